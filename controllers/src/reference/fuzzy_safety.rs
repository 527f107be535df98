//! The fuzzy safety model: braking in proportion to two fuzzy measures of risk.
//!
//! The *proactive* measure PFS asks whether the driver can stop behind a vehicle that brakes hard
//! from now on. The *critical* measure CFS asks whether the driver avoids a collision with a
//! vehicle that keeps its speed. Each is 0 at distances at which gentle braking suffices, 1 where
//! hard braking does not, and linear between (Mattas et al., *Fuzzy surrogate safety metrics for
//! real-time assessment of rear-end collision risk*, Accident Analysis and Prevention 148 (2020)
//! 105794; figures and equations as implemented in JRC-FSM).

use super::{Assessment, BUILD_UP_MPS3, Conflict, DELAY_S, HARDEST_BRAKING_MPS2, ReferenceModel};

/// Deceleration with which gentle braking suffices (m/s²) (JRC-FSM).
const COMFORTABLE_BRAKING_MPS2: f64 = 4.0;
/// Deceleration of hard braking (m/s²) (JRC-FSM).
const HARD_BRAKING_MPS2: f64 = 6.0;
/// Deceleration of the vehicle ahead that the proactive measure expects (m/s²) (JRC-FSM).
const LEAD_BRAKING_MPS2: f64 = 7.0;
/// Distance that is left at standstill (m) (JRC-FSM).
const STANDSTILL_GAP_M: f64 = 2.0;
/// Further distance of the proactive measure (m) (JRC-FSM).
const SAFETY_MARGIN_M: f64 = 2.0;
/// Advance in time that a vehicle on its way into the lane needs to count as no conflict (s)
/// (JRC-FSM).
const CUT_IN_ADVANCE_S: f64 = 0.1;

/// Returns the gap that the model keeps behind a vehicle at the same speed (m).
pub(crate) fn following_gap_m(speed_mps: f64) -> f64 {
    proactive_gap_m(speed_mps, speed_mps, COMFORTABLE_BRAKING_MPS2) + SAFETY_MARGIN_M + STANDSTILL_GAP_M
}

/// Returns the gap at which braking with `braking_mps2` stops the driver behind a vehicle that
/// brakes hard (m).
fn proactive_gap_m(speed_mps: f64, lead_speed_mps: f64, braking_mps2: f64) -> f64 {
    speed_mps * DELAY_S + speed_mps.powi(2) / (2.0 * braking_mps2) - lead_speed_mps.powi(2) / (2.0 * LEAD_BRAKING_MPS2)
}

/// Returns the proactive measure PFS, 0 to 1.
fn proactive_risk(conflict: &Conflict) -> f64 {
    let (speed_mps, other_mps) = (conflict.speed_mps, conflict.other_speed_mps);
    let safe_m = proactive_gap_m(speed_mps, other_mps, COMFORTABLE_BRAKING_MPS2) + SAFETY_MARGIN_M;
    let unsafe_m = proactive_gap_m(speed_mps, other_mps, HARD_BRAKING_MPS2);
    between(conflict.gap_m - STANDSTILL_GAP_M, safe_m, unsafe_m)
}

/// Returns the critical measure CFS, 0 to 1.
fn critical_risk(conflict: &Conflict) -> f64 {
    let closing_mps = conflict.closing_mps();
    if closing_mps <= 0.0 {
        return 0.0;
    }
    let present_mps2 = conflict.acceleration_mps2.max(-COMFORTABLE_BRAKING_MPS2);
    let closing_after_delay_mps = closing_mps + present_mps2 * DELAY_S;
    if closing_after_delay_mps < 0.0 {
        // The present braking alone ends the closing within the delay.
        let needed_m = closing_mps.powi(2) / (2.0 * conflict.acceleration_mps2.abs());
        return f64::from(u8::from(conflict.gap_m < needed_m));
    }
    let during_delay_m = (closing_mps + present_mps2 * DELAY_S / 2.0) * DELAY_S;
    let needed_m = |braking_mps2: f64| during_delay_m + closing_after_delay_mps.powi(2) / (2.0 * braking_mps2);
    between(conflict.gap_m, needed_m(COMFORTABLE_BRAKING_MPS2), needed_m(HARD_BRAKING_MPS2))
}

/// Returns 0 above `safe_m`, 1 below `unsafe_m`, and the linear interpolation between.
fn between(gap_m: f64, safe_m: f64, unsafe_m: f64) -> f64 {
    if gap_m > safe_m {
        0.0
    } else if gap_m < unsafe_m {
        1.0
    } else {
        (gap_m - safe_m) / (unsafe_m - safe_m)
    }
}

/// The fuzzy safety model of the regulation.
#[derive(Clone, Debug)]
pub struct FuzzySafetyModel {
    /// Remaining delay before braking (s).
    delay_s: f64,
    /// Present deceleration (m/s²).
    braking_mps2: f64,
}

impl Default for FuzzySafetyModel {
    fn default() -> Self {
        Self { delay_s: DELAY_S, braking_mps2: 0.0 }
    }
}

impl FuzzySafetyModel {
    /// Returns true if a vehicle that is beside the own lane will be in it before the driver has
    /// passed.
    fn enters(conflict: &Conflict) -> bool {
        let towards_mps = conflict.lateral_closing_mps;
        let passing_s = (conflict.gap_m + 2.0 * conflict.half_lengths_m) / conflict.closing_mps();
        towards_mps > 0.0 && conflict.lateral_gap_m / towards_mps <= passing_s + CUT_IN_ADVANCE_S
    }
}

impl ReferenceModel for FuzzySafetyModel {
    fn assess(&mut self, conflict: &Conflict, step_s: f64) -> Assessment {
        if conflict.is_behind() || (conflict.lateral_gap_m > 0.0 && !Self::enters(conflict)) {
            return Assessment::Clear;
        }
        let (critical, proactive) = (critical_risk(conflict), proactive_risk(conflict));
        if critical + proactive <= 0.0 {
            return Assessment::Clear;
        }
        if self.delay_s > 0.0 {
            self.delay_s -= step_s;
            return Assessment::Risk(0.0);
        }
        let wanted_mps2 = if critical > 0.0 {
            COMFORTABLE_BRAKING_MPS2 + critical * (HARD_BRAKING_MPS2 - COMFORTABLE_BRAKING_MPS2)
        } else {
            proactive * COMFORTABLE_BRAKING_MPS2
        };
        let built_up_mps2 = (self.braking_mps2 + BUILD_UP_MPS3 * step_s).min(HARDEST_BRAKING_MPS2);
        self.braking_mps2 = built_up_mps2.min(wanted_mps2);
        Assessment::Risk(self.braking_mps2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ahead(gap_m: f64, speed_mps: f64, other_speed_mps: f64) -> Conflict {
        Conflict {
            gap_m,
            lateral_gap_m: -1.9,
            half_lengths_m: 4.3,
            lateral_closing_mps: 0.0,
            speed_mps,
            other_speed_mps,
            acceleration_mps2: 0.0,
        }
    }

    #[test]
    fn the_measures_are_zero_at_a_safe_gap_and_one_at_an_unsafe_one() {
        // At 20 m/s: 15 + 400/8 − 400/14 + 2 + 2 m.
        let gap_m = following_gap_m(20.0);
        assert!((gap_m - 40.4286).abs() < 1e-3, "{gap_m}");
        assert_eq!(proactive_risk(&ahead(gap_m + 0.01, 20.0, 20.0)), 0.0);
        assert!(proactive_risk(&ahead(gap_m - 1.0, 20.0, 20.0)) > 0.0);
        // 15 + 400/12 − 400/14 + 2 m.
        assert_eq!(proactive_risk(&ahead(21.7, 20.0, 20.0)), 1.0);
        assert!(proactive_risk(&ahead(21.8, 20.0, 20.0)) < 1.0);
        // Closing in with 10 m/s: 7.5 m in the delay, then 100/8 or 100/12 m.
        assert_eq!(critical_risk(&ahead(20.1, 20.0, 10.0)), 0.0);
        assert!((critical_risk(&ahead(17.916_667, 20.0, 10.0)) - 0.5).abs() < 1e-6);
        assert_eq!(critical_risk(&ahead(15.8, 20.0, 10.0)), 1.0);
        assert_eq!(critical_risk(&ahead(1.0, 10.0, 20.0)), 0.0, "an opening gap");
    }

    #[test]
    fn braking_that_ends_the_closing_within_the_delay_is_enough_or_not() {
        let braking = Conflict { acceleration_mps2: -4.0, ..ahead(0.6, 12.0, 10.0) };
        assert_eq!(critical_risk(&braking), 0.0, "2²/8 = 0.5 m are needed");
        assert_eq!(critical_risk(&Conflict { gap_m: 0.4, ..braking }), 1.0);
    }

    #[test]
    fn a_vehicle_that_enters_the_lane_only_after_it_is_passed_is_no_conflict() {
        let beside = Conflict { lateral_gap_m: 1.0, lateral_closing_mps: 0.1, ..ahead(5.0, 20.0, 10.0) };
        assert!(!FuzzySafetyModel::enters(&beside), "10 s, and passed after 1.4 s");
        assert!(FuzzySafetyModel::enters(&Conflict { lateral_closing_mps: 1.0, ..beside }));
        assert!(!FuzzySafetyModel::enters(&Conflict { lateral_closing_mps: -1.0, ..beside }));
    }
}
