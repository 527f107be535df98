//! Empirical quantiles and parametric forms, with their confidence interval and goodness of fit.

use closecall_traffic::statistics::normal::TruncatedStandardNormal;
use closecall_traffic::statistics::quantiles::{median, quantile};
use closecall_traffic::{Stream, maths};
use rand::{RngExt, SeedableRng};

use super::Quantity;

/// Least number of values to which a distribution is fitted.
pub const MIN_VALUES: usize = 5;

/// Largest number of empirical quantiles: the deciles. With fewer values, there are as many
/// quantiles as values.
const QUANTILES: usize = 11;

/// Number of bootstrap resamples for the interval of the median.
const MEDIAN_RESAMPLES: usize = 2_000;

/// Number of bootstrap samples for the probability of a larger Kolmogorov–Smirnov distance.
const GOODNESS_OF_FIT_SAMPLES: usize = 1_000;

/// Number of standard deviations at which a normal distribution is truncated, which keeps 99.7 % of
/// it.
const TRUNCATION_SDS: f64 = 3.0;

/// Probabilities of the lower and upper end of the interval.
const INTERVAL: [f64; 2] = [0.025, 0.975];

/// A parametric form with its parameters, in the quantity's unit unless stated otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// Log-normal distribution.
    LogNormal {
        /// Median.
        median: f64,
        /// Standard deviation of the logarithm (-).
        sigma: f64,
    },
    /// Normal distribution, truncated at both bounds.
    TruncatedNormal {
        /// Mean before truncation.
        mean: f64,
        /// Standard deviation before truncation.
        sd: f64,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
    },
}

/// How well a parametric form fits the values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoodnessOfFit {
    /// Kolmogorov–Smirnov distance: largest difference between the two distribution functions (-).
    pub distance: f64,
    /// Probability of a larger distance if the form were true (-).
    pub p_value: f64,
}

/// The fitted distribution of one quantity, with values in the quantity's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedQuantity {
    /// The quantity.
    pub quantity: Quantity,
    /// Number of values.
    pub n: usize,
    /// Quantiles at equally spaced probabilities from 0 to 1.
    pub quantiles: Vec<f64>,
    /// Median.
    pub median: f64,
    /// Lower and upper end of the 95 % bootstrap interval of the median.
    pub interval_95: [f64; 2],
    /// The parametric form and its goodness of fit.
    ///
    /// `None` if the values do not vary, or if they are not all positive and the form is
    /// log-normal.
    pub form: Option<(Form, GoodnessOfFit)>,
}

impl FittedQuantity {
    /// Fits the distribution of `values`. Returns `None` if there are fewer than [`MIN_VALUES`].
    pub fn new(quantity: Quantity, values: &[f64], seed: u64) -> Option<Self> {
        if values.len() < MIN_VALUES {
            return None;
        }
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let levels = QUANTILES.min(sorted.len());
        let level = |k: usize| k as f64 / (levels - 1) as f64;
        let mut rng = stream(seed, quantity);
        Some(Self {
            quantity,
            n: sorted.len(),
            quantiles: (0..levels).map(|k| quantile(&sorted, level(k))).collect(),
            median: quantile(&sorted, 0.5),
            interval_95: median_interval(&sorted, &mut rng),
            form: Family::of(quantity)
                .fit(&sorted)
                .and_then(|form| Some((form, goodness_of_fit(&sorted, form, &mut rng)?))),
        })
    }
}

/// Returns the random stream of one quantity. Each has its own, so that a further quantity does not
/// change the others.
fn stream(seed: u64, quantity: Quantity) -> Stream {
    let mut hasher = blake3::Hasher::new_derive_key("closecall 2026 bootstrap of fitted distributions v1");
    hasher.update(&seed.to_le_bytes());
    hasher.update(quantity.name().as_bytes());
    Stream::from_seed(*hasher.finalize().as_bytes())
}

/// Returns the percentile bootstrap interval of the median.
fn median_interval(values: &[f64], rng: &mut Stream) -> [f64; 2] {
    let resample =
        |rng: &mut Stream| median((0..values.len()).map(|_| values[rng.random_range(0..values.len())]).collect());
    let mut medians: Vec<f64> = (0..MEDIAN_RESAMPLES).map(|_| resample(rng)).collect();
    medians.sort_by(f64::total_cmp);
    INTERVAL.map(|level| quantile(&medians, level))
}

/// The family of parametric forms that is fitted to a quantity.
#[derive(Clone, Copy)]
enum Family {
    LogNormal,
    TruncatedNormal,
}

impl Family {
    fn of(quantity: Quantity) -> Self {
        match quantity {
            Quantity::CrossingSpeed | Quantity::FollowingSpeed => Self::TruncatedNormal,
            Quantity::CutOutThw
            | Quantity::LaneChangeDuration
            | Quantity::LaneChangeWidth
            | Quantity::Closing
            | Quantity::CriticalCutOutThw
            | Quantity::FrontThw
            | Quantity::ShortFrontThw => Self::LogNormal,
        }
    }

    /// Fits the form by the moments of `values`, or of their logarithms for the log-normal form.
    ///
    /// Returns `None` if the values do not vary, or if they are not all positive and the form is
    /// log-normal.
    fn fit(self, values: &[f64]) -> Option<Form> {
        match self {
            Self::LogNormal => {
                let (mean, sigma) = moments(values.iter().map(|value| maths::ln(*value)))?;
                Some(Form::LogNormal { median: maths::exp(mean), sigma })
            }
            Self::TruncatedNormal => {
                let (mean, sd) = moments(values.iter().copied())?;
                Some(Form::TruncatedNormal {
                    mean,
                    sd,
                    min: mean - TRUNCATION_SDS * sd,
                    max: mean + TRUNCATION_SDS * sd,
                })
            }
        }
    }
}

/// Returns the mean and the standard deviation (with n − 1), or `None` unless both are finite and
/// the standard deviation is above 0.
fn moments(values: impl Iterator<Item = f64> + Clone) -> Option<(f64, f64)> {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let variance = values.map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let sd = variance.sqrt();
    (mean.is_finite() && sd > 0.0 && sd.is_finite()).then_some((mean, sd))
}

impl Form {
    /// Returns the name of the form, as in scenario files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LogNormal { .. } => "log-normal",
            Self::TruncatedNormal { .. } => "truncated-normal",
        }
    }

    fn family(self) -> Family {
        match self {
            Self::LogNormal { .. } => Family::LogNormal,
            Self::TruncatedNormal { .. } => Family::TruncatedNormal,
        }
    }

    /// Returns the standard normal distribution behind the form, truncated like it.
    fn standard_normal(self) -> Option<TruncatedStandardNormal> {
        match self {
            Self::LogNormal { .. } => TruncatedStandardNormal::new(f64::NEG_INFINITY, f64::INFINITY),
            Self::TruncatedNormal { mean, sd, min, max } => {
                TruncatedStandardNormal::new((min - mean) / sd, (max - mean) / sd)
            }
        }
    }

    /// Returns the standard normal variate that corresponds to `value`.
    fn standardised(self, value: f64) -> f64 {
        match self {
            Self::LogNormal { median, sigma } => maths::ln(value / median) / sigma,
            Self::TruncatedNormal { mean, sd, .. } => (value - mean) / sd,
        }
    }

    /// Returns the value that corresponds to the standard normal variate `z`.
    fn value(self, z: f64) -> f64 {
        match self {
            Self::LogNormal { median, sigma } => median * maths::exp(sigma * z),
            Self::TruncatedNormal { mean, sd, .. } => mean + sd * z,
        }
    }
}

/// Returns the Kolmogorov–Smirnov distance between sorted values and a form, or `None` if no
/// probability is left between the bounds of the form.
fn ks_distance(sorted: &[f64], form: Form) -> Option<f64> {
    let n = sorted.len() as f64;
    let normal = form.standard_normal()?;
    let at = |(k, value): (usize, &f64)| {
        let cdf = normal.cdf(form.standardised(*value));
        ((k + 1) as f64 / n - cdf).max(cdf - k as f64 / n)
    };
    Some(sorted.iter().enumerate().map(at).fold(0.0, f64::max))
}

/// Returns the goodness of fit of `form`, by a parametric bootstrap that refits the form to each
/// sample, or `None` if no probability is left between the bounds of the form.
fn goodness_of_fit(sorted: &[f64], form: Form, rng: &mut Stream) -> Option<GoodnessOfFit> {
    let distance = ks_distance(sorted, form)?;
    let normal = form.standard_normal()?;
    let mut exceeded = 0_usize;
    for _ in 0..GOODNESS_OF_FIT_SAMPLES {
        // The quantile function is finite only strictly between 0 and 1.
        let draw = |rng: &mut Stream| form.value(normal.quantile(rng.random::<f64>().max(f64::MIN_POSITIVE)));
        let mut sample: Vec<f64> = (0..sorted.len()).map(|_| draw(rng)).collect();
        sample.sort_by(f64::total_cmp);
        let refitted = form.family().fit(&sample).unwrap_or(form);
        exceeded += usize::from(ks_distance(&sample, refitted)? >= distance);
    }
    // The observed sample counts as one of the samples, so that the probability is never 0.
    Some(GoodnessOfFit { distance, p_value: (exceeded + 1) as f64 / (GOODNESS_OF_FIT_SAMPLES + 1) as f64 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log_normal_values(n: usize, median: f64, sigma: f64) -> Vec<f64> {
        let form = Form::LogNormal { median, sigma };
        let normal = form.standard_normal().unwrap();
        (0..n).map(|k| form.value(normal.quantile((k as f64 + 0.5) / n as f64))).collect()
    }

    #[test]
    fn the_fit_recovers_the_parameters_of_a_log_normal() {
        let fitted = FittedQuantity::new(Quantity::CutOutThw, &log_normal_values(400, 0.9, 0.3), 0).unwrap();
        let Some((Form::LogNormal { median, sigma }, goodness)) = fitted.form else { panic!("a log-normal form") };
        assert!((median - 0.9).abs() < 1e-3 && (sigma - 0.3).abs() < 5e-3);
        assert!(goodness.distance < 0.01 && goodness.p_value > 0.9);
        assert!(fitted.interval_95[0] < 0.9 && fitted.interval_95[1] > 0.9);
    }

    #[test]
    fn a_form_that_does_not_fit_has_a_small_p_value() {
        let two_clusters: Vec<f64> =
            (0..60).map(|k| if k % 2 == 0 { 1.0 } else { 5.0 } + 0.001 * f64::from(k)).collect();
        let fitted = FittedQuantity::new(Quantity::FrontThw, &two_clusters, 0).unwrap();
        assert!(fitted.form.unwrap().1.p_value < 0.01);
    }

    #[test]
    fn too_few_values_are_not_fitted_and_equal_or_zero_values_have_no_form() {
        assert_eq!(FittedQuantity::new(Quantity::Closing, &[1.0; 4], 0), None);
        let equal = FittedQuantity::new(Quantity::Closing, &[2.0; 8], 0).unwrap();
        assert_eq!((equal.form, equal.interval_95), (None, [2.0, 2.0]));
        let with_zero = FittedQuantity::new(Quantity::CutOutThw, &[0.0, 1.0, 2.0, 3.0, 4.0], 0).unwrap();
        assert_eq!(with_zero.form, None);
    }

    #[test]
    fn the_interval_is_reproducible_and_depends_on_the_seed() {
        let values: Vec<f64> = (0..15).map(|k| f64::from(k * k)).collect();
        let interval = |seed| FittedQuantity::new(Quantity::CrossingSpeed, &values, seed).unwrap().interval_95;
        assert_eq!(interval(1), interval(1));
        let differs = (0..20).map(interval).any(|other| other != interval(1));
        assert!(differs, "different seeds give different resamples");
    }
}
