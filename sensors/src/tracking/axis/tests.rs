//! Tests of the axis filter on motions and measurements that are drawn from its own model.

use closecall_traffic::{ActorId, CONTROL_STEP, StandardNormal, Stream, stream};
use rand::RngExt;

use super::super::motion::{ACROSS_MODES, ALONG_MODES, ALONG_WHITE_MODE};
use super::*;

const STEP_S: f64 = CONTROL_STEP.s();
const WHITE_SD_M: f64 = 0.1;
const SLOW_SD_M: f64 = 0.1;
const SLOW_SHARE: f64 = 0.96;

fn normal(rng: &mut Stream) -> f64 {
    rng.sample(StandardNormal)
}

/// A simulated vehicle, whose modes, motion and measurements follow the filter's model, with its
/// filter.
struct SimulatedVehicle {
    rng: Stream,
    truth: Vector4<f64>,
    mode: usize,
    filter: AxisFilter,
}

impl SimulatedVehicle {
    fn new(modes: &'static [Mode], run: u64) -> Self {
        let mut rng = stream(7, run, &ActorId::new("ego").unwrap(), "axis-test");
        let mode = 0;
        let truth = Vector4::new(50.0, 1.0 * normal(&mut rng), 0.0, normal(&mut rng));
        Self { rng, truth, mode, filter: AxisFilter::prior(modes, Gaussian::new(50.0, 100.0), Gaussian::new(0.0, 1.0)) }
    }

    fn advance(&mut self) {
        let modes = self.filter.modes;
        let mut draw: f64 = self.rng.random();
        for (to, rate) in modes[self.mode].switch_rates_per_s.iter().enumerate().filter(|(to, _)| *to < modes.len()) {
            draw -= rate * STEP_S;
            if draw < 0.0 && to != self.mode {
                self.mode = to;
                break;
            }
        }
        // The filter's prediction gives the mean of the next state, and its covariance the noise.
        let mut step = ModeEstimate { state: self.truth, covariance: Matrix4::zeros(), probability: 1.0 };
        let mode = &modes[self.mode];
        step.predict(mode, STEP_S, &Remaining::after(mode, self.mode, STEP_S), SLOW_SHARE);
        let tiny = Matrix4::identity() * 1e-15;
        let factor = (step.covariance + tiny).cholesky().unwrap().l();
        let draws = Vector4::from_fn(|_, _| normal(&mut self.rng));
        self.truth = step.state + factor * draws;
        self.filter.predict(STEP_S, SLOW_SHARE, Situation::FREE);
    }

    fn measure(&mut self) {
        let error_m = SLOW_SD_M * self.truth[3] + WHITE_SD_M * normal(&mut self.rng);
        let position_m = self.truth[0] + error_m;
        let measurement =
            AxisMeasurement { position_m, white_sd_m: WHITE_SD_M, slow_sd_m: SLOW_SD_M, time_offset_s: 0.0 };
        self.filter.measure_position(&measurement);
    }

    /// Returns the NEES of position and speed.
    fn nees(&self) -> f64 {
        let now = self.filter.estimate();
        let (dp, dv) = (self.truth[0] - now.position_m, self.truth[1] - now.speed_mps);
        let (pp, pv, vv) = (now.position_variance_m2, now.position_speed_covariance_m2ps, now.speed_variance_m2ps2);
        (vv * dp * dp - 2.0 * pv * dp * dv + pp * dv * dv) / (pp * vv - pv * pv)
    }
}

fn mean_nees(modes: &'static [Mode], runs: u32) -> f64 {
    let sum: f64 = (0..runs)
        .map(|run| {
            let mut vehicle = SimulatedVehicle::new(modes, run.into());
            vehicle.measure();
            for _ in 0..100 {
                vehicle.advance();
                vehicle.measure();
            }
            vehicle.nees()
        })
        .sum();
    sum / f64::from(runs)
}

#[test]
fn a_single_mode_is_consistent_despite_the_slow_error() {
    let runs = 1_000;
    // The mean of n χ² variables of 2 degrees of freedom has the standard deviation 2/√n.
    let deviation = (mean_nees(ALONG_WHITE_MODE, runs) - 2.0) / (2.0 / f64::from(runs).sqrt());
    assert!(deviation.abs() < 3.0, "{deviation} standard deviations from 2");
}

#[test]
fn switching_modes_are_nearly_consistent() {
    // Mixing the modes is an approximation, and a mixture has heavier tails than a normal
    // distribution.
    for modes in [ALONG_MODES, ACROSS_MODES] {
        let mean = mean_nees(modes, 600);
        assert!((1.6..2.6).contains(&mean), "{mean}");
    }
}

#[test]
fn transition_probabilities_sum_to_1_for_any_step() {
    for rates_per_s in [[0.0, 7.7, 0.5], [0.0; MODES]] {
        for step_s in [0.0, 0.04, 1.0, 100.0] {
            let shares = transition_probabilities(&rates_per_s, 0, staying_probability(&rates_per_s, 0, step_s));
            assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{shares:?}");
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{shares:?}");
        }
    }
}

#[test]
fn predicting_over_a_horizon_equals_predicting_step_by_step() {
    for modes in [ALONG_MODES, ACROSS_MODES] {
        let filter = AxisFilter::prior(modes, Gaussian::new(0.0, 0.1), Gaussian::new(0.0, 0.1));
        let mut stepped = filter;
        for _ in 0..10 {
            stepped.predict(STEP_S, 1.0, Situation::FREE);
        }
        let (predicted, stepped) = (filter.predicted(10.0 * STEP_S), stepped.estimate());
        assert!(
            (predicted.speed_variance_m2ps2 / stepped.speed_variance_m2ps2 - 1.0).abs() < 1e-9,
            "{predicted:?} {stepped:?}"
        );
        assert!(
            (predicted.position_variance_m2 / stepped.position_variance_m2 - 1.0).abs() < 1e-9,
            "{predicted:?} {stepped:?}"
        );
    }
    let prior = AxisFilter::prior(ALONG_MODES, Gaussian::new(0.0, 0.1), Gaussian::new(0.0, 0.1));
    assert_eq!(prior.predicted(0.0), prior.estimate());
}

#[test]
fn a_measurement_that_is_not_a_number_leaves_the_mode_probabilities_unchanged() {
    let mut filter = AxisFilter::prior(ALONG_MODES, Gaussian::new(0.0, 1.0), Gaussian::new(0.0, 1.0));
    let before = filter.estimates.map(|estimate| estimate.probability);
    filter.measure_position(&AxisMeasurement {
        position_m: f64::NAN,
        white_sd_m: 1.0,
        slow_sd_m: 0.0,
        time_offset_s: 0.0,
    });
    assert_eq!(filter.estimates.map(|estimate| estimate.probability), before);
    // The estimate must not look valid afterwards.
    assert!(filter.estimate().position_m.is_nan());
}

#[test]
fn the_mean_of_position_and_speed_is_the_mean_of_the_whole_mixture() {
    let mut vehicle = SimulatedVehicle::new(ALONG_MODES, 3);
    vehicle.measure();
    for _ in 0..50 {
        vehicle.advance();
        vehicle.measure();
    }
    let estimates = &vehicle.filter.estimates;
    let whole = mixture(estimates, &estimates.map(|estimate| estimate.probability));
    let estimate = vehicle.filter.estimate();
    assert_eq!([estimate.position_m, estimate.speed_mps], [whole.state[0], whole.state[1]]);
    let covariance =
        [estimate.position_variance_m2, estimate.position_speed_covariance_m2ps, estimate.speed_variance_m2ps2];
    assert_eq!(covariance, COVARIANCES.map(|at| whole.covariance[at]));
}

#[test]
fn the_prediction_equals_the_full_products_of_the_matrices() {
    let mut state = ModeEstimate {
        state: Vector4::new(-50.0, 3.0, -0.7, 0.3),
        covariance: Matrix4::from_fn(|row, column| 1.0 / (1.0 + (row + column) as f64)),
        probability: 1.0,
    };
    let before = state;
    let mode = &ACROSS_MODES[0];
    let remaining = Remaining::after(mode, 0, STEP_S);
    state.predict(mode, STEP_S, &remaining, SLOW_SHARE);
    let (t, half) = (STEP_S, 0.5 * STEP_S * STEP_S);
    #[rustfmt::skip]
    let step = Matrix4::new(
        1.0, t, half, 0.0,
        0.0, remaining.speed, t, 0.0,
        0.0, 0.0, remaining.persistence, 0.0,
        0.0, 0.0, 0.0, SLOW_SHARE,
    );
    assert_eq!(state.state, step * before.state);
    let full = step * before.covariance * step.transpose();
    assert_eq!(state.covariance[(0, 2)], full[(0, 2)]);
    assert_eq!(state.covariance[(2, 1)], full[(2, 1)]);
    assert_eq!(state.covariance[(3, 1)], full[(3, 1)]);
}

#[test]
fn a_negative_horizon_moves_the_position_back_at_constant_speed() {
    for modes in [ALONG_MODES, ALONG_WHITE_MODE] {
        let mut vehicle = SimulatedVehicle::new(modes, 3);
        for _ in 0..50 {
            vehicle.measure();
            vehicle.advance();
        }
        let (latest, before) = (vehicle.filter.estimate(), vehicle.filter.predicted(-0.2));
        assert_eq!(before.position_m, latest.position_m - 0.2 * latest.speed_mps);
        assert_ne!(latest.speed_mps, 0.0);
        assert_eq!(AxisEstimate { position_m: latest.position_m, ..before }, latest);
    }
}
