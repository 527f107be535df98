//! Statistics of lane changes: durations, speeds, and correlations with the criticality metrics.
//!
//! Durations, speeds and correlations use *complete* lane changes only ([`crate::lane_change`]).
//! The counts include all lane changes; overlapping and double lane changes are also counted
//! separately.
//!
//! - **Box plots**: quartiles by linear interpolation ([`quantile`]). Whiskers reach to the
//!   furthest values within 1.5 interquartile ranges of the box (Tukey); values beyond are
//!   outliers.
//! - **Correlation**: Pearson's r of the values and Spearman's ρ of their ranks (ties share their
//!   mean rank). It covers the lane changes for which both quantities have a value, and their
//!   number is stated. With fewer than 5 pairs, or if a quantity does not vary, there is no
//!   coefficient.

use closecall_traffic::statistics::quantiles::quantile;
use closecall_traffic::{Side, VehicleClass};
use serde::Serialize;

use super::CriticalLaneChange;

/// Least number of pairs for which a correlation is stated.
const MIN_PAIRS: usize = 5;

/// Largest length of a whisker in interquartile ranges (J. W. Tukey, Exploratory Data Analysis,
/// 1977).
const WHISKER_RANGES: f64 = 1.5;

/// The numbers that define a box plot, in the unit of its values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoxPlot {
    /// Number of values.
    pub n: usize,
    /// Mean of the values.
    pub mean: f64,
    /// Lower whisker, lower quartile, median, upper quartile, upper whisker.
    pub five: [f64; 5],
    /// Values beyond the whiskers, in ascending order.
    pub outliers: Vec<f64>,
}

impl BoxPlot {
    /// Computes the box plot of all finite `values`. Returns `None` if there are none.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.retain(|value| value.is_finite());
        if values.is_empty() {
            return None;
        }
        values.sort_by(f64::total_cmp);
        let [lower, median, upper] = [0.25, 0.5, 0.75].map(|level| quantile(&values, level));
        let reach = WHISKER_RANGES * (upper - lower);
        let is_within = |value: &f64| (lower - reach..=upper + reach).contains(value);
        let within: Vec<f64> = values.iter().copied().filter(is_within).collect();
        let five = [*within.first()?, lower, median, upper, *within.last()?];
        let outliers = values.iter().copied().filter(|value| !is_within(value)).collect();
        Some(Self { n: values.len(), mean: values.iter().sum::<f64>() / values.len() as f64, five, outliers })
    }
}

/// Statistics of the lane changes of one vehicle class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClassStatistics {
    /// The vehicle class.
    pub vehicle_class: VehicleClass,
    /// Number of all lane changes.
    pub lane_changes: usize,
    /// Number of lane changes to the left.
    pub to_the_left: usize,
    /// Number of complete lane changes.
    pub complete: usize,
    /// Number of lane changes that overlap with another lane change.
    pub overlapping: usize,
    /// Number of lane changes that are part of a double one.
    pub double: usize,
    /// Durations of the complete lane changes (s).
    pub duration_s: Option<BoxPlot>,
    /// Widths of the peaks of lateral speed of the complete lane changes (s).
    pub width_s: Option<BoxPlot>,
    /// Speeds of the complete lane changes when the centre crosses the marking (m/s).
    pub speed_mps: Option<BoxPlot>,
}

/// The correlation of two quantities.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correlation {
    /// Name of the first quantity.
    pub of: &'static str,
    /// Name of the second quantity.
    pub with: &'static str,
    /// Number of complete lane changes for which both have a value.
    pub n: usize,
    /// Pearson's correlation coefficient r (-).
    pub pearson: Option<f64>,
    /// Spearman's rank correlation coefficient ρ (-).
    pub spearman: Option<f64>,
}

/// Statistics over many lane changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// One entry for each vehicle class with lane changes, in the order of `VehicleClass::ALL`.
    pub classes: Vec<ClassStatistics>,
    /// Duration against speed, then each of the two against every metric in the order of
    /// `Metrics::named`.
    pub correlations: Vec<Correlation>,
}

/// Computes the statistics of `changes`.
pub fn statistics(changes: &[CriticalLaneChange]) -> Statistics {
    let classes = VehicleClass::ALL.into_iter().filter_map(|class| class_statistics(changes, class));
    Statistics { classes: classes.collect(), correlations: correlations(changes) }
}

fn class_statistics(changes: &[CriticalLaneChange], vehicle_class: VehicleClass) -> Option<ClassStatistics> {
    let all: Vec<_> = changes
        .iter()
        .map(|change| &change.lane_change)
        .filter(|change| change.vehicle_class == vehicle_class)
        .collect();
    let complete: Vec<_> = all.iter().filter(|change| change.complete).collect();
    (!all.is_empty()).then(|| ClassStatistics {
        vehicle_class,
        lane_changes: all.len(),
        to_the_left: all.iter().filter(|change| change.direction == Side::Left).count(),
        complete: complete.len(),
        overlapping: all.iter().filter(|change| change.overlapping).count(),
        double: all.iter().filter(|change| change.double).count(),
        duration_s: BoxPlot::of(complete.iter().map(|change| change.duration_s).collect()),
        width_s: BoxPlot::of(complete.iter().map(|change| change.width_s).collect()),
        speed_mps: BoxPlot::of(complete.iter().map(|change| change.speed_mps).collect()),
    })
}

/// Reads a quantity from a lane change; `None` if it has no value there.
type Quantity = Box<dyn Fn(&CriticalLaneChange) -> Option<f64>>;

fn correlations(changes: &[CriticalLaneChange]) -> Vec<Correlation> {
    let complete: Vec<_> = changes.iter().filter(|change| change.lane_change.complete).collect();
    let duration: (_, Quantity) = ("duration_s", Box::new(|change| Some(change.lane_change.duration_s)));
    let speed: (_, Quantity) = ("crossing_speed_mps", Box::new(|change| Some(change.lane_change.speed_mps)));
    let names: Vec<&'static str> =
        complete.first().map_or_else(Vec::new, |change| change.metrics.named().map(|(name, _)| name).to_vec());
    let metrics: Vec<(_, Quantity)> = names
        .into_iter()
        .enumerate()
        .map(|(index, name)| -> (_, Quantity) {
            (name, Box::new(move |change| change.metrics.named()[index].1.value()))
        })
        .collect();
    let with_metrics = [&duration, &speed].into_iter().flat_map(|of| metrics.iter().map(move |with| (of, with)));
    let pairs = [(&duration, &speed)].into_iter().chain(with_metrics);
    pairs.map(|(of, with)| correlation(&complete, of, with)).collect()
}

fn correlation(
    complete: &[&CriticalLaneChange],
    (of, first): &(&'static str, Quantity),
    (with, second): &(&'static str, Quantity),
) -> Correlation {
    let pairs = complete.iter().filter_map(|change| first(change).zip(second(change)));
    let (a, b): (Vec<f64>, Vec<f64>) = pairs.filter(|(a, b)| a.is_finite() && b.is_finite()).unzip();
    Correlation { of, with, n: a.len(), pearson: pearson(&a, &b), spearman: spearman(&a, &b) }
}

/// Returns Pearson's correlation coefficient, or `None` with too few pairs or if a quantity does
/// not vary.
fn pearson(a: &[f64], b: &[f64]) -> Option<f64> {
    let n = a.len() as f64;
    let (mean_a, mean_b) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let sum =
        |product: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(a, b)| product(a - mean_a, b - mean_b)).sum::<f64>();
    let (aa, bb, ab) = (sum(&|a, _| a * a), sum(&|_, b| b * b), sum(&|a, b| a * b));
    (a.len() >= MIN_PAIRS && aa > 0.0 && bb > 0.0).then(|| (ab / (aa.sqrt() * bb.sqrt())).clamp(-1.0, 1.0))
}

/// Returns Spearman's rank correlation, or `None` with too few pairs or if a quantity does not
/// vary.
pub fn spearman(a: &[f64], b: &[f64]) -> Option<f64> {
    pearson(&ranks(a), &ranks(b))
}

/// Returns the ranks of `values`, starting at 1; equal values share their mean rank.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut ranked = 0;
    for tied in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let rank = ranked as f64 + 0.5 * (tied.len() + 1) as f64;
        tied.iter().for_each(|&index| ranks[index] = rank);
        ranked += tied.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criticality::{Judgement, criticality};
    use crate::filters::smooth;
    use crate::trajectory_data::test_support::{changing_track, trajectory_data_of};

    #[test]
    fn box_plots_match_numpy() {
        let plot = BoxPlot::of(vec![7.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 30.0]).unwrap();
        // NumPy: percentile([1, 2, 3, 4, 5, 6, 7, 30], [25, 50, 75]) = 2.75, 4.5, 6.25.
        assert_eq!((plot.n, plot.mean, plot.five), (8, 7.25, [1.0, 2.75, 4.5, 6.25, 7.0]));
        assert_eq!(plot.outliers, [30.0]);
        assert_eq!(BoxPlot::of(vec![2.0]).unwrap().five, [2.0; 5]);
        assert_eq!(BoxPlot::of(vec![f64::NAN]), None);
    }

    #[test]
    fn correlations_match_scipy() {
        let (a, b) = ([1.0, 2.0, 3.0, 4.0, 5.0, 5.0], [2.0, 1.0, 4.0, 3.0, 7.0, 5.0]);
        // scipy.stats.pearsonr and spearmanr.
        assert!((pearson(&a, &b).unwrap() - 0.831_521_840_620_299_8).abs() < 1e-12);
        assert!((pearson(&ranks(&a), &ranks(&b)).unwrap() - 0.869_656_553_478_672_7).abs() < 1e-12);
        assert_eq!(pearson(&[1.0; 6], &b), None);
        assert_eq!(pearson(&a[..4], &b[..4]), None);
        assert_eq!(ranks(&[3.0, 1.0, 3.0]), [2.5, 1.0, 2.5]);
    }

    #[test]
    fn a_slower_lane_change_with_a_longer_duration_gives_a_negative_correlation() {
        let track = |k: u64| {
            let duration_s = 3.0 + 0.5 * k as f64;
            changing_track(k + 1, (0.0, 40.0 - 2.0 * k as f64), (-5.25, -1.75), (3.0, duration_s), 160)
        };
        let changes = criticality(&smooth(&trajectory_data_of((0..8).map(track).collect())), &Judgement::default());
        let result = statistics(&changes);
        let [cars] = &result.classes[..] else { panic!("one class") };
        assert_eq!((cars.lane_changes, cars.to_the_left, cars.complete, cars.double), (8, 8, 8, 0));
        assert!((cars.duration_s.as_ref().unwrap().five[2] - 4.75).abs() < 0.2);
        let first = &result.correlations[0];
        assert_eq!((first.of, first.with, first.n), ("duration_s", "crossing_speed_mps", 8));
        assert!(first.pearson.unwrap() < -0.99 && first.spearman.unwrap() < -0.999);
        assert_eq!(result.correlations.len(), 15);
    }
}
