//! Disturbance of the lateral position.

use closecall_traffic::{ActorId, StandardNormal, Trajectory, stream};
use rand::distr::Distribution;

use crate::trajectory_data::MarkingDistances;

/// A disturbance of the lateral position of all vehicles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// Constant displacement to the left (m).
    pub offset_m: f64,
    /// Intensity of the Brownian noise (m/√s).
    pub noise_m_per_sqrt_s: f64,
}

/// One of several repetitions of an experiment, each with its own noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Repetition {
    /// Seed of the study.
    pub(super) seed: u64,
    /// Number of the repetition, from 0.
    pub(super) number: u64,
}

impl Disturbance {
    /// Returns `track` and its `distances` to the markings, both displaced.
    pub(super) fn apply(
        &self,
        track: &Trajectory,
        distances: &[MarkingDistances],
        repetition: Repetition,
    ) -> (Trajectory, Vec<MarkingDistances>) {
        let mut points = track.points.clone();
        let mut distances = distances.to_vec();
        let mut noise = Brownian::new(track, repetition);
        for (k, point) in points.iter_mut().enumerate() {
            let displaced_m = self.offset_m + self.noise_m_per_sqrt_s * noise.next(k);
            point.d_m += displaced_m;
            if let Some(measured) = distances.get_mut(k) {
                measured.left_m = measured.left_m.map(|left_m| left_m - displaced_m);
                measured.right_m = measured.right_m.map(|right_m| right_m + displaced_m);
            }
        }
        (track.with_points(points), distances)
    }
}

/// A Brownian path of unit intensity (√s) at the instants of a track, which starts at 0.
struct Brownian<'a> {
    track: &'a Trajectory,
    stream: Option<closecall_traffic::Stream>,
    value: f64,
}

impl<'a> Brownian<'a> {
    fn new(track: &'a Trajectory, Repetition { seed, number }: Repetition) -> Self {
        // The name is valid for every track id. Without a stream there would be no noise, and the
        // tests would fail.
        let name = ActorId::new(&format!("track-{}", track.track_id)).ok();
        Self { track, stream: name.map(|name| stream(seed, number, &name, "brownian-lateral")), value: 0.0 }
    }

    /// Advances the path to instant `k`, which must follow the previous one, and returns its value
    /// there.
    fn next(&mut self, k: usize) -> f64 {
        if let (true, Some(stream)) = (k > 0, &mut self.stream) {
            let step_s = (self.track.points[k].time - self.track.points[k - 1].time).s();
            let normal: f64 = StandardNormal.sample(stream);
            self.value += step_s.max(0.0).sqrt() * normal;
        }
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory_data::test_support::straight_track;

    #[test]
    fn the_noise_has_the_given_intensity_and_all_levels_share_one_path() {
        let noise_m = |noise_m_per_sqrt_s: f64, number| {
            let track = straight_track(1, 0.0, 25.0, -1.75, 101);
            let disturbance = Disturbance { offset_m: 0.5, noise_m_per_sqrt_s };
            let distances = vec![MarkingDistances { left_m: Some(1.75), right_m: Some(1.75) }; 101];
            let (track, distances) = disturbance.apply(&track, &distances, Repetition { seed: 7, number });
            let displaced_m = track.points[100].d_m + 1.75;
            assert!((distances[100].left_m.unwrap() - 1.75 + displaced_m).abs() < 1e-12);
            assert!((distances[100].right_m.unwrap() - 1.75 - displaced_m).abs() < 1e-12);
            assert_eq!(track.points[0].d_m, -1.25);
            displaced_m - 0.5
        };
        assert_eq!(noise_m(0.0, 0), 0.0);
        assert!((noise_m(0.4, 3) - 4.0 * noise_m(0.1, 3)).abs() < 1e-9);
        // After 10 s the variance is 10 σ².
        let squares = (0..400).map(|number| noise_m(0.2, number).powi(2)).sum::<f64>() / 400.0;
        assert!((squares - 0.4).abs() < 0.1, "{squares}");
    }
}
