//! The tracks that a program has answered: they wait for the latency, and are predicted to the
//! present.

use std::collections::{BTreeMap, VecDeque};

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Time, Track, TrackId};

use super::Pose;
use crate::tracking::TrackList;

/// An answer that has not been replaced by a later one.
#[derive(Clone, Debug)]
struct Answered {
    /// Number of the step from which on a controller gets it.
    due_step: u64,
    /// The time at which its states hold.
    time: Time,
    /// The ego's place at that time.
    pose: Pose,
    tracks: Vec<Track>,
}

/// The answers of a program that tracks.
#[derive(Clone, Debug, Default)]
pub(crate) struct OutsideTracks {
    answers: VecDeque<Answered>,
    /// The number of each track of the program in the run.
    ids: BTreeMap<u32, TrackId>,
}

impl OutsideTracks {
    /// Appends an answer whose states hold at `time`, where the ego was at `pose`. It is due from
    /// `step` on.
    pub(crate) fn push(&mut self, (time, pose): (Time, Pose), tracks: Vec<Track>, step: u64) {
        // Answers arrive in their order.
        let due_step = step.max(self.answers.back().map_or(0, |answer| answer.due_step));
        self.answers.push_back(Answered { due_step, time, pose, tracks });
    }

    /// Appends the tracks of the latest answer that is due in `step` to `list`, predicted to `time`
    /// at constant velocity, in the ego's frame at that time.
    pub(crate) fn report(&mut self, step: u64, (time, pose): (Time, Pose), frame: &EgoFrame<'_>, list: &mut TrackList) {
        while self.answers.get(1).is_some_and(|next| next.due_step <= step) {
            self.answers.pop_front();
        }
        let Some(answer) = self.answers.front().filter(|answer| answer.due_step <= step) else { return };
        let elapsed_s = (time - answer.time).s();
        for track in &answer.tracks {
            let id = *self.ids.entry(track.id.0).or_insert_with(|| list.new_id());
            let (state, covariance) = answer.pose.moved(&pose, (&track.state, &track.covariance), elapsed_s);
            let (s_m, d_m) = frame.road_position_m(state[0], state[1]);
            list.tracks.push(Track {
                id,
                time,
                state,
                covariance,
                heading_rad: track.heading_rad + answer.pose.yaw_rad - pose.yaw_rad,
                lane: frame.lane_probabilities(s_m, d_m, covariance[(1, 1)].sqrt()),
                ..track.clone()
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{CONTROL_STEP, ClassScores, Road, Source, TrackStatus, VehicleState};
    use nalgebra::{Matrix4, Vector4};

    use super::*;

    fn track(id: u32) -> Track {
        Track {
            id: TrackId(id),
            source: Source::Rear,
            status: TrackStatus::Confirmed,
            time: Time::ZERO,
            state: Vector4::new(-40.0, 0.0, 35.0, 0.0),
            covariance: Matrix4::identity() * 0.01,
            heading_rad: 0.0,
            length_m: 4.6,
            width_m: 1.8,
            class: ClassScores::UNKNOWN,
            existence: 0.9,
            lane: [0.0; 3],
        }
    }

    #[test]
    fn an_answer_waits_for_the_latency_and_is_predicted_to_the_present() {
        let road = Road::straight(3);
        let first = VehicleState { s_m: 500.0, d_m: -5.625, speed_mps: 30.0, ..VehicleState::default() };
        let mut outside = OutsideTracks::default();
        let mut list = TrackList::default();
        list.new_id();
        let mut seen = Vec::new();
        for step in 0..5_u64 {
            let time = CONTROL_STEP * i64::try_from(step).unwrap();
            let ego = VehicleState { s_m: 500.0 + 30.0 * time.s(), ..first };
            let pose = Pose::of(&road, &first, &ego);
            if step == 0 {
                outside.push((time, pose), vec![track(7)], step + 2);
            }
            if step == 1 {
                outside.push((time, pose), vec![track(9), track(7)], step + 2);
            }
            list.tracks.clear();
            outside.report(step, (time, pose), &EgoFrame::new(&road, &ego), &mut list);
            seen.push(list.tracks.clone());
        }
        assert!(seen[0].is_empty() && seen[1].is_empty());
        // At constant speeds the gap shrinks by 5 m/s, for 0.08 s.
        assert!((seen[2][0].x_m() - (-40.0 + 5.0 * 0.08)).abs() < 1e-9, "{}", seen[2][0].x_m());
        assert!(seen[2][0].lane[1] > 0.99 && seen[2][0].time == CONTROL_STEP * 2);
        // A track keeps its number, which is no other sensor's.
        assert_eq!(seen[2][0].id, TrackId(1));
        assert_eq!(seen[3].iter().map(|track| track.id).collect::<Vec<_>>(), [TrackId(2), TrackId(1)]);
        // Without a new answer the last one is predicted further.
        assert!((seen[4][0].x_m() - (-40.0 + 5.0 * 0.12)).abs() < 1e-9);
    }
}
