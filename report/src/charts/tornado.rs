//! Tornado charts: which factor moves an output most, the strongest at the top.

use std::io;
use std::ops::Range;

use plotters::coord::ranged1d::{BoldPoints, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::style::{Canvas, Drawn, GREY, GRID, file_svg, label_text, number_text};

/// One bar.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TornadoBar {
    /// The name beside the bar.
    pub(crate) label: String,
    /// Both ends of the bar, the smaller first.
    pub(crate) ends: [f64; 2],
    /// The 95 % interval of each end.
    pub(crate) intervals_95: [[f64; 2]; 2],
    /// The text behind the bar.
    pub(crate) note: String,
    /// True for a bar without an assumption, or one that may have no length.
    pub(crate) is_grey: bool,
}

/// Width of the chart (px).
const WIDTH_PX: i32 = 900;
/// Horizontal positions: the end of the names, the ends of the scale, the start of the notes (px).
const NAMES_PX: i32 = 262;
const SCALE_PX: [i32; 2] = [270, 640];
const NOTES_PX: i32 = 656;
/// Height of a bar with the space around it (px).
const ROW_PX: i32 = 26;
/// Half of the height of a bar, and of the cross lines at the ends of an interval (px).
const HALF_BAR_PX: i32 = 8;
const HALF_CROSS_PX: i32 = 5;
/// Space above the bars, and below them for the scale (px).
const TOP_PX: i32 = 34;
const BOTTOM_PX: i32 = 48;
/// Number of labels of the scale.
const TICKS: usize = 8;
/// Free space at the ends of the scale, as a share of its range.
const MARGIN: f64 = 0.04;

const BAR: RGBColor = RGBColor(0x1f, 0x77, 0xb4);

/// The texts of a chart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TornadoTexts<'a> {
    /// The heads above the names, the bars and the notes.
    pub(crate) heads: [&'a str; 3],
    /// The name below the scale.
    pub(crate) scale: &'a str,
}

/// Returns the SVG of a tornado chart. A line marks the value `centre`.
pub(crate) fn tornado(bars: &[TornadoBar], centre: f64, texts: TornadoTexts<'_>) -> io::Result<String> {
    let ends = || bars.iter().flat_map(|bar| bar.intervals_95).flatten().chain([centre]).filter(|end| end.is_finite());
    let (low, high) = (ends().fold(f64::INFINITY, f64::min), ends().fold(f64::NEG_INFINITY, f64::max));
    let margin = MARGIN * (high - low);
    let scale = if low < high { low - margin..high + margin } else { 0.0..1.0 };
    let rows = i32::try_from(bars.len()).unwrap_or(i32::MAX);
    let bottom_px = TOP_PX + ROW_PX * rows;
    let size = (WIDTH_PX.unsigned_abs(), (bottom_px + BOTTOM_PX).unsigned_abs());
    let drawn = file_svg(size, |canvas| {
        draw_scale(canvas, &scale, bottom_px, texts.scale)?;
        let heads_px = [(NAMES_PX, HPos::Right), (SCALE_PX[0], HPos::Left), (NOTES_PX, HPos::Left)];
        for (text, (x_px, side)) in texts.heads.iter().zip(heads_px) {
            draw_text(canvas, text, (x_px, TOP_PX / 2), side, true)?;
        }
        for (bar, row) in bars.iter().zip(0..) {
            draw_bar(canvas, bar, &scale, TOP_PX + ROW_PX * row + ROW_PX / 2)?;
        }
        let x = x_px(centre, &scale);
        canvas.draw(&PathElement::new([(x, TOP_PX), (x, bottom_px)], BLACK))
    });
    drawn.map_err(|error| io::Error::other(error.to_string()))
}

/// Returns the horizontal position of a value; values beyond the scale are at its ends.
fn x_px(value: f64, scale: &Range<f64>) -> i32 {
    let [left, right] = SCALE_PX.map(f64::from);
    let share = ((value - scale.start) / (scale.end - scale.start)).clamp(0.0, 1.0);
    #[expect(clippy::cast_possible_truncation, reason = "within the scale")]
    let x = (left + share * (right - left)).round() as i32;
    x
}

fn draw_scale(canvas: &Canvas<'_>, scale: &Range<f64>, bottom_px: i32, name: &str) -> Drawn {
    let text = number_text(scale.start, scale.end);
    let ticks = RangedCoordf64::from(scale.clone()).key_points(BoldPoints(TICKS));
    for value in ticks {
        let x = x_px(value, scale);
        canvas.draw(&PathElement::new([(x, TOP_PX), (x, bottom_px)], GRID))?;
        draw_text(canvas, &text(&value), (x, bottom_px + 12), HPos::Center, false)?;
    }
    draw_text(canvas, name, ((SCALE_PX[0] + SCALE_PX[1]) / 2, bottom_px + 34), HPos::Center, true)
}

fn draw_bar(canvas: &Canvas<'_>, bar: &TornadoBar, scale: &Range<f64>, y: i32) -> Drawn {
    let [from, to] = bar.ends.map(|end| x_px(end, scale));
    let colour = if bar.is_grey { GREY } else { BAR };
    draw_text(canvas, &bar.label, (NAMES_PX, y), HPos::Right, false)?;
    canvas.draw(&Rectangle::new([(from, y - HALF_BAR_PX), (to, y + HALF_BAR_PX)], colour.filled()))?;
    for interval in bar.intervals_95 {
        let [low, high] = interval.map(|bound| x_px(bound, scale));
        if low < high {
            canvas.draw(&PathElement::new([(low, y), (high, y)], BLACK))?;
            for x in [low, high] {
                canvas.draw(&PathElement::new([(x, y - HALF_CROSS_PX), (x, y + HALF_CROSS_PX)], BLACK))?;
            }
        }
    }
    draw_text(canvas, &bar.note, (NOTES_PX, y), HPos::Left, false)
}

fn draw_text(canvas: &Canvas<'_>, text: &str, at_px: (i32, i32), side: HPos, is_head: bool) -> Drawn {
    let style = label_text(is_head).pos(Pos::new(side, VPos::Center));
    canvas.draw(&Text::new(text.to_owned(), at_px, style))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_holds_its_names_and_notes_and_clips_what_is_beyond_the_scale() {
        let bar = |label: &str, ends: [f64; 2]| TornadoBar {
            label: label.to_owned(),
            ends,
            intervals_95: ends.map(|end| [end - 0.1, end + 0.1]),
            note: format!("{label}!"),
            is_grey: false,
        };
        let bars = [bar("steering", [0.1, 0.6]), bar("<b>", [0.2, f64::INFINITY])];
        let texts = TornadoTexts { heads: ["factor", "rate", "note"], scale: "rate [%]" };
        let text = tornado(&bars, 0.3, texts).unwrap();
        assert!(text.contains("steering!") && text.contains("&lt;b&gt;") && text.contains("rate [%]"), "{text}");
        assert_eq!(x_px(-0.1, &(0.0..1.0)), SCALE_PX[0]);
        assert_eq!(x_px(f64::INFINITY, &(0.0..1.0)), SCALE_PX[1]);
        assert_eq!(text, tornado(&bars, 0.3, texts).unwrap());
        assert!(tornado(&[], 0.0, texts).is_ok());
    }
}
