//! The checked coverage plan of a scenario: what its samples are to cover.
//!
//! ```text
//!  item `closing`: bins 0 to 5, 5 to 10          target `closing`: 2 bins
//!  item `class`:   bins car, truck, motorcycle   target `class`:   3 bins
//!  cross `both`:   of the two items              target `both`:    6 bins, all combinations
//! ```
//!
//! An *item* divides the values of a parameter, a measure or an attribute of the operational design
//! domain into bins. A *target* is an item, or a cross of several items. A bin of a target is
//! covered by a stated number of samples.

use std::fmt;

use closecall_traffic::{ConfigError, ParameterName, Parameters, Problem, Value};

use super::config::{CoverageConfig, CrossConfig, ItemConfig};
use super::name::CoverageName;
use super::odd::{OddAttribute, Surroundings};
use crate::criteria::{Measure, MeasureKind};
use crate::outcome::Outcome;
use crate::parameters::{ParameterSpace, Part, Strata, volume};

/// Largest number of bins of a target.
const MOST_BINS: usize = 10_000;
/// The word of an excluded combination that means every bin of an item.
const ANY: &str = "*";

/// A range or a label of an item.
#[derive(Clone, Debug, PartialEq)]
pub enum Bin {
    /// Numbers from the first one up to the second one.
    Range([f64; 2]),
    /// A label.
    Label(String),
}

impl fmt::Display for Bin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range([low, high]) => write!(f, "{low} to {high}"),
            Self::Label(label) => f.write_str(label),
        }
    }
}

/// Where the value of an item comes from.
#[derive(Clone, Debug)]
enum Source {
    Parameter(ParameterName),
    Measure(&'static Measure),
    Odd(OddAttribute),
}

/// An item with its bins.
#[derive(Clone, Debug)]
pub struct Item {
    /// The name of the item.
    pub name: CoverageName,
    /// The parameter, measure or attribute that the item divides into bins, in words.
    pub subject: String,
    /// The bins.
    pub bins: Vec<Bin>,
    source: Source,
}

/// An item or a cross whose bins are to be hit.
#[derive(Clone, Debug)]
pub struct Target {
    /// The name of the item or cross.
    pub name: CoverageName,
    /// The indices of the items in the plan.
    pub items: Vec<usize>,
    /// Number of samples that cover a bin.
    pub at_least: u64,
    /// Whether each bin is to be covered. The combinations of a cross are in the order in which the
    /// bin of the last item changes fastest.
    pub counts: Vec<bool>,
    /// The probability of each bin, if all items are parameters without a correlation to others.
    pub weights: Option<Vec<f64>>,
}

/// Everything that the samples of a scenario should cover.
#[derive(Clone, Debug, Default)]
pub struct CoveragePlan {
    /// The items.
    pub items: Vec<Item>,
    /// The items again, and the crosses.
    pub targets: Vec<Target>,
    /// The target whose bins the design `coverage` visits.
    pub fill: Option<CoverageName>,
}

impl CoverageConfig {
    /// Checks the table against the parameters of the scenario.
    ///
    /// # Errors
    /// [`ConfigError`] for a name that does not exist, edges that do not ascend, and other
    /// contradictions.
    pub(crate) fn check(&self, space: &ParameterSpace) -> Result<CoveragePlan, ConfigError> {
        let mut plan = CoveragePlan::default();
        for (name, config) in &self.item {
            let within = |error: ConfigError| error.within(name.as_str()).within("item");
            let item = item(*name, config, space).map_err(within)?;
            let counts = vec![true; item.bins.len()];
            let at_least = at_least(config.at_least).map_err(within)?;
            let items = vec![plan.items.len()];
            plan.items.push(item);
            let target = Target { name: *name, items, at_least, counts, weights: None };
            plan.targets.push(target.weighted(&plan.items, space));
        }
        for (name, config) in &self.cross {
            let within = |error: ConfigError| error.within(name.as_str()).within("cross");
            if self.item.contains_key(name) {
                return Err(within(ConfigError::new("items", Problem::Duplicate { value: name.to_string() })));
            }
            let target = cross(*name, config, &plan.items).map_err(within)?;
            plan.targets.push(target.weighted(&plan.items, space));
        }
        if let Some(name) = self.fill {
            let Some(target) = plan.target(name.as_str()) else {
                let problem = Problem::UnknownWord { value: name.to_string(), allowed: plan.names().join(", ") };
                return Err(ConfigError::new("fill", problem));
            };
            if target.weights.is_none() {
                let rule = format!("`{name}` must have items that are parameters and not correlated with others");
                return Err(ConfigError::new("fill", Problem::Contradiction { other: "item", rule }));
            }
            plan.fill = Some(name);
        }
        Ok(plan)
    }
}

fn at_least(value: Option<u64>) -> Result<u64, ConfigError> {
    match value {
        Some(value @ 0) => {
            Err(ConfigError::new("at-least", Problem::WrongCount { value, allowed: "a number of samples from 1" }))
        }
        value => Ok(value.unwrap_or(1)),
    }
}

fn item(name: CoverageName, config: &ItemConfig, space: &ParameterSpace) -> Result<Item, ConfigError> {
    // The bins of labels: the chosen labels, or all of them.
    let label_bins = |all: &[String]| -> Result<Vec<Bin>, ConfigError> {
        if !config.edges.is_empty() {
            let rule = "only a number has edges, and the bins of labels are the labels".to_owned();
            return Err(ConfigError::new("edges", Problem::Contradiction { other: "labels", rule }));
        }
        for (index, label) in config.labels.iter().enumerate() {
            if !all.contains(label) {
                let problem = Problem::UnknownWord { value: label.clone(), allowed: all.join(", ") };
                return Err(ConfigError::new("labels", problem));
            }
            if config.labels[..index].contains(label) {
                return Err(ConfigError::new("labels", Problem::Duplicate { value: label.clone() }));
            }
        }
        let labels = if config.labels.is_empty() { all } else { &config.labels };
        Ok(labels.iter().cloned().map(Bin::Label).collect())
    };
    match (&config.parameter, &config.measure, config.odd) {
        (Some(parameter), None, None) => {
            let Some(entry) = space.get(parameter) else {
                let allowed = space.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
                let problem = Problem::UnknownParameter { name: parameter.clone(), allowed };
                return Err(ConfigError::new("parameter", problem));
            };
            let labels = match entry.distribution.nominal() {
                // A fixed label is the only one.
                Value::Label(label) if entry.distribution.labels().is_empty() => vec![label],
                _ => entry.distribution.labels().to_vec(),
            };
            let bins = if labels.is_empty() { ranges(config)? } else { label_bins(&labels)? };
            Ok(Item { name, subject: parameter.to_string(), bins, source: Source::Parameter(parameter.clone()) })
        }
        (None, Some(word), None) => {
            let Some(measure) = Measure::named(word).filter(|measure| !measure.is_reported()) else {
                let allowed = Measure::measured().map(|measure| measure.name).collect::<Vec<_>>().join(", ");
                return Err(ConfigError::new("measure", Problem::UnknownWord { value: word.clone(), allowed }));
            };
            let bins = match measure.kind {
                MeasureKind::Flag => label_bins(&["no", "yes"].map(str::to_owned))?,
                MeasureKind::Number => ranges(config)?,
            };
            Ok(Item { name, subject: word.clone(), bins, source: Source::Measure(measure) })
        }
        (None, None, Some(attribute)) => {
            let labels: Vec<String> = attribute.labels().iter().map(|&label| label.to_owned()).collect();
            let subject = attribute.name();
            Ok(Item { name, subject, bins: label_bins(&labels)?, source: Source::Odd(attribute) })
        }
        (None, None, None) => {
            let needed = "an item bins a `parameter`, a `measure` or an attribute `odd`";
            Err(ConfigError::new("parameter", Problem::Missing { needed }))
        }
        _ => {
            let rule = "an item has exactly one of `parameter`, `measure` and `odd`".to_owned();
            let key = if config.parameter.is_some() { "parameter" } else { "measure" };
            Err(ConfigError::new(key, Problem::Contradiction { other: "odd", rule }))
        }
    }
}

/// Returns the bins of a number.
fn ranges(config: &ItemConfig) -> Result<Vec<Bin>, ConfigError> {
    if !config.labels.is_empty() {
        let rule = "a number has edges and no labels".to_owned();
        return Err(ConfigError::new("labels", Problem::Contradiction { other: "edges", rule }));
    }
    if config.edges.len() < 2 {
        return Err(ConfigError::new("edges", Problem::Missing { needed: "a number has two edges or more" }));
    }
    let pairs = || config.edges.windows(2).map(|pair| [pair[0], pair[1]]);
    if let Some([low, high]) = pairs().find(|[low, high]| !(low < high && low.is_finite() && high.is_finite())) {
        let allowed = format!("a finite number above the edge before it, {low}");
        let problem = Problem::UnknownWord { value: high.to_string(), allowed };
        return Err(ConfigError::new("edges", problem));
    }
    Ok(pairs().map(Bin::Range).collect())
}

fn cross(name: CoverageName, config: &CrossConfig, items: &[Item]) -> Result<Target, ConfigError> {
    let mut indices = Vec::new();
    for word in &config.items {
        let Some(index) = items.iter().position(|item| item.name == *word) else {
            let allowed = items.iter().map(|item| item.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(ConfigError::new("items", Problem::UnknownWord { value: word.to_string(), allowed }));
        };
        if indices.contains(&index) {
            return Err(ConfigError::new("items", Problem::Duplicate { value: word.to_string() }));
        }
        indices.push(index);
    }
    if indices.len() < 2 {
        return Err(ConfigError::new("items", Problem::Missing { needed: "a cross has two items or more" }));
    }
    let sizes = indices.iter().map(|&index| items[index].bins.len());
    let combinations = sizes.fold(1_usize, usize::saturating_mul);
    if combinations > MOST_BINS {
        let problem =
            Problem::WrongCount { value: combinations as u64, allowed: "a number of combinations up to 10000" };
        return Err(ConfigError::new("items", problem));
    }
    let mut target = Target {
        name,
        items: indices,
        at_least: at_least(config.at_least)?,
        counts: vec![true; combinations],
        weights: None,
    };
    for (index, excluded) in config.without.iter().enumerate() {
        let within = |error: ConfigError| error.within_index(index).within("without");
        if excluded.len() != target.items.len() {
            let needed = "a combination has one bin of each item";
            return Err(within(ConfigError::new("items", Problem::Missing { needed })));
        }
        for (word, &item) in excluded.iter().zip(&target.items) {
            let names: Vec<String> = items[item].bins.iter().map(Bin::to_string).collect();
            if word != ANY && !names.contains(word) {
                let allowed = format!("{}, {ANY}", names.join(", "));
                let problem = Problem::UnknownWord { value: word.clone(), allowed };
                return Err(within(ConfigError::new(items[item].name.as_str(), problem)));
            }
        }
        for combination in 0..combinations {
            let mut bins = target.bins(combination, items).into_iter().zip(excluded);
            let is_excluded = bins.all(|(bin, word)| word == ANY || bin.to_string() == *word);
            target.counts[combination] &= !is_excluded;
        }
    }
    if !target.counts.contains(&true) {
        return Err(ConfigError::new("without", Problem::Missing { needed: "no combination is left to be covered" }));
    }
    Ok(target)
}

impl Item {
    /// Returns the index of the bin of a run; `None` if its value is in no bin, or the run has
    /// none. `surroundings` returns road and weather of the run.
    pub fn bin(&self, outcome: &Outcome, surroundings: &dyn Fn() -> Option<Surroundings>) -> Option<usize> {
        match &self.source {
            Source::Parameter(name) => self.bin_of_value(&outcome.parameters, name),
            Source::Measure(measure) => {
                let value = measure.of(outcome)?;
                match measure.kind {
                    MeasureKind::Flag => self.bin_of_label(if value == 1.0 { "yes" } else { "no" }),
                    MeasureKind::Number => self.bin_of_number(value),
                }
            }
            Source::Odd(attribute) => self.bin_of_label(attribute.of(&surroundings()?)),
        }
    }

    fn bin_of_value(&self, parameters: &Parameters, name: &ParameterName) -> Option<usize> {
        match parameters.get(name)? {
            Value::Number(number) => self.bin_of_number(*number),
            Value::Label(label) => self.bin_of_label(label),
        }
    }

    fn bin_of_label(&self, label: &str) -> Option<usize> {
        self.bins.iter().position(|bin| matches!(bin, Bin::Label(name) if name == label))
    }

    fn bin_of_number(&self, number: f64) -> Option<usize> {
        let last = self.bins.len().checked_sub(1)?;
        self.bins.iter().enumerate().position(|(index, bin)| match bin {
            Bin::Range([low, high]) => (*low..*high).contains(&number) || index == last && number == *high,
            Bin::Label(_) => false,
        })
    }

    /// Returns for each bin the interval of the uniform numbers from which the parameter's
    /// distribution draws a value in that bin. Returns `None` for an item that is not a parameter,
    /// or whose parameter is correlated with another.
    fn parts(&self, space: &ParameterSpace) -> Option<Vec<Part>> {
        let Source::Parameter(name) = &self.source else { return None };
        let parameter = space.iter().position(|(other, _)| other == name)?;
        let distribution = &space.get(name)?.distribution;
        if space.is_correlated(parameter) {
            return None;
        }
        let last = self.bins.len() - 1;
        let part = |(index, bin): (usize, &Bin)| {
            let interval = match bin {
                Bin::Range([low, high]) => {
                    // Only the last bin includes its upper edge.
                    let end = if index == last { *high } else { high.next_down() };
                    [distribution.cdf(low.next_down())?, distribution.cdf(end)?]
                }
                // The interval of a label that is never drawn is empty.
                Bin::Label(label) => distribution.interval_of(label).unwrap_or([0.0; 2]),
            };
            Some(Part { parameter, interval })
        };
        self.bins.iter().enumerate().map(part).collect()
    }
}

impl Target {
    /// Returns the parts of each combination, the last item first; `None` if an item has no parts.
    fn parts(&self, items: &[Item], space: &ParameterSpace) -> Option<Vec<Vec<Part>>> {
        let item_parts: Vec<Vec<Part>> =
            self.items.iter().map(|&item| items[item].parts(space)).collect::<Option<_>>()?;
        let combination_parts = |index: usize| {
            let bins = self.bin_indices(index, items);
            item_parts.iter().zip(bins).rev().map(|(parts, bin)| parts[bin]).collect()
        };
        Some((0..self.counts.len()).map(combination_parts).collect())
    }

    fn weighted(self, items: &[Item], space: &ParameterSpace) -> Self {
        let weights = self.parts(items, space).map(|parts| parts.iter().map(|parts| volume(parts)).collect());
        Self { weights, ..self }
    }

    /// Returns the bin of each item in the combination with this index.
    pub fn bins<'a>(&self, index: usize, items: &'a [Item]) -> Vec<&'a Bin> {
        self.items.iter().zip(self.bin_indices(index, items)).map(|(&item, bin)| &items[item].bins[bin]).collect()
    }

    /// Returns the index of the bin of each item in the combination with this index: the digits of
    /// the index, whose last one belongs to the last item.
    fn bin_indices(&self, index: usize, items: &[Item]) -> Vec<usize> {
        let mut rest = index;
        let mut bins = vec![0; self.items.len()];
        for (bin, &item) in bins.iter_mut().zip(&self.items).rev() {
            let count = items[item].bins.len();
            *bin = rest % count;
            rest /= count;
        }
        bins
    }

    /// Returns the index of the combination of `bins`, which has the index of the bin of each item
    /// of the plan. Returns `None` if an item of the target has no bin.
    pub fn index(&self, bins: &[Option<usize>], items: &[Item]) -> Option<usize> {
        self.items.iter().try_fold(0, |index, &item| Some(index * items[item].bins.len() + bins[item]?))
    }
}

impl CoveragePlan {
    /// Returns the names of the targets.
    pub fn names(&self) -> Vec<&str> {
        self.targets.iter().map(|target| target.name.as_str()).collect()
    }

    /// Returns the bins that the design `coverage` visits; none if there is no `fill`.
    pub(crate) fn strata(&self, space: &ParameterSpace) -> Strata {
        let Some(target) = self.fill.and_then(|name| self.target(name.as_str())) else { return Strata::default() };
        let parts = target.parts(&self.items, space).unwrap_or_default();
        let counted = parts.into_iter().zip(&target.counts).filter(|(_, counts)| **counts);
        Strata::new(counted.map(|(parts, _)| parts).collect())
    }

    /// Returns the target with this name.
    pub fn target(&self, name: &str) -> Option<&Target> {
        self.targets.iter().find(|target| target.name.as_str() == name)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{ScenarioFile, library};

    fn file(table: &str) -> Result<ScenarioFile, String> {
        let text = library::text("low-thw-overtake").unwrap();
        let text = format!("{text}\n{table}");
        ScenarioFile::parse(Path::new("a.toml"), &text, &[]).map_err(|error| error.to_string())
    }

    const TABLE: &str = r#"
[coverage.item.closing]
parameter = "closing-mps"
edges = [0, 5, 10, 20]
[coverage.item.class]
parameter = "rear-class"
[coverage.item.rain]
odd = "rainfall-intensity"
labels = ["no-rain", "light-rain"]
[coverage.item.hit]
measure = "ego_collided"
[coverage.cross.both]
items = ["closing", "class"]
at-least = 2
without = [["10 to 20", "*"]]
"#;

    #[test]
    fn items_have_bins_and_a_cross_their_combinations() {
        let file = file(TABLE).unwrap();
        let plan = file.coverage();
        assert_eq!(plan.names(), ["class", "closing", "hit", "rain", "both"]);
        let both = plan.target("both").unwrap();
        let classes = plan.items[0].bins.len();
        assert_eq!((both.counts.len(), both.at_least), (3 * classes, 2));
        assert_eq!(both.counts.iter().filter(|counts| **counts).count(), 2 * classes);
        let closing = &plan.items[1];
        let bin = |number| closing.bin_of_number(number);
        assert_eq!([-0.1, 0.0, 5.0, 19.9, 20.0, 20.1].map(bin), [None, Some(0), Some(1), Some(2), Some(2), None]);
        assert_eq!(bin(f64::NAN), None);
        for index in 0..both.counts.len() {
            let bins = both.bins(index, &plan.items);
            let position = |item: usize, bin: &Bin| plan.items[item].bins.iter().position(|other| other == bin);
            let positions = [position(0, bins[1]), position(1, bins[0]), None, None];
            assert_eq!(both.index(&positions, &plan.items), Some(index));
        }
        assert_eq!(both.index(&[None, Some(0), None, None], &plan.items), None);
    }

    #[test]
    fn what_does_not_fit_is_refused_with_what_is_allowed() {
        for (table, part) in [
            ("[coverage.item.a]", "an item bins a `parameter`"),
            ("[coverage.item.a]\nparameter = 'closing-mps'", "two edges or more"),
            ("[coverage.item.a]\nparameter = 'closing-mps'\nedges = [1, 1]", "above the edge before it, 1"),
            ("[coverage.item.a]\nparameter = 'closing-mps'\nedges = [1, nan]", "a finite number"),
            ("[coverage.item.a]\nparameter = 'closing-mps'\nlabels = ['x']", "edges and no labels"),
            ("[coverage.item.a]\nparameter = 'speed'", "names the parameter `$speed`"),
            ("[coverage.item.a]\nmeasure = 'engaged'", "is `engaged`, but one of"),
            ("[coverage.item.a]\nmeasure = 'harm'\nodd = 'particulates'", "exactly one of"),
            ("[coverage.item.a]\nodd = 'rainfall-intensity'\nlabels = ['drizzle']", "is `drizzle`, but one of no-rain"),
            ("[coverage.item.a]\nodd = 'rain'", "rainfall-intensity"),
            ("[coverage.item.a]\nodd = 'particulates'\nat-least = 0", "a number of samples from 1"),
            ("[coverage.item.A]\nodd = 'particulates'", "not the name of a coverage item"),
            ("[coverage.item.a]\nodd = 'particulates'\n[coverage.cross.b]\nitems = ['a']", "two items or more"),
            ("[coverage.item.a]\nodd = 'particulates'\n[coverage.cross.b]\nitems = ['a', 'c']", "is `c`, but one of a"),
            ("[coverage.cross.b]\nitem = ['a', 'c']", "unknown field `item`"),
        ] {
            let error = file(table).unwrap_err();
            assert!(error.contains(part), "{table}: {error}");
        }
        let edges = (0..200).map(|edge| edge.to_string()).collect::<Vec<_>>().join(",");
        let item = |name: &str| format!("[coverage.item.{name}]\nparameter = 'closing-mps'\nedges = [{edges}]\n");
        let many = format!("{}{}[coverage.cross.c]\nitems = ['a', 'b']", item("a"), item("b"));
        assert!(file(&many).unwrap_err().contains("up to 10000"));
    }
}
