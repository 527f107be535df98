//! The rear camera: a software renderer, and a network that says what each LiDAR cluster looks like.
//!
//! ```text
//!   detection ─▶ box in E's frame ─▶ window of the image ─▶ crop, 32 × 32 ─▶ network ─▶ class scores
//!                                         scene ─────────────▲
//! ```
//!
//! The image is that of a pinhole camera in the rear window, 1280 × 800 px, 60° wide. It is never drawn as a whole in
//! the loop: a crop has the same pixels as the whole image would have, bit for bit (see [`Frame`]).

mod body;
mod classifier;
mod config;
pub mod dataset;
mod draw;
mod frame;
mod glow;
mod ground;
mod hash;
mod image;
mod light;
mod mesh;
mod pinhole;
mod pipeline;
mod raster;
mod rear_camera;
mod shapes;
mod sky;
mod spray;
mod window;

pub use classifier::{Backend, Classifier, ClassifierError, SHIPPED_MODEL};
pub use config::{Camera, CameraConfig, Pipeline, Sun, SunConfig};
pub use frame::{Frame, Lists};
pub use image::{CHANNELS, CROP_PX, Crop, Image, LabelledImage};
pub use pinhole::{GroundBox, HEIGHT_PX, PixelRect, WIDTH_PX};
pub use pipeline::CropClassifier;
pub use rear_camera::{ExposureKey, RearCamera};
pub use shapes::{HELD_OUT, SHAPES, usual_dimensions};
