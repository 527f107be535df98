//! Full factorial grids.
//!
//! # How many levels
//!
//! All parameters get the same number of levels, the largest with which the number of combinations stays within n; but
//! a choice has at most as many levels as labels, and a fixed value has one. Then each, in the order of the names, gets
//! one level more where the combinations still stay within n. A number's levels are the medians of as many equally
//! probable parts, a choice's are its most probable labels; a single level is the nominal value.
//!
//! The last name varies fastest.

use closecall_traffic::Parameters;

use crate::parameters::ParameterSpace;

/// A full factorial grid: the number of levels of each parameter, in the order of the names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    levels: Vec<u64>,
}

impl Grid {
    /// The grid with up to `n` points; the nominal values alone where n is 0.
    pub(super) fn within(space: &ParameterSpace, n: u64) -> Self {
        let most: Vec<u64> = space.iter().map(|(_, entry)| entry.distribution.most_levels()).collect();
        let even = |levels: u64| Self { levels: most.iter().map(|&most| most.min(levels)).collect() };
        let (mut fits, mut too_many) = (1, n.max(1).saturating_add(1));
        while too_many - fits > 1 {
            let middle = fits + (too_many - fits) / 2;
            if even(middle).fits(n) {
                fits = middle;
            } else {
                too_many = middle;
            }
        }
        let mut grid = even(fits);
        for (place, &most) in most.iter().enumerate() {
            let mut raised = grid.clone();
            raised.levels[place] = most.min(fits.saturating_add(1));
            if raised.fits(n) {
                grid = raised;
            }
        }
        grid
    }

    /// True where there are no more than `n` combinations.
    fn fits(&self, n: u64) -> bool {
        let product = self.levels.iter().try_fold(1_u64, |product, &levels| product.checked_mul(levels));
        product.is_some_and(|points| points <= n)
    }

    /// The number of combinations.
    pub(super) fn points(&self) -> u64 {
        self.levels.iter().product()
    }

    /// One combination.
    pub(super) fn point(&self, space: &ParameterSpace, index: u64) -> Parameters {
        let mut rest = index % self.points();
        let mut chosen = vec![0; self.levels.len()];
        for (level, of) in chosen.iter_mut().zip(&self.levels).rev() {
            *level = rest % of;
            rest /= of;
        }
        space.map(|_, place, distribution| distribution.level(chosen[place], self.levels[place]))
    }
}
