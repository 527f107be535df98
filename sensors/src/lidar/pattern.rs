//! The scan pattern of the Valeo SCALA, second generation: the direction and the footprint of every beam.
//!
//! ```text
//!        column 0                    column 326                   column 652
//!   φ  −66.5° ── step 0.25° ── −15° ── step 0.125° ── +15° ── step 0.25° ── +66.5°
//!
//!   layer 15 ┐ group 3 (shifted by 3·0.0181° in azimuth)
//!         …  │
//!   layer  0 ┘ group 0          one mirror side raises every layer by 0.14° at φ = 0, the other lowers it
//! ```
//!
//! The azimuth φ is measured about the z axis of the sensor's frame, from its x axis, which points backward: column 0
//! points to the ego's left, column 652 to its right.
//!
//! Source: the published pattern of the SCALA Gen 2, θ = 0.6025·l + 2.564·g − 4.749 ± c(φ) in degrees with the cubic
//! c(φ) = 1.512e-8·φ³ − 5.152e-6·φ² − 1.233e-3·φ + 0.1412.
//!
//! A beam has a footprint. Its height is taken as 0.6°, because the four layers of a group are four adjacent detector
//! cells, 0.6025° apart, without a gap. Its width is assumed to be the finest azimuth step, 0.125°, so that
//! neighbouring columns touch. 2 × 4 sub-rays of equal weight sample the footprint.

use closecall_traffic::CONTROL_STEP;

use super::MirrorSide;

/// Number of columns in a scan.
pub const COLUMNS: usize = 653;
/// Number of layers in a column.
pub const LAYERS: usize = 16;
/// Number of beams in a scan.
pub const BEAMS: usize = COLUMNS * LAYERS;
/// Number of layers in a group. The layers of a group share the same azimuth shift.
pub(crate) const LAYERS_PER_GROUP: usize = 4;
/// Number of groups in a column.
pub(crate) const GROUPS: usize = LAYERS / LAYERS_PER_GROUP;
/// Number of sub-rays side by side in a footprint.
pub(crate) const SUBRAY_COLUMNS: usize = 2;
/// Number of sub-rays above each other in a footprint.
pub(crate) const SUBRAY_ROWS: usize = 4;
/// Number of sub-rays in a footprint.
pub(crate) const SUBRAYS: usize = SUBRAY_COLUMNS * SUBRAY_ROWS;

/// Half of the horizontal field of view (°).
pub(crate) const HALF_FIELD_DEG: f64 = 66.5;
/// Tangent of half of the horizontal field of view, rounded.
pub(crate) const HALF_FIELD_TAN: f64 = 2.2998;
/// Duration of a sweep over the field of view (ns).
///
/// The mirror has two sides, so it turns by 180° in each period. It deflects a beam by twice its own angle, so it turns
/// by half of 133° during a sweep.
pub(crate) const SWEEP_NS: f64 = CONTROL_STEP.ns() as f64 * HALF_FIELD_DEG / 180.0;

/// The fine azimuth step (°), which is also the unit that azimuths are counted in.
const FINE_STEP_DEG: f64 = 0.125;
/// Azimuth at which the fine steps end (fine steps): 15°.
const FINE_END_STEPS: i32 = 120;
/// Azimuth at which the coarse steps end (fine steps): 66.5°.
const COARSE_END_STEPS: i32 = 532;
/// Azimuth shift between successive groups (°).
const GROUP_SHIFT_DEG: f64 = 0.0181;
/// Width of a footprint (°).
const FOOTPRINT_WIDTH_DEG: f64 = FINE_STEP_DEG;
/// Height of a footprint (°).
const FOOTPRINT_HEIGHT_DEG: f64 = 0.6;

/// A column of the pattern: the values that its beams have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    /// Azimuth of group 0 (°).
    pub(crate) azimuth_deg: f64,
    /// Time of measurement after the scan's start (ns).
    pub(crate) offset_ns: u32,
    /// Cosine and sine of the azimuth of each group's centre.
    pub(crate) centre: [[f32; 2]; GROUPS],
    /// Cosines of the azimuths of each group's sub-rays.
    pub(crate) cos: [[f32; SUBRAY_COLUMNS]; GROUPS],
    /// Sines of the azimuths of each group's sub-rays.
    pub(crate) sin: [[f32; SUBRAY_COLUMNS]; GROUPS],
}

/// The elevations of a beam and its sub-rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elevation {
    /// Tangent and cosine of the elevation of the beam's centre.
    pub(crate) centre: [f32; 2],
    /// Tangents of the elevations of its sub-rays, from the lowest to the highest.
    pub(crate) tan: [f32; SUBRAY_ROWS],
    /// Cosines of the elevations of its sub-rays.
    pub(crate) cos: [f32; SUBRAY_ROWS],
}

/// Number of layers, from the lowest, that may meet the road near enough to return light, at the usual heights and tilts.
pub(crate) const ROAD_LAYERS: usize = 8;

/// The centre lines and the lowest sub-rays of the lowest beams of a column, for a test of several layers at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CentreLines {
    /// Cosines of the azimuths.
    pub(crate) cos: [f32; ROAD_LAYERS],
    /// Sines of the azimuths.
    pub(crate) sin: [f32; ROAD_LAYERS],
    /// Tangents of the elevations of the centre lines.
    pub(crate) tan: [f32; ROAD_LAYERS],
    /// Cosines of the elevations of the centre lines.
    pub(crate) cosine: [f32; ROAD_LAYERS],
    /// Tangents of the elevations of the lowest sub-rays.
    pub(crate) lowest_tan: [f32; ROAD_LAYERS],
    /// Cosines of the elevations of the lowest sub-rays.
    pub(crate) lowest_cosine: [f32; ROAD_LAYERS],
}

impl CentreLines {
    fn new(column: &Column, elevations: &[Elevation]) -> Self {
        let of_layer = |value: fn(&Elevation) -> f32| std::array::from_fn(|layer| value(&elevations[layer]));
        Self {
            cos: std::array::from_fn(|layer| column.centre[layer / LAYERS_PER_GROUP][0]),
            sin: std::array::from_fn(|layer| column.centre[layer / LAYERS_PER_GROUP][1]),
            tan: of_layer(|elevation| elevation.centre[0]),
            cosine: of_layer(|elevation| elevation.centre[1]),
            lowest_tan: of_layer(|elevation| elevation.tan[0]),
            lowest_cosine: of_layer(|elevation| elevation.cos[0]),
        }
    }
}

/// The scan pattern: all beams of both mirror sides, in the sensor's frame.
///
/// A direction is stored as (cos φ, sin φ, tan θ). The horizontal part of this vector has length 1: multiplied by a
/// horizontal distance, it gives the point at that distance.
#[derive(Clone, Debug)]
pub struct Pattern {
    pub(crate) columns: Vec<Column>,
    /// Elevations of all beams, for each mirror side.
    elevations: [Vec<Elevation>; 2],
    /// Centre lines of all columns, for each mirror side.
    centre_lines: [Vec<CentreLines>; 2],
}

impl Pattern {
    /// Returns the pattern of the Valeo SCALA Gen 2.
    pub fn scala_2() -> Self {
        let columns: Vec<Column> = azimuth_steps().map(|steps| column(f64::from(steps) * FINE_STEP_DEG)).collect();
        let elevations: [Vec<Elevation>; 2] = [MirrorSide::Plus, MirrorSide::Minus].map(|mirror_side| {
            let of =
                |column: &Column| (0..LAYERS).map(|layer| elevation(layer, column.azimuth_deg, mirror_side)).collect();
            columns.iter().flat_map::<Vec<Elevation>, _>(of).collect()
        });
        let centre_lines = [&elevations[0], &elevations[1]].map(|elevations| {
            let of_columns = columns.iter().zip(elevations.chunks_exact(LAYERS));
            of_columns.map(|(column, elevations)| CentreLines::new(column, elevations)).collect()
        });
        Self { columns, elevations, centre_lines }
    }

    /// Returns the elevations of the 16 beams of a column.
    pub(crate) fn elevations(&self, mirror_side: MirrorSide, column: usize) -> &[Elevation] {
        &self.elevations[mirror_side as usize][column * LAYERS..(column + 1) * LAYERS]
    }

    /// Returns the centre lines of the lowest beams of a column.
    pub(crate) fn centre_lines(&self, mirror_side: MirrorSide, column: usize) -> &CentreLines {
        &self.centre_lines[mirror_side as usize][column]
    }

    /// Returns the range of columns whose footprints may touch azimuths from `low_deg` to `high_deg`.
    pub(crate) fn columns_between(&self, low_deg: f64, high_deg: f64) -> std::ops::Range<usize> {
        let half = 0.5 * FOOTPRINT_WIDTH_DEG;
        let shift = GROUP_SHIFT_DEG * (GROUPS - 1) as f64;
        let first = self.columns.partition_point(|column| column.azimuth_deg + shift + half < low_deg);
        let end = self.columns.partition_point(|column| column.azimuth_deg - half <= high_deg);
        first..end.max(first)
    }

    /// Returns bounds of the azimuths of all sub-rays in a range of columns (°).
    pub(crate) fn azimuths_deg(&self, columns: &std::ops::Range<usize>) -> [f64; 2] {
        let half = 0.5 * FOOTPRINT_WIDTH_DEG;
        let shift = GROUP_SHIFT_DEG * (GROUPS - 1) as f64;
        [self.columns[columns.start].azimuth_deg - half, self.columns[columns.end - 1].azimuth_deg + shift + half]
    }

    /// Returns the range of layers whose footprints may touch elevations from `low_deg` to `high_deg`.
    pub(crate) fn layers_between(mirror_side: MirrorSide, low_deg: f64, high_deg: f64) -> std::ops::Range<usize> {
        let half = 0.5 * FOOTPRINT_HEIGHT_DEG;
        let (lowest, highest) = match mirror_side {
            MirrorSide::Plus => (CUBIC_MIN_DEG, CUBIC_MAX_DEG),
            MirrorSide::Minus => (-CUBIC_MAX_DEG, -CUBIC_MIN_DEG),
        };
        let touches = |layer: &usize| {
            base_deg(*layer) + highest + half >= low_deg && base_deg(*layer) + lowest - half <= high_deg
        };
        let first = (0..LAYERS).find(touches).unwrap_or(LAYERS);
        let end = (first..LAYERS).rfind(touches).map_or(first, |last| last + 1);
        first..end
    }

    /// Returns the azimuth and elevation of a beam's centre in the sensor's frame (rad).
    pub fn direction_rad(&self, mirror_side: MirrorSide, beam: u16) -> (f64, f64) {
        let (column, layer) = (usize::from(beam) / LAYERS, usize::from(beam) % LAYERS);
        let azimuth_deg = self.columns[column].azimuth_deg;
        (group_azimuth_deg(azimuth_deg, layer).to_radians(), layer_deg(layer, azimuth_deg, mirror_side).to_radians())
    }

    /// Returns the time after the scan's start at which a column at this azimuth is measured (s), clamped to the sweep.
    pub(crate) fn sweep_offset_s(azimuth_deg: f64) -> f64 {
        let share = ((azimuth_deg + HALF_FIELD_DEG) / (2.0 * HALF_FIELD_DEG)).clamp(0.0, 1.0);
        share * SWEEP_NS * 1e-9
    }
}

/// Bounds of the cubic c(φ) over the field of view, rounded outward (°). A test checks that the cubic stays within
/// them.
const CUBIC_MIN_DEG: f64 = 0.040;
const CUBIC_MAX_DEG: f64 = 0.197;

/// Returns the azimuths of all columns (fine steps).
fn azimuth_steps() -> impl Iterator<Item = i32> {
    let coarse_negative = (-COARSE_END_STEPS..-FINE_END_STEPS).step_by(2);
    let coarse_positive = (FINE_END_STEPS + 2..=COARSE_END_STEPS).step_by(2);
    coarse_negative.chain(-FINE_END_STEPS..=FINE_END_STEPS).chain(coarse_positive)
}

/// Returns the mirror's contribution c(φ) to the elevation (°).
fn cubic_deg(azimuth_deg: f64) -> f64 {
    ((1.512e-8 * azimuth_deg - 5.152e-6) * azimuth_deg - 1.233e-3) * azimuth_deg + 0.1412
}

/// Returns the elevation of a layer without the mirror's contribution (°).
fn base_deg(layer: usize) -> f64 {
    let (group, in_group) = (layer / LAYERS_PER_GROUP, layer % LAYERS_PER_GROUP);
    0.6025 * in_group as f64 + 2.564 * group as f64 - 4.749
}

/// Returns the elevation of a layer at an azimuth (°).
fn layer_deg(layer: usize, azimuth_deg: f64, mirror_side: MirrorSide) -> f64 {
    match mirror_side {
        MirrorSide::Plus => base_deg(layer) + cubic_deg(azimuth_deg),
        MirrorSide::Minus => base_deg(layer) - cubic_deg(azimuth_deg),
    }
}

/// Returns the azimuth of a layer in the column at `azimuth_deg`, including the shift of its group (°).
fn group_azimuth_deg(azimuth_deg: f64, layer: usize) -> f64 {
    azimuth_deg + GROUP_SHIFT_DEG * (layer / LAYERS_PER_GROUP) as f64
}

#[expect(clippy::cast_possible_truncation, reason = "the model's directions are single precision: 1e-7 rad")]
fn column(azimuth_deg: f64) -> Column {
    let mut column = Column {
        azimuth_deg,
        #[expect(clippy::cast_sign_loss, reason = "clamped to 0 and above")]
        offset_ns: (Pattern::sweep_offset_s(azimuth_deg) * 1e9) as u32,
        centre: [[0.0; 2]; GROUPS],
        cos: [[0.0; SUBRAY_COLUMNS]; GROUPS],
        sin: [[0.0; SUBRAY_COLUMNS]; GROUPS],
    };
    for group in 0..GROUPS {
        let centre_deg = group_azimuth_deg(azimuth_deg, group * LAYERS_PER_GROUP);
        let (sin, cos) = centre_deg.to_radians().sin_cos();
        column.centre[group] = [cos as f32, sin as f32];
        for across in 0..SUBRAY_COLUMNS {
            let offset_deg = FOOTPRINT_WIDTH_DEG * ((across as f64 + 0.5) / SUBRAY_COLUMNS as f64 - 0.5);
            let (sin, cos) = (centre_deg + offset_deg).to_radians().sin_cos();
            column.cos[group][across] = cos as f32;
            column.sin[group][across] = sin as f32;
        }
    }
    column
}

#[expect(clippy::cast_possible_truncation, reason = "the model's directions are single precision: 1e-7 rad")]
fn elevation(layer: usize, azimuth_deg: f64, mirror_side: MirrorSide) -> Elevation {
    let centre_deg = layer_deg(layer, azimuth_deg, mirror_side);
    let subray_rad = |upward: usize| {
        let offset_deg = FOOTPRINT_HEIGHT_DEG * ((upward as f64 + 0.5) / SUBRAY_ROWS as f64 - 0.5);
        (centre_deg + offset_deg).to_radians()
    };
    Elevation {
        centre: [centre_deg.to_radians().tan() as f32, centre_deg.to_radians().cos() as f32],
        tan: std::array::from_fn(|upward| subray_rad(upward).tan() as f32),
        cos: std::array::from_fn(|upward| subray_rad(upward).cos() as f32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_match_the_data_sheet() {
        let azimuths: Vec<f64> = azimuth_steps().map(|steps| f64::from(steps) * FINE_STEP_DEG).collect();
        assert_eq!(azimuths.len(), COLUMNS);
        assert_eq!((azimuths[0], azimuths[COLUMNS / 2], azimuths[COLUMNS - 1]), (-66.5, 0.0, 66.5));
        for pair in azimuths.windows(2) {
            let fine = pair[0] >= -15.0 && pair[1] <= 15.0;
            assert_eq!(pair[1] - pair[0], if fine { 0.125 } else { 0.25 });
        }
    }

    #[test]
    fn elevations_match_values_calculated_by_hand() {
        let pattern = Pattern::scala_2();
        let at = |mirror_side, column: usize, layer: usize| {
            pattern.direction_rad(mirror_side, u16::try_from(column * LAYERS + layer).unwrap())
        };
        // φ = 0: c = 0.1412. Layer 7 is g = 1, l = 3: 1.8075 + 2.564 − 4.749 = −0.3775.
        assert!((at(MirrorSide::Plus, 326, 7).1.to_degrees() - -0.2363).abs() < 1e-9);
        assert!((at(MirrorSide::Minus, 326, 7).1.to_degrees() - -0.5187).abs() < 1e-9);
        // φ = 66.5: 0.004447 − 0.022784 − 0.081995 + 0.1412 = 0.040868. Layer 15: 1.8075 + 7.692 − 4.749 = 4.7505.
        assert!((at(MirrorSide::Plus, 652, 15).1.to_degrees() - 4.791_368).abs() < 1e-5);
        assert!((at(MirrorSide::Plus, 652, 15).0.to_degrees() - (66.5 + 3.0 * 0.0181)).abs() < 1e-9);
    }

    #[test]
    fn the_cubic_stays_within_its_bounds() {
        for steps in azimuth_steps() {
            let cubic = cubic_deg(f64::from(steps) * FINE_STEP_DEG);
            assert!((CUBIC_MIN_DEG..=CUBIC_MAX_DEG).contains(&cubic), "{cubic} at {steps}");
        }
    }

    #[test]
    fn an_azimuth_range_includes_every_footprint_that_it_touches() {
        let pattern = Pattern::scala_2();
        let found = pattern.columns_between(-0.3, 0.3);
        for (index, column) in pattern.columns.iter().enumerate() {
            let reaches = (0..4).any(|g| {
                let centre = column.azimuth_deg + 0.0181 * f64::from(g);
                centre + 0.0625 >= -0.3 && centre - 0.0625 <= 0.3
            });
            assert!(!reaches || found.contains(&index), "column {index}");
        }
        assert!(found.len() <= 7);
        assert!(pattern.columns_between(70.0, 80.0).is_empty());
    }

    #[test]
    fn the_sweep_ends_14_8_ms_after_the_first_column() {
        let pattern = Pattern::scala_2();
        assert_eq!(pattern.columns[0].offset_ns, 0);
        assert_eq!(pattern.columns[COLUMNS - 1].offset_ns, 14_777_777);
    }
}
