//! The state of one run, and the parts of its step.

use closecall_controllers::CheckedDriver;
use closecall_controllers::{
    DriverInput, DriverNote, EgoCommand, EgoController, EgoInput, EgoState, Looks, MisSettings, Neighbours, Reason,
};
use closecall_sensors::{Perception, Scene, SceneVehicle};
use closecall_traffic::{CONTROL_STEP, ENGAGEMENT_CLOSING_MPS, ENGAGEMENT_GAP_M, Measured, Track, VehicleState};

use super::ego_input::{odometry, sensor_availability};
use super::equipment::{controller, perception};
use super::events::Events;
use super::humans::{Human, human_drivers, looks, weave};
use super::margins::{MarginMeter, Widths};
use super::mis_log::{MisLog, MisObservation};
use super::moments::Moments;
use super::phase::{AFTER_COLLISION, Encounter, Follower};
use super::settling::settle_sensors;
use super::start::start_of_ego;
use super::{Arm, CurrentMargins, Observer, RunEvent, RunKey, SampleError, StepView};
use crate::outcome::{EndReason, Moment, Outcome, Phase};
use crate::scenario::Scenario;
use crate::world::{Action, InitialVehicle, World};

/// Deceleration of the ego above which it counts as braking hard (m/s²): an assumption, above the 1 m/s² of the paper's
/// comfort limit with its overshoot; 1.2 to 3 are plausible.
const HAZARD_BRAKING_MPS2: f64 = 1.5;

/// The state of one run.
pub(super) struct Run<'a> {
    scenario: &'a Scenario,
    key: RunKey,
    arm: &'a Arm,
    world: World,
    perception: Box<dyn Perception>,
    controller: Box<dyn EgoController>,
    humans: Vec<Human>,
    events: Events,
    encounter: Encounter,
    meter: MarginMeter,
    mis: MisLog,
    moments: Moments,
    critical_gap_m: f64,
    /// The last command of the ego controller.
    command: Option<EgoCommand>,
    /// How far the driver of each vehicle looks. The ego perceives with its sensors; its margins need the lane and the path.
    looks: Vec<Looks>,
    // Buffers that are reused in each step.
    neighbours: Vec<Neighbours>,
    tracks: Vec<Track>,
    margins: CurrentMargins,
    actions: Vec<Action>,
    /// All vehicles other than the ego, in the order of their names.
    others: Vec<SceneVehicle>,
    /// All vehicles, in the order of the scenario's actors.
    vehicles: Vec<SceneVehicle>,
    /// Front gap (m) and front time headway (s) of each actor.
    fronts: Vec<(Measured, Measured)>,
}

impl<'a> Run<'a> {
    pub(super) fn new(scenario: &'a Scenario, key: RunKey, arm: &'a Arm) -> Result<Self, SampleError> {
        let CheckedDriver::Ego(settings) = &scenario.actors[scenario.ego].driver else {
            unreachable!("a checked scenario has its ego stack at `ego`")
        };
        let own = key;
        // Noise and drivers draw from these random numbers; the outcome names the run itself.
        let key = scenario.random_numbers.map_or(own, |of| RunKey { seed: of.seed, sample: of.sample });
        let world_with = |ego: VehicleState| {
            let vehicles = scenario.actors.iter().enumerate().map(|(index, actor)| InitialVehicle {
                id: actor.id.clone(),
                vehicle: scenario.vehicle(index, own),
                state: if index == scenario.ego { ego } else { actor.start },
                weave: weave(actor, &scenario.road, key),
                has_ideal_actuators: index == scenario.ego && scenario.interventions.has_ideal_actuation,
            });
            World::new(scenario.road, scenario.environment.friction, scenario.physics_step, vehicles.collect())
        };
        let placed = scenario.actors[scenario.ego].start;
        let mut world = world_with(placed);
        let start = start_of_ego(scenario, settings, arm, &world)?;
        if start != placed {
            world = world_with(start);
        }
        let widths = Widths { vehicle_m: 0.0, lane_m: scenario.road.lane_width_m() };
        let margins = CurrentMargins::new(world.state(scenario.ego), &Neighbours::default(), widths);
        let humans = human_drivers(scenario, key);
        let mut run = Self {
            scenario,
            key: own,
            arm,
            perception: perception(scenario, arm, key)?,
            controller: controller(scenario, settings, arm),
            looks: looks(&humans, scenario.actors.len()),
            humans,
            events: Events::new(scenario),
            encounter: Encounter::default(),
            meter: MarginMeter::new(scenario.physics_step.s()),
            mis: MisLog::default(),
            moments: Moments::default(),
            critical_gap_m: settings.mis().unwrap_or(&MisSettings::PAPER).critical_gap_m,
            command: None,
            neighbours: vec![Neighbours::default(); world.len()],
            // One track of each of the three object-level sensors.
            tracks: Vec::with_capacity(3 * world.len()),
            margins,
            actions: vec![Action::default(); world.len()],
            others: Vec::with_capacity(world.len()),
            vehicles: Vec::with_capacity(world.len()),
            fronts: Vec::with_capacity(world.len()),
            world,
        };
        run.collect_vehicles();
        let ego = run.vehicles[scenario.ego];
        settle_sensors(run.perception.as_mut(), scenario, ego, &run.others)?;
        Ok(run)
    }

    /// Returns whether sensors and ego controller act at the current time.
    pub(super) fn is_control_step(&self) -> bool {
        self.world.time().is_multiple_of(CONTROL_STEP)
    }

    /// Reports the states of all vehicles to the observer.
    pub(super) fn report_motion(&self, observer: &mut dyn Observer) {
        observer.moved(self.world.time(), &mut (0..self.world.len()).map(|actor| *self.world.state(actor)));
    }

    /// Updates the neighbours of all vehicles, the ego's margins, and the phase of the encounter.
    pub(super) fn update_surroundings(&mut self, observer: &mut dyn Observer) {
        self.world.find_neighbours(&self.looks, &mut self.neighbours);
        let ego = self.scenario.ego;
        let own = self.world.state(ego);
        self.margins = CurrentMargins::new(own, &self.neighbours[ego], self.widths(ego));
        if self.world.is_wrecked(ego) {
            return;
        }
        self.meter.observe(own, &self.margins);
        let follower = self.margins.follower.zip(self.margins.thw_rear_s.ok());
        let follower = follower.map(|(actor, thw_s)| Follower { actor, thw_s });
        let before = self.encounter.phase();
        let phase = self.encounter.update(&self.world, ego, follower);
        if phase != before {
            observer.event(self.world.time(), &RunEvent::PhaseChanged { to: phase });
        }
    }

    /// Runs the ego's sensors and its controller, unless the ego has collided.
    pub(super) fn perceive_and_control(&mut self, observer: &mut dyn Observer) -> Result<(), SampleError> {
        let ego = self.scenario.ego;
        self.collect_vehicles();
        let time = self.world.time();
        if !self.world.is_wrecked(ego) {
            let scene = Scene {
                time,
                road: &self.scenario.road,
                environment: &self.scenario.environment,
                ego: self.vehicles[ego],
                others: &self.others,
            };
            let tracks = self.perception.step(&scene)?;
            self.tracks.clear();
            self.tracks.extend_from_slice(tracks);
            let input = EgoInput {
                time,
                odometry: odometry(self.scenario, &self.world),
                road: &self.scenario.road,
                tracks: &self.tracks,
                sensors: sensor_availability(self.perception.as_ref()),
            };
            let command = self.controller.step(&input)?;
            if !command.acceleration_mps2.is_finite() {
                return Err(SampleError::Command { value: command.acceleration_mps2, time });
            }
            self.accept_command(command, input.sensors.reason(), observer);
        }
        self.report_step(observer);
        Ok(())
    }

    /// Stores the command of the ego controller, and notes what follows from it. `failed` says which sensors have failed.
    fn accept_command(&mut self, command: EgoCommand, failed: Option<Reason>, observer: &mut dyn Observer) {
        let time = self.world.time();
        let from = self.command.map_or(EgoState::Following, |last| last.state);
        if command.state != from {
            let changed = RunEvent::EgoStateChanged { from, to: command.state, reason: command.reason };
            observer.event(time, &changed);
        }
        self.command = Some(command);
        let ego = self.scenario.ego;
        let is_critical = self.encounter.reaches_critical_gap(&self.world, ego, self.critical_gap_m);
        self.note_moments(is_critical);
        self.mis.observe(&MisObservation {
            time,
            command: &command,
            speed_mps: self.world.state(ego).speed_mps,
            thw_front_s: self.margins.thw_front_s,
            is_critical,
            failed,
        });
    }

    /// Notes the moments of the encounter that are reached now.
    fn note_moments(&mut self, is_critical: bool) {
        let time = self.world.time();
        let own_mps = self.world.state(self.scenario.ego).speed_mps;
        let is_near = self.margins.follower.is_some_and(|rear| {
            let closing_mps = self.world.state(rear).speed_mps - own_mps;
            self.margins.gap_rear_m.is_ok_and(|gap_m| gap_m <= ENGAGEMENT_GAP_M)
                && closing_mps >= ENGAGEMENT_CLOSING_MPS
        });
        let lead_brakes = self.margins.lead.is_ok_and(|lead| self.world.state(lead.actor).brake_light);
        let brakes_hard = self.world.state(self.scenario.ego).acceleration_mps2 < -HAZARD_BRAKING_MPS2;
        for (moment, is_now) in [
            (Moment::Hazard, is_near && lead_brakes && brakes_hard),
            (Moment::RearNear, is_near),
            (Moment::CriticalDistance, is_critical),
            (Moment::FrontBrakes, lead_brakes),
            (Moment::Crossed, matches!(self.encounter.phase(), Phase::Overtaking | Phase::After)),
            (Moment::Concluded, self.encounter.phase() == Phase::After),
        ] {
            if is_now {
                self.moments.note(moment, time);
            }
        }
    }

    /// Fills the lists of vehicles for sensors and observers.
    fn collect_vehicles(&mut self) {
        self.others.clear();
        self.vehicles.clear();
        for actor in 0..self.world.len() {
            let vehicle = SceneVehicle {
                actor,
                vehicle: *self.world.vehicle(actor),
                state: *self.world.state(actor),
                pitch_rad: self.world.pitch_rad(actor),
            };
            self.vehicles.push(vehicle);
        }
        // The sensors process the vehicles in the order of their names, so that their random draws do not depend on the order
        // of the list of actors.
        let others = self.world.by_name().iter().filter(|actor| **actor != self.scenario.ego);
        self.others.extend(others.map(|&actor| self.vehicles[actor]));
    }

    fn widths(&self, actor: usize) -> Widths {
        Widths { vehicle_m: self.world.vehicle(actor).dimensions.width_m, lane_m: self.scenario.road.lane_width_m() }
    }

    /// Reports the control step to the observer.
    fn report_step(&mut self, observer: &mut dyn Observer) {
        let Some(command) = self.command.as_ref().filter(|_| observer.wants_steps()) else { return };
        self.fronts.clear();
        for actor in 0..self.world.len() {
            let now = CurrentMargins::new(self.world.state(actor), &self.neighbours[actor], self.widths(actor));
            self.fronts.push((now.gap_front_m, now.thw_front_s));
        }
        observer.step(&StepView {
            time: self.world.time(),
            scenario: self.scenario,
            vehicles: &self.vehicles,
            fronts: &self.fronts,
            tracks: &self.tracks,
            perception: self.perception.as_ref(),
            command,
            margins: &self.margins,
            phase: self.encounter.phase(),
        });
    }

    /// Determines the actions of all vehicles, from the current state: of the human drivers, of the scenario's events, and
    /// of the ego controller.
    pub(super) fn decide_actions(&mut self, observer: &mut dyn Observer) -> Result<(), SampleError> {
        let time = self.world.time();
        self.events.update(&self.world, |event| {
            observer.event(time, &RunEvent::EventTriggered { event: event.to_owned() });
        });
        let ego = self.scenario.ego;
        let commanded_mps2 = self.command.map_or(0.0, |command| command.acceleration_mps2);
        self.actions[ego] = Action { acceleration_mps2: commanded_mps2, ..Action::default() };
        for human in &mut self.humans {
            let actor = human.actor;
            if self.world.is_wrecked(actor) {
                continue;
            }
            let input = DriverInput {
                time,
                vehicle: self.world.vehicle(actor),
                own: self.world.state(actor),
                neighbours: &self.neighbours[actor],
                road: &self.scenario.road,
                lane_change_target: self.world.lane_change_target(actor),
                lateral_deviation_m: self.world.lateral_deviation_m(actor),
                desired_speed_offset_mps: human.desired_speed_noise.as_mut().map_or(0.0, |noise| noise.at(time)),
            };
            let action = human
                .driver
                .step(&input, &mut human.rng)
                .map_err(|source| SampleError::Driver { actor: self.scenario.actors[actor].id.clone(), source })?;
            if let Some(note) = action.note {
                if note == DriverNote::CutOutStarted {
                    self.events.note_cut_out(actor, time);
                    if !self.world.is_wrecked(ego) && self.margins.follower == Some(actor) {
                        self.moments.note(Moment::CutOut, time);
                    }
                }
                observer.event(time, &RunEvent::DriverNote { actor, note });
            }
            self.actions[actor] = Action {
                acceleration_mps2: self
                    .events
                    .requested_mps2(actor, &self.world)
                    .map_or(action.acceleration_mps2, |event_mps2| event_mps2.min(action.acceleration_mps2)),
                lane_change: action.lane_change.or(self.events.lane_change(actor, &self.world, &self.scenario.road)),
                indicator: action.indicator,
            };
        }
        Ok(())
    }

    /// Moves the world by one step and reports new collisions to the observer.
    pub(super) fn advance(&mut self, observer: &mut dyn Observer) {
        let known = self.world.collisions().len();
        self.world.step(&self.actions, self.encounter.phase());
        for index in known..self.world.collisions().len() {
            let collision = &self.world.collisions()[index];
            if collision.involves(self.scenario.ego_id()) {
                let is_ahead = self.is_ahead_of_ego(index);
                self.meter.note_collision(is_ahead);
            }
            observer.event(collision.time, &RunEvent::Collision(collision.clone()));
        }
    }

    /// Returns whether the other vehicle of a collision of the ego has its centre ahead of the ego's. `collision` is an
    /// index into the list of collisions.
    fn is_ahead_of_ego(&self, collision: usize) -> bool {
        let ego = self.scenario.ego;
        let between = &self.world.collisions()[collision].between;
        let other = self
            .scenario
            .actors
            .iter()
            .position(|actor| actor.id != *self.scenario.ego_id() && between.contains(&actor.id));
        other.is_some_and(|other| self.world.state(other).s_m > self.world.state(ego).s_m)
    }

    /// Returns why the run has ended, or `None` if it goes on.
    pub(super) fn end(&self) -> Option<EndReason> {
        let time = self.world.time();
        if let Some(first) = self.world.collisions().first() {
            if time >= first.time + AFTER_COLLISION {
                return Some(EndReason::Collision);
            }
        } else if self.stands_still() {
            return Some(EndReason::Standstill);
        }
        (time >= self.scenario.duration).then_some(EndReason::Duration)
    }

    /// Returns whether the ego, its lead vehicle and all vehicles behind it stand still, so that the ego can no longer
    /// collide.
    fn stands_still(&self) -> bool {
        let ego = self.scenario.ego;
        let own = self.world.state(ego);
        let lead = self.neighbours[ego].own.lead.map(|lead| lead.actor);
        own.speed_mps == 0.0
            && (0..self.world.len()).all(|actor| {
                let state = self.world.state(actor);
                let matters = state.s_m <= own.s_m || Some(actor) == lead;
                !matters || state.speed_mps == 0.0
            })
    }

    /// Returns the outcome of the run.
    pub(super) fn finish(self, end: EndReason) -> Outcome {
        let CheckedDriver::Ego(settings) = &self.scenario.actors[self.scenario.ego].driver else {
            unreachable!("a checked scenario has its ego stack at `ego`")
        };
        Outcome {
            scenario: self.scenario.name.clone(),
            seed: self.key.seed,
            sample: self.key.sample,
            controller: self.arm.controller.name().to_owned(),
            ego: self.scenario.ego_id().clone(),
            parameters: self.scenario.parameters.clone(),
            end,
            duration: self.world.time(),
            collisions: self.world.collisions().to_vec(),
            moments: self.moments.finish(),
            margins: self.meter.finish(),
            mis: self.mis.finish(self.arm.controller.has_mis(settings)),
        }
    }
}
