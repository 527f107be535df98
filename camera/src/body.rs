//! Shading and projection of a body: its faces are lit once, and its triangles are projected once for each moment of
//! the exposure.

use super::hash::split;
use super::light::Illumination;
use super::mesh::{Mesh, Surface, Texture, Vec3, add_scaled, cross, dot, each, normalised, sub};
use super::pinhole::Lens;
use super::raster::{Projection, ScreenTriangle, project};

/// Number of moments within one exposure at which the scene is sampled, once per pixel each. The mean over these
/// samples blurs moving objects and smooths edges (Haeberli and Akeley, *The accumulation buffer*, 1990).
pub(crate) const MOMENTS: usize = 4;

/// The properties of a shaded face that a sample of it needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade {
    /// Radiance towards the lens, before texture and air are applied.
    pub(crate) radiance: Vec3,
    /// The pattern drawn onto the face.
    pub(crate) texture: Texture,
    /// Coefficients of the texture coordinates: `u = map[0] · p + offset[0]` for the position p in camera axes, and
    /// likewise v.
    pub(crate) map: [Vec3; 2],
    /// Constants of the texture coordinates, see `map`.
    pub(crate) offset: [f32; 2],
    /// Instance number of the vehicle that the face belongs to, or 0 if it belongs to none.
    pub(crate) instance: u16,
}

/// Pose and motion of a body in the ground frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// Position of the body's origin (m).
    pub(crate) at: [f64; 2],
    /// Cosine and sine of the body's heading.
    pub(crate) turn: [f64; 2],
    /// Pitch of the body, positive if its nose points down (rad).
    pub(crate) pitch_rad: f64,
    /// Velocity of the body relative to the lens (m/s).
    pub(crate) velocity: [f64; 2],
    /// Instance number of the body in the ground truth, or 0 if it is no vehicle.
    pub(crate) instance: u16,
}

/// The rotations and translations from the body's frame to the ground frame and to camera axes.
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
        // Small-angle approximation of the pitch: the body's x axis dips, and its z axis leans forward.
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

fn transform_point(rotation: &[Vec3; 3], at: Vec3, point: Vec3) -> Vec3 {
    let mut sum = at;
    for (axis, share) in rotation.iter().zip(point) {
        sum = add_scaled(sum, *axis, share);
    }
    sum
}

/// Shades the faces of a body, projects them for each moment, and appends the results to `faces` and `moments`. `corners` is
/// memory that the next call may reuse.
pub(crate) fn add_body(
    mesh: &Mesh,
    placement: &Placement,
    shading: &Shading<'_>,
    (faces, moments): (&mut Vec<Shade>, &mut [Vec<ScreenTriangle>; MOMENTS]),
    corners: &mut Vec<Vec3>,
) {
    let transform = Transform::new(placement, shading.lens);
    let first = faces.len();
    corners.clear();
    corners.extend(mesh.vertices.iter().map(|v| transform_point(&transform.rotation, transform.at, *v)));
    for face in &mesh.faces {
        let on_ground = face.corners.map(|corner| corners[usize::from(corner)]);
        let radiance = shaded_radiance(&on_ground, &face.surface, shading);
        let (map, offset) = match face.surface.texture {
            Texture::Plain => ([[0.0; 3]; 2], [0.0; 2]),
            _ => texture_map(mesh, usize::from(face.map), &transform),
        };
        faces.push(Shade { radiance, texture: face.surface.texture, map, offset, instance: placement.instance });
    }
    let lens = shading.lens;
    let projection = Projection { focal_px: lens.focal_px as f32, optics: &lens.optics };
    for (moment, triangles) in moments.iter_mut().enumerate() {
        let delay_s = f64::from(shading.light.exposure_s) * moment_offset(moment);
        let moved = [placement.velocity[0] * delay_s, placement.velocity[1] * delay_s];
        let shift = shading.lens.in_camera([placement.at[0] + moved[0], placement.at[1] + moved[1], 0.0]);
        let at = shift.map(|part| part as f32);
        for (to, from) in corners.iter_mut().zip(&mesh.vertices) {
            *to = transform_point(&transform.camera_rotation, at, *from);
            if lens.readout_s > 0.0 {
                *to = lens.when_read(to.map(f64::from), placement.velocity).map(|part| part as f32);
            }
        }
        for (index, face) in mesh.faces.iter().enumerate() {
            let in_camera = face.corners.map(|corner| corners[usize::from(corner)]);
            project(in_camera, projection, (first + index) as u32, triangles);
        }
    }
}

/// Returns the time of a moment relative to the middle of the exposure, in units of the exposure time (−½ to ½).
pub(crate) fn moment_offset(moment: usize) -> f64 {
    (moment as f64 + 0.5) / MOMENTS as f64 - 0.5
}

/// The inputs of shading that are the same for all faces of a body.
pub(crate) struct Shading<'a> {
    /// The lens that looks at the body.
    pub(crate) lens: &'a Lens,
    /// The illumination of the scene.
    pub(crate) light: &'a Illumination,
    /// Whether the left and the right indicator shine.
    pub(crate) indicators: [bool; 2],
}

fn shaded_radiance(corners: &[Vec3; 3], surface: &Surface, shading: &Shading<'_>) -> Vec3 {
    let light = shading.light;
    let normal = normalised(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0])));
    let centre = each(|axis| (corners[0][axis] + corners[1][axis] + corners[2][axis]) / 3.0);
    let to_lens = sub([0.0, 0.0, shading.lens.height_m as f32], centre);
    let distance = dot(to_lens, to_lens).sqrt().max(0.5);
    let view = to_lens.map(|part| part / distance);
    let diffuse = light.diffuse_radiance(normal);
    // The ego's tail lamps illuminate the scene from about the position of the lens.
    let tail = light.tail * dot(normal, view).max(0.0) / (distance * distance);
    let emitted = light.emitted_radiance(surface.emission, |is_left| shading.indicators[usize::from(!is_left)]);
    // The beam of a lamp is narrow, so its radiance falls with the angle.
    let beam = dot(normal, view).max(0.0);
    let mirror = reflected_radiance(normal, view, surface.gloss, light);
    each(|i| {
        let red = if i == 0 { tail } else { 0.05 * tail };
        surface.albedo[i] * (diffuse[i] + red) + mirror[i] + emitted[i] * beam * beam
    })
}

/// Returns the radiance that the clear coat of a face reflects: the sky above, the road below, and the sun near its
/// mirror direction.
fn reflected_radiance(normal: Vec3, view: Vec3, gloss: f32, light: &Illumination) -> Vec3 {
    /// Reflectance of glass and clear coat at perpendicular incidence.
    const PERPENDICULAR_REFLECTANCE: f32 = 0.04;
    if gloss == 0.0 {
        return [0.0; 3];
    }
    let cosine = dot(normal, view).clamp(0.0, 1.0);
    // Schlick's approximation of the Fresnel equations (1994).
    let grazing = 1.0 - cosine;
    let squared = grazing * grazing;
    let share = gloss * (PERPENDICULAR_REFLECTANCE + (1.0 - PERPENDICULAR_REFLECTANCE) * squared * squared * grazing);
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

fn texture_map(mesh: &Mesh, index: usize, transform: &Transform) -> ([Vec3; 2], [f32; 2]) {
    let map = &mesh.maps[index];
    let origin = transform_point(&transform.camera_rotation, transform.camera_at, map.origin);
    let axes = [map.u_axis, map.v_axis].map(|axis| transform_point(&transform.camera_rotation, [0.0; 3], axis));
    (axes, axes.map(|axis| -dot(origin, axis)))
}

/// Returns the factor by which a texture changes the reflectance of its face at the texture coordinates (u, v), each
/// from 0 to 1.
pub(crate) fn texture_factor(texture: Texture, u: f32, v: f32) -> f32 {
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
            // Seats and occupants appear as silhouettes against the light from behind.
            let seat = (v < 0.45 && stripe(u * 1.1 + 0.2, 2.0) < 0.45) as u8;
            0.55 + 0.7 * v - 0.15 * f32::from(seat)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Emission;

    #[test]
    fn moments_are_spread_evenly_about_the_middle_of_the_exposure() {
        let sum: f64 = (0..MOMENTS).map(moment_offset).sum();
        assert!(sum.abs() < 1e-12);
        assert!((moment_offset(MOMENTS - 1) - moment_offset(0) - 0.75).abs() < 1e-12);
    }

    #[test]
    fn a_plate_has_glyphs_and_a_margin() {
        assert_eq!(texture_factor(Texture::Plate, 0.02, 0.5), 1.0);
        assert!((0..100).any(|step| texture_factor(Texture::Plate, step as f32 / 100.0, 0.5) < 0.5));
        assert_eq!(Emission::None, Surface::PLATE.emission);
    }
}
