//! The ground at the four moments of a pixel at once: the steps of [`Ground::radiance`], with the
//! same bits.

use wide::f32x4;

use super::{
    ASPHALT, ASPHALT_KEY, BEAM_M, CONTACT_SHADOW_M, DARKEST, DASH_EVERY_M, DASH_M, DASHES_MERGE_M, EDGE_LINE_HALF_M,
    GRAIN_TO_M, GRASS, GRASS_KEY, Ground, GroundLanes, GroundLight, LANE_LINE_HALF_M, LEAST_SUN, LONGEST_SHADOW_M,
    PAINT, Patch, PatchKind, SHOULDER_M,
};
use crate::camera::lanes::{PlaneNoise, Radiance, none, split};
use crate::camera::light::Illumination;

/// Values that the pixels of one row share, by moment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GroundRow {
    /// Position along the axis of the lens (m), and distance that the ego has moved along s (m).
    x: f32x4,
    travelled_m: f32x4,
    /// Share of the texture that the distance from the lens leaves.
    detail: f32x4,
    /// Whether the grain of the asphalt shows.
    has_grain: f32x4,
    /// Share of the sky's light that the road mirrors.
    gloss: f32x4,
    /// How far the dashes have merged.
    merged: f32x4,
}

/// The noise of grass and asphalt, with its latest cells.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GroundNoise {
    grass: PlaneNoise,
    grain: PlaneNoise,
    wear: PlaneNoise,
}

/// The visible shares of sky and sun, and the added light of headlamps.
struct PatchLight {
    sky: f32x4,
    sun: f32x4,
    beam: f32x4,
}

#[inline]
fn splat(value: f32) -> f32x4 {
    f32x4::splat(value)
}

impl GroundRow {
    /// Prepares a row whose samples lie at `x` (m), by moment, after the ego has moved by
    /// `travelled_m`.
    pub(crate) fn new(x: [f32; 4], travelled_m: [f32; 4], light: &Illumination) -> Self {
        let run_m = -f32x4::from(x);
        let merging_m = DASHES_MERGE_M[1] - DASHES_MERGE_M[0];
        Self {
            x: x.into(),
            travelled_m: travelled_m.into(),
            detail: splat(1.0) / (splat(1.0) + run_m * run_m / splat(400.0)),
            has_grain: run_m.simd_lt(splat(GRAIN_TO_M)),
            gloss: splat(light.wetness) * (run_m / (run_m + splat(25.0))) * splat(0.55),
            merged: ((run_m - splat(DASHES_MERGE_M[0])) / splat(merging_m)).max(splat(0.0)).min(splat(1.0)),
        }
    }
}

impl Ground {
    /// Returns the radiance of the ground at the points (x, y) of a row, by moment. Returns `None`
    /// if some of them are on the road and others beside it.
    #[inline]
    pub(crate) fn radiances(
        &self,
        row: &GroundRow,
        y: f32x4,
        lit: &GroundLight<'_>,
        noise: &mut GroundNoise,
    ) -> Option<Radiance> {
        let light = lit.light;
        let (s, d) = self.road_positions(row.x, y);
        let s = s + row.travelled_m;
        let (albedo, gloss) = self.albedos([s, d], row, light.wetness, noise)?;
        let cast = patch_light(lit, [row.x, y]);
        let up = light.to_sun[2].max(0.0);
        let mirrored = light.sky(super::MIRRORED_SLOPE);
        Some(std::array::from_fn(|channel| {
            let illumination = splat(light.ambient[channel]) * cast.sky
                + splat(light.sun[channel] * up) * cast.sun
                + splat(light.beam) * cast.beam;
            albedo[channel] * illumination + gloss * cast.sky * splat(mirrored[channel])
        }))
    }

    /// See [`Ground::road_position`].
    #[inline]
    fn road_positions(&self, x: f32x4, y: f32x4) -> (f32x4, f32x4) {
        let along = splat(self.cos) * x - splat(self.sin) * y;
        let across = splat(self.d_m) + splat(self.sin) * x + splat(self.cos) * y;
        if let Some(course) = &self.course {
            let (along, left) = (along.to_array(), (across - splat(self.d_m)).to_array());
            let at: [[f32; 2]; 4] = std::array::from_fn(|moment| course.position_m(along[moment], left[moment]));
            return (splat(self.s_m) + f32x4::from(at.map(|at| at[0])), f32x4::from(at.map(|at| at[1])));
        }
        if self.curvature_per_m == 0.0 {
            return (splat(self.s_m) + along, across);
        }
        let (k, one) = (splat(self.curvature_per_m), splat(1.0));
        let q = k * (along * along + across * across) - splat(2.0) * across;
        let d = -q / (one + (one + k * q).max(splat(0.0)).sqrt());
        let tangent = along / (one - k * across);
        let bend = k * tangent;
        (splat(self.s_m) + tangent * (one - bend * bend / splat(3.0)), d)
    }

    /// See [`Ground::albedo`].
    #[inline]
    fn albedos(
        &self,
        [s, d]: [f32x4; 2],
        row: &GroundRow,
        wetness: f32,
        noise: &mut GroundNoise,
    ) -> Option<(Radiance, f32x4)> {
        let right = self.lanes.right_m();
        let is_beside = d.simd_gt(splat(SHOULDER_M[0])) | d.simd_lt(splat(right - SHOULDER_M[1]));
        if is_beside.all() {
            let texture = noise.grass.at(GRASS_KEY, splat(0.7) * s, splat(1.3) * d);
            let shade = splat(0.75) + splat(0.5) * texture * (splat(0.3) + splat(0.7) * row.detail);
            return Some((GRASS.map(|value| splat(value) * shade), splat(0.0)));
        }
        if is_beside.any() {
            return None;
        }
        let dark = splat(1.0 - 0.45 * wetness);
        let mut grain = splat(1.0);
        if row.has_grain.any() {
            let texture = noise.grain.at(ASPHALT_KEY, splat(9.0) * s, splat(9.0) * d);
            let grained = splat(1.0) + splat(0.35) * (texture - splat(0.5)) * row.detail;
            grain = row.has_grain.select(grained, grain);
        }
        let wear = splat(1.0) - splat(0.12) * noise.wear.at(ASPHALT_KEY, splat(0.05) * s, splat(0.8) * d);
        let painted = self.paint_shares(s, d, row);
        let albedo =
            std::array::from_fn(|i| (splat(ASPHALT[i]) + splat(PAINT[i] - ASPHALT[i]) * painted) * grain * wear * dark);
        Some((albedo, row.gloss))
    }

    /// See [`Ground::paint_share`].
    #[inline]
    fn paint_shares(&self, s: f32x4, d: f32x4, row: &GroundRow) -> f32x4 {
        let [none_of_it, whole] = [splat(0.0), splat(1.0)];
        let (off, is_edge) = self.lanes.nearest_markings(s - splat(self.s_m), d);
        let is_near = off.simd_lt(splat(EDGE_LINE_HALF_M));
        if none(is_near) {
            return none_of_it;
        }
        let phase = split(s / splat(DASH_EVERY_M)).1 * splat(DASH_EVERY_M);
        let dash = phase.simd_lt(splat(DASH_M)).select(whole, none_of_it);
        let dashes = dash + (splat(DASH_M / DASH_EVERY_M) - dash) * row.merged;
        let of_lane = off.simd_ge(splat(LANE_LINE_HALF_M)).select(none_of_it, dashes);
        is_edge.select(is_near.select(whole, none_of_it), of_lane)
    }
}

impl GroundLanes {
    /// See [`GroundLanes::nearest_marking`].
    #[inline]
    fn nearest_markings(&self, ahead: f32x4, d: f32x4) -> (f32x4, f32x4) {
        match self {
            Self::Equal { width_m, lanes } => {
                let (first, last) = (splat(0.0), splat(*lanes));
                let line = split(-d / splat(*width_m) + splat(0.5)).0.round_float();
                let line = line.max(first).min(last);
                let off = (d + line * splat(*width_m)).abs();
                (off, line.simd_eq(first) | line.simd_eq(last))
            }
            Self::Each { markings_m, last } => {
                let [no, yes] = [splat(0.0), splat(0.0).simd_eq(splat(0.0))];
                let mut nearest = (splat(f32::INFINITY), no);
                for (number, marking_m) in markings_m[..=*last].iter().enumerate() {
                    let off = (d - splat(*marking_m)).abs();
                    let is_nearer = off.simd_lt(nearest.0);
                    let is_edge = if number == 0 || number == *last { yes } else { no };
                    nearest = (is_nearer.select(off, nearest.0), is_nearer.select(is_edge, nearest.1));
                }
                nearest
            }
            Self::Along { .. } => {
                let (ahead, d) = (ahead.to_array(), d.to_array());
                let at: [(f32, bool); 4] = std::array::from_fn(|moment| self.nearest_marking(ahead[moment], d[moment]));
                let is_edge = f32x4::from(at.map(|(_, is_edge)| f32::from(u8::from(is_edge))));
                (f32x4::from(at.map(|(off, _)| off)), is_edge.simd_eq(splat(1.0)))
            }
        }
    }
}

/// See [`super::patch_light`].
#[inline]
fn patch_light(lit: &GroundLight<'_>, at: [f32x4; 2]) -> PatchLight {
    let light = lit.light;
    let mut cast = PatchLight { sky: splat(1.0), sun: splat(1.0), beam: splat(0.0) };
    for (bounds, patch) in lit.patches {
        if lit.left_px > bounds[2] || lit.left_px + 1.0 < bounds[0] {
            continue;
        }
        let [cos, sin] = patch.turn.map(splat);
        let (dx, dy) = (at[0] - splat(patch.at[0]), at[1] - splat(patch.at[1]));
        let (along, left) = (cos * dx + sin * dy, cos * dy - sin * dx);
        match patch.kind {
            PatchKind::Shadow => {
                cast.sky *= contact(patch, along, left);
                if light.sun[0] > 0.0 {
                    cast.sun = in_sun_shadow(patch, [along, left], light.to_sun).select(splat(0.0), cast.sun);
                }
            }
            PatchKind::Beam => cast.beam += headlamp_beam(along - splat(patch.extent[0]), left),
        }
    }
    cast
}

/// See [`super::contact`].
#[inline]
fn contact(patch: &Patch, along: f32x4, left: f32x4) -> f32x4 {
    let outside = (along.abs() - splat(patch.extent[0])).max(left.abs() - splat(patch.extent[1])).max(splat(0.0));
    let open = (outside / splat(CONTACT_SHADOW_M)).min(splat(1.0));
    splat(DARKEST) + splat(1.0 - DARKEST) * open * (splat(2.0) - open)
}

/// See [`super::in_sun_shadow`].
#[inline]
fn in_sun_shadow(patch: &Patch, [along, left]: [f32x4; 2], to_sun: [f32; 3]) -> f32x4 {
    let reach = (patch.extent[2] / to_sun[2].max(LEAST_SUN)).min(LONGEST_SHADOW_M);
    let (mut from, mut to) = (splat(0.0), splat(reach));
    for (start, (rate, half)) in [along, left].into_iter().zip(super::ways(patch, to_sun)) {
        let [low, high] = [-half, half].map(|half| (splat(half) - start) / splat(rate));
        from = from.max(low.min(high));
        to = to.min(low.max(high));
    }
    from.simd_lt(to)
}

/// See [`super::headlamp_beam`].
#[inline]
fn headlamp_beam(ahead: f32x4, left: f32x4) -> f32x4 {
    let [far, wide] = BEAM_M.map(splat);
    let (zero, one) = (splat(0.0), splat(1.0));
    let half = (splat(1.5) + splat(0.15) * ahead).min(wide);
    let across = one - (left / half) * (left / half);
    let is_lit = ahead.simd_gt(zero) & ahead.simd_lt(far) & across.simd_gt(zero);
    if none(is_lit) {
        return zero;
    }
    let along = (one - ahead / far) * (one - ahead / far) * ahead / (ahead + splat(3.0));
    is_lit.select(along * across * across, zero)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::Road;

    use super::super::PLACE_EVERY_M;
    use super::*;

    /// The left lane begins between 20 and 100 m, and the right one becomes wider.
    fn changing() -> Road {
        let sections = [(20.0, -3.0, vec![0.0, 3.5, 3.25]), (100.0, 0.0, vec![3.0, 3.5, 4.0])];
        Road::straight(3).with_cross_sections(&sections)
    }

    #[test]
    fn the_markings_of_lanes_that_change_are_where_the_lanes_are() {
        for (road, lens_m) in [(changing(), 50.0), (changing().reversed(), -50.0)] {
            let lanes = GroundLanes::new(&road, lens_m);
            for index in 0..600_u16 {
                let ahead = 0.5 * (f32::from(index) - 300.0);
                let s_m = lens_m + f64::from(ahead);
                // A kink between two places is rounded off.
                if road.cross_sections_m().any(|kink_m| (kink_m - s_m).abs() < f64::from(PLACE_EVERY_M)) {
                    continue;
                }
                let markings = [0, 1, 2, 3].map(|number| road.full_boundary_m(number, s_m) as f32);
                for marking_m in markings {
                    let (off, is_edge) = lanes.nearest_marking(ahead, marking_m);
                    let at_edge = [markings[0], markings[3]].iter().any(|edge_m| (edge_m - marking_m).abs() < 1e-4);
                    assert!(off < 1e-3 && is_edge == at_edge, "{marking_m} at {ahead}: {off} {is_edge}");
                }
            }
            let ahead: [f32; 4] = [-31.0, -7.5, 20.0, 49.0];
            for index in 0..300_u16 {
                let d: [f32; 4] = std::array::from_fn(|moment| 2.0 - 0.05 * f32::from(index) - 0.013 * moment as f32);
                let (off, is_edge) = lanes.nearest_markings(ahead.into(), d.into());
                let is_edge = is_edge.select(splat(1.0), splat(0.0)).to_array();
                for moment in 0..4 {
                    let expected = lanes.nearest_marking(ahead[moment], d[moment]);
                    assert_eq!((off.to_array()[moment], is_edge[moment] == 1.0), expected, "{ahead:?} {d:?}");
                }
            }
        }
    }

    #[test]
    fn the_markings_at_four_moments_are_the_markings_at_each() {
        for widths_m in [&[3.75, 3.75, 3.75][..], &[3.25, 3.5, 4.0], &[2.5, 5.0]] {
            let lanes = GroundLanes::new(&Road::straight(1).with_lane_widths(widths_m), 0.0);
            for index in 0..300_u16 {
                let d: [f32; 4] = std::array::from_fn(|moment| 2.0 - 0.05 * f32::from(index) - 0.013 * moment as f32);
                let (off, is_edge) = lanes.nearest_markings(splat(0.0), d.into());
                let is_edge = is_edge.select(splat(1.0), splat(0.0)).to_array();
                for (moment, d) in d.into_iter().enumerate() {
                    let (expected, at_edge) = lanes.nearest_marking(0.0, d);
                    assert_eq!(
                        (off.to_array()[moment], is_edge[moment] == 1.0),
                        (expected, at_edge),
                        "{widths_m:?} {d}"
                    );
                }
            }
        }
    }
}
