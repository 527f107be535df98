//! What the radial speed of a radar detection says about the speed of a track.
//!
//! ```text
//!   radial speed    ṙ = (v − v₀)·e = a·v_s + b·v_d − v₀·e          e: from the sensor to the vehicle
//!   speed           v_s = (ṙ + v₀·e − b·v_d)/a                     a, b: the road's axes, times e
//!   variance        (σ² + b²·var(v_d) + (v − v₀)²_⊥·σ_⊥²/r²)/a²    σ_⊥: position across the line of sight
//! ```
//!
//! The direction e follows from the track, whose position the LiDARs measure to centimetres. The
//! radar knows its angle to a degree only. Range and angle serve to find the track: a detection
//! belongs to the one track that it fits. If it fits two, it corrects none, as a wrong speed does
//! more harm than no speed. The mirror image of a vehicle behind a guard rail fits no track that is
//! not there.

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Road, Time, VehicleState, maths};

use super::axis::AxisEstimate;

/// Gate for the squared distance of a detection from a track in three values (along the road,
/// across it, radial speed): the 99 % quantile of χ² with three degrees of freedom.
const GATE: f64 = 11.34;
/// Least share of the line of sight that lies along the road (assumption): beyond 60°, the radial
/// speed says little of the speed along the road. Plausible: 0.3 to 0.7.
const MIN_ALONG: f64 = 0.5;
/// Standard deviation of the reflecting point across the line of sight (widths of the vehicle;
/// assumption): the point is anywhere on the face. Plausible: 0.25 to 0.5.
const POINT_SD_WIDTHS: f64 = 0.5;

/// A detection of a radar, in the ego's frame at the time of its scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadarDetection {
    /// Position of the sensor ahead of and to the left of the ego's centre (m).
    pub sensor_m: [f64; 2],
    /// Distance from the sensor (m).
    pub range_m: f64,
    /// Azimuth (rad): 0 is straight behind, positive to the ego's left.
    pub azimuth_rad: f64,
    /// Rate of change of the range (m/s): negative if the vehicle approaches.
    pub radial_mps: f64,
    /// Standard deviation of the range (m).
    pub range_sd_m: f64,
    /// Standard deviation of the azimuth (rad).
    pub azimuth_sd_rad: f64,
    /// Standard deviation of the radial speed (m/s).
    pub radial_sd_mps: f64,
}

/// The detections of all radars at one time.
#[derive(Clone, Copy, Debug)]
pub struct RadarScan<'a> {
    /// Time of the scan.
    pub time: Time,
    /// The road from the map.
    pub road: &'a Road,
    /// State of the ego at `time`, from its odometry and its position in the lane.
    pub ego: VehicleState,
    /// The detections of each radar.
    pub detections: [&'a [RadarDetection]; 2],
}

/// A measured speed along the road.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeasuredSpeed {
    /// Speed along the road (m/s).
    pub(super) speed_mps: f64,
    /// Standard deviation of the speed (m/s).
    pub(super) sd_mps: f64,
}

/// What a detection says about a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Match {
    /// Squared distance of the detection from the track, in variances.
    pub(super) squared_distance: f64,
    pub(super) measured: MeasuredSpeed,
}

/// A track as a detection is compared with it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Estimates along the road (of the face) and across it (of the centre).
    pub(super) estimate: [AxisEstimate; 2],
    /// Positions along the road between which the vehicle lies (m).
    pub(super) span_m: [f64; 2],
    /// Width of the vehicle (m).
    pub(super) width_m: f64,
}

impl Candidate {
    /// Returns what a detection says about the track; `None` if the two do not fit, or if the line
    /// of sight is too far off the road. `ego_mps` is the speed of the ego along its heading (m/s).
    pub(super) fn compare(&self, detection: &RadarDetection, frame: &EgoFrame<'_>, ego_mps: f64) -> Option<Match> {
        let [along, across] = self.estimate;
        let [sensor_x_m, sensor_y_m] = detection.sensor_m;
        let point = frame.point(along.position_m, across.position_m);
        let [x_m, y_m] = [point.x_m - sensor_x_m, point.y_m - sensor_y_m];
        let distance_m = maths::hypot(x_m, y_m);
        // A vehicle beside the sensor has a face that is out of view.
        if !(distance_m > self.width_m) {
            return None;
        }
        let sight = [x_m / distance_m, y_m / distance_m];
        let (sin, cos) = maths::sin_cos(point.road_yaw_rad);
        let scale = frame.path_scale(along.position_m, across.position_m);
        let of_along = scale * (cos * sight[0] + sin * sight[1]);
        let of_across = cos * sight[1] - sin * sight[0];
        if !(of_along.abs() >= MIN_ALONG) {
            return None;
        }
        // Velocity relative to the ego, along its axes.
        let (along_mps, across_mps) = (scale * along.speed_mps, across.speed_mps);
        let relative_mps = [along_mps * cos - across_mps * sin - ego_mps, along_mps * sin + across_mps * cos];
        let sideways_mps = relative_mps[1] * sight[0] - relative_mps[0] * sight[1];
        let sideways_m2 = across.position_variance_m2 + (POINT_SD_WIDTHS * self.width_m).powi(2);
        let variance_m2ps2 = detection.radial_sd_mps.powi(2)
            + of_across * of_across * across.speed_variance_m2ps2
            + sideways_mps * sideways_mps * sideways_m2 / (distance_m * distance_m);
        let radial_mps = relative_mps[0] * sight[0] + relative_mps[1] * sight[1];
        let innovation_mps = detection.radial_mps - radial_mps;
        let predicted_m2ps2 = of_along * of_along * along.speed_variance_m2ps2 + variance_m2ps2;
        let squared_distance =
            self.squared_distance(detection, frame) + innovation_mps * innovation_mps / predicted_m2ps2;
        let measured = MeasuredSpeed {
            speed_mps: along.speed_mps + innovation_mps / of_along,
            sd_mps: variance_m2ps2.sqrt() / of_along.abs(),
        };
        (squared_distance <= GATE).then_some(Match { squared_distance, measured })
    }

    /// Returns the squared distance of the detected point from the vehicle's box along and across
    /// the road, in variances.
    fn squared_distance(&self, detection: &RadarDetection, frame: &EgoFrame<'_>) -> f64 {
        let [along, across] = self.estimate;
        let (sin, cos) = maths::sin_cos(detection.azimuth_rad);
        let [sensor_x_m, sensor_y_m] = detection.sensor_m;
        let (s_m, d_m) =
            frame.road_position_m(sensor_x_m - detection.range_m * cos, sensor_y_m + detection.range_m * sin);
        let [rear_m, front_m] = self.span_m;
        let outside_m = |at_m: f64, low_m: f64, high_m: f64| (low_m - at_m).max(at_m - high_m).max(0.0);
        let half_m = 0.5 * self.width_m;
        let off_m =
            [outside_m(s_m, rear_m, front_m), outside_m(d_m, across.position_m - half_m, across.position_m + half_m)];
        // Errors along and across the line of sight, which lies along the road within 60°.
        let angle_m = detection.range_m * detection.azimuth_sd_rad;
        let turned =
            |of_range: f64, of_angle: f64| (of_range * detection.range_sd_m).powi(2) + (of_angle * angle_m).powi(2);
        let variances_m2 =
            [turned(cos, sin) + along.position_variance_m2, turned(sin, cos) + across.position_variance_m2];
        off_m.iter().zip(variances_m2).map(|(off_m, variance_m2)| off_m * off_m / variance_m2).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EGO: VehicleState = VehicleState {
        s_m: 1_000.0,
        d_m: -5.625,
        heading_rad: 0.0,
        speed_mps: 30.0,
        acceleration_mps2: 0.0,
        yaw_rate_radps: 0.0,
        brake_light: false,
        indicator: closecall_traffic::Indicator::Off,
    };

    /// Returns a track of a car whose front is at (`s_m`, `d_m`).
    fn candidate(s_m: f64, d_m: f64, speed_mps: f64) -> Candidate {
        let at = |position_m: f64, speed_mps: f64| AxisEstimate {
            position_m,
            speed_mps,
            position_variance_m2: 0.01,
            position_speed_covariance_m2ps: 0.0,
            speed_variance_m2ps2: 1.0,
        };
        let across = AxisEstimate { speed_variance_m2ps2: 0.01, ..at(d_m, 0.0) };
        Candidate { estimate: [at(s_m, speed_mps), across], span_m: [s_m - 4.6, s_m + 1.0], width_m: 1.8 }
    }

    /// Returns what a radar without errors measures of a point of the road that moves along it.
    fn detection(s_m: f64, d_m: f64, speed_mps: f64) -> RadarDetection {
        let (sensor_x_m, sensor_y_m) = (-2.3, 0.7);
        let (x_m, y_m) = (s_m - EGO.s_m - sensor_x_m, d_m - EGO.d_m - sensor_y_m);
        let range_m = maths::hypot(x_m, y_m);
        RadarDetection {
            sensor_m: [sensor_x_m, sensor_y_m],
            range_m,
            azimuth_rad: maths::atan2(y_m, -x_m),
            radial_mps: (speed_mps - EGO.speed_mps) * x_m / range_m,
            range_sd_m: 0.25,
            azimuth_sd_rad: 0.017,
            radial_sd_mps: 0.28,
        }
    }

    fn compare(candidate: &Candidate, detection: &RadarDetection) -> Option<Match> {
        let road = Road::straight(3);
        candidate.compare(detection, &EgoFrame::new(&road, &EGO), EGO.speed_mps)
    }

    #[test]
    fn the_speed_along_the_road_follows_from_the_radial_speed_at_every_angle() {
        // The track believes 37 m/s; the vehicle has 38 m/s.
        for (s_m, d_m) in [(930.0, -5.625), (980.0, -1.875), (990.0, -1.875), (985.0, -9.375)] {
            let Match { measured, .. } = compare(&candidate(s_m, d_m, 37.0), &detection(s_m, d_m, 38.0)).unwrap();
            assert!((measured.speed_mps - 38.0).abs() < 1e-9, "{measured:?} at {s_m}, {d_m}");
            // The farther the line of sight is off the road, the less its speed says.
            assert!(measured.sd_mps >= 0.28, "{measured:?}");
        }
        let sd_mps = |s_m: f64, d_m: f64| {
            compare(&candidate(s_m, d_m, 38.0), &detection(s_m, d_m, 38.0)).unwrap().measured.sd_mps
        };
        assert!(sd_mps(990.0, -1.875) > sd_mps(950.0, -1.875));
        assert!((sd_mps(900.0, -4.925) - 0.28).abs() < 1e-3, "straight behind, only the radar's error counts");
    }

    #[test]
    fn a_detection_far_from_the_track_or_beside_the_sensor_says_nothing() {
        let track = candidate(950.0, -1.875, 38.0);
        assert!(compare(&track, &detection(950.0, -1.875, 38.0)).is_some());
        // Another lane, another distance, another speed.
        assert!(compare(&track, &detection(950.0, -9.375, 38.0)).is_none());
        assert!(compare(&track, &detection(940.0, -1.875, 38.0)).is_none());
        assert!(compare(&track, &detection(950.0, -1.875, 45.0)).is_none());
        // Its mirror image at a rail 0.75 m beside the road.
        assert!(compare(&track, &detection(950.0, 1.5 + 2.775, 38.0)).is_none());
        // More than 60° off the road.
        assert!(compare(&candidate(996.0, -1.0, 31.0), &detection(996.0, -1.0, 31.0)).is_none());
    }
}
