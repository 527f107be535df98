//! Writes fitted distributions as TOML. Its lines can be pasted into the `[parameters]` table of a
//! scenario.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use super::{FittedDistributions, FittedQuantity, Form, MIN_VALUES, Quantity};
use closecall_traffic::atomic::write_atomically;

/// Text for the heading of the file.
#[derive(Clone, Debug, Default)]
pub struct Heading {
    /// The command that reproduces the file.
    pub command: String,
    /// The origin of the trajectory data, and its licence.
    pub provenance: String,
}

/// Formats the distributions as TOML text.
///
/// The table `[parameters]` holds the empirical quantiles, and `[parametric]` the parametric forms
/// under the same names.
pub fn to_toml(result: &FittedDistributions, heading: &Heading) -> String {
    let mut text = String::new();
    push_heading(&mut text, result, heading);
    let source = result.data_sets.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    text.push_str("\n[parameters]\n");
    for fitted in &result.fitted {
        push_line(&mut text, &format!("# {}", fitted.quantity.meaning()));
        let quantiles = fitted.quantiles.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", ");
        let dependence = dependence(result, fitted.quantity);
        push_entry(&mut text, fitted, &format!("empirical = {{ quantiles = [{quantiles}] }}{dependence}"), &source);
    }
    for (quantity, n) in &result.too_few {
        let name = quantity.name();
        push_line(&mut text, &format!("# {name}: not fitted, {n} values where {MIN_VALUES} are needed"));
    }
    text.push_str("\n[parametric]\n");
    for fitted in &result.fitted {
        let Some((form, goodness)) = fitted.form else {
            push_line(&mut text, &format!("# {}: no parametric form suits these values", fitted.quantity.name()));
            continue;
        };
        let (distance, p) = (goodness.distance, goodness.p_value);
        push_line(&mut text, &format!("# Kolmogorov-Smirnov distance {distance:.3}, p = {p:.3}"));
        push_entry(&mut text, fitted, &form_text(form), &source);
    }
    text
}

/// Returns the rank correlations of a quantity with the quantities after it, as a further key of
/// its parameter.
fn dependence(result: &FittedDistributions, quantity: Quantity) -> String {
    let is_fitted = |quantity: Quantity| result.fitted.iter().any(|fitted| fitted.quantity == quantity);
    let terms =
        result.correlations.iter().filter(|correlation| correlation.of == quantity && is_fitted(correlation.with));
    let terms: Vec<String> =
        terms.map(|correlation| format!("{} = {:.2}", correlation.with.name(), correlation.spearman)).collect();
    if terms.is_empty() { String::new() } else { format!(", spearman = {{ {} }}", terms.join(", ")) }
}

/// Writes the distributions to `path` atomically.
///
/// # Errors
/// Returns an I/O error if the file cannot be written. A file that existed before then stays
/// untouched.
pub fn write_toml(result: &FittedDistributions, heading: &Heading, path: &Path) -> io::Result<()> {
    let text = to_toml(result, heading);
    write_atomically(path, |file| file.write_all(text.as_bytes()))
}

fn push_line(text: &mut String, line: &str) {
    text.push_str(line);
    text.push('\n');
}

fn push_heading(text: &mut String, result: &FittedDistributions, heading: &Heading) {
    push_line(text, "# Distributions fitted to trajectory data. This file holds the fitted values only, not the data.");
    for (key, value) in [("command", &heading.command), ("provenance", &heading.provenance)] {
        for line in value.lines() {
            push_line(text, &format!("# {key}: {line}"));
        }
    }
    push_line(text, &format!("# seed of the bootstrap: {}", result.seed));
    push_line(text, "# trajectory files, with the BLAKE3 hash of each file:");
    for (name, hash) in &result.data_sets {
        push_line(text, &format!("#   {} {hash}", one_line(name)));
    }
}

fn push_entry(text: &mut String, fitted: &FittedQuantity, distribution: &str, source: &str) {
    let [low, high] = fitted.interval_95.map(number);
    let (name, n, source) = (fitted.quantity.name(), fitted.n, quoted(source));
    let part_of = fitted.quantity.part_of().map_or_else(String::new, |(whole, cut)| {
        let [from, to] = cut.map(number);
        format!(", quantity = \"{}\", cut = [{from}, {to}]", whole.name())
    });
    let provenance = format!("fitted = {{ n = {n}, source = {source}, interval-95 = [{low}, {high}]{part_of} }}");
    // Writing to a string cannot fail.
    let _infallible = writeln!(text, "{name} = {{ {distribution}, {provenance} }}");
}

fn form_text(form: Form) -> String {
    match form {
        Form::LogNormal { median, sigma } => {
            format!("log-normal = {{ median = {}, sigma = {} }}", number(median), number(sigma))
        }
        Form::TruncatedNormal { mean, sd, min, max } => {
            let [mean, sd, min, max] = [mean, sd, min, max].map(number);
            format!("truncated-normal = {{ mean = {mean}, sd = {sd}, min = {min}, max = {max} }}")
        }
    }
}

/// Number of decimals of the written values: finer than the resolution of any trajectory data.
pub const DECIMALS: u8 = 3;

fn number(value: f64) -> String {
    format!("{value:.0$}", usize::from(DECIMALS))
}

/// Replaces control characters, so that the text stays on one line.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Returns the text as a TOML string.
fn quoted(text: &str) -> String {
    format!("\"{}\"", one_line(text).replace('\\', "\\\\").replace('"', "\\\""))
}

#[cfg(test)]
mod tests {
    use closecall_traffic::ParameterName;

    use super::*;
    use crate::fit::RankCorrelation;
    use closecall_scenarios::parameters::ParametersConfig;

    fn result() -> FittedDistributions {
        let values: Vec<f64> = (0..30).map(|k| 0.4 + 0.05 * f64::from(k)).collect();
        let fitted =
            [Quantity::CutOutThw, Quantity::CrossingSpeed].map(|q| FittedQuantity::new(q, &values, 3).unwrap());
        FittedDistributions {
            data_sets: vec![("a \"quoted\"\nname".to_owned(), "ab12".to_owned())],
            seed: 3,
            fitted: fitted.to_vec(),
            too_few: vec![(Quantity::Closing, 2)],
            correlations: vec![RankCorrelation {
                of: Quantity::CutOutThw,
                with: Quantity::CrossingSpeed,
                n: 30,
                spearman: -0.4,
            }],
        }
    }

    #[test]
    fn both_tables_are_valid_scenario_parameters() {
        let text =
            to_toml(&result(), &Heading { command: "closecall traffic fit".to_owned(), provenance: String::new() });
        let document: toml::Table = text.parse().unwrap();
        for table in ["parameters", "parametric"] {
            let config: ParametersConfig = document[table].clone().try_into().unwrap();
            config.check().unwrap();
            let entry = &config.0[&ParameterName::new("cut-out-thw-s").unwrap()];
            assert_eq!(entry.fitted.as_ref().unwrap().n, 30);
        }
        assert!(text.contains("spearman = { crossing-mps = -0.40 }"), "{text}");
        assert!(text.contains("# closing-mps: not fitted, 2 values where 5 are needed"));
    }

    #[test]
    fn the_file_holds_the_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fit.toml");
        write_toml(&result(), &Heading::default(), &path).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), to_toml(&result(), &Heading::default()));
        assert!(write_toml(&result(), &Heading::default(), &folder.path().join("no/such/folder.toml")).is_err());
    }
}
