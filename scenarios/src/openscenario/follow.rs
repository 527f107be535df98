//! A vehicle that keeps a gap to another: `LongitudinalDistanceAction` during a run.
//!
//! `tool export` writes this action for a human driver who follows. The import turns the action
//! into such a driver: Wiedemann 99, whose equilibrium gap cc0 + cc1·v + cc2/2 equals the gap of
//! the action at the speed v of the vehicle ahead. While the import plays the storyboard, the
//! follower approaches its gap within the limits of the action. Only triggers that look at the
//! follower depend on this motion.

use super::dom::{ImportError, Node};
use super::reader::is_true;
use super::storyboard::{STEP_S, Storyboard};
use super::world::Vehicle;

/// Gap at standstill, cc0 (m), as in a scenario file by default.
const CC0_M: f64 = 1.5;
/// Distance by which the gap may exceed the safe gap, cc2 (m), as in a scenario file by default.
const CC2_M: f64 = 4.0;
/// Largest cc1, the time headway in addition to cc0 (s), that a scenario file allows.
const MOST_CC1_S: f64 = 10.0;
/// Time in which a follower closes the difference between its gap and the gap of the action (s): an
/// assumption; 1 to 5 are plausible.
const CLOSING_S: f64 = 2.0;

/// A vehicle that follows another by an action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Following {
    /// Index of the follower.
    pub(super) vehicle: usize,
    /// Index of the vehicle ahead.
    lead: usize,
    /// Line of the action, counted from 1.
    pub(super) line: usize,
    /// Constant part of the gap between the bumpers (m).
    gap_m: f64,
    /// Part of the gap that grows with the speed of the follower (s).
    gap_s: f64,
    max_acceleration_mps2: f64,
    max_deceleration_mps2: f64,
    max_speed_mps: f64,
    /// Time headway of the driver, cc1 (s).
    cc1_s: f64,
}

impl Following {
    /// Returns the speed of the follower after a step (m/s).
    pub(super) fn next_speed_mps(&self, vehicles: &[Vehicle]) -> f64 {
        let (follower, lead) = (&vehicles[self.vehicle], &vehicles[self.lead]);
        let gap_m = lead.back_m() - follower.front_m();
        let wanted_m = self.gap_m + self.gap_s * follower.speed_mps;
        let change_mps = lead.speed_mps + (gap_m - wanted_m) / CLOSING_S - follower.speed_mps;
        let limits_mps = [-self.max_deceleration_mps2, self.max_acceleration_mps2].map(|limit| limit * STEP_S);
        let speed_mps = follower.speed_mps + change_mps.max(limits_mps[0]).min(limits_mps[1]);
        speed_mps.min(self.max_speed_mps).max(0.0)
    }

    /// Returns the driver as a table of TOML. `desired_mps` is its desired speed.
    pub(super) fn driver(&self, desired_mps: f64) -> String {
        let Self { cc1_s, .. } = self;
        format!(
            "{{ wiedemann99 = {{ cc0-m = {CC0_M:?}, cc1-s = {cc1_s:?}, cc2-m = {CC2_M:?}, \
             desired-speed-mps = {desired_mps:?} }} }}"
        )
    }
}

impl Storyboard<'_> {
    /// Returns how a vehicle follows another by an action.
    ///
    /// # Errors
    /// [`ImportError`] if no driver follows in this way.
    fn following(&self, node: &Node, vehicle: usize) -> Result<Following, ImportError> {
        let refuse = |message: String| Err(self.reader.error(node, message));
        let lead = self.index(node, "entityRef")?;
        if !is_true(node, "continuous") {
            return refuse("during a run, `continuous` must be `true`: a driver that follows keeps its gap".to_owned());
        }
        let [follower, ahead] = [vehicle, lead].map(|index| &self.vehicles[index]);
        if node.raw("displacement") == Some("leadingReferencedEntity") || !(ahead.back_m() > follower.front_m()) {
            let names = format!("`{}` is not behind `{}`", follower.name, ahead.name);
            return refuse(format!("{names}: a driver follows a vehicle ahead"));
        }
        // A distance between the reference points contains parts of both vehicles.
        let inside_m = match is_true(node, "freespace") {
            true => 0.0,
            false => (follower.front_m() - follower.s_m) + (ahead.s_m - ahead.back_m()),
        };
        let (gap_m, gap_s) = match (node.raw("distance"), node.raw("timeGap")) {
            (Some(_), None) => (self.reader.number(node, "distance")? - inside_m, 0.0),
            (None, Some(_)) => (-inside_m, self.reader.number(node, "timeGap")?),
            _ => return refuse("it needs either `distance` or `timeGap`".to_owned()),
        };
        let kept_m = gap_m + gap_s * ahead.speed_mps;
        let cc1_s = (kept_m - CC0_M - 0.5 * CC2_M) / ahead.speed_mps;
        if !(0.0..=MOST_CC1_S).contains(&cc1_s) {
            let least_m = CC0_M + 0.5 * CC2_M;
            return refuse(format!(
                "a gap of {kept_m:.2} m at {:.2} m/s: a driver that follows keeps {least_m} m and a time headway of 0 to \
                 {MOST_CC1_S} s",
                ahead.speed_mps
            ));
        }
        let limits = node.child("DynamicConstraints");
        let limit = |name: &str| match limits {
            Some(limits) => self.reader.number_or(limits, name, f64::INFINITY),
            None => Ok(f64::INFINITY),
        };
        Ok(Following {
            vehicle,
            lead,
            line: node.line,
            gap_m,
            gap_s,
            max_acceleration_mps2: limit("maxAcceleration")?,
            max_deceleration_mps2: limit("maxDeceleration")?,
            max_speed_mps: limit("maxSpeed")?,
            cc1_s,
        })
    }

    /// Makes a vehicle follow another, and adds a note about the driver that the import makes of
    /// it.
    pub(super) fn follow(&mut self, node: &Node, vehicle: usize) -> Result<Following, ImportError> {
        let following = self.following(node, vehicle)?;
        if vehicle != self.ego {
            self.notes.push(format!(
                "line {}: `{}` follows `{}`: from the start, a driver of Wiedemann 99 with this gap follows the vehicle \
                 ahead",
                node.line, self.vehicles[vehicle].name, self.vehicles[following.lead].name
            ));
        }
        self.following.push(following);
        Ok(following)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_follower_comes_to_its_gap_and_keeps_it() {
        let vehicle = |s_m: f64, speed_mps: f64| Vehicle { s_m, speed_mps, length_m: 4.0, ..Vehicle::default() };
        let mut vehicles = [vehicle(0.0, 35.0), vehicle(100.0, 30.0)];
        let following = Following {
            vehicle: 0,
            lead: 1,
            line: 1,
            gap_m: 30.0,
            gap_s: 0.0,
            max_acceleration_mps2: 2.0,
            max_deceleration_mps2: 3.0,
            max_speed_mps: 36.0,
            cc1_s: 0.9,
        };
        for _ in 0..6_000 {
            let before_mps = vehicles[0].speed_mps;
            vehicles.iter_mut().for_each(|vehicle| vehicle.s_m += vehicle.speed_mps * STEP_S);
            vehicles[0].speed_mps = following.next_speed_mps(&vehicles);
            let acceleration_mps2 = (vehicles[0].speed_mps - before_mps) / STEP_S;
            assert!((-3.0 - 1e-9..=2.0 + 1e-9).contains(&acceleration_mps2), "{acceleration_mps2}");
            assert!(vehicles[0].speed_mps <= 36.0);
        }
        assert!((vehicles[1].back_m() - vehicles[0].front_m() - 30.0).abs() < 0.1);
        assert!((vehicles[0].speed_mps - 30.0).abs() < 0.01);
    }
}
