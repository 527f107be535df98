//! What a block runs: samples of a campaign, or points of the search for a rare event. An engine
//! passes it on as whole numbers, which it need not understand.
//!
//! | numbers | what they are |
//! |---|---|
//! | n, n, … | the samples with these numbers |
//! | 2⁶⁴ − 1, d, then for each point its noise and the bits of its d numbers | points |
//!
//! No sample has the number 2⁶⁴ − 1, since a campaign has at most 2⁶⁴ − 1 samples, counted from 0.

use crate::rare::Point;

/// The first number of a block of points.
const OF_POINTS: u64 = u64::MAX;

/// What a block runs.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Content {
    /// Samples, by their numbers.
    Samples(Vec<u64>),
    /// Points, all of the same number of dimensions.
    Points(Vec<Point>),
}

impl Content {
    /// Returns the number of samples or points.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Samples(samples) => samples.len(),
            Self::Points(points) => points.len(),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the numbers that an engine passes on.
    pub(super) fn numbers(&self) -> Vec<u64> {
        match self {
            Self::Samples(samples) => samples.clone(),
            Self::Points(points) => {
                let dimensions = points.first().map_or(0, |point| point.normals.len());
                let bits = points
                    .iter()
                    .flat_map(|point| std::iter::once(point.noise).chain(point.normals.iter().map(|z| z.to_bits())));
                [OF_POINTS, dimensions as u64].into_iter().chain(bits).collect()
            }
        }
    }

    /// Reads the numbers; `None` if a point is incomplete.
    pub(super) fn read(numbers: &[u64]) -> Option<Self> {
        let [OF_POINTS, dimensions, bits @ ..] = numbers else { return Some(Self::Samples(numbers.to_vec())) };
        let points = bits.chunks_exact(usize::try_from(*dimensions).ok()?.checked_add(1)?);
        if !points.remainder().is_empty() {
            return None;
        }
        let point = |numbers: &[u64]| Point {
            noise: numbers[0],
            normals: numbers[1..].iter().map(|bits| f64::from_bits(*bits)).collect(),
        };
        Some(Self::Points(points.map(point).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_and_points_arrive_to_the_bit() {
        let point = |noise| Point { noise, normals: vec![-0.0, 1.0 / 3.0, f64::MIN_POSITIVE] };
        for content in [
            Content::Samples(vec![]),
            Content::Samples(vec![0, 7, u64::MAX - 1]),
            Content::Points(vec![point(0), point(u64::MAX)]),
        ] {
            assert_eq!(Content::read(&content.numbers()), Some(content.clone()));
            let (read, sent) = (Content::read(&content.numbers()).unwrap().numbers(), content.numbers());
            assert_eq!(read, sent, "also the sign of a zero");
        }
        let cut = Content::Points(vec![point(1)]).numbers();
        assert_eq!(Content::read(&cut[..cut.len() - 1]), None);
        assert_eq!(Content::read(&[OF_POINTS, u64::MAX, 1]), None);
    }
}
