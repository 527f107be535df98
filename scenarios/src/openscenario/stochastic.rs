//! Distributions of the parameters of a scenario: `Stochastic`.
//!
//! ```text
//!  Stochastic ─▶ a distribution of each parameter ─┬─▶ draw 1, 2, … of `numberOfTestRuns` ─▶ values
//!                                                  └─▶ the distributions of a scenario file, if it has such
//! ```
//!
//! All distributions are drawn through their quantile functions. A parameter of a scenario file has
//! the same distribution if it has one of this form: see [`Marginal::config`].
//!
//! A `Range` truncates a distribution. The expected value and the variance are the ones before
//! truncation. For a log-normal distribution, they belong to the value itself, and not to its
//! logarithm: σ² = ln(1 + v / m²), and the median is m / √(1 + v / m²), for the expected value m
//! and the variance v. `tool export` writes them in the same way. The schema of the standard has
//! the same two attributes as for a normal distribution.

use std::collections::BTreeMap;

use closecall_traffic::{Value, maths};
use rand::RngExt;

use super::dom::{ImportError, Node};
use super::reader::Reader;
use super::structure::Given;
use crate::parameters::{Distribution, LogNormalConfig, ParameterConfig, TruncatedNormalConfig};
use crate::sampling::scenario_stream;

/// Distance from the mean at which a normal distribution without a range is truncated (standard
/// deviations). The probability beyond is below 10⁻¹⁶, and no double-precision number between 0 and
/// 1 leads there.
const UNBOUNDED_SD: f64 = 8.25;
/// Largest number of quantiles into which a histogram is divided.
const MOST_QUANTILES: u32 = 1_000;
/// Deviation of a weight from a whole number of parts of a histogram: numerical.
const ROUNDING: f64 = 1e-9;
/// Largest expected value of a Poisson distribution, which bounds the list of its numbers.
const MOST_EXPECTED: f64 = 1e6;
/// Distance from the expected value at which a Poisson distribution ends (standard deviations, and
/// numbers beside). The probability beyond is below 10⁻¹⁶.
const POISSON_END: f64 = 40.0;
/// Largest double-precision number below 2⁶⁴, the number of seeds.
const MOST_WHOLE: f64 = 18_446_744_073_709_549_568.0;

/// The distributions of a file.
#[derive(Clone, Debug)]
pub(super) struct Stochastic {
    /// Number of test runs: the number of draws.
    pub(super) runs: u64,
    /// Seed of the draws; `None` if the file states none.
    pub(super) seed: Option<u64>,
    pub(super) marginals: Vec<Marginal>,
    pub(super) notes: Vec<String>,
}

/// The distribution of one parameter.
#[derive(Clone, Debug)]
pub(super) struct Marginal {
    /// Name of the parameter in the file.
    pub(super) name: String,
    pub(super) line: usize,
    /// Name of the element, such as `NormalDistribution`.
    pub(super) element: String,
    shape: Shape,
}

#[derive(Clone, Debug)]
enum Shape {
    /// A distribution that a parameter of a scenario file can have.
    Number(Box<(ParameterConfig, Distribution)>),
    /// Intervals with uniform distributions, sorted by their lower limits, and their weights.
    Histogram { bins: Vec<[f64; 2]>, weights: Vec<f64> },
    /// Single values and their weights.
    Values { values: Vec<String>, weights: Vec<f64> },
}

impl Stochastic {
    /// Returns the values of a draw, from 1.
    pub(super) fn draw(&self, number: u64) -> Given {
        let value = |marginal: &Marginal| {
            let channel = format!("parameter/{}", marginal.name);
            let u = scenario_stream(self.seed.unwrap_or_default(), number.saturating_sub(1), &channel).random();
            (marginal.name.clone(), marginal.quantile(u))
        };
        self.marginals.iter().map(value).collect()
    }
}

impl Marginal {
    /// Returns the quantile at probability `u`, in [0, 1).
    fn quantile(&self, u: f64) -> String {
        match &self.shape {
            Shape::Number(number) => number.1.quantile(u).to_string(),
            Shape::Histogram { bins, weights } => {
                let (index, share) = chosen(weights, u);
                let [low, high] = bins[index];
                (low + share * (high - low)).clamp(low, high).to_string()
            }
            Shape::Values { values, weights } => values[chosen(weights, u).0].clone(),
        }
    }

    /// Returns the distribution as a parameter of a scenario file has it. `has_labels` says that
    /// the parameter takes labels, and no numbers.
    ///
    /// # Errors
    /// The message, if no distribution of a scenario file is the same.
    pub(super) fn config(&self, has_labels: bool) -> Result<ParameterConfig, String> {
        let labels = || "the parameter of the scenario takes labels, and this distribution has numbers".to_owned();
        match &self.shape {
            _ if has_labels && !matches!(self.shape, Shape::Values { .. }) => Err(labels()),
            Shape::Number(number) => Ok(number.0.clone()),
            Shape::Histogram { bins, weights } => Ok(ParameterConfig::empirical(quantiles(bins, weights)?)),
            Shape::Values { values, weights } => {
                let possible: BTreeMap<String, f64> = values
                    .iter()
                    .zip(weights)
                    .filter(|(_, weight)| **weight > 0.0)
                    .map(|(value, weight)| (value.clone(), *weight))
                    .collect();
                match possible.first_key_value() {
                    Some((value, _)) if possible.len() == 1 => Ok(ParameterConfig::fixed(fixed(value, has_labels)?)),
                    _ if has_labels => Ok(ParameterConfig { choice: Some(possible), ..ParameterConfig::default() }),
                    _ => {
                        Err("it has several single numbers, and a parameter of a scenario file takes several numbers \
                              only from a continuous distribution: choose one draw with its values"
                            .to_owned())
                    }
                }
            }
        }
    }
}

fn fixed(value: &str, is_label: bool) -> Result<Value, String> {
    if is_label {
        return Ok(Value::Label(value.to_owned()));
    }
    match value.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(Value::Number(number)),
        _ => Err(format!("`{value}` is not a number, and the parameter of the scenario takes numbers")),
    }
}

/// Returns the index of the weight in which a number `u` in [0, 1) falls, and its place in it, from
/// 0 to 1.
fn chosen(weights: &[f64], u: f64) -> (usize, f64) {
    let mut rest = u * weights.iter().sum::<f64>();
    for (index, weight) in weights.iter().enumerate() {
        if rest < *weight {
            return (index, rest / weight);
        }
        rest -= weight;
    }
    // Rounding can lead beyond the last weight.
    (weights.iter().rposition(|weight| *weight > 0.0).unwrap_or_default(), 1.0)
}

/// Returns the quantiles at equally spaced probabilities of a histogram: each bin is divided into
/// as many equal parts as its weight has shares.
fn quantiles(bins: &[[f64; 2]], weights: &[f64]) -> Result<Vec<f64>, String> {
    let used: Vec<_> = bins.iter().zip(weights).filter(|(_, weight)| **weight > 0.0).collect();
    if let Some(pair) = used.windows(2).find(|pair| pair[0].0[1] != pair[1].0[0]) {
        return Err(format!(
            "a bin ends at {} and the next begins at {}, and a distribution by quantiles has neither gaps nor overlaps: \
             choose one draw with its values",
            pair[0].0[1], pair[1].0[0]
        ));
    }
    let least = used.iter().map(|(_, weight)| **weight).fold(f64::INFINITY, f64::min);
    let parts_of = |division: u32| -> Option<Vec<u32>> {
        let mut total = 0;
        let mut parts = Vec::with_capacity(used.len());
        for (_, weight) in &used {
            let exact = f64::from(division) * **weight / least;
            if !(exact <= f64::from(MOST_QUANTILES)) || (exact - exact.round()).abs() > ROUNDING * exact {
                return None;
            }
            let count = exact.round();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 1 to 1000")]
            let count = count as u32;
            total += count;
            parts.push(count);
        }
        (total <= MOST_QUANTILES).then_some(parts)
    };
    let Some(parts) = (1..=MOST_QUANTILES).find_map(parts_of) else {
        return Err(format!(
            "its weights are no multiples of one weight that divides the histogram into {MOST_QUANTILES} parts or fewer: \
             choose one draw with its values"
        ));
    };
    let mut quantiles: Vec<f64> = used.first().map(|([low, _], _)| *low).into_iter().collect();
    for (([low, high], _), count) in used.into_iter().zip(parts) {
        quantiles.extend((1..count).map(|part| low + (high - low) * f64::from(part) / f64::from(count)));
        quantiles.push(*high);
    }
    Ok(quantiles)
}

/// Reads the distributions of a document, which [`super::structure::check`] has checked.
///
/// # Errors
/// [`ImportError`] at a distribution that is not read, or that has no probability.
pub(super) fn read(reader: &Reader, node: &Node) -> Result<Stochastic, ImportError> {
    let runs = whole(reader, node, "numberOfTestRuns", 1.0)?;
    let seed = node.raw("randomSeed").is_some().then(|| whole(reader, node, "randomSeed", 0.0)).transpose()?;
    let mut stochastic = Stochastic { runs, seed, marginals: Vec::new(), notes: Vec::new() };
    for child in node.all("StochasticDistribution") {
        let name = reader.text(child, "parameterName")?;
        if stochastic.marginals.iter().any(|other| other.name == name) {
            return Err(reader.error(child, format!("`{name}` has a distribution already, and can have only one")));
        }
        let inner = reader.only(child)?;
        let shape = shape(reader, inner, &mut stochastic.notes)?;
        stochastic.marginals.push(Marginal { name, line: inner.line, element: inner.name.clone(), shape });
    }
    match stochastic.marginals.is_empty() {
        true => Err(reader.error(node, "it needs a `StochasticDistribution`")),
        false => Ok(stochastic),
    }
}

fn whole(reader: &Reader, node: &Node, name: &str, least: f64) -> Result<u64, ImportError> {
    let value = reader.number(node, name)?;
    if !(least..=MOST_WHOLE).contains(&value) || value.fract() != 0.0 {
        let message = format!("`{name}` is {value}; a whole number from {least} and below 2^64 is needed");
        return Err(reader.error(node, message));
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number in the range above")]
    let value = value as u64;
    Ok(value)
}

fn shape(reader: &Reader, node: &Node, notes: &mut Vec<String>) -> Result<Shape, ImportError> {
    match node.name.as_str() {
        "UniformDistribution" => {
            let [min, max] = range(reader, reader.child(node, &["Range"])?)?;
            number(reader, node, if min < max { ParameterConfig::uniform(min, max) } else { constant(min) })
        }
        "NormalDistribution" => normal(reader, node),
        "LogNormalDistribution" => {
            notes.push(format!(
                "line {}: `{}`: expected value and variance belong to the value itself, and not to its logarithm",
                node.line, node.name
            ));
            log_normal(reader, node)
        }
        "PoissonDistribution" => poisson(reader, node),
        "Histogram" => histogram(reader, node),
        "ProbabilityDistributionSet" => {
            let mut possible: BTreeMap<String, f64> = BTreeMap::new();
            for element in node.all("Element") {
                *possible.entry(reader.text(element, "value")?).or_default() += weight(reader, element)?;
            }
            let (values, weights): (Vec<_>, Vec<_>) = possible.into_iter().unzip();
            check_weights(reader, node, &weights)?;
            Ok(Shape::Values { values, weights })
        }
        _ => Err(reader.error(node, "this distribution is not read")),
    }
}

fn constant(value: f64) -> ParameterConfig {
    ParameterConfig::fixed(Value::Number(value))
}

/// Returns the limits of a range.
fn range(reader: &Reader, node: &Node) -> Result<[f64; 2], ImportError> {
    let limits = [reader.number(node, "lowerLimit")?, reader.number(node, "upperLimit")?];
    match limits[0] <= limits[1] {
        true => Ok(limits),
        false => Err(reader.error(node, format!("`lowerLimit` {} is above `upperLimit` {}", limits[0], limits[1]))),
    }
}

/// Returns the limits that truncate a distribution, or `None` if nothing does.
fn truncation(reader: &Reader, node: &Node) -> Result<Option<[f64; 2]>, ImportError> {
    node.child("Range").map(|limits| range(reader, limits)).transpose()
}

fn number(reader: &Reader, node: &Node, config: ParameterConfig) -> Result<Shape, ImportError> {
    match config.check() {
        Ok(entry) => Ok(Shape::Number(Box::new((config, entry.distribution)))),
        Err(error) => Err(reader.error(node, format!("no distribution of a scenario file: {error}"))),
    }
}

/// Returns the variance, which is at least 0.
fn variance(reader: &Reader, node: &Node) -> Result<f64, ImportError> {
    match reader.number(node, "variance")? {
        variance if variance >= 0.0 => Ok(variance),
        variance => Err(reader.error(node, format!("`variance` is {variance}; a number of at least 0 is needed"))),
    }
}

/// Returns a distribution without variance, which its range must contain.
fn degenerate(reader: &Reader, node: &Node, value: f64, limits: Option<[f64; 2]>) -> Result<Shape, ImportError> {
    match limits.is_none_or(|[low, high]| (low..=high).contains(&value)) {
        true => number(reader, node, constant(value)),
        false => Err(reader.error(node, format!("its only value {value} lies outside its `Range`"))),
    }
}

fn normal(reader: &Reader, node: &Node) -> Result<Shape, ImportError> {
    let (mean, sd) = (reader.number(node, "expectedValue")?, variance(reader, node)?.sqrt());
    let limits = truncation(reader, node)?;
    if sd == 0.0 {
        return degenerate(reader, node, mean, limits);
    }
    let [min, max] = limits.unwrap_or([mean - UNBOUNDED_SD * sd, mean + UNBOUNDED_SD * sd]);
    let normal = ParameterConfig {
        truncated_normal: Some(TruncatedNormalConfig { mean, sd, min, max }),
        ..ParameterConfig::default()
    };
    number(reader, node, if min < max { normal } else { constant(min) })
}

fn log_normal(reader: &Reader, node: &Node) -> Result<Shape, ImportError> {
    let (expected, variance) = (reader.number(node, "expectedValue")?, variance(reader, node)?);
    let limits = truncation(reader, node)?;
    if !(expected > 0.0) {
        return Err(reader.error(node, format!("`expectedValue` is {expected}; a number above 0 is needed")));
    }
    let spread = variance / (expected * expected);
    if spread == 0.0 {
        return degenerate(reader, node, expected, limits);
    }
    if let Some([low, high]) = limits
        && low == high
    {
        return number(reader, node, constant(low));
    }
    let log_normal = LogNormalConfig {
        median: expected / (1.0 + spread).sqrt(),
        sigma: maths::ln_1p(spread).sqrt(),
        // A log-normal value is positive: a limit of 0 cuts nothing off.
        min: limits.map(|[low, _]| low).filter(|low| *low > 0.0),
        max: limits.map(|[_, high]| high),
    };
    number(reader, node, ParameterConfig { log_normal: Some(log_normal), ..ParameterConfig::default() })
}

/// Returns the numbers of a Poisson distribution, and a weight for each. The weight is the
/// probability of the number, divided by the probability of the most probable number.
fn poisson(reader: &Reader, node: &Node) -> Result<Shape, ImportError> {
    let expected = reader.number(node, "expectedValue")?;
    if !(expected > 0.0 && expected <= MOST_EXPECTED) {
        let message = format!("`expectedValue` is {expected}; a number above 0, up to {MOST_EXPECTED}, is needed");
        return Err(reader.error(node, message));
    }
    let limits = truncation(reader, node)?.unwrap_or([0.0, f64::INFINITY]);
    let reach = POISSON_END * (expected.sqrt() + 1.0);
    let low = limits[0].max(expected - reach).max(0.0).ceil();
    let high = limits[1].min(expected + reach).floor();
    if !(low <= high) {
        return Err(reader.error(node, "its `Range` contains no whole number that is probable"));
    }
    // ln(pₖ₊₁ / pₖ) = ln(λ / (k + 1)), counted from the first number.
    let (mut values, mut logarithms, mut logarithm, mut k) = (Vec::new(), Vec::new(), 0.0, low);
    while k <= high {
        values.push(k.to_string());
        logarithms.push(logarithm);
        k += 1.0;
        logarithm += maths::ln(expected / k);
    }
    let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights = logarithms.iter().map(|logarithm| maths::exp(logarithm - largest)).collect();
    Ok(Shape::Values { values, weights })
}

fn histogram(reader: &Reader, node: &Node) -> Result<Shape, ImportError> {
    let mut bins: Vec<([f64; 2], f64)> = Vec::new();
    for bin in node.all("Bin") {
        bins.push((range(reader, reader.child(bin, &["Range"])?)?, weight(reader, bin)?));
    }
    bins.sort_by(|(a, _), (b, _)| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let (bins, weights): (Vec<_>, Vec<_>) = bins.into_iter().unzip();
    check_weights(reader, node, &weights)?;
    Ok(Shape::Histogram { bins, weights })
}

fn weight(reader: &Reader, node: &Node) -> Result<f64, ImportError> {
    match reader.number(node, "weight")? {
        weight if weight >= 0.0 => Ok(weight),
        weight => Err(reader.error(node, format!("`weight` is {weight}; a number of at least 0 is needed"))),
    }
}

/// Checks that one of the weights is positive, and that their sum is finite.
fn check_weights(reader: &Reader, node: &Node, weights: &[f64]) -> Result<(), ImportError> {
    let total: f64 = weights.iter().sum();
    match total > 0.0 && total.is_finite() {
        true => Ok(()),
        false => Err(reader.error(node, "one weight must be above 0, and the sum of all finite")),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::dom::parse;
    use super::*;

    const LIMITS: &str = "<Range lowerLimit=\"1\" upperLimit=\"4\"/>";

    fn stochastic(attributes: &str, distributions: &[(&str, &str)]) -> Result<Stochastic, String> {
        let inner: String = distributions
            .iter()
            .map(|(name, inner)| {
                format!("<StochasticDistribution parameterName=\"{name}\">{inner}</StochasticDistribution>")
            })
            .collect();
        let reader = Reader { path: Path::new("values.xosc").to_owned() };
        let root = parse(&reader.path, &format!("<Stochastic {attributes}>{inner}</Stochastic>")).unwrap();
        read(&reader, &root).map_err(|error| error.to_string())
    }

    fn marginal(inner: &str) -> Result<Marginal, String> {
        Ok(stochastic("numberOfTestRuns=\"1\"", &[("a", inner)])?.marginals.remove(0))
    }

    /// Returns the mean and the variance of the numbers at equally spaced probabilities.
    fn moments(marginal: &Marginal) -> (f64, f64) {
        const COUNT: u32 = 20_000;
        let at = |index: u32| (f64::from(index) + 0.5) / f64::from(COUNT);
        let values: Vec<f64> = (0..COUNT).map(|index| marginal.quantile(at(index)).parse().unwrap()).collect();
        let mean = values.iter().sum::<f64>() / f64::from(COUNT);
        (mean, values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / f64::from(COUNT))
    }

    #[test]
    fn each_distribution_has_the_mean_and_the_variance_that_its_formula_gives() {
        let bins = "<Bin weight=\"1\"><Range lowerLimit=\"0\" upperLimit=\"2\"/></Bin>\
                    <Bin weight=\"3\"><Range lowerLimit=\"4\" upperLimit=\"6\"/></Bin>";
        let set = "<Element value=\"2\" weight=\"1\"/><Element value=\"5\" weight=\"2\"/>";
        let cases = [
            (format!("<UniformDistribution>{LIMITS}</UniformDistribution>"), 2.5, 0.75),
            ("<NormalDistribution expectedValue=\"3\" variance=\"4\"/>".to_owned(), 3.0, 4.0),
            ("<LogNormalDistribution expectedValue=\"3\" variance=\"0.5\"/>".to_owned(), 3.0, 0.5),
            ("<PoissonDistribution expectedValue=\"7.5\"/>".to_owned(), 7.5, 7.5),
            // Means of 1 and 5 with a within-bin variance of 1/3.
            (format!("<Histogram>{bins}</Histogram>"), 4.0, 3.0 + 1.0 / 3.0),
            (format!("<ProbabilityDistributionSet>{set}</ProbabilityDistributionSet>"), 4.0, 2.0),
        ];
        for (inner, mean, variance) in cases {
            let (is_mean, is_variance) = moments(&marginal(&inner).unwrap());
            assert!((is_mean - mean).abs() < 2e-3 * mean, "{inner}: {is_mean}");
            assert!((is_variance - variance).abs() < 5e-3 * variance, "{inner}: {is_variance}");
        }
    }

    #[test]
    fn a_range_truncates() {
        for inner in [
            format!("<NormalDistribution expectedValue=\"3\" variance=\"9\">{LIMITS}</NormalDistribution>"),
            format!("<LogNormalDistribution expectedValue=\"3\" variance=\"9\">{LIMITS}</LogNormalDistribution>"),
            format!("<PoissonDistribution expectedValue=\"3\">{LIMITS}</PoissonDistribution>"),
        ] {
            let marginal = marginal(&inner).unwrap();
            let ends = [0.0, 1.0 - 1e-12].map(|u| marginal.quantile(u).parse::<f64>().unwrap());
            assert!((ends[0] - 1.0).abs() < 1e-9 && (ends[1] - 4.0).abs() < 1e-9, "{inner}: {ends:?}");
        }
        // p₁ to p₄ of a Poisson distribution with λ = 3 are as 3, 4.5, 4.5, 3.375.
        let inner = format!("<PoissonDistribution expectedValue=\"3\">{LIMITS}</PoissonDistribution>");
        let Shape::Values { weights, .. } = marginal(&inner).unwrap().shape else { panic!("{inner}") };
        for (weight, right) in weights.iter().zip([3.0, 4.5, 4.5, 3.375]) {
            assert!((weight - right / 4.5).abs() < 1e-12, "{weights:?}");
        }
    }

    #[test]
    fn a_normal_distribution_without_a_range_ends_where_no_probability_is_left() {
        assert!(0.5 * maths::erfc(UNBOUNDED_SD * std::f64::consts::FRAC_1_SQRT_2) < 1e-16);
        let config =
            marginal("<NormalDistribution expectedValue=\"3\" variance=\"4\"/>").unwrap().config(false).unwrap();
        let normal = config.truncated_normal.unwrap();
        assert_eq!((normal.mean, normal.sd, normal.min, normal.max), (3.0, 2.0, -13.5, 19.5));
    }

    #[test]
    fn a_histogram_with_weights_becomes_quantiles_with_the_same_probabilities() {
        let bin = |weight: &str, low: f64, high: f64| {
            format!("<Bin weight=\"{weight}\"><Range lowerLimit=\"{low}\" upperLimit=\"{high}\"/></Bin>")
        };
        let of = |bins: &[String]| marginal(&format!("<Histogram>{}</Histogram>", bins.concat())).unwrap();
        let histogram = of(&[bin("0.3", 2.0, 3.0), bin("0.2", 1.0, 2.0), bin("0", 3.0, 9.0)]);
        let config = histogram.config(false).unwrap();
        let quantiles = config.empirical.clone().unwrap().quantiles;
        assert_eq!(quantiles.len(), 6);
        for (quantile, right) in quantiles.iter().zip([1.0, 1.5, 2.0, 2.0 + 1.0 / 3.0, 2.0 + 2.0 / 3.0, 3.0]) {
            assert!((quantile - right).abs() < 1e-12, "{quantiles:?}");
        }
        let distribution = config.check().unwrap().distribution;
        for u in [0.0, 0.1, 0.39, 0.4, 0.75, 0.999] {
            let Value::Number(number) = distribution.quantile(u) else { panic!("{u}") };
            assert!((number - histogram.quantile(u).parse::<f64>().unwrap()).abs() < 1e-9, "{u}: {number}");
        }
        let gap = of(&[bin("1", 1.0, 2.0), bin("1", 3.0, 4.0)]);
        assert!(gap.config(false).unwrap_err().contains("a bin ends at 2 and the next begins at 3"));
        let uneven = of(&[bin("1", 1.0, 2.0), bin("3.14159265", 2.0, 4.0)]);
        assert!(uneven.config(false).unwrap_err().contains("no multiples of one weight"));
    }

    #[test]
    fn what_no_parameter_of_a_scenario_file_can_have_is_said() {
        let set = |elements: &str| {
            marginal(&format!("<ProbabilityDistributionSet>{elements}</ProbabilityDistributionSet>")).unwrap()
        };
        let (two, one) = ("<Element value=\"2\" weight=\"1\"/>", "<Element value=\"5\" weight=\"2\"/>");
        assert!(set(&[two, one].concat()).config(false).unwrap_err().contains("several single numbers"));
        let poisson = marginal("<PoissonDistribution expectedValue=\"7.5\"/>").unwrap();
        assert!(poisson.config(false).unwrap_err().contains("several single numbers"));
        assert_eq!(set(two).config(false).unwrap().fixed, Some(Value::Number(2.0)));
        let labels = set(&[two, one].concat()).config(true).unwrap().choice.unwrap();
        assert_eq!(labels, BTreeMap::from([("2".to_owned(), 1.0), ("5".to_owned(), 2.0)]));
        let uniform = marginal(&format!("<UniformDistribution>{LIMITS}</UniformDistribution>")).unwrap();
        assert!(uniform.config(true).unwrap_err().contains("takes labels"));
        assert!(
            set("<Element value=\"van\" weight=\"1\"/>").config(false).unwrap_err().contains("`van` is not a number")
        );
    }

    #[test]
    fn a_wrong_distribution_is_refused() {
        let upside_down = "<Range lowerLimit=\"4\" upperLimit=\"1\"/>";
        let bin = "<Bin weight=\"-1\"><Range lowerLimit=\"1\" upperLimit=\"2\"/></Bin>";
        for (inner, word) in [
            (format!("<UniformDistribution>{upside_down}</UniformDistribution>"), "is above `upperLimit` 1"),
            ("<UniformDistribution/>".to_owned(), "it needs `Range`"),
            ("<NormalDistribution expectedValue=\"3\" variance=\"-4\"/>".to_owned(), "`variance` is -4"),
            (
                format!("<NormalDistribution expectedValue=\"9\" variance=\"0\">{LIMITS}</NormalDistribution>"),
                "its only value 9 lies outside",
            ),
            (
                format!("<NormalDistribution expectedValue=\"900\" variance=\"1\">{LIMITS}</NormalDistribution>"),
                "no probability is left",
            ),
            ("<LogNormalDistribution expectedValue=\"0\" variance=\"4\"/>".to_owned(), "above 0 is needed"),
            ("<PoissonDistribution expectedValue=\"-2\"/>".to_owned(), "`expectedValue` is -2"),
            (
                "<PoissonDistribution expectedValue=\"2\"><Range lowerLimit=\"1.2\" upperLimit=\"1.8\"/>\
                 </PoissonDistribution>"
                    .to_owned(),
                "no whole number",
            ),
            (format!("<Histogram>{bin}</Histogram>"), "`weight` is -1"),
            ("<Histogram/>".to_owned(), "one weight must be above 0"),
            ("<ProbabilityDistributionSet/>".to_owned(), "one weight must be above 0"),
            ("<UserDefinedDistribution/>".to_owned(), "`UserDefinedDistribution`: this distribution is not read"),
        ] {
            let message = marginal(&inner).unwrap_err();
            assert!(message.contains("values.xosc:1: `") && message.contains(word), "{message}");
        }
        let uniform = format!("<UniformDistribution>{LIMITS}</UniformDistribution>");
        let one = [("a", uniform.as_str())];
        for (attributes, distributions, word) in [
            ("", &one[..], "it needs `numberOfTestRuns`"),
            ("numberOfTestRuns=\"0\"", &one[..], "`numberOfTestRuns` is 0; a whole number from 1"),
            ("numberOfTestRuns=\"1\" randomSeed=\"0.5\"", &one[..], "`randomSeed` is 0.5"),
            ("numberOfTestRuns=\"1\" randomSeed=\"-1\"", &one[..], "`randomSeed` is -1; a whole number from 0"),
            ("numberOfTestRuns=\"1\" randomSeed=\"2e19\"", &one[..], "below 2^64 is needed"),
            ("numberOfTestRuns=\"1\"", &one[..0], "it needs a `StochasticDistribution`"),
            ("numberOfTestRuns=\"1\"", &[one[0], one[0]][..], "`a` has a distribution already"),
        ] {
            let message = stochastic(attributes, distributions).unwrap_err();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn a_draw_depends_on_the_seed_its_number_and_the_parameter() {
        let uniform = format!("<UniformDistribution>{LIMITS}</UniformDistribution>");
        let both = [("a", uniform.as_str()), ("b", uniform.as_str())];
        let of = |seed: &str| stochastic(&format!("numberOfTestRuns=\"3\" randomSeed=\"{seed}\""), &both).unwrap();
        let (first, second) = (of("1"), of("2"));
        assert_eq!(first.draw(1), of("1").draw(1));
        assert_ne!(first.draw(1), first.draw(2));
        assert_ne!(first.draw(1), second.draw(1));
        assert_ne!(first.draw(1)["a"], first.draw(1)["b"]);
        // The standard has a double-precision number as seed: other forms of 1, and large seeds.
        for same in ["1.0", "1e0", "10E-1", "+1"] {
            assert_eq!(first.draw(2), of(same).draw(2), "{same}");
        }
        assert_eq!(of("1.5e3").seed, Some(1_500));
        assert_eq!(of("12345678901234568").seed, Some(12_345_678_901_234_568));
        assert_eq!(of("18446744073709549568").seed, Some(18_446_744_073_709_549_568));
    }
}
