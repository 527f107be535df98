//! The filter of one track in road coordinates, with one axis along the road and one across.
//!
//! Along the road, the filter follows the face that the ego sees (a follower's front): the face is
//! measured, and it defines the gap. Across the road, the filter follows the vehicle's centre. The
//! middle of the front lies half a length ahead of the centre along the heading, and is therefore
//! offset by ½·L·v_d/v_s to the side (L: length; v_s, v_d: speeds along and across the road).

use super::axis::{AxisEstimate, AxisFilter, AxisFit, AxisMeasurement};
use super::box_use::Innovation;
use super::motion::{ACROSS_MODES, ALONG_MODES, EgoRear, RearVehicle, Situation};
use crate::tracking::WheelFronts;
use crate::tracking::gaussian::Gaussian;
use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::maths;
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

/// Prior standard deviation of a vehicle's speed, whose prior mean is the ego's speed (m/s).
///
/// It is wide enough for a parked vehicle, which is at 3 σ.
pub const SPEED_PRIOR_SD_MPS: f64 = 10.0;
/// Prior standard deviation of a vehicle's speed across the road (m/s).
pub const LATERAL_SPEED_PRIOR_SD_MPS: f64 = 0.7;
/// Prior standard deviation of a vehicle's position (m): wide enough to have no influence.
pub const POSITION_PRIOR_SD_M: f64 = 1_000.0;
/// Time after the middle of a face was seen during which parts of it correct nothing across the
/// road (s; assumption). A driver who weaves with 0.12 m/s moves by a tenth of a metre meanwhile,
/// while a part is up to 0.8 m off the middle.
const MIDDLE_KNOWN_S: f64 = 1.0;
/// Correlation time of the slow measurement error (s).
pub const SLOW_TIME_S: f64 = 5.0;
/// Correlation length of the slow measurement error (m). The error also changes with the distance
/// to the ego, as the beams wander over the vehicle.
pub const SLOW_DISTANCE_M: f64 = 5.0;
/// Gate for the squared distance along one axis: the 99.9 % quantile of χ² with one degree of
/// freedom.
const AXIS_GATE: f64 = 10.8;
/// Time without a measurement after which a track follows another sensor (s): a sensor of 10 Hz may
/// lose a scan. A sensor of less than 4 Hz is followed only where no other sensor measures.
const FOLLOWED_S: f64 = 0.25;
/// Acceleration of a manoeuvre that may have begun since the latest measurement of the sensor that
/// a track follows (m/s²): the acceleration in the allowance of the gate.
const MANOEUVRE_MPS2: f64 = 2.5;
/// Standard deviation of half of a vehicle's length (m).
///
/// Cars are 3.6 to 5.2 m long, and a follower shows nothing of its length. Half of the length is
/// therefore within ±0.4 m of the typical one. The same value is used for measured lengths and for
/// trucks: it matters only while a vehicle moves across the road.
const HALF_LENGTH_SD_M: f64 = 0.4;
/// Speed below which the direction of motion does not determine the heading (m/s).
const HEADING_SPEED_MPS: f64 = 3.0;

/// The measured position of a vehicle's face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measurement {
    pub(crate) along: AxisMeasurement,
    pub(crate) across: AxisMeasurement,
    /// Whether a part of the face was seen, such as a lamp, whose place on the vehicle is unknown.
    pub(crate) is_part: bool,
    /// Whether the middle of the face was seen.
    pub(crate) knows_middle: bool,
    /// The part of the vehicle that was seen.
    pub(crate) seen: Span,
}

/// The part of a vehicle that a scan shows, in road axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// Whether the field of view cuts off the vehicle's side, so that the face is out of view.
    pub(crate) is_cut: bool,
    /// Whether a front is seen: both of its edges, or a class that only a front shows.
    pub(crate) is_face: bool,
    /// Positions along the road of the rearmost and of the foremost point (m).
    pub(crate) along_m: [f64; 2],
    /// Positions across the road of the rightmost and of the leftmost point (m).
    pub(crate) across_m: [f64; 2],
    /// Spacing of the columns on the side at these two points (m), infinite if no side is seen.
    pub(crate) spacing_m: [f64; 2],
    /// The fronts of its wheels, as positions along the road (m).
    pub(crate) wheels: WheelFronts,
    /// Height of the highest point (m).
    pub(crate) top_m: f64,
    /// Number of points.
    pub(crate) points: usize,
}

impl Measurement {
    /// Returns the measurement across the road for a vehicle with half the length `half_length_m`
    /// and the given motion.
    ///
    /// It accounts for the offset between the middle of the front and the centre, and for the
    /// uncertainty of the length.
    fn across_for(&self, half_length_m: f64, [along, across]: &[AxisEstimate; 2]) -> AxisMeasurement {
        if !(along.speed_mps > HEADING_SPEED_MPS) {
            return self.across;
        }
        let offset_sd_m = HALF_LENGTH_SD_M * across.speed_mps / along.speed_mps;
        let time_offset_s = self.across.time_offset_s + half_length_m / along.speed_mps;
        AxisMeasurement { time_offset_s, slow_sd_m: maths::hypot(self.across.slow_sd_m, offset_sd_m), ..self.across }
    }

    /// Returns the variances of the slow error along and across the road (m²).
    fn slow_m2(&self) -> [f64; 2] {
        [self.along, self.across].map(|axis| axis.slow_sd_m * axis.slow_sd_m)
    }

    /// Returns whether all values are finite.
    pub(crate) fn is_finite(&self) -> bool {
        [&self.along, &self.across]
            .iter()
            .all(|axis| (axis.position_m + axis.white_sd_m + axis.slow_sd_m + axis.time_offset_s).is_finite())
    }
}

/// The sensor that a filter follows along one axis.
#[derive(Clone, Copy, Debug)]
struct Followed {
    sensor: usize,
    /// Time since its latest measurement (s).
    age_s: f64,
    /// Position and variance of that measurement (m, m²).
    position_m: f64,
    variance_m2: f64,
}

/// The filter for the position and motion of one vehicle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoadFilter {
    along: AxisFilter,
    across: AxisFilter,
    /// Variance of the slow error along and across the road, as it is smoothed over the
    /// measurements (m²).
    slow_m2: [f64; 2],
    /// Share of the slow error along and across the road that remains since the latest measurement.
    slow_share: [f64; 2],
    /// Time since the middle of the face was last seen (s); infinite if it has not been, or a part
    /// has counted since.
    since_middle_s: f64,
    /// The sensor that is followed along and across the road.
    followed: [Followed; 2],
}

impl RoadFilter {
    /// Creates a filter at its first measurement, which is one of `sensor`. The prior speed along
    /// the road is `speed_mps`.
    pub(crate) fn new(measurement: &Measurement, speed_mps: f64, sensor: Option<usize>) -> Self {
        let at = |axis: &AxisMeasurement| Gaussian::new(axis.position_m, POSITION_PRIOR_SD_M);
        let along_mps = Gaussian::new(speed_mps, SPEED_PRIOR_SD_MPS);
        let across_mps = Gaussian::new(0.0, LATERAL_SPEED_PRIOR_SD_MPS);
        let mut filter = Self {
            along: AxisFilter::prior(ALONG_MODES, at(&measurement.along), along_mps),
            across: AxisFilter::prior(ACROSS_MODES, at(&measurement.across), across_mps),
            slow_m2: measurement.slow_m2(),
            slow_share: [1.0; 2],
            since_middle_s: f64::INFINITY,
            followed: [Followed { sensor: 0, age_s: f64::INFINITY, position_m: 0.0, variance_m2: 0.0 }; 2],
        };
        filter.correct(measurement, 0.0, sensor);
        filter
    }

    /// Predicts by `step_s`, to the time at which the ego's rear is at `ego`.
    pub(crate) fn predict(&mut self, step_s: f64, ego: &EgoRear) {
        let [along, across] = self.estimate();
        let distance_m = (along.speed_mps - ego.speed_mps).abs() * step_s;
        let slow_share = maths::exp(-step_s / SLOW_TIME_S - distance_m / SLOW_DISTANCE_M);
        let front_s_m = along.position_m + along.speed_mps * step_s;
        let situation =
            Situation::of(&RearVehicle { front_s_m, d_m: across.position_m, speed_mps: along.speed_mps }, ego);
        self.along.predict(step_s, slow_share, situation);
        self.across.predict(step_s, slow_share, situation);
        self.slow_share = self.slow_share.map(|share| share * slow_share);
        self.since_middle_s += step_s;
        self.followed.iter_mut().for_each(|followed| followed.age_s += step_s);
    }

    /// Corrects the filter with a measurement of the face, which lies half a length of
    /// `half_length_m` ahead of the centre.
    ///
    /// A part says nothing across the road for a while after the middle has been seen: one side of
    /// the mirror may see the plate, and the other always the same lamp, whose distance from the
    /// middle never averages out.
    ///
    /// Along each axis, the filter follows one sensor. A measurement of another sensor that
    /// contradicts the followed sensor corrects nothing: two sensors, one of them misaligned, would
    /// pull the track to and fro in every scan, always in the same order.
    pub(crate) fn correct(&mut self, measurement: &Measurement, half_length_m: f64, sensor: Option<usize>) {
        let estimate = self.estimate();
        if Self::counts(&mut self.followed[0], &measurement.along, &estimate[0], sensor) {
            self.smooth(0, measurement);
            self.along.measure_position(&self.smoothed(measurement).along);
        }
        let has_silent_part = measurement.is_part && self.is_middle_known();
        let across = measurement.across_for(half_length_m, &estimate);
        if has_silent_part || !Self::counts(&mut self.followed[1], &across, &estimate[1], sensor) {
            return;
        }
        let is_first_part = measurement.is_part && self.since_middle_s.is_finite();
        if is_first_part || measurement.knows_middle && !self.is_middle_known() {
            // The slow error so far was the error of the middle, or of parts.
            self.across.renew_slow_error();
            self.slow_m2[1] = measurement.slow_m2()[1];
            self.slow_share[1] = 1.0;
        } else {
            self.smooth(1, measurement);
        }
        if measurement.knows_middle {
            self.since_middle_s = 0.0;
        } else if measurement.is_part {
            self.since_middle_s = f64::INFINITY;
        }
        self.across.measure_position(&self.smoothed(measurement).across_for(half_length_m, &estimate));
    }

    /// Corrects the filter along the road with a position of the face that follows from another
    /// part of the vehicle.
    pub(crate) fn correct_along(&mut self, measured: &AxisMeasurement, sensor: Option<usize>) {
        let [along, _] = self.estimate();
        if Self::counts(&mut self.followed[0], measured, &along, sensor) {
            self.smooth_axis(0, measured.slow_sd_m * measured.slow_sd_m);
            self.along.measure_position(&AxisMeasurement { slow_sd_m: self.slow_m2[0].sqrt(), ..*measured });
        }
    }

    /// Corrects the filter across the road with a position of the centre that follows from a side
    /// of the vehicle.
    pub(crate) fn correct_across(&mut self, measured: &AxisMeasurement, sensor: Option<usize>) {
        let [_, across] = self.estimate();
        if Self::counts(&mut self.followed[1], measured, &across, sensor) {
            self.smooth_axis(1, measured.slow_sd_m * measured.slow_sd_m);
            self.across.measure_position(&AxisMeasurement { slow_sd_m: self.slow_m2[1].sqrt(), ..*measured });
        }
    }

    /// Corrects the filter with a measured speed along the road (m/s).
    pub(crate) fn measure_speed(&mut self, speed_mps: f64, sd_mps: f64) {
        self.along.measure_speed(speed_mps, sd_mps);
    }

    /// Moves the point that the filter follows along the road by `offset_m`, which is known with
    /// the variance `variance_m2`.
    pub(crate) fn shift_along(&mut self, offset_m: f64, variance_m2: f64) {
        self.along.shift(offset_m, variance_m2);
        self.followed[0].age_s = f64::INFINITY;
    }

    /// Moves the centre across the road by `offset_m`, which is known with the variance
    /// `variance_m2`.
    pub(crate) fn shift_across(&mut self, offset_m: f64, variance_m2: f64) {
        self.across.shift(offset_m, variance_m2);
        self.followed[1].age_s = f64::INFINITY;
    }

    /// Returns whether the measurement of a sensor along or across the road counts. It counts if it
    /// comes from the camera alone (`None`), or from the sensor that the axis follows. It counts if
    /// the followed sensor has not measured for a while: the axis then follows the new sensor. It
    /// also counts if it agrees with the last measurement of the followed sensor. `estimate` is the
    /// estimate of the axis.
    fn counts(
        followed: &mut Followed,
        measurement: &AxisMeasurement,
        estimate: &AxisEstimate,
        sensor: Option<usize>,
    ) -> bool {
        let Some(sensor) = sensor else { return true };
        let [position_m, variance_m2] = measurement.position_now(estimate.speed_mps);
        if followed.sensor == sensor || followed.age_s > FOLLOWED_S {
            *followed = Followed { sensor, age_s: 0.0, position_m, variance_m2 };
            return true;
        }
        let age_s = followed.age_s;
        let off_m = position_m - followed.position_m - estimate.speed_mps * age_s;
        let manoeuvre_m = 0.5 * MANOEUVRE_MPS2 * age_s * age_s;
        let motion_m2 = estimate.speed_variance_m2ps2 * age_s * age_s + manoeuvre_m * manoeuvre_m;
        off_m * off_m <= AXIS_GATE * (variance_m2 + followed.variance_m2 + motion_m2)
    }

    /// Returns whether the middle of the face was seen a short time ago.
    fn is_middle_known(&self) -> bool {
        self.since_middle_s <= MIDDLE_KNOWN_S
    }

    /// Smooths the variance of the slow error along or across the road with the variance of the
    /// latest measurement.
    fn smooth(&mut self, axis: usize, measurement: &Measurement) {
        self.smooth_axis(axis, measurement.slow_m2()[axis]);
    }

    /// Smooths the variance of the slow error along or across the road with a new one (m²).
    fn smooth_axis(&mut self, axis: usize, slow_m2: f64) {
        let new_share = 1.0 - std::mem::replace(&mut self.slow_share[axis], 1.0);
        self.slow_m2[axis] += new_share * (slow_m2 - self.slow_m2[axis]);
    }

    /// Returns the measurement with the smoothed standard deviations of the slow error.
    ///
    /// The slow error is part of the state in units of its standard deviation, and stays the same
    /// while the two sides of the mirror alternate. Their boxes have different standard deviations.
    /// With these, the filter would take the difference between the two sides for information on
    /// the slow error. A part has another slow error than the middle that was just seen.
    fn smoothed(&self, measurement: &Measurement) -> Measurement {
        let with = |axis: AxisMeasurement, slow_m2: f64| AxisMeasurement { slow_sd_m: slow_m2.sqrt(), ..axis };
        let new = |axis: AxisMeasurement| AxisMeasurement {
            white_sd_m: maths::hypot(axis.white_sd_m, axis.slow_sd_m),
            slow_sd_m: 0.0,
            ..axis
        };
        Measurement {
            along: with(measurement.along, self.slow_m2[0]),
            across: match measurement.is_part && self.is_middle_known() {
                true => new(measurement.across),
                false => with(measurement.across, self.slow_m2[1]),
            },
            ..*measurement
        }
    }

    /// Returns how well a measurement fits, along and across the road, for half a length of
    /// `half_length_m`.
    pub(crate) fn fit(&self, measurement: &Measurement, half_length_m: f64) -> [AxisFit; 2] {
        let measurement = self.smoothed(measurement);
        let across = measurement.across_for(half_length_m, &self.estimate());
        [self.along.fit(&measurement.along), self.across.fit(&across)]
    }

    /// Returns the innovations of a measurement, along and across the road, for half a length of
    /// `half_length_m`.
    pub(crate) fn innovation(&self, measurement: &Measurement, half_length_m: f64) -> [Innovation; 2] {
        let measurement = self.smoothed(measurement);
        let across = measurement.across_for(half_length_m, &self.estimate());
        [self.along.innovation(&measurement.along), self.across.innovation(&across)]
    }

    /// Returns the estimates along the road (of the face) and across it (of the centre).
    pub(crate) fn estimate(&self) -> [AxisEstimate; 2] {
        [self.along.estimate(), self.across.estimate()]
    }

    /// Returns the same estimates, predicted by `horizon_s`.
    pub(crate) fn predicted(&self, horizon_s: f64) -> [AxisEstimate; 2] {
        [self.along.predicted(horizon_s), self.across.predicted(horizon_s)]
    }
}

/// State, covariance and heading of a vehicle in the ego's frame.
#[derive(Clone, Copy, Debug)]
pub struct EgoEstimate {
    /// `[x, y, vx, vy]` (m, m/s).
    pub state: Vector4<f64>,
    /// Covariance of `state`.
    pub covariance: Matrix4<f64>,
    /// Heading relative to the ego's (rad).
    pub heading_rad: f64,
}

/// Transforms the estimates along and across the road to the ego's frame. The covariance is rotated
/// with them.
#[inline]
pub fn in_ego_frame([along, across]: &[AxisEstimate; 2], frame: &EgoFrame<'_>) -> EgoEstimate {
    let point = frame.point(along.position_m, across.position_m);
    let (sin, cos) = maths::sin_cos(point.road_yaw_rad);
    let path_scale = frame.path_scale(along.position_m, across.position_m);
    let to_ego = Matrix2::new(cos * path_scale, -sin, sin * path_scale, cos);
    let velocity_mps = to_ego * Vector2::new(along.speed_mps, across.speed_mps);
    let turned = |along: f64, across: f64| to_ego * Matrix2::new(along, 0.0, 0.0, across) * to_ego.transpose();
    let cross = turned(along.position_speed_covariance_m2ps, across.position_speed_covariance_m2ps);
    let mut covariance = Matrix4::zeros();
    covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&turned(along.position_variance_m2, across.position_variance_m2));
    covariance.fixed_view_mut::<2, 2>(0, 2).copy_from(&cross);
    covariance.fixed_view_mut::<2, 2>(2, 0).copy_from(&cross);
    covariance.fixed_view_mut::<2, 2>(2, 2).copy_from(&turned(along.speed_variance_m2ps2, across.speed_variance_m2ps2));
    let moves = along.speed_mps > HEADING_SPEED_MPS;
    EgoEstimate {
        state: Vector4::new(point.x_m, point.y_m, velocity_mps.x, velocity_mps.y),
        covariance,
        heading_rad: if moves { maths::atan2(velocity_mps.y, velocity_mps.x) } else { point.road_yaw_rad },
    }
}

#[cfg(test)]
mod tests;
