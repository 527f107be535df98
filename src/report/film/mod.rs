//! What a run looked like: kept in memory until its outcome is known, since only then is it known what mattered.
//!
//! ```text
//!  simulation ─▶ FilmRecorder ─(outcome)─┐
//!                                        ├─▶ Film ─▶ Rerun file │ static figure │ still picture
//!  recorded traffic: a lane change, ──────┘
//!  or an encounter that is re-enacted
//! ```
//!
//! A film is the same thing whether its vehicles were simulated or recorded on a road, so that both can be looked at in
//! the same views.

mod comparison;
mod encounter;
mod moments;
mod recorder;
mod scan;
mod story;
mod traffic;

use std::ops::Range;

use closecall_controllers::EgoCommand;
use closecall_sensors::camera::Camera;
use closecall_sensors::{FieldOfView, NoiseKey, Scene, SceneVehicle};
use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::metrics::{Encounter, Moving, closest_encounter};
use closecall_traffic::{Environment, Road, Time, Track, Vehicle, VehicleState};

pub use comparison::{Comparison, Course};
pub use encounter::film_encounter;
pub use recorder::FilmRecorder;
pub(super) use scan::{NO_CLUSTER, Scan};
pub(super) use story::{collision_text, note_words, state_word};
pub use traffic::{TrafficFilmError, film_lane_change};

use crate::outcome::{Collision, Outcome, Phase};
use crate::simulation::{Happening, MarginsNow};

/// Encounters further ahead than this are not looked at [s].
const ENCOUNTER_HORIZON_S: f64 = 10.0;

/// How much of a run is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
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
    pub(super) time: Time,
    /// In the order of the cast; where a vehicle is not there, its nearest state in time.
    pub(super) states: Vec<VehicleState>,
    /// Pitch of each body, positive nose down [rad].
    pub(super) pitches_rad: Vec<f64>,
    pub(super) margins: MarginsNow,
    pub(super) tracks: Vec<Track>,
    /// What E's controller asked for; nothing where E was recorded on a road.
    pub(super) command: Option<EgoCommand>,
    pub(super) phase: Option<Phase>,
    pub(super) rear_field: Option<FieldOfView>,
    pub(super) scan: Option<Scan>,
}

/// A level that a quantity is compared with.
#[derive(Clone, Debug)]
pub(super) struct Limit {
    pub(super) name: String,
    pub(super) value: f64,
}

/// A whole run, from the first frame to the outcome.
#[derive(Clone, Debug)]
pub struct Film {
    pub(super) title: String,
    /// Who controls E: the name of the arm; `recorded` for traffic on a road.
    pub(super) arm: String,
    pub(super) level: Level,
    /// Time from one frame to the next.
    pub(super) period: Time,
    pub(super) road: Road,
    pub(super) environment: Environment,
    pub(super) cast: Vec<Member>,
    /// The place of E among them; in recorded traffic, of the vehicle that changes lanes.
    pub(super) ego: usize,
    pub(super) frames: Vec<Frame>,
    pub(super) happenings: Vec<(Time, Happening)>,
    /// What is to be said about instants beside what happened.
    pub(super) notes: Vec<(Time, String)>,
    /// Accelerations of E that mean something [m/s²].
    pub(super) acceleration_limits: Vec<Limit>,
    /// The rear camera, where one was simulated, and the key of its noise.
    pub(super) camera: Option<(Camera, NoiseKey)>,
    /// How it ended; nothing for recorded traffic.
    pub(super) outcome: Option<Outcome>,
    /// The moment to look at first, where it is known otherwise than from collisions and headways.
    pub(super) highlight: Option<Time>,
    /// What is to be said before its story, as Markdown.
    pub(super) foreword: String,
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
    pub(super) fn collisions(&self) -> &[Collision] {
        self.outcome.as_ref().map_or(&[], |outcome| &outcome.collisions)
    }

    /// The first collision of E, else of anyone.
    pub(super) fn worst_collision(&self) -> Option<&Collision> {
        let ego = self.cast[self.ego].name.as_str();
        let collisions = self.collisions();
        let of_ego = |collision: &&Collision| collision.between.iter().any(|id| id.as_str() == ego);
        collisions.iter().find(of_ego).or(collisions.first())
    }

    /// The times of all frames.
    pub(super) fn times(&self) -> Vec<Time> {
        self.frames.iter().map(|frame| frame.time).collect()
    }

    /// The frame at `time`, or the last one before it; the first where all are later.
    pub(super) fn frame_at(&self, time: Time) -> Option<&Frame> {
        let after = self.frames.partition_point(|frame| frame.time <= time);
        self.frames.get(after.saturating_sub(1))
    }

    /// The places of all vehicles along the road, from the last to the first [m].
    pub(super) fn reach_m(&self) -> (f64, f64) {
        let places = self.frames.iter().flat_map(|frame| frame.states.iter().map(|state| state.s_m));
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s_m| (low.min(s_m), high.max(s_m)))
    }

    /// True where a vehicle is there in a frame.
    pub(super) fn is_there(&self, actor: usize, row: usize) -> bool {
        self.cast[actor].rows.contains(&row)
    }

    /// The closest encounter of E that is ahead in a frame, both vehicles at their present velocities: the soonest.
    pub(super) fn encounter(&self, row: usize) -> Option<Encounter> {
        let frame = &self.frames[row];
        let own = self.moving(frame, self.ego);
        let others = (0..self.cast.len()).filter(|&actor| actor != self.ego && self.is_there(actor, row));
        let ahead =
            others.filter_map(|actor| closest_encounter(&own, &self.moving(frame, actor), ENCOUNTER_HORIZON_S).ok());
        ahead.min_by(|a, b| a.ttce_s.total_cmp(&b.ttce_s))
    }

    fn moving(&self, frame: &Frame, actor: usize) -> Moving {
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
    pub(super) fn scene_vehicles(&self, frame: &Frame) -> (SceneVehicle, Vec<SceneVehicle>) {
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
    pub(super) fn scene<'a>(&'a self, frame: &Frame, ego: SceneVehicle, others: &'a [SceneVehicle]) -> Scene<'a> {
        Scene { time: frame.time, road: &self.road, environment: &self.environment, ego, others }
    }

    /// Where a vehicle stands in E's frame: ahead, to the left [m], and its heading [rad].
    pub(super) fn in_ego_frame(&self, frame: &Frame, actor: usize) -> [f64; 3] {
        let pose = |state: &VehicleState| self.road.plane_pose(state.s_m, state.d_m, state.heading_rad);
        let (own, other) = (pose(&frame.states[self.ego]), pose(&frame.states[actor]));
        let (sin, cos) = own.yaw_rad.sin_cos();
        let (dx, dy) = (other.x_m - own.x_m, other.y_m - own.y_m);
        [cos * dx + sin * dy, cos * dy - sin * dx, other.yaw_rad - own.yaw_rad]
    }
}
