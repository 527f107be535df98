//! Labelled crops: background, and vehicles in boxes with the errors of LiDAR clusters.

use std::fmt::Write;

use closecall_traffic::{ClassScores, Light, Stream, maths};
use rand::RngExt;

use super::DatasetSummary;
use super::scenes::RandomScene;
use crate::camera::MIN_SHARE_IN_IMAGE;
use crate::camera::{Crop, ExposureKey, Frame, GroundBox, PixelRect, RearCamera};
use crate::{Scene, SceneVehicle};

/// Minimum unoccluded share of a vehicle for it to be labelled (0 to 1).
const MIN_VISIBLE_SHARE: f64 = 0.55;
/// Maximum share of a background window that any vehicle may fill (0 to 1).
const MAX_VEHICLE_SHARE: f64 = 0.10;
/// Number of background windows drawn in one scene.
const BACKGROUND_WINDOWS: usize = 3;

/// The crops and their labels, in the format of the files.
pub(super) struct Crops {
    pub(super) rgb: Vec<u8>,
    pub(super) csv: String,
}

impl Default for Crops {
    fn default() -> Self {
        Self { rgb: Vec::new(), csv: "label,distance_m,light,weather,body_shape,window_px\n".to_owned() }
    }
}

impl Crops {
    /// Adds the crops of one scene.
    pub(super) fn add(&mut self, scene: &RandomScene, rng: &mut Stream, summary: &mut DatasetSummary) {
        let camera = RearCamera::new(scene.camera);
        let key = ExposureKey::draw(rng);
        for index in 0..scene.others.len() {
            let cluster_box = vehicle_cluster_box(scene, &scene.others[index], rng);
            let Some(window) = window(&camera, scene, &cluster_box) else { continue };
            let mut crop = Crop::default();
            let visible = rendered_share(&camera, &scene.scene(), index, window, key, &mut crop);
            let unoccluded_scene = Scene { others: &scene.others[index..=index], ..scene.scene() };
            let unoccluded = rendered_share(&camera, &unoccluded_scene, 0, window, key, &mut Crop::default());
            if visible > 0.01 && visible > MIN_VISIBLE_SHARE * unoccluded {
                let vehicle = &scene.others[index].vehicle;
                self.push(scene, vehicle.class as usize, &cluster_box, &crop, summary);
                let _ = writeln!(self.csv, ",{},{}", vehicle.appearance.body_shape, window.width);
            }
        }
        for _ in 0..BACKGROUND_WINDOWS {
            let cluster_box = background_cluster_box(scene, rng);
            let Some(window) = window(&camera, scene, &cluster_box) else { continue };
            let mut frame = Frame::new(&scene.camera, &scene.scene(), key, &[window]);
            let mut crop = Crop::default();
            frame.crop(window, &mut crop);
            let max_share = (0..scene.others.len()).map(|other| frame.instance_share(other)).fold(0.0, f64::max);
            if max_share <= MAX_VEHICLE_SHARE {
                self.push(scene, ClassScores::BACKGROUND, &cluster_box, &crop, summary);
                let _ = writeln!(self.csv, ",,{}", window.width);
            }
        }
    }

    fn push(
        &mut self,
        scene: &RandomScene,
        label: usize,
        cluster_box: &GroundBox,
        crop: &Crop,
        summary: &mut DatasetSummary,
    ) {
        self.rgb.extend_from_slice(&crop.rgb);
        summary.pictures += 1;
        summary.labels[label] += 1;
        let rear = -cluster_box.x_m - scene.ego.vehicle.dimensions.length_m / 2.0 - cluster_box.length_m / 2.0;
        let light = match scene.environment.light {
            Light::Day => "day",
            Light::Dusk => "dusk",
            Light::Night => "night",
        };
        let environment = &scene.environment;
        let weather = match (environment.rain_mm_per_h > 0.0, environment.visibility_m < 1_000.0) {
            (true, _) => "rain",
            (false, true) => "fog",
            (false, false) => "dry",
        };
        let _ = write!(self.csv, "{label},{rear:.1},{light},{weather}");
    }
}

fn window(camera: &RearCamera, scene: &RandomScene, cluster_box: &GroundBox) -> Option<PixelRect> {
    camera
        .project(&scene.ego, cluster_box)
        .filter(|window| window.share_in_image(camera.camera().resolution) >= MIN_SHARE_IN_IMAGE)
}

/// Renders a crop, and returns the share of its samples that show the vehicle with this index.
fn rendered_share(
    camera: &RearCamera,
    scene: &Scene<'_>,
    index: usize,
    window: PixelRect,
    key: ExposureKey,
    crop: &mut Crop,
) -> f64 {
    let mut frame = Frame::new(camera.camera(), scene, key, &[window]);
    frame.crop(window, crop);
    frame.instance_share(index)
}

/// Returns a random box that a LiDAR cluster of the vehicle could have given. The visible face is
/// almost correct, the length is often an assumption, and the height depends on which part of the
/// vehicle the beams hit.
fn vehicle_cluster_box(scene: &RandomScene, vehicle: &SceneVehicle, rng: &mut Stream) -> GroundBox {
    let mut truth = ego_box(scene, vehicle);
    let face = truth.length_m / 2.0;
    truth.length_m = if rng.random_bool(0.5) { rng.random_range(1.5..6.0) } else { truth.length_m };
    let (sin, cos) = maths::sin_cos(truth.heading_rad);
    let back = face - truth.length_m / 2.0 + rng.random_range(-0.3..0.3);
    let aside = rng.random_range(-0.2..0.2) * truth.width_m;
    truth.x_m += back * cos - aside * sin;
    truth.y_m += back * sin + aside * cos;
    truth.width_m *= rng.random_range(0.7..1.2);
    truth.height_m *= if rng.random_bool(0.25) { rng.random_range(0.4..0.8) } else { rng.random_range(0.8..1.1) };
    truth.heading_rad += rng.random_range(-0.03..0.03);
    truth
}

/// Returns the true box of a vehicle in the ego's frame.
fn ego_box(scene: &RandomScene, vehicle: &SceneVehicle) -> GroundBox {
    let pose =
        |vehicle: &SceneVehicle| scene.road.plane_pose(vehicle.state.s_m, vehicle.state.d_m, vehicle.state.heading_rad);
    let (ego, other) = (pose(&scene.ego), pose(vehicle));
    let (sin, cos) = maths::sin_cos(ego.yaw_rad);
    let (dx, dy) = (other.x_m - ego.x_m, other.y_m - ego.y_m);
    let size = vehicle.vehicle.dimensions;
    GroundBox {
        x_m: cos * dx + sin * dy,
        y_m: cos * dy - sin * dx,
        heading_rad: other.yaw_rad - ego.yaw_rad,
        length_m: size.length_m,
        width_m: size.width_m,
        height_m: size.height_m,
    }
}

/// Returns the random box of a cluster that is not a vehicle: spray or ground near the ego, rails
/// and posts beside the road, or any other position.
fn background_cluster_box(scene: &RandomScene, rng: &mut Stream) -> GroundBox {
    let kind = rng.random_range(0..3);
    let back = match kind {
        0 => rng.random_range(3.0..25.0),
        _ => rng.random_range(4.0..120.0),
    };
    let d_m = match kind {
        0 => scene.ego.state.d_m + rng.random_range(-2.5..2.5),
        1 => [0.79, scene.road.right_edge_m() - 3.04, scene.road.right_edge_m() / 2.0][rng.random_range(0..3)],
        _ => rng.random_range(scene.road.right_edge_m() - 6.0..6.0),
    };
    let mut anchor = scene.ego;
    anchor.state.s_m -= back + scene.ego.vehicle.dimensions.length_m / 2.0;
    anchor.state.d_m = d_m;
    anchor.state.heading_rad = 0.0;
    GroundBox {
        length_m: rng.random_range(0.1..5.0),
        width_m: rng.random_range(0.1..2.5),
        height_m: rng.random_range(0.2..2.5),
        ..ego_box(scene, &anchor)
    }
}
