//! The lane changes that vehicles are about to complete, for encounters along the lanes.

use std::collections::BTreeMap;

use closecall_traffic::Time;

use super::evaluate::window;
use crate::filters::SmoothedTrajectoryData;
use crate::lane_change::LaneChange;

/// A lane change with the lateral position at which it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RunningChange {
    /// The first and last instant.
    span: [Time; 2],
    /// Lateral position at its end (m), or at the end of the track if that is earlier.
    end_m: f64,
}

/// The lane changes of each track.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RunningChanges {
    by_track: BTreeMap<u64, Vec<RunningChange>>,
}

impl RunningChanges {
    /// Gathers the lane changes of `data`.
    pub(super) fn of(data: &SmoothedTrajectoryData, lane_changes: &[LaneChange]) -> Self {
        let mut by_track: BTreeMap<u64, Vec<RunningChange>> = BTreeMap::new();
        for lane_change in lane_changes {
            let Some(index) = data.track_index(lane_change.track_id) else { continue };
            let span = window(lane_change);
            let points = &data.tracks[index].trajectory.points;
            let ends = points.iter().rev().find(|point| point.time <= span[1]);
            if let Some(point) = ends {
                by_track.entry(lane_change.track_id).or_default().push(RunningChange { span, end_m: point.d_m });
            }
        }
        Self { by_track }
    }

    /// Returns the lateral position at which the lane change of a track ends that runs at `time`
    /// (m); of several the one that ends last. `None` if none is running.
    pub(super) fn end_m(&self, track_id: u64, time: Time) -> Option<f64> {
        let changes = self.by_track.get(&track_id)?;
        let running = changes.iter().filter(|change| change.span[0] <= time && time <= change.span[1]);
        running.max_by_key(|change| change.span[1]).map(|change| change.end_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filters::smooth;
    use crate::lane_change::detect;
    use crate::trajectory_data::test_support::{changing_track, straight_track, trajectory_data_of};

    #[test]
    fn only_a_running_lane_change_has_an_end() {
        let tracks = vec![
            changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110),
            straight_track(2, 0.0, 30.0, -5.25, 110),
        ];
        let data = smooth(&trajectory_data_of(tracks));
        let running = RunningChanges::of(&data, &detect(&data));
        let end_m = |track_id, time_s| running.end_m(track_id, Time::from_s(time_s));
        assert!((end_m(1, 5.5).unwrap() + 1.75).abs() < 0.05, "{:?}", end_m(1, 5.5));
        assert_eq!((end_m(1, 0.5), end_m(1, 10.5), end_m(2, 5.5)), (None, None, None));
    }
}
