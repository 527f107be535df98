//! The layout with which the viewer opens a recording (its blueprint), stored in the recording
//! itself.
//!
//! ```text
//!  ┌───────────────────────┬─────────────────────┐      ┌───────────────────────┬─────────────────────┐
//!  │ verdict               │ time headway        │      │ verdict               │ time headway        │
//!  ├───────────────────────┤                     │      ├───────────────────────┤                     │
//!  │ from above            ├─────────────────────┤      │ from above: both arms ├─────────────────────┤
//!  ├───────────────────────┤ acceleration │ …    │      │ on one metre axis     │ acceleration │ …    │
//!  │ scene                 ├─────────────────────┤      ├───────────┬───────────┼─────────────────────┤
//!  ├───────────────────────┤ states │ log │ story│      │ scenes │ rear cameras │ states │ log │ story│
//!  │ rear camera           │                     │      │           │           │ of both arms        │
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

pub(super) use self::nodes::BLUEPRINT_TIMELINE;
use self::nodes::{Node, View, below, beside, named, tabs};
use super::RecordingError;
use super::camera::{Pictures, STRIP_PX};
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
    /// The pictures of the rear cameras.
    pub(super) cameras: Vec<Pictures>,
    /// True if there are states of the ego stack.
    pub(super) has_states: bool,
    /// The plots that have a curve.
    pub(super) plots: Vec<Plot>,
    /// Times of the first and the last frame.
    pub(super) span: [Time; 2],
}

/// Writes the layout for these films. `verdict_text` is the text of the verdict.
pub(super) fn write(recording: &Recording, films: &[FilmContents], verdict_text: &str) -> Result<(), RecordingError> {
    let has_camera = films.iter().any(|film| !film.cameras.is_empty());
    let views: Vec<(f32, Node)> = bird(films)
        .map(|view| (bird_share(films), view))
        .into_iter()
        .chain(scenes(films).map(|view| (scenes_share(films, has_camera), view)))
        .collect();
    let rest = views.iter().map(|(share, _)| share).sum();
    let left = below(std::iter::once((verdict_share(verdict_text, rest), verdict())).chain(views).collect());
    let mut right = Vec::new();
    let mut plots = films_plots(films);
    if !plots.is_empty() {
        right.push((2.5, plots.remove(0)));
    }
    right.extend(tabs(plots).map(|node| (2.4, node)));
    let story = View::new("TextDocument", "Story", "summary").into();
    let told = films.iter().any(|film| film.has_states).then(states).into_iter().chain([log(films), story]);
    right.extend(tabs(told.collect()).map(|node| (5.1, node)));
    // Camera and point cloud need the room.
    let left_share = if has_camera { 14.0 } else { 11.0 };
    let columns = [left.map(|node| (left_share, node)), below(right).map(|node| (9.0, node))];
    let root = beside(columns.into_iter().flatten().collect());
    nodes::write(recording, root.unwrap_or_else(verdict), OPENING_TIMELINE)
}

/// Height of the view from above of a pair on a road of three lanes (m in the picture), and the
/// most by which the view of wider roads is higher.
const PAIR_M: f64 = 47.7;
const MOST_HIGHER: f64 = 1.6;

/// Returns the room for the view from above: recorded roads have more lanes.
fn bird_share(films: &[FilmContents]) -> f32 {
    let ends = films.iter().flat_map(|film| film.bird_range);
    let [low, high] = ends.fold([0.0_f64; 2], |[low, high], end| [low.min(end), high.max(end)]);
    let higher = ((high - low) / PAIR_M).clamp(1.0, MOST_HIGHER) as f32;
    match films {
        [_] if is_traffic(films) => 3.4,
        [_] => 3.0,
        _ if films.iter().any(|film| !film.cameras.is_empty()) => 5.0 * higher,
        _ => 4.6 * higher,
    }
}

/// Returns the room for the scenes. With images of the camera they take a third of the window.
fn scenes_share(films: &[FilmContents], has_camera: bool) -> f32 {
    match has_camera {
        true if films.len() > 1 => 6.4,
        true => 7.4,
        false if films.len() > 1 || is_traffic(films) => 3.8,
        false => 5.4,
    }
}

/// Height of the window below its bars, of a line of the verdict, and of what surrounds the lines,
/// in a window of 1280 x 720 px (px).
const WINDOW_PX: f32 = 662.0;
const LINE_PX: f32 = 15.0;
const AROUND_LINES_PX: f32 = 52.0;
/// Letters in a line of the verdict there.
const LINE_LETTERS: usize = 110;
/// Largest part of the column that the verdict takes.
const MOST_OF_COLUMN: f32 = 0.4;

/// Returns the room for the verdict, if the other views of the column have the room `rest`: as much
/// as its lines take in a window of 1280 x 720 px.
fn verdict_share(told: &str, rest: f32) -> f32 {
    // Code has wider letters, and moves to the next line as a whole: it counts twice.
    let letters = |line: &str| -> usize {
        let parts = line.replace("**", "");
        parts.split('`').zip([1, 2].into_iter().cycle()).map(|(part, factor)| factor * part.chars().count()).sum()
    };
    let lines: usize = told.trim().lines().map(|line| letters(line).div_ceil(LINE_LETTERS).max(1)).sum();
    let part = ((AROUND_LINES_PX + LINE_PX * lines as f32) / WINDOW_PX).min(MOST_OF_COLUMN);
    if rest > 0.0 { rest * part / (1.0 - part) } else { 1.0 }
}

fn verdict() -> Node {
    View::new("TextDocument", "Verdict", "verdict").into()
}

/// Returns the 3D views of the films with the images of the rear cameras. The views of one film lie
/// below each other, and the views of a pair are tabs. Several cameras of one film are tabs.
fn scenes(films: &[FilmContents]) -> Option<Node> {
    let scenes: Vec<(f32, Node)> = films.iter().filter(|film| film.has_scene).map(|film| (1.0, scene(film))).collect();
    let camera_of = |film: &FilmContents| {
        let view = |pictures: &Pictures| camera(titled(&pictures.title, films, film), film, pictures);
        tabs(film.cameras.iter().map(view).collect()).map(|node| (1.0, node))
    };
    let cameras: Vec<(f32, Node)> = films.iter().filter_map(camera_of).collect();
    match (scenes.len(), cameras.is_empty()) {
        (_, true) => beside(scenes),
        (1, false) => below(scenes.into_iter().chain(cameras).collect()),
        _ => {
            let [scenes, cameras] = [
                beside(scenes).map(|node| named("Scenes", node)),
                below(cameras).map(|node| named("Rear cameras", node)),
            ];
            tabs(scenes.into_iter().chain(cameras).collect())
        }
    }
}

/// Returns the view of the pictures of a rear camera, with the strip above them that has the
/// labels.
fn camera(title: String, film: &FilmContents, pictures: &Pictures) -> Node {
    let [width_px, height_px] = pictures.size_px;
    let bounds = Range2D { x_range: [0.0, width_px].into(), y_range: [-STRIP_PX, height_px].into() };
    let strip = Background::new(BackgroundKind::SolidColor).with_color(palette::GROUND);
    let view = View::new("2D", title, format!("{}{}", film.root, pictures.entity));
    view.with("VisualBounds2D", VisualBounds2D::new(bounds)).with("Background", strip).into()
}

/// Returns the 3D view of a film, which moves along the road with the ego.
fn scene(film: &FilmContents) -> Node {
    let root = &film.root;
    let title = format!("Scene: {}", film.name);
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

/// Returns the view from above, in which the roads of all films lie below each other on one metre
/// axis.
fn bird(films: &[FilmContents]) -> Option<Node> {
    let shown: Vec<&FilmContents> = films.iter().filter(|film| film.has_scene).collect();
    let low = shown.iter().map(|film| film.bird_range[0]).min_by(f64::total_cmp)?;
    let high = shown.iter().map(|film| film.bird_range[1]).max_by(f64::total_cmp)?;
    let subject = if is_traffic(films) { "vehicle that changes lanes" } else { "E" };
    let outlines = if shown.len() > 1 { " · outlines: other arm" } else { "" };
    let title = format!("From above [m from {subject} blue] · F orange · R pink · tracks cyan{outlines}");
    let view = View::new("2D", title, "/").with_contents(shown.iter().map(|film| format!("/{}bird/**", film.root)));
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
        // The title of the first plot explains the thin curves of all plots.
        let is_first = films.len() > 1 && nodes.is_empty();
        let note = if is_first { " · thin: " } else { "" };
        let baseline = films.first().filter(|_| is_first).map_or("", |film| film.name.as_str());
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

/// Room for the half of a label at the end of a time axis, as a share of its length: 15 px of 500
/// px.
const LABEL_ROOM: f64 = 0.03;

/// Lengths of a run between which the viewer labels no tick but the first, in a window of 1280 px:
/// single seconds have no room, and the next labelled tick is beyond the end (s). The axis of such
/// a run reaches to that tick.
const BETWEEN_TICKS_S: [f64; 2] = [6.5, 10.0];

/// Returns a time axis over the longest of the films, with room for the label of its last tick.
fn whole_run(films: &[FilmContents]) -> TimeAxis {
    let start = films.iter().map(|film| film.span[0]).min().unwrap_or(Time::ZERO);
    let end = films.iter().map(|film| film.span[1]).max().unwrap_or(Time::ZERO);
    let boundary = |time: Time| TimeRangeBoundary::Absolute(TimeInt(time.ns()));
    let shown = Time::from_s(axis_length_s(start, end));
    TimeAxis::new().with_view_range(TimeRange { start: boundary(start), end: boundary(start + shown) })
}

/// Time between the labelled ticks of a run that is longer than [`BETWEEN_TICKS_S`] (s).
const TICKS_S: f64 = 10.0;

/// Returns the length of the time axis of a run (s). A tick just beyond the end has the room of its
/// label, too.
fn axis_length_s(start: Time, end: Time) -> f64 {
    let [from_s, to_s] = BETWEEN_TICKS_S;
    let length_s = (end - start).s();
    let is_without_second = start == Time::ZERO && length_s > from_s && length_s < to_s;
    let to_next_tick_s = (end.s() / TICKS_S).ceil() * TICKS_S - start.s();
    let shown_s =
        if is_without_second || to_next_tick_s < (1.0 + LABEL_ROOM) * length_s { to_next_tick_s } else { length_s };
    (1.0 + LABEL_ROOM) * shown_s
}

/// Returns the log. It shows the texts only: their colours and words make other columns redundant.
fn log(films: &[FilmContents]) -> Node {
    let columns = [TextLogColumn { visible: true.into(), kind: TextLogColumnKind::Body }];
    View::new("TextLog", "Log", "/")
        .with_contents(films.iter().map(|film| format!("/{}log/**", film.root)))
        .with("TextLogColumns", TextLogColumns::new().with_text_log_columns(columns))
        .into()
}

/// Returns the view of the bands of states of all films. The moments have the colours of their
/// lines in the plots.
fn states() -> Node {
    View::new("StateTimeline", "States · moments: colours of the lines", super::plots::STATES_ENTITY).into()
}

/// Returns the title of a view, followed by the name of its arm if there are several films.
fn titled(title: &str, films: &[FilmContents], film: &FilmContents) -> String {
    if films.len() < 2 { title.to_owned() } else { format!("{title}: {}", film.name) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_axis_has_room_for_its_last_label_and_for_a_second_one() {
        let length_s = |end_ms| axis_length_s(Time::ZERO, Time::from_ms(end_ms));
        assert!((length_s(60_000) - 61.8).abs() < 1e-9 && (length_s(6_000) - 6.18).abs() < 1e-9);
        assert!((length_s(8_900) - 10.3).abs() < 1e-9, "the tick of 10 s is on the axis");
        assert!((length_s(19_860) - 20.6).abs() < 1e-9, "the label of 20 s has room");
        let recorded = axis_length_s(Time::from_ms(133_600), Time::from_ms(142_000));
        assert!((recorded - 1.03 * 8.4).abs() < 1e-9, "a multiple of 10 s may lie within");
    }

    #[test]
    fn the_verdict_has_the_room_of_its_lines_and_not_more() {
        let height_px = |told: &str| {
            let share = verdict_share(told, 8.0);
            WINDOW_PX * share / (share + 8.0)
        };
        let two = "**COLLISION**\n\n- **with MIS: R struck E**\n";
        assert!((height_px(two) - (AROUND_LINES_PX + 3.0 * LINE_PX)).abs() < 0.01);
        let long = format!("{two}- **{}**\n", "x".repeat(2 * LINE_LETTERS + 1));
        assert!((height_px(&long) - height_px(two) - 3.0 * LINE_PX).abs() < 0.01);
        assert!(height_px(&long.repeat(50)) <= MOST_OF_COLUMN * WINDOW_PX + 0.01, "the other views keep their room");
        let with_code = two.replace("COLLISION", &format!("COLLISION · with `{}`", "x".repeat(LINE_LETTERS / 2)));
        assert!((height_px(&with_code) - height_px(two) - LINE_PX).abs() < 0.01, "code takes more room");
        assert!(verdict_share(two, 0.0) > 0.0, "a verdict alone");
    }
}
