//! Configuration of a prescribed driver.

use closecall_traffic::{Check, ConfigError, Lane, Num, Parameters, Problem, Range, Road, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::driver::PrescribedDriver;
use super::lane_change::{PrescribedLaneChange, PrescribedLaneChangeConfig, check_lane_changes};
use super::profile::{AccelerationStep, SpeedProfile};

/// Latest time in a profile (s).
pub(super) const MAX_TIME_S: f64 = 1e6;

/// Highest speed in a profile (m/s).
const MAX_SPEED_MPS: f64 = 100.0;

/// A prescribed driver as a scenario file describes it: exactly one of the first three keys, and
/// optional lane changes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct PrescribedConfig {
    /// Pairs of time (s) and speed (m/s), with increasing times. The speed is linear in between,
    /// constant before and after.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<Vec<[Num; 2]>>,
    /// Pairs of time (s) and acceleration (m/s²), with increasing times. Each acceleration holds
    /// until the next; before the first it is zero. The driver starts at the initial speed; braking
    /// ends at standstill, accelerating at 100 m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration_profile: Option<Vec<[Num; 2]>>,
    /// The speeds of a vehicle in recorded traffic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded: Option<RecordedConfig>,
    /// Changes to an adjacent lane at given times. Each begins no earlier than the one before ends.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lane_changes: Vec<PrescribedLaneChangeConfig>,
}

/// A track of a trajectory file, in place of `profile`. It is read together with the scenario file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RecordedConfig {
    /// Path of the trajectory file, relative to the folder of the scenario file.
    pub file: String,
    /// Number of the track in that file.
    pub track_id: u64,
    /// Time in the run at which the track begins (s). Default: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
}

/// A checked prescribed driver: a profile with at least one point and increasing times, and lane
/// changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Prescribed {
    points: Points,
    pub(super) lane_changes: Vec<PrescribedLaneChange>,
}

#[derive(Clone, Debug, PartialEq)]
enum Points {
    Speeds(SpeedProfile),
    Accelerations(Vec<AccelerationStep>),
}

impl PrescribedConfig {
    /// Creates a profile from pairs of time (s) and speed (m/s).
    pub fn speeds(points: &[[f64; 2]]) -> Self {
        let profile = points.iter().map(|pair| pair.map(Num::Fixed)).collect();
        Self { profile: Some(profile), ..Self::default() }
    }
}

impl Check for PrescribedConfig {
    type Checked = Prescribed;

    fn check(&self, parameters: &Parameters) -> Result<Prescribed, ConfigError> {
        Ok(Prescribed {
            points: self.check_points(parameters)?,
            lane_changes: check_lane_changes(&self.lane_changes, parameters)?,
        })
    }
}

impl PrescribedConfig {
    fn check_points(&self, parameters: &Parameters) -> Result<Points, ConfigError> {
        match (&self.profile, &self.acceleration_profile, &self.recorded) {
            (Some(pairs), None, None) => {
                let points = check_pairs(pairs, "profile", &SPEED, parameters)?;
                Ok(Points::Speeds(SpeedProfile::new(points)))
            }
            (None, Some(pairs), None) => {
                let steps = check_pairs(pairs, "acceleration-profile", &ACCELERATION, parameters)?;
                let steps = steps
                    .into_iter()
                    .map(|(from_s, acceleration_mps2)| AccelerationStep { from_s, acceleration_mps2 })
                    .collect();
                Ok(Points::Accelerations(steps))
            }
            (None, None, Some(_)) => {
                let needed = "the speeds of the recorded track, which are read together with a scenario file";
                Err(ConfigError::new("recorded", Problem::Missing { needed }))
            }
            (None, None, None) => {
                let needed = "one of `profile`, `acceleration-profile` and `recorded`";
                Err(ConfigError::new("profile", Problem::Missing { needed }))
            }
            (profile, ..) => {
                let other = if profile.is_some() { "profile" } else { "acceleration-profile" };
                let key = if profile.is_some() && self.acceleration_profile.is_some() {
                    "acceleration-profile"
                } else {
                    "recorded"
                };
                let rule = "only one of the three may be given".to_owned();
                Err(ConfigError::new(key, Problem::Contradiction { other, rule }))
            }
        }
    }
}

/// Key, valid range and requirement of the second value in each pair.
struct Quantity {
    key: &'static str,
    range: Range,
    needed: &'static str,
}

const SPEED: Quantity = Quantity {
    key: "speed-mps",
    range: Range::closed(0.0, MAX_SPEED_MPS),
    needed: "at least one pair of time and speed",
};

const ACCELERATION: Quantity = Quantity {
    key: "acceleration-mps2",
    range: Range::closed(-12.0, 12.0),
    needed: "at least one pair of time and acceleration",
};

fn check_pairs(
    pairs: &[[Num; 2]],
    key: &str,
    quantity: &Quantity,
    parameters: &Parameters,
) -> Result<Vec<(f64, f64)>, ConfigError> {
    if pairs.is_empty() {
        return Err(ConfigError::new(key, Problem::Missing { needed: quantity.needed }));
    }
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(pairs.len());
    for (index, [time, value]) in pairs.iter().enumerate() {
        let locate = |error: ConfigError| error.within_index(index).within(key);
        let earliest = match points.last() {
            Some((last, _)) => Range::above(*last, MAX_TIME_S),
            None => Range::closed(0.0, MAX_TIME_S),
        };
        let time_s = parameters.number(time, "time-s", earliest).map_err(locate)?;
        points.push((time_s, parameters.number(value, quantity.key, quantity.range).map_err(locate)?));
    }
    Ok(points)
}

impl Prescribed {
    /// Returns a driver that keeps its lane and this speed (m/s).
    pub fn constant(speed_mps: f64) -> Self {
        Self { points: Points::Speeds(SpeedProfile::new(vec![(0.0, speed_mps)])), lane_changes: Vec::new() }
    }

    /// Returns the speeds of a vehicle that drives at `start_mps` at time zero.
    pub(super) fn speeds_from(&self, start_mps: f64) -> SpeedProfile {
        match &self.points {
            Points::Speeds(profile) => profile.clone(),
            Points::Accelerations(steps) => SpeedProfile::integrated(start_mps, steps, MAX_SPEED_MPS),
        }
    }

    /// Checks that a target lane exists for each lane change of a vehicle that starts in lane
    /// `start` of `road`.
    ///
    /// # Errors
    /// Returns a [`ConfigError`] that names the first lane change that would leave the road, or enter
    /// its acceleration lane.
    pub fn check_lanes(&self, start: Lane, road: &Road) -> Result<(), ConfigError> {
        let mut lane = start;
        for (index, change) in self.lane_changes.iter().enumerate() {
            lane = road.lane_to_enter(lane, change.to).map_err(|reason| {
                let problem = Problem::Contradiction { other: "start", rule: reason.to_string() };
                ConfigError::new("to", problem).within_index(index).within("lane-changes")
            })?;
        }
        Ok(())
    }

    /// Returns the time at which the first lane change begins, or `None` if the driver keeps its lane.
    pub fn first_lane_change(&self) -> Option<Time> {
        self.lane_changes.first().map(|change| change.at)
    }

    /// Returns the distance that a vehicle with the initial speed `start_mps` drives until a time (m).
    pub fn distance_m(&self, start_mps: f64, until: Time) -> f64 {
        self.speeds_from(start_mps).distance_m(until.s())
    }

    /// Returns the same driver with left and right exchanged.
    #[must_use]
    pub(crate) fn mirrored(&self) -> Self {
        let lane_changes = self.lane_changes.iter().map(PrescribedLaneChange::mirrored).collect();
        Self { lane_changes, ..self.clone() }
    }

    /// Creates a driver for one run.
    pub(crate) fn driver(&self) -> PrescribedDriver {
        PrescribedDriver::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{AccelerationLane, Side};

    use super::*;

    fn pairs(points: &[[f64; 2]]) -> Option<Vec<[Num; 2]>> {
        PrescribedConfig::speeds(points).profile
    }

    #[test]
    fn times_that_do_not_increase_are_refused_with_their_index() {
        let none = Parameters::default();
        let twice = [[0.0, 3.0], [0.0, 2.0]];
        let error = PrescribedConfig::speeds(&twice).check(&none).unwrap_err();
        assert_eq!(error.path.to_string(), "profile[1].time-s");
        let accelerates = PrescribedConfig { acceleration_profile: pairs(&twice), ..PrescribedConfig::default() };
        let error = accelerates.check(&none).unwrap_err();
        assert_eq!(error.path.to_string(), "acceleration-profile[1].time-s");
        assert!(PrescribedConfig::speeds(&[]).check(&none).is_err());
        assert!(PrescribedConfig::speeds(&[[f64::NAN, 3.0]]).check(&none).is_err());
    }

    #[test]
    fn exactly_one_profile_is_needed() {
        let none = Parameters::default();
        assert!(PrescribedConfig::default().check(&none).is_err());
        let recorded = Some(RecordedConfig { file: "a.csv".to_owned(), track_id: 1, from_s: None });
        let (profile, acceleration_profile) = (pairs(&[[0.0, 3.0]]), pairs(&[[0.0, -3.0]]));
        let path = |config: PrescribedConfig| config.check(&none).unwrap_err().path.to_string();
        let both = PrescribedConfig { profile: profile.clone(), acceleration_profile, ..PrescribedConfig::default() };
        assert_eq!(path(both.clone()), "acceleration-profile");
        assert_eq!(path(PrescribedConfig { profile: None, recorded: recorded.clone(), ..both.clone() }), "recorded");
        assert_eq!(path(PrescribedConfig { acceleration_profile: None, recorded, ..both }), "recorded");
    }

    #[test]
    fn lane_changes_stay_on_the_road_and_do_not_overlap() {
        let none = Parameters::default();
        let change = |at_s: f64, to| PrescribedLaneChangeConfig { at_s: at_s.into(), to, duration_s: 5.0.into() };
        let config = |lane_changes| PrescribedConfig { lane_changes, ..PrescribedConfig::speeds(&[[0.0, 30.0]]) };
        let there_and_back = config(vec![change(1.0, Side::Left), change(6.0, Side::Right)]).check(&none).unwrap();
        assert_eq!(there_and_back.check_lanes(Lane(2), &Road::straight(2)), Ok(()));
        let error = there_and_back.check_lanes(Lane(1), &Road::straight(2)).unwrap_err();
        assert_eq!(error.path.to_string(), "lane-changes[0].to");
        let mirrored = there_and_back.mirrored();
        assert!(
            mirrored.check_lanes(Lane(1), &Road::straight(2)).is_ok()
                && mirrored.check_lanes(Lane(2), &Road::straight(2)).is_err()
        );
        let entry = AccelerationLane { from_m: 100.0, to_m: 350.0, taper_end_m: 410.0 };
        let with_entry = Road::straight(3).with_acceleration_lane(entry);
        assert!(there_and_back.check_lanes(Lane(2), &with_entry).is_ok());
        let error = mirrored.check_lanes(Lane(2), &with_entry).unwrap_err();
        assert!(error.to_string().contains("acceleration lane"), "{error}");
        let error = config(vec![change(1.0, Side::Left), change(5.9, Side::Left)]).check(&none).unwrap_err();
        assert_eq!(error.path.to_string(), "lane-changes[1].at-s");
        assert!(config(vec![change(f64::NAN, Side::Left)]).check(&none).is_err());
    }
}
