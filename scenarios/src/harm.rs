//! The severity of collisions: the risk that a driver dies, as a function of the change of velocity
//! ΔV.
//!
//! A count of collisions rates a bump at 1 m/s like a crash at 20 m/s. The *harm* of a run
//! therefore weights each vehicle by its driver's risk of death, (ΔV/71 mph)⁴. This rule of thumb
//! is from H. C. Joksch, *Velocity change and fatality risk in a crash: a rule of thumb*, Accident
//! Analysis and Prevention 25 (1993) 103–104, after crashes of 1980 to 1986 in the United States.
//!
//! Cars have become safer since, and the rule does not cover motorcyclists. The harm *compares*
//! arms on the same samples; it does not predict deaths.

use std::collections::BTreeMap;

use crate::outcome::{Outcome, worse};
use closecall_traffic::ActorId;

/// The definition of the harm and its source, for reports.
pub const WEIGHT: &str = "driver deaths expected, (delta-v / 31.74 m/s)^4 for each vehicle (Joksch 1993)";

/// One mile per hour in metres per second.
const MPS_PER_MPH: f64 = 0.447_04;
/// Change of velocity at which the rule of thumb reaches a risk of 1 (m/s).
const CERTAIN_DEATH_MPS: f64 = 71.0 * MPS_PER_MPH;

/// Returns the risk that a change of velocity (m/s) kills the driver. Returns 1 for NaN, which must
/// never look harmless.
fn death_risk(delta_v_mps: f64) -> f64 {
    let share = delta_v_mps / CERTAIN_DEATH_MPS;
    if share < 1.0 { share.max(0.0).powi(4) } else { 1.0 }
}

/// Returns the harm of a run: the sum of the risks of all vehicles that collided, each at its
/// largest change of velocity.
///
/// The ego and the other vehicles count alike. A system that protects the ego at the expense of
/// others gains nothing.
pub fn harm(outcome: &Outcome) -> f64 {
    let mut worst_mps: BTreeMap<&ActorId, f64> = BTreeMap::new();
    for collision in &outcome.collisions {
        for (actor, &delta_v_mps) in collision.between.iter().zip(&collision.delta_v_mps) {
            let worst = worst_mps.entry(actor).or_insert(0.0);
            *worst = worse(*worst, delta_v_mps);
        }
    }
    // The sum of an empty iterator is -0, which reports would show.
    worst_mps.values().fold(0.0, |sum, &delta_v_mps| sum + death_risk(delta_v_mps))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_risk_follows_the_rule_of_thumb() {
        assert_eq!(death_risk(0.0), 0.0);
        // 60 mph: (60/71)⁴, about one half.
        assert!((death_risk(60.0 * MPS_PER_MPH) - 0.51).abs() < 0.005);
        assert_eq!(death_risk(40.0), 1.0);
        assert_eq!(death_risk(f64::NAN), 1.0, "an unknown change of velocity is not harmless");
    }

    #[test]
    fn the_risk_grows_with_the_change_of_velocity() {
        let risks: Vec<f64> = (0..40).map(|mps| death_risk(f64::from(mps))).collect();
        assert!(risks.is_sorted());
    }
}
