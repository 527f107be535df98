//! The film of a lane change in recorded traffic. The vehicle that changes lanes is the ego of the
//! film.
//!
//! The film shows the smoothed trajectories from which the metrics are computed, from
//! [`CONTEXT_TIME`] before the lane change until the same time after it, with all vehicles that
//! come within [`REACH_M`] of the ego. The road is drawn straight, with lanes of the typical width
//! in the trajectory data. Trajectory data have no brake lights and no indicators, so the film
//! shows none.

use closecall_recorded::criticality::{
    CRITICAL_A_LAT_MPS2, CRITICAL_A_LON_MPS2, CRITICAL_DCE_M, CRITICAL_DISTANCE_M, CRITICAL_SPEED_FACTOR,
    CRITICAL_TTCE_S, CriticalLaneChange, MetricResult,
};
use closecall_recorded::filters::{PERIOD, SmoothedTrajectoryData};
use closecall_traffic::metrics::{CRITICAL_THW_S, time_headway_s, time_to_collision_s};
use closecall_traffic::{
    Absent, Check, ConfigError, Environment, Lane, Num, Parameters, Road, RoadConfig, Side, Time, Trajectory,
    TrajectoryPoint, Vehicle, VehicleState, maths,
};

use super::{Film, FilmActor, Frame, Level, Part};
use closecall_scenarios::causal::VehicleLetters;
use closecall_sensors::SensorAlarms;
use closecall_simulation::{CurrentMargins, Lead};

/// Time shown before the start and after the end of the lane change.
const CONTEXT_TIME: Time = Time::from_ms(2_000);
/// Vehicles that never come closer to the ego than this along the road are left out (m).
const REACH_M: f64 = 150.0;
/// Lateral distance beyond which a vehicle is on another carriageway (m). The readers put
/// carriageways 1 km apart.
const SEPARATE_M: f64 = 200.0;
/// Largest number of vehicles that are named and coloured. All others are the traffic around them.
const MAX_MAIN: usize = 5;
/// Largest number of vehicles whose speed and acceleration are plotted.
const MAX_PLOTTED: usize = 3;
/// Smallest and largest lane width that the drawn road may have (m).
const LANE_WIDTH_RANGE_M: [f64; 2] = [2.5, 5.0];
/// Largest number of lanes that the drawn road may have.
const MAX_LANES: u8 = 8;
/// Speed below which the direction of the velocity is mostly noise (m/s). The heading is then 0.
const MIN_HEADING_SPEED_MPS: f64 = 1.0;
/// Speed limit of the drawn road (m/s). The film does not depend on it.
const SPEED_LIMIT_MPS: f64 = 120.0 / 3.6;

/// The reason why recorded traffic cannot be shown as a film.
#[derive(Clone, Debug, thiserror::Error)]
pub enum TrafficFilmError {
    /// The trajectory data do not contain the track.
    #[error("the recording has no track {track_id}")]
    NoTrack {
        /// The track id.
        track_id: u64,
    },
    /// No road can be built from the recorded lanes.
    #[error("the recorded lanes do not make a road: {0}")]
    Road(#[from] ConfigError),
}

/// Returns the film of one lane change in trajectory data.
///
/// # Errors
/// [`TrafficFilmError`] if the trajectory data do not contain the track, or no road can be built
/// from its lanes.
pub fn film_lane_change(
    recording: &SmoothedTrajectoryData,
    change: &CriticalLaneChange,
) -> Result<Film, TrafficFilmError> {
    let track_id = change.lane_change.track_id;
    let changer = recording.trajectories().find(|track| track.track_id == track_id);
    let changer = changer.ok_or(TrafficFilmError::NoTrack { track_id })?;
    let carriageway = Carriageway::of(recording, changer);
    let changer = &carriageway.moved(changer);
    let (from, to) = (Time::from_s(change.lane_change.start_s), Time::from_s(change.lane_change.end_s));
    let is_shown = |point: &&TrajectoryPoint| point.time >= from - CONTEXT_TIME && point.time <= to + CONTEXT_TIME;
    let instants: Vec<&TrajectoryPoint> = changer.points.iter().filter(is_shown).collect();
    let others: Vec<Trajectory> =
        recording.trajectories().filter(|track| carriageway.has(track)).map(|track| carriageway.moved(track)).collect();
    let tracks = nearby_tracks(&others, changer, &instants);
    let frames = instants.iter().map(|point| frame_at(&tracks, point.time)).collect();
    let film_actor = |track: &&Trajectory| FilmActor {
        name: track_name(track.track_id),
        vehicle: Vehicle { dimensions: track.dimensions, ..Vehicle::typical(track.class) },
        present_frames: present_frames(track, instants.iter().map(|point| point.time)),
        part: Part::Background,
        is_plotted: false,
    };
    let mut film = Film {
        title: format!("{} · lane change of track {track_id}", recording.name),
        arm: "recorded".to_owned(),
        has_mis: false,
        level: Level::Full,
        period: PERIOD,
        road: road(recording, &tracks)?,
        environment: Environment::CLEAR_DAY,
        actors: tracks.iter().map(film_actor).collect(),
        ego: 0,
        frames,
        happenings: Vec::new(),
        notes: notes(change),
        acceleration_limits: Vec::new(),
        cameras: Vec::new(),
        outcome: None,
        avoidable: Vec::new(),
        letters: VehicleLetters::default(),
        faults: Vec::new(),
        goal_s: None,
        highlight: critical_time(change),
        foreword: String::new(),
        settings: Vec::new(),
    };
    mark_main(&mut film);
    Ok(film)
}

impl Film {
    /// Gives the vehicles of a recorded lane change the parts of an encounter, each with its track,
    /// for a picture in the colours of an encounter. The picture still moves with the vehicle that
    /// changes lanes.
    #[must_use]
    pub fn with_parts_of_tracks(mut self, parts: &[(Part, u64)]) -> Self {
        for (index, actor) in self.actors.iter_mut().enumerate() {
            let part = parts.iter().find(|(_, track_id)| actor.name == track_name(*track_id)).map(|(part, _)| *part);
            actor.part = match (part, actor.part) {
                (Some(part), _) => part,
                (None, Part::Ego | Part::Lead | Part::Rear) => Part::Other(index),
                (None, part) => part,
            };
        }
        self
    }
}

/// Returns the name of a recorded vehicle in a film.
fn track_name(track_id: u64) -> String {
    format!("track-{track_id}")
}

/// The carriageway on which a lane change is shown. The readers put the second carriageway of a
/// recording 1 km to the right of the first, and continue its lane numbers; the film shows it as a
/// separate road.
struct Carriageway {
    /// Lateral position of its left edge in the recording (m).
    left_m: f64,
    /// Number of the lanes to the left of it.
    lanes_before: u8,
    /// Lateral position of the vehicle that changes lanes in the recording (m).
    own_m: f64,
}

impl Carriageway {
    /// Returns the carriageway of a track.
    fn of(recording: &SmoothedTrajectoryData, changer: &Trajectory) -> Self {
        let own_m = changer.points.first().map_or(0.0, |point| point.d_m);
        let edge_m = |lane: u8| recording.markings.right_edge_m(Lane(lane));
        let is_before = |lane: &u8| edge_m(*lane).is_some_and(|edge_m| edge_m > own_m + SEPARATE_M);
        let lanes_before = (1..u8::MAX).filter(is_before).max().map_or(0, |last| last + 1);
        match edge_m(lanes_before) {
            Some(left_m) if lanes_before > 0 => Self { left_m, lanes_before, own_m },
            _ => Self { left_m: 0.0, lanes_before: 0, own_m },
        }
    }

    /// Returns whether a track is on this carriageway.
    fn has(&self, track: &Trajectory) -> bool {
        track.points.first().is_some_and(|point| (point.d_m - self.own_m).abs() < SEPARATE_M)
    }

    /// Returns a track in the frame of this carriageway.
    fn moved(&self, track: &Trajectory) -> Trajectory {
        let moved = |point: &TrajectoryPoint| TrajectoryPoint {
            d_m: point.d_m - self.left_m,
            lane: Lane(point.lane.0.saturating_sub(self.lanes_before).max(1)),
            ..*point
        };
        track.with_points(track.points.iter().map(moved).collect())
    }
}

/// Returns the track `changer`, followed by all other tracks that come near it.
fn nearby_tracks<'a>(
    others: &'a [Trajectory],
    changer: &'a Trajectory,
    instants: &[&TrajectoryPoint],
) -> Vec<&'a Trajectory> {
    let is_near = |track: &&Trajectory| {
        track.track_id != changer.track_id
            && instants
                .iter()
                .any(|instant| track.at(instant.time).is_some_and(|at| (at.s_m - instant.s_m).abs() < REACH_M))
    };
    std::iter::once(changer).chain(others.iter().filter(is_near)).collect()
}

/// Gives the vehicle that changes lanes, its neighbours and the nearest others their parts, at the
/// critical moment.
fn mark_main(film: &mut Film) {
    let critical = film.critical_moment();
    let Some(frame) = film.frame_at(critical) else { return };
    let own_m = frame.states[film.ego].s_m;
    let row = film.frames.partition_point(|frame| frame.time < critical);
    let mut parts = vec![(film.ego, Part::Ego)];
    parts.extend(frame.margins.lead.ok().map(|lead| (lead.actor, Part::Lead)));
    parts.extend(frame.margins.follower.map(|actor| (actor, Part::Rear)));
    let mut others: Vec<usize> = (0..film.actors.len())
        .filter(|&actor| film.is_present(actor, row) && parts.iter().all(|(taken, _)| *taken != actor))
        .collect();
    let distance_m = |actor: usize| (frame.states[actor].s_m - own_m).abs();
    others.sort_by(|&a, &b| distance_m(a).total_cmp(&distance_m(b)));
    let room = MAX_MAIN.saturating_sub(parts.len());
    parts.extend(others.into_iter().take(room).enumerate().map(|(number, actor)| (actor, Part::Other(number))));
    for (number, (actor, part)) in parts.into_iter().enumerate() {
        film.actors[actor].part = part;
        film.actors[actor].is_plotted = number < MAX_PLOTTED;
    }
}

/// Returns the range of frames in which a track is present, where frame i shows the i-th of
/// `instants`.
pub(super) fn present_frames(track: &Trajectory, instants: impl Iterator<Item = Time>) -> std::ops::Range<usize> {
    let mut present = instants.enumerate().filter(|(_, time)| track.at(*time).is_some()).map(|(index, _)| index);
    match present.next() {
        Some(first) => first..present.last().unwrap_or(first) + 1,
        None => 0..0,
    }
}

fn road(recording: &SmoothedTrajectoryData, tracks: &[&Trajectory]) -> Result<Road, ConfigError> {
    let lanes = tracks.iter().flat_map(|track| track.points.iter().map(|point| point.lane.0)).max();
    straight_road(lanes.unwrap_or(1).clamp(1, MAX_LANES), recording.markings.typical_lane_width_m())
}

/// Returns a straight road on which recorded traffic is drawn. The lane width is clamped to the
/// permitted range.
pub(super) fn straight_road(lanes: u8, lane_width_m: f64) -> Result<Road, ConfigError> {
    let config = RoadConfig {
        lanes,
        lane_width_m: lane_width_m.clamp(LANE_WIDTH_RANGE_M[0], LANE_WIDTH_RANGE_M[1]).into(),
        curvature_per_m: Num::Fixed(0.0),
        cross_sections: Vec::new(),
        alignment: Vec::new(),
        alignment_d_m: None,
        speed_limit_mps: Num::Fixed(SPEED_LIMIT_MPS),
        overtaking_side: Side::Left,
        guard_rails: false,
        roadside: closecall_traffic::RoadsideConfig::default(),
        acceleration_lane: None,
    };
    config.check(&Parameters::default())
}

/// Returns the frame of recorded tracks at `time`. The first track is the ego.
pub(super) fn frame_at(tracks: &[&Trajectory], time: Time) -> Frame {
    let nearest = |track: &Trajectory| {
        let has_begun = track.points.first().is_none_or(|first| time >= first.time);
        track.at(time).or(if has_begun { track.points.last() } else { track.points.first() }).copied()
    };
    let points: Vec<Option<TrajectoryPoint>> = tracks.iter().map(|track| nearest(track)).collect();
    let states: Vec<VehicleState> = points.iter().map(|point| point.map(state).unwrap_or_default()).collect();
    let present: Vec<(usize, TrajectoryPoint)> =
        (0..tracks.len()).filter_map(|index| Some((index, tracks[index].at(time).copied()?))).collect();
    Frame {
        time,
        pitches_rad: vec![0.0; states.len()],
        margins: margins(tracks, &present),
        states,
        tracks: Vec::new(),
        rear_seen: Vec::new(),
        command: None,
        phase: None,
        health: None,
        alarms: SensorAlarms::default(),
        rear_fields: Vec::new(),
        other_scans: Vec::new(),
        radar_health: None,
        radar_returns: None,
        rear_images: Vec::new(),
        failed_cameras: Vec::new(),
        scan: None,
    }
}

fn state(point: TrajectoryPoint) -> VehicleState {
    let (along, across) = (point.speed_mps, point.lateral_speed_mps);
    let speed_mps = maths::hypot(along, across);
    VehicleState {
        s_m: point.s_m,
        d_m: point.d_m,
        heading_rad: if speed_mps < MIN_HEADING_SPEED_MPS { 0.0 } else { maths::atan2(across, along) },
        speed_mps,
        acceleration_mps2: point.acceleration_mps2,
        ..VehicleState::default()
    }
}

/// Returns the margins of the first track to the nearest vehicles ahead and behind in its recorded
/// lane.
fn margins(tracks: &[&Trajectory], present: &[(usize, TrajectoryPoint)]) -> CurrentMargins {
    let changer = present.iter().find(|(index, _)| *index == 0).map(|(_, point)| *point);
    let nearest_in_lane = |ahead: bool| {
        let changer = changer?;
        let others = present
            .iter()
            .filter(move |(index, at)| *index != 0 && at.lane == changer.lane && (at.s_m > changer.s_m) == ahead);
        let nearest = others.min_by(|a, b| (a.1.s_m - changer.s_m).abs().total_cmp(&(b.1.s_m - changer.s_m).abs()))?;
        let lengths_m = tracks[0].dimensions.length_m + tracks[nearest.0].dimensions.length_m;
        Some((nearest.0, nearest.1.speed_mps, (nearest.1.s_m - changer.s_m).abs() - 0.5 * lengths_m))
    };
    let (lead, follower) = (nearest_in_lane(true), nearest_in_lane(false));
    let own_mps = changer.map_or(0.0, |changer| changer.speed_mps);
    let gap_m = |neighbour: Option<(usize, f64, f64)>, absent| neighbour.map(|(_, _, gap_m)| gap_m).ok_or(absent);
    let behind = follower.ok_or(Absent::NoFollower);
    CurrentMargins {
        lead: lead.map(|(actor, speed_mps, _)| Lead { actor, speed_mps }).ok_or(Absent::NoLead),
        follower: follower.map(|(actor, _, _)| actor),
        gap_front_m: gap_m(lead, Absent::NoLead),
        thw_front_s: gap_m(lead, Absent::NoLead).and_then(|gap_m| time_headway_s(gap_m, own_mps)),
        gap_rear_m: gap_m(follower, Absent::NoFollower),
        thw_rear_s: behind.and_then(|(_, speed_mps, gap_m)| time_headway_s(gap_m, speed_mps)),
        ttc_front_s: lead
            .ok_or(Absent::NoLead)
            .and_then(|(_, speed_mps, gap_m)| time_to_collision_s(gap_m.max(0.0), own_mps, speed_mps)),
        ttc_rear_s: behind.and_then(|(_, speed_mps, gap_m)| time_to_collision_s(gap_m, speed_mps, own_mps)),
    }
}

/// Returns the time of the critical headway. If the headway is not critical, returns the time of
/// another critical metric between two vehicles.
fn critical_time(change: &CriticalLaneChange) -> Option<Time> {
    let at = |(name, metric): (&'static str, MetricResult)| match metric {
        MetricResult::Value { opponent: Some(_), time_s, critical: true, .. } => Some((name != "thw_s", time_s)),
        _ => None,
    };
    let first = change.metrics.named().into_iter().filter_map(at).min_by_key(|(is_other, _)| *is_other);
    first.map(|(_, time_s)| Time::from_s(time_s))
}

/// Returns notes about the lane change and its metrics, each with the time at which it applies.
fn notes(change: &CriticalLaneChange) -> Vec<(Time, String)> {
    let lane_change = &change.lane_change;
    let mut notes = vec![
        (Time::from_s(lane_change.start_s), format!("track {} begins to change lanes", lane_change.track_id)),
        (
            Time::from_s(lane_change.crossing_s),
            format!("it crosses from lane {} to {}", lane_change.from_lane, lane_change.to_lane),
        ),
        (Time::from_s(lane_change.end_s), "the lane change ends".to_owned()),
    ];
    notes.extend(change.metrics.named().into_iter().filter_map(|(name, metric)| note(name, metric)));
    notes
}

/// Returns the note about a metric, with the time at which it has its value.
fn note(name: &str, metric: MetricResult) -> Option<(Time, String)> {
    let MetricResult::Value { value, opponent, time_s, critical } = metric else { return None };
    let against = opponent.map_or(String::new(), |track| format!(" to track {track}"));
    let (label, unit, limit) = described(name);
    let mark = if critical { "CRITICAL" } else { "not critical" };
    // A vehicle that passes at a safe distance has a short time to closest encounter, too.
    let is_short = name == "ttce_s" && !critical && value < CRITICAL_TTCE_S;
    let only = if is_short { ", judged only with the distance" } else { "" };
    Some((Time::from_s(time_s), format!("{label} {value:.2} {unit}{against}{only}: {mark} ({limit})")))
}

/// Returns the name of a metric in words, its unit, and its threshold.
fn described(name: &str) -> (&'static str, &'static str, String) {
    let at = |threshold: f64, unit: &str| format!("threshold {threshold} {unit}");
    match name {
        "distance_m" => ("distance", "m", at(CRITICAL_DISTANCE_M, "m")),
        "speed_mps" => ("speed", "m/s", at(CRITICAL_SPEED_FACTOR, "of the speed limit")),
        "a_lon_mps2" => ("longitudinal acceleration", "m/s²", at(CRITICAL_A_LON_MPS2, "m/s²")),
        "a_lat_mps2" => ("lateral acceleration", "m/s²", at(CRITICAL_A_LAT_MPS2, "m/s²")),
        "thw_s" => ("time headway", "s", at(CRITICAL_THW_S, "s")),
        "dce_m" => ("distance at closest encounter", "m", at(CRITICAL_DCE_M, "m")),
        _ => ("time to closest encounter", "s", at(CRITICAL_TTCE_S, "s")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_below_its_threshold_says_why_it_is_not_critical() {
        let text = |value, critical| {
            note("ttce_s", MetricResult::Value { value, opponent: Some(26), time_s: 6.0, critical }).unwrap().1
        };
        let short = "time to closest encounter 0.01 s to track 26";
        let limit = "(threshold 2.6 s)";
        assert_eq!(text(0.01, false), format!("{short}, judged only with the distance: not critical {limit}"));
        assert_eq!(text(0.01, true), format!("{short}: CRITICAL {limit}"));
        assert_eq!(text(3.0, false), format!("time to closest encounter 3.00 s to track 26: not critical {limit}"));
    }
}
