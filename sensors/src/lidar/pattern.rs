//! The scan pattern of a LiDAR: the direction and the footprint of every beam. The picture shows
//! the pattern of the Valeo SCALA, second generation:
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
//! The azimuth φ is measured about the z axis of the sensor's frame, from its x axis, which points
//! backward: column 0 points to the ego's left, the last column to its right.
//!
//! A [`LidarKind`] says where the layers and the columns lie. Without a raster, each beam is a
//! column of one layer, with an elevation and a time of its own. A beam has a footprint. 2 × 4
//! sub-rays of equal weight sample it.

use std::sync::{Mutex, PoisonError};

use super::beam_table::BeamTable;
use super::{LidarKind, MirrorSide};
use closecall_traffic::maths;

/// Greatest number of groups in a column.
pub(crate) const GROUPS: usize = 4;
/// Number of sub-rays side by side in a footprint.
pub(crate) const SUBRAY_COLUMNS: usize = 2;
/// Number of sub-rays above each other in a footprint.
pub(crate) const SUBRAY_ROWS: usize = 4;
/// Number of sub-rays in a footprint.
pub(crate) const SUBRAYS: usize = SUBRAY_COLUMNS * SUBRAY_ROWS;

/// Half of the horizontal field of view of the SCALA (°), which the object-level rear sensor
/// shares.
pub(crate) const HALF_FIELD_DEG: f64 = 66.5;

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

impl Column {
    /// Returns the least magnitude of the sines of the azimuths of the beams' centres.
    pub(crate) fn least_sine(&self) -> f32 {
        self.centre.iter().map(|[_, sin]| sin.abs()).fold(1.0, f32::min)
    }
}

/// The elevations of a beam and its sub-rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elevation {
    /// Group of the beam's layer.
    pub(crate) group: usize,
    /// Tangent and cosine of the elevation of the beam's centre.
    pub(crate) centre: [f32; 2],
    /// Tangents of the elevations of its sub-rays, from the lowest to the highest.
    pub(crate) tan: [f32; SUBRAY_ROWS],
    /// Cosines of the elevations of its sub-rays.
    pub(crate) cos: [f32; SUBRAY_ROWS],
}

/// Number of layers, from the lowest, that may meet the road near enough to return light, at the
/// usual heights and tilts.
pub(crate) const ROAD_LAYERS: usize = 8;

/// The centre lines and the lowest sub-rays of the lowest beams of a column, for a test of several
/// layers at once.
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
    /// Returns the centre lines of a column's lowest beams. There is at least one beam.
    fn new(column: &Column, elevations: &[Elevation]) -> Self {
        // A pattern with fewer layers repeats its uppermost one.
        let at = |layer: usize| &elevations[layer.min(elevations.len() - 1)];
        let of_layer = |value: fn(&Elevation) -> f32| std::array::from_fn(|layer| value(at(layer)));
        Self {
            cos: std::array::from_fn(|layer| column.centre[at(layer).group][0]),
            sin: std::array::from_fn(|layer| column.centre[at(layer).group][1]),
            tan: of_layer(|elevation| elevation.centre[0]),
            cosine: of_layer(|elevation| elevation.centre[1]),
            lowest_tan: of_layer(|elevation| elevation.tan[0]),
            lowest_cosine: of_layer(|elevation| elevation.cos[0]),
        }
    }
}

/// Number of successive columns that share bounds.
pub(crate) const BLOCK_COLUMNS: usize = 16;

/// Bounds of the [`CentreLines`] of a block of columns: the least and the greatest value of each
/// layer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineBounds {
    /// Cosines of the azimuths.
    pub(crate) cos: [[f32; ROAD_LAYERS]; 2],
    /// Sines of the azimuths.
    pub(crate) sin: [[f32; ROAD_LAYERS]; 2],
    /// Tangents of the elevations of the centre lines.
    pub(crate) tan: [[f32; ROAD_LAYERS]; 2],
    /// Cosines of the elevations of the centre lines.
    pub(crate) cosine: [[f32; ROAD_LAYERS]; 2],
    /// Tangents of the elevations of the lowest sub-rays.
    pub(crate) lowest_tan: [[f32; ROAD_LAYERS]; 2],
    /// Cosines of the elevations of the lowest sub-rays.
    pub(crate) lowest_cosine: [[f32; ROAD_LAYERS]; 2],
}

impl LineBounds {
    /// Returns the bounds of the lines of a block.
    fn new(lines: &[CentreLines]) -> Self {
        let extremes = |value: fn(&CentreLines) -> &[f32; ROAD_LAYERS]| {
            let fold = |from, pick: fn(f32, f32) -> f32| {
                std::array::from_fn(|layer| lines.iter().map(|column| value(column)[layer]).fold(from, pick))
            };
            [fold(f32::INFINITY, f32::min), fold(f32::NEG_INFINITY, f32::max)]
        };
        Self {
            cos: extremes(|lines| &lines.cos),
            sin: extremes(|lines| &lines.sin),
            tan: extremes(|lines| &lines.tan),
            cosine: extremes(|lines| &lines.cosine),
            lowest_tan: extremes(|lines| &lines.lowest_tan),
            lowest_cosine: extremes(|lines| &lines.lowest_cosine),
        }
    }
}

/// The scan pattern: all beams of both mirror sides, in the sensor's frame.
///
/// A direction is stored as (cos φ, sin φ, tan θ). The horizontal part of this vector has length 1:
/// multiplied by a horizontal distance, it gives the point at that distance.
#[derive(Clone, Debug)]
pub struct Pattern {
    kind: &'static LidarKind,
    pub(crate) columns: Vec<Column>,
    /// Elevations of all beams, for each mirror side; once if the sensor has no mirror with two
    /// sides.
    elevations: Vec<Vec<Elevation>>,
    /// Centre lines of all columns, for each mirror side.
    centre_lines: Vec<Vec<CentreLines>>,
    /// Bounds of the centre lines in each block of columns, for each mirror side.
    line_bounds: Vec<Vec<LineBounds>>,
    /// Least cosine of the elevation of a beam.
    pub(crate) least_cosine: f32,
    /// Bounds of the mirror's contribution to the elevation (°).
    mirror_bounds_deg: [f64; 2],
    /// Least and greatest elevation of the beams, if they form no raster (°).
    elevation_bounds_deg: Option<[f64; 2]>,
}

impl Pattern {
    /// Returns the pattern of a kind of LiDAR, which all scanners of this kind share. A process
    /// sees few kinds, so that the patterns are never released.
    pub(crate) fn shared(kind: &'static LidarKind) -> &'static Self {
        static PATTERNS: Mutex<Vec<&'static Pattern>> = Mutex::new(Vec::new());
        let mut patterns = PATTERNS.lock().unwrap_or_else(PoisonError::into_inner);
        match patterns.iter().find(|pattern| std::ptr::eq(pattern.kind, kind)) {
            Some(pattern) => pattern,
            None => {
                let pattern: &'static Self = Box::leak(Box::new(Self::new(kind)));
                patterns.push(pattern);
                pattern
            }
        }
    }

    /// Returns the pattern of a kind of LiDAR.
    pub fn new(kind: &'static LidarKind) -> Self {
        let columns: Vec<Column> = (0..kind.azimuths_deg.len()).map(|index| column(kind, index)).collect();
        let sides: &[MirrorSide] = match kind.mirror_cubic_deg {
            Some(_) => &[MirrorSide::Plus, MirrorSide::Minus],
            None => &[MirrorSide::Plus],
        };
        let elevations: Vec<Vec<Elevation>> = sides
            .iter()
            .map(|mirror_side| {
                let column_elevations = |column: usize| -> Vec<Elevation> {
                    (0..kind.layers()).map(|layer| elevation(kind, [column, layer], *mirror_side)).collect()
                };
                (0..columns.len()).flat_map(column_elevations).collect()
            })
            .collect();
        let of_side = |elevations: &Vec<Elevation>| {
            let of_columns = columns.iter().zip(elevations.chunks_exact(kind.layers()));
            of_columns.map(|(column, elevations)| CentreLines::new(column, elevations)).collect()
        };
        let centre_lines: Vec<Vec<CentreLines>> = elevations.iter().map(of_side).collect();
        let bounds = |lines: &Vec<CentreLines>| lines.chunks(BLOCK_COLUMNS).map(LineBounds::new).collect();
        Self {
            kind,
            columns,
            least_cosine: elevations.iter().flatten().map(|elevation| elevation.centre[1]).fold(1.0, f32::min),
            elevations,
            line_bounds: centre_lines.iter().map(bounds).collect(),
            centre_lines,
            mirror_bounds_deg: mirror_bounds_deg(kind.mirror_cubic_deg, &kind.azimuths_deg),
            elevation_bounds_deg: kind.table.as_ref().map(BeamTable::elevation_bounds_deg),
        }
    }

    /// Returns the kind of LiDAR.
    pub(crate) fn kind(&self) -> &'static LidarKind {
        self.kind
    }

    /// Returns the elevations of the beams of a column.
    pub(crate) fn elevations(&self, mirror_side: MirrorSide, column: usize) -> &[Elevation] {
        let layers = self.kind.layers();
        &self.elevations[mirror_side as usize % self.elevations.len()][column * layers..(column + 1) * layers]
    }

    /// Returns the centre lines of the lowest beams of a column.
    pub(crate) fn centre_lines(&self, mirror_side: MirrorSide, column: usize) -> &CentreLines {
        &self.centre_lines[mirror_side as usize % self.centre_lines.len()][column]
    }

    /// Returns the bounds of the centre lines of a block of [`BLOCK_COLUMNS`] columns.
    pub(crate) fn line_bounds(&self, mirror_side: MirrorSide, block: usize) -> &LineBounds {
        &self.line_bounds[mirror_side as usize % self.line_bounds.len()][block]
    }

    /// Returns the range of columns whose footprints may touch azimuths from `low_deg` to
    /// `high_deg`.
    pub(crate) fn columns_between(&self, low_deg: f64, high_deg: f64) -> std::ops::Range<usize> {
        let half = 0.5 * self.kind.beam_width_deg;
        let shift = self.greatest_shift_deg();
        let first = self.columns.partition_point(|column| column.azimuth_deg + shift + half < low_deg);
        let end = self.columns.partition_point(|column| column.azimuth_deg - half <= high_deg);
        first..end.max(first)
    }

    /// Returns bounds of the azimuths of all sub-rays in a range of columns (°).
    pub(crate) fn azimuths_deg(&self, columns: &std::ops::Range<usize>) -> [f64; 2] {
        let half = 0.5 * self.kind.beam_width_deg;
        let shift = self.greatest_shift_deg();
        [self.columns[columns.start].azimuth_deg - half, self.columns[columns.end - 1].azimuth_deg + shift + half]
    }

    /// Returns the azimuth shift of the last group (°).
    fn greatest_shift_deg(&self) -> f64 {
        self.kind.group_shift_deg * (self.kind.groups() - 1) as f64
    }

    /// Returns the range of layers whose footprints may touch elevations from `low_deg` to
    /// `high_deg`.
    pub(crate) fn layers_between(
        &self,
        mirror_side: MirrorSide,
        low_deg: f64,
        high_deg: f64,
    ) -> std::ops::Range<usize> {
        let half = 0.5 * self.kind.beam_height_deg;
        if let Some([least, most]) = self.elevation_bounds_deg {
            return 0..usize::from(most + half >= low_deg && least - half <= high_deg);
        }
        let [least, most] = self.mirror_bounds_deg;
        let (lowest, highest) = match mirror_side {
            MirrorSide::Plus => (least, most),
            MirrorSide::Minus => (-most, -least),
        };
        let base_deg = |layer: &usize| self.kind.layers_deg[*layer];
        let touches =
            |layer: &usize| base_deg(layer) + highest + half >= low_deg && base_deg(layer) + lowest - half <= high_deg;
        let layers = self.kind.layers();
        let first = (0..layers).find(touches).unwrap_or(layers);
        let end = (first..layers).rfind(touches).map_or(first, |last| last + 1);
        first..end
    }

    /// Returns the azimuth and elevation of a beam's centre in the sensor's frame (rad).
    pub fn direction_rad(&self, mirror_side: MirrorSide, beam: u16) -> (f64, f64) {
        let layers = self.kind.layers();
        let (column, layer) = (usize::from(beam) / layers, usize::from(beam) % layers);
        let azimuth_deg = self.columns[column].azimuth_deg;
        let group = layer / self.kind.layers_per_group;
        let elevation_deg = layer_deg(self.kind, [column, layer], mirror_side);
        (group_azimuth_deg(self.kind, azimuth_deg, group).to_radians(), elevation_deg.to_radians())
    }
}

/// Step to which the bounds of the mirror's contribution are rounded outward (°).
const BOUND_STEP_DEG: f64 = 0.001;

/// Returns bounds of the mirror's contribution over the field of view, rounded outward (°).
pub(crate) fn mirror_bounds_deg(cubic: Option<[f64; 4]>, azimuths_deg: &[f64]) -> [f64; 2] {
    let Some(cubic) = cubic else { return [0.0; 2] };
    let values = || azimuths_deg.iter().map(|azimuth_deg| cubic_deg(cubic, *azimuth_deg) / BOUND_STEP_DEG);
    let least = values().fold(f64::INFINITY, f64::min).floor();
    [least * BOUND_STEP_DEG, values().fold(f64::NEG_INFINITY, f64::max).ceil() * BOUND_STEP_DEG]
}

/// Returns the mirror's contribution c(φ) to the elevation (°).
fn cubic_deg([c0, c1, c2, c3]: [f64; 4], azimuth_deg: f64) -> f64 {
    ((c3 * azimuth_deg + c2) * azimuth_deg + c1) * azimuth_deg + c0
}

/// Returns the elevation of a layer in a column (°).
fn layer_deg(kind: &LidarKind, [column, layer]: [usize; 2], mirror_side: MirrorSide) -> f64 {
    if let Some(table) = &kind.table {
        return table.elevations_deg[column];
    }
    let azimuth_deg = kind.azimuths_deg[column];
    match (kind.mirror_cubic_deg, mirror_side) {
        (None, _) => kind.layers_deg[layer],
        (Some(cubic), MirrorSide::Plus) => kind.layers_deg[layer] + cubic_deg(cubic, azimuth_deg),
        (Some(cubic), MirrorSide::Minus) => kind.layers_deg[layer] - cubic_deg(cubic, azimuth_deg),
    }
}

/// Returns the azimuth of a group in the column at `azimuth_deg` (°).
fn group_azimuth_deg(kind: &LidarKind, azimuth_deg: f64, group: usize) -> f64 {
    azimuth_deg + kind.group_shift_deg * group as f64
}

#[expect(clippy::cast_possible_truncation, reason = "the model's directions are single precision: 1e-7 rad")]
fn column(kind: &LidarKind, index: usize) -> Column {
    let azimuth_deg = kind.azimuths_deg[index];
    #[expect(clippy::cast_sign_loss, reason = "clamped to 0 and above")]
    let swept_ns = || (kind.sweep_offset_s(azimuth_deg) * 1e9) as u32;
    let mut column = Column {
        azimuth_deg,
        offset_ns: kind.table.as_ref().map_or_else(swept_ns, |table| table.offsets_ns[index]),
        centre: [[0.0; 2]; GROUPS],
        cos: [[0.0; SUBRAY_COLUMNS]; GROUPS],
        sin: [[0.0; SUBRAY_COLUMNS]; GROUPS],
    };
    for group in 0..GROUPS {
        // The groups that the pattern lacks stay within its bounds.
        let centre_deg = group_azimuth_deg(kind, azimuth_deg, group.min(kind.groups() - 1));
        let (sin, cos) = maths::sin_cos(centre_deg.to_radians());
        column.centre[group] = [cos as f32, sin as f32];
        for across in 0..SUBRAY_COLUMNS {
            let offset_deg = kind.beam_width_deg * ((across as f64 + 0.5) / SUBRAY_COLUMNS as f64 - 0.5);
            let (sin, cos) = maths::sin_cos((centre_deg + offset_deg).to_radians());
            column.cos[group][across] = cos as f32;
            column.sin[group][across] = sin as f32;
        }
    }
    column
}

#[expect(clippy::cast_possible_truncation, reason = "the model's directions are single precision: 1e-7 rad")]
fn elevation(kind: &LidarKind, [column, layer]: [usize; 2], mirror_side: MirrorSide) -> Elevation {
    let centre_deg = layer_deg(kind, [column, layer], mirror_side);
    let subray_rad = |upward: usize| {
        let offset_deg = kind.beam_height_deg * ((upward as f64 + 0.5) / SUBRAY_ROWS as f64 - 0.5);
        (centre_deg + offset_deg).to_radians()
    };
    Elevation {
        group: layer / kind.layers_per_group,
        centre: [maths::tan(centre_deg.to_radians()) as f32, maths::cos(centre_deg.to_radians()) as f32],
        tan: std::array::from_fn(|upward| maths::tan(subray_rad(upward)) as f32),
        cos: std::array::from_fn(|upward| maths::cos(subray_rad(upward)) as f32),
    }
}

#[cfg(test)]
mod tests {
    use super::super::LidarModel;
    use super::*;

    fn scala() -> Pattern {
        Pattern::new(LidarModel::Scala2.kind())
    }

    /// Returns the elevation of a layer of the SCALA by its published formula (°).
    fn published_deg(layer: usize, azimuth_deg: f64, sign: f64) -> f64 {
        let (group, in_group) = (layer / 4, layer % 4);
        let base = 0.6025 * in_group as f64 + 2.564 * group as f64 - 4.749;
        base + sign * (((1.512e-8 * azimuth_deg - 5.152e-6) * azimuth_deg - 1.233e-3) * azimuth_deg + 0.1412)
    }

    #[test]
    fn columns_match_the_data_sheet() {
        let azimuths: Vec<f64> = scala().columns.iter().map(|column| column.azimuth_deg).collect();
        assert_eq!(azimuths.len(), 653);
        assert_eq!((azimuths[0], azimuths[326], azimuths[652]), (-66.5, 0.0, 66.5));
        for pair in azimuths.windows(2) {
            let fine = pair[0] >= -15.0 && pair[1] <= 15.0;
            assert_eq!(pair[1] - pair[0], if fine { 0.125 } else { 0.25 });
        }
    }

    #[test]
    fn elevations_match_values_calculated_by_hand() {
        let pattern = scala();
        let at = |mirror_side, column: usize, layer: usize| {
            pattern.direction_rad(mirror_side, u16::try_from(column * 16 + layer).unwrap())
        };
        // φ = 0: c = 0.1412. Layer 7 is g = 1, l = 3: 1.8075 + 2.564 − 4.749 = −0.3775.
        assert!((at(MirrorSide::Plus, 326, 7).1.to_degrees() - -0.2363).abs() < 1e-9);
        assert!((at(MirrorSide::Minus, 326, 7).1.to_degrees() - -0.5187).abs() < 1e-9);
        // φ = 66.5: 0.004447 − 0.022784 − 0.081995 + 0.1412 = 0.040868. Layer 15: 1.8075 + 7.692 −
        // 4.749 = 4.7505.
        assert!((at(MirrorSide::Plus, 652, 15).1.to_degrees() - 4.791_368).abs() < 1e-5);
        assert!((at(MirrorSide::Plus, 652, 15).0.to_degrees() - (66.5 + 3.0 * 0.0181)).abs() < 1e-9);
    }

    #[test]
    fn the_file_of_the_scala_gives_the_directions_of_the_published_formula_to_the_bit() {
        let pattern = scala();
        for (mirror_side, sign) in [(MirrorSide::Plus, 1.0), (MirrorSide::Minus, -1.0)] {
            for (index, column) in pattern.columns.iter().enumerate() {
                for (layer, elevation) in pattern.elevations(mirror_side, index).iter().enumerate() {
                    let published_rad = published_deg(layer, column.azimuth_deg, sign).to_radians();
                    assert_eq!(elevation.centre, [maths::tan(published_rad) as f32, maths::cos(published_rad) as f32]);
                    assert_eq!(elevation.group, layer / 4);
                }
            }
        }
        assert_eq!(pattern.mirror_bounds_deg.map(|bound| (bound * 1e3).round()), [40.0, 196.0]);
    }

    #[test]
    fn an_azimuth_range_includes_every_footprint_that_it_touches() {
        let pattern = scala();
        let columns = pattern.columns_between(-0.3, 0.3);
        for (index, column) in pattern.columns.iter().enumerate() {
            let reaches = (0..4).any(|g| {
                let centre = column.azimuth_deg + 0.0181 * f64::from(g);
                centre + 0.0625 >= -0.3 && centre - 0.0625 <= 0.3
            });
            assert!(!reaches || columns.contains(&index), "column {index}");
        }
        assert!(columns.len() <= 7);
        assert!(pattern.columns_between(70.0, 80.0).is_empty());
    }

    #[test]
    fn the_sweep_ends_14_8_ms_after_the_first_column() {
        let pattern = scala();
        assert_eq!(pattern.columns[0].offset_ns, 0);
        assert_eq!(pattern.columns[652].offset_ns, 14_777_777);
    }
}
