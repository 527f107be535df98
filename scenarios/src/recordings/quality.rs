//! How far a recording can be trusted.

use std::collections::BTreeMap;

use closecall_traffic::{Time, Trajectory, TrajectoryPoint};
use serde::Serialize;

use super::Recording;

/// Flaws of a recording, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Quality {
    /// Tracks without gaps.
    pub tracks: usize,
    /// Vehicles.
    pub vehicles: usize,
    /// Instants of all tracks.
    pub instants: usize,
    /// Gaps: pieces of a vehicle's track beyond the first.
    pub gaps: usize,
    /// Steps between two frames at a speed that differs from the recorded one by more than 10 m/s.
    pub jumps: usize,
    /// Pairs of vehicles in one lane, at one instant, that overlap lengthwise.
    pub overlaps: usize,
}

/// A step counts as a jump where its speed differs from the recorded speed by more than this [m/s]: at 10 Hz, a metre.
const JUMP_MPS: f64 = 10.0;

/// Counts the flaws of `recording`.
pub fn quality(recording: &Recording) -> Quality {
    let tracks = &recording.trajectories;
    let mut vehicles: Vec<u64> = tracks.iter().map(|track| track.vehicle_id).collect();
    vehicles.sort_unstable();
    vehicles.dedup();
    Quality {
        tracks: tracks.len(),
        vehicles: vehicles.len(),
        instants: tracks.iter().map(|track| track.points.len()).sum(),
        gaps: tracks.len() - vehicles.len(),
        jumps: tracks.iter().map(jumps).sum(),
        overlaps: overlaps(tracks),
    }
}

fn jumps(track: &Trajectory) -> usize {
    let is_jump = |pair: &&[TrajectoryPoint]| {
        let step_mps = (pair[1].s_m - pair[0].s_m) / (pair[1].time - pair[0].time).s();
        let difference_mps = (step_mps - 0.5 * (pair[0].speed_mps + pair[1].speed_mps)).abs();
        difference_mps.is_nan() || difference_mps > JUMP_MPS
    };
    track.points.windows(2).filter(is_jump).count()
}

fn overlaps(tracks: &[Trajectory]) -> usize {
    let mut lanes: BTreeMap<(Time, u8), Vec<(f64, f64)>> = BTreeMap::new();
    for track in tracks {
        let half = 0.5 * track.dimensions.length_m;
        for point in &track.points {
            lanes.entry((point.time, point.lane.0)).or_default().push((point.s_m - half, point.s_m + half));
        }
    }
    let overlaps_in = |spans: &mut Vec<(f64, f64)>| {
        spans.sort_by(|a, b| a.0.total_cmp(&b.0));
        spans.windows(2).filter(|pair| pair[1].0 < pair[0].1).count()
    };
    lanes.values_mut().map(overlaps_in).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recordings::test_support::{recording_of, straight_track};

    #[test]
    fn flaws_are_counted() {
        let mut jumping = straight_track(2, 100.0, 20.0, -5.0, 10);
        jumping.points[5].s_m += 5.0;
        let mut piece = straight_track(3, 0.0, 20.0, -8.0, 10);
        piece.vehicle_id = 2;
        let close = straight_track(4, 3.0, 20.0, -1.75, 4);
        let recording = recording_of(vec![straight_track(1, 0.0, 20.0, -1.75, 10), jumping, piece, close]);
        let found = quality(&recording);
        assert_eq!(found, Quality { tracks: 4, vehicles: 3, instants: 34, gaps: 1, jumps: 2, overlaps: 4 });
    }
}
