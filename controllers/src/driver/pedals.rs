//! How fast a human driver applies the brake.
//!
//! ```text
//!  acceleration ▲
//!             0 │‾‾‾‾│  accelerator released
//!               │    ╲  12.65 m/s³
//!               │      ╲______  requested
//!               └──────────────▶ time
//! ```
//!
//! A driver releases the accelerator at once. From the deceleration that this gives, braking builds up at a limited rate: UN Regulation 157 (annex 4, appendix 3) lets its competent human driver reach
//! 0.774 g within 0.6 s. The value was read in open implementations (ec-jrc/JRC-FSM, esmini), not in the regulation.
//! Range for an ensemble: 5 to 25 m/s³. In crashes and near-crashes the rate grows with urgency, in the median 3.4·g/τ
//! for a time to collision τ: 17 m/s³ at 2 s (Markkula et al., Accident Analysis and Prevention 95 (2016) 209–226,
//! parameters in the authors' code). Drivers often take more than a second to reach emergency deceleration (Ising et al.,
//! Proceedings of the Human Factors and Ergonomics Society 56 (2012)).
//!
//! The reaction time ends when the braking begins. The release of either pedal is not limited: no source was found.

use closecall_traffic::Time;

use super::COASTING_DECELERATION_MPS2;

/// Largest rate at which a driver builds up braking (m/s³) (UN Regulation 157).
const BRAKE_BUILD_UP_MPS3: f64 = 12.65;

/// The pedals of one driver.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pedals {
    /// Time and acceleration (m/s²) of the last step.
    last: Option<(Time, f64)>,
}

impl Pedals {
    /// Returns `requested_mps2`, or the strongest braking that the driver can have built up by `now` (m/s²).
    pub(crate) fn apply_mps2(&mut self, requested_mps2: f64, now: Time) -> f64 {
        let (time, last_mps2) = self.last.unwrap_or((now, 0.0));
        let strongest_mps2 = last_mps2.min(-COASTING_DECELERATION_MPS2) - BRAKE_BUILD_UP_MPS3 * (now - time).s();
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
        let mut pedals = Pedals::default();
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
}
