//! Computes the states of the vehicles at the start of a run.

use closecall_controllers::CheckedDriver;
use closecall_traffic::metrics::touching_distance_m;
use closecall_traffic::{
    ActorId, ConfigError, Lane, LateralPath, Num, Parameters, Problem, Range, Road, Vehicle, VehicleState, maths,
};

use super::actor::find_actor;
use super::config::{ActorConfig, RelativeStartConfig, StartConfig};

const SPEED_RANGE_MPS: Range = Range::closed(0.0, 80.0);
const POSITION_RANGE_M: Range = Range::closed(-10_000.0, 100_000.0);
const GAP_RANGE_M: Range = Range::closed(-50.0, 1_000.0);
const THW_RANGE_S: Range = Range::closed(0.0, 60.0);
const ACCELERATION_RANGE_MPS2: Range = Range::closed(-12.0, 12.0);
const CLOSING_RANGE_MPS: Range = Range::closed(-60.0, 60.0);

/// The actors of a scenario, with their checked vehicles and drivers in the same order.
#[derive(Clone, Copy)]
pub(super) struct Actors<'a> {
    pub(super) actors: &'a [ActorConfig],
    pub(super) vehicles: &'a [Vehicle],
    pub(super) drivers: &'a [CheckedDriver],
    pub(super) paths: &'a [Option<LateralPath>],
}

/// Returns the state of every actor at time zero, in the order of the actors.
///
/// # Errors
/// [`ConfigError`] if a value is out of range, if positions depend on each other in a cycle, or if
/// vehicles overlap.
pub(super) fn initial_states(
    Actors { actors, vehicles, drivers, paths }: Actors<'_>,
    road: &Road,
    parameters: &Parameters,
) -> Result<Vec<VehicleState>, ConfigError> {
    let mut placed: Vec<Option<VehicleState>> = vec![None; actors.len()];
    // Each round places the actors whose reference has been placed. A round that places no actor
    // has found a cycle.
    while placed.iter().any(Option::is_none) {
        let before = placed.iter().flatten().count();
        for (index, actor) in actors.iter().enumerate() {
            if placed[index].is_none() {
                let placement = Placement { actors, vehicles, drivers, road, parameters, placed: &placed };
                let state = placement.state(index, actor).map_err(|error| at(index, error))?;
                let on_path = |state| on_path(state, paths[index].as_ref(), road);
                let state = state.map(on_path).transpose();
                placed[index] = state.map_err(|error| error.within_index(index).within("actor"))?;
            }
        }
        if placed.iter().flatten().count() == before {
            return Err(cycle_error(actors, &placed));
        }
    }
    let states: Vec<VehicleState> = placed.into_iter().flatten().collect();
    reject_overlaps(actors, vehicles, road, &states)?;
    Ok(states)
}

/// Returns the state in which an actor starts on its lateral path.
fn on_path(state: VehicleState, path: Option<&LateralPath>, road: &Road) -> Result<VehicleState, ConfigError> {
    let Some(path) = path else { return Ok(state) };
    let [d_m, slope, _] = path.at(0.0);
    let [on_path, at_start] = [d_m, state.d_m].map(|d_m| road.lane_at(state.s_m, d_m));
    if on_path == at_start {
        return Ok(VehicleState { d_m, heading_rad: maths::atan(slope), ..state });
    }
    let rule = format!("the path starts in lane {}, and the actor in lane {}", on_path.0, at_start.0);
    Err(ConfigError::new("path", Problem::Contradiction { other: "start", rule }))
}

fn at(index: usize, error: ConfigError) -> ConfigError {
    error.within("start").within_index(index).within("actor")
}

/// Returns the error that the position of an actor depends on itself.
fn cycle_error(actors: &[ActorConfig], placed: &[Option<VehicleState>]) -> ConfigError {
    let index = placed.iter().position(Option::is_none).unwrap_or_default();
    let rule = format!("the start of `{}` depends on itself", actors[index].id);
    let key = match actors[index].start {
        StartConfig::Ahead(_) => "ahead",
        _ => "behind",
    };
    at(index, ConfigError::new("of", Problem::Contradiction { other: "start", rule }).within(key))
}

/// Returns an error if two vehicles overlap.
fn reject_overlaps(
    actors: &[ActorConfig],
    vehicles: &[Vehicle],
    road: &Road,
    states: &[VehicleState],
) -> Result<(), ConfigError> {
    let shape = |(state, vehicle): (&VehicleState, &Vehicle)| {
        let pose = road.plane_pose(state.s_m, state.d_m, state.heading_rad);
        closecall_traffic::geometry::OrientedBox::new(pose, vehicle.dimensions)
    };
    let shapes: Vec<_> = states.iter().zip(vehicles).map(shape).collect();
    for later in 1..actors.len() {
        for earlier in 0..later {
            if shapes[earlier].overlaps(&shapes[later]) {
                let rule = format!("`{}` and `{}` overlap at the start", actors[earlier].id, actors[later].id);
                let problem = Problem::Contradiction { other: "start", rule };
                return Err(ConfigError::new("start", problem).within_index(later).within("actor"));
            }
        }
    }
    Ok(())
}

/// The data from which the state of an actor is computed. All slices are in the order of the
/// actors.
struct Placement<'a> {
    actors: &'a [ActorConfig],
    vehicles: &'a [Vehicle],
    drivers: &'a [CheckedDriver],
    road: &'a Road,
    parameters: &'a Parameters,
    /// The states that are known so far.
    placed: &'a [Option<VehicleState>],
}

impl Placement<'_> {
    /// Returns the state of one actor, or `None` if its reference has not been placed yet.
    fn state(&self, index: usize, actor: &ActorConfig) -> Result<Option<VehicleState>, ConfigError> {
        match &actor.start {
            StartConfig::Absolute(start) => {
                let number =
                    |num, key, range| self.parameters.number(num, key, range).map_err(|error| error.within("absolute"));
                let s_m = number(&start.s_m, "s-m", POSITION_RANGE_M)?;
                let lane = self.lane(start.lane, s_m).map_err(|error| error.within("absolute"))?;
                let [d_m, ..] = self.road.driving_line(lane, s_m);
                let speed_mps = number(&start.speed_mps, "speed-mps", SPEED_RANGE_MPS)?;
                let acceleration = start.acceleration_mps2.as_ref();
                let acceleration_mps2 =
                    acceleration.map_or(Ok(0.0), |num| number(num, "acceleration-mps2", ACCELERATION_RANGE_MPS2))?;
                Ok(Some(VehicleState { s_m, d_m, speed_mps, acceleration_mps2, ..VehicleState::default() }))
            }
            StartConfig::Ahead(start) => self.relative(index, start, 1.0).map_err(|error| error.within("ahead")),
            StartConfig::Behind(start) => self.relative(index, start, -1.0).map_err(|error| error.within("behind")),
        }
    }

    /// Returns the state of an actor relative to its reference. `direction` is 1 if the actor is
    /// ahead, -1 if it is behind.
    fn relative(
        &self,
        index: usize,
        start: &RelativeStartConfig,
        direction: f64,
    ) -> Result<Option<VehicleState>, ConfigError> {
        let other = self.find(&start.of)?;
        let Some(reference) = self.placed[other] else { return Ok(None) };
        // The gap closes if the vehicle that is behind is faster.
        let speed = Alternative { key: "speed-mps", value: start.speed_mps.as_ref() };
        let closing = Alternative { key: "closing-mps", value: start.closing_mps.as_ref() };
        let speed_mps = match exactly_one(speed, closing, "one of `speed-mps` and `closing-mps`")? {
            Given::First(num) => self.parameters.number(num, speed.key, SPEED_RANGE_MPS)?,
            Given::Second(num) => {
                let closing_mps = self.parameters.number(num, closing.key, CLOSING_RANGE_MPS)?;
                SPEED_RANGE_MPS.check(reference.speed_mps - direction * closing_mps, closing.key)?
            }
        };
        let gap = Alternative { key: "gap-m", value: start.gap_m.as_ref() };
        let thw = Alternative { key: "thw-s", value: start.thw_s.as_ref() };
        let gap_m = if start.settled == Some(true) {
            self.settled_gap_m(index, start, direction, speed_mps)?
        } else {
            match exactly_one(gap, thw, "one of `gap-m`, `thw-s` and `settled`")? {
                Given::First(num) => self.parameters.number(num, gap.key, GAP_RANGE_M)?,
                Given::Second(num) => {
                    let follower_mps = if direction > 0.0 { reference.speed_mps } else { speed_mps };
                    self.parameters.number(num, thw.key, THW_RANGE_S)? * follower_mps
                }
            }
        };
        let [length_m, other_length_m] = [index, other].map(|index| self.vehicles[index].dimensions.length_m);
        let s_m = reference.s_m + direction * (gap_m + touching_distance_m(length_m, other_length_m));
        let line_m = |lane, s_m| self.road.driving_line(lane, s_m)[0];
        let d_m = match start.lane {
            Some(lane) => line_m(self.lane(lane, s_m)?, s_m),
            None if self.road.has_changing_lanes() => {
                let lane = self.lane(self.road.lane_of(&reference), s_m)?;
                reference.d_m + (line_m(lane, s_m) - line_m(lane, reference.s_m))
            }
            None => reference.d_m,
        };
        Ok(Some(VehicleState { s_m, d_m, speed_mps, ..VehicleState::default() }))
    }

    /// Returns the gap at which the driver of an actor behind its reference follows in equilibrium
    /// at `speed_mps` (m).
    fn settled_gap_m(
        &self,
        index: usize,
        start: &RelativeStartConfig,
        direction: f64,
        speed_mps: f64,
    ) -> Result<f64, ConfigError> {
        let refuse = |other: &'static str, rule: &str| {
            ConfigError::new("settled", Problem::Contradiction { other, rule: rule.to_owned() })
        };
        for (other, key_value) in [("gap-m", &start.gap_m), ("thw-s", &start.thw_s)] {
            if key_value.is_some() {
                return Err(refuse(other, "only one of them may be given"));
            }
        }
        if direction > 0.0 {
            return Err(refuse("ahead", "only a vehicle that is behind follows"));
        }
        let gap_m = match &self.drivers[index] {
            CheckedDriver::Human(human) => human.settled_gap_m(speed_mps),
            CheckedDriver::Ego(settings) => settings.human().map(|human| human.settled_gap_m(speed_mps)),
        };
        gap_m.ok_or_else(|| {
            refuse("driver", "only drivers that follow by Wiedemann 99 or the Intelligent Driver Model have such a gap, and an ego with such a `human`")
        })
    }

    fn find(&self, id: &ActorId) -> Result<usize, ConfigError> {
        let ids: Vec<&ActorId> = self.actors.iter().map(|actor| &actor.id).collect();
        find_actor(&ids, id, "of")
    }

    /// Returns a lane that the road has, and in which vehicles have room at `s_m`.
    fn lane(&self, lane: Lane, s_m: f64) -> Result<Lane, ConfigError> {
        if !(1..=self.road.lanes()).contains(&lane.0) {
            return Err(ConfigError::new("lane", Problem::UnknownLane { value: lane.0, lanes: self.road.lanes() }));
        }
        if self.road.is_open(lane, [s_m; 2]) {
            return Ok(lane);
        }
        let [width_m, least_m] = [self.road.lane_width_m(lane, s_m), Road::LANE_WIDTH_M.low()];
        let rule = format!(
            "lane {lane} is {width_m:.2} m wide at {s_m:.1} m, and a vehicle starts in a lane of {least_m} m or more"
        );
        Err(ConfigError::new("lane", Problem::Contradiction { other: "road.cross-sections", rule }))
    }
}

/// One of two keys. Exactly one must be given.
#[derive(Clone, Copy)]
struct Alternative<'a> {
    key: &'static str,
    value: Option<&'a Num>,
}

/// The value of the alternative that is given.
enum Given<'a> {
    First(&'a Num),
    Second(&'a Num),
}

/// Returns the value of the only alternative that is given. `needed` describes the two in the error
/// if none is.
fn exactly_one<'a>(
    first: Alternative<'a>,
    second: Alternative<'a>,
    needed: &'static str,
) -> Result<Given<'a>, ConfigError> {
    match (first.value, second.value) {
        (Some(num), None) => Ok(Given::First(num)),
        (None, Some(num)) => Ok(Given::Second(num)),
        (Some(_), Some(_)) => {
            let rule = "only one of the two may be given".to_owned();
            Err(ConfigError::new(first.key, Problem::Contradiction { other: second.key, rule }))
        }
        (None, None) => Err(ConfigError::new(first.key, Problem::Missing { needed })),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use closecall_traffic::metrics::bumper_gap_m;

    use crate::sampling::Design;
    use crate::{Scenario, ScenarioFile};

    /// A vehicle with this start and driver, and the ego at 30 m/s.
    fn scenario(start: &str, driver: &str) -> Result<Scenario, String> {
        let text = format!(
            "schema-version = 1\nname = 'settled'\nduration-s = 5.0\nroad = {{ lanes = 3 }}\n\
             [[actor]]\nid = 'ego'\nvehicle = {{ class = 'car' }}\n\
             start = {{ absolute = {{ lane = 2, s-m = 500.0, speed-mps = 30.0 }} }}\n\
             driver = {{ ego-stack = {{ acc = {{ time-gap-s = 0.7 }} }} }}\n\
             [[actor]]\nid = 'rear'\nvehicle = {{ class = 'car' }}\nstart = {{ {start} }}\ndriver = {{ {driver} }}\n"
        );
        let file = ScenarioFile::parse(Path::new("settled.toml"), &text, &[]).map_err(|error| error.to_string())?;
        let sample = file.space().sample(Design::Random, 0, 0, 1);
        file.concrete(&sample).map_err(|error| error.to_string())
    }

    fn gap_m(driver: &str) -> f64 {
        let start = "behind = { of = 'ego', settled = true, closing-mps = 0.0 }";
        let actors = scenario(start, driver).unwrap().actors;
        let [ahead_m, behind_m] = [0, 1].map(|actor| actors[actor].vehicle.dimensions.length_m);
        bumper_gap_m(actors[0].start.s_m - actors[1].start.s_m, ahead_m, behind_m)
    }

    /// A vehicle with this start, 30 m/s, on a road whose third lane ends between 600 and 700 m, and the
    /// traffic of this block.
    fn on_ending_lane(start: &str, traffic: &str) -> Result<Scenario, String> {
        let text = format!(
            "schema-version = 1\nname = 'ending'\nduration-s = 5.0\nroad = {{ lanes = 3, cross-sections = [\
             {{ s-m = 600.0, widths-m = [3.5, 3.5, 3.5] }}, {{ s-m = 700.0, widths-m = [3.5, 3.5, 0.0] }}] }}\n\
             [[actor]]\nid = 'ego'\nvehicle = {{ class = 'car' }}\n\
             start = {{ absolute = {{ lane = 3, s-m = 500.0, speed-mps = 30.0 }} }}\n\
             driver = {{ ego-stack = {{ acc = {{ time-gap-s = 0.7 }} }} }}\n\
             [[actor]]\nid = 'front'\nvehicle = {{ class = 'car' }}\nstart = {{ {start} }}\n\
             driver = {{ prescribed = {{ profile = [[0.0, 30.0]] }} }}\n{traffic}"
        );
        let file = ScenarioFile::parse(Path::new("ending.toml"), &text, &[]).map_err(|error| error.to_string())?;
        let sample = file.space().sample(Design::Random, 0, 0, 1);
        file.concrete(&sample).map_err(|error| error.to_string())
    }

    #[test]
    fn a_vehicle_does_not_start_in_a_lane_that_ends_there_however_its_place_is_given() {
        let ahead =
            |gap_m: f64| on_ending_lane(&format!("ahead = {{ of = 'ego', gap-m = {gap_m:?}, speed-mps = 30.0 }}"), "");
        assert!(ahead(50.0).is_ok());
        let error = ahead(160.0).unwrap_err();
        assert!(error.contains("lane 3 is 1.2") && error.contains("a lane of 2.5 m or more"), "{error}");
        let traffic = "[[traffic]]\nid = 't'\ndraw = 0.5\nvehicles = 9\nlanes = [3]\nfrom-m = 30.0\nspeed-mps = 28.0\n\
                       speed-sd-mps = 0.0\nmean-thw-s = 1.0\ndriver = { wiedemann99 = { desired-speed-mps = 28.0 } }\n";
        let error = on_ending_lane("absolute = { lane = 1, s-m = 500.0, speed-mps = 30.0 }", traffic).unwrap_err();
        assert!(error.contains("where lane 3 is") && error.contains("road.cross-sections"), "{error}");
    }

    #[test]
    fn a_settled_vehicle_starts_at_the_gap_that_its_driver_keeps() {
        assert!((gap_m("wiedemann99 = { cc0-m = 1.5, cc1-s = 0.5, cc2-m = 4.0 }") - (1.5 + 15.0 + 2.0)).abs() < 1e-9);
        assert!((gap_m("idm = { standstill-gap-m = 2.5, time-gap-s = 0.6 }") - (2.5 + 18.0)).abs() < 1e-9);
    }

    #[test]
    fn a_settled_start_needs_a_driver_that_follows_and_no_other_gap() {
        let follows = "wiedemann99 = {}";
        let refused = |start, driver| scenario(start, driver).unwrap_err();
        let prescribed = "prescribed = { profile = [[0.0, 30.0]] }";
        let settled = "behind = { of = 'ego', settled = true, closing-mps = 0.0 }";
        assert!(refused(settled, prescribed).contains("settled"));
        assert!(
            refused("behind = { of = 'ego', settled = true, gap-m = 9.0, closing-mps = 0.0 }", follows)
                .contains("gap-m")
        );
        assert!(refused("ahead = { of = 'ego', settled = true, closing-mps = 0.0 }", follows).contains("behind"));
        // A wrong value of the driver is an error of the driver.
        let error = refused(settled, "wiedemann99 = { cc1-s = 99.0 }");
        assert!(error.contains("driver.wiedemann99.cc1-s"), "{error}");
    }
}
