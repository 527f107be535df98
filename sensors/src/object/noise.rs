//! The errors of one sensor about one vehicle: white noise, a slow drift, and lost measurements.
//!
//! The drift is a first-order Gauss–Markov process of standard deviation σ and correlation time τ,
//! bₖ₊₁ = φ·bₖ + σ·√(1 − φ²)·w with φ = exp(−Δt/τ) (Gelb, *Applied Optimal Estimation*, 1974): a radar's centre of
//! reflection wanders over the body of the vehicle instead of jumping from scan to scan.
//!
//! Every step draws the same numbers, whether the vehicle is seen or not. So two runs that differ only in what E does
//! (with and without MIS) meet the same errors at the same times.

use std::sync::Arc;

use closecall_traffic::{ActorId, Side, Stream, stream};
use rand::RngExt;
use rand_distr::StandardNormal;

use super::config::ObjectSensorModel;

/// What the random streams of E's sensors are keyed by, beside the channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoiseKey {
    /// The campaign's seed.
    pub seed: u64,
    /// The sample's index.
    pub sample: u64,
    /// The ego vehicle.
    pub ego: ActorId,
    /// The scenario's actors, in the order of its list: the errors about each are keyed by its name, so that neither the
    /// order nor a further actor changes them. An actor beyond the list is keyed by its number.
    pub actors: Arc<[ActorId]>,
}

impl NoiseKey {
    /// The stream of one channel, such as `front-radar`.
    pub fn stream(&self, channel: &str) -> Stream {
        stream(self.seed, self.sample, &self.ego, channel)
    }

    /// The stream of what one channel has to do with one actor.
    fn stream_about(&self, channel: &str, actor: usize) -> Stream {
        match self.actors.get(actor) {
            Some(name) => self.stream(&format!("{channel}/{name}")),
            None => self.stream(&format!("{channel}/{actor}")),
        }
    }
}

/// The state of the errors about one vehicle.
#[derive(Clone, Debug)]
pub(super) struct TargetNoise {
    rng: Stream,
    drift_m: [f64; 2],
}

/// The errors of one scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScanErrors {
    /// Error of the position along and across the road [m].
    pub(super) position_m: [f64; 2],
    /// Error of the speed along the road [m/s]; 0 where speed is not measured.
    pub(super) speed_mps: f64,
    /// True where the measurement is lost.
    pub(super) is_lost: bool,
}

impl ScanErrors {
    /// The same errors with the lateral one drawn towards the side on which one overtakes: where one drives on the left,
    /// the sensors err as they do where one drives on the right, mirrored.
    pub(super) fn towards(self, overtaking_side: Side) -> Self {
        let [along_m, across_m] = self.position_m;
        match overtaking_side {
            Side::Left => self,
            Side::Right => Self { position_m: [along_m, -across_m], ..self },
        }
    }
}

impl TargetNoise {
    /// The errors about the vehicle that is number `actor`, in the middle of their stationary course.
    pub(super) fn new(key: &NoiseKey, channel: &str, actor: usize, model: &ObjectSensorModel) -> Self {
        let mut rng = key.stream_about(channel, actor);
        let drift_m = [(); 2].map(|()| model.drift_sd_m * normal(&mut rng));
        Self { rng, drift_m }
    }

    /// The errors of the next scan.
    pub(super) fn next(&mut self, model: &ObjectSensorModel) -> ScanErrors {
        let decay = model.drift_decay;
        let kick_sd_m = model.drift_sd_m * (1.0 - decay * decay).sqrt();
        let mut position_m = [0.0; 2];
        for ((error_m, drift_m), white_sd_m) in position_m.iter_mut().zip(&mut self.drift_m).zip(model.white_sd_m) {
            *drift_m = decay * *drift_m + kick_sd_m * normal(&mut self.rng);
            *error_m = *drift_m + white_sd_m * normal(&mut self.rng);
        }
        let speed_mps = model.speed_sd_mps.unwrap_or(0.0) * normal(&mut self.rng);
        let is_lost = self.rng.random::<f64>() < model.dropout;
        ScanErrors { position_m, speed_mps, is_lost }
    }
}

fn normal(rng: &mut Stream) -> f64 {
    rng.sample(StandardNormal)
}
