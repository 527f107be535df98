//! Points that may belong to vehicles.

/// A point that may belong to a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// Index of the point in the scan.
    pub(crate) index: u32,
    /// Distance behind the sensor along the ego's axis (m).
    pub(crate) back_m: f32,
    /// Lateral offset from the ego's path, positive to the left (m).
    pub(crate) left_m: f32,
}
