//! The layout with which the viewer opens a recording (its blueprint), stored in the recording itself.
//!
//! ```text
//!  ┌───────────────────────────────┬───────────────┬───────────────┐
//!  │                               │ time headway  │ speed         │
//!  │  3D, behind and above the ego ├───────────────┼───────────────┤
//!  │  (of a pair: side by side)    │ gap           │ acceleration  │
//!  ├───────────────────────────────┼───────────────┼───────────────┤
//!  │  from above                   │ encounter     │ margin gained │
//!  ├───────────────┬───────────────┼───────────────┴───────────────┤
//!  │  rear camera  │ states        │  story │ log                  │
//!  └───────────────┴───────────────┴───────────────────────────────┘
//! ```
//!
//! The layout contains only views that have something to show.

mod send;

use rerun::blueprint::components::{BackgroundKind, Corner2D, Eye3DKind, PanelState, PlayState};
use rerun::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use rerun::blueprint::{
    Blueprint, BlueprintPanel, ContainerLike, Horizontal, SelectionPanel, Spatial2DView, Spatial3DView,
    StateTimelineView, TextDocumentView, TextLogView, TimePanel, TimeSeriesView, Vertical,
};
use rerun::components::Range1D;
use rerun::datatypes::Range2D;
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, EntityBehavior, EyeControls3D, LineGrid3D, PlotLegend, ScalarAxis, TextLogColumns, VisualBounds2D,
};
use rerun::{AsComponents, EntityPath};

use super::palette;
use super::stream::OPENING_TIMELINE;

/// Position of the eye of the 3D view in the ego frame (m), far enough back to show vehicles behind the ego.
const EYE_M: [f32; 3] = [-32.0, 6.0, 12.0];
/// Point at which the eye looks, in the ego frame (m).
const TARGET_M: [f32; 3] = [-1.0, 0.0, 0.0];
/// Room for names above and below the road in the view from above (m in the picture).
const BIRD_MARGIN: f64 = 4.5;

/// The plots: name of the entity, title, and range of the value axis if it is fixed.
const PLOTS: [(&str, &str, Option<[f64; 2]>); 6] = [
    ("headway", "Time headway [s]: front orange, rear pink", Some([0.0, 4.0])),
    ("gap", "Gap [m]", Some([0.0, 120.0])),
    ("encounter", "Closest encounter: TTCE [s], DCE [m]", Some([0.0, 10.0])),
    ("speed", "Speed [m/s]: ego blue", None),
    ("acceleration", "Acceleration [m/s²]", Some([-10.0, 4.0])),
    ("margin", "Front headway gained [s]", Some([-1.0, 4.0])),
];

/// The parts of a film that the views can show.
#[derive(Clone, Debug, Default)]
pub(super) struct FilmContents {
    /// Prefix of its entity paths.
    pub(super) root: String,
    /// Name of its arm, for the titles of the views.
    pub(super) name: String,
    /// Entities of the scene that are hidden until the user switches them on.
    pub(super) hidden_layers: Vec<String>,
    /// True if the 3D scene and the view from above were written.
    pub(super) has_scene: bool,
    /// Upper and lower edge of the road in the view from above.
    pub(super) edges: [f64; 2],
    /// True if there are camera images.
    pub(super) has_camera: bool,
    /// True if there are states of the ego stack.
    pub(super) has_states: bool,
    /// Names of the plots that have a curve.
    pub(super) plots: Vec<&'static str>,
}

/// The layout of the views of one recording.
#[derive(Default)]
pub(super) struct Layout {
    /// Properties of views that the library's blueprint builder cannot express, each with its path in the blueprint
    /// store.
    properties: Vec<(EntityPath, Box<dyn AsComponents>)>,
}

impl Layout {
    /// Returns the blueprint, and collects the properties that it cannot express.
    fn blueprint(&mut self, films: &[FilmContents]) -> Blueprint {
        let mut left = Vec::new();
        let mut shares = Vec::new();
        let mut add = |view: Option<ContainerLike>, share: f32| {
            if let Some(view) = view {
                left.push(view);
                shares.push(share);
            }
        };
        let scenes: Vec<ContainerLike> =
            films.iter().filter(|film| film.has_scene).map(|film| self.scene(film)).collect();
        add(side_by_side(scenes), 10.0);
        for film in films.iter().filter(|film| film.has_scene) {
            add(Some(self.bird(film)), if films.len() > 1 { 2.9 } else { 3.8 });
        }
        let cameras = films.iter().filter(|film| film.has_camera);
        let mut below: Vec<ContainerLike> = cameras.map(|film| self.camera(film)).collect();
        below.extend(films.iter().filter(|film| film.has_states).map(states));
        add(side_by_side(below), 4.6);
        let left = Vertical::new(left).with_row_shares(shares);
        let right = Vertical::new([self.plots(films), self.texts(films)]).with_row_shares([12.0, 6.0]);
        let root = Horizontal::new([left.into(), right.into()]).with_column_shares([11.0, 9.0]);
        let time = TimePanel::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(OPENING_TIMELINE)
            .with_play_state(PlayState::Following);
        Blueprint::new(root)
            .with_auto_layout(false)
            .with_auto_views(false)
            .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
            .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
            .with_time_panel(time)
    }

    /// Returns the 3D view of a film, which follows the ego.
    fn scene(&mut self, film: &FilmContents) -> ContainerLike {
        let root = &film.root;
        let view = Spatial3DView::new(titled("Scene", film))
            .with_origin(format!("{root}world/ego"))
            .with_contents([format!("/{root}world/**")])
            .into();
        for layer in film.hidden_layers.iter().map(|layer| format!("ViewContents/overrides/{root}{layer}/visualizers"))
        {
            self.property(&view, &layer, EntityBehavior::update_fields().with_visible(false));
        }
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

    /// Returns the view from above of a film.
    fn bird(&mut self, film: &FilmContents) -> ContainerLike {
        let title = titled("From above (across the road twice as wide)", film);
        let view = Spatial2DView::new(title).with_origin(format!("{}bird", film.root)).into();
        let reach = super::bird::REACH_M;
        let [top, bottom] = film.edges;
        let bounds =
            Range2D { x_range: [-reach, reach].into(), y_range: [top - BIRD_MARGIN, bottom + BIRD_MARGIN].into() };
        self.property(&view, "VisualBounds2D", VisualBounds2D::new(bounds));
        view
    }

    fn camera(&mut self, film: &FilmContents) -> ContainerLike {
        Spatial2DView::new(titled("Rear camera", film)).with_origin(format!("{}camera", film.root)).into()
    }

    /// Returns the plots in which any film has a curve. All films share them.
    fn plots(&mut self, films: &[FilmContents]) -> ContainerLike {
        let mut columns: [Vec<ContainerLike>; 2] = [Vec::new(), Vec::new()];
        for (index, (name, title, range)) in PLOTS.into_iter().enumerate() {
            let films_with_plot: Vec<&FilmContents> = films.iter().filter(|film| film.plots.contains(&name)).collect();
            if films_with_plot.is_empty() {
                continue;
            }
            let contents = films_with_plot.iter().map(|film| format!("/{}plots/{name}/**", film.root));
            let view = TimeSeriesView::new(title).with_origin("/").with_contents(contents).into();
            // Curves have the colours of the vehicles, so that only plots with other curves need a legend.
            let is_plain = matches!(name, "gap" | "speed") || (films.len() > 1 && name == "acceleration");
            let legend = PlotLegend::new().with_corner(Corner2D::LeftTop).with_visible(!is_plain);
            self.property(&view, "PlotLegend", legend);
            if let Some([low, high]) = range {
                self.property(&view, "ScalarAxis", ScalarAxis::new().with_range(Range1D::new(low, high)));
            }
            columns[index / (PLOTS.len() / 2)].push(view);
        }
        let columns = columns.into_iter().filter(|views| !views.is_empty());
        side_by_side(columns.map(|views| Vertical::new(views).into()).collect())
            .unwrap_or_else(|| Vertical::new([]).into())
    }

    /// Returns the story beside the log. The log shows the texts only: their colours and words make other columns
    /// redundant.
    fn texts(&mut self, films: &[FilmContents]) -> ContainerLike {
        let story = TextDocumentView::new("Story").with_origin("summary").into();
        let contents = films.iter().map(|film| format!("/{}log/**", film.root));
        let log = TextLogView::new("Log").with_origin("/").with_contents(contents).into();
        let columns = [TextLogColumn { visible: true.into(), kind: TextLogColumnKind::Body }];
        self.property(&log, "TextLogColumns", TextLogColumns::new().with_text_log_columns(columns));
        Horizontal::new([story, log]).into()
    }

    /// Adds a property of a view.
    fn property(&mut self, view: &ContainerLike, name: &str, property: impl AsComponents + 'static) {
        if let ContainerLike::View(view) = view {
            let path = format!("{}/{name}", view.blueprint_path());
            self.properties.push((path.into(), Box::new(property)));
        }
    }
}

/// Returns the view of the bands of states of a film.
fn states(film: &FilmContents) -> ContainerLike {
    StateTimelineView::new(titled("States", film)).with_origin(format!("{}states", film.root)).into()
}

/// Returns the title of a view, followed by the name of its arm if there are several films.
fn titled(title: &str, film: &FilmContents) -> String {
    if film.root.is_empty() { title.to_owned() } else { format!("{title}: {}", film.name) }
}

/// Returns the views side by side. A single view needs no container.
fn side_by_side(mut views: Vec<ContainerLike>) -> Option<ContainerLike> {
    match views.len() {
        0 => None,
        1 => views.pop(),
        _ => Some(Horizontal::new(views).into()),
    }
}
