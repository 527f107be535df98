//! A Sobol sequence with hash-based Owen scrambling.
//!
//! Source: B. Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4), 2020, as implemented in
//! the crate `sobol_burley`: 2¹⁶ points in 256 dimensions for each 32-bit seed. A longer sequence
//! continues with further blocks of 2¹⁶ points, and more dimensions with further groups of 256.
//! Each block and each group is scrambled independently.

use closecall_traffic::Parameters;
use rand::Rng;
use sobol_burley::NUM_DIMENSIONS;

use super::random::scenario_stream;
use crate::parameters::ParameterSpace;

/// Binary logarithm of the number of points in a block.
const BLOCK_BITS: u32 = 16;

/// Half the spacing of the numbers in the sequence, which have 23 bits. It moves each number to the
/// middle of its cell, so that none is 0, where the quantile of an unbounded distribution is
/// infinite.
const HALF_CELL: f64 = 1.0 / (1_u32 << 24) as f64;

/// Returns the parameter values of sample `index`.
pub(super) fn sample(space: &ParameterSpace, seed: u64, index: u64) -> Parameters {
    let block = index >> BLOCK_BITS;
    let point = (index & ((1 << BLOCK_BITS) - 1)) as u32;
    let mut scramble = 0;
    let number = |name_index: usize| {
        let (group, dimension) = (name_index as u32 / NUM_DIMENSIONS, name_index as u32 % NUM_DIMENSIONS);
        if dimension == 0 {
            scramble = scenario_stream(seed, block, &format!("sobol/{group}")).next_u32();
        }
        f64::from(sobol_burley::sample(point, dimension, scramble)) + HALF_CELL
    };
    space.values((0..space.iter().len()).map(number).collect())
}

/// Returns point `index` of a scrambled Sobol sequence in the open unit cube, for searches that
/// need no seed.
pub fn unit_point(index: u32, dimensions: usize) -> Vec<f64> {
    (0..dimensions as u32).map(|dimension| f64::from(sobol_burley::sample(index, dimension, 0)) + HALF_CELL).collect()
}
