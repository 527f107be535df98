//! Mixtures of normal distributions, relative to the standard normal distribution, and their fit to
//! weighted points.
//!
//! ```text
//!                    ╭╮                    ╭╮
//!   q(z)  ▁▁▂▃▄▄▃▂▁▁▁││▁▁  +  α·φ(z)  +  ▁▁││▁▁     one component for each region of failure
//!        ─────────────────────────────────────▶ z
//! ```
//!
//! A component has its own mean and standard deviation in each dimension. Most dimensions do not
//! matter for a region. There the fit of few points would only add noise, which multiplies in the
//! weights over all dimensions. So a mean or a standard deviation stays standard normal unless the
//! points contradict it ([`SIGNIFICANCE`]).
//!
//! The smallest Bayesian information criterion determines the number of components (G. Schwarz,
//! *Estimating the dimension of a model*, Annals of Statistics 6 (1978) 461–464). In it, a mean or
//! a standard deviation counts only if it differs from the standard normal distribution.
//! Expectation and maximization alternate (A. P. Dempster, N. M. Laird and D. B. Rubin, Journal of
//! the Royal Statistical Society B 39 (1977) 1–38), from starts that lie apart as in k-means++ (D.
//! Arthur and S. Vassilvitskii, SODA 2007, 1027–1035).

use closecall_traffic::Stream;
use closecall_traffic::maths::{exp, ln};
use rand::RngExt;
use serde::Serialize;

use super::problem::{Point, draw_noise};

/// Largest number of components that a fit tries (-): an assumption; 2 to 10 are plausible.
const MOST_COMPONENTS: usize = 4;
/// Number of standard errors by which a mean or a standard deviation has to differ from the
/// standard normal distribution (-): an assumption; 2 to 4 are plausible.
const SIGNIFICANCE: f64 = 2.5;
/// Standard deviations that a component may have (-). A component is nowhere narrower than the
/// distribution of the scenario. Its tails are then nowhere lighter, so that no weight grows with
/// the distance from the component. The larger one is an assumption; 2 to 5 are plausible.
const SD: [f64; 2] = [1.0, 3.0];
/// Smallest effective number of points of a component (-): an assumption; 4 to 20 are plausible.
const LEAST_POINTS: f64 = 8.0;
/// Rounds of expectation and maximization, and starts of each number of components (-):
/// assumptions.
const ROUNDS: usize = 30;
const STARTS: usize = 3;

/// One component.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Component {
    /// The share of the mixture.
    pub weight: f64,
    /// The mean in each dimension.
    pub mean: Vec<f64>,
    /// The standard deviation in each dimension.
    pub sd: Vec<f64>,
}

impl Component {
    /// Returns the logarithm of its density, relative to the standard normal density.
    fn log_ratio(&self, z: &[f64]) -> f64 {
        let terms = z.iter().zip(&self.mean).zip(&self.sd);
        terms
            .map(|((z, mean), sd)| {
                if *mean == 0.0 && *sd == 1.0 {
                    return 0.0;
                }
                let scaled = (z - mean) / sd;
                0.5 * (z * z - scaled * scaled) - ln(*sd)
            })
            .sum()
    }

    /// Returns true if a point lies on the same side of the nominal case as the component.
    pub fn is_towards(&self, z: &[f64]) -> bool {
        z.iter().zip(&self.mean).map(|(z, mean)| z * mean).sum::<f64>() > 0.0
    }

    /// Returns the number of means and standard deviations that differ from the standard normal
    /// distribution.
    fn moved(&self) -> usize {
        self.mean.iter().filter(|mean| **mean != 0.0).count() + self.sd.iter().filter(|sd| **sd != 1.0).count()
    }
}

/// A mixture with a share of the standard normal distribution, which bounds every weight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mixture {
    /// Share of the standard normal distribution: the defensive component.
    pub defensive: f64,
    /// The other components.
    pub components: Vec<Component>,
}

impl Mixture {
    /// Returns the standard normal distribution.
    pub const fn standard() -> Self {
        Self { defensive: 1.0, components: Vec::new() }
    }

    /// Returns the distribution of the scenario and one that is wider, in equal shares.
    pub fn wide(dimensions: usize, sd: f64) -> Self {
        let component = Component { weight: 1.0, mean: vec![0.0; dimensions], sd: vec![sd; dimensions] };
        Self { defensive: 0.5, components: vec![component] }
    }

    /// Returns the density at a point, relative to the standard normal density: the inverse of the
    /// likelihood weight.
    pub fn ratio(&self, z: &[f64]) -> f64 {
        let density = |component: &Component| component.weight * exp(component.log_ratio(z).min(MOST_LOG));
        self.defensive + (1.0 - self.defensive) * self.components.iter().map(density).sum::<f64>()
    }

    /// Returns the density of the components alone, relative to the standard normal density.
    pub fn ratio_of_components(&self, z: &[f64]) -> f64 {
        self.components.iter().map(|component| component.weight * exp(component.log_ratio(z).min(MOST_LOG))).sum()
    }

    /// Draws a point.
    pub fn draw(&self, dimensions: usize, rng: &mut Stream) -> Point {
        let mut share = rng.random::<f64>() - self.defensive;
        let mut chosen = None;
        if share >= 0.0 && self.defensive < 1.0 {
            share /= 1.0 - self.defensive;
            chosen = self.components.iter().find(|component| {
                share -= component.weight;
                share < 0.0
            });
            // The weights add up to 1 but for rounding.
            chosen = chosen.or(self.components.last());
        }
        let mut point = Point::draw(dimensions, rng);
        if let Some(component) = chosen {
            for ((z, mean), sd) in point.normals.iter_mut().zip(&component.mean).zip(&component.sd) {
                *z = mean + sd * *z;
            }
        }
        point.noise = draw_noise(rng);
        point
    }

    /// Returns the mixture of several in equal shares.
    pub fn pooled(mixtures: &[Self], defensive: f64) -> Self {
        let share = 1.0 / mixtures.len().max(1) as f64;
        let scaled = |component: &Component| Component { weight: share * component.weight, ..component.clone() };
        let components = mixtures.iter().flat_map(|mixture| mixture.components.iter().map(scaled)).collect();
        Self { defensive, components }
    }
}

/// Largest logarithm of a ratio of densities (-). Beyond it the weight of the point is 0 to every
/// digit.
const MOST_LOG: f64 = 600.0;

/// Weighted points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighted<'a> {
    /// The points.
    pub(super) points: &'a [&'a [f64]],
    /// The weights of the points, not negative.
    pub(super) weights: &'a [f64],
}

impl Weighted<'_> {
    /// Returns the effective number of points: (Σw)² / Σw² (L. Kish, *Survey Sampling*, 1965).
    fn effective(&self) -> f64 {
        effective(self.weights)
    }

    /// Fits a mixture. `None` of no points.
    pub(super) fn fit(&self, defensive: f64, rng: &mut Stream) -> Option<Mixture> {
        let size = self.effective();
        if !(size > 0.0) {
            return None;
        }
        let mut best: Option<(f64, Vec<Component>)> = None;
        for count in 1..=MOST_COMPONENTS {
            for _ in 0..if count == 1 { 1 } else { STARTS } {
                let Some(components) = self.fit_components(count, rng) else { continue };
                let criterion = self.criterion(&components, size);
                if best.as_ref().is_none_or(|(least, _)| criterion < *least) {
                    best = Some((criterion, components));
                }
            }
        }
        best.map(|(_, components)| Mixture { defensive, components })
    }

    /// Returns the Bayesian information criterion, with the likelihood relative to the standard
    /// normal distribution.
    fn criterion(&self, components: &[Component], size: f64) -> f64 {
        let total: f64 = self.weights.iter().sum();
        let mixture = Mixture { defensive: 0.0, components: components.to_vec() };
        let log_likelihood: f64 = self
            .points
            .iter()
            .zip(self.weights)
            .map(|(z, weight)| weight / total * ln(mixture.ratio(z).max(f64::MIN_POSITIVE)))
            .sum();
        let numbers = components.iter().map(Component::moved).sum::<usize>() + components.len() - 1;
        numbers as f64 * ln(size.max(2.0)) - 2.0 * size * log_likelihood
    }

    /// Fits a number of components; `None` if one of them has too few points.
    fn fit_components(&self, count: usize, rng: &mut Stream) -> Option<Vec<Component>> {
        if count == 1 {
            return Some(vec![self.component(self.weights, 1.0)]);
        }
        let mut shares = self.start(count, rng)?;
        let mut components = Vec::new();
        for _ in 0..ROUNDS {
            components = self.maximize(&shares)?;
            shares = self.expect(&components);
        }
        Some(components)
    }

    /// Returns the share of each component in each point: its nearest of centres that lie apart.
    fn start(&self, count: usize, rng: &mut Stream) -> Option<Vec<Vec<f64>>> {
        let mut nearest = vec![f64::INFINITY; self.points.len()];
        let mut owner = vec![0; self.points.len()];
        let mut pull = self.weights.to_vec();
        for centre in 0..count {
            let chosen = choose(&pull, rng)?;
            for (index, point) in self.points.iter().enumerate() {
                let apart: f64 = point.iter().zip(self.points[chosen]).map(|(a, b)| (a - b) * (a - b)).sum();
                if apart < nearest[index] {
                    (nearest[index], owner[index]) = (apart, centre);
                }
                pull[index] = self.weights[index] * nearest[index];
            }
        }
        let is_of = |centre: usize| {
            owner.iter().map(|nearest_centre| if *nearest_centre == centre { 1.0 } else { 0.0 }).collect()
        };
        Some((0..count).map(is_of).collect())
    }

    fn maximize(&self, shares: &[Vec<f64>]) -> Option<Vec<Component>> {
        let total: f64 = self.weights.iter().sum();
        let component = |share: &Vec<f64>| {
            let weights: Vec<f64> = self.weights.iter().zip(share).map(|(weight, share)| weight * share).collect();
            (effective(&weights) >= LEAST_POINTS).then(|| self.component(&weights, weights.iter().sum::<f64>() / total))
        };
        shares.iter().map(component).collect()
    }

    fn expect(&self, components: &[Component]) -> Vec<Vec<f64>> {
        let mut shares = vec![vec![0.0; self.points.len()]; components.len()];
        for (index, point) in self.points.iter().enumerate() {
            let logs: Vec<f64> =
                components.iter().map(|component| ln(component.weight) + component.log_ratio(point)).collect();
            let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let total: f64 = logs.iter().map(|log| exp(log - largest)).sum();
            for (share, log) in shares.iter_mut().zip(&logs) {
                share[index] = exp(log - largest) / total;
            }
        }
        shares
    }

    /// Returns the component of points with these weights.
    fn component(&self, weights: &[f64], share: f64) -> Component {
        let total: f64 = weights.iter().sum();
        let size = effective(weights);
        let dimensions = self.points.first().map_or(0, |point| point.len());
        let mut component = Component { weight: share, mean: vec![0.0; dimensions], sd: vec![1.0; dimensions] };
        for axis in 0..dimensions {
            let moment = |function: &dyn Fn(f64) -> f64| {
                self.points.iter().zip(weights).map(|(point, weight)| weight * function(point[axis])).sum::<f64>()
                    / total
            };
            let mean = moment(&|z| z);
            let about = |centre: f64| moment(&|z| (z - centre) * (z - centre)).sqrt();
            let spread = about(mean);
            let is_moved = mean.abs() > SIGNIFICANCE * spread / size.sqrt();
            let centre = if is_moved { mean } else { 0.0 };
            let sd = about(centre);
            // The standard error of the logarithm of a standard deviation.
            let is_scaled = !(ln(sd).abs() <= SIGNIFICANCE / (2.0 * size).sqrt());
            component.mean[axis] = centre;
            component.sd[axis] = if is_scaled { sd.clamp(SD[0], SD[1]) } else { 1.0 };
        }
        component
    }
}

/// Returns (Σw)² / Σw²; 0 if all weights are 0.
pub(super) fn effective(weights: &[f64]) -> f64 {
    let (sum, squares) = weights.iter().fold((0.0, 0.0), |(sum, squares), w| (sum + w, squares + w * w));
    if squares > 0.0 { sum * sum / squares } else { 0.0 }
}

/// Chooses an index with a probability in proportion to its pull.
fn choose(pull: &[f64], rng: &mut Stream) -> Option<usize> {
    let total: f64 = pull.iter().sum();
    if !(total > 0.0) {
        return None;
    }
    let mut rest = rng.random::<f64>() * total;
    let chosen = pull.iter().position(|weight| {
        rest -= weight;
        rest < 0.0
    });
    chosen.or_else(|| pull.iter().rposition(|weight| *weight > 0.0))
}
