//! The configuration of parameters, as in a scenario file.

use std::collections::BTreeMap;

use closecall_traffic::{ConfigError, KeyPath, ParameterName, Problem, Value};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::copula::Copula;
use super::distribution::{FINITE, at_least};
use super::space::{ParameterSpace, Provenance, SpaceEntry};
use super::{Distribution, finite};

/// What is missing if a parameter has no distribution.
const DISTRIBUTIONS: &str =
    "a distribution, which is one of `uniform`, `truncated-normal`, `log-normal`, `choice`, `empirical`, `fixed`";

/// The `[parameters]` table of a scenario file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct ParametersConfig(pub BTreeMap<ParameterName, ParameterConfig>);

impl ParametersConfig {
    /// Checks all parameters.
    ///
    /// # Errors
    /// Returns the first invalid key in the order of the names, with its path below `[parameters]`.
    pub fn check(&self) -> Result<ParameterSpace, ConfigError> {
        let check = |(name, config): (&ParameterName, &ParameterConfig)| {
            let entry = config.check().map_err(|error| error.within(name.as_str()))?;
            Ok((name.clone(), entry))
        };
        let entries = self.0.iter().map(check).collect::<Result<BTreeMap<_, _>, ConfigError>>()?;
        let stated = self.0.iter().filter(|(_, config)| !config.spearman.is_empty());
        let stated = stated.map(|(name, config)| (name.clone(), config.spearman.clone())).collect();
        let copula = Copula::new(&entries, &stated)?;
        Ok(ParameterSpace::new(entries, copula))
    }
}

/// The configuration of one parameter: exactly one distribution, and its provenance.
///
/// The distributions are optional fields of one struct, not variants of an enum: only this allows
/// further keys beside them and still refuses unknown keys.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ParameterConfig {
    /// Uniform distribution between two bounds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uniform: Option<UniformConfig>,
    /// Normal distribution, truncated at two bounds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truncated_normal: Option<TruncatedNormalConfig>,
    /// Log-normal distribution, which may be truncated at either end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub log_normal: Option<LogNormalConfig>,
    /// One of several labels, each with its weight. The weights need not add up to 1.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "finite::weights")]
    pub choice: Option<BTreeMap<String, f64>>,
    /// Distribution given by its quantiles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub empirical: Option<EmpiricalConfig>,
    /// The same number or label in every sample.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "finite::value")]
    #[schemars(schema_with = "finite::value_schema")]
    pub fixed: Option<Value>,
    /// Provenance: the distribution was fitted to trajectory data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fitted: Option<FittedConfig>,
    /// Provenance: the distribution was assumed, for the reason given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub assumed: Option<String>,
    /// What trajectory data show of the quantity. A verdict says which share of the distribution lies
    /// beyond it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observed: Option<ObservedConfig>,
    /// Rank correlations (Spearman) with other parameters, by their names: from -0.99 to 0.99. It
    /// suffices that one of two parameters states theirs. A pair that neither states is
    /// independent.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty", deserialize_with = "finite::correlations")]
    pub spearman: BTreeMap<ParameterName, f64>,
    /// A remark for the reader.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// A uniform distribution between two bounds, in the parameter's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct UniformConfig {
    /// Smallest value.
    #[serde(deserialize_with = "finite::number")]
    pub min: f64,
    /// Largest value, above the smallest.
    #[serde(deserialize_with = "finite::number")]
    pub max: f64,
}

/// A log-normal distribution, which may be truncated at either end, in the parameter's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LogNormalConfig {
    /// Median before truncation, above 0.
    #[serde(deserialize_with = "finite::number")]
    pub median: f64,
    /// Standard deviation of the logarithm, above 0 (-).
    #[serde(deserialize_with = "finite::number")]
    pub sigma: f64,
    /// Smallest value; 0 if absent.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "finite::option")]
    pub min: Option<f64>,
    /// Largest value; unbounded if absent.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "finite::option")]
    pub max: Option<f64>,
}

/// A normal distribution, truncated at two bounds, in the parameter's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct TruncatedNormalConfig {
    /// Mean before truncation.
    #[serde(deserialize_with = "finite::number")]
    pub mean: f64,
    /// Standard deviation before truncation, above 0.
    #[serde(deserialize_with = "finite::number")]
    pub sd: f64,
    /// Smallest value.
    #[serde(deserialize_with = "finite::number")]
    pub min: f64,
    /// Largest value, above the smallest.
    #[serde(deserialize_with = "finite::number")]
    pub max: f64,
}

/// A distribution given by its quantiles, in the parameter's unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct EmpiricalConfig {
    /// Quantiles at equally spaced probabilities from 0 to 1, in non-descending order, with linear
    /// interpolation.
    #[serde(deserialize_with = "finite::list")]
    pub quantiles: Vec<f64>,
}

/// The data to which a distribution was fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct FittedConfig {
    /// Number of observations.
    pub n: u64,
    /// The trajectory data, and how it was evaluated.
    pub source: String,
    /// Lower and upper end of the 95 % bootstrap interval of the median.
    #[serde(
        default,
        rename = "interval-95",
        skip_serializing_if = "Option::is_none",
        deserialize_with = "finite::pair"
    )]
    pub interval_95: Option<[f64; 2]>,
    /// The quantity of `closecall traffic fit` to which the distribution was fitted, such as
    /// `front-thw-s`. Default: the one with the name of the parameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantity: Option<String>,
    /// The range of values of the quantity that were fitted: from the first number up to below the
    /// second. Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "finite::pair")]
    pub cut: Option<[f64; 2]>,
}

/// What trajectory data show of a quantity, beside the distribution that a scenario samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ObservedConfig {
    /// Number of observations.
    pub n: u64,
    /// Smallest observed value.
    #[serde(deserialize_with = "finite::number")]
    pub min: f64,
    /// Largest observed value, not below the smallest.
    #[serde(deserialize_with = "finite::number")]
    pub max: f64,
    /// The trajectory data, and the quantity.
    pub source: String,
}

impl ObservedConfig {
    fn check(&self) -> Result<(), ConfigError> {
        if self.n == 0 {
            let problem = Problem::WrongCount { value: self.n, allowed: "at least 1 observation" };
            return Err(ConfigError::new("n", problem));
        }
        if !(self.min <= self.max) {
            let rule = format!("{} is not below {}", self.min, self.max);
            return Err(ConfigError::new("min", Problem::Contradiction { other: "max", rule }));
        }
        if self.source.trim().is_empty() {
            return Err(ConfigError::new("source", Problem::Missing { needed: "where it was observed" }));
        }
        Ok(())
    }
}

impl ParameterConfig {
    /// Creates a parameter with a uniform distribution between two bounds.
    pub fn uniform(min: f64, max: f64) -> Self {
        Self { uniform: Some(UniformConfig { min, max }), ..Self::default() }
    }

    /// Creates a parameter whose distribution is given by quantiles at equally spaced probabilities
    /// from 0 to 1.
    pub fn empirical(quantiles: Vec<f64>) -> Self {
        Self { empirical: Some(EmpiricalConfig { quantiles }), ..Self::default() }
    }

    /// Creates a parameter that has the same value in every sample.
    pub fn fixed(value: Value) -> Self {
        Self { fixed: Some(value), ..Self::default() }
    }

    /// Cuts the values of a number below the first and above the second limit. The quantiles of an
    /// empirical distribution take the limit, the other forms are truncated there.
    pub(crate) fn cut(&mut self, [low, high]: [Option<f64>; 2]) {
        let cut = |value: f64| value.max(low.unwrap_or(f64::NEG_INFINITY)).min(high.unwrap_or(f64::INFINITY));
        if let Some(empirical) = &mut self.empirical {
            empirical.quantiles.iter_mut().for_each(|value| *value = cut(*value));
        }
        if let Some(UniformConfig { min, max }) = &mut self.uniform {
            (*min, *max) = (cut(*min), cut(*max));
        }
        if let Some(TruncatedNormalConfig { min, max, .. }) = &mut self.truncated_normal {
            (*min, *max) = (cut(*min), cut(*max));
        }
        if let Some(LogNormalConfig { min, max, .. }) = &mut self.log_normal {
            (*min, *max) = (low.or(*min), high.or(*max));
        }
    }

    /// Checks this parameter.
    ///
    /// # Errors
    /// Returns the first invalid key, with its path below the parameter's name.
    pub fn check(&self) -> Result<SpaceEntry, ConfigError> {
        let candidates = [
            ("uniform", self.uniform.as_ref().map(Distribution::uniform)),
            ("truncated-normal", self.truncated_normal.as_ref().map(Distribution::truncated_normal)),
            ("log-normal", self.log_normal.as_ref().map(Distribution::log_normal)),
            ("choice", self.choice.as_ref().map(Distribution::choice)),
            ("empirical", self.empirical.as_ref().map(Distribution::empirical)),
            ("fixed", self.fixed.as_ref().map(Distribution::fixed)),
        ];
        let mut forms = candidates.into_iter().filter_map(|(key, candidate)| Some((key, candidate?)));
        let Some((key, distribution)) = forms.next() else {
            return Err(ConfigError { path: KeyPath::default(), problem: Problem::Missing { needed: DISTRIBUTIONS } });
        };
        if let Some((second, _)) = forms.next() {
            let rule = "a parameter has exactly one distribution".to_owned();
            return Err(ConfigError::new(second, Problem::Contradiction { other: key, rule }));
        }
        if let Some(observed) = &self.observed {
            observed.check().map_err(|error| error.within("observed"))?;
        }
        Ok(SpaceEntry {
            distribution: distribution.map_err(|error| error.within(key))?,
            observed: self.observed.clone(),
            provenance: self.provenance()?,
            note: self.note.clone(),
        })
    }

    /// Checks the provenance.
    fn provenance(&self) -> Result<Provenance, ConfigError> {
        match (&self.fitted, &self.assumed) {
            (Some(_), Some(_)) => {
                let rule = "a distribution is either fitted or assumed".to_owned();
                Err(ConfigError::new("assumed", Problem::Contradiction { other: "fitted", rule }))
            }
            (Some(fitted), None) => {
                fitted.check().map_err(|error| error.within("fitted"))?;
                Ok(Provenance::Fitted(fitted.clone()))
            }
            (None, Some(why)) if why.trim().is_empty() => {
                Err(ConfigError::new("assumed", Problem::Missing { needed: "the reason for the assumption" }))
            }
            (None, Some(why)) => Ok(Provenance::Assumed(why.clone())),
            (None, None) => Ok(Provenance::Unstated),
        }
    }
}

impl FittedConfig {
    fn check(&self) -> Result<(), ConfigError> {
        if self.n == 0 {
            return Err(ConfigError::new(
                "n",
                Problem::WrongCount { value: self.n, allowed: "at least 1 observation" },
            ));
        }
        if self.source.trim().is_empty() {
            return Err(ConfigError::new("source", Problem::Missing { needed: "what it was fitted to" }));
        }
        if let Some([low, high]) = self.cut.filter(|[low, high]| !(low < high)) {
            let rule = format!("{low} is not below {high}");
            return Err(ConfigError::new("cut[0]", Problem::Contradiction { other: "cut[1]", rule }));
        }
        if let Some([low, high]) = self.interval_95 {
            for (index, value, allowed) in [(0, low, FINITE), (1, high, at_least(low))] {
                if !allowed.contains(value) {
                    let problem = Problem::OutOfRange { value, allowed };
                    let error = ConfigError { path: KeyPath::default(), problem }.within_index(index);
                    return Err(error.within("interval-95"));
                }
            }
        }
        Ok(())
    }
}
