//! Checked distributions of a parameter.

use std::collections::BTreeMap;

use closecall_traffic::statistics::normal::TruncatedStandardNormal;
use closecall_traffic::statistics::quantiles;
use closecall_traffic::{ConfigError, KeyPath, Problem, Range, Value, maths};

use super::Variation;
use super::config::{EmpiricalConfig, LogNormalConfig, TruncatedNormalConfig, UniformConfig};

/// Largest magnitude of a number in a distribution. It is far above every quantity of a scenario,
/// and sums and products of such numbers stay finite.
const MAGNITUDE_LIMIT: f64 = 1e12;

/// Range of all numbers up to the largest magnitude.
pub(super) const FINITE: Range = Range::closed(-MAGNITUDE_LIMIT, MAGNITUDE_LIMIT);

/// Range of all positive numbers up to the largest magnitude.
const POSITIVE: Range = Range::above(0.0, MAGNITUDE_LIMIT);

/// Returns the range from `low` up to the largest magnitude.
pub(super) const fn at_least(low: f64) -> Range {
    Range::closed(low, MAGNITUDE_LIMIT)
}

/// Smallest probability that is distinguished from 0: half the spacing 2⁻⁵³ of the numbers of the
/// random generator. The quantile at 0 of an unbounded distribution is its quantile at this
/// probability, and therefore finite.
const SMALLEST_PROBABILITY: f64 = f64::EPSILON / 4.0;

/// Largest standard deviation of a logarithm (-), at which the quartiles already differ by a factor
/// of 700,000.
const LARGEST_SIGMA: f64 = 10.0;

/// Probability of the median, and the middle of a cell of a grid.
const HALF: f64 = 0.5;

/// The distribution of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution(Kind);

/// The kind of a distribution, with its checked parameters.
#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Uniform { min: f64, max: f64 },
    TruncatedNormal { mean: f64, sd: f64, bounds: [f64; 2], standard: TruncatedStandardNormal },
    LogNormal { median: f64, sigma: f64, cut: [Option<f64>; 2], standard: TruncatedStandardNormal },
    Choice(WeightedLabels),
    Empirical { quantiles: Vec<f64> },
    Fixed(Value),
}

/// Labels with a positive probability, in the order of the labels.
#[derive(Clone, Debug, PartialEq)]
struct WeightedLabels {
    labels: Vec<String>,
    /// Cumulative probability of each label and all before it.
    cumulative: Vec<f64>,
    /// Indices of the labels, the most probable first; equally probable ones in the order of the
    /// labels.
    by_weight: Vec<usize>,
}

impl Distribution {
    /// Creates a uniform distribution between two bounds.
    ///
    /// # Errors
    /// Returns an error unless both bounds are finite and the upper one is larger.
    pub fn uniform(config: &UniformConfig) -> Result<Self, ConfigError> {
        let [min, max] = bounds(config.min, config.max)?;
        Ok(Self(Kind::Uniform { min, max }))
    }

    /// Creates a normal distribution, truncated at two bounds.
    ///
    /// # Errors
    /// Returns an error unless all numbers are finite, the standard deviation is positive, the
    /// upper bound is larger than the lower one, and some probability is left between them.
    pub fn truncated_normal(config: &TruncatedNormalConfig) -> Result<Self, ConfigError> {
        let mean = FINITE.check(config.mean, "mean")?;
        let sd = POSITIVE.check(config.sd, "sd")?;
        let [min, max] = bounds(config.min, config.max)?;
        let standard = TruncatedStandardNormal::new((min - mean) / sd, (max - mean) / sd).ok_or_else(|| {
            let rule = format!("no probability is left between `min` and `max` (sd {sd})");
            ConfigError::new("mean", Problem::Contradiction { other: "min", rule })
        })?;
        Ok(Self(Kind::TruncatedNormal { mean, sd, bounds: [min, max], standard }))
    }

    /// Creates a log-normal distribution, which may be truncated at either end.
    ///
    /// # Errors
    /// Returns an error unless all numbers are finite, all but `min` positive, `min` is not
    /// negative, and some probability is left between the bounds.
    pub fn log_normal(config: &LogNormalConfig) -> Result<Self, ConfigError> {
        let median = POSITIVE.check(config.median, "median")?;
        let sigma = Range::above(0.0, LARGEST_SIGMA).check(config.sigma, "sigma")?;
        let max = config.max.map(|max| POSITIVE.check(max, "max")).transpose()?;
        let min = config.min.map(|min| at_least(0.0).check(min, "min")).transpose()?;
        // A log-normal value is positive: 0 cuts nothing off.
        let min = min.filter(|&min| min > 0.0);
        let high = max.map_or(f64::INFINITY, |max| maths::ln(max / median) / sigma);
        let low = min.map_or(f64::NEG_INFINITY, |min| maths::ln(min / median) / sigma);
        let standard = TruncatedStandardNormal::new(low, high).ok_or_else(|| {
            let rule = format!("no probability is left between `min` and `max` (sigma {sigma})");
            ConfigError::new(
                if max.is_some() { "max" } else { "min" },
                Problem::Contradiction { other: "median", rule },
            )
        })?;
        Ok(Self(Kind::LogNormal { median, sigma, cut: [min, max], standard }))
    }

    /// Creates a choice of one of several labels. A label with weight 0 never occurs.
    ///
    /// # Errors
    /// Returns an error unless every label contains a visible character, every weight is finite and
    /// not negative, and at least one weight is positive.
    pub fn choice(weights: &BTreeMap<String, f64>) -> Result<Self, ConfigError> {
        for (label, &weight) in weights {
            check_label(label).map_err(|problem| ConfigError::new(label, problem))?;
            at_least(0.0).check(weight, label)?;
        }
        let possible: Vec<(&String, f64)> =
            weights.iter().filter(|(_, weight)| **weight > 0.0).map(|(label, weight)| (label, *weight)).collect();
        let total: f64 = possible.iter().map(|(_, weight)| weight).sum();
        if possible.is_empty() {
            return Err(own_error(Problem::Missing { needed: "a label with a weight above 0" }));
        }
        let mut sum = 0.0;
        let cumulative = possible.iter().map(|(_, weight)| {
            sum += weight;
            sum / total
        });
        let mut by_weight: Vec<usize> = (0..possible.len()).collect();
        by_weight.sort_by(|&a, &b| possible[b].1.total_cmp(&possible[a].1).then(a.cmp(&b)));
        Ok(Self(Kind::Choice(WeightedLabels {
            cumulative: cumulative.collect(),
            labels: possible.iter().map(|(label, _)| (*label).clone()).collect(),
            by_weight,
        })))
    }

    /// Creates a distribution from quantiles at equally spaced probabilities from 0 to 1, with
    /// linear interpolation.
    ///
    /// # Errors
    /// Returns an error unless there are two or more finite numbers in non-descending order.
    pub fn empirical(config: &EmpiricalConfig) -> Result<Self, ConfigError> {
        let quantiles = &config.quantiles;
        if quantiles.len() < 2 {
            let problem = Problem::WrongLength { value: quantiles.len() as u64, allowed: "at least 2" };
            return Err(ConfigError::new("quantiles", problem));
        }
        for (index, &value) in quantiles.iter().enumerate() {
            let allowed = if index == 0 { FINITE } else { at_least(quantiles[index - 1]) };
            if !allowed.contains(value) {
                let error = own_error(Problem::OutOfRange { value, allowed });
                return Err(error.within_index(index).within("quantiles"));
            }
        }
        Ok(Self(Kind::Empirical { quantiles: quantiles.clone() }))
    }

    /// Creates a distribution that always has the same value.
    ///
    /// # Errors
    /// Returns an error unless the value is a finite number or a label with a visible character.
    pub fn fixed(value: &Value) -> Result<Self, ConfigError> {
        match value {
            Value::Number(number) if !FINITE.contains(*number) => {
                Err(own_error(Problem::OutOfRange { value: *number, allowed: FINITE }))
            }
            Value::Label(label) => check_label(label).map_err(own_error).map(|()| Self(Kind::Fixed(value.clone()))),
            Value::Number(_) => Ok(Self(Kind::Fixed(value.clone()))),
        }
    }

    /// Returns the quantile at probability `u`, for `u` in [0, 1).
    ///
    /// For labels, this is the first label in their order whose cumulative probability exceeds `u`.
    pub fn quantile(&self, u: f64) -> Value {
        debug_assert!((0.0..1.0).contains(&u), "quantile at {u}");
        match &self.0 {
            Kind::Uniform { min, max } => Value::Number((min + u * (max - min)).clamp(*min, *max)),
            Kind::TruncatedNormal { mean, sd, bounds: [min, max], standard } => {
                Value::Number((mean + sd * standard.quantile(u)).clamp(*min, *max))
            }
            Kind::LogNormal { median, sigma, cut: [min, max], standard } => {
                let z = standard.quantile(u.max(SMALLEST_PROBABILITY));
                let value = (median * maths::exp(sigma * z)).min(max.unwrap_or(f64::INFINITY));
                Value::Number(value.max(min.unwrap_or(0.0)))
            }
            Kind::Choice(weights) => {
                let index = weights.cumulative.partition_point(|&cumulative| cumulative <= u);
                Value::Label(weights.labels[index.min(weights.labels.len() - 1)].clone())
            }
            Kind::Empirical { quantiles: values } => Value::Number(quantiles::quantile(values, u)),
            Kind::Fixed(value) => value.clone(),
        }
    }

    /// Returns the nominal value: the median, or the most probable label (the first of several).
    pub fn nominal(&self) -> Value {
        match &self.0 {
            Kind::Choice(weights) => Value::Label(weights.labels[weights.by_weight[0]].clone()),
            _ => self.quantile(HALF),
        }
    }

    /// Returns the cumulative probability at `x`, or `None` for labels.
    pub fn cdf(&self, x: f64) -> Option<f64> {
        match &self.0 {
            Kind::Uniform { min, max } => Some(((x - min) / (max - min)).clamp(0.0, 1.0)),
            Kind::TruncatedNormal { mean, sd, standard, .. } => Some(standard.cdf((x - mean) / sd)),
            Kind::LogNormal { .. } if x <= 0.0 => Some(0.0),
            Kind::LogNormal { median, sigma, standard, .. } => Some(standard.cdf(maths::ln(x / median) / sigma)),
            Kind::Empirical { quantiles: values } => Some(quantiles::cdf(values, x)),
            Kind::Fixed(Value::Number(value)) => Some(if x < *value { 0.0 } else { 1.0 }),
            Kind::Choice(_) | Kind::Fixed(Value::Label(_)) => None,
        }
    }

    /// Returns how far a value is from the nominal one (standard deviations, with sign): the
    /// standard normal number with the same cumulative probability. The nominal label is at 0, and
    /// any other label at the number nearest to 0 that gives it. Returns `None` for a value that
    /// the distribution never takes, and at a bound, which is infinitely far.
    pub fn distance_sd(&self, value: &Value) -> Option<f64> {
        if *value == self.nominal() {
            return Some(0.0);
        }
        let probability = match value {
            Value::Number(number) => self.cdf(*number)?,
            Value::Label(label) => {
                let [low, high] = self.interval_of(label)?;
                HALF.clamp(low, high)
            }
        };
        let normal = TruncatedStandardNormal::new(f64::NEG_INFINITY, f64::INFINITY)?;
        (probability > 0.0 && probability < 1.0).then(|| normal.quantile(probability))
    }

    /// Returns the numbers u whose quantile is this label; `None` if it is none of the
    /// distribution's.
    pub(crate) fn interval_of(&self, label: &str) -> Option<[f64; 2]> {
        let index = self.labels().iter().position(|one| one == label)?;
        match &self.0 {
            Kind::Choice(WeightedLabels { cumulative, .. }) => {
                Some([index.checked_sub(1).map_or(0.0, |before| cumulative[before]), cumulative[index]])
            }
            _ => Some([0.0, 1.0]),
        }
    }

    /// Returns the smallest and the largest number, or `None` for labels.
    ///
    /// If a distribution is unbounded, the probability beyond the returned bound is 10⁻¹⁶.
    pub fn bounds(&self) -> Option<[f64; 2]> {
        match &self.0 {
            Kind::Uniform { min, max } | Kind::TruncatedNormal { bounds: [min, max], .. } => Some([*min, *max]),
            Kind::LogNormal { median, sigma, cut: [min, max], standard } => {
                let at = |u| median * maths::exp(sigma * standard.quantile(u));
                let low = min.unwrap_or_else(|| at(SMALLEST_PROBABILITY));
                Some([low, max.unwrap_or_else(|| at(1.0 - 2.0 * SMALLEST_PROBABILITY))])
            }
            Kind::Empirical { quantiles } => Some([quantiles[0], quantiles[quantiles.len() - 1]]),
            Kind::Fixed(Value::Number(value)) => Some([*value, *value]),
            Kind::Choice(_) | Kind::Fixed(Value::Label(_)) => None,
        }
    }

    /// Returns the labels that can occur, in their order; empty for numbers.
    pub fn labels(&self) -> &[String] {
        match &self.0 {
            Kind::Choice(weights) => &weights.labels,
            Kind::Fixed(Value::Label(label)) => std::slice::from_ref(label),
            _ => &[],
        }
    }

    /// Returns how much the value varies.
    pub fn variation(&self) -> Variation {
        match &self.0 {
            Kind::Choice(weights) if weights.labels.len() > 1 => Variation::Discrete,
            Kind::Choice(_) | Kind::Fixed(_) => Variation::None,
            Kind::Uniform { .. } | Kind::TruncatedNormal { .. } | Kind::LogNormal { .. } | Kind::Empirical { .. } => {
                match self.bounds() {
                    Some([low, high]) if low < high => Variation::Continuous,
                    _ => Variation::None,
                }
            }
        }
    }

    /// Returns true if the value is always the same.
    pub fn is_fixed(&self) -> bool {
        matches!(self.0, Kind::Fixed(_))
    }

    /// Returns the largest number of levels that a grid can have: 1 if fixed, the number of labels,
    /// or no limit.
    pub(crate) fn max_levels(&self) -> u64 {
        match &self.0 {
            Kind::Choice(weights) => weights.labels.len() as u64,
            Kind::Fixed(_) => 1,
            _ => u64::MAX,
        }
    }

    /// Returns level number `level` of `count` levels: the medians of as many equally probable
    /// parts, or the most probable labels.
    pub(crate) fn level(&self, level: u64, count: u64) -> Value {
        match &self.0 {
            Kind::Choice(weights) => Value::Label(weights.labels[weights.by_weight[level as usize]].clone()),
            _ => self.quantile((level as f64 + HALF) / count as f64),
        }
    }
}

/// Returns an error that refers to the distribution itself, not to one of its keys.
fn own_error(problem: Problem) -> ConfigError {
    ConfigError { path: KeyPath::default(), problem }
}

/// Checks the bounds `min` and `max`.
fn bounds(min: f64, max: f64) -> Result<[f64; 2], ConfigError> {
    let min = FINITE.check(min, "min")?;
    let max = Range::above(min, MAGNITUDE_LIMIT).check(max, "max")?;
    Ok([min, max])
}

/// Checks that a label contains a visible character.
fn check_label(label: &str) -> Result<(), Problem> {
    if label.trim().is_empty() { Err(Problem::Missing { needed: "a label that is not empty" }) } else { Ok(()) }
}
