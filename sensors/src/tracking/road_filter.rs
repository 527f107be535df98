//! The filter of one track, in road coordinates: one axis along the road, one across.
//!
//! Along, it is the face that E sees which is followed (a follower's front): it is measured, and the gap to it is what
//! counts. Across, it is the vehicle's middle line at its centre; the front's middle lies half a length further along
//! the heading, and so by ½·L·v_d/v_s further to the side.

use super::axis::{AxisEstimate, AxisFilter, AxisFit, AxisMeasurement};
use super::motion::{ACROSS, ALONG, Behind, EgoRear, Situation};
use crate::ego_frame::EgoFrame;
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

/// Speed of what is seen for the first time: E's own, within this [m/s]. Wide enough for a parked vehicle at 3 σ.
const SPEED_PRIOR_SD_MPS: f64 = 10.0;
/// Speed across the road of what is seen for the first time [m/s].
const LATERAL_SPEED_PRIOR_SD_MPS: f64 = 0.7;
/// Position before the first measurement: nothing in particular [m].
const POSITION_PRIOR_SD_M: f64 = 1_000.0;
/// The slow part of the measurement's errors changes with the time [s] and with the distance to E [m], as the beams
/// wander over the vehicle.
const SLOW_TIME_S: f64 = 5.0;
const SLOW_WAY_M: f64 = 5.0;
/// How well half of a length is taken to be known [m]: cars are 3.6 to 5.2 m long, of which a follower shows nothing, and
/// half of that lies within ±0.4 m of the typical one. The same is taken where the length was seen, and for trucks: it counts
/// only while a vehicle moves across the road.
const HALF_LENGTH_SD_M: f64 = 0.4;
/// Below this speed the direction of motion says nothing about the heading [m/s].
pub(crate) const HEADING_SPEED_MPS: f64 = 3.0;

/// A face that was measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measurement {
    pub(super) along: AxisMeasurement,
    pub(super) across: AxisMeasurement,
}

impl Measurement {
    /// Across the road, as seen of a vehicle of this half length that moves so: its front's middle lies half a length along
    /// the heading from its centre, as well as the length is known.
    fn across_of(&self, half_m: f64, [along, across]: &[AxisEstimate; 2]) -> AxisMeasurement {
        if !(along.speed_mps > HEADING_SPEED_MPS) {
            return self.across;
        }
        let unknown_m = HALF_LENGTH_SD_M * across.speed_mps / along.speed_mps;
        let lever_s = self.across.lever_s + half_m / along.speed_mps;
        AxisMeasurement { lever_s, slow_sd_m: self.across.slow_sd_m.hypot(unknown_m), ..self.across }
    }

    pub(super) fn is_finite(&self) -> bool {
        [&self.along, &self.across]
            .iter()
            .all(|axis| (axis.position_m + axis.white_sd_m + axis.slow_sd_m + axis.lever_s).is_finite())
    }
}

/// What is known of the place and the motion of one vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoadFilter {
    along: AxisFilter,
    across: AxisFilter,
}

impl RoadFilter {
    /// A filter at its first measurement, of something about as fast along the road as `speed_mps`.
    pub(super) fn first(measurement: &Measurement, speed_mps: f64) -> Self {
        let at = |axis: &AxisMeasurement| [axis.position_m, POSITION_PRIOR_SD_M];
        let mut filter = Self {
            along: AxisFilter::prior(ALONG, at(&measurement.along), [speed_mps, SPEED_PRIOR_SD_MPS]),
            across: AxisFilter::prior(ACROSS, at(&measurement.across), [0.0, LATERAL_SPEED_PRIOR_SD_MPS]),
        };
        filter.correct(measurement, 0.0);
        filter
    }

    /// Goes on by `t` seconds, to when E's rear is at `ego`.
    pub(super) fn predict(&mut self, t: f64, ego: &EgoRear) {
        let [along, across] = self.now();
        let way_m = (along.speed_mps - ego.speed_mps).abs() * t;
        let slow_share = (-t / SLOW_TIME_S - way_m / SLOW_WAY_M).exp();
        let front_s_m = along.position_m + along.speed_mps * t;
        let situation = Situation::of(&Behind { front_s_m, d_m: across.position_m, speed_mps: along.speed_mps }, ego);
        self.along.predict(t, slow_share, situation);
        self.across.predict(t, slow_share, situation);
    }

    /// Takes in a measurement of the face, half a length of `half_m` before the centre.
    pub(super) fn correct(&mut self, measurement: &Measurement, half_m: f64) {
        let across = measurement.across_of(half_m, &self.now());
        self.along.measure_position(&measurement.along);
        self.across.measure_position(&across);
    }

    /// How well a measurement fits to a vehicle of this half length, along and across the road.
    pub(super) fn fit(&self, measurement: &Measurement, half_m: f64) -> [AxisFit; 2] {
        let across = measurement.across_of(half_m, &self.now());
        [self.along.fit(&measurement.along), self.across.fit(&across)]
    }

    /// Along the road (the face) and across it (the centre).
    pub(super) fn now(&self) -> [AxisEstimate; 2] {
        [self.along.now(), self.across.now()]
    }

    /// The same after `horizon_s` without another measurement.
    pub(super) fn ahead(&self, horizon_s: f64) -> [AxisEstimate; 2] {
        [self.along.ahead(horizon_s), self.across.ahead(horizon_s)]
    }
}

/// State, covariance and heading in E's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EgoEstimate {
    /// [x, y, vx, vy]
    pub(crate) state: Vector4<f64>,
    pub(crate) covariance: Matrix4<f64>,
    pub(crate) heading_rad: f64,
}

/// From the axes of the road to E's frame. The covariance is that of the two axes, turned.
pub(crate) fn in_ego_frame([along, across]: &[AxisEstimate; 2], frame: &EgoFrame<'_>) -> EgoEstimate {
    let point = frame.point(along.position_m, across.position_m);
    let (sin, cos) = point.road_yaw_rad.sin_cos();
    let path_scale = frame.path_scale(across.position_m);
    let to_ego = Matrix2::new(cos * path_scale, -sin, sin * path_scale, cos);
    let velocity_mps = to_ego * Vector2::new(along.speed_mps, across.speed_mps);
    let turned = |along: f64, across: f64| to_ego * Matrix2::new(along, 0.0, 0.0, across) * to_ego.transpose();
    let cross = turned(along.position_speed_m2ps, across.position_speed_m2ps);
    let mut covariance = Matrix4::zeros();
    covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&turned(along.position_m2, across.position_m2));
    covariance.fixed_view_mut::<2, 2>(0, 2).copy_from(&cross);
    covariance.fixed_view_mut::<2, 2>(2, 0).copy_from(&cross);
    covariance.fixed_view_mut::<2, 2>(2, 2).copy_from(&turned(along.speed_m2ps2, across.speed_m2ps2));
    let moves = along.speed_mps > HEADING_SPEED_MPS;
    EgoEstimate {
        state: Vector4::new(point.x_m, point.y_m, velocity_mps.x, velocity_mps.y),
        covariance,
        heading_rad: if moves { velocity_mps.y.atan2(velocity_mps.x) } else { point.road_yaw_rad },
    }
}
