//! A body on its way to the image: its faces lit, its triangles projected once for each moment of the exposure.

use super::hash::split;
use super::light::Illumination;
use super::mesh::{Mesh, Surface, Texture, Vec3, add_scaled, cross, dot, each, normalised, sub};
use super::pinhole::Lens;
use super::raster::{ScreenTriangle, project};

/// Moments of one exposure at which the scene is sampled: as many samples for each pixel. The mean over them blurs
/// what moves and smooths edges (Haeberli and Akeley, *The accumulation buffer*, 1990).
pub(crate) const MOMENTS: usize = 4;

/// What a sample needs to know of the face that it hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade {
    /// Radiance towards the lens before texture and air.
    pub(crate) radiance: Vec3,
    /// What is drawn onto it.
    pub(crate) texture: Texture,
    /// Texture coordinate u = map[0] · (place in camera axes) + offset[0], v likewise.
    pub(crate) map: [Vec3; 2],
    /// See `map`.
    pub(crate) offset: [f32; 2],
    /// The instance that the face belongs to; 0 for none.
    pub(crate) instance: u16,
}

/// Where and how a body stands in the ground frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// Its origin [m].
    pub(crate) at: [f64; 2],
    /// Cosine and sine of its heading.
    pub(crate) turn: [f64; 2],
    /// Pitch of the body, nose down [rad].
    pub(crate) pitch_rad: f64,
    /// Its velocity relative to the lens [m/s].
    pub(crate) velocity: [f64; 2],
    /// Its instance number in the truth; 0 for none.
    pub(crate) instance: u16,
}

/// Rotation and translation from body to ground frame and to camera axes.
struct Transform {
    rotation: [Vec3; 3],
    at: Vec3,
    camera_rotation: [Vec3; 3],
    camera_at: Vec3,
}

impl Transform {
    fn new(placement: &Placement, lens: &Lens) -> Self {
        let [cos, sin] = placement.turn;
        let pitch = placement.pitch_rad;
        // Small pitch: the body's x axis dips, its z axis leans forward.
        let axes = [[cos, sin, -pitch], [-sin, cos, 0.0], [cos * pitch, sin * pitch, 1.0]];
        let at = [placement.at[0], placement.at[1], 0.0];
        let origin = lens.in_camera(at);
        let axis_in_camera = |axis: [f64; 3]| {
            let tip = lens.in_camera([at[0] + axis[0], at[1] + axis[1], axis[2]]);
            each(|i| (tip[i] - origin[i]) as f32)
        };
        Self {
            rotation: axes.map(|axis| axis.map(|part| part as f32)),
            at: at.map(|part| part as f32),
            camera_rotation: axes.map(axis_in_camera),
            camera_at: origin.map(|part| part as f32),
        }
    }
}

fn apply(rotation: &[Vec3; 3], at: Vec3, point: Vec3) -> Vec3 {
    let mut sum = at;
    for (axis, share) in rotation.iter().zip(point) {
        sum = add_scaled(sum, *axis, share);
    }
    sum
}

/// Lights the faces of a body, and appends them and their triangles to a frame's lists.
pub(crate) fn add(
    mesh: &Mesh,
    placement: &Placement,
    eye: &Eye<'_>,
    faces: &mut Vec<Shade>,
    moments: &mut [Vec<ScreenTriangle>; MOMENTS],
) {
    let transform = Transform::new(placement, eye.lens);
    let first = faces.len();
    let ground: Vec<Vec3> = mesh.vertices.iter().map(|v| apply(&transform.rotation, transform.at, *v)).collect();
    for face in &mesh.faces {
        let corners = face.corners.map(|corner| ground[usize::from(corner)]);
        let radiance = lit(&corners, &face.surface, eye);
        let (map, offset) = match face.surface.texture {
            Texture::Plain => ([[0.0; 3]; 2], [0.0; 2]),
            _ => texture_map(mesh, usize::from(face.map), &transform),
        };
        faces.push(Shade { radiance, texture: face.surface.texture, map, offset, instance: placement.instance });
    }
    let mut camera = vec![[0.0; 3]; mesh.vertices.len()];
    for (moment, triangles) in moments.iter_mut().enumerate() {
        let late = f64::from(eye.light.exposure_s) * moment_offset(moment);
        let moved = [placement.velocity[0] * late, placement.velocity[1] * late];
        let shift = eye.lens.in_camera([placement.at[0] + moved[0], placement.at[1] + moved[1], 0.0]);
        let at = shift.map(|part| part as f32);
        for (to, from) in camera.iter_mut().zip(&mesh.vertices) {
            *to = apply(&transform.camera_rotation, at, *from);
        }
        for (place, face) in mesh.faces.iter().enumerate() {
            let corners = face.corners.map(|corner| camera[usize::from(corner)]);
            project(corners, eye.lens.focal_px as f32, (first + place) as u32, triangles);
        }
    }
}

/// When a moment lies in the exposure: −½ … ½ of it.
pub(crate) fn moment_offset(moment: usize) -> f64 {
    (moment as f64 + 0.5) / MOMENTS as f64 - 0.5
}

/// What it takes to light a face.
pub(crate) struct Eye<'a> {
    /// The lens.
    pub(crate) lens: &'a Lens,
    /// The light.
    pub(crate) light: &'a Illumination,
    /// Whether the indicator on the left (`true`) or right side shines.
    pub(crate) indicators: [bool; 2],
}

fn lit(corners: &[Vec3; 3], surface: &Surface, eye: &Eye<'_>) -> Vec3 {
    let light = eye.light;
    let normal = normalised(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0])));
    let centre = each(|axis| (corners[0][axis] + corners[1][axis] + corners[2][axis]) / 3.0);
    let to_lens = sub([0.0, 0.0, eye.lens.height_m as f32], centre);
    let distance = dot(to_lens, to_lens).sqrt().max(0.5);
    let view = to_lens.map(|part| part / distance);
    let falls = light.falls_on(normal);
    // E's tail lamps, about where the lens is.
    let tail = light.tail * dot(normal, view).max(0.0) / (distance * distance);
    let emitted = light.emitted(surface.emission, |is_left| eye.indicators[usize::from(!is_left)]);
    // A lamp's beam is narrow.
    let beam = dot(normal, view).max(0.0);
    let mirror = mirrored(normal, view, surface.gloss, light);
    each(|i| {
        let red = if i == 0 { tail } else { 0.05 * tail };
        surface.albedo[i] * (falls[i] + red) + mirror[i] + emitted[i] * beam * beam
    })
}

/// What the clear layer of a face mirrors: the sky above, the road below, the sun where it happens to.
fn mirrored(normal: Vec3, view: Vec3, gloss: f32, light: &Illumination) -> Vec3 {
    /// Reflectance of glass and lacquer at perpendicular incidence.
    const STRAIGHT: f32 = 0.04;
    if gloss == 0.0 {
        return [0.0; 3];
    }
    let cosine = dot(normal, view).clamp(0.0, 1.0);
    // Schlick's approximation of Fresnel's equations (1994).
    let grazing = 1.0 - cosine;
    let squared = grazing * grazing;
    let share = gloss * (STRAIGHT + (1.0 - STRAIGHT) * squared * squared * grazing);
    let bounced = sub(normal.map(|part| 2.0 * cosine * part), view);
    let sky = light.sky(bounced[2].max(0.0));
    let upwards = (bounced[2] * 4.0 + 0.5).clamp(0.0, 1.0);
    let sun = dot(bounced, light.to_sun);
    let glint = if sun > 0.0 { sun * sun * sun * sun * 0.25 * gloss } else { 0.0 };
    each(|i| {
        let road = 0.12 * light.ambient[i];
        share * (road + (sky[i] - road) * upwards) + glint * glint * light.sun[i]
    })
}

fn texture_map(mesh: &Mesh, place: usize, transform: &Transform) -> ([Vec3; 2], [f32; 2]) {
    let map = &mesh.maps[place];
    let origin = apply(&transform.camera_rotation, transform.camera_at, map.origin);
    let axes = [map.u_axis, map.v_axis].map(|axis| apply(&transform.camera_rotation, [0.0; 3], axis));
    (axes, axes.map(|axis| -dot(origin, axis)))
}

/// Reflectance relative to the face's own at texture coordinates (u, v), each 0 … 1.
pub(crate) fn drawn(texture: Texture, u: f32, v: f32) -> f32 {
    let stripe = |x: f32, count: f32| split(x * count).1;
    match texture {
        Texture::Plain => 1.0,
        Texture::Plate => {
            let glyph = (0.12..0.94).contains(&u) && (0.2..0.8).contains(&v) && stripe(u, 8.0) < 0.62;
            if glyph && (stripe(u, 21.0) < 0.6 || stripe(v, 3.0) < 0.4) { 0.08 } else { 1.0 }
        }
        Texture::Grille => {
            if stripe(v, 5.0) < 0.35 {
                2.5
            } else {
                0.4
            }
        }
        Texture::Panel => {
            let rib = if stripe(u, 24.0) < 0.08 { 0.75 } else { 1.0 };
            let sign = (0.25..0.75).contains(&u) && (0.35..0.7).contains(&v) && stripe(u, 11.0) < 0.6;
            if sign { 0.35 } else { rib }
        }
        Texture::Glass => {
            // Seats and occupants show against the light from behind.
            let seat = (v < 0.45 && stripe(u * 1.1 + 0.2, 2.0) < 0.45) as u8;
            0.55 + 0.7 * v - 0.15 * f32::from(seat)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::mesh::Emission;

    #[test]
    fn moments_are_spread_evenly_about_the_middle_of_the_exposure() {
        let sum: f64 = (0..MOMENTS).map(moment_offset).sum();
        assert!(sum.abs() < 1e-12);
        assert!((moment_offset(MOMENTS - 1) - moment_offset(0) - 0.75).abs() < 1e-12);
    }

    #[test]
    fn a_plate_has_glyphs_and_a_margin() {
        assert_eq!(drawn(Texture::Plate, 0.02, 0.5), 1.0);
        assert!((0..100).any(|step| drawn(Texture::Plate, step as f32 / 100.0, 0.5) < 0.5));
        assert_eq!(Emission::None, Surface::PLATE.emission);
    }
}
