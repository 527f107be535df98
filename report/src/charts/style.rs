//! The common parts of all charts: sizes, fonts, colours, axes, and the conversion of a chart to
//! SVG.
//!
//! SVG carries its own text, so no font has to be installed. Equal values give equal bytes.

use std::io;
use std::ops::Range;

use maud::{Markup, PreEscaped};
use plotters::coord::Shift;
use plotters::coord::ranged1d::BoldPoints;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::campaign::overview::Fate;
use closecall_traffic::maths;
use closecall_traffic::statistics::format::without_trailing_zeros;

/// The surface that a chart is drawn on.
pub(crate) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// A chart with its axes, to which series are added.
pub(crate) type Plot<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
/// The result of drawing.
pub(crate) type Drawn<T = ()> = Result<T, DrawingAreaErrorKind<io::Error>>;

/// Size of a chart that stands beside others (px).
pub(super) const SMALL_PX: (u32, u32) = (420, 220);
/// Size of a map (px): its text is legible on a page of 390 px.
pub(super) const MAP_PX: (u32, u32) = (400, 360);
/// Largest width of a map on a page (px).
pub(super) const WIDEST_MAP_PX: u32 = 620;
/// Size of a chart in a file of its own (px).
pub(crate) const FILE_PX: (u32, u32) = (860, 520);

/// Margin around a chart (px).
const MARGIN_PX: u32 = 8;
/// Margin on the right, for half of the last label of the horizontal axis (px).
const RIGHT_MARGIN_PX: u32 = 20;
/// Font of all text, as in the figures of encounters.
const FONT: &str = "DejaVu Sans, sans-serif";
/// Font sizes, as plotters counts them: letters come out smaller by a factor of 1.24 (px).
const LABEL_PX: i32 = 13;
const NAME_PX: i32 = 15;
const TITLE_PX: i32 = 20;
/// Width of one letter of a label (px).
const LETTER_PX: f64 = 6.2;
/// Height of the area below the chart, for labels and the name of the axis (px).
const BELOW_PX: u32 = 42;
/// Width of the area to the left of the chart, without the labels (px).
const BESIDE_PX: u32 = 14;

/// Colour of axes and of their text.
const AXIS: RGBColor = RGBColor(0x55, 0x5f, 0x6b);
/// Colour of grid lines.
pub(super) const GRID: RGBColor = RGBColor(0xe3, 0xe7, 0xec);
/// Shade of cells in which samples collide.
pub(super) const COLLISIONS: RGBColor = RGBColor(0xd3, 0x54, 0x00);
/// Colour of samples without a collision, and of bars that say little. Its contrast is 3 : 1 or
/// more on a white sheet, and, with the lightness inverted, on the sheet of a dark page (WCAG 2.2,
/// 1.4.11).
pub(super) const GREY: RGBColor = RGBColor(0x7d, 0x88, 0x95);
const BLUE: RGBColor = RGBColor(0x1f, 0x77, 0xb4);
const ORANGE: RGBColor = RGBColor(0xde, 0x77, 0x17);
const RED: RGBColor = RGBColor(0xb0, 0x00, 0x20);
const NEARLY_BLACK: RGBColor = RGBColor(0x11, 0x11, 0x11);

/// Returns the colour of a fate. The colours also differ in lightness, and no two colours differ by
/// red against green alone.
pub(crate) const fn fate_colour(fate: Fate) -> RGBColor {
    match fate {
        Fate::Passed => GREY,
        Fate::Prevented => BLUE,
        Fate::Failed => ORANGE,
        Fate::Induced => RED,
        Fate::Error => NEARLY_BLACK,
    }
}

/// Returns the colour of an arm: one for the arm under test, one for the baseline.
pub(crate) const fn arm_colour(is_tested: bool) -> RGBColor {
    if is_tested { BLUE } else { ORANGE }
}

/// Returns the colour of a series, from a set that colour-blind readers can tell apart: M. Okabe
/// and K. Ito, Color Universal Design (2008).
pub(crate) const fn series_colour(index: usize) -> RGBColor {
    match index % 7 {
        0 => RGBColor(0, 114, 178),
        1 => RGBColor(213, 94, 0),
        2 => RGBColor(0, 158, 115),
        3 => RGBColor(204, 121, 167),
        4 => RGBColor(230, 159, 0),
        5 => RGBColor(86, 180, 233),
        _ => BLACK,
    }
}

/// Returns a colour as a style sheet writes it.
pub(crate) fn css(RGBColor(red, green, blue): RGBColor) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Returns the style of the text in a legend.
pub(crate) fn legend_text<'a>() -> TextStyle<'a> {
    (FONT, LABEL_PX).into_font().color(&BLACK)
}

/// Returns the style of a label inside a chart, or of a heading.
pub(super) fn label_text<'a>(is_head: bool) -> TextStyle<'a> {
    let colour = if is_head { AXIS } else { NEARLY_BLACK };
    (FONT, LABEL_PX).into_font().color(&colour)
}

/// One axis of a chart.
pub(crate) struct ChartAxis<'a> {
    /// The quantity on the axis, with its unit; empty if nothing is written beside the axis.
    pub(crate) name: &'a str,
    /// The values at its ends.
    pub(crate) range: Range<f64>,
    /// The largest number of labels.
    pub(crate) labels: usize,
    /// The text at a value; empty if the value has no label.
    pub(crate) text: Box<dyn Fn(&f64) -> String + 'a>,
    /// True if a line crosses the chart at each label.
    pub(crate) has_grid: bool,
}

impl ChartAxis<'_> {
    /// Returns the number of letters in the longest label.
    fn longest_label(&self) -> usize {
        let values = RangedCoordf64::from(self.range.clone()).key_points(BoldPoints(self.labels));
        values.iter().map(|value| (self.text)(value).chars().count()).max().unwrap_or(0)
    }
}

/// Returns a text for values between `low` and `high`, with as many digits as a hundredth of the
/// range needs.
pub(crate) fn number_text(low: f64, high: f64) -> impl Fn(&f64) -> String {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few digits")]
    let digits = (2.0 - maths::log10(high - low).floor()).clamp(0.0, 6.0) as usize;
    move |value| without_trailing_zeros(&format!("{value:.digits$}"))
}

/// Draws the axes with their labels and names, and the title if there is one.
pub(crate) fn axes<'a, 'b>(
    canvas: &'a Canvas<'b>,
    title: Option<&str>,
    x: &ChartAxis<'_>,
    y: &ChartAxis<'_>,
) -> Drawn<Plot<'a, 'b>> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred pixels")]
    let labels_px = (LETTER_PX * y.longest_label() as f64).ceil() as u32;
    let name_px = if y.name.is_empty() { 0 } else { NAME_PX.unsigned_abs() + 2 };
    let mut builder = ChartBuilder::on(canvas);
    if let Some(title) = title {
        builder.caption(title, (FONT, TITLE_PX));
    }
    let mut plot = builder
        .margin(MARGIN_PX)
        .margin_right(RIGHT_MARGIN_PX)
        .x_label_area_size(BELOW_PX)
        .y_label_area_size(BESIDE_PX + name_px + labels_px)
        .build_cartesian_2d(x.range.clone(), y.range.clone())?;
    let mut mesh = plot.configure_mesh();
    if !x.has_grid {
        mesh.disable_x_mesh();
    }
    if !y.has_grid {
        mesh.disable_y_mesh();
    }
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(AXIS)
        .label_style((FONT, LABEL_PX).into_font().color(&AXIS))
        .axis_desc_style((FONT, NAME_PX).into_font().color(&AXIS))
        .x_labels(x.labels)
        .y_labels(y.labels)
        .x_label_formatter(&x.text)
        .y_label_formatter(&y.text)
        .x_desc(x.name)
        .y_desc(y.name)
        .draw()?;
    Ok(plot)
}

/// Returns the SVG of a chart of this size (px).
fn svg(size_px: (u32, u32), paint: impl FnOnce(&Canvas<'_>) -> Drawn) -> Drawn<String> {
    let mut text = String::new();
    let canvas = SVGBackend::with_string(&mut text, size_px).into_drawing_area();
    let drawn = paint(&canvas).and_then(|()| canvas.present());
    drop(canvas);
    drawn.map(|()| text)
}

/// Returns the SVG of a chart of this size (px) that can stand in a file of its own. It has a white
/// background: viewers show what is not drawn in any colour, some in black. The style sheet of the
/// pages leaves the background out where a page is dark.
pub(crate) fn file_svg(size_px: (u32, u32), paint: impl FnOnce(&Canvas<'_>) -> Drawn) -> Drawn<String> {
    svg(size_px, |canvas| canvas.fill(&WHITE).and_then(|()| paint(canvas)))
}

/// Returns a chart that stands inside a page: it shrinks with the page, and is at most this large
/// (px).
pub(super) fn inline(size_px: (u32, u32), paint: impl FnOnce(&Canvas<'_>) -> Drawn) -> io::Result<Markup> {
    sized(size_px, &format!("style=\"max-width:{}px\"", size_px.0), paint)
}

/// Returns a chart that grows and shrinks with the page, and is at most this wide (px).
pub(super) fn scaled(
    size_px: (u32, u32),
    widest_px: u32,
    paint: impl FnOnce(&Canvas<'_>) -> Drawn,
) -> io::Result<Markup> {
    sized(size_px, &format!("style=\"max-width:{widest_px}px\""), paint)
}

/// Attributes that plotters writes although they are the defaults of SVG.
const DEFAULTS: [&str; 3] = [" opacity=\"1\"", " stroke-width=\"1\"", " stroke=\"none\""];

/// Returns a chart with other attributes in the place of its width and height.
pub(super) fn sized(
    size_px: (u32, u32),
    attributes: &str,
    paint: impl FnOnce(&Canvas<'_>) -> Drawn,
) -> io::Result<Markup> {
    let text = svg(size_px, paint).map_err(|error| io::Error::other(error.to_string()))?;
    let written_size = format!("width=\"{}\" height=\"{}\"", size_px.0, size_px.1);
    let inherited = [format!(" font-family=\"{FONT}\""), format!(" fill=\"{}\"", css(AXIS).to_uppercase())];
    let with_inherited = format!("{attributes}{}", inherited.concat());
    // A report has thousands of charts: the chart as a whole has the font and the colour of its
    // text, and no shape repeats a default.
    let repeated = inherited.iter().map(String::as_str).chain(DEFAULTS);
    let lean = repeated.fold(text, |text, repeated| text.replace(repeated, ""));
    let lean = lean.replace(">\n", ">").replace("\n<", "<");
    Ok(PreEscaped(lean.replacen(&written_size, &with_inherited, 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_the_digits_that_the_axis_needs() {
        assert_eq!(number_text(0.0, 3.0)(&0.5), "0.5");
        assert_eq!(number_text(0.0, 2_000.0)(&1_250.0), "1250");
        assert_eq!(number_text(-0.01, 0.01)(&-0.0), "0");
    }

    /// The relative luminance of a colour (WCAG 2.2).
    fn luminance(colour: [f64; 3]) -> f64 {
        let linear = colour.map(|channel| match channel / 255.0 {
            dark if dark <= 0.04045 => dark / 12.92,
            light => maths::exp(2.4 * maths::ln((light + 0.055) / 1.055)),
        });
        linear.iter().zip([0.2126, 0.7152, 0.0722]).map(|(channel, weight)| channel * weight).sum()
    }

    fn contrast(one: [f64; 3], other: [f64; 3]) -> f64 {
        let [one, other] = [one, other].map(|colour| luminance(colour) + 0.05);
        one.max(other) / one.min(other)
    }

    /// The colour behind the style sheet's `invert(1) hue-rotate(180deg)` (Filter Effects Module
    /// 1).
    fn inverted(colour: [f64; 3]) -> [f64; 3] {
        let from = colour.map(|channel| 255.0 - channel);
        [[-0.574, 1.430, 0.144], [0.426, 0.430, 0.144], [0.426, 1.430, -0.856]].map(|weights: [f64; 3]| {
            let sum: f64 = weights.iter().zip(from).map(|(weight, channel)| weight * channel).sum();
            sum.clamp(0.0, 255.0)
        })
    }

    #[test]
    fn the_colour_of_each_fate_stands_out_from_a_white_and_from_a_dark_sheet() {
        let (white, dark) = ([255.0; 3], [f64::from(0x1c_u8), f64::from(0x22_u8), f64::from(0x28_u8)]);
        for fate in Fate::ALL {
            let RGBColor(red, green, blue) = fate_colour(fate);
            let colour = [red, green, blue].map(f64::from);
            let contrasts = [contrast(colour, white), contrast(inverted(colour), dark)];
            assert!(contrasts.iter().all(|contrast| *contrast >= 3.0), "{}: {contrasts:?}", fate.word(true));
        }
        // The sheets of the style sheet.
        let style = include_str!("../campaign/html/style.css");
        assert!(style.contains("--sheet: #fff;") && style.contains("--sheet: #1c2228;"));
        assert!(style.contains("filter: invert(1) hue-rotate(180deg)"));
    }

    #[test]
    fn a_chart_in_a_file_has_a_background_below_all_else_which_a_dark_page_leaves_out() {
        let paint = |canvas: &Canvas<'_>| canvas.draw(&Circle::new((5, 5), 2, BLACK));
        let background = "<rect x=\"0\" y=\"0\" width=\"420\" height=\"220\" opacity=\"1\" fill=\"#FFFFFF\"";
        let chart = file_svg(SMALL_PX, paint).unwrap();
        let at = |text: &str| chart.find(text).unwrap_or_else(|| panic!("{text}: {chart}"));
        assert!(at(background) < at("<circle") && chart.find("<rect") == Some(at(background)), "{chart}");
        // A chart that is part of a page alone lies on the sheet of the page.
        assert!(!inline(SMALL_PX, paint).unwrap().into_string().contains("<rect"));
        let style = include_str!("../campaign/html/style.css");
        let (_, dark) = style.split_once("@media screen and (prefers-color-scheme: dark) { figure svg").unwrap();
        let rule = "figure svg > rect[fill=\"#ffffff\" i]:first-of-type { fill: none; }";
        assert!(dark.split("@media").next().unwrap().contains(rule), "{dark}");
    }

    #[test]
    fn a_chart_on_a_page_states_its_font_once_and_no_default_of_svg() {
        let paint = |canvas: &Canvas<'_>| {
            canvas.draw(&Text::new("left", (5, 5), label_text(true)))?;
            canvas.draw(&Text::new("a < b", (5, 20), label_text(true)))?;
            canvas.draw(&Circle::new((5, 5), 2, BLACK.mix(0.5)))
        };
        let chart = inline(SMALL_PX, paint).unwrap().into_string();
        assert_eq!([chart.matches("DejaVu").count(), chart.matches("#555F6B").count()], [1, 1], "{chart}");
        assert!(
            DEFAULTS.iter().all(|default| !chart.contains(default)) && chart.contains("opacity=\"0.5\""),
            "{chart}"
        );
        assert!(chart.contains(">left</text>") && chart.contains(">a &lt; b</text>"), "{chart}");
    }

    #[test]
    fn a_chart_on_a_page_shrinks_with_the_page() {
        let chart = inline(SMALL_PX, |canvas| canvas.draw(&Circle::new((5, 5), 2, BLACK))).unwrap().into_string();
        let head = "<svg style=\"max-width:420px\" font-family=\"DejaVu Sans, sans-serif\" fill=\"#555F6B\" viewBox=\"0 0 420 220\"";
        assert!(chart.starts_with(head), "{chart}");
        let paint = |canvas: &Canvas<'_>| canvas.draw(&Circle::new((5, 5), 2, BLACK));
        let map = scaled(MAP_PX, WIDEST_MAP_PX, paint).unwrap().into_string();
        assert!(
            map.starts_with("<svg style=\"max-width:620px\" font-family=") && map.contains("viewBox=\"0 0 400 360\"")
        );
        // The frame of a page of 390 px is 360 px wide, and letters are smaller than their font
        // size (see `LABEL_PX`).
        assert!(f64::from(LABEL_PX) / 1.24 * 360.0 / f64::from(MAP_PX.0) > 9.0);
    }
}
