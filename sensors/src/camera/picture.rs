//! Size and field of view of the camera's image.
//!
//! Pixels are square: the field of view of the columns gives the focal length, and the number of
//! rows gives the field of view of the rows.
//!
//! The smallest image is VGA (the Caltech Pedestrian Dataset, filmed from a car: P. Dollár et al.,
//! *Pedestrian Detection: A Benchmark*, CVPR 2009). The largest is the image of an automotive
//! sensor of 8.3 megapixels, onsemi's AR0820.

use closecall_traffic::{Check, ConfigError, Parameters, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Width of the usual image (px).
pub const WIDTH_PX: u16 = 1280;

/// Height of the usual image (px).
pub const HEIGHT_PX: u16 = 800;

/// Horizontal field of view of the usual camera (rad): 60°.
pub(super) const FIELD_OF_VIEW_RAD: f64 = std::f64::consts::FRAC_PI_3;

/// Focal length of the usual camera (px): half of the width over the tangent of half of the field
/// of view, 1 / √3.
pub const FOCAL_PX: f64 = WIDTH_PX as f64 / 2.0 * 1.732_050_807_568_877_2;

/// Numbers of columns and of rows that an image may have.
const WIDTHS_PX: std::ops::RangeInclusive<u64> = 640..=3_848;
const HEIGHTS_PX: std::ops::RangeInclusive<u64> = 480..=2_168;

/// The size of a camera's image as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct ResolutionConfig {
    /// Number of columns of the image (px).
    pub width_px: u64,
    /// Number of rows of the image (px).
    pub height_px: u64,
}

impl Default for ResolutionConfig {
    fn default() -> Self {
        Self { width_px: WIDTH_PX.into(), height_px: HEIGHT_PX.into() }
    }
}

/// The checked size of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    /// Number of columns.
    pub width_px: u16,
    /// Number of rows.
    pub height_px: u16,
}

impl Check for ResolutionConfig {
    type Checked = Resolution;

    fn check(&self, _: &Parameters) -> Result<Resolution, ConfigError> {
        let count = |value: u64, key, range: std::ops::RangeInclusive<u64>, allowed| {
            let checked = u16::try_from(value).ok().filter(|_| range.contains(&value));
            checked.ok_or_else(|| ConfigError::new(key, Problem::WrongCount { value, allowed }))
        };
        Ok(Resolution {
            width_px: count(self.width_px, "width-px", WIDTHS_PX, "a number of columns from 640 to 3848")?,
            height_px: count(self.height_px, "height-px", HEIGHTS_PX, "a number of rows from 480 to 2168")?,
        })
    }
}

impl Resolution {
    /// The size of the usual image, with which the networks were trained.
    pub const USUAL: Self = Self { width_px: WIDTH_PX, height_px: HEIGHT_PX };

    /// Returns the rectangle of all pixels.
    pub fn image(self) -> PixelRect {
        PixelRect { left: 0, top: 0, width: self.width_px.into(), height: self.height_px.into() }
    }

    /// Returns the middle of the image (px).
    pub(crate) fn middle_px(self) -> [f64; 2] {
        [self.width_px, self.height_px].map(|extent| f64::from(extent) / 2.0)
    }

    /// Returns how many pixels lie where the usual image has one: what has a size in the usual
    /// image is larger by this factor.
    pub(crate) fn scale(self) -> f64 {
        f64::from(self.width_px) / f64::from(WIDTH_PX)
    }

    /// Returns the column or row of the usual image that shows what a column or row of this one
    /// shows. Both are counted from the upper left corner.
    pub(crate) fn in_usual(self, pixel: i32) -> i32 {
        if self.width_px == WIDTH_PX {
            return pixel;
        }
        let usual = (i64::from(pixel) * i64::from(WIDTH_PX)).div_euclid(i64::from(self.width_px));
        i32::try_from(usual).unwrap_or(pixel)
    }
}

/// A rectangle of pixels, which may extend beyond the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelRect {
    /// Leftmost column.
    pub left: i32,
    /// Topmost row.
    pub top: i32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl PixelRect {
    /// Returns the share of the rectangle's area that lies in an image of this size (0 to 1).
    pub fn share_in_image(&self, image: Resolution) -> f64 {
        let overlap = |start: i32, extent: u32, limit: u16| {
            let end = i64::from(start) + i64::from(extent);
            (end.min(limit.into()) - i64::from(start.max(0))).max(0) as f64 / f64::from(extent.max(1))
        };
        overlap(self.left, self.width, image.width_px) * overlap(self.top, self.height, image.height_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_without_pixels_and_an_image_that_no_sensor_has_are_refused() {
        let refused = |text: &str| {
            let config: ResolutionConfig = toml::from_str(text).unwrap();
            config.check(&Parameters::default()).unwrap_err().to_string()
        };
        for (text, key, value, allowed) in [
            ("width-px = 0", "width-px", 0, "a number of columns from 640 to 3848"),
            ("width-px = 639", "width-px", 639, "a number of columns from 640 to 3848"),
            ("width-px = 3849", "width-px", 3_849, "a number of columns from 640 to 3848"),
            // The remainder by 2^16 is a width that an image may have.
            ("width-px = 66816", "width-px", 66_816, "a number of columns from 640 to 3848"),
            ("height-px = 0", "height-px", 0, "a number of rows from 480 to 2168"),
            ("height-px = 1000000", "height-px", 1_000_000, "a number of rows from 480 to 2168"),
        ] {
            assert_eq!(refused(text), format!("`{key}` is {value}, but {allowed} is needed"));
        }
        assert!(toml::from_str::<ResolutionConfig>("width-px = 1280.5").is_err());
        assert!(toml::from_str::<ResolutionConfig>("aspect = 1.5").is_err(), "pixels are square");
        for (width_px, height_px) in [(640, 480), (1_280, 800), (3_848, 2_168)] {
            let checked = ResolutionConfig { width_px, height_px }.check(&Parameters::default()).unwrap();
            assert_eq!([checked.width_px, checked.height_px].map(u64::from), [width_px, height_px]);
        }
    }

    #[test]
    fn places_of_the_usual_image_are_found_in_each_image() {
        for pixel in [-50, -1, 0, 1, 799, 1_279] {
            assert_eq!(Resolution::USUAL.in_usual(pixel), pixel);
        }
        let twice = Resolution { width_px: 2_560, height_px: 1_600 };
        assert_eq!([-1, 0, 1, 2, 2_559].map(|pixel| twice.in_usual(pixel)), [-1, 0, 0, 1, 1_279]);
        assert_eq!((Resolution::USUAL.scale(), twice.scale()), (1.0, 2.0));
    }
}
