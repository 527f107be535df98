//! False alarms: points where there is nothing, because the receiver's noise alone exceeds the
//! detection threshold.
//!
//! Noise has no preferred time: within the listening time of the receiver, every range is equally
//! likely. A false alarm has the power of the threshold, so its intensity grows with the square of
//! its range.

use super::noise::{Noise, Purpose};
use super::pattern::Pattern;
use super::power::LinkBudget;
use super::power::MAX_INTENSITY;
use super::pulse;
use super::receiver::SensorPoseEstimate;
use super::{LidarScan, Material, PointSource, PointTruth, ScanTruth};

/// Least range of a false alarm (m).
const NEAREST_M: f32 = 0.5;
/// Number of beams among which the number of false alarms is drawn at once. Their rate is at most
/// 0.1, so double precision can represent the probability of none.
const BLOCK: usize = 4_096;

/// The receiver of a scan whose noise exceeds its threshold in some beams.
pub(super) struct FalseAlarms<'a> {
    /// Probability of a false alarm in a beam.
    pub(super) rate: f64,
    /// Range up to which the receiver listens (m).
    pub(super) reach_m: f32,
    pub(super) link: &'a LinkBudget,
    pub(super) noise: Noise,
    pub(super) pattern: &'a Pattern,
}

impl FalseAlarms<'_> {
    /// Appends the false alarms to the scan and to its ground truth. `pose_at` returns the pose of
    /// the sensor at the time of a column.
    ///
    /// Every beam has one with the same probability, independently of the others. There are few, so
    /// that their number is drawn instead of each beam, and then different beams for them.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a pattern has at most 65,535 beams")]
    pub(super) fn append(
        &self,
        pose_at: impl Fn(u32) -> SensorPoseEstimate,
        (scan, truth): (&mut LidarScan, &mut ScanTruth),
    ) {
        let beams = self.pattern.kind().beams();
        let mut draws = 0;
        for first in (0..beams).step_by(BLOCK) {
            let among = BLOCK.min(beams - first);
            let before = scan.len();
            let alarms = binomial(among, self.rate, self.noise.uniform(first, Purpose::Detection).into());
            while scan.len() < before + alarms {
                let beam = first + (self.noise.uniform(draws, Purpose::Dropout) * among as f32) as usize;
                draws += 1;
                if beam < first + among && !scan.beam[before..].contains(&(beam as u16)) {
                    self.push(beam, &pose_at, scan);
                    let range_m = self.range_m(beam);
                    truth.points.push(PointTruth { source: PointSource::False, material: Material::Water, range_m });
                }
            }
        }
    }

    fn range_m(&self, beam: usize) -> f32 {
        NEAREST_M + self.noise.uniform(beam, Purpose::Range) * (self.reach_m - NEAREST_M)
    }

    /// Appends the false alarm of a beam.
    #[expect(clippy::cast_possible_truncation, reason = "a pattern has at most 65,535 beams")]
    fn push(&self, beam: usize, pose_at: impl Fn(u32) -> SensorPoseEstimate, scan: &mut LidarScan) {
        let layers = self.pattern.kind().layers();
        let column = &self.pattern.columns[beam / layers];
        let elevation = &self.pattern.elevations(scan.mirror_side, beam / layers)[beam % layers];
        let range_m = self.range_m(beam);
        let [cos, sin] = column.centre[elevation.group];
        let [tan, cosine] = elevation.centre;
        let level = range_m * cosine;
        let [x, y, z] = pose_at(column.offset_ns).ego_frame_point_m([level * cos, level * sin, level * tan]);
        scan.x_m.push(x);
        scan.y_m.push(y);
        scan.z_m.push(z);
        scan.intensity.push((range_m * range_m / self.link.gain_m2).min(MAX_INTENSITY));
        scan.echoes.note(|| [pulse::width_ns(1.0, 0.0), self.link.reported_intensity(1.0, range_m)]);
        scan.offset_ns.push(column.offset_ns);
        scan.beam.push(beam as u16);
    }
}

/// Returns the number of successes in `trials` independent trials with the probability `rate`
/// (below 1), for a uniform random number: the inverse of the cumulative probability.
fn binomial(trials: usize, rate: f64, uniform: f64) -> usize {
    let mut probability = power(1.0 - rate, trials);
    let (odds, mut below, mut successes) = (rate / (1.0 - rate), probability, 0);
    while below < uniform && successes < trials {
        probability *= odds * (trials - successes) as f64 / (successes + 1) as f64;
        below += probability;
        successes += 1;
    }
    successes
}

/// Returns a power, by squaring: the same bits on every machine.
fn power(mut base: f64, mut exponent: usize) -> f64 {
    let mut product = 1.0;
    while exponent > 0 {
        if exponent % 2 == 1 {
            product *= base;
        }
        base *= base;
        exponent /= 2;
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_successes_has_the_probabilities_of_the_binomial_distribution() {
        // The probabilities of 0 to 3 successes in three trials with 0.2 are 0.512, 0.384, 0.096
        // and 0.008.
        for (uniform, expected) in
            [(0.001, 0), (0.511, 0), (0.513, 1), (0.895, 1), (0.897, 2), (0.991, 2), (0.993, 3), (1.0, 3)]
        {
            assert_eq!(binomial(3, 0.2, uniform), expected, "{uniform}");
        }
        let draws = 100_000;
        let number = |draw: usize| binomial(BLOCK, 1e-3, (draw as f64 + 0.5) / draws as f64) as f64;
        let (sum, squares) =
            (0..draws).map(number).fold((0.0, 0.0), |(sum, squares), count| (sum + count, squares + count * count));
        let mean = sum / draws as f64;
        let variance = squares / draws as f64 - mean * mean;
        let expected = BLOCK as f64 * 1e-3;
        assert!(
            (mean / expected - 1.0).abs() < 1e-3 && (variance / (expected * 0.999) - 1.0).abs() < 1e-3,
            "{mean} {variance}"
        );
    }
}
