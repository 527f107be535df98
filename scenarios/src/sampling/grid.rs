//! Full factorial grids.
//!
//! # Number of levels
//!
//! All parameters get the same number of levels: the largest for which the number of combinations
//! does not exceed n. A choice has at most as many levels as labels, and a fixed value has one.
//! Then each parameter, in the order of the names, gets one more level if the number of
//! combinations still does not exceed n. The levels of a number are the medians of as many equally
//! probable parts, and the levels of a choice are its most probable labels. A single level is the
//! nominal value.
//!
//! The parameter with the last name varies fastest.

use closecall_traffic::Parameters;

use crate::parameters::ParameterSpace;

/// A full factorial grid: the number of levels of each parameter, in the order of the names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    levels: Vec<u64>,
}

impl Grid {
    /// Returns the grid with up to `n` points; see the module documentation. If `n` is 0, its only
    /// point is the nominal one.
    pub(super) fn within(space: &ParameterSpace, n: u64) -> Self {
        let max_levels: Vec<u64> = space.iter().map(|(_, entry)| entry.distribution.max_levels()).collect();
        let even = |levels: u64| Self { levels: max_levels.iter().map(|&max| max.min(levels)).collect() };
        // Bisection for the largest number of levels, up to n, with which the grid fits.
        let (mut low, mut high) = (1, n.max(1).saturating_add(1));
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if even(middle).fits(n) {
                low = middle;
            } else {
                high = middle;
            }
        }
        let mut grid = even(low);
        for (index, &max) in max_levels.iter().enumerate() {
            let mut raised = grid.clone();
            raised.levels[index] = max.min(low.saturating_add(1));
            if raised.fits(n) {
                grid = raised;
            }
        }
        grid
    }

    /// Returns true if the number of combinations does not exceed `n`.
    fn fits(&self, n: u64) -> bool {
        let product = self.levels.iter().try_fold(1_u64, |product, &levels| product.checked_mul(levels));
        product.is_some_and(|points| points <= n)
    }

    /// Returns the number of combinations.
    pub(super) fn points(&self) -> u64 {
        self.levels.iter().product()
    }

    /// Returns combination `index`, counted modulo [`Self::points`].
    pub(super) fn point(&self, space: &ParameterSpace, index: u64) -> Parameters {
        let mut remainder = index % self.points();
        let mut chosen = vec![0; self.levels.len()];
        for (level, count) in chosen.iter_mut().zip(&self.levels).rev() {
            *level = remainder % count;
            remainder /= count;
        }
        space.map(|_, index, distribution| distribution.level(chosen[index], self.levels[index]))
    }
}
