//! Detection of lane changes by three criteria.
//!
//! | criterion    | evaluates                                                     | applies to                 |
//! |--------------|---------------------------------------------------------------|----------------------------|
//! | **peak**     | peaks of the smoothed lateral speed                           | all trajectory data        |
//! | **distance** | displacement from the lane's centre                           | all trajectory data        |
//! | **gradient** | jumps of the measured distances to the left and right marking | in-car logs: the reference |
//!
//! # Peak
//!
//! ```text
//!  lateral    │        ╭──╮                   v_peak
//!  speed      │       ╱    ╲
//!             │      │      │
//!             │─ ─ ─ ├──────┤ ─ ─ ─ ─ ─ ─ ─   v_peak − rel_height · prominence
//!             │    ╱   width  ╲
//!             └──┴─────────────┴───────────▶ t
//!               start    ×    end             ×: crossing of the marking
//!               └── duration ──┘
//! ```
//!
//! A manoeuvre is a peak of the lateral speed in one direction, with a prominence of at least 0.15
//! m/s: a lane change of 3.5 m that takes 30 s still peaks at 0.22 m/s. Peaks, prominences and
//! widths are defined as in SciPy's `find_peaks` and `peak_widths`, with
//! `rel_height = 1 − (w_vehicle / w_lane) / 2`. Peaks are searched in the signed lateral speed,
//! which is 0 before and after the track. Widths are measured in the lateral speed clipped at zero:
//! a vehicle that keeps its lane has no lateral speed, so neither a swerve in the other direction
//! nor the end of the track may contribute to the height at which the width is measured.
//!
//! The width excludes both slow ends of the manoeuvre. A quintic path of length L and duration T
//! has the lateral position d = L·(10τ³ − 15τ⁴ + 6τ⁵), with τ = t/T, and its lateral speed is
//! 16·τ²·(1 − τ)² times its peak. This equals the share h = 1 − rel_height of the peak at 4·τ·(1 −
//! τ) = √h. Hence
//!
//! ```text
//!   width / T = √(1 − √h),        h = (w_vehicle / w_lane) / 2
//! ```
//!
//! which is 0.71 for a car of 1.85 m in a lane of 3.75 m. Published mean durations of 6.7 to 6.9 s
//! are such widths. The result has both: `width_s`, and `duration_s` = width / √(1 − √h). The
//! duration extends symmetrically about the width, from `start_s` to `end_s`.
//!
//! - A track that begins or ends in the middle of a manoeuvre has its peak at that end, because the
//!   lateral speed is 0 beyond it.
//! - If lanes are recorded, a manoeuvre is a lane change if the recorded lane changes in the
//!   manoeuvre's direction between its start and end. The crossing is the first frame in the new
//!   lane. The vehicle must stay in each lane for at least 0.5 s, so that flicker on a marking does
//!   not count. If several peaks contain the crossing, it belongs to the highest one. The crossing
//!   may also lie up to 1 s before or after a peak, because vehicles pause on a marking.
//! - If the lane is unreliable (in-car logs have none, and the robustness study displaces
//!   vehicles), a manoeuvre is a lane change if it shifts the vehicle by at least 2.5 m, which no
//!   vehicle does within its lane. The crossing is then at half of the shift. Peaks in one
//!   direction whose manoeuvres overlap are one sweep: a slow lane change with a pause has two
//!   peaks, and remains one.
//!
//! # Distance
//!
//! A vehicle keeps a lane if its whole width lies within the lane for at least 0.5 s: |e| ≤ (w_lane
//! − w_vehicle)/2, with the displacement e from the lane's centre. A lane change is the transition
//! from one kept lane to another. It starts when the vehicle leaves the band of its old lane and
//! ends when it enters the band of its new lane. The crossing is where its centre passes the
//! marking. The shift is measured from 1.5 s before the start to 1.5 s after the end. The duration
//! is shorter than by the peak criterion, because it covers only the time on the marking. An offset
//! of the measured position affects this criterion directly: with an offset beyond (w_lane −
//! w_vehicle)/2, 0.8 to 0.95 m for a car, a vehicle in the middle of its lane is in none.
//!
//! # Gradient
//!
//! When a test vehicle crosses the left marking, this marking becomes the right marking: the
//! distance to the left marking jumps up by a lane width, and the distance to the right marking
//! jumps down. Nothing else makes both jump in opposite directions, no offset affects the jump, and
//! it is sharp in time. Start and end come from the peak of lateral speed that contains the jump. A
//! jump outside of any peak is a camera error, not a lane change.
//!
//! # Flags
//!
//! - *complete*: start and end were recorded, the shift is at least 2.5 m, and the lane change does
//!   not overlap with another lane change. Only complete lane changes enter statistics of
//!   durations.
//! - *overlapping*: another lane change of the same vehicle in the same direction begins before
//!   this one ends, or one peak carries the vehicle over two markings. Both lane changes are
//!   listed, but neither has a duration of its own.
//! - *double*: overlapping lane changes that lead from one outer lane of the road to the other in
//!   one movement. The markings determine the outer lanes. A road of two lanes has no double lane
//!   changes.

mod basis;
mod change;
mod crossings;
mod detect;
mod distance;
mod double;
mod dwell;
mod find;
mod geometry;
mod gradient;
mod lane_reliability;
mod manoeuvre;
mod peaks;
mod score;

pub use basis::DetectionBasis;
pub use change::LaneChange;
pub use detect::{Criterion, LaneChangeDetector, detect};
pub(crate) use dwell::{MIN_DWELL, is_stay};
pub use find::{FoundLaneChanges, find};
pub use lane_reliability::LaneReliability;
pub use manoeuvre::{MIN_PROMINENCE_MPS, MIN_SHIFT_M, quintic_width_share};
pub use peaks::{Peak, Width, find_peaks, peak_width};
pub use score::{HitRate, ReferenceChange, ReferenceError, Score, TrackSpans, listed_for, read_references, score};
