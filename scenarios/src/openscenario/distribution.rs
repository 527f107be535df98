//! A file of parameter values for a scenario: `ParameterValueDistribution`.
//!
//! ```text
//!  Deterministic ─▶ combinations of values, numbered from 1 ─┬─▶ one of them ─▶ scenario that the file names
//!  Stochastic ────▶ draws of values, numbered from 1 ────────┘
//! ```
//!
//! A scenario file holds the times of one play of the storyboard, which depend on the values. One
//! import therefore uses one combination. The values of the last distribution of the file change
//! fastest.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::dom::{ImportError, Node};
use super::reader::Reader;
use super::stochastic::{self, Stochastic};
use super::structure::Given;

/// Largest number of values of one range.
const MOST_VALUES: f64 = 1e6;
/// Share of a step by which a range may miss its upper limit: numerical.
const ROUNDING: f64 = 1e-9;

/// A file of parameter values.
#[derive(Clone, Debug)]
pub(super) struct ValueFile {
    /// The scenario that it names.
    pub(super) scenario: PathBuf,
    pub(super) values: ValueSource,
}

/// Where the values of a file come from.
#[derive(Clone, Debug)]
pub(super) enum ValueSource {
    /// The alternatives of each distribution. A combination has one of each.
    Deterministic(Vec<Vec<Given>>),
    /// Distributions, from which values are drawn.
    Stochastic(Stochastic),
}

impl ValueFile {
    /// Returns the number of combinations or draws.
    pub(super) fn count(&self) -> u64 {
        match &self.values {
            ValueSource::Deterministic(distributions) => {
                distributions.iter().fold(1, |count: u64, alternatives| count.saturating_mul(alternatives.len() as u64))
            }
            ValueSource::Stochastic(stochastic) => stochastic.runs,
        }
    }

    /// Returns the values of a combination or of a draw. `number` is from 1 to
    /// [`ValueFile::count`].
    pub(super) fn combination(&self, number: u64) -> Given {
        let distributions = match &self.values {
            ValueSource::Deterministic(distributions) => distributions,
            ValueSource::Stochastic(stochastic) => return stochastic.draw(number),
        };
        let mut rest = number.saturating_sub(1);
        let mut values = Given::new();
        for alternatives in distributions.iter().rev() {
            let count = alternatives.len() as u64;
            let index = usize::try_from(rest % count).unwrap_or_default();
            rest /= count;
            values.extend(alternatives[index].clone());
        }
        values
    }

    /// Returns what a number chooses, in the plural.
    pub(super) const fn plural(&self) -> &'static str {
        match &self.values {
            ValueSource::Deterministic(_) => "combinations of values",
            ValueSource::Stochastic(_) => "draws of values",
        }
    }

    /// Returns what the values of a number are, for a note.
    pub(super) fn description(&self, number: u64) -> String {
        let count = self.count();
        match &self.values {
            ValueSource::Deterministic(_) => format!("value set {number} of {count}"),
            ValueSource::Stochastic(stochastic) => {
                let seed = match stochastic.seed {
                    Some(seed) => format!("the random seed {seed}"),
                    None => "no stated random seed, which is taken as 0".to_owned(),
                };
                format!("draw {number} of {count} with {seed}")
            }
        }
    }
}

/// Reads the values of a document, which [`super::structure::check`] has checked.
///
/// # Errors
/// [`ImportError`] at an element beside the values, or at a distribution that is not read.
pub(super) fn read(reader: &Reader, root: &Node, distribution: &Node) -> Result<ValueFile, ImportError> {
    let mut beside = root.children.iter().filter(|child| child.name != "FileHeader" && child.name != distribution.name);
    if let Some(other) = beside.next() {
        return Err(reader.error(other, format!("a file of values has nothing beside `{}`", distribution.name)));
    }
    let scenario = reader.path_in(reader.child(distribution, &["ScenarioFile"])?, "filepath")?;
    let values = match (distribution.child("Stochastic"), distribution.child("Deterministic")) {
        (Some(stochastic), None) => ValueSource::Stochastic(stochastic::read(reader, stochastic)?),
        (Some(stochastic), Some(_)) => {
            return Err(reader.error(stochastic, "it stands beside `Deterministic`: a file must have one of them"));
        }
        (None, _) => {
            ValueSource::Deterministic(deterministic(reader, reader.child(distribution, &["Deterministic"])?)?)
        }
    };
    Ok(ValueFile { scenario, values })
}

/// Returns the alternatives of each distribution.
fn deterministic(reader: &Reader, node: &Node) -> Result<Vec<Vec<Given>>, ImportError> {
    let mut distributions = Vec::new();
    let mut stated: BTreeSet<String> = BTreeSet::new();
    for node in &node.children {
        let alternatives = match node.name.as_str() {
            "DeterministicMultiParameterDistribution" => value_sets(reader, reader.only(node)?)?,
            _ => values(reader, node)?,
        };
        if alternatives.is_empty() {
            return Err(reader.error(node, "it has no value"));
        }
        // One of two values of a parameter would be left out in silence.
        let names: BTreeSet<String> = alternatives.iter().flat_map(Given::keys).cloned().collect();
        if let Some(name) = names.intersection(&stated).next() {
            return Err(reader.error(node, format!("a distribution before it has values of `{name}` already")));
        }
        stated.extend(names);
        distributions.push(alternatives);
    }
    Ok(distributions)
}

fn value_sets(reader: &Reader, node: &Node) -> Result<Vec<Given>, ImportError> {
    let mut sets = Vec::new();
    for set in node.all("ParameterValueSet") {
        let mut values = Given::new();
        for assignment in set.all("ParameterAssignment") {
            let name = reader.text(assignment, "parameterRef")?;
            if values.insert(name.clone(), reader.text(assignment, "value")?).is_some() {
                return Err(reader.error(assignment, format!("the set has a value of `{name}` already")));
            }
        }
        sets.push(values);
    }
    Ok(sets)
}

/// Returns the values of a distribution of one parameter.
fn values(reader: &Reader, node: &Node) -> Result<Vec<Given>, ImportError> {
    let name = reader.text(node, "parameterName")?;
    let inner = reader.only(node)?;
    let given = |value: String| Given::from([(name.clone(), value)]);
    match inner.name.as_str() {
        "DistributionSet" => inner
            .all("Element")
            .map(|element| match element.raw("weight") {
                None => reader.text(element, "value").map(&given),
                Some(_) => Err(reader.error(element, "`weight` is not an attribute of a value of a `DistributionSet`")),
            })
            .collect(),
        "DistributionRange" => {
            let range = reader.child(inner, &["Range"])?;
            let (low, high) = (reader.number(range, "lowerLimit")?, reader.number(range, "upperLimit")?);
            let step = reader.number(inner, "stepWidth")?;
            let steps = ((high - low) / step + ROUNDING).floor();
            if !(step > 0.0) || !(0.0..MOST_VALUES).contains(&steps) {
                let message = format!("from {low} to {high} in steps of {step}: 1 to {MOST_VALUES} values are needed");
                return Err(reader.error(inner, message));
            }
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in the range above")]
            let steps = steps as u32;
            Ok((0..=steps).map(|index| given((low + f64::from(index) * step).to_string())).collect())
        }
        _ => Err(reader.error(inner, "this distribution is not read")),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::dom::parse;
    use super::*;

    fn value_file(inner: &str) -> Result<ValueFile, String> {
        let text = format!(
            "<OpenSCENARIO><ParameterValueDistribution><ScenarioFile filepath=\"case.xosc\"/>{inner}\
             </ParameterValueDistribution></OpenSCENARIO>"
        );
        let reader = Reader { path: Path::new("folder/values.xosc").to_owned() };
        let root = parse(&reader.path, &text).unwrap();
        read(&reader, &root, &root.children[0]).map_err(|error| error.to_string())
    }

    fn single(name: &str, inner: &str) -> String {
        format!(
            "<DeterministicSingleParameterDistribution parameterName=\"{name}\">{inner}\
             </DeterministicSingleParameterDistribution>"
        )
    }

    #[test]
    fn the_combinations_are_numbered_and_the_last_distribution_changes_fastest() {
        let range = "<Range lowerLimit=\"0\" upperLimit=\"0.3\"/>";
        let speeds = format!("<DistributionRange stepWidth=\"0.1\">{range}</DistributionRange>");
        let cars = "<DistributionSet><Element value=\"car\"/><Element value=\"van\"/></DistributionSet>";
        let inner = [single("speed", &speeds), single("model", cars)].concat();
        let file = value_file(&format!("<Deterministic>{inner}</Deterministic>")).unwrap();
        assert_eq!((file.count(), file.scenario.as_path()), (8, Path::new("folder/case.xosc")));
        let values = |number| {
            let values = file.combination(number);
            (values["speed"].clone(), values["model"].clone())
        };
        assert_eq!(values(1), ("0".to_owned(), "car".to_owned()));
        assert_eq!(values(2), ("0".to_owned(), "van".to_owned()));
        assert_eq!(values(3).0.parse::<f64>().unwrap(), 0.1);
        assert!((values(8).0.parse::<f64>().unwrap() - 0.3).abs() < 1e-12);
    }

    #[test]
    fn a_distribution_without_a_list_of_values_is_refused() {
        let range = |step: &str, high: &str| {
            let limits = format!("<Range lowerLimit=\"1\" upperLimit=\"{high}\"/>");
            single("a", &format!("<DistributionRange stepWidth=\"{step}\">{limits}</DistributionRange>"))
        };
        for (inner, word) in [
            ("<Stochastic/>".to_owned(), "`Stochastic`: it needs `numberOfTestRuns`"),
            ("<Stochastic/><Deterministic/>".to_owned(), "`Stochastic`: it stands beside `Deterministic`"),
            (String::new(), "it needs `Deterministic`"),
            (
                format!("<Deterministic>{}</Deterministic>", range("1", "2").repeat(2)),
                "a distribution before it has values of `a` already",
            ),
            (
                format!(
                    "<Deterministic>{}</Deterministic>",
                    single("a", "<DistributionSet><Element value=\"1\" weight=\"1\"/></DistributionSet>")
                ),
                "`Element`: `weight` is not an attribute",
            ),
            (format!("<Deterministic>{}</Deterministic>", range("0", "2")), "in steps of 0"),
            (format!("<Deterministic>{}</Deterministic>", range("-1", "2")), "in steps of -1"),
            (format!("<Deterministic>{}</Deterministic>", range("1", "0")), "from 1 to 0"),
            (format!("<Deterministic>{}</Deterministic>", range("1e-9", "2")), "1 to 1000000 values"),
            (format!("<Deterministic>{}</Deterministic>", single("a", "<DistributionSet/>")), "it has no value"),
            (format!("<Deterministic>{}</Deterministic>", single("a", "<UserDefinedDistribution/>")), "not read"),
        ] {
            let message = value_file(&inner).unwrap_err();
            assert!(message.contains("values.xosc:1") && message.contains(word), "{message}");
        }
    }
}
