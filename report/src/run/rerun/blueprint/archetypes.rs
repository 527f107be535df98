//! What a layout needs of the parts of the rerun library, as its public interface lacks it.
//!
//! * `rerun::blueprint` sets no property of a view: axis, bounds, eye, background, legend, columns of the log. It shows
//!   or hides entities of a view only together with a visualizer. Their archetypes are public in this part alone.
//! * `rerun::blueprint::Blueprint::send` starts two threads that never end, once for each file: a memory sink and its
//!   stream hold each other. The archetypes of containers and panels, which it would log, are therefore here too.
//!
//! No other file uses a part of the library.

pub(in super::super) use rerun::external::re_log_types::BlueprintActivationCommand;
pub(super) use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EntityBehavior, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, ScalarAxis,
    TextLogColumns, TimeAxis, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint, VisualBounds2D,
};
