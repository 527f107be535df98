//! Criticality of a lane change: metrics, each with the opponent and the time of its most critical
//! value.
//!
//! | metric       | meaning                                                 | critical            |
//! |--------------|---------------------------------------------------------|---------------------|
//! | `distance_m` | Euclidean distance from box to box                      | < 1.0 m             |
//! | `speed_mps`  | speed of the vehicle that changes lanes                 | > 1.3 · speed limit |
//! | `a_lon_mps2` | magnitude of its acceleration along the road            | > 8 m/s²            |
//! | `a_lat_mps2` | magnitude of its acceleration across the road           | > 8 m/s²            |
//! | `thw_s`      | its time headway (THW)                                  | < 0.9 s             |
//! | `dce_m`      | distance at closest encounter (DCE), if TTCE < 2.6 s    | < 1.0 m             |
//! | `ttce_s`     | time to closest encounter (TTCE)                        | only if asked for: < 2.6 s |
//!
//! In addition, two metrics without a threshold: the time to collision `ttc_s` (TTC) and the
//! deceleration rate to avoid a crash `drac_mps2` (DRAC), both towards the vehicles ahead that
//! count for THW, at constant speeds of both vehicles. All metrics are also evaluated at one
//! instant alone: the instant of the common clock nearest to the crossing, the later one of two
//! equally near.
//!
//! # Definitions
//!
//! - **Window**: all recorded instants of the common clock from the start to the end of the lane
//!   change, and the crossing if it lies outside. The result is the most critical of all values in
//!   the window, against all opponents.
//! - **Opponents**: for distance, TTCE and DCE, all other vehicles present at that instant. For
//!   THW, the vehicle ahead in the lane of the own centre and the vehicle ahead in the target lane,
//!   because the lane change has begun within the window; the smaller headway of the two counts. A
//!   vehicle is ahead if its centre is ahead of the own centre and either its rear is ahead of the
//!   own front, or the two boxes overlap across the road. Recorded traffic does contain such
//!   overlaps; the headway is then 0. A vehicle alongside in the target lane has no headway:
//!   distance, TTCE and DCE cover it.
//! - **TTCE and DCE** apply to two oriented boxes at constant velocity, in continuous time. They
//!   are absent if the vehicles do not approach each other or if the encounter is more than 10 s
//!   ahead. DCE is evaluated only if TTCE < 2.6 s. A short TTCE is not critical by itself, unless
//!   [`Judgement::ttce_alone`] asks for it: vehicles that pass each other at a safe distance have
//!   one, too.
//! - **Encounters along the lanes**, only if [`Judgement::curvilinear`] asks for them: a constant
//!   velocity carries a vehicle that changes lanes beyond its new lane. With this model, both
//!   vehicles keep their speeds along the road. A vehicle whose lane change is running keeps its
//!   lateral speed until it is at the lateral position at which its lane change ends in the
//!   recording, and stays there. All others keep their lateral positions. Boxes that do not move
//!   across the road point along it. Results, horizon and condition are as for TTCE and DCE. The
//!   end of the lane change is known only in hindsight, as its window and its new lane are. The
//!   published thresholds come without a motion model. They judge the encounters at constant
//!   velocity, which need no further assumption, so shares and figures refer to these.
//! - **Shares** refer to the complete lane changes, unless [`Counted::All`] asks for all.
//! - **Magnitudes**: published acceleration thresholds are signed, −8 m/s² for braking; here the
//!   magnitude counts.
//! - **Speed limit**: 120 km/h if it is not known.
//! - **Geometry**: the road frame is treated as a plane. Over the 50 m that matter, the bend of a
//!   motorway of 1 km radius turns two headings apart by 3°.
//! - Velocities and accelerations come from the smoothed trajectories ([`crate::filters`]).
//!
//! A metric without a value is absent, with a reason, and never counts as critical. The shares
//! state how many are absent.

mod evaluate;
mod record;
mod running;
mod severity;
mod shares;
mod statistics;
mod thresholds;

pub use evaluate::{Judgement, criticality};
pub use record::{CriticalLaneChange, CurvilinearMetrics, Evaluation, FollowingMetrics, MetricResult, Metrics};
pub use severity::by_severity;
pub use shares::{Counted, CriticalShare, CriticalShares, shares};
pub use statistics::spearman;
pub use statistics::{BoxPlot, ClassStatistics, Correlation, Statistics, statistics};
pub use thresholds::{
    CRITICAL_A_LAT_MPS2, CRITICAL_A_LON_MPS2, CRITICAL_DCE_M, CRITICAL_DISTANCE_M, CRITICAL_SPEED_FACTOR,
    CRITICAL_TTCE_S, DEFAULT_SPEED_LIMIT_MPS, ENCOUNTER_HORIZON_S,
};
