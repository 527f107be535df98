//! Glare: the veil that stray light of a bright source lays over the image, in the lens and on the
//! window in front of it.
//!
//! A source that illuminates the lens with E adds to each direction the radiance of Stiles and
//! Holladay, which the International Commission on Illumination has adopted for the human eye (CIE
//! 146:2002; J. J. Vos, *On the cause of disability glare and its dependence on glare angle, age
//! and ocular pigmentation*, Clinical and Experimental Optometry 86, 2003):
//!
//! ```text
//!   L = k · 10 · E / θ²      θ: angle to the source (deg), 1° to 30°
//! ```
//!
//! k is 1 for a healthy young eye. It is an assumption that a camera behind a window scatters light
//! in the same way. The falloff is as for polished surfaces: their scatter falls with about the
//! 1.8th power of the angle (the default of the ABg model of Photon Engineering's FRED). Within 1°
//! the radiance keeps its value at 1°. Beyond 30° it continues to fall, to zero where the source is
//! behind the lens. The veil is added before the exposure: pixels near the source saturate, and all
//! contrast is lost there. Nothing hides a source.

use closecall_traffic::{Scene, SceneVehicle, maths};

use super::fault::CameraFault;
use super::frame::Frame;
use super::light::Illumination;
use super::mesh::{Emission, Vec3, dot, sub};
use super::pinhole::Lens;
use super::shapes;

/// Radiance of the veil at 1 rad for E = 1: 10 · (π/180)².
const AT_ONE_RADIAN: f32 = 0.003_046_174;
/// Square of the angle below which the veil no longer grows: 1° (rad²).
const LEAST_SQUARE: f32 = 0.000_304_617_4;
/// Distance across the road beyond which a main beam misses the camera (m): a lane and a half.
const BEAM_HALF_WIDTH_M: f64 = 5.6;
/// Luminous intensity of a main beam divided by the intensity of the dipped beam where it lights
/// the road. A main beam of class B has at least 40,500 cd in its middle (UN Regulation 149, table
/// 5). It is an assumption that the dipped beam has a fourth of it.
const MAIN_BEAM: f32 = 4.0;

/// The veil of one source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Veil {
    /// Unit vector to the source in the ground frame.
    towards: Vec3,
    /// Illumination of the lens by the source times the strength k, in units of π times the
    /// radiance of a white surface.
    irradiance: Vec3,
}

impl Veil {
    /// Adds the veil's radiance in the direction of a unit vector to `light`.
    pub(crate) fn add_to(&self, direction: Vec3, light: &mut Vec3) {
        let apart = sub(direction, self.towards);
        // The square of the chord equals the square of the angle to within 2 % at 30°.
        let factor = AT_ONE_RADIAN / dot(apart, apart).max(LEAST_SQUARE);
        for (sum, irradiance) in light.iter_mut().zip(self.irradiance) {
            *sum += irradiance * factor;
        }
    }
}

impl Frame {
    /// Adds the glare of a fault of the camera. `scene` is the scene that the image shows.
    pub fn add_glare(&mut self, fault: &CameraFault, scene: &Scene<'_>) {
        let sun = sun_veil(fault.sun_glare, &self.lens, &self.light);
        let beams = nearest_behind(scene)
            .filter(|_| fault.main_beam_glare > 0.0 && self.light.is_dark())
            .map(|vehicle| main_beam_veil(fault.main_beam_glare, scene, vehicle, &self.lens, &self.light));
        self.lists.veils.extend(sun.into_iter().chain(beams.into_iter().flatten()));
    }
}

/// Returns the veil of the sun; `None` if it does not shine into the lens.
#[expect(clippy::cast_possible_truncation, reason = "radiance needs no more than single precision")]
fn sun_veil(strength: f64, lens: &Lens, light: &Illumination) -> Option<Veil> {
    let [.., depth] = lens.direction_in_camera(light.to_sun.map(f64::from));
    (strength > 0.0 && light.sun[0] > 0.0 && depth > 0.0).then(|| {
        // A white surface that faces the sun has the radiance E/π. The lens is inclined to the sun.
        let factor = strength as f32 * std::f32::consts::PI * depth as f32;
        Veil { towards: light.to_sun, irradiance: light.sun.map(|sun| sun * factor) }
    })
}

/// Returns the veils of the headlamps of a vehicle whose main beam is on.
#[expect(clippy::cast_possible_truncation, reason = "radiance needs no more than single precision")]
fn main_beam_veil(
    strength: f64,
    scene: &Scene<'_>,
    vehicle: &SceneVehicle,
    lens: &Lens,
    light: &Illumination,
) -> Vec<Veil> {
    let (at, heading) = lens.pose_in_ground(scene, vehicle);
    let (sin, cos) = maths::sin_cos(heading);
    let lamps = shapes::vehicle(&vehicle.vehicle).lamps;
    let of_lamp = |[x, y, z]: [f64; 3]| {
        let to_lamp = [at[0] + cos * x - sin * y, at[1] + sin * x + cos * y, z - lens.height_m];
        let distance_m = to_lamp.iter().map(|part| part * part).sum::<f64>().sqrt().max(1.0);
        let facing = -(cos * to_lamp[0] + sin * to_lamp[1]) / distance_m;
        let (distance, facing) = (distance_m as f32, facing as f32);
        let beam = MAIN_BEAM * light.headlamp_irradiance(distance, facing) * light.transmission(distance);
        Veil {
            towards: to_lamp.map(|part| (part / distance_m) as f32),
            irradiance: [1.0, 0.98, 0.92].map(|tint| tint * beam * strength as f32),
        }
    };
    let headlamps = lamps.iter().filter(|lamp| lamp.emission == Emission::Headlamp);
    headlamps.map(|lamp| of_lamp(lamp.at.map(f64::from))).collect()
}

/// Returns the vehicle with the nearest front behind the ego whose beam reaches the camera.
fn nearest_behind<'a>(scene: &Scene<'a>) -> Option<&'a SceneVehicle> {
    let ego = &scene.ego;
    let half_m = |vehicle: &SceneVehicle| 0.5 * vehicle.vehicle.dimensions.length_m;
    let gap_m = |other: &SceneVehicle| ego.state.s_m - half_m(ego) - other.state.s_m - half_m(other);
    let near = scene.others.iter().filter(|other| (other.state.d_m - ego.state.d_m).abs() < BEAM_HALF_WIDTH_M);
    near.filter(|other| gap_m(other) > 0.0).min_by(|a, b| gap_m(a).total_cmp(&gap_m(b)))
}

#[cfg(test)]
mod tests;
