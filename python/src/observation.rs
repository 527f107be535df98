//! What a stepped run shows to a learning algorithm, as numbers in a fixed order. Nothing of it is the truth.

use closecall_controllers::{EgoInput, Front};
use closecall_traffic::{Source, Track, TrackStatus, maths};

/// The numbers of the ego, its road, its sensors and its lead vehicle, in their order.
pub(crate) const ODOMETRY_KEYS: [&str; 18] = [
    "speed_mps",
    "acceleration_mps2",
    "yaw_rate_radps",
    "lane",
    "lane_offset_m",
    "length_m",
    "width_m",
    "lanes",
    "lane_width_m",
    "speed_limit_mps",
    "curvature_per_m",
    "front_works",
    "surround_works",
    "rear_works",
    "has_lead",
    "lead_gap_m",
    "lead_speed_mps",
    "lead_acceleration_mps2",
];

/// The numbers of a track, in their order.
pub(crate) const TRACK_KEYS: [&str; 19] = [
    "present",
    "x_m",
    "y_m",
    "vx_mps",
    "vy_mps",
    "heading_rad",
    "length_m",
    "width_m",
    "existence",
    "confirmed",
    "coasting",
    "source",
    "lane_left",
    "lane_own",
    "lane_right",
    "car",
    "truck",
    "motorcycle",
    "background",
];

/// Returns the number of values of an observation with this many rows of tracks.
pub(crate) const fn len(max_tracks: usize) -> usize {
    ODOMETRY_KEYS.len() + max_tracks * TRACK_KEYS.len()
}

/// Writes the observation. The nearest tracks come first, and those beyond `max_tracks` are left out.
pub(crate) fn write(input: &EgoInput<'_>, front: Option<Front>, max_tracks: usize, values: &mut Vec<f64>) {
    let (odometry, road, works) = (&input.odometry, input.road, input.sensors);
    values.clear();
    values.extend([
        odometry.speed_mps,
        odometry.acceleration_mps2,
        odometry.yaw_rate_radps,
        f64::from(odometry.lane.0),
        odometry.lane_offset_m,
        odometry.length_m,
        odometry.width_m,
        f64::from(road.lanes()),
        road.greatest_lane_width_m(odometry.lane),
        road.speed_limit_mps(),
        input.curvature_per_m,
    ]);
    values.extend([works.front, works.surround, works.rear].map(flag));
    let lead = front.map_or([0.0; 4], |lead| [1.0, lead.gap_m, lead.speed_mps, lead.acceleration_mps2]);
    values.extend(lead);
    let mut nearest: Vec<&Track> = input.tracks.iter().collect();
    nearest.sort_by(|one, other| distance_m(one).total_cmp(&distance_m(other)).then(one.id.cmp(&other.id)));
    for track in nearest.into_iter().take(max_tracks) {
        values.extend([1.0, track.x_m(), track.y_m(), track.vx_mps(), track.vy_mps()]);
        values.extend([track.heading_rad, track.length_m, track.width_m, track.existence]);
        values.extend([TrackStatus::Confirmed, TrackStatus::Coasting].map(|status| flag(track.status == status)));
        values.push(match track.source {
            Source::Front => 0.0,
            Source::Surround => 1.0,
            Source::Rear => 2.0,
        });
        values.extend(track.lane);
        values.extend(track.class.0);
    }
    values.resize(len(max_tracks), 0.0);
}

fn distance_m(track: &Track) -> f64 {
    maths::hypot(track.x_m(), track.y_m())
}

fn flag(is_set: bool) -> f64 {
    f64::from(u8::from(is_set))
}

/// Returns the numbers as bytes of 64-bit floats, in the order of the machine.
pub(crate) fn bytes(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_ne_bytes()).collect()
}
