//! The losses of the aerial acquisition: positions, numbers, lane changes and metrics, compared
//! with the truth.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use crate::criticality::{CriticalLaneChange, ENCOUNTER_HORIZON_S, Judgement, criticality};
use crate::filters::smooth;
use crate::lane_change::{Criterion, LaneChange, LaneChangeDetector, LaneReliability};
use crate::trajectory_data::TrajectoryData;
use closecall_traffic::statistics::quantiles::median;
use closecall_traffic::{VehicleClass, maths};
use serde::Serialize;

use crate::aerial::flight::Flight;

/// Largest distance between a vehicle and its track (m): about a lane.
const SAME_VEHICLE_M: f64 = 3.5;
/// Largest difference of the crossing times of the same lane change (s).
const SAME_CHANGE_S: f64 = 1.5;
/// The criteria that need no log of the vehicle's own camera.
const CRITERIA: [Criterion; 2] = [Criterion::Peak, Criterion::Distance];

/// Lane changes by one criterion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CriterionLoss {
    /// The criterion.
    pub criterion: Criterion,
    /// Number of lane changes in the truth.
    pub wanted: usize,
    /// Number of lane changes of the truth that are also in the tracks.
    pub found: usize,
    /// Number of lane changes in the tracks that the truth does not have.
    pub invented: usize,
    /// Median difference of the crossing times (s).
    pub crossing_s: Option<f64>,
}

/// One metric, over the lane changes for which both truth and tracks have a value. Times to
/// collision count only below 10 s.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricLoss {
    /// Name of the metric, which ends with its unit.
    pub metric: &'static str,
    /// Number of lane changes.
    pub n: usize,
    /// Median of the signed difference to the truth.
    pub bias: Option<f64>,
    /// Median of the magnitude of the difference.
    pub error: Option<f64>,
    /// Number of lane changes that are critical either in the truth or in the tracks, but not in
    /// both.
    pub flipped: usize,
}

/// The losses for the vehicles of one class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LossRow {
    /// The class in the truth.
    pub class: VehicleClass,
    /// True if the perspective bias is corrected.
    pub is_corrected: bool,
    /// Number of tracks of the truth.
    pub vehicles: usize,
    /// Share of the vehicles' pictures with a track (-).
    pub followed: Option<f64>,
    /// Root mean squared error along the road (m).
    pub rmse_along_m: Option<f64>,
    /// Root mean squared error across the road (m).
    pub rmse_across_m: Option<f64>,
    /// Mean error across the road (m); positive to the left, away from the camera.
    pub bias_across_m: Option<f64>,
    /// Number of times that a vehicle's track changes its number.
    pub id_switches: usize,
    /// Lane changes by each criterion.
    pub lane_changes: Vec<CriterionLoss>,
    /// The metrics of the lane changes by the peak criterion.
    pub metrics: Vec<MetricLoss>,
}

/// The losses of a flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Losses {
    /// Number of pictures.
    pub frames: usize,
    /// For cars and trucks: raw, then corrected.
    pub rows: Vec<LossRow>,
}

/// Compares the tracks of flights with the truth.
pub fn losses(flights: &[Flight]) -> Losses {
    let mut rows = Vec::new();
    for class in [VehicleClass::Car, VehicleClass::Truck] {
        for is_corrected in [false, true] {
            let estimated = |flight: &Flight| if is_corrected { flight.corrected.clone() } else { flight.raw.clone() };
            let mut sum = Sum::default();
            flights.iter().for_each(|flight| sum.add(&flight.truth, &estimated(flight), class));
            rows.push(sum.row(class, is_corrected));
        }
    }
    Losses { frames: flights.iter().map(|flight| flight.frames).sum(), rows }
}

/// The sums for one class over all flights.
#[derive(Default)]
struct Sum {
    vehicles: usize,
    watched: usize,
    errors_m: Vec<[f64; 2]>,
    id_switches: usize,
    changes: BTreeMap<Criterion, ChangeSum>,
    /// The metrics, in the order of a lane change.
    metrics: BTreeMap<usize, MetricSum>,
}

/// The lane changes of one criterion.
#[derive(Default)]
struct ChangeSum {
    wanted: usize,
    found: usize,
    invented: usize,
    /// Differences of the crossing times (s).
    crossings_s: Vec<f64>,
}

/// The values of one metric.
#[derive(Default)]
struct MetricSum {
    name: &'static str,
    /// Signed differences to the truth.
    differences: Vec<f64>,
    flipped: usize,
}

/// The tracks that follow each track of the truth.
type Followers = BTreeMap<u64, BTreeSet<u64>>;

impl Sum {
    fn add(&mut self, truth: &TrajectoryData, estimated: &TrajectoryData, class: VehicleClass) {
        let classes: BTreeMap<u64, VehicleClass> =
            truth.trajectories.iter().map(|track| (track.track_id, track.class)).collect();
        let is_wanted = |track: u64| classes.get(&track) == Some(&class);
        let followers = self.add_positions(truth, estimated, class);
        let owner = |follower: u64| followers.iter().find(|(_, all)| all.contains(&follower)).map(|(track, _)| *track);
        for criterion in CRITERIA {
            let detector = LaneChangeDetector::new(LaneReliability::Reliable, &truth.markings);
            let all = |data: &TrajectoryData| -> Vec<LaneChange> {
                data.trajectories.iter().flat_map(|track| detector.detect(criterion, track, &[])).collect()
            };
            let (wanted, given) = (all(truth), all(estimated));
            let is_same = |a: &LaneChange, b: &LaneChange| same(a, b, &followers);
            let sum = self.changes.entry(criterion).or_default();
            for change in wanted.iter().filter(|change| is_wanted(change.track_id)) {
                sum.wanted += 1;
                if let Some(other) = given.iter().find(|other| is_same(change, other)) {
                    sum.found += 1;
                    sum.crossings_s.push((other.crossing_s - change.crossing_s).abs());
                }
            }
            let unknown = given.iter().filter(|other| owner(other.track_id).is_some_and(&is_wanted));
            sum.invented += unknown.filter(|other| !wanted.iter().any(|change| is_same(change, other))).count();
        }
        let evaluated = |data: &TrajectoryData| criticality(&smooth(data), &Judgement::default());
        let (wanted, given) = (evaluated(truth), evaluated(estimated));
        for change in wanted.iter().filter(|change| is_wanted(change.lane_change.track_id)) {
            let other = given.iter().find(|other| same(&change.lane_change, &other.lane_change, &followers));
            if let Some(other) = other {
                self.add_metrics(change, other);
            }
        }
    }

    fn add_positions(&mut self, truth: &TrajectoryData, estimated: &TrajectoryData, class: VehicleClass) -> Followers {
        let mut followers = Followers::new();
        for track in &truth.trajectories {
            let mut current = None;
            let is_wanted = track.class == class;
            self.vehicles += usize::from(is_wanted);
            for point in &track.points {
                let distance = |other: &closecall_traffic::TrajectoryPoint| {
                    maths::hypot(other.s_m - point.s_m, other.d_m - point.d_m)
                };
                let near = estimated.trajectories.iter().filter_map(|other| {
                    let at = other.at(point.time).filter(|at| distance(at) < SAME_VEHICLE_M)?;
                    Some((other.track_id, at))
                });
                let best = near.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
                self.watched += usize::from(is_wanted);
                let Some((follower, at)) = best else { continue };
                followers.entry(track.track_id).or_default().insert(follower);
                if is_wanted {
                    self.errors_m.push([at.s_m - point.s_m, at.d_m - point.d_m]);
                    self.id_switches += usize::from(current.is_some_and(|current| current != follower));
                }
                current = Some(follower);
            }
        }
        followers
    }

    fn add_metrics(&mut self, truth: &CriticalLaneChange, estimated: &CriticalLaneChange) {
        for (index, ((name, wanted, _), (_, given, _))) in truth.named().zip(estimated.named()).enumerate() {
            let sum = self.metrics.entry(index).or_insert_with(|| MetricSum { name, ..MetricSum::default() });
            // Almost equal speeds give any time to collision.
            let is_defined = |value: &f64| name != "ttc_s" || *value < ENCOUNTER_HORIZON_S;
            let both = (wanted.value().filter(is_defined), given.value());
            if let (Some(wanted), Some(given)) = both {
                sum.differences.push(given - wanted);
            }
            sum.flipped += usize::from(wanted.is_critical() != given.is_critical());
        }
    }

    fn row(self, class: VehicleClass, is_corrected: bool) -> LossRow {
        let n = self.errors_m.len();
        let mean =
            |value: &dyn Fn(&[f64; 2]) -> f64| (n > 0).then(|| self.errors_m.iter().map(value).sum::<f64>() / n as f64);
        let middle = |values: Vec<f64>| (!values.is_empty()).then(|| median(values));
        LossRow {
            class,
            is_corrected,
            vehicles: self.vehicles,
            followed: (self.watched > 0).then(|| n as f64 / self.watched as f64),
            rmse_along_m: mean(&|error| error[0] * error[0]).map(f64::sqrt),
            rmse_across_m: mean(&|error| error[1] * error[1]).map(f64::sqrt),
            bias_across_m: mean(&|error| error[1]),
            id_switches: self.id_switches,
            lane_changes: self
                .changes
                .into_iter()
                .map(|(criterion, ChangeSum { wanted, found, invented, crossings_s })| CriterionLoss {
                    criterion,
                    wanted,
                    found,
                    invented,
                    crossing_s: middle(crossings_s),
                })
                .collect(),
            metrics: self
                .metrics
                .into_values()
                .map(|MetricSum { name, differences, flipped }| MetricLoss {
                    metric: name,
                    n: differences.len(),
                    bias: middle(differences.clone()),
                    error: middle(differences.into_iter().map(f64::abs).collect()),
                    flipped,
                })
                .collect(),
        }
    }
}

/// Returns true if a lane change of the truth and one of the tracks are the same.
fn same(truth: &LaneChange, estimated: &LaneChange, followers: &Followers) -> bool {
    followers.get(&truth.track_id).is_some_and(|all| all.contains(&estimated.track_id))
        && truth.direction == estimated.direction
        && (truth.crossing_s - estimated.crossing_s).abs() < SAME_CHANGE_S
}

impl fmt::Display for Losses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number =
            |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |value| format!("{value:.digits$}"));
        let label =
            |row: &LossRow| format!("{} {}", row.class.name(), if row.is_corrected { "corrected" } else { "raw" });
        writeln!(f, "{} pictures", self.frames)?;
        writeln!(f, "                 vehicles  followed  RMSE along  across  bias across  ID switches")?;
        for row in &self.rows {
            writeln!(
                f,
                "{:<16} {:>8} {:>8} % {:>8} m {:>5} m {:>10} m {:>12}",
                label(row),
                row.vehicles,
                number(row.followed.map(|share| 100.0 * share), 1),
                number(row.rmse_along_m, 2),
                number(row.rmse_across_m, 2),
                number(row.bias_across_m, 2),
                row.id_switches,
            )?;
        }
        writeln!(f, "\nlane changes     criterion   found     invented  crossing differs by (median)")?;
        for row in &self.rows {
            for loss in &row.lane_changes {
                let detected = format!("{}/{}", loss.found, loss.wanted);
                let (name, crossing) = (loss.criterion.name(), number(loss.crossing_s, 2));
                writeln!(f, "{:<16} {name:<9} {detected:>7} {:>12} {crossing:>10} s", label(row), loss.invented)?;
            }
        }
        writeln!(f, "\nmetric           of                   n     bias    error  verdict changes")?;
        for row in &self.rows {
            for loss in &row.metrics {
                let (bias, error) = (number(loss.bias, 3), number(loss.error, 3));
                writeln!(
                    f,
                    "{:<16} {:<16} {:>5} {bias:>8} {error:>8} {:>16}",
                    label(row),
                    loss.metric,
                    loss.n,
                    loss.flipped
                )?;
            }
        }
        Ok(())
    }
}
