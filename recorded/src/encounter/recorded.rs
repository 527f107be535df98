//! An encounter of recorded traffic, and the reasons why a lane change is no encounter.

use crate::lane_change::LaneChange;
use closecall_traffic::{Lane, Measured, Time, Trajectory};

/// Longest part of an encounter before the lane change begins.
pub const LEAD_IN: Time = Time::from_ms(20_000);
/// Part of an encounter after the lane change ends.
pub const LEAD_OUT: Time = Time::from_ms(6_000);
/// Shortest time from the start of an encounter to the crossing: a shorter approach is not
/// informative. If no lead vehicle is required, a lane change that is recorded from its start on
/// needs no longer approach.
pub const SHORTEST_APPROACH: Time = Time::from_ms(2_000);
/// Distance to the ego vehicle along the road below which another vehicle belongs to the encounter
/// (m).
pub const REACH_M: f64 = 150.0;
/// Longest time headway of the rear vehicle to the ego vehicle at the crossing (s): beyond it, the
/// rear vehicle is not considered to change lanes because of the ego vehicle.
pub const LONGEST_THW_S: f64 = 5.0;

/// Index of the ego vehicle in [`RecordedEncounter::vehicles`].
pub const EGO_INDEX: usize = 0;
/// Index of the lead vehicle in [`RecordedEncounter::vehicles`], if there is one.
pub const LEAD_INDEX: usize = 1;
/// Index of the rear vehicle in [`RecordedEncounter::vehicles`], if there is a lead vehicle.
pub const REAR_INDEX: usize = 2;
/// Indices of the rear vehicle and of the vehicle that it overtakes, if no lead vehicle is
/// required.
const REAR_ALONE_INDEX: usize = 0;
const OVERTAKEN_INDEX: usize = 1;

/// Whether an encounter has a lead vehicle, whose distance to the ego vehicle is the margin that
/// can be increased.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lead {
    /// A lane change without a lead vehicle is no encounter.
    Required,
    /// No vehicle has that role. A lane change without an ego vehicle is an encounter, too.
    LeftOut,
}

/// One vehicle of an encounter.
#[derive(Clone, Debug)]
pub struct Participant {
    /// The trajectory, in the frame of the encounter.
    pub trajectory: Trajectory,
    /// The lane changes, with the time and the lane numbers of the trajectory data.
    pub changes: Vec<LaneChange>,
}

/// An encounter from trajectory data.
#[derive(Clone, Debug)]
pub struct RecordedEncounter {
    /// Name of the trajectory data set.
    pub data_name: String,
    /// Lane change of the rear vehicle, with the time and the lane numbers of the trajectory data.
    pub change: LaneChange,
    /// Time of the trajectory data at time 0 of the encounter.
    pub start: Time,
    /// Time of the encounter at which the centre of the rear vehicle crosses the marking.
    pub crossing: Time,
    /// Time of the encounter at its end.
    pub end: Time,
    /// Time headway of the rear vehicle to the ego vehicle at the crossing (s). Without a lead
    /// vehicle it is not required, and then absent.
    pub crossing_thw_s: Measured,
    /// Number of lanes of the road.
    pub lanes: u8,
    /// Width of each lane (m).
    pub lane_width_m: f64,
    /// Lane that the rear vehicle leaves.
    pub home: Lane,
    /// Lane that the rear vehicle changes to.
    pub target: Lane,
    /// Whether one of the vehicles is the lead vehicle.
    pub lead: Lead,
    /// Whether one of the vehicles is the ego vehicle: always with a lead vehicle.
    pub has_ego: bool,
    /// The vehicles with roles, then all other vehicles that come near, in order of their track
    /// ids. The roles are the ego, the lead and the rear vehicle; without a lead vehicle, the rear
    /// vehicle and, if there is one, the ego vehicle.
    pub vehicles: Vec<Participant>,
}

impl RecordedEncounter {
    /// Returns the trajectories of the ego, the lead and the rear vehicle of an encounter with a
    /// lead vehicle, in this order.
    pub fn ego_lead_rear(&self) -> [&Trajectory; 3] {
        [EGO_INDEX, LEAD_INDEX, REAR_INDEX].map(|index| &self.vehicles[index].trajectory)
    }

    /// Returns the index of the rear vehicle in [`RecordedEncounter::vehicles`].
    pub fn rear_index(&self) -> usize {
        match self.lead {
            Lead::Required => REAR_INDEX,
            Lead::LeftOut => REAR_ALONE_INDEX,
        }
    }

    /// Returns the index of the vehicle that the rear vehicle overtakes, the ego vehicle, in
    /// [`RecordedEncounter::vehicles`]. Returns `None` if no vehicle is ahead.
    pub fn overtaken_index(&self) -> Option<usize> {
        match self.lead {
            Lead::Required => Some(EGO_INDEX),
            Lead::LeftOut => self.has_ego.then_some(OVERTAKEN_INDEX),
        }
    }

    /// Returns the number of vehicles with roles, which come first in
    /// [`RecordedEncounter::vehicles`].
    pub fn roles(&self) -> usize {
        match self.lead {
            Lead::Required => REAR_INDEX + 1,
            Lead::LeftOut => 1 + usize::from(self.has_ego),
        }
    }

    /// Returns the rear vehicle, which changes lanes.
    pub fn rear(&self) -> &Participant {
        &self.vehicles[self.rear_index()]
    }

    /// Converts a time of the trajectory data (s) to the clock of the encounter.
    pub fn time_of(&self, recorded_s: f64) -> Time {
        Time::from_s(recorded_s) - self.start
    }
}

/// The reason why a lane change is not an encounter. Track ids and lanes are as in the trajectory
/// data.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoEncounter {
    /// The trajectory data does not contain the track.
    #[error("the trajectory file has no track {track_id}")]
    NoTrack {
        /// Track id of the rear vehicle.
        track_id: u64,
    },
    /// No vehicle is ahead of the rear vehicle.
    #[error(
        "no vehicle is ahead of track {track_id} in lane {lane} when its lane change begins: there is no ego vehicle"
    )]
    NoEgo {
        /// Track id of the rear vehicle.
        track_id: u64,
        /// The lane that the rear vehicle leaves.
        lane: u8,
    },
    /// No vehicle is ahead of the ego vehicle.
    #[error(
        "no vehicle is ahead of track {ego_id}, the ego vehicle in front of track {track_id}: without a lead vehicle \
         there is no margin to increase"
    )]
    NoLead {
        /// Track id of the rear vehicle.
        track_id: u64,
        /// Track id of the ego vehicle.
        ego_id: u64,
    },
    /// The vehicles with roles are not recorded together for long enough before the crossing.
    #[error(
        "track {track_id}{}{} is recorded for {recorded_s:.1} s before it crosses the marking; {needed_s:.1} s are needed{}",
        ego_id.map_or(String::new(), |ego_id| format!(" behind track {ego_id}")),
        front_id.map_or(String::new(), |front_id| format!(" behind track {front_id}")),
        front_id.map_or(", or a record that begins before the lane change does", |_| "")
    )]
    TooShort {
        /// Track id of the rear vehicle.
        track_id: u64,
        /// Track id of the ego vehicle, if there is one.
        ego_id: Option<u64>,
        /// Track id of the lead vehicle, if it is required.
        front_id: Option<u64>,
        /// Time for which they are recorded together (s).
        recorded_s: f64,
        /// Least time that is required (s).
        needed_s: f64,
    },
    /// The track of one of the three vehicles ends before the crossing.
    #[error(
        "track {track_id} crosses the marking {missing_s:.1} s after the end of its own track, or of track {ego_id}{} ahead \
         of it: all of them have to be recorded until then",
        front_id.map_or(String::new(), |front_id| format!(" or {front_id}"))
    )]
    EndsBeforeCrossing {
        /// Track id of the rear vehicle.
        track_id: u64,
        /// Track id of the ego vehicle.
        ego_id: u64,
        /// Track id of the lead vehicle, if it is required.
        front_id: Option<u64>,
        /// Time from the end of the first of the three tracks to the crossing (s).
        missing_s: f64,
    },
    /// The rear vehicle is not close behind the ego vehicle when it crosses the marking.
    #[error(
        "as track {track_id} crosses the marking, its headway to track {ego_id} is {}: it has to be above 0 and at most \
         {longest_s:.0} s",
        match thw_s { Ok(thw_s) => format!("{thw_s:.2} s"), Err(absent) => format!("none ({absent})") }
    )]
    NotBehind {
        /// Track id of the rear vehicle.
        track_id: u64,
        /// Track id of the ego vehicle.
        ego_id: u64,
        /// Time headway of the rear vehicle at the crossing (s).
        thw_s: Measured,
        /// Longest time headway that is accepted (s).
        longest_s: f64,
    },
    /// One of the three vehicles is also recorded outside the lanes of the road.
    #[error("track {track_id}, or one of the two ahead of it, leaves the road on which it changes lanes")]
    LeavesTheRoad {
        /// Track id of the rear vehicle.
        track_id: u64,
    },
    /// The road has more lanes than a road is allowed to have.
    #[error("the road of track {track_id} has {lanes} lanes; at most {most} are possible")]
    TooManyLanes {
        /// Track id of the rear vehicle.
        track_id: u64,
        /// Number of lanes.
        lanes: u8,
        /// Largest number of lanes that is allowed.
        most: u8,
    },
}
