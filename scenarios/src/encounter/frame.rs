//! The road and the clock of an encounter.

use std::collections::BTreeSet;

use closecall_traffic::{Lane, Time, Trajectory, TrajectoryPoint};

use super::NoEncounter;
use crate::filters::{SmoothedRecording, resample};
use crate::lane_change::LaneChange;

/// Lane widths that a road may have [m], and the most lanes.
const LANE_WIDTHS_M: [f64; 2] = [2.5, 5.0];
const MOST_LANES: u8 = 8;

/// Where an encounter's frame lies in its recording's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) start: Time,
    pub(super) end: Time,
    pub(super) origin_m: f64,
    pub(super) road: RoadPlace,
}

/// The lanes of a road among all lanes of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoadPlace {
    /// The recording's number of its leftmost lane.
    pub(super) first: u8,
    pub(super) lanes: u8,
    pub(super) lane_width_m: f64,
    /// Where its left edge lies in the recording [m].
    pub(super) left_edge_m: f64,
}

impl RoadPlace {
    /// The road on which `own` makes `change`.
    pub(super) fn of(
        recording: &SmoothedRecording,
        own: &Trajectory,
        change: &LaneChange,
    ) -> Result<Self, NoEncounter> {
        let mut known: BTreeSet<u8> =
            recording.trajectories().flat_map(|track| &track.points).map(|point| point.lane.0).collect();
        known.extend((1..=u8::MAX).filter(|&lane| recording.markings.right_edge_m(Lane(lane)).is_some()));
        known.extend([change.from_lane, change.to_lane]);
        let left = change.from_lane.min(change.to_lane);
        let first = (1..=left).rev().take_while(|lane| known.contains(lane)).last().unwrap_or(left);
        let last = (left..=u8::MAX).take_while(|lane| known.contains(lane)).last().unwrap_or(left);
        let lanes = last - first + 1;
        if lanes > MOST_LANES {
            return Err(NoEncounter::TooManyLanes { track_id: change.track_id, lanes, most: MOST_LANES });
        }
        let lane_width_m = recording.markings.typical_lane_width_m().clamp(LANE_WIDTHS_M[0], LANE_WIDTHS_M[1]);
        let crossed_m = recording.markings.right_edge_m(Lane(left));
        let crossed_m = crossed_m.or_else(|| own.at(Time::from_s(change.crossing_s)).map(|point| point.d_m));
        let left_edge_m = crossed_m.unwrap_or(0.0) + f64::from(left - first + 1) * lane_width_m;
        Ok(Self { first, lanes, lane_width_m, left_edge_m })
    }

    /// The recording's lane `lane` as this road counts it, where it is one of its own.
    pub(super) fn lane(&self, lane: u8) -> Option<Lane> {
        let place = lane.checked_sub(self.first)?;
        (place < self.lanes).then(|| Lane(place + 1))
    }
}

impl Frame {
    /// The part of a track that lies within the encounter, in its frame, at every `period`; nothing of a vehicle that is
    /// on another road, or there for less than two instants.
    pub(super) fn view(&self, track: &Trajectory, period: Time) -> Option<Trajectory> {
        let within = track.points.iter().filter(|point| point.time >= self.start && point.time <= self.end);
        let points: Option<Vec<TrajectoryPoint>> = within.map(|point| self.point(point)).collect();
        let points = resample(&points?, period);
        (points.len() >= 2).then(|| track.with_points(points))
    }

    fn point(&self, point: &TrajectoryPoint) -> Option<TrajectoryPoint> {
        Some(TrajectoryPoint {
            time: point.time - self.start,
            s_m: point.s_m - self.origin_m,
            d_m: point.d_m - self.road.left_edge_m,
            lane: self.road.lane(point.lane.0)?,
            ..*point
        })
    }
}
