//! Plays a storyboard with vehicles that follow their actions exactly, and records the actions of
//! each with their times.
//!
//! The ego keeps the speed of the file. As in a nominal encounter, the times of the others' actions
//! depend on the file alone, and are the same for every controller of the ego.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use closecall_traffic::maths;

use super::condition::Memory;
use super::dom::{ImportError, Node};
use super::follow::Following;
use super::reader::{Reader, is_true};
use super::road::ImportedRoad;
use super::shift::Shift;
use super::synchronize::{ACCELERATION_MPS2, Meeting};
use super::world::Vehicle;

/// Step of the storyboard (s): the step of esmini's tests.
pub(super) const STEP_S: f64 = 0.01;
/// Longest storyboard without a stop trigger that fires (s): an assumption; 100 to 1000 are
/// plausible.
pub(super) const LONGEST_S: f64 = 300.0;
/// Time that is played after the last action ended (s), if no trigger stops the storyboard: an
/// assumption; 5 to 60 are plausible.
const AFTER_LAST_S: f64 = 20.0;

/// Highest speed of a scenario file (m/s).
pub(super) const MOST_SPEED_MPS: f64 = 100.0;

/// Largest acceleration of an action, forwards or backwards (m/s²): no tyre transmits more, as for
/// recorded values. A `step` sets a speed at once. It limits the vehicles that the scenario drives:
/// the controller drives the ego, whatever its actions ask for.
const MOST_ACCELERATION_MPS2: f64 = 12.0;

/// Largest angle between a vehicle and the road at its start (rad): an assumption; 0.02 to 0.2 are
/// plausible.
const MOST_START_ANGLE_RAD: f64 = 0.1;
/// Distance from the centre of a lane above which a note says so (m): numerical.
pub(super) const NOTED_OFFSET_M: f64 = 0.01;
/// Largest distance beyond an end of the road (m): lengths and positions are rounded in files.
const ROUNDING_M: f64 = 0.01;

/// Difference of two values that are the same but for rounding: numerical.
const SAME: f64 = 1e-9;

/// When an element began and ended (s).
#[derive(Clone, Copy, Debug)]
pub(super) struct ElementState {
    pub(super) started_s: f64,
    pub(super) ended_s: Option<f64>,
}

/// An element of the storyboard, which a condition names.
#[derive(Clone, Debug)]
pub(super) struct StoryboardElement {
    /// Its kind as in `storyboardElementType`, such as `maneuverGroup`.
    pub(super) kind: String,
    /// The names of the elements around it, from the story on, and its own name.
    pub(super) path: Vec<String>,
    /// Number of the element in the document.
    pub(super) id: usize,
}

impl StoryboardElement {
    /// Returns whether the element has this name, behind the names of some elements around it.
    pub(super) fn is_named(&self, stated: &str) -> bool {
        let Some((own, around)) = self.path.split_last() else { return false };
        let (before, name) = stated.rsplit_once("::").unwrap_or(("", stated));
        let mut around = around.iter();
        own == name && (before.is_empty() || before.split("::").all(|wanted| around.any(|name| name == wanted)))
    }
}

/// A lane change that a vehicle makes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LaneChange {
    pub(super) vehicle: usize,
    pub(super) at_s: f64,
    pub(super) from: i32,
    pub(super) to: i32,
    pub(super) duration_s: f64,
    /// The element that makes it, and its line.
    pub(super) line: usize,
    pub(super) element: &'static str,
}

/// How a value goes from one to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    Linear,
    Cubic,
    Sinusoidal,
}

impl Shape {
    /// Returns the share of the way after a part of the time.
    fn share(self, part: f64) -> f64 {
        match self {
            Self::Linear => part,
            Self::Cubic => part * part * (3.0 - 2.0 * part),
            Self::Sinusoidal => 0.5 * (1.0 - maths::cos(PI * part)),
        }
    }

    /// Returns the largest slope of the shape, divided by its mean slope.
    const fn steepness(self) -> f64 {
        match self {
            Self::Linear => 1.0,
            Self::Cubic => 1.5,
            Self::Sinusoidal => 0.5 * PI,
        }
    }
}

/// An action that takes time.
#[derive(Clone, Debug)]
enum Running {
    /// A change of speed: from, to, begin, duration and shape.
    Speed { vehicle: usize, from_mps: f64, to_mps: f64, begins_s: f64, duration_s: f64, shape: Shape },
    /// A speed relative to another vehicle, for ever.
    Relative { vehicle: usize, other: usize, value: f64, is_factor: bool },
    /// Speeds at times, linear in between.
    Profile { vehicle: usize, points: Vec<(f64, f64)> },
    /// The same, to arrive at a place when another vehicle arrives at its own.
    Meet { vehicle: usize, points: Vec<(f64, f64)>, meeting: Meeting },
    /// A gap to another vehicle, for ever.
    Follow(Following),
    /// A shift within the lane.
    Offset(Shift),
    /// A lane change, until its end.
    Lane { ends_s: f64 },
    /// A lane that a vehicle on a trajectory has from a time.
    LaneFrom { vehicle: usize, at_s: f64, lane: i32 },
}

/// A running event.
#[derive(Clone, Debug)]
struct RunningEvent {
    name: String,
    /// Number of the event in the document.
    id: usize,
    /// Number of its manoeuvre in the document.
    maneuver: usize,
    is_longitudinal: Vec<usize>,
    /// The vehicles that it moves sideways.
    is_lateral: Vec<usize>,
    /// The numbers of its actions in the document. Each ends with the event.
    action_ids: Vec<usize>,
    actions: Vec<Running>,
}

/// How the actions at the beginning are performed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Round {
    /// The vehicles to which a position or a speed is relative may not be set yet.
    Set,
    /// All are set: what is possible is checked, and what is left out is noted.
    Checked,
}

/// A storyboard that is played.
#[derive(Clone)]
pub(super) struct Storyboard<'a> {
    pub(super) reader: Reader,
    pub(super) road: &'a ImportedRoad,
    pub(super) vehicles: Vec<Vehicle>,
    pub(super) ego: usize,
    pub(super) time_s: f64,
    pub(super) memories: BTreeMap<usize, Memory>,
    /// When elements began and ended, by their numbers in the document: names are unique among the
    /// elements beside each other alone.
    pub(super) states: BTreeMap<usize, ElementState>,
    pub(super) elements: Vec<StoryboardElement>,
    running: Vec<RunningEvent>,
    done: BTreeSet<usize>,
    /// Time and speed of each vehicle in each step.
    pub(super) speeds: Vec<Vec<(f64, f64)>>,
    /// Distance since the start and offset from the centre of the lane of each vehicle in each step
    /// (m).
    pub(super) offsets: Vec<Vec<[f64; 2]>>,
    pub(super) shifts: Vec<Shift>,
    pub(super) lane_changes: Vec<LaneChange>,
    /// The vehicles that follow another.
    pub(super) following: Vec<Following>,
    /// Number of actions during the run by which each vehicle moves.
    pub(super) moves: Vec<usize>,
    /// Times of the events, for the reader of the result.
    pub(super) events: Vec<(f64, String)>,
    pub(super) notes: Vec<String>,
    /// Time at which the storyboard ends (s).
    pub(super) end_s: f64,
}

impl<'a> Storyboard<'a> {
    pub(super) fn new(reader: Reader, road: &'a ImportedRoad, vehicles: Vec<Vehicle>, ego: usize) -> Self {
        let (speeds, offsets) = (vec![Vec::new(); vehicles.len()], vec![Vec::new(); vehicles.len()]);
        let moves = vec![0; vehicles.len()];
        Self {
            reader,
            road,
            vehicles,
            ego,
            time_s: 0.0,
            memories: BTreeMap::new(),
            states: BTreeMap::new(),
            elements: Vec::new(),
            running: Vec::new(),
            done: BTreeSet::new(),
            speeds,
            offsets,
            shifts: Vec::new(),
            lane_changes: Vec::new(),
            following: Vec::new(),
            moves,
            events: Vec::new(),
            notes: Vec::new(),
            end_s: 0.0,
        }
    }

    /// Returns the vehicle that an attribute names.
    pub(super) fn vehicle(&self, node: &Node, name: &str) -> Result<&Vehicle, ImportError> {
        Ok(&self.vehicles[self.index(node, name)?])
    }

    pub(super) fn index(&self, node: &Node, name: &str) -> Result<usize, ImportError> {
        let wanted = self.reader.text(node, name)?;
        self.vehicles.iter().position(|vehicle| vehicle.name == wanted).ok_or_else(|| {
            let names: Vec<_> = self.vehicles.iter().map(|vehicle| vehicle.name.as_str()).collect();
            self.reader.error(node, format!("there is no vehicle `{wanted}`, only {}", names.join(", ")))
        })
    }

    /// Plays the storyboard to its end.
    pub(super) fn play(&mut self, storyboard: &Node) -> Result<(), ImportError> {
        self.collect_elements(storyboard, &[]);
        let road = self.road;
        let sections = &road.sections;
        let [mut first_section, mut last_section] = [usize::MAX, 0];
        let mut last_action_s = 0.0;
        let mut have_left = vec![false; self.vehicles.len()];
        loop {
            for story in storyboard.all("Story") {
                self.start(story.id);
                for act in story.all("Act") {
                    self.act(act)?;
                }
                if self.have_ended(story.all("Act")) {
                    self.end(story.id);
                }
            }
            if !self.running.is_empty() {
                last_action_s = self.time_s;
            }
            for (index, vehicle) in self.vehicles.iter().enumerate() {
                self.speeds[index].push((self.time_s, vehicle.speed_mps));
                self.offsets[index].push([vehicle.travelled_m, vehicle.offset_m]);
                if vehicle.s_m > road.length_m + ROUNDING_M && !std::mem::replace(&mut have_left[index], true) {
                    self.notes.push(format!(
                        "`{}` drives beyond the end of the road at {:.2} s: the road goes on as it ends",
                        vehicle.name, self.time_s
                    ));
                }
                let section = sections.at(vehicle.s_m);
                if !sections.has(section, vehicle.lane) {
                    return Err(self.no_lane(vehicle));
                }
                [first_section, last_section] = [first_section.min(section), last_section.max(section)];
            }
            sections.check_numbers(first_section, last_section)?;
            let stop = storyboard.child("StopTrigger").filter(|trigger| !trigger.children.is_empty());
            let stops = stop.is_some() && self.is_triggered(stop)?;
            let limit_s = if stop.is_some() { LONGEST_S } else { last_action_s + AFTER_LAST_S };
            if stops || self.time_s >= limit_s.min(LONGEST_S) {
                self.end_s = self.time_s;
                self.events.push((self.time_s, "storyboard ends".to_owned()));
                self.note_what_never_begins(storyboard);
                if !stops && stop.is_some() {
                    self.notes
                        .push(format!("the stop trigger never fires within {LONGEST_S} s: the scenario ends there"));
                }
                return Ok(());
            }
            self.check_meetings()?;
            self.advance();
        }
    }

    /// Notes the events that have not begun at the end: nothing of them is in the scenario.
    fn note_what_never_begins(&mut self, storyboard: &Node) {
        let groups =
            storyboard.all("Story").flat_map(|story| story.all("Act")).flat_map(|act| act.all("ManeuverGroup"));
        let events = groups.flat_map(|group| group.all("Maneuver")).flat_map(|maneuver| maneuver.all("Event"));
        for event in events.filter(|event| !self.done.contains(&event.id)) {
            let name = event.raw("name").unwrap_or_default();
            let note = format!("line {}: the event `{name}` never begins, and its actions are left out", event.line);
            self.notes.push(note);
        }
    }

    /// Returns the error of a vehicle whose lane is missing where it drives.
    fn no_lane(&self, vehicle: &Vehicle) -> ImportError {
        ImportError {
            path: self.reader.path.clone(),
            line: vehicle.line,
            element: "ScenarioObject".to_owned(),
            message: format!(
                "`{}` drives in lane {} at {:.2} s, {:.1} m along the road, and the road has no such lane there: \
                 it must change lanes before",
                vehicle.name, vehicle.lane, self.time_s, vehicle.s_m
            ),
        }
    }

    /// Checks the arrivals of the next step by which vehicles synchronise.
    fn check_meetings(&self) -> Result<(), ImportError> {
        for action in self.running.iter().flat_map(|event| &event.actions) {
            if let Running::Meet { meeting, .. } = action {
                self.check_meeting(meeting)?;
            }
        }
        Ok(())
    }

    fn collect_elements(&mut self, node: &Node, around: &[String]) {
        for child in &node.children {
            let mut path = around.to_vec();
            if matches!(child.name.as_str(), "Story" | "Act" | "ManeuverGroup" | "Maneuver" | "Event" | "Action")
                && let Some(name) = child.raw("name")
            {
                path.push(name.to_owned());
                let kind = child.name[..1].to_ascii_lowercase() + &child.name[1..];
                self.elements.push(StoryboardElement { kind, path: path.clone(), id: child.id });
            }
            self.collect_elements(child, &path);
        }
    }

    fn start(&mut self, id: usize) {
        let started = ElementState { started_s: self.time_s, ended_s: None };
        self.states.entry(id).or_insert(started);
    }

    /// Ends an element that has begun. Returns whether it had not ended before.
    fn end(&mut self, id: usize) -> bool {
        let time_s = self.time_s;
        let running = self.states.get_mut(&id).filter(|state| state.ended_s.is_none());
        running.map(|state| state.ended_s = Some(time_s)).is_some()
    }

    /// Ends an element, and tells it to the reader of the result.
    fn end_told(&mut self, id: usize, name: &str) {
        if self.end(id) {
            self.events.push((self.time_s, format!("{name} ends")));
        }
    }

    fn has_ended(&self, id: usize) -> bool {
        self.states.get(&id).is_some_and(|state| state.ended_s.is_some())
    }

    fn have_ended<'n>(&self, mut nodes: impl Iterator<Item = &'n Node>) -> bool {
        nodes.all(|node| self.has_ended(node.id))
    }

    fn act(&mut self, act: &Node) -> Result<(), ImportError> {
        if self.has_ended(act.id) {
            return Ok(());
        }
        if !self.states.contains_key(&act.id) {
            if !self.is_triggered(act.child("StartTrigger"))? {
                return Ok(());
            }
            self.start(act.id);
        }
        if let Some(stop) = act.child("StopTrigger").filter(|trigger| !trigger.children.is_empty())
            && self.is_triggered(Some(stop))?
        {
            self.stop_act(act);
            self.end_told(act.id, act.raw("name").unwrap_or_default());
            return Ok(());
        }
        for group in act.all("ManeuverGroup") {
            if let Some(reference) = group.child("CatalogReference") {
                return Err(self.reader.error(reference, "a manoeuvre of a catalogue is not read"));
            }
            let mut actors = Vec::new();
            let list = self.reader.child(group, &["Actors"])?;
            for entity in list.all("EntityRef") {
                actors.push(self.index(entity, "entityRef")?);
            }
            self.start(group.id);
            for maneuver in group.all("Maneuver") {
                self.maneuver(maneuver, &actors)?;
            }
            if self.have_ended(group.all("Maneuver")) {
                self.end(group.id);
            }
        }
        if self.have_ended(act.all("ManeuverGroup")) {
            self.end(act.id);
        }
        Ok(())
    }

    /// Ends the manoeuvres and the events of an act. Other acts go on.
    fn stop_act(&mut self, act: &Node) {
        let maneuvers: Vec<&Node> = act.all("ManeuverGroup").flat_map(|group| group.all("Maneuver")).collect();
        self.end_events(|running| maneuvers.iter().any(|maneuver| maneuver.id == running.maneuver));
        for maneuver in maneuvers {
            self.end_told(maneuver.id, maneuver.raw("name").unwrap_or_default());
        }
        for group in act.all("ManeuverGroup") {
            self.end(group.id);
        }
    }

    fn maneuver(&mut self, maneuver: &Node, actors: &[usize]) -> Result<(), ImportError> {
        self.start(maneuver.id);
        for event in maneuver.all("Event") {
            let key = event.id;
            let event_name = event.raw("name").unwrap_or_default().to_owned();
            if !self.done.contains(&key) {
                // The conditions of an event are looked at until it begins.
                if self.is_triggered(event.child("StartTrigger"))? {
                    if event.raw("priority") == Some("skip")
                        && self.running.iter().any(|running| running.maneuver == maneuver.id)
                    {
                        let message = "`priority` is `skip`, and another event of the manoeuvre runs when it begins: a \
                                       skipped event is not read";
                        return Err(self.reader.error(event, message));
                    }
                    self.done.insert(key);
                    self.start(event.id);
                    self.events.push((self.time_s, format!("{event_name} begins")));
                    self.begin(event, (&event_name, maneuver.id), actors)?;
                }
            }
        }
        if self.have_ended(maneuver.all("Event")) {
            self.end_told(maneuver.id, maneuver.raw("name").unwrap_or_default());
        }
        Ok(())
    }

    fn begin(&mut self, event: &Node, (name, maneuver): (&str, usize), actors: &[usize]) -> Result<(), ImportError> {
        let priority = self.reader.text(event, "priority")?;
        if matches!(priority.as_str(), "override" | "overwrite") {
            self.end_events(|running| running.maneuver == maneuver);
        }
        let mut running = RunningEvent {
            name: name.to_owned(),
            id: event.id,
            maneuver,
            is_longitudinal: Vec::new(),
            is_lateral: Vec::new(),
            action_ids: Vec::new(),
            actions: Vec::new(),
        };
        for action in event.all("Action") {
            self.start(action.id);
            running.action_ids.push(action.id);
            let inner = self.reader.only(action)?;
            if inner.name != "PrivateAction" {
                return Err(self.reader.error(inner, "only actions of vehicles are read"));
            }
            if actors.is_empty() {
                return Err(self.reader.error(inner, "no vehicle performs it: `Actors` has no `EntityRef`"));
            }
            for &actor in actors {
                self.action(self.reader.only(inner)?.clone(), actor, &mut running)?;
            }
        }
        // A new change of speed ends the one before, and a new motion sideways a shift.
        let (replaced, turned) = (running.is_longitudinal.clone(), running.is_lateral.clone());
        for other in &mut self.running {
            other.actions.retain(|action| match action {
                Running::Speed { vehicle, .. }
                | Running::Relative { vehicle, .. }
                | Running::Profile { vehicle, .. }
                | Running::Meet { vehicle, .. }
                | Running::Follow(Following { vehicle, .. }) => !replaced.contains(vehicle),
                Running::Offset(shift) => !turned.contains(&shift.vehicle),
                Running::Lane { .. } | Running::LaneFrom { .. } => true,
            });
        }
        self.running.push(running);
        self.end_events(|event| event.actions.is_empty());
        Ok(())
    }

    fn action(&mut self, node: Node, actor: usize, running: &mut RunningEvent) -> Result<(), ImportError> {
        if actor == self.ego && node.name != "ControllerAction" && node.name != "ActivateControllerAction" {
            let name = &self.vehicles[actor].name;
            self.notes.push(format!(
                "line {}: `{}` of `{name}`, the ego: its controller drives instead; the others begin as if it happened",
                node.line, node.name
            ));
        }
        if matches!(node.name.as_str(), "LongitudinalAction" | "LateralAction" | "RoutingAction" | "SynchronizeAction")
        {
            self.moves[actor] += 1;
        }
        match node.name.as_str() {
            "LongitudinalAction" => {
                let inner = self.reader.only(&node)?.clone();
                match inner.name.as_str() {
                    "SpeedAction" => self.speed_action(&inner, actor, running),
                    "SpeedProfileAction" => self.speed_profile(&inner, actor, running),
                    "LongitudinalDistanceAction" => {
                        let following = self.follow(&inner, actor)?;
                        running.is_longitudinal.push(actor);
                        running.actions.push(Running::Follow(following));
                        Ok(())
                    }
                    _ => Err(self.reader.error(&inner, "this action is not read")),
                }
            }
            "LateralAction" => {
                let inner = self.reader.only(&node)?.clone();
                match inner.name.as_str() {
                    "LaneChangeAction" => self.lane_change(&inner, actor, running),
                    "LaneOffsetAction" => {
                        let shift = self.lane_offset(&inner, actor)?;
                        self.shifts.push(shift);
                        running.is_lateral.push(actor);
                        if shift.runs(self.time_s) {
                            running.actions.push(Running::Offset(shift));
                        }
                        Ok(())
                    }
                    _ => Err(self.reader.error(&inner, "only `LaneChangeAction` and `LaneOffsetAction` are read")),
                }
            }
            "RoutingAction" => {
                let inner = self.reader.only(&node)?.clone();
                match inner.name.as_str() {
                    "FollowTrajectoryAction" => self.follow_trajectory(&inner, actor, running),
                    _ => Err(self.reader.error(&inner, "it is not read: a vehicle has no route on one road")),
                }
            }
            "SynchronizeAction" => {
                let (points, meeting) = self.synchronize(&node, actor)?;
                running.is_longitudinal.push(actor);
                running.actions.push(Running::Meet { vehicle: actor, points, meeting });
                Ok(())
            }
            "ControllerAction" | "ActivateControllerAction" => {
                self.notes.push(format!(
                    "line {}: `{}` of `{}`: a scenario has one controller, the ego's",
                    node.line, node.name, self.vehicles[actor].name
                ));
                Ok(())
            }
            _ => Err(self.reader.error(&node, "this action is not read")),
        }
    }

    /// Returns the target speed of a speed action (m/s), and the vehicle that it stays relative to.
    fn target_speed(&self, node: &Node) -> Result<(f64, Option<Running>), ImportError> {
        let target = self.reader.only(self.reader.child(node, &["SpeedActionTarget"])?)?;
        let value = self.reader.number(target, "value")?;
        match target.name.as_str() {
            "AbsoluteTargetSpeed" => Ok((value, None)),
            "RelativeTargetSpeed" => {
                let other = self.index(target, "entityRef")?;
                let is_factor = self.reader.text(target, "speedTargetValueType")? == "factor";
                let base_mps = self.vehicles[other].speed_mps;
                let speed_mps = if is_factor { base_mps * value } else { base_mps + value };
                let stays = is_true(target, "continuous");
                Ok((speed_mps, stays.then_some(Running::Relative { vehicle: 0, other, value, is_factor })))
            }
            _ => Err(self.reader.error(target, "this target is not read")),
        }
    }

    /// Returns the speed of an action if a vehicle of a scenario can have it.
    fn possible(&self, action: &Node, speed_mps: f64) -> Result<f64, ImportError> {
        // Sums of speeds round.
        if (-SAME..=MOST_SPEED_MPS).contains(&speed_mps) {
            return Ok(speed_mps.max(0.0));
        }
        let node = action.child("SpeedActionTarget").and_then(|target| target.children.first()).unwrap_or(action);
        Err(self.reader.error(node, format!("a speed of {speed_mps} m/s; 0 to {MOST_SPEED_MPS} m/s are needed")))
    }

    fn speed_action(&mut self, node: &Node, actor: usize, running: &mut RunningEvent) -> Result<(), ImportError> {
        let dynamics = self.reader.child(node, &["SpeedActionDynamics"])?;
        let (to_mps, stays) = self.target_speed(node)?;
        if stays.is_some() && dynamics.raw("dynamicsShape") != Some("step") {
            let message = "`dynamicsShape` must be `step`: a speed that is continuously relative to another vehicle's is \
                           set at once";
            return Err(self.reader.error(dynamics, message));
        }
        let to_mps = self.possible(node, to_mps)?;
        let from_mps = self.vehicles[actor].speed_mps;
        let (duration_s, shape) = self.transition(dynamics, from_mps, to_mps, 0.5 * (from_mps + to_mps))?;
        if duration_s > 0.0 && actor != self.ego {
            // A smooth change of speed has a higher acceleration in its middle.
            self.check_acceleration(dynamics, shape.steepness() * (to_mps - from_mps) / duration_s)?;
        }
        self.check_dynamics(dynamics)?;
        running.is_longitudinal.push(actor);
        if let Some(Running::Relative { other, value, is_factor, .. }) = stays {
            self.vehicles[actor].speed_mps = to_mps;
            running.actions.push(Running::Relative { vehicle: actor, other, value, is_factor });
        } else if duration_s <= 0.0 {
            self.vehicles[actor].speed_mps = to_mps;
        } else {
            let begins_s = self.time_s;
            running.actions.push(Running::Speed { vehicle: actor, from_mps, to_mps, begins_s, duration_s, shape });
        }
        Ok(())
    }

    /// Checks the time or the distance of a transition between speeds, also if the speed does not
    /// change by it. A rate is checked where a vehicle accelerates by it.
    fn check_dynamics(&self, node: &Node) -> Result<(), ImportError> {
        if node.raw("dynamicsShape") == Some("step") {
            return Ok(());
        }
        let value = self.reader.number(node, "value")?;
        match value >= 0.0 || node.raw("dynamicsDimension") == Some("rate") {
            true => Ok(()),
            false => Err(self.reader.error(node, format!("`value` is {value}; a number of at least 0 is needed"))),
        }
    }

    /// Checks that a vehicle can have an acceleration, and notes if a prescribed driver has less.
    fn check_acceleration(&mut self, node: &Node, acceleration_mps2: f64) -> Result<(), ImportError> {
        if !(acceleration_mps2.abs() <= MOST_ACCELERATION_MPS2 + SAME) {
            let message = format!(
                "an acceleration of {acceleration_mps2:.2} m/s²; -{MOST_ACCELERATION_MPS2} to {MOST_ACCELERATION_MPS2} \
                 m/s² are possible, and the shape `step` sets a speed at once"
            );
            return Err(self.reader.error(node, message));
        }
        let [hardest_mps2, largest_mps2] = ACCELERATION_MPS2;
        if !(hardest_mps2 - SAME..=largest_mps2 + SAME).contains(&acceleration_mps2) {
            self.notes.push(format!(
                "line {}: an acceleration of {acceleration_mps2:.2} m/s²: a vehicle of a scenario has {hardest_mps2} to \
                 {largest_mps2} m/s² by its driver",
                node.line
            ));
        }
        Ok(())
    }

    /// Returns the duration of a transition (s), and its shape. `mean_mps` is the mean
    /// speed in it.
    fn transition(&self, node: &Node, from: f64, to: f64, mean_mps: f64) -> Result<(f64, Shape), ImportError> {
        let stated = self.reader.text(node, "dynamicsShape")?;
        let shape = match stated.as_str() {
            "step" => return Ok((0.0, Shape::Linear)),
            "linear" => Shape::Linear,
            "sinusoidal" => Shape::Sinusoidal,
            "cubic" => Shape::Cubic,
            _ => return Err(self.reader.error(node, format!("`dynamicsShape` is `{stated}`"))),
        };
        let value = self.reader.number(node, "value")?;
        let dimension = self.reader.text(node, "dynamicsDimension")?;
        let duration_s = match dimension.as_str() {
            "time" => value,
            "rate" if (to - from).abs() < SAME => 0.0,
            "rate" => shape.steepness() * (to - from).abs() / value.abs(),
            "distance" => value / mean_mps,
            _ => return Err(self.reader.error(node, format!("`dynamicsDimension` is `{dimension}`"))),
        };
        if duration_s.is_finite() && duration_s >= 0.0 {
            return Ok((duration_s, shape));
        }
        Err(self.reader.error(node, format!("it takes {duration_s} s to come from {from} to {to}")))
    }

    fn speed_profile(&mut self, node: &Node, actor: usize, running: &mut RunningEvent) -> Result<(), ImportError> {
        if let Some(limits) = node.child("DynamicConstraints") {
            return Err(self.reader.error(limits, "limits of a speed profile are not read"));
        }
        if node.raw("entityRef").is_some() {
            return Err(self.reader.error(node, "speeds relative to another vehicle are not read"));
        }
        let mut points = vec![(self.time_s, self.vehicles[actor].speed_mps)];
        let mut at_s = self.time_s;
        for entry in node.all("SpeedProfileEntry") {
            let duration_s = self.reader.number(entry, "time")?;
            if !(duration_s >= 0.0) {
                return Err(self.reader.error(entry, "`time` must be 0 or more"));
            }
            if duration_s == 0.0 {
                // A first entry at the start sets the speed at once.
                points.pop();
            }
            at_s += duration_s;
            let speed_mps = self.possible(entry, self.reader.number(entry, "speed")?)?;
            if let Some((_, before_mps)) = points.last().filter(|_| duration_s > 0.0 && actor != self.ego) {
                self.check_acceleration(entry, (speed_mps - before_mps) / duration_s)?;
            }
            points.push((at_s, speed_mps));
        }
        running.is_longitudinal.push(actor);
        running.actions.push(Running::Profile { vehicle: actor, points });
        Ok(())
    }

    fn follow_trajectory(&mut self, node: &Node, actor: usize, running: &mut RunningEvent) -> Result<(), ImportError> {
        if self.vehicles[actor].offset_m != 0.0 {
            let message = format!(
                "`{}` is beside the centre of its lane: a trajectory begins at the centre, and keeps it",
                self.vehicles[actor].name
            );
            return Err(self.reader.error(node, message));
        }
        let mut driven = self.trajectory(node, actor)?;
        if let Some(first) = driven.speeds.first_mut() {
            first.0 = first.0.min(self.time_s);
        }
        self.notes.push(format!(
            "line {}: of the trajectory of `{}`, speeds and lane changes are read: it keeps the centre of its lane",
            node.line, self.vehicles[actor].name
        ));
        for change in &driven.lane_changes {
            let (at_s, lane) = (change.at_s, change.to);
            running.actions.push(Running::LaneFrom { vehicle: actor, at_s, lane });
        }
        self.lane_changes.extend(driven.lane_changes);
        running.is_longitudinal.push(actor);
        running.is_lateral.push(actor);
        running.actions.push(Running::Profile { vehicle: actor, points: driven.speeds });
        Ok(())
    }

    fn lane_change(&mut self, node: &Node, actor: usize, running: &mut RunningEvent) -> Result<(), ImportError> {
        if self.reader.number_or(node, "targetLaneOffset", 0.0)? != 0.0 {
            return Err(self
                .reader
                .error(node, "`targetLaneOffset` must be 0: a vehicle keeps the centre of its lane"));
        }
        let target = self.reader.only(self.reader.child(node, &["LaneChangeTarget"])?)?;
        let shift = self.reader.number(target, "value")?;
        let from = self.vehicles[actor].lane;
        #[expect(clippy::cast_possible_truncation, reason = "compared with the lanes of the road below")]
        let to = match target.name.as_str() {
            "AbsoluteTargetLane" => {
                let (id, at_m) = (shift as i32, self.vehicles[actor].s_m);
                let to = self.road.number(id, at_m);
                let message = || format!("lane {id} is not a driving lane along the road at {at_m:.2} m");
                to.ok_or_else(|| self.reader.error(target, message()))?
            }
            "RelativeTargetLane" => self.shifted(self.vehicle(target, "entityRef")?.lane, shift as i32),
            _ => return Err(self.reader.error(target, "this target is not read")),
        };
        let [from_index, to_index] =
            [from, to].map(|lane| self.road.lanes.iter().position(|candidate| *candidate == lane));
        let Some((from_index, to_index)) = from_index.zip(to_index) else {
            let lanes: Vec<_> = self.road.lanes.iter().map(ToString::to_string).collect();
            let message = format!("lane {to} is not a driving lane along the road, only {}", lanes.join(", "));
            return Err(self.reader.error(target, message));
        };
        if from_index == to_index && self.vehicles[actor].offset_m != 0.0 {
            let message = "it leads back to the centre of the lane: a `LaneOffsetAction` with the offset 0 is needed";
            return Err(self.reader.error(node, message));
        }
        if from_index == to_index {
            return Ok(());
        }
        if from_index.abs_diff(to_index) > 1 {
            return Err(self
                .reader
                .error(target, format!("from lane {from} to lane {to}: only the next lane is read")));
        }
        let dynamics = self.reader.child(node, &["LaneChangeActionDynamics"])?;
        let at_m = self.vehicles[actor].s_m;
        let way_m = self.road.half_width_m(from_index, at_m) + self.road.half_width_m(to_index, at_m);
        let (duration_s, _) = self.transition(dynamics, 0.0, way_m, self.vehicles[actor].speed_mps)?;
        let at_s = self.time_s;
        (self.vehicles[actor].lane, self.vehicles[actor].offset_m) = (to, 0.0);
        running.is_lateral.push(actor);
        let (line, element) = (node.line, "LaneChangeAction");
        self.lane_changes.push(LaneChange { vehicle: actor, at_s, from, to, duration_s, line, element });
        running.actions.push(Running::Lane { ends_s: at_s + duration_s });
        Ok(())
    }

    /// Returns the lane that lies some lanes to the left of a lane. The numbers of OpenDRIVE leave
    /// out 0.
    pub(super) fn shifted(&self, lane: i32, shift: i32) -> i32 {
        let sum = lane.saturating_add(shift);
        match lane < 0 {
            true if sum >= 0 => sum.saturating_add(1),
            false if sum <= 0 => sum.saturating_sub(1),
            _ => sum,
        }
    }

    pub(super) fn advance(&mut self) {
        for vehicle in &mut self.vehicles {
            let centre_m = self.road.index(vehicle.lane).map(|index| self.road.file_centre_m(index, vehicle.s_m));
            let scale = self.road.path_scale(vehicle.s_m, centre_m.unwrap_or_default() + vehicle.offset_m);
            vehicle.s_m += vehicle.speed_mps * STEP_S / scale;
            vehicle.travelled_m += vehicle.speed_mps * STEP_S;
        }
        self.time_s = ((self.time_s + STEP_S) / STEP_S).round() * STEP_S;
        let before: Vec<f64> = self.vehicles.iter().map(|vehicle| vehicle.speed_mps).collect();
        let (time_s, vehicles) = (self.time_s, &self.vehicles);
        let (mut set, mut lanes, mut offsets) = (Vec::new(), Vec::new(), Vec::new());
        for event in &mut self.running {
            event.actions.retain(|action| match action {
                Running::Speed { vehicle, from_mps, to_mps, begins_s, duration_s, shape } => {
                    let part = ((time_s - begins_s) / duration_s).clamp(0.0, 1.0);
                    set.push((*vehicle, from_mps + shape.share(part) * (to_mps - from_mps)));
                    part < 1.0
                }
                Running::Relative { vehicle, other, value, is_factor } => {
                    let base_mps = before[*other];
                    set.push((*vehicle, if *is_factor { base_mps * value } else { base_mps + value }));
                    true
                }
                Running::Profile { vehicle, points } | Running::Meet { vehicle, points, .. } => {
                    let after = points.partition_point(|(at_s, _)| *at_s <= time_s);
                    let (Some(&(t0, v0)), next) = (points.get(after.saturating_sub(1)), points.get(after)) else {
                        return false;
                    };
                    let speed_mps = next.map_or(v0, |(t1, v1)| v0 + (v1 - v0) * (time_s - t0) / (t1 - t0));
                    set.push((*vehicle, speed_mps));
                    next.is_some()
                }
                Running::Follow(following) => {
                    set.push((following.vehicle, following.next_speed_mps(vehicles)));
                    true
                }
                Running::Offset(shift) => {
                    offsets.push((shift.vehicle, shift.offset_m(time_s)));
                    shift.runs(time_s)
                }
                Running::Lane { ends_s } => time_s < *ends_s - 1e-9,
                Running::LaneFrom { vehicle, at_s, lane } => {
                    let is_later = time_s < *at_s;
                    if !is_later {
                        lanes.push((*vehicle, *lane));
                    }
                    is_later
                }
            });
        }
        for (vehicle, lane) in lanes {
            self.vehicles[vehicle].lane = lane;
        }
        for (vehicle, offset_m) in offsets {
            self.vehicles[vehicle].offset_m = offset_m;
        }
        for (vehicle, speed_mps) in set {
            if speed_mps < -SAME {
                let stands = format!("`{}` stands where its relative speed is below 0", self.vehicles[vehicle].name);
                if !self.notes.iter().any(|note| note.starts_with(&stands)) {
                    self.notes.push(format!("{stands}, from {time_s:.2} s: no vehicle of a scenario drives backwards"));
                }
            }
            self.vehicles[vehicle].speed_mps = speed_mps.max(0.0);
        }
        for (vehicle, before_mps) in self.vehicles.iter_mut().zip(before) {
            vehicle.acceleration_mps2 = (vehicle.speed_mps - before_mps) / STEP_S;
        }
        self.end_events(|event| event.actions.is_empty());
    }

    /// Ends the events that have a property, with their actions.
    fn end_events(&mut self, is_over: impl Fn(&RunningEvent) -> bool) {
        let (over, running) = std::mem::take(&mut self.running).into_iter().partition(is_over);
        self.running = running;
        for event in over {
            self.end_told(event.id, &event.name);
            event.actions.iter().for_each(|action| self.cut_short(&event.name, action));
            for action in event.action_ids {
                self.end(action);
            }
        }
    }

    /// Notes an action that ends before it is done, if the scenario file cannot say so. Lane
    /// changes of a trajectory that have not begun do not happen.
    fn cut_short(&mut self, event: &str, action: &Running) {
        let time_s = self.time_s;
        match *action {
            Running::Lane { ends_s } if time_s < ends_s - SAME => self
                .notes
                .push(format!("`{event}` ends at {time_s:.2} s within its lane change, which is made to its end")),
            Running::Follow(Following { vehicle, .. }) => self.notes.push(format!(
                "`{event}` ends at {time_s:.2} s, and `{}` goes on to keep its distance",
                self.vehicles[vehicle].name
            )),
            Running::LaneFrom { vehicle, at_s, .. } => {
                self.lane_changes.retain(|change| change.vehicle != vehicle || change.at_s != at_s);
            }
            _ => {}
        }
    }

    /// Performs the actions at the beginning.
    pub(super) fn init(&mut self, storyboard: &Node) -> Result<Vec<Node>, ImportError> {
        let actions = self.reader.child(storyboard, &["Init", "Actions"])?.clone();
        let mut globals = Vec::new();
        for node in &actions.children {
            match node.name.as_str() {
                "GlobalAction" => globals.push(self.reader.only(node)?.clone()),
                "Private" => {}
                _ => return Err(self.reader.error(node, "this action is not read")),
            }
        }
        self.set_starts(&actions)?;
        match self.vehicles.iter().find(|vehicle| !vehicle.is_placed) {
            Some(vehicle) => {
                Err(self.reader.error(&actions, format!("no `TeleportAction` says where `{}` starts", vehicle.name)))
            }
            None => Ok(globals),
        }
    }

    /// Sets the positions and speeds at the beginning. They can be relative to a vehicle whose actions
    /// stand behind, and to several in turn: they are set until they stay the same, and checked then.
    fn set_starts(&mut self, actions: &Node) -> Result<(), ImportError> {
        let state = |vehicle: &Vehicle| (vehicle.s_m, vehicle.lane, vehicle.offset_m, vehicle.speed_mps);
        for _ in 0..=self.vehicles.len() {
            let before: Vec<_> = self.vehicles.iter().map(state).collect();
            self.round(actions, Round::Set)?;
            if before.iter().zip(&self.vehicles).all(|(before, vehicle)| *before == state(vehicle)) {
                return self.round(actions, Round::Checked);
            }
        }
        let message =
            "the starts and speeds of vehicles are relative to each other in a circle: one of them must be absolute";
        Err(self.reader.error(actions, message))
    }

    fn round(&mut self, actions: &Node, round: Round) -> Result<(), ImportError> {
        for node in actions.all("Private") {
            let vehicle = self.index(node, "entityRef")?;
            for action in node.all("PrivateAction") {
                self.init_action(self.reader.only(action)?, vehicle, round)?;
            }
        }
        Ok(())
    }

    fn init_action(&mut self, node: &Node, vehicle: usize, round: Round) -> Result<(), ImportError> {
        let is_last = round == Round::Checked;
        match node.name.as_str() {
            "TeleportAction" => {
                let position = self.reader.only(self.reader.child(node, &["Position"])?)?;
                self.place(position, vehicle, round)
            }
            "LongitudinalAction" => {
                let inner = self.reader.only(node)?;
                match inner.name.as_str() {
                    "SpeedAction" => {
                        let (speed_mps, stays) = self.target_speed(inner)?;
                        if stays.is_some() && is_last {
                            self.notes.push(format!(
                                "line {}: the speed of `{}` is relative to another at the start, and does not follow it afterwards",
                                inner.line, self.vehicles[vehicle].name
                            ));
                        }
                        let dynamics = inner.child("SpeedActionDynamics");
                        let shape = dynamics.and_then(|dynamics| dynamics.raw("dynamicsShape"));
                        dynamics.map(|dynamics| self.check_dynamics(dynamics)).transpose()?;
                        if is_last && shape.is_some_and(|shape| shape != "step") {
                            self.notes.push(format!(
                                "line {}: `{}` starts with the target speed, and does not come to it",
                                inner.line, self.vehicles[vehicle].name
                            ));
                        }
                        // In the other rounds, the speed of another vehicle may not be set yet.
                        self.vehicles[vehicle].speed_mps =
                            if is_last { self.possible(inner, speed_mps)? } else { speed_mps };
                        Ok(())
                    }
                    "LongitudinalDistanceAction" => self.keep_distance(inner, vehicle, round),
                    _ => Err(self.reader.error(inner, "this action is not read")),
                }
            }
            "ControllerAction" | "ActivateControllerAction" => {
                self.note_controller(node.line, vehicle);
                Ok(())
            }
            _ => Err(self.reader.error(node, "this action is not read")),
        }
    }

    /// Notes that the controller of a vehicle, named on a line of the file, is left out.
    pub(super) fn note_controller(&mut self, line: usize, vehicle: usize) {
        let name = &self.vehicles[vehicle].name;
        let instead = match vehicle == self.ego {
            true => "the controller under test drives instead",
            false => "it drives as the actions say",
        };
        let left_out = format!("the controller of `{name}`: {instead}");
        if !self.notes.iter().any(|note| note.ends_with(&left_out)) {
            self.notes.push(format!("line {line}: {left_out}"));
        }
    }

    /// Puts a vehicle at the distance from another that an action asks for at the beginning.
    fn keep_distance(&mut self, node: &Node, vehicle: usize, round: Round) -> Result<(), ImportError> {
        let other = self.index(node, "entityRef")?;
        if is_true(node, "continuous") {
            return Err(self
                .reader
                .error(node, "`continuous` must be `false`: a vehicle does not follow another by an action"));
        }
        let is_behind = match node.raw("displacement") {
            Some("trailingReferencedEntity") => true,
            Some("leadingReferencedEntity") => false,
            _ => self.vehicles[vehicle].s_m < self.vehicles[other].s_m,
        };
        if node.raw("distance").is_some() && node.raw("timeGap").is_some() {
            return Err(self.reader.error(node, "it has `distance` and `timeGap`: it must have one of them"));
        }
        let distance_m = match node.raw("distance") {
            Some(_) => self.reader.number(node, "distance")?,
            None => {
                let behind = if is_behind { vehicle } else { other };
                self.reader.number(node, "timeGap")? * self.vehicles[behind].speed_mps
            }
        };
        let is_free_space = is_true(node, "freespace");
        let (follower, leader) = (&self.vehicles[vehicle], &self.vehicles[other]);
        let sign = if is_behind { -1.0 } else { 1.0 };
        let s_m = match (is_free_space, sign > 0.0) {
            (false, _) => leader.s_m + sign * distance_m,
            (true, true) => leader.front_m() + distance_m - (follower.back_m() - follower.s_m),
            (true, false) => leader.back_m() - distance_m - (follower.front_m() - follower.s_m),
        };
        if let Some(limits) = node.child("DynamicConstraints").filter(|_| round == Round::Checked) {
            let name = &self.vehicles[vehicle].name;
            self.notes.push(format!("line {}: `{name}` starts at its distance, and does not come to it", limits.line));
        }
        self.vehicles[vehicle].s_m = s_m;
        self.vehicles[vehicle].start = (node.line, node.name.clone());
        Ok(())
    }

    /// Returns the position along the road (m) and the lane of a position on a lane.
    pub(super) fn on_lane(&self, node: &Node) -> Result<(f64, i32), ImportError> {
        let road = self.reader.text(node, "roadId")?;
        if road != self.road.id {
            let message = format!("`roadId` is `{road}`: all vehicles must be on one road, here `{}`", self.road.id);
            return Err(self.reader.error(node, message));
        }
        #[expect(clippy::cast_possible_truncation, reason = "compared with the lanes of the road")]
        let id = self.reader.number(node, "laneId")? as i32;
        let s_m = self.reader.number(node, "s")?;
        let Some(lane) = self.road.number(id, s_m) else {
            return Err(self.reader.error(node, format!("lane {id} is not a driving lane along the road at {s_m} m")));
        };
        Ok((s_m, lane))
    }

    /// Returns the position along the road (m) and the lane of a position in the plane.
    fn in_plane(&mut self, node: &Node, vehicle: usize, round: Round) -> Result<(f64, i32), ImportError> {
        let point = self.on_road(node, None)?;
        let heading_rad = self.reader.number_or(node, "h", 0.0)?;
        if let Some(line) = &self.road.line
            && !(line.angle_rad(heading_rad, point.s_m).abs() <= MOST_START_ANGLE_RAD)
        {
            return Err(self.reader.error(node, "`h` is not the direction of the road: a vehicle starts along it"));
        }
        let Some(index) = self.road.lane_near(point.s_m, point.t_m) else {
            return Err(self.reader.error(node, "the road has no lane"));
        };
        let beside_m = point.t_m - self.road.file_centre_m(index, point.s_m);
        if !(beside_m.abs() <= self.road.half_width_m(index, point.s_m)) {
            return Err(self.reader.error(node, format!("it lies {:.2} m beside the nearest lane", beside_m.abs())));
        }
        if beside_m.abs() > NOTED_OFFSET_M && round == Round::Checked {
            self.notes.push(format!(
                "line {}: `{}` starts at the centre of its lane, {:.2} m beside its position in the file",
                node.line,
                self.vehicles[vehicle].name,
                beside_m.abs()
            ));
        }
        Ok((point.s_m, self.road.lanes[index]))
    }

    /// Returns the vehicle to which a position is relative, or `None` if another round places it.
    fn placed(&self, node: &Node, round: Round) -> Result<Option<&Vehicle>, ImportError> {
        let other = self.vehicle(node, "entityRef")?;
        if !other.is_placed && round == Round::Checked {
            let message = format!(
                "it is relative to `{}`, which starts nowhere: it has no start, or the starts lead back to it in a circle",
                other.name
            );
            return Err(self.reader.error(node, message));
        }
        Ok(other.is_placed.then_some(other))
    }

    fn place(&mut self, node: &Node, vehicle: usize, round: Round) -> Result<(), ImportError> {
        let reader = self.reader.clone();
        let offset_m = reader.number_or(node, "offset", 0.0)?;
        if offset_m != 0.0 && vehicle == self.ego {
            return Err(reader.error(node, "`offset` must be 0: the ego starts at the centre of its lane"));
        }
        if let Some(orientation) = node.child("Orientation") {
            let heading_rad = reader.number_or(orientation, "h", 0.0)?;
            if !(heading_rad.abs() < 1e-3) {
                return Err(reader.error(orientation, "`h` must be 0: a vehicle starts along the road"));
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "compared with the lanes of the road")]
        let (s_m, lane) = match node.name.as_str() {
            "LanePosition" => {
                let (s_m, lane) = self.on_lane(node)?;
                if !(-ROUNDING_M..=self.road.length_m + ROUNDING_M).contains(&s_m) {
                    let message =
                        format!("`s` is {s_m}; 0 to {} m, the length of the road, are needed", self.road.length_m);
                    return Err(reader.error(node, message));
                }
                (s_m.clamp(0.0, self.road.length_m), lane)
            }
            "WorldPosition" => self.in_plane(node, vehicle, round)?,
            "RelativeLanePosition" => {
                let Some(other) = self.placed(node, round)? else { return Ok(()) };
                let shift_m = if node.raw("ds").is_some() {
                    reader.number(node, "ds")?
                } else {
                    reader.number(node, "dsLane")?
                };
                (other.s_m + shift_m, self.shifted(other.lane, reader.number(node, "dLane")? as i32))
            }
            "RelativeRoadPosition" => {
                let Some(other) = self.placed(node, round)? else { return Ok(()) };
                let shift_m = reader.number(node, "dt")?;
                let (road, at_m) = (self.road, other.s_m);
                let from_m = road.index(other.lane).map_or(f64::NAN, |index| road.file_centre_m(index, at_m));
                let beside_m = |index: usize| (from_m + shift_m - road.file_centre_m(index, at_m)).abs();
                let near = road.lane_near(at_m, from_m + shift_m);
                let Some(index) = near.filter(|index| beside_m(*index) <= 0.4 * road.half_width_m(*index, at_m)) else {
                    let lanes: Vec<_> = self.road.lanes.iter().map(ToString::to_string).collect();
                    let message = format!(
                        "`dt` of {shift_m} m does not lead to the centre of a driving lane along the road: these are {}",
                        lanes.join(", ")
                    );
                    return Err(reader.error(node, message));
                };
                (other.s_m + reader.number(node, "ds")?, self.road.lanes[index])
            }
            _ => {
                let message = "only `LanePosition`, `RelativeLanePosition`, `RelativeRoadPosition` and `WorldPosition` \
                               are read";
                return Err(reader.error(node, message));
            }
        };
        if !self.road.lanes.contains(&lane) {
            let lanes: Vec<_> = self.road.lanes.iter().map(ToString::to_string).collect();
            let message = format!("lane {lane} is not a driving lane along the road, only {}", lanes.join(", "));
            // The other vehicle may not be placed yet.
            let is_relative = !matches!(node.name.as_str(), "LanePosition" | "WorldPosition");
            return if round == Round::Set && is_relative { Ok(()) } else { Err(reader.error(node, message)) };
        }
        let (lane, offset_m) = self.lane_beside(node, (lane, s_m), offset_m)?;
        let placed = &mut self.vehicles[vehicle];
        placed.start = (node.line, node.name.clone());
        (placed.s_m, placed.lane, placed.is_placed, placed.offset_m) = (s_m, lane, true, offset_m);
        Ok(())
    }
}
