//! The returns of guard rails that a scan can leave out, since the detector would discard them.
//!
//! On a straight road, each column meets the face of a rail at one distance in the plane. A point
//! lies on the centre line of its beam, at that distance or beyond, apart from the error of its
//! range. Along that line, the lateral distance from the road grows. If the nearest possible point
//! is beyond the region of interest, all points of the column are:
//!
//! ```text
//!   sensor o--.__                      region of interest
//!   . . . . . . .'--.__. . . . . . . . . . . . . . . . .
//!                      '*-.__          * nearest possible point
//!   =========================*====     rail
//! ```
//!
//! A pulse that meets the rail and the road in front of it gives a point between them. The beam
//! must then be higher than the rail's lower edge, which it is not up to [`narrow_to_m`].

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use closecall_traffic::maths;

use super::LaneGeometry;
use super::echo::PULSE_M;
use super::noise::MAX_NORMAL;
use super::pattern::{Column, Elevation, GROUPS, SUBRAY_COLUMNS};
use super::power::LinkBudget;
use super::receiver::SensorPoseEstimate;
use super::targets::{Part, Targets};

/// Height of the lower edge of a rail (m).
const BELOW_RAIL_M: f64 = 0.44;
/// Factor on the height of a beam, and the step to which a distance is rounded down (m): margins.
const BEAM_MARGIN: f64 = 4.0 / 3.0;
const NARROW_STEP_M: f64 = 10.0;
/// Margin for rounding, and for the tilt of the sensor's frame (m).
const MARGIN_M: f32 = 0.03;

/// The limits beyond which the points of a guard rail are discarded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RailReturns {
    /// Slope of the road in the ego's frame.
    slope: f32,
    /// Lateral limits of the region of interest, left and right (m).
    region_m: [f32; 2],
    /// Greatest error of a measured range (m).
    max_error_m: f32,
    /// Distance up to which a beam is lower than the lower edge of a rail (m).
    narrow_to_m: f32,
}

/// Returns the distance up to which a beam of this height (°) is lower than the lower edge of a
/// rail (m): 30 m for 0.6°.
#[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
pub(crate) fn narrow_to_m(beam_height_deg: f64) -> f32 {
    let exact_m = BELOW_RAIL_M / maths::tan((BEAM_MARGIN * beam_height_deg).to_radians());
    ((exact_m / NARROW_STEP_M).floor() * NARROW_STEP_M) as f32
}

impl RailReturns {
    /// Returns the limits for beams of this height (°), or `None` on a curved road, on which the
    /// distance of the rails varies within a column.
    #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
    pub(crate) fn new(lane: &LaneGeometry, link: &LinkBudget, beam_height_deg: f64) -> Option<Self> {
        lane.is_straight().then(|| Self {
            slope: -lane.heading_rad as f32,
            region_m: lane.region_m.map(|end_m| end_m as f32),
            max_error_m: MAX_NORMAL * link.range_sd_m(1.0),
            narrow_to_m: narrow_to_m(beam_height_deg),
        })
    }

    /// Returns true if the detector would discard every point that the column may give of the guard
    /// rails among these parts. `pose` is the ego's estimate at the time of the column.
    #[inline(always)]
    pub(crate) fn are_discarded<S: Simd>(
        &self,
        simd: S,
        column: &Column,
        elevations: &[Elevation],
        pose: &SensorPoseEstimate,
        parts: &[usize],
        targets: &Targets,
    ) -> bool {
        let (Some(lowest), Some(highest)) = (elevations.first(), elevations.last()) else { return false };
        let tans = [lowest.tan[0], highest.tan[highest.tan.len() - 1]];
        let azimuths = Azimuths::new(simd, column);
        let mut inverse = f32x8::splat(simd, 0.0);
        for part in parts.iter().map(|&part| &targets.parts[part]).filter(|part| part.is_guard_rail) {
            inverse = inverse.max(azimuths.greatest_inverses(simd, tans, part, targets));
        }
        let inverse = inverse.reduce_max();
        let plane_m = 1.0 / inverse;
        let pulse_m = if plane_m > self.narrow_to_m { PULSE_M } else { 0.0 };
        let nearest_m = (plane_m - self.max_error_m - pulse_m) * lowest.centre[1].min(highest.centre[1]);
        // The comparisons are false for NaN.
        inverse == 0.0 || nearest_m > 0.0 && self.are_beyond(nearest_m, &column.centre, pose)
    }

    /// Returns true for a sensor that is not turned if all points at least `nearest_m` from it, in
    /// these directions, are beyond the region of interest.
    #[inline(always)]
    fn are_beyond(&self, nearest_m: f32, azimuths: &[[f32; 2]; GROUPS], pose: &SensorPoseEstimate) -> bool {
        let left_of_road = |[x_m, y_m, _]: [f32; 3]| y_m - self.slope * x_m;
        let sensor_m = left_of_road(pose.level_point_m([0.0; 3]));
        let [left_end_m, right_end_m] = self.region_m;
        // All groups are tested side by side.
        let mut is_beyond = [false; GROUPS];
        for ([cos, sin], is_beyond) in azimuths.iter().zip(&mut is_beyond) {
            let outward = left_of_road(pose.level_direction([*cos, *sin, 0.0]));
            let near_m = sensor_m + nearest_m * outward;
            *is_beyond = ((near_m > left_end_m + MARGIN_M) & (outward > 0.0))
                | ((near_m < right_end_m - MARGIN_M) & (outward < 0.0));
        }
        is_beyond == [true; GROUPS]
    }
}

/// The azimuths of all sub-rays of a column, in the lanes of vector registers.
#[derive(Clone, Copy)]
struct Azimuths<S: Simd> {
    cos: f32x8<S>,
    sin: f32x8<S>,
}

impl<S: Simd> Azimuths<S> {
    #[inline(always)]
    fn new(simd: S, column: &Column) -> Self {
        let lanes = |[[a, b], [c, d], [e, f], [g, h]]: [[f32; SUBRAY_COLUMNS]; GROUPS]| {
            f32x8::load_array(simd, [a, b, c, d, e, f, g, h])
        };
        Self { cos: lanes(column.cos), sin: lanes(column.sin) }
    }

    /// Returns a bound on the inverse distance in the plane at which the sub-rays of each azimuth
    /// meet a solid (1/m); less than 0 if none does.
    ///
    /// A ray meets a convex solid at the least inverse distance of its front-facing faces.
    #[inline(always)]
    fn greatest_inverses(&self, simd: S, tans: [f32; 2], part: &Part, targets: &Targets) -> f32x8<S> {
        let mut least = f32x8::splat(simd, f32::INFINITY);
        for face in &targets.faces[part.faces.front_facing()] {
            let [x, y, z] = face.inverse;
            let upward = (z * tans[0]).max(z * tans[1]);
            least = least.min(self.cos * x + self.sin * y + upward);
        }
        least
    }
}
