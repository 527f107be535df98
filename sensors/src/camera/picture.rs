//! Size and field of view of the camera's image.

/// Width of the image (px).
pub const WIDTH_PX: u16 = 1280;

/// Height of the image (px).
pub const HEIGHT_PX: u16 = 800;

/// Horizontal field of view (rad): 60°.
pub(super) const FIELD_OF_VIEW_RAD: f64 = std::f64::consts::FRAC_PI_3;

/// Focal length (px): half of the width over the tangent of half of the field of view, 1 / √3.
pub const FOCAL_PX: f64 = WIDTH_PX as f64 / 2.0 * 1.732_050_807_568_877_2;
