//! One exposure of the rear camera: the scene, prepared so that `draw.rs` can render any of its
//! pixels.
//!
//! ```text
//!   bodies ─ shaded, projected at 4 moments ─▶ visible face of each sample ─▶ radiance ─▶ air ─▶ mean of 4
//!   ground, sky ─────────────────────────────▶ if no face is visible ─────────────▲                 │
//!                                          bytes ◀─ noise, exposure ◀─ window ◀─ glow ◀─ spray ◀────┘
//! ```
//!
//! **A crop is identical to the same pixels of the whole image, bit for bit**, because a pixel is a
//! function of (scene, pixel, key) alone. The frame leaves out bodies, shadows, spray clouds and
//! halos that cannot reach the requested pixels. Their bounds are never too small, and each
//! contributes exactly nothing outside its bounds.

use closecall_traffic::{Indicator, Time, maths};

use super::body::{Corner, MOMENTS, Placement, Shade, Shading, add_body, moment_offset};
use super::bounds::{Bounds, touches};
use super::effects::Effects;
use super::glow::Glow;
use super::ground::{BEAM_M, CONTACT_SHADOW_M, Ground, LONGEST_SHADOW_M, Patch, PatchKind};
use super::hash::{mix, normal3};
use super::light::Illumination;
use super::line_memory::LineMemory;
use super::mesh::{Emission, Mesh, Vec3};
use super::picture::PixelRect;
use super::pinhole::{GroundBox, Lens};
use super::raster::{SUBPIXEL_STEPS, ScreenTriangle, Visibility};
use super::shapes::Roadside;
use super::spray::{self, Cloud};
use super::veil::Veil;
use super::window::RearWindow;
use super::{Camera, ExposureKey, shapes};
use closecall_traffic::{Scene, SceneVehicle};

/// Longitudinal distance beyond which vehicles are not rendered (m).
const MAX_DISTANCE_M: f64 = 400.0;
/// Offset within the pixel of the sample of each moment (1/256 px). Together they form a rotated
/// grid.
const SUBPIXEL_OFFSETS: [[i32; 2]; MOMENTS] = [[32, 160], [96, 32], [224, 96], [160, 224]];
/// Margin by which bounds are enlarged to cover vibration, motion within the exposure, and rounding
/// (px of the usual image).
const MARGIN_PX: f64 = 24.0;
/// Maximum shift of the image by vibration during an exposure (px of the usual image).
const MAX_SHAKE_PX: f64 = 6.0;
/// Interval at which the pattern of drops on the window changes, because drops move and are wiped
/// away.
const DROP_PATTERN_PERIOD: Time = Time::from_ms(400);
/// Period of a blinking indicator, which shines during the first half.
const BLINK_PERIOD: Time = Time::from_ms(700);

/// The triangles of one body.
pub(super) struct Object {
    pub(super) bounds: Bounds,
    /// For each moment, the range of the body's triangles in [`FrameBuffers::triangles`].
    pub(super) triangles: [std::ops::Range<usize>; MOMENTS],
}

/// One exposure of the rear camera.
pub struct Frame {
    pub(super) lens: Lens,
    pub(super) light: Illumination,
    pub(super) ground: Ground,
    pub(super) window: RearWindow,
    /// Offset within the pixel of the sample of each moment, including vibration (1/256 px).
    pub(super) subpixel: [[i32; 2]; MOMENTS],
    /// Distance that the ego has moved along s at each moment, relative to the middle of the
    /// exposure (m).
    pub(super) travelled_m: [f32; MOMENTS],
    /// Speed of the ego (m/s).
    pub(super) ego_speed_mps: f64,
    /// Yaw of the ego in the plane plus the yaw of the camera (rad), from which the textures of
    /// woods and clouds count.
    pub(super) bearing_rad: f32,
    pub(super) lists: FrameBuffers,
}

/// The buffers of a frame, which the next frame can reuse to avoid allocations.
#[derive(Default)]
pub struct FrameBuffers {
    pub(super) objects: Vec<Object>,
    pub(super) triangles: [Vec<ScreenTriangle>; MOMENTS],
    pub(super) faces: Vec<Shade>,
    pub(super) patches: Vec<(Bounds, Patch)>,
    pub(super) clouds: Vec<(Bounds, Cloud)>,
    pub(super) glows: Vec<(Bounds, Glow)>,
    pub(super) veils: Vec<Veil>,
    pub(super) visibility: Visibility,
    /// The effects that may touch the pixels to render.
    pub(super) effects: Effects,
    /// Memory of the row that is being rendered.
    pub(super) line: LineMemory,
    /// The body that is being added, and its corners in camera axes.
    mesh: Mesh,
    corners: Vec<Corner>,
    roadside: Vec<Roadside>,
}

impl std::fmt::Debug for FrameBuffers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FrameBuffers").field("faces", &self.faces.len()).finish_non_exhaustive()
    }
}

impl FrameBuffers {
    fn clear(&mut self) {
        self.objects.clear();
        self.triangles.iter_mut().for_each(Vec::clear);
        self.faces.clear();
        self.patches.clear();
        self.clouds.clear();
        self.glows.clear();
        self.veils.clear();
    }
}

impl Frame {
    /// Prepares the exposure for rendering within the rectangles `regions`. Pixels outside of them
    /// are not valid.
    pub fn new(camera: &Camera, scene: &Scene<'_>, key: ExposureKey, regions: &[PixelRect]) -> Self {
        Self::with_buffers(FrameBuffers::default(), camera, scene, key, regions)
    }

    /// Prepares the exposure like [`Frame::new`], but reuses the buffers of an earlier frame.
    pub fn with_buffers(
        mut lists: FrameBuffers,
        camera: &Camera,
        scene: &Scene<'_>,
        key: ExposureKey,
        regions: &[PixelRect],
    ) -> Self {
        lists.clear();
        let lens = Lens::new(camera, &scene.ego);
        let ego = &scene.ego.state;
        let yaw = scene.road.plane_pose(ego.s_m, ego.d_m, ego.heading_rad).yaw_rad;
        let light = Illumination::new(scene.environment, camera, ego, yaw);
        let (sin, cos) = maths::sin_cos(ego.heading_rad);
        let (s_m, d_m) =
            (ego.s_m + lens.ahead_m * cos - lens.left_m * sin, ego.d_m + lens.ahead_m * sin + lens.left_m * cos);
        let drops = scene.time.ns() / DROP_PATTERN_PERIOD.ns();
        let mut frame = Self {
            lens,
            ground: Ground::new(scene.road, s_m, d_m, ego.heading_rad),
            window: RearWindow {
                dirt: camera.dirt as f32,
                drops_key: mix(drops as u64),
                noise_key: key.0,
                image: camera.resolution,
            },
            subpixel: shaken_offsets(camera, &light, &lens, key),
            travelled_m: [0, 1, 2, 3].map(|moment| (ego.speed_mps * moment_offset(moment)) as f32 * light.exposure_s),
            light,
            ego_speed_mps: ego.speed_mps,
            bearing_rad: (yaw + camera.yaw_rad) as f32,
            lists,
        };
        for (index, vehicle) in scene.others.iter().enumerate() {
            frame.add_vehicle(scene, vehicle, u16::try_from(index + 1).unwrap_or(0), regions);
        }
        frame.add_roadside(scene, s_m, regions);
        frame.add_ghosts_of_the_sun();
        let ego_clouds = spray::clouds_behind(
            &scene.ego,
            scene,
            [-lens.ahead_m as f32, -lens.left_m as f32],
            [1.0, 0.0],
            lens.height_m as f32,
            key.0,
        );
        frame.add_clouds(ego_clouds.into_iter().flatten());
        frame
    }

    /// Returns the buffers, for reuse by the next frame.
    pub fn into_buffers(self) -> FrameBuffers {
        self.lists
    }

    fn add_vehicle(&mut self, scene: &Scene<'_>, vehicle: &SceneVehicle, instance: u16, regions: &[PixelRect]) {
        let (at, heading) = self.lens.pose_in_ground(scene, vehicle);
        if !(at[0].abs() < MAX_DISTANCE_M) {
            return;
        }
        let (sin, cos) = maths::sin_cos(heading);
        let size = vehicle.vehicle.dimensions;
        let ego = &scene.ego.state;
        let speed = vehicle.state.speed_mps;
        let placement = Placement {
            at,
            turn: [cos, sin],
            pitch_rad: vehicle.pitch_rad,
            velocity: [speed * cos - ego.speed_mps, speed * sin],
            instance,
        };
        let body = GroundBox {
            x_m: at[0],
            y_m: at[1],
            heading_rad: heading,
            length_m: size.length_m + 0.4,
            width_m: size.width_m + 0.6,
            height_m: size.height_m + 0.3,
        };
        self.add_patches(&body, size.height_m);
        let turn = [cos as f32, sin as f32];
        let clouds = spray::clouds_behind(
            vehicle,
            scene,
            at.map(|x| x as f32),
            turn,
            self.lens.height_m as f32,
            self.window.noise_key,
        );
        self.add_clouds(clouds.into_iter().flatten());
        let bounds = self.bounds_of(&self.while_read(&placement, body));
        let lamps_matter = self.light.is_dark() && bounds.is_some();
        let is_wanted =
            bounds.is_some_and(|bounds| regions.iter().any(|region| touches(&bounds, &bounds_of_rect(region))));
        if !(is_wanted || lamps_matter) {
            return;
        }
        let mut mesh = std::mem::take(&mut self.lists.mesh);
        shapes::build_vehicle(&mut mesh, &vehicle.vehicle);
        let indicators = blinking(vehicle.state.indicator, scene.time);
        if lamps_matter {
            self.add_glows(&mesh, &placement, indicators);
        }
        if let (true, Some(bounds)) = (is_wanted, bounds) {
            self.add_object(&mesh, &placement, indicators, bounds);
        }
        self.lists.mesh = mesh;
    }

    fn add_object(&mut self, mesh: &Mesh, placement: &Placement, indicators: [bool; 2], bounds: Bounds) {
        let before: [usize; MOMENTS] = std::array::from_fn(|moment| self.lists.triangles[moment].len());
        let shading = Shading { lens: &self.lens, light: &self.light, indicators };
        let out = (&mut self.lists.faces, &mut self.lists.triangles);
        add_body(mesh, placement, &shading, out, &mut self.lists.corners);
        let triangles = std::array::from_fn(|moment| before[moment]..self.lists.triangles[moment].len());
        self.lists.objects.push(Object { bounds, triangles });
    }

    fn add_roadside(&mut self, scene: &Scene<'_>, s_m: f64, regions: &[PixelRect]) {
        let (mut bodies, mut mesh) = (std::mem::take(&mut self.lists.roadside), std::mem::take(&mut self.lists.mesh));
        shapes::roadside(scene.road, s_m, &mut bodies);
        for body in &bodies {
            let mut anchor = SceneVehicle { pitch_rad: 0.0, ..scene.ego };
            anchor.state = closecall_traffic::VehicleState { s_m: body.s_m, d_m: body.d_m, ..Default::default() };
            let (at, heading) = self.lens.pose_in_ground(scene, &anchor);
            let [half_length, half_width, height_m] = body.extent_m.map(f64::from);
            let (sin, cos) = maths::sin_cos(heading);
            let velocity = [-scene.ego.state.speed_mps, 0.0];
            let placement = Placement { at, turn: [cos, sin], pitch_rad: 0.0, velocity, instance: 0 };
            let around = GroundBox {
                x_m: at[0],
                y_m: at[1],
                heading_rad: heading,
                length_m: 2.0 * half_length,
                width_m: 2.0 * half_width,
                height_m,
            };
            let Some(bounds) = self.bounds_of(&self.while_read(&placement, around)) else { continue };
            if !regions.iter().any(|region| touches(&bounds, &bounds_of_rect(region))) {
                continue;
            }
            body.build(&mut mesh);
            self.add_object(&mesh, &placement, [false; 2], bounds);
        }
        (self.lists.roadside, self.lists.mesh) = (bodies, mesh);
    }

    fn add_patches(&mut self, body: &GroundBox, height_m: f64) {
        let (sin, cos) = maths::sin_cos(body.heading_rad);
        let patch = Patch {
            at: [body.x_m as f32, body.y_m as f32],
            turn: [cos as f32, sin as f32],
            extent: [(body.length_m / 2.0 - 0.2) as f32, (body.width_m / 2.0 - 0.3) as f32, height_m as f32],
            kind: PatchKind::Shadow,
        };
        let sun = if self.light.sun[0] > 0.0 { f64::from(LONGEST_SHADOW_M) } else { 0.0 };
        let grown = 2.0 * (f64::from(CONTACT_SHADOW_M) + sun);
        let shadow =
            GroundBox { length_m: body.length_m + grown, width_m: body.width_m + grown, height_m: 0.0, ..*body };
        if let Some(bounds) = self.bounds_of(&shadow) {
            self.lists.patches.push((bounds, patch));
        }
        if self.light.is_dark() {
            let [far, wide] = BEAM_M.map(f64::from);
            let ahead = (body.length_m + far) / 2.0;
            let lit = GroundBox {
                x_m: body.x_m + ahead * cos,
                y_m: body.y_m + ahead * sin,
                length_m: far + 1.0,
                width_m: 2.0 * wide,
                height_m: 0.0,
                ..*body
            };
            if let Some(bounds) = self.bounds_of(&lit) {
                self.lists.patches.push((bounds, Patch { kind: PatchKind::Beam, ..patch }));
            }
        }
    }

    fn add_clouds(&mut self, clouds: impl IntoIterator<Item = Cloud>) {
        for cloud in clouds {
            let radius = f64::from(cloud.radius_m);
            let [x, y, up] = cloud.at.map(f64::from);
            let corners: [[f64; 3]; 8] = std::array::from_fn(|corner| {
                let sign = |bit: usize| if corner >> bit & 1 == 0 { -radius } else { radius };
                self.lens.in_camera([x + sign(0), y + sign(1), up + self.lens.height_m + sign(2)])
            });
            if let Some(bounds) = self.lens.bounds(&corners) {
                let bounds = self.widened(bounds);
                self.lists.clouds.push((bounds, cloud));
            }
        }
    }

    fn add_glows(&mut self, mesh: &Mesh, placement: &Placement, indicators: [bool; 2]) {
        let [cos, sin] = placement.turn;
        let distance = (placement.at[0].powi(2) + placement.at[1].powi(2)).sqrt().max(1.0);
        let facing = -(cos * placement.at[0] + sin * placement.at[1]) / distance;
        for lamp in &mesh.lamps {
            let [x, y, z] = lamp.at.map(f64::from);
            let ground = [placement.at[0] + cos * x - sin * y, placement.at[1] + sin * x + cos * y];
            let radiance = self.light.emitted_radiance(lamp.emission, |is_left| indicators[usize::from(!is_left)]);
            let mut camera = self.lens.in_camera([ground[0], ground[1], z]);
            if self.lens.readout_s > 0.0 {
                camera = self.lens.when_read(camera, placement.velocity);
            }
            if camera[2] < 1.0 || radiance[0] <= 0.0 {
                continue;
            }
            let project = |point: [f64; 3]| self.lens.pixel(point).map(|x| x as f32);
            let left = self.light.transmission(camera[2] as f32);
            let strength = if lamp.emission == Emission::Headlamp { 1.0 } else { 0.15 };
            let at_px = project(camera);
            let scale = self.lens.image.scale() as f32;
            let halo = Glow::halo(at_px, camera[2] as f32, facing as f32, radiance.map(|x| x * left * strength))
                .enlarged(scale);
            self.lists.glows.push((halo.bounds(), halo));
            let mirrored = self.lens.in_camera([ground[0], ground[1], -z]);
            if self.light.wetness > 0.0 && mirrored[2] > 1.0 {
                let streak = Glow::streak(project(mirrored), &halo, self.light.wetness);
                self.lists.glows.push((streak.bounds(), streak));
            }
            if lamp.emission == Emission::Headlamp {
                let irradiance = self.light.headlamp_irradiance(camera[2] as f32, facing as f32) * left;
                self.add_ghosts(at_px, [irradiance; 3]);
            }
        }
    }

    /// Adds the ghosts of a source of light at a position in the image (px), which illuminates the
    /// lens so much.
    fn add_ghosts(&mut self, source_px: [f32; 2], irradiance: Vec3) {
        let reflectance = self.lens.optics.surface_reflectance as f32;
        if reflectance > 0.0 {
            let reflected = irradiance.map(|part| part * reflectance * reflectance);
            let ghosts = Glow::ghosts(source_px, reflected, self.lens.image);
            self.lists.glows.extend(ghosts.map(|ghost| (ghost.bounds(), ghost)));
        }
    }

    fn add_ghosts_of_the_sun(&mut self) {
        let towards = self.lens.direction_in_camera(self.light.to_sun.map(f64::from));
        if self.light.sun[0] > 0.0 && towards[2] > 0.0 {
            let at_px = self.lens.pixel(towards).map(|part| part as f32);
            // The light of the sun is the radiance of a white, matt surface that faces the sun:
            // E/π.
            self.add_ghosts(at_px, self.light.sun.map(|part| std::f32::consts::PI * part));
        }
    }

    /// Returns a box around all places at which a body is while a rolling shutter reads the image.
    fn while_read(&self, placement: &Placement, body: GroundBox) -> GroundBox {
        let ([x, y], [cos, sin]) = (placement.velocity, placement.turn);
        let [along_m, across_m] =
            [x * cos + y * sin, y * cos - x * sin].map(|speed_mps| speed_mps.abs() * self.lens.readout_s);
        GroundBox { length_m: body.length_m + along_m, width_m: body.width_m + across_m, ..body }
    }

    /// Returns the bounds in the image of a box given in the ground frame, never too small. Returns
    /// `None` if the box is not visible.
    fn bounds_of(&self, body: &GroundBox) -> Option<Bounds> {
        let corners = body.corners().map(|corner| self.lens.in_camera(corner));
        self.lens.bounds(&corners).map(|bounds| self.widened(bounds))
    }

    fn widened(&self, [left, top, right, bottom]: [f64; 4]) -> Bounds {
        let margin_px = MARGIN_PX * self.lens.image.scale().max(1.0);
        [left - margin_px, top - margin_px, right + margin_px, bottom + margin_px].map(|bound| bound as f32)
    }
}

fn bounds_of_rect(rect: &PixelRect) -> Bounds {
    let (right, bottom) = (i64::from(rect.left) + i64::from(rect.width), i64::from(rect.top) + i64::from(rect.height));
    [rect.left as f32, rect.top as f32, right as f32, bottom as f32]
}

/// Returns whether the left and the right indicator shine at this time.
fn blinking(indicator: Indicator, time: Time) -> [bool; 2] {
    let on = time.ns().rem_euclid(BLINK_PERIOD.ns()) < BLINK_PERIOD.ns() / 2;
    [on && indicator == Indicator::Left, on && indicator == Indicator::Right]
}

/// Returns the offset within the pixel of the sample of each moment, for a camera that rotates at a
/// constant rate during the exposure.
fn shaken_offsets(camera: &Camera, light: &Illumination, lens: &Lens, key: ExposureKey) -> [[i32; 2]; MOMENTS] {
    let [yaw, pitch, _] = normal3(mix(key.0 ^ 0x7368_616b));
    let max_px = MAX_SHAKE_PX * lens.image.scale();
    #[expect(clippy::cast_possible_truncation, reason = "limited to a few pixels before the cast")]
    let shift = |rate: f32, moment: usize| {
        let turned = camera.vibration_radps * f64::from(rate * light.exposure_s) * moment_offset(moment);
        ((turned * lens.focal_px).clamp(-max_px, max_px) * f64::from(SUBPIXEL_STEPS)) as i32
    };
    std::array::from_fn(|moment| {
        let [x, y] = SUBPIXEL_OFFSETS[moment];
        [x + shift(yaw, moment), y + shift(pitch, moment)]
    })
}
