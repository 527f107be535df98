//! The models as functions of a list of parameters, and their simulation behind a recorded leader.

use closecall_controllers::{Idm, IdmConfig, Lead, Wiedemann99, Wiedemann99Config, Wiedemann99Model};
use closecall_recorded::following::FollowingPair;
use closecall_traffic::{Check, Num, Parameters};

/// A car-following model that can be calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FollowingModel {
    /// The Wiedemann 99 model.
    Wiedemann99,
    /// The Intelligent Driver Model.
    Idm,
}

/// One parameter of a model, with the range in which it is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSpec {
    /// The key, as in a scenario file.
    pub key: &'static str,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// True if the parameter says how closely or how fast the driver follows in the recorded
    /// traffic. A scenario sets such a parameter, and a member of an ensemble does not.
    pub is_of_traffic: bool,
}

const fn spec(key: &'static str, min: f64, max: f64) -> ParameterSpec {
    ParameterSpec { key, min, max, is_of_traffic: false }
}

const fn traffic_parameter(key: &'static str, min: f64, max: f64) -> ParameterSpec {
    ParameterSpec { key, min, max, is_of_traffic: true }
}

/// Parameters of the Intelligent Driver Model. The ranges are limits of the search.
const IDM: [ParameterSpec; 5] = [
    traffic_parameter("desired-speed-mps", 8.0, 45.0),
    traffic_parameter("time-gap-s", 0.1, 4.0),
    traffic_parameter("standstill-gap-m", 0.1, 10.0),
    spec("acceleration-mps2", 0.1, 6.0),
    spec("comfortable-braking-mps2", 0.1, 6.0),
];

/// Parameters of the Wiedemann 99 model. The ranges are limits of the search, after the open tool
/// PvcTools.
const WIEDEMANN_99: [ParameterSpec; 11] = [
    traffic_parameter("desired-speed-mps", 8.0, 45.0),
    traffic_parameter("cc0-m", 0.5, 10.0),
    traffic_parameter("cc1-s", 0.1, 3.0),
    spec("cc2-m", 0.0, 15.0),
    spec("cc3-s", -30.0, 0.0),
    spec("cc4-mps", -2.0, 0.0),
    spec("cc5-mps", 0.0, 2.0),
    spec("cc6", 0.0, 20.0),
    spec("cc7-mps2", 0.0, 1.25),
    spec("cc8-mps2", 0.5, 6.0),
    spec("cc9-mps2", 0.2, 6.0),
];

/// A model with its parameters, for one simulation.
enum Follower {
    Wiedemann99(Box<Wiedemann99Model>),
    Idm(Idm),
}

impl FollowingModel {
    /// Returns the name of the model's table in a scenario file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wiedemann99 => "wiedemann99",
            Self::Idm => "idm",
        }
    }

    /// Returns the parameters that are calibrated.
    pub const fn parameters(self) -> &'static [ParameterSpec] {
        match self {
            Self::Wiedemann99 => &WIEDEMANN_99,
            Self::Idm => &IDM,
        }
    }

    /// Returns the values at a point of the unit cube: each value in its range.
    pub(super) fn values(self, point: &[f64]) -> Vec<f64> {
        let value = |(spec, u): (&ParameterSpec, &f64)| spec.min + u.clamp(0.0, 1.0) * (spec.max - spec.min);
        self.parameters().iter().zip(point).map(value).collect()
    }

    /// Returns the model with these values, or `None` if the check of a scenario would refuse one.
    fn follower(self, values: &[f64]) -> Option<Follower> {
        let none = Parameters::default();
        match self {
            Self::Idm => {
                let config = IdmConfig {
                    time_gap_s: self.value(values, "time-gap-s"),
                    standstill_gap_m: self.value(values, "standstill-gap-m"),
                    acceleration_mps2: self.value(values, "acceleration-mps2"),
                    comfortable_braking_mps2: self.value(values, "comfortable-braking-mps2"),
                    ..IdmConfig::default()
                };
                config.check(&none).ok().map(Follower::Idm)
            }
            Self::Wiedemann99 => {
                let checked: Option<Wiedemann99> = wiedemann99_config(values).check(&none).ok();
                checked.map(|settings| Follower::Wiedemann99(Box::new(Wiedemann99Model::new(&settings))))
            }
        }
    }

    /// Returns the value of a parameter, or `None` if the model does not have it.
    fn value(self, values: &[f64], key: &str) -> Option<Num> {
        let index = self.parameters().iter().position(|spec| spec.key == key)?;
        values.get(index).map(|value| Num::Fixed(*value))
    }
}

/// Returns the Wiedemann 99 driver with these values of its parameters.
pub(super) fn wiedemann99_config(values: &[f64]) -> Wiedemann99Config {
    let value = |key: &str| FollowingModel::Wiedemann99.value(values, key);
    Wiedemann99Config {
        cc0_m: value("cc0-m"),
        cc1_s: value("cc1-s"),
        cc2_m: value("cc2-m"),
        cc3_s: value("cc3-s"),
        cc4_mps: value("cc4-mps"),
        cc5_mps: value("cc5-mps"),
        cc6: value("cc6"),
        cc7_mps2: value("cc7-mps2"),
        cc8_mps2: value("cc8-mps2"),
        cc9_mps2: value("cc9-mps2"),
        desired_speed_mps: value("desired-speed-mps"),
        ..Wiedemann99Config::default()
    }
}

impl Follower {
    fn acceleration_mps2(&mut self, speed_mps: f64, desired_mps: f64, lead: &Lead) -> f64 {
        match self {
            Self::Wiedemann99(model) => model.acceleration_mps2(speed_mps, desired_mps, Some(lead)),
            Self::Idm(model) => model.acceleration_mps2(speed_mps, desired_mps, Some(lead)),
        }
    }
}

/// The follower at one instant of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Simulated {
    /// Gap to the recorded leader (m).
    pub(super) gap_m: f64,
    /// Speed (m/s).
    pub(super) speed_mps: f64,
}

/// Simulates the follower of a pair with these values of the model's parameters, and passes each
/// instant to `observe` together with its index. The speed changes linearly within a step; the
/// follower does not roll backwards.
pub(super) fn simulate(
    model: FollowingModel,
    values: &[f64],
    pair: &FollowingPair,
    mut observe: impl FnMut(usize, Simulated),
) -> bool {
    let (Some(mut follower), Some(first)) = (model.follower(values), pair.instants.first()) else { return false };
    let desired_mps = values.first().copied().unwrap_or_default();
    let (mut front_m, mut speed_mps) = (first.follower_front_m, first.follower_mps.max(0.0));
    for (index, instant) in pair.instants.iter().enumerate() {
        let gap_m = instant.leader_rear_m - front_m;
        observe(index, Simulated { gap_m, speed_mps });
        let lead = Lead { gap_m, speed_mps: instant.leader_mps, acceleration_mps2: instant.leader_mps2 };
        let next_mps = (speed_mps + follower.acceleration_mps2(speed_mps, desired_mps, &lead) * pair.step_s).max(0.0);
        front_m += 0.5 * (speed_mps + next_mps) * pair.step_s;
        speed_mps = next_mps;
    }
    true
}

/// Returns the sum of the squared errors of the gap (m²) and the number of instants.
pub(super) fn squared_error(model: FollowingModel, values: &[f64], pair: &FollowingPair) -> (f64, usize) {
    let mut sum = 0.0;
    let is_valid = simulate(model, values, pair, |index, simulated| {
        let error_m = simulated.gap_m - pair.instants[index].gap_m();
        sum += error_m * error_m;
    });
    (if is_valid { sum } else { f64::INFINITY }, pair.instants.len())
}
