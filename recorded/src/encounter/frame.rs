//! The frame of an encounter: its road and its clock, relative to the road and the clock of the
//! trajectory data.

use std::collections::BTreeSet;

use closecall_traffic::{Lane, Time, Trajectory, TrajectoryPoint};

use super::NoEncounter;
use crate::filters::{SmoothedTrajectoryData, resample};
use crate::lane_change::LaneChange;
use crate::trajectory_data::Carriageways;

/// Largest number of lanes of a road.
const MAX_LANES: u8 = 8;

/// The frame of an encounter, located in the frame of the trajectory data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Start of the encounter.
    pub(super) start: Time,
    /// End of the encounter.
    pub(super) end: Time,
    /// Position s of the encounter's origin (m).
    pub(super) origin_m: f64,
    pub(super) road: RoadSection,
}

/// The road of an encounter: contiguous lanes among all lanes of the trajectory data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoadSection {
    /// Number of its leftmost lane in the trajectory data.
    pub(super) first: u8,
    /// Number of lanes.
    pub(super) lanes: u8,
    /// Width of each lane (m).
    pub(super) lane_width_m: f64,
    /// Lateral position d of its left edge in the trajectory data (m).
    pub(super) left_edge_m: f64,
}

impl RoadSection {
    /// Finds the road on which the vehicle `ego` makes the lane change `change`.
    pub(super) fn of(
        data: &SmoothedTrajectoryData,
        ego: &Trajectory,
        change: &LaneChange,
    ) -> Result<Self, NoEncounter> {
        let carriageways = Carriageways::of(data.trajectories());
        let at = ego.at(Time::from_s(change.crossing_s)).or(ego.points.first());
        let is_beside = |point: &&TrajectoryPoint| at.is_none_or(|at| carriageways.share(at.d_m, point.d_m));
        let points = data.trajectories().flat_map(|track| &track.points);
        let mut occupied_lanes: BTreeSet<u8> = points.filter(is_beside).map(|point| point.lane.0).collect();
        let is_marked = |lane: &u8| data.markings.right_edge_m(Lane(*lane)).is_some();
        occupied_lanes.extend((1..=u8::MAX).filter(is_marked));
        occupied_lanes.retain(|lane| !data.markings.is_median(Lane(*lane)));
        occupied_lanes.extend([change.from_lane, change.to_lane]);
        let left = change.from_lane.min(change.to_lane);
        let first = (1..=left).rev().take_while(|lane| occupied_lanes.contains(lane)).last().unwrap_or(left);
        let last = (left..=u8::MAX).take_while(|lane| occupied_lanes.contains(lane)).last().unwrap_or(left);
        let lanes = last - first + 1;
        if lanes > MAX_LANES {
            return Err(NoEncounter::TooManyLanes { track_id: change.track_id, lanes, most: MAX_LANES });
        }
        let lane_width_m = data.markings.typical_lane_width_m();
        let crossed_m = data.markings.right_edge_m(Lane(left));
        let crossed_m = crossed_m.or_else(|| ego.at(Time::from_s(change.crossing_s)).map(|point| point.d_m));
        let left_edge_m = crossed_m.unwrap_or(0.0) + f64::from(left - first + 1) * lane_width_m;
        Ok(Self { first, lanes, lane_width_m, left_edge_m })
    }

    /// Converts lane number `lane` of the trajectory data to a lane of this road. Returns `None` if
    /// it is not part of it.
    pub(super) fn lane(&self, lane: u8) -> Option<Lane> {
        let index = lane.checked_sub(self.first)?;
        (index < self.lanes).then(|| Lane(index + 1))
    }
}

impl Frame {
    /// Returns the part of a track that lies within the encounter, in its frame, with a point at
    /// every `period`.
    ///
    /// Returns `None` if a point of that part is on another road, or if fewer than two points
    /// remain.
    pub(super) fn view(&self, track: &Trajectory, period: Time) -> Option<Trajectory> {
        let within = track.points.iter().filter(|point| point.time >= self.start && point.time <= self.end);
        let points: Option<Vec<TrajectoryPoint>> = within.map(|point| self.point(point)).collect();
        let points = resample(&points?, period);
        (points.len() >= 2).then(|| track.with_points(points))
    }

    /// Converts a point to the frame of the encounter. Returns `None` if it is on another road.
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
