//! A Kalman filter for one axis of the road: position and speed of a vehicle, and the sensor's drift.
//!
//! State [p, v, b]: position, speed (constant but for white acceleration of spectral density q), and the slowly varying
//! error b of the measured position, a Gauss–Markov process. With b in the state the covariance stays honest although
//! the errors of successive scans are correlated (Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking
//! and Navigation*, 2001, section 8.2: state augmentation for autocorrelated measurement noise). Both axes of the road
//! are independent, as their errors are; in road coordinates a vehicle that follows a bend at constant speed moves
//! uniformly, so that the bend is no manoeuvre.

use nalgebra::{Matrix3, Vector3};

/// Position of nothing in particular, before the first measurement [m²].
const UNKNOWN_POSITION_M2: f64 = 1e6;

/// What is known of one vehicle along one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisFilter {
    state: Vector3<f64>,
    covariance: Matrix3<f64>,
}

/// How a state changes within one scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisProcess {
    /// Time from scan to scan [s].
    pub(super) step_s: f64,
    /// Spectral density of the white acceleration [m²/s³].
    pub(super) manoeuvre_m2ps3: f64,
    /// Standard deviation of the drift [m].
    pub(super) drift_sd_m: f64,
    /// Share of the drift left after one scan [1].
    pub(super) drift_decay: f64,
}

/// Position and speed along one axis, with their covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct AxisEstimate {
    pub(super) position_m: f64,
    pub(super) speed_mps: f64,
    pub(super) position_m2: f64,
    pub(super) position_speed_m2ps: f64,
    pub(super) speed_m2ps2: f64,
}

impl AxisFilter {
    /// A filter near `position_m`, which has not been measured yet, with a speed of `speed_mps` ± `speed_sd_mps`.
    pub(super) fn prior(position_m: f64, speed_mps: f64, speed_sd_mps: f64, drift_sd_m: f64) -> Self {
        let variances = Vector3::new(UNKNOWN_POSITION_M2, speed_sd_mps * speed_sd_mps, drift_sd_m * drift_sd_m);
        Self { state: Vector3::new(position_m, speed_mps, 0.0), covariance: Matrix3::from_diagonal(&variances) }
    }

    /// Goes on by one scan.
    pub(super) fn predict(&mut self, process: &AxisProcess) {
        let (t, decay) = (process.step_s, process.drift_decay);
        self.state[0] += t * self.state[1];
        self.state[2] *= decay;
        let p = &self.covariance;
        let (pp, pv, pb, vv, vb, bb) = (p[(0, 0)], p[(0, 1)], p[(0, 2)], p[(1, 1)], p[(1, 2)], p[(2, 2)]);
        let q = process.manoeuvre_m2ps3;
        let pp = pp + t * (2.0 * pv + t * vv) + q * t * t * t / 3.0;
        let pv = pv + t * vv + q * t * t / 2.0;
        let pb = decay * (pb + t * vb);
        let vv = vv + q * t;
        let vb = decay * vb;
        let bb = decay * decay * bb + (1.0 - decay * decay) * process.drift_sd_m * process.drift_sd_m;
        self.covariance = Matrix3::new(pp, pv, pb, pv, vv, vb, pb, vb, bb);
    }

    /// Takes in a measured position, which carries the drift.
    pub(super) fn measure_position(&mut self, position_m: f64, sd_m: f64) {
        let gain = self.covariance.column(0) + self.covariance.column(2);
        self.correct(position_m - self.state[0] - self.state[2], gain, gain[0] + gain[2] + sd_m * sd_m);
    }

    /// Takes in a measured speed.
    pub(super) fn measure_speed(&mut self, speed_mps: f64, sd_mps: f64) {
        let gain = self.covariance.column(1).into_owned();
        self.correct(speed_mps - self.state[1], gain, gain[1] + sd_mps * sd_mps);
    }

    /// P·Hᵀ for a scalar measurement in `gain`, its innovation, and the innovation's variance.
    fn correct(&mut self, innovation: f64, gain: Vector3<f64>, variance: f64) {
        self.state += gain * (innovation / variance);
        self.covariance -= gain * gain.transpose() / variance;
    }

    pub(super) fn speed_sd_mps(&self) -> f64 {
        self.covariance[(1, 1)].sqrt()
    }

    /// Position and speed after `horizon_s` without another measurement.
    pub(super) fn estimate(&self, horizon_s: f64, manoeuvre_m2ps3: f64) -> AxisEstimate {
        let mut ahead = *self;
        if horizon_s > 0.0 {
            let (drift_sd_m, drift_decay) = (0.0, 1.0);
            ahead.predict(&AxisProcess { step_s: horizon_s, manoeuvre_m2ps3, drift_sd_m, drift_decay });
        }
        AxisEstimate {
            position_m: ahead.state[0],
            speed_mps: ahead.state[1],
            position_m2: ahead.covariance[(0, 0)],
            position_speed_m2ps: ahead.covariance[(0, 1)],
            speed_m2ps2: ahead.covariance[(1, 1)],
        }
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::ActorId;

    use super::super::config::ObjectSensorConfig;
    use super::super::noise::{NoiseKey, TargetNoise};
    use super::*;
    use closecall_traffic::Parameters;
    use rand::RngExt;
    use rand_distr::StandardNormal;

    /// Normalised error squared of (position, speed), averaged over many independent filters.
    fn mean_nees(runs: u64) -> f64 {
        let model = ObjectSensorConfig::default().check_rear_object(&Parameters::default()).unwrap();
        let q = 0.5;
        let process = AxisProcess {
            step_s: 0.04,
            manoeuvre_m2ps3: q,
            drift_sd_m: model.drift_sd_m,
            drift_decay: model.drift_decay,
        };
        let mut sum = 0.0;
        for run in 0..runs {
            let key = NoiseKey { seed: 7, sample: run, ego: ActorId::new("ego").unwrap(), actors: [].into() };
            let mut world = key.stream("world");
            let mut normal = || world.sample::<f64, _>(StandardNormal);
            let mut noise = TargetNoise::new(&key, "test", 0, &model);
            let (mut position_m, mut speed_mps) = (50.0, 10.0 * normal());
            let mut filter = AxisFilter::prior(position_m, 0.0, 10.0, model.drift_sd_m);
            for scan in 0..40 {
                if scan > 0 {
                    // The exact discretisation of white acceleration.
                    let (t, a, b) = (0.04_f64, normal(), normal());
                    position_m += t * speed_mps + (q * t * t * t / 3.0).sqrt() * (0.75_f64.sqrt() * a + 0.5 * b);
                    speed_mps += (q * t).sqrt() * a;
                    filter.predict(&process);
                }
                let error_m = noise.next(&model).position_m[0];
                filter.measure_position(position_m + error_m, model.white_sd_m[0]);
            }
            let estimate = filter.estimate(0.0, q);
            let (dp, dv) = (position_m - estimate.position_m, speed_mps - estimate.speed_mps);
            let (pp, pv, vv) = (estimate.position_m2, estimate.position_speed_m2ps, estimate.speed_m2ps2);
            sum += (vv * dp * dp - 2.0 * pv * dp * dv + pp * dv * dv) / (pp * vv - pv * pv);
        }
        sum / runs as f64
    }

    #[test]
    fn the_covariance_is_honest_despite_the_drift() {
        let runs = 1_000;
        // The mean of n χ² variables of 2 degrees of freedom has the standard deviation 2/√n.
        let deviation = (mean_nees(runs) - 2.0) / (2.0 / (runs as f64).sqrt());
        assert!(deviation.abs() < 3.0, "{deviation} standard deviations from 2");
    }
}
