//! The returns of the bare road that a scan can leave out, since the detector would discard them as ground.
//!
//! Nearly all points of a usual scan are road. A beam that meets nothing but the road gives points on its centre line,
//! from the distance at which its lowest sub-ray meets the road to the greatest distance from which the road returns
//! enough light, both widened by the greatest error of the range. Along that line the height falls:
//!
//! ```text
//!   sensor o-._
//!              '-._   centre line of the beam, as the ego estimates it
//!   ..............'-*-._.........  height below which a point counts as ground; it rises with distance
//!   ----------------|----'-*-----  road
//!               nearest  farthest
//! ```
//!
//! If the nearest possible point counts as ground, all points of the beam do. The noise is addressed by beam, so that
//! leaving out a beam changes no other one.

use super::cast::{ColumnHits, SubRays};
use super::ground::{GROUND_M, GROUND_REACH_M, GROUND_SLOPE};
use super::noise::MAX_NORMAL;
use super::pattern::{Column, Elevation, LAYERS_PER_GROUP};
use super::power::{LinkBudget, MIN_POWER, range_sd_m};
use super::receiver::SensorPoseEstimate;
use super::targets::{FaceRange, Targets};

/// The faces of the road's surface, which is always the first of all faces.
const GROUND_FACES: FaceRange = FaceRange { first: 0, first_back: 1, end: 1 };
/// Slope of a centre line up to which at least [`LEVEL_SHARE`] of its length lies in the plane.
const MAX_SLOPE: f32 = 0.24;
/// Share of the length of such a line that lies in the plane, at least: √(1 − 0.24²) = 0.9708.
const LEVEL_SHARE: f32 = 0.97;
/// Margin for rounding in single precision (m).
const MARGIN_M: f32 = 0.002;
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

impl BareRoad {
    /// Returns the bounds, or `None` if the road may return light from beyond the distance up to which it counts as
    /// ground.
    pub(crate) fn new(
        targets: &Targets,
        link: &LinkBudget,
        pose: SensorPoseEstimate,
        max_shift_m: f32,
    ) -> Option<Self> {
        let max_error_m = MAX_NORMAL * range_sd_m(1.0);
        let farthest_m = (POWER_MARGIN * link.gain_m2 * targets.faces[0].strength_m / MIN_POWER).cbrt();
        let is_near = farthest_m + max_error_m + max_shift_m + MARGIN_M < GROUND_REACH_M;
        is_near.then_some(Self { pose, max_error_m, max_shift_m })
    }

    /// Returns true if every point that a beam may give counts as ground. `per_distance` is the inverse horizontal
    /// distance at which the lowest sub-ray meets the road (1/m).
    fn counts_as_ground(&self, [cos, sin]: [f32; 2], elevation: &Elevation, per_distance: f32) -> bool {
        let nearest_m = 1.0 / (per_distance * elevation.cos[0]) - self.max_error_m;
        let [tan, cosine] = elevation.centre;
        let level_m = nearest_m * cosine;
        let [_, _, height_m] = self.pose.ego_frame_point_m([level_m * cos, level_m * sin, level_m * tan]);
        let fall_m = self.pose.sensor_z_m() - height_m;
        let ground_m = GROUND_M + GROUND_SLOPE * (LEVEL_SHARE * nearest_m - self.max_shift_m) - MARGIN_M;
        // The comparisons are false for NaN.
        height_m < ground_m && fall_m > 0.0 && fall_m < MAX_SLOPE * nearest_m
    }
}

/// Finds the layers of a column that may receive a return from the road, and sets [`ColumnHits::ground_below`] and
/// [`ColumnHits::bare`].
///
/// The layers are tried from the lowest up to the first whose return would be too weak to be detected. Beams that may
/// also hit a solid are intersected with the road here. For the others the receiver computes the return directly, since
/// the road, with nothing below it, occludes nothing; `omitted` decides which of these returns are left out.
pub(crate) fn cast_ground(
    column: &Column,
    elevations: &[Elevation],
    (targets, link): (&Targets, &LinkBudget),
    omitted: Option<&BareRoad>,
    hits: &mut ColumnHits,
) {
    let ground = &targets.faces[0];
    let max_power_m3 = link.gain_m2 * ground.strength_m;
    for (layer, elevation) in elevations.iter().enumerate() {
        let group = layer / LAYERS_PER_GROUP;
        let [cos, sin] = column.centre[group];
        // The lowest sub-ray hits the road at the shortest distance and at the steepest angle.
        let inverse = ground.inverse[0] * cos + ground.inverse[1] * sin + ground.inverse[2] * elevation.tan[0];
        if !(inverse > 0.0 && max_power_m3 * inverse * inverse * inverse > MIN_POWER) {
            break;
        }
        hits.ground_below = layer + 1;
        if hits.is_tested(layer) {
            let subrays = SubRays { cos: column.cos[group], sin: column.sin[group], tan: elevation.tan };
            hits.intersect(layer, &subrays, GROUND_FACES, targets);
        } else if omitted.is_some_and(|road| road.counts_as_ground([cos, sin], elevation, inverse)) {
            hits.bare |= 1 << layer;
        }
    }
}
