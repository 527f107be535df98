//! Makes a logical scenario from a recorded approach: the encounter of the published method with
//! the recorded vehicles, road and speeds, whose parameters vary around the recorded values.
//!
//! ```text
//!   target ─────────────────────────────────╭────────▶
//!                                    ╭──────╯
//!   home   ── rear ──────────────────╯──▶  ego ──▶  front ▶ brakes
//! ```
//!
//! | parameter | distribution |
//! |---|---|
//! | `cruise-mps`, `closing-mps` | normal around the recorded value; the spread is the bandwidth of all approaches ([`Variation`]) |
//! | `front-thw-s`, `lane-change-duration-s` | the same with the spread of all pairs and of all lane changes. If the approach has no value, the quantiles of the recordings; if these are too few, the distribution of the library's `low-thw-overtake` |
//! | `rear-cc1-s` | the steps of the published method from the recorded headway down to 0, in quarters, and uniformly in between. The headway at which the rear driver pulls out follows from it |
//! | `brake-mps2` | braking of car drivers in crashes and near-crashes, as `low-thw-overtake` has it for the rear driver, up to [`HARDEST_LEAD_BRAKING_MPS2`] |
//! | `brake-phase`, `reaction-s`, `hardest-braking-mps2`, `evasive-lateral-mps2` | as in `low-thw-overtake` |
//!
//! The lead vehicle keeps the speed of the ego until it brakes. Other vehicles of the recording are
//! left out, so that the passing lane is free.

use std::path::Path;

use closecall_controllers::{
    AccConfig, AebConfig, DriverConfig, EgoStackConfig, FollowConfig, LaneKeepingConfig, MisConfig, OvertakerConfig,
    PrescribedConfig, ReactionConfig, SpeedKeepingConfig, Wiedemann99Config,
};
use closecall_recorded::encounter::{Approach, Party, Variation};
use closecall_recorded::fit::MIN_VALUES;
use closecall_traffic::statistics::quantiles::quantile;
use closecall_traffic::{ActorId, LaneWidthsConfig, Num, ParameterName, RoadConfig, VehicleClass, VehicleConfig};

use super::config::{
    AbsoluteStartConfig, ActorConfig, EXPECTS_SHARE, Function, RelativeStartConfig, SCHEMA_VERSION, ScenarioConfig,
    StartConfig,
};
use super::events::{BrakeConfig, EffectConfig, EventConfig, NominalEncounterConfig, TriggerConfig};
use super::parameters::{FittedConfig, ParameterConfig, ParametersConfig, TruncatedNormalConfig};
use super::recorded_values::{rounded, to_steps};
use super::reenacted::written;
use super::{ScenarioError, ScenarioFile, library};
use crate::coverage::CoverageConfig;

/// The scenario of the library from which the drivers are taken.
const HEADLINE: &str = "low-thw-overtake";
/// Time for which the rear vehicle approaches before it would cross the marking (s): an assumption;
/// 5 to 20 are plausible. Windows of recordings seldom show the whole approach.
const APPROACH_S: f64 = 10.0;
/// Longest gap at the start (m): the gap of `low-thw-overtake`, beyond the 100 m at which the
/// system engages.
const LONGEST_GAP_M: f64 = 120.0;
/// Shortest gap at the start (m): an assumption; 2 to 10 are plausible.
const SHORTEST_GAP_M: f64 = 5.0;
/// Hardest braking of the lead vehicle (m/s²): full braking of a car on a dry road, as in
/// `low-thw-overtake`.
const HARDEST_LEAD_BRAKING_MPS2: f64 = 8.0;
/// Largest cc1 (s): below the critical headway of 0.9 s, since a driver who keeps more never comes
/// close.
const LARGEST_CC1_S: f64 = 0.85;
/// Gap at standstill of Wiedemann's model (m): its published default.
const STANDSTILL_GAP_M: f64 = 1.5;
/// Number of standard deviations at which a distribution around a recorded value is cut (-), as in
/// `fit`.
const CUT_SDS: f64 = 3.0;
/// Smallest standard deviation of a distribution: the resolution of the file.
const SMALLEST_SD: f64 = 0.001;
/// Position of the ego at the start (m): room for the vehicles behind.
const EGO_S_M: f64 = 500.0;
/// Time after the nominal approach until the run ends at the latest (s): an assumption; 10 to 40
/// are plausible.
const AFTERWARDS_S: f64 = 20.0;
/// Number of quantiles of an empirical distribution, as in `fit`.
const QUANTILES: usize = 11;

/// The spread of all approaches of the recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Spreads {
    /// The names of the recordings.
    pub source: String,
    /// Spread of the speed of the ego.
    pub ego_mps: Variation,
    /// Spread of the closing speed.
    pub closing_mps: Variation,
    /// Headways of all pairs that follow each other (s).
    pub front_headways_s: Vec<f64>,
    /// Durations of all complete lane changes (s).
    pub durations_s: Vec<f64>,
}

/// Returns the logical scenario of an approach. `name` is its name; the path appears in error
/// messages.
///
/// # Errors
/// [`ScenarioError`] if the recorded values do not result in a valid scenario.
pub fn logical(
    approach: &Approach,
    spreads: &Spreads,
    name: &str,
    source: &Path,
) -> Result<ScenarioFile, ScenarioError> {
    let headline = ScenarioFile::parse(&library::path(HEADLINE), library::text(HEADLINE).unwrap_or_default(), &[])?;
    let config = parameters(approach, spreads, &headline.config().parameters)
        .and_then(|parameters| config(approach, name, parameters));
    written(config, (source, &[]))
}

/// Returns the distributions of the parameters.
fn parameters(approach: &Approach, spreads: &Spreads, headline: &ParametersConfig) -> Result<ParametersConfig, String> {
    let values = &approach.values;
    let taken = |name: &str| {
        let entry = headline.0.iter().find(|(parameter, _)| parameter.as_str() == name);
        entry.map(|(_, config)| config.clone()).ok_or_else(|| format!("`{HEADLINE}` has no parameter `{name}`"))
    };
    let around = |value: f64, variation: Variation, bounds| {
        around(value, variation, (bounds, approach.rear.track_id, &spreads.source))
    };
    let recorded_or = |value: Option<f64>, all: &[f64], bounds, name: &str| match value {
        Some(value) => Ok(around(value, Variation::of(all), bounds)),
        None if all.len() >= MIN_VALUES => Ok(empirical(all, bounds, &spreads.source)),
        None => taken(name),
    };
    let mut braking = taken("hardest-braking-mps2")?;
    if let Some(normal) = &mut braking.truncated_normal {
        normal.max = HARDEST_LEAD_BRAKING_MPS2;
    }
    let largest_s = (values.crossing_thw_s - standstill_gap_m(approach) / values.ego_mps.max(1.0)).min(LARGEST_CC1_S);
    let steps = (0..=4).map(|step| to_steps(f64::from(step) / 4.0 * largest_s.max(SMALLEST_SD))).collect();
    let cc1 = ParameterConfig {
        assumed: Some(format!(
            "steps from the recorded headway of track {} down to 0, as the published method samples",
            approach.rear.track_id
        )),
        ..ParameterConfig::empirical(steps)
    };
    let all = [
        ("cruise-mps", around(values.ego_mps, spreads.ego_mps, [3.0, 60.0])),
        ("closing-mps", around(values.closing_mps, spreads.closing_mps, [0.25, 30.0])),
        ("front-thw-s", recorded_or(values.front_thw_s, &spreads.front_headways_s, [0.2, 5.0], "front-thw-s")?),
        (
            "lane-change-duration-s",
            recorded_or(values.duration_s, &spreads.durations_s, [1.5, 20.0], "lane-change-duration-s")?,
        ),
        ("rear-cc1-s", cc1),
        ("brake-mps2", braking),
        ("brake-phase", taken("brake-phase")?),
        ("reaction-s", taken("reaction-s")?),
        ("hardest-braking-mps2", taken("hardest-braking-mps2")?),
        ("evasive-lateral-mps2", taken("evasive-lateral-mps2")?),
    ];
    let named = |(name, config): (&str, ParameterConfig)| Ok((parameter_name(name)?, config));
    all.into_iter().map(named).collect::<Result<_, String>>().map(ParametersConfig)
}

fn parameter_name(name: &str) -> Result<ParameterName, String> {
    ParameterName::new(name).ok_or_else(|| format!("`{name}` is not a name of a parameter"))
}

/// Returns a normal distribution around a recorded value, within bounds.
fn around(value: f64, variation: Variation, (bounds, track, source): ([f64; 2], u64, &str)) -> ParameterConfig {
    let mean = to_steps(value.clamp(bounds[0] + SMALLEST_SD, bounds[1] - SMALLEST_SD));
    let sd = to_steps(variation.around(value)).max(SMALLEST_SD);
    let [min, max] = [(mean - CUT_SDS * sd).max(bounds[0]), (mean + CUT_SDS * sd).min(bounds[1])].map(to_steps);
    let normal = TruncatedNormalConfig { mean, sd, min, max };
    let base = ParameterConfig { truncated_normal: Some(normal), ..ParameterConfig::default() };
    match variation {
        Variation::Fitted { n, .. } => ParameterConfig {
            fitted: Some(FittedConfig { n: n as u64, source: source.to_owned(), ..FittedConfig::default() }),
            note: Some(format!(
                "the mean is the recorded value of track {track}; sd is the bandwidth of all (Silverman's rule)"
            )),
            ..base
        },
        Variation::Assumed { share } => ParameterConfig {
            assumed: Some(format!(
                "the mean is the recorded value of track {track}; the recording has too few values to fit a spread, {:.0} % is an assumption",
                100.0 * share
            )),
            ..base
        },
    }
}

/// Returns the quantiles of recorded values within bounds.
fn empirical(values: &[f64], bounds: [f64; 2], source: &str) -> ParameterConfig {
    let mut sorted: Vec<f64> = values.iter().map(|value| value.clamp(bounds[0], bounds[1])).collect();
    sorted.sort_by(f64::total_cmp);
    let levels = QUANTILES.min(sorted.len());
    let at = |level: usize| to_steps(quantile(&sorted, level as f64 / (levels - 1) as f64));
    ParameterConfig {
        fitted: Some(FittedConfig { n: values.len() as u64, source: source.to_owned(), ..FittedConfig::default() }),
        note: Some("this approach has no value of its own".to_owned()),
        ..ParameterConfig::empirical((0..levels).map(at).collect())
    }
}

/// Returns the gap at standstill of the rear driver (m): at most half of the gap with which it was
/// recorded at the crossing.
fn standstill_gap_m(approach: &Approach) -> f64 {
    STANDSTILL_GAP_M.min(0.5 * approach.values.crossing_thw_s * approach.values.ego_mps)
}

/// Returns the contents of the scenario file.
fn config(approach: &Approach, name: &str, parameters: ParametersConfig) -> Result<ScenarioConfig, String> {
    let values = &approach.values;
    let crossing_gap_m = values.crossing_thw_s * values.ego_mps;
    let gap_m = (crossing_gap_m + APPROACH_S * values.closing_mps).clamp(SHORTEST_GAP_M, LONGEST_GAP_M);
    let highest = |name: &str| {
        let entry = parameters.0.iter().find(|(parameter, _)| parameter.as_str() == name);
        entry.and_then(|(_, config)| Some(config.truncated_normal?.max)).unwrap_or_default()
    };
    let slowest_mps = parameters.0.iter().find(|(parameter, _)| parameter.as_str() == "closing-mps");
    let slowest_mps = slowest_mps.and_then(|(_, config)| Some(config.truncated_normal?.min)).unwrap_or(1.0);
    let (ego, rear, lead) = (&approach.ego, &approach.rear, approach.lead.as_ref());
    Ok(ScenarioConfig {
        function: Function::Mis,
        schema_version: SCHEMA_VERSION,
        name: name.to_owned(),
        description: format!(
            "Track {} (rear) overtakes track {} (ego) in {}, recorded from {:.1} to {:.1} s",
            rear.track_id, ego.track_id, approach.data_name, approach.from_s, approach.to_s
        ),
        tags: vec!["recorded-traffic".to_owned()],
        requirements: Vec::new(),
        checks: Default::default(),
        gate: Default::default(),
        expects: Vec::new(),
        expects_share: EXPECTS_SHARE,
        overridden: Vec::new(),
        coverage: CoverageConfig::default(),
        duration_s: rounded(gap_m / slowest_mps + AFTERWARDS_S),
        road: RoadConfig {
            lanes: approach.lanes,
            lane_width_m: LaneWidthsConfig::Equal(rounded(approach.lane_width_m)),
            curvature_per_m: Num::Fixed(0.0),
            cross_sections: Vec::new(),
            alignment: Vec::new(),
            alignment_d_m: None,
            speed_limit_mps: rounded(highest("cruise-mps") + highest("closing-mps")),
            overtaking_side: approach.direction(),
            guard_rails: false,
            roadside: closecall_traffic::RoadsideConfig::default(),
            acceleration_lane: None,
        },
        environment: Default::default(),
        actors: vec![
            ActorConfig {
                start: StartConfig::Absolute(AbsoluteStartConfig {
                    lane: approach.home,
                    s_m: Num::Fixed(EGO_S_M),
                    speed_mps: parameter("cruise-mps")?,
                    acceleration_mps2: None,
                }),
                ..actor("ego", vehicle(ego), ego_stack()?)?
            },
            ActorConfig {
                start: StartConfig::Ahead(RelativeStartConfig {
                    thw_s: Some(parameter("front-thw-s")?),
                    speed_mps: Some(parameter("cruise-mps")?),
                    ..relative("ego")?
                }),
                path: None,
                lane_keeping: Some(LaneKeepingConfig { sdlp_m: Num::Fixed(0.2) }),
                events: vec![lead_brakes()?],
                ..actor(
                    "front",
                    lead.map_or_else(|| VehicleConfig::typical(VehicleClass::Car), vehicle),
                    DriverConfig::Prescribed(PrescribedConfig {
                        profile: Some(vec![[Num::Fixed(0.0), parameter("cruise-mps")?]]),
                        ..PrescribedConfig::default()
                    }),
                )?
            },
            ActorConfig {
                start: StartConfig::Behind(RelativeStartConfig {
                    gap_m: Some(rounded(gap_m)),
                    closing_mps: Some(parameter("closing-mps")?),
                    ..relative("ego")?
                }),
                path: None,
                lane_keeping: Some(LaneKeepingConfig { sdlp_m: Num::Fixed(0.2) }),
                speed_keeping: Some(SpeedKeepingConfig { acceleration_noise_mps2: Num::Fixed(0.1) }),
                ..actor("rear", vehicle(rear), overtaker(approach)?)?
            },
        ],
        parameters,
        traffic: Vec::new(),
        sensors: Default::default(),
        random_numbers: None,
        controller: Default::default(),
        ideal: Default::default(),
        fault: Default::default(),
    })
}

fn parameter(name: &str) -> Result<Num, String> {
    Ok(Num::Parameter(parameter_name(name)?))
}

fn id(name: &str) -> Result<ActorId, String> {
    ActorId::new(name).map_err(|error| error.to_string())
}

fn relative(reference: &str) -> Result<RelativeStartConfig, String> {
    Ok(RelativeStartConfig {
        of: id(reference)?,
        gap_m: None,
        thw_s: None,
        speed_mps: None,
        closing_mps: None,
        settled: None,
        lane: None,
    })
}

/// Returns an actor at the start of the road, to be placed by the caller.
fn actor(name: &str, vehicle: VehicleConfig, driver: DriverConfig) -> Result<ActorConfig, String> {
    Ok(ActorConfig {
        id: id(name)?,
        vehicle,
        start: StartConfig::Ahead(relative("ego")?),
        driver,
        path: None,
        lane_keeping: None,
        speed_keeping: None,
        events: Vec::new(),
    })
}

fn vehicle(party: &Party) -> VehicleConfig {
    VehicleConfig {
        length_m: Some(rounded(party.dimensions.length_m)),
        width_m: Some(rounded(party.dimensions.width_m)),
        height_m: Some(rounded(party.dimensions.height_m)),
        ..VehicleConfig::typical(party.class)
    }
}

fn ego_stack() -> Result<DriverConfig, String> {
    Ok(DriverConfig::EgoStack(EgoStackConfig {
        acc: AccConfig { time_gap_s: parameter("front-thw-s")?, set_speed_mps: None, standstill_gap_m: None },
        aeb: Some(AebConfig::default()),
        mis: Some(MisConfig::default()),
        human: None,
        automated: true,
    }))
}

/// Returns the event by which the lead vehicle brakes to a standstill.
fn lead_brakes() -> Result<EventConfig, String> {
    Ok(EventConfig {
        id: id("front-brakes")?,
        when: TriggerConfig::NominalEncounter(NominalEncounterConfig {
            from: id("rear")?,
            to: id("ego")?,
            phase: parameter("brake-phase")?,
        }),
        then: EffectConfig::Brake(BrakeConfig {
            deceleration_mps2: parameter("brake-mps2")?,
            to_speed_mps: Some(Num::Fixed(0.0)),
        }),
    })
}

/// Returns the rear driver. Its safe gap, which follows from cc1, alone decides where it pulls out.
fn overtaker(approach: &Approach) -> Result<DriverConfig, String> {
    Ok(DriverConfig::Overtaker(OvertakerConfig {
        cut_out_thw_s: Num::Fixed(0.0),
        follow: FollowConfig::Wiedemann99(Wiedemann99Config {
            cc0_m: Some(rounded(standstill_gap_m(approach))),
            cc1_s: Some(parameter("rear-cc1-s")?),
            hardest_braking_mps2: Some(parameter("hardest-braking-mps2")?),
            ..Wiedemann99Config::default()
        }),
        reaction_s: ReactionConfig::Value(parameter("reaction-s")?),
        lane_change_duration_s: Some(parameter("lane-change-duration-s")?),
        evasive_lateral_mps2: Some(parameter("evasive-lateral-mps2")?),
        lapse: None,
        perception: None,
        brake_build_up_mps3: None,
        returns: None,
    }))
}
