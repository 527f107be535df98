//! A lane change.

use closecall_traffic::{Side, VehicleClass};
use serde::Serialize;

/// A detected lane change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LaneChange {
    /// Track id in the trajectory data.
    pub track_id: u64,
    /// Vehicle id in the trajectory data.
    pub vehicle_id: u64,
    /// Vehicle class: car, truck or motorcycle.
    pub vehicle_class: VehicleClass,
    /// Direction: to the left or to the right.
    pub direction: Side,
    /// Number of the old lane.
    pub from_lane: u8,
    /// Number of the new lane.
    pub to_lane: u8,
    /// Start of the manoeuvre (s). It may lie before the track if the lane change is not complete.
    pub start_s: f64,
    /// Time at which half of the recorded lateral shift is done (s).
    pub midpoint_s: f64,
    /// First instant with the centre in the new lane (s).
    pub crossing_s: f64,
    /// End of the manoeuvre (s). It may lie after the track if the lane change is not complete.
    pub end_s: f64,
    /// Duration of the whole manoeuvre (s).
    pub duration_s: f64,
    /// Width of the peak of lateral speed (s), about 0.7 of the duration; by the distance criterion
    /// the duration itself.
    pub width_s: f64,
    /// Speed along the road at the crossing (m/s).
    pub speed_mps: f64,
    /// Speed along the road at the peak of lateral speed (m/s).
    pub peak_speed_mps: f64,
    /// Largest lateral speed, positive in the direction of the lane change (m/s).
    pub peak_lateral_speed_mps: f64,
    /// Recorded lateral shift from start to end, positive in the direction of the lane change (m).
    pub lateral_shift_m: f64,
    /// True if another lane change of the vehicle in the same direction overlaps with it in time.
    pub overlapping: bool,
    /// True if the lane change is part of a double one: from one outer lane of the road to the
    /// other in one movement.
    pub double: bool,
    /// True if the whole manoeuvre was recorded, shifts the vehicle by at least 2.5 m, and overlaps
    /// with no other lane change.
    pub complete: bool,
}
