//! Tests of the chain behind the rear LiDAR, and of the tracker on simulated detections, against
//! the true states.

mod fixed_gap;
mod front;
mod long_vehicles;
mod monitors;
mod rear_radar;
mod several_cameras;
mod several_lidars;
mod silhouettes;
mod tracking;
