//! Oriented boxes in an image.

use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::maths;

/// A rectangle in an image, turned by an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageBox {
    /// Column and row of the centre (px).
    pub centre_px: [f64; 2],
    /// Extent along the vehicle (px).
    pub length_px: f64,
    /// Extent across the vehicle (px).
    pub width_px: f64,
    /// Direction of the vehicle from the columns' axis towards the rows' axis (rad). Front and rear
    /// look alike from above, so the angle counts modulo π.
    pub angle_rad: f64,
}

impl ImageBox {
    /// Returns the smallest box of this direction around `points`; `None` without points.
    pub fn around(points: &[[f64; 2]], angle_rad: f64) -> Option<Self> {
        let (sin, cos) = maths::sin_cos(angle_rad);
        let along = |point: &[f64; 2]| point[0] * cos + point[1] * sin;
        let across = |point: &[f64; 2]| point[1] * cos - point[0] * sin;
        let [a0, a1] = extent(points.iter().map(along))?;
        let [c0, c1] = extent(points.iter().map(across))?;
        let (a, c) = (0.5 * (a0 + a1), 0.5 * (c0 + c1));
        let centre_px = [a * cos - c * sin, a * sin + c * cos];
        Some(Self { centre_px, length_px: a1 - a0, width_px: c1 - c0, angle_rad })
    }

    /// Returns the corners (px), in order around the box, beginning at the front.
    pub fn corners_px(&self) -> [[f64; 2]; 4] {
        self.plane().corners_m().map(|corner| [corner.x, corner.y])
    }

    /// Returns the box in the plane of the image, with pixels as the unit.
    pub(crate) const fn plane(&self) -> OrientedBox {
        let Self { centre_px: [x_m, y_m], length_px, width_px, angle_rad } = *self;
        OrientedBox { x_m, y_m, yaw_rad: angle_rad, length_m: length_px, width_m: width_px }
    }
}

/// Returns the smallest and the largest value; `None` without values.
pub(crate) fn extent(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.fold(None, |extent: Option<[f64; 2]>, value| {
        Some(extent.map_or([value, value], |[low, high]| [low.min(value), high.max(value)]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_around_its_own_corners_is_the_same_box() {
        for angle_rad in [0.0, 0.4, 1.5, -2.0] {
            let given = ImageBox { centre_px: [320.0, 90.0], length_px: 40.0, width_px: 15.0, angle_rad };
            let fitted = ImageBox::around(&given.corners_px(), angle_rad).unwrap();
            assert!((fitted.length_px - 40.0).abs() < 1e-9 && (fitted.width_px - 15.0).abs() < 1e-9, "{fitted:?}");
            assert!((fitted.centre_px[0] - 320.0).abs() < 1e-9 && (fitted.centre_px[1] - 90.0).abs() < 1e-9);
        }
        assert_eq!(ImageBox::around(&[], 0.0), None);
    }
}
