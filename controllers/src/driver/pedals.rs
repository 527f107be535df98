//! The rate at which a human driver applies the brake.
//!
//! ```text
//!  acceleration ▲
//!             0 │‾‾‾‾│  accelerator released
//!               │    ╲  12.65 m/s³
//!               │      ╲______  requested
//!               └──────────────▶ time
//! ```
//!
//! A driver releases the accelerator at once. From the resulting deceleration, braking builds up at
//! a limited rate: UN Regulation 157 (annex 4, appendix 3) lets its competent human driver reach
//! 0.774 g within 0.6 s. The value was read in open implementations (ec-jrc/JRC-FSM, esmini), not
//! in the regulation. Range for an ensemble: 5 to 25 m/s³. In crashes and near-crashes the rate
//! grows with urgency, in the median 3.4·g/τ for a time to collision τ: 17 m/s³ at 2 s (Markkula et
//! al., Accident Analysis and Prevention 95 (2016) 209–226, parameters in the authors' code).
//! Drivers often take more than a second to reach emergency deceleration (Ising et al., Proceedings
//! of the Human Factors and Ergonomics Society 56 (2012)).
//!
//! The reaction time ends when the braking begins. The release of either pedal is not limited: no
//! source was found.

use closecall_traffic::{ConfigError, Num, Parameters, Problem, Range, Time};

use super::COASTING_DECELERATION_MPS2;

/// Largest rate at which a driver builds up braking if the scenario gives none (m/s³) (UN
/// Regulation 157).
pub(crate) const DEFAULT_BRAKE_BUILD_UP_MPS3: f64 = 12.65;

/// Range of the rate at which a driver builds up braking (m/s³).
const BRAKE_BUILD_UP_RANGE: Range = Range::closed(1.0, 100.0);

/// Checks the rate at which a driver builds up braking (m/s³). A driver without a reaction time
/// (`perceives` is false) is not limited, and has none.
pub(crate) fn check_brake_build_up(
    rate: Option<&Num>,
    perceives: bool,
    parameters: &Parameters,
) -> Result<f64, ConfigError> {
    match rate {
        None => Ok(DEFAULT_BRAKE_BUILD_UP_MPS3),
        Some(_) if !perceives => {
            let rule = "without a reaction time the driver brakes as its model asks, at once".to_owned();
            Err(ConfigError::new("brake-build-up-mps3", Problem::Contradiction { other: "reaction-s", rule }))
        }
        Some(num) => parameters.number(num, "brake-build-up-mps3", BRAKE_BUILD_UP_RANGE),
    }
}

/// The pedals of one driver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pedals {
    /// Largest rate at which braking builds up (m/s³).
    build_up_mps3: f64,
    /// Time and acceleration (m/s²) of the last step.
    last: Option<(Time, f64)>,
}

impl Pedals {
    /// Creates the pedals of a driver who builds up braking at `build_up_mps3` (m/s³) at most.
    pub(crate) fn new(build_up_mps3: f64) -> Self {
        Self { build_up_mps3, last: None }
    }

    /// Returns `requested_mps2`, or the strongest braking that the driver can have built up by
    /// `now` (m/s²).
    pub(crate) fn apply_mps2(&mut self, requested_mps2: f64, now: Time) -> f64 {
        let (time, last_mps2) = self.last.unwrap_or((now, 0.0));
        let strongest_mps2 = last_mps2.min(-COASTING_DECELERATION_MPS2) - self.build_up_mps3 * (now - time).s();
        // Written so that NaN stays NaN; the driver refuses it.
        let applied_mps2 = if requested_mps2 < strongest_mps2 { strongest_mps2 } else { requested_mps2 };
        self.last = Some((now, applied_mps2));
        applied_mps2
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::PHYSICS_STEP;

    use super::*;

    #[test]
    fn braking_builds_up_within_six_tenths_of_a_second_and_is_released_at_once() {
        let mut pedals = Pedals::new(DEFAULT_BRAKE_BUILD_UP_MPS3);
        let (mut time, mut applied_mps2) = (Time::ZERO, pedals.apply_mps2(1.0, Time::ZERO));
        assert_eq!(applied_mps2, 1.0);
        let begin = time;
        while applied_mps2 > -0.774 * 9.81 {
            time += PHYSICS_STEP;
            applied_mps2 = pedals.apply_mps2(-0.774 * 9.81, time);
        }
        // From 0.7 to 7.6 m/s² at 12.65 m/s³.
        assert!(((time - begin).s() - 0.545).abs() < 0.011, "{time}");
        assert_eq!(pedals.apply_mps2(-1.0, time + PHYSICS_STEP), -1.0);
        assert!(pedals.apply_mps2(f64::NAN, time + PHYSICS_STEP).is_nan());
    }

    #[test]
    fn a_slower_build_up_brakes_less_at_the_same_time() {
        let after_half_a_second_mps2 = |build_up_mps3| {
            let mut pedals = Pedals::new(build_up_mps3);
            (0..=50).map(|step| pedals.apply_mps2(-9.0, Time::from_ms(10 * step))).fold(0.0, f64::min)
        };
        assert!((after_half_a_second_mps2(5.0) + 0.7 + 5.0 * 0.5).abs() < 1e-9);
        assert_eq!(after_half_a_second_mps2(25.0), -9.0);
    }
}
