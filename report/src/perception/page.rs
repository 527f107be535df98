//! The page: the curves of each factor, and the figures of each case.

use crate::page::{document, head, number_heads, table, text_heads};
use maud::{Markup, html};

use super::chart::{COLOURS, Chart, Line, legend};
use super::number;
use closecall_studies::perception::approach::GAPS_M;
use closecall_studies::perception::cases::Case;
use closecall_studies::perception::figures::{Estimate, Figures};
use closecall_studies::perception::study::Study;

/// Returns the page of one study, or of two.
pub(super) fn page(studies: &[Study]) -> Markup {
    let names: Vec<String> = studies.iter().map(|study| format!("{} ({})", study.name, study.mode.name())).collect();
    let title = format!("Sensors: {}", names.join(" against "));
    let mut factors: Vec<&str> = Vec::new();
    for (case, _) in studies.iter().flat_map(|study| &study.cases) {
        if case.factor != "usual" && !factors.contains(&case.factor) {
            factors.push(case.factor);
        }
    }
    let about = studies.iter().zip(&names);
    let about =
        about.map(|(study, name)| format!("{name}: {} approaches of each case, seed {}", study.runs, study.seed));
    let body = html! {
        (head(&title, &[], &about.collect::<Vec<_>>().join("; ")))
        p {
            "A vehicle comes from " (GAPS_M[0]) " m behind the ego to " (GAPS_M[1]) " m, at 10 to 50 km/h more. No controller acts."
        }
        p { "Bars are 95 % intervals (Clopper and Pearson). There are three errors: of the position of the front along the road, of the \
             position across it, and of the speed. An error has no value at a distance at which fewer than two approaches have a track." }
        @for factor in factors {
            h2 { (heading(factor)) }
            @for names in groups(studies, factor) {
                (charts(&lines(studies, &names)))
            }
        }
        h2 { "Figures" }
        @for (study, name) in studies.iter().zip(&names) {
            h3 { (name) }
            (figures(study))
        }
        h2 { "Class scores" }
        p { "If the scores are right, the share of steps in which the most probable class is the true one equals its score." }
        (calibrations(studies))
    };
    document(&title, &body)
}

fn heading(factor: &str) -> &'static str {
    match factor {
        "class" => "Class of the vehicle",
        "paint" => "Reflectivity of the paint",
        "plate" => "Registration plate of a dark car",
        "offset" => "Lateral offset",
        "weather" => "Weather",
        "light" => "Light",
        "traffic" => "Traffic in between",
        _ => "Faults",
    }
}

/// Returns the names of the cases of a factor, in groups. A chart has room for one group beside the
/// standard case.
fn groups<'a>(studies: &'a [Study], factor: &str) -> Vec<Vec<&'a str>> {
    let mut names: Vec<&str> = Vec::new();
    for (case, _) in studies.iter().flat_map(|study| &study.cases).filter(|(case, _)| case.factor == factor) {
        if !names.contains(&&*case.name) {
            names.push(&case.name);
        }
    }
    names.chunks(COLOURS.len() - 1).map(<[&str]>::to_vec).collect()
}

/// Returns the lines of some cases beside the standard case, of each study.
fn lines<'a>(studies: &'a [Study], names: &[&str]) -> Vec<Line<'a>> {
    let mut lines = Vec::new();
    for (number, study) in studies.iter().enumerate() {
        let shown = study.cases.iter().filter(|(case, _)| names.contains(&&*case.name) || case.factor == "usual");
        for (index, (case, figures)) in shown.enumerate() {
            let name = if studies.len() > 1 { format!("{}: {}", study.name, case.name) } else { case.name.clone() };
            lines.push(Line { name, curve: &figures.curve, place: [number, index] });
        }
    }
    lines
}

/// Returns the charts of some lines with their legend.
fn charts(lines: &[Line<'_>]) -> Markup {
    html! {
        div.charts.of-case {
            figure { (Chart::PROBABILITY.svg(lines)) }
            div { (legend(lines)) }
        }
        div.charts.errors {
            @for chart in &Chart::ERRORS { figure { (chart.svg(lines)) } }
        }
    }
}

/// Returns a value with its interval.
fn with_interval(estimate: Option<Estimate>, decimals: usize) -> String {
    let Some(Estimate { value, interval_95: [low, high] }) = estimate else { return "-".to_owned() };
    match low.is_finite() && high.is_finite() {
        true => format!("{value:.decimals$} ({low:.decimals$} to {high:.decimals$})"),
        false => format!("{value:.decimals$}"),
    }
}

/// Returns the table of the figures of a study.
fn figures(study: &Study) -> Markup {
    let heads = html! {
        (text_heads(&["case"]))
        (number_heads(&[
            "first confirmed track (m)", "along: bias (m)", "RMSE (m)", "95 % (m)", "across: bias (m)", "RMSE (m)", "95 % (m)",
            "speed: bias (m/s)", "RMSE (m/s)", "95 % (m/s)", "confirmed after (s)", "within 4 s (%)", "false tracks (1/h)",
            "id switches", "not available (%)", "GOSPA (m)", "class right (%)", "calibration error", "NEES (4)",
        ]))
    };
    let percent = |estimate: Option<Estimate>| {
        estimate.map(|estimate| Estimate {
            value: 100.0 * estimate.value,
            interval_95: estimate.interval_95.map(|bound| 100.0 * bound),
        })
    };
    let row = |(case, figures): &(Case, Figures)| {
        let mut cells = vec![with_interval(Some(figures.range_m), 0)];
        for index in 0..3 {
            let errors = figures.errors.map(|errors| errors[index]);
            cells.push(with_interval(errors.map(|error| error.bias), 2));
            cells.push(with_interval(errors.map(|error| error.rmse), 2));
            cells.push(number(errors.map(|error| error.q95), 2));
        }
        cells.push(with_interval(figures.confirmed_after_s, 2));
        cells.push(with_interval(percent(Some(figures.confirms)), 0));
        cells.push(with_interval(Some(figures.false_tracks_per_h), 0));
        cells.push(with_interval(Some(figures.id_switches), 2));
        cells.push(with_interval(percent(Some(figures.unavailable)), 0));
        cells.push(with_interval(Some(figures.gospa_m), 2));
        cells.push(with_interval(percent(figures.class_accuracy), 0));
        cells.push(number(figures.calibration_error, 3));
        cells.push(with_interval(figures.nees, 1));
        html! { tr { td { (case.name) } @for cell in &cells { td.number { (cell) } } } }
    };
    table(&heads, &html! { @for case in &study.cases { (row(case)) } })
}

/// Returns the calibration of the class scores of the standard case, of each study.
fn calibrations(studies: &[Study]) -> Markup {
    let heads =
        html! { (text_heads(&["configuration", "case"])) (number_heads(&["mean score", "share right", "steps"])) };
    let rows = html! {
        @for study in studies {
            @for (case, figures) in study.cases.iter().filter(|(case, _)| matches!(case.factor, "usual" | "class" | "light")) {
                @for bin in &figures.calibration {
                    tr {
                        td { (study.name) } td { (case.name) }
                        td.number { (format!("{:.3}", bin.confidence)) }
                        td.number { (format!("{:.3}", bin.accuracy)) }
                        td.number { (bin.steps) }
                    }
                }
            }
        }
    };
    table(&heads, &rows)
}
