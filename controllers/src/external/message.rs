//! The messages to a controller that is a process: the closed loop writes them, and
//! [`bridge`](super::bridge) reads them. `docs/reference/controllers.md` documents the protocol.

use closecall_traffic::{self as traffic, Road, Side, Source, TrackId, TrackStatus};
use serde::{Deserialize, Serialize};

use super::abi;
use crate::{EgoInput, Front, Odometry, SensorAvailability};

/// The road in the first message to a process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RoadMessage {
    /// Number of lanes.
    pub lanes: u8,
    /// Width of the ego's lane (m); if it changes along the road, the greatest one.
    pub lane_width_m: f64,
    /// Width of each lane (m), from lane 1 on; if it changes along the road, the greatest one.
    pub lane_widths_m: Vec<f64>,
    /// Curvature (1/m), positive to the left; `None` if it changes along the road.
    pub curvature_per_m: Option<f64>,
    /// Speed limit (m/s).
    pub speed_limit_mps: f64,
    /// The side on which others are overtaken.
    pub overtaking_side: Side,
}

impl RoadMessage {
    /// Returns the message of a road for an ego in a lane.
    pub fn of(road: &Road, lane: traffic::Lane) -> Self {
        Self {
            lanes: road.lanes(),
            lane_width_m: road.greatest_lane_width_m(lane),
            lane_widths_m: (1..=road.lanes()).map(|lane| road.greatest_lane_width_m(traffic::Lane(lane))).collect(),
            curvature_per_m: road.constant_curvature_per_m(),
            speed_limit_mps: road.speed_limit_mps(),
            overtaking_side: road.overtaking_side(),
        }
    }
}

/// The message of a control step.
#[derive(Debug, Serialize, Deserialize)]
pub struct StepMessage {
    time_s: f64,
    pub(crate) time_ns: i64,
    pub(crate) odometry: Odometry,
    pub(crate) front: Option<Front>,
    pub(crate) tracks: Vec<TrackMessage>,
    pub(crate) sensors: SensorAvailability,
}

impl StepMessage {
    /// Returns the message of a control step. `front` is the lead vehicle.
    pub fn new(input: &EgoInput<'_>, front: Option<Front>) -> Self {
        Self {
            time_s: input.time.s(),
            time_ns: input.time.ns(),
            odometry: input.odometry,
            front,
            tracks: input.tracks.iter().map(TrackMessage::from).collect(),
            sensors: input.sensors,
        }
    }
}

/// A track, as the messages have it.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct TrackMessage {
    id: TrackId,
    source: Source,
    status: TrackStatus,
    time_s: f64,
    x_m: f64,
    y_m: f64,
    vx_mps: f64,
    vy_mps: f64,
    covariance: [[f64; 4]; 4],
    heading_rad: f64,
    length_m: f64,
    width_m: f64,
    class: Class,
    existence: f64,
    lane: Lane,
}

#[derive(Debug, Serialize, Deserialize)]
struct Class {
    car: f64,
    truck: f64,
    motorcycle: f64,
    background: f64,
}

#[derive(Debug, Serialize, Deserialize)]
struct Lane {
    left: f64,
    own: f64,
    right: f64,
}

impl From<&closecall_traffic::Track> for TrackMessage {
    fn from(track: &closecall_traffic::Track) -> Self {
        let [car, truck, motorcycle, background] = track.class.0;
        let [left, own, right] = track.lane;
        Self {
            id: track.id,
            source: track.source,
            status: track.status,
            time_s: track.time.s(),
            x_m: track.x_m(),
            y_m: track.y_m(),
            vx_mps: track.vx_mps(),
            vy_mps: track.vy_mps(),
            covariance: std::array::from_fn(|row| std::array::from_fn(|column| track.covariance[(row, column)])),
            heading_rad: track.heading_rad,
            length_m: track.length_m,
            width_m: track.width_m,
            class: Class { car, truck, motorcycle, background },
            existence: track.existence,
            lane: Lane { left, own, right },
        }
    }
}

impl From<&TrackMessage> for abi::Track {
    fn from(track: &TrackMessage) -> Self {
        Self {
            id: track.id.0,
            source: track.source as i32,
            status: track.status as i32,
            reserved: 0,
            time_s: track.time_s,
            x_m: track.x_m,
            y_m: track.y_m,
            vx_mps: track.vx_mps,
            vy_mps: track.vy_mps,
            covariance: std::array::from_fn(|index| track.covariance[index / 4][index % 4]),
            heading_rad: track.heading_rad,
            length_m: track.length_m,
            width_m: track.width_m,
            class: [track.class.car, track.class.truck, track.class.motorcycle, track.class.background],
            existence: track.existence,
            lane: [track.lane.left, track.lane.own, track.lane.right],
        }
    }
}
