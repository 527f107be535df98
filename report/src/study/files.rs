//! The files of a study: its charts, its page, and its JSON.

use std::fmt::{self, Display, Formatter};
use std::path::{Path, PathBuf};

use closecall_campaign::boundary::Boundary;
use closecall_campaign::frontier::Frontier;
use closecall_campaign::sensitivity::{FactorKind, RunErrors, Sensitivity};
use closecall_studies::anchor::{Anchor, Quantity, Row};
use closecall_traffic::atomic::{WriteError, create_folder, write_file};
use closecall_traffic::words::counted;
use maud::{Markup, PreEscaped, html};
use serde_json::Value;

use super::aligned::{error_lines, mean, with_interval};
use super::anchor::{
    AnchorText, HEADS as ANCHOR_HEADS, cells as anchor_cells, charts as anchor_charts, conclusion as anchor_conclusion,
    name,
};
use super::boundary::{
    BoundaryText, about, cells as boundary_cells, charts as boundary_charts, heads as boundary_heads, ranges,
    statements, verdict,
};
use super::frontier::{FrontierText, HEADS, cells, charts as frontier_charts, others, short, without_collisions};
use super::sensitivity::{SensitivityText, conclusion};
use super::tornado::charts as tornado_charts;
use crate::campaign::html::page::{document, head, number, table, text_heads};
use crate::json;

/// A study with its outputs: text (`Display`), JSON, and files.
#[derive(Clone, Debug)]
pub enum Study {
    /// A sensitivity study.
    Sensitivity(Sensitivity),
    /// A frontier.
    Frontier(Frontier),
    /// A boundary of failing and passing.
    Boundary(Boundary),
    /// Emergency braking against crash records.
    Anchor(Anchor),
}

impl Display for Study {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sensitivity(study) => SensitivityText(study).fmt(f),
            Self::Frontier(frontier) => FrontierText(frontier).fmt(f),
            Self::Boundary(boundary) => BoundaryText(boundary).fmt(f),
            Self::Anchor(anchor) => AnchorText(anchor).fmt(f),
        }
    }
}

impl Study {
    /// Returns the study as JSON.
    pub fn json(&self) -> Value {
        let (value, seed) = match self {
            Self::Sensitivity(study) => (json::sensitivity(study), study.seed),
            Self::Frontier(frontier) => (json::frontier(frontier), frontier.seed),
            Self::Boundary(boundary) => (json::boundary(boundary), boundary.seed),
            Self::Anchor(anchor) => (json::anchor(anchor), anchor.seed),
        };
        json::stamped(value, Some(seed), None)
    }

    /// Returns the number of points or runs that ended in an error.
    pub fn errors(&self) -> u64 {
        match self {
            Self::Sensitivity(study) => study.errors().points,
            Self::Frontier(frontier) => frontier.errors.points,
            Self::Boundary(boundary) => boundary.errors.points,
            Self::Anchor(anchor) => anchor.errors.points,
        }
    }

    /// Returns true if the runs say what the study asks. Only a boundary can be inconclusive.
    pub fn is_conclusive(&self) -> bool {
        match self {
            Self::Boundary(boundary) => boundary.is_conclusive(),
            Self::Sensitivity(_) | Self::Frontier(_) | Self::Anchor(_) => true,
        }
    }
}

/// Writes the page, the charts and the JSON of a study into a folder, which is created if it does
/// not exist. Returns their paths.
///
/// # Errors
/// [`WriteError`] if a chart cannot be drawn or a file cannot be written.
pub fn write_study(folder: &Path, study: &Study) -> Result<Vec<PathBuf>, WriteError> {
    let fail = |source| WriteError::new(folder, source);
    let (name, chart_name, charts, page) = match study {
        Study::Sensitivity(study) => {
            let charts = tornado_charts(study).map_err(fail)?;
            let page = sensitivity_page(study, &charts);
            ("sensitivity", "tornado", charts, page)
        }
        Study::Frontier(frontier) => {
            let charts = frontier_charts(frontier).map_err(fail)?;
            let page = frontier_page(frontier, &charts);
            ("frontier", "frontier", charts, page)
        }
        Study::Boundary(boundary) => {
            let charts = boundary_charts(boundary).map_err(fail)?;
            let page = boundary_page(boundary, &charts);
            ("boundary", "boundary", charts, page)
        }
        Study::Anchor(anchor) => {
            let charts = anchor_charts(anchor).map_err(fail)?;
            let page = anchor_page(anchor, &charts);
            ("anchor", "anchor", charts, page)
        }
    };
    create_folder(folder)?;
    let mut files =
        vec![(format!("{name}.html"), page.into_string()), (format!("{name}.json"), format!("{:#}\n", study.json()))];
    files.extend(charts.into_iter().map(|(name, svg)| (format!("{chart_name}-{name}.svg"), svg)));
    let write = |(name, text): (String, String)| {
        let path = folder.join(name);
        write_file(&path, |file| file.write_all(text.as_bytes())).map(|()| path)
    };
    files.into_iter().map(write).collect()
}

type Charts = Vec<(&'static str, String)>;

fn errors(errors: &RunErrors, runs: &str) -> Markup {
    html! { @for line in error_lines(errors, runs) { p.failure { (line) } } }
}

fn sensitivity_page(study: &Sensitivity, charts: &Charts) -> Markup {
    let title = format!("Sensitivity: {}", study.scenario);
    let about = format!(
        "Controllers {}, {} factors, seed {}",
        study.controllers.join(" and "),
        study.factors.len(),
        study.seed
    );
    let body = html! {
        (head(&title, &study.settings, &about))
        p { strong { (conclusion(study)) } }
        (errors(&study.errors(), "points"))
        @for (index, output) in study.outputs.iter().enumerate() {
            section {
                h2 { (output.title()) }
                @if let Some((_, svg)) = charts.get(index) { figure.broad tabindex="0" { (PreEscaped(svg)) } }
                @if let Some(decomposition) = &study.decomposition {
                    @let of_output = &decomposition.indices[index];
                    p.note {
                        "Mean " (mean(*output, of_output.mean)) " over " (decomposition.points) " points. The bars show the smallest and the "
                        "largest mean over the quarters of a factor's distribution, with 95 % intervals; grey: chance, or an index of "
                        "the quarters whose interval reaches 0. The table says what moves single samples: the total index is the share of "
                        "the variance that would be left if only this factor were unknown, the first-order index the share that it "
                        "explains alone."
                    }
                    (table(&text_heads(&["factor", "total index (95 %)", "first-order index (95 %)"]), &html! {
                        @for group in of_output.order() {
                            tr {
                                td { (decomposition.groups[group].label) }
                                (number(with_interval(of_output.of_groups[group].total)))
                                (number(with_interval(of_output.of_groups[group].first)))
                            }
                        }
                    }))
                }
            }
        }
        section {
            h2 { "Factors" }
            p.note { "A number of the scenario file is uniformly distributed over its range; a parameter keeps its distribution." }
            (table(&text_heads(&["factor", "kind", "from", "to", "source"]), &html! {
                @for factor in &study.factors {
                    tr {
                        td { (factor.name) }
                        td { (factor.kind.name()) }
                        @let ends = factor.range.map(|ends| ends.map(|end| format!("{end:.4}"))).unwrap_or_default();
                        @for end in ends { (number(end)) }
                        td { (factor.source) }
                    }
                }
                @for left in &study.left_out {
                    tr { td { (left.key) } td { "left out" } td {} td {} td { (left.reason) } }
                }
            }))
            @if study.factors.iter().any(|factor| factor.kind == FactorKind::Chance) {
                p.note { "Chance is the number that keys the random streams of a run. Both arms always share it." }
            }
        }
    };
    document(&title, &body)
}

fn anchor_page(anchor: &Anchor, charts: &Charts) -> Markup {
    let title = "Emergency braking against crash records";
    let (arms, samples) = (anchor.controllers.join(" and "), counted(anchor.samples, "sample"));
    let about = format!("{}: {arms}, {samples} of each row, seed {}", anchor.scenario, anchor.seed);
    let rows = |head: &str, rows: &[Row]| {
        let heads: Vec<&str> = std::iter::once(head).chain(ANCHOR_HEADS).collect();
        table(
            &text_heads(&heads),
            &html! {
                @for row in rows {
                    tr {
                        td { (name(row)) }
                        @for cell in anchor_cells(row) { (number(cell)) }
                    }
                }
            },
        )
    };
    let body = html! {
        (head(title, &anchor.settings, &about))
        @for quantity in Quantity::ALL { p { strong { (anchor_conclusion(anchor, quantity)) } } }
        (errors(&anchor.errors, "samples"))
        @for (_, svg) in charts { figure.broad tabindex="0" { (PreEscaped(svg)) } }
        section { h2 { "Drivers" } (rows("drivers", &anchor.members)) }
        section { h2 { "One assumption varied" } (rows("assumption", &anchor.variations)) }
    };
    document(title, &body)
}

fn frontier_page(frontier: &Frontier, charts: &Charts) -> Markup {
    let title = format!("Frontier: {}", frontier.scenario);
    let (controllers, samples) = (frontier.controllers.join(" and "), counted(frontier.samples, "sample"));
    let about = format!("Controllers {controllers}, {samples} for each combination, seed {}", frontier.seed);
    let keys: Vec<&str> = frontier.keys.iter().map(|key| short(key)).collect();
    let heads: Vec<&str> = [""].into_iter().chain(keys).chain(HEADS).collect();
    let body = html! {
        (head(&title, &frontier.settings, &about))
        (errors(&frontier.errors, "runs"))
        @if let Some(reason) = without_collisions(frontier) { p { strong { (reason) } } } @else {
            p.note {
                "Marked combinations are Pareto-optimal: no other one prevents more, induces less or loses less speed without being worse "
                "in another of the three. All combinations run the same samples. Lines are 95 % intervals. Overlapping "
                "intervals do not tell two combinations apart."
            }
        }
        @for (_, svg) in charts { figure.broad tabindex="0" { (PreEscaped(svg)) } }
        section {
            h2 { "Combinations" }
            (table(&text_heads(&heads), &html! {
                @for point in &frontier.points {
                    tr.tested[point.is_optimal] {
                        td { @if point.is_optimal { "◆" } }
                        @for value in &point.values { (number(value)) }
                        @for cell in cells(point) { (number(cell)) }
                    }
                }
            }))
            @if let Some(others) = others(frontier) { p.note { (others) } }
            p.note { "Keys: " @for key in &frontier.keys { code { (key) } " " } }
        }
    };
    document(&title, &body)
}

fn boundary_page(boundary: &Boundary, charts: &Charts) -> Markup {
    let title = format!("Boundary: {}", boundary.scenario);
    let heads = boundary_heads(boundary);
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let body = html! {
        (head(&title, &boundary.settings, &about(boundary)))
        p { "Event: " code { (boundary.event) } ". " (ranges(boundary)) "." }
        (errors(&boundary.errors, "runs"))
        @for line in verdict(boundary) { p.failure { (line) } }
        @for (_, svg) in charts { figure.broad tabindex="0" { (PreEscaped(svg)) } }
        p.note {
            "Orange runs: the event happens; grey runs: it does not; runs in the colour of the text: no value. The line is where a "
            "Gaussian process puts the boundary. In the grey band the event is not decided with 95 %; in the orange area it happens."
        }
        @if let Some(surveyed) = &boundary.surveyed {
            @for line in statements(surveyed) { p { (line) } }
            section {
                h2 { "Boundary" }
                (table(&text_heads(&heads), &html! {
                    @for slice in &surveyed.slices {
                        @let [first, crossings] = boundary_cells(slice);
                        tr { (number(first)) td { (crossings) } }
                    }
                }))
            }
        }
        p.note { "Keys: " @for key in &boundary.keys { code { (key) } " " } }
    };
    document(&title, &body)
}
