//! The tracker: Kalman filters along both axes, with association by the overlap of oriented boxes
//! on the ground.
//!
//! Each frame, tracks are predicted. Of all pairs of a predicted box and a detected box, the pair
//! with the largest overlap is joined first. A new track takes the mean speed of the others,
//! because a vehicle moves by most of its length between two frames. After the last frame, all
//! tracks are smoothed.

use std::collections::BTreeMap;

use closecall_traffic::VehicleClass;
use closecall_traffic::geometry::OrientedBox;

use crate::aerial::kalman::{AxisModel, Estimate};
use crate::aerial::overlap::intersection_over_union;

/// Least overlap (intersection over union) of a detection with the prediction of its track.
const LEAST_OVERLAP: f64 = 0.1;
/// Number of detections after which a track counts.
const CONFIRMED_AFTER: usize = 5;
/// Number of frames without a detection after which a track ends.
const LOST_AFTER: usize = 6;
/// Along the road: vehicles change their acceleration by some m/s² within a second.
const ALONG: AxisModel = AxisModel { jerk_density: 1.0, sigma_m: 0.3 };
/// Across the road: a lane change of 5 s has a mean squared jerk of about 0.5 m²/s⁶ for its
/// duration.
const ACROSS: AxisModel = AxisModel { jerk_density: 0.5, sigma_m: 0.2 };

/// A vehicle on the ground, as a frame shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundDetection {
    /// The box.
    pub footprint: OrientedBox,
    /// The class.
    pub class: VehicleClass,
    /// Score of the detection (0 to 1).
    pub score: f64,
}

/// The state of a track at one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Number of the frame.
    pub frame: usize,
    /// Position along and across the road (m).
    pub at_m: [f64; 2],
    /// Speed along and across the road (m/s).
    pub speed_mps: [f64; 2],
    /// Acceleration along and across the road (m/s²).
    pub acceleration_mps2: [f64; 2],
}

/// A vehicle that was followed over some frames.
#[derive(Clone, Debug, PartialEq)]
pub struct AerialTrack {
    /// Number of the track, from 1.
    pub id: u64,
    /// The class with the higher sum of scores.
    pub class: VehicleClass,
    /// Mean length and width (m).
    pub size_m: [f64; 2],
    /// The smoothed states, one for each frame from the first to the last detection.
    pub points: Vec<TrackPoint>,
}

struct Track {
    id: u64,
    first_frame: usize,
    /// Filtered estimates along and across the road for each frame since the first.
    filtered: Vec<[Estimate; 2]>,
    /// Number of frames up to the latest detection.
    seen: usize,
    detections: usize,
    missed: usize,
    scores: BTreeMap<VehicleClass, f64>,
    size_sum_m: [f64; 2],
    yaw_rad: f64,
}

impl Track {
    fn size_m(&self) -> [f64; 2] {
        self.size_sum_m.map(|sum| sum / self.detections as f64)
    }

    fn observe(&mut self, detection: &GroundDetection) {
        *self.scores.entry(detection.class).or_default() += detection.score;
        self.size_sum_m[0] += detection.footprint.length_m;
        self.size_sum_m[1] += detection.footprint.width_m;
        self.yaw_rad = detection.footprint.yaw_rad;
        self.detections += 1;
        self.missed = 0;
        self.seen = self.filtered.len();
    }

    fn finished(self, dt_s: f64) -> AerialTrack {
        let axis = |axis: usize, model: AxisModel| {
            let filtered: Vec<Estimate> = self.filtered[..self.seen].iter().map(|both| both[axis]).collect();
            model.smoothed(&filtered, dt_s)
        };
        let (along, across) = (axis(0, ALONG), axis(1, ACROSS));
        let points = along.iter().zip(&across).enumerate().map(|(index, (a, c))| TrackPoint {
            frame: self.first_frame + index,
            at_m: [a.mean.x, c.mean.x],
            speed_mps: [a.mean.y, c.mean.y],
            acceleration_mps2: [a.mean.z, c.mean.z],
        });
        let best = self.scores.iter().max_by(|a, b| a.1.total_cmp(b.1)).map_or(VehicleClass::Car, |(class, _)| *class);
        AerialTrack { id: self.id, class: best, size_m: self.size_m(), points: points.collect() }
    }
}

/// Follows vehicles over frames that are `dt_s` apart, each with its detections. The tracks are in
/// the order of their numbers.
pub fn track(frames: &[Vec<GroundDetection>], dt_s: f64) -> Vec<AerialTrack> {
    let (mut open, mut finished): (Vec<Track>, Vec<Track>) = (Vec::new(), Vec::new());
    let mut next_id = 1;
    for (frame, detections) in frames.iter().enumerate() {
        let predicted: Vec<[Estimate; 2]> = open.iter().map(|track| predicted(track, dt_s)).collect();
        let joined = associate(&open, &predicted, detections);
        let flow_mps = flow_mps(&open);
        let mut is_free = vec![true; detections.len()];
        for ((track, estimates), detection) in open.iter_mut().zip(predicted).zip(&joined) {
            let Some(index) = *detection else {
                track.filtered.push(estimates);
                track.missed += 1;
                continue;
            };
            let OrientedBox { x_m, y_m, .. } = detections[index].footprint;
            track.filtered.push([ALONG.updated(&estimates[0], x_m), ACROSS.updated(&estimates[1], y_m)]);
            track.observe(&detections[index]);
            is_free[index] = false;
        }
        let (lost, kept): (Vec<Track>, Vec<Track>) = open.into_iter().partition(|track| track.missed >= LOST_AFTER);
        (open, finished) = (kept, finished.into_iter().chain(lost).collect());
        for (detection, _) in detections.iter().zip(&is_free).filter(|(_, is_free)| **is_free) {
            let OrientedBox { x_m, y_m, yaw_rad, .. } = detection.footprint;
            let mut new = Track {
                id: next_id,
                first_frame: frame,
                filtered: vec![[ALONG.first(x_m, flow_mps), ACROSS.first(y_m, 0.0)]],
                seen: 0,
                detections: 0,
                missed: 0,
                scores: BTreeMap::new(),
                size_sum_m: [0.0; 2],
                yaw_rad,
            };
            new.observe(detection);
            open.push(new);
            next_id += 1;
        }
    }
    finished.extend(open);
    finished.retain(|track| track.detections >= CONFIRMED_AFTER);
    finished.sort_by_key(|track| track.id);
    finished.into_iter().map(|track| track.finished(dt_s)).collect()
}

fn predicted(track: &Track, dt_s: f64) -> [Estimate; 2] {
    let last = &track.filtered[track.filtered.len() - 1];
    [ALONG.predicted(&last[0], dt_s), ACROSS.predicted(&last[1], dt_s)]
}

/// Returns the mean speed of the tracks that count (m/s); 0 without any.
fn flow_mps(open: &[Track]) -> f64 {
    let confirmed = open.iter().filter(|track| track.detections >= CONFIRMED_AFTER);
    let speeds: Vec<f64> = confirmed.map(|track| track.filtered[track.filtered.len() - 1][0].mean.y).collect();
    speeds.iter().sum::<f64>() / speeds.len().max(1) as f64
}

/// Returns the detection of each track. No two tracks share one.
fn associate(open: &[Track], predicted: &[[Estimate; 2]], detections: &[GroundDetection]) -> Vec<Option<usize>> {
    let mut pairs = Vec::new();
    for (index, (track, estimates)) in open.iter().zip(predicted).enumerate() {
        let [length_m, width_m] = track.size_m();
        let (x_m, y_m) = (estimates[0].mean.x, estimates[1].mean.x);
        let expected = OrientedBox { x_m, y_m, yaw_rad: track.yaw_rad, length_m, width_m };
        for (other, detection) in detections.iter().enumerate() {
            let overlap = intersection_over_union(&expected, &detection.footprint);
            if overlap >= LEAST_OVERLAP {
                pairs.push((overlap, index, other));
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut joined = vec![None; open.len()];
    for (_, index, other) in pairs {
        if joined[index].is_none() && !joined.contains(&Some(other)) {
            joined[index] = Some(other);
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 0.08;

    fn detection(x_m: f64, y_m: f64, class: VehicleClass) -> GroundDetection {
        let length_m = if class == VehicleClass::Truck { 16.0 } else { 4.5 };
        let footprint = OrientedBox { x_m, y_m, yaw_rad: 0.0, length_m, width_m: 2.0 };
        GroundDetection { footprint, class, score: 0.8 }
    }

    /// A car at 33 m/s passes a truck at 25 m/s in the next lane; the car is missed in some frames.
    fn passing() -> Vec<Vec<GroundDetection>> {
        let frame = |k: usize| {
            let time = k as f64 * DT_S;
            let mut all = vec![detection(40.0 + 25.0 * time, -5.25, VehicleClass::Truck)];
            if !(60..63).contains(&k) {
                all.insert(k % 2, detection(33.0 * time, -1.75, VehicleClass::Car));
            }
            all
        };
        (0..120).map(frame).collect()
    }

    #[test]
    fn a_car_that_passes_a_truck_keeps_its_number_over_missed_frames() {
        let tracks = track(&passing(), DT_S);
        assert_eq!(
            tracks.len(),
            2,
            "{:?}",
            tracks.iter().map(|track| (track.id, track.points.len())).collect::<Vec<_>>()
        );
        for (class, speed_mps, y_m) in [(VehicleClass::Truck, 25.0, -5.25), (VehicleClass::Car, 33.0, -1.75)] {
            let followed = tracks.iter().find(|track| track.class == class).unwrap();
            assert_eq!(followed.points.len(), 120);
            let middle = &followed.points[61];
            assert!(
                (middle.speed_mps[0] - speed_mps).abs() < 0.05 && (middle.at_m[1] - y_m).abs() < 0.01,
                "{middle:?}"
            );
        }
    }

    #[test]
    fn single_false_detections_make_no_track_and_a_long_gap_ends_one() {
        let mut frames = passing();
        frames[30].push(detection(500.0, -9.0, VehicleClass::Car));
        assert_eq!(track(&frames, DT_S).len(), 2);
        for frame in &mut frames[80..90] {
            frame.retain(|detection| detection.class == VehicleClass::Truck);
        }
        let tracks = track(&frames, DT_S);
        assert_eq!(tracks.len(), 3);
        assert_eq!(tracks.iter().map(|track| track.points.last().unwrap().frame).min(), Some(79));
        assert_eq!(track(&[], DT_S), Vec::new());
    }
}
