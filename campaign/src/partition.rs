//! Parts of a campaign that is divided among several machines.
//!
//! A hash of the sample's number determines the part to which the sample belongs. Neighbouring
//! samples of a grid or a sequence, which may all be slow or all fail, are thereby spread over the
//! machines. Nothing else determines the part, so that all machines agree.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Largest number of parts of a campaign.
const MAX_PARTS: u64 = 10_000;

/// Up to this number of samples, the samples of a part are counted one by one, in less than a
/// second.
const COUNTED_SAMPLES: u64 = 100_000_000;

/// One part of a campaign. `2/3` is the second of three.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Partition {
    part: u64,
    count: u64,
}

/// A text that does not name a part of a campaign.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{word}` is not a part of a campaign: expected I/N with 1 ≤ I ≤ N ≤ {MAX_PARTS}, such as 2/3")]
pub struct PartitionError {
    word: String,
}

impl Partition {
    /// Returns the number of this part, counted from 1.
    pub const fn part(self) -> u64 {
        self.part
    }

    /// Returns the number of parts of the campaign.
    pub const fn count(self) -> u64 {
        self.count
    }

    /// Returns true if the sample belongs to this part.
    pub const fn contains(self, sample: u64) -> bool {
        split_mix(sample) % self.count == self.part - 1
    }
}

/// Returns the number of samples in a part of the campaign, or of all samples, from a range of their
/// numbers. A part of more than 100,000,000 samples is as large as the average one.
pub(crate) fn samples_in(part: Option<Partition>, numbers: Range<u64>) -> u64 {
    let all = numbers.end.saturating_sub(numbers.start);
    match part {
        None => all,
        Some(part) if all > COUNTED_SAMPLES => all.div_ceil(part.count),
        Some(part) => numbers.filter(|&sample| part.contains(sample)).count() as u64,
    }
}

/// Returns the hash of a number by the mixing function of SplitMix64. Neighbouring numbers have
/// unrelated hashes.
///
/// Source: G. L. Steele et al., *Fast splittable pseudorandom number generators*, OOPSLA 2014, in
/// the form of S. Vigna's reference implementation.
pub const fn split_mix(number: u64) -> u64 {
    let z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl FromStr for Partition {
    type Err = PartitionError;

    fn from_str(word: &str) -> Result<Self, PartitionError> {
        let fail = || PartitionError { word: word.to_owned() };
        let (part, count) = word.split_once('/').ok_or_else(fail)?;
        let number = |text: &str| text.parse::<u64>().map_err(|_| fail());
        let (part, count) = (number(part)?, number(count)?);
        if (1..=count).contains(&part) && count <= MAX_PARTS { Ok(Self { part, count }) } else { Err(fail()) }
    }
}

impl TryFrom<String> for Partition {
    type Error = PartitionError;
    fn try_from(word: String) -> Result<Self, PartitionError> {
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
        write!(f, "{}/{}", self.part, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_belongs_to_exactly_one_part_and_parts_are_of_similar_size() {
        for count in [1, 2, 3, 7] {
            let parts: Vec<Partition> = (1..=count).map(|part| format!("{part}/{count}").parse().unwrap()).collect();
            let mut sizes = vec![0_u64; parts.len()];
            for sample in 0..10_000 {
                let holders: Vec<usize> = (0..parts.len()).filter(|&index| parts[index].contains(sample)).collect();
                assert_eq!(holders.len(), 1, "sample {sample} of {count} parts");
                sizes[holders[0]] += 1;
            }
            let even = 10_000.0 / count as f64;
            // Six standard deviations of a binomial count.
            assert!(sizes.iter().all(|&size| (size as f64 - even).abs() < 6.0 * even.sqrt()), "{sizes:?}");
        }
    }

    #[test]
    fn the_samples_of_a_part_are_counted_without_a_walk_through_endless_ones() {
        let part = |word: &str| Some(word.parse::<Partition>().unwrap());
        assert_eq!(samples_in(None, 3..u64::MAX), u64::MAX - 3);
        assert_eq!(samples_in(None, Range { start: 5, end: 3 }), 0);
        assert_eq!(samples_in(part("1/1"), 3..10), 7);
        let parts = ["1/3", "2/3", "3/3"].map(|word| samples_in(part(word), 0..10_000));
        assert_eq!(parts.iter().sum::<u64>(), 10_000);
        assert_eq!(samples_in(part("2/3"), 0..u64::MAX), u64::MAX / 3);
        // A large number of samples in the largest number of parts is not nothing.
        assert!(samples_in(part("10000/10000"), 0..COUNTED_SAMPLES + 1) > 0);
    }

    #[test]
    fn the_hash_agrees_with_the_reference_implementation() {
        // The first outputs of SplitMix64 seeded with 0.
        assert_eq!(split_mix(0), 0xe220_a839_7b1d_cdaf);
        assert_eq!(split_mix(0x9e37_79b9_7f4a_7c15), 0x6e78_9e6a_a1b9_65f4);
    }

    #[test]
    fn other_texts_are_refused() {
        for word in ["0/3", "4/3", "1/0", "1", "a/b", "1/2/3", "-1/3", "1/10001", ""] {
            let error = word.parse::<Partition>().unwrap_err().to_string();
            assert!(error.contains("I/N") && error.contains(word), "{error}");
        }
        assert_eq!("2/3".parse::<Partition>().unwrap().to_string(), "2/3");
    }
}
