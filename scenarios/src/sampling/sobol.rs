//! A Sobol sequence with hash-based Owen scrambling.
//!
//! B. Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4), 2020, as the crate `sobol_burley` implements it: 2¹⁶
//! points in 256 dimensions for each 32-bit seed. A longer sequence is continued by the next block of 2¹⁶ points, and
//! more dimensions by the next group of 256, each scrambled independently.

use closecall_traffic::Parameters;
use rand::Rng;
use sobol_burley::NUM_DIMENSIONS;

use super::random::scenario_stream;
use crate::parameters::ParameterSpace;

/// log₂ of the number of points of a block.
const BLOCK_BITS: u32 = 16;

/// Half the spacing of the sequence's numbers, which have 23 bits. In the middle of its cell no number is 0, where
/// the quantile of an unbounded distribution is infinite.
const HALF_CELL: f64 = 1.0 / (1_u32 << 24) as f64;

pub(super) fn sample(space: &ParameterSpace, seed: u64, index: u64) -> Parameters {
    let block = index >> BLOCK_BITS;
    let place = (index & ((1 << BLOCK_BITS) - 1)) as u32;
    let mut scramble = 0;
    space.map(|_, name_place, distribution| {
        let (group, dimension) = (name_place as u32 / NUM_DIMENSIONS, name_place as u32 % NUM_DIMENSIONS);
        if dimension == 0 {
            scramble = scenario_stream(seed, block, &format!("sobol/{group}")).next_u32();
        }
        distribution.quantile(f64::from(sobol_burley::sample(place, dimension, scramble)) + HALF_CELL)
    })
}
