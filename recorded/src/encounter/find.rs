//! Assignment of the roles in an encounter, and its start and end.

use closecall_traffic::metrics::{bumper_gap_m, time_headway_s};
use closecall_traffic::{Absent, Lane, Measured, Time, Trajectory, TrajectoryPoint};

use super::frame::{Frame, RoadSection};
use super::{
    EGO_INDEX, LEAD_IN, LEAD_OUT, LONGEST_THW_S, Lead, NoEncounter, Participant, REACH_M, RecordedEncounter,
    SHORTEST_APPROACH,
};
use crate::filters::{PERIOD, SmoothedTrajectoryData};
use crate::lane_change::LaneChange;

/// Extracts the encounter around the lane change `change`, with a trajectory point at every
/// `period`.
///
/// `all` holds all lane changes of `data`. The period of the common clock must be a multiple of
/// `period`.
///
/// # Errors
/// Returns [`NoEncounter`] if the rear vehicle and the vehicles ahead of it are not recorded for
/// long enough before the crossing, or if they do not share a valid road. If a lead vehicle is
/// required, also if there is no ego or no lead vehicle, and if the rear vehicle is not close
/// behind the ego vehicle at the crossing.
pub fn encounter(
    data: &SmoothedTrajectoryData,
    change: &LaneChange,
    all: &[LaneChange],
    period: Time,
    lead: Lead,
) -> Result<RecordedEncounter, NoEncounter> {
    let roles = Roles::of(data, change, lead)?;
    let start = roles.start(data, change)?;
    let road = RoadSection::of(data, roles.rear, change)?;
    let reference = roles.reference();
    let last = reference.span().map_or(start, |(_, last)| last);
    let end = last.min(on_clock(Time::from_s(change.end_s) + LEAD_OUT));
    let origin_m = reference.at(start).map_or(0.0, |point| point.s_m);
    let frame = Frame { start, end, origin_m, road };
    let track_id = roles.rear.track_id;
    let vehicles = participants(data, &roles, &frame, all, period);
    let vehicles = vehicles.ok_or(NoEncounter::LeavesTheRoad { track_id })?;
    let thw_s = roles.headway_s(Time::from_s(change.crossing_s));
    let is_behind = |thw_s: &f64| *thw_s > 0.0 && *thw_s <= LONGEST_THW_S;
    if let (Lead::Required, Some(ego)) = (lead, roles.ego)
        && !thw_s.is_ok_and(|thw_s| is_behind(&thw_s))
    {
        let ego_id = ego.track_id;
        return Err(NoEncounter::NotBehind { track_id, ego_id, thw_s, longest_s: LONGEST_THW_S });
    }
    Ok(RecordedEncounter {
        data_name: data.name.clone(),
        change: change.clone(),
        start,
        crossing: Time::from_s(change.crossing_s) - start,
        end: end - start,
        crossing_thw_s: thw_s,
        lanes: road.lanes,
        lane_width_m: road.lane_width_m,
        home: road.lane(change.from_lane).unwrap_or(Lane(1)),
        target: road.lane(change.to_lane).unwrap_or(Lane(1)),
        lead,
        has_ego: roles.ego.is_some(),
        vehicles,
    })
}

/// Returns the last instant of the common clock at or before `time`.
fn on_clock(time: Time) -> Time {
    Time::from_ns(time.ns().div_euclid(PERIOD.ns()) * PERIOD.ns())
}

/// Returns the track that changes lanes, and the first instant of the common clock at which it is
/// recorded in its old lane while it changes lanes. Returns `None` if `data` does not have the
/// track.
pub(super) fn begin<'a>(data: &'a SmoothedTrajectoryData, change: &LaneChange) -> Option<(&'a Trajectory, Time)> {
    let track = &data.tracks[data.track_index(change.track_id)?];
    let rear = &track.trajectory;
    let crossing = Time::from_s(change.crossing_s);
    let stays = track.stays.iter().filter(|stay| stay.lane.0 == change.from_lane && stay.first < crossing);
    let home_since = stays.map(|stay| stay.first).next_back();
    let recorded_since = rear.span().map(|(first, _)| first);
    let begins = [Some(Time::from_s(change.start_s)), home_since, recorded_since].into_iter().flatten().max();
    // Rounded up to the common clock.
    Some((rear, on_clock(begins.unwrap_or(crossing) + PERIOD - Time::from_ns(1))))
}

/// The vehicles of an encounter, and the time at which their roles are assigned.
struct Roles<'a> {
    /// The ego vehicle: there is one if a lead vehicle is required.
    ego: Option<&'a Trajectory>,
    /// The lead vehicle, if it is required.
    lead: Option<&'a Trajectory>,
    rear: &'a Trajectory,
    /// First instant of the common clock at which the rear vehicle is recorded while it changes
    /// lanes.
    change_start: Time,
}

impl<'a> Roles<'a> {
    /// Assigns the roles at the start of the lane change `change`.
    fn of(data: &'a SmoothedTrajectoryData, change: &LaneChange, lead: Lead) -> Result<Self, NoEncounter> {
        let track_id = change.track_id;
        let (rear, change_start) = begin(data, change).ok_or(NoEncounter::NoTrack { track_id })?;
        let no_ego = NoEncounter::NoEgo { track_id, lane: change.from_lane };
        let lane = Lane(change.from_lane);
        let ahead = next_ahead(data, rear, lane, change_start);
        match lead {
            Lead::Required => {
                let ego = ahead.ok_or(no_ego)?;
                let no_lead = NoEncounter::NoLead { track_id, ego_id: ego.track_id };
                let lead = next_ahead(data, ego, lane, change_start).ok_or(no_lead)?;
                Ok(Self { ego: Some(ego), lead: Some(lead), rear, change_start })
            }
            Lead::LeftOut => Ok(Self { ego: ahead, lead: None, rear, change_start }),
        }
    }

    /// Returns the vehicle at which s is 0 when the encounter starts, and near which the other
    /// vehicles are: the ego vehicle if a lead vehicle is required, otherwise the rear vehicle.
    fn reference(&self) -> &'a Trajectory {
        self.ego.filter(|_| self.lead.is_some()).unwrap_or(self.rear)
    }

    /// Returns the start of the encounter.
    fn start(&self, data: &SmoothedTrajectoryData, change: &LaneChange) -> Result<Time, NoEncounter> {
        match (self.ego, self.lead) {
            (Some(ego), Some(lead)) => self.start_in_order(data, change, [ego, lead]),
            _ => self.start_of_record(data, change),
        }
    }

    /// Returns the first instant at which the rear vehicle is recorded, together with the vehicle
    /// that it overtakes and, if enough time is left, with the vehicle that is ahead of it in its
    /// new lane.
    fn start_of_record(&self, data: &SmoothedTrajectoryData, change: &LaneChange) -> Result<Time, NoEncounter> {
        let crossing = Time::from_s(change.crossing_s);
        let since = |track: &Trajectory| track.span().map_or(self.change_start, |(first, _)| first);
        let earliest = since(self.rear).max(self.change_start - LEAD_IN);
        let start = self.ego.map_or(earliest, |ego| since(ego).max(earliest));
        // A record that holds the lane change from its start on is long enough.
        let holds_start = start <= Time::from_s(change.start_s);
        if !holds_start && crossing < start + SHORTEST_APPROACH {
            return Err(NoEncounter::TooShort {
                track_id: self.rear.track_id,
                ego_id: self.ego.filter(|ego| since(ego) > earliest).map(|ego| ego.track_id),
                front_id: None,
                recorded_s: (crossing - start).s(),
                needed_s: SHORTEST_APPROACH.s(),
            });
        }
        // The first instant of the clock at which the rear vehicle is in its new lane.
        let in_new_lane =
            self.rear.points.iter().find(|point| point.time >= crossing && point.lane.0 == change.to_lane);
        let new_leader = in_new_lane.and_then(|point| next_ahead(data, self.rear, point.lane, point.time));
        let with_new_leader = new_leader.map_or(start, |leader| since(leader).max(start));
        Ok(if crossing < with_new_leader + SHORTEST_APPROACH { start } else { with_new_leader })
    }

    /// Returns the earliest instant from which the three vehicles keep their order in the lane
    /// without interruption.
    fn start_in_order(
        &self,
        data: &SmoothedTrajectoryData,
        change: &LaneChange,
        [ego, lead]: [&Trajectory; 2],
    ) -> Result<Time, NoEncounter> {
        let lane = Lane(change.from_lane);
        let next_id =
            |follower: &Trajectory, time: Time| next_ahead(data, follower, lane, time).map(|track| track.track_id);
        let in_order =
            |time: Time| next_id(self.rear, time) == Some(ego.track_id) && next_id(ego, time) == Some(lead.track_id);
        let max_ticks = LEAD_IN.ns() / PERIOD.ns();
        let instants = (0..=max_ticks).map(|ticks| self.change_start - PERIOD * ticks);
        let start = instants.take_while(|&time| in_order(time)).last().unwrap_or(self.change_start);
        let crossing = Time::from_s(change.crossing_s);
        let recorded_to = [ego, lead, self.rear].into_iter().filter_map(|track| Some(track.span()?.1)).min();
        let until = recorded_to.map_or(start, |last| last.min(crossing));
        let (track_id, ego_id, front_id) = (self.rear.track_id, ego.track_id, Some(lead.track_id));
        // The crossing may lie between two instants of the clock, up to one period after the last
        // recorded one.
        if until + PERIOD < crossing {
            let missing_s = (crossing - until).s();
            return Err(NoEncounter::EndsBeforeCrossing { track_id, ego_id, front_id, missing_s });
        }
        if until < start + SHORTEST_APPROACH {
            return Err(NoEncounter::TooShort {
                track_id,
                ego_id: Some(ego_id),
                front_id,
                recorded_s: (until - start).s(),
                needed_s: SHORTEST_APPROACH.s(),
            });
        }
        Ok(start)
    }

    /// Returns the time headway of the rear vehicle to the ego vehicle (s).
    fn headway_s(&self, time: Time) -> Measured {
        let ego = self.ego.ok_or(Absent::NoLead)?;
        let (rear_point, ego_point) = self.rear.at(time).zip(ego.at(time)).ok_or(Absent::NotRecorded)?;
        let apart_m = ego_point.s_m - rear_point.s_m;
        let gap_m = bumper_gap_m(apart_m, self.rear.dimensions.length_m, ego.dimensions.length_m);
        time_headway_s(gap_m, rear_point.speed_mps)
    }
}

/// Returns the nearest vehicle ahead of `follower` in `lane`, or `None` if there is none or
/// `follower` is not in that lane.
pub(super) fn next_ahead<'a>(
    data: &'a SmoothedTrajectoryData,
    follower: &Trajectory,
    lane: Lane,
    time: Time,
) -> Option<&'a Trajectory> {
    let position: &TrajectoryPoint = follower.at(time).filter(|point| point.lane == lane)?;
    let others = data.present_at(time).iter().map(|&presence| data.look_up(presence));
    let ahead = others
        .filter(|(track, point)| track.track_id != follower.track_id && point.lane == lane && point.s_m > position.s_m);
    ahead.min_by(|a, b| a.1.s_m.total_cmp(&b.1.s_m)).map(|(track, _)| track)
}

/// Returns the vehicles with roles, then all other vehicles that come near the ego vehicle, or the
/// rear vehicle if no lead vehicle is required.
///
/// Returns `None` if one with a role leaves the road.
fn participants(
    data: &SmoothedTrajectoryData,
    roles: &Roles<'_>,
    frame: &Frame,
    all: &[LaneChange],
    period: Time,
) -> Option<Vec<Participant>> {
    let participant = |track: &Trajectory| {
        // The crossing is the first instant in the new lane: a vehicle that crosses at the start is
        // already there.
        let within = |change: &&LaneChange| {
            let crossing = Time::from_s(change.crossing_s);
            change.track_id == track.track_id && crossing > frame.start && crossing <= frame.end
        };
        let trajectory = frame.view(track, period)?;
        Some(Participant { trajectory, changes: all.iter().filter(within).cloned().collect() })
    };
    let in_order = match roles.lead {
        Some(lead) => [roles.ego, Some(lead), Some(roles.rear)],
        None => [Some(roles.rear), roles.ego, None],
    };
    let with_roles: Vec<&Trajectory> = in_order.into_iter().flatten().collect();
    let mut vehicles: Vec<Participant> = with_roles.iter().map(|track| participant(track)).collect::<Option<_>>()?;
    // The reference comes first in either order.
    let reference = vehicles[EGO_INDEX].trajectory.clone();
    let is_near = |other: &Participant| {
        let distance_m = |point: &TrajectoryPoint| Some((point.s_m - reference.at(point.time)?.s_m).abs());
        other.trajectory.points.iter().filter_map(distance_m).any(|distance_m| distance_m < REACH_M)
    };
    let is_other = |track: &&Trajectory| with_roles.iter().all(|role| role.track_id != track.track_id);
    let others = data.trajectories().filter(is_other).filter_map(participant);
    vehicles.extend(others.filter(is_near));
    Some(vehicles)
}
