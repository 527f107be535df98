//! Finding lane changes: three criteria, of which each sees something else.
//!
//! | criterion    | what it looks at                                             | where                |
//! |--------------|--------------------------------------------------------------|----------------------|
//! | **peak**     | peaks of the smoothed lateral speed                          | every recording      |
//! | **distance** | displacement from the lane's centre                          | every recording      |
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
//! A manoeuvre is a peak of the lateral speed in one direction, with a prominence of at least 0.15 m/s: a lane change of
//! 3.5 m that takes 30 s still peaks at 0.22 m/s. Peaks, their prominence and their width are those of SciPy's
//! `find_peaks` and `peak_widths`, with `rel_height = 1 − (w_vehicle / w_lane) / 2`. Peaks are found in the lateral speed
//! with its sign, and with rest before and after the track. Widths are taken where it is cut off at zero: a vehicle that
//! keeps its lane has no lateral speed, so neither its swerving the other way nor the end of its track belongs to the
//! height of which the width is a share.
//!
//! The width leaves out both slow ends of the manoeuvre. On a quintic path of length L and duration T, with τ = t/T,
//! d = L·(10τ³ − 15τ⁴ + 6τ⁵), the lateral speed is 16·τ²·(1 − τ)² times its peak. It is at the share h = 1 − rel_height
//! of the peak where 4·τ·(1 − τ) = √h, so that
//!
//! ```text
//!   width / T = √(1 − √h),        h = (w_vehicle / w_lane) / 2
//! ```
//!
//! which is 0.71 for a car of 1.85 m in a lane of 3.75 m. Published mean durations of 6.7 to 6.9 s are such widths. Here
//! both are reported: `width_s`, and `duration_s` = width / √(1 − √h), of which `start_s` and `end_s` are the ends,
//! placed evenly about the width.
//!
//! - A track that begins or ends in the middle of a manoeuvre has its peak at that end, as if at rest beyond it.
//! - Where lanes are recorded, a manoeuvre is a lane change if between its start and end the recorded lane changes in its
//!   direction. The crossing is the first frame in the other lane, where each lane is held for at least 0.5 s: flicker
//!   on a marking is none. It belongs to the highest of several such peaks; a vehicle that pauses on the marking has it
//!   up to 1 s before or after one.
//! - Where the lane is in doubt (in-car logs have none, and the robustness study moves vehicles off theirs), a manoeuvre
//!   is a lane change if it shifts the vehicle by at least 2.5 m: nothing that stays in its lane does. The crossing is
//!   then where half of the shift is done.
//!
//! # Distance
//!
//! A vehicle keeps a lane while it lies within it with its whole width, |e| ≤ (w_lane − w_vehicle)/2 of the displacement e
//! from the lane's centre, for at least 0.5 s. A lane change is from one kept lane to another. It starts when the vehicle
//! leaves its old lane's band, ends when it enters the new one, and crosses where its centre passes the marking. Its
//! shift is that from 1.5 s before to 1.5 s after, its duration shorter than by the peak, since it only counts the time
//! on the marking. What displaces the measured position displaces this criterion: beyond (w_lane − w_vehicle)/2, 0.8 to
//! 0.95 m for a car, vehicles in the middle of their lane are in none.
//!
//! # Gradient
//!
//! When a test vehicle crosses the left marking, the marking that was the left one becomes the right one: the distance
//! to the left jumps up by a lane's width, that to the right down. Nothing else makes both jump against each other, no
//! offset changes it, and it is sharp in time. Start and end are those of the peak of lateral speed that it lies in; a
//! jump outside of any peak is one of the camera's, and no lane change.
//!
//! # What is marked
//!
//! - *complete*: start and end were recorded, the shift is at least 2.5 m, and it is no part of a double. Only complete
//!   ones belong in statistics of durations.
//! - *double*: another lane change of the same vehicle in the same direction begins before this one ends, or one peak
//!   carries the vehicle over two markings. Both are listed.

mod crossings;
mod detect;
mod distance;
mod double;
mod geometry;
mod gradient;
mod manoeuvre;
mod peaks;
mod score;

use closecall_traffic::{Side, VehicleClass};
use serde::Serialize;

pub use detect::{Criterion, Detector, Lanes, detect};
pub use manoeuvre::{MIN_PROMINENCE_MPS, MIN_SHIFT_M, quintic_width_share};
pub use peaks::{Peak, Width, find_peaks, peak_width};
pub use score::{ReferenceChange, ReferenceError, Score, Share, Spans, read_references, score};

/// One lane change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LaneChange {
    /// The recording's number of the track.
    pub track_id: u64,
    /// The recording's number of the vehicle.
    pub vehicle_id: u64,
    /// Car, truck or motorcycle.
    pub vehicle_class: VehicleClass,
    /// To the left or to the right.
    pub direction: Side,
    /// The lane before.
    pub from_lane: u8,
    /// The lane after.
    pub to_lane: u8,
    /// When the manoeuvre starts [s]; where it is not complete, this may lie before the track.
    pub start_s: f64,
    /// When half of the lateral shift is done, as far as it was recorded [s].
    pub midpoint_s: f64,
    /// First instant with the centre in the other lane [s].
    pub crossing_s: f64,
    /// When the manoeuvre ends [s]; where it is not complete, this may lie after the track.
    pub end_s: f64,
    /// Duration of the whole manoeuvre [s].
    pub duration_s: f64,
    /// Width of the peak of lateral speed [s]: about 0.7 of the duration. By the distance criterion the duration itself.
    pub width_s: f64,
    /// Speed along the road at the crossing [m/s].
    pub speed_mps: f64,
    /// Largest lateral speed, positive in the direction of the lane change [m/s].
    pub peak_lateral_speed_mps: f64,
    /// Lateral shift from start to end, as far as recorded, positive in the direction of the lane change [m].
    pub lateral_shift_m: f64,
    /// True where it is one of two or more in a row in the same direction.
    pub double: bool,
    /// True where the whole manoeuvre was recorded, shifts the vehicle by at least 2.5 m, and is no part of a double.
    pub complete: bool,
}
