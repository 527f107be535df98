//! The values that a recorded lane change gives for a logical scenario: a rear vehicle approaches
//! another vehicle and overtakes it.
//!
//! | value | read from |
//! |---|---|
//! | speed of the ego | its median speed from the start of the approach to the crossing |
//! | closing speed | the highest difference of both speeds in that time: the rear vehicle before its driver adapts |
//! | headway at the crossing | the rear vehicle's time headway to the ego when it crosses the marking |
//! | front headway | the median time headway of the ego to the lead vehicle in that time, if one is recorded |
//! | duration | the whole lane change, if it is recorded as a whole |

use closecall_traffic::metrics::{bumper_gap_m, time_headway_s};
use closecall_traffic::statistics::quantiles::median;
use closecall_traffic::{Dimensions, Lane, Side, Time, Trajectory, VehicleClass};

use super::find::{begin, next_ahead};
use super::frame::RoadSection;
use super::{LEAD_IN, LONGEST_THW_S, NoEncounter};
use crate::criticality::CriticalLaneChange;
use crate::filters::{PERIOD, SmoothedTrajectoryData};

/// Closing speed below which the rear vehicle does not approach (m/s): an assumption; 0.3 to 1 are
/// plausible. Human drivers do not notice a slower approach from 100 m.
const MIN_CLOSING_MPS: f64 = 0.5;
/// Longest front headway at which the ego follows (s), as in `fit`.
const FOLLOWING_THW_S: f64 = 3.0;

/// A vehicle of an approach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Party {
    /// The track in the trajectory data.
    pub track_id: u64,
    /// The class.
    pub class: VehicleClass,
    /// The size.
    pub dimensions: Dimensions,
}

/// The values of an approach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ApproachValues {
    /// Speed of the ego (m/s).
    pub ego_mps: f64,
    /// Highest closing speed of the rear vehicle (m/s).
    pub closing_mps: f64,
    /// Time headway of the rear vehicle at the crossing (s).
    pub crossing_thw_s: f64,
    /// Time headway of the ego to the lead vehicle (s); `None` if no lead vehicle is recorded
    /// within 3 s.
    pub front_thw_s: Option<f64>,
    /// Duration of the lane change (s); `None` if it is not recorded as a whole.
    pub duration_s: Option<f64>,
}

/// An approach in recorded traffic.
#[derive(Clone, Debug, PartialEq)]
pub struct Approach {
    /// Name of the trajectory data set.
    pub data_name: String,
    /// The lane change of the rear vehicle, with its metrics.
    pub change: CriticalLaneChange,
    /// The vehicle that is overtaken.
    pub ego: Party,
    /// The vehicle that changes lanes.
    pub rear: Party,
    /// The vehicle ahead of the ego within 3 s.
    pub lead: Option<Party>,
    /// First second of the trajectory data from which values were read.
    pub from_s: f64,
    /// Last second: the time of the crossing.
    pub to_s: f64,
    /// Number of lanes of the road.
    pub lanes: u8,
    /// Width of each lane (m).
    pub lane_width_m: f64,
    /// Lane that the rear vehicle leaves.
    pub home: Lane,
    /// The values.
    pub values: ApproachValues,
}

impl Approach {
    /// Returns the metrics that are critical, by their names.
    pub fn critical_metrics(&self) -> Vec<&'static str> {
        self.change.metrics.named().iter().filter(|(_, metric)| metric.is_critical()).map(|(name, _)| *name).collect()
    }

    /// Returns the side to which the rear vehicle overtakes.
    pub fn direction(&self) -> Side {
        self.change.lane_change.direction
    }
}

/// The reason why a lane change is not an approach.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoApproach {
    /// Nobody is overtaken.
    #[error("no vehicle is ahead in the lane that it leaves")]
    NobodyAhead,
    /// The rear vehicle is not faster.
    #[error("it never closes in on the vehicle ahead by {MIN_CLOSING_MPS} m/s or more")]
    NotClosing,
    /// The rear vehicle is not close behind the ego at the crossing.
    #[error("at the crossing it is not behind the vehicle ahead within {LONGEST_THW_S:.0} s")]
    NotBehind,
    /// The road cannot be built.
    #[error("{}", without_track(.0))]
    Road(NoEncounter),
}

/// Returns the reason without the number of the track, so that equal reasons are counted together.
fn without_track(reason: &NoEncounter) -> String {
    match reason {
        NoEncounter::TooManyLanes { lanes, most, .. } => {
            format!("its road has {lanes} lanes; at most {most} are possible")
        }
        reason => reason.to_string(),
    }
}

/// Reads the approach of the lane change `change` from `data`.
///
/// # Errors
/// [`NoApproach`] if nobody is overtaken.
pub fn approach(data: &SmoothedTrajectoryData, change: &CriticalLaneChange) -> Result<Approach, NoApproach> {
    let lane_change = &change.lane_change;
    let (rear, start) = begin(data, lane_change).ok_or(NoApproach::NobodyAhead)?;
    let lane = Lane(lane_change.from_lane);
    let crossing = Time::from_s(lane_change.crossing_s);
    let ego = next_ahead(data, rear, lane, start).ok_or(NoApproach::NobodyAhead)?;
    let road = RoadSection::of(data, rear, lane_change).map_err(NoApproach::Road)?;
    let instants = approach_of(data, [rear, ego], lane, [start, crossing]);
    let pairs: Vec<_> = instants.iter().filter_map(|&time| Some((time, rear.at(time)?, ego.at(time)?))).collect();
    let from = pairs.first().map_or(start, |(time, _, _)| *time);
    let closings = pairs.iter().map(|(_, rear, ego)| rear.speed_mps - ego.speed_mps);
    let closing_mps = closings.fold(f64::NEG_INFINITY, f64::max);
    if !(closing_mps >= MIN_CLOSING_MPS) {
        return Err(NoApproach::NotClosing);
    }
    // The crossing may lie between two instants of the clock.
    let at_crossing = pairs.last().ok_or(NoApproach::NotBehind)?;
    let crossing_thw_s = headway_s([rear, ego], at_crossing.0).filter(|thw_s| *thw_s > 0.0 && *thw_s <= LONGEST_THW_S);
    let lead = next_ahead(data, ego, lane, start);
    let headways = |lead: &Trajectory| -> Vec<f64> {
        pairs.iter().filter_map(|(time, _, _)| headway_s([ego, lead], *time)).filter(|thw_s| *thw_s > 0.0).collect()
    };
    let front = lead.and_then(|lead| Some((lead, headways(lead))).filter(|(_, headways)| !headways.is_empty()));
    let front = front.map(|(lead, headways)| (lead, median(headways))).filter(|(_, thw_s)| *thw_s <= FOLLOWING_THW_S);
    let values = ApproachValues {
        ego_mps: median(pairs.iter().map(|(_, _, ego)| ego.speed_mps).collect()),
        closing_mps,
        crossing_thw_s: crossing_thw_s.ok_or(NoApproach::NotBehind)?,
        front_thw_s: front.map(|(_, thw_s)| thw_s),
        duration_s: lane_change.complete.then_some(lane_change.duration_s),
    };
    Ok(Approach {
        data_name: data.name.clone(),
        change: change.clone(),
        ego: party(ego),
        rear: party(rear),
        lead: front.map(|(lead, _)| party(lead)),
        from_s: from.s(),
        to_s: lane_change.crossing_s,
        lanes: road.lanes,
        lane_width_m: road.lane_width_m,
        home: road.lane(lane_change.from_lane).unwrap_or(Lane(1)),
        values,
    })
}

fn party(track: &Trajectory) -> Party {
    Party { track_id: track.track_id, class: track.class, dimensions: track.dimensions }
}

/// Returns the instants from which values are read. At these instants, up to the crossing, the ego
/// is the next vehicle ahead of the rear vehicle, without interruption before the start of the lane
/// change, and at most [`LEAD_IN`] before it.
fn approach_of(
    data: &SmoothedTrajectoryData,
    [rear, ego]: [&Trajectory; 2],
    lane: Lane,
    [start, crossing]: [Time; 2],
) -> Vec<Time> {
    let is_next = |time: &Time| next_ahead(data, rear, lane, *time).is_some_and(|next| next.track_id == ego.track_id);
    let before = (1..=LEAD_IN.ns() / PERIOD.ns()).map(|ticks| start - PERIOD * ticks).take_while(is_next);
    let mut instants: Vec<Time> = before.collect();
    instants.reverse();
    let mut time = start;
    while time <= crossing.max(start) {
        instants.push(time);
        time += PERIOD;
    }
    instants
}

/// Returns the time headway of the first track to the second (s), or `None` if it has none.
fn headway_s([follower, ahead]: [&Trajectory; 2], time: Time) -> Option<f64> {
    let (point, next) = (follower.at(time)?, ahead.at(time)?);
    let gap_m = bumper_gap_m(next.s_m - point.s_m, follower.dimensions.length_m, ahead.dimensions.length_m);
    time_headway_s(gap_m, point.speed_mps).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criticality::{Judgement, criticality};
    use crate::filters::smooth;
    use crate::trajectory_data::test_support::{changing_track, straight_track, trajectory_data_of};

    /// A vehicle at 30 m/s changes lanes to the left behind a vehicle at `ego_mps`, which follows
    /// another vehicle 30 m ahead.
    fn recorded(ego_mps: f64) -> Result<Approach, NoApproach> {
        let rear = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110);
        let ego = straight_track(2, 40.0, ego_mps, -5.25, 110);
        let lead = straight_track(3, 40.0 + 34.5, ego_mps, -5.25, 110);
        let data = smooth(&trajectory_data_of(vec![rear, ego, lead]));
        approach(&data, &criticality(&data, &Judgement::default())[0])
    }

    #[test]
    fn an_approach_has_the_recorded_values() {
        let approach = recorded(25.0).unwrap();
        let ApproachValues { ego_mps, closing_mps, crossing_thw_s, front_thw_s, .. } = approach.values;
        assert!((ego_mps - 25.0).abs() < 1e-6 && (closing_mps - 5.0).abs() < 1e-6, "{approach:?}");
        // The crossing is at 5.5 s or one frame later, with a gap of 40 − 4.5 − 5·t (m) at 30 m/s.
        assert!((crossing_thw_s - (35.5 - 5.0 * 5.5) / 30.0).abs() < 1.0 / 30.0, "{crossing_thw_s}");
        assert!((front_thw_s.unwrap() - 30.0 / 25.0).abs() < 1e-6);
        assert_eq!((approach.ego.track_id, approach.lead.unwrap().track_id, approach.rear.track_id), (2, 3, 1));
        assert!(approach.from_s < 3.0 && approach.to_s > 5.0 && approach.to_s < 6.0, "{approach:?}");
    }

    #[test]
    fn a_vehicle_that_does_not_close_in_overtakes_nobody() {
        assert_eq!(recorded(29.8), Err(NoApproach::NotClosing));
        let rear = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110);
        let data = smooth(&trajectory_data_of(vec![rear]));
        let changes = criticality(&data, &Judgement::default());
        assert_eq!(approach(&data, &changes[0]), Err(NoApproach::NobodyAhead));
    }
}
