//! A scenario made from a recorded encounter: everyone starts where and as fast as recorded, and E has the ego stack.
//!
//! | who | drives |
//! |---|---|
//! | E | the ego stack: time gap and set speed are those that the recorded driver kept |
//! | F | as recorded: speeds, and lane changes at their times (`prescribed`) |
//! | R | [`RearDriver`] |
//! | who stays ahead of R in another lane | as recorded |
//! | who stays behind R in the lane it changes to | follows by Wiedemann 99 at the highest speed recorded of it |
//!
//! Not simulated are all others: those in E's lane, of whom those behind would drive into E where E brakes; those who
//! change lanes, into gaps that are elsewhere now; those who come into view later, and those who would overlap with
//! another in the middle of a lane. Everyone starts in the middle of its lane.

use std::path::Path;

use closecall_controllers::{
    AccConfig, AebConfig, DriverConfig, EgoStackConfig, FollowConfig, MisConfig, OvertakerConfig, PrescribedConfig,
    PrescribedLaneChangeConfig, ReactionConfig, Wiedemann99Config,
};
use closecall_scenarios::encounter::{EGO, FRONT, Participant, REAR, RecordedEncounter};
use closecall_scenarios::filters::PERIOD;
use closecall_traffic::metrics::{bumper_gap_m, time_headway_s, touching_distance_m};
use closecall_traffic::{ActorId, Choice, Num, RoadConfig, Time, Trajectory, TrajectoryPoint, VehicleConfig};
use toml_edit::{ArrayOfTables, DocumentMut, Item};

use super::config::{AbsoluteStartConfig, ActorConfig, SCHEMA_VERSION, ScenarioConfig, StartConfig};
use super::{ScenarioError, ScenarioFile, Setting};

/// Who drives R.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RearDriver {
    /// A human driver who reacts to E, follows as closely as was recorded, and pulls out at the recorded headway
    #[default]
    Driver,
    /// The recorded speeds and the recorded lane change, whatever E does
    Recorded,
}

/// The names of E, F and R as actors.
const NAMES: [&str; 3] = ["ego", "front", "rear"];
/// The human drivers' reaction time [s]: the median of unwarned drivers (Green, Transportation Human Factors 2 (2000)).
const REACTION_S: f64 = 0.9;
/// Gap at standstill of Wiedemann's model [m]: its published default.
const STANDSTILL_GAP_M: f64 = 1.5;
/// R follows closer than it pulls out, by this factor, so that it gets to pull out.
const FOLLOWS_CLOSER: f64 = 0.9;
/// Time gaps that an adaptive cruise control has [s], and durations that a lane change has [s].
const TIME_GAPS_S: [f64; 2] = [0.2, 5.0];
const LANE_CHANGES_S: [f64; 2] = [1.5, 20.0];
/// Where nothing slower was recorded, speeds are taken to be at least this [m/s].
const SLOWEST_MPS: f64 = 1.0;
/// Room between two vehicles that start in one lane [m].
const LEAST_GAP_M: f64 = 0.5;
/// Values in the file have so many steps per unit.
const STEPS: f64 = 1_000.0;

/// A vehicle's name as an actor: ego, front, rear, or its track.
pub fn actor_name(place: usize, vehicle: &Trajectory) -> String {
    NAMES.get(place).map_or_else(|| format!("track-{}", vehicle.track_id), |name| (*name).to_owned())
}

/// The scenario of an encounter, with `settings` applied; `source` names where it comes from in messages.
///
/// # Errors
/// [`ScenarioError`] where the recorded values, or the settings, do not make a scenario.
pub fn reenact(
    encounter: &RecordedEncounter,
    rear: RearDriver,
    (source, settings): (&Path, &[Setting]),
) -> Result<ScenarioFile, ScenarioError> {
    let written = text(encounter, rear);
    let text = written.map_err(|message| ScenarioError::Syntax { path: source.to_owned(), line: 1, message })?;
    let file = ScenarioFile::parse(source, &text, settings)?;
    file.check()?;
    Ok(file)
}

/// The scenario file; what the format leaves to its defaults is not written.
fn text(encounter: &RecordedEncounter, rear: RearDriver) -> Result<String, String> {
    let written = toml::to_string(&config(encounter, rear)?).map_err(|error| error.to_string())?;
    let mut document: DocumentMut = written.parse().map_err(|error: toml_edit::TomlError| error.to_string())?;
    for left_out in ["requirements", "environment", "parameters", "sensors"] {
        document.remove(left_out);
    }
    let actors = document.get_mut("actor").and_then(Item::as_array_of_tables_mut);
    actors.into_iter().flat_map(ArrayOfTables::iter_mut).for_each(|actor| {
        actor.remove("event");
    });
    Ok(document.to_string())
}

fn config(encounter: &RecordedEncounter, rear: RearDriver) -> Result<ScenarioConfig, String> {
    let [ego, _, own] = encounter.protagonists();
    let mut actors = Vec::new();
    for (place, vehicle) in encounter.vehicles.iter().enumerate() {
        let driver = match (place, rear) {
            (EGO, _) => Some(ego_stack(encounter)),
            (FRONT, _) | (REAR, RearDriver::Recorded) => Some(as_recorded(encounter, vehicle)),
            (REAR, RearDriver::Driver) => Some(overtaker(encounter)),
            _ => bystander(encounter, vehicle),
        };
        let starts = &encounter.vehicles[..place];
        if let (Some(driver), Some(start)) = (driver, start_of(&vehicle.trajectory))
            && (place <= REAR || starts.iter().all(|earlier| is_clear(&earlier.trajectory, start, vehicle)))
        {
            actors.push(actor(&actor_name(place, &vehicle.trajectory), vehicle, (start, driver))?);
        }
    }
    Ok(ScenarioConfig {
        schema_version: SCHEMA_VERSION,
        name: format!("reenacted-track-{}", own.track_id),
        description: format!(
            "The encounter of track {} (R) with track {} (E) in {}, from {:.1} s on",
            own.track_id,
            ego.track_id,
            encounter.recording,
            encounter.start.s()
        ),
        tags: vec!["reenacted".to_owned()],
        requirements: Vec::new(),
        duration_s: rounded(encounter.end.s()),
        road: RoadConfig {
            lanes: encounter.lanes,
            lane_width_m: rounded(encounter.lane_width_m),
            curvature_per_m: Num::Fixed(0.0),
            speed_limit_mps: rounded(fastest_mps(encounter.vehicles.iter().map(|vehicle| &vehicle.trajectory))),
            overtaking_side: encounter.change.direction,
            guard_rails: false,
        },
        environment: Default::default(),
        parameters: Default::default(),
        actors,
        sensors: Default::default(),
    })
}

fn actor(
    name: &str,
    vehicle: &Participant,
    (start, driver): (&TrajectoryPoint, DriverConfig),
) -> Result<ActorConfig, String> {
    let size = &vehicle.trajectory.dimensions;
    Ok(ActorConfig {
        id: ActorId::new(name).map_err(|error| error.to_string())?,
        vehicle: VehicleConfig {
            class: Choice::Fixed(vehicle.trajectory.class),
            length_m: Some(rounded(size.length_m)),
            width_m: Some(rounded(size.width_m)),
            height_m: Some(rounded(size.height_m)),
            mass_kg: None,
            paint_reflectivity: None,
            paint_rgb: None,
            body_shape: None,
            brake_light_from_mps2: None,
        },
        start: StartConfig::Absolute(AbsoluteStartConfig {
            lane: start.lane,
            s_m: rounded(start.s_m),
            speed_mps: rounded(start.speed_mps.max(0.0)),
        }),
        driver,
        lane_keeping: None,
        speed_keeping: None,
        events: Vec::new(),
    })
}

/// Where a vehicle is at the start, if it is there by then.
fn start_of(vehicle: &Trajectory) -> Option<&TrajectoryPoint> {
    vehicle.points.first().filter(|point| point.time == Time::ZERO)
}

/// True where a vehicle that starts at `start` does not touch another one in its lane.
fn is_clear(other: &Trajectory, start: &TrajectoryPoint, vehicle: &Participant) -> bool {
    let touching_m = touching_distance_m(other.dimensions.length_m, vehicle.trajectory.dimensions.length_m);
    start_of(other).is_none_or(|at| at.lane != start.lane || (at.s_m - start.s_m).abs() > touching_m + LEAST_GAP_M)
}

fn ego_stack(encounter: &RecordedEncounter) -> DriverConfig {
    let [ego, front, _] = encounter.protagonists();
    let mut headways_s: Vec<f64> = gaps(ego, front, encounter.crossing)
        .filter_map(|(gap_m, own_mps)| time_headway_s(gap_m, own_mps).ok())
        .collect();
    headways_s.sort_by(f64::total_cmp);
    let kept_s = headways_s.get(headways_s.len() / 2).copied().unwrap_or(TIME_GAPS_S[1]);
    DriverConfig::EgoStack(EgoStackConfig {
        acc: AccConfig {
            time_gap_s: rounded(kept_s.clamp(TIME_GAPS_S[0], TIME_GAPS_S[1])),
            set_speed_mps: Some(rounded(fastest_mps([ego]))),
            standstill_gap_m: None,
        },
        aeb: Some(AebConfig::default()),
        mis: Some(MisConfig::default()),
        automated: true,
    })
}

/// R as a human driver: as close behind E as was recorded, and as fast.
fn overtaker(encounter: &RecordedEncounter) -> DriverConfig {
    let [ego, _, rear] = encounter.protagonists();
    let cut_out_thw_s = encounter.crossing_thw_s;
    let start_mps = start_of(rear).map_or(SLOWEST_MPS, |start| start.speed_mps.max(SLOWEST_MPS));
    let cc0_m = STANDSTILL_GAP_M.min(0.5 * cut_out_thw_s * start_mps);
    let closest_s = gaps(rear, ego, encounter.crossing)
        .filter(|(_, own_mps)| *own_mps >= SLOWEST_MPS)
        .map(|(gap_m, own_mps)| (gap_m - cc0_m) / own_mps)
        .fold(cut_out_thw_s - cc0_m / start_mps, f64::min);
    let [shortest_s, longest_s] = LANE_CHANGES_S;
    DriverConfig::Overtaker(OvertakerConfig {
        cut_out_thw_s: rounded(cut_out_thw_s),
        follow: FollowConfig::Wiedemann99(Wiedemann99Config {
            cc0_m: Some(rounded(cc0_m)),
            cc1_s: Some(rounded((FOLLOWS_CLOSER * closest_s).max(0.0))),
            desired_speed_mps: Some(rounded(fastest_mps([rear]))),
            ..Wiedemann99Config::default()
        }),
        reaction_s: ReactionConfig::Value(Num::Fixed(REACTION_S)),
        lane_change_duration_s: Some(rounded(encounter.change.duration_s.clamp(shortest_s, longest_s))),
        evasive_lateral_mps2: None,
        lapse: None,
        returns: None,
    })
}

/// Gap to `ahead` [m] and own speed [m/s] of a vehicle, up to a time.
fn gaps(own: &Trajectory, ahead: &Trajectory, until: Time) -> impl Iterator<Item = (f64, f64)> {
    let [own_m, ahead_m] = [own, ahead].map(|vehicle| vehicle.dimensions.length_m);
    let before = own.points.iter().take_while(move |point| point.time < until);
    before.filter_map(move |point| {
        Some((bumper_gap_m(ahead.at(point.time)?.s_m - point.s_m, own_m, ahead_m), point.speed_mps))
    })
}

/// Who is neither E, F nor R; nothing for those who are not simulated.
fn bystander(encounter: &RecordedEncounter, vehicle: &Participant) -> Option<DriverConfig> {
    let (start, rear) = (start_of(&vehicle.trajectory)?, start_of(encounter.protagonists()[REAR])?);
    let stays = vehicle.trajectory.points.iter().all(|point| point.lane == start.lane);
    if !stays || start.lane == encounter.home {
        return None;
    }
    if start.s_m > rear.s_m {
        return Some(as_recorded(encounter, vehicle));
    }
    (start.lane == encounter.target).then(|| {
        DriverConfig::Wiedemann99(Wiedemann99Config {
            desired_speed_mps: Some(rounded(fastest_mps([&vehicle.trajectory]))),
            reaction_s: Some(ReactionConfig::Value(Num::Fixed(REACTION_S))),
            ..Wiedemann99Config::default()
        })
    })
}

/// The recorded speeds on the recording's common clock, and the recorded lane changes.
fn as_recorded(encounter: &RecordedEncounter, vehicle: &Participant) -> DriverConfig {
    let on_clock = vehicle.trajectory.points.iter().filter(|point| point.time.is_multiple_of(PERIOD));
    let pair = |point: &TrajectoryPoint| [rounded(point.time.s()), rounded(point.speed_mps.max(0.0))];
    let mut free_from_s = 0.0;
    let mut lane_changes = Vec::new();
    for change in &vehicle.changes {
        let at_s = encounter.time_of(change.start_s).s().max(free_from_s);
        let end_s = encounter.time_of(change.end_s).s();
        let duration_s = (end_s - at_s).clamp(LANE_CHANGES_S[0], LANE_CHANGES_S[1]);
        let (at_s, duration_s) = (to_steps(at_s), to_steps(duration_s));
        // One step of rounding later than the end, so that the two never overlap.
        free_from_s = at_s + duration_s + 1.0 / STEPS;
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

fn fastest_mps<'a>(vehicles: impl IntoIterator<Item = &'a Trajectory>) -> f64 {
    let speeds = vehicles.into_iter().flat_map(|vehicle| vehicle.points.iter().map(|point| point.speed_mps));
    speeds.fold(SLOWEST_MPS, f64::max)
}

fn rounded(value: f64) -> Num {
    Num::Fixed(to_steps(value))
}

fn to_steps(value: f64) -> f64 {
    (value * STEPS).round() / STEPS
}
