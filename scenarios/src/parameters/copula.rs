//! Dependence between parameters: a Gaussian copula with given rank correlations.
//!
//! Each number u of a coupled parameter becomes a standard normal variate, the variates are mixed
//! by the Cholesky factor of their correlation matrix, and the result becomes a number u again.
//! Each number stays uniform, so that each parameter keeps its own distribution. Spearman's ρ of
//! two parameters belongs to the correlation r = 2·sin(π·ρ/6) of their variates (K. Pearson, 1907).
//! Of the coupled parameters, the first in the order of the names keeps its number.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use closecall_traffic::statistics::cholesky;
use closecall_traffic::statistics::normal::TruncatedStandardNormal;
use closecall_traffic::{ConfigError, ParameterName, Problem, Range, maths};

use super::space::{SpaceEntry, Variation};

/// Range of a rank correlation: at ±1 one parameter would follow from the other.
const RANK_CORRELATION: Range = Range::closed(-0.99, 0.99);
/// Key of the rank correlations of a parameter.
pub(super) const KEY: &str = "spearman";

/// The dependence between the parameters of a scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Copula {
    /// Indices of the coupled parameters in the order of the names, with the rows of the lower
    /// Cholesky factor.
    rows: Vec<(usize, Vec<f64>)>,
}

impl Copula {
    /// Creates the copula of parameters with the rank correlations that each states.
    ///
    /// # Errors
    /// [`ConfigError`] for a correlation that is out of range, with a parameter that does not exist
    /// or does not vary continuously, that is stated twice differently, or for which no joint
    /// distribution exists.
    pub(super) fn new(
        entries: &BTreeMap<ParameterName, SpaceEntry>,
        stated: &BTreeMap<ParameterName, BTreeMap<ParameterName, f64>>,
    ) -> Result<Self, ConfigError> {
        let mut pairs: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for (name, partners) in stated {
            for (partner, spearman) in partners {
                let at = |error: ConfigError| error.within(KEY).within(name.as_str());
                let pair = [name, partner].map(|parameter| entries.keys().position(|previous| previous == parameter));
                check(entries, name, partner, *spearman).map_err(at)?;
                let [Some(a), Some(b)] = pair else { continue };
                let previous = pairs.insert((a.min(b), a.max(b)), *spearman);
                if previous.is_some_and(|previous| previous != *spearman) {
                    let rule = format!("`{name}` and `{partner}` state different rank correlations of the two");
                    return Err(at(contradiction(partner.as_str(), rule)));
                }
            }
        }
        let is_member = |index: &usize| pairs.keys().any(|(a, b)| a == index || b == index);
        let members: Vec<usize> = (0..entries.len()).filter(is_member).collect();
        let correlation = |a: usize, b: usize| match pairs.get(&(a.min(b), a.max(b))) {
            _ if a == b => 1.0,
            Some(spearman) => 2.0 * maths::sin(PI * spearman / 6.0),
            None => 0.0,
        };
        let matrix: Vec<Vec<f64>> =
            members.iter().map(|a| members.iter().map(|b| correlation(*a, *b)).collect()).collect();
        let rows = cholesky(&matrix).ok_or_else(|| {
            let name = stated.keys().next().map_or("", ParameterName::as_str);
            contradiction(KEY, "no joint distribution has the rank correlations of all parameters".to_owned())
                .within(name)
        })?;
        Ok(Self { rows: members.into_iter().zip(rows).collect() })
    }

    /// Returns true if the parameter with this index is coupled with others.
    pub(super) fn couples(&self, index: usize) -> bool {
        self.rows.iter().any(|(member, _)| *member == index)
    }

    /// Couples the numbers u of all parameters, which are in the order of the names.
    pub(super) fn couple(&self, numbers: &mut [f64]) {
        let Some(normal) = TruncatedStandardNormal::new(f64::NEG_INFINITY, f64::INFINITY) else { return };
        // The quantile is finite only strictly between 0 and 1.
        let variate = |u: f64| normal.quantile(u.max(f64::MIN_POSITIVE));
        let variates: Vec<f64> = self.rows.iter().map(|(index, _)| variate(numbers[*index])).collect();
        for (place, (index, row)) in self.rows.iter().enumerate().skip(1) {
            let mixed: f64 = row[..=place].iter().zip(&variates).map(|(weight, z)| weight * z).sum();
            // A quantile function takes numbers below 1.
            numbers[*index] = normal.cdf(mixed).min(1.0 - f64::EPSILON / 2.0);
        }
    }

    /// Makes coupled standard normal numbers of all parameters, which are in the order of the
    /// names, independent of each other: what [`Self::couple`] does, backwards.
    pub(super) fn uncouple(&self, normals: &mut [f64]) {
        let mut independent: Vec<f64> = Vec::with_capacity(self.rows.len());
        for (place, (index, row)) in self.rows.iter().enumerate() {
            let explained: f64 = row[..place].iter().zip(&independent).map(|(weight, z)| weight * z).sum();
            independent.push((normals[*index] - explained) / row[place]);
            normals[*index] = independent[place];
        }
    }
}

fn check(
    entries: &BTreeMap<ParameterName, SpaceEntry>,
    name: &ParameterName,
    partner: &ParameterName,
    spearman: f64,
) -> Result<(), ConfigError> {
    if name == partner {
        return Err(contradiction(partner.as_str(), "a parameter has no correlation with itself".to_owned()));
    }
    if !entries.contains_key(partner) {
        let names = entries.keys().map(ParameterName::as_str).collect::<Vec<_>>().join(", ");
        return Err(ConfigError::new(
            partner.as_str(),
            Problem::UnknownParameter { name: partner.clone(), allowed: names },
        ));
    }
    for parameter in [name, partner] {
        if entries.get(parameter).is_none_or(|entry| entry.distribution.variation() != Variation::Continuous) {
            let rule =
                format!("only numbers that vary continuously have a rank correlation, and `{parameter}` does not");
            return Err(contradiction(partner.as_str(), rule));
        }
    }
    if !RANK_CORRELATION.contains(spearman) {
        let problem = Problem::OutOfRange { value: spearman, allowed: RANK_CORRELATION };
        return Err(ConfigError::new(partner.as_str(), problem));
    }
    Ok(())
}

fn contradiction(key: &str, rule: String) -> ConfigError {
    ConfigError::new(key, Problem::Contradiction { other: "parameters", rule })
}
