//! The layout that the viewer opens with, stored in the recording itself.
//!
//! ```text
//!  ┌───────────────────────────────┬───────────────┬───────────────┐
//!  │                               │ time headway  │ speed         │
//!  │  3D, from behind and above E  ├───────────────┼───────────────┤
//!  │                               │ gap           │ acceleration  │
//!  ├───────────────────────────────┼───────────────┼───────────────┤
//!  │  states                       │ time to       │ margin gained │
//!  ├───────────────────────────────┤ encounter     │               │
//!  │  log │ summary                │               │               │
//!  └───────────────────────────────┴───────────────┴───────────────┘
//! ```

use rerun::blueprint::components::{BackgroundKind, Corner2D, Eye3DKind, PanelState, PlayState};
use rerun::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use rerun::blueprint::{
    Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, Horizontal, SelectionPanel, Spatial3DView,
    StateTimelineView, Tabs, TextDocumentView, TextLogView, TimePanel, TimeSeriesView, Vertical,
};
use rerun::components::Range1D;
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, EyeControls3D, LineGrid3D, PlotLegend, ScalarAxis, TextLogColumns,
};
use rerun::log::LogMsg;
use rerun::{AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, StoreId, StoreKind};

use super::stream::OPENING_TIMELINE;
use super::{APPLICATION, RecordError, palette};

/// Where the eye is and what it looks at, in E's frame [m]: far enough back to see who follows.
const EYE_M: [f32; 3] = [-30.0, 9.0, 11.0];
const TARGET_M: [f32; 3] = [4.0, -0.5, 0.0];

/// Lays out the views of one recording.
#[derive(Default)]
pub(super) struct Layout {
    /// What the builder has no words for: properties of views, by their place in the blueprint's own store.
    properties: Vec<(EntityPath, Box<dyn AsComponents>)>,
}

impl Layout {
    /// Sends the blueprint into a recording; `has_margin` where there is a gained margin to plot.
    pub(super) fn send(mut self, stream: &RecordingStream, has_margin: bool) -> Result<(), RecordError> {
        let blueprint = self.blueprint(has_margin);
        let (carrier, messages) = RecordingStreamBuilder::new(APPLICATION).memory()?;
        blueprint.send(&carrier, BlueprintActivation::default())?;
        let mut messages: Vec<LogMsg> = messages.take();
        messages.retain(|message| message.store_id().kind() == StoreKind::Blueprint && !is_activation(message));
        let Some(id) = messages.first().map(|message| message.store_id().clone()) else {
            return Err(RecordError::Disabled);
        };
        messages.extend(self.property_messages(&id)?);
        stream.send_blueprint(messages, BlueprintActivationCommand::make_active(id));
        Ok(())
    }

    fn property_messages(self, id: &StoreId) -> Result<Vec<LogMsg>, RecordError> {
        let (stream, messages) = RecordingStreamBuilder::from_store_id(id).send_properties(false).memory()?;
        // The blueprint's only timeline, by which the viewer reads it.
        stream.set_time_sequence("blueprint", 0);
        for (path, property) in self.properties {
            stream.log(path, property.as_ref())?;
        }
        let mut messages = messages.take();
        messages.retain(|message| matches!(message, LogMsg::ArrowMsg(..)));
        Ok(messages)
    }

    fn blueprint(&mut self, has_margin: bool) -> Blueprint {
        let states = StateTimelineView::new("States").with_origin("states");
        let summary = TextDocumentView::new("Summary").with_origin("summary");
        let words = Tabs::new([self.log(), summary.into()]);
        let left = Vertical::new([self.scene(), states.into(), words.into()]).with_row_shares([10.0, 6.0, 4.0]);
        let margins = Vertical::new([
            self.plot("Time headway [s]", "plots/headway", Some([0.0, 4.0])),
            self.plot("Gap [m]", "plots/gap", Some([0.0, 120.0])),
            self.plot("Time to encounter [s]", "plots/encounter", Some([0.0, 15.0])),
        ]);
        let mut motion = vec![
            self.plot("Speed [m/s]", "plots/speed", None),
            self.plot("Acceleration [m/s²]", "plots/acceleration", Some([-10.0, 4.0])),
        ];
        if has_margin {
            motion.push(self.plot("Front margin gained [s]", "plots/margin", Some([-1.0, 4.0])));
        }
        let plots = Horizontal::new([margins.into(), Vertical::new(motion).into()]);
        let root = Horizontal::new([left.into(), plots.into()]).with_column_shares([11.0, 9.0]);
        Blueprint::new(root)
            .with_auto_layout(false)
            .with_auto_views(false)
            .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
            .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
            .with_time_panel(
                TimePanel::new()
                    .with_state(PanelState::Collapsed)
                    .with_timeline(OPENING_TIMELINE)
                    .with_play_state(PlayState::Following),
            )
    }

    fn scene(&mut self) -> ContainerLike {
        let view = Spatial3DView::new("Scene").with_origin("world/ego").with_contents(["/world/**"]).into();
        let eye = EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position(EYE_M)
            .with_look_target(TARGET_M)
            .with_eye_up([0.0, 0.0, 1.0]);
        self.property(&view, "EyeControls3D", eye);
        self.property(&view, "LineGrid3D", LineGrid3D::new().with_visible(false));
        let sky = Background::new(BackgroundKind::SolidColor).with_color(palette::SKY);
        self.property(&view, "Background", sky);
        view
    }

    /// The log without the columns that its colours and words say already.
    fn log(&mut self) -> ContainerLike {
        let view = TextLogView::new("What happened").with_origin("log").into();
        let columns = [TextLogColumn { visible: true.into(), kind: TextLogColumnKind::Body }];
        self.property(&view, "TextLogColumns", TextLogColumns::new().with_text_log_columns(columns));
        view
    }

    fn plot(&mut self, name: &str, origin: &str, range: Option<[f64; 2]>) -> ContainerLike {
        let view = TimeSeriesView::new(name).with_origin(origin).into();
        self.property(&view, "PlotLegend", PlotLegend::new().with_corner(Corner2D::LeftTop));
        if let Some([low, high]) = range {
            self.property(&view, "ScalarAxis", ScalarAxis::new().with_range(Range1D::new(low, high)));
        }
        view
    }

    fn property(&mut self, view: &ContainerLike, name: &str, property: impl AsComponents + 'static) {
        if let ContainerLike::View(view) = view {
            let path = format!("{}/{name}", view.blueprint_path());
            self.properties.push((path.into(), Box::new(property)));
        }
    }
}

fn is_activation(message: &LogMsg) -> bool {
    matches!(message, LogMsg::BlueprintActivationCommand(_))
}
