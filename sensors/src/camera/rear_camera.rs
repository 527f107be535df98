//! The public interface of the rear camera: it projects boxes to windows and renders scenes to
//! images.

use super::exposure::ExposureKey;
use super::image::LabelledImage;
use super::picture::PixelRect;
use super::pinhole::{GroundBox, Lens, NEAR_M};
use super::{Camera, Frame};
use closecall_traffic::{Scene, SceneVehicle};

/// Ratio of the side of a window to the larger side of the object's projection.
const WINDOW_TO_OBJECT_RATIO: f64 = 1.3;
/// Minimum width of a window, measured at the object's distance (m), so that a crop of a single
/// post also shows its surroundings.
const MIN_WINDOW_WIDTH_M: f64 = 2.2;
/// Maximum width of a window (px of the usual image).
const MAX_WINDOW_WIDTH_PX: f64 = 2_400.0;
/// A box has a window only if part of it lies deeper than this along the optical axis (m).
const MIN_DEPTH_M: f64 = 1.5;

/// The rear camera of the ego vehicle.
#[derive(Clone, Debug)]
pub struct RearCamera {
    camera: Camera,
}

impl RearCamera {
    /// Creates a camera from its checked configuration.
    pub fn new(camera: Camera) -> Self {
        Self { camera }
    }

    /// Returns the checked configuration.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns the square window of the image around a box given in the vehicle frame of `ego`.
    /// Returns `None` if the box is not behind the ego vehicle or is too near to the lens.
    pub fn project(&self, ego: &SceneVehicle, object: &GroundBox) -> Option<PixelRect> {
        let lens = Lens::new(&self.camera, ego);
        let relative_to_lens = GroundBox { x_m: object.x_m - lens.ahead_m, y_m: object.y_m - lens.left_m, ..*object };
        let corners = relative_to_lens.corners().map(|corner| lens.in_camera(corner));
        let nearest = corners.iter().map(|corner| corner[2]).fold(f64::INFINITY, f64::min);
        let farthest = corners.iter().map(|corner| corner[2]).fold(f64::NEG_INFINITY, f64::max);
        if !(farthest > MIN_DEPTH_M) {
            return None;
        }
        let [left, top, right, bottom] = lens.bounds(&corners)?;
        let min_side = MIN_WINDOW_WIDTH_M * lens.focal_px / nearest.max(NEAR_M).max(MIN_DEPTH_M);
        let max_side = MAX_WINDOW_WIDTH_PX * lens.image.scale();
        let side = ((right - left).max(bottom - top) * WINDOW_TO_OBJECT_RATIO).max(min_side).min(max_side);
        if !(side >= 1.0) {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded above, and 1 or more")]
        let (side, left, top) = (
            side.round() as u32,
            ((left + right - side) / 2.0).round() as i32,
            ((top + bottom - side) / 2.0).round() as i32,
        );
        Some(PixelRect { left, top, width: side, height: side })
    }

    /// Renders the whole image, and for each pixel the vehicle that it shows.
    pub fn render_image(&self, scene: &Scene<'_>, key: ExposureKey) -> LabelledImage {
        Frame::new(&self.camera, scene, key, &[self.camera.resolution.image()]).image()
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{
        Check, Environment, Light, Num, Parameters, Road, Time, Vehicle, VehicleClass, VehicleState,
    };
    use proptest::prelude::*;

    use super::super::CameraConfig;
    use super::super::image::{CROP_PX, Crop, sample_positions};
    use super::super::picture::{Resolution, ResolutionConfig, WIDTH_PX};
    use super::*;

    fn rear_camera() -> RearCamera {
        RearCamera::new(CameraConfig::default().check(&Parameters::default()).unwrap())
    }

    /// Renders the crop of one window.
    fn render_crop(camera: &RearCamera, scene: &Scene<'_>, window: PixelRect, key: ExposureKey) -> Crop {
        let mut crop = Crop::default();
        Frame::new(&camera.camera, scene, key, &[window]).crop(window, &mut crop);
        crop
    }

    fn camera_with(change: impl FnOnce(&mut CameraConfig)) -> RearCamera {
        let mut config = CameraConfig::default();
        change(&mut config);
        RearCamera::new(config.check(&Parameters::default()).unwrap())
    }

    /// Returns a camera with every deviation from the ideal one.
    fn real_camera() -> RearCamera {
        camera_with(|config| {
            config.lens.distortion_k1 = Num::Fixed(-0.3);
            config.lens.vignetting = Num::Fixed(1.0);
            config.lens.surface_reflectance = Num::Fixed(0.04);
            config.readout_s = Num::Fixed(0.03);
            config.night_sky = Num::Fixed(0.03);
        })
    }

    fn vehicle(class: VehicleClass, s_m: f64, d_m: f64) -> SceneVehicle {
        let state = VehicleState { s_m, d_m, speed_mps: 30.0, ..VehicleState::default() };
        SceneVehicle { actor: 1, vehicle: Vehicle::typical(class), state, pitch_rad: 0.0 }
    }

    fn box_of(ego: &SceneVehicle, other: &SceneVehicle) -> GroundBox {
        let size = other.vehicle.dimensions;
        GroundBox {
            x_m: other.state.s_m - ego.state.s_m,
            y_m: other.state.d_m - ego.state.d_m,
            heading_rad: 0.0,
            length_m: size.length_m,
            width_m: size.width_m,
            height_m: size.height_m,
        }
    }

    /// A varied scene: a vehicle of each class, rain, spray, guard rails and a bend.
    fn varied_scene(light: Light) -> (Road, Environment, Vec<SceneVehicle>) {
        let road = Road::straight(3).with_curvature(0.001);
        let environment =
            Environment { light, rain_mm_per_h: 4.0, water_film_mm: 0.8, visibility_m: 2_000.0, friction: 0.6 };
        let others = vec![
            vehicle(VehicleClass::Car, 470.0, -5.6),
            vehicle(VehicleClass::Truck, 440.0, -9.4),
            vehicle(VehicleClass::Motorcycle, 480.0, -1.9),
        ];
        (road, environment, others)
    }

    /// Returns the pixels in the middle of the cells between knots, which lie at these cells and
    /// pixels, as `xtask/training/mask_rcnn_sampling.py` chooses the pixels of the Mask R-CNN.
    fn between(knots: [(f64, f64); 6]) -> Vec<i32> {
        let cells = (0..).map(|cell| f64::from(cell) + 0.5).take_while(|cell| *cell < knots[5].0);
        let pixel = |cell: f64| {
            let pair = knots.windows(2).find(|pair| cell < pair[1].0).unwrap();
            let [(from, low), (to, high)] = [pair[0], pair[1]];
            (low + (high - low) * (cell - from) / (to - from)).floor() as i32
        };
        cells.map(pixel).collect()
    }

    #[test]
    fn the_pixels_that_the_mask_rcnn_reads_equal_the_whole_image() {
        let columns = between([(0., 0.), (48., 320.), (96., 512.), (224., 768.), (272., 960.), (320., 1280.)]);
        let rows = between([(0., 0.), (17., 250.), (29., 310.), (89., 430.), (112., 522.), (144., 800.)]);
        assert_eq!((columns.len(), rows.len()), (320, 144));
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        for (camera, light) in
            [(rear_camera(), Light::Day), (rear_camera(), Light::Night), (real_camera(), Light::Dusk)]
        {
            let (road, environment, others) = varied_scene(light);
            let scene =
                Scene { time: Time::from_ms(880), road: &road, environment: &environment, ego, others: &others };
            let whole = camera.render_image(&scene, ExposureKey(42)).image;
            let mut frame = Frame::new(camera.camera(), &scene, ExposureKey(42), &[camera.camera().resolution.image()]);
            let sampled = frame.sampled(&columns, &rows).image;
            let expected = rows.iter().flat_map(|y| {
                columns.iter().flat_map(|x| {
                    let at = 3 * (*y as usize * usize::from(WIDTH_PX) + *x as usize);
                    whole.rgb[at..at + 3].to_vec()
                })
            });
            assert!(sampled.rgb.iter().copied().eq(expected), "{light:?}");
        }
    }

    fn assert_crops_match(camera: &RearCamera, light: Light, windows: &[PixelRect]) {
        let (road, environment, others) = varied_scene(light);
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        let scene = Scene { time: Time::from_ms(880), road: &road, environment: &environment, ego, others: &others };
        let image = camera.render_image(&scene, ExposureKey(42)).image;
        for window in windows {
            let crop = render_crop(camera, &scene, *window, ExposureKey(42));
            let (columns, rows) =
                (sample_positions(window.left, window.width), sample_positions(window.top, window.height));
            for (index, rgb) in crop.rgb.chunks_exact(3).enumerate() {
                let (u, v) = (columns[index % CROP_PX], rows[index / CROP_PX]);
                let whole = u32::try_from(u).ok().zip(u32::try_from(v).ok()).and_then(|(u, v)| image.pixel(u, v));
                assert_eq!(rgb, whole.unwrap_or_default(), "{light:?} {window:?} at {u} {v}");
            }
        }
    }

    #[test]
    fn a_crop_has_the_same_bits_as_the_whole_image() {
        let square = |left, top, side| PixelRect { left, top, width: side, height: side };
        let windows = [square(600, 380, 32), square(500, 300, 301), square(620, 395, 21), square(-40, 700, 200)];
        for light in [Light::Day, Light::Dusk, Light::Night] {
            assert_crops_match(&rear_camera(), light, &windows);
            assert_crops_match(&real_camera(), light, &windows);
        }
    }

    fn with_size(width_px: u64, height_px: u64) -> RearCamera {
        camera_with(|config| config.resolution = ResolutionConfig { width_px, height_px })
    }

    #[test]
    fn a_crop_of_an_image_of_any_size_has_the_bits_of_the_whole_image() {
        let square = |left, top, side| PixelRect { left, top, width: side, height: side };
        for (size, windows) in [
            ((640, 480), [square(300, 230, 32), square(-20, 300, 200), square(600, 400, 100)]),
            ((1_921, 1_209), [square(900, 590, 64), square(700, 500, 401), square(1_880, 1_150, 150)]),
        ] {
            assert_crops_match(&with_size(size.0, size.1), Light::Night, &windows);
        }
    }

    #[test]
    fn the_image_has_the_size_and_twice_the_pixels_show_the_same_scene_finer() {
        let picture = rendered(&with_size(2_560, 1_600), Light::Day, AS_PLACED);
        assert_eq!((picture.image.width, picture.image.height), (2_560, 1_600));
        assert_eq!((picture.image.rgb.len(), picture.instances.len()), (3 * 2_560 * 1_600, 2_560 * 1_600));
        let usual = rendered(&rear_camera(), Light::Day, AS_PLACED);
        let shown = |picture: &LabelledImage| picture.instances.iter().filter(|instance| **instance == 1).count();
        let ratio = shown(&picture) as f64 / shown(&usual) as f64;
        assert!((3.9..4.1).contains(&ratio), "the car covers {ratio} times the pixels");
        // The vehicle that a pixel shows is the vehicle that the same place of the fine image
        // shows, but for the edges.
        let differ =
            (0..800_usize).flat_map(|row| (0..1_280_usize).map(move |column| (row, column))).filter(|(row, column)| {
                usual.instances[row * 1_280 + column] != picture.instances[2 * row * 2_560 + 2 * column]
            });
        assert!(differ.count() < 2_000);
    }

    fn with_yaw(yaw_deg: f64) -> RearCamera {
        camera_with(|config| config.yaw_deg = Num::Fixed(yaw_deg))
    }

    #[test]
    fn a_crop_of_a_turned_camera_has_the_bits_of_the_whole_image() {
        let square = |left, top, side| PixelRect { left, top, width: side, height: side };
        let windows = [square(600, 380, 32), square(100, 300, 301), square(900, 395, 64), square(-40, 700, 200)];
        for yaw_deg in [-35.0, 20.0] {
            let distorted = camera_with(|config| {
                config.yaw_deg = Num::Fixed(yaw_deg);
                config.lens.distortion_k1 = Num::Fixed(-0.3);
                config.readout_s = Num::Fixed(0.03);
            });
            for light in [Light::Day, Light::Night] {
                assert_crops_match(&with_yaw(yaw_deg), light, &windows);
                assert_crops_match(&distorted, light, &windows);
            }
        }
    }

    #[test]
    fn the_projected_window_of_a_vehicle_shows_it_to_a_turned_camera() {
        let (_, environment, others) = varied_scene(Light::Day);
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        let road = Road::straight(3);
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
        for yaw_deg in [-15.0, 15.0] {
            let camera = with_yaw(yaw_deg);
            for (index, other) in others.iter().enumerate() {
                let window = camera.project(&ego, &box_of(&ego, other)).unwrap();
                let straight = rear_camera().project(&ego, &box_of(&ego, other)).unwrap();
                let moved = f64::from(straight.left - window.left) / yaw_deg;
                assert!(moved > 10.0, "a camera that looks to the left shows it farther to the left: {moved}");
                let mut frame = Frame::new(camera.camera(), &scene, ExposureKey(1), &[window]);
                frame.crop(window, &mut Crop::default());
                let share = frame.instance_share(index);
                assert!((0.1..0.9).contains(&share), "{:?}: {share}", other.vehicle.class);
            }
        }
    }

    #[test]
    fn a_camera_beside_the_centre_line_sees_what_it_would_see_in_an_ego_beside_its_place() {
        let (_, environment, others) = varied_scene(Light::Night);
        // The ego sprays from its own place.
        let environment = Environment { rain_mm_per_h: 0.0, water_film_mm: 0.0, ..environment };
        let road = Road::straight(3);
        let picture = |camera: RearCamera, d_m: f64| {
            let ego = vehicle(VehicleClass::Car, 500.0, d_m);
            let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
            let window = camera.project(&ego, &box_of(&ego, &others[0])).unwrap();
            (camera.render_image(&scene, ExposureKey(3)), window)
        };
        for left_m in [0.5, -1.25] {
            let beside = camera_with(|config| config.left_m = Num::Fixed(left_m));
            let (got, got_window) = picture(beside, -5.625);
            let (wanted, wanted_window) = picture(rear_camera(), -5.625 + left_m);
            assert!(got.image == wanted.image && got.instances == wanted.instances, "{left_m} m");
            assert_eq!(got_window, wanted_window);
            assert!(got.image != picture(rear_camera(), -5.625).0.image);
        }
    }

    #[test]
    fn the_mirrored_camera_sees_the_mirror_image_of_the_mirrored_world() {
        let (_, environment, others) = varied_scene(Light::Day);
        let environment = Environment { rain_mm_per_h: 0.0, water_film_mm: 0.0, ..environment };
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        let road = Road::straight(3);
        let mirror = |other: &SceneVehicle| SceneVehicle {
            state: VehicleState { d_m: road.right_edge_m() - other.state.d_m, ..other.state },
            ..*other
        };
        let seen = |camera: RearCamera, road: &Road, ego: SceneVehicle, others: &[SceneVehicle]| {
            let scene = Scene { time: Time::ZERO, road, environment: &environment, ego, others };
            camera.render_image(&scene, ExposureKey(3)).instances
        };
        let original = seen(with_yaw(15.0), &road, ego, &others);
        let mirrored_road = road.mirrored().unwrap();
        let mirrored_others: Vec<SceneVehicle> = others.iter().map(mirror).collect();
        let differences = |yaw_deg: f64| {
            let image = seen(with_yaw(yaw_deg), &mirrored_road, mirror(&ego), &mirrored_others);
            let rows = original.chunks_exact(1_280).zip(image.chunks_exact(1_280));
            rows.flat_map(|(one, other)| one.iter().zip(other.iter().rev())).filter(|(one, other)| one != other).count()
        };
        let shown = original.iter().filter(|instance| **instance > 0).count();
        assert!(shown > 3_000, "{shown} pixels show vehicles");
        // The samples of a pixel do not lie in its middle: edges may differ by a pixel.
        let mirrored = differences(-15.0);
        assert!(mirrored * 5 < shown, "{mirrored} of {shown} pixels differ");
        assert!(differences(15.0) > shown, "a camera that is not mirrored shows something else");
    }

    #[test]
    fn the_window_of_a_vehicle_has_twice_the_side_in_twice_the_pixels() {
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        // The vehicle nearest to the lens has the largest window that is allowed.
        for x_m in [-60.0, -20.0, -5.2] {
            let at = GroundBox { x_m, y_m: 1.0, heading_rad: 0.0, length_m: 4.6, width_m: 2.5, height_m: 1.5 };
            let [usual, fine] =
                [rear_camera(), with_size(2_560, 1_600)].map(|camera| camera.project(&ego, &at).unwrap());
            for (one, two) in [(usual.left, fine.left), (usual.top, fine.top), (usual.width as i32, fine.width as i32)]
            {
                assert!((two - 2 * one).abs() <= 2, "{two} is not twice {one}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3))]
        #[test]
        fn any_crop_has_the_same_bits_as_the_whole_image(
            windows in prop::collection::vec((-50_i32..1280, -50_i32..800, 8_u32..500), 12),
        ) {
            let squares: Vec<_> = windows.into_iter().map(|(left, top, side)| PixelRect { left, top, width: side, height: side }).collect();
            assert_crops_match(&rear_camera(), Light::Night, &squares);
            assert_crops_match(&real_camera(), Light::Night, &squares);
        }
    }

    #[test]
    fn the_projected_window_of_a_vehicle_shows_the_vehicle() {
        let (_, environment, others) = varied_scene(Light::Day);
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        let road = Road::straight(3);
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
        let camera = rear_camera();
        for (index, other) in others.iter().enumerate() {
            let window = camera.project(&ego, &box_of(&ego, other)).unwrap();
            let mut frame = Frame::new(camera.camera(), &scene, ExposureKey(1), &[window]);
            frame.crop(window, &mut Crop::default());
            let share = frame.instance_share(index);
            assert!((0.1..0.9).contains(&share), "{:?}: {share}", other.vehicle.class);
        }
    }

    #[test]
    fn the_same_key_gives_the_same_image_and_a_different_key_different_noise() {
        let (road, environment, others) = varied_scene(Light::Dusk);
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
        let window = PixelRect { left: 600, top: 380, width: 64, height: 64 };
        let rendered = |key| render_crop(&rear_camera(), &scene, window, ExposureKey(key));
        assert_eq!(rendered(5), rendered(5));
        assert_ne!(rendered(5), rendered(6));
    }

    /// Place along the road of the car of the varied scene (m), and the speed of the ego (m/s).
    const AS_PLACED: [f64; 2] = [470.0, 30.0];

    /// Renders the varied scene on a dry road, with its car at this place (m) and speed (m/s).
    fn rendered(camera: &RearCamera, light: Light, [s_m, speed_mps]: [f64; 2]) -> LabelledImage {
        let (road, environment, mut others) = varied_scene(light);
        let environment = Environment { rain_mm_per_h: 0.0, water_film_mm: 0.0, visibility_m: 20_000.0, ..environment };
        (others[0].state.s_m, others[0].state.speed_mps) = (s_m, speed_mps);
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
        camera.render_image(&scene, ExposureKey(3))
    }

    fn brightness(picture: &LabelledImage, [left, top]: [usize; 2]) -> f64 {
        let rows = (top..top + 40).flat_map(|row| picture.image.rgb[3 * (1280 * row + left)..][..3 * 40].iter());
        rows.map(|value| f64::from(*value)).sum::<f64>() / (3.0 * 1_600.0)
    }

    /// Returns the mean position in the image of the pixels that show the first other vehicle (px).
    fn centre_px(picture: &LabelledImage) -> [f64; 2] {
        let shown = picture.instances.iter().enumerate().filter(|(_, instance)| **instance == 1);
        let at: Vec<[f64; 2]> = shown.map(|(index, _)| [(index % 1280) as f64, (index / 1280) as f64]).collect();
        assert!(at.len() > 100);
        [0, 1].map(|axis| at.iter().map(|at| at[axis]).sum::<f64>() / at.len() as f64)
    }

    #[test]
    fn an_uncorrected_lens_darkens_the_corners_and_not_the_middle() {
        let ideal = rendered(&rear_camera(), Light::Day, AS_PLACED);
        let dark = rendered(&camera_with(|config| config.lens.vignetting = Num::Fixed(1.0)), Light::Day, AS_PLACED);
        assert!(brightness(&dark, [0, 0]) < 0.8 * brightness(&ideal, [0, 0]));
        assert!((brightness(&dark, [620, 380]) - brightness(&ideal, [620, 380])).abs() < 1.0);
    }

    #[test]
    fn barrel_distortion_draws_vehicles_nearer_to_the_middle_and_the_window_follows() {
        let camera = camera_with(|config| config.lens.distortion_k1 = Num::Fixed(-0.4));
        let [_, ideal_v] = centre_px(&rendered(&rear_camera(), Light::Day, AS_PLACED));
        let [u, v] = centre_px(&rendered(&camera, Light::Day, AS_PLACED));
        assert!((v - 400.0).abs() < (ideal_v - 400.0).abs());
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        let window = camera.project(&ego, &box_of(&ego, &varied_scene(Light::Day).2[0])).unwrap();
        let middle = [window.left, window.top].map(|low| f64::from(low) + 0.5 * f64::from(window.width));
        assert!(
            (middle[0] - u).abs() < 0.2 * f64::from(window.width)
                && (middle[1] - v).abs() < 0.2 * f64::from(window.width)
        );
    }

    #[test]
    fn a_rolling_shutter_moves_only_moving_objects_and_rows_beside_the_middle() {
        let rolling = camera_with(|config| config.readout_s = Num::Fixed(0.1));
        // 8 m behind the lens, the car lies below the middle of the image, where rows are read
        // later.
        let height = |camera: &RearCamera, mps: f64| centre_px(&rendered(camera, Light::Day, [488.0, mps]))[1];
        assert!(height(&rear_camera(), 50.0) > 400.0);
        assert!((height(&rolling, 30.0) - height(&rear_camera(), 30.0)).abs() < 0.5, "as fast as the ego");
        // By then it has come nearer, and appears lower.
        assert!(height(&rolling, 50.0) > height(&rear_camera(), 50.0) + 0.2);
    }

    #[test]
    fn the_sky_far_from_towns_is_darker_only_at_night() {
        let far = camera_with(|config| config.night_sky = Num::Fixed(0.03));
        let sky = |camera: &RearCamera, light| brightness(&rendered(camera, light, AS_PLACED), [100, 100]);
        assert!(sky(&far, Light::Night) < 0.6 * sky(&rear_camera(), Light::Night));
        assert_eq!(sky(&far, Light::Day), sky(&rear_camera(), Light::Day));
    }

    #[test]
    fn reflections_in_the_lens_draw_ghosts_of_headlamps_and_of_the_sun() {
        let ghostly = |lens: &dyn Fn(&mut CameraConfig)| {
            camera_with(|config| {
                config.sun.azimuth_rad = Num::Fixed(2.9);
                config.sun.elevation_rad = Num::Fixed(0.2);
                lens(config);
            })
        };
        for light in [Light::Day, Light::Night] {
            let total = |reflectance: f64| {
                let camera = ghostly(&|config| config.lens.surface_reflectance = Num::Fixed(reflectance));
                let rgb = rendered(&camera, light, AS_PLACED).image.rgb;
                rgb.iter().map(|value| f64::from(*value)).sum::<f64>()
            };
            let (none, coated, bare) = (total(0.0), total(0.005), total(0.04));
            assert!(coated > none && bare > 10.0 * (coated - none) + none, "{light:?}: {none} {coated} {bare}");
        }
    }

    #[test]
    fn boxes_ahead_and_alongside_have_no_visible_window() {
        let ego = vehicle(VehicleClass::Car, 500.0, -5.6);
        let box_at = |x_m| GroundBox { x_m, y_m: 3.7, heading_rad: 0.0, length_m: 4.6, width_m: 1.8, height_m: 1.5 };
        assert_eq!(rear_camera().project(&ego, &box_at(30.0)), None);
        assert_eq!(
            rear_camera()
                .project(&ego, &box_at(0.0))
                .map(|window| window.share_in_image(Resolution::USUAL))
                .filter(|share| *share > 0.0),
            None
        );
        assert!(rear_camera().project(&ego, &box_at(-30.0)).is_some());
    }
}
