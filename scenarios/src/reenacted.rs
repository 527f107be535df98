//! Makes a scenario from a recorded encounter. Every vehicle starts at its recorded position and
//! speed, in the middle of its lane; the ego is driven by the ego stack.
//!
//! | vehicle | driver |
//! |---|---|
//! | ego | the ego stack, with the time gap and the set speed that the recorded driver kept |
//! | lead vehicle | recorded speeds and lane changes, which cross the marking when the recorded vehicle does (`prescribed`) |
//! | rear vehicle | [`RearDriver`] |
//! | a vehicle that stays ahead of the rear vehicle in another lane | recorded speeds (`prescribed`) |
//! | a vehicle that stays behind the rear vehicle in the lane that this changes to | Wiedemann 99, with the highest recorded speed as desired speed |
//!
//! All other vehicles are left out:
//!
//! * vehicles in the ego's lane: those behind would drive into the ego when it brakes
//! * vehicles that change lanes, since the gaps that they changed into are elsewhere in the
//!   simulation
//! * vehicles that appear after the start
//! * vehicles that would overlap with another one in the middle of a lane

use std::collections::BTreeMap;
use std::path::Path;

use closecall_controllers::{
    AccConfig, AebConfig, DriverConfig, EgoStackConfig, FollowConfig, MisConfig, OvertakerConfig, PrescribedConfig,
    PrescribedLaneChangeConfig, ReactionConfig, Wiedemann99Config,
};
use closecall_recorded::encounter::{EGO_INDEX, LONGEST_THW_S, Participant, RecordedEncounter};
use closecall_recorded::filters::PERIOD;
use closecall_traffic::metrics::{time_headway_s, touching_distance_m};
use closecall_traffic::{ActorId, LaneWidthsConfig, Num, RoadConfig, Time, Trajectory, TrajectoryPoint, VehicleConfig};
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item};

use crate::coverage::CoverageConfig;
use crate::criteria::GateConfig;

use super::config::{
    AbsoluteStartConfig, ActorConfig, EXPECTS_SHARE, Function, SCHEMA_VERSION, ScenarioConfig, StartConfig,
};
use super::recorded_values::{MIN_SPEED_MPS, ROUNDING_STEP, max_speed_mps, rounded, to_steps};
use super::{ScenarioError, ScenarioFile, Setting};

/// The driver of the rear vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RearDriver {
    /// A human driver model that reacts to the ego, follows as closely as recorded, and cuts out at
    /// the recorded headway.
    #[default]
    Model,
    /// The recorded speeds and the recorded lane change, whatever the ego does.
    Recorded,
}

/// The names of the ego, the lead vehicle and the rear vehicle as actors.
const NAMES: [&str; 3] = ["ego", "front", "rear"];
/// The human drivers' reaction time (s): the mean for unexpected but common events, such as the
/// brake lights of the vehicle ahead (Green, Transportation Human Factors 2 (2000) 195–216).
pub(super) const REACTION_S: f64 = 1.25;
/// Gap at standstill of Wiedemann's model (m): its published default.
const STANDSTILL_GAP_M: f64 = 1.5;
/// Ratio of the rear driver's following headway to its smallest recorded headway. It is below 1,
/// and the driver reaches the headway at which it cuts out.
pub(super) const FOLLOWING_SHARE: f64 = 0.9;
/// Smallest and largest time gap of the adaptive cruise control (s).
const MIN_TIME_GAP_S: f64 = 0.2;
const MAX_TIME_GAP_S: f64 = 5.0;
/// Smallest and largest duration of a lane change (s).
pub(super) const MIN_LANE_CHANGE_S: f64 = 1.5;
pub(super) const MAX_LANE_CHANGE_S: f64 = 20.0;
/// Smallest gap between two vehicles that start in the same lane (m).
pub(super) const MIN_START_GAP_M: f64 = 0.5;

/// Returns the name of a vehicle as an actor: `ego`, `front`, `rear`, or its track. `index` is its
/// index in the encounter's list of vehicles.
pub fn actor_name(index: usize, vehicle: &Trajectory) -> String {
    NAMES.get(index).map_or_else(|| format!("track-{}", vehicle.track_id), |name| (*name).to_owned())
}

/// Returns the scenario of an encounter, with the settings applied. The last argument holds the
/// path that names the source in error messages, and the settings.
///
/// # Errors
/// [`ScenarioError`] if the recorded values or the settings do not result in a valid scenario.
pub fn reenact(
    encounter: &RecordedEncounter,
    rear: RearDriver,
    source: &Path,
    settings: &[Setting],
) -> Result<ScenarioFile, ScenarioError> {
    written(config(encounter, rear), (source, settings))
}

/// Returns the scenario file with these contents and the settings applied, and checks it.
pub(super) fn written(
    config: Result<ScenarioConfig, String>,
    (source, settings): (&Path, &[Setting]),
) -> Result<ScenarioFile, ScenarioError> {
    let text = config.and_then(|config| scenario_text(&config));
    let text = text.map_err(|message| ScenarioError::Syntax { path: source.to_owned(), line: Some(1), message })?;
    let file = ScenarioFile::parse(source, &text, settings)?;
    file.check()?;
    Ok(file)
}

/// Returns the text of the scenario file. Keys with their default values are left out.
fn scenario_text(config: &ScenarioConfig) -> Result<String, String> {
    let written = toml::to_string(config).map_err(|error| error.to_string())?;
    let mut document: DocumentMut = written.parse().map_err(|error: toml_edit::TomlError| error.to_string())?;
    for default_key in ["requirements", "environment", "sensors"] {
        document.remove(default_key);
    }
    if config.parameters.0.is_empty() {
        document.remove("parameters");
    }
    let actors = document.get_mut("actor").and_then(Item::as_array_of_tables_mut);
    for actor in actors.into_iter().flat_map(ArrayOfTables::iter_mut) {
        if actor.get("event").and_then(Item::as_array).is_some_and(Array::is_empty) {
            actor.remove("event");
        }
    }
    Ok(document.to_string())
}

/// Returns the contents of the scenario file.
pub(super) fn config(encounter: &RecordedEncounter, rear: RearDriver) -> Result<ScenarioConfig, String> {
    let mut actors = Vec::new();
    for (index, vehicle) in encounter.vehicles.iter().enumerate() {
        let is_rear = index == encounter.rear_index();
        let driver = match rear {
            _ if index == EGO_INDEX => Some(ego_stack(encounter)),
            RearDriver::Model if is_rear => Some(overtaking_driver(encounter)),
            _ if index <= encounter.rear_index() => Some(prescribed_driver(encounter, vehicle)),
            _ => other_driver(encounter, vehicle),
        };
        let earlier_vehicles = &encounter.vehicles[..index];
        if let (Some(driver), Some(start)) = (driver, start_of(&vehicle.trajectory))
            && (index <= encounter.rear_index()
                || earlier_vehicles.iter().all(|earlier| is_clear(&earlier.trajectory, start, vehicle)))
        {
            actors.push(actor(&actor_name(index, &vehicle.trajectory), vehicle, start, driver)?);
        }
    }
    let [ego, _, rear_track] = encounter.ego_lead_rear();
    let title = Title {
        name: format!("reenacted-track-{}", rear_track.track_id),
        description: format!(
            "The encounter of track {} (R) with track {} (E) in {}, from {:.1} s on",
            rear_track.track_id,
            ego.track_id,
            encounter.data_name,
            encounter.start.s()
        ),
        tag: "reenacted",
    };
    Ok(with_actors(encounter, title, actors))
}

/// The words that name a scenario.
pub(super) struct Title {
    /// Its name.
    pub(super) name: String,
    /// What happens.
    pub(super) description: String,
    /// Its only tag.
    pub(super) tag: &'static str,
}

/// Returns the contents of a scenario file with the road and the duration of an encounter.
pub(super) fn with_actors(encounter: &RecordedEncounter, title: Title, actors: Vec<ActorConfig>) -> ScenarioConfig {
    ScenarioConfig {
        function: Function::Mis,
        schema_version: SCHEMA_VERSION,
        name: title.name,
        description: title.description,
        tags: vec![title.tag.to_owned()],
        requirements: Vec::new(),
        checks: BTreeMap::new(),
        gate: GateConfig::default(),
        expects: Vec::new(),
        expects_share: EXPECTS_SHARE,
        overridden: Vec::new(),
        coverage: CoverageConfig::default(),
        duration_s: rounded(encounter.end.s()),
        road: RoadConfig {
            lanes: encounter.lanes,
            lane_width_m: LaneWidthsConfig::Equal(rounded(encounter.lane_width_m)),
            curvature_per_m: Num::Fixed(0.0),
            cross_sections: Vec::new(),
            alignment: Vec::new(),
            alignment_d_m: None,
            speed_limit_mps: rounded(max_speed_mps(encounter.vehicles.iter().map(|vehicle| &vehicle.trajectory))),
            overtaking_side: encounter.change.direction,
            guard_rails: false,
            roadside: closecall_traffic::RoadsideConfig::default(),
            acceleration_lane: None,
        },
        environment: Default::default(),
        parameters: Default::default(),
        actors,
        traffic: Vec::new(),
        sensors: Default::default(),
        random_numbers: None,
        controller: Default::default(),
        ideal: Default::default(),
        fault: Default::default(),
    }
}

/// Returns an actor with the recorded size and start of a vehicle.
pub(super) fn actor(
    name: &str,
    vehicle: &Participant,
    start: &TrajectoryPoint,
    driver: DriverConfig,
) -> Result<ActorConfig, String> {
    let size = &vehicle.trajectory.dimensions;
    Ok(ActorConfig {
        id: ActorId::new(name).map_err(|error| error.to_string())?,
        vehicle: VehicleConfig {
            length_m: Some(rounded(size.length_m)),
            width_m: Some(rounded(size.width_m)),
            height_m: Some(rounded(size.height_m)),
            ..VehicleConfig::typical(vehicle.trajectory.class)
        },
        start: StartConfig::Absolute(AbsoluteStartConfig {
            lane: start.lane,
            s_m: rounded(start.s_m),
            speed_mps: rounded(start.speed_mps.max(0.0)),
            acceleration_mps2: None,
        }),
        driver,
        path: None,
        lane_keeping: None,
        speed_keeping: None,
        events: Vec::new(),
    })
}

/// Returns the point of a vehicle at the start of the encounter, or `None` if the vehicle appears
/// later.
pub(super) fn start_of(vehicle: &Trajectory) -> Option<&TrajectoryPoint> {
    vehicle.points.first().filter(|point| point.time == Time::ZERO)
}

/// Returns whether a vehicle that starts at `start` keeps a gap to `other`, if both start in the
/// same lane.
fn is_clear(other: &Trajectory, start: &TrajectoryPoint, vehicle: &Participant) -> bool {
    let touching_m = touching_distance_m(other.dimensions.length_m, vehicle.trajectory.dimensions.length_m);
    start_of(other).is_none_or(|at| at.lane != start.lane || (at.s_m - start.s_m).abs() > touching_m + MIN_START_GAP_M)
}

/// Returns the ego stack. Its time gap is the median time headway recorded before the rear vehicle
/// crosses the lane marking, its set speed the highest recorded speed.
fn ego_stack(encounter: &RecordedEncounter) -> DriverConfig {
    let [ego, front, _] = encounter.ego_lead_rear();
    let mut headways_s: Vec<f64> = gaps(ego, front, encounter.crossing)
        .filter_map(|ego_state| time_headway_s(ego_state.gap_m, ego_state.speed_mps).ok())
        .collect();
    headways_s.sort_by(f64::total_cmp);
    let median_s = headways_s.get(headways_s.len() / 2).copied().unwrap_or(MAX_TIME_GAP_S);
    DriverConfig::EgoStack(EgoStackConfig {
        acc: AccConfig {
            time_gap_s: rounded(median_s.clamp(MIN_TIME_GAP_S, MAX_TIME_GAP_S)),
            set_speed_mps: Some(rounded(max_speed_mps([ego]))),
            standstill_gap_m: None,
        },
        aeb: Some(AebConfig::default()),
        mis: Some(MisConfig::default()),
        human: None,
        automated: true,
    })
}

/// Returns the rear vehicle's driver as a human driver model that follows the ego as closely as
/// recorded, and as fast.
fn overtaking_driver(encounter: &RecordedEncounter) -> DriverConfig {
    let [ego, _, rear] = encounter.ego_lead_rear();
    let cut_out_thw_s = encounter.crossing_thw_s.unwrap_or(LONGEST_THW_S);
    let start_mps = start_of(rear).map_or(MIN_SPEED_MPS, |start| start.speed_mps.max(MIN_SPEED_MPS));
    let cc0_m = STANDSTILL_GAP_M.min(0.5 * cut_out_thw_s * start_mps);
    let closest_s = gaps(rear, ego, encounter.crossing)
        .filter(|rear_state| rear_state.speed_mps >= MIN_SPEED_MPS)
        .map(|rear_state| (rear_state.gap_m - cc0_m) / rear_state.speed_mps)
        .fold(cut_out_thw_s - cc0_m / start_mps, f64::min);
    DriverConfig::Overtaker(OvertakerConfig {
        cut_out_thw_s: rounded(cut_out_thw_s),
        follow: FollowConfig::Wiedemann99(Wiedemann99Config {
            cc0_m: Some(rounded(cc0_m)),
            cc1_s: Some(rounded((FOLLOWING_SHARE * closest_s).max(0.0))),
            desired_speed_mps: Some(rounded(max_speed_mps([rear]))),
            ..Wiedemann99Config::default()
        }),
        reaction_s: ReactionConfig::Value(Num::Fixed(REACTION_S)),
        lane_change_duration_s: Some(rounded(encounter.change.duration_s.clamp(MIN_LANE_CHANGE_S, MAX_LANE_CHANGE_S))),
        evasive_lateral_mps2: None,
        lapse: None,
        perception: None,
        brake_build_up_mps3: None,
        returns: None,
    })
}

/// The gap of a vehicle to the one ahead, and its own speed, at one instant.
struct GapAndSpeed {
    gap_m: f64,
    speed_mps: f64,
}

/// Returns the gap of a vehicle to the vehicle `ahead`, and its speed, at each of its points before
/// `until`.
fn gaps(follower: &Trajectory, ahead: &Trajectory, until: Time) -> impl Iterator<Item = GapAndSpeed> {
    let half_lengths_m = 0.5 * (follower.dimensions.length_m + ahead.dimensions.length_m);
    let before = follower.points.iter().take_while(move |point| point.time < until);
    before.filter_map(move |point| {
        let gap_m = ahead.at(point.time)?.s_m - point.s_m - half_lengths_m;
        Some(GapAndSpeed { gap_m, speed_mps: point.speed_mps })
    })
}

/// Returns the driver of a vehicle other than the ego, the lead and the rear vehicle, or `None` if
/// it is not simulated.
fn other_driver(encounter: &RecordedEncounter, vehicle: &Participant) -> Option<DriverConfig> {
    let (start, rear) = (start_of(&vehicle.trajectory)?, start_of(&encounter.rear().trajectory)?);
    let stays = vehicle.trajectory.points.iter().all(|point| point.lane == start.lane);
    if !stays || start.lane == encounter.home {
        return None;
    }
    if start.s_m > rear.s_m {
        return Some(prescribed_driver(encounter, vehicle));
    }
    (start.lane == encounter.target).then(|| {
        DriverConfig::Wiedemann99(Wiedemann99Config {
            desired_speed_mps: Some(rounded(max_speed_mps([&vehicle.trajectory]))),
            reaction_s: Some(ReactionConfig::Value(Num::Fixed(REACTION_S))),
            ..Wiedemann99Config::default()
        })
    })
}

/// Returns a driver with the recorded speeds, at the times of the common clock, and the recorded
/// lane changes.
pub(super) fn prescribed_driver(encounter: &RecordedEncounter, vehicle: &Participant) -> DriverConfig {
    let on_clock = vehicle.trajectory.points.iter().filter(|point| point.time.is_multiple_of(PERIOD));
    let pair = |point: &TrajectoryPoint| [rounded(point.time.s()), rounded(point.speed_mps.max(0.0))];
    let mut free_from_s = 0.0;
    let mut lane_changes = Vec::new();
    for change in &vehicle.changes {
        let [start_s, crossing_s, end_s] =
            [change.start_s, change.crossing_s, change.end_s].map(|recorded_s| encounter.time_of(recorded_s).s());
        let as_recorded = || {
            let at_s = start_s.max(free_from_s);
            (at_s, (end_s - at_s).clamp(MIN_LANE_CHANGE_S, MAX_LANE_CHANGE_S))
        };
        let crossing = lane_change_across(&vehicle.trajectory, [start_s, crossing_s], free_from_s);
        let (at_s, duration_s) = crossing.unwrap_or_else(as_recorded);
        let (at_s, duration_s) = (to_steps(at_s), to_steps(duration_s));
        // The next lane change starts at least one rounding step after the end of this one, so that
        // they never overlap.
        free_from_s = at_s + duration_s + ROUNDING_STEP;
        lane_changes.push(PrescribedLaneChangeConfig {
            at_s: Num::Fixed(at_s),
            to: change.direction,
            duration_s: Num::Fixed(duration_s),
        });
    }
    DriverConfig::Prescribed(PrescribedConfig {
        profile: Some(on_clock.map(pair).collect()),
        lane_changes,
        ..PrescribedConfig::default()
    })
}

/// Returns the start and the duration (s) of a lane change that crosses the marking when the
/// recorded vehicle does, at `crossing_s`.
///
/// A simulated lane change follows a symmetric path whose length is its duration times the speed at
/// its start, and crosses the marking after half of that length. A recorded one is hardly ever
/// symmetric. Of all starts from `free_from_s` on for which the duration is possible, the start
/// nearest to the recorded `start_s` is chosen. Returns `None` if there is none.
fn lane_change_across(vehicle: &Trajectory, [start_s, crossing_s]: [f64; 2], free_from_s: f64) -> Option<(f64, f64)> {
    let crossing_m = vehicle.at(Time::from_s(crossing_s))?.s_m;
    let candidate = |point: &TrajectoryPoint| {
        let duration_s = 2.0 * (crossing_m - point.s_m) / point.speed_mps.max(MIN_SPEED_MPS);
        let is_possible = (MIN_LANE_CHANGE_S..=MAX_LANE_CHANGE_S).contains(&duration_s);
        (is_possible && point.time.s() >= free_from_s).then_some((point.time.s(), duration_s))
    };
    let starts = vehicle.points.iter().take_while(|point| point.time.s() < crossing_s).filter_map(candidate);
    starts.min_by(|a, b| (a.0 - start_s).abs().total_cmp(&(b.0 - start_s).abs()))
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Dimensions, Lane, VehicleClass};

    use super::*;

    /// A vehicle that accelerates from 20 m/s with 1 m/s² for 20 s.
    fn accelerating() -> Trajectory {
        let point = |tick: i64| {
            let time = Time::from_ms(10 * tick);
            let time_s = time.s();
            TrajectoryPoint {
                time,
                s_m: 20.0 * time_s + 0.5 * time_s * time_s,
                d_m: -1.75,
                speed_mps: 20.0 + time_s,
                acceleration_mps2: 1.0,
                lateral_speed_mps: 0.0,
                lateral_acceleration_mps2: 0.0,
                lane: Lane(1),
            }
        };
        Trajectory {
            track_id: 1,
            vehicle_id: 1,
            class: VehicleClass::Car,
            dimensions: Dimensions { length_m: 4.5, width_m: 1.8, height_m: 1.5 },
            points: (0..2_000).map(point).collect(),
        }
    }

    #[test]
    fn a_prescribed_lane_change_is_half_done_at_the_recorded_crossing() {
        let vehicle = accelerating();
        let s_m = |time_s: f64| 20.0 * time_s + 0.5 * time_s * time_s;
        for (start_s, crossing_s) in [(4.0, 9.0), (4.0, 4.2), (0.0, 15.0), (-3.0, 2.5)] {
            let (at_s, duration_s) = lane_change_across(&vehicle, [start_s, crossing_s], 0.0).unwrap();
            let half_m = 0.5 * duration_s * (20.0 + at_s);
            assert!((s_m(at_s) + half_m - s_m(crossing_s)).abs() < 1e-3, "{start_s} {crossing_s}: {at_s} {duration_s}");
            assert!(at_s >= 0.0 && (MIN_LANE_CHANGE_S..=MAX_LANE_CHANGE_S).contains(&duration_s));
        }
        let (at_s, _) = lane_change_across(&vehicle, [4.0, 9.0], 0.0).unwrap();
        assert!((at_s - 4.0).abs() < 1e-9, "the recorded start is kept if it is possible: {at_s}");
        assert_eq!(lane_change_across(&vehicle, [4.0, 9.0], 8.9), None, "there is no time left");
    }
}
