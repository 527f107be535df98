//! One run: its state, and the parts of a step.

use closecall_controllers::CheckedDriver;
use closecall_controllers::{
    DriverInput, DriverNote, EgoCommand, EgoController, EgoInput, EgoState, MisSettings, Neighbours, Odometry,
    SensorAvailability,
};
use closecall_sensors::{Health, NoiseKey, Perception, Scene, SceneVehicle};
use closecall_traffic::{CONTROL_STEP, ENGAGEMENT_CLOSING_MPS, ENGAGEMENT_GAP_M, Measured, Track};

use super::events::Events;
use super::humans::{Human, humans, weave};
use super::margins::MarginMeter;
use super::mis_log::{EgoNow, MisLog};
use super::moments::Moments;
use super::phase::{AFTER_COLLISION, Encounter};
use super::{Arm, Happening, MarginsNow, Observer, RunKey, SampleError, StepView};
use crate::outcome::{EndReason, Moment, Outcome, Phase};
use crate::scenario::Scenario;
use crate::world::{Action, Placed, World};

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
    command: Option<EgoCommand>,
    // Buffers, kept from step to step.
    neighbours: Vec<Neighbours>,
    tracks: Vec<Track>,
    margins: MarginsNow,
    actions: Vec<Action>,
    others: Vec<SceneVehicle>,
    vehicles: Vec<SceneVehicle>,
    fronts: Vec<(Measured, Measured)>,
}

impl<'a> Run<'a> {
    pub(super) fn new(scenario: &'a Scenario, key: RunKey, arm: &'a Arm) -> Result<Self, SampleError> {
        let placed = scenario
            .actors
            .iter()
            .map(|actor| Placed {
                id: actor.id.clone(),
                vehicle: actor.vehicle,
                state: actor.start,
                weave: weave(actor, &scenario.road, key),
            })
            .collect();
        let world = World::new(scenario.road, scenario.environment.friction, scenario.physics_step, placed);
        let CheckedDriver::Ego(settings) = &scenario.actors[scenario.ego].driver else {
            unreachable!("a checked scenario has its ego stack at `ego`")
        };
        let margins =
            MarginsNow::new(world.state(scenario.ego), &Neighbours::default(), [0.0, scenario.road.lane_width_m()]);
        let sensors = match arm.sensors {
            Some(mode) => scenario.sensors.with_mode(mode),
            None => scenario.sensors,
        };
        Ok(Self {
            scenario,
            key,
            arm,
            perception: sensors.build(&NoiseKey {
                seed: key.seed,
                sample: key.sample,
                ego: scenario.ego_id().clone(),
                actors: scenario.actors.iter().map(|actor| actor.id.clone()).collect(),
            })?,
            controller: arm.controller.build(settings),
            humans: humans(scenario, key),
            events: Events::new(scenario),
            encounter: Encounter::default(),
            meter: MarginMeter::new(scenario.physics_step.s()),
            mis: MisLog::default(),
            moments: Moments::default(),
            critical_gap_m: settings.mis().unwrap_or(&MisSettings::PAPER).critical_gap_m,
            command: None,
            neighbours: vec![Neighbours::default(); world.len()],
            tracks: Vec::new(),
            margins,
            actions: vec![Action::default(); world.len()],
            others: Vec::with_capacity(world.len()),
            vehicles: Vec::with_capacity(world.len()),
            fronts: Vec::with_capacity(world.len()),
            world,
        })
    }

    pub(super) fn is_control_step(&self) -> bool {
        self.world.time().is_multiple_of(CONTROL_STEP)
    }

    /// Shows how everyone moves, at each step of the physics.
    pub(super) fn show_motion(&self, observer: &mut dyn Observer) {
        observer.moved(self.world.time(), &mut (0..self.world.len()).map(|actor| *self.world.state(actor)));
    }

    /// Works out who is around whom, E's margins, and the phase of the encounter.
    pub(super) fn look_around(&mut self, observer: &mut dyn Observer) {
        for actor in 0..self.world.len() {
            self.neighbours[actor] = self.world.neighbours(actor);
        }
        let ego = self.scenario.ego;
        let own = self.world.state(ego);
        self.margins = MarginsNow::new(own, &self.neighbours[ego], self.widths_m(ego));
        if self.world.is_wrecked(ego) {
            return;
        }
        self.meter.take(own, &self.margins);
        let follower = self.margins.follower.zip(self.margins.thw_rear_s.ok());
        let before = self.encounter.phase();
        let phase = self.encounter.update(&self.world, ego, follower);
        if phase != before {
            observer.happening(self.world.time(), &Happening::PhaseChanged { to: phase });
        }
    }

    /// Lets E measure, and its controller decide, unless E has lost control.
    pub(super) fn perceive_and_control(&mut self, observer: &mut dyn Observer) -> Result<(), SampleError> {
        let ego = self.scenario.ego;
        self.list_vehicles();
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
                odometry: self.odometry(),
                road: &self.scenario.road,
                tracks: &self.tracks,
                sensors: availability(self.perception.as_ref()),
            };
            let command = self.controller.step(&input)?;
            if !command.acceleration_mps2.is_finite() {
                return Err(SampleError::Command { value: command.acceleration_mps2, time });
            }
            self.take_command(command, observer);
        }
        self.show(observer);
        Ok(())
    }

    fn take_command(&mut self, command: EgoCommand, observer: &mut dyn Observer) {
        let time = self.world.time();
        let from = self.command.map_or(EgoState::Following, |last| last.state);
        if command.state != from {
            let changed = Happening::EgoStateChanged { from, to: command.state, reason: command.reason };
            observer.happening(time, &changed);
        }
        self.command = Some(command);
        let ego = self.scenario.ego;
        let is_critical = self.encounter.reaches(&self.world, ego, self.critical_gap_m);
        self.note_moments(is_critical);
        self.mis.take(&EgoNow {
            time,
            command: &command,
            speed_mps: self.world.state(ego).speed_mps,
            thw_front_s: self.margins.thw_front_s,
            is_critical,
        });
    }

    /// Notes which moments of the encounter are now.
    fn note_moments(&mut self, is_critical: bool) {
        let time = self.world.time();
        let own_mps = self.world.state(self.scenario.ego).speed_mps;
        let is_near = self.margins.follower.is_some_and(|rear| {
            let closing_mps = self.world.state(rear).speed_mps - own_mps;
            self.margins.gap_rear_m.is_ok_and(|gap_m| gap_m <= ENGAGEMENT_GAP_M)
                && closing_mps >= ENGAGEMENT_CLOSING_MPS
        });
        let brakes = self.margins.lead.is_ok_and(|lead| self.world.state(lead.actor).brake_light);
        for (moment, is_now) in [
            (Moment::RearNear, is_near),
            (Moment::CriticalDistance, is_critical),
            (Moment::FrontBrakes, brakes),
            (Moment::Concluded, self.encounter.phase() == Phase::After),
        ] {
            if is_now {
                self.moments.note(moment, time);
            }
        }
    }

    /// Fills the lists of vehicles that sensors and observers see.
    fn list_vehicles(&mut self) {
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
        // The sensors meet the others in the order of their names: what they draw does not depend on the list's order.
        let others = self.world.by_name().iter().filter(|actor| **actor != self.scenario.ego);
        self.others.extend(others.map(|&actor| self.vehicles[actor]));
    }

    /// The width of a vehicle, and that of the lanes [m].
    fn widths_m(&self, actor: usize) -> [f64; 2] {
        [self.world.vehicle(actor).dimensions.width_m, self.scenario.road.lane_width_m()]
    }

    fn odometry(&self) -> Odometry {
        let ego = self.scenario.ego;
        let state = self.world.state(ego);
        let lane = self.scenario.road.lane_at(state.d_m);
        let size = self.world.vehicle(ego).dimensions;
        Odometry {
            speed_mps: state.speed_mps,
            acceleration_mps2: state.acceleration_mps2,
            yaw_rate_radps: state.yaw_rate_radps,
            lane,
            lane_offset_m: state.d_m - self.scenario.road.lane_centre_m(lane),
            length_m: size.length_m,
            width_m: size.width_m,
        }
    }

    fn show(&mut self, observer: &mut dyn Observer) {
        let Some(command) = &self.command else { return };
        self.fronts.clear();
        for actor in 0..self.world.len() {
            let now = MarginsNow::new(self.world.state(actor), &self.neighbours[actor], self.widths_m(actor));
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

    /// Lets the human drivers and the scenario's events decide on the state at t.
    pub(super) fn drive(&mut self, observer: &mut dyn Observer) -> Result<(), SampleError> {
        let time = self.world.time();
        self.events.update(&self.world, |event| {
            observer.happening(time, &Happening::EventTriggered { event: event.to_owned() });
        });
        let ego = self.scenario.ego;
        let asked_mps2 = self.command.map_or(0.0, |command| command.acceleration_mps2);
        self.actions[ego] = Action { acceleration_mps2: asked_mps2, ..Action::default() };
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
                changing_to: self.world.changing_to(actor),
                lateral_deviation_m: self.world.lateral_deviation_m(actor),
                desired_speed_offset_mps: human.wander.as_mut().map_or(0.0, |wander| wander.at(time)),
            };
            let action = human
                .driver
                .step(&input, &mut human.rng)
                .map_err(|source| SampleError::Driver { actor: self.scenario.actors[actor].id.clone(), source })?;
            if let Some(note) = action.note {
                if note == DriverNote::CutOutStarted {
                    self.events.cut_out_started(actor, time);
                    if !self.world.is_wrecked(ego) && self.margins.follower == Some(actor) {
                        self.moments.note(Moment::CutOut, time);
                    }
                }
                observer.happening(time, &Happening::DriverNote { actor, note });
            }
            self.actions[actor] = Action {
                acceleration_mps2: self
                    .events
                    .asked_mps2(actor, &self.world)
                    .map_or(action.acceleration_mps2, |event_mps2| event_mps2.min(action.acceleration_mps2)),
                lane_change: action.lane_change,
                indicator: action.indicator,
            };
        }
        Ok(())
    }

    /// Moves the world on by one step.
    pub(super) fn advance(&mut self, observer: &mut dyn Observer) {
        let known = self.world.collisions().len();
        self.world.step(&self.actions, self.encounter.phase());
        for place in known..self.world.collisions().len() {
            let collision = &self.world.collisions()[place];
            if collision.involves(self.scenario.ego_id()) {
                let ahead = self.is_ahead_of_ego(place);
                self.meter.touched(ahead);
            }
            observer.happening(collision.time, &Happening::Collision(collision.clone()));
        }
    }

    /// True where the other vehicle of a collision of E has its centre ahead of E's.
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

    /// Why the run is over, if it is.
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

    /// True where E stands, and so does everyone behind it and the one ahead of it: nothing can happen to E any more.
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

fn availability(perception: &dyn Perception) -> SensorAvailability {
    let health = perception.health();
    SensorAvailability {
        front: health.front != Health::Failed,
        surround: health.surround != Health::Failed,
        rear: health.rear != Health::Failed,
    }
}
