//! Labels of recorded traffic as ASAM OpenLABEL 1.0.0: its vehicles, lane changes and criticality.
//!
//! ```text
//!   tracks ──▶ points, sorted by time on disk ──▶ frames    position, heading, speed, lane of each vehicle
//!          └─▶ spans, classes, sizes ───────────▶ objects   one vehicle each, with its frame interval
//!   lane changes, metrics ──────────────────────▶ actions   frame interval, times, metrics
//!                                             └─▶ relations the vehicle that changes lanes
//!   markings, layout ───────────────────────────▶ contexts  one lane each; tags: the road
//! ```
//!
//! (ASAM OpenLABEL 1.0.0, 2021; its JSON schema; the ontology of its tags, which follows BSI PAS
//! 1883:2020.)
//!
//! - What changes from frame to frame stands in `frames`, because a cuboid belongs to a frame. What a
//!   vehicle, a lane change or a lane has once stands in `objects`, `actions` and `contexts`.
//! - Positions are in the coordinate system `closecall-road`: x along the road, y to the left of the
//!   left edge of lane 1, z up, in metres. The recorded road is straight in it.
//! - OpenLABEL needs the height of a cuboid, which no layout states: it is the typical height of the
//!   vehicle class.
//! - OpenLABEL has no term for the time headway or for other metrics. They are numbers of the action
//!   with the names of the command's JSON output.
//! - Tags are written if the recording makes them certain: the classes of vehicles, the number of
//!   lanes and their widths if markings are stated, else the least number of lanes, and the motorway
//!   if the layout is of motorways alone.
//!
//! The memory grows with the number of tracks and of lane changes, by some hundred bytes each, and
//! not with the number of points: these are sorted in temporary files beside the output.

mod element;
mod label;
pub(crate) mod names;
mod sorted_points;
mod write;

pub use label::{LabelError, Labels, label_file};
