//! The ray cast: which face each sub-ray meets first.
//!
//! For one column the directions of all sub-rays of a group share cos φ and sin φ, so that m·d is a constant plus
//! m_z·tan θ: two operations for each of the eight sub-rays of a beam, side by side in vector registers. The columns and
//! layers that a solid can touch are found beforehand from its bounds; [`by_brute_force`] tries everything instead, and
//! a property test holds the two to the same bits.

use super::pattern::{Column, Elevation, LAYERS, LAYERS_PER_GROUP, SUBRAY_COLUMNS, SUBRAY_ROWS, SUBRAYS};
use super::targets::{FaceRange, Part, Targets};

/// No face was met.
pub(crate) const NO_FACE: u32 = u32::MAX;

/// What the sub-rays of one beam meet first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BeamHits {
    /// Inverse of the horizontal distance (1/m), 0 where nothing is met.
    pub(crate) inverse: [f32; SUBRAYS],
    /// The face, as an index; [`NO_FACE`] where nothing is met.
    pub(crate) face: [u32; SUBRAYS],
}

impl BeamHits {
    pub(crate) const NONE: Self = Self { inverse: [0.0; SUBRAYS], face: [NO_FACE; SUBRAYS] };
}

/// What the beams of one column meet first.
#[derive(Clone, Debug)]
pub(crate) struct ColumnHits {
    pub(crate) beams: [BeamHits; LAYERS],
    /// The layers that some solid may have met, as bits.
    pub(crate) touched: u16,
    /// The layers that may see the road: all below this one.
    pub(crate) ground_below: usize,
}

impl Default for ColumnHits {
    fn default() -> Self {
        Self { beams: [BeamHits::NONE; LAYERS], touched: 0, ground_below: 0 }
    }
}

impl ColumnHits {
    /// Forgets the previous column.
    pub(crate) fn clear(&mut self) {
        for layer in 0..LAYERS {
            if self.is_touched(layer) {
                self.beams[layer] = BeamHits::NONE;
            }
        }
        self.touched = 0;
        self.ground_below = 0;
    }

    /// True where some solid may have met the beam of this layer.
    pub(crate) fn is_touched(&self, layer: usize) -> bool {
        self.touched >> layer & 1 == 1
    }

    /// Lets the beams of a column meet one solid.
    pub(crate) fn cast(&mut self, column: &Column, elevations: &[Elevation], part: &Part, targets: &Targets) {
        for layer in part.layers.clone() {
            let group = layer / LAYERS_PER_GROUP;
            let subrays = SubRays { cos: column.cos[group], sin: column.sin[group], tan: elevations[layer].tan };
            self.intersect(layer, &subrays, part.faces, targets);
        }
    }

    /// Lets the beam of one layer meet one solid.
    #[inline]
    pub(crate) fn intersect(&mut self, layer: usize, subrays: &SubRays, faces: FaceRange, targets: &Targets) {
        subrays.intersect(faces, targets, &mut self.beams[layer]);
        self.touched |= 1 << layer;
    }
}

/// Which sub-ray a lane is: across and upward. Neighbours in range are neighbours in the lanes.
#[inline(always)]
pub(crate) const fn subray_position(subray: usize) -> (usize, usize) {
    (subray % SUBRAY_COLUMNS, subray / SUBRAY_COLUMNS)
}

/// The sub-rays of one beam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubRays {
    pub(crate) cos: [f32; SUBRAY_COLUMNS],
    pub(crate) sin: [f32; SUBRAY_COLUMNS],
    pub(crate) tan: [f32; SUBRAY_ROWS],
}

impl SubRays {
    /// m·d of each sub-ray.
    #[inline(always)]
    pub(crate) fn inverse_distances(&self, inverse: [f32; 3]) -> [f32; SUBRAYS] {
        let horizontal: [f32; SUBRAY_COLUMNS] =
            std::array::from_fn(|across| inverse[0] * self.cos[across] + inverse[1] * self.sin[across]);
        std::array::from_fn(|subray| {
            let (across, upward) = subray_position(subray);
            horizontal[across] + inverse[2] * self.tan[upward]
        })
    }

    /// Keeps in `hits` what is nearer: what was met before, or this solid. Where both are equally near, the former.
    #[inline(always)]
    fn intersect(&self, faces: FaceRange, targets: &Targets, hits: &mut BeamHits) {
        let mut nearest = [f32::INFINITY; SUBRAYS];
        let mut nearest_face = [NO_FACE; SUBRAYS];
        for (face, index) in targets.faces[faces.front_facing()].iter().zip(faces.first..) {
            let planes = self.inverse_distances(face.inverse);
            for subray in 0..SUBRAYS {
                nearest_face[subray] = if planes[subray] < nearest[subray] { index } else { nearest_face[subray] };
                nearest[subray] = if planes[subray] < nearest[subray] { planes[subray] } else { nearest[subray] };
            }
        }
        let mut entered_after = [0.0_f32; SUBRAYS];
        for face in &targets.faces[faces.back_facing()] {
            let planes = self.inverse_distances(face.inverse);
            for subray in 0..SUBRAYS {
                entered_after[subray] =
                    if planes[subray] > entered_after[subray] { planes[subray] } else { entered_after[subray] };
            }
        }
        for subray in 0..SUBRAYS {
            let is_nearer = nearest[subray] > entered_after[subray] && nearest[subray] > hits.inverse[subray];
            hits.inverse[subray] = if is_nearer { nearest[subray] } else { hits.inverse[subray] };
            hits.face[subray] = if is_nearer { nearest_face[subray] } else { hits.face[subray] };
        }
    }
}

/// The parts that a sweep over the columns has to try at each of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct ActiveParts {
    /// Parts in order of their first column, then of their index.
    queue: Vec<usize>,
    next: usize,
    parts: Vec<usize>,
}

impl ActiveParts {
    /// Starts a sweep.
    pub(crate) fn start(&mut self, targets: &Targets) {
        self.queue.clear();
        self.queue.extend(0..targets.parts.len());
        self.queue.sort_unstable_by_key(|&part| (targets.parts[part].columns.start, part));
        self.next = 0;
        self.parts.clear();
    }

    /// The parts for the next column, in order of their index.
    pub(crate) fn advance_to(&mut self, column: usize, targets: &Targets) -> &[usize] {
        self.parts.retain(|&part| targets.parts[part].columns.end > column);
        while let Some(&part) = self.queue.get(self.next)
            && targets.parts[part].columns.start <= column
        {
            let position = self.parts.partition_point(|&other| other < part);
            self.parts.insert(position, part);
            self.next += 1;
        }
        &self.parts
    }
}

/// The same for every beam and every solid, whatever the bounds say.
#[cfg(test)]
pub(crate) fn by_brute_force(column: &Column, elevations: &[Elevation], targets: &Targets) -> ColumnHits {
    let mut hits = ColumnHits::default();
    for part in &targets.parts {
        hits.cast(column, elevations, &Part { columns: 0..usize::MAX, layers: 0..LAYERS, ..*part }, targets);
    }
    hits
}
