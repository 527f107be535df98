//! Who is who, and from when to when.

use closecall_traffic::metrics::time_headway_s;
use closecall_traffic::{Absent, Lane, Measured, Time, Trajectory, TrajectoryPoint};

use super::frame::{Frame, RoadPlace};
use super::{
    EGO, LEAD_IN, LEAD_OUT, LONGEST_THW_S, NoEncounter, Participant, REACH_M, RecordedEncounter, SHORTEST_APPROACH,
};
use crate::filters::{PERIOD, SmoothedRecording};
use crate::lane_change::LaneChange;

/// The encounter around one of the lane changes of a recording, `all` of which are given; trajectories at every `period`,
/// of which a multiple is the recording's common clock.
///
/// # Errors
/// [`NoEncounter`] where nobody is there to be E or F, or the three are not recorded together for long enough.
pub fn encounter(
    recording: &SmoothedRecording,
    change: &LaneChange,
    all: &[LaneChange],
    period: Time,
) -> Result<RecordedEncounter, NoEncounter> {
    let cast = Cast::of(recording, change)?;
    let start = cast.start(recording, change)?;
    let road = RoadPlace::of(recording, cast.rear, change)?;
    let last = cast.ego.span().map_or(start, |(_, last)| last);
    let end = last.min(on_clock(Time::from_s(change.end_s) + LEAD_OUT));
    let origin_m = cast.ego.at(start).map_or(0.0, |point| point.s_m);
    let frame = Frame { start, end, origin_m, road };
    let (track_id, ego_id) = (cast.rear.track_id, cast.ego.track_id);
    let vehicles = participants(recording, &cast, &frame, (all, period));
    let vehicles = vehicles.ok_or(NoEncounter::LeavesTheRoad { track_id })?;
    let thw_s = cast.headway_s(Time::from_s(change.crossing_s));
    let is_behind = |thw_s: &f64| *thw_s > 0.0 && *thw_s <= LONGEST_THW_S;
    let not_behind = NoEncounter::NotBehind { track_id, ego_id, thw_s, longest_s: LONGEST_THW_S };
    let crossing_thw_s = thw_s.ok().filter(is_behind).ok_or(not_behind)?;
    Ok(RecordedEncounter {
        recording: recording.name.clone(),
        change: change.clone(),
        start,
        crossing: Time::from_s(change.crossing_s) - start,
        end: end - start,
        crossing_thw_s,
        lanes: road.lanes,
        lane_width_m: road.lane_width_m,
        home: road.lane(change.from_lane).unwrap_or(Lane(1)),
        target: road.lane(change.to_lane).unwrap_or(Lane(1)),
        vehicles,
    })
}

/// `time`, or the last instant of the common clock before it.
fn on_clock(time: Time) -> Time {
    Time::from_ns(time.ns().div_euclid(PERIOD.ns()) * PERIOD.ns())
}

/// The three who make the encounter, and when they are looked for.
struct Cast<'a> {
    ego: &'a Trajectory,
    front: &'a Trajectory,
    rear: &'a Trajectory,
    /// The instant of the common clock at which R begins to change lanes, or is first seen doing so.
    pull_out: Time,
}

impl<'a> Cast<'a> {
    fn of(recording: &'a SmoothedRecording, change: &LaneChange) -> Result<Self, NoEncounter> {
        let track_id = change.track_id;
        let place = recording.place_of(track_id).ok_or(NoEncounter::NoTrack { track_id })?;
        let track = &recording.tracks[place];
        let rear = &track.trajectory;
        let crossing = Time::from_s(change.crossing_s);
        let stays = track.stays.iter().filter(|stay| stay.lane.0 == change.from_lane && stay.first < crossing);
        let home_since = stays.map(|stay| stay.first).next_back();
        let seen_since = rear.span().map(|(first, _)| first);
        let begins = [Some(Time::from_s(change.start_s)), home_since, seen_since].into_iter().flatten().max();
        // The first instant at which it is so.
        let pull_out = on_clock(begins.unwrap_or(crossing) + PERIOD - Time::from_ns(1));
        let nobody = NoEncounter::NobodyAhead { track_id, lane: change.from_lane };
        let lane = Lane(change.from_lane);
        let ego = lead_of(recording, rear, lane, pull_out).ok_or(nobody)?;
        let nobody = NoEncounter::NobodyAheadOfEgo { track_id, ego_id: ego.track_id };
        let front = lead_of(recording, ego, lane, pull_out).ok_or(nobody)?;
        Ok(Self { ego, front, rear, pull_out })
    }

    /// The earliest instant from which on the three stay in this order in the lane.
    fn start(&self, recording: &SmoothedRecording, change: &LaneChange) -> Result<Time, NoEncounter> {
        let lane = Lane(change.from_lane);
        let number = |track: Option<&Trajectory>| track.map(|track| track.track_id);
        let together = |time: Time| {
            number(lead_of(recording, self.rear, lane, time)) == Some(self.ego.track_id)
                && number(lead_of(recording, self.ego, lane, time)) == Some(self.front.track_id)
        };
        let most = LEAD_IN.ns() / PERIOD.ns();
        let instants = (0..=most).map(|ticks| self.pull_out - PERIOD * ticks);
        let start = instants.take_while(|&time| together(time)).last().unwrap_or(self.pull_out);
        let crossing = Time::from_s(change.crossing_s);
        let recorded_to = [self.ego, self.front, self.rear].iter().filter_map(|track| Some(track.span()?.1)).min();
        let until = recorded_to.map_or(start, |last| last.min(crossing));
        // A crossing between two instants of the clock may lie up to one of them after the last.
        if until < start + SHORTEST_APPROACH || until + PERIOD < crossing {
            return Err(NoEncounter::TooShort {
                track_id: self.rear.track_id,
                ego_id: self.ego.track_id,
                front_id: self.front.track_id,
                recorded_s: (until - start).s(),
                needed_s: SHORTEST_APPROACH.s(),
            });
        }
        Ok(start)
    }

    /// R's time headway to E [s].
    fn headway_s(&self, time: Time) -> Measured {
        let (rear, ego) = (self.rear.at(time), self.ego.at(time));
        let (rear, ego) = rear.zip(ego).ok_or(Absent::NotRecorded)?;
        let half_lengths_m = 0.5 * (self.rear.dimensions.length_m + self.ego.dimensions.length_m);
        time_headway_s(ego.s_m - rear.s_m - half_lengths_m, rear.speed_mps)
    }
}

/// The nearest vehicle ahead of `own` in `lane`, where `own` is in it.
fn lead_of<'a>(recording: &'a SmoothedRecording, own: &Trajectory, lane: Lane, time: Time) -> Option<&'a Trajectory> {
    let here: &TrajectoryPoint = own.at(time).filter(|point| point.lane == lane)?;
    let others = recording.present_at(time).iter().map(|&presence| recording.look_up(presence));
    let ahead =
        others.filter(|(track, point)| track.track_id != own.track_id && point.lane == lane && point.s_m > here.s_m);
    ahead.min_by(|a, b| a.1.s_m.total_cmp(&b.1.s_m)).map(|(track, _)| track)
}

/// E, F, R, and everyone else who comes near E; nothing where one of the three is not on the road.
fn participants(
    recording: &SmoothedRecording,
    cast: &Cast<'_>,
    frame: &Frame,
    (all, period): (&[LaneChange], Time),
) -> Option<Vec<Participant>> {
    let participant = |track: &Trajectory| {
        let within = |change: &&LaneChange| {
            let crossing = Time::from_s(change.crossing_s);
            change.track_id == track.track_id && crossing >= frame.start && crossing <= frame.end
        };
        let trajectory = frame.view(track, period)?;
        Some(Participant { trajectory, changes: all.iter().filter(within).cloned().collect() })
    };
    let protagonists = [cast.ego, cast.front, cast.rear];
    let mut vehicles: Vec<Participant> = protagonists.into_iter().map(participant).collect::<Option<_>>()?;
    let ego = vehicles[EGO].trajectory.clone();
    let is_near = |other: &Participant| {
        let apart = |point: &TrajectoryPoint| Some((point.s_m - ego.at(point.time)?.s_m).abs());
        other.trajectory.points.iter().filter_map(apart).any(|apart_m| apart_m < REACH_M)
    };
    let is_other = |track: &&Trajectory| protagonists.iter().all(|known| known.track_id != track.track_id);
    let others = recording.trajectories().filter(is_other).filter_map(participant);
    vehicles.extend(others.filter(is_near));
    Some(vehicles)
}
