//! Puts the distributions of an OpenSCENARIO file into a scenario file that Closecall wrote.

use std::collections::BTreeSet;
use std::path::Path;

use toml_edit::{Array, DocumentMut, InlineTable, Item, TableLike, Value};

use super::dom::ImportError;
use super::stochastic::{Marginal, Stochastic};
use crate::ScenarioFile;
use crate::parameters::{Distribution, ParameterConfig};

/// The keys of a parameter that state its distribution or its origin.
const REPLACED: [&str; 8] =
    ["uniform", "truncated-normal", "log-normal", "choice", "empirical", "fixed", "fitted", "assumed"];
/// Relative difference of two numbers that are the same but for rounding: numerical.
const SAME: f64 = 1e-9;

/// Returns the text of a scenario file with the distributions of another file, and notes on what
/// became of them. A parameter that has the same distribution already keeps its text. `source`
/// names the other file, for its errors and for the reader of the scenario file.
///
/// # Errors
/// [`ImportError`] at a distribution whose parameter the scenario does not have, or that no
/// parameter of a scenario file can have.
pub(super) fn with_distributions(
    file: &ScenarioFile,
    stochastic: &Stochastic,
    source: &Path,
) -> Result<(String, Vec<String>), ImportError> {
    let error = |line: usize, element: &str, message: String| ImportError {
        path: source.to_owned(),
        line,
        element: element.to_owned(),
        message,
    };
    let mut document: DocumentMut = file
        .text()
        .parse()
        .map_err(|problem: toml_edit::TomlError| error(1, "ScenarioFile", problem.message().to_owned()))?;
    let mut notes = stochastic.notes.clone();
    let parameters = &file.config().parameters.0;
    for marginal in &stochastic.marginals {
        let refuse = |message: String| error(marginal.line, &marginal.element, message);
        let name = marginal.name.replace('_', "-");
        let Some((parameter, entry)) = file.space().iter().find(|(parameter, _)| parameter.as_str() == name) else {
            let names: Vec<_> =
                file.space().iter().map(|(parameter, _)| parameter.as_str().replace('-', "_")).collect();
            return Err(refuse(format!("there is no parameter `{}`, only {}", marginal.name, names.join(", "))));
        };
        let has_labels = !entry.distribution.labels().is_empty();
        let config = marginal.config(has_labels).map_err(|message| refuse(format!("`{name}`: {message}")))?;
        let checked = config.check().map_err(|problem| refuse(format!("`{name}`: {problem}")))?;
        let before = parameters.get(parameter).and_then(|before| Form::new(before, &entry.distribution));
        let after = Form::new(&config, &checked.distribution);
        if before.zip(after).is_some_and(|(before, after)| before.is_same(&after)) {
            continue;
        }
        let table = parameter_table(&mut document, &name)
            .ok_or_else(|| refuse(format!("`{name}` is no table of the scenario file")))?;
        put(table, marginal, &config);
        let origin = format!("{} of {}", marginal.element, source.display());
        table.insert("assumed", Item::Value(origin.into()));
        notes.push(format!("`{name}` has the `{}` of line {}", marginal.element, marginal.line));
    }
    let stated: BTreeSet<String> =
        stochastic.marginals.iter().map(|marginal| marginal.name.replace('_', "-")).collect();
    let others: Vec<_> = parameters.keys().map(|name| name.as_str()).filter(|name| !stated.contains(*name)).collect();
    if !others.is_empty() {
        notes.push(format!(
            "no distribution is stated for {}: the distribution of the scenario stays",
            others.join(", ")
        ));
    }
    if parameters.values().any(|config| !config.spearman.is_empty()) {
        notes
            .push("the rank correlations of the scenario stay: the file of distributions cannot state them".to_owned());
    }
    Ok((document.to_string(), notes))
}

fn parameter_table<'a>(document: &'a mut DocumentMut, name: &str) -> Option<&'a mut dyn TableLike> {
    document.get_mut("parameters")?.as_table_like_mut()?.get_mut(name)?.as_table_like_mut()
}

/// Replaces the distribution of a parameter, and leaves its other keys.
fn put(table: &mut dyn TableLike, marginal: &Marginal, config: &ParameterConfig) {
    for key in REPLACED {
        table.remove(key);
    }
    if let Some((key, value)) = distribution(config) {
        table.insert(key, Item::Value(value));
    }
    debug_assert!(REPLACED.iter().any(|key| table.contains_key(key)), "{}", marginal.name);
}

/// Returns the distribution of a parameter with its key; `None` if it has none.
fn distribution(config: &ParameterConfig) -> Option<(&'static str, Value)> {
    if let Some(uniform) = &config.uniform {
        return Some(("uniform", numbers(&[("min", Some(uniform.min)), ("max", Some(uniform.max))])));
    }
    if let Some(normal) = &config.truncated_normal {
        let [mean, sd, min, max] = [normal.mean, normal.sd, normal.min, normal.max].map(Some);
        return Some(("truncated-normal", numbers(&[("mean", mean), ("sd", sd), ("min", min), ("max", max)])));
    }
    if let Some(log_normal) = &config.log_normal {
        let [median, sigma] = [log_normal.median, log_normal.sigma].map(Some);
        let cut = [("median", median), ("sigma", sigma), ("min", log_normal.min), ("max", log_normal.max)];
        return Some(("log-normal", numbers(&cut)));
    }
    if let Some(weights) = &config.choice {
        let weights = weights.iter().map(|(label, weight)| (label.as_str(), *weight));
        return Some(("choice", Value::InlineTable(InlineTable::from_iter(weights))));
    }
    if let Some(empirical) = &config.empirical {
        let quantiles = Value::Array(Array::from_iter(empirical.quantiles.iter().copied()));
        return Some(("empirical", Value::InlineTable(InlineTable::from_iter([("quantiles", quantiles)]))));
    }
    let value = match config.fixed.as_ref()? {
        closecall_traffic::Value::Number(number) => Value::from(*number),
        closecall_traffic::Value::Label(label) => Value::from(label.as_str()),
    };
    Some(("fixed", value))
}

fn numbers(keys: &[(&'static str, Option<f64>)]) -> Value {
    let present = keys.iter().filter_map(|(key, value)| Some((*key, (*value)?)));
    Value::InlineTable(InlineTable::from_iter(present))
}

/// What two distributions are compared by.
#[derive(Clone, Debug)]
struct Form {
    key: &'static str,
    labels: Vec<String>,
    numbers: Vec<f64>,
}

impl Form {
    /// Returns the form of a distribution, whose checked form stands with it; `None` if the
    /// parameter has none.
    fn new(config: &ParameterConfig, checked: &Distribution) -> Option<Self> {
        let key;
        let (mut labels, mut numbers): (Vec<String>, Vec<f64>) = (Vec::new(), Vec::new());
        if let Some(uniform) = &config.uniform {
            (key, numbers) = ("uniform", vec![uniform.min, uniform.max]);
        } else if let Some(normal) = &config.truncated_normal {
            (key, numbers) = ("truncated-normal", vec![normal.mean, normal.sd, normal.min, normal.max]);
        } else if let Some(log_normal) = &config.log_normal {
            // If nothing truncates it, the file of distributions can state the end of its
            // probability.
            let [_, high] = checked.bounds()?;
            (key, numbers) =
                ("log-normal", vec![log_normal.median, log_normal.sigma, log_normal.min.unwrap_or_default(), high]);
        } else if let Some(weights) = &config.choice {
            // Weights need not add up to 1, and a weight of 0 is none.
            let total: f64 = weights.values().sum();
            let possible = weights.iter().filter(|(_, weight)| **weight > 0.0);
            (labels, numbers) = possible.map(|(label, weight)| (label.clone(), weight / total)).unzip();
            key = "choice";
        } else if let Some(empirical) = &config.empirical {
            (key, numbers) = ("empirical", empirical.quantiles.clone());
        } else {
            match config.fixed.as_ref()? {
                closecall_traffic::Value::Number(number) => numbers.push(*number),
                closecall_traffic::Value::Label(label) => labels.push(label.clone()),
            }
            key = "fixed";
        }
        Some(Self { key, labels, numbers })
    }

    /// Returns whether two distributions are the same but for rounding.
    fn is_same(&self, other: &Self) -> bool {
        let are_near = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME * a.abs().max(b.abs());
        self.key == other.key
            && self.labels == other.labels
            && self.numbers.len() == other.numbers.len()
            && self.numbers.iter().zip(&other.numbers).all(are_near)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::parameters::{LogNormalConfig, TruncatedNormalConfig};

    #[test]
    fn each_distribution_is_written_as_the_scenario_file_reads_it() {
        let none = ParameterConfig::default;
        let normal = TruncatedNormalConfig { mean: 0.7, sd: 0.15, min: 0.5, max: 0.9 };
        let log_normal = LogNormalConfig { median: 1.25, sigma: 0.3, min: None, max: Some(2.5) };
        let configs = [
            ParameterConfig::uniform(30.0, 33.2),
            ParameterConfig { truncated_normal: Some(normal), ..none() },
            ParameterConfig { log_normal: Some(log_normal), ..none() },
            ParameterConfig { choice: Some(BTreeMap::from([("a \"b\"".to_owned(), 0.5)])), ..none() },
            ParameterConfig::empirical(vec![1.0, 1.5, 1.5, 1.0 / 3.0 + 2.0]),
            ParameterConfig::fixed(closecall_traffic::Value::Number(6.0)),
            ParameterConfig::fixed(closecall_traffic::Value::Label("van".to_owned())),
        ];
        for config in configs {
            let (key, value) = distribution(&config).unwrap();
            let read: ParameterConfig = toml::from_str(&format!("{key} = {value}")).unwrap();
            assert_eq!(read, config);
        }
        assert!(distribution(&none()).is_none());
    }

    #[test]
    fn distributions_are_the_same_but_for_rounding() {
        let is_same = |a: &ParameterConfig, b: &ParameterConfig| {
            let [a, b] = [a, b].map(|config| Form::new(config, &config.check().unwrap().distribution).unwrap());
            a.is_same(&b)
        };
        let uniform = |max: f64| ParameterConfig::uniform(1.0, max);
        assert!(is_same(&uniform(2.0), &uniform(2.0 + 1e-12)));
        assert!(!is_same(&uniform(2.0), &uniform(2.0 + 1e-6)));
        assert!(!is_same(&uniform(2.0), &ParameterConfig::empirical(vec![1.0, 1.6, 2.0])));
        let choice = |car: f64| ParameterConfig {
            choice: Some(BTreeMap::from([("car".to_owned(), car), ("truck".to_owned(), 1.0), ("van".to_owned(), 0.0)])),
            ..ParameterConfig::default()
        };
        assert!(is_same(&choice(9.0), &choice(9.0)));
        assert!(!is_same(&choice(9.0), &choice(9.001)));
        let log_normal = |max: Option<f64>| ParameterConfig {
            log_normal: Some(LogNormalConfig { median: 1.0, sigma: 0.5, min: Some(0.5), max }),
            ..ParameterConfig::default()
        };
        let end = log_normal(None).check().unwrap().distribution.bounds().unwrap()[1];
        assert!(is_same(&log_normal(None), &log_normal(Some(end))));
        assert!(!is_same(&log_normal(None), &log_normal(Some(2.0))));
    }
}
