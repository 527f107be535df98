//! The choice of the most relevant approaches, and the variation of their values.
//!
//! **Choice.** Approaches that are critical by at least one metric of the published method precede
//! the others. The first is the most critical approach. Each further approach is the approach that
//! differs most from all chosen approaches: its smallest distance to them is largest, in the space
//! of speed, closing speed, headway at the crossing and front headway, each divided by its standard
//! deviation (T. F. Gonzalez, *Clustering to minimize the maximum intercluster distance*,
//! Theoretical Computer Science 38 (1985) 293–306). Of two equal approaches, the earlier in the
//! order of the files and of time is chosen. The choice is therefore reproducible.
//!
//! **Variation.** A value varies around the recorded value by the bandwidth of a kernel density
//! estimate, 0.9·min(σ, IQR/1.34)·n^(−1/5) over all approaches of the files (B. W. Silverman,
//! *Density Estimation for Statistics and Data Analysis*, 1986, equation 3.31). All scenarios
//! together then sample the estimated density of the recorded approaches.

use closecall_traffic::maths;
use closecall_traffic::statistics::quantiles::quantile;

use super::Approach;
use crate::fit::MIN_VALUES;

/// Share of its recorded value by which a quantity varies if there are too few approaches to fit a
/// spread (-): an assumption; 0.05 to 0.2 are plausible.
const ASSUMED_SHARE: f64 = 0.1;
/// Ratio of the interquartile range to the standard deviation of a normal distribution (-).
const IQR_PER_SD: f64 = 1.34;
/// Factor of Silverman's rule (-).
const SILVERMAN: f64 = 0.9;

/// How much a quantity varies around its recorded value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Variation {
    /// By the bandwidth of a kernel density estimate.
    Fitted {
        /// The bandwidth, in the quantity's unit.
        bandwidth: f64,
        /// Number of values.
        n: usize,
    },
    /// By a share of the recorded value, since there are too few values.
    Assumed {
        /// The share (-).
        share: f64,
    },
}

impl Variation {
    /// Returns the variation of a quantity with these recorded values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len();
        let assumed = Self::Assumed { share: ASSUMED_SHARE };
        if n < MIN_VALUES {
            return assumed;
        }
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let iqr = quantile(&sorted, 0.75) - quantile(&sorted, 0.25);
        let spread = standard_deviation(&sorted).min(iqr / IQR_PER_SD);
        let bandwidth = SILVERMAN * spread * maths::powf(n as f64, -0.2);
        if bandwidth > 0.0 { Self::Fitted { bandwidth, n } } else { assumed }
    }

    /// Returns the standard deviation around a recorded value.
    pub fn around(self, value: f64) -> f64 {
        match self {
            Self::Fitted { bandwidth, .. } => bandwidth,
            Self::Assumed { share } => share * value.abs(),
        }
    }
}

/// An approach that was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relevant {
    /// The index among all approaches.
    pub index: usize,
    /// Whether it is critical by at least one metric.
    pub is_critical: bool,
    /// The distance to the nearest earlier chosen approach, in standard deviations; `None` for the
    /// first.
    pub distance_sd: Option<f64>,
}

/// Chooses the `count` most relevant approaches.
pub fn most_relevant(approaches: &[Approach], count: usize) -> Vec<Relevant> {
    let points = normalised(approaches);
    let metrics: Vec<usize> = approaches.iter().map(|approach| approach.critical_metrics().len()).collect();
    let mut chosen: Vec<Relevant> = Vec::new();
    for is_critical in [true, false] {
        let mut left: Vec<usize> = (0..approaches.len()).filter(|&index| (metrics[index] > 0) == is_critical).collect();
        while chosen.len() < count && !left.is_empty() {
            let nearest = |index: usize| {
                let distances = chosen.iter().map(|approach| distance(&points[approach.index], &points[index]));
                distances.min_by(f64::total_cmp)
            };
            // Without a first approach, the number of critical metrics decides, then the shorter
            // headway.
            let rank = |index: usize| match nearest(index) {
                Some(distance_sd) => [distance_sd, 0.0],
                None => [metrics[index] as f64, -approaches[index].values.crossing_thw_s],
            };
            let mut best = 0;
            for position in 1..left.len() {
                if rank(left[position]) > rank(left[best]) {
                    best = position;
                }
            }
            let index = left.remove(best);
            chosen.push(Relevant { index, is_critical, distance_sd: nearest(index) });
        }
    }
    chosen
}

/// Returns the values of each approach, divided by their standard deviations. A front headway that
/// is not recorded is at its mean.
fn normalised(approaches: &[Approach]) -> Vec<[f64; 4]> {
    let fronts: Vec<f64> = approaches.iter().filter_map(|approach| approach.values.front_thw_s).collect();
    let mean_front_s = fronts.iter().sum::<f64>() / fronts.len().max(1) as f64;
    let raw: Vec<[f64; 4]> = approaches
        .iter()
        .map(|Approach { values, .. }| {
            [values.ego_mps, values.closing_mps, values.crossing_thw_s, values.front_thw_s.unwrap_or(mean_front_s)]
        })
        .collect();
    let sds = [0, 1, 2, 3].map(|axis| {
        let sd = standard_deviation(&raw.iter().map(|point| point[axis]).collect::<Vec<_>>());
        if sd > 0.0 { sd } else { 1.0 }
    });
    raw.iter().map(|point| [0, 1, 2, 3].map(|axis| point[axis] / sds[axis])).collect()
}

fn distance(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

fn standard_deviation(values: &[f64]) -> f64 {
    let n = values.len().max(2) as f64;
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criticality::{Judgement, criticality};
    use crate::encounter::approach;
    use crate::filters::smooth;
    use crate::trajectory_data::test_support::{changing_track, straight_track, trajectory_data_of};

    /// An approach to a vehicle `gap_m` ahead that is slower by `closing_mps`.
    fn recorded(gap_m: f64, closing_mps: f64) -> Approach {
        let rear = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110);
        let ego = straight_track(2, gap_m, 30.0 - closing_mps, -5.25, 110);
        let data = smooth(&trajectory_data_of(vec![rear, ego]));
        approach(&data, &criticality(&data, &Judgement::default())[0]).unwrap()
    }

    #[test]
    fn the_bandwidth_follows_silvermans_rule() {
        // Mean 3, variance 2.5, interquartile range 2: 2/1.34 is below the standard deviation of
        // 1.58.
        let Variation::Fitted { bandwidth, n } = Variation::of(&[1.0, 2.0, 3.0, 4.0, 5.0]) else { panic!("fitted") };
        assert_eq!(n, 5);
        assert!((bandwidth - 0.9 * (2.0 / 1.34) * 0.724_779_663_677_695_6).abs() < 1e-12, "{bandwidth}");
        assert_eq!(Variation::of(&[1.0, 2.0]).around(20.0), 2.0);
        assert_eq!(Variation::of(&[3.0; 9]).around(20.0), 2.0, "values without spread");
    }

    #[test]
    fn critical_approaches_precede_and_each_further_one_differs_most() {
        // The second and the third are alike; the last one is not critical.
        let all =
            [recorded(30.0, 3.0), recorded(45.0, 5.0), recorded(45.2, 5.0), recorded(68.0, 8.0), recorded(120.0, 2.0)];
        let critical: Vec<bool> = all.iter().map(|approach| !approach.critical_metrics().is_empty()).collect();
        assert_eq!(critical, [true, true, true, true, false]);
        let chosen = most_relevant(&all, 3);
        let indices: Vec<usize> = chosen.iter().map(|approach| approach.index).collect();
        assert!(!(indices.contains(&1) && indices.contains(&2)), "{chosen:?}");
        assert!(chosen.iter().all(|approach| approach.is_critical) && chosen[0].distance_sd.is_none());
        let every = most_relevant(&all, 9);
        assert_eq!(every.len(), 5);
        assert_eq!(every.last().map(|approach| (approach.index, approach.is_critical)), Some((4, false)));
        assert_eq!(most_relevant(&all, 3), chosen);
    }
}
