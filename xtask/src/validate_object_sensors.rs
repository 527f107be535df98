//! Compares the verdicts of the object-level sensors with the verdicts of the full chain, sample by
//! sample.
//!
//!     cargo run --release -p closecall-xtask -- validate-object-sensors -n 1000
//!
//! Prints Cohen's κ and the collision rates in clear air, rain (10 mm/h), fog (visibility 100 m)
//! and at night, and lists every sample on which the modes differ with its reason. The exit code is
//! 1 in three cases: some κ is below 0.8, or undefined because no run or every run collides; rates
//! differ by more than 2 percentage points; no condition has the given name. A thousand samples
//! take about half an hour on two cores.
#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::fmt::{self, Display, Formatter};
use std::path::Path;
use std::process::ExitCode;

use closecall::scenarios::source;
use closecall_studies::perception::agreement::Agreement;

/// The weather: its name and its settings.
const CONDITIONS: [(&str, &[&str]); 4] = [
    ("clear air", &[]),
    ("rain, 10 mm/h", &["environment.rain-mm-per-h=10"]),
    ("fog, 100 m", &["environment.visibility-m=100"]),
    ("night", &["environment.light=\"night\""]),
];
/// Least agreement and largest difference of the rates that are asked for.
const MIN_KAPPA: f64 = 0.8;
const MAX_DIFFERENCE: f64 = 0.02;

/// Compares the object-level sensors with the full chain.
/// What the command line says.
#[derive(clap::Parser)]
pub(crate) struct Args {
    /// The scenario: a name of the library, or a file
    #[arg(default_value = "low-thw-overtake")]
    scenario: String,
    /// Number of samples in each condition
    #[arg(short = 'n', long, default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(1..))]
    samples: u64,
    /// The seed
    #[arg(long, default_value_t = 2026)]
    seed: u64,
    /// Only the conditions whose names contain this text, such as `fog`
    #[arg(long, default_value = "")]
    condition: String,
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Box<dyn std::error::Error>> {
    let comparison = compare(&args)?;
    print!("{comparison}");
    Ok(if comparison.agrees() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The agreement in one condition.
struct Compared {
    name: &'static str,
    agreement: Agreement,
}

/// The agreement in each condition.
struct Comparison {
    scenario: String,
    samples: u64,
    seed: u64,
    conditions: Vec<Compared>,
}

/// Compares the verdicts in each condition that is asked for.
///
/// # Errors
/// If no condition has such a name, the scenario cannot be read, or a run fails.
fn compare(args: &Args) -> Result<Comparison, Box<dyn std::error::Error>> {
    let wanted = CONDITIONS.into_iter().filter(|(name, _)| name.contains(&args.condition));
    let mut conditions = Vec::new();
    for (name, settings) in wanted {
        let settings = settings.iter().map(|text| text.parse()).collect::<Result<Vec<_>, _>>()?;
        let file = source::load(Path::new(&args.scenario), &settings)?;
        conditions.push(Compared { name, agreement: Agreement::of(&file, args.seed, args.samples)? });
    }
    if conditions.is_empty() {
        let names = CONDITIONS.map(|(name, _)| name).join("`, `");
        return Err(
            format!("--condition is `{}`, which is part of no name; the names are `{names}`", args.condition).into()
        );
    }
    let Args { samples, seed, .. } = *args;
    Ok(Comparison { scenario: args.scenario.clone(), samples, seed, conditions })
}

impl Compared {
    /// Returns whether the verdicts agree. Without κ, chance alone explains them, and nothing is
    /// known.
    fn agrees(&self) -> bool {
        let [object, full] = self.agreement.rates();
        self.agreement.kappa().is_some_and(|kappa| kappa >= MIN_KAPPA) && (object - full).abs() <= MAX_DIFFERENCE
    }
}

impl Comparison {
    /// Returns whether something was compared, and agrees in each condition.
    fn agrees(&self) -> bool {
        let is_compared = |condition: &Compared| !condition.agreement.pairs.is_empty();
        !self.conditions.is_empty()
            && self.conditions.iter().all(|condition| is_compared(condition) && condition.agrees())
    }
}

impl Display for Comparison {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { scenario, samples, seed, .. } = self;
        writeln!(f, "{scenario}, {samples} samples, seed {seed}")?;
        for Compared { name, agreement } in &self.conditions {
            let [object, full] = agreement.rates().map(|rate| 100.0 * rate);
            let kappa = agreement.kappa();
            let kappa = kappa.map_or_else(|| "undefined".to_owned(), |kappa| format!("{kappa:.3}"));
            let differ = agreement.pairs.iter().filter(|pair| pair.differs()).count();
            writeln!(f, "{name}: kappa {kappa}, collisions {object:.1} % object, {full:.1} % full, {differ} differ")?;
        }
        for Compared { name, agreement } in &self.conditions {
            for pair in agreement.pairs.iter().filter(|pair| pair.differs()) {
                let rear =
                    pair.rear.map_or_else(String::new, |(class, paint)| format!("{}, paint {paint:.2}", class.name()));
                let only = if pair.object.has_collided { "object" } else { "full" };
                let (sample, reason) = (pair.sample, pair.reason());
                writeln!(f, "{name}, sample {sample}: collides with {only} only; {rear}; {reason}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use closecall_studies::perception::agreement::{Pair, Verdict};

    use super::*;

    fn args(more: &[&str]) -> Args {
        Args::parse_from(["validate-object-sensors"].iter().chain(more))
    }

    #[test]
    fn a_condition_is_compared_and_each_differing_sample_listed() {
        let comparison = compare(&args(&["-n", "24", "--condition", "fog"])).unwrap();
        let text = comparison.to_string();
        assert_eq!(comparison.conditions.len(), 1);
        assert!(text.contains("fog, 100 m: kappa ") && !text.contains("undefined"), "{text}");
        let differ = comparison.conditions[0].agreement.pairs.iter().filter(|pair| pair.differs()).count();
        assert_eq!(text.matches(", sample ").count(), differ, "{text}");
    }

    #[test]
    fn an_unknown_condition_is_answered_with_the_names() {
        let message = compare(&args(&["--condition", "nihgt"])).err().unwrap().to_string();
        assert!(
            message.contains("`nihgt`") && message.contains("`rain, 10 mm/h`") && message.contains("`night`"),
            "{message}"
        );
        assert!(Args::try_parse_from(["validate-object-sensors", "-n", "0"]).is_err());
    }

    #[test]
    fn agreement_by_chance_or_without_a_comparison_does_not_count() {
        let verdict =
            |has_collided| Verdict { has_collided, engaged_at_s: None, released_at_s: None, min_gap_rear_m: None };
        let pair = |object, full| Pair { sample: 0, rear: None, object: verdict(object), full: verdict(full) };
        let comparison = |conditions: &[&[Pair]]| Comparison {
            scenario: String::new(),
            samples: 0,
            seed: 0,
            conditions: conditions
                .iter()
                .map(|pairs| Compared { name: "night", agreement: Agreement { pairs: pairs.to_vec() } })
                .collect(),
        };
        assert!(comparison(&[&[pair(true, true), pair(false, false)]]).agrees());
        assert!(!comparison(&[&[pair(false, false)]]).agrees(), "no run collides");
        assert!(!comparison(&[&[pair(true, true)]]).agrees(), "every run collides");
        assert!(
            !comparison(&[&[pair(true, true), pair(false, false)], &[]]).agrees(),
            "no sample in the second condition"
        );
        assert!(!comparison(&[]).agrees(), "no condition");
        assert!(!comparison(&[&[pair(true, false), pair(false, true)]]).agrees());
    }
}
