//! The layout with which the viewer opens a recording (its blueprint), stored in the recording itself.
//!
//! ```text
//!  ┌───────────────────────┬─────────────────────┐      ┌───────────────────────┬─────────────────────┐
//!  │ verdict               │ time headway        │      │ verdict               │ time headway        │
//!  ├───────────────────────┤                     │      ├───────────────────────┤                     │
//!  │ from above            ├─────────────────────┤      │ from above: both arms ├─────────────────────┤
//!  ├───────────────────────┤ acceleration │ …    │      │ on one metre axis     │ acceleration │ …    │
//!  │ scene                 ├─────────────────────┤      ├───────────┬───────────┼─────────────────────┤
//!  │ (and rear camera)     │ states              │      │ scene:    │ scene:    │ states: with MIS    │
//!  │                       ├─────────────────────┤      │ without   │ with MIS  ├─────────────────────┤
//!  │                       │ log │ story         │      │ MIS       │           │ states: without │ … │
//!  └───────────────────────┴─────────────────────┘      └───────────┴───────────┴─────────────────────┘
//!           one run                                              a pair
//! ```
//!
//! The layout contains only views that have something to show.

mod nodes;

use closecall_traffic::Time;
use rerun::blueprint::components::{BackgroundKind, Eye3DKind};
use rerun::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use rerun::components::Range1D;
use rerun::datatypes::{Range2D, TimeInt, TimeRange, TimeRangeBoundary};

use self::nodes::{Node, View, below, beside, tabs};
use super::RecordingError;
use super::palette;
use super::parts::{
    Background, EntityBehavior, EyeControls3D, LineGrid3D, PlotLegend, ScalarAxis, TextLogColumns, TimeAxis,
    VisualBounds2D,
};
use super::plots::Plot;
use super::recording::Recording;
use super::stream::OPENING_TIMELINE;

/// Position of the eye of the 3D view in the frame of the rig (m): behind, beside and above.
const EYE_M: [f32; 3] = [-25.0, -17.0, 13.0];
/// Point at which the eye looks, in the frame of the rig (m).
const TARGET_M: [f32; 3] = [6.0, 1.0, 0.0];

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
    /// Colour behind the 3D scene.
    pub(super) sky: palette::Rgba,
    /// Lowest and highest position across the road in the view from above (m in the picture).
    pub(super) bird_range: [f64; 2],
    /// True if there are camera images.
    pub(super) has_camera: bool,
    /// True if there are states of the ego stack.
    pub(super) has_states: bool,
    /// The plots that have a curve.
    pub(super) plots: Vec<Plot>,
    /// Times of the first and the last frame.
    pub(super) span: [Time; 2],
    /// The weather, if it is not that of a clear day.
    pub(super) weather: Option<String>,
}

/// Writes the layout for these films.
pub(super) fn write(recording: &Recording, films: &[FilmContents]) -> Result<(), RecordingError> {
    let left = below(
        [Some((verdict_share(films), verdict())), bird(films).map(|view| (bird_share(films), view))]
            .into_iter()
            .flatten()
            .chain(scenes(films).map(|view| (if films.len() > 1 || is_traffic(films) { 3.4 } else { 5.0 }, view)))
            .collect(),
    );
    let mut states: Vec<Node> = films.iter().filter(|film| film.has_states).rev().map(states).collect();
    let mut right = Vec::new();
    let mut plots = films_plots(films);
    if !plots.is_empty() {
        right.push((2.5, plots.remove(0)));
    }
    right.extend(tabs(plots).map(|node| (2.4, node)));
    if !states.is_empty() {
        right.push((3.2, states.remove(0)));
    }
    states.extend([log(films), View::new("TextDocument", "Story", "summary").into()]);
    right.extend(tabs(states).map(|node| (1.9, node)));
    let columns = [left.map(|node| (11.0, node)), below(right).map(|node| (9.0, node))];
    let root = beside(columns.into_iter().flatten().collect());
    nodes::write(recording, root.unwrap_or_else(verdict), OPENING_TIMELINE)
}

/// Returns the room for the view from above: recorded roads have more lanes.
fn bird_share(films: &[FilmContents]) -> f32 {
    match films {
        [_] if is_traffic(films) => 3.4,
        [_] => 2.5,
        _ => 4.2,
    }
}

/// Returns the room for the verdict. That on recorded traffic is longer.
fn verdict_share(films: &[FilmContents]) -> f32 {
    match films {
        [_] if is_traffic(films) => 3.4,
        [_] => 2.6,
        _ => 2.9,
    }
}

fn verdict() -> Node {
    View::new("TextDocument", "Verdict", "verdict").into()
}

/// Returns the 3D views of the films, each with the rear camera if there is one.
fn scenes(films: &[FilmContents]) -> Option<Node> {
    let mut nodes = Vec::new();
    for film in films.iter().filter(|film| film.has_scene) {
        let mut own = vec![(3.0, scene(film))];
        if film.has_camera {
            let camera =
                View::new("2D", titled("Rear camera", films, film), format!("{}{}", film.root, super::camera::ENTITY));
            own.push((1.6, camera.into()));
        }
        nodes.extend(below(own).map(|node| (1.0, node)));
    }
    beside(nodes)
}

/// Returns the 3D view of a film, which moves along the road with the ego.
fn scene(film: &FilmContents) -> Node {
    let root = &film.root;
    let mut title = format!("Scene: {}", film.name);
    if let Some(weather) = &film.weather {
        title.push_str(&format!(" · {weather}"));
    }
    let eye = EyeControls3D::new()
        .with_kind(Eye3DKind::Orbital)
        .with_position(EYE_M)
        .with_look_target(TARGET_M)
        .with_eye_up([0.0, 0.0, 1.0]);
    let sky = Background::new(BackgroundKind::SolidColor).with_color(film.sky);
    let mut view = View::new("3D", title, format!("{root}world/rig"))
        .with_contents([format!("/{root}world/**")])
        .with("EyeControls3D", eye)
        .with("LineGrid3D", LineGrid3D::new().with_visible(false))
        .with("Background", sky);
    for layer in &film.hidden_layers {
        let path = format!("ViewContents/overrides/{root}{layer}/visualizers");
        view = view.with(path, EntityBehavior::update_fields().with_visible(false));
    }
    view.into()
}

/// Returns the view from above, in which the roads of all films lie below each other on one metre axis.
fn bird(films: &[FilmContents]) -> Option<Node> {
    let shown: Vec<&FilmContents> = films.iter().filter(|film| film.has_scene).collect();
    let low = shown.iter().map(|film| film.bird_range[0]).min_by(f64::total_cmp)?;
    let high = shown.iter().map(|film| film.bird_range[1]).max_by(f64::total_cmp)?;
    let subject = if is_traffic(films) { "vehicle that changes lanes" } else { "ego" };
    let view = View::new("2D", format!("From above · distance from the {subject} [m]"), "/")
        .with_contents(shown.iter().map(|film| format!("/{}bird/**", film.root)));
    let bounds = Range2D { x_range: super::bird::X_RANGE_M.into(), y_range: [low, high].into() };
    let road = Background::new(BackgroundKind::SolidColor).with_color(palette::GROUND);
    Some(view.with("VisualBounds2D", VisualBounds2D::new(bounds)).with("Background", road).into())
}

/// Returns the plots in which any film has a curve. All films share them.
fn films_plots(films: &[FilmContents]) -> Vec<Node> {
    let mut nodes = Vec::new();
    for kind in super::plots::KINDS {
        let of_kind: Vec<(&FilmContents, &Plot)> = films
            .iter()
            .flat_map(|film| film.plots.iter().filter(|plot| plot.kind == kind).map(move |plot| (film, plot)))
            .collect();
        if of_kind.is_empty() {
            continue;
        }
        let contents = of_kind.iter().map(|(film, _)| format!("/{}plots/{}/**", film.root, kind.name()));
        let low = of_kind.iter().map(|(_, plot)| plot.range[0]).fold(f64::INFINITY, f64::min);
        let high = of_kind.iter().map(|(_, plot)| plot.range[1]).fold(f64::NEG_INFINITY, f64::max);
        let note = if films.len() > 1 { " · thin: " } else { "" };
        let baseline = films.first().filter(|_| films.len() > 1).map_or("", |film| film.name.as_str());
        let view = View::new("TimeSeries", format!("{}{note}{baseline}", kind.title(is_traffic(films))), "/")
            .with_contents(contents)
            .with("PlotLegend", PlotLegend::new().with_visible(false))
            .with("ScalarAxis", ScalarAxis::new().with_range(Range1D::new(low, high)))
            .with("TimeAxis", whole_run(films));
        nodes.push(view.into());
    }
    nodes
}

/// Returns true if the recording shows recorded traffic only.
fn is_traffic(films: &[FilmContents]) -> bool {
    films.iter().all(|film| !film.has_states)
}

/// Returns a time axis over the longest of the films.
fn whole_run(films: &[FilmContents]) -> TimeAxis {
    let start = films.iter().map(|film| film.span[0]).min().unwrap_or(Time::ZERO);
    let end = films.iter().map(|film| film.span[1]).max().unwrap_or(Time::ZERO);
    let boundary = |time: Time| TimeRangeBoundary::Absolute(TimeInt(time.ns()));
    TimeAxis::new().with_view_range(TimeRange { start: boundary(start), end: boundary(end) })
}

/// Returns the log. It shows the texts only: their colours and words make other columns redundant.
fn log(films: &[FilmContents]) -> Node {
    let columns = [TextLogColumn { visible: true.into(), kind: TextLogColumnKind::Body }];
    View::new("TextLog", "Log", "/")
        .with_contents(films.iter().map(|film| format!("/{}log/**", film.root)))
        .with("TextLogColumns", TextLogColumns::new().with_text_log_columns(columns))
        .into()
}

/// Returns the view of the bands of states of a film.
fn states(film: &FilmContents) -> Node {
    View::new("StateTimeline", format!("States: {}", film.name), format!("{}states", film.root)).into()
}

/// Returns the title of a view, followed by the name of its arm if there are several films.
fn titled(title: &str, films: &[FilmContents], film: &FilmContents) -> String {
    if films.len() < 2 { title.to_owned() } else { format!("{title}: {}", film.name) }
}
