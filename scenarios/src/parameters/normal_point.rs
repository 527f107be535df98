//! Points of standard normal space with labels.

use std::collections::BTreeMap;

use closecall_traffic::ParameterName;

/// A point of the space in which the numbers of a scenario are independent and standard normal.
///
/// Labels have no place in that space: any two of them are apart, and nothing lies between. They
/// stand beside the numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NormalPoint {
    /// A standard normal number for each parameter that is a number and varies, in the order of the
    /// names (standard deviations).
    pub normals: Vec<f64>,
    /// The label of each parameter that is a choice and varies.
    pub labels: BTreeMap<ParameterName, String>,
}
