//! Finding lane changes in recordings: the peak criterion.
//!
//! ```text
//!  lateral    │        ╭──╮                   v_peak
//!  speed      │       ╱    ╲
//!             │      │      │
//!             │─ ─ ─ ├──────┤ ─ ─ ─ ─ ─ ─ ─   v_peak · (1 − rel_height)
//!             │    ╱   width  ╲
//!             └──┴─────────────┴───────────▶ t
//!               start    ×    end             ×: crossing of the marking
//!               └── duration ──┘
//! ```
//!
//! A lane change is a peak of the smoothed lateral speed that carries the vehicle's centre over a lane marking. Peaks,
//! their prominence and their width are those of SciPy's `find_peaks` and `peak_widths`; the tests compare with it. The
//! width is measured at the relative height `rel_height = 1 − (w_vehicle / w_lane) / 2` below the peak. Heights are
//! counted from rest, because a vehicle that keeps its lane has no lateral speed: the recorded noise beside a peak then
//! does not make it narrower.
//!
//! # Width and duration
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
//! # What counts
//!
//! - The crossing is the first instant in another lane, where the recorded lane stays for at least 0.5 s before and
//!   after: flicker on a marking is none. It belongs to the highest peak in its direction between whose start and end it
//!   lies. A peak that carries a vehicle over two markings gives two lane changes.
//! - A peak needs a prominence of 0.15 m/s. A lane change of 3.5 m that takes 30 s still peaks at 0.22 m/s.
//! - A track that begins or ends in the middle of a manoeuvre has its peak at that end, as if at rest beyond it.
//! - A lane change is *complete* where its start and end were both recorded, it shifts the vehicle by at least 2.5 m, and
//!   its peak crosses one marking only. Only complete ones belong in statistics of durations.

mod detect;
mod peaks;

use closecall_traffic::{Side, VehicleClass};
use serde::Serialize;

pub use detect::{MIN_PROMINENCE_MPS, MIN_SHIFT_M, detect, quintic_width_share};
pub use peaks::{Peak, find_peaks, width};

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
    /// First instant with the centre in the other lane [s].
    pub crossing_s: f64,
    /// When the manoeuvre ends [s]; where it is not complete, this may lie after the track.
    pub end_s: f64,
    /// Duration of the whole manoeuvre [s].
    pub duration_s: f64,
    /// Width of the peak of lateral speed [s]: about 0.7 of the duration.
    pub width_s: f64,
    /// Speed along the road at the crossing [m/s].
    pub speed_mps: f64,
    /// Largest lateral speed, positive in the direction of the lane change [m/s].
    pub peak_lateral_speed_mps: f64,
    /// Lateral shift from start to end, as far as recorded, positive in the direction of the lane change [m].
    pub lateral_shift_m: f64,
    /// True where the whole manoeuvre was recorded and shifts the vehicle by at least 2.5 m, over one marking.
    pub complete: bool,
}
