//! Echoes: the pulses that the receiver can distinguish along a beam.
//!
//! Sub-rays that end within the length of one pulse add up to one echo. Its power is the sum of
//! their contributions. A beam that is split by an edge, or spread over the road at a grazing
//! angle, gives several weaker echoes.

use std::ops::Mul;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};

use super::cast::{BeamHits, spread_rows};
use super::pattern::{Elevation, SUBRAY_COLUMNS, SUBRAY_ROWS, SUBRAYS};
use super::power::LinkBudget;
use super::targets::Face;

/// Length of a pulse in range, c·τ/2 (m), for a duration τ of about 5 ns.
pub(crate) const PULSE_M: f32 = 0.75;
/// Share of a sub-ray in the footprint.
const SHARE: f32 = 1.0 / SUBRAYS as f32;

/// An echo of a beam.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Echo {
    /// Mean distance of its sub-rays, weighted by power (m).
    pub(crate) range_m: f32,
    /// Received power without the air's attenuation, in multiples of the detection threshold.
    pub(crate) power: f32,
    /// Index of the face that contributes the strongest sub-ray.
    pub(crate) face: u32,
}

impl Echo {
    /// Returns an echo of this power and moment, the sum of powers times ranges (thresholds · m).
    /// The strongest contribution gives the face, and the range of an echo without power.
    #[inline(always)]
    fn of_sums(power: f32, moment: f32, strongest_m: f32, face: u32) -> Self {
        Self { range_m: if power > 0.0 { moment / power } else { strongest_m }, power, face }
    }
}

/// The echoes of a beam, in order of range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Echoes {
    list: [Echo; SUBRAYS],
    count: usize,
}

impl Echoes {
    pub(crate) const NONE: Self = Self { list: [Echo { range_m: 0.0, power: 0.0, face: 0 }; SUBRAYS], count: 0 };

    pub(crate) fn as_slice(&self) -> &[Echo] {
        &self.list[..self.count]
    }

    /// Removes all echoes.
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Replaces the echoes by the echoes of the faces that the sub-rays hit.
    #[inline(always)]
    pub(crate) fn set<S: Simd>(
        &mut self,
        simd: S,
        (hits, elevation): (&BeamHits, &Elevation),
        faces: &[Face],
        link: &LinkBudget,
    ) {
        self.count = 0;
        let inverse = f32x8::load_array_ref(simd, &hits.inverse);
        let is_hit = inverse.simd_gt(f32x8::splat(simd, 0.0)).to_bitmask() as u8;
        if is_hit == 0 {
            return;
        }
        // A sub-ray that hits nothing has the strength of some face, but no inverse range, and so
        // no power. Usually all others hit the same face.
        let first = hits.face[is_hit.trailing_zeros() as usize];
        let met = u32x8::load_array_ref(simd, &hits.face);
        let strength_m = match met.simd_eq(u32x8::splat(simd, first)).to_bitmask() as u8 & is_hit == is_hit {
            true => f32x8::splat(simd, faces[first as usize].strength_m),
            false => {
                let last = faces.len() - 1;
                f32x8::load_array(simd, hits.face.map(|face| faces[last.min(face as usize)].strength_m))
            }
        };
        let per_range = inverse * spread_rows(simd, elevation.cos);
        let range_m = f32x8::splat(simd, 1.0) / per_range;
        let power = received_power(per_range, strength_m * (SHARE * link.gain_m2));
        // A sub-ray that hits nothing has an infinite range, and no power.
        let zero = f32x8::splat(simd, 0.0);
        let reached_m = range_m.simd_lt(f32x8::splat(simd, f32::INFINITY)).select(range_m, zero);
        let (nearest_m, farthest_m) = (range_m.reduce_min(), reached_m.reduce_max());
        // Usually all sub-rays end within one pulse. A sub-ray that hits nothing adds nothing to
        // the sums.
        if farthest_m <= nearest_m + PULSE_M {
            if farthest_m > 0.0 {
                let is_strongest = power.simd_eq(power.reduce_max()) & reached_m.simd_gt(zero);
                let strongest = SUBRAYS - 1 - (is_strongest.to_bitmask() as u8).leading_zeros() as usize;
                let (moment, power) = ((power * reached_m).to_array(), power.to_array());
                let sum = |values: [f32; SUBRAYS]| values.into_iter().fold(0.0, |sum, value| sum + value);
                let strongest_m = reached_m.to_array()[strongest];
                self.list[0] = Echo::of_sums(sum(power), sum(moment), strongest_m, hits.face[strongest]);
                self.count = 1;
            }
            return;
        }
        let (reached_m, power) = (reached_m.to_array(), power.to_array());
        for subray in (0..SUBRAYS).filter(|&subray| reached_m[subray] > 0.0) {
            self.insert(Echo { range_m: reached_m[subray], power: power[subray], face: hits.face[subray] });
        }
        self.merge();
    }

    /// Replaces the echoes by the echoes of a beam that hits only the road, which is face 0.
    ///
    /// The two columns of sub-rays count as equal. A higher sub-ray hits the road farther away, so
    /// the echoes are already in order of range.
    pub(crate) fn set_ground(&mut self, [cos, sin]: [f32; 2], elevation: &Elevation, ground: &Face, link: &LinkBudget) {
        let strength = SUBRAY_COLUMNS as f32 * SHARE * link.gain_m2 * ground.strength_m;
        let level = ground.inverse[0] * cos + ground.inverse[1] * sin;
        self.count = 0;
        for upward in 0..SUBRAY_ROWS {
            let inverse = level + ground.inverse[2] * elevation.tan[upward];
            if !(inverse > 0.0) {
                break;
            }
            let per_range = inverse * elevation.cos[upward];
            self.list[upward] = Echo { range_m: 1.0 / per_range, power: received_power(per_range, strength), face: 0 };
            self.count = upward + 1;
        }
        self.merge();
    }

    /// Inserts an echo in order of range. There are at most eight, and they mostly arrive in order.
    #[inline(always)]
    fn insert(&mut self, echo: Echo) {
        let mut index = self.count;
        while index > 0 && self.list[index - 1].range_m > echo.range_m {
            self.list[index] = self.list[index - 1];
            index -= 1;
        }
        self.list[index] = echo;
        self.count += 1;
    }

    /// Merges each echo with the echoes that follow it within the length of one pulse.
    #[inline(always)]
    fn merge(&mut self) {
        let (mut from, mut echoes) = (0, 0);
        while from < self.count {
            let end_m = self.list[from].range_m + PULSE_M;
            let within = self.list[from..self.count].iter().take_while(|echo| echo.range_m <= end_m).count();
            self.list[echoes] = sum(self.list[from..from + within].iter().copied());
            echoes += 1;
            from += within;
        }
        self.count = echoes;
    }
}

/// Returns the variances of the range within the echoes of a beam (m²), in the order in which
/// [`Echoes::set`] gives them: the mean square distance of the sub-rays from their mean range,
/// weighted by power.
pub(crate) fn range_variances_m2((hits, elevation): (&BeamHits, &Elevation), faces: &[Face]) -> [f32; SUBRAYS] {
    let mut parts = [(0.0, 0.0); SUBRAYS];
    let mut count = 0;
    for subray in (0..SUBRAYS).filter(|&subray| hits.inverse[subray] > 0.0) {
        let per_range = hits.inverse[subray] * elevation.cos[subray / SUBRAY_COLUMNS];
        parts[count] = (1.0 / per_range, received_power(per_range, faces[hits.face[subray] as usize].strength_m));
        count += 1;
    }
    variances_m2(&mut parts[..count])
}

/// Returns the variances of the range within the echoes of a beam that hits only the road (m²), in
/// the order in which [`Echoes::set_ground`] gives them.
pub(crate) fn ground_range_variances_m2([cos, sin]: [f32; 2], elevation: &Elevation, ground: &Face) -> [f32; SUBRAYS] {
    let level = ground.inverse[0] * cos + ground.inverse[1] * sin;
    let mut parts = [(0.0, 0.0); SUBRAYS];
    let mut count = 0;
    for upward in 0..SUBRAY_ROWS {
        let inverse = level + ground.inverse[2] * elevation.tan[upward];
        if !(inverse > 0.0) {
            break;
        }
        let per_range = inverse * elevation.cos[upward];
        parts[count] = (1.0 / per_range, received_power(per_range, ground.strength_m));
        count += 1;
    }
    variances_m2(&mut parts[..count])
}

/// Returns the variances of the range within the echoes that sub-rays of these ranges (m) and
/// powers give (m²).
fn variances_m2(parts: &mut [(f32, f32)]) -> [f32; SUBRAYS] {
    parts.sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
    let mut variances_m2 = [0.0; SUBRAYS];
    let mut from = 0;
    for variance_m2 in &mut variances_m2 {
        let Some(&(nearest_m, _)) = parts.get(from) else { break };
        let within = parts[from..].iter().take_while(|part| part.0 <= nearest_m + PULSE_M).count();
        *variance_m2 = variance_of_m2(&parts[from..from + within]);
        from += within;
    }
    variances_m2
}

/// Returns the variance of ranges (m) that are weighted by power (m²).
fn variance_of_m2(parts: &[(f32, f32)]) -> f32 {
    let weighted =
        |value: &dyn Fn(f32) -> f32| -> f32 { parts.iter().map(|&(range_m, power)| power * value(range_m)).sum() };
    let power = weighted(&|_| 1.0);
    if !(power > 0.0) {
        return 0.0;
    }
    let mean_m = weighted(&|range_m| range_m) / power;
    weighted(&|range_m| (range_m - mean_m) * (range_m - mean_m)) / power
}

/// Returns the sum of several echoes as one echo. One without a range adds nothing.
#[inline(always)]
fn sum(parts: impl Iterator<Item = Echo>) -> Echo {
    let (mut power, mut moment, mut strongest) = (0.0, 0.0, Echo::default());
    for part in parts {
        power += part.power;
        moment += part.power * part.range_m;
        if (part.power >= strongest.power) & (part.range_m > 0.0) {
            strongest = part;
        }
    }
    Echo::of_sums(power, moment, strongest.range_m, strongest.face)
}

/// Returns the power that is received from sub-rays at the inverse range `per_range` (1/m).
///
/// It is `strength` (thresholds · m³) over the third power of the range: two powers for the
/// spreading of the light, and one because cos γ is the distance of the face's plane over the
/// range.
#[inline(always)]
fn received_power<T: Copy + Mul<Output = T>>(per_range: T, strength: T) -> T {
    strength * per_range * per_range * per_range
}

#[cfg(test)]
mod tests {
    use super::super::{Lidar, Material, PointSource};
    use super::*;
    use closecall_traffic::Environment;

    fn face(strength_m: f32) -> Face {
        Face { inverse: [0.0; 3], offset_m: 1.0, strength_m, material: Material::Paint, source: PointSource::Actor(0) }
    }

    const LEVEL: Elevation =
        Elevation { group: 0, centre: [0.0, 1.0], tan: [0.0; SUBRAY_ROWS], cos: [1.0; SUBRAY_ROWS] };

    /// Returns hits of a face at these ranges.
    fn hits_at(ranges_m: [Option<f32>; SUBRAYS]) -> BeamHits {
        let mut hits = BeamHits::NONE;
        for (subray, range_m) in ranges_m.into_iter().enumerate() {
            if let Some(range_m) = range_m {
                hits.inverse[subray] = 1.0 / range_m;
                hits.face[subray] = 0;
            }
        }
        hits
    }

    fn echoes(ranges_m: [Option<f32>; SUBRAYS]) -> Vec<(f32, f32)> {
        let hits = hits_at(ranges_m);
        let link = LinkBudget::new(&Lidar::default(), &Environment::CLEAR_DAY);
        // At 10 m each sub-ray contributes 1/8 of gain·ρ·cos γ/R² with ρ·cos γ = 1.
        let mut echoes = Echoes::NONE;
        fearless_simd::dispatch!(fearless_simd::Level::new(), simd => echoes.set(simd, (&hits, &LEVEL), &[face(10.0)], &link));
        let unit = link.gain_m2 / 100.0;
        echoes.as_slice().iter().map(|echo| (echo.range_m, echo.power / unit)).collect()
    }

    #[test]
    fn a_whole_target_gives_one_echo_and_a_split_beam_two() {
        let whole = echoes([Some(10.0); SUBRAYS]);
        assert_eq!(whole.len(), 1);
        assert!((whole[0].0 - 10.0).abs() < 1e-4 && (whole[0].1 - 1.0).abs() < 1e-4, "{whole:?}");
        let (near, far) = (Some(10.0), Some(20.0));
        let split = echoes([far, near, near, None, far, near, None, None]);
        assert_eq!(split.len(), 2);
        assert!((split[0].0 - 10.0).abs() < 1e-4 && (split[0].1 - 0.375).abs() < 1e-4, "{split:?}");
        assert!((split[1].0 - 20.0).abs() < 1e-3 && (split[1].1 - 0.25 / 8.0).abs() < 1e-4, "{split:?}");
        assert!(echoes([None; SUBRAYS]).is_empty());
    }

    /// Returns the variances of the range within the echoes of sub-rays that hit a face at these
    /// ranges (m²).
    fn variances_m2_of(ranges_m: [Option<f32>; SUBRAYS]) -> [f32; SUBRAYS] {
        range_variances_m2((&hits_at(ranges_m), &LEVEL), &[face(10.0)])
    }

    #[test]
    fn the_range_variance_of_a_slanted_plane_is_that_of_evenly_spaced_ranges() {
        // Four rows, 0.1 m apart: n = 4 values with the spacing d have the variance d²·(n² − 1)/12.
        let rows = [50.0, 50.0, 50.1, 50.1, 50.2, 50.2, 50.3, 50.3].map(Some);
        let expected = 0.01 * 15.0 / 12.0;
        let [variance_m2, rest @ ..] = variances_m2_of(rows);
        assert!((variance_m2 / expected - 1.0).abs() < 0.01, "{variance_m2}");
        assert_eq!(rest, [0.0; SUBRAYS - 1]);
        // The rows have 15 sixteenths of the variance of the whole footprint, which is 0.4 m deep.
        assert!((variance_m2 * 16.0 / 15.0 / (0.4 * 0.4 / 12.0) - 1.0).abs() < 0.01);
        assert!(variances_m2_of([Some(50.0); SUBRAYS])[0] < 1e-9);
    }

    #[test]
    fn each_echo_of_a_split_beam_has_the_range_variance_of_its_own_parts() {
        let (near, far) = (Some(20.0), Some(30.0));
        let [first, second, rest @ ..] = variances_m2_of([far, near, Some(20.4), None, far, near, Some(20.4), None]);
        // Two halves, 0.4 m apart: a variance of 0.2².
        assert!((first / 0.04 - 1.0).abs() < 0.01 && second < 1e-9, "{first} {second}");
        assert_eq!(rest, [0.0; SUBRAYS - 2]);
        assert_eq!(variances_m2_of([None; SUBRAYS]), [0.0; SUBRAYS]);
    }

    #[test]
    fn a_beam_on_the_road_has_the_same_range_variance_by_both_ways() {
        // A road 0.6 m below the sensor, in sight of four rows from 12.0 m on.
        let ground = Face { inverse: [0.0, 0.0, -1.0 / 0.6], ..face(0.09) };
        let tan = [-0.05, -0.0498, -0.0496, -0.0494];
        let elevation = Elevation { group: 0, centre: [-0.0497, 1.0], tan, cos: [0.999; SUBRAY_ROWS] };
        let [bare, ..] = ground_range_variances_m2([1.0, 0.0], &elevation, &ground);
        let mut hits = BeamHits::NONE;
        for subray in 0..SUBRAYS {
            (hits.inverse[subray], hits.face[subray]) = (tan[subray / SUBRAY_COLUMNS] / -0.6, 0);
        }
        let [cast, ..] = range_variances_m2((&hits, &elevation), &[ground]);
        assert!(bare > 1e-4 && (bare / cast - 1.0).abs() < 1e-2, "{bare} {cast}");
    }

    #[test]
    fn targets_within_one_pulse_length_give_one_echo() {
        let merged = echoes([10.0, 10.7, 10.2, 10.4, 10.1, 10.3, 10.5, 10.6].map(Some));
        assert_eq!(merged.len(), 1);
        assert!(merged[0].0 > 10.2 && merged[0].0 < 10.4, "{merged:?}");
        let two = echoes([10.0, 10.8, 10.2, 10.4, 10.1, 10.3, 10.5, 10.6].map(Some));
        assert_eq!(two.len(), 2);
    }
}
