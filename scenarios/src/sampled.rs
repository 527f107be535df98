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
//! | `lane-changer` | the vehicle that changes lanes | Wiedemann 99 with its published parameters; the desired speed is the highest recorded one. It changes lanes when the recorded vehicle does |
//! | `opp1` | the vehicle that it overtakes: the next one ahead in the lane that it leaves | recorded speeds and lane changes |
//! | `opp2` | the vehicle that has overtaken it: the next one ahead in the other lane at the recorded crossing, if there is one | the same |
//! | `track-…` | all other vehicles that are there from the start | the same |
//! | `ego` | no recorded vehicle: a scenario has one ego, and here no vehicle carries the system under test | the ego stack without the margin increase system, [`EGO_DISTANCE_M`] behind all others |
//!
//! Vehicles behind the vehicle that changes lanes, in its lane or in its target lane, are left out.
//! They do not influence it, and with their recorded motion they would drive into it when it keeps
//! a longer distance than recorded. A vehicle whose recorded lane changes do not fit the lanes of
//! the road is left out, too.
//!
//! Each step can be *transferred* to the margin increase system: the vehicle that changes lanes
//! becomes the rear vehicle, the vehicle that it overtakes becomes the ego, and the next one ahead
//! becomes the lead vehicle.

use std::path::Path;

use closecall_controllers::{
    AccConfig, AebConfig, DriverConfig, EgoStackConfig, FollowConfig, OvertakerConfig, ReactionConfig,
    Wiedemann99Config,
};
use closecall_recorded::encounter::{EGO_INDEX, Participant, REAR_INDEX, RecordedEncounter};
use closecall_traffic::{ActorId, Lane, Num, Side, Time, Trajectory, TrajectoryPoint, VehicleClass, VehicleConfig};

use super::config::{AbsoluteStartConfig, ActorConfig, ScenarioConfig, StartConfig};
use super::events::{EffectConfig, EventConfig, LaneChangeConfig, TriggerConfig};
use super::recorded_values::{MIN_SPEED_MPS, max_speed_mps, rounded, to_steps};
use super::reenacted::{
    FOLLOWING_SHARE, MAX_LANE_CHANGE_S, MIN_LANE_CHANGE_S, REACTION_S, RearDriver, actor, config, is_clear,
    lane_change_across, prescribed_driver, start_of, written,
};
use super::step_value::StepValue;
use super::{ScenarioError, ScenarioFile, Setting};

/// Distance of the ego behind all other vehicles (m): more than the 200 m that the sensors reach.
const EGO_DISTANCE_M: f64 = 250.0;
/// Time gap of the ego's adaptive cruise control (s). The ego never comes close enough to use it.
const EGO_TIME_GAP_S: f64 = 1.8;
/// Name of the actor that changes lanes.
pub(super) const LANE_CHANGER: &str = "lane-changer";

/// The scenario of one step, and the indices of its vehicles among its actors.
#[derive(Clone, Debug)]
pub struct SampledEncounter {
    /// The scenario.
    pub file: ScenarioFile,
    /// The vehicle that changes lanes.
    pub lane_changer: usize,
    /// The vehicle that it overtakes.
    pub opp1: usize,
    /// The vehicle that has overtaken it.
    pub opp2: Option<usize>,
    /// The index of that vehicle in the encounter.
    pub recorded_opp2: Option<usize>,
    /// Start and end of the lane change (s), at the recorded speeds.
    pub lane_change_s: [f64; 2],
}

/// Returns the scenario in which a parameter of a recorded lane change has one value. The last
/// argument holds the path that names the source in error messages, and further settings.
///
/// # Errors
/// [`ScenarioError`] if the recorded values or the settings do not result in a valid scenario.
pub fn sampled(
    encounter: &RecordedEncounter,
    step: StepValue<'_>,
    (source, settings): (&Path, &[Setting]),
) -> Result<SampledEncounter, ScenarioError> {
    let in_set = |source_error| ScenarioError::Set { path: source.to_owned(), source: source_error };
    let settings = [settings, &[step.setting().map_err(in_set)?]].concat();
    let recorded_opp2 = opp2_of(encounter);
    let lane_change = lane_change_of(encounter);
    let built = built(encounter, recorded_opp2, lane_change);
    let index_of =
        |config: &ScenarioConfig, name: &str| config.actors.iter().position(|actor| actor.id.as_str() == name);
    let file = written(built, (source, &settings))?;
    let (changer, opp1) = (index_of(file.config(), LANE_CHANGER), index_of(file.config(), "opp1"));
    let opp2 = index_of(file.config(), "opp2");
    Ok(SampledEncounter {
        file,
        lane_changer: changer.unwrap_or_default(),
        opp1: opp1.unwrap_or_default(),
        opp2,
        recorded_opp2,
        lane_change_s: [lane_change.at_s, lane_change.at_s + lane_change.duration_s],
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
            lane_change_duration_s: Some(rounded(self.lane_change_s[1] - self.lane_change_s[0])),
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

/// Returns the index of the vehicle that has overtaken the lane changer, in the list of vehicles of
/// the encounter: the next vehicle ahead in the target lane at the recorded crossing, if it is
/// there from the start.
pub fn opp2_of(encounter: &RecordedEncounter) -> Option<usize> {
    let own_m = at_or_before(&encounter.rear().trajectory, encounter.crossing)?.s_m;
    let others = encounter.vehicles.iter().enumerate().skip(encounter.rear_index() + 1);
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

/// When a lane change takes place.
#[derive(Clone, Copy)]
struct LaneChangeTimes {
    /// Its start (s).
    at_s: f64,
    /// Its duration (s).
    duration_s: f64,
}

/// Returns the times of the lane change, which crosses the marking when the recorded one does.
fn lane_change_of(encounter: &RecordedEncounter) -> LaneChangeTimes {
    let [start_s, end_s] =
        [encounter.change.start_s, encounter.change.end_s].map(|time_s| encounter.time_of(time_s).s());
    let rear = &encounter.rear().trajectory;
    let as_recorded = (start_s.max(0.0), (end_s - start_s.max(0.0)).clamp(MIN_LANE_CHANGE_S, MAX_LANE_CHANGE_S));
    let (at_s, duration_s) = lane_change_across(rear, [start_s, encounter.crossing.s()], 0.0).unwrap_or(as_recorded);
    LaneChangeTimes { at_s: to_steps(at_s), duration_s: to_steps(duration_s) }
}

/// Returns the contents of the scenario file before a value is varied.
fn built(
    encounter: &RecordedEncounter,
    opp2: Option<usize>,
    lane_change: LaneChangeTimes,
) -> Result<ScenarioConfig, String> {
    let base = config(encounter, RearDriver::Recorded)?;
    let changer = encounter.rear();
    let own_start = start_of(&changer.trajectory).ok_or("the vehicle that changes lanes appears after the start")?;
    let mut actors = vec![lane_changer(encounter, changer, own_start, lane_change)?];
    let mut kept: Vec<&Participant> = vec![changer];
    for (index, vehicle) in encounter.vehicles.iter().enumerate().filter(|(index, _)| *index != encounter.rear_index())
    {
        let Some(start) = start_of(&vehicle.trajectory) else { continue };
        let is_opponent = index == EGO_INDEX || Some(index) == opp2;
        let fits = fits_the_road(encounter, vehicle, start.lane)
            && kept.iter().all(|earlier| is_clear(&earlier.trajectory, start, vehicle));
        if !is_opponent && (is_behind(encounter, vehicle) || !fits) {
            continue;
        }
        let name = match index {
            EGO_INDEX => "opp1".to_owned(),
            _ if Some(index) == opp2 => "opp2".to_owned(),
            _ => format!("track-{}", vehicle.trajectory.track_id),
        };
        actors.push(actor(&name, vehicle, start, prescribed_driver(encounter, vehicle))?);
        kept.push(vehicle);
    }
    actors.push(ego(encounter, &kept)?);
    Ok(ScenarioConfig {
        name: format!("sampled-track-{}", changer.trajectory.track_id),
        description: format!(
            "The lane change of track {} past track {} in {}, from {:.1} s on",
            changer.trajectory.track_id,
            encounter.vehicles[EGO_INDEX].trajectory.track_id,
            encounter.data_name,
            encounter.start.s()
        ),
        tags: vec!["sampled".to_owned()],
        actors,
        ..base
    })
}

/// Returns the vehicle that changes lanes: it follows by Wiedemann's model, and changes lanes when
/// the recorded one does.
fn lane_changer(
    encounter: &RecordedEncounter,
    changer: &Participant,
    start: &TrajectoryPoint,
    LaneChangeTimes { at_s, duration_s }: LaneChangeTimes,
) -> Result<ActorConfig, String> {
    let driver = DriverConfig::Wiedemann99(Wiedemann99Config {
        desired_speed_mps: Some(rounded(max_speed_mps([&changer.trajectory]))),
        ..Wiedemann99Config::default()
    });
    let change = EventConfig {
        id: ActorId::new("changes-lanes").map_err(|error| error.to_string())?,
        when: TriggerConfig::AtS(Num::Fixed(at_s)),
        then: EffectConfig::LaneChange(LaneChangeConfig {
            to: encounter.change.direction,
            duration_s: Num::Fixed(duration_s),
        }),
    };
    Ok(ActorConfig { events: vec![change], ..actor(LANE_CHANGER, changer, start, driver)? })
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
        }),
        driver: DriverConfig::EgoStack(EgoStackConfig {
            acc,
            aeb: Some(AebConfig::default()),
            mis: None,
            human: None,
            automated: true,
        }),
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

/// Returns whether all lane changes of a vehicle that starts in lane `start` lead to a lane of the
/// road.
fn fits_the_road(encounter: &RecordedEncounter, vehicle: &Participant, start: Lane) -> bool {
    let mut lane = start.0;
    vehicle.changes.iter().all(|change| {
        lane = match change.direction {
            Side::Left => lane.saturating_sub(1),
            Side::Right => lane.saturating_add(1),
        };
        (1..=encounter.lanes).contains(&lane)
    })
}
