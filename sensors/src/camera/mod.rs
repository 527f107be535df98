//! The rear camera: a software renderer, and a neural network that classifies the image of each
//! LiDAR cluster.
//!
//! ```text
//!   detection ─▶ box in the ego's frame ─▶ window of the image ─▶ crop, 32 × 32 px ─▶ network ─▶ class scores
//!                                              scene ──────────────▲
//! ```
//!
//! A second pipeline finds vehicles in the whole image by a Mask R-CNN ([`WholeImageDetector`]); it
//! needs ONNX Runtime.
//!
//! The camera is a pinhole camera in the ego's rear window. Its image has 1280 × 800 px and covers
//! 60° horizontally, unless a scenario says otherwise. A simulated run renders only the pixels that
//! a network reads. Each pixel of a crop is identical, bit for bit, to the same pixel of the whole
//! image (see [`Frame`]).

mod background;
mod body;
mod bounds;
mod classifier;
mod config;
mod detector;
mod draw;
mod effects;
mod exposure;
mod fault;
mod frame;
mod glow;
mod ground;
mod hash;
mod image;
mod image_memory;
mod instance;
mod labels;
mod lanes;
mod light;
mod line;
mod line_memory;
mod mask_rcnn_config;
mod mesh;
mod network;
mod optics;
mod picture;
mod pinhole;
mod pipeline;
mod raster;
mod rear_camera;
mod sampling;
mod shapes;
mod sky;
mod spray;
mod triangles;
mod vector_registers;
mod veil;
mod whole_image;
mod window;

pub use classifier::{Backend, Classifier, ClassifierError, SHIPPED_MODEL};
pub use config::{Camera, CameraConfig, Pipeline, Sun, SunConfig};
pub use detector::{InstanceDetector, SHIPPED_MASK_RCNN};
pub use exposure::ExposureKey;
pub use fault::CameraFault;
pub use frame::{Frame, FrameBuffers};
pub use hash::mix;
pub use image::{CHANNELS, CROP_PX, Crop, Image, LabelledImage};
pub use image_memory::ImageMemory;
pub use instance::{Instance, MASK_THRESHOLD, Mask, overlap};
pub use labels::LabelMap;
pub use mask_rcnn_config::{MaskRcnn, MaskRcnnConfig, MaskRcnnInput, SHIPPED_MIN_SHOWN_PX, SHIPPED_MISSED};
pub use network::Network;
pub use optics::{LensConfig, Optics};
pub use picture::{FOCAL_PX, HEIGHT_PX, PixelRect, Resolution, ResolutionConfig, WIDTH_PX};
pub use pinhole::GroundBox;
pub use pipeline::{CropClassifier, ImagedScene, MIN_SHARE_IN_IMAGE, best_camera, fuse, is_beside_road};
pub use rear_camera::RearCamera;
pub use sampling::{Sampling, SamplingError};
pub use shapes::HELD_OUT_SHAPES;
pub use triangles::{BodyTriangle, body_triangles};
pub use whole_image::WholeImageDetector;
