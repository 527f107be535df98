//! Full factorial grids.
//!
//! # How many levels
//!
//! Every parameter starts with one level, which is its nominal value. As long as the number of combinations stays
//! within n, the parameter with the fewest levels (the first by name of several) that can take one more gets it; a
//! choice has at most as many levels as labels, a fixed value has one. A number's levels are the medians of as many equally
//! probable parts, a choice's are its most probable labels.
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
        let mut grid = Self::even(&most, n);
        loop {
            let can_be_raised = |place: &usize| grid.levels[*place] < most[*place] && grid.fits_raised(*place, n);
            let fewest = (0..most.len()).filter(can_be_raised).min_by_key(|&place| grid.levels[place]);
            let Some(place) = fewest else { return grid };
            grid.levels[place] += 1;
        }
    }

    /// The largest grid within `n` in which all parameters have the same number of levels, but for those that cannot
    /// have so many: where the rule arrives after whole rounds, found by bisection.
    fn even(most: &[u64], n: u64) -> Self {
        let grid = |levels: u64| Self { levels: most.iter().map(|&most| most.min(levels)).collect() };
        let (mut fits, mut too_many) = (1, n.saturating_add(1).max(2));
        while too_many - fits > 1 {
            let middle = fits + (too_many - fits) / 2;
            if grid(middle).fits(n) {
                fits = middle;
            } else {
                too_many = middle;
            }
        }
        grid(fits)
    }

    fn fits(&self, n: u64) -> bool {
        let product = self.levels.iter().try_fold(1_u64, |product, &levels| product.checked_mul(levels));
        product.is_some_and(|points| points <= n)
    }

    fn fits_raised(&self, place: usize, n: u64) -> bool {
        let mut raised = self.clone();
        raised.levels[place] += 1;
        raised.fits(n)
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
