//! The values at which a metric is critical.

/// Distance between two vehicles below which it is critical (m).
pub const CRITICAL_DISTANCE_M: f64 = 1.0;
/// Multiple of the speed limit above which the speed is critical (-).
pub const CRITICAL_SPEED_FACTOR: f64 = 1.3;
/// Magnitude above which the acceleration along the road is critical (m/s²).
pub const CRITICAL_A_LON_MPS2: f64 = 8.0;
/// Magnitude above which the acceleration across the road is critical (m/s²).
pub const CRITICAL_A_LAT_MPS2: f64 = 8.0;
/// Distance at closest encounter below which it is critical (m).
pub const CRITICAL_DCE_M: f64 = 1.0;
/// Time to closest encounter below which it is critical (s).
pub const CRITICAL_TTCE_S: f64 = 2.6;
/// Speed limit that is assumed if none is known (m/s): 120 km/h.
pub const DEFAULT_SPEED_LIMIT_MPS: f64 = 120.0 / 3.6;
/// Prediction horizon of encounters (s): an encounter further ahead is ignored.
pub const ENCOUNTER_HORIZON_S: f64 = 10.0;
