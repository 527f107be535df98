//! The ray cast: which face each sub-ray meets first.
//!
//! For one column the directions of all sub-rays of a group share cos φ and sin φ, so that m·d is a constant plus
//! m_z·tan θ: two operations for each of the eight sub-rays of a beam, side by side in vector registers. The columns and
//! layers that a solid can touch are found beforehand from its bounds; [`by_brute_force`] tries everything instead, and
//! a property test holds the two to the same bits.

use super::pattern::{ACROSS, Column, Elevation, LAYERS, LAYERS_PER_GROUP, SUBRAYS, UPWARD};
use super::targets::{FaceRange, Part, Targets};

/// No face was met.
pub(crate) const NO_FACE: u32 = u32::MAX;

/// What the sub-rays of one beam meet first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BeamHits {
    /// Inverse of the horizontal distance [1/m], 0 where nothing is met.
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
            let ray = Fan { cos: column.cos[group], sin: column.sin[group], tan: elevations[layer].tan };
            self.meet(layer, &ray, part.faces, targets);
        }
    }

    /// Lets the beam of one layer meet one solid.
    #[inline]
    pub(crate) fn meet(&mut self, layer: usize, fan: &Fan, faces: FaceRange, targets: &Targets) {
        fan.meet(faces, targets, &mut self.beams[layer]);
        self.touched |= 1 << layer;
    }
}

/// Which sub-ray a lane is: across and upward. Neighbours in range are neighbours in the lanes.
#[inline(always)]
pub(crate) const fn place(lane: usize) -> (usize, usize) {
    (lane % ACROSS, lane / ACROSS)
}

/// The sub-rays of one beam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fan {
    pub(crate) cos: [f32; ACROSS],
    pub(crate) sin: [f32; ACROSS],
    pub(crate) tan: [f32; UPWARD],
}

impl Fan {
    /// m·d of each sub-ray.
    #[inline(always)]
    pub(crate) fn along(&self, inverse: [f32; 3]) -> [f32; SUBRAYS] {
        let level: [f32; ACROSS] =
            std::array::from_fn(|across| inverse[0] * self.cos[across] + inverse[1] * self.sin[across]);
        std::array::from_fn(|lane| {
            let (across, upward) = place(lane);
            level[across] + inverse[2] * self.tan[upward]
        })
    }

    /// Keeps in `hits` what is nearer: what was met before, or this solid. Where both are equally near, the former.
    #[inline(always)]
    fn meet(&self, faces: FaceRange, targets: &Targets, hits: &mut BeamHits) {
        let mut nearest = [f32::INFINITY; SUBRAYS];
        let mut by = [NO_FACE; SUBRAYS];
        for (face, index) in targets.faces[faces.towards()].iter().zip(faces.first..) {
            let along = self.along(face.inverse);
            for lane in 0..SUBRAYS {
                by[lane] = if along[lane] < nearest[lane] { index } else { by[lane] };
                nearest[lane] = if along[lane] < nearest[lane] { along[lane] } else { nearest[lane] };
            }
        }
        let mut farthest = [0.0_f32; SUBRAYS];
        for face in &targets.faces[faces.away()] {
            let along = self.along(face.inverse);
            for lane in 0..SUBRAYS {
                farthest[lane] = if along[lane] > farthest[lane] { along[lane] } else { farthest[lane] };
            }
        }
        for lane in 0..SUBRAYS {
            let met = nearest[lane] > farthest[lane] && nearest[lane] > hits.inverse[lane];
            hits.inverse[lane] = if met { nearest[lane] } else { hits.inverse[lane] };
            hits.face[lane] = if met { by[lane] } else { hits.face[lane] };
        }
    }
}

/// The parts that a sweep over the columns has to try at each of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Active {
    /// Parts in order of their first column, then of their index.
    queue: Vec<usize>,
    next: usize,
    parts: Vec<usize>,
}

impl Active {
    /// Starts a sweep.
    pub(crate) fn start(&mut self, targets: &Targets) {
        self.queue.clear();
        self.queue.extend(0..targets.parts.len());
        self.queue.sort_unstable_by_key(|&part| (targets.parts[part].columns.start, part));
        self.next = 0;
        self.parts.clear();
    }

    /// The parts for the next column, in order of their index.
    pub(crate) fn at(&mut self, column: usize, targets: &Targets) -> &[usize] {
        self.parts.retain(|&part| targets.parts[part].columns.end > column);
        while let Some(&part) = self.queue.get(self.next)
            && targets.parts[part].columns.start <= column
        {
            let place = self.parts.partition_point(|&other| other < part);
            self.parts.insert(place, part);
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
