//! Trajectory data (recorded road traffic): reading it, judging its quality, and writing it.
//!
//! ```text
//!   file (plain or gzip) ─▶ reader of its layout ─▶ rows in SI units ─▶ gapless tracks, one by one ─▶ TrajectoryData
//!                           (one line or element at a time)          (in memory: incomplete ones)     (all tracks)
//! ```
//!
//! The content of a file determines its layout; the file's name does not. A Parquet file has the
//! layout of its columns; see `parquet`.
//! `docs/reference/trajectory-data.md` describes all layouts for users:
//!
//! | layout | content | module |
//! |---|---|---|
//! | plain | CSV with a header, in metres, one row per track and frame; [`write_trajectories`] writes it | `plain` |
//! | NGSIM | 18 columns in feet, with or without a header; or the 25 columns of the catalogue's export (DOI 10.21949/1504477) | `ngsim` |
//! | highD, exiD | three files per recorded data set | `highd`, `exid`, `file_set` |
//! | CommonRoad | XML with lanelets and dynamic obstacles | `commonroad`, `lanelets` |
//! | SUMO | floating car data, as XML or a table | `sumo`, `collected` |
//! | Vissim | vehicle record (`.fzp`) | `vissim`, `collected` |
//! | I-24 MOTION | JSON in feet | `i24`, `collected` |
//! | OpenLABEL | JSON with cuboids in frames; [`label_file`](crate::openlabel::label_file) writes it | `openlabel`, `openlabel_text` |
//! | OSI | `GroundTruth` messages in a trace file or in MCAP | `osi`, `osi_messages` |
//! | in-car | log of one vehicle that sees the lane markings; [`write_in_car`] writes it | `in_car` |
//!
//! # What the readers do
//!
//! - They convert units to SI. `d` is positive to the left and 0 at the left edge of the leftmost
//!   lane. NGSIM's `Local_Y` is the middle of the front bumper, so the reader subtracts half the
//!   vehicle length to get the centre of the box. `Local_X` stays as it is: during a lane change at
//!   a heading of 0.05 rad, the front is 0.1 m beside the centre, which is below NGSIM's own
//!   accuracy.
//! - They take the step between two frames from the rows: a file may hold every second frame.
//! - They bridge gaps of at most half a second, and split the rows of a vehicle at longer gaps and
//!   at movements that no vehicle makes, because NGSIM and others reuse vehicle numbers
//!   ([`Continuity`]). The first piece keeps the vehicle's number; later pieces add multiples of
//!   [`PIECE_STRIDE`] to it.
//! - The catalogue's export joins several data sets of one location in which vehicle numbers recur.
//!   The reader tells them apart by the time of frame 0. If their clocks overlap, it shifts one
//!   behind the other: their vehicles never meet. (Files longer than [`WINDOW_ROWS`] rows are not
//!   shifted, because their time spans are unknown before the end of the file.)
//! - NGSIM times are in milliseconds, all others in seconds. If times count from 1970, the reader
//!   counts them from the first instant instead.
//! - Finite differences between neighbouring frames supply the quantities that a layout lacks:
//!   lateral speed, lateral acceleration, and the acceleration if its field is empty.
//! - A vehicle class that the reader does not know counts as the nearest known class, and the
//!   reader counts such names ([`Tracks::unknown_classes`]).
//! - The readers reject everything else with line, column and allowed values, including mixed-up
//!   units and columns (`plausible`). They neither guess nor repair. They skip and count unusable
//!   rows only if the caller asks for it ([`BadRows::Skip`]).
//!
//! # Memory
//!
//! [`open`] yields complete tracks one by one. It holds the rows of incomplete tracks and some
//! dozen bytes per vehicle. Therefore, files longer than [`WINDOW_ROWS`] rows must be sorted by
//! vehicle or by time; see `order`. [`read`] holds the whole file, in any row order. Criticality needs
//! all vehicles, because every vehicle may be an opponent, but only smoothed ones: see
//! [`smooth_file`](crate::filters::smooth_file).

mod assemble;
mod axes;
mod builder;
mod carriageways;
mod class_names;
mod collected;
mod common_crossings;
mod commonroad;
mod continuity;
mod data;
mod error;
mod estimated_lanes;
mod exid;
mod fields;
mod file_layout;
mod file_set;
mod frame_times;
mod header;
mod highd;
mod i24;
mod in_car;
mod inferred_road;
mod input;
mod json_input;
mod jumping_numbers;
mod lane_comparison;
mod lane_numbers;
mod lane_sides;
mod lane_spacing;
mod lanelets;
mod layout;
mod mapped_rows;
mod markings;
mod ngsim;
mod open;
mod openlabel;
mod openlabel_text;
mod order;
mod orientation;
mod osi;
mod osi_messages;
mod overlaps;
mod parquet;
mod plain;
mod plane_pieces;
mod plane_steps;
mod plausible;
mod quality;
mod reference_line;
mod road_axis;
mod rows;
mod side_by_side;
mod sides;
mod skipped_rows;
mod source;
mod stated_lanes;
mod sumo;
#[cfg(test)]
pub(crate) mod test_support;
mod text;
mod text_layout;
mod tracks;
mod unnamed_lanes;
mod vissim;
mod write;
mod write_in_car;
mod xml;

pub use axes::AxisOptions;
pub use builder::PIECE_STRIDE;
pub(crate) use carriageways::Carriageways;
pub use class_names::UnknownClass;
pub use continuity::Continuity;
pub use data::{MarkingDistances, RecordedTrack, TrajectoryData, refuse_duplicates};
pub use error::{TrajectoryFileError, TrajectoryFileProblem, WriteError};
pub use file_layout::Layout;
pub use markings::{DEFAULT_LANE_WIDTH_M, IgnoredMarking, LANE_WIDTHS_M, LaneMarkings, MarkingObserver};
pub(crate) use open::open_whole;
pub use open::{input_files, open, open_from, open_streaming, read, read_from, read_with};
pub use order::{STREAM_ROWS, WINDOW_ROWS};
pub use quality::{Flaw, FlawCounts, FlawLocation, Flaws, QualityInspector, count_flaws};
pub use skipped_rows::{SkippedRows, SkippedRowsByReason};
pub use tracks::{BadRows, LayoutChoice, ReadOptions, Tracks};
pub(crate) use write::check_finite;
pub use write::write_trajectories;
pub use write_in_car::{
    BusFrame, InCarFrame, InCarLog, TrueLaneChange, ground_truth_path, write_ground_truth, write_in_car,
};
