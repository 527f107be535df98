//! Functions that the public interface of the rerun library lacks, from the parts of the library.
//!
//! * `rerun::blueprint` sets no property of a view: axis, bounds, eye, background, legend, columns
//!   of the log. It shows or hides entities of a view only together with a visualizer. Their
//!   archetypes are public in a part alone.
//! * `rerun::blueprint::Blueprint::send` starts two threads that never end, once for each file: a
//!   memory sink and its stream hold each other. So the archetypes of containers and panels, which
//!   it would log, are here too.
//! * `rerun::sink` encodes into a file on a thread, which at most logs an error of the disk, or
//!   encodes a whole recording into memory. The encoder writes message by message, and returns the
//!   error of the file.
//! * No function reads the messages of a recording, or the version in its header. `rerun::sink`
//!   does not name the address that its client takes.
//!
//! No other file uses a part of the library.

pub(super) use rerun::external::re_log_encoding::{
    Decodable, DecoderApp as Decoder, EncodeError, Encoder, EncodingOptions, StreamHeader,
};
pub(super) use rerun::external::re_log_types::BlueprintActivationCommand;
pub(super) use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EntityBehavior, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, ScalarAxis,
    TextLogColumns, TimeAxis, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint, VisualBounds2D,
};
pub(super) use rerun::external::re_sdk_types::datatypes::AbsoluteTimeRange;
pub(super) use rerun::external::re_uri::ProxyUri;
