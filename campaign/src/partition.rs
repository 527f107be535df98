//! A campaign shared out among several machines.
//!
//! Which part a sample belongs to follows from a hash of its number, so that neither slow nor failing regions of a
//! grid or a sequence fall to one machine, and from nothing else, so that every machine agrees.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Most parts of a campaign.
const MOST_PARTS: u64 = 10_000;

/// One part of a campaign: `2/3` is the second of three.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Partition {
    part: u64,
    of: u64,
}

/// A word that is no part of a campaign.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{word}` is no part of a campaign: I/N with 1 ≤ I ≤ N ≤ {MOST_PARTS} is needed, such as 2/3")]
pub struct NotAPartition {
    word: String,
}

impl Partition {
    /// Which part it is, counted from 1.
    pub const fn part(self) -> u64 {
        self.part
    }

    /// How many parts there are.
    pub const fn of(self) -> u64 {
        self.of
    }

    /// True where the sample belongs to this part.
    pub const fn has(self, sample: u64) -> bool {
        split_mix(sample) % self.of == self.part - 1
    }
}

/// The mixing function of SplitMix64: G. L. Steele et al., *Fast splittable pseudorandom number generators*, OOPSLA
/// 2014, as S. Vigna's reference implementation has it. Neighbouring numbers get unrelated hashes.
pub const fn split_mix(number: u64) -> u64 {
    let z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl FromStr for Partition {
    type Err = NotAPartition;

    fn from_str(word: &str) -> Result<Self, NotAPartition> {
        let fail = || NotAPartition { word: word.to_owned() };
        let (part, of) = word.split_once('/').ok_or_else(fail)?;
        let number = |text: &str| text.parse::<u64>().map_err(|_| fail());
        let (part, of) = (number(part)?, number(of)?);
        if (1..=of).contains(&part) && of <= MOST_PARTS { Ok(Self { part, of }) } else { Err(fail()) }
    }
}

impl TryFrom<String> for Partition {
    type Error = NotAPartition;
    fn try_from(word: String) -> Result<Self, NotAPartition> {
        word.parse()
    }
}

impl From<Partition> for String {
    fn from(partition: Partition) -> Self {
        partition.to_string()
    }
}

impl fmt::Display for Partition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.part, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_belongs_to_exactly_one_part_and_parts_are_alike() {
        for of in [1, 2, 3, 7] {
            let parts: Vec<Partition> = (1..=of).map(|part| format!("{part}/{of}").parse().unwrap()).collect();
            let mut sizes = vec![0_u64; parts.len()];
            for sample in 0..10_000 {
                let holders: Vec<usize> = (0..parts.len()).filter(|&place| parts[place].has(sample)).collect();
                assert_eq!(holders.len(), 1, "sample {sample} of {of} parts");
                sizes[holders[0]] += 1;
            }
            let even = 10_000.0 / of as f64;
            // Six standard deviations of a binomial count.
            assert!(sizes.iter().all(|&size| (size as f64 - even).abs() < 6.0 * even.sqrt()), "{sizes:?}");
        }
    }

    #[test]
    fn the_hash_is_that_of_the_reference() {
        // The first outputs of SplitMix64 seeded with 0.
        assert_eq!(split_mix(0), 0xe220_a839_7b1d_cdaf);
        assert_eq!(split_mix(0x9e37_79b9_7f4a_7c15), 0x6e78_9e6a_a1b9_65f4);
    }

    #[test]
    fn what_is_no_part_is_refused() {
        for word in ["0/3", "4/3", "1/0", "1", "a/b", "1/2/3", "-1/3", "1/10001", ""] {
            let error = word.parse::<Partition>().unwrap_err().to_string();
            assert!(error.contains("I/N") && error.contains(word), "{error}");
        }
        assert_eq!("2/3".parse::<Partition>().unwrap().to_string(), "2/3");
    }
}
