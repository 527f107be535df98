//! Computes the map.

use std::path::Path;

use closecall_campaign::runner::run_guarded;
use closecall_controllers::{
    ACTUATOR_LAG_S, ArrivalPrediction, BRAKE_RELEASE_JERK_MPS3, BrakingResponse, CheckedDriver, Encounter,
    GOAL_TOLERANCE_S, MisSettings, Reason,
};
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::{ScenarioError, ScenarioFile, Setting};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::{BuiltIn, ControllerChoice};
use closecall_simulation::{Arm, NoObserver, RunKey, SampleError};
use closecall_traffic::{CONTROL_STEP, ParameterName, Parameters, Value};
use rayon::prelude::*;
use serde::Serialize;

use super::MapPoint;

/// The scenario of every point.
const SCENARIO: &str = include_str!("scenario.toml");
/// Kilometres per hour in one metre per second.
const KMH_PER_MPS: f64 = 3.6;
/// Time for which the rear vehicle approaches before it can be detected (s): the run starts in
/// balance.
const BEFORE_DETECTION_S: f64 = 1.0;
/// The parameters that the grid sets. The gap at the start follows from the detection distance and
/// the speed difference.
const GRID_PARAMETERS: [&str; 5] = ["speed-mps", "closing-mps", "detection-m", "start-gap-m", "front-thw-s"];

/// A map that cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// A value is out of range, or a setting does not fit.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The controller has no plan to compare the loop with.
    #[error("`{controller}` has no braking plan to compare with: the map needs `mis` or `mis-extended`")]
    NoMis {
        /// The controller.
        controller: String,
    },
    /// A setting changes a parameter of the grid.
    #[error("`{setting}`: the grid has the values of `{parameter}`")]
    OfGrid {
        /// The setting.
        setting: String,
        /// The parameter.
        parameter: &'static str,
    },
    /// No scenario can have a value of the grid.
    #[error("failed to make a point of the map: {reason}")]
    Value {
        /// The parameter of the grid.
        parameter: &'static str,
        /// The value that it leads to, and what is allowed.
        reason: String,
    },
    /// The settings ask for tracks that are not true.
    #[error(
        "the map needs true tracks, as the theory assumes them: `sensors.mode` is `{mode}`, and may only be `ground-truth`"
    )]
    Sensors {
        /// The mode.
        mode: &'static str,
    },
    /// A point has no outcome.
    #[error("failed to run the point at {closing_kmh} km/h, {detection_m} m and {front_thw_s} s: {source}")]
    Point {
        /// The speed difference (km/h).
        closing_kmh: f64,
        /// The detection distance (m).
        detection_m: f64,
        /// The front time headway (s).
        front_thw_s: f64,
        /// The reason for which there is no outcome.
        source: SampleError,
    },
}

/// The grid of a map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MapGrid {
    /// Speed of the ego and of the lead vehicle (m/s).
    pub speed_mps: f64,
    /// Speed differences of the rear vehicle (km/h).
    pub closing_kmh: Vec<f64>,
    /// Detection distances (m).
    pub detection_m: Vec<f64>,
    /// Front time headways (s).
    pub front_thw_s: Vec<f64>,
}

impl MapGrid {
    /// Returns the grid with each list in rising order, without repeated values.
    fn sorted(&self) -> Self {
        let mut grid = self.clone();
        for list in [&mut grid.closing_kmh, &mut grid.detection_m, &mut grid.front_thw_s] {
            list.sort_by(f64::total_cmp);
            list.dedup();
        }
        grid
    }
}

/// A map.
#[derive(Clone, Debug, Serialize)]
pub struct Map {
    /// The grid.
    pub grid: MapGrid,
    /// The controller.
    pub controller: String,
    /// Largest braking of the system (m/s²).
    pub max_deceleration_mps2: f64,
    /// Gain of the front time headway that the system aims at (s).
    pub goal_s: f64,
    /// Critical gap (m).
    pub critical_gap_m: f64,
    /// Speed difference from which the system engages (km/h).
    pub engages_from_kmh: f64,
    /// The points, by front time headway, detection distance and speed difference.
    pub points: Vec<MapPoint>,
}

/// Computes the map of a margin increase system. `settings` change the scenario of the points, but
/// not the values of the grid, nor the true tracks.
///
/// # Errors
/// [`MapError`] if a value is out of range, a setting changes a value of the map, or a point has no
/// outcome.
pub fn map(grid: &MapGrid, controller: &ControllerChoice, settings: &[Setting]) -> Result<Map, MapError> {
    let Some(BuiltIn::Mis | BuiltIn::MisExtended) = controller.built_in() else {
        return Err(MapError::NoMis { controller: controller.to_string() });
    };
    settings.iter().try_for_each(leaves_grid)?;
    let grid = grid.sorted();
    let file = ScenarioFile::parse(Path::new("the scenario of the map"), SCENARIO, settings)?;
    let mut cells = Vec::new();
    for &front_thw_s in &grid.front_thw_s {
        for &detection_m in &grid.detection_m {
            cells.extend(grid.closing_kmh.iter().map(|&closing_kmh| Cell { closing_kmh, detection_m, front_thw_s }));
        }
    }
    let arm = Arm { controller: controller.factory(), sensors: Some(SensorMode::GroundTruth) };
    let computed: Result<Vec<(MapPoint, MisSettings)>, MapError> =
        cells.par_iter().map(|cell| cell.compute(grid.speed_mps, &file, &arm)).collect();
    let computed = computed?;
    let mis = computed.first().map_or(MisSettings::PAPER, |(_, mis)| *mis);
    Ok(Map {
        grid,
        controller: controller.to_string(),
        max_deceleration_mps2: mis.max_deceleration_mps2,
        goal_s: mis.thw_gain_s,
        critical_gap_m: mis.critical_gap_m,
        engages_from_kmh: KMH_PER_MPS * mis.engage_closing_mps,
        points: computed.into_iter().map(|(point, _)| point).collect(),
    })
}

/// Refuses a setting that changes a parameter of the grid.
fn leaves_grid(setting: &Setting) -> Result<(), MapError> {
    let setting = setting.to_string();
    let key = setting.split('=').next().unwrap_or_default();
    let mut parts = key.strip_prefix("parameters.").unwrap_or(key).split('.');
    let first = parts.next().unwrap_or_default();
    match GRID_PARAMETERS.into_iter().find(|parameter| *parameter == first) {
        Some(parameter) => Err(MapError::OfGrid { setting, parameter }),
        None => Ok(()),
    }
}

/// Returns the error of a point, which names the first parameter of the grid that it depends on.
fn grid_error(error: ScenarioError) -> MapError {
    if let ScenarioError::Value { source, at, .. } = &error
        && let Some(parameter) = GRID_PARAMETERS.into_iter().find(|name| at.contains(&format!("{name} = ")))
    {
        return MapError::Value { parameter, reason: format!("{source}{at}") };
    }
    error.into()
}

/// One point of the grid.
#[derive(Clone, Copy, Debug)]
struct Cell {
    closing_kmh: f64,
    detection_m: f64,
    front_thw_s: f64,
}

/// The theory's statement about a point.
struct Theory {
    planned_mps2: f64,
    margin_s: f64,
    at_once_s: Option<f64>,
}

impl Cell {
    fn compute(self, speed_mps: f64, file: &ScenarioFile, arm: &Arm) -> Result<(MapPoint, MisSettings), MapError> {
        let closing_mps = self.closing_kmh / KMH_PER_MPS;
        let values = [
            ("speed-mps", speed_mps),
            ("closing-mps", closing_mps),
            ("detection-m", self.detection_m),
            ("start-gap-m", self.detection_m + BEFORE_DETECTION_S * closing_mps),
            ("front-thw-s", self.front_thw_s),
        ];
        let named = |(name, value)| Some((ParameterName::new(name)?, Value::Number(value)));
        let parameters: Parameters = values.into_iter().filter_map(named).collect();
        let scenario = file.concrete(&parameters).map_err(grid_error)?;
        let CheckedDriver::Ego(ego) = &scenario.actors[scenario.ego].driver else {
            return Err(self.failed(SampleError::Panic { message: "the map has no ego".to_owned() }));
        };
        let mode = scenario.sensors.mode();
        if mode != SensorMode::GroundTruth {
            return Err(MapError::Sensors { mode: mode.name() });
        }
        let mis = arm.controller.settings(ego).mis().copied().unwrap_or(MisSettings::PAPER);
        let outcome = run_guarded(&scenario, RunKey { seed: 0, sample: 0 }, arm, &mut NoObserver)
            .map_err(|source| self.failed(source))?;
        let theory = self.theory(speed_mps, &mis);
        let summary = outcome.mis.as_ref().ok();
        let loop_s =
            summary.and_then(|mis| Some(mis.thw_front_at_critical_s.ok()? - mis.thw_front_at_engagement_s.ok()?));
        let is_in_time = |margin_s: Option<f64>| margin_s.is_some_and(|s| s >= mis.thw_gain_s - GOAL_TOLERANCE_S);
        let theory_s = theory.as_ref().map(|theory| theory.margin_s);
        let mut point = MapPoint {
            closing_kmh: self.closing_kmh,
            detection_m: self.detection_m,
            front_thw_s: self.front_thw_s,
            planned_mps2: theory.as_ref().map(|theory| theory.planned_mps2),
            theory_s,
            theory_at_once_s: theory.as_ref().and_then(|theory| theory.at_once_s),
            loop_s,
            is_in_time_in_theory: is_in_time(theory_s),
            is_in_time_in_loop: is_in_time(loop_s),
            reason: None,
        };
        if !point.agrees() {
            point.reason = Some(self.reason(&point, &outcome, &mis));
        }
        Ok((point, mis))
    }

    /// Returns the margin of the braking plan at the moment of the engagement; `None` if the
    /// conditions for engaging do not hold.
    fn theory(self, speed_mps: f64, mis: &MisSettings) -> Option<Theory> {
        let closing_mps = self.closing_kmh / KMH_PER_MPS;
        if closing_mps < mis.engage_closing_mps || self.front_thw_s >= mis.short_thw_s {
            return None;
        }
        let encounter = Encounter {
            ego_mps: speed_mps,
            front_gap_m: self.front_thw_s * speed_mps,
            lead_mps: speed_mps,
            rear_gap_m: self.detection_m.min(mis.engage_gap_m),
            closing_mps,
            critical_gap_m: mis.critical_gap_m,
        };
        let response = BrakingResponse {
            commanded_mps2: 0.0,
            braking_mps2: 0.0,
            build_up_mps3: mis.max_jerk_mps3,
            release_mps3: BRAKE_RELEASE_JERK_MPS3,
            lag_s: ACTUATOR_LAG_S,
        };
        let prediction = ArrivalPrediction { encounter, response };
        let goal_s = self.front_thw_s + mis.thw_gain_s;
        let planned_mps2 = prediction.solve(goal_s, mis.max_deceleration_mps2)?.deceleration_mps2;
        let at_once = encounter.solve(goal_s, mis.max_deceleration_mps2)?.deceleration_mps2;
        Some(Theory {
            planned_mps2,
            margin_s: prediction.headway_at_arrival_s(planned_mps2)? - self.front_thw_s,
            at_once_s: encounter.headway_at_arrival_s(at_once).map(|thw_s| thw_s - self.front_thw_s),
        })
    }

    /// Returns why theory and loop differ, from the events of the run.
    fn reason(self, point: &MapPoint, outcome: &Outcome, mis: &MisSettings) -> String {
        let Ok(summary) = &outcome.mis else { return "the controller has no margin increase system".to_owned() };
        let Ok(engaged_at_s) = summary.engaged_at_s else {
            return format!("the system does not engage in the loop: {}", summary.reason);
        };
        if point.theory_s.is_none() {
            return "the plan has no solution in theory, and the loop brakes as strongly as it may".to_owned();
        }
        let closing_mps = self.closing_kmh / KMH_PER_MPS;
        // The system engages up to one step of the controller after its conditions hold.
        let expected_s = BEFORE_DETECTION_S + (self.detection_m - mis.engage_gap_m).max(0.0) / closing_mps;
        if engaged_at_s - expected_s > CONTROL_STEP.s() + 1e-9 {
            let later_s = engaged_at_s - expected_s;
            return format!("the system engages {later_s:.2} s later in the loop than its conditions hold in theory");
        }
        if point.loop_s.is_none() {
            let released = summary
                .released_at_s
                .map_or_else(|_| "the run ends".to_owned(), |s| format!("it releases at {s:.2} s"));
            return format!("the rear vehicle never is at the critical gap in the loop: {released}");
        }
        if summary.reason == Reason::EngagedGoalOutOfReach
            && point.planned_mps2.is_some_and(|mps2| mps2 < mis.max_deceleration_mps2)
        {
            return "the plan at the engagement is out of reach in the loop, and not in theory".to_owned();
        }
        let mean = summary.mean_deceleration_mps2.map_or_else(|_| "-".to_owned(), |mps2| format!("{mps2:.2}"));
        format!(
            "not explained: the ego brakes by {mean} m/s² in the mean in the loop, the plan at the engagement asks for {:.2} m/s²",
            point.planned_mps2.unwrap_or(f64::NAN),
        )
    }

    fn failed(self, source: SampleError) -> MapError {
        let Self { closing_kmh, detection_m, front_thw_s } = self;
        MapError::Point { closing_kmh, detection_m, front_thw_s, source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> MapGrid {
        MapGrid {
            speed_mps: 30.0,
            closing_kmh: vec![8.0, 15.0, 24.0, 40.0],
            detection_m: vec![80.0, 100.0],
            front_thw_s: vec![0.7],
        }
    }

    #[test]
    fn theory_and_loop_agree_or_the_map_says_why() {
        let map = map(&grid(), &ControllerChoice::MIS, &[]).unwrap();
        assert_eq!(map.points.len(), 8);
        for point in &map.points {
            assert!(point.agrees() != point.reason.is_some(), "{point:?}");
        }
        let agreeing = map.points.iter().filter(|point| point.agrees() && point.loop_s.is_some()).count();
        assert!(agreeing >= 5, "{:?}", map.points);
    }

    #[test]
    fn what_the_map_sets_cannot_be_set_and_lists_are_sorted() {
        let refused =
            |text: &str| map(&grid(), &ControllerChoice::MIS, &[text.parse().unwrap()]).unwrap_err().to_string();
        for parameter in GRID_PARAMETERS {
            for key in [parameter.to_owned(), format!("parameters.{parameter}.fixed")] {
                let message = refused(&format!("{key}=3"));
                assert!(message.contains(&format!("the grid has the values of `{parameter}`")), "{message}");
            }
        }
        assert!(refused("sensors.mode=object").contains("may only be `ground-truth`"));
        let unsorted = MapGrid { closing_kmh: vec![24.0, 15.0, 24.0], detection_m: vec![100.0], ..grid() };
        assert_eq!(map(&unsorted, &ControllerChoice::MIS, &[]).unwrap().grid.closing_kmh, [15.0, 24.0]);
    }

    #[test]
    fn a_known_cause_of_a_difference_is_named() {
        let single = MapGrid { closing_kmh: vec![24.0], detection_m: vec![100.0], ..grid() };
        let settings = ["actor.rear.driver.prescribed.acceleration-profile=[[0.0, 0.0], [3.0, -3.0]]".parse().unwrap()];
        let map = map(&single, &ControllerChoice::MIS, &settings).unwrap();
        let reason = map.points[0].reason.as_deref().unwrap();
        assert!(
            reason.contains("the rear vehicle never is at the critical gap in the loop: it releases at"),
            "{reason}"
        );
    }

    #[test]
    fn the_reference_point_of_the_paper_is_just_in_time() {
        let map = map(&grid(), &ControllerChoice::MIS, &[]).unwrap();
        let at = |kmh: f64, m: f64| map.points.iter().find(|p| p.closing_kmh == kmh && p.detection_m == m).unwrap();
        assert!(at(24.0, 100.0).theory_at_once_s.unwrap() > 1.9, "{:?}", at(24.0, 100.0));
        assert!(at(15.0, 100.0).is_in_time_in_loop && !at(40.0, 100.0).is_in_time_in_loop);
        assert_eq!((at(8.0, 100.0).theory_s, at(8.0, 100.0).loop_s), (None, None), "below 10 km/h");
    }
}
