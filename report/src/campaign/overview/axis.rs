//! The axis of one parameter: its range or its labels, divided into cells of equal width.

use closecall_scenarios::parameters::Distribution;
use closecall_traffic::Value;

/// Probability beyond each end of the axis, if the distribution has no bounds.
const TAIL: f64 = 1e-3;

/// The axis of a parameter that varies.
#[derive(Clone, Debug, PartialEq)]
pub enum Axis {
    /// Numbers from `low` to `high`.
    Numbers {
        /// The parameter's name.
        name: String,
        /// The smallest value.
        low: f64,
        /// The largest value.
        high: f64,
    },
    /// Labels.
    Labels {
        /// The parameter's name.
        name: String,
        /// The labels, in the order of the scenario file.
        labels: Vec<String>,
    },
}

impl Axis {
    /// Returns the axis of a parameter, or `None` if the parameter does not vary.
    pub(super) fn of(name: &str, distribution: &Distribution) -> Option<Self> {
        let name = name.to_owned();
        if !distribution.labels().is_empty() {
            let labels = distribution.labels().to_vec();
            return (labels.len() > 1).then_some(Self::Labels { name, labels });
        }
        let number = |u: f64| match distribution.quantile(u) {
            Value::Number(number) => Some(number),
            Value::Label(_) => None,
        };
        let [low, high] = match distribution.bounds() {
            Some(bounds) => bounds,
            None => [number(TAIL)?, number(1.0 - TAIL)?],
        };
        (low < high).then_some(Self::Numbers { name, low, high })
    }

    /// Returns the parameter's name.
    pub fn name(&self) -> &str {
        match self {
            Self::Numbers { name, .. } | Self::Labels { name, .. } => name,
        }
    }

    /// Returns the index of the cell that a value lies in, if the axis is divided into `cells`
    /// cells. Values beyond the ends of the axis belong to the outermost cells. Each label has a
    /// cell; labels beyond the number of cells share the last cell. Returns `None` if the value is
    /// not on the axis.
    pub fn cell(&self, value: &Value, cells: usize) -> Option<usize> {
        let last = cells.checked_sub(1)?;
        match (self, value) {
            (Self::Numbers { low, high, .. }, Value::Number(number)) => {
                let share = (number - low) / (high - low);
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
                let cell = (share * cells as f64) as usize;
                share.is_finite().then(|| cell.min(last))
            }
            (Self::Labels { labels, .. }, Value::Label(label)) => {
                labels.iter().position(|candidate| candidate == label).map(|index| index.min(last))
            }
            _ => None,
        }
    }

    /// Returns the number of cells in use, at most `cells`: labels need no more cells than there
    /// are labels.
    pub fn cells(&self, cells: usize) -> usize {
        match self {
            Self::Numbers { .. } => cells,
            Self::Labels { labels, .. } => labels.len().min(cells),
        }
    }

    /// Returns the position of a value along the axis: the number itself, or the index of the
    /// label.
    pub fn position(&self, value: &Value) -> Option<f64> {
        match (self, value) {
            (Self::Numbers { .. }, Value::Number(number)) => Some(*number),
            (Self::Labels { labels, .. }, Value::Label(label)) => {
                labels.iter().position(|candidate| candidate == label).map(|index| index as f64)
            }
            _ => None,
        }
    }

    /// Returns the positions of both ends. Labels lie at whole numbers, and the outermost labels
    /// lie half a step from the ends.
    pub fn ends(&self) -> [f64; 2] {
        match self {
            Self::Numbers { low, high, .. } => [*low, *high],
            Self::Labels { labels, .. } => [-0.5, labels.len() as f64 - 0.5],
        }
    }
}
