//! Whether the striking vehicle avoids the collision if it brakes in another way.

use closecall_controllers::reference::{BrakingReaction, CRITICAL_TTC_S};
use closecall_traffic::geometry::BoxSide;
use closecall_traffic::{Vehicle, VehicleState};

/// Time for which the motion is continued beyond the collision (s). Full braking from any speed on
/// a motorway ends earlier.
const BEYOND_S: f64 = 15.0;

/// Largest braking of a cruise control above 20 m/s (m/s²) (ISO 15622). If more is needed, the
/// careful driver in the loop sees a risk.
const CRUISE_CONTROL_MPS2: f64 = 3.5;

/// How the striking vehicle brakes instead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Braking {
    /// As the competent and careful driver of UN Regulation 157, once it perceives a risk.
    Careful,
    /// With the full friction of the road (m/s²), once the hazard can be perceived.
    FullFromHazard(f64),
    /// With the full friction of the road (m/s²), from the start of the run.
    FullFromStart(f64),
}

/// The two vehicles of a collision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair<'a> {
    /// The states of all vehicles at each step up to the collision.
    pub(super) states: &'a [Vec<VehicleState>],
    /// Step of the simulation (s).
    pub(super) step_s: f64,
    /// Index of the striking and of the struck vehicle in the list of actors.
    pub(super) indices: [usize; 2],
    /// The vehicles.
    pub(super) vehicles: [Vehicle; 2],
    /// The sides that were struck.
    pub(super) sides: [BoxSide; 2],
}

impl Pair<'_> {
    /// Returns whether the vehicles stay apart if the striking vehicle brakes in another way;
    /// `None` if undecided. Braking along the lane decides only about a front that strikes a rear.
    pub(super) fn is_avoided(&self, braking: Braking) -> Option<bool> {
        if self.sides != [BoxSide::Front, BoxSide::Rear] {
            return None;
        }
        let first = self.states.first()?;
        let [striking, struck] = self.indices;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "15 s in steps of 10 ms")]
        let steps = self.states.len() + (BEYOND_S / self.step_s) as usize;
        let hazard = self.hazard_step();
        let mut striking_state = first[striking];
        let mut last_of_other = first[struck];
        let (mut reaction, mut differs) = (None::<BrakingReaction>, false);
        for step in 0..steps {
            let recorded = self.states.get(step);
            if recorded.is_none() && !differs {
                // The vehicle drives unchanged up to the contact, and the contact follows.
                return Some(false);
            }
            let other = recorded.map_or_else(|| continued(&last_of_other, self.step_s), |states| states[struck]);
            last_of_other = other;
            if let (false, Some(states)) = (differs, recorded) {
                striking_state = states[striking];
            }
            if step > 0 && self.touch(&striking_state, &other) {
                return Some(false);
            }
            let wanted_mps2 = match braking {
                Braking::Careful => self.careful_mps2(&striking_state, &other, &mut reaction),
                Braking::FullFromHazard(mps2) => hazard.is_some_and(|hazard| step >= hazard).then_some(mps2),
                Braking::FullFromStart(mps2) => Some(mps2),
            };
            if let Some(mps2) = wanted_mps2 {
                differs = true;
                striking_state = self.braked(&striking_state, mps2);
            }
            if differs && striking_state.speed_mps == 0.0 {
                return Some(true);
            }
        }
        Some(differs)
    }

    /// Returns the braking of the careful driver (m/s²); `None` before its first risk. While it is
    /// no faster than the vehicle ahead, it keeps its speed.
    fn careful_mps2(
        &self,
        striking: &VehicleState,
        other: &VehicleState,
        reaction: &mut Option<BrakingReaction>,
    ) -> Option<f64> {
        let closing_mps = striking.speed_mps - other.speed_mps;
        if reaction.is_none() && self.is_in_path(striking, other) && self.is_risk(striking, other) {
            *reaction = Some(BrakingReaction::default());
        }
        reaction.as_mut().map(|reaction| if closing_mps > 0.0 { reaction.advance(self.step_s) } else { 0.0 })
    }

    /// Returns whether the careful driver sees a risk. As in the loop, this driver sees one at a
    /// time to collision of 2 s, or if more braking is needed than a cruise control may use.
    fn is_risk(&self, striking: &VehicleState, other: &VehicleState) -> bool {
        let (gap_m, closing_mps) = (self.gap_m(striking, other), striking.speed_mps - other.speed_mps);
        // Both vehicles brake to a standstill, or the speed falls to the speed of a vehicle that
        // does not brake.
        let braking_mps2 = -other.acceleration_mps2;
        let needed_mps2 = if braking_mps2 > 0.0 {
            striking.speed_mps.powi(2) / (2.0 * (gap_m + other.speed_mps.powi(2) / (2.0 * braking_mps2)))
        } else {
            closing_mps.max(0.0).powi(2) / (2.0 * gap_m)
        };
        gap_m <= CRITICAL_TTC_S * closing_mps || !(needed_mps2 <= CRUISE_CONTROL_MPS2)
    }

    /// Returns the first step at which the struck vehicle can be seen to brake, or at which the
    /// time to collision falls to the 2 s of the careful driver, whichever comes first.
    fn hazard_step(&self) -> Option<usize> {
        let [striking, struck] = self.indices;
        self.states.iter().position(|states| {
            let (striking_state, other) = (&states[striking], &states[struck]);
            let closing_mps = striking_state.speed_mps - other.speed_mps;
            other.brake_light
                || (self.is_in_path(striking_state, other)
                    && self.gap_m(striking_state, other) <= CRITICAL_TTC_S * closing_mps)
        })
    }

    /// Returns the vehicle one step later, if it brakes with `braking_mps2` along its recorded
    /// path.
    fn braked(&self, striking: &VehicleState, braking_mps2: f64) -> VehicleState {
        let speed_mps = (striking.speed_mps - braking_mps2 * self.step_s).max(0.0);
        let s_m = striking.s_m + 0.5 * (striking.speed_mps + speed_mps) * self.step_s;
        VehicleState { s_m, d_m: self.lateral_m(s_m), speed_mps, acceleration_mps2: -braking_mps2, ..*striking }
    }

    /// Returns the lateral position of the striking vehicle at `s_m` of its path.
    fn lateral_m(&self, s_m: f64) -> f64 {
        let [striking, _] = self.indices;
        let states = self.states;
        let next = states.partition_point(|states| states[striking].s_m < s_m);
        states.get(next).or(states.last()).map_or(0.0, |states| states[striking].d_m)
    }

    /// Returns the gap along the road (m); negative while the vehicles overlap lengthwise or the
    /// other one is behind.
    fn gap_m(&self, striking: &VehicleState, other: &VehicleState) -> f64 {
        other.s_m - striking.s_m - 0.5 * self.vehicles.map(|vehicle| vehicle.dimensions.length_m).iter().sum::<f64>()
    }

    fn overlaps_sideways(&self, striking: &VehicleState, other: &VehicleState) -> bool {
        let half_m = 0.5 * self.vehicles.map(|vehicle| vehicle.dimensions.width_m).iter().sum::<f64>();
        (striking.d_m - other.d_m).abs() < half_m
    }

    /// Returns whether the other vehicle is ahead in the path of the striking one.
    fn is_in_path(&self, striking: &VehicleState, other: &VehicleState) -> bool {
        other.s_m > striking.s_m && self.overlaps_sideways(striking, other)
    }

    fn touch(&self, striking: &VehicleState, other: &VehicleState) -> bool {
        let lengths_m: f64 = self.vehicles.map(|vehicle| vehicle.dimensions.length_m).iter().sum();
        self.overlaps_sideways(striking, other) && (striking.s_m - other.s_m).abs() < 0.5 * lengths_m
    }
}

/// Returns a vehicle one step later. If its acceleration is braking, the vehicle continues it to a
/// standstill.
fn continued(state: &VehicleState, step_s: f64) -> VehicleState {
    let speed_mps = (state.speed_mps + state.acceleration_mps2.min(0.0) * step_s).max(0.0);
    let s_m = state.s_m + 0.5 * (state.speed_mps + speed_mps) * step_s;
    VehicleState { s_m, speed_mps, ..*state }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Time, VehicleClass};

    use super::super::Trace;
    use super::*;

    const STEP_S: f64 = 0.01;

    /// A vehicle at 30 m/s follows another at 30 m/s with `gap_m`. The vehicle ahead brakes with 6
    /// m/s² from 1 s on, and the follower does not. The trace ends at the contact.
    fn trace(gap_m: f64) -> Trace {
        let mut trace = Trace::default();
        let at = |s_m: f64, speed_mps: f64, acceleration_mps2: f64| VehicleState {
            s_m,
            speed_mps,
            acceleration_mps2,
            brake_light: acceleration_mps2 < 0.0,
            ..VehicleState::default()
        };
        let length_m = Vehicle::typical(VehicleClass::Car).dimensions.length_m;
        let (mut striking, mut other) = (at(0.0, 30.0, 0.0), at(gap_m + length_m, 30.0, 0.0));
        let mut step = 0;
        while other.s_m - striking.s_m >= length_m && step < 2_000 {
            trace.times.push(Time::from_ms(10 * step));
            trace.states.push(vec![striking, other]);
            let braking = if step >= 100 { 6.0 } else { 0.0 };
            let speed_mps = (other.speed_mps - braking * STEP_S).max(0.0);
            other = at(other.s_m + 0.5 * (speed_mps + other.speed_mps) * STEP_S, speed_mps, -braking);
            striking = at(striking.s_m + 30.0 * STEP_S, 30.0, 0.0);
            step += 1;
        }
        trace
    }

    fn avoided(gap_m: f64, braking: Braking) -> bool {
        decided(&trace(gap_m), [BoxSide::Front, BoxSide::Rear], braking).unwrap()
    }

    fn decided(trace: &Trace, sides: [BoxSide; 2], braking: Braking) -> Option<bool> {
        let vehicles = [Vehicle::typical(VehicleClass::Car); 2];
        Pair { states: &trace.states, step_s: STEP_S, indices: [0, 1], vehicles, sides }.is_avoided(braking)
    }

    #[test]
    fn a_driver_who_does_nothing_else_avoids_nothing() {
        // Of two vehicles side by side, the second drifts into the path of the first in the last
        // step. No brake light, no risk.
        let at = |s_m: f64, d_m: f64| VehicleState { s_m, d_m, speed_mps: 30.0, ..VehicleState::default() };
        let mut trace = Trace::default();
        for step in 0..100_u32 {
            trace.times.push(Time::from_ms(10 * i64::from(step)));
            let s_m = 0.3 * f64::from(step);
            trace.states.push(vec![at(s_m, 0.0), at(s_m + 3.0, 2.5)]);
        }
        let rear_end = [BoxSide::Front, BoxSide::Rear];
        assert_eq!(decided(&trace, rear_end, Braking::Careful), Some(false));
        assert_eq!(decided(&trace, rear_end, Braking::FullFromHazard(8.0)), Some(false));
        assert_eq!(decided(&trace, rear_end, Braking::FullFromStart(8.0)), Some(true));
    }

    #[test]
    fn a_side_contact_is_not_decided() {
        let trace = trace(20.0);
        for sides in [[BoxSide::Front, BoxSide::Left], [BoxSide::Right, BoxSide::Rear], [BoxSide::Rear, BoxSide::Front]]
        {
            for braking in [Braking::Careful, Braking::FullFromHazard(8.0), Braking::FullFromStart(8.0)] {
                assert_eq!(decided(&trace, sides, braking), None, "{sides:?} {braking:?}");
            }
        }
    }

    #[test]
    fn full_braking_at_once_keeps_any_gap_behind_a_vehicle_that_brakes_less() {
        assert!(avoided(0.5, Braking::FullFromHazard(8.0)));
        assert!(!avoided(2.0, Braking::FullFromHazard(5.0)), "75 m behind a vehicle that needs 75 m, braking less");
        assert!(avoided(20.0, Braking::FullFromHazard(5.0)), "90 m are enough, 75 + 20 m are there");
        assert!(avoided(0.5, Braking::FullFromStart(8.0)));
    }

    #[test]
    fn a_careful_driver_needs_a_gap_that_its_delay_uses_up() {
        // A risk at once. 0.75 s of delay, and 7.59 m/s² reached in 0.6 s: 31 m before the driver
        // brakes fully, and 56 m afterwards, of the gap and the 75 m of the vehicle ahead.
        assert!(!avoided(5.0, Braking::Careful));
        assert!(avoided(60.0, Braking::Careful));
        let least = (1..100).map(f64::from).find(|gap_m| avoided(*gap_m, Braking::Careful)).unwrap();
        assert!((10.0..40.0).contains(&least), "{least}");
    }
}
