//! Samples a recorded lane change: the other vehicles drive as recorded, the vehicle that changes
//! lanes is driven by a model, and one of its parameters varies.
//!
//! ```text
//!   target ───────────────────────────────────────────╭──────▶          ── opp2 ──▶
//!                                              ╭──────╯
//!   home   ── lane-changer (Wiedemann 99) ─────╯──▶  opp1 ──▶  track-… ──▶
//! ```
//!
//! | actor | vehicle | driver |
//! |---|---|---|
//! | `lane-changer` | the vehicle that changes lanes | Wiedemann 99 with the parameters that are passed. It starts at the recorded position, speed and acceleration, and follows the recorded lateral path |
//! | `opp1` | the vehicle that it overtakes: the next one ahead in the lane that it leaves, if there is one | recorded speeds and lateral path |
//! | `opp2` | the vehicle that has overtaken it: the next one ahead in the other lane at the recorded crossing, if there is one | the same |
//! | `track-…` | all other vehicles that are there from the start | the same |
//! | `ego` | no recorded vehicle: a scenario has one ego, and here no vehicle carries the system under test | the ego stack without the margin increase system, [`EGO_DISTANCE_M`] behind all others |
//!
//! A lateral path is a function of the distance along the road: the vehicle changes lanes where the
//! recorded one does, and crosses the marking later if it is slower.
//!
//! Vehicles behind the vehicle that changes lanes, in its lane or in its target lane, are left out.
//! They do not influence it, and with their recorded motion they would drive into it when it keeps
//! a longer distance than recorded. A vehicle whose record overlaps with another one is left out,
//! too. A vehicle whose record ends keeps its last speed.
//!
//! Each step can be *transferred* to the margin increase system: the vehicle that changes lanes
//! becomes the rear vehicle, the vehicle that it overtakes becomes the ego, and the next one ahead
//! becomes the lead vehicle.

use std::path::Path;

use closecall_controllers::{
    AccConfig, AebConfig, DriverConfig, EgoStackConfig, FollowConfig, OvertakerConfig, PrescribedConfig,
    ReactionConfig, Wiedemann99Config,
};
use closecall_recorded::encounter::{Participant, REAR_INDEX, RecordedEncounter};
use closecall_traffic::metrics::touching_distance_m;
use closecall_traffic::{
    ActorId, Environment, Lane, LateralPath, Num, Time, Trajectory, TrajectoryPoint, VehicleClass, VehicleConfig,
};

use crate::grip::lateral_grip_mps2;

use super::config::{AbsoluteStartConfig, ActorConfig, ScenarioConfig, StartConfig};
use super::recorded_values::{MIN_SPEED_MPS, max_speed_mps, rounded};
use super::reenacted::{
    FOLLOWING_SHARE, MAX_LANE_CHANGE_S, MIN_LANE_CHANGE_S, MIN_START_GAP_M, REACTION_S, RearDriver, Title, actor,
    config, prescribed_driver, start_of, with_actors, written,
};
use super::step_value::StepValue;
use super::{ScenarioError, ScenarioFile, Setting};

/// Distance of the ego behind all other vehicles (m): more than the 200 m that the sensors reach.
const EGO_DISTANCE_M: f64 = 250.0;
/// Time gap of the ego's adaptive cruise control (s). The ego never comes close enough to use it.
const EGO_TIME_GAP_S: f64 = 1.8;
/// Shortest times between two points of a lateral path (s). The first suitable one is taken:
/// assumptions. A lane change takes several seconds.
const PATH_STEPS_S: [f64; 5] = [0.5, 0.75, 1.0, 1.5, 2.0];
/// Shortest distance between two points of a lateral path (m): an assumption, 1 to 5 are plausible.
const PATH_STEP_M: f64 = 2.0;
/// Time in which a vehicle steers straight ahead after the end of its record (s): an assumption, 1
/// to 3 are plausible.
const STRAIGHTENING_S: f64 = 2.0;
/// Distance to the edge of the road that the path of a vehicle's centre keeps (m): numerical.
const EDGE_M: f64 = 0.01;
/// Largest acceleration with which a vehicle starts (m/s²): dry friction. Beyond it lies noise.
const MOST_MPS2: f64 = 9.0;
/// Name of the actor that changes lanes.
pub(super) const LANE_CHANGER: &str = "lane-changer";
/// Names of the vehicle that it overtakes, and of the vehicle that has overtaken it.
const OPP1: &str = "opp1";
const OPP2: &str = "opp2";

/// The scenario of one step, and the indices of its vehicles among its actors.
#[derive(Clone, Debug)]
pub struct SampledEncounter {
    /// The scenario.
    pub file: ScenarioFile,
    /// The vehicle that changes lanes.
    pub lane_changer: usize,
    /// The vehicle that it overtakes.
    pub opp1: Option<usize>,
    /// The vehicle that has overtaken it.
    pub opp2: Option<usize>,
    /// The index of that vehicle in the encounter.
    pub recorded_opp2: Option<usize>,
    /// The indices of all other simulated vehicles in the encounter.
    pub others: Vec<usize>,
    /// Start and end of the recorded lane change (s).
    pub lane_change_s: [f64; 2],
}

/// Returns the scenario in which a driver replaces the recorded one, and a parameter has one value;
/// without a value, the driver is as passed. The last argument holds the path that names the source
/// in error messages, and further settings.
///
/// # Errors
/// [`ScenarioError`] if the recorded values or the settings do not result in a valid scenario.
pub fn sampled(
    encounter: &RecordedEncounter,
    (driver, step): (&Wiedemann99Config, Option<StepValue<'_>>),
    (source, settings): (&Path, &[Setting]),
) -> Result<SampledEncounter, ScenarioError> {
    let in_set = |source_error| ScenarioError::Set { path: source.to_owned(), source: source_error };
    let step = step.map(|step| step.setting()).transpose().map_err(in_set)?;
    let settings: Vec<Setting> = settings.iter().cloned().chain(step).collect();
    let recorded_opp2 = opp2_of(encounter);
    let others = simulated_others(encounter, recorded_opp2);
    let built = built(encounter, &others, driver);
    let index_of =
        |config: &ScenarioConfig, name: &str| config.actors.iter().position(|actor| actor.id.as_str() == name);
    let file = written(built, (source, &settings))?;
    let changer = index_of(file.config(), LANE_CHANGER);
    let [opp1, opp2] = [OPP1, OPP2].map(|name| index_of(file.config(), name));
    let of_change = [encounter.change.start_s, encounter.change.end_s];
    Ok(SampledEncounter {
        file,
        lane_changer: changer.unwrap_or_default(),
        opp1,
        opp2,
        recorded_opp2,
        others,
        lane_change_s: of_change.map(|time_s| encounter.time_of(time_s).s().clamp(0.0, encounter.end.s())),
    })
}

impl SampledEncounter {
    /// Returns the encounter with the margin increase system: the vehicle that changes lanes
    /// becomes the rear vehicle, which follows with the parameters of this step and pulls out at
    /// the headway `cut_out_thw_s` (s), with which it crossed the marking in the run of this step.
    /// The path names the source in error messages.
    ///
    /// # Errors
    /// [`ScenarioError`] if the values do not result in a valid scenario.
    pub fn transferred(
        &self,
        encounter: &RecordedEncounter,
        cut_out_thw_s: f64,
        source: &Path,
    ) -> Result<ScenarioFile, ScenarioError> {
        let follow = match self.file.config().actors.get(self.lane_changer).map(|actor| &actor.driver) {
            Some(DriverConfig::Wiedemann99(config)) => config.clone(),
            _ => Wiedemann99Config::default(),
        };
        // A driver whose headway is no shorter than the one at which it pulls out would never come
        // that close.
        let longest_s = FOLLOWING_SHARE * cut_out_thw_s;
        let cc1_s = match follow.cc1_s {
            Some(Num::Fixed(cc1_s)) => cc1_s.min(longest_s),
            _ => longest_s,
        };
        let overtaker = DriverConfig::Overtaker(OvertakerConfig {
            cut_out_thw_s: rounded(cut_out_thw_s),
            follow: FollowConfig::Wiedemann99(Wiedemann99Config { cc1_s: Some(rounded(cc1_s)), ..follow }),
            reaction_s: ReactionConfig::Value(Num::Fixed(REACTION_S)),
            lane_change_duration_s: Some(rounded(
                (self.lane_change_s[1] - self.lane_change_s[0]).clamp(MIN_LANE_CHANGE_S, MAX_LANE_CHANGE_S),
            )),
            evasive_lateral_mps2: None,
            lapse: None,
            perception: None,
            brake_build_up_mps3: None,
            returns: None,
        });
        let transferred = config(encounter, RearDriver::Model).map(|mut config| {
            config.name = config.name.replace("reenacted", "transferred");
            config.tags = vec!["transferred".to_owned()];
            if let Some(rear) = config.actors.get_mut(REAR_INDEX) {
                rear.driver = overtaker;
            }
            config
        });
        written(transferred, (source, &[]))
    }
}

/// Returns the name of the actor that drives as a track does and is no opponent.
pub fn name_of_other(track_id: u64) -> String {
    format!("track-{track_id}")
}

/// Returns the index of the vehicle that has overtaken the lane changer, in the list of vehicles of
/// the encounter: the next vehicle ahead in the target lane at the recorded crossing, if it is
/// there from the start.
pub fn opp2_of(encounter: &RecordedEncounter) -> Option<usize> {
    let own_m = at_or_before(&encounter.rear().trajectory, encounter.crossing)?.s_m;
    let overtaken = encounter.overtaken_index();
    let others = encounter.vehicles.iter().enumerate();
    let others = others.filter(|(index, _)| *index != encounter.rear_index() && Some(*index) != overtaken);
    let ahead = others.filter_map(|(index, other)| {
        start_of(&other.trajectory)?;
        let point = at_or_before(&other.trajectory, encounter.crossing)?;
        (point.lane == encounter.target && point.s_m > own_m).then_some((index, point.s_m))
    });
    ahead.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
}

/// Returns the last point of a track at or before `time`, or `None` if the track is over by then.
fn at_or_before(track: &Trajectory, time: Time) -> Option<&TrajectoryPoint> {
    let after = track.points.partition_point(|point| point.time <= time);
    let point = track.points.get(after.checked_sub(1)?)?;
    (after < track.points.len() || point.time == time).then_some(point)
}

/// Returns the indices of the vehicles that are simulated beside the one that changes lanes: both
/// opponents, and the vehicles that are there from the start, not behind, and apart from all
/// others.
fn simulated_others(encounter: &RecordedEncounter, opp2: Option<usize>) -> Vec<usize> {
    let opp1 = encounter.overtaken_index();
    let is_opponent = |index: &usize| Some(*index) == opp1 || Some(*index) == opp2;
    let mut kept = vec![encounter.rear_index()];
    kept.extend((0..encounter.vehicles.len()).filter(is_opponent));
    for (index, vehicle) in encounter.vehicles.iter().enumerate() {
        let is_apart = |other: &usize| stays_apart(&encounter.vehicles[*other].trajectory, &vehicle.trajectory);
        let is_new = !kept.contains(&index) && start_of(&vehicle.trajectory).is_some();
        if is_new && !is_behind(encounter, vehicle) && kept.iter().all(is_apart) {
            kept.push(index);
        }
    }
    kept.split_off(1)
}

/// Returns the contents of the scenario file before a value is varied.
fn built(
    encounter: &RecordedEncounter,
    others: &[usize],
    driver: &Wiedemann99Config,
) -> Result<ScenarioConfig, String> {
    let changer = encounter.rear();
    let own = recorded_actor(encounter, LANE_CHANGER, changer, DriverConfig::Wiedemann99(driver.clone()))?;
    let mut actors = vec![own];
    let opp1 = encounter.overtaken_index();
    let opp2 = opp2_of(encounter);
    for &index in others {
        let vehicle = &encounter.vehicles[index];
        let name = match Some(index) {
            index if index == opp1 => OPP1.to_owned(),
            index if index == opp2 => OPP2.to_owned(),
            _ => name_of_other(vehicle.trajectory.track_id),
        };
        // The lateral path holds the lane changes.
        let speeds = match prescribed_driver(encounter, vehicle) {
            DriverConfig::Prescribed(prescribed) => {
                DriverConfig::Prescribed(PrescribedConfig { lane_changes: Vec::new(), ..prescribed })
            }
            other => other,
        };
        actors.push(recorded_actor(encounter, &name, vehicle, speeds)?);
    }
    let kept: Vec<&Participant> =
        std::iter::once(changer).chain(others.iter().map(|index| &encounter.vehicles[*index])).collect();
    actors.push(ego(encounter, &kept)?);
    let track_id = changer.trajectory.track_id;
    let past =
        opp1.map_or(String::new(), |index| format!(" past track {}", encounter.vehicles[index].trajectory.track_id));
    let title = Title {
        name: format!("sampled-track-{track_id}"),
        description: format!(
            "The lane change of track {track_id}{past} in {}, from {:.1} s on",
            encounter.data_name,
            encounter.start.s()
        ),
        tag: "sampled",
    };
    Ok(with_actors(encounter, title, actors))
}

/// Returns an actor that starts as recorded and follows the recorded lateral path.
fn recorded_actor(
    encounter: &RecordedEncounter,
    name: &str,
    vehicle: &Participant,
    driver: DriverConfig,
) -> Result<ActorConfig, String> {
    let start = start_of(&vehicle.trajectory).ok_or_else(|| format!("`{name}` appears after the start"))?;
    let path = lateral_path(encounter, &vehicle.trajectory);
    let width_m = encounter.lane_width_m;
    let lane = (1..=encounter.lanes).find(|lane| path[0][1] > -f64::from(*lane) * width_m).unwrap_or(encounter.lanes);
    let start = TrajectoryPoint { lane: Lane(lane), ..*start };
    let actor = actor(name, vehicle, &start, driver)?;
    Ok(ActorConfig {
        start: match actor.start {
            StartConfig::Absolute(absolute) => StartConfig::Absolute(AbsoluteStartConfig {
                acceleration_mps2: Some(rounded(start.acceleration_mps2.clamp(-MOST_MPS2, MOST_MPS2))),
                ..absolute
            }),
            other => other,
        },
        path: Some(path.iter().map(|point| point.map(rounded)).collect()),
        ..actor
    })
}

/// Returns the recorded lateral path of a vehicle, within the road: the finest one that needs no
/// more lateral acceleration than drivers use. What it leaves out is noise of the recorded
/// positions.
fn lateral_path(encounter: &RecordedEncounter, vehicle: &Trajectory) -> Vec<[f64; 2]> {
    let speed_mps = max_speed_mps([vehicle]);
    let friction = Environment::CLEAR_DAY.friction;
    let is_driven = |path: &Vec<[f64; 2]>| {
        let bend_per_m = LateralPath::new(path).map(|path| path.largest_second_derivative_per_m());
        bend_per_m.is_some_and(|bend_per_m| speed_mps * speed_mps * bend_per_m <= lateral_grip_mps2(friction))
    };
    let mut paths = PATH_STEPS_S.iter().map(|step_s| path_in_steps(encounter, vehicle, *step_s));
    paths.find(is_driven).unwrap_or_else(|| path_in_steps(encounter, vehicle, PATH_STEPS_S[PATH_STEPS_S.len() - 1]))
}

/// Returns the recorded lateral path of a vehicle with points at least `step_s` apart: at least two
/// pairs of the distance since the start and the lateral position (m).
fn path_in_steps(encounter: &RecordedEncounter, vehicle: &Trajectory, step_s: f64) -> Vec<[f64; 2]> {
    let right_m = -f64::from(encounter.lanes) * encounter.lane_width_m;
    let within = |d_m: f64| d_m.clamp(right_m + EDGE_M, -EDGE_M);
    let mut path: Vec<[f64; 2]> = Vec::new();
    let mut last: Option<&TrajectoryPoint> = None;
    let first_m = vehicle.points.first().map_or(0.0, |point| point.s_m);
    for point in &vehicle.points {
        let is_due =
            last.is_none_or(|last| point.s_m - last.s_m >= PATH_STEP_M && (point.time - last.time).s() >= step_s);
        if is_due {
            path.push([point.s_m - first_m, within(point.d_m)]);
            last = Some(point);
        }
    }
    // The end of the record, from which the vehicle steers straight ahead.
    if let (Some(end), Some(last)) = (vehicle.points.last(), last) {
        if end.s_m - last.s_m >= PATH_STEP_M {
            path.push([end.s_m - first_m, within(end.d_m)]);
        }
        let length_m = (STRAIGHTENING_S * end.speed_mps).max(PATH_STEP_M);
        let slope = end.lateral_speed_mps / end.speed_mps.max(MIN_SPEED_MPS);
        path.push([end.s_m.max(last.s_m) - first_m + length_m, within(end.d_m + 0.5 * slope * length_m)]);
    }
    // A vehicle that stands, or moves less than a step, keeps its lateral position.
    if let [only] = path[..] {
        path.push([PATH_STEP_M, only[1]]);
    }
    path
}

/// Returns whether two recorded vehicles never overlap, and keep a gap at the start.
fn stays_apart(one: &Trajectory, other: &Trajectory) -> bool {
    let touching_m = touching_distance_m(one.dimensions.length_m, other.dimensions.length_m);
    let beside_m = touching_distance_m(one.dimensions.width_m, other.dimensions.width_m);
    one.points.iter().all(|point| {
        let spare_m = if point.time == Time::ZERO { MIN_START_GAP_M } else { 0.0 };
        let apart = |at: &TrajectoryPoint| {
            (at.s_m - point.s_m).abs() > touching_m + spare_m || (at.d_m - point.d_m).abs() > beside_m
        };
        other.at(point.time).is_none_or(apart)
    })
}

/// Returns the ego, which is behind all other vehicles and as slow as the slowest of them.
fn ego(encounter: &RecordedEncounter, others: &[&Participant]) -> Result<ActorConfig, String> {
    let starts = || others.iter().filter_map(|other| start_of(&other.trajectory));
    let last_m = starts().map(|start| start.s_m).fold(f64::INFINITY, f64::min);
    let slowest_mps = starts().map(|start| start.speed_mps).fold(f64::INFINITY, f64::min).max(MIN_SPEED_MPS);
    let acc = AccConfig {
        time_gap_s: Num::Fixed(EGO_TIME_GAP_S),
        set_speed_mps: Some(rounded(slowest_mps)),
        standstill_gap_m: None,
    };
    Ok(ActorConfig {
        id: ActorId::new("ego").map_err(|error| error.to_string())?,
        vehicle: VehicleConfig::typical(VehicleClass::Car),
        start: StartConfig::Absolute(AbsoluteStartConfig {
            lane: encounter.home,
            s_m: rounded(last_m - EGO_DISTANCE_M),
            speed_mps: rounded(slowest_mps),
            acceleration_mps2: None,
        }),
        driver: DriverConfig::EgoStack(EgoStackConfig {
            acc,
            aeb: Some(AebConfig::default()),
            mis: None,
            human: None,
            automated: true,
        }),
        path: None,
        lane_keeping: None,
        speed_keeping: None,
        events: Vec::new(),
    })
}

/// Returns whether a vehicle is behind the lane changer at the crossing, or at the end of its track
/// before it, in one of the two lanes of the lane change.
fn is_behind(encounter: &RecordedEncounter, vehicle: &Participant) -> bool {
    let changer = &encounter.rear().trajectory;
    let until = vehicle.trajectory.span().map_or(Time::ZERO, |(_, last)| last.min(encounter.crossing));
    let pair = at_or_before(changer, until).zip(at_or_before(&vehicle.trajectory, until));
    pair.is_none_or(|(changer, other)| {
        [encounter.home, encounter.target].contains(&other.lane) && other.s_m <= changer.s_m
    })
}
