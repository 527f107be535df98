//! Labels of recorded traffic as ASAM OpenLABEL 1.0.0: its vehicles, lane changes and criticality.
//!
//! ```text
//!  tracks ──▶ points, sorted by time on disk ─▶ frames    pose, speed, lane of each vehicle
//!         └─▶ spans, classes, sizes ──────────▶ objects   one vehicle each, its frame interval
//!  lane changes, metrics ─────────────────────▶ actions   frame interval, times, metrics
//!                                           └─▶ relations the vehicle that changes lanes
//!  markings, layout ──────────────────────────▶ contexts  one lane each; tags: the road
//! ```
//!
//! (ASAM OpenLABEL 1.0.0, 2021; its JSON schema; the ontology of its tags, which follows BSI PAS
//! 1883:2020.)
//!
//! - Values that change from frame to frame are in `frames`, because a cuboid belongs to a frame.
//!   Values that a vehicle, a lane change or a lane has once are in `objects`, `actions` and
//!   `contexts`.
//! - Positions are in the coordinate system `closecall-road`: x along the road, y to the left of
//!   the left edge of lane 1, z up, in metres. The recorded road is straight in it.
//! - OpenLABEL demands the height of a cuboid, which no layout states. The file has the typical
//!   height of the vehicle class.
//! - OpenLABEL has no term for the time headway or for other metrics. They are numbers of the
//!   action, with the names of the command's JSON output.
//! - A tag is written only if the recording makes it certain: the classes of vehicles; the number
//!   and widths of lanes if markings are stated, else the least number of lanes; the motorway if
//!   the layout is for motorways alone.
//!
//! The memory grows with the number of tracks and of lane changes, by some hundred bytes each, and
//! not with the number of points: these are sorted in temporary files beside the output.

mod element;
mod label;
pub(crate) mod names;
mod sorted_points;
mod write;

pub use label::{LabelError, Labels, label_file};
