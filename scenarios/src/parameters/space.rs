//! The checked parameters of a scenario.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;

use closecall_traffic::{ParameterName, Parameters, Value, maths};

use super::copula::Copula;
use super::strata::Strata;
use super::{Distribution, FittedConfig, ObservedConfig};

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

/// The provenance of a distribution.
#[derive(Clone, Debug, PartialEq)]
pub enum Provenance {
    /// Fitted to trajectory data.
    Fitted(FittedConfig),
    /// Assumed, with the reason.
    Assumed(String),
    /// Not stated in the file.
    Unstated,
}

/// One checked parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SpaceEntry {
    /// Distribution of its values.
    pub distribution: Distribution,
    /// Provenance of the distribution.
    pub provenance: Provenance,
    /// What trajectory data show of the quantity.
    pub observed: Option<ObservedConfig>,
    /// A remark for the reader.
    pub note: Option<String>,
}

impl SpaceEntry {
    /// Returns the range that trajectory data show, and the probability of a value beyond it;
    /// `None` if no data are stated, or no value lies beyond.
    pub fn beyond_observed(&self) -> Option<(&ObservedConfig, f64)> {
        let observed = self.observed.as_ref()?;
        let beyond = 1.0 - (self.distribution.cdf(observed.max)? - self.distribution.cdf(observed.min)?);
        // An empirical distribution begins at the smallest observed value.
        let [low, high] = self.distribution.bounds()?;
        (low < observed.min || high > observed.max).then_some((observed, beyond))
    }
}

/// The parameters of a scenario with their distributions, in the order of their names.
///
/// The parameters are sampled by the designs of [`crate::sampling`], independently of each other
/// unless they state rank correlations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterSpace {
    entries: BTreeMap<ParameterName, SpaceEntry>,
    copula: Copula,
    strata: Strata,
}

/// How much sampled values vary, in rising order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Variation {
    /// The values are always the same.
    None,
    /// The parameters take finitely many values, and independent samples repeat each other.
    Discrete,
    /// The values come from a continuum.
    Continuous,
}

/// Probability of the median.
const HALF: f64 = 0.5;

/// Largest distance of a coupled number u from [`HALF`] that is taken for a rounding error (-):
/// more than a thousand spacings of such numbers, and no sampled number is so near.
const ROUNDING: f64 = 1e-12;

/// Returns the standard normal probability below `z`, within the domain of a quantile function:
/// above 0 and below 1.
fn probability_below(z: f64) -> f64 {
    (0.5 * maths::erfc(-z * FRAC_1_SQRT_2)).clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0)
}

impl ParameterSpace {
    pub(super) fn new(entries: BTreeMap<ParameterName, SpaceEntry>, copula: Copula) -> Self {
        Self { entries, copula, strata: Strata::default() }
    }

    /// Returns the values at the numbers u of all parameters, in the order of the names. Correlated
    /// parameters are coupled first.
    pub(crate) fn values(&self, mut numbers: Vec<f64>) -> Parameters {
        self.copula.couple(&mut numbers);
        self.map(|_, index, distribution| distribution.quantile(numbers[index]))
    }

    /// Returns the same parameters with the bins that the design `coverage` visits.
    pub(crate) fn with_strata(self, strata: Strata) -> Self {
        Self { strata, ..self }
    }

    /// Returns the bins that the design `coverage` visits.
    pub(crate) const fn strata(&self) -> &Strata {
        &self.strata
    }

    /// Returns true if there are bins that the design `coverage` can visit.
    pub const fn has_strata(&self) -> bool {
        !self.strata.is_empty()
    }

    /// Returns true if the parameter states a rank correlation with another one.
    pub(crate) fn is_correlated(&self, index: usize) -> bool {
        self.copula.couples(index)
    }

    /// Iterates over all parameters in the order of their names.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&ParameterName, &SpaceEntry)> {
        self.entries.iter()
    }

    /// Returns the parameter `name`, or `None` if there is none.
    pub fn get(&self, name: &ParameterName) -> Option<&SpaceEntry> {
        self.entries.get(name)
    }

    /// Returns how much the parameters vary.
    pub fn variation(&self) -> Variation {
        let variations = self.entries.values().map(|entry| entry.distribution.variation());
        variations.max().unwrap_or(Variation::None)
    }

    /// Returns the nominal value of every parameter: the median, or the most probable label.
    pub fn nominal(&self) -> Parameters {
        self.map(|_, _, distribution| distribution.nominal())
    }

    /// Iterates over the parameters whose values differ between samples, in the order of their
    /// names.
    pub fn varying(&self) -> impl Iterator<Item = (&ParameterName, &SpaceEntry)> {
        self.iter().filter(|(_, entry)| entry.distribution.variation() != Variation::None)
    }

    /// Returns the values at a point of the unit cube, which has a coordinate in [0, 1) for each
    /// parameter of [`Self::varying`]: its quantile there. Rank correlations do not count here: a
    /// study of sensitivity varies one parameter after the other. The other parameters have their
    /// only value. A coordinate that is missing is taken as the median.
    pub fn at(&self, point: &[f64]) -> Parameters {
        let mut coordinates = point.iter();
        self.map(|_, _, distribution| match distribution.variation() {
            Variation::None => distribution.nominal(),
            _ => coordinates.next().map_or_else(|| distribution.nominal(), |u| distribution.quantile(*u)),
        })
    }

    /// Returns the values at a point of standard normal space, which has a number for each
    /// parameter of [`Self::varying`]. Correlated parameters are coupled, so that independent
    /// standard normal numbers give the distribution from which independent samples are drawn.
    pub fn at_normals(&self, normals: &[f64]) -> Parameters {
        let mut coordinates = normals.iter();
        let number = |entry: &SpaceEntry| match entry.distribution.variation() {
            Variation::None => HALF,
            _ => coordinates.next().map_or(HALF, |z| probability_below(*z)),
        };
        self.values(self.entries.values().map(number).collect())
    }

    /// Returns the distance of these values to the nominal ones in standard normal space (standard
    /// deviations). Of correlated parameters, a value that the others make likely adds little.
    /// Returns `None` if a parameter has no value, or one that its distribution never takes, and at
    /// a bound of a distribution, which is infinitely far.
    pub fn distance_sd(&self, values: &Parameters) -> Option<f64> {
        let number = |(name, entry): (&ParameterName, &SpaceEntry)| entry.distribution.distance_sd(values.get(name)?);
        let mut normals = self.entries.iter().map(number).collect::<Option<Vec<f64>>>()?;
        self.copula.uncouple(&mut normals);
        Some(normals.iter().map(|z| z * z).sum::<f64>().sqrt())
    }

    /// Returns the point of standard normal space that has these values, with the labels beside it.
    /// Works like [`Self::distance_sd`] where there is none.
    pub fn normal_point(&self, values: &Parameters) -> Option<NormalPoint> {
        let number = |(name, entry): (&ParameterName, &SpaceEntry)| entry.distribution.distance_sd(values.get(name)?);
        let mut normals = self.entries.iter().map(number).collect::<Option<Vec<f64>>>()?;
        self.copula.uncouple(&mut normals);
        let of_numbers = self.entries.values().zip(normals);
        let of_numbers = of_numbers.filter(|(entry, _)| entry.distribution.variation() == Variation::Continuous);
        let labels = self.varying().filter_map(|(name, _)| match values.get(name)? {
            Value::Label(label) => Some((name.clone(), label.clone())),
            Value::Number(_) => None,
        });
        Some(NormalPoint { normals: of_numbers.map(|(_, z)| z).collect(), labels: labels.collect() })
    }

    /// Returns the values at a point of standard normal space: what [`Self::normal_point`] does,
    /// backwards. A number or a label that the point lacks is nominal.
    pub fn at_normal_point(&self, point: &NormalPoint) -> Parameters {
        let mut coordinates = point.normals.iter();
        let number = |entry: &SpaceEntry| match entry.distribution.variation() {
            Variation::Continuous => coordinates.next().map_or(HALF, |z| probability_below(*z)),
            Variation::None | Variation::Discrete => HALF,
        };
        let mut numbers: Vec<f64> = self.entries.values().map(number).collect();
        self.copula.couple(&mut numbers);
        self.map(|name, index, distribution| match distribution.variation() {
            Variation::Continuous if (numbers[index] - HALF).abs() > ROUNDING => distribution.quantile(numbers[index]),
            Variation::Discrete => {
                let label = point.labels.get(name).cloned();
                label.map_or_else(|| distribution.nominal(), Value::Label)
            }
            Variation::None | Variation::Continuous => distribution.nominal(),
        })
    }

    /// Returns the distance of a point to the nominal values (standard deviations): its length,
    /// with the distances of its labels.
    pub fn length_sd(&self, point: &NormalPoint) -> f64 {
        let of_label = |(name, label): (&ParameterName, &String)| {
            self.get(name)?.distribution.distance_sd(&Value::Label(label.clone()))
        };
        let of_labels = point.labels.iter().filter_map(of_label);
        point.normals.iter().copied().chain(of_labels).map(|z| z * z).sum::<f64>().sqrt()
    }

    /// Returns the nominal values, then variations of them with one parameter at one of its bounds
    /// or labels.
    ///
    /// If a scenario is valid for all of these, it passes every check that depends on a single
    /// parameter.
    pub fn extremes(&self) -> impl Iterator<Item = Parameters> {
        let nominal = self.nominal();
        let varied = {
            let nominal = nominal.clone();
            self.entries.iter().flat_map(move |(name, entry)| {
                let bounds = entry.distribution.bounds().into_iter().flatten().map(Value::Number);
                let labels = entry.distribution.labels().iter().cloned().map(Value::Label);
                let nominal = nominal.clone();
                let other = |value: &Value| nominal.get(name) != Some(value);
                let values: Vec<Value> = bounds.chain(labels).filter(other).collect();
                values.into_iter().map(move |value| {
                    let mut parameters = nominal.clone();
                    parameters.insert(name.clone(), value);
                    parameters
                })
            })
        };
        std::iter::once(nominal).chain(varied)
    }

    /// Maps every parameter to a value. `value` receives its name, its index in the order of the
    /// names, and its distribution.
    pub(crate) fn map(&self, mut value: impl FnMut(&ParameterName, usize, &Distribution) -> Value) -> Parameters {
        let entries = self.entries.iter().enumerate();
        entries.map(|(index, (name, entry))| (name.clone(), value(name, index, &entry.distribution))).collect()
    }
}

/// Collects parameters that are independent of each other.
impl FromIterator<(ParameterName, SpaceEntry)> for ParameterSpace {
    fn from_iter<I: IntoIterator<Item = (ParameterName, SpaceEntry)>>(entries: I) -> Self {
        Self { entries: entries.into_iter().collect(), ..Self::default() }
    }
}
