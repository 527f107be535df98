//! Drift: whether new traffic still matches the distributions that a scenario was fitted to.
//!
//! Each quantity of the fitted file is compared with its values in new trajectory data by a
//! two-sample Kolmogorov–Smirnov test at the fitted quantiles ([`two_sample`]). New values are rounded
//! as the quantiles are ([`DECIMALS`]). The p-values are corrected for the number of tests ([`holm`]),
//! so that the probability of any false alarm is at most [`LEVEL`].
//!
//! A parameter is compared with its *quantity* in the range of its *cut*, on both sides: a
//! scenario's headways from 0.5 to 0.9 s with the new headways from 0.5 to 0.9 s. Quantities that
//! repeat another one are not tested. The width of the peak of lateral speed follows from the
//! duration. The critical headways are a part of all headways, if these are tested. Values of one
//! recording are treated as independent. Vehicles that drive one behind the other are not quite
//! independent, and a platoon can look like drift.

use std::path::Path;

use closecall_recorded::filters::SmoothedFile;
use closecall_recorded::fit::{DECIMALS, MIN_VALUES, Quantity, Samples, observe};
use closecall_scenarios::parameters::{ParameterConfig, ParametersConfig};
use closecall_scenarios::{ScenarioError, source};
use closecall_traffic::Stream;
use closecall_traffic::statistics::holm;
use closecall_traffic::statistics::quantiles::quantile;
use closecall_traffic::statistics::two_sample::{self, Summary};
use rand::SeedableRng;
use serde::Serialize;

/// Level of the test: the largest probability that traffic without drift is called drifted (-).
pub const LEVEL: f64 = 0.05;
/// Relative shift for which the needed number of values is stated (-).
const STATED_SHIFT: f64 = 0.05;
/// The quantities that are tested.
const TESTED: [Quantity; 6] = [
    Quantity::CutOutThw,
    Quantity::LaneChangeDuration,
    Quantity::Closing,
    Quantity::CrossingSpeed,
    Quantity::FrontThw,
    Quantity::FollowingSpeed,
];

/// The fitted parameters of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted(Vec<FittedParameter>);

/// A fitted parameter: the values of a quantity within its cut.
#[derive(Clone, Debug, PartialEq)]
struct FittedParameter {
    name: String,
    quantity: Quantity,
    /// The range of values that were fitted: from the first number up to below the second. `None`
    /// for all.
    cut: Option<[f64; 2]>,
    summary: Summary,
}

impl FittedParameter {
    /// Reads a parameter. Returns `None` if it has no quantiles that were fitted, or if its
    /// quantity is not tested.
    ///
    /// # Errors
    /// The parameter names a quantity that does not exist.
    fn of(name: &str, config: &ParameterConfig) -> Result<Option<Self>, String> {
        let (Some(fitted), Some(empirical)) = (&config.fitted, &config.empirical) else { return Ok(None) };
        let named = fitted.quantity.as_deref();
        let Some(named_quantity) = Quantity::ALL.into_iter().find(|quantity| quantity.name() == named.unwrap_or(name))
        else {
            let names: Vec<&str> = Quantity::ALL.iter().map(|quantity| quantity.name()).collect();
            return match named {
                Some(named) => Err(format!("`{name}.fitted.quantity` is `{named}`: allowed are {}", names.join(", "))),
                None => Ok(None),
            };
        };
        let (quantity, part) =
            named_quantity.part_of().map_or((named_quantity, None), |(whole, cut)| (whole, Some(cut)));
        if !TESTED.contains(&quantity) {
            return Ok(None);
        }
        let summary = usize::try_from(fitted.n).ok().and_then(|n| Summary::new(n, &empirical.quantiles));
        let cut = fitted.cut.or(part);
        Ok(summary.map(|summary| Self { name: name.to_owned(), quantity, cut, summary }))
    }

    /// Returns true if another parameter has all values of this one.
    fn is_part_of(&self, other: &Self) -> bool {
        self.quantity == other.quantity && (other.cut.is_none() || self.cut == other.cut)
    }
}

impl Fitted {
    /// Reads a file that `closecall traffic fit` wrote, or a scenario, by its file or by its name
    /// in the library, whose parameters come from one.
    ///
    /// # Errors
    /// [`ScenarioError`] if the file cannot be read, or holds no fitted quantity.
    pub fn read(path: &Path) -> Result<Self, ScenarioError> {
        let text = source::text(path)?;
        Self::parse(&text).map_err(|message| ScenarioError::Syntax { path: path.to_owned(), line: Some(1), message })
    }

    fn parse(text: &str) -> Result<Self, String> {
        let mut document: toml::Table = text.parse().map_err(|error: toml::de::Error| error.message().to_owned())?;
        let parameters = document.remove("parameters").ok_or("there is no table `parameters`")?;
        let parameters: ParametersConfig =
            parameters.try_into().map_err(|error: toml::de::Error| error.message().to_owned())?;
        let mut all: Vec<FittedParameter> = Vec::new();
        for (name, config) in &parameters.0 {
            all.extend(FittedParameter::of(name.as_str(), config)?);
        }
        // Within a quantity, parameters without a cut come first. Among these, the parameter that
        // has the name of the quantity comes first.
        all.sort_by_key(|parameter| {
            (parameter.quantity, parameter.cut.is_some(), parameter.name != parameter.quantity.name())
        });
        let mut kept: Vec<FittedParameter> = Vec::new();
        for parameter in all {
            if !kept.iter().any(|other| parameter.is_part_of(other)) {
                kept.push(parameter);
            }
        }
        let all = kept;
        if all.is_empty() {
            let names: Vec<&str> = TESTED.iter().map(|quantity| quantity.name()).collect();
            return Err(format!(
                "no parameter has quantiles that were fitted: one of {} with `empirical` and `fitted` is needed, as `closecall \
                 traffic fit` writes them",
                names.join(", ")
            ));
        }
        Ok(Self(all))
    }
}

/// The comparison of one quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuantityDrift {
    /// Name of the parameter.
    pub name: String,
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Smallest value of the quantity that is compared; `None` if all values are compared.
    pub cut_from: Option<f64>,
    /// Upper end of the compared values, which is excluded; `None` if all values are compared.
    pub cut_to: Option<f64>,
    /// Number of fitted values.
    pub fitted_n: usize,
    /// Median of the fitted values, in the unit of the name.
    pub fitted_median: f64,
    /// Number of new values.
    pub n: usize,
    /// Median of the new values; `None` if there are none.
    pub median: Option<f64>,
    /// Kolmogorov–Smirnov distance (-); `None` if there are too few new values.
    pub distance: Option<f64>,
    /// Probability of a larger distance without drift (-).
    pub p_value: Option<f64>,
    /// The probability, corrected for the number of tests (-).
    pub corrected_p_value: Option<f64>,
    /// Distance beyond which the test finds drift with these numbers of values (-).
    pub found_from: Option<f64>,
    /// Number of new values with which the test finds the observed distance; `None` if no number
    /// suffices.
    pub needed: Option<u64>,
    /// Number of new values with which the test finds a shift by 5 % about every second time;
    /// `None` if no number suffices.
    pub needed_for_five_percent: Option<u64>,
}

/// The comparison of new trajectory data with fitted distributions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drift {
    /// The quantities.
    pub quantities: Vec<QuantityDrift>,
    /// True if at least one quantity was tested.
    pub is_tested: bool,
    /// True if a corrected p-value is below [`LEVEL`].
    pub has_drifted: bool,
}

/// Compares trajectory files with fitted distributions. `seed` determines the simulated distances.
pub fn drift(fitted: &Fitted, files: &[SmoothedFile], seed: u64) -> Drift {
    let mut samples = Samples::default();
    for file in files {
        samples.extend(observe(&file.data));
    }
    let simulated = |name: &str, summary: &Summary, m: usize| summary.simulated(m, &mut stream(seed, name));
    drift_of(fitted, |quantity| samples.values(quantity).to_vec(), &simulated)
}

/// A function that returns simulated distances of a number of new values, in ascending order.
type Simulated<'a> = dyn Fn(&str, &Summary, usize) -> Vec<f64> + 'a;

/// The result of one test.
#[derive(Clone, Copy)]
struct TestResult {
    distance: f64,
    p_value: f64,
    /// Distance beyond which the test finds drift.
    critical: f64,
}

fn drift_of(fitted: &Fitted, values: impl Fn(Quantity) -> Vec<f64>, simulated: &Simulated<'_>) -> Drift {
    let steps = 10_f64.powi(i32::from(DECIMALS));
    let sorted = |parameter: &FittedParameter| {
        let mut values = values(parameter.quantity);
        values.retain(|value| parameter.cut.is_none_or(|[from, to]| (from..to).contains(value)));
        values.iter_mut().for_each(|value| *value = (*value * steps).round() / steps);
        values.sort_by(f64::total_cmp);
        values
    };
    let new: Vec<Vec<f64>> = fitted.0.iter().map(sorted).collect();
    let is_enough = |new: &Vec<f64>| new.len() >= MIN_VALUES;
    let level = LEVEL / new.iter().filter(|new| is_enough(new)).count().max(1) as f64;
    let tests = fitted.0.iter().zip(&new).map(|(FittedParameter { name, summary, .. }, new)| {
        let test = || {
            let (distance, simulated) = (summary.distance(new), simulated(name, summary, new.len()));
            let p_value = two_sample::p_value(distance, &simulated);
            TestResult { distance, p_value, critical: two_sample::critical_distance(&simulated, level) }
        };
        is_enough(new).then(test)
    });
    let tests: Vec<Option<TestResult>> = tests.collect();
    let p_values: Vec<f64> = tests.iter().flatten().map(|test| test.p_value).collect();
    let mut corrected = holm::corrected(&p_values).into_iter();
    let mut quantities = Vec::new();
    for ((parameter, new), test) in fitted.0.iter().zip(&new).zip(&tests) {
        let summary = &parameter.summary;
        let shift = summary.distance_of_shift(|value| value * (1.0 + STATED_SHIFT));
        let factor = test.map_or_else(
            || two_sample::asymptotic_factor(level),
            |test| two_sample::factor(test.critical, summary.n(), new.len()),
        );
        let needed = |distance| two_sample::needed(factor, summary.n(), distance);
        quantities.push(QuantityDrift {
            name: parameter.name.clone(),
            quantity: parameter.quantity.name(),
            cut_from: parameter.cut.map(|[from, _]| from),
            cut_to: parameter.cut.map(|[_, to]| to),
            fitted_n: summary.n(),
            fitted_median: summary.median(),
            n: new.len(),
            median: (!new.is_empty()).then(|| quantile(new, 0.5)),
            distance: test.map(|test| test.distance),
            p_value: test.map(|test| test.p_value),
            corrected_p_value: test.and_then(|_| corrected.next()),
            found_from: test.map(|test| test.critical),
            needed: test.and_then(|test| needed(test.distance)),
            needed_for_five_percent: needed(shift),
        });
    }
    let has_drifted =
        quantities.iter().filter_map(|parameter| parameter.corrected_p_value).any(|p_value| p_value < LEVEL);
    Drift { quantities, is_tested: !p_values.is_empty(), has_drifted }
}

/// Returns the random stream of one parameter. A further parameter does not change the streams of
/// the others.
fn stream(seed: u64, name: &str) -> Stream {
    let mut hasher = blake3::Hasher::new_derive_key("closecall 2026 simulated distances of drift v1");
    hasher.update(&seed.to_le_bytes());
    hasher.update(name.as_bytes());
    Stream::from_seed(*hasher.finalize().as_bytes())
}

#[cfg(test)]
mod tests {
    use closecall_traffic::maths;
    use closecall_traffic::statistics::normal::TruncatedStandardNormal;
    use rand::RngExt;
    use rayon::prelude::*;

    use super::*;

    /// Number of fitted values of each quantity, and the log-normal distribution that they come
    /// from: median and standard deviation of the logarithm, close to the library's fitted file.
    const TRUTH: [(Quantity, usize, [f64; 2]); 6] = [
        (Quantity::CutOutThw, 40, [0.76, 0.58]),
        (Quantity::LaneChangeDuration, 30, [4.7, 0.38]),
        (Quantity::Closing, 35, [1.3, 0.9]),
        (Quantity::CrossingSpeed, 48, [15.3, 0.15]),
        (Quantity::FrontThw, 270, [1.4, 0.45]),
        (Quantity::FollowingSpeed, 270, [13.7, 0.2]),
    ];

    fn drawn(n: usize, [median, sigma]: [f64; 2], rng: &mut Stream) -> Vec<f64> {
        let normal = TruncatedStandardNormal::new(-6.0, 6.0).unwrap();
        let mut values: Vec<f64> = (0..n).map(|_| median * maths::exp(sigma * normal.quantile(rng.random()))).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    /// The share of 1,000 resamplings that are called drifted. In each, values are drawn and
    /// reduced to the quantiles of a fitted file, and `n` new values of each quantity are drawn and
    /// changed by `shift`.
    fn share_called_drifted(n: usize, shift: impl Fn(Quantity, f64) -> f64 + Sync) -> f64 {
        let summary = |values: &[f64]| {
            let levels = 11.min(values.len());
            let at = |k: usize| quantile(values, k as f64 / (levels - 1) as f64);
            Summary::new(values.len(), &(0..levels).map(at).collect::<Vec<f64>>()).unwrap()
        };
        // The simulated distances depend on the numbers of values only.
        let simulated = TRUTH.map(|(quantity, fitted_n, truth)| {
            let any = summary(&drawn(fitted_n, truth, &mut Stream::seed_from_u64(0)));
            (quantity.name(), any.simulated(n, &mut stream(0, quantity.name())))
        });
        let simulated = |name: &str, _: &Summary, _: usize| {
            simulated.iter().find(|(quantity, _)| *quantity == name).unwrap().1.clone()
        };
        let is_called = |index: &u64| {
            let mut rng = Stream::seed_from_u64(*index);
            let mut fit = |(quantity, n, truth): (Quantity, usize, [f64; 2])| {
                let (name, summary) = (quantity.name().to_owned(), summary(&drawn(n, truth, &mut rng)));
                FittedParameter { name, quantity, cut: None, summary }
            };
            let fitted = Fitted(TRUTH.map(&mut fit).to_vec());
            let new = TRUTH.map(|(quantity, _, truth)| {
                let values = drawn(n, truth, &mut rng);
                (quantity, values.into_iter().map(|value| shift(quantity, value)).collect::<Vec<f64>>())
            });
            let values = |wanted| new.iter().find(|(quantity, _)| *quantity == wanted).unwrap().1.clone();
            drift_of(&fitted, values, &simulated).has_drifted
        };
        (0..1_000_u64).into_par_iter().filter(is_called).count() as f64 / 1_000.0
    }

    #[test]
    fn traffic_without_drift_is_called_drifted_in_about_five_percent() {
        for n in [40, 200] {
            let share = share_called_drifted(n, |_, value| value);
            assert!((0.03..=0.07).contains(&share), "{n} values: {share}");
        }
    }

    #[test]
    fn faster_and_closer_traffic_is_found_as_often_as_documented() {
        let is_speed = |quantity| matches!(quantity, Quantity::CrossingSpeed | Quantity::FollowingSpeed);
        let faster = |quantity, value: f64| if is_speed(quantity) { 1.05 * value } else { value };
        let is_headway = |quantity| matches!(quantity, Quantity::CutOutThw | Quantity::FrontThw);
        let closer = |quantity, value: f64| if is_headway(quantity) { value - 0.1 } else { value };
        let shares = [50, 200, 800].map(|n| {
            [
                share_called_drifted(n, |_, value| value),
                share_called_drifted(n, faster),
                share_called_drifted(n, closer),
            ]
        });
        let pairs = shares.iter().flatten().zip(DOCUMENTED.iter().flatten());
        assert!(pairs.into_iter().all(|(share, documented)| (share - documented).abs() < 0.02), "{shares:?}");
    }

    /// The table of docs/evidence/statistics.md: 50, 200 and 800 new values; no drift, 5 % faster,
    /// 0.1 s closer.
    const DOCUMENTED: [[f64; 3]; 3] = [[0.053, 0.186, 0.112], [0.049, 0.455, 0.211], [0.046, 0.699, 0.387]];

    #[test]
    fn any_number_of_values_that_vehicles_share_matches_its_own_fit() {
        // Seven speeds, with differences far below the written decimals.
        let speeds =
            |n: u32| -> Vec<f64> { (0..n).map(|k| 22.1 + 0.3 * f64::from(k % 7) + 1e-7 * f64::from(k % 11)).collect() };
        for n in [14, 500, 20_000] {
            let mut sorted = speeds(n);
            sorted.sort_by(f64::total_cmp);
            let quantiles: Vec<String> = (0..=10)
                .map(|k| format!("{:.1$}", quantile(&sorted, f64::from(k) / 10.0), usize::from(DECIMALS)))
                .collect();
            let text = format!(
                "[parameters]\nfollowing-mps = {{ empirical = {{ quantiles = [{}] }}, fitted = {{ n = {n}, source = 's' }} }}",
                quantiles.join(", ")
            );
            let fitted = Fitted::parse(&text).unwrap();
            let simulated = |name: &str, summary: &Summary, m: usize| summary.simulated(m, &mut stream(0, name));
            let drift = drift_of(&fitted, |_| speeds(n), &simulated);
            assert!(drift.is_tested && !drift.has_drifted, "{n}: {drift:?}");
            // What must not pass: a speed of the seven is missing.
            let others = |_: Quantity| -> Vec<f64> { speeds(n).into_iter().filter(|speed| *speed < 23.8).collect() };
            assert_eq!(drift_of(&fitted, others, &simulated).has_drifted, n > 14, "{n}");
        }
    }

    #[test]
    fn a_file_without_fitted_quantities_is_refused() {
        assert!(Fitted::parse("a = 1").unwrap_err().contains("parameters"));
        assert!(Fitted::parse("[parameters]\nx = { fixed = 1.0 }").unwrap_err().contains("cut-out-thw-s"));
        assert_eq!(Fitted::parse(include_str!("../../scenarios/library/fitted/us101.toml")).unwrap().0.len(), 6);
        let unknown = "[parameters]\nx = { empirical = { quantiles = [1, 2] }, fitted = { n = 9, source = 's', quantity = 'gap' } }";
        assert!(
            Fitted::parse(unknown).unwrap_err().contains("`x.fitted.quantity` is `gap`: allowed are cut-out-thw-s")
        );
    }

    #[test]
    fn a_cut_parameter_is_compared_with_the_values_within_its_cut() {
        let text = include_str!("../../scenarios/library/rear-vehicle-is-followed.toml");
        let fitted = Fitted::parse(text).unwrap();
        // The headway of the follower repeats the front headway; the log-normal headway at the
        // crossing has no quantiles.
        let names: Vec<&str> = fitted.0.iter().map(|parameter| parameter.name.as_str()).collect();
        assert_eq!(names, ["lane-change-duration-s", "front-thw-s"]);
        assert_eq!((fitted.0[1].quantity, fitted.0[1].cut), (Quantity::FrontThw, Some([0.5, 0.9])));
        let headways = || (0..300).map(|k| 0.01 * f64::from(k)).collect::<Vec<f64>>();
        let values = |quantity| if quantity == Quantity::FrontThw { headways() } else { Vec::new() };
        let drift = drift_of(&fitted, values, &|_, _, _| vec![0.0]);
        assert_eq!(drift.quantities[1].n, 40, "of 300 headways, those from 0.5 up to below 0.9 s");
    }
}
