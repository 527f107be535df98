//! Errors of the ego's odometry, of its position on the map, and of the map itself. The ego does
//! not know them.
//!
//! ```text
//!   scene ─▶ seen from the ego: distance, bearing ─▶ + own position, heading and speed, on the map ─▶ scene as believed
//!                 (as it is)                                 (wrong)
//! ```
//!
//! The ego derives the speed of another vehicle from a position relative to itself and its own
//! motion, and its lane from the same position and the map. All positions relative to the ego are
//! right. Speeds over ground, lanes and the region of interest are wrong.

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{ConfigError, Num, Parameters, Range, Road, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::list::check_span;
use crate::{Scene, SceneVehicle};

/// Greatest relative error of the speed (-).
const MAX_SPEED_SCALE: f64 = 0.1;
/// Greatest error of the lateral position (m).
const MAX_LATERAL_M: f64 = 1.0;
/// Greatest error of the heading (deg).
const MAX_HEADING_DEG: f64 = 3.0;
/// Greatest error of the curvature (1/m): a bend of a radius of 1 km that the map takes for
/// straight.
const MAX_CURVATURE_PER_M: f64 = 0.001;
/// Greatest error of the width of a lane (m).
const MAX_LANE_WIDTH_M: f64 = 1.0;

/// Errors of odometry and map as a scenario file describes them. They hold from `from-s` to
/// `until-s`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct OdometryErrorConfig {
    /// Time at which the errors begin (s). Default: before the start of the run.
    pub from_s: Option<Num>,
    /// Time at which the errors end (s). Default: the end of the run.
    pub until_s: Option<Num>,
    /// Relative error of the measured own speed (-): 0.01 if the ego takes 30 m/s for 30.3 m/s.
    /// Wheel speeds err by the wear and the pressure of the tyres. Default: 0.
    pub speed_scale: Option<Num>,
    /// Error of the own lateral position on the map (m): positive if the ego believes itself too
    /// far left. Default: 0.
    pub lateral_m: Option<Num>,
    /// Error of the own heading relative to the road (deg): positive if the ego believes itself to
    /// be turned too far to the left. It moves a vehicle 60 m behind by 1 m per degree on the map.
    /// Default: 0.
    pub heading_deg: Option<Num>,
    /// Error of the curvature on the map (1/m): positive if the map bends too far to the left.
    /// Default: 0.
    pub curvature_per_m: Option<Num>,
    /// Error of the width of each lane on the map (m): positive if the lanes on the map are too
    /// wide. Default: 0.
    pub lane_width_m: Option<Num>,
    /// The map has no guard rails, though they stand along the road. It needs `guard-rails`. The
    /// region of interest then reaches behind them.
    pub rails_missing: bool,
}

/// Checked errors of odometry and map. None by default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryErrors {
    /// Begin and end (s).
    span_s: [f64; 2],
    /// Relative error of the measured own speed (-).
    pub speed_scale: f64,
    /// Error of the own lateral position (m).
    pub lateral_m: f64,
    /// Error of the own heading (rad).
    pub heading_rad: f64,
    /// Error of the curvature on the map (1/m).
    pub curvature_per_m: f64,
    /// Error of the width of each lane on the map (m).
    pub lane_width_m: f64,
    /// Whether guard rails are missing on the map.
    pub has_no_rails: bool,
}

impl Default for OdometryErrors {
    fn default() -> Self {
        Self {
            span_s: [f64::NEG_INFINITY, f64::INFINITY],
            speed_scale: 0.0,
            lateral_m: 0.0,
            heading_rad: 0.0,
            curvature_per_m: 0.0,
            lane_width_m: 0.0,
            has_no_rails: false,
        }
    }
}

impl OdometryErrorConfig {
    /// Checks the errors.
    ///
    /// # Errors
    /// [`ConfigError`] if a value is out of its range.
    pub fn check(&self, parameters: &Parameters) -> Result<OdometryErrors, ConfigError> {
        let number = |num: &Option<Num>, key, limit: f64| {
            parameters.number_or(num.as_ref(), key, Range::closed(-limit, limit), 0.0)
        };
        Ok(OdometryErrors {
            span_s: check_span([&self.from_s, &self.until_s], parameters)?,
            speed_scale: number(&self.speed_scale, "speed-scale", MAX_SPEED_SCALE)?,
            lateral_m: number(&self.lateral_m, "lateral-m", MAX_LATERAL_M)?,
            heading_rad: number(&self.heading_deg, "heading-deg", MAX_HEADING_DEG)?.to_radians(),
            curvature_per_m: number(&self.curvature_per_m, "curvature-per-m", MAX_CURVATURE_PER_M)?,
            lane_width_m: number(&self.lane_width_m, "lane-width-m", MAX_LANE_WIDTH_M)?,
            has_no_rails: self.rails_missing,
        })
    }
}

impl OdometryErrors {
    /// Returns whether there is no error.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Returns begin and end of the errors (s).
    pub(super) fn span_s(&self) -> [f64; 2] {
        self.span_s
    }

    /// Returns the errors that hold at `time`.
    #[must_use]
    pub fn at(&self, time: Time) -> Self {
        let [from_s, until_s] = self.span_s;
        if from_s <= time.s() && time.s() < until_s { *self } else { Self::default() }
    }

    /// Returns the same errors from before the start of the run to its end.
    #[must_use]
    pub fn throughout(self) -> Self {
        Self { span_s: Self::default().span_s, ..self }
    }

    /// Returns the road as the map shows it.
    #[must_use]
    pub fn map_of(&self, road: &Road) -> Road {
        let mut map = road.clone();
        if self.curvature_per_m != 0.0 {
            map = map.with_added_curvature(self.curvature_per_m);
        }
        if self.lane_width_m != 0.0 {
            map = map.with_added_lane_width(self.lane_width_m);
        }
        if self.has_no_rails { map.without_guard_rails() } else { map }
    }

    /// Returns the lateral position on the map of an ego at (`s_m`, `d_m`) (m). The ego measures its
    /// place between the markings of its lane.
    pub fn own_d_m(&self, road: &Road, s_m: f64, d_m: f64) -> f64 {
        if self.lane_width_m == 0.0 {
            return d_m + self.lateral_m;
        }
        let map = self.map_of(road);
        let on_map_m = match [&map, road].map(Road::equal_lane_width_m) {
            [Some(map_m), Some(width_m)] => d_m * (map_m / width_m),
            _ => {
                let lane = road.lane_at(s_m, d_m);
                let scale = map.lane_width_m(lane, s_m) / road.lane_width_m(lane, s_m);
                map.lane_centre_m(lane, s_m) + (d_m - road.lane_centre_m(lane, s_m)) * scale
            }
        };
        on_map_m + self.lateral_m
    }
}

/// The ego's beliefs about itself, the road and the vehicles around it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Belief {
    errors: OdometryErrors,
    /// Position along the road in the previous step (m).
    previous_s_m: Option<f64>,
    /// Distance that the ego believes to have driven beyond the true one (m). It remains when the
    /// error of the speed ends.
    ahead_m: f64,
    map: Option<Road>,
    others: Vec<SceneVehicle>,
}

impl Belief {
    /// Creates a belief with these errors.
    pub(crate) fn new(errors: OdometryErrors) -> Self {
        Self { errors, ..Self::default() }
    }

    /// Returns the scene as the ego believes it to be.
    pub(crate) fn of<'a>(&'a mut self, scene: &Scene<'a>) -> Scene<'a> {
        if self.errors.is_none() {
            return *scene;
        }
        let errors = self.errors.at(scene.time);
        let ego_state = scene.ego.state;
        self.ahead_m += errors.speed_scale * (ego_state.s_m - self.previous_s_m.unwrap_or(ego_state.s_m));
        self.previous_s_m = Some(ego_state.s_m);
        let map = &*self.map.insert(errors.map_of(scene.road));
        let faster_mps = errors.speed_scale * ego_state.speed_mps;
        let mut ego = scene.ego;
        ego.state.s_m += self.ahead_m;
        ego.state.d_m = errors.own_d_m(scene.road, ego_state.s_m, ego_state.d_m);
        ego.state.heading_rad += errors.heading_rad;
        ego.state.speed_mps += faster_mps;
        let [seen, believed] = [EgoFrame::new(scene.road, &ego_state), EgoFrame::new(map, &ego.state)];
        let on_map = |vehicle: &SceneVehicle| {
            let mut vehicle = *vehicle;
            let state = &mut vehicle.state;
            let at = seen.point(state.s_m, state.d_m);
            (state.s_m, state.d_m) = believed.road_position_m(at.x_m, at.y_m);
            state.heading_rad += at.road_yaw_rad - believed.point(state.s_m, state.d_m).road_yaw_rad;
            state.speed_mps += faster_mps;
            vehicle
        };
        self.others.clear();
        self.others.extend(scene.others.iter().map(on_map));
        Scene { road: map, ego, others: &self.others, ..*scene }
    }
}
