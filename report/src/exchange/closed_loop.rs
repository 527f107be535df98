//! The closed-loop and the logical form: starts, and the human drivers' behaviour as actions with
//! triggers. The file names a controller, which drives the ego.
//!
//! A manoeuvre of a human driver depends on its model, which OpenSCENARIO cannot say. Each is
//! replaced by an action that begins where the model would begin it if all vehicles kept their
//! speeds:
//!
//! | driver | action | begins |
//! |---|---|---|
//! | `prescribed` | speed profile, lane changes | at their times |
//! | `overtaker` | lane change to the passing lane | at the headway from which the marking is crossed at `cut-out-thw-s` |
//! | `wiedemann99`, `idm` | keeps the gap of equilibrium | where braking at 2 m/s² suffices |
//! | all but `prescribed`, on a ramp | lane change to the through lane | where the acceleration lane begins |

use closecall_controllers::{
    CheckedDriver, DriverConfig, FollowConfig, HumanDriver, IdmConfig, OvertakerConfig, PrescribedConfig,
    Wiedemann99Config, entry_change_duration_s,
};
use closecall_scenarios::openscenario::content_hash;
use closecall_scenarios::{
    ActorConfig, EffectConfig, EventConfig, NominalEncounterConfig, RelativeStartConfig, Scenario, ScenarioConfig,
    StartConfig, Trigger, TriggerConfig,
};
use closecall_simulation::Performance;
use closecall_traffic::{ActorId, Choice, ENGAGEMENT_GAP_M, Lane, Num, Side, Time, Value, Vehicle, VehicleClass};

use super::element::Element;
use super::environment;
use super::expression::{Expression, Values, parameter_name};
use super::road::UsedRoad;
use super::scenario::{Document, group, header, private, teleport};
use super::trigger::{at, event, gap_below, headway_below, started, travelled};
use super::vehicles::{axle_to_centre_m, entry_name};

/// Braking by which a follower comes to its gap (m/s²): an assumption; 1 to 3 are plausible.
const FOLLOWING_BRAKING_MPS2: f64 = 2.0;
/// Time from the nominal encounter to phase 1 (s), as in a scenario file.
const AFTER_ENCOUNTER_S: f64 = 6.0;
/// Duration of a lane change of an overtaker if the file gives none (s), as in a scenario file.
const LANE_CHANGE_S: f64 = 6.3;
/// Speed of a follower that its constraints do not limit (m/s): the highest speed of a scenario
/// file.
const MAX_SPEED_MPS: f64 = 100.0;

/// Who drives a vehicle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// The actions of the storyboard.
    Human,
    /// A controller with this name.
    Ego { controller: String },
}

/// Writes one form.
pub(super) struct Writer<'a> {
    pub(super) config: &'a ScenarioConfig,
    pub(super) scenario: &'a Scenario,
    pub(super) road: UsedRoad<'a>,
    pub(super) controller: &'a str,
    pub(super) values: Values<'a>,
}

impl Writer<'_> {
    /// Returns the document.
    pub(super) fn document(&self, (description, unsaid): (&str, &[String]), source: Option<&str>) -> String {
        let mut init = vec![environment::action(&self.config.environment, &self.scenario.environment, self.values)];
        let (mut entities, mut groups) = (Vec::new(), Vec::new());
        for (index, actor) in self.scenario.actors.iter().enumerate() {
            let name = actor.id.as_str();
            let is_ego = index == self.scenario.ego;
            let mut actions = vec![teleport(self.position(index)), set_speed(self.speed(index))];
            if is_ego {
                let activated = Element::new("ActivateControllerAction");
                let activated = activated.with("longitudinal", "true").with("lateral", "true");
                actions.push(activated.within("ControllerAction"));
            }
            init.push(private(name, actions));
            let role = match is_ego {
                true => Role::Ego { controller: self.controller.to_owned() },
                false => Role::Human,
            };
            entities.push((name.to_owned(), self.entry(index), role));
            let events = self.events(index);
            if !events.is_empty() {
                groups.push(group(name, events));
            }
        }
        let duration_s = self.scenario.duration.s();
        let parameters = if self.values.are_named { self.declarations() } else { Vec::new() };
        let with_hash = |hash: &str| header(description, unsaid, source.map(|text| (text, hash)));
        let document = Document { header: with_hash(""), parameters, entities, init, groups, duration_s };
        if source.is_none() {
            return document.text();
        }
        let hash = content_hash(&document.clone().text()).unwrap_or_default();
        Document { header: with_hash(&hash), ..document }.text()
    }

    fn declarations(&self) -> Vec<Element> {
        let declared = self.values.sample.iter().map(|(name, value)| {
            let kind = if matches!(value, Value::Number(_)) { "double" } else { "string" };
            Element::new("ParameterDeclaration")
                .with("name", parameter_name(name))
                .with("parameterType", kind)
                .with("value", value)
        });
        declared.collect()
    }

    /// Returns the configuration of an actor; vehicles of drawn traffic have none.
    fn config_of(&self, index: usize) -> Option<&ActorConfig> {
        let id = &self.scenario.actors[index].id;
        self.config.actors.iter().find(|actor| actor.id == *id)
    }

    fn index_of(&self, id: &ActorId) -> Option<usize> {
        self.scenario.actors.iter().position(|actor| actor.id == *id)
    }

    /// Returns the entry of a vehicle in the catalogue: the class itself if the class is a
    /// parameter.
    fn entry(&self, index: usize) -> String {
        match self.config_of(index).map(|config| &config.vehicle.class) {
            Some(Choice::Parameter(name)) if self.values.are_named => format!("${}", parameter_name(name)),
            _ => entry_name(&self.scenario.actors[index].id),
        }
    }

    fn vehicle(&self, index: usize) -> &Vehicle {
        &self.scenario.actors[index].vehicle
    }

    /// Returns the position of the rear axle at the start.
    fn position(&self, index: usize) -> Element {
        let (actor, axle_m) = (&self.scenario.actors[index], axle_to_centre_m(&self.vehicle(index).dimensions));
        let config = self.config_of(index).filter(|_| self.values.are_named);
        match config.map(|config| &config.start) {
            Some(StartConfig::Ahead(relative)) => self.relative_position(index, relative, 1.0),
            Some(StartConfig::Behind(relative)) => self.relative_position(index, relative, -1.0),
            other => {
                let s_m = match other {
                    Some(StartConfig::Absolute(start)) => self.values.expression(&start.s_m),
                    _ => actor.start.s_m.into(),
                };
                let lane = self.scenario.road.lane_of(&actor.start);
                // The line that a driver in the lane follows passes a kink of the lane beside its centre.
                let [line_m, ..] = self.scenario.road.driving_line(lane, actor.start.s_m);
                let offset_m = actor.start.d_m - line_m;
                Element::new("LanePosition")
                    .with("roadId", 1)
                    .with("laneId", format!("-{lane}"))
                    .with("s", s_m - (axle_m + self.road.start_m).into())
                    .with("offset", offset_m)
            }
        }
    }

    fn relative_position(&self, index: usize, start: &RelativeStartConfig, sign: f64) -> Element {
        let Some(reference) = self.index_of(&start.of) else { return Element::new("LanePosition") };
        let lanes = [index, reference].map(|actor| self.start_lane(actor));
        let (front, back) = if sign > 0.0 { (index, reference) } else { (reference, index) };
        // From rear axle to rear axle: the gap, the distance from the rear vehicle's axle to its
        // front, and the distance from the lead vehicle's rear to its axle.
        let behind_m =
            0.5 * self.vehicle(front).dimensions.length_m - axle_to_centre_m(&self.vehicle(front).dimensions);
        let ahead_m = 0.5 * self.vehicle(back).dimensions.length_m + axle_to_centre_m(&self.vehicle(back).dimensions);
        let distance_m = self.gap(index, start, back) + (behind_m + ahead_m).into();
        Element::new("RelativeLanePosition")
            .with("entityRef", &start.of)
            .with("dLane", i32::from(lanes[1].0) - i32::from(lanes[0].0))
            .with("ds", distance_m * sign.into())
            .with("offset", 0)
    }

    /// Returns the gap between two vehicles at the start (m).
    fn gap(&self, index: usize, start: &RelativeStartConfig, back: usize) -> Expression {
        match (&start.gap_m, &start.thw_s) {
            (Some(gap), _) => self.values.expression(gap),
            (None, Some(thw)) => self.values.expression(thw) * self.speed(back),
            (None, None) => match self.config_of(index).map(|config| &config.driver) {
                Some(DriverConfig::Wiedemann99(model)) => self.wiedemann_gap(model, self.speed(index)),
                Some(DriverConfig::Idm(model)) => self.idm_gap(model, self.speed(index)),
                Some(DriverConfig::Overtaker(overtaker)) => match &overtaker.follow {
                    FollowConfig::Wiedemann99(model) => self.wiedemann_gap(model, self.speed(index)),
                    FollowConfig::Idm(model) => self.idm_gap(model, self.speed(index)),
                },
                _ => 0.0.into(),
            },
        }
    }

    /// Returns the speed of a vehicle at the start (m/s).
    fn speed(&self, index: usize) -> Expression {
        let of_sample = self.scenario.actors[index].start.speed_mps.into();
        let Some(config) = self.config_of(index).filter(|_| self.values.are_named) else { return of_sample };
        let (relative, sign) = match &config.start {
            StartConfig::Absolute(start) => return self.values.expression(&start.speed_mps),
            StartConfig::Ahead(relative) => (relative, -1.0),
            StartConfig::Behind(relative) => (relative, 1.0),
        };
        match (&relative.speed_mps, &relative.closing_mps, self.index_of(&relative.of)) {
            (Some(speed), _, _) => self.values.expression(speed),
            (None, Some(closing), Some(reference)) => {
                self.speed(reference) + self.values.expression(closing) * sign.into()
            }
            _ => of_sample,
        }
    }

    /// Returns the vehicle ahead in the same lane at the start.
    fn vehicle_ahead(&self, index: usize) -> Option<usize> {
        let actors = &self.scenario.actors;
        let (start, road) = (&actors[index].start, &self.scenario.road);
        let lane = road.lane_of(start);
        (0..actors.len())
            .filter(|other| road.lane_of(&actors[*other].start) == lane && actors[*other].start.s_m > start.s_m)
            .min_by(|a, b| actors[*a].start.s_m.total_cmp(&actors[*b].start.s_m))
    }

    fn closing_mps(&self, index: usize, ahead: usize) -> f64 {
        self.scenario.actors[index].start.speed_mps - self.scenario.actors[ahead].start.speed_mps
    }

    fn start_lane(&self, index: usize) -> Lane {
        self.scenario.road.lane_of(&self.scenario.actors[index].start)
    }

    /// Returns the events of a vehicle.
    fn events(&self, index: usize) -> Vec<Element> {
        let Some(config) = self.config_of(index) else { return self.drawn_vehicle(index) };
        let merging = self.merging(index);
        let mut events = match &config.driver {
            DriverConfig::EgoStack(_) => Vec::new(),
            DriverConfig::Prescribed(prescribed) => self.prescribed(index, prescribed),
            DriverConfig::Overtaker(_) if merging.is_some() => Vec::new(),
            DriverConfig::Overtaker(overtaker) => self.overtaking(index, overtaker).into_iter().collect(),
            DriverConfig::Wiedemann99(model) => {
                let gap_m = |speed| self.wiedemann_gap(model, speed);
                self.following(index, gap_m).into_iter().collect()
            }
            DriverConfig::Idm(model) => self.following(index, |speed| self.idm_gap(model, speed)).into_iter().collect(),
        };
        events.extend(merging);
        events.extend(config.events.iter().zip(0..).filter_map(|(event, number)| self.event(index, event, number)));
        events
    }

    fn drawn_vehicle(&self, index: usize) -> Vec<Element> {
        let id = self.scenario.actors[index].id.as_str();
        // Two kinds of traffic may be called `left` and `left-lane`.
        let begin = id.rsplit_once('-').map_or(id, |(begin, _)| begin);
        let drawn = self.config.traffic.iter().find(|traffic| traffic.id.as_str() == begin);
        let merging = self.merging(index);
        let event = match drawn.map(|traffic| &traffic.driver) {
            Some(DriverConfig::Wiedemann99(model)) => self.following(index, |speed| self.wiedemann_gap(model, speed)),
            Some(DriverConfig::Idm(model)) => self.following(index, |speed| self.idm_gap(model, speed)),
            Some(DriverConfig::Overtaker(overtaker)) if merging.is_none() => self.overtaking(index, overtaker),
            _ => None,
        };
        event.into_iter().chain(merging).collect()
    }

    /// Returns the gap of equilibrium of Wiedemann 99, cc0 + cc1·v + cc2/2 (m).
    fn wiedemann_gap(&self, model: &Wiedemann99Config, speed: Expression) -> Expression {
        // Vissim has the same defaults.
        self.values.or(model.cc0_m.as_ref(), 1.5)
            + self.values.or(model.cc1_s.as_ref(), 0.9) * speed
            + self.values.or(model.cc2_m.as_ref(), 4.0) * 0.5.into()
    }

    /// Returns the gap of equilibrium of the Intelligent Driver Model, s₀ + T·v (m).
    fn idm_gap(&self, model: &IdmConfig, speed: Expression) -> Expression {
        self.values.or(model.standstill_gap_m.as_ref(), 2.0) + self.values.or(model.time_gap_s.as_ref(), 1.5) * speed
    }

    fn following(&self, index: usize, gap_m: impl Fn(Expression) -> Expression) -> Option<Element> {
        let ahead = self.vehicle_ahead(index)?;
        let [name, lead] = [index, ahead].map(|actor| self.scenario.actors[actor].id.as_str());
        let kept_m = gap_m(self.speed(ahead));
        let approaches = self.closing_mps(index, ahead) > 0.0;
        let closing = self.speed(index) - self.speed(ahead);
        let begins_m = match approaches {
            true => kept_m.clone() + closing.clone() * closing / (2.0 * FOLLOWING_BRAKING_MPS2).into(),
            false => kept_m.clone(),
        };
        let performance = Performance::of(self.vehicle(index).class, self.scenario.environment.friction);
        let limits = Element::new("DynamicConstraints")
            .with("maxAcceleration", performance.max_acceleration_mps2)
            .with("maxDeceleration", performance.max_deceleration_mps2)
            .with("maxSpeed", MAX_SPEED_MPS);
        let action = Element::new("LongitudinalDistanceAction")
            .with("entityRef", lead)
            .with("distance", kept_m)
            .with("continuous", "true")
            .with("freespace", "true")
            .with("coordinateSystem", "road")
            .with("displacement", "trailingReferencedEntity")
            .child(limits)
            .within("LongitudinalAction");
        let when = gap_below(&format!("{name}-is-near-{lead}"), name, lead, begins_m);
        Some(event(&format!("{name}-follows"), "override", action, when))
    }

    fn overtaking(&self, index: usize, config: &OvertakerConfig) -> Option<Element> {
        let ahead = self.vehicle_ahead(index)?;
        let side = self.scenario.road.overtaking_side();
        let lane = self.scenario.road.beside(self.start_lane(index), side)?;
        let [name, lead] = [index, ahead].map(|actor| self.scenario.actors[actor].id.as_str());
        let duration = self.values.or(config.lane_change_duration_s.as_ref(), LANE_CHANGE_S);
        let speed = self.speed(index);
        // The driver crosses the marking at the requested headway, or at the headway of its safe
        // gap if that is larger.
        let requested = self.values.expression(&config.cut_out_thw_s);
        let (safe, safe_s) = self.safe_thw(index, &config.follow);
        let crossing = if self.values.of_sample(&config.cut_out_thw_s) >= safe_s { requested } else { safe };
        let begins_s = match self.closing_mps(index, ahead) > 0.0 {
            true => crossing + (speed.clone() - self.speed(ahead)) * duration.clone() * 0.5.into() / speed,
            false => crossing,
        };
        let when = headway_below(&format!("{name}-comes-close-to-{lead}"), name, lead, begins_s);
        Some(event(&cut_out_name(name), "override", change_lanes(lane, duration), when))
    }

    /// Returns the lane change of a driver who enters the road on the acceleration lane, or `None`
    /// if the driver does not.
    fn merging(&self, index: usize) -> Option<Element> {
        let (road, actor) = (&self.scenario.road, &self.scenario.actors[index]);
        let (lane, config) = (road.acceleration_lane()?, self.config.road.acceleration_lane.as_ref()?);
        if !enters(self.scenario, index) {
            return None;
        }
        let target = road.beside(self.start_lane(index), road.overtaking_side())?;
        let rest_m = lane.to_m - lane.from_m - 0.5 * actor.vehicle.dimensions.length_m;
        let duration_s = entry_change_duration_s(actor.start.speed_mps, rest_m);
        let way_m = match actor.start.s_m < lane.from_m {
            true => self.values.expression(&config.from_m) - self.start_m(index),
            false => 0.0.into(),
        };
        let name = actor.id.as_str();
        let when = travelled(&format!("{name}-leaves-the-ramp"), name, way_m);
        Some(event(&cut_out_name(name), "parallel", change_lanes(target, duration_s.into()), when))
    }

    /// Returns the position of the centre of a vehicle at the start (m).
    fn start_m(&self, index: usize) -> Expression {
        let of_sample = self.scenario.actors[index].start.s_m.into();
        let Some(config) = self.config_of(index).filter(|_| self.values.are_named) else { return of_sample };
        let (relative, sign) = match &config.start {
            StartConfig::Absolute(start) => return self.values.expression(&start.s_m),
            StartConfig::Ahead(relative) => (relative, 1.0),
            StartConfig::Behind(relative) => (relative, -1.0),
        };
        let Some(reference) = self.index_of(&relative.of) else { return of_sample };
        let back = if sign > 0.0 { reference } else { index };
        let halves_m = [index, reference].map(|actor| 0.5 * self.vehicle(actor).dimensions.length_m);
        let distance_m = self.gap(index, relative, back) + (halves_m[0] + halves_m[1]).into();
        self.start_m(reference) + distance_m * sign.into()
    }

    /// Returns the time headway of the safe gap of a car-following model (s), and its value in the
    /// sample.
    fn safe_thw(&self, index: usize, follow: &FollowConfig) -> (Expression, f64) {
        let (standstill, headway, defaults) = match follow {
            FollowConfig::Wiedemann99(model) => (model.cc0_m.as_ref(), model.cc1_s.as_ref(), [1.5, 0.9]),
            FollowConfig::Idm(model) => (model.standstill_gap_m.as_ref(), model.time_gap_s.as_ref(), [2.0, 1.5]),
        };
        let expression =
            self.values.or(standstill, defaults[0]) / self.speed(index) + self.values.or(headway, defaults[1]);
        let [standstill_m, headway_s] = [(standstill, defaults[0]), (headway, defaults[1])]
            .map(|(num, default): (Option<&Num>, f64)| num.map_or(default, |num| self.values.of_sample(num)));
        (expression, standstill_m / self.scenario.actors[index].start.speed_mps + headway_s)
    }

    fn prescribed(&self, index: usize, config: &PrescribedConfig) -> Vec<Element> {
        let name = self.scenario.actors[index].id.as_str();
        let mut events = Vec::new();
        if let Some(action) = self.speeds(index, config) {
            let when = at(&format!("{name}-starts"), 0.0.into());
            events.push(event(&format!("{name}-speeds"), "parallel", action, when));
        }
        let mut lane = self.start_lane(index);
        for (number, change) in config.lane_changes.iter().enumerate() {
            let Some(target) = self.scenario.road.beside(lane, change.to) else { break };
            lane = target;
            let change_name = match number {
                0 => cut_out_name(name),
                number => format!("{}-{}", cut_out_name(name), number + 1),
            };
            let when = at(&format!("{change_name}-time"), self.values.expression(&change.at_s));
            let action = change_lanes(target, self.values.expression(&change.duration_s));
            events.push(event(&change_name, "parallel", action, when));
        }
        events
    }

    /// Returns the speeds of a prescribed driver, or `None` if they are constant.
    fn speeds(&self, index: usize, config: &PrescribedConfig) -> Option<Element> {
        let mut entries: Vec<(Expression, Expression)> = Vec::new();
        if let Some(profile) = &config.profile {
            let mut last_s = Expression::Number(0.0);
            for [time, speed] in profile {
                let time = self.values.expression(time);
                entries.push((time.clone() - last_s, self.values.expression(speed)));
                last_s = time;
            }
            // The first point is the start itself.
            if profile.len() < 2 {
                return None;
            }
        } else if let Some(steps) = &config.acceleration_profile {
            let mut speed = self.speed(index);
            let first_s = steps.first().map(|[time, _]| self.values.expression(time))?;
            entries.push((first_s, speed.clone()));
            for (number, [time, acceleration]) in steps.iter().enumerate() {
                let end_s = match steps.get(number + 1) {
                    Some([next, _]) => self.values.expression(next),
                    None => self.scenario.duration.s().into(),
                };
                let duration_s = end_s - self.values.expression(time);
                speed = speed + self.values.expression(acceleration) * duration_s.clone();
                // Braking ends at standstill; with numbers that is known.
                if let Expression::Number(value) = speed {
                    speed = value.max(0.0).into();
                }
                entries.push((duration_s, speed.clone()));
            }
        }
        let entries = entries
            .into_iter()
            .map(|(time_s, speed)| Element::new("SpeedProfileEntry").with("time", time_s).with("speed", speed));
        let profile = Element::new("SpeedProfileAction").with("followingMode", "position").children(entries);
        Some(profile.within("LongitudinalAction"))
    }

    /// Returns an event of the scenario file, or `None` if its trigger refers to a manoeuvre that
    /// is not in the file.
    fn event(&self, index: usize, config: &EventConfig, number: usize) -> Option<Element> {
        let name = config.id.as_str();
        let action = match &config.then {
            EffectConfig::Brake(brake) => {
                let rate = self.values.expression(&brake.deceleration_mps2);
                let speed = self.values.or(brake.to_speed_mps.as_ref(), 0.0);
                brake_to(speed, rate)
            }
            EffectConfig::LaneChange(change) => {
                let lane = self.scenario.road.beside(self.start_lane(index), change.to)?;
                change_lanes(lane, self.values.expression(&change.duration_s))
            }
        };
        let condition_name = format!("{name}-when");
        let checked = self.scenario.actors[index].events.get(number).map(|event| event.when);
        let when = match (&config.when, checked) {
            (TriggerConfig::AtS(time), _) => at(&condition_name, self.values.expression(time)),
            (TriggerConfig::NominalEncounter(encounter), Some(Trigger::At(time))) => {
                at(&condition_name, self.nominal_time(encounter, time))
            }
            (TriggerConfig::ThwBelow(below), _) => headway_below(
                &condition_name,
                below.from.as_str(),
                below.to.as_str(),
                self.values.expression(&below.thw_s),
            ),
            (TriggerConfig::CutOutStarted(cut_out), _) => {
                let actor = self.index_of(&cut_out.actor)?;
                if !self.changes_lanes(actor) {
                    return None;
                }
                let delay_s = self.values.or(cut_out.delay_s.as_ref(), 0.0);
                started(&condition_name, &cut_out_name(cut_out.actor.as_str()), delay_s)
            }
            (TriggerConfig::NominalEncounter(_), _) => return None,
        };
        Some(event(name, "override", action, when))
    }

    /// Returns whether a vehicle has an event with the name of [`cut_out_name`].
    fn changes_lanes(&self, index: usize) -> bool {
        if self.merging(index).is_some() {
            return true;
        }
        match self.config_of(index).map(|config| &config.driver) {
            Some(DriverConfig::Overtaker(config)) => self.overtaking(index, config).is_some(),
            Some(DriverConfig::Prescribed(config)) => !config.lane_changes.is_empty(),
            _ => false,
        }
    }

    /// Returns the time of an event relative to the nominal encounter (s); `of_sample` is its time
    /// in the sample.
    fn nominal_time(&self, config: &NominalEncounterConfig, of_sample: Time) -> Expression {
        if !self.values.are_named {
            return of_sample.s().into();
        }
        let (Some(from), Some(to)) = (self.index_of(&config.from), self.index_of(&config.to)) else {
            return of_sample.s().into();
        };
        let start = self.config_of(from).map(|config| &config.start);
        let Some(StartConfig::Behind(start)) =
            start.filter(|start| matches!(start, StartConfig::Behind(start) if start.of == config.to))
        else {
            return of_sample.s().into();
        };
        let gap = self.gap(from, start, from);
        let closing = self.speed(from) - self.speed(to);
        // A rear vehicle that starts nearer begins at time zero.
        let begins = match &gap {
            Expression::Number(gap_m) if *gap_m <= ENGAGEMENT_GAP_M => 0.0.into(),
            Expression::Number(gap_m) => Expression::from(gap_m - ENGAGEMENT_GAP_M) / closing.clone(),
            Expression::Formula(_) => return of_sample.s().into(),
        };
        let ends = gap / closing + AFTER_ENCOUNTER_S.into();
        begins.clone() + self.values.expression(&config.phase) * (ends - begins)
    }
}

/// Returns whether a human driver finds the way from the acceleration lane to the through lane.
fn enters(scenario: &Scenario, index: usize) -> bool {
    let actor = &scenario.actors[index];
    let merges = matches!(&actor.driver, CheckedDriver::Human(human) if !matches!(human, HumanDriver::Prescribed(_)));
    merges && scenario.road.entry_lane() == Some(scenario.road.lane_of(&actor.start))
}

/// Returns the name of the event in which a vehicle first changes lanes.
fn cut_out_name(actor: &str) -> String {
    format!("{actor}-changes-lanes")
}

/// Returns the entries of the catalogue for actors whose class is a parameter: one for each class,
/// with its name.
pub(super) fn classes(config: &ScenarioConfig) -> Vec<(String, Vehicle)> {
    let is_drawn = config.actors.iter().any(|actor| matches!(actor.vehicle.class, Choice::Parameter(_)));
    let typical = |class: VehicleClass| (class.name().to_owned(), Vehicle::typical(class));
    if is_drawn { VehicleClass::ALL.map(typical).into() } else { Vec::new() }
}

/// Returns the action that sets a speed at once.
pub(super) fn set_speed(speed_mps: Expression) -> Element {
    speed_action(["step", "time"], 0.0.into(), speed_mps)
}

fn brake_to(speed_mps: Expression, rate_mps2: Expression) -> Element {
    speed_action(["linear", "rate"], rate_mps2, speed_mps)
}

fn speed_action([shape, dimension]: [&str; 2], value: Expression, speed_mps: Expression) -> Element {
    let how = Element::new("SpeedActionDynamics")
        .with("dynamicsShape", shape)
        .with("value", value)
        .with("dynamicsDimension", dimension);
    let target = Element::new("AbsoluteTargetSpeed").with("value", speed_mps).within("SpeedActionTarget");
    Element::new("SpeedAction").child(how).child(target).within("LongitudinalAction")
}

/// Returns the action of a lane change. Its shape is the shape of the standard that is nearest to a
/// quintic path.
fn change_lanes(lane: Lane, duration_s: Expression) -> Element {
    let how = Element::new("LaneChangeActionDynamics")
        .with("dynamicsShape", "sinusoidal")
        .with("value", duration_s)
        .with("dynamicsDimension", "time");
    let target = Element::new("AbsoluteTargetLane").with("value", format!("-{lane}")).within("LaneChangeTarget");
    Element::new("LaneChangeAction").child(how).child(target).within("LateralAction")
}

/// Returns the properties of this scenario that the closed-loop forms cannot express.
pub(super) fn unsaid(config: &ScenarioConfig, scenario: &Scenario, are_named: bool) -> Vec<String> {
    let mut list = vec![
        "the ego's sensors, tracks and their errors, and the stack that reads them: a controller drives the ego"
            .to_owned(),
    ];
    for actor in &config.actors {
        let id = &actor.id;
        match &actor.driver {
            DriverConfig::Wiedemann99(_) => list.push(format!(
                "{id}: the state of Wiedemann 99, reaction and perception: it keeps the gap of equilibrium"
            )),
            DriverConfig::Idm(_) => list.push(format!(
                "{id}: the Intelligent Driver Model, reaction and perception: it keeps the gap of equilibrium"
            )),
            DriverConfig::Overtaker(overtaker) => {
                list.push(format!(
                    "{id}: gap acceptance, reaction, car following and evasive steering: it changes lanes at a headway"
                ));
                if overtaker.returns.is_some() {
                    list.push(format!("{id}: its return to the lane that it left"));
                }
            }
            DriverConfig::EgoStack(_) | DriverConfig::Prescribed(_) => {}
        }
        let merges = |id: &ActorId| {
            (0..scenario.actors.len()).any(|index| scenario.actors[index].id == *id && enters(scenario, index))
        };
        if merges(id) {
            list.push(format!(
                "{id}: the gap that it accepts, and its acceleration: it changes lanes where the acceleration lane begins"
            ));
        }
        if actor.lane_keeping.is_some() {
            list.push(format!("{id}: its weaving within the lane"));
        }
        if actor.speed_keeping.is_some() {
            list.push(format!("{id}: the variation of its desired speed"));
        }
        let refers_to_missing = actor.events.iter().any(|event| match &event.when {
            TriggerConfig::CutOutStarted(cut_out) => config.actors.iter().any(|other| {
                other.id == cut_out.actor
                    && !merges(&other.id)
                    && matches!(
                        other.driver,
                        DriverConfig::Wiedemann99(_) | DriverConfig::Idm(_) | DriverConfig::EgoStack(_)
                    )
            }),
            _ => false,
        });
        if refers_to_missing {
            list.push(format!("{id}: an event at a lane change that is not an action of this file"));
        }
    }
    if are_named {
        if !config.traffic.is_empty() {
            list.push("drawn traffic: the vehicles of the sample, whatever the parameters".to_owned());
        }
        if config.actors.iter().any(|actor| matches!(actor.vehicle.class, Choice::Parameter(_))) {
            list.push("a sampled class: distances have the dimensions of the sample".to_owned());
        }
        if config.parameters.0.values().any(|parameter| !parameter.spearman.is_empty()) {
            list.push("rank correlations of parameters: the distributions are independent".to_owned());
        }
    }
    list.extend(unsaid_of_world(config, scenario));
    list
}

/// Returns the properties of the road and of the vehicles that no form can express.
pub(super) fn unsaid_of_world(config: &ScenarioConfig, scenario: &Scenario) -> Vec<String> {
    let mut list = vec!["paint, registration plates, brake lights and indicators".to_owned()];
    if scenario.road.has_guard_rails() {
        list.push("guard rails and their posts".to_owned());
    }
    if config.road.roadside != Default::default() {
        list.push("signs, gantries and trees beside the road".to_owned());
    }
    if scenario.road.overtaking_side() == Side::Right {
        list.push(
            "overtaking on the right: the road has right-hand traffic, so that its lanes run along it".to_owned(),
        );
        if scenario.road.acceleration_lane().is_some() {
            list.push("the end of the acceleration lane: the lane goes on".to_owned());
        }
    }
    list
}
