//! The film of a run: its frames, its vehicles, and the data of the run as a whole.

use std::ops::Range;

use closecall_controllers::EgoCommand;
use closecall_sensors::camera::Camera;
use closecall_sensors::faults::StatedFault;
use closecall_sensors::{
    FieldOfView, Health, NoiseKey, RadarReturn, RearImage, Scene, SceneVehicle, SensorAlarms, SensorHealth,
};
use closecall_studies::attribution::Avoidable;
use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::metrics::{Encounter, Moving, closest_encounter};
use closecall_traffic::{Environment, Road, Time, Track, Vehicle, VehicleState, maths};

use closecall_scenarios::causal::VehicleLetters;
use closecall_scenarios::outcome::{Collision, Outcome, Phase};
use closecall_simulation::{CurrentMargins, RunEvent};

use super::Scan;
use super::knowledge::RearSeen;

/// Closest encounters later than this are ignored (s).
const ENCOUNTER_HORIZON_S: f64 = 10.0;

/// The level of detail of a film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The states of the vehicles, the events and the plots.
    Events,
    /// Also the 3D scene: the vehicles, and the ego's perception.
    Objects,
    /// Also the LiDAR points and camera images of the rear sensors, if these are simulated.
    #[default]
    Full,
}

/// A vehicle of a film.
#[derive(Clone, Debug)]
pub struct FilmActor {
    /// Name of the actor.
    pub name: String,
    /// Class and dimensions of the vehicle.
    pub vehicle: Vehicle,
    /// Indices of the frames in which the vehicle is present.
    pub present_frames: Range<usize>,
    /// The vehicle's part in the film, which decides its colour.
    pub part: Part,
    /// True if the plots show its speed and acceleration.
    pub is_plotted: bool,
}

/// The part of a vehicle in a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The ego; in the film of a recorded lane change, the vehicle that changes lanes.
    Ego,
    /// The lead vehicle.
    Lead,
    /// The rear vehicle.
    Rear,
    /// Another vehicle of the scenario, with its number among the other vehicles.
    Other(usize),
    /// A vehicle that is part of the traffic around. It is grey and has no name.
    Background,
}

impl Part {
    /// Returns the part of the vehicle with an index, where the ego, the lead vehicle and the rear
    /// vehicle have these indices.
    pub(super) fn of_index(index: usize, ego: usize, [lead, rear]: [Option<usize>; 2]) -> Self {
        let parts = [(Some(ego), Self::Ego), (lead, Self::Lead), (rear, Self::Rear)];
        let part = |index: usize| parts.iter().find(|(of, _)| *of == Some(index)).map(|(_, part)| *part);
        part(index).unwrap_or_else(|| Self::Other((0..index).filter(|&before| part(before).is_none()).count()))
    }
}

/// One instant of a film.
#[derive(Clone, Debug)]
pub struct Frame {
    pub(in crate::run) time: Time,
    /// States of the vehicles, in the order of [`Film::actors`]. A vehicle that is absent has the
    /// nearest of its states in time.
    pub(in crate::run) states: Vec<VehicleState>,
    /// Pitch of each body, positive nose down (rad).
    pub(in crate::run) pitches_rad: Vec<f64>,
    pub(in crate::run) margins: CurrentMargins,
    /// Tracks that the ego's sensors report; empty below [`Level::Objects`].
    pub(in crate::run) tracks: Vec<Track>,
    /// The vehicles behind the ego, as its rear sensors know them.
    pub(in crate::run) rear_seen: Vec<RearSeen>,
    /// Command of the ego's controller; `None` for recorded traffic.
    pub(in crate::run) command: Option<EgoCommand>,
    /// Phase of the encounter; `None` for recorded traffic.
    pub(in crate::run) phase: Option<Phase>,
    /// Health of the sensors as the ego knows it; `None` for recorded traffic.
    pub(in crate::run) health: Option<SensorHealth>,
    /// What the monitors of the sensors have noticed; nothing for recorded traffic.
    pub(in crate::run) alarms: SensorAlarms,
    /// Fields of view of the rear sensors; none if they are not simulated or below
    /// [`Level::Objects`].
    pub(in crate::run) rear_fields: Vec<FieldOfView>,
    /// Scan of the rear LiDAR, the first one if there are several, in the frames whose scan is
    /// kept.
    pub(in crate::run) scan: Option<Scan>,
    /// Scans of the other LiDARs with their names, likewise.
    pub(in crate::run) other_scans: Vec<(&'static str, Scan)>,
    /// Health of the rear radars as the ego knows it; `None` without them.
    pub(in crate::run) radar_health: Option<Health>,
    /// Detections of the left and of the right rear radar, in the frames with a new scan; none
    /// below [`Level::Objects`].
    pub(in crate::run) radar_returns: Option<[Vec<RadarReturn>; 2]>,
    /// Images of rear cameras that a network has evaluated as a whole, in the frames in which they
    /// were taken; none below [`Level::Full`].
    pub(in crate::run) rear_images: Vec<RearImage>,
    /// Names of the rear cameras that had failed when the scan was classified, if there are several.
    pub(in crate::run) failed_cameras: Vec<&'static str>,
}

impl Frame {
    /// Returns the index of the vehicle ahead of the ego in its lane.
    pub(in crate::run) fn lead(&self) -> Option<usize> {
        self.margins.lead.ok().map(|lead| lead.actor)
    }

    /// Returns the image of a rear camera, if one was taken that a network has evaluated as a whole.
    pub(in crate::run) fn rear_image(&self, camera: &Camera) -> Option<&RearImage> {
        self.rear_images.iter().find(|image| image.camera == camera.name)
    }

    /// Returns the index of the vehicle behind the ego in its lane.
    pub(in crate::run) fn follower(&self) -> Option<usize> {
        self.margins.follower
    }
}

/// A reference level of a plotted quantity.
#[derive(Clone, Debug)]
pub(in crate::run) struct Limit {
    pub(in crate::run) name: String,
    pub(in crate::run) value: f64,
}

/// A whole run, from its first frame to its outcome, or a stretch of recorded traffic.
#[derive(Clone, Debug)]
pub struct Film {
    pub(in crate::run) title: String,
    /// Name of the arm, which controls the ego; `recorded` for recorded traffic.
    pub(in crate::run) arm: String,
    /// Whether the ego stack of the scenario has a margin increase system. If so, the arm `acc` is
    /// the arm without it.
    pub(in crate::run) has_mis: bool,
    pub(in crate::run) level: Level,
    /// Time between two frames.
    pub(in crate::run) period: Time,
    pub(in crate::run) road: Road,
    pub(in crate::run) environment: Environment,
    /// The vehicles, in the order of the scenario's actors.
    pub(in crate::run) actors: Vec<FilmActor>,
    /// Index of the ego among the actors. In the film of a recorded lane change, the vehicle that
    /// changes lanes is the ego.
    pub(in crate::run) ego: usize,
    pub(in crate::run) frames: Vec<Frame>,
    pub(in crate::run) happenings: Vec<(Time, RunEvent)>,
    /// Texts about instants that no event covers.
    pub(in crate::run) notes: Vec<(Time, String)>,
    /// Reference levels of the ego's acceleration (m/s²).
    pub(in crate::run) acceleration_limits: Vec<Limit>,
    /// The rear cameras in the order of the scenario, each with the key of its noise, if they were
    /// simulated.
    pub(in crate::run) cameras: Vec<(Camera, NoiseKey)>,
    /// The outcome; `None` for recorded traffic.
    pub(in crate::run) outcome: Option<Outcome>,
    /// How each collision of the outcome was avoidable, in its order; `None` if undetermined.
    pub(in crate::run) avoidable: Vec<Option<Avoidable>>,
    /// The letters of the vehicles in texts.
    pub(in crate::run) letters: VehicleLetters,
    /// The faults that were injected.
    pub(in crate::run) faults: Vec<StatedFault>,
    /// The front time headway that the margin increase system is to gain (s); `None` without one.
    pub(in crate::run) goal_s: Option<f64>,
    /// The critical moment, if it follows from something other than collisions and headways.
    pub(in crate::run) highlight: Option<Time>,
    /// Text that precedes the story, in Markdown.
    pub(in crate::run) foreword: String,
    /// Settings of the command line, each as `key=value`.
    pub(in crate::run) settings: Vec<String>,
}

impl Film {
    /// Sets the text, in Markdown, that precedes the story.
    #[must_use]
    pub fn with_foreword(self, foreword: String) -> Self {
        Self { foreword, ..self }
    }

    /// Sets the settings of the command line that the story names.
    #[must_use]
    pub fn with_settings(mut self, settings: impl IntoIterator<Item = String>) -> Self {
        self.settings = settings.into_iter().collect();
        self
    }

    /// Sets the name of the arm, by which several films in one recording differ.
    #[must_use]
    pub fn with_arm(self, arm: String) -> Self {
        Self { arm, ..self }
    }

    /// Makes all vehicles but the first `count` traffic around these: grey, without name and
    /// curves.
    #[must_use]
    pub fn with_plots_of_first(mut self, count: usize) -> Self {
        for actor in self.actors.iter_mut().skip(count) {
            actor.is_plotted = false;
            actor.part = Part::Background;
        }
        self
    }

    /// Gives all vehicles the part of traffic around, except the ego, the lead vehicle, the rear
    /// vehicle, and every vehicle that collides or is ever directly ahead of or behind the ego.
    /// These relevant vehicles are named, but not plotted.
    pub(super) fn mark_relevant(&mut self) {
        let collides = |name: &str| {
            let mut vehicles = self.collisions().iter().flat_map(|collision| &collision.between);
            vehicles.any(|id| id.as_str() == name)
        };
        let is_near = |actor: usize| {
            let mut margins = self.frames.iter().map(|frame| &frame.margins);
            margins.any(|near| near.follower == Some(actor) || near.lead.is_ok_and(|lead| lead.actor == actor))
        };
        let is_relevant: Vec<bool> =
            (0..self.actors.len()).map(|actor| collides(&self.actors[actor].name) || is_near(actor)).collect();
        for (actor, is_relevant) in self.actors.iter_mut().zip(is_relevant) {
            if let Part::Other(_) = actor.part {
                actor.is_plotted = false;
                actor.part = if is_relevant { actor.part } else { Part::Background };
            }
        }
    }

    /// Returns true if a vehicle is named and coloured.
    pub(in crate::run) fn is_main(&self, actor: usize) -> bool {
        self.actors[actor].part != Part::Background
    }

    /// Returns the title of the film.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Returns the name of the arm, which controls the ego; `recorded` for recorded traffic.
    pub fn arm(&self) -> &str {
        &self.arm
    }

    /// Returns the outcome of the run, or `None` for recorded traffic.
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    /// Returns all collisions.
    pub(in crate::run) fn collisions(&self) -> &[Collision] {
        self.outcome.as_ref().map_or(&[], |outcome| &outcome.collisions)
    }

    /// Returns true if a drawing from above has the name of a vehicle: the ego, the lead vehicle
    /// and the rear vehicle have one, and each vehicle that collides.
    pub(in crate::run) fn is_labelled(&self, actor: usize) -> bool {
        matches!(self.actors[actor].part, Part::Ego | Part::Lead | Part::Rear) || self.collides(actor)
    }

    /// Returns true if a vehicle has a part in a collision.
    pub(in crate::run) fn collides(&self, actor: usize) -> bool {
        let name = self.actors[actor].name.as_str();
        self.collisions().iter().any(|collision| collision.between.iter().any(|id| id.as_str() == name))
    }

    /// Returns the first collision of the ego or, if there is none, the first collision of any
    /// vehicles.
    pub(in crate::run) fn worst_collision(&self) -> Option<&Collision> {
        let ego = self.actors[self.ego].name.as_str();
        let collisions = self.collisions();
        let of_ego = |collision: &&Collision| collision.between.iter().any(|id| id.as_str() == ego);
        collisions.iter().find(of_ego).or(collisions.first())
    }

    /// Returns the times of all frames.
    pub(in crate::run) fn times(&self) -> Vec<Time> {
        self.frames.iter().map(|frame| frame.time).collect()
    }

    /// Returns the last frame at or before `time`, or the first frame if all are later.
    pub(in crate::run) fn frame_at(&self, time: Time) -> Option<&Frame> {
        let after = self.frames.partition_point(|frame| frame.time <= time);
        self.frames.get(after.saturating_sub(1))
    }

    /// Returns the smallest and the largest position of any vehicle along the road (m).
    pub(in crate::run) fn s_range_m(&self) -> (f64, f64) {
        let positions = self.frames.iter().flat_map(|frame| frame.states.iter().map(|state| state.s_m));
        positions.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s_m| (low.min(s_m), high.max(s_m)))
    }

    /// Returns true if a vehicle is present in a frame.
    pub(in crate::run) fn is_present(&self, actor: usize, frame_index: usize) -> bool {
        self.actors[actor].present_frames.contains(&frame_index)
    }

    /// Returns the ego's next closest encounter after a frame, or `None` if there is none within
    /// the horizon. Both vehicles are assumed to keep their velocities.
    pub(in crate::run) fn soonest_encounter(&self, frame_index: usize) -> Option<Encounter> {
        let frame = &self.frames[frame_index];
        let ego = self.moving_box(frame, self.ego);
        let others = (0..self.actors.len()).filter(|&actor| actor != self.ego && self.is_present(actor, frame_index));
        let encounters = others
            .filter_map(|actor| closest_encounter(&ego, &self.moving_box(frame, actor), ENCOUNTER_HORIZON_S).ok());
        encounters.min_by(|a, b| a.ttce_s.total_cmp(&b.ttce_s))
    }

    /// Returns the box of a vehicle with its velocity in the plane.
    pub(in crate::run) fn moving_box(&self, frame: &Frame, actor: usize) -> Moving {
        let state = &frame.states[actor];
        let size = &self.actors[actor].vehicle.dimensions;
        let pose = self.road.plane_pose(state.s_m, state.d_m, state.heading_rad);
        let (sin, cos) = maths::sin_cos(pose.yaw_rad);
        Moving {
            shape: OrientedBox {
                x_m: pose.x_m,
                y_m: pose.y_m,
                yaw_rad: pose.yaw_rad,
                length_m: size.length_m,
                width_m: size.width_m,
            },
            vx_mps: state.speed_mps * cos,
            vy_mps: state.speed_mps * sin,
        }
    }

    /// Returns the ego and the other vehicles of a frame as input of the sensor models.
    pub(in crate::run) fn scene_vehicles(&self, frame: &Frame) -> (SceneVehicle, Vec<SceneVehicle>) {
        let vehicle = |actor: usize| SceneVehicle {
            actor,
            vehicle: self.actors[actor].vehicle,
            state: frame.states[actor],
            pitch_rad: frame.pitches_rad[actor],
        };
        let others = (0..self.actors.len()).filter(|&actor| actor != self.ego).map(vehicle).collect();
        (vehicle(self.ego), others)
    }

    /// Returns the scene of a frame, as input of the sensor models.
    pub(in crate::run) fn scene<'a>(
        &'a self,
        frame: &Frame,
        ego: SceneVehicle,
        others: &'a [SceneVehicle],
    ) -> Scene<'a> {
        Scene { time: frame.time, road: &self.road, environment: &self.environment, ego, others }
    }

    /// Returns the pose of a vehicle in the ego frame: x forward (m), y to the left (m), heading
    /// (rad).
    pub(in crate::run) fn in_ego_frame(&self, frame: &Frame, actor: usize) -> [f64; 3] {
        let pose = |state: &VehicleState| self.road.plane_pose(state.s_m, state.d_m, state.heading_rad);
        let (ego, other) = (pose(&frame.states[self.ego]), pose(&frame.states[actor]));
        let (sin, cos) = maths::sin_cos(ego.yaw_rad);
        let (dx, dy) = (other.x_m - ego.x_m, other.y_m - ego.y_m);
        [cos * dx + sin * dy, cos * dy - sin * dx, other.yaw_rad - ego.yaw_rad]
    }
}
