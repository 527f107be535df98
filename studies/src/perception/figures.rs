//! The figures of the approaches of a case: curves over the distance, and figures with 95 %
//! intervals.
//!
//! Steps of one approach are correlated, and approaches are not. An interval therefore rests on the
//! scatter of the approaches: Clopper and Pearson's interval for a share of approaches, Student's
//! for a mean of their means, and Garwood's for a rate.

use closecall_traffic::CONTROL_STEP;
use closecall_traffic::statistics::interval::clopper_pearson;
use closecall_traffic::statistics::quantiles::quantile;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use crate::perception::approach::{Approach, GAPS_M, Tracked};

/// Distance between two points of a curve (m).
const SPACING_M: f64 = 10.0;
/// Number of bins of the calibration of the class scores.
const BINS: usize = 5;

/// A value with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// The interval; infinite if there are too few approaches for one.
    pub interval_95: [f64; 2],
}

/// Bias, root mean square and 95 % quantile of the magnitude of an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorFigures {
    /// Mean error.
    pub bias: Estimate,
    /// Root mean square error.
    pub rmse: Estimate,
    /// Quantile of the magnitude that 95 % of the steps are below.
    pub q95: f64,
}

/// One point of the curves of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Distance from the front of the vehicle to the ego's rear (m).
    pub gap_m: f64,
    /// Probability that the vehicle has a confirmed track there.
    pub confirmed: Estimate,
    /// Errors of the position along the road (m), of the position across it (m), and of the speed
    /// (m/s), over the approaches with a track there; `None` if there are fewer than two.
    pub errors: Option<[PointErrors; 3]>,
}

/// Bias, root mean square and 95 % quantile of the magnitude of an error at one distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointErrors {
    /// Mean error.
    pub bias: f64,
    /// Root mean square error.
    pub rmse: f64,
    /// Quantile of the magnitude that 95 % of the approaches are below.
    pub q95: f64,
}

impl PointErrors {
    /// Returns the figures of at least one error.
    fn of(errors: &[f64]) -> Self {
        let mut magnitudes: Vec<f64> = errors.iter().map(|error| error.abs()).collect();
        magnitudes.sort_by(f64::total_cmp);
        Self {
            bias: mean(errors.iter().copied()),
            rmse: mean(errors.iter().map(|error| error * error)).sqrt(),
            q95: quantile(&magnitudes, 0.95),
        }
    }
}

/// A bin of the calibration of the class scores.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationBin {
    /// Mean score of the most probable class.
    pub confidence: f64,
    /// Share of the steps in which that class is the true one.
    pub accuracy: f64,
    /// Number of steps.
    pub steps: u64,
}

/// The figures of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// The curves over the distance, from near to far.
    pub curve: Vec<CurvePoint>,
    /// Distance of the first confirmed track (m); 0 in an approach without one.
    pub range_m: Estimate,
    /// Errors of the position along the road (m), of the position across it (m), and of the speed
    /// (m/s).
    pub errors: Option<[ErrorFigures; 3]>,
    /// Time from the appearance of a vehicle at 40 m until its track is confirmed (s); `None` if it
    /// never is.
    pub confirmed_after_s: Option<Estimate>,
    /// Share of the approaches in which it was confirmed within 4 s.
    pub confirms: Estimate,
    /// Confirmed tracks without a vehicle, per hour.
    pub false_tracks_per_h: Estimate,
    /// Changes of the id of a vehicle's track, per approach.
    pub id_switches: Estimate,
    /// Share of the steps in which the ego knows that its rear sensors have failed. No function is
    /// available then.
    pub unavailable: Estimate,
    /// Mean GOSPA metric (m).
    pub gospa_m: Estimate,
    /// Share of the steps with a track in which the most probable class is the true one.
    pub class_accuracy: Option<Estimate>,
    /// Expected calibration error of the class scores: the mean difference of score and accuracy
    /// over the bins.
    pub calibration_error: Option<f64>,
    /// The bins of the calibration.
    pub calibration: Vec<CalibrationBin>,
    /// Mean normalised squared error: 4 if the covariance is right.
    pub nees: Option<Estimate>,
}

impl Figures {
    /// Returns the figures of all approaches of a case.
    pub fn of(approaches: &[Approach]) -> Self {
        let tracked = |approach: &Approach| -> Vec<Tracked> {
            approach.observations.iter().filter_map(|observation| observation.tracked).collect()
        };
        let runs: Vec<Vec<Tracked>> = approaches.iter().map(tracked).collect();
        let of_error = |error: fn(&Tracked) -> f64| {
            error_figures(&runs.iter().map(|run| run.iter().map(error).collect()).collect::<Vec<Vec<f64>>>())
        };
        let errors = (
            of_error(|track| track.position_m[0]),
            of_error(|track| track.position_m[1]),
            of_error(|track| track.speed_mps),
        );
        let steps: usize = approaches.iter().map(|approach| approach.observations.len()).sum();
        let false_tracks = approaches.iter().map(|approach| approach.false_tracks).sum();
        let confirmed: Vec<f64> = approaches.iter().filter_map(|approach| approach.confirmed_after_s).collect();
        let (calibration, calibration_error) = calibration(&runs);
        let right = |run: &Vec<Tracked>| {
            (!run.is_empty()).then(|| mean(run.iter().map(|track| f64::from(u8::from(track.is_class_right)))))
        };
        Self {
            curve: curve(approaches),
            range_m: student(&approaches.iter().map(first_confirmed_m).collect::<Vec<_>>()),
            errors: match errors {
                (Some(along), Some(across), Some(speed)) => Some([along, across, speed]),
                _ => None,
            },
            confirmed_after_s: (!confirmed.is_empty()).then(|| student(&confirmed)),
            confirms: share(confirmed.len(), approaches.len()),
            false_tracks_per_h: rate(false_tracks, steps as f64 * CONTROL_STEP.s() / 3_600.0),
            id_switches: student(&approaches.iter().map(|approach| approach.id_switches as f64).collect::<Vec<_>>()),
            unavailable: student(&approaches.iter().map(failed_share).collect::<Vec<_>>()),
            gospa_m: student(&approaches.iter().map(mean_gospa_m).collect::<Vec<_>>()),
            class_accuracy: Some(runs.iter().filter_map(right).collect::<Vec<_>>())
                .filter(|shares| !shares.is_empty())
                .map(|shares| student(&shares)),
            calibration_error,
            calibration,
            nees: Some(approaches.iter().filter(|approach| !approach.nees.is_empty()))
                .map(|with| with.map(|approach| mean(approach.nees.iter().copied())).collect::<Vec<_>>())
                .filter(|means| !means.is_empty())
                .map(|means| student(&means)),
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

fn mean_gospa_m(approach: &Approach) -> f64 {
    mean(approach.observations.iter().map(|observation| observation.gospa_m))
}

fn failed_share(approach: &Approach) -> f64 {
    approach.failed_steps as f64 / approach.observations.len() as f64
}

fn first_confirmed_m(approach: &Approach) -> f64 {
    approach
        .observations
        .iter()
        .find(|observation| observation.tracked.is_some())
        .map_or(0.0, |observation| observation.gap_m)
}

/// Returns the mean of independent values with Student's interval.
fn student(values: &[f64]) -> Estimate {
    let count = values.len() as f64;
    let value = mean(values.iter().copied());
    let variance = values.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (count - 1.0);
    let half = match StudentsT::new(0.0, 1.0, count - 1.0) {
        Ok(student) if count > 1.0 => student.inverse_cdf(0.975) * (variance / count).sqrt(),
        _ => f64::INFINITY,
    };
    Estimate { value, interval_95: [value - half, value + half] }
}

/// Returns a share of independent approaches.
fn share(hits: usize, trials: usize) -> Estimate {
    let interval_95 = clopper_pearson(hits as u64, trials as u64, 0.95);
    Estimate { value: hits as f64 / trials as f64, interval_95 }
}

/// Returns the rate of events that happen independently: Garwood's interval (1936).
fn rate(events: u64, hours: f64) -> Estimate {
    let bound = |degrees: f64, quantile: f64| {
        ChiSquared::new(degrees).map_or(0.0, |chi| 0.5 * chi.inverse_cdf(quantile)) / hours
    };
    let events = events as f64;
    let low = if events > 0.0 { bound(2.0 * events, 0.025) } else { 0.0 };
    Estimate { value: events / hours, interval_95: [low, bound(2.0 * events + 2.0, 0.975)] }
}

/// Returns the figures of an error, run by run; `None` if no run has any.
fn error_figures(runs: &[Vec<f64>]) -> Option<ErrorFigures> {
    let runs: Vec<&Vec<f64>> = runs.iter().filter(|run| !run.is_empty()).collect();
    let mut magnitudes: Vec<f64> = runs.iter().flat_map(|run| run.iter().map(|error| error.abs())).collect();
    if magnitudes.is_empty() {
        return None;
    }
    magnitudes.sort_by(f64::total_cmp);
    let of_runs = |transform: fn(f64) -> f64| {
        student(&runs.iter().map(|run| mean(run.iter().map(|error| transform(*error)))).collect::<Vec<_>>())
    };
    let squares = of_runs(|error| error * error);
    let rmse =
        Estimate { value: squares.value.sqrt(), interval_95: squares.interval_95.map(|bound| bound.max(0.0).sqrt()) };
    Some(ErrorFigures { bias: of_runs(|error| error), rmse, q95: quantile(&magnitudes, 0.95) })
}

/// Returns the curves. At each distance, the first step of each approach at this distance or nearer
/// counts.
fn curve(approaches: &[Approach]) -> Vec<CurvePoint> {
    let points = (GAPS_M[0] / SPACING_M).floor() as usize;
    let at = |index: usize| {
        let gap_m = SPACING_M * index as f64;
        let tracks: Vec<Option<Tracked>> = approaches
            .iter()
            .filter_map(|approach| approach.observations.iter().find(|observation| observation.gap_m <= gap_m))
            .filter(|observation| observation.gap_m > gap_m - SPACING_M)
            .map(|observation| observation.tracked)
            .collect();
        if tracks.is_empty() {
            return None;
        }
        let tracked: Vec<Tracked> = tracks.iter().flatten().copied().collect();
        let errors_of = |error: fn(&Tracked) -> f64| PointErrors::of(&tracked.iter().map(error).collect::<Vec<f64>>());
        let errors = (tracked.len() > 1).then(|| {
            [
                errors_of(|track| track.position_m[0]),
                errors_of(|track| track.position_m[1]),
                errors_of(|track| track.speed_mps),
            ]
        });
        Some(CurvePoint { gap_m, confirmed: share(tracked.len(), tracks.len()), errors })
    };
    (1..=points).filter_map(at).collect()
}

/// Returns the bins of the calibration, and the expected calibration error (Naeini, Cooper and
/// Hauskrecht 2015).
fn calibration(runs: &[Vec<Tracked>]) -> (Vec<CalibrationBin>, Option<f64>) {
    let mut bins = [(0.0, 0.0, 0_u64); BINS];
    for track in runs.iter().flatten() {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the bins")]
        let bin = ((track.confidence * BINS as f64) as usize).min(BINS - 1);
        let (confidence, right, steps) = &mut bins[bin];
        (*confidence, *right, *steps) =
            (*confidence + track.confidence, *right + f64::from(u8::from(track.is_class_right)), *steps + 1);
    }
    let total: u64 = bins.iter().map(|(_, _, steps)| steps).sum();
    let filled = bins.into_iter().filter(|(_, _, steps)| *steps > 0);
    let bins: Vec<CalibrationBin> = filled
        .map(|(confidence, right, steps)| CalibrationBin {
            confidence: confidence / steps as f64,
            accuracy: right / steps as f64,
            steps,
        })
        .collect();
    let error = bins.iter().map(|bin| bin.steps as f64 * (bin.confidence - bin.accuracy).abs()).sum::<f64>();
    (bins, (total > 0).then(|| error / total as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::approach::Observation;

    #[test]
    fn intervals_are_those_of_the_tables() {
        // Student's quantile for nine degrees of freedom is 2.262.
        let values: Vec<f64> = (0..10).map(f64::from).collect();
        let Estimate { value, interval_95: [low, high] } = student(&values);
        assert!((value - 4.5).abs() < 1e-12 && (high - low - 2.0 * 2.262 * 3.02765 / 10.0_f64.sqrt()).abs() < 1e-3);
        // Garwood: no event, and ten.
        assert!((rate(0, 1.0).interval_95[1] - 3.689).abs() < 1e-3);
        let ten = rate(10, 2.0);
        assert!((ten.interval_95[0] - 4.795 / 2.0).abs() < 1e-3 && (ten.interval_95[1] - 18.390 / 2.0).abs() < 1e-3);
        assert_eq!(student(&[1.0]).interval_95, [f64::NEG_INFINITY, f64::INFINITY]);
    }

    #[test]
    fn errors_have_their_bias_rmse_and_quantile() {
        let runs = vec![vec![1.0, -1.0], vec![3.0, 1.0], vec![]];
        let figures = error_figures(&runs).unwrap();
        assert!((figures.bias.value - 1.0).abs() < 1e-12 && (figures.rmse.value - 3.0_f64.sqrt()).abs() < 1e-12);
        assert!(error_figures(&[vec![]]).is_none());
    }

    #[test]
    fn a_point_of_a_curve_has_the_errors_of_the_approaches_at_its_distance() {
        let tracked = |along_m| Tracked {
            position_m: [along_m, 0.5],
            speed_mps: -along_m,
            is_class_right: true,
            confidence: 1.0,
        };
        // The second observation of an approach is nearer than the distance of the point, and does
        // not count.
        let approach = |along_m| Approach {
            observations: [(29.0, along_m), (28.0, 100.0)]
                .map(|(gap_m, along_m)| Observation { gap_m, tracked: Some(tracked(along_m)), gospa_m: 0.0 })
                .to_vec(),
            ..Approach::default()
        };
        let points = curve(&[approach(-1.0), approach(2.0), approach(3.0)]);
        let point = points.iter().find(|point| point.gap_m == 30.0).unwrap();
        let [along, across, speed] = point.errors.unwrap();
        assert!((along.bias - 4.0 / 3.0).abs() < 1e-12 && (along.rmse - (14.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        // The quantile lies between the two largest magnitudes, a tenth of their difference below
        // the largest.
        assert!((along.q95 - 2.9).abs() < 1e-12 && (speed.bias + along.bias).abs() < 1e-12, "{along:?}");
        assert_eq!(across, PointErrors { bias: 0.5, rmse: 0.5, q95: 0.5 });
    }
}
