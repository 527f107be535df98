//! Rate and size of the pictures of a flight.
//!
//! The pictures of the published method are reduced before the detector searches them, because it
//! knows vehicles of 0.11 to 0.17 m per pixel: each pixel that it sees is the mean of 3 × 3
//! recorded ones. Rows at the edges that make no whole pixel, or no whole cell of the detector, are
//! left out, as many above as below.

use closecall_sensors::camera::{CHANNELS, Image};
use closecall_traffic::Time;
use serde::Serialize;

use crate::aerial::camera::{AerialCamera, HEIGHT_PX, PUBLISHED_PX, PUBLISHED_REDUCTION, View, WIDTH_PX};
use crate::aerial::detector::STRIDE;
use crate::aerial::flight::FRAME;
use crate::aerial::picture::{AerialPicture, AerialScene, render, render_sampled};

/// Rate and size of the pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Footage {
    /// A strip of 1280 × 192 px along the road, at 12.5 Hz.
    #[default]
    Strip,
    /// Whole pictures of 4104 × 3006 px at 20 Hz, as the published method has them.
    Published,
}

impl Footage {
    /// Returns the time between two pictures.
    pub const fn period(self) -> Time {
        match self {
            Self::Strip => FRAME,
            Self::Published => Time::from_ms(50),
        }
    }

    /// Returns columns and rows of the pictures that the detector searches.
    const fn searched_px(self) -> [usize; 2] {
        match self {
            Self::Strip => [WIDTH_PX, HEIGHT_PX],
            Self::Published => [searched(PUBLISHED_PX[0]), searched(PUBLISHED_PX[1])],
        }
    }

    /// Returns the view of the pictures that the detector searches.
    pub(crate) const fn view(self, strip: View) -> View {
        match self {
            Self::Strip => strip,
            Self::Published => strip.with_size(self.searched_px()),
        }
    }

    /// Renders a picture as the camera takes it. `camera` has the view of the searched picture.
    pub(crate) fn picture(self, scene: &AerialScene, camera: &AerialCamera) -> AerialPicture {
        match self {
            Self::Strip => render(scene, camera),
            Self::Published => {
                let [width, height] = self.searched_px();
                // The whole pixels keep the scale; those beyond them widen the picture.
                let exact = camera.view().with_size([PUBLISHED_REDUCTION * width, PUBLISHED_REDUCTION * height]);
                // Nine recorded pixels make one that is searched: a sample for each is enough.
                render_sampled(scene, &AerialCamera::new(View { size_px: PUBLISHED_PX, ..exact }), 1)
            }
        }
    }

    /// Returns the picture that the detector searches.
    pub(crate) fn searched(self, picture: Image) -> Image {
        match self {
            Self::Strip => picture,
            Self::Published => reduced(&picture, PUBLISHED_REDUCTION, self.searched_px()),
        }
    }
}

/// Returns the largest number of reduced pixels along a side that fill whole cells of the detector.
const fn searched(side_px: usize) -> usize {
    side_px / PUBLISHED_REDUCTION / STRIDE * STRIDE
}

/// Reduces the middle of an image to this size. Each pixel is the mean of a square of `factor`
/// pixels on a side. The image is at least as large as all squares.
fn reduced(image: &Image, factor: usize, [width, height]: [usize; 2]) -> Image {
    let columns = image.width as usize;
    let (left, top) = ((columns - width * factor) / 2, (image.height as usize - height * factor) / 2);
    let count = factor * factor;
    let mut rgb = Vec::with_capacity(CHANNELS * width * height);
    for row in 0..height {
        for column in 0..width {
            for channel in 0..CHANNELS {
                let square = (0..count).map(|index| {
                    let (y, x) = (top + row * factor + index / factor, left + column * factor + index % factor);
                    usize::from(image.rgb[(y * columns + x) * CHANNELS + channel])
                });
                let mean = (square.sum::<usize>() + count / 2) / count;
                rgb.push(u8::try_from(mean).unwrap_or(u8::MAX));
            }
        }
    }
    let side = |side: usize| u32::try_from(side).unwrap_or(0);
    Image { width: side(width), height: side(height), rgb }
}

#[cfg(test)]
mod tests {
    use closecall_sensors::camera::Backend;
    use closecall_traffic::{Vehicle, VehicleClass, maths};

    use super::*;
    use crate::aerial::camera::{ALTITUDE_M, OFF_NADIR_RAD};
    use crate::aerial::detector::{DETECTED_FROM, Detector};
    use crate::aerial::footprint::raw;
    use crate::aerial::ground::Ground;
    use crate::aerial::picture::{GroundVehicle, Light};

    #[test]
    fn a_reduced_image_has_the_means_of_squares_in_its_middle() {
        // 5 x 4 pixels, each with its number in all channels: two squares of 2 x 2 pixels in the
        // middle rows, beginning at column 0.
        let rgb = (0..20_u8).flat_map(|number| [number, number, 100 + number]).collect();
        let small = reduced(&Image { width: 5, height: 4, rgb }, 2, [2, 1]);
        assert_eq!((small.width, small.height), (2, 1));
        // (5 + 6 + 10 + 11) / 4 and (7 + 8 + 12 + 13) / 4.
        assert_eq!(small.rgb, [8, 8, 108, 10, 10, 110]);
    }

    #[test]
    fn the_published_pictures_are_searched_at_whole_cells_and_at_a_known_scale() {
        let [width, height] = Footage::Published.searched_px();
        assert_eq!([width, height], [1_368, 1_000]);
        assert!(width.is_multiple_of(STRIDE) && height.is_multiple_of(STRIDE));
        assert_eq!(Footage::Published.period(), Time::from_ms(50));
        let strip = View::beside_road([0.0, -5.0], ALTITUDE_M, OFF_NADIR_RAD);
        assert_eq!(Footage::Strip.view(strip), strip);
        let ground_m = ALTITUDE_M / Footage::Published.view(strip).focal_px;
        assert!((0.10..0.12).contains(&ground_m), "{ground_m}");
    }

    #[test]
    fn a_vehicle_in_a_published_picture_is_where_the_searched_view_has_it_and_is_found_there() {
        let strip = View::beside_road([0.0, -5.25], ALTITUDE_M, OFF_NADIR_RAD);
        let camera = AerialCamera::new(Footage::Published.view(strip));
        let mut vehicle = Vehicle::typical(VehicleClass::Car);
        vehicle.appearance.paint_rgb = [250; 3];
        let vehicle = GroundVehicle { id: 1, vehicle, at_m: [4.0, -5.25], yaw_rad: 0.0, livery: None };
        let ground = Ground::new(vec![0.0, -3.5, -7.0], 3);
        let scene = AerialScene { ground, vehicles: vec![vehicle], light: Light::NOON, key: 9 };
        let picture = Footage::Published.picture(&scene, &camera);
        assert_eq!([picture.image.width, picture.image.height], [4_104, 3_006]);
        let searched = Footage::Published.searched(picture.image);
        assert_eq!([searched.width as usize, searched.height as usize], Footage::Published.searched_px());
        // The middle of the roof is white, and the pavement behind the vehicle is grey.
        let value = |point: [f64; 3]| {
            let [column, row] = camera.project(point).unwrap();
            let pixel = searched.pixel(column as u32, row as u32).unwrap();
            pixel.iter().map(|value| u32::from(*value)).sum::<u32>()
        };
        let (roof, road) = (value([4.0, -5.25, 1.5]), value([-6.0, -5.25, 0.0]));
        assert!(2 * roof > 3 * road, "{roof} {road}");
        let detections = Detector::shipped(&Backend::Tract).unwrap().detect(&searched, DETECTED_FROM).unwrap();
        let mut places = detections.iter().filter_map(|detection| raw(&camera, &detection.image_box));
        assert!(places.any(|place| maths::hypot(place.x_m - 4.0, place.y_m + 5.25) < 1.0), "{detections:?}");
    }
}
