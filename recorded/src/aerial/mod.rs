//! Traffic as an aerial camera sees it.
//!
//! ```text
//!  trajectory data ─▶ render  oblique pictures ─▶ detector  oriented boxes ─▶ footprint  boxes on the ground, raw or with
//!                                                                                        the perspective bias corrected
//!                  ─▶ tracker  Kalman filter, oriented overlap ─▶ trajectory data ─▶ losses  compared with the truth
//! ```

pub mod camera;
pub mod dataset;
mod detector;
mod error;
mod flight;
mod footage;
pub mod footprint;
mod ground;
mod image_box;
mod kalman;
mod losses;
mod overlap;
mod picture;
mod random_scene;
mod raster;
mod tracker;

pub use detector::{DETECTED_FROM, Detector, ImageDetection, SHIPPED_DETECTOR};
pub use error::AerialError;
pub use flight::{Boxes, Correction, FRAME, Flight, FlightOptions, fly, fly_watched};
pub use footage::Footage;
pub use ground::Ground;
pub use image_box::ImageBox;
pub use losses::{CriterionLoss, LossRow, Losses, MetricLoss, losses};
pub use overlap::intersection_over_union;
pub use picture::{AerialPicture, AerialScene, GroundVehicle, Label, Light, render};
pub use random_scene::{Frame, random_scene, random_vehicle};
pub use tracker::{AerialTrack, GroundDetection, TrackPoint, track};
