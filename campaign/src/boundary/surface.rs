//! A Gaussian process over the unit square, by the crate `friedrich`.
//!
//! ```text
//!  coordinates in [0, 1]²  ─▶ stretched by a ratio ┐
//!  margins ─▶ divided by their standard deviation  ┴▶ Matérn kernel, constant mean, noise ─▶ mean, standard deviation
//! ```
//!
//! The kernel is Matérn's with ν = 3/2: its functions have a slope, but may bend sharply, as a
//! margin does where another vehicle or another rule begins to decide. `friedrich` fits its length
//! and its amplitude by the likelihood. It fits neither the noise of a kernel that it rescales nor
//! a length for each parameter, and its `likelihood` replaces a determinant by the product of the
//! diagonal. So noise and ratio are chosen from short lists, by the predictions of runs that are
//! left out.

use closecall_traffic::maths;
use friedrich::gaussian_process::GaussianProcess;
use friedrich::kernel::Matern1;
use friedrich::prior::ConstantPrior;

/// Fewest runs for which a surface is fitted: an assumption, 5 for each parameter; a surface of
/// fewer says little more than its runs.
pub(super) const FEWEST: usize = 10;

/// Standard deviations of the noise with which a fit begins, as shares of the standard deviation of
/// the margins: none but for rounding, and up to a third. The fit multiplies the noise by the same
/// factors as the amplitude of the kernel.
const NOISES: [f64; 4] = [0.001, 0.03, 0.1, 0.3];
/// Ratios of the two lengths that are tried.
const RATIOS: [f64; 5] = [1.0, 0.25, 0.5, 2.0, 4.0];
/// Steps of a fit, and the relative change of the parameters below which it ends.
const MOST_STEPS: usize = 100;
const SMALLEST_STEP: f64 = 0.01;
/// Replacement of a diagonal that rounding has made negative: the square of a hundredth of the
/// smallest noise.
const SMALLEST_DIAGONAL: f64 = 1e-10;

/// A predicted margin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Predicted {
    /// The mean, in the unit of the margin.
    pub(super) mean: f64,
    /// The standard deviation, in the unit of the margin.
    pub(super) sd: f64,
}

/// The standard normal quantile of 97.5 %.
pub(super) const Z_95: f64 = 1.96;

impl Predicted {
    /// Returns true if 0 is outside the 95 % interval.
    pub(super) fn is_decided(&self) -> bool {
        self.mean.abs() > Z_95 * self.sd
    }

    /// Returns the probability that the margin has the sign of its mean.
    pub(super) fn probability_of_sign(&self) -> f64 {
        match self.sd > 0.0 {
            true => 0.5 * maths::erfc(-self.mean.abs() / self.sd * std::f64::consts::FRAC_1_SQRT_2),
            false => 1.0,
        }
    }
}

/// What a surface is made of, apart from its runs.
#[derive(Clone, Copy, Debug)]
struct Shape {
    /// Ratio of the lengths along the second and the first parameter.
    ratio: f64,
    kernel: Matern1,
    /// Standard deviation of the noise, in standard deviations of the margins.
    noise: f64,
    /// Mean of the margins, in their standard deviations.
    mean: f64,
}

/// A fitted surface.
pub(super) struct Surface {
    shape: Shape,
    /// The runs: coordinates in [0, 1], and margins in their standard deviations.
    points: Vec<[f64; 2]>,
    values: Vec<f64>,
    /// Standard deviation of the margins, in their unit.
    scale: f64,
    process: GaussianProcess<Matern1, ConstantPrior>,
}

impl Shape {
    /// Returns points as `friedrich` takes them: with one length for both coordinates.
    fn stretched(&self, points: &[[f64; 2]]) -> Vec<Vec<f64>> {
        let root = self.ratio.sqrt();
        points.iter().map(|[x, y]| vec![x * root, y / root]).collect()
    }

    fn process(&self, points: &[[f64; 2]], values: Vec<f64>) -> GaussianProcess<Matern1, ConstantPrior> {
        let prior = ConstantPrior::new(self.mean);
        GaussianProcess::new(prior, self.kernel, self.noise, Some(SMALLEST_DIAGONAL), self.stretched(points), values)
    }

    fn is_finite(&self) -> bool {
        [self.kernel.ls, self.kernel.ampl, self.noise].iter().all(|value| value.is_finite())
    }

    /// Fits length and amplitude of the kernel with this noise.
    fn fitted(self, points: &[[f64; 2]], values: &[f64]) -> Self {
        let fit = GaussianProcess::builder(self.stretched(points), values.to_vec())
            .set_kernel(self.kernel)
            .set_prior(ConstantPrior::new(self.mean))
            .set_noise(self.noise)
            .set_cholesky_epsilon(Some(SMALLEST_DIAGONAL))
            .set_fit_parameters(MOST_STEPS, SMALLEST_STEP)
            .fit_kernel()
            .train();
        Self { kernel: fit.kernel, noise: fit.noise, ..self }
    }

    /// Predicts each run from the others. The standard deviation includes the noise.
    fn leave_one_out(&self, points: &[[f64; 2]], values: &[f64]) -> Vec<Predicted> {
        let without = |index: usize| {
            let mut others = (points.to_vec(), values.to_vec());
            let (point, _) = (others.0.remove(index), others.1.remove(index));
            let process = self.process(&others.0, others.1);
            predict(&process, self.stretched(&[point]), self.noise * self.noise).remove(0)
        };
        (0..points.len()).map(without).collect()
    }

    /// Returns the logarithm of the probability density of all runs, each predicted from the
    /// others.
    fn score(&self, points: &[[f64; 2]], values: &[f64]) -> f64 {
        let density = |(Predicted { mean, sd }, value): (Predicted, &f64)| {
            let deviation = (value - mean) / sd;
            -maths::ln(sd) - 0.5 * deviation * deviation
        };
        self.leave_one_out(points, values).into_iter().zip(values).map(density).sum()
    }
}

/// A shape that may become the surface.
struct Candidate {
    score: f64,
    /// The noise with which its fit began.
    noise: f64,
    shape: Shape,
}

/// Returns the candidate with the largest score, the first of several.
fn best(candidates: impl Iterator<Item = Candidate>) -> Option<Candidate> {
    candidates.reduce(|best, next| if next.score > best.score { next } else { best })
}

/// Share of the largest margin below which margins differ by rounding alone.
const ROUNDING: f64 = 1e-12;

/// Returns true if margins are all equal but for rounding.
pub(super) fn are_equal(margins: &[f64]) -> bool {
    spread(margins).is_none()
}

/// Returns the mean and the standard deviation of margins; `None` if they are all equal but for
/// rounding. Both may be infinite.
fn spread(margins: &[f64]) -> Option<[f64; 2]> {
    let count = margins.len() as f64;
    let mean = margins.iter().sum::<f64>() / count;
    let scale = (margins.iter().map(|margin| (margin - mean) * (margin - mean)).sum::<f64>() / count).sqrt();
    let largest = margins.iter().fold(0.0_f64, |largest, margin| largest.max(margin.abs()));
    // A scale that is not a number is not small.
    (!(scale <= ROUNDING * largest)).then_some([mean, scale])
}

/// Smallest variance of a prediction (standard deviations of the margins, squared): rounding makes
/// some negative.
const SMALLEST_VARIANCE: f64 = 1e-16;

/// Predicts at points; `more` is added to each variance.
fn predict(process: &GaussianProcess<Matern1, ConstantPrior>, points: Vec<Vec<f64>>, more: f64) -> Vec<Predicted> {
    let (means, variances) = process.predict_mean_variance(&points);
    let one = |(mean, variance): (f64, f64)| Predicted { mean, sd: (variance.max(SMALLEST_VARIANCE) + more).sqrt() };
    means.into_iter().zip(variances).map(one).collect()
}

impl Surface {
    /// Fits a surface to margins at points of the unit square. `None` for fewer than [`FEWEST`]
    /// points, and for margins that are all equal but for rounding.
    pub(super) fn fit(points: &[[f64; 2]], margins: &[f64]) -> Option<Self> {
        if points.len() < FEWEST || margins.len() != points.len() {
            return None;
        }
        let [mean, scale] = spread(margins).filter(|spread| spread.iter().all(|number| number.is_finite()))?;
        let values: Vec<f64> = margins.iter().map(|margin| margin / scale).collect();
        let candidate = |ratio, noise| {
            let start = Shape { ratio, noise, kernel: Matern1::default(), mean: mean / scale };
            let shape = start.fitted(points, &values);
            let score = if shape.is_finite() { shape.score(points, &values) } else { f64::NAN };
            score.is_finite().then_some(Candidate { score, noise, shape })
        };
        let by_noise = best(NOISES.iter().filter_map(|noise| candidate(RATIOS[0], *noise)))?;
        let noise = by_noise.noise;
        let by_ratio = RATIOS[1..].iter().filter_map(|ratio| candidate(*ratio, noise));
        let shape = best(std::iter::once(by_noise).chain(by_ratio))?.shape;
        let process = shape.process(points, values.clone());
        Some(Self { shape, points: points.to_vec(), values, scale, process })
    }

    /// Predicts the margin at points of the unit square.
    pub(super) fn predict(&self, points: &[[f64; 2]]) -> Vec<Predicted> {
        if points.is_empty() {
            return Vec::new();
        }
        self.in_unit(predict(&self.process, self.shape.stretched(points), 0.0))
    }

    /// Returns the standard deviation with which single runs scatter about the surface, in the unit
    /// of the margin. [`Self::predict`] does not contain it, [`Self::leave_one_out`] does.
    pub(super) fn noise_sd(&self) -> f64 {
        self.shape.noise.abs() * self.scale
    }

    /// Predicts the margin of each run from the others.
    pub(super) fn leave_one_out(&self) -> Vec<Predicted> {
        self.in_unit(self.shape.leave_one_out(&self.points, &self.values))
    }

    /// Returns the same surface with a run whose margin is the predicted mean.
    pub(super) fn believing(&self, point: [f64; 2]) -> Self {
        let value = self.predict(&[point]).first().map_or(0.0, |predicted| predicted.mean / self.scale);
        let (points, values) = ([&self.points[..], &[point]].concat(), [&self.values[..], &[value]].concat());
        let process = self.shape.process(&points, values.clone());
        Self { shape: self.shape, points, values, scale: self.scale, process }
    }

    fn in_unit(&self, predicted: Vec<Predicted>) -> Vec<Predicted> {
        let one = |Predicted { mean, sd }: Predicted| Predicted { mean: mean * self.scale, sd: sd * self.scale };
        predicted.into_iter().map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::sampling::unit_point;

    use super::*;

    fn points(count: u32) -> Vec<[f64; 2]> {
        (0..count).map(|index| unit_point(index, 2)).map(|point| [point[0], point[1]]).collect()
    }

    #[test]
    fn a_surface_goes_through_smooth_margins_and_knows_less_between_them() {
        let points = points(30);
        let margins: Vec<f64> = points.iter().map(|[x, y]| 40.0 + 10.0 * maths::sin(3.0 * x) + 5.0 * y * y).collect();
        let surface = Surface::fit(&points, &margins).unwrap();
        for (predicted, margin) in surface.predict(&points).iter().zip(&margins) {
            assert!((predicted.mean - margin).abs() < 0.1, "{predicted:?} {margin}");
        }
        let [at_run, outside] = surface.predict(&[points[0], [3.0, 3.0]])[..] else { panic!("two predictions") };
        assert!(outside.sd > 10.0 * at_run.sd);
        assert_eq!(surface.leave_one_out().len(), 30);
        // The margins are smooth: they do not scatter.
        assert!((0.0..1.0).contains(&surface.noise_sd()), "{}", surface.noise_sd());
    }

    #[test]
    fn too_few_runs_and_equal_margins_have_no_surface() {
        assert!(Surface::fit(&points(9), &[1.0; 9]).is_none());
        assert!(Surface::fit(&points(20), &[1.0; 20]).is_none());
        // The mean of these numbers is rounded, and differs from each of them.
        assert!(Surface::fit(&points(60), &[-0.1; 60]).is_none());
        assert!(Surface::fit(&points(20), &[0.0; 20]).is_none());
        assert!(are_equal(&[-0.1; 60]) && are_equal(&[0.0; 20]) && !are_equal(&[0.1, 0.2]));
        // Their squares are too large for a number, and they are not equal.
        let huge: Vec<f64> = (0..20).map(|index| f64::from(index) * 1e300).collect();
        assert!(Surface::fit(&points(20), &huge).is_none() && !are_equal(&huge));
        let margins: Vec<f64> = (0..20).map(f64::from).collect();
        assert!(Surface::fit(&points(20), &[&margins[..19], &[f64::NAN]].concat()).is_none());
        assert!(Surface::fit(&points(20), &margins).is_some());
    }

    #[test]
    fn a_fit_gives_the_same_bits_again() {
        let points = points(25);
        let margins: Vec<f64> = points.iter().map(|[x, y]| x - y * y).collect();
        let predicted = || Surface::fit(&points, &margins).unwrap().predict(&[[0.3, 0.7]]);
        assert_eq!(predicted(), predicted());
    }
}
