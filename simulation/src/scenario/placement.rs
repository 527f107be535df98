//! Where the vehicles are when a run starts.

use closecall_traffic::metrics::touching_distance_m;
use closecall_traffic::{ActorId, ConfigError, Lane, Num, Parameters, Problem, Range, Road, Vehicle, VehicleState};

use super::config::{ActorConfig, RelativeStartConfig, StartConfig};

const SPEED_RANGE_MPS: Range = Range::closed(0.0, 80.0);
const PLACE_RANGE_M: Range = Range::closed(-10_000.0, 100_000.0);
const GAP_RANGE_M: Range = Range::closed(-50.0, 1_000.0);
const THW_RANGE_S: Range = Range::closed(0.0, 60.0);
const CLOSING_RANGE_MPS: Range = Range::closed(-60.0, 60.0);

/// The state of every actor at time zero, in the order of the actors.
pub(super) fn place(
    actors: &[ActorConfig],
    vehicles: &[Vehicle],
    road: &Road,
    parameters: &Parameters,
) -> Result<Vec<VehicleState>, ConfigError> {
    let mut placed: Vec<Option<VehicleState>> = vec![None; actors.len()];
    // Each round places the actors whose reference is placed; a round that places nobody has met a circle.
    while placed.iter().any(Option::is_none) {
        let before = placed.iter().flatten().count();
        for (index, actor) in actors.iter().enumerate() {
            if placed[index].is_none() {
                let placing = Placing { actors, vehicles, road, parameters, placed: &placed };
                placed[index] = placing.state(index, actor).map_err(|error| at(index, error))?;
            }
        }
        if placed.iter().flatten().count() == before {
            return Err(circle(actors, &placed));
        }
    }
    let states: Vec<VehicleState> = placed.into_iter().flatten().collect();
    refuse_overlaps(actors, vehicles, road, &states)?;
    Ok(states)
}

fn at(index: usize, error: ConfigError) -> ConfigError {
    error.within("start").within_index(index).within("actor")
}

fn circle(actors: &[ActorConfig], placed: &[Option<VehicleState>]) -> ConfigError {
    let index = placed.iter().position(Option::is_none).unwrap_or_default();
    let rule = format!("where `{}` starts depends on where it starts itself", actors[index].id);
    let key = match actors[index].start {
        StartConfig::Ahead(_) => "ahead",
        _ => "behind",
    };
    at(index, ConfigError::new("of", Problem::Contradiction { other: "start", rule }).within(key))
}

fn refuse_overlaps(
    actors: &[ActorConfig],
    vehicles: &[Vehicle],
    road: &Road,
    states: &[VehicleState],
) -> Result<(), ConfigError> {
    let shape = |index: usize| {
        let state: &VehicleState = &states[index];
        let pose = road.plane_pose(state.s_m, state.d_m, state.heading_rad);
        closecall_traffic::geometry::OrientedBox::new(pose, vehicles[index].dimensions)
    };
    for later in 1..actors.len() {
        for earlier in 0..later {
            if shape(earlier).overlaps(&shape(later)) {
                let rule = format!("`{}` and `{}` overlap at the start", actors[earlier].id, actors[later].id);
                let problem = Problem::Contradiction { other: "start", rule };
                return Err(ConfigError::new("start", problem).within_index(later).within("actor"));
            }
        }
    }
    Ok(())
}

struct Placing<'a> {
    actors: &'a [ActorConfig],
    vehicles: &'a [Vehicle],
    road: &'a Road,
    parameters: &'a Parameters,
    placed: &'a [Option<VehicleState>],
}

impl Placing<'_> {
    /// The state of one actor, or nothing where its reference is not placed yet.
    fn state(&self, index: usize, actor: &ActorConfig) -> Result<Option<VehicleState>, ConfigError> {
        match &actor.start {
            StartConfig::Absolute(start) => {
                let number =
                    |num, key, range| self.parameters.number(num, key, range).map_err(|error| error.within("absolute"));
                let d_m = self.lane_centre_m(start.lane).map_err(|error| error.within("absolute"))?;
                let s_m = number(&start.s_m, "s-m", PLACE_RANGE_M)?;
                let speed_mps = number(&start.speed_mps, "speed-mps", SPEED_RANGE_MPS)?;
                Ok(Some(VehicleState { s_m, d_m, speed_mps, ..VehicleState::default() }))
            }
            StartConfig::Ahead(start) => self.relative(index, start, 1.0).map_err(|error| error.within("ahead")),
            StartConfig::Behind(start) => self.relative(index, start, -1.0).map_err(|error| error.within("behind")),
        }
    }

    fn relative(
        &self,
        index: usize,
        start: &RelativeStartConfig,
        side: f64,
    ) -> Result<Option<VehicleState>, ConfigError> {
        let other = self.find(&start.of)?;
        let Some(reference) = self.placed[other] else { return Ok(None) };
        // Ahead the gap closes while the other is faster, behind while this one is.
        let speed_mps = match exactly_one(&start.speed_mps, &start.closing_mps, ["speed-mps", "closing-mps"])? {
            (key, num, true) => self.parameters.number(num, key, SPEED_RANGE_MPS)?,
            (key, num, false) => {
                let closing_mps = self.parameters.number(num, key, CLOSING_RANGE_MPS)?;
                SPEED_RANGE_MPS.check(reference.speed_mps - side * closing_mps, key)?
            }
        };
        let gap_m = match exactly_one(&start.gap_m, &start.thw_s, ["gap-m", "thw-s"])? {
            (key, num, true) => self.parameters.number(num, key, GAP_RANGE_M)?,
            (key, num, false) => {
                let follower_mps = if side > 0.0 { reference.speed_mps } else { speed_mps };
                self.parameters.number(num, key, THW_RANGE_S)? * follower_mps
            }
        };
        let [own, other] = [index, other].map(|index| self.vehicles[index].dimensions.length_m);
        let d_m = match start.lane {
            Some(lane) => self.lane_centre_m(lane)?,
            None => reference.d_m,
        };
        let s_m = reference.s_m + side * (gap_m + touching_distance_m(own, other));
        Ok(Some(VehicleState { s_m, d_m, speed_mps, ..VehicleState::default() }))
    }

    fn find(&self, id: &ActorId) -> Result<usize, ConfigError> {
        find_actor(self.actors, id, "of")
    }

    fn lane_centre_m(&self, lane: Lane) -> Result<f64, ConfigError> {
        if (1..=self.road.lanes()).contains(&lane.0) {
            Ok(self.road.lane_centre_m(lane))
        } else {
            let problem = Problem::WrongCount { value: lane.0.into(), allowed: "a lane of this road, counted from 1" };
            Err(ConfigError::new("lane", problem))
        }
    }
}

/// The place of the actor that `key` names.
pub(super) fn find_actor(actors: &[ActorConfig], id: &ActorId, key: &str) -> Result<usize, ConfigError> {
    actors.iter().position(|actor| actor.id == *id).ok_or_else(|| {
        let known = actors.iter().map(|actor| format!("`{}`", actor.id)).collect::<Vec<_>>().join(", ");
        ConfigError::new(key, Problem::UnknownActor { value: id.to_string(), known })
    })
}

/// The one of two keys that is given: its name, its value, and whether it is the first.
fn exactly_one<'a>(
    first: &'a Option<Num>,
    second: &'a Option<Num>,
    keys: [&'static str; 2],
) -> Result<(&'static str, &'a Num, bool), ConfigError> {
    match (first, second) {
        (Some(num), None) => Ok((keys[0], num, true)),
        (None, Some(num)) => Ok((keys[1], num, false)),
        (Some(_), Some(_)) => {
            let rule = "only one of the two may be given".to_owned();
            Err(ConfigError::new(keys[0], Problem::Contradiction { other: keys[1], rule }))
        }
        (None, None) => {
            let needed =
                if keys[0] == "gap-m" { "one of `gap-m` and `thw-s`" } else { "one of `speed-mps` and `closing-mps`" };
            Err(ConfigError::new(keys[0], Problem::Missing { needed }))
        }
    }
}
