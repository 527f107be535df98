//! The result of a calibration: as text, as JSON, and as a member of a driver ensemble.

use closecall_recorded::following::FollowingData;
use closecall_simulation::calibration::{Calibration, Errors, ParameterSpec};
use closecall_traffic::statistics::format::percent;
use closecall_traffic::statistics::quantiles::quantile;
use serde_json::{Map, Value, json};

/// Probabilities of the quantiles over the calibrated pairs (-).
const PROBABILITIES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Published results, for comparison.
const LITERATURE: &str = "Kesting and Treiber, Transportation Research Record 2088 (2008): relative errors of 11 to 29 % for several \
                          models. Zhu et al., Transportation Research Part C 93 (2018) 425-445: of five models the \
                          Intelligent Driver Model follows best, Wiedemann 99 is harder to calibrate";

/// Returns the quantiles of one parameter over the calibrated pairs.
fn quantiles_of(calibration: &Calibration, index: usize) -> [f64; 5] {
    let mut values: Vec<f64> = calibration.pairs.iter().filter_map(|pair| pair.values.get(index).copied()).collect();
    values.sort_by(f64::total_cmp);
    PROBABILITIES.map(|u| quantile(&values, u))
}

fn parameters(calibration: &Calibration) -> impl Iterator<Item = (&'static ParameterSpec, f64, [f64; 5])> + '_ {
    let specs = calibration.model.parameters().iter().enumerate();
    specs.zip(&calibration.pooled).map(|((index, spec), pooled)| (spec, *pooled, quantiles_of(calibration, index)))
}

/// Distance from an end of the searched range from which on a value lies in it, as a share of the
/// range (-): numerical.
const AT_LIMIT: f64 = 1e-3;

/// Returns the ends of the searched range of a parameter at which the pooled value or values of
/// single pairs lie, in words; nothing if there are none. The best value may lie beyond such an
/// end.
fn at_limits(calibration: &Calibration, index: usize) -> Option<String> {
    let spec = calibration.model.parameters().get(index)?;
    let near = AT_LIMIT * (spec.max - spec.min);
    let all = calibration.pairs.len();
    let end = |(name, limit): (&str, f64)| {
        let is_at = |values: &[f64]| values.get(index).is_some_and(|value| (value - limit).abs() <= near);
        let pooled = is_at(&calibration.pooled).then(|| "pooled".to_owned());
        let single = calibration.pairs.iter().filter(|pair| is_at(&pair.values)).count();
        let single = (single > 0).then(|| format!("{single} of {all} pairs"));
        let who: Vec<String> = pooled.into_iter().chain(single).collect();
        (!who.is_empty()).then(|| format!("{name} limit {limit}: {}", who.join(", ")))
    };
    let ends: Vec<String> = [("lower", spec.min), ("upper", spec.max)].into_iter().filter_map(end).collect();
    (!ends.is_empty()).then(|| format!("at the {}", ends.join("; at the ")))
}

/// Returns the end of the searched range at which the pooled value lies, as the end of a sentence.
fn pooled_limit(spec: &ParameterSpec, pooled: f64) -> String {
    let near = AT_LIMIT * (spec.max - spec.min);
    let ends = [("lower", spec.min), ("upper", spec.max)];
    let end = ends.into_iter().find(|(_, limit)| (pooled - limit).abs() <= near);
    end.map_or_else(String::new, |(name, limit)| {
        format!("; the value is the {name} limit of the search, {limit}, and the best one may lie beyond")
    })
}

/// Returns why no pair is left to calibrate.
pub fn no_pair(data: &FollowingData) -> String {
    let reasons = data.left_out.iter().take(3).map(|pair| format!("{}: {}", pair.name, pair.reason));
    let reasons: Vec<String> = reasons.collect();
    format!(
        "no pair is left to calibrate: {} can be used, but the hash of the name holds some out, and {} are left out ({})",
        data.pairs.len(),
        data.left_out.len(),
        reasons.join("; ")
    )
}

/// Returns the result as lines of text.
pub fn text(calibration: &Calibration, data: &FollowingData) -> String {
    let mut text = format!(
        "{}: {} pairs calibrated, {} held out, {} left out\n",
        calibration.model.name(),
        calibration.pairs.len(),
        calibration.held_out.len(),
        data.left_out.len()
    );
    for left_out in &data.left_out {
        text.push_str(&format!("  left out: {}: {}\n", left_out.name, left_out.reason));
    }
    text.push_str(&format!("{:<26} {:>8}   {}\n", "parameter", "pooled", "single pairs: 5, 25, 50, 75, 95 %"));
    for (index, (spec, pooled, quantiles)) in parameters(calibration).enumerate() {
        let quantiles: Vec<String> = quantiles.iter().map(|value| format!("{value:>8.3}")).collect();
        text.push_str(&format!("{:<26} {pooled:>8.3}   {}\n", spec.key, quantiles.join(" ")));
        if let Some(limits) = at_limits(calibration, index) {
            text.push_str(&format!("  {limits}; the best value may lie beyond\n"));
        }
    }
    text.push_str("spacing error                  pairs   RMSE (m)   relative\n");
    let mut line = |name: &str, errors: Errors| {
        text.push_str(&format!(
            "{name:<30} {:>5}   {:>8.3}   {:>8}\n",
            errors.pairs,
            errors.rmse_m,
            percent(errors.relative)
        ));
    };
    line("single sets, own pairs", calibration.errors_of_single);
    line("pooled set, calibration pairs", calibration.errors_of_pooled);
    if let Some(held_out) = calibration.errors_of_held_out {
        line("pooled set, held-out pairs", held_out);
    }
    text.push_str(&format!("literature: {LITERATURE}\n"));
    if let Some(predictive) = &calibration.predictive {
        let shown = |values: [f64; 5]| values.map(|value| format!("{value:.2}")).join(", ");
        text.push_str(&format!(
            "predictive check on held-out pairs, {} drivers: time headway at 5, 25, 50, 75, 95 % recorded {} s, simulated {} s; \
             the 90 % band of the gap covers {} of the instants\n",
            predictive.drivers,
            shown(predictive.recorded_s),
            shown(predictive.simulated_s),
            percent(predictive.coverage),
        ));
    }
    text
}

/// Returns the result as JSON.
pub fn json(calibration: &Calibration, data: &FollowingData) -> Value {
    let errors =
        |errors: &Errors| json!({ "pairs": errors.pairs, "rmse_m": errors.rmse_m, "relative": errors.relative });
    let keys: Vec<&str> = calibration.model.parameters().iter().map(|spec| spec.key).collect();
    let values = |values: &[f64]| -> Map<String, Value> {
        keys.iter().zip(values).map(|(key, value)| ((*key).to_owned(), json!(value))).collect()
    };
    let limits: Map<String, Value> = keys
        .iter()
        .enumerate()
        .filter_map(|(index, key)| Some(((*key).to_owned(), json!(at_limits(calibration, index)?))))
        .collect();
    let pairs: Vec<Value> = calibration
        .pairs
        .iter()
        .map(|pair| json!({ "pair": pair.name, "rmse_m": pair.rmse_m, "parameters": values(&pair.values) }))
        .collect();
    let predictive = calibration.predictive.as_ref().map(|predictive| {
        json!({
            "drivers": predictive.drivers,
            "probabilities": predictive.probabilities,
            "recorded_headway_s": predictive.recorded_s,
            "simulated_headway_s": predictive.simulated_s,
            "coverage_of_90_percent_band": predictive.coverage,
        })
    });
    let files: Vec<Value> = data
        .files
        .iter()
        .map(|file| json!({ "path": file.path.display().to_string(), "blake3": file.blake3 }))
        .collect();
    json!({
        "model": calibration.model.name(),
        "files": files,
        "pooled": values(&calibration.pooled),
        "at_limits": limits,
        "pairs": pairs,
        "held_out": calibration.held_out,
        "left_out": data.left_out.iter().map(|pair| json!({ "pair": pair.name, "reason": pair.reason })).collect::<Vec<_>>(),
        "errors": {
            "single_sets_own_pairs": errors(&calibration.errors_of_single),
            "pooled_calibration_pairs": errors(&calibration.errors_of_pooled),
            "pooled_held_out_pairs": calibration.errors_of_held_out.as_ref().map(errors),
        },
        "literature": LITERATURE,
        "predictive": predictive,
    })
}

/// Returns a member of a driver ensemble with the pooled parameters, as the text of its file. It
/// leaves headway and desired speed to the scenario, which has the values of the recorded traffic.
pub fn member(calibration: &Calibration, data: &FollowingData, command: &str) -> String {
    let model = calibration.model.name();
    let files: Vec<String> = data
        .files
        .iter()
        .map(|file| {
            let name = file.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            format!("{name} (blake3 {})", &file.blake3[..16.min(file.blake3.len())])
        })
        .collect();
    let source = format!(
        "{command}: {} pairs of {}, RMSE of the gap {:.2} m, on {} held-out pairs {}",
        calibration.pairs.len(),
        files.join(", "),
        calibration.errors_of_pooled.rmse_m,
        calibration.held_out.len(),
        calibration.errors_of_held_out.map_or_else(|| "-".to_owned(), |errors| format!("{:.2} m", errors.rmse_m)),
    );
    let quoted = |text: &str| json!(text).to_string();
    let mut text = format!(
        "schema-version = 1\nname = \"calibrated-{model}\"\ndescription = {}\nfollow = {{ model = \"{model}\", source = {} }}\n",
        quoted("Drivers who follow as in recorded traffic, with one set of parameters for all."),
        quoted(&source),
    );
    for (spec, pooled, _) in parameters(calibration).filter(|(spec, ..)| !spec.is_of_traffic) {
        text.push_str(&format!(
            "\n[[set]]\nkey = \"{}\"\nvalue = {pooled:.4}\nsource = {}\n",
            spec.key,
            quoted(&format!("{source}{}", pooled_limit(spec, pooled)))
        ));
    }
    text.push_str("\n[calibration] # figures for the reader: 5, 25, 50, 75, 95 % over the single pairs\n");
    for (index, (spec, pooled, quantiles)) in parameters(calibration).enumerate() {
        let quantiles = quantiles.map(|value| format!("{value:.3}")).join(", ");
        let limits = at_limits(calibration, index).map_or_else(String::new, |limits| format!(" # {limits}"));
        text.push_str(&format!("{} = {{ pooled = {pooled:.4}, quantiles = [{quantiles}] }}{limits}\n", spec.key));
    }
    text
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::member::Member;
    use closecall_simulation::calibration::{FollowingModel, PairResult};

    use super::*;

    #[test]
    fn the_member_is_one_that_the_ensemble_takes_and_leaves_the_headway_alone() {
        let errors = Errors { pairs: 2, rmse_m: 2.5, relative: 0.15 };
        let values = vec![30.0, 1.25, 2.0, 1.1, 1.8];
        let pair = |name: &str| PairResult { name: name.to_owned(), values: values.clone(), rmse_m: 2.5 };
        let calibration = Calibration {
            model: FollowingModel::Idm,
            pairs: vec![pair("a"), pair("b")],
            held_out: vec!["c".to_owned()],
            pooled: values.clone(),
            errors_of_single: errors,
            errors_of_pooled: errors,
            errors_of_held_out: Some(Errors { rmse_m: 3.25, ..errors }),
            predictive: None,
        };
        let data = FollowingData::default();
        let member = Member::parse("m.toml".as_ref(), &member(&calibration, &data, "closecall")).unwrap();
        assert_eq!(member.name(), "calibrated-idm");
        let sets: Vec<String> = member.values().into_iter().map(|(set, _)| set).collect();
        assert_eq!(sets, ["follow = idm", "acceleration-mps2 = 1.1", "comfortable-braking-mps2 = 1.8"]);
        assert!(text(&calibration, &data).contains("pooled set, held-out pairs         2      3.250       15 %"));
        assert_eq!(json(&calibration, &data)["errors"]["pooled_held_out_pairs"]["rmse_m"], 3.25);
        assert!(!text(&calibration, &data).contains("limit"));
    }

    #[test]
    fn a_value_at_an_end_of_the_search_is_marked_in_every_output() {
        let errors = Errors { pairs: 1, rmse_m: 2.5, relative: 0.15 };
        let pair = |acceleration_mps2| {
            let values = vec![30.0, 1.25, 2.0, acceleration_mps2, 1.8];
            PairResult { name: "a".to_owned(), values, rmse_m: 2.5 }
        };
        let calibration = Calibration {
            model: FollowingModel::Idm,
            pairs: vec![pair(5.9999), pair(1.2), pair(6.0)],
            held_out: Vec::new(),
            pooled: vec![30.0, 1.25, 0.1, 6.0, 1.8],
            errors_of_single: errors,
            errors_of_pooled: errors,
            errors_of_held_out: None,
            predictive: None,
        };
        let data = FollowingData::default();
        let shown = text(&calibration, &data);
        assert!(shown.contains("  at the lower limit 0.1: pooled; the best value may lie beyond\n"), "{shown}");
        assert!(
            shown.contains("  at the upper limit 6: pooled, 2 of 3 pairs; the best value may lie beyond\n"),
            "{shown}"
        );
        let member = member(&calibration, &data, "closecall");
        assert!(member.contains("the value is the upper limit of the search, 6,"), "{member}");
        assert!(member.contains("# at the lower limit 0.1: pooled\n"), "{member}");
        assert_eq!(member.matches("limit of the search").count(), 1, "{member}");
        Member::parse("m.toml".as_ref(), &member).unwrap();
        let limits = json!({
            "standstill-gap-m": "at the lower limit 0.1: pooled",
            "acceleration-mps2": "at the upper limit 6: pooled, 2 of 3 pairs",
        });
        assert_eq!(json(&calibration, &data)["at_limits"], limits);
    }
}
