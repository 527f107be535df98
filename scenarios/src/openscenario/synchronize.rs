//! A vehicle that arrives at a place when another arrives at its own: `SynchronizeAction`.
//!
//! ```text
//!  motion of the master, played ahead ─▶ time of its arrival ─┐
//!  way of the vehicle to its target ──────────────────────────┴─▶ speeds of constant acceleration
//! ```
//!
//! For the way d, the time T and the speed v₀ at the beginning, the speed at the end is
//! v₁ = 2 d / T − v₀. If the action states v₁, the vehicle has two constant accelerations, which
//! change after half the time at the speed 2 d / T − (v₀ + v₁) / 2. A steady state is a part at the
//! end with the speed v₁. The standard leaves the course of the speed to the player.
//!
//! The master's arrival is the one of the actions that have begun. If it does not arrive then, the
//! action is refused: the vehicle would have to look at the master on its way, and a prescribed
//! driver does not.

use super::dom::{ImportError, Node};
use super::storyboard::{LONGEST_S, MOST_SPEED_MPS, STEP_S, Storyboard};

/// Accelerations that a prescribed driver commands (m/s²): `MAX_BRAKING_MPS2` and
/// `MAX_ACCELERATION_MPS2` of its module.
pub(super) const ACCELERATION_MPS2: [f64; 2] = [-9.0, 5.0];
/// Largest distance between a master and its target at the time of its arrival, beside the
/// tolerance of the action (m): an assumption; 0.01 to 1 are plausible.
const MOST_APART_M: f64 = 0.1;
/// Difference of two times or speeds that are the same but for rounding: numerical.
const SAME: f64 = 1e-9;

/// The arrival of the other vehicle, which is checked when its time comes.
#[derive(Clone, Debug)]
pub(super) struct Meeting {
    master: usize,
    /// Time of both arrivals (s).
    at_s: f64,
    /// Target of the master along the road (m).
    target_m: f64,
    tolerance_m: f64,
    line: usize,
}

/// The end of the way of a vehicle.
#[derive(Clone, Copy, Debug)]
struct FinalSpeed {
    speed_mps: f64,
    /// Time at the end during which the vehicle has this speed (s).
    steady_s: f64,
}

/// The way of a vehicle to its target.
#[derive(Clone, Copy, Debug)]
struct Approach {
    way_m: f64,
    duration_s: f64,
    from_mps: f64,
    end: Option<FinalSpeed>,
}

impl Approach {
    /// Returns the speeds at times from now, linear in between.
    ///
    /// # Errors
    /// The message, if no prescribed driver accelerates like this, or no vehicle has these speeds.
    fn speeds(&self) -> Result<Vec<(f64, f64)>, String> {
        let points = self.course()?;
        let [hardest_mps2, largest_mps2] = ACCELERATION_MPS2;
        for pair in points.windows(2) {
            let acceleration_mps2 = (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0);
            if !(hardest_mps2 - SAME..=largest_mps2 + SAME).contains(&acceleration_mps2) {
                return Err(format!(
                    "{}, an acceleration of {acceleration_mps2:.2} m/s² is needed; {hardest_mps2} to {largest_mps2} m/s² \
                     are possible",
                    self.arrival()
                ));
            }
        }
        Ok(points)
    }

    /// Returns what the vehicle has to do, for a message.
    fn arrival(&self) -> String {
        let Self { way_m, duration_s, from_mps, .. } = self;
        format!("to come {way_m:.2} m in {duration_s:.2} s from {from_mps:.2} m/s")
    }

    /// Returns the speeds at times from now, linear in between, whatever accelerations they need.
    ///
    /// # Errors
    /// The message, if no vehicle of a scenario has these speeds.
    fn course(&self) -> Result<Vec<(f64, f64)>, String> {
        let Self { way_m, duration_s, from_mps, end } = *self;
        let points = match end {
            None => vec![(0.0, from_mps), (duration_s, 2.0 * way_m / duration_s - from_mps)],
            Some(FinalSpeed { speed_mps, steady_s }) => {
                let changing_s = duration_s - steady_s;
                if !(changing_s > 0.0) {
                    return Err(format!(
                        "its steady state of {steady_s:.2} s must be shorter than the {duration_s:.2} s to come"
                    ));
                }
                let middle_mps = 2.0 * (way_m - steady_s * speed_mps) / changing_s - 0.5 * (from_mps + speed_mps);
                let mut points = vec![(0.0, from_mps), (0.5 * changing_s, middle_mps), (changing_s, speed_mps)];
                if steady_s > 0.0 {
                    points.push((duration_s, speed_mps));
                }
                points
            }
        };
        for (_, speed_mps) in &points {
            if !(-SAME..=MOST_SPEED_MPS).contains(speed_mps) {
                return Err(format!(
                    "{}, a speed of {speed_mps:.2} m/s is needed; 0 to {MOST_SPEED_MPS} m/s are possible",
                    self.arrival()
                ));
            }
        }
        Ok(points.into_iter().map(|(at_s, mps)| (at_s, mps.max(0.0))).collect())
    }
}

impl Storyboard<'_> {
    /// Returns the speeds at times by which a vehicle arrives together with another, and notes
    /// them.
    ///
    /// # Errors
    /// [`ImportError`] if a vehicle of a scenario cannot arrive in time, or if the arrival of the
    /// master is not known.
    pub(super) fn synchronize(&mut self, node: &Node, actor: usize) -> Result<(Vec<(f64, f64)>, Meeting), ImportError> {
        let master = self.index(node, "masterEntityRef")?;
        if master == actor {
            return Err(self.reader.error(node, "`masterEntityRef` is the vehicle itself"));
        }
        let master_target_m = self.target_m(node, "TargetPositionMaster")?;
        let target_m = self.target_m(node, "TargetPosition")?;
        let way_m = target_m - self.vehicles[actor].s_m;
        if !(way_m > 0.0) {
            let target = self.reader.child(node, &["TargetPosition"])?;
            let message = format!("it lies {:.2} m behind `{}`", -way_m, self.vehicles[actor].name);
            return Err(self.reader.error(target, message));
        }
        let (duration_s, master_mps) = self.arrival(node, master, master_target_m)?;
        let end = match node.child("FinalSpeed") {
            Some(end) => Some(self.final_speed(end, master_mps)?),
            None => None,
        };
        let from_mps = self.vehicles[actor].speed_mps;
        // On a bend, the way beside the reference line has its own length.
        let vehicle = &self.vehicles[actor];
        let scale = |s_m: f64| {
            let centre_m = self.road.index(vehicle.lane).map(|index| self.road.file_centre_m(index, s_m));
            self.road.path_scale(s_m, centre_m.unwrap_or_default() + vehicle.offset_m)
        };
        let way_m = 0.5 * (scale(vehicle.s_m) + scale(target_m)) * way_m;
        let approach = Approach { way_m, duration_s, from_mps, end };
        // The controller drives the ego, whatever its action asks for.
        let speeds = if actor == self.ego { approach.course() } else { approach.speeds() };
        let speeds = speeds.map_err(|message| self.reader.error(node, message))?;
        let speeds: Vec<_> = speeds.into_iter().map(|(after_s, mps)| (self.time_s + after_s, mps)).collect();
        let at_s = self.time_s + duration_s;
        let last_mps = speeds.last().map_or(from_mps, |(_, mps)| *mps);
        self.notes.push(format!(
            "line {}: `{}` arrives at its target at {at_s:.2} s with {last_mps:.2} m/s, when `{}` arrives at its own if it \
             moves as in the file",
            node.line, self.vehicles[actor].name, self.vehicles[master].name
        ));
        let tolerance_m = self.reader.number_or(node, "targetToleranceMaster", 0.0)?;
        Ok((speeds, Meeting { master, at_s, target_m: master_target_m, tolerance_m, line: node.line }))
    }

    /// Checks that a master arrives at its target when it is expected there, if that is before the
    /// next step.
    ///
    /// # Errors
    /// [`ImportError`] if it is elsewhere.
    pub(super) fn check_meeting(&self, meeting: &Meeting) -> Result<(), ImportError> {
        let rest_s = meeting.at_s - self.time_s;
        if rest_s >= STEP_S + SAME {
            return Ok(());
        }
        let master = &self.vehicles[meeting.master];
        let apart_m = meeting.target_m - (master.s_m + master.speed_mps * rest_s);
        if apart_m.abs() <= MOST_APART_M + meeting.tolerance_m {
            return Ok(());
        }
        Err(ImportError {
            path: self.reader.path.clone(),
            line: meeting.line,
            element: "SynchronizeAction".to_owned(),
            message: format!(
                "`{}` changes its speed on the way: at {:.2} s it is {:.2} m {} its target, and a vehicle of a scenario \
                 does not adapt to it",
                master.name,
                meeting.at_s,
                apart_m.abs(),
                if apart_m > 0.0 { "before" } else { "behind" }
            ),
        })
    }

    /// Returns the place of a target along the road (m).
    fn target_m(&self, node: &Node, name: &str) -> Result<f64, ImportError> {
        let position = self.reader.only(self.reader.child(node, &[name])?)?;
        let point = self.on_road(position, None)?;
        let lane = self.road.lane_near(point.s_m, point.t_m);
        let beside_m = lane.map_or(f64::INFINITY, |lane| (point.t_m - self.road.file_centre_m(lane, point.s_m)).abs());
        if !lane.is_some_and(|lane| beside_m <= self.road.half_width_m(lane, point.s_m)) {
            return Err(self.reader.error(position, format!("it lies {beside_m:.2} m beside the nearest lane")));
        }
        Ok(point.s_m)
    }

    /// Returns the time until a vehicle arrives at a place by the actions that have begun (s), and
    /// its speed there (m/s).
    fn arrival(&self, node: &Node, vehicle: usize, target_m: f64) -> Result<(f64, f64), ImportError> {
        let name = &self.vehicles[vehicle].name;
        if !(self.vehicles[vehicle].s_m < target_m) {
            let target = self.reader.child(node, &["TargetPositionMaster"])?;
            return Err(self.reader.error(target, format!("`{name}` is not before it")));
        }
        let mut ahead = self.clone();
        loop {
            let (s_m, speed_mps) = (ahead.vehicles[vehicle].s_m, ahead.vehicles[vehicle].speed_mps);
            let rest_m = target_m - s_m;
            if speed_mps > 0.0 && rest_m <= speed_mps * STEP_S {
                return Ok((ahead.time_s - self.time_s + rest_m / speed_mps, speed_mps));
            }
            if ahead.time_s >= LONGEST_S {
                let message = format!("`{name}` does not arrive at its target within {LONGEST_S} s");
                return Err(self.reader.error(node, message));
            }
            ahead.advance();
        }
    }

    fn final_speed(&self, node: &Node, master_mps: f64) -> Result<FinalSpeed, ImportError> {
        let reader = &self.reader;
        let speed = reader.only(node)?;
        let value = reader.number(speed, "value")?;
        let speed_mps = match speed.name.as_str() {
            "AbsoluteSpeed" => value,
            "RelativeSpeedToMaster" => match reader.text(speed, "speedTargetValueType")?.as_str() {
                "factor" => master_mps * value,
                _ => master_mps + value,
            },
            _ => return Err(reader.error(speed, "this speed is not read")),
        };
        if !(0.0..=MOST_SPEED_MPS).contains(&speed_mps) {
            let message = format!("a speed of {speed_mps} m/s; 0 to {MOST_SPEED_MPS} m/s are needed");
            return Err(reader.error(speed, message));
        }
        let steady_s = match &speed.children[..] {
            [] => 0.0,
            [steady] if steady.name == "TargetTimeSteadyState" => reader.number(steady, "time")?,
            [steady] if steady.name == "TargetDistanceSteadyState" => {
                let distance_m = reader.number(steady, "distance")?;
                if !(speed_mps > 0.0) {
                    return Err(reader.error(steady, "a vehicle that stands at the end drives no distance there"));
                }
                distance_m / speed_mps
            }
            _ => return Err(reader.error(speed, "it can have one steady state")),
        };
        Ok(FinalSpeed { speed_mps, steady_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn driven_m(speeds: &[(f64, f64)]) -> f64 {
        speeds.windows(2).map(|pair| 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0)).sum()
    }

    #[test]
    fn a_vehicle_comes_to_its_target_in_time_with_its_final_speed() {
        let approach = Approach { way_m: 100.0, duration_s: 4.0, from_mps: 20.0, end: None };
        assert_eq!(approach.speeds().unwrap(), [(0.0, 20.0), (4.0, 30.0)]);
        for (speed_mps, steady_s) in [(20.0, 0.0), (30.0, 0.0), (28.0, 1.0)] {
            let end = Some(FinalSpeed { speed_mps, steady_s });
            let speeds = Approach { end, ..approach }.speeds().unwrap();
            assert!((driven_m(&speeds) - 100.0).abs() < 1e-9, "{speeds:?}");
            assert_eq!(*speeds.last().unwrap(), (4.0, speed_mps));
            assert_eq!(speeds[0], (0.0, 20.0));
            let steady = speeds.iter().find(|(at_s, _)| (at_s - (4.0 - steady_s)).abs() < 1e-9);
            assert_eq!(steady.map(|point| point.1), Some(speed_mps));
        }
    }

    #[test]
    fn an_arrival_that_no_vehicle_can_have_is_refused_with_the_reason() {
        let approach = |way_m: f64, duration_s: f64, end: Option<FinalSpeed>| {
            Approach { way_m, duration_s, from_mps: 20.0, end }.speeds().unwrap_err()
        };
        assert!(approach(20.0, 4.0, None).contains("a speed of -10.00 m/s is needed"));
        assert!(approach(1_000.0, 10.0, None).contains("a speed of 180.00 m/s is needed"));
        assert!(approach(100.0, 2.0, None).contains("an acceleration of 30.00 m/s² is needed; -9 to 5 m/s²"));
        let hard = Approach { way_m: 100.0, duration_s: 2.0, from_mps: 20.0, end: None };
        assert_eq!(hard.course().unwrap(), [(0.0, 20.0), (2.0, 80.0)], "for a vehicle that is not driven by it");
        let steady = Some(FinalSpeed { speed_mps: 20.0, steady_s: 4.0 });
        assert!(approach(80.0, 4.0, steady).contains("shorter than the 4.00 s"));
        let stands = Some(FinalSpeed { speed_mps: 0.0, steady_s: 0.0 });
        assert!(approach(20.0, 10.0, stands).contains("a speed of -6.00 m/s is needed"));
    }
}
