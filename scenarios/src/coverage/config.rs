//! The table `[coverage]` of a scenario file.

use std::collections::BTreeMap;

use closecall_traffic::ParameterName;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::name::CoverageName;
use super::odd::OddAttribute;

/// What the samples of the scenario should cover.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CoverageConfig {
    /// The items, by their names. Names of items and crosses differ.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, ItemConfig>")]
    pub item: BTreeMap<CoverageName, ItemConfig>,
    /// Crosses of items, by their names.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, CrossConfig>")]
    pub cross: BTreeMap<CoverageName, CrossConfig>,
    /// The item or cross whose bins the sampling design `coverage` visits in turn. Its items are parameters that are not correlated
    /// with others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fill: Option<CoverageName>,
}

/// An item: give exactly one of `parameter`, `measure` and `odd`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ItemConfig {
    /// A parameter of the scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parameter: Option<ParameterName>,
    /// A measure of the arm under test, such as `min_thw_rear_s`. A flag has the bins `no` and `yes`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measure: Option<String>,
    /// An attribute of the operational design domain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odd: Option<OddAttribute>,
    /// Of a number: the edges of its bins, ascending. A bin includes its lower edge, the last one its upper edge, too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub edges: Vec<f64>,
    /// Of a parameter with labels or an attribute: the labels that count. Default: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
    /// Samples by which a bin is covered. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_least: Option<u64>,
}

/// A cross: one bin for each combination of bins of its items.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CrossConfig {
    /// The names of two items or more.
    pub items: Vec<CoverageName>,
    /// Combinations that do not count, because they cannot happen: a bin of each item, or `*` for any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<Vec<String>>,
    /// Samples by which a bin is covered. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_least: Option<u64>,
}

impl CoverageConfig {
    /// Returns true if nothing is to be covered.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
