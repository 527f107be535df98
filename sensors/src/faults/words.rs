//! Injected faults in words: the sensor, its fault, and the time.

use std::fmt;

use closecall_traffic::{Side, Time};

use super::list::{Combine, FaultList};
use super::{Faults, LidarFault, ObjectFault, OdometryErrors, RadarFault};
use crate::camera::CameraFault;

/// A group of sensors, as [`SensorHealth`](crate::SensorHealth) has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorGroup {
    /// The sensor that looks ahead.
    Front,
    /// The short-range sensors to both sides.
    Surround,
    /// The sensors that look back, except the radars.
    Rear,
    /// The rear radars, which also belong to the sensors that look back.
    RearRadars,
    /// The odometry and the map, which every function relies on.
    Odometry,
}

/// An injected fault in words.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedFault {
    /// The sensors that it concerns.
    pub group: SensorGroup,
    /// The sensor.
    pub sensor: String,
    /// The fault of the sensor, in words.
    pub effects: String,
    /// Time of its begin (s); negative infinity if it holds from the start on.
    pub from_s: f64,
    /// Time of its end (s); infinity if it holds to the end.
    pub until_s: f64,
}

impl StatedFault {
    /// Returns whether the fault holds at `time`.
    pub fn holds_at(&self, time: Time) -> bool {
        self.from_s <= time.s() && time.s() < self.until_s
    }
}

impl fmt::Display for StatedFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.sensor, self.effects)?;
        match [self.from_s > 0.0, self.until_s.is_finite()] {
            [false, false] => Ok(()),
            [true, false] => write!(f, " from {:.1} s on", self.from_s),
            [false, true] => write!(f, " until {:.1} s", self.until_s),
            [true, true] => write!(f, " from {:.1} to {:.1} s", self.from_s, self.until_s),
        }
    }
}

/// Sensors that exist, so that their faults act.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ActingSensors {
    /// Whether LiDAR and camera look back, and not the object-level sensor.
    pub(crate) is_full: bool,
    /// Whether a LiDAR looks ahead, and not the radar.
    pub(crate) has_front_lidar: bool,
    /// Whether radars look back besides the LiDARs.
    pub(crate) has_rear_radar: bool,
    /// Whether the sensors around the ego and the sensors that look back are models, and not the
    /// truth.
    pub(crate) has_models: bool,
}

impl Faults {
    /// Returns the faults of the sensors that exist, in words.
    pub(crate) fn stated(&self, acting: ActingSensors) -> Vec<StatedFault> {
        let mut stated = Vec::new();
        if acting.has_models {
            match acting.has_front_lidar {
                true => state(&mut stated, &self.front_lidar, SensorGroup::Front, "front LiDAR"),
                false => state(&mut stated, &self.front_radar, SensorGroup::Front, "front radar"),
            }
            state(&mut stated, &self.surround, SensorGroup::Surround, "side sensors");
            match acting.is_full {
                true => {
                    state(&mut stated, &self.rear_lidar, SensorGroup::Rear, "rear LiDAR");
                    state(&mut stated, &self.rear_camera, SensorGroup::Rear, "rear camera");
                    if acting.has_rear_radar {
                        state(&mut stated, &self.rear_radar, SensorGroup::RearRadars, "rear radar");
                    }
                }
                false => state(&mut stated, &self.rear_object, SensorGroup::Rear, "rear sensor"),
            }
        }
        if !self.odometry.is_none() {
            let [from_s, until_s] = self.odometry.span_s();
            let parts = [("odometry", self.odometry.effects_on_odometry()), ("map", self.odometry.effects_on_map())];
            stated.extend(parts.into_iter().filter(|(_, effects)| !effects.is_empty()).map(|(source, effects)| {
                let (group, effects) = (SensorGroup::Odometry, effects.join(", "));
                StatedFault { group, sensor: source.to_owned(), effects, from_s, until_s }
            }));
        }
        stated
    }
}

/// Effects that have words.
trait Effects {
    /// Returns the name of the one sensor that the effects concern, if they name one.
    fn of_sensor(&self) -> Option<&'static str> {
        None
    }

    /// Returns the effects in words.
    fn effects(&self) -> Vec<String>;
}

/// Adds the entries of one sensor.
fn state<T: Effects + Combine>(stated: &mut Vec<StatedFault>, list: &FaultList<T>, group: SensorGroup, name: &str) {
    stated.extend(list.spans().map(|(effect, [from_s, until_s])| StatedFault {
        group,
        sensor: effect.of_sensor().map_or_else(|| name.to_owned(), |sensor| format!("{name} `{sensor}`")),
        effects: effect.effects().join(", "),
        from_s,
        until_s,
    }));
}

/// Returns the words of those effects that are there.
fn those(effects: impl IntoIterator<Item = (bool, String)>) -> Vec<String> {
    effects.into_iter().filter(|(is_there, _)| *is_there).map(|(_, words)| words).collect()
}

/// Returns the words for a latency and its greatest additional part (s).
fn late(delay_s: f64, jitter_s: f64) -> String {
    let up_to = if jitter_s > 0.0 { "up to " } else { "" };
    format!("late by {up_to}{:.2} s", delay_s + jitter_s)
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

impl Effects for LidarFault {
    fn of_sensor(&self) -> Option<&'static str> {
        self.sensor
    }

    fn effects(&self) -> Vec<String> {
        let is_askew = [self.yaw_rad, self.pitch_rad, self.height_m] != [0.0; 3];
        those([
            (self.is_dead, "dead".to_owned()),
            (self.is_frozen, "frozen".to_owned()),
            (self.lost_frames > 0.0, format!("with {} of the scans lost", percent(self.lost_frames))),
            (self.dropout > 0.0, format!("with {} of the points lost", percent(self.dropout))),
            (self.blocked_deg.iter().any(Option::is_some), "partly blocked".to_owned()),
            (self.window_transmission < 1.0, format!("dirty ({} pass)", percent(self.window_transmission))),
            (self.delay_s > 0.0 || self.jitter_s > 0.0, late(self.delay_s, self.jitter_s)),
            (self.clock_offset_s != 0.0, format!("with a clock off by {:.2} s", self.clock_offset_s)),
            (is_askew, "mounted askew".to_owned()),
            (self.range_noise_m > 0.0, format!("noisy ({:.2} m)", self.range_noise_m)),
            (self.rail_ghosts > 0.0, "with mirror images behind the guard rail".to_owned()),
            (self.crosstalk > 0.0, "disturbed by another LiDAR".to_owned()),
            (self.blooming_deg > 0.0, "with halos around number plates".to_owned()),
        ])
    }
}

impl Effects for CameraFault {
    fn of_sensor(&self) -> Option<&'static str> {
        self.sensor
    }

    fn effects(&self) -> Vec<String> {
        those([
            (self.is_dead, "dead".to_owned()),
            (self.is_frozen, "frozen".to_owned()),
            (self.sun_glare > 0.0, "dazzled by the sun".to_owned()),
            (self.main_beam_glare > 0.0, "dazzled by main beam".to_owned()),
            (self.dirt > 0.0, format!("{} covered by dirt", percent(self.dirt))),
            (self.blur_px > 0.0, format!("out of focus ({:.1} px)", self.blur_px)),
        ])
    }
}

impl Effects for ObjectFault {
    fn effects(&self) -> Vec<String> {
        let ghost = self.ghost.map_or_else(String::new, |[gap_m, _]| {
            format!("with a ghost {gap_m:.0} m away (a vehicle that does not exist)")
        });
        let is_noisy = self.noise_m != [0.0; 2] || self.speed_noise_mps > 0.0;
        those([
            (self.is_dead, "dead".to_owned()),
            (self.is_frozen, "frozen".to_owned()),
            (self.lost_frames > 0.0, format!("with {} of the scans lost", percent(self.lost_frames))),
            (self.dropout > 0.0, format!("with {} of the measurements lost", percent(self.dropout))),
            (self.blocked_deg.iter().any(Option::is_some), "partly blocked".to_owned()),
            (self.range_share < 1.0, format!("dirty ({} of the range left)", percent(self.range_share))),
            (self.delay_s > 0.0 || self.jitter_s > 0.0, late(self.delay_s, self.jitter_s)),
            (self.clock_offset_s != 0.0, format!("with a clock off by {:.2} s", self.clock_offset_s)),
            (self.yaw_rad != 0.0, "mounted askew".to_owned()),
            (is_noisy, "noisy".to_owned()),
            (self.ghost.is_some(), ghost),
        ])
    }
}

impl Effects for RadarFault {
    fn of_sensor(&self) -> Option<&'static str> {
        self.side.map(|side| match side {
            Side::Left => "left",
            Side::Right => "right",
        })
    }

    fn effects(&self) -> Vec<String> {
        let ghost =
            self.ghost.map(|[gap_m, _]| format!("with a ghost {gap_m:.0} m away (a vehicle that does not exist)"));
        those([
            (self.is_dead, "dead".to_owned()),
            (self.dropout > 0.0, format!("with {} of the detections lost", percent(self.dropout))),
            (self.blocked_deg.iter().any(Option::is_some), "partly blocked".to_owned()),
            (self.range_share < 1.0, format!("dirty ({} of the range left)", percent(self.range_share))),
            (self.delay_s > 0.0, late(self.delay_s, 0.0)),
            (self.yaw_rad != 0.0, "mounted askew".to_owned()),
            (self.ghost.is_some(), ghost.unwrap_or_default()),
        ])
    }
}

impl OdometryErrors {
    /// Returns the errors of the ego's own motion and position in words.
    fn effects_on_odometry(&self) -> Vec<String> {
        those([
            (self.speed_scale != 0.0, format!("with speed wrong by {:.1} %", 100.0 * self.speed_scale)),
            (self.lateral_m != 0.0, format!("with position wrong by {:.2} m", self.lateral_m)),
            (self.heading_rad != 0.0, format!("with heading wrong by {:.1}°", self.heading_rad.to_degrees())),
        ])
    }

    /// Returns the errors of the map in words.
    fn effects_on_map(&self) -> Vec<String> {
        those([
            (self.curvature_per_m != 0.0, "with wrong curvature".to_owned()),
            (self.lane_width_m != 0.0, format!("with lane width wrong by {:.2} m", self.lane_width_m)),
            (self.has_no_rails, "without guard rails".to_owned()),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_odometry_and_of_the_map_are_told_apart() {
        let told = |change: fn(&mut OdometryErrors)| {
            let mut faults = Faults::default();
            change(&mut faults.odometry);
            let acting =
                ActingSensors { is_full: false, has_front_lidar: false, has_rear_radar: false, has_models: true };
            faults.stated(acting).iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        assert!(told(|_| {}).is_empty());
        assert_eq!(told(|errors| errors.speed_scale = 0.01), ["odometry with speed wrong by 1.0 %"]);
        let of_map = told(|errors| (errors.lane_width_m, errors.has_no_rails) = (0.2, true));
        assert_eq!(of_map, ["map with lane width wrong by 0.20 m, without guard rails"]);
        let both = told(|errors| (errors.heading_rad, errors.curvature_per_m) = (1.0_f64.to_radians(), 1e-4));
        assert_eq!(both, ["odometry with heading wrong by 1.0°", "map with wrong curvature"]);
    }
}
