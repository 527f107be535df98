//! The test case of the reference models: a slower vehicle cuts in.
//!
//! ```text
//!        ┌───┐
//!        │ o │ ──▶ moves 3.5 m sideways at a constant speed
//!        └───┘
//!  ┌───┐
//!  │   │ ──▶      gap       at the start
//!  └───┘
//! ```
//!
//! Geometry, step and duration come from JRC-FSM (`utility/comparison_cut_in.py`,
//! `utility/movement.py`), to reproduce its published outcomes. Positions advance with the speed at
//! the end of each step.

use super::{Assessment, Conflict, ReferenceModel};

/// Step (s) (JRC-FSM).
const STEP_S: f64 = 0.1;
/// Number of steps after the start-up, in which the other vehicle reaches its lateral speed
/// (JRC-FSM).
const STEPS: usize = 350;
/// Length of both vehicles (m) (JRC-FSM).
const LENGTH_M: f64 = 4.3;
/// Width of both vehicles (m) (JRC-FSM).
const WIDTH_M: f64 = 1.9;
/// Lateral distance of the vehicles' centres at the end of the start-up (m) (JRC-FSM).
const LATERAL_DISTANCE_M: f64 = 1.6 + WIDTH_M;
/// Lateral acceleration of the other vehicle during the start-up (m/s²) (JRC-FSM).
const LATERAL_ACCELERATION_MPS2: f64 = 1.5;

/// A vehicle that cuts in ahead of a faster one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutIn {
    /// Speed of the faster vehicle at the start (m/s).
    pub speed_mps: f64,
    /// Speed of the vehicle that cuts in (m/s).
    pub other_speed_mps: f64,
    /// Bumper-to-bumper gap when the vehicle that cuts in reaches its lateral speed (m).
    pub gap_m: f64,
    /// Lateral speed of the vehicle that cuts in (m/s).
    pub lateral_mps: f64,
}

impl CutIn {
    /// Returns true if the vehicles touch with `model` as the driver of the faster one.
    pub fn ends_in_collision(&self, model: &mut impl ReferenceModel) -> bool {
        let start_up_steps = (self.lateral_mps / (LATERAL_ACCELERATION_MPS2 * STEP_S)).ceil() as usize;
        let start_up_mps = |step: usize| LATERAL_ACCELERATION_MPS2 * STEP_S * step as f64;
        let lateral_steps = lateral_steps(self.lateral_mps);
        // The lateral speed at a step: rising, then constant, then zero.
        let lateral_mps = |step: usize| match step.checked_sub(start_up_steps) {
            None => start_up_mps(step),
            Some(later) if later <= lateral_steps => self.lateral_mps,
            Some(_) => 0.0,
        };
        let mut lateral_m =
            LATERAL_DISTANCE_M + (0..start_up_steps).map(|step| start_up_mps(step) * STEP_S).sum::<f64>();
        let mut distance_m =
            self.gap_m + LENGTH_M + start_up_steps as f64 * (self.speed_mps - self.other_speed_mps) * STEP_S;
        let (mut speed_mps, mut last_mps, mut has_reacted) = (self.speed_mps, self.speed_mps, false);
        for step in 0..STEPS + start_up_steps {
            let conflict = Conflict {
                gap_m: distance_m - LENGTH_M,
                lateral_gap_m: lateral_m.abs() - WIDTH_M,
                half_lengths_m: LENGTH_M,
                lateral_closing_mps: lateral_mps(step),
                speed_mps,
                other_speed_mps: self.other_speed_mps,
                acceleration_mps2: (speed_mps - last_mps) / STEP_S,
            };
            let assessment = model.assess(&conflict, STEP_S);
            if lateral_m.abs() < WIDTH_M && distance_m.abs() < LENGTH_M {
                return true;
            }
            last_mps = speed_mps;
            match assessment {
                Assessment::Harmless => return false,
                Assessment::Risk(braking_mps2) => {
                    speed_mps = (speed_mps - braking_mps2 * STEP_S).max(0.0);
                    has_reacted = true;
                }
                Assessment::Clear if has_reacted => {}
                Assessment::Clear => speed_mps = self.speed_mps,
            }
            distance_m += (self.other_speed_mps - speed_mps) * STEP_S;
            // After the start-up, the position advances with the lateral speed at the end of the
            // step.
            let speed_step = if step < start_up_steps { step } else { step + 1 };
            lateral_m -= lateral_mps(speed_step) * STEP_S;
        }
        false
    }
}

/// Returns the number of steps at the full lateral speed: the vehicle that cuts in stops its
/// lateral motion in the middle of the lane. Without a lateral speed there is no such end.
fn lateral_steps(lateral_mps: f64) -> usize {
    if lateral_mps > 0.0 { (LATERAL_DISTANCE_M / STEP_S / lateral_mps).floor() as usize + 1 } else { STEPS }
}

#[cfg(test)]
mod tests {
    use super::super::{CarefulDriver, FuzzySafetyModel};
    use super::*;

    fn collides(cut_in: CutIn) -> [bool; 2] {
        [
            cut_in.ends_in_collision(&mut CarefulDriver::default()),
            cut_in.ends_in_collision(&mut FuzzySafetyModel::default()),
        ]
    }

    #[test]
    fn near_and_fast_cut_ins_end_in_collisions_and_far_ones_do_not() {
        let near = CutIn { speed_mps: 60.0 / 3.6, other_speed_mps: 10.0 / 3.6, gap_m: 25.0, lateral_mps: 0.8 };
        assert_eq!(collides(near), [true, true]);
        assert_eq!(collides(CutIn { gap_m: 59.0, ..near }), [false, false]);
        assert_eq!(collides(CutIn { lateral_mps: 0.0, ..near }), [false, false], "the other vehicle stays in its lane");
        assert_eq!(collides(CutIn { gap_m: 5.0, ..near }), [false, false], "passed before it is there");
        // The fuzzy model sees the vehicle come while the careful driver still waits for it to
        // overlap.
        assert_eq!(collides(CutIn { lateral_mps: 1.5, ..near }), [true, false]);
    }
}
