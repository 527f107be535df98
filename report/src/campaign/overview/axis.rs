//! The values of one parameter, laid out along an axis.

use closecall_scenarios::parameters::Distribution;
use closecall_traffic::Value;

/// Probability that is left out at each end of a distribution without bounds.
const TAIL: f64 = 1e-3;

/// One parameter that varies.
#[derive(Clone, Debug, PartialEq)]
pub enum Axis {
    /// Numbers from `low` to `high`.
    Numbers {
        /// The parameter's name.
        name: String,
        /// The smallest.
        low: f64,
        /// The largest.
        high: f64,
    },
    /// Labels.
    Labels {
        /// The parameter's name.
        name: String,
        /// The labels, in their order.
        labels: Vec<String>,
    },
}

impl Axis {
    /// The axis of a parameter; nothing where it does not vary.
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

    /// The parameter's name.
    pub fn name(&self) -> &str {
        match self {
            Self::Numbers { name, .. } | Self::Labels { name, .. } => name,
        }
    }

    /// Which of `cells` equal parts a value lies in; values beyond the ends count with the ends. Labels have a part
    /// each, and share the last where there are more of them than parts.
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
                labels.iter().position(|known| known == label).map(|place| place.min(last))
            }
            _ => None,
        }
    }

    /// How many of `cells` parts can be told apart.
    pub fn cells(&self, cells: usize) -> usize {
        match self {
            Self::Numbers { .. } => cells,
            Self::Labels { labels, .. } => labels.len().min(cells),
        }
    }

    /// Where a value lies along the axis: a number itself, a label at its place.
    pub fn position(&self, value: &Value) -> Option<f64> {
        match (self, value) {
            (Self::Numbers { .. }, Value::Number(number)) => Some(*number),
            (Self::Labels { labels, .. }, Value::Label(label)) => {
                labels.iter().position(|known| known == label).map(|place| place as f64)
            }
            _ => None,
        }
    }

    /// The ends of the axis; labels stand at whole numbers, half a step inside.
    pub fn ends(&self) -> [f64; 2] {
        match self {
            Self::Numbers { low, high, .. } => [*low, *high],
            Self::Labels { labels, .. } => [-0.5, labels.len() as f64 - 0.5],
        }
    }
}
