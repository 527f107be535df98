//! The errors of one sensor's measurements of one vehicle: white noise, a slow drift, and lost measurements.
//!
//! The drift is a first-order Gauss–Markov process with the standard deviation σ and the correlation time τ (Gelb,
//! *Applied Optimal Estimation*, 1974):
//!
//! ```text
//!   bₖ₊₁ = φ·bₖ + σ·√(1 − φ²)·w        φ = exp(−Δt/τ), w: standard normal
//! ```
//!
//! It models a radar's centre of reflection, which wanders over the vehicle's body instead of jumping from scan to scan.
//!
//! Every step takes the same number of random values, whether the vehicle is seen or not. Two runs that differ only in
//! the ego's behaviour (with and without MIS) therefore have the same errors at the same times. The values of a vehicle that is
//! not in view are drawn once it is seen, and never if it is not.

use std::sync::Arc;

use closecall_traffic::{ActorId, Side, Stream, stream};
use rand::RngExt;
use rand_distr::StandardNormal;

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
    /// The errors of each actor's measurements are keyed by the actor's name, so that neither the order nor a further
    /// actor changes them. An actor whose index is beyond the list is keyed by its index.
    pub actors: Arc<[ActorId]>,
}

impl NoiseKey {
    /// Returns the random stream of one channel, such as `front-radar`.
    pub fn stream(&self, channel: &str) -> Stream {
        stream(self.seed, self.sample, &self.ego, channel)
    }

    /// Returns the random stream of one channel for one actor.
    pub(super) fn stream_about(&self, channel: &str, actor: usize) -> Stream {
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
    drift_m: [f64; 2],
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
}

impl MeasurementErrors {
    /// Returns the same errors for a road on which vehicles overtake on `overtaking_side`.
    ///
    /// The lateral error is mirrored for overtaking on the right, so that the errors in left-hand traffic mirror those
    /// in right-hand traffic.
    pub(super) fn mirrored_for(self, overtaking_side: Side) -> Self {
        let [along_m, across_m] = self.position_m;
        match overtaking_side {
            Side::Left => self,
            Side::Right => Self { position_m: [along_m, -across_m], ..self },
        }
    }
}

impl TargetNoise {
    /// Creates the error process for the vehicle with the index `actor`; the drift starts in its stationary
    /// distribution.
    pub(super) fn new(key: &NoiseKey, channel: &str, actor: usize, errors: &TargetErrors) -> Self {
        let mut rng = key.stream_about(channel, actor);
        let drift_m = errors.slow_sd_m.map(|sd_m| sd_m * normal(&mut rng));
        Self { rng, drift_m, skipped: 0 }
    }

    /// Passes over the errors of a scan that does not see the vehicle. They are drawn before the next ones that are needed.
    pub(super) fn skip(&mut self) {
        self.skipped += 1;
    }

    /// Changes the size of the errors, as the weather does. Those of scans that were passed over keep theirs.
    pub(super) fn change(&mut self, from: &TargetErrors, to: &TargetErrors) {
        self.draw_skipped(from);
        for (axis, drift_m) in self.drift_m.iter_mut().enumerate() {
            let [from_m, to_m] = [from, to].map(|errors| errors.slow_sd_m[axis]);
            if from_m > 0.0 && from_m != to_m {
                *drift_m *= to_m / from_m;
            }
        }
    }

    /// Returns the errors of the next scan, which is lost with the probability `lost`. The measured speed has the deviation
    /// `speed_sd_mps` (m/s).
    pub(super) fn draw(&mut self, errors: &TargetErrors, lost: f64, speed_sd_mps: f64) -> MeasurementErrors {
        self.draw_skipped(errors);
        let position_m = self.draw_position_m(errors);
        let speed_mps = speed_sd_mps * normal(&mut self.rng);
        let is_lost = self.rng.random::<f64>() < lost;
        MeasurementErrors { position_m, speed_mps, is_lost }
    }

    fn draw_skipped(&mut self, errors: &TargetErrors) {
        for _ in 0..std::mem::take(&mut self.skipped) {
            self.draw_position_m(errors);
            normal(&mut self.rng);
            self.rng.random::<f64>();
        }
    }

    fn draw_position_m(&mut self, errors: &TargetErrors) -> [f64; 2] {
        std::array::from_fn(|axis| {
            let decay = errors.slow_decay[axis];
            let increment_sd_m = errors.slow_sd_m[axis] * (1.0 - decay * decay).sqrt();
            let drift_m = &mut self.drift_m[axis];
            *drift_m = decay * *drift_m + increment_sd_m * normal(&mut self.rng);
            *drift_m + errors.white_sd_m[axis] * normal(&mut self.rng)
        })
    }
}

fn normal(rng: &mut Stream) -> f64 {
    rng.sample(StandardNormal)
}

#[cfg(test)]
mod tests {
    use super::super::errors::{Losses, decay};
    use super::*;

    const ERRORS: TargetErrors = TargetErrors {
        white_sd_m: [0.01, 0.02],
        slow_sd_m: [0.05, 0.1],
        slow_decay: [0.99, 0.9],
        losses: Losses::Even(0.1),
    };

    fn key() -> NoiseKey {
        NoiseKey { seed: 1, sample: 2, ego: ActorId::new("ego").unwrap(), actors: Arc::from([]) }
    }

    #[test]
    fn scans_that_are_passed_over_change_no_later_error() {
        let mut drawn = TargetNoise::new(&key(), "rear-object", 1, &ERRORS);
        let mut lazy = drawn.clone();
        for scan in 0..200 {
            let errors = drawn.draw(&ERRORS, 0.1, 0.0);
            // In view now and then: for one scan, for several, and after a long time.
            if matches!(scan, 0 | 7 | 8 | 9 | 150..) {
                let late = lazy.draw(&ERRORS, 0.1, 0.0);
                assert_eq!(errors.position_m.map(f64::to_bits), late.position_m.map(f64::to_bits), "scan {scan}");
                assert_eq!(errors.is_lost, late.is_lost);
            } else {
                lazy.skip();
            }
        }
    }
    #[test]
    fn errors_have_the_deviation_and_the_correlation_time_of_each_axis() {
        let mut noise = TargetNoise::new(&key(), "rear-object", 1, &ERRORS);
        let slow_only = TargetErrors { white_sd_m: [0.0; 2], slow_decay: [0.4, 2.0].map(decay), ..ERRORS };
        let drawn: Vec<[f64; 2]> = (0..200_000).map(|_| noise.draw(&slow_only, 0.0, 0.0).position_m).collect();
        for (axis, time_s) in [0.4, 2.0].into_iter().enumerate() {
            let lag = |steps: usize| drawn.iter().zip(&drawn[steps..]).map(|(a, b)| a[axis] * b[axis]).sum::<f64>();
            let sd_m = (lag(0) / drawn.len() as f64).sqrt();
            assert!((sd_m / slow_only.slow_sd_m[axis] - 1.0).abs() < 0.05, "{sd_m}");
            let after_time = lag((time_s / 0.04) as usize) / lag(0);
            assert!((after_time - (-1.0_f64).exp()).abs() < 0.05, "{after_time}");
        }
    }

    #[test]
    fn errors_grow_with_the_weather_from_one_scan_to_the_next() {
        let larger = TargetErrors { slow_sd_m: [0.5, 0.1], white_sd_m: [0.0; 2], ..ERRORS };
        let mut noise = TargetNoise::new(&key(), "rear-object", 1, &ERRORS);
        let mut skipping = noise.clone();
        let before_m = (0..50).map(|_| noise.draw(&ERRORS, 0.0, 0.0)).last().unwrap();
        (0..50).for_each(|_| skipping.skip());
        assert!(before_m.position_m[0].abs() < 0.3);
        for noise in [&mut noise, &mut skipping] {
            noise.change(&ERRORS, &larger);
        }
        let [drawn, skipped] = [noise, skipping].map(|mut noise| noise.draw(&larger, 0.0, 0.0).position_m);
        assert_eq!(drawn.map(f64::to_bits), skipped.map(f64::to_bits), "scans before the change had the former errors");
    }
}
