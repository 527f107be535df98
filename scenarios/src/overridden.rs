//! Settings of the command line that weaken the criteria of a scenario.
//!
//! `--set` may change every value. If a setting removes a check, moves its bound to the easier
//! side, or asks for less to happen, the judged scenario differs from the scenario of the file. The
//! text of the scenario then lists the weakened criteria under the key `overridden`. A saved
//! campaign, a part of a campaign and a replay keep the text, and so the list.

use super::ScenarioConfig;
use crate::coverage::{Bin, CoverageConfig};
use crate::criteria::{Expression, GateConfig};

/// The key under which the text lists the weakened criteria.
pub(super) const KEY: &str = "overridden";

/// The entry for a weakened coverage plan. It matters only if a gate asks for coverage, in the
/// scenario file, in a project file or on the command line.
pub const COVERAGE: &str = "what is to be covered";

/// Returns the criteria of `before` that `after` weakens, in words.
pub(super) fn weakened(before: &ScenarioConfig, after: &ScenarioConfig) -> Vec<String> {
    let mut weakened = before.overridden.clone();
    for (requirement, checks) in &before.checks {
        let new_checks = after.checks.get(requirement).map_or(&[][..], Vec::as_slice);
        let is_kept = |old: &Expression| new_checks.iter().any(|new| new.is_as_strict_as(old));
        weakened.extend(checks.iter().filter(|old| !is_kept(old)).map(|old| format!("{requirement}: {old}")));
    }
    let is_gate_kept = |old: &&Expression| after.gate.require.iter().any(|new| new.is_as_strict_as(old));
    weakened.extend(before.gate.require.iter().filter(|old| !is_gate_kept(old)).map(|old| format!("gate {old}")));
    weakened.extend(weaker_probability(&before.gate, &after.gate));
    let requirements = before.requirements.iter().filter(|requirement| !after.requirements.contains(requirement));
    weakened.extend(requirements.map(|requirement| format!("requirement {requirement}")));
    weakened.extend((after.function != before.function).then(|| format!("function {}", before.function.name())));
    let expects = before.expects.iter().filter(|flag| !after.expects.contains(flag));
    weakened.extend(expects.map(|flag| format!("expects {}", flag.measure().name)));
    // A share that is NaN is weaker than any number, so the comparison must fail for NaN.
    let is_share_kept = after.expects_share >= before.expects_share || before.expects.is_empty();
    weakened.extend((!is_share_kept).then(|| format!("expects-share {}", before.expects_share)));
    let is_named = weakened.iter().any(|weakening| weakening == COVERAGE);
    weakened.extend((!is_named && covered(before) != covered(after)).then(|| COVERAGE.to_owned()));
    let observed = before.parameters.0.iter().filter(|(name, parameter)| {
        let kept = after.parameters.0.get(name).and_then(|parameter| parameter.observed.as_ref());
        parameter.observed.is_some() && kept.is_some_and(|kept| Some(kept) != parameter.observed.as_ref())
    });
    weakened.extend(observed.map(|(name, _)| format!("observed range of {name}")));
    weakened
}

/// Returns what the samples are to cover: the table, and the bins of its items. The bins also
/// depend on the labels of the parameters. Returns `None` for an empty table.
fn covered(config: &ScenarioConfig) -> Option<(&CoverageConfig, Vec<Vec<Bin>>)> {
    let bins = || {
        let space = config.parameters.check().ok()?;
        let plan = config.coverage.check(&space).ok()?;
        Some(plan.items.into_iter().map(|item| item.bins).collect())
    };
    (!config.coverage.is_empty()).then(|| (&config.coverage, bins().unwrap_or_default()))
}

/// Returns the bound of `before` on the probability of a collision if the bound of `after` is
/// higher, absent, or of lower confidence.
fn weaker_probability(before: &GateConfig, after: &GateConfig) -> Option<String> {
    let max = before.max_probability?;
    let confidence = |gate: &GateConfig| gate.confidence.unwrap_or(GateConfig::CONFIDENCE);
    let is_kept = after.max_probability.is_some_and(|new| new <= max) && confidence(after) >= confidence(before);
    (!is_kept).then(|| format!("gate max-probability {max}"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::{ScenarioFile, library};

    fn overridden(settings: &[&str]) -> Vec<String> {
        let settings: Vec<_> = settings.iter().map(|text| text.parse().unwrap()).collect();
        let text = library::text("low-thw-overtake").unwrap();
        let text = text.replacen("\nduration-s", "\nexpects-share = 0.95\nfunction = \"mis\"\nduration-s", 1);
        let file = ScenarioFile::parse(Path::new("a.toml"), &text, &settings).unwrap();
        // What a saved campaign reads is the text.
        let again = ScenarioFile::parse(Path::new("a.toml"), file.text(), &[]).unwrap();
        assert_eq!(again.config(), file.config());
        file.config().overridden.clone()
    }

    #[test]
    fn a_check_that_a_setting_weakens_is_named() {
        for (setting, part) in [
            ("checks.MIS-1=['lower(prevented | baseline.ego_collided) >= 0.1']", "MIS-1: lower(prevented"),
            ("checks.MIS-1=['share(prevented | baseline.ego_collided) >= 0.5']", "MIS-1: lower(prevented"),
            ("checks.MIS-2=[]", "MIS-2: upper(induced) <= 0.03"),
            ("checks.MIS-2=['upper(induced) <= 0.03']", "MIS-2: upper(others_collided_alone)"),
            ("requirements=[]", "requirement MIS-1"),
            ("function=aeb", "function mis"),
            ("expects=['lead_braked']", "expects rear_near"),
            ("expects-share=0.1", "expects-share 0.95"),
            ("parameters.closing-mps.observed.max=14", "observed range of closing-mps"),
        ] {
            let weakenings = overridden(&[setting]);
            assert!(weakenings.iter().any(|weakening| weakening.starts_with(part)), "{setting}: {weakenings:?}");
        }
    }

    #[test]
    fn a_setting_that_changes_what_is_to_be_covered_is_named_whoever_asks_for_it() {
        let coverage = "[coverage.item.closing]\nparameter = 'closing-mps'\nedges = [2, 8, 14]\n\n\
                        [coverage.item.class]\nparameter = 'rear-class'\n\n[parameters]";
        let text = library::text("low-thw-overtake").unwrap().replacen("[parameters]", coverage, 1);
        let overridden = |settings: &[&str]| {
            let settings: Vec<_> = settings.iter().map(|text| text.parse().unwrap()).collect();
            ScenarioFile::parse(Path::new("a.toml"), &text, &settings).unwrap().config().overridden.clone()
        };
        for settings in [
            &["coverage.item.closing.edges=[2, 14]"][..],
            &["coverage.item.class.labels=['car']"],
            &["coverage.item.closing.at-least=2", "duration-s=30"],
            // The bins of a parameter with labels are its labels.
            &["rear-class=car"],
        ] {
            assert_eq!(overridden(settings), [super::COVERAGE], "{settings:?}");
        }
        for setting in ["duration-s=30", "parameters.closing-mps.uniform.min=3"] {
            assert_eq!(overridden(&[setting]), Vec::<String>::new(), "{setting}");
        }
    }

    #[test]
    fn a_gate_of_the_file_that_a_setting_weakens_is_named() {
        let overridden = |setting: &str| {
            let gate = "[gate]\nrequire = ['count(ego_collided) <= 0']\nmax-probability = 0.01\n\n[parameters]";
            let text = library::text("low-thw-overtake").unwrap().replacen("[parameters]", gate, 1);
            let file = ScenarioFile::parse(Path::new("a.toml"), &text, &[setting.parse().unwrap()]).unwrap();
            file.config().overridden.clone()
        };
        let (count, probability) = ("gate count(ego_collided) <= 0", "gate max-probability 0.01");
        for (setting, expected) in [
            ("gate={}", &[count, probability][..]),
            ("gate.require=[]", &[count][..]),
            ("gate.require=['count(ego_collided) <= 60']", &[count][..]),
            ("gate.max-probability=0.1", &[probability][..]),
            ("gate.confidence=0.6", &[probability][..]),
            ("gate.max-probability=0.001", &[][..]),
            ("gate.confidence=0.99", &[][..]),
            ("duration-s=30", &[][..]),
        ] {
            assert_eq!(overridden(setting), expected, "{setting}");
        }
    }

    #[test]
    fn a_check_that_a_setting_leaves_or_tightens_is_not() {
        for setting in
            ["duration-s=30", "expects-share=0.99", "checks.MIS-1=['lower(prevented | baseline.ego_collided) >= 0.6']"]
        {
            assert_eq!(overridden(&[setting]), Vec::<String>::new(), "{setting}");
        }
    }
}
