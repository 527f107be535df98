//! All parameters of a scenario, checked.

use std::collections::BTreeMap;

use closecall_traffic::{ParameterName, Parameters, Value};

use super::{Distribution, FittedConfig};

/// Where a distribution comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Provenance {
    /// Fitted to recordings.
    Fitted(FittedConfig),
    /// Assumed, for this reason.
    Assumed(String),
    /// The file does not say.
    Unstated,
}

/// One checked parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SpaceEntry {
    /// Which values it takes.
    pub distribution: Distribution,
    /// Where that comes from.
    pub provenance: Provenance,
    /// A remark for the reader.
    pub note: Option<String>,
}

/// The parameters of a scenario with their distributions, in the order of their names.
///
/// They are sampled independently of each other. [`crate::sampling`] gives it the designs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterSpace(BTreeMap<ParameterName, SpaceEntry>);

impl ParameterSpace {
    /// All parameters in the order of their names.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&ParameterName, &SpaceEntry)> {
        self.0.iter()
    }

    /// One parameter.
    pub fn get(&self, name: &ParameterName) -> Option<&SpaceEntry> {
        self.0.get(name)
    }

    /// Every parameter at its nominal value: the median, or the most probable label.
    pub fn nominal(&self) -> Parameters {
        self.map(|_, _, distribution| distribution.nominal())
    }

    /// The nominal values, and for each parameter those with it alone at each of its bounds or labels.
    ///
    /// A scenario that is valid for all of these is valid wherever its checks look at single values.
    pub fn extremes(&self) -> Vec<Parameters> {
        let nominal = self.nominal();
        let mut extremes = vec![nominal.clone()];
        for (name, entry) in &self.0 {
            let bounds = entry.distribution.bounds().into_iter().flatten().map(Value::Number);
            let labels = entry.distribution.labels().iter().cloned().map(Value::Label);
            for value in bounds.chain(labels).filter(|value| nominal.get(name) != Some(value)) {
                let mut parameters = nominal.clone();
                parameters.insert(name.clone(), value);
                extremes.push(parameters);
            }
        }
        extremes
    }

    /// The values that `value` gives for each parameter, from its name, its place among the names, and its
    /// distribution.
    pub(crate) fn map(&self, mut value: impl FnMut(&ParameterName, usize, &Distribution) -> Value) -> Parameters {
        let entries = self.0.iter().enumerate();
        entries.map(|(place, (name, entry))| (name.clone(), value(name, place, &entry.distribution))).collect()
    }
}

impl FromIterator<(ParameterName, SpaceEntry)> for ParameterSpace {
    fn from_iter<I: IntoIterator<Item = (ParameterName, SpaceEntry)>>(entries: I) -> Self {
        Self(entries.into_iter().collect())
    }
}
