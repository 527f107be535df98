//! The returns of the bare road that a scan can leave out, since the detector would discard them as
//! ground.
//!
//! Nearly all points of a usual scan are road. A beam that meets nothing but the road gives points
//! on its centre line, from the distance at which its lowest sub-ray meets the road to the greatest
//! distance from which the road returns enough light, both widened by the greatest error of the
//! range. Along that line the height falls:
//!
//! ```text
//!   sensor o-._
//!              '-._   centre line of the beam, as the ego estimates it
//!   ..............'-*-._.........  height below which a point counts as ground; it rises with distance
//!   ----------------|----'-*-----  road
//!               nearest  farthest
//! ```
//!
//! If the nearest possible point counts as ground, all points of the beam do. The noise is
//! addressed by beam, so a scan without one beam changes no other beam.

use fearless_simd::Simd;

use super::cast::{ColumnHits, SubRays};
use super::ground::{GROUND_M, GROUND_SLOPE};
use super::noise::MAX_NORMAL;
use super::pattern::{CentreLines, Column, Elevation, LineBounds, ROAD_LAYERS};
use super::power::{LinkBudget, MIN_POWER};
use super::receiver::SensorPoseEstimate;
use super::targets::{FaceRange, LayerMask, Targets};
use closecall_traffic::maths;

/// The faces of the road's surface, which is always the first of all faces.
const GROUND_FACES: FaceRange = FaceRange { first: 0, first_back: 1, end: 1 };
/// Slope of a centre line up to which at least [`LEVEL_SHARE`] of its length lies in the plane.
const MAX_SLOPE: f32 = 0.24;
/// Share of the length of such a line that lies in the plane, at least: √(1 − 0.24²) = 0.9708.
const LEVEL_SHARE: f32 = 0.97;
/// Margin for rounding in single precision (m).
const MARGIN_M: f32 = 0.002;
/// Further margins for bounds of a block of columns: for the heights (m), for the slopes, and for
/// the distances, relative to the sum of the components of the road's vector.
const BLOCK_MARGIN_M: f32 = 0.001;
const BLOCK_SLOPE: f32 = 1e-5;
const BLOCK_SHARE: f32 = 1e-6;
/// Factor on the power for rounding in single precision.
const POWER_MARGIN: f32 = 1.01;

/// Bounds on the points of the bare road in one scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BareRoad {
    pose: SensorPoseEstimate,
    /// Greatest error of a measured range (m).
    max_error_m: f32,
    /// Distance by which deskewing may move a point (m).
    max_shift_m: f32,
}

/// Returns the distance beyond which a road of this strength (m) returns too little light to be
/// detected (m).
pub(crate) fn farthest_road_return_m(link: &LinkBudget, strength_m: f32) -> f32 {
    maths::cbrt(POWER_MARGIN * link.gain_m2 * strength_m / MIN_POWER)
}

impl BareRoad {
    /// Returns the bounds, or `None` if the road may return light from beyond `ground_reach_m`, up
    /// to which it counts as ground (m). `max_shift_m` is the distance by which deskewing may move
    /// a point (m).
    pub(crate) fn new(
        targets: &Targets,
        link: &LinkBudget,
        pose: SensorPoseEstimate,
        [max_shift_m, ground_reach_m]: [f32; 2],
    ) -> Option<Self> {
        let max_error_m = MAX_NORMAL * link.range_sd_m(1.0);
        let farthest_m = farthest_road_return_m(link, targets.faces[0].strength_m);
        let is_near = farthest_m + max_error_m + max_shift_m + MARGIN_M < ground_reach_m;
        is_near.then_some(Self { pose, max_error_m, max_shift_m })
    }

    /// Returns true if all points that a column may give count as ground, provided that its beams
    /// meet nothing but the road. False if the uppermost of the tested layers may give a point,
    /// too: the layers above it are not tested.
    ///
    /// Written without branches, so that the layers are tested side by side in vector registers.
    #[inline(always)]
    pub(crate) fn covers(&self, lines: &CentreLines, road: &Road) -> bool {
        if self.pose.is_turned() { self.covers_as::<true>(lines, road) } else { self.covers_as::<false>(lines, road) }
    }

    #[inline(always)]
    fn covers_as<const IS_TURNED: bool>(&self, lines: &CentreLines, road: &Road) -> bool {
        let mut kept = [false; ROAD_LAYERS];
        for (layer, kept) in kept.iter_mut().enumerate() {
            let azimuth = [lines.cos[layer], lines.sin[layer]];
            let per_distance = road.per_distance(azimuth, lines.lowest_tan[layer]);
            let counts = self.counts_as_ground::<IS_TURNED>(
                azimuth,
                [lines.tan[layer], lines.cosine[layer]],
                per_distance * lines.lowest_cosine[layer],
            );
            *kept = road.is_detectable(per_distance) & (!counts | (layer + 1 == ROAD_LAYERS));
        }
        kept == [false; ROAD_LAYERS]
    }

    /// Returns true if [`BareRoad::covers`] surely returns true for all columns of a block. False
    /// for a turned sensor.
    ///
    /// The inverse distance at which the lowest sub-ray of a layer meets the road is at most
    /// `most`, so that the nearest point is at least `nearest_m` away. Per metre of range, a centre
    /// line rises by `slopes` times the cosine of its elevation. The point lies below the ground if
    /// `nearest_m` times `gain` exceeds the height of the sensor above the ground.
    #[inline(always)]
    pub(crate) fn covers_block(&self, bounds: &LineBounds, road: &Road) -> bool {
        if self.pose.is_turned() {
            return false;
        }
        let [x, y, z] = road.inverse;
        let slack = BLOCK_SHARE * (x.abs() + y.abs() + z.abs());
        let above_m = self.pose.sensor_z_m() - GROUND_M + GROUND_SLOPE * self.max_shift_m + MARGIN_M + BLOCK_MARGIN_M;
        let [along, up] = self.pose.level_slopes();
        let mut kept = [false; ROAD_LAYERS];
        for (layer, kept) in kept.iter_mut().enumerate() {
            let least = |factor: f32, extremes: &[[f32; ROAD_LAYERS]; 2]| {
                (factor * extremes[0][layer]).min(factor * extremes[1][layer])
            };
            let most = |factor: f32, extremes: &[[f32; ROAD_LAYERS]; 2]| {
                (factor * extremes[0][layer]).max(factor * extremes[1][layer])
            };
            let inverse = most(x, &bounds.cos) + most(y, &bounds.sin) + most(z, &bounds.lowest_tan) + slack;
            let nearest_m = 1.0 / (inverse * bounds.lowest_cosine[1][layer]) - self.max_error_m - MARGIN_M;
            let slopes = [
                least(along, &bounds.cos) + least(up, &bounds.tan) - BLOCK_SLOPE,
                most(along, &bounds.cos) + most(up, &bounds.tan) + BLOCK_SLOPE,
            ];
            let gain = GROUND_SLOPE * LEVEL_SHARE - slopes[1] * bounds.cosine[0][layer];
            // The comparisons are false for NaN.
            let counts =
                (nearest_m > 0.0) & (slopes[1] < 0.0) & (slopes[0] > -MAX_SLOPE) & (nearest_m * gain > above_m);
            *kept = road.is_detectable(inverse) & (!counts | (layer + 1 == ROAD_LAYERS));
        }
        kept == [false; ROAD_LAYERS]
    }

    /// Returns [`BareRoad::counts_as_ground`] for this sensor.
    #[inline(always)]
    fn is_ground(&self, azimuth: [f32; 2], elevation: [f32; 2], per_range: f32) -> bool {
        match self.pose.is_turned() {
            true => self.counts_as_ground::<true>(azimuth, elevation, per_range),
            false => self.counts_as_ground::<false>(azimuth, elevation, per_range),
        }
    }

    /// Returns true if every point that a beam may give counts as ground. `azimuth` has the cosine
    /// and sine of the azimuth of its centre line, `elevation` the tangent and cosine of its
    /// elevation. `per_range` is the inverse range at which the lowest sub-ray meets the road
    /// (1/m).
    #[inline(always)]
    fn counts_as_ground<const IS_TURNED: bool>(
        &self,
        [cos, sin]: [f32; 2],
        [tan, cosine]: [f32; 2],
        per_range: f32,
    ) -> bool {
        let nearest_m = 1.0 / per_range - self.max_error_m;
        let level_m = nearest_m * cosine;
        let at_m = [level_m * cos, level_m * sin, level_m * tan];
        let [_, _, height_m] =
            if IS_TURNED { self.pose.ego_frame_point_m(at_m) } else { self.pose.level_point_m(at_m) };
        let fall_m = self.pose.sensor_z_m() - height_m;
        let ground_m = GROUND_M + GROUND_SLOPE * (LEVEL_SHARE * nearest_m - self.max_shift_m) - MARGIN_M;
        // The comparisons are false for NaN.
        (height_m < ground_m) & (fall_m > 0.0) & (fall_m < MAX_SLOPE * nearest_m)
    }
}

/// The surface of the road in one scan.
pub(crate) struct Road {
    /// Vector m of its plane (1/m), see [`targets`](super::targets).
    inverse: [f32; 3],
    /// Received power of a return, if multiplied by the cube of the inverse distance (thresholds ·
    /// m³), at most.
    max_power_m3: f32,
}

impl Road {
    pub(crate) fn new(targets: &Targets, link: &LinkBudget) -> Self {
        let ground = &targets.faces[0];
        Self { inverse: ground.inverse, max_power_m3: link.gain_m2 * ground.strength_m }
    }

    /// Returns the inverse horizontal distance at which a sub-ray meets the road (1/m).
    #[inline(always)]
    fn per_distance(&self, [cos, sin]: [f32; 2], tan: f32) -> f32 {
        self.inverse[0] * cos + self.inverse[1] * sin + self.inverse[2] * tan
    }

    /// Returns true if a beam may receive a return whose lowest sub-ray meets the road at this
    /// inverse distance (1/m).
    #[inline(always)]
    fn is_detectable(&self, per_distance: f32) -> bool {
        (per_distance > 0.0) & (self.max_power_m3 * per_distance * per_distance * per_distance > MIN_POWER)
    }
}

/// Finds the layers of a column that may receive a return from the road, and sets
/// [`ColumnHits::ground_below`] and [`ColumnHits::bare`].
///
/// The layers are tried from the lowest up to the first whose return would be too weak to be
/// detected. Beams that may also hit a solid are intersected with the road here. For the others the
/// receiver computes the return directly, since the road, with nothing below it, occludes nothing;
/// `omitted` decides which of these returns are left out. All returns of layers that are not
/// `wanted` (a bit mask) are left out.
#[inline(always)]
pub(crate) fn cast_ground<S: Simd>(
    simd: S,
    (column, elevations): (&Column, &[Elevation]),
    (targets, road): (&Targets, &Road),
    (omitted, wanted): (Option<&BareRoad>, LayerMask),
    hits: &mut ColumnHits,
) {
    for (layer, elevation) in elevations.iter().enumerate() {
        let group = elevation.group;
        // The lowest sub-ray hits the road at the shortest distance and at the steepest angle.
        let per_distance = road.per_distance(column.centre[group], elevation.tan[0]);
        if !road.is_detectable(per_distance) {
            break;
        }
        hits.ground_below = layer + 1;
        if wanted >> layer & 1 == 0 {
            hits.bare |= 1 << layer;
        } else if hits.is_tested(layer) {
            hits.intersect(layer, &SubRays::new(simd, column, elevation), GROUND_FACES, targets);
        } else if omitted
            .is_some_and(|bare| bare.is_ground(column.centre[group], elevation.centre, per_distance * elevation.cos[0]))
        {
            hits.bare |= 1 << layer;
        }
    }
}
