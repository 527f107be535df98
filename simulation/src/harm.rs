//! How grave collisions are: the risk that a driver dies, by the change of velocity ΔV.
//!
//! Counting collisions alone would take a bump at 1 m/s for as much as a crash at 20. Each vehicle is weighted with the
//! rule of thumb of H. C. Joksch, *Velocity change and fatality risk in a crash: a rule of thumb*, Accident Analysis and
//! Prevention 25 (1993) 103–104: the risk that its driver is killed is (ΔV/71 mph)⁴, from crashes of 1980 to 1986 in the
//! United States. Cars have become safer since, and riders of motorcycles are not drivers of cars: the sum *compares* arms
//! on the same samples, it does not predict deaths.

use std::collections::BTreeMap;

use closecall_traffic::ActorId;

use crate::outcome::{Outcome, worse};

/// The weight and its source, for reports.
pub const WEIGHT: &str = "driver deaths expected, (delta-v / 31.74 m/s)^4 for each vehicle (Joksch 1993)";

/// Metres per second in a mile per hour.
const MPS_PER_MPH: f64 = 0.447_04;
/// Change of velocity at which the rule of thumb comes to certain death [m/s].
const CERTAIN_DEATH_MPS: f64 = 71.0 * MPS_PER_MPH;

/// The risk that a driver dies of a change of velocity [m/s]. One that is not a number never looks harmless: 1.
pub fn death_risk(delta_v_mps: f64) -> f64 {
    let share = delta_v_mps / CERTAIN_DEATH_MPS;
    if share < 1.0 { share.max(0.0).powi(4) } else { 1.0 }
}

/// The harm of a run: the risks of all vehicles that were in a collision, each at its largest change of velocity. E's
/// own and those of the others count alike; a system that protects E at the cost of others prevents nothing.
pub fn harm(outcome: &Outcome) -> f64 {
    let mut worst_mps: BTreeMap<&ActorId, f64> = BTreeMap::new();
    for collision in &outcome.collisions {
        for (actor, &delta_v_mps) in collision.between.iter().zip(&collision.delta_v_mps) {
            let known = worst_mps.entry(actor).or_insert(0.0);
            *known = worse(*known, delta_v_mps);
        }
    }
    worst_mps.values().map(|&delta_v_mps| death_risk(delta_v_mps)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_of_thumb() {
        assert_eq!(death_risk(0.0), 0.0);
        // 60 mph: (60/71)⁴, about one half.
        assert!((death_risk(60.0 * MPS_PER_MPH) - 0.51).abs() < 0.005);
        assert_eq!(death_risk(40.0), 1.0);
        assert_eq!(death_risk(f64::NAN), 1.0, "what is not known is not harmless");
    }

    #[test]
    fn it_grows_with_the_change_of_velocity() {
        let risks: Vec<f64> = (0..40).map(|mps| death_risk(f64::from(mps))).collect();
        assert!(risks.is_sorted());
    }
}
