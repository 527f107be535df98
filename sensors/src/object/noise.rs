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

use super::config::ObjectSensorModel;

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
    pub(super) fn new(key: &NoiseKey, channel: &str, actor: usize, model: &ObjectSensorModel) -> Self {
        let mut rng = key.stream_about(channel, actor);
        let drift_m = [(); 2].map(|()| model.drift_sd_m * normal(&mut rng));
        Self { rng, drift_m, skipped: 0 }
    }

    /// Passes over the errors of a scan that does not see the vehicle. They are drawn before the next ones that are needed.
    pub(super) fn skip(&mut self) {
        self.skipped += 1;
    }

    /// Returns the errors of the next scan.
    pub(super) fn draw(&mut self, model: &ObjectSensorModel) -> MeasurementErrors {
        for _ in 0..std::mem::take(&mut self.skipped) {
            self.draw_next(model);
        }
        self.draw_next(model)
    }

    fn draw_next(&mut self, model: &ObjectSensorModel) -> MeasurementErrors {
        let decay = model.drift_decay;
        let increment_sd_m = model.drift_sd_m * (1.0 - decay * decay).sqrt();
        let mut position_m = [0.0; 2];
        for ((error_m, drift_m), white_sd_m) in position_m.iter_mut().zip(&mut self.drift_m).zip(model.white_sd_m) {
            *drift_m = decay * *drift_m + increment_sd_m * normal(&mut self.rng);
            *error_m = *drift_m + white_sd_m * normal(&mut self.rng);
        }
        let speed_mps = model.speed_sd_mps.unwrap_or(0.0) * normal(&mut self.rng);
        let is_lost = self.rng.random::<f64>() < model.dropout;
        MeasurementErrors { position_m, speed_mps, is_lost }
    }
}

fn normal(rng: &mut Stream) -> f64 {
    rng.sample(StandardNormal)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::Parameters;

    use super::super::config::ObjectSensorConfig;
    use super::*;

    #[test]
    fn scans_that_are_passed_over_change_no_later_error() {
        let model = ObjectSensorConfig::default().check_rear_object(&Parameters::default()).unwrap();
        let key = NoiseKey { seed: 1, sample: 2, ego: ActorId::new("ego").unwrap(), actors: Arc::from([]) };
        let mut drawn = TargetNoise::new(&key, "rear-object", 1, &model);
        let mut lazy = drawn.clone();
        for scan in 0..200 {
            let errors = drawn.draw(&model);
            // In view now and then: for one scan, for several, and after a long time.
            if matches!(scan, 0 | 7 | 8 | 9 | 150..) {
                let late = lazy.draw(&model);
                assert_eq!(errors.position_m.map(f64::to_bits), late.position_m.map(f64::to_bits), "scan {scan}");
                assert_eq!(errors.is_lost, late.is_lost);
            } else {
                lazy.skip();
            }
        }
    }
}
