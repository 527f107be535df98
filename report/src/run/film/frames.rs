//! The frames of a film, and what is known of it as a whole.

use std::ops::Range;

use closecall_controllers::EgoCommand;
use closecall_sensors::camera::Camera;
use closecall_sensors::{FieldOfView, NoiseKey, Scene, SceneVehicle};
use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::metrics::{Encounter, Moving, closest_encounter};
use closecall_traffic::{Environment, Road, Time, Track, Vehicle, VehicleState};

use closecall_simulation::outcome::{Collision, Outcome, Phase};
use closecall_simulation::{Happening, MarginsNow};

use super::Scan;

/// Encounters further ahead than this are not looked at [s].
const ENCOUNTER_HORIZON_S: f64 = 10.0;

/// How much of a run is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// States, events and plots
    Events,
    /// The vehicles and what E takes them for as well
    Objects,
    /// The rear sensors' points and pictures as well, where they are simulated
    #[default]
    Full,
}

/// One vehicle of a film.
#[derive(Clone, Debug)]
pub struct Member {
    /// What it is called.
    pub name: String,
    /// What it is.
    pub vehicle: Vehicle,
    /// The frames in which it is there.
    pub rows: Range<usize>,
    /// True where its speed and acceleration are plotted.
    pub is_plotted: bool,
}

/// One instant of a film.
#[derive(Clone, Debug)]
pub struct Frame {
    pub(in crate::run) time: Time,
    /// In the order of the cast; where a vehicle is not there, its nearest state in time.
    pub(in crate::run) states: Vec<VehicleState>,
    /// Pitch of each body, positive nose down [rad].
    pub(in crate::run) pitches_rad: Vec<f64>,
    pub(in crate::run) margins: MarginsNow,
    pub(in crate::run) tracks: Vec<Track>,
    /// What E's controller asked for; nothing where E was recorded on a road.
    pub(in crate::run) command: Option<EgoCommand>,
    pub(in crate::run) phase: Option<Phase>,
    pub(in crate::run) rear_field: Option<FieldOfView>,
    pub(in crate::run) scan: Option<Scan>,
}

/// A level that a quantity is compared with.
#[derive(Clone, Debug)]
pub(in crate::run) struct Limit {
    pub(in crate::run) name: String,
    pub(in crate::run) value: f64,
}

/// A whole run, from the first frame to the outcome.
#[derive(Clone, Debug)]
pub struct Film {
    pub(in crate::run) title: String,
    /// Who controls E: the name of the arm; `recorded` for traffic on a road.
    pub(in crate::run) arm: String,
    pub(in crate::run) level: Level,
    /// Time from one frame to the next.
    pub(in crate::run) period: Time,
    pub(in crate::run) road: Road,
    pub(in crate::run) environment: Environment,
    pub(in crate::run) cast: Vec<Member>,
    /// The place of E among them; in recorded traffic, of the vehicle that changes lanes.
    pub(in crate::run) ego: usize,
    pub(in crate::run) frames: Vec<Frame>,
    pub(in crate::run) happenings: Vec<(Time, Happening)>,
    /// What is to be said about instants beside what happened.
    pub(in crate::run) notes: Vec<(Time, String)>,
    /// Accelerations of E that mean something [m/s²].
    pub(in crate::run) acceleration_limits: Vec<Limit>,
    /// The rear camera, where one was simulated, and the key of its noise.
    pub(in crate::run) camera: Option<(Camera, NoiseKey)>,
    /// How it ended; nothing for recorded traffic.
    pub(in crate::run) outcome: Option<Outcome>,
    /// The moment to look at first, where it is known otherwise than from collisions and headways.
    pub(in crate::run) highlight: Option<Time>,
    /// What is to be said before its story, as Markdown.
    pub(in crate::run) foreword: String,
}

impl Film {
    /// Puts a text in Markdown before the story.
    #[must_use]
    pub fn with_foreword(self, foreword: String) -> Self {
        Self { foreword, ..self }
    }

    /// Plots the speeds and accelerations of the first `count` vehicles only.
    #[must_use]
    pub fn plotting_first(mut self, count: usize) -> Self {
        for (place, member) in self.cast.iter_mut().enumerate() {
            member.is_plotted = place < count;
        }
        self
    }

    /// What the film is called.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Who controls E; `recorded` for traffic on a road.
    pub fn arm(&self) -> &str {
        &self.arm
    }

    /// How the run ended; nothing for recorded traffic.
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    /// Every first touch of two vehicles.
    pub(in crate::run) fn collisions(&self) -> &[Collision] {
        self.outcome.as_ref().map_or(&[], |outcome| &outcome.collisions)
    }

    /// The first collision of E, else of anyone.
    pub(in crate::run) fn worst_collision(&self) -> Option<&Collision> {
        let ego = self.cast[self.ego].name.as_str();
        let collisions = self.collisions();
        let of_ego = |collision: &&Collision| collision.between.iter().any(|id| id.as_str() == ego);
        collisions.iter().find(of_ego).or(collisions.first())
    }

    /// The times of all frames.
    pub(in crate::run) fn times(&self) -> Vec<Time> {
        self.frames.iter().map(|frame| frame.time).collect()
    }

    /// The frame at `time`, or the last one before it; the first where all are later.
    pub(in crate::run) fn frame_at(&self, time: Time) -> Option<&Frame> {
        let after = self.frames.partition_point(|frame| frame.time <= time);
        self.frames.get(after.saturating_sub(1))
    }

    /// The places of all vehicles along the road, from the last to the first [m].
    pub(in crate::run) fn reach_m(&self) -> (f64, f64) {
        let places = self.frames.iter().flat_map(|frame| frame.states.iter().map(|state| state.s_m));
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s_m| (low.min(s_m), high.max(s_m)))
    }

    /// True where a vehicle is there in a frame.
    pub(in crate::run) fn is_there(&self, actor: usize, row: usize) -> bool {
        self.cast[actor].rows.contains(&row)
    }

    /// The closest encounter of E that is ahead in a frame, both vehicles at their present velocities: the soonest.
    pub(in crate::run) fn encounter(&self, row: usize) -> Option<Encounter> {
        let frame = &self.frames[row];
        let own = self.moving(frame, self.ego);
        let others = (0..self.cast.len()).filter(|&actor| actor != self.ego && self.is_there(actor, row));
        let ahead =
            others.filter_map(|actor| closest_encounter(&own, &self.moving(frame, actor), ENCOUNTER_HORIZON_S).ok());
        ahead.min_by(|a, b| a.ttce_s.total_cmp(&b.ttce_s))
    }

    pub(super) fn moving(&self, frame: &Frame, actor: usize) -> Moving {
        let state = &frame.states[actor];
        let size = &self.cast[actor].vehicle.dimensions;
        let pose = self.road.plane_pose(state.s_m, state.d_m, state.heading_rad);
        let (sin, cos) = pose.yaw_rad.sin_cos();
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

    /// The vehicles of a frame as the sensors saw them, E first in what is returned.
    pub(in crate::run) fn scene_vehicles(&self, frame: &Frame) -> (SceneVehicle, Vec<SceneVehicle>) {
        let vehicle = |actor: usize| SceneVehicle {
            actor,
            vehicle: self.cast[actor].vehicle,
            state: frame.states[actor],
            pitch_rad: frame.pitches_rad[actor],
        };
        let others = (0..self.cast.len()).filter(|&actor| actor != self.ego).map(vehicle).collect();
        (vehicle(self.ego), others)
    }

    /// The scene of a frame.
    pub(in crate::run) fn scene<'a>(
        &'a self,
        frame: &Frame,
        ego: SceneVehicle,
        others: &'a [SceneVehicle],
    ) -> Scene<'a> {
        Scene { time: frame.time, road: &self.road, environment: &self.environment, ego, others }
    }

    /// Where a vehicle stands in E's frame: ahead, to the left [m], and its heading [rad].
    pub(in crate::run) fn in_ego_frame(&self, frame: &Frame, actor: usize) -> [f64; 3] {
        let pose = |state: &VehicleState| self.road.plane_pose(state.s_m, state.d_m, state.heading_rad);
        let (own, other) = (pose(&frame.states[self.ego]), pose(&frame.states[actor]));
        let (sin, cos) = own.yaw_rad.sin_cos();
        let (dx, dy) = (other.x_m - own.x_m, other.y_m - own.y_m);
        [cos * dx + sin * dy, cos * dy - sin * dx, other.yaw_rad - own.yaw_rad]
    }
}
