//! The picture that an aerial camera takes of vehicles on a road, with labels.

use closecall_sensors::camera::{BodyTriangle, CHANNELS, Image, body_triangles};
use closecall_traffic::{Vehicle, maths};

use crate::aerial::camera::{AerialCamera, Vec3};
use crate::aerial::ground::{Ground, unit};
use crate::aerial::image_box::ImageBox;
use crate::aerial::raster::{Corner, Samples};

/// Samples for each pixel along each axis, unless the picture is reduced afterwards.
const SAMPLES: usize = 2;
/// Share of a box's area that has to show the vehicle, so that the label counts as visible.
const VISIBLE_SHARE: f64 = 0.35;
/// Standard deviation of the noise of a pixel (steps of 255).
const NOISE: f64 = 2.5;

/// A vehicle on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundVehicle {
    /// Number of the vehicle.
    pub id: u64,
    /// Class, size, body shape and paint.
    pub vehicle: Vehicle,
    /// Position of the centre of its box (m).
    pub at_m: [f64; 2],
    /// Heading from the x axis, counter-clockwise (rad).
    pub yaw_rad: f64,
    /// Colour of all parts that are neither glass nor rubber nor dark plastic, linear red, green
    /// and blue; `None` for the triangles of the body.
    pub livery: Option<[f64; 3]>,
}

impl GroundVehicle {
    /// Returns a point of the vehicle's frame in the ground frame (m).
    fn place(&self, [x, y, z]: Vec3) -> Vec3 {
        let (sin, cos) = maths::sin_cos(self.yaw_rad);
        [self.at_m[0] + cos * x - sin * y, self.at_m[1] + sin * x + cos * y, z]
    }
}

/// The light of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Direction of the sun from the x axis (rad).
    pub azimuth_rad: f64,
    /// Elevation of the sun (rad).
    pub elevation_rad: f64,
    /// Share of the light that comes from the sun and not from the sky (0 to 1).
    pub direct: f64,
    /// Factor of the exposure (-).
    pub exposure: f64,
}

impl Light {
    /// A clear day at noon.
    pub const NOON: Self = Self { azimuth_rad: -1.2, elevation_rad: 0.9, direct: 0.6, exposure: 1.0 };

    fn to_sun(self) -> Vec3 {
        let ((sin_az, cos_az), (sin_el, cos_el)) =
            (maths::sin_cos(self.azimuth_rad), maths::sin_cos(self.elevation_rad));
        [cos_el * cos_az, cos_el * sin_az, sin_el]
    }
}

/// Everything that a picture shows.
#[derive(Clone, Debug)]
pub struct AerialScene {
    /// The ground.
    pub ground: Ground,
    /// The vehicles.
    pub vehicles: Vec<GroundVehicle>,
    /// The light.
    pub light: Light,
    /// Key of the noise.
    pub key: u64,
}

/// The label of a vehicle in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Label {
    /// Number of the vehicle.
    pub id: u64,
    /// The tight box around the visible body, turned to the heading.
    pub image_box: ImageBox,
    /// True if at least a third of the box shows the vehicle. Otherwise it lies outside the picture
    /// or behind another vehicle.
    pub is_visible: bool,
}

/// A picture with the labels of its vehicles.
#[derive(Clone, Debug)]
pub struct AerialPicture {
    /// The picture.
    pub image: Image,
    /// A label for each vehicle in front of the camera.
    pub labels: Vec<Label>,
}

/// Renders a picture. The same scene and camera give the same bytes.
pub fn render(scene: &AerialScene, camera: &AerialCamera) -> AerialPicture {
    render_sampled(scene, camera, SAMPLES)
}

/// Renders a picture with this number of samples for each pixel along each axis.
pub(crate) fn render_sampled(scene: &AerialScene, camera: &AerialCamera, per_axis: usize) -> AerialPicture {
    let [width, height] = camera.view().size_px;
    let mut samples = Samples::new(width * per_axis, height * per_axis);
    let mut colours: Vec<([f64; 3], usize)> = vec![([0.0; 3], usize::MAX)];
    let mut labels = Vec::new();
    for (index, vehicle) in scene.vehicles.iter().enumerate() {
        let triangles = body_triangles(&vehicle.vehicle);
        if let Some(image_box) = label_box(vehicle, &triangles, camera) {
            labels.push((index, Label { id: vehicle.id, image_box, is_visible: false }));
        }
        draw_body(scene, camera, (vehicle, &triangles, index), (&mut samples, &mut colours), per_axis);
    }
    let mut shown = vec![0_usize; scene.vehicles.len()];
    for face in &samples.face {
        if let Some(count) = shown.get_mut(colours[*face as usize].1) {
            *count += 1;
        }
    }
    let labels = labels.into_iter().map(|(index, label)| {
        let area = label.image_box.length_px * label.image_box.width_px * (per_axis * per_axis) as f64;
        Label { is_visible: shown[index] as f64 >= VISIBLE_SHARE * area, ..label }
    });
    let labels = labels.collect();
    AerialPicture { image: develop(scene, camera, &samples, &colours, per_axis), labels }
}

/// Draws the body of a vehicle and its shadow; each face gets a colour.
fn draw_body(
    scene: &AerialScene,
    camera: &AerialCamera,
    (vehicle, triangles, index): (&GroundVehicle, &[BodyTriangle], usize),
    (samples, colours): (&mut Samples, &mut Vec<([f64; 3], usize)>),
    per_axis: usize,
) {
    let to_sun = scene.light.to_sun();
    let on_ground = |p: Vec3| [p[0] - to_sun[0] * p[2] / to_sun[2], p[1] - to_sun[1] * p[2] / to_sun[2], 0.0];
    let sampled = |point: Vec3| -> Option<Corner> {
        let [column, row, depth] = camera.project_with_depth(point)?;
        Some([column * per_axis as f64, row * per_axis as f64, depth])
    };
    let corners = |points: [Vec3; 3]| -> Option<[Corner; 3]> {
        let [a, b, c] = points.map(&sampled);
        Some([a?, b?, c?])
    };
    for triangle in triangles {
        let points = triangle.corners_m.map(|corner| vehicle.place(corner.map(f64::from)));
        if let Some(corners) = corners(points) {
            colours.push((shaded(points, albedo(vehicle, triangle), scene.light), index));
            samples.draw(&corners, u32::try_from(colours.len() - 1).unwrap_or(0));
        }
        if let Some(corners) = corners(points.map(on_ground)) {
            samples.shade(&corners);
        }
    }
}

/// Returns the reflectance of a face.
fn albedo(vehicle: &GroundVehicle, triangle: &BodyTriangle) -> [f64; 3] {
    /// Reflectance up to which a face is of glass, rubber or dark plastic.
    const DARK: f64 = 0.06;
    let albedo = triangle.albedo.map(f64::from);
    vehicle.livery.filter(|_| albedo.iter().any(|value| *value > DARK)).unwrap_or(albedo)
}

/// Returns the colour of a face in the light.
fn shaded([a, b, c]: [Vec3; 3], albedo: [f64; 3], light: Light) -> [f64; 3] {
    let (u, v) = ([0, 1, 2].map(|axis| b[axis] - a[axis]), [0, 1, 2].map(|axis| c[axis] - a[axis]));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = normal.iter().map(|part| part * part).sum::<f64>().sqrt().max(1e-12);
    let to_sun = light.to_sun();
    let facing = (0..3).map(|axis| normal[axis] * to_sun[axis]).sum::<f64>() / length;
    // The sky lights upward faces fully and upright faces by half.
    let sky = (1.0 - light.direct) * (0.5 + 0.5 * normal[2] / length);
    albedo.map(|value| value * (sky + light.direct * facing.max(0.0) / to_sun[2].max(0.2)))
}

/// Returns the exact box around each vehicle, with its index; `None` for a vehicle that is not in
/// front of the camera.
pub(crate) fn exact_boxes(scene: &AerialScene, camera: &AerialCamera) -> Vec<(usize, ImageBox)> {
    let boxes =
        scene.vehicles.iter().enumerate().filter_map(|(index, vehicle)| {
            Some((index, label_box(vehicle, &body_triangles(&vehicle.vehicle), camera)?))
        });
    boxes.collect()
}

/// Returns the tight box around the corners of a body, turned to the heading.
fn label_box(vehicle: &GroundVehicle, triangles: &[BodyTriangle], camera: &AerialCamera) -> Option<ImageBox> {
    let at = camera.project(vehicle.place([0.0; 3]))?;
    let ahead = camera.project(vehicle.place([1.0, 0.0, 0.0]))?;
    let angle_rad = maths::atan2(ahead[1] - at[1], ahead[0] - at[0]);
    let corners = triangles.iter().flat_map(|triangle| triangle.corners_m);
    let pixels: Option<Vec<[f64; 2]>> =
        corners.map(|corner| camera.project(vehicle.place(corner.map(f64::from)))).collect();
    ImageBox::around(&pixels?, angle_rad)
}

/// Turns samples into an image: colours, the mean of the samples of each pixel, gamma, noise.
fn develop(
    scene: &AerialScene,
    camera: &AerialCamera,
    samples: &Samples,
    colours: &[([f64; 3], usize)],
    per_axis: usize,
) -> Image {
    /// Linear value that saturates the sensor at exposure 1.
    const WHITE: f64 = 0.75;
    let [width, height] = camera.view().size_px;
    let mut rgb = vec![0; width * height * CHANNELS];
    let sky = 1.0 - scene.light.direct;
    for row in 0..height {
        for column in 0..width {
            let mut sum = [0.0; 3];
            let grid = (0..per_axis).flat_map(|dy| (0..per_axis).map(move |dx| (dx, dy)));
            for (dx, dy) in grid {
                let index = (row * per_axis + dy) * width * per_axis + column * per_axis + dx;
                let colour = match samples.face[index] {
                    0 => {
                        let offset = |part: usize| (part as f64 + 0.5) / per_axis as f64;
                        let at = camera.ground_at([column as f64 + offset(dx), row as f64 + offset(dy)]);
                        let light = if samples.is_shadowed[index] { sky } else { 1.0 };
                        at.map_or([0.6; 3], |at| scene.ground.albedo(at).map(|value| value * light))
                    }
                    face => colours[face as usize].0,
                };
                (0..3).for_each(|channel| sum[channel] += colour[channel]);
            }
            for (channel, sum) in sum.iter().enumerate() {
                let linear = scene.light.exposure * sum / ((per_axis * per_axis) as f64 * WHITE);
                let noise = gaussian(scene.key, row * width + column, channel);
                let encoded = 255.0 * linear.max(0.0).sqrt() + NOISE * noise;
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
                let byte = encoded.round().clamp(0.0, 255.0) as u8;
                rgb[(row * width + column) * CHANNELS + channel] = byte;
            }
        }
    }
    let side = |side: usize| u32::try_from(side).unwrap_or(0);
    Image { width: side(width), height: side(height), rgb }
}

/// Returns noise of unit variance, as the sum of three uniform numbers.
fn gaussian(key: u64, pixel: usize, channel: usize) -> f64 {
    let part =
        |index: u64| unit(key.wrapping_add(index << 48 | (channel as u64) << 40), pixel as f64, index as f64) - 0.5;
    2.0 * (part(1) + part(2) + part(3))
}
