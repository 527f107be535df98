//! Shading and projection of a body: the faces that can be seen are lit once, and their triangles
//! are projected once for each moment of the exposure. The moments share a vector, and each lane
//! has the bits of a single moment.

use wide::f32x4;

use super::hash::split;
use super::light::Illumination;
use super::mesh::{Mesh, Surface, Texture, Vec3, add_scaled, cross, dot, each, normalised, sub};
use super::pinhole::Lens;
use super::raster::{Facing, Projection, ScreenTriangle, project};

/// Number of moments within one exposure at which the scene is sampled, once per pixel each. The
/// mean over these samples blurs moving objects and smooths edges (Haeberli and Akeley, *The
/// accumulation buffer*, 1990).
pub(crate) const MOMENTS: usize = 4;

/// The properties of a shaded face that a sample of it needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade {
    /// Radiance towards the lens, before texture and air are applied.
    pub(crate) radiance: Vec3,
    /// The pattern drawn onto the face.
    pub(crate) texture: Texture,
    /// Coefficients of the texture coordinates: `u = map[0] · p + offset[0]` for the position p in
    /// camera axes, and likewise v.
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
        // Small-angle approximation of the pitch: the body's x axis dips, and its z axis leans
        // forward.
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

/// A corner of a body in camera axes (m): its x, y and z, each by moment.
pub(crate) type Corner = [f32x4; 3];

/// Returns the corners of a body in camera axes, by moment. Each lane takes the steps of a single
/// [`transform_point`].
fn corners_in_camera(
    mesh: &Mesh,
    placement: &Placement,
    transform: &Transform,
    shading: &Shading<'_>,
    corners: &mut Vec<Corner>,
) {
    let lens = shading.lens;
    let shifts: [[f64; 3]; MOMENTS] = std::array::from_fn(|moment| {
        let delay_s = f64::from(shading.light.exposure_s) * moment_offset(moment);
        let moved = [placement.velocity[0] * delay_s, placement.velocity[1] * delay_s];
        lens.in_camera([placement.at[0] + moved[0], placement.at[1] + moved[1], 0.0])
    });
    let at: Corner = each(|axis| shifts.map(|shift| shift[axis] as f32).into());
    corners.clear();
    corners.extend(mesh.vertices.iter().map(|vertex| {
        let mut sum = at;
        for (axis, share) in transform.camera_rotation.iter().zip(*vertex) {
            sum = each(|part| sum[part] + f32x4::splat(axis[part] * share));
        }
        sum
    }));
    if lens.readout_s > 0.0 {
        for corner in corners {
            let mut parts = corner.map(f32x4::to_array);
            for moment in 0..MOMENTS {
                let at = each(|part| f64::from(parts[part][moment]));
                let read = lens.when_read(at, placement.velocity);
                parts.iter_mut().zip(read).for_each(|(part, read)| part[moment] = read as f32);
            }
            *corner = parts.map(f32x4::from);
        }
    }
}

/// Projects the faces of a body for each moment, shades the faces that face the lens, and appends
/// the results to `faces` and `moments`. `corners` is memory that the next call may reuse.
pub(crate) fn add_body(
    mesh: &Mesh,
    placement: &Placement,
    shading: &Shading<'_>,
    (faces, moments): (&mut Vec<Shade>, &mut [Vec<ScreenTriangle>; MOMENTS]),
    corners: &mut Vec<Corner>,
) {
    let transform = Transform::new(placement, shading.lens);
    corners_in_camera(mesh, placement, &transform, shading, corners);
    let lens = shading.lens;
    let middle_px = lens.image.middle_px().map(|part| part as f32);
    let projection = Projection { focal_px: lens.focal_px as f32, middle_px, optics: &lens.optics };
    for face in &mesh.faces {
        let in_camera = face.corners.map(|corner| corners[usize::from(corner)]);
        let edges = [1, 2].map(|to| each(|part| in_camera[to][part] - in_camera[0][part]));
        let normal = crossed(edges[0], edges[1]);
        let offset = normal[0] * in_camera[0][0] + normal[1] * in_camera[0][1] + normal[2] * in_camera[0][2];
        let facing = offset.simd_lt(f32x4::splat(0.0)).to_bitmask();
        if facing == 0 {
            continue;
        }
        let index = faces.len() as u32;
        let (in_camera, normal) = (in_camera.map(|corner| corner.map(f32x4::to_array)), normal.map(f32x4::to_array));
        let offset = offset.to_array();
        for (moment, triangles) in moments.iter_mut().enumerate().filter(|(moment, _)| facing >> moment & 1 == 1) {
            let of_moment = in_camera.map(|corner| corner.map(|part| part[moment]));
            let plane = Facing { normal: normal.map(|part| part[moment]), offset: offset[moment] };
            project(of_moment, plane, projection, index, triangles);
        }
        let on_ground = face
            .corners
            .map(|corner| transform_point(&transform.rotation, transform.at, mesh.vertices[usize::from(corner)]));
        let radiance = shaded_radiance(&on_ground, &face.surface, shading);
        let (map, offset) = match face.surface.texture {
            Texture::Plain => ([[0.0; 3]; 2], [0.0; 2]),
            _ => texture_map(mesh, usize::from(face.map), &transform),
        };
        faces.push(Shade { radiance, texture: face.surface.texture, map, offset, instance: placement.instance });
    }
}

/// [`cross`] of each moment.
fn crossed(a: Corner, b: Corner) -> Corner {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns the time of a moment relative to the middle of the exposure, in units of the exposure
/// time (−½ to ½).
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

/// Returns the radiance that the clear coat of a face reflects: the sky above, the road below, and
/// the sun near its mirror direction.
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

/// Returns the factor by which a texture changes the reflectance of its face at the texture
/// coordinates (u, v), each from 0 to 1.
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
    use closecall_traffic::{Check, Environment, Parameters, SceneVehicle, Vehicle, VehicleClass, VehicleState};

    use super::*;
    use crate::camera::CameraConfig;
    use crate::camera::mesh::Emission;

    #[test]
    fn the_faces_of_a_block_that_face_away_are_neither_shaded_nor_rendered() {
        let camera = CameraConfig::default().check(&Parameters::default()).unwrap();
        let state = VehicleState::default();
        let ego = SceneVehicle { actor: 0, vehicle: Vehicle::typical(VehicleClass::Car), state, pitch_rad: 0.0 };
        let lens = Lens::new(&camera, &ego);
        let light = Illumination::new(&Environment::CLEAR_DAY, &camera, &state, 0.0);
        let mut mesh = Mesh::default();
        mesh.block([0.0, 0.0, 0.5], [0.5; 3], Surface::METAL);
        let placement =
            Placement { at: [-20.0, 0.0], turn: [1.0, 0.0], pitch_rad: 0.0, velocity: [3.0, 0.0], instance: 1 };
        let shading = Shading { lens: &lens, light: &light, indicators: [false; 2] };
        let (mut faces, mut moments) = (Vec::new(), <[Vec<ScreenTriangle>; MOMENTS]>::default());
        add_body(&mesh, &placement, &shading, (&mut faces, &mut moments), &mut Vec::new());
        // Two triangles ahead and two on top. The lens is above the block, and does not see its
        // sides.
        assert_eq!((mesh.faces.len(), faces.len()), (12, 4));
        assert_eq!(moments.map(|triangles| triangles.len()), [4; MOMENTS]);
    }

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
