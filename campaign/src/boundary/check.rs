//! The validity of a surface: each run predicted from the others.
//!
//! Near the boundary the sign of a run is uncertain even if the surface is right. The number of
//! signs that are predicted is therefore compared with the number that the surface expects. The
//! first runs fill the rectangle, and most of their signs have to be predicted.

use std::fmt;

use closecall_traffic::statistics::format::percent;

use super::search::START_RUNS;
use super::slices::Area;
use super::surface::Predicted;

/// Smallest probability of so few predicted signs with which the surface is not doubted: an
/// assumption; 0.1 to 5 % are usual.
const SMALLEST_PROBABILITY: f64 = 0.01;
/// Share of the first runs whose sign has to be predicted: an assumption; 70 to 90 % are plausible.
/// If the margin is noise, half of the signs are predicted.
const SMALLEST_START_SHARE: f64 = 0.8;
/// Share of the runs that may be without a value: an assumption; 5 to 25 % are plausible. A surface
/// says nothing about places where the number does not exist, and draws a boundary through them.
const LARGEST_WITHOUT_VALUE: f64 = 0.1;
/// Share of the area that may be undecided: an assumption; 20 to 50 % are plausible.
const LARGEST_UNDECIDED: f64 = 0.5;

/// The runs, each predicted from the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeaveOneOut {
    /// Number of runs with a margin.
    pub runs: usize,
    /// Runs that have the sign that is predicted without them.
    pub signs: usize,
    /// Number of such runs that the surface expects.
    pub signs_expected: f64,
    /// Probability of so few signs if the surface is right.
    pub probability: f64,
    /// Number of first runs with a margin.
    pub start_runs: usize,
    /// First runs that have the sign that is predicted without them.
    pub start_signs: usize,
    /// Runs whose margin is in the 95 % interval that is predicted without them.
    pub inside_95: usize,
}

/// A reason to doubt a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// Fewer signs are predicted than the surface expects.
    Signs(LeaveOneOut),
    /// Too few signs of the first runs are predicted.
    StartSigns(LeaveOneOut),
    /// Too much of the area is undecided.
    Undecided(Area),
    /// Too many runs have no value.
    WithoutValue {
        /// The number of such runs.
        without: usize,
        /// The number of all runs.
        runs: usize,
    },
    /// The event happens in runs whose margin is 0: their sign does not say so.
    OnBound {
        /// The number of such runs.
        on_bound: usize,
        /// The number of runs with a margin.
        runs: usize,
    },
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Signs(check) => write!(
                f,
                "{} of {} runs have the sign that is predicted without them; {:.1} are expected (probability of so few: {})",
                check.signs,
                check.runs,
                check.signs_expected,
                percent(check.probability)
            ),
            Self::StartSigns(check) => write!(
                f,
                "{} of the {} runs that fill the rectangle have the sign that is predicted without them; {} are required",
                check.start_signs,
                check.start_runs,
                percent(SMALLEST_START_SHARE)
            ),
            Self::Undecided(area) => write!(
                f,
                "{} of the area is undecided; at most {} is allowed",
                percent(area.undecided),
                percent(LARGEST_UNDECIDED)
            ),
            Self::WithoutValue { without, runs } => write!(
                f,
                "{without} of {runs} runs have no value, and the surface says nothing about their places; at most {} is allowed",
                percent(LARGEST_WITHOUT_VALUE)
            ),
            Self::OnBound { on_bound, runs } => write!(
                f,
                "in {on_bound} of {runs} runs the number is equal to the bound, and the event happens: there the number has no distance from the bound"
            ),
        }
    }
}

impl LeaveOneOut {
    /// Compares margins with their predictions. `indices` are the numbers of their runs.
    pub(super) fn new(predicted: &[Predicted], margins: &[f64], indices: &[usize]) -> Self {
        let has_sign = |(predicted, margin): (&Predicted, &f64)| (predicted.mean < 0.0) == (*margin < 0.0);
        let signs: Vec<bool> = predicted.iter().zip(margins).map(has_sign).collect();
        let is_start = |index: &&usize| **index < START_RUNS;
        let is_inside = |(predicted, margin): &(&Predicted, &f64)| {
            !Predicted { mean: *margin - predicted.mean, ..**predicted }.is_decided()
        };
        let probabilities: Vec<f64> = predicted.iter().map(Predicted::probability_of_sign).collect();
        let count = signs.iter().filter(|sign| **sign).count();
        Self {
            runs: signs.len(),
            signs: count,
            signs_expected: probabilities.iter().sum(),
            probability: at_most(count, &probabilities),
            start_runs: indices.iter().filter(is_start).count(),
            start_signs: indices.iter().zip(&signs).filter(|(index, sign)| is_start(index) && **sign).count(),
            inside_95: predicted.iter().zip(margins).filter(is_inside).count(),
        }
    }

    /// Returns the reasons to doubt the surface.
    pub(super) fn doubts(self, area: Area) -> Vec<Doubt> {
        let enough_start = self.start_signs as f64 >= SMALLEST_START_SHARE * self.start_runs as f64;
        let signs = (!(self.probability >= SMALLEST_PROBABILITY)).then_some(Doubt::Signs(self));
        let start = (!enough_start).then_some(Doubt::StartSigns(self));
        let undecided = (!(area.undecided <= LARGEST_UNDECIDED)).then_some(Doubt::Undecided(area));
        [signs, start, undecided].into_iter().flatten().collect()
    }
}

/// Returns a reason to doubt a surface if too many of the runs have no value.
pub(super) fn without_value(without: usize, runs: usize) -> Option<Doubt> {
    let few = without as f64 <= LARGEST_WITHOUT_VALUE * runs as f64;
    (!few).then_some(Doubt::WithoutValue { without, runs })
}

/// Returns the probability of at most `count` of independent events with these probabilities.
///
/// The independence of the signs is an assumption. Neighbouring runs are predicted from each other,
/// so their errors go together, and the number of signs scatters more than assumed. The check
/// therefore doubts a right surface more often than [`SMALLEST_PROBABILITY`] says.
fn at_most(count: usize, probabilities: &[f64]) -> f64 {
    let mut of_counts = vec![1.0];
    for probability in probabilities {
        let happens = std::iter::once(0.0).chain(of_counts.iter().map(|share| share * probability));
        let not = of_counts.iter().map(|share| share * (1.0 - probability)).chain([0.0]);
        of_counts = happens.zip(not).map(|(happens, not)| happens + not).collect();
    }
    of_counts.iter().take(count + 1).sum::<f64>().min(1.0)
}

#[cfg(test)]
mod tests {
    use super::super::search::tests::{Margin, searched};
    use super::super::slices::map;
    use super::*;

    fn doubts(margin: Margin, scramble: u32) -> (LeaveOneOut, Vec<Doubt>) {
        let searched = searched(margin, 60, scramble);
        let (surface, indices) = searched.surface().unwrap();
        let margins: Vec<f64> = searched.margins.iter().map(|margin| margin.unwrap()).collect();
        let check = LeaveOneOut::new(&surface.leave_one_out(), &margins, &indices);
        (check, check.doubts(map(&surface).1))
    }

    #[test]
    fn a_smooth_margin_is_predicted_without_each_of_its_runs() {
        for scramble in [1, 2, 3] {
            let (check, doubts) = doubts(|x, y| y - 0.2 - 0.5 * x * x, scramble);
            assert!(doubts.is_empty(), "{doubts:?}");
            assert!(check.runs == 60 && check.start_runs == 20 && check.start_signs >= 18, "{check:?}");
            assert!(check.inside_95 >= 54, "{check:?}");
        }
    }

    #[test]
    fn noise_is_doubted() {
        // The fractions of large multiples have no order along the square.
        let noise: Margin = |x, y| {
            let large = 43_758.545_3 * closecall_traffic::maths::sin(12_345.678 * x + 98_765.43 * y);
            large - large.floor() - 0.5
        };
        let all = [1, 2, 3].map(|scramble| doubts(noise, scramble));
        assert!(all.iter().all(|(_, doubts)| !doubts.is_empty()), "{all:?}");
        // The signs of the runs speak up, too, unless chance predicts 16 of 20.
        let speaks = |doubts: &[Doubt]| doubts.iter().any(|doubt| !matches!(doubt, Doubt::Undecided(_)));
        assert!(all.iter().filter(|(_, doubts)| speaks(doubts)).count() >= 2, "{all:?}");
    }

    #[test]
    fn a_margin_with_many_jumps_is_doubted() {
        let squares: Margin = |x, y| if ((5.0 * x).floor() + (5.0 * y).floor()) % 2.0 == 0.0 { 1.0 } else { -1.0 };
        for scramble in [1, 2, 3] {
            let (check, doubts) = doubts(squares, scramble);
            assert!(!doubts.is_empty(), "{check:?}");
        }
    }

    #[test]
    fn the_probability_of_few_signs_is_that_of_a_binomial_with_equal_probabilities() {
        assert!((at_most(1, &[0.5; 3]) - 0.5).abs() < 1e-12);
        assert!((at_most(3, &[0.2; 3]) - 1.0).abs() < 1e-12);
        assert!((at_most(0, &[0.1, 0.4]) - 0.54).abs() < 1e-12);
    }

    #[test]
    fn runs_without_a_value_are_a_doubt_if_they_are_more_than_a_tenth() {
        assert_eq!(without_value(0, 60), None);
        assert_eq!(without_value(6, 60), None);
        assert_eq!(without_value(7, 60), Some(Doubt::WithoutValue { without: 7, runs: 60 }));
        let doubt = without_value(31, 60).unwrap().to_string();
        assert!(doubt.starts_with("31 of 60 runs have no value") && doubt.contains("at most 10 %"), "{doubt}");
    }

    #[test]
    fn wrong_signs_that_the_surface_is_sure_of_are_a_doubt() {
        let predicted = [Predicted { mean: 5.0, sd: 1.0 }; 20];
        let area = Area { passes: 1.0, fails: 0.0, undecided: 0.0 };
        let indices: Vec<usize> = (0..20).collect();
        let right = LeaveOneOut::new(&predicted, &[5.5; 20], &indices);
        assert!(right.doubts(area).is_empty() && right.inside_95 == 20);
        let mut margins = [5.5; 20];
        margins[3] = -1.0;
        let wrong = LeaveOneOut::new(&predicted, &margins, &indices);
        assert_eq!((wrong.signs, wrong.inside_95), (19, 19));
        assert!(matches!(wrong.doubts(area)[..], [Doubt::Signs(_)]), "{wrong:?}");
        assert!(wrong.doubts(area)[0].to_string().starts_with("19 of 20 runs have the sign"));
    }
}
