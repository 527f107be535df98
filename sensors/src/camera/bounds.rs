//! Rectangles of the image that something covers.

/// Bounds in the image, `[left, top, right, bottom]` (px).
pub(super) type Bounds = [f32; 4];

pub(super) fn touches(a: &Bounds, b: &Bounds) -> bool {
    a[0] <= b[2] && b[0] <= a[2] && a[1] <= b[3] && b[1] <= a[3]
}
