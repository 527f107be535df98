//! Labelled images from the renderer, for the training and the evaluation of classifiers.
//!
//! There are three kinds of content; the first two are rendered from the same random scenes:
//! - *images*: `image-000000.png` … and `annotations.json` in the COCO format, with the bounding
//!   box, the mask (run lengths) and the class of every visible vehicle;
//! - *crops*: `crops.rgb`, which holds 32 × 32 × 3 bytes per crop, and `crops.csv`, which holds one
//!   row per crop. The classifier is trained on them. Their boxes have errors as large as the
//!   errors of boxes fitted to LiDAR clusters;
//! - *sampled pictures*: the columns and rows of the image that a network reads, with the vehicle
//!   at each pixel.
//!
//! The training set and the held-out set share no body shape
//! ([`HELD_OUT_SHAPES`](crate::camera::HELD_OUT_SHAPES)), no paint and no random numbers.

mod coco;
mod crops;
mod files;
mod options;
mod render;
mod sampled;
mod scenes;
mod summary;

pub use options::{CameraLooks, Content, DatasetOptions, MAX_VEHICLES, Set, USUAL_VEHICLES};
pub use render::render_dataset;
pub use sampled::render_sampled;
pub use summary::{DatasetError, DatasetSummary};
