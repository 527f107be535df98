//! The page: the curves of each factor, and the figures of each case.

use std::fmt::Write;

use closecall_report::page::{document, number_heads, table, text_heads};
use maud::{Markup, PreEscaped, html};

use super::number;
use crate::approach::GAPS_M;
use crate::cases::Case;
use crate::figures::{CurvePoint, Estimate, Figures};
use crate::study::Study;

/// Size of a chart (px), and of its margins: left, right, above, below.
const SIZE_PX: [f64; 2] = [560.0, 260.0];
const MARGINS_PX: [f64; 4] = [52.0, 12.0, 26.0, 40.0];
/// Colours of the lines: Okabe and Ito, Color Universal Design (2008).
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];
/// Dashes of the lines of the second study, and of the lines beyond the colours.
const DASHES: [&str; 4] = ["", "6 3", "2 3", "8 3 2 3"];
/// Width of the last line that is drawn (px), what each one below it is wider, and the greatest width: of lines that coincide, each
/// shows at the edges of the next.
const WIDTHS_PX: [f64; 3] = [1.6, 0.8, 5.6];

/// A line of a chart.
struct Line {
    name: String,
    /// Distance, value, and bounds of the interval if it has one.
    points: Vec<(f64, f64, Option<[f64; 2]>)>,
    dash: usize,
}

/// What a chart shows of a point of a curve.
type Shown = fn(&CurvePoint) -> Option<(f64, Option<[f64; 2]>)>;

const CHARTS: [(&str, Shown); 4] = [
    ("probability of a confirmed track", |it| Some((it.confirmed.value, Some(it.confirmed.interval_95)))),
    ("error along the road, root mean square (m)", |it| Some((it.rmse?[0], None))),
    ("error across the road, root mean square (m)", |it| Some((it.rmse?[1], None))),
    ("error of the speed, root mean square (m/s)", |it| Some((it.rmse?[2], None))),
];

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
    let body = html! {
        h1 { (title) }
        @for (study, name) in studies.iter().zip(&names) {
            p { (name) ": " (study.runs) " approaches of each case, seed " (study.seed) ". A vehicle comes from "
                (GAPS_M[0]) " m behind the ego to " (GAPS_M[1]) " m, at 10 to 50 km/h more. No controller acts." }
        }
        p { "Bars are 95 % intervals (Clopper and Pearson). An error has no value at a distance at which fewer than two approaches have a track." }
        @for factor in factors {
            h2 { (heading(factor)) }
            @for names in groups(studies, factor) {
                div { @for (name, shown) in CHARTS { (PreEscaped(chart(name, &lines(studies, &names, shown)))) } }
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

/// Returns the names of the cases of a factor, in groups of as many as a chart can show beside the usual one.
fn groups<'a>(studies: &'a [Study], factor: &str) -> Vec<Vec<&'a str>> {
    let mut names: Vec<&str> = Vec::new();
    for (case, _) in studies.iter().flat_map(|study| &study.cases).filter(|(case, _)| case.factor == factor) {
        if !names.contains(&&*case.name) {
            names.push(&case.name);
        }
    }
    names.chunks(COLOURS.len() - 1).map(<[&str]>::to_vec).collect()
}

/// Returns the lines of some cases beside the usual one, of each study.
fn lines(studies: &[Study], names: &[&str], shown: Shown) -> Vec<Line> {
    let mut lines = Vec::new();
    for (dash, study) in studies.iter().enumerate() {
        let varied = study.cases.iter().filter(|(case, _)| names.contains(&&*case.name) || case.factor == "usual");
        for (case, figures) in varied {
            let point = |it: &CurvePoint| shown(it).map(|(value, interval)| (it.gap_m, value, interval));
            let name = if studies.len() > 1 { format!("{}: {}", study.name, case.name) } else { case.name.clone() };
            lines.push(Line { name, points: figures.curve.iter().filter_map(point).collect(), dash });
        }
    }
    lines
}

/// Returns a chart as SVG, with its legend.
fn chart(name: &str, lines: &[Line]) -> String {
    let values = lines.iter().flat_map(|line| line.points.iter().map(|point| point.1));
    let top = nice(values.fold(0.0_f64, f64::max));
    let of_lines = lines.len() / (1 + lines.iter().map(|line| line.dash).max().unwrap_or(0));
    let [width, height] = SIZE_PX;
    let [left, right, above, below] = MARGINS_PX;
    let x = |gap_m: f64| left + (width - left - right) * gap_m / GAPS_M[0];
    let y = |value: f64| height - below - (height - above - below) * (value / top).min(1.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {}\" width=\"{width}\" role=\"img\" \
         font-family=\"DejaVu Sans, sans-serif\" font-size=\"11\" fill=\"#333\"><title>{}</title>\
         <text x=\"{left}\" y=\"15\" font-size=\"13\">{}</text>",
        height + 15.0 * lines.len() as f64 + 10.0,
        escaped(name),
        escaped(name)
    );
    // Writing to a string does not fail.
    let mut put = |text: std::fmt::Arguments<'_>| svg.write_fmt(text).unwrap_or_default();
    for tick in 0..=4 {
        let value = top * f64::from(tick) / 4.0;
        let at = y(value);
        put(format_args!(
            "<path d=\"M{left} {at:.1}H{:.1}\" stroke=\"#e3e7ec\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            width - right,
            left - 6.0,
            at + 4.0,
            format!("{value:.3}").trim_end_matches('0').trim_end_matches('.')
        ));
    }
    for gap_m in (0..=150).step_by(25) {
        let at = x(f64::from(gap_m));
        put(format_args!(
            "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{gap_m}</text>",
            height - below + 16.0
        ));
    }
    put(format_args!(
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">distance from the front of the vehicle to the ego's rear (m)</text>",
        0.5 * (left + width - right),
        height - 6.0
    ));
    let [last_px, wider_px, widest_px] = WIDTHS_PX;
    for (index, line) in lines.iter().enumerate() {
        let same = lines[..index].iter().find(|earlier| earlier.points == line.points);
        let note = match same {
            _ if line.points.is_empty() => " (no track)".to_owned(),
            Some(earlier) => format!(" (the same as {})", earlier.name),
            None => String::new(),
        };
        let of_study = index % of_lines.max(1);
        let colour = COLOURS[of_study % COLOURS.len()];
        let dash = DASHES[(line.dash + of_study / COLOURS.len()) % DASHES.len()];
        let path: Vec<String> =
            line.points.iter().map(|point| format!("{:.1} {:.1}", x(point.0), y(point.1))).collect();
        if !path.is_empty() {
            put(format_args!(
                "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{:.1}\" stroke-dasharray=\"{dash}\"/>",
                path.join("L"),
                (last_px + wider_px * (lines.len() - 1 - index) as f64).min(widest_px)
            ));
        }
        for (gap_m, _, interval) in &line.points {
            let Some([low, high]) = interval else { continue };
            // Bars side by side do not hide each other.
            let at = x(*gap_m) + 1.5 * (index as f64 - 0.5 * lines.len() as f64);
            put(format_args!(
                "<path d=\"M{at:.1} {:.1}V{:.1}\" stroke=\"{colour}\" stroke-opacity=\"0.5\"/>",
                y(*low),
                y(*high)
            ));
        }
        let at = height + 15.0 * index as f64 + 12.0;
        put(format_args!(
            "<path d=\"M{left} {:.1}h26\" stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\"/><text x=\"{:.1}\" y=\"{at:.1}\">{}</text>",
            at - 4.0,
            left + 34.0,
            escaped(&format!("{}{note}", line.name))
        ));
    }
    svg.push_str("</svg>");
    svg
}

/// Returns the next value at which an axis may end: 1, 2 or 5 times a power of ten.
fn nice(largest: f64) -> f64 {
    if !(largest > 0.0) {
        return 1.0;
    }
    let power = 10.0_f64.powf(largest.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|step| step * power).find(|end| *end >= largest - 1e-12).unwrap_or(largest)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Returns a value with its interval.
fn with_interval(of: Option<Estimate>, decimals: usize) -> String {
    let Some(Estimate { value, interval_95: [low, high] }) = of else { return "-".to_owned() };
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
    let percent = |of: Option<Estimate>| {
        of.map(|it| Estimate { value: 100.0 * it.value, interval_95: it.interval_95.map(|bound| 100.0 * bound) })
    };
    let row = |(case, of): &(Case, Figures)| {
        let mut cells = vec![with_interval(Some(of.range_m), 0)];
        for index in 0..3 {
            let errors = of.errors.map(|errors| errors[index]);
            cells.push(with_interval(errors.map(|it| it.bias), 2));
            cells.push(with_interval(errors.map(|it| it.rmse), 2));
            cells.push(number(errors.map(|it| it.q95), 2));
        }
        cells.push(with_interval(of.confirmed_after_s, 2));
        cells.push(with_interval(percent(Some(of.confirms)), 0));
        cells.push(with_interval(Some(of.false_tracks_per_h), 0));
        cells.push(with_interval(Some(of.id_switches), 2));
        cells.push(with_interval(percent(Some(of.unavailable)), 0));
        cells.push(with_interval(Some(of.gospa_m), 2));
        cells.push(with_interval(percent(of.class_accuracy), 0));
        cells.push(number(of.calibration_error, 3));
        cells.push(with_interval(of.nees, 1));
        html! { tr { td { (case.name) } @for cell in &cells { td.number { (cell) } } } }
    };
    table(&heads, &html! { @for case in &study.cases { (row(case)) } })
}

/// Returns the calibration of the class scores of the usual case, of each study.
fn calibrations(studies: &[Study]) -> Markup {
    let heads =
        html! { (text_heads(&["configuration", "case"])) (number_heads(&["mean score", "share right", "steps"])) };
    let rows = html! {
        @for study in studies {
            @for (case, of) in study.cases.iter().filter(|(case, _)| matches!(case.factor, "usual" | "class" | "light")) {
                @for bin in &of.calibration {
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
