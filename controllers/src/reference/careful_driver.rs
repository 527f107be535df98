//! The competent and careful human driver.
//!
//! ```text
//!  risk ─▶ 0.75 s at 0.4 m/s² (accelerator released) ─▶ braking builds up at 12.65 m/s³ ─▶ 0.774 g
//! ```

use super::{Assessment, BUILD_UP_MPS3, Conflict, DELAY_S, HARDEST_BRAKING_MPS2, ReferenceModel};

/// Deceleration during the delay (m/s²) (JRC-FSM).
const RELEASED_ACCELERATOR_MPS2: f64 = 0.4;
/// Time to collision up to which there is a risk (s) (JRC-FSM).
pub const CRITICAL_TTC_S: f64 = 2.0;

/// The reaction of the driver to a risk: first the accelerator is released, then the brake is
/// applied.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BrakingReaction {
    /// Time for which the risk has been perceived (s).
    perceived_s: f64,
    /// Present deceleration (m/s²); 0 without a risk.
    braking_mps2: f64,
}

impl BrakingReaction {
    /// Reacts to a risk for `step_s` more, and returns the deceleration (m/s²).
    pub fn advance(&mut self, step_s: f64) -> f64 {
        self.braking_mps2 = if self.perceived_s < DELAY_S {
            RELEASED_ACCELERATOR_MPS2
        } else {
            (self.braking_mps2 + BUILD_UP_MPS3 * step_s).min(HARDEST_BRAKING_MPS2)
        };
        self.perceived_s += step_s;
        self.braking_mps2
    }
}

/// The competent and careful human driver of the regulation.
///
/// The driver judges a vehicle that cuts in when the two overlap sideways for the first time: at a
/// time to collision above 2 s there is no risk.
#[derive(Clone, Debug, Default)]
pub struct CarefulDriver {
    reaction: BrakingReaction,
    is_over: bool,
}

impl ReferenceModel for CarefulDriver {
    fn assess(&mut self, conflict: &Conflict, step_s: f64) -> Assessment {
        if self.is_over {
            return Assessment::Harmless;
        }
        if conflict.is_behind() || conflict.lateral_gap_m > 0.0 {
            return Assessment::Clear;
        }
        // A driver who has become slower than the other vehicle is as far from a collision as one
        // who closes in as fast.
        if conflict.gap_m.abs() > CRITICAL_TTC_S * conflict.closing_mps().abs() {
            self.is_over = true;
            return Assessment::Harmless;
        }
        Assessment::Risk(self.reaction.advance(step_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Control step (s).
    const STEP_S: f64 = 0.04;

    #[test]
    fn braking_begins_after_the_delay_and_builds_up_within_its_jerk() {
        let mut reaction = BrakingReaction::default();
        let braking: Vec<f64> = (0..50).map(|_| reaction.advance(STEP_S)).collect();
        let at = |time_s: f64| braking[(time_s / STEP_S) as usize];
        assert_eq!((at(0.0), at(0.7)), (0.4, 0.4));
        assert!(at(0.85) > 0.4 && at(0.85) < 3.0, "{}", at(0.85));
        assert!(braking.windows(2).all(|pair| pair[1] - pair[0] <= BUILD_UP_MPS3 * STEP_S + 1e-12));
        // 0.774 g is reached 0.6 s after the delay.
        assert!(at(1.2) < HARDEST_BRAKING_MPS2 && at(1.44) >= HARDEST_BRAKING_MPS2, "{braking:?}");
    }

    #[test]
    fn a_vehicle_that_cuts_in_far_ahead_is_harmless_for_good() {
        let near = Conflict {
            gap_m: 10.0,
            lateral_gap_m: 0.1,
            half_lengths_m: 4.3,
            lateral_closing_mps: 1.0,
            speed_mps: 20.0,
            other_speed_mps: 10.0,
            acceleration_mps2: 0.0,
        };
        let mut driver = CarefulDriver::default();
        assert_eq!(driver.assess(&near, STEP_S), Assessment::Clear, "beside the own lane");
        let overlapping = Conflict { lateral_gap_m: -0.1, ..near };
        assert_eq!(driver.assess(&overlapping, STEP_S), Assessment::Risk(0.4));
        assert_eq!(driver.assess(&Conflict { gap_m: -9.0, ..overlapping }, STEP_S), Assessment::Clear, "behind");
        assert_eq!(driver.assess(&Conflict { gap_m: 21.0, ..overlapping }, STEP_S), Assessment::Harmless);
        assert_eq!(driver.assess(&overlapping, STEP_S), Assessment::Harmless, "judged once");
    }
}
