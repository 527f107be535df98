//! Crops with their labels: vehicles in boxes that are off as those of LiDAR clusters are, and clusters of nothing.

use std::fmt::Write;

use closecall_traffic::{Light, Stream};
use rand::RngExt;

use super::{DatasetSummary, DrawnScene};
use crate::camera::{Crop, ExposureKey, Frame, GroundBox, PixelRect, RearCamera};
use crate::{Scene, SceneVehicle};

/// A window must show at least this share of itself within the image [1].
const LEAST_IN_IMAGE: f64 = 0.6;
/// A vehicle of which less than this share is left by those in front of it is no label [1].
const LEAST_VISIBLE: f64 = 0.55;
/// A window in which a vehicle fills more than this share is no background [1].
const MOST_IN_BACKGROUND: f64 = 0.10;
/// Class label of the background.
const BACKGROUND: usize = 3;
/// Background windows in one scene.
const BACKGROUNDS: usize = 3;

/// Crops and their labels, as they stand in the files.
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
    pub(super) fn add(&mut self, drawn: &DrawnScene, rng: &mut Stream, summary: &mut DatasetSummary) {
        let camera = RearCamera::new(drawn.camera);
        let key = ExposureKey::draw(rng);
        for place in 0..drawn.others.len() {
            let found = jittered(drawn, &drawn.others[place], rng);
            let Some(window) = window(&camera, drawn, &found) else { continue };
            let mut crop = Crop::default();
            let seen = share(&camera, &drawn.scene(), place, window, key, &mut crop);
            let alone = Scene { others: &drawn.others[place..=place], ..drawn.scene() };
            let whole = share(&camera, &alone, 0, window, key, &mut Crop::default());
            if seen > 0.01 && seen > LEAST_VISIBLE * whole {
                let vehicle = &drawn.others[place].vehicle;
                self.push(drawn, vehicle.class as usize, &found, &crop, summary);
                let _ = writeln!(self.csv, ",{},{}", vehicle.appearance.body_shape, window.width);
            }
        }
        for _ in 0..BACKGROUNDS {
            let found = nothing(drawn, rng);
            let Some(window) = window(&camera, drawn, &found) else { continue };
            let mut frame = Frame::new(&drawn.camera, &drawn.scene(), key, &[window]);
            let mut crop = Crop::default();
            frame.crop(window, &mut crop);
            let fullest = (0..drawn.others.len()).map(|other| frame.share_of_latest(other)).fold(0.0, f64::max);
            if fullest <= MOST_IN_BACKGROUND {
                self.push(drawn, BACKGROUND, &found, &crop, summary);
                let _ = writeln!(self.csv, ",,{}", window.width);
            }
        }
    }

    fn push(&mut self, drawn: &DrawnScene, label: usize, found: &GroundBox, crop: &Crop, summary: &mut DatasetSummary) {
        self.rgb.extend_from_slice(&crop.rgb);
        summary.pictures += 1;
        summary.labels[label] += 1;
        let rear = -found.x_m - drawn.ego.vehicle.dimensions.length_m / 2.0 - found.length_m / 2.0;
        let light = match drawn.environment.light {
            Light::Day => "day",
            Light::Dusk => "dusk",
            Light::Night => "night",
        };
        let environment = &drawn.environment;
        let weather = match (environment.rain_mm_per_h > 0.0, environment.visibility_m < 1_000.0) {
            (true, _) => "rain",
            (false, true) => "fog",
            (false, false) => "dry",
        };
        let _ = write!(self.csv, "{label},{rear:.1},{light},{weather}");
    }
}

fn window(camera: &RearCamera, drawn: &DrawnScene, found: &GroundBox) -> Option<PixelRect> {
    camera.project(&drawn.ego, found).filter(|window| window.share_in_image() >= LEAST_IN_IMAGE)
}

/// Draws a crop, and returns the share of it that shows one vehicle.
fn share(
    camera: &RearCamera,
    scene: &Scene<'_>,
    place: usize,
    window: PixelRect,
    key: ExposureKey,
    crop: &mut Crop,
) -> f64 {
    let mut frame = Frame::new(camera.camera(), scene, key, &[window]);
    frame.crop(window, crop);
    frame.share_of_latest(place)
}

/// The box that a LiDAR cluster of a vehicle might have given: the face that it sees is nearly right, the length is
/// often assumed, the height is what the beams happened to hit.
fn jittered(drawn: &DrawnScene, vehicle: &SceneVehicle, rng: &mut Stream) -> GroundBox {
    let mut truth = ego_box(drawn, vehicle);
    let face = truth.length_m / 2.0;
    truth.length_m = if rng.random_bool(0.5) { rng.random_range(1.5..6.0) } else { truth.length_m };
    let (sin, cos) = truth.heading_rad.sin_cos();
    let back = face - truth.length_m / 2.0 + rng.random_range(-0.3..0.3);
    let aside = rng.random_range(-0.2..0.2) * truth.width_m;
    truth.x_m += back * cos - aside * sin;
    truth.y_m += back * sin + aside * cos;
    truth.width_m *= rng.random_range(0.7..1.2);
    truth.height_m *= if rng.random_bool(0.25) { rng.random_range(0.4..0.8) } else { rng.random_range(0.8..1.1) };
    truth.heading_rad += rng.random_range(-0.03..0.03);
    truth
}

/// A vehicle's true box in E's frame.
fn ego_box(drawn: &DrawnScene, vehicle: &SceneVehicle) -> GroundBox {
    let pose = |of: &SceneVehicle| drawn.road.plane_pose(of.state.s_m, of.state.d_m, of.state.heading_rad);
    let (ego, other) = (pose(&drawn.ego), pose(vehicle));
    let (sin, cos) = ego.yaw_rad.sin_cos();
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

/// The box of a cluster where no vehicle is: spray and ground near E, rails and posts beside the road, anything.
fn nothing(drawn: &DrawnScene, rng: &mut Stream) -> GroundBox {
    let kind = rng.random_range(0..3);
    let back = match kind {
        0 => rng.random_range(3.0..25.0),
        _ => rng.random_range(4.0..120.0),
    };
    let d_m = match kind {
        0 => drawn.ego.state.d_m + rng.random_range(-2.5..2.5),
        1 => [0.79, drawn.road.right_edge_m() - 3.04, drawn.road.right_edge_m() / 2.0][rng.random_range(0..3)],
        _ => rng.random_range(drawn.road.right_edge_m() - 6.0..6.0),
    };
    let mut stand = drawn.ego;
    stand.state.s_m -= back + drawn.ego.vehicle.dimensions.length_m / 2.0;
    stand.state.d_m = d_m;
    stand.state.heading_rad = 0.0;
    GroundBox {
        length_m: rng.random_range(0.1..5.0),
        width_m: rng.random_range(0.1..2.5),
        height_m: rng.random_range(0.2..2.5),
        ..ego_box(drawn, &stand)
    }
}
