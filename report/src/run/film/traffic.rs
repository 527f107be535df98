//! A lane change in recorded traffic, as a film: the vehicle that changes lanes takes E's place.
//!
//! Shown are the smoothed trajectories on which the metrics were worked out, from [`AROUND`] before the lane change to
//! as long after it, and every vehicle that comes within [`REACH_M`] of it. The road is drawn straight, with lanes of the
//! typical width that the recording tells. Recordings have no brake lights and no indicators, so none are shown.

use closecall_scenarios::criticality::CriticalLaneChange;
use closecall_scenarios::filters::{PERIOD, SmoothedRecording};
use closecall_traffic::metrics::{time_headway_s, time_to_collision_s};
use closecall_traffic::{
    Absent, Check, ConfigError, Environment, Num, Parameters, Road, RoadConfig, Side, Time, Trajectory,
    TrajectoryPoint, Vehicle, VehicleState,
};

use super::{Film, Frame, Level, Member};
use closecall_simulation::{Lead, MarginsNow};

/// Time shown before the lane change starts and after it ends.
const AROUND: Time = Time::from_ms(2_000);
/// Vehicles that never come nearer than this along the road are left out [m].
const REACH_M: f64 = 150.0;
/// Lane widths that a road may have [m], and the most lanes.
const LANE_WIDTHS_M: [f64; 2] = [2.5, 5.0];
const MOST_LANES: u8 = 8;
/// Below this speed the direction of movement is noise [m/s].
const HEADING_FROM_MPS: f64 = 1.0;
/// The speed limit of the drawn road [m/s]; nothing depends on it.
const SPEED_LIMIT_MPS: f64 = 120.0 / 3.6;

/// A lane change that cannot be shown.
#[derive(Clone, Debug, thiserror::Error)]
pub enum TrafficFilmError {
    /// The recording has no track of that number.
    #[error("the recording has no track {track_id}")]
    NoTrack {
        /// The number.
        track_id: u64,
    },
    /// The lanes do not make a road.
    #[error("the recorded lanes do not make a road: {0}")]
    Road(#[from] ConfigError),
}

/// A film of one lane change of a recording.
///
/// # Errors
/// [`TrafficFilmError`] where the recording does not have its track, or its lanes make no road.
pub fn film_lane_change(recording: &SmoothedRecording, change: &CriticalLaneChange) -> Result<Film, TrafficFilmError> {
    let track_id = change.lane_change.track_id;
    let own = recording.trajectories().find(|track| track.track_id == track_id);
    let own = own.ok_or(TrafficFilmError::NoTrack { track_id })?;
    let (from, to) = (Time::from_s(change.lane_change.start_s), Time::from_s(change.lane_change.end_s));
    let shown = |point: &&TrajectoryPoint| point.time >= from - AROUND && point.time <= to + AROUND;
    let instants: Vec<&TrajectoryPoint> = own.points.iter().filter(shown).collect();
    let tracks = around(recording, own, &instants);
    let frames = instants.iter().map(|point| frame(&tracks, point.time)).collect();
    let member = |track: &&Trajectory| Member {
        name: format!("track-{}", track.track_id),
        vehicle: Vehicle { dimensions: track.dimensions, ..Vehicle::typical(track.class) },
        rows: rows(track, instants.iter().map(|point| point.time)),
        is_plotted: true,
    };
    Ok(Film {
        title: format!("{} · lane change of track {track_id}", recording.name),
        arm: "recorded".to_owned(),
        level: Level::Full,
        period: PERIOD,
        road: road(recording, &tracks)?,
        environment: Environment::CLEAR_DAY,
        cast: tracks.iter().map(member).collect(),
        ego: 0,
        frames,
        happenings: Vec::new(),
        notes: notes(change),
        acceleration_limits: Vec::new(),
        camera: None,
        outcome: None,
        highlight: None,
        foreword: String::new(),
    })
}

/// The track itself first, then every other one that comes near it.
fn around<'a>(
    recording: &'a SmoothedRecording,
    own: &'a Trajectory,
    instants: &[&TrajectoryPoint],
) -> Vec<&'a Trajectory> {
    let near = |track: &&Trajectory| {
        track.track_id != own.track_id
            && instants.iter().any(|own| track.at(own.time).is_some_and(|at| (at.s_m - own.s_m).abs() < REACH_M))
    };
    std::iter::once(own).chain(recording.trajectories().filter(near)).collect()
}

/// The frames, at `instants`, in which a track is there.
pub(super) fn rows(track: &Trajectory, instants: impl Iterator<Item = Time>) -> std::ops::Range<usize> {
    let mut there = instants.enumerate().filter(|(_, time)| track.at(*time).is_some()).map(|(row, _)| row);
    match there.next() {
        Some(first) => first..there.last().unwrap_or(first) + 1,
        None => 0..0,
    }
}

fn road(recording: &SmoothedRecording, tracks: &[&Trajectory]) -> Result<Road, ConfigError> {
    let lanes = tracks.iter().flat_map(|track| track.points.iter().map(|point| point.lane.0)).max();
    straight_road(lanes.unwrap_or(1).clamp(1, MOST_LANES), recording.markings.typical_lane_width_m())
}

/// A straight road to draw recorded traffic on.
pub(super) fn straight_road(lanes: u8, lane_width_m: f64) -> Result<Road, ConfigError> {
    let config = RoadConfig {
        lanes,
        lane_width_m: Num::Fixed(lane_width_m.clamp(LANE_WIDTHS_M[0], LANE_WIDTHS_M[1])),
        curvature_per_m: Num::Fixed(0.0),
        speed_limit_mps: Num::Fixed(SPEED_LIMIT_MPS),
        overtaking_side: Side::Left,
        guard_rails: false,
    };
    config.check(&Parameters::default())
}

/// One instant of recorded vehicles, the first of them E.
pub(super) fn frame(tracks: &[&Trajectory], time: Time) -> Frame {
    let nearest = |track: &Trajectory| {
        let late = track.points.first().is_none_or(|first| time >= first.time);
        track.at(time).or(if late { track.points.last() } else { track.points.first() }).copied()
    };
    let points: Vec<Option<TrajectoryPoint>> = tracks.iter().map(|track| nearest(track)).collect();
    let states: Vec<VehicleState> = points.iter().map(|point| point.map(state).unwrap_or_default()).collect();
    let present: Vec<(usize, TrajectoryPoint)> =
        (0..tracks.len()).filter_map(|place| Some((place, tracks[place].at(time).copied()?))).collect();
    Frame {
        time,
        pitches_rad: vec![0.0; states.len()],
        margins: margins(tracks, &present),
        states,
        tracks: Vec::new(),
        command: None,
        phase: None,
        rear_field: None,
        scan: None,
    }
}

fn state(point: TrajectoryPoint) -> VehicleState {
    let (along, across) = (point.speed_mps, point.lateral_speed_mps);
    let speed_mps = along.hypot(across);
    VehicleState {
        s_m: point.s_m,
        d_m: point.d_m,
        heading_rad: if speed_mps < HEADING_FROM_MPS { 0.0 } else { across.atan2(along) },
        speed_mps,
        acceleration_mps2: point.acceleration_mps2,
        ..VehicleState::default()
    }
}

/// The margins of the vehicle that changes lanes, by the lanes as recorded.
fn margins(tracks: &[&Trajectory], present: &[(usize, TrajectoryPoint)]) -> MarginsNow {
    let own = present.iter().find(|(place, _)| *place == 0).map(|(_, point)| *point);
    let in_lane = |ahead: bool| {
        let own = own?;
        let others =
            present.iter().filter(move |(place, at)| *place != 0 && at.lane == own.lane && (at.s_m > own.s_m) == ahead);
        let nearest = others.min_by(|a, b| (a.1.s_m - own.s_m).abs().total_cmp(&(b.1.s_m - own.s_m).abs()))?;
        let lengths_m = tracks[0].dimensions.length_m + tracks[nearest.0].dimensions.length_m;
        Some((nearest.0, nearest.1.speed_mps, (nearest.1.s_m - own.s_m).abs() - 0.5 * lengths_m))
    };
    let (lead, follower) = (in_lane(true), in_lane(false));
    let own_mps = own.map_or(0.0, |own| own.speed_mps);
    let gap = |found: Option<(usize, f64, f64)>, absent| found.map(|(_, _, gap_m)| gap_m).ok_or(absent);
    let behind = follower.ok_or(Absent::NoFollower);
    MarginsNow {
        lead: lead.map(|(actor, speed_mps, _)| Lead { actor, speed_mps }).ok_or(Absent::NoLead),
        follower: follower.map(|(actor, _, _)| actor),
        gap_front_m: gap(lead, Absent::NoLead),
        thw_front_s: gap(lead, Absent::NoLead).and_then(|gap_m| time_headway_s(gap_m, own_mps)),
        gap_rear_m: gap(follower, Absent::NoFollower),
        thw_rear_s: behind.and_then(|(_, speed_mps, gap_m)| time_headway_s(gap_m, speed_mps)),
        ttc_rear_s: behind.and_then(|(_, speed_mps, gap_m)| time_to_collision_s(gap_m, speed_mps, own_mps)),
    }
}

/// The metrics of the lane change, each at its moment.
fn notes(change: &CriticalLaneChange) -> Vec<(Time, String)> {
    let found = &change.lane_change;
    let mut notes = vec![
        (Time::from_s(found.start_s), format!("track {} begins to change lanes", found.track_id)),
        (Time::from_s(found.crossing_s), format!("it crosses from lane {} to {}", found.from_lane, found.to_lane)),
        (Time::from_s(found.end_s), "the lane change ends".to_owned()),
    ];
    for (name, metric) in change.metrics.named() {
        if let closecall_scenarios::criticality::MetricRecord::Value { value, opponent, time_s, critical } = metric {
            let against = opponent.map_or(String::new(), |track| format!(" against track {track}"));
            let mark = if critical { ": CRITICAL" } else { "" };
            notes.push((Time::from_s(time_s), format!("most critical {name} {value:.2}{against}{mark}")));
        }
    }
    notes
}
