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
/// Returns [`NoEncounter`] if there is no ego vehicle or no required lead vehicle, if these vehicles are not
/// recorded together for long enough, if the rear vehicle is not close behind the ego vehicle at
/// the crossing, or if they do not share a valid road.
pub fn encounter(
    data: &SmoothedTrajectoryData,
    change: &LaneChange,
    all: &[LaneChange],
    (period, lead): (Time, Lead),
) -> Result<RecordedEncounter, NoEncounter> {
    let roles = Roles::of(data, change, lead)?;
    let start = roles.start(data, change)?;
    let road = RoadSection::of(data, roles.rear, change)?;
    let last = roles.ego.span().map_or(start, |(_, last)| last);
    let end = last.min(on_clock(Time::from_s(change.end_s) + LEAD_OUT));
    let origin_m = roles.ego.at(start).map_or(0.0, |point| point.s_m);
    let frame = Frame { start, end, origin_m, road };
    let (track_id, ego_id) = (roles.rear.track_id, roles.ego.track_id);
    let vehicles = participants(data, &roles, &frame, all, period);
    let vehicles = vehicles.ok_or(NoEncounter::LeavesTheRoad { track_id })?;
    let thw_s = roles.headway_s(Time::from_s(change.crossing_s));
    let is_behind = |thw_s: &f64| *thw_s > 0.0 && *thw_s <= LONGEST_THW_S;
    let not_behind = NoEncounter::NotBehind { track_id, ego_id, thw_s, longest_s: LONGEST_THW_S };
    let crossing_thw_s = thw_s.ok().filter(is_behind).ok_or(not_behind)?;
    Ok(RecordedEncounter {
        data_name: data.name.clone(),
        change: change.clone(),
        start,
        crossing: Time::from_s(change.crossing_s) - start,
        end: end - start,
        crossing_thw_s,
        lanes: road.lanes,
        lane_width_m: road.lane_width_m,
        home: road.lane(change.from_lane).unwrap_or(Lane(1)),
        target: road.lane(change.to_lane).unwrap_or(Lane(1)),
        lead,
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

/// The three vehicles of an encounter, and the time at which their roles are assigned.
struct Roles<'a> {
    ego: &'a Trajectory,
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
        let ego = next_ahead(data, rear, lane, change_start).ok_or(no_ego)?;
        let no_lead = NoEncounter::NoLead { track_id, ego_id: ego.track_id };
        let lead = match lead {
            Lead::Required => Some(next_ahead(data, ego, lane, change_start).ok_or(no_lead)?),
            Lead::LeftOut => None,
        };
        Ok(Self { ego, lead, rear, change_start })
    }

    /// Returns the earliest instant from which the three vehicles keep their order in the lane
    /// without interruption.
    fn start(&self, data: &SmoothedTrajectoryData, change: &LaneChange) -> Result<Time, NoEncounter> {
        let lane = Lane(change.from_lane);
        let next_id =
            |follower: &Trajectory, time: Time| next_ahead(data, follower, lane, time).map(|track| track.track_id);
        // Without a lead vehicle, the ego vehicle only has to be ahead: it may cut in.
        let is_ahead = |time: Time| {
            self.rear.at(time).zip(self.ego.at(time)).is_some_and(|(rear, ego)| rear.lane == lane && ego.s_m > rear.s_m)
        };
        let in_order = |time: Time| match self.lead {
            Some(lead) => {
                next_id(self.rear, time) == Some(self.ego.track_id) && next_id(self.ego, time) == Some(lead.track_id)
            }
            None => is_ahead(time),
        };
        let max_ticks = LEAD_IN.ns() / PERIOD.ns();
        let instants = (0..=max_ticks).map(|ticks| self.change_start - PERIOD * ticks);
        let start = instants.take_while(|&time| in_order(time)).last().unwrap_or(self.change_start);
        let crossing = Time::from_s(change.crossing_s);
        let needed = [Some(self.ego), self.lead, Some(self.rear)];
        let recorded_to = needed.into_iter().flatten().filter_map(|track| Some(track.span()?.1)).min();
        let until = recorded_to.map_or(start, |last| last.min(crossing));
        let (track_id, ego_id, front_id) = (self.rear.track_id, self.ego.track_id, self.lead.map(|lead| lead.track_id));
        // The crossing may lie between two instants of the clock, up to one period after the last
        // recorded one.
        if until + PERIOD < crossing {
            let missing_s = (crossing - until).s();
            return Err(NoEncounter::EndsBeforeCrossing { track_id, ego_id, front_id, missing_s });
        }
        if until < start + SHORTEST_APPROACH {
            return Err(NoEncounter::TooShort {
                track_id,
                ego_id,
                front_id,
                recorded_s: (until - start).s(),
                needed_s: SHORTEST_APPROACH.s(),
            });
        }
        Ok(start)
    }

    /// Returns the time headway of the rear vehicle to the ego vehicle (s).
    fn headway_s(&self, time: Time) -> Measured {
        let (rear, ego) = (self.rear.at(time), self.ego.at(time));
        let (rear, ego) = rear.zip(ego).ok_or(Absent::NotRecorded)?;
        let gap_m = bumper_gap_m(ego.s_m - rear.s_m, self.rear.dimensions.length_m, self.ego.dimensions.length_m);
        time_headway_s(gap_m, rear.speed_mps)
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

/// Returns the vehicles with roles, then all other vehicles that come near the ego vehicle.
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
    let with_roles: Vec<&Trajectory> = [Some(roles.ego), roles.lead, Some(roles.rear)].into_iter().flatten().collect();
    let mut vehicles: Vec<Participant> = with_roles.iter().map(|track| participant(track)).collect::<Option<_>>()?;
    let ego = vehicles[EGO_INDEX].trajectory.clone();
    let is_near = |other: &Participant| {
        let distance_m = |point: &TrajectoryPoint| Some((point.s_m - ego.at(point.time)?.s_m).abs());
        other.trajectory.points.iter().filter_map(distance_m).any(|distance_m| distance_m < REACH_M)
    };
    let is_other = |track: &&Trajectory| with_roles.iter().all(|role| role.track_id != track.track_id);
    let others = data.trajectories().filter(is_other).filter_map(participant);
    vehicles.extend(others.filter(is_near));
    Some(vehicles)
}
