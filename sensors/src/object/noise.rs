//! The errors of one sensor's measurements of one vehicle: white noise, a slow drift, and lost
//! measurements.
//!
//! The drift is a first-order Gauss–Markov process with the standard deviation σ and the
//! correlation time τ (Gelb, *Applied Optimal Estimation*, 1974):
//!
//! ```text
//!   bₖ₊₁ = φ·bₖ + σ·√(1 − φ²)·w        φ = exp(−Δt/τ), w: standard normal
//! ```
//!
//! It models a radar's centre of reflection, which wanders over the vehicle's body instead of
//! jumping from scan to scan.
//!
//! Every step takes the same number of random values, whether the vehicle is seen or not. Two runs
//! that differ only in the ego's behaviour (with and without MIS) therefore have the same errors at
//! the same times. The values of a vehicle outside the field of view are drawn once it is seen, and
//! never if it is not seen.

use std::sync::Arc;

use closecall_traffic::{ActorId, Side, StandardNormal, Stream, stream};
use rand::RngExt;

use super::errors::TargetErrors;

/// The key of the random streams of the ego's sensors, apart from the channel name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoiseKey {
    /// The campaign's seed.
    pub seed: u64,
    /// The sample's index.
    pub sample: u64,
    /// The ego vehicle.
    pub ego: ActorId,
    /// The scenario's actors, in the order of its list.
    ///
    /// The errors of each actor's measurements are keyed by the actor's name, so that neither the
    /// order nor a further actor changes them. An actor whose index is beyond the list is keyed by
    /// its index.
    pub actors: Arc<[ActorId]>,
}

impl NoiseKey {
    /// Returns the key of other random streams: another one for each number, and the same one for 0.
    pub(crate) fn redrawn(&self, number: u32) -> Self {
        Self { seed: self.seed ^ (u64::from(number) << 32), ..self.clone() }
    }

    /// Returns the random stream of one channel, such as `front-radar`.
    pub fn stream(&self, channel: &str) -> Stream {
        stream(self.seed, self.sample, &self.ego, channel)
    }

    /// Returns the random stream of one channel for one actor.
    pub(crate) fn stream_about(&self, channel: &str, actor: usize) -> Stream {
        match self.actors.get(actor) {
            Some(name) => self.stream(&format!("{channel}/{name}")),
            None => self.stream(&format!("{channel}/{actor}")),
        }
    }
}

/// The error process of one sensor for one vehicle.
#[derive(Clone, Debug)]
pub(super) struct TargetNoise {
    rng: Stream,
    /// The slow errors along and across the road, in standard deviations (-).
    slow: [f64; 2],
    /// Number of scans whose errors have not been drawn yet, because nothing needed them.
    skipped: u64,
}

/// The errors of one vehicle's measurement in one scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasurementErrors {
    /// Errors of the position along and across the road (m).
    pub(super) position_m: [f64; 2],
    /// Error of the speed along the road (m/s); 0 if the sensor does not measure speed.
    pub(super) speed_mps: f64,
    /// Whether the measurement is lost.
    pub(super) is_lost: bool,
    /// Standard deviations of the white and of the slow part of the position's errors, along and
    /// across the road (m).
    pub(super) white_sd_m: [f64; 2],
    pub(super) slow_sd_m: [f64; 2],
}

/// Conditions of a scan that its errors depend on, beside the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Scan {
    /// Whether the vehicle is far.
    pub(super) is_far: bool,
    /// Probability that the scan loses the vehicle (-).
    pub(super) lost: f64,
    /// Standard deviation of the measured speed (m/s).
    pub(super) speed_sd_mps: f64,
}

impl MeasurementErrors {
    /// Returns the same errors for a road on which vehicles overtake on `overtaking_side`.
    ///
    /// The lateral error is mirrored for overtaking on the right, so the errors in left-hand
    /// traffic mirror the errors in right-hand traffic.
    pub(super) fn mirrored_for(self, overtaking_side: Side) -> Self {
        let [along_m, across_m] = self.position_m;
        match overtaking_side {
            Side::Left => self,
            Side::Right => Self { position_m: [along_m, -across_m], ..self },
        }
    }
}

impl TargetNoise {
    /// Creates the error process for the vehicle with the index `actor`; the slow errors start in
    /// their stationary distribution.
    pub(super) fn new(key: &NoiseKey, channel: &str, actor: usize) -> Self {
        let mut rng = key.stream_about(channel, actor);
        let slow = std::array::from_fn(|_| normal(&mut rng));
        Self { rng, slow, skipped: 0 }
    }

    /// Passes over the errors of a scan that does not see the vehicle. They are drawn before the
    /// next errors that are needed.
    pub(super) fn skip(&mut self) {
        self.skipped += 1;
    }

    /// Returns the errors of the next scan. The errors of skipped scans have the same correlation
    /// times.
    pub(super) fn draw(&mut self, errors: &TargetErrors, scan: Scan) -> MeasurementErrors {
        self.draw_skipped(errors);
        let [white_sd_m, slow_sd_m] = [errors.white_sd_m, errors.slow_sd_m].map(|sd_m| sd_m.of(scan.is_far));
        let white = self.draw_position(errors);
        let position_m = std::array::from_fn(|axis| self.slow[axis] * slow_sd_m[axis] + white[axis] * white_sd_m[axis]);
        let speed_mps = scan.speed_sd_mps * normal(&mut self.rng);
        let is_lost = self.rng.random::<f64>() < scan.lost;
        MeasurementErrors { position_m, speed_mps, is_lost, white_sd_m, slow_sd_m }
    }

    /// Draws the errors of the scans that were passed over, as their correlation times change.
    pub(super) fn draw_skipped(&mut self, errors: &TargetErrors) {
        for _ in 0..std::mem::take(&mut self.skipped) {
            self.draw_position(errors);
            normal(&mut self.rng);
            self.rng.random::<f64>();
        }
    }

    /// Draws the slow errors of the next scan, and returns its white errors, in standard deviations
    /// (-).
    fn draw_position(&mut self, errors: &TargetErrors) -> [f64; 2] {
        std::array::from_fn(|axis| {
            let decay = errors.slow_decay[axis];
            self.slow[axis] = decay * self.slow[axis] + (1.0 - decay * decay).sqrt() * normal(&mut self.rng);
            normal(&mut self.rng)
        })
    }
}

fn normal(rng: &mut Stream) -> f64 {
    rng.sample(StandardNormal)
}

#[cfg(test)]
mod tests {
    use super::super::errors::{Losses, NearFar, decay};
    use super::*;
    use closecall_traffic::maths;

    const ERRORS: TargetErrors = TargetErrors {
        white_sd_m: NearFar { near: [0.01, 0.02], far: [0.1, 0.2] },
        far_m: 80.0,
        slow_sd_m: NearFar { near: [0.05, 0.1], far: [0.15, 0.1] },
        slow_decay: [0.99, 0.9],
        losses: Losses::Even(0.1),
    };

    const SCAN: Scan = Scan { is_far: false, lost: 0.0, speed_sd_mps: 0.0 };

    fn key() -> NoiseKey {
        NoiseKey { seed: 1, sample: 2, ego: ActorId::new("ego").unwrap(), actors: Arc::from([]) }
    }

    #[test]
    fn scans_that_are_passed_over_change_no_later_error() {
        let mut drawn = TargetNoise::new(&key(), "rear-object", 1);
        let mut lazy = drawn.clone();
        for scan in 0..200 {
            let scan_of = Scan { is_far: scan < 100, lost: 0.1, ..SCAN };
            let errors = drawn.draw(&ERRORS, scan_of);
            // In view now and then: for one scan, for several, and after a long time.
            if matches!(scan, 0 | 7 | 8 | 9 | 150..) {
                let late = lazy.draw(&ERRORS, scan_of);
                assert_eq!(errors.position_m.map(f64::to_bits), late.position_m.map(f64::to_bits), "scan {scan}");
                assert_eq!(errors.is_lost, late.is_lost);
            } else {
                lazy.skip();
            }
        }
    }

    #[test]
    fn white_errors_of_a_far_vehicle_are_its_own() {
        let white_only = TargetErrors { slow_sd_m: NearFar::same([0.0; 2]), ..ERRORS };
        let mut noise = TargetNoise::new(&key(), "rear-object", 1);
        for is_far in [false, true] {
            let drawn: Vec<_> = (0..20_000).map(|_| noise.draw(&white_only, Scan { is_far, ..SCAN })).collect();
            for axis in 0..2 {
                let mean_square =
                    drawn.iter().map(|error| error.position_m[axis].powi(2)).sum::<f64>() / drawn.len() as f64;
                let sd_m = white_only.white_sd_m.of(is_far)[axis];
                assert!((mean_square.sqrt() / sd_m - 1.0).abs() < 0.03, "{mean_square}");
                assert_eq!(drawn[0].white_sd_m[axis], sd_m);
            }
        }
    }

    #[test]
    fn errors_have_the_deviation_and_the_correlation_time_of_each_axis() {
        let mut noise = TargetNoise::new(&key(), "rear-object", 1);
        let white_sd_m = NearFar::same([0.0; 2]);
        let slow_only = TargetErrors { white_sd_m, slow_decay: [0.4, 2.0].map(decay), ..ERRORS };
        let drawn: Vec<[f64; 2]> = (0..200_000).map(|_| noise.draw(&slow_only, SCAN).position_m).collect();
        for (axis, time_s) in [0.4, 2.0].into_iter().enumerate() {
            let lag = |steps: usize| drawn.iter().zip(&drawn[steps..]).map(|(a, b)| a[axis] * b[axis]).sum::<f64>();
            let sd_m = (lag(0) / drawn.len() as f64).sqrt();
            assert!((sd_m / slow_only.slow_sd_m.near[axis] - 1.0).abs() < 0.05, "{sd_m}");
            let after_time = lag((time_s / 0.04) as usize) / lag(0);
            assert!((after_time - maths::exp(-1.0)).abs() < 0.05, "{after_time}");
        }
    }

    #[test]
    fn slow_errors_grow_with_the_distance_and_the_weather_from_one_scan_to_the_next() {
        let slow_only = TargetErrors { white_sd_m: NearFar::same([0.0; 2]), slow_decay: [1.0; 2], ..ERRORS };
        let mut noise = TargetNoise::new(&key(), "rear-object", 1);
        let mut drawn = |errors: &TargetErrors, is_far| noise.draw(errors, Scan { is_far, ..SCAN }).position_m;
        let [near_m, far_m] = [false, true].map(|is_far| drawn(&slow_only, is_far));
        assert!((far_m[0] / near_m[0] - 3.0).abs() < 1e-12 && far_m[1] == near_m[1], "{near_m:?} {far_m:?}");
        let in_fog = TargetErrors { slow_sd_m: NearFar::same([0.5, 0.1]), ..slow_only };
        assert!((drawn(&in_fog, false)[0] / near_m[0] - 10.0).abs() < 1e-12);
    }

    #[test]
    fn scans_before_a_change_of_the_weather_keep_their_correlation_time() {
        let later = TargetErrors { slow_decay: [0.1; 2], ..ERRORS };
        let mut noise = TargetNoise::new(&key(), "rear-object", 1);
        let mut skipping = noise.clone();
        for _ in 0..50 {
            noise.draw(&ERRORS, SCAN);
            skipping.skip();
        }
        skipping.draw_skipped(&ERRORS);
        let [drawn, skipped] = [noise, skipping].map(|mut noise| noise.draw(&later, SCAN).position_m);
        assert_eq!(drawn.map(f64::to_bits), skipped.map(f64::to_bits));
    }
}
