//! The state of one run, and the parts of its step.

mod acting;

use std::borrow::Cow;

use closecall_controllers::CheckedDriver;
use closecall_controllers::{EgoCommand, EgoInput, EgoSettings, EgoState, Looks, MisSettings, Neighbours, Reason};
use closecall_sensors::{Perception, Scene, SceneVehicle};
use closecall_traffic::{
    Absent, CONTROL_STEP, ConfigError, ENGAGEMENT_CLOSING_MPS, ENGAGEMENT_GAP_M, Measured, Problem, Road, Source, Time,
    Track, VehicleState,
};

use super::cost::{CostMeter, Instant, Rear};
use super::ego_input::{odometry, sensor_availability};
use super::equipment::perception;
use super::error::LARGEST_COMMAND_MPS2;
use super::events::Events;
use super::humans::{Human, human_drivers, looks, weave};
use super::margins::{MarginMeter, Widths};
use super::mis_log::{MisLog, MisObservation, RearObservation};
use super::moments::Moments;
use super::phase::{Encounter, Follower};
use super::promise::{EgoMotion, PromiseMeter};
use super::settling::settle_sensors;
use super::start::start_of_ego;
use super::{Arm, CurrentMargins, Observer, RunEvent, RunKey, SampleError, StepView};
use crate::world::{Action, InitialVehicle, World};
use closecall_scenarios::Scenario;
use closecall_scenarios::outcome::{Ahead, EndReason, Moment, Outcome, Phase};

/// Deceleration of the ego above which it counts as braking hard (m/s²): an assumption, above the 1
/// m/s² of the paper's comfort limit with its overshoot; 1.2 to 3 are plausible.
const HAZARD_BRAKING_MPS2: f64 = 1.5;

/// The next event for which a run waits.
pub(super) enum Next {
    /// A command of the ego controller.
    Control,
    /// Nothing: it has ended.
    End(EndReason),
}

/// Returns the settings of the ego stack.
pub(super) fn settings_of(scenario: &Scenario) -> &EgoSettings {
    let CheckedDriver::Ego(settings) = &scenario.actors[scenario.ego].driver else {
        unreachable!("a checked scenario has its ego stack at `ego`")
    };
    settings
}

/// The state of one run. It borrows its scenario and its arm, or owns them.
pub(super) struct Run<'a> {
    scenario: Cow<'a, Scenario>,
    key: RunKey,
    arm: Cow<'a, Arm>,
    world: World,
    perception: Box<dyn Perception>,
    /// Whether the controller gets the tracks of the sensors that look back.
    looks_back: bool,
    humans: Vec<Human>,
    events: Events,
    encounter: Encounter,
    meter: MarginMeter,
    cost: CostMeter,
    mis: MisLog,
    promise: PromiseMeter,
    moments: Moments,
    /// The margin increase system of the arm; of the scenario or the method, if the arm has none.
    mis_settings: MisSettings,
    /// The last command of the ego controller.
    command: Option<EgoCommand>,
    /// The command that moves the ego, and the next one with the time at which it takes effect.
    acting: Option<EgoCommand>,
    pending: Option<(Time, EgoCommand)>,
    /// Time of the first command of emergency braking.
    emergency_braking_at: Option<Time>,
    /// How far the driver of each vehicle looks. The ego perceives with its sensors; its margins
    /// need the lane and the path.
    looks: Vec<Looks>,
    // Buffers that are reused in each step.
    neighbours: Vec<Neighbours>,
    tracks: Vec<Track>,
    /// The tracks of the other sensors, for a controller that does not look back.
    tracks_ahead: Vec<Track>,
    margins: CurrentMargins,
    actions: Vec<Action>,
    /// All vehicles other than the ego, in the order of their names.
    others: Vec<SceneVehicle>,
    /// All vehicles, in the order of the scenario's actors.
    vehicles: Vec<SceneVehicle>,
    /// Front gap (m) and front time headway (s) of each actor.
    fronts: Vec<(Measured, Measured)>,
    /// The road as the map shows it while its errors hold.
    wrong_map: Road,
}

impl<'a> Run<'a> {
    /// Prepares a run, whose sensors `observer` sees settle.
    pub(super) fn new(
        scenario: Cow<'a, Scenario>,
        key: RunKey,
        arm: Cow<'a, Arm>,
        observer: &mut dyn Observer,
    ) -> Result<Self, SampleError> {
        let settings = *settings_of(&scenario);
        let looks_back = arm.controller.looks_back(&settings);
        let of_arm = arm.controller.settings(&settings);
        if of_arm.lacks_driver() {
            let rule = format!("`{}` needs a human driver of the ego", arm.controller.name());
            let problem = Problem::Contradiction { other: "ego-stack", rule };
            return Err(SampleError::Scenario(ConfigError::new("human", problem)));
        }
        let mis_settings = *of_arm.mis().or(settings.mis()).unwrap_or(&MisSettings::PAPER);
        let own = key;
        // Noise and drivers draw from these random numbers; the outcome names the run itself.
        let key = scenario
            .random_numbers
            .map_or(own, |random_numbers| RunKey { seed: random_numbers.seed, sample: random_numbers.sample });
        let world_with = |ego: VehicleState| {
            let vehicles = scenario.actors.iter().enumerate().map(|(index, actor)| InitialVehicle {
                id: actor.id.clone(),
                vehicle: scenario.vehicle(index, own),
                state: if index == scenario.ego { ego } else { actor.start },
                path: actor.path.clone(),
                weave: weave(actor, &scenario.road, key),
                has_ideal_actuators: index == scenario.ego && scenario.interventions.has_ideal_actuation,
            });
            World::new(scenario.road.clone(), scenario.environment.friction, scenario.physics_step, vehicles.collect())
        };
        let placed = scenario.actors[scenario.ego].start;
        let mut world = world_with(placed);
        let start = start_of_ego(&scenario, &settings, &arm, &world)?;
        if start != placed {
            world = world_with(start);
        }
        let lane_m = own_lane_m(&scenario.road, world.state(scenario.ego));
        let widths = Widths { vehicle_m: 0.0, lane_m };
        let margins = CurrentMargins::new(world.state(scenario.ego), &Neighbours::default(), widths);
        let humans = human_drivers(&scenario, key, &of_arm);
        let mut run = Self {
            key: own,
            perception: perception(&scenario, &arm, key, looks_back || observer.wants_steps())?,
            looks_back,
            looks: looks(&humans, scenario.actors.len()),
            humans,
            events: Events::new(&scenario),
            encounter: Encounter::default(),
            meter: MarginMeter::new(scenario.physics_step.s()),
            cost: CostMeter::new(scenario.physics_step.s()),
            mis: MisLog::new(),
            promise: PromiseMeter::new(),
            moments: Moments::default(),
            mis_settings,
            command: None,
            acting: None,
            pending: None,
            emergency_braking_at: None,
            neighbours: vec![Neighbours::default(); world.len()],
            // One track of each of the three object-level sensors.
            tracks: Vec::with_capacity(3 * world.len()),
            tracks_ahead: Vec::with_capacity(2 * world.len()),
            margins,
            actions: vec![Action::default(); world.len()],
            others: Vec::with_capacity(world.len()),
            vehicles: Vec::with_capacity(world.len()),
            fronts: Vec::with_capacity(world.len()),
            wrong_map: scenario.sensors.odometry_errors().map_of(&scenario.road),
            world,
            scenario,
            arm,
        };
        run.collect_vehicles();
        let ego = run.vehicles[run.scenario.ego];
        settle_sensors(run.perception.as_mut(), &run.scenario, ego, &run.others, observer)?;
        Ok(run)
    }

    /// Goes on until the ego controller has to act, or the run ends. [`Self::input`] is then the
    /// controller's input, and [`Self::command`] takes its answer.
    pub(super) fn go_on(&mut self, observer: &mut dyn Observer) -> Result<Next, SampleError> {
        loop {
            self.report_motion(observer);
            self.update_surroundings(observer);
            if self.world.time().is_multiple_of(CONTROL_STEP) {
                self.collect_vehicles();
                if !self.world.is_wrecked(self.scenario.ego) {
                    self.perceive()?;
                    return Ok(Next::Control);
                }
                self.report_step(observer);
            }
            if let Some(end) = self.complete_step(observer)? {
                return Ok(Next::End(end));
            }
        }
    }

    /// Takes the command of the ego controller for the current time. Returns why the run has ended,
    /// or `None` if it goes on.
    pub(super) fn command(
        &mut self,
        command: EgoCommand,
        observer: &mut dyn Observer,
    ) -> Result<Option<EndReason>, SampleError> {
        if !(command.acceleration_mps2.abs() <= LARGEST_COMMAND_MPS2) {
            return Err(SampleError::Command { value: command.acceleration_mps2, time: self.world.time() });
        }
        self.accept_command(command, observer);
        self.report_step(observer);
        self.complete_step(observer)
    }

    /// Returns the input of the ego controller at the current time.
    pub(super) fn input(&self) -> EgoInput<'_> {
        let time = self.world.time();
        let is_map_right = self.scenario.sensors.odometry_errors().at(time).is_none();
        let road = if is_map_right { &self.scenario.road } else { &self.wrong_map };
        EgoInput {
            time,
            odometry: odometry(&self.scenario, &self.world),
            road,
            curvature_per_m: road.parallel_curvature_per_m(self.world.state(self.scenario.ego).s_m, 0.0),
            tracks: if self.looks_back { &self.tracks } else { &self.tracks_ahead },
            sensors: sensor_availability(self.perception.as_ref()),
        }
    }

    /// Returns the current time.
    pub(super) fn time(&self) -> Time {
        self.world.time()
    }

    /// Returns the scenario.
    pub(super) fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Returns the ego's true margins at the current time.
    pub(super) fn margins(&self) -> &CurrentMargins {
        &self.margins
    }

    /// Ends the step, unless the run has ended: all vehicles act, and move to the next instant.
    fn complete_step(&mut self, observer: &mut dyn Observer) -> Result<Option<EndReason>, SampleError> {
        if let Some(end) = self.end() {
            return Ok(Some(end));
        }
        self.decide_actions(observer)?;
        self.advance(observer);
        Ok(None)
    }

    /// Reports the states of all vehicles to the observer.
    fn report_motion(&self, observer: &mut dyn Observer) {
        observer.moved(self.world.time(), &mut (0..self.world.len()).map(|actor| *self.world.state(actor)));
    }

    /// Updates the neighbours of all vehicles, the ego's margins, and the phase of the encounter.
    fn update_surroundings(&mut self, observer: &mut dyn Observer) {
        self.world.find_neighbours(&self.looks, &mut self.neighbours);
        let ego = self.scenario.ego;
        let ego_state = self.world.state(ego);
        self.margins = CurrentMargins::new(ego_state, &self.neighbours[ego], self.widths(ego));
        if self.world.is_wrecked(ego) {
            return;
        }
        let reference_mps = self.meter.observe(ego_state, &self.margins);
        self.promise.observe(&EgoMotion {
            time: self.world.time(),
            braking_mps2: -ego_state.acceleration_mps2,
            thw_front_s: self.margins.thw_front_s,
        });
        let rear = self.margins.follower.zip(self.margins.gap_rear_m.ok()).map(|(actor, gap_m)| {
            let state = self.world.state(actor);
            Rear { gap_m, speed_mps: state.speed_mps, acceleration_mps2: state.acceleration_mps2 }
        });
        self.cost.observe(&Instant {
            own_mps: ego_state.speed_mps,
            reference_mps,
            lead_brakes: self.margins.lead.is_ok_and(|lead| self.world.state(lead.actor).brake_light),
            rear,
        });
        let follower = self.margins.follower.zip(self.margins.thw_rear_s.ok());
        let follower = follower.map(|(actor, thw_s)| Follower { actor, thw_s });
        let before = self.encounter.phase();
        let phase = self.encounter.update(&self.world, ego, follower);
        if phase != before {
            observer.event(self.world.time(), &RunEvent::PhaseChanged { to: phase });
        }
    }

    /// Runs the ego's sensors.
    fn perceive(&mut self) -> Result<(), SampleError> {
        let scene = Scene {
            time: self.world.time(),
            road: &self.scenario.road,
            environment: &self.scenario.environment,
            ego: self.vehicles[self.scenario.ego],
            others: &self.others,
        };
        let tracks = self.perception.step(&scene)?;
        self.tracks.clear();
        self.tracks.extend_from_slice(tracks);
        if !self.looks_back {
            self.tracks_ahead.clear();
            self.tracks_ahead.extend(tracks.iter().filter(|track| track.source != Source::Rear).cloned());
        }
        Ok(())
    }

    /// Stores the command of the ego controller, and notes its consequences.
    fn accept_command(&mut self, command: EgoCommand, observer: &mut dyn Observer) {
        let time = self.world.time();
        let failed: Option<Reason> = sensor_availability(self.perception.as_ref()).reason();
        let from = self.command.map_or(EgoState::Following, |last| last.state);
        if command.state != from {
            let changed = RunEvent::EgoStateChanged { from, to: command.state, reason: command.reason };
            observer.event(time, &changed);
        }
        if command.state == EgoState::EmergencyBraking {
            self.emergency_braking_at.get_or_insert(time);
        }
        self.command = Some(command);
        self.take_effect();
        self.pending = Some((time + self.scenario.computing.unwrap_or(Time::ZERO), command));
        let ego = self.scenario.ego;
        let rear = self.observe_rear();
        self.note_moments(rear);
        self.note_promise(rear);
        self.mis.observe(&MisObservation {
            time,
            command: &command,
            speed_mps: self.world.state(ego).speed_mps,
            thw_front_s: self.margins.thw_front_s,
            rear,
            failed,
        });
    }

    /// Lets a command that waits take effect once its time has come. It waits for a control step at
    /// most, so that only one waits.
    fn take_effect(&mut self) {
        if let Some((_, command)) = self.pending.take_if(|(from, _)| *from <= self.world.time()) {
            self.acting = Some(command);
        }
    }

    /// Observes where the vehicle behind is.
    fn observe_rear(&mut self) -> RearObservation {
        let ego = self.scenario.ego;
        let ego_state = self.world.state(ego);
        let near = self.margins.follower.filter(|rear| {
            let closing_mps = self.world.state(*rear).speed_mps - ego_state.speed_mps;
            self.margins.gap_rear_m.is_ok_and(|gap_m| gap_m <= ENGAGEMENT_GAP_M)
                && closing_mps >= ENGAGEMENT_CLOSING_MPS
        });
        let brakes_hard = ego_state.acceleration_mps2 < -HAZARD_BRAKING_MPS2;
        RearObservation {
            near,
            is_hazard: near.is_some() && self.lead_brakes() && brakes_hard,
            has_crossed: matches!(self.encounter.phase(), Phase::Overtaking | Phase::After),
            is_critical: self.encounter.reaches_critical_gap(&self.world, ego, self.mis_settings.critical_gap_m),
        }
    }

    fn lead_brakes(&self) -> bool {
        self.margins.lead.is_ok_and(|lead| self.world.state(lead.actor).brake_light)
    }

    /// Notes the moments of the encounter that are reached now.
    fn note_moments(&mut self, rear: RearObservation) {
        let time = self.world.time();
        let lead = self.margins.lead.ok().map(|lead| lead.actor);
        let last_behind = self.encounter.rear();
        for (moment, is_now, actor) in [
            (Moment::Hazard, rear.is_hazard, rear.near),
            (Moment::RearNear, rear.near.is_some(), rear.near),
            (Moment::CriticalDistance, rear.is_critical, last_behind),
            (Moment::FrontBrakes, self.lead_brakes(), lead),
            (Moment::Crossed, rear.has_crossed, last_behind),
            (Moment::Concluded, self.encounter.phase() == Phase::After, last_behind),
        ] {
            if is_now {
                self.moments.note(moment, time, actor.map(|actor| &self.scenario.actors[actor].id));
            }
        }
    }

    /// Updates the fulfilment of the method's promise.
    fn note_promise(&mut self, rear: RearObservation) {
        if let (Some(actor), Ok(rear_gap_m)) = (rear.near, self.margins.gap_rear_m) {
            let ego_mps = self.world.state(self.scenario.ego).speed_mps;
            let settings = self.mis_settings;
            let encounter = self.margins.gap_front_m.ok().zip(self.margins.lead.ok()).map(|(front_gap_m, lead)| {
                closecall_controllers::Encounter {
                    ego_mps,
                    front_gap_m,
                    lead_mps: lead.speed_mps,
                    rear_gap_m,
                    closing_mps: self.world.state(actor).speed_mps - ego_mps,
                    critical_gap_m: settings.critical_gap_m,
                }
            });
            self.promise.note_near(encounter, &settings);
        }
        if rear.is_critical {
            self.promise.note_critical(self.margins.thw_front_s);
        }
        if rear.has_crossed {
            self.promise.note_crossed(self.world.time());
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
        // The sensors process the vehicles in the order of their names: their random draws do not
        // depend on the order of the list of actors.
        let others = self.world.by_name().iter().filter(|actor| **actor != self.scenario.ego);
        self.others.extend(others.map(|&actor| self.vehicles[actor]));
    }

    fn widths(&self, actor: usize) -> Widths {
        Widths {
            vehicle_m: self.world.vehicle(actor).dimensions.width_m,
            lane_m: own_lane_m(&self.scenario.road, self.world.state(actor)),
        }
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
            scenario: &self.scenario,
            vehicles: &self.vehicles,
            fronts: &self.fronts,
            tracks: &self.tracks,
            perception: self.perception.as_ref(),
            command,
            margins: &self.margins,
            phase: self.encounter.phase(),
        });
    }

    /// Ends the sensors after the last step.
    pub(super) fn finish_sensors(&mut self) -> Result<(), SampleError> {
        let time = self.world.time();
        Ok(self.perception.finish(time)?)
    }

    /// Returns the outcome of the run.
    pub(super) fn finish(self, end: EndReason) -> Outcome {
        let settings = settings_of(&self.scenario);
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
            touches: self.world.touches().to_vec(),
            moments: self.moments.finish(),
            ahead: Some(Ahead {
                min_ttc_front_s: self.meter.min_ttc_front_s(),
                emergency_braking_at_s: self.emergency_braking_at.map(Time::s).ok_or(Absent::NoEmergencyBraking),
            }),
            margins: self.meter.finish(),
            mis: self.mis.finish(self.arm.controller.has_mis(settings)),
            cost: Some(self.cost.finish()),
            promise: Some(self.promise.finish()),
        }
    }
}

/// Returns the width of the lane in which a vehicle is (m).
fn own_lane_m(road: &Road, vehicle: &VehicleState) -> f64 {
    road.lane_width_m(road.lane_of(vehicle), vehicle.s_m)
}
