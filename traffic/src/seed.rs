//! Seeded random streams, one for each purpose.
//!
//! A stream is keyed by (campaign seed, sample, actor, channel) and by nothing else. An additional
//! actor or sensor therefore does not shift the numbers that the others draw, and both arms of a
//! paired sample draw the same numbers.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::ActorId;

/// A deterministic stream of random numbers: ChaCha with 8 rounds.
pub type Stream = ChaCha8Rng;

/// The context string of the key derivation: it separates these keys from any other use of the
/// hash, and versions them.
const DOMAIN: &str = "closecall 2026 random stream v1";

/// Returns the random stream of one purpose.
///
/// All seeds are equivalent; 0 does not mean a random seed.
pub fn stream(seed: u64, sample: u64, actor: &ActorId, channel: &str) -> Stream {
    let mut hasher = blake3::Hasher::new_derive_key(DOMAIN);
    hasher.update(&seed.to_le_bytes());
    hasher.update(&sample.to_le_bytes());
    for name in [actor.as_str(), channel] {
        hasher.update(&(name.len() as u64).to_le_bytes());
        hasher.update(name.as_bytes());
    }
    ChaCha8Rng::from_seed(*hasher.finalize().as_bytes())
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;

    fn first(seed: u64, sample: u64, actor: &str, channel: &str) -> u64 {
        stream(seed, sample, &ActorId::new(actor).unwrap(), channel).random()
    }

    #[test]
    fn each_part_of_the_key_changes_the_stream() {
        let base = first(0, 0, "rear", "reaction");
        assert_eq!(base, first(0, 0, "rear", "reaction"));
        for other in [
            first(1, 0, "rear", "reaction"),
            first(0, 1, "rear", "reaction"),
            first(0, 0, "front", "reaction"),
            first(0, 0, "rear", "lidar"),
            first(0, 0, "rearr", "eaction"),
        ] {
            assert_ne!(base, other);
        }
    }
}
