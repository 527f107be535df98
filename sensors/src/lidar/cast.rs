//! The ray cast: finds the face that each sub-ray hits first.
//!
//! A face is given by the vector m of [`targets`](super::targets), a direction by the vector d. The
//! eight sub-rays of a beam lie side by side in the lanes of vector registers, and the product m·d
//! takes three multiplications and two additions for all of them.
//!
//! The columns and layers that can hit a solid follow from its bounds, and only these are tried.
//! `by_brute_force` tries all of them, and a property test requires the same result to the bit.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u32x8};

use super::pattern::{Column, Elevation, SUBRAY_COLUMNS, SUBRAY_ROWS, SUBRAYS};
use super::targets::{FaceRange, LayerMask, Part, Targets, layers_below};

/// The face index of a sub-ray that hits nothing.
pub(crate) const NO_FACE: u32 = u32::MAX;

/// The first hits of the sub-rays of a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BeamHits {
    /// Inverse of the horizontal distance of each hit (1/m), or 0 if the sub-ray hits nothing.
    /// Sub-rays of the same height, whose ranges are most alike, have successive indices.
    pub(crate) inverse: [f32; SUBRAYS],
    /// Index of the face that each sub-ray hits, or [`NO_FACE`].
    pub(crate) face: [u32; SUBRAYS],
}

impl BeamHits {
    pub(crate) const NONE: Self = Self { inverse: [0.0; SUBRAYS], face: [NO_FACE; SUBRAYS] };
}

/// The first hits of the beams of a column.
#[derive(Clone, Debug, Default)]
pub(crate) struct ColumnHits {
    /// First hits of the beam of each layer.
    pub(crate) beams: Vec<BeamHits>,
    /// Bit mask of the layers that were tested against at least one solid.
    pub(crate) tested: LayerMask,
    /// Number of layers, counted from the lowest, that may receive a return from the road.
    pub(crate) ground_below: usize,
    /// Bit mask of those layers whose returns from the bare road are left out.
    pub(crate) bare: LayerMask,
}

impl ColumnHits {
    /// Returns the hits of a column with this number of layers, before the first cast.
    pub(crate) fn new(layers: usize) -> Self {
        Self { beams: vec![BeamHits::NONE; layers], ..Self::default() }
    }

    /// Resets the hits for the next column.
    pub(crate) fn clear(&mut self) {
        while self.tested != 0 {
            self.beams[self.tested.trailing_zeros() as usize] = BeamHits::NONE;
            self.tested &= self.tested - 1;
        }
        self.ground_below = 0;
        self.bare = 0;
    }

    /// Returns true if this layer was tested against at least one solid.
    pub(crate) fn is_tested(&self, layer: usize) -> bool {
        self.tested >> layer & 1 == 1
    }

    /// Returns a bit mask of the layers that may receive a return from a solid or from the road
    /// that must not be left out.
    pub(crate) fn need_echoes(&self) -> LayerMask {
        self.tested | layers_below(self.ground_below) & !self.bare
    }

    /// Intersects the beams of a column with a solid, in those layers that are `wanted` (a bit
    /// mask).
    #[inline(always)]
    pub(crate) fn cast<S: Simd>(
        &mut self,
        simd: S,
        (column, elevations): (&Column, &[Elevation]),
        (part, wanted): (&Part, LayerMask),
        targets: &Targets,
    ) {
        let mut layers = part.layers & wanted;
        while layers != 0 {
            let layer = layers.trailing_zeros() as usize;
            self.intersect(layer, &SubRays::new(simd, column, &elevations[layer]), part.faces, targets);
            layers &= layers - 1;
        }
    }

    /// Intersects the beam of a layer with a solid.
    #[inline(always)]
    pub(crate) fn intersect<S: Simd>(
        &mut self,
        layer: usize,
        subrays: &SubRays<S>,
        faces: FaceRange,
        targets: &Targets,
    ) {
        subrays.intersect(faces, targets, &mut self.beams[layer]);
        self.tested |= 1 << layer;
    }
}

/// The directions of the sub-rays of a beam, in the lanes of vector registers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubRays<S: Simd> {
    simd: S,
    /// Cosines of the azimuths.
    cos: f32x8<S>,
    /// Sines of the azimuths.
    sin: f32x8<S>,
    /// Tangents of the elevations.
    tan: f32x8<S>,
}

/// Spreads the values of the sub-rays' columns over the lanes.
#[inline(always)]
fn spread_columns<S: Simd>(simd: S, [a, b]: [f32; SUBRAY_COLUMNS]) -> f32x8<S> {
    f32x8::load_array(simd, [a, b, a, b, a, b, a, b])
}

/// Spreads the values of the sub-rays' rows over the lanes.
#[inline(always)]
pub(crate) fn spread_rows<S: Simd>(simd: S, [a, b, c, d]: [f32; SUBRAY_ROWS]) -> f32x8<S> {
    f32x8::load_array(simd, [a, a, b, b, c, c, d, d])
}

impl<S: Simd> SubRays<S> {
    /// Returns the directions of the beam of a layer.
    #[inline(always)]
    pub(crate) fn new(simd: S, column: &Column, elevation: &Elevation) -> Self {
        let group = elevation.group;
        Self {
            simd,
            cos: spread_columns(simd, column.cos[group]),
            sin: spread_columns(simd, column.sin[group]),
            tan: spread_rows(simd, elevation.tan),
        }
    }

    /// Returns the inverse horizontal distance m·d at which each sub-ray meets the plane of a face
    /// (1/m).
    #[inline(always)]
    fn inverse_distances(&self, [x, y, z]: [f32; 3]) -> f32x8<S> {
        self.cos * x + self.sin * y + self.tan * z
    }

    /// Replaces the hits of those sub-rays that meet this solid at a shorter distance. At equal
    /// distance the earlier hit stays.
    #[inline(always)]
    fn intersect(&self, faces: FaceRange, targets: &Targets, hits: &mut BeamHits) {
        let mut nearest = f32x8::splat(self.simd, f32::INFINITY);
        let mut nearest_face = u32x8::splat(self.simd, NO_FACE);
        for (face, index) in targets.faces[faces.front_facing()].iter().zip(faces.first..) {
            let planes = self.inverse_distances(face.inverse);
            nearest_face = planes.simd_lt(nearest).select(u32x8::splat(self.simd, index), nearest_face);
            nearest = planes.min(nearest);
        }
        let mut entered_after = f32x8::splat(self.simd, 0.0);
        for face in &targets.faces[faces.back_facing()] {
            entered_after = self.inverse_distances(face.inverse).max(entered_after);
        }
        let earlier = f32x8::load_array_ref(self.simd, &hits.inverse);
        let is_hit = nearest.simd_gt(entered_after) & nearest.simd_gt(earlier);
        is_hit.select(nearest, earlier).store_array(&mut hits.inverse);
        let face = u32x8::load_array_ref(self.simd, &hits.face);
        is_hit.select(nearest_face, face).store_array(&mut hits.face);
    }
}

/// The solids whose bounds contain the current column of a sweep over all columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct ActiveParts {
    /// Indices of all parts, in order of their first column, then of their index.
    queue: Vec<usize>,
    next: usize,
    parts: Vec<usize>,
    /// Column from which on other parts are active.
    change: usize,
    /// Bit mask of the layers that may hit an active part that is none of a guard rail.
    solid_layers: LayerMask,
    /// Whether an active part is one of a guard rail.
    has_rails: bool,
}

impl ActiveParts {
    /// Starts a sweep at column 0.
    pub(crate) fn start(&mut self, targets: &Targets) {
        self.queue.clear();
        self.queue.extend(0..targets.parts.len());
        self.queue.sort_unstable_by_key(|&part| (targets.parts[part].columns.start, part));
        self.next = 0;
        self.parts.clear();
        self.change = 0;
    }

    /// Returns the active parts, in order of their index.
    pub(crate) fn parts(&self) -> &[usize] {
        &self.parts
    }

    /// Returns a bit mask of the layers that may hit an active part that is none of a guard rail.
    pub(crate) fn solid_layers(&self) -> LayerMask {
        self.solid_layers
    }

    /// Returns whether an active part is one of a guard rail.
    pub(crate) fn has_rails(&self) -> bool {
        self.has_rails
    }

    /// Returns the column up to which no part is active, as of the latest column.
    pub(crate) fn idle_until(&self) -> usize {
        if self.parts.is_empty() { self.change } else { 0 }
    }

    /// Advances to `column`: the active parts are then those whose bounds contain it.
    pub(crate) fn advance_to(&mut self, column: usize, targets: &Targets) {
        if column < self.change {
            return;
        }
        self.parts.retain(|&part| targets.parts[part].columns.end > column);
        while let Some(&part) = self.queue.get(self.next)
            && targets.parts[part].columns.start <= column
        {
            let position = self.parts.partition_point(|&other| other < part);
            self.parts.insert(position, part);
            self.next += 1;
        }
        self.change = self.queue.get(self.next).map_or(usize::MAX, |&part| targets.parts[part].columns.start);
        (self.solid_layers, self.has_rails) = (0, false);
        for part in self.parts.iter().map(|&part| &targets.parts[part]) {
            self.change = self.change.min(part.columns.end);
            self.has_rails |= part.is_guard_rail;
            self.solid_layers |= if part.is_guard_rail { 0 } else { part.layers };
        }
    }
}

/// Returns the hits of a column, with every beam tested against every solid regardless of its
/// bounds.
#[cfg(test)]
pub(crate) fn by_brute_force(column: &Column, elevations: &[Elevation], targets: &Targets) -> ColumnHits {
    let mut hits = ColumnHits::new(elevations.len());
    for part in &targets.parts {
        let part = Part { columns: 0..usize::MAX, layers: layers_below(elevations.len()), ..*part };
        let part_and_mask = (&part, LayerMask::MAX);
        fearless_simd::dispatch!(fearless_simd::Level::baseline(), simd => hits.cast(simd, (column, elevations), part_and_mask, targets));
    }
    hits
}
