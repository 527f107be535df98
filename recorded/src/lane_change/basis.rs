//! The basis of a detection of lane changes, for its output: the lanes that it used, and the reason
//! why it may have found nothing.

use std::collections::BTreeSet;
use std::fmt;

use closecall_traffic::words::counted;
use closecall_traffic::{Lane, Trajectory};

use super::{Criterion, LaneReliability};
use crate::trajectory_data::{LaneMarkings, MarkingDistances};

/// The lanes that a detection used, gathered from the tracks as they are read.
#[derive(Clone, Debug)]
pub struct DetectionBasis {
    criterion: Criterion,
    lanes: LaneReliability,
    markings: LaneMarkings,
    recorded_lanes: BTreeSet<u8>,
    recorded_crossings: u64,
    /// Changes of the recorded lane while the rows of a vehicle are missing.
    hidden_crossings: u64,
    /// Frames in which both distances to the markings were measured.
    measured_frames: u64,
    is_measured: bool,
}

impl DetectionBasis {
    /// Creates the basis of a detection by `criterion` on a road with these `markings`.
    pub fn new(criterion: Criterion, lanes: LaneReliability, markings: &LaneMarkings) -> Self {
        Self {
            criterion,
            lanes,
            markings: markings.clone(),
            recorded_lanes: BTreeSet::new(),
            recorded_crossings: 0,
            hidden_crossings: 0,
            measured_frames: 0,
            is_measured: false,
        }
    }

    /// Adds a track, with its distances to the markings if they were measured.
    pub fn push(&mut self, track: &Trajectory, distances: &[MarkingDistances]) {
        self.recorded_lanes.extend(track.points.iter().map(|point| point.lane.0));
        let changes = track.points.windows(2).filter(|pair| pair[0].lane != pair[1].lane);
        self.recorded_crossings += changes.count() as u64;
        self.is_measured |= !distances.is_empty();
        let seen = distances.iter().filter(|seen| seen.left_m.is_some() && seen.right_m.is_some());
        self.measured_frames += seen.count() as u64;
    }

    /// States how often a vehicle changes its recorded lane while its rows are missing.
    pub(super) fn set_hidden_crossings(&mut self, hidden_crossings: u64) {
        self.hidden_crossings = hidden_crossings;
    }

    /// Returns true if lane positions come from the recorded lanes alone, and none of them is
    /// known.
    fn has_no_marking(&self) -> bool {
        !self.is_measured && !self.recorded_lanes.iter().any(|&lane| self.markings.right_edge_m(Lane(lane)).is_some())
    }

    /// Returns true if lane changes are searched by the recorded lanes, and no vehicle changes its
    /// recorded lane.
    pub fn lacks_recorded_crossings(&self) -> bool {
        let by_lane = (self.criterion, self.lanes) == (Criterion::Peak, LaneReliability::Reliable);
        by_lane && self.recorded_crossings + self.hidden_crossings == 0
    }

    /// Returns why vehicles change their recorded lanes although no lane change was found, of
    /// `found` lane changes.
    pub fn unexplained_crossings(&self, lane_changes: usize) -> Option<String> {
        let by_lane = (self.criterion, self.lanes) == (Criterion::Peak, LaneReliability::Reliable);
        (by_lane && lane_changes == 0 && self.recorded_crossings > 0).then(|| {
            format!(
                "the recorded lane changes {} times, but no lateral movement carries a vehicle over a marking: the file shows no lane \
                 change that can be followed",
                self.recorded_crossings
            )
        })
    }

    /// Returns the reasons for which lane changes may be missing, or their quantities may be wrong.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> = self.markings.ignored().iter().map(ToString::to_string).collect();
        if self.lacks_recorded_crossings() {
            warnings.push(
                "no vehicle changes its recorded lane, so that nothing can be found by it; a search that takes no lane as \
                 recorded goes by the lateral shift alone"
                    .to_owned(),
            );
        }
        if self.criterion == Criterion::Distance && self.has_no_marking() {
            let width_m = self.markings.typical_lane_width_m();
            warnings.push(format!("no marking is known: lanes of {width_m:.2} m from d = 0 to the right are assumed"));
        }
        if self.is_measured && self.criterion != Criterion::Peak && self.measured_frames == 0 {
            let criterion = self.criterion.name();
            warnings.push(format!(
                "the distances to both markings were never measured, so that the {criterion} criterion can find nothing"
            ));
        }
        warnings
    }
}

impl fmt::Display for DetectionBasis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width_m = self.markings.typical_lane_width_m();
        match (self.criterion, self.lanes) {
            (Criterion::Gradient, _) => {
                write!(f, "lanes: from the measured distances to the markings in {} frames", self.measured_frames)
            }
            (Criterion::Distance, _) if self.is_measured => {
                write!(f, "lanes: from the measured distances to the markings in {} frames", self.measured_frames)
            }
            (Criterion::Peak, LaneReliability::Estimated) => write!(
                f,
                "lanes: {} estimated from the lateral positions of the traffic, {width_m:.2} m wide",
                self.recorded_lanes.len()
            ),
            (Criterion::Peak, LaneReliability::Unreliable) => {
                write!(f, "lanes: none; a lateral shift by most of a lane of {width_m:.2} m is a lane change")
            }
            (_, _) => {
                let lanes: Vec<u8> = self
                    .recorded_lanes
                    .iter()
                    .copied()
                    .filter(|&lane| self.markings.right_edge_m(Lane(lane)).is_some())
                    .collect();
                write!(
                    f,
                    "lanes: {} recorded, {width_m:.2} m wide, {} known, {} of the recorded lane",
                    self.recorded_lanes.len(),
                    counted(lanes.len(), "marking"),
                    counted(self.recorded_crossings, "change")
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory_data::test_support::{changing_track, straight_track, trajectory_data_of};

    fn basis(criterion: Criterion, lanes: LaneReliability, tracks: Vec<Trajectory>) -> DetectionBasis {
        let data = trajectory_data_of(tracks);
        let mut basis = DetectionBasis::new(criterion, lanes, &data.markings);
        data.trajectories.iter().for_each(|track| basis.push(track, &[]));
        basis
    }

    #[test]
    fn a_file_without_lanes_is_a_warning_and_never_silence() {
        let alone = || vec![straight_track(1, 0.0, 30.0, -1.75, 100)];
        let by_lane = basis(Criterion::Peak, LaneReliability::Reliable, alone());
        assert!(by_lane.warnings()[0].contains("goes by the lateral shift alone"), "{:?}", by_lane.warnings());
        let by_shift = basis(Criterion::Peak, LaneReliability::Unreliable, alone());
        assert!(by_shift.warnings().is_empty() && by_shift.to_string().contains("lanes: none"), "{by_shift}");
        let by_distance = basis(Criterion::Distance, LaneReliability::Reliable, alone());
        assert!(by_distance.warnings()[0].contains("3.50 m from d = 0"), "{:?}", by_distance.warnings());
    }

    #[test]
    fn recorded_lanes_are_stated_without_a_warning() {
        let track = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110);
        let basis = basis(Criterion::Distance, LaneReliability::Reliable, vec![track]);
        assert_eq!(basis.warnings(), [""; 0]);
        assert!(basis.to_string().starts_with("lanes: 2 recorded, 3.43 m wide, 1 marking known"), "{basis}");
    }
}
