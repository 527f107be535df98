//! The result of an evaluation: a lane change with its seven metrics.

use closecall_traffic::Absent;
use serde::Serialize;

use crate::lane_change::LaneChange;

/// The result of one metric for one lane change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum MetricResult {
    /// The most critical value.
    Value {
        /// The value, in the metric's unit.
        value: f64,
        /// Track id of the other vehicle; `None` for a metric of a single vehicle.
        opponent: Option<u64>,
        /// Time at which the value occurs (s).
        time_s: f64,
        /// True if the value is beyond the threshold.
        critical: bool,
    },
    /// The metric has no value.
    Absent {
        /// The reason.
        absent: Absent,
    },
}

impl MetricResult {
    /// Returns true if there is a value and it is beyond the threshold.
    pub fn is_critical(&self) -> bool {
        matches!(self, Self::Value { critical: true, .. })
    }

    /// Returns true if the recorded value is beyond what a vehicle can do.
    pub fn is_implausible(&self) -> bool {
        matches!(self, Self::Absent { absent: Absent::Implausible })
    }

    /// Returns the value, or `None` if it is absent.
    pub fn value(&self) -> Option<f64> {
        match self {
            Self::Value { value, .. } => Some(*value),
            Self::Absent { .. } => None,
        }
    }
}

/// The seven metrics of one lane change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Smallest distance from box to box (m).
    pub distance_m: MetricResult,
    /// Largest speed (m/s).
    pub speed_mps: MetricResult,
    /// Largest magnitude of the acceleration along the road (m/s²).
    pub a_lon_mps2: MetricResult,
    /// Largest magnitude of the acceleration across the road (m/s²).
    pub a_lat_mps2: MetricResult,
    /// Smallest time headway (s).
    pub thw_s: MetricResult,
    /// Smallest distance at closest encounter (m).
    pub dce_m: MetricResult,
    /// Smallest time to closest encounter (s).
    pub ttce_s: MetricResult,
}

impl Metrics {
    /// Returns all seven metrics with their names, in a fixed order.
    pub fn named(&self) -> [(&'static str, MetricResult); 7] {
        [
            ("distance_m", self.distance_m),
            ("speed_mps", self.speed_mps),
            ("a_lon_mps2", self.a_lon_mps2),
            ("a_lat_mps2", self.a_lat_mps2),
            ("thw_s", self.thw_s),
            ("dce_m", self.dce_m),
            ("ttce_s", self.ttce_s),
        ]
    }
}

/// Two further metrics towards the vehicles ahead, for comparison with other publications. They are
/// never critical: the published method has no threshold for them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FollowingMetrics {
    /// Smallest time to collision (TTC) at constant speeds (s).
    pub ttc_s: MetricResult,
    /// Largest deceleration rate to avoid a crash (DRAC): the constant deceleration that suffices
    /// if the vehicle ahead keeps its speed (m/s²).
    pub drac_mps2: MetricResult,
}

impl FollowingMetrics {
    /// Returns both metrics with their names, in a fixed order.
    pub const fn named(&self) -> [(&'static str, MetricResult); 2] {
        [("ttc_s", self.ttc_s), ("drac_mps2", self.drac_mps2)]
    }
}

/// The closest encounters of vehicles that stay in their lanes, or complete their lane changes
/// ([`curvilinear_encounter`](closecall_traffic::metrics::curvilinear_encounter)). `critical`
/// states how the thresholds of DCE and TTCE would judge them. The counts of critical metrics leave
/// them out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvilinearMetrics {
    /// Smallest distance at closest encounter along the lanes (m).
    pub dce_curvilinear_m: MetricResult,
    /// Smallest time to closest encounter along the lanes (s).
    pub ttce_curvilinear_s: MetricResult,
}

impl CurvilinearMetrics {
    /// Returns both metrics with their names, in a fixed order.
    pub const fn named(&self) -> [(&'static str, MetricResult); 2] {
        [("dce_curvilinear_m", self.dce_curvilinear_m), ("ttce_curvilinear_s", self.ttce_curvilinear_s)]
    }
}

/// The values of all metrics over one window of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// The seven metrics.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// The two further metrics.
    #[serde(flatten)]
    pub following: FollowingMetrics,
    /// The encounters along the lanes, if they were asked for.
    #[serde(flatten)]
    pub curvilinear: Option<CurvilinearMetrics>,
}

impl Evaluation {
    /// Returns all nine metrics with their names, in a fixed order, and after them the two of the
    /// encounters along the lanes, if they were asked for.
    pub fn named(self) -> impl Iterator<Item = (&'static str, MetricResult)> {
        let curvilinear = self.curvilinear.map(|metrics| metrics.named());
        self.metrics.named().into_iter().chain(self.following.named()).chain(curvilinear.into_iter().flatten())
    }
}

/// A lane change with its criticality metrics.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriticalLaneChange {
    /// The lane change.
    #[serde(flatten)]
    pub lane_change: LaneChange,
    /// The metrics over the whole lane change.
    pub metrics: Metrics,
    /// Two further metrics over the whole lane change.
    pub following: FollowingMetrics,
    /// The encounters along the lanes over the whole lane change, if they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curvilinear: Option<CurvilinearMetrics>,
    /// All metrics at the instant nearest to the crossing alone.
    pub at_crossing: Evaluation,
}

impl CriticalLaneChange {
    /// Returns the nine metrics over the whole lane change, each with its name and its value at the
    /// crossing, and after them the two of the encounters along the lanes, if they were asked for.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, MetricResult, MetricResult)> {
        let Self { metrics, following, curvilinear, .. } = *self;
        let whole = Evaluation { metrics, following, curvilinear };
        whole.named().zip(self.at_crossing.named()).map(|((name, whole), (_, crossing))| (name, whole, crossing))
    }
}
