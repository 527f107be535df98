//! Fog in the 3D scene: upright curtains ahead of the ego, behind which everything is paler. The
//! eye looks ahead.
//!
//! After Koschmieder, contrast falls with the distance r as exp(-3.912·r/V), with the
//! meteorological visibility V at which 2 % of it are left. Each curtain removes the share of its
//! distance from the curtain before.

use closecall_traffic::maths;
use nalgebra::Vector3;
use rerun::Mesh3D;

use super::RecordingError;
use super::palette;
use super::stream::Writer;
use super::vehicles::write_poses;
use crate::run::film::{Film, Frame};

/// Extinction over the visibility: -ln(0.02).
const KOSCHMIEDER: f64 = 3.912;
/// Visibility above which the scene shows no fog (m). At 2 km, a vehicle at 100 m keeps four fifths
/// of its contrast.
const MAX_VISIBILITY_M: f64 = 2_000.0;
/// Number of curtains.
const CURTAINS: u32 = 5;
/// Distance of the farthest curtain from the ego, as a share of the visibility.
const FARTHEST: f64 = 1.0;
/// Largest distance of a curtain (m).
const MAX_DISTANCE_M: f64 = 300.0;
/// Height and half width of a curtain (m).
const HEIGHT_M: f64 = 60.0;
const HALF_WIDTH_M: f64 = 200.0;

/// Returns the share of the light of distant things that passes the weather, for the colour of the
/// sky.
pub(super) fn clear_share(film: &Film) -> f64 {
    let visibility_m = film.environment.visibility_m;
    if visibility_m >= MAX_VISIBILITY_M { 1.0 } else { visibility_m / MAX_VISIBILITY_M }
}

/// Writes the curtains, which move along the road with the ego.
pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
    let visibility_m = film.environment.visibility_m;
    if visibility_m >= MAX_VISIBILITY_M {
        return Ok(());
    }
    let step_m = (FARTHEST * visibility_m).min(MAX_DISTANCE_M) / f64::from(CURTAINS);
    let opacity = 1.0 - maths::exp(-KOSCHMIEDER * step_m / visibility_m);
    let light = film.environment.light;
    let colour = palette::with_opacity(palette::through_fog(palette::sky(light), 0.0, light), (255.0 * opacity) as u8);
    for curtain in 1..=CURTAINS {
        let x_m = step_m * f64::from(curtain);
        let corner = |across: f64, up: f64| {
            Vector3::new(x_m, across * HALF_WIDTH_M, up * HEIGHT_M).map(|value| value as f32).into()
        };
        let corners: [[f32; 3]; 4] = [corner(-1.0, -0.1), corner(1.0, -0.1), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let mesh = Mesh3D::new(corners).with_triangle_indices([[0, 1, 2], [0, 2, 3]]).with_albedo_factor(colour);
        writer.write_static(&format!("world/fog/{curtain}"), &mesh)?;
    }
    let along = |frame: &Frame| {
        let ego = &frame.states[film.ego];
        film.road.plane_pose(ego.s_m, 0.0, 0.0)
    };
    write_poses(writer, "world/fog", &film.times(), &film.frames.iter().map(along).collect::<Vec<_>>())
}
