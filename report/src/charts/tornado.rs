//! Tornado charts: which factor moves an output most, the strongest at the top.

use std::io;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::style::{Canvas, Drawn, GRID, label_text, number_text, svg};

/// One bar.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TornadoBar {
    /// The name beside the bar.
    pub(crate) label: String,
    /// The length of the bar.
    pub(crate) value: f64,
    /// The 95 % interval of the length.
    pub(crate) interval_95: [f64; 2],
    /// The length of the darker part of the bar, if it has one.
    pub(crate) inner: Option<f64>,
    /// The text behind the bar.
    pub(crate) note: String,
    /// True for a bar that is no single assumption.
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
const TICKS: i32 = 5;
/// The values at which a scale may end.
const ENDS: [f64; 9] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0];

const BAR: RGBColor = RGBColor(0x9e, 0xc5, 0xe4);
const INNER: RGBColor = RGBColor(0x1f, 0x77, 0xb4);
const GREY_BAR: RGBColor = RGBColor(0xcf, 0xd6, 0xde);
const GREY_INNER: RGBColor = RGBColor(0x8d, 0x99, 0xa6);

/// Returns the SVG of a tornado chart. `heads` are the texts above the names, the bars and the notes; `name` is below the scale.
pub(crate) fn tornado(bars: &[TornadoBar], heads: [&str; 3], name: &str) -> io::Result<String> {
    let most = bars.iter().map(|bar| bar.interval_95[1].max(bar.value)).fold(0.0, f64::max);
    let end = ENDS.into_iter().find(|end| *end >= most).unwrap_or(most);
    let rows = i32::try_from(bars.len()).unwrap_or(i32::MAX);
    let bottom_px = TOP_PX + ROW_PX * rows;
    let size = (WIDTH_PX.unsigned_abs(), (bottom_px + BOTTOM_PX).unsigned_abs());
    let drawn = svg(size, |canvas| {
        draw_scale(canvas, end, bottom_px, name)?;
        let heads_px = [(NAMES_PX, HPos::Right), (SCALE_PX[0], HPos::Left), (NOTES_PX, HPos::Left)];
        for (text, (x_px, side)) in heads.iter().zip(heads_px) {
            draw_text(canvas, text, (x_px, TOP_PX / 2), side, true)?;
        }
        for (bar, row) in bars.iter().zip(0..) {
            draw_bar(canvas, bar, end, TOP_PX + ROW_PX * row + ROW_PX / 2)?;
        }
        Ok(())
    });
    drawn.map_err(|error| io::Error::other(error.to_string()))
}

/// Returns the horizontal position of a value; values beyond the scale are at its ends.
fn x_px(value: f64, end: f64) -> i32 {
    let [left, right] = SCALE_PX.map(f64::from);
    let share = (value / end).clamp(0.0, 1.0);
    #[expect(clippy::cast_possible_truncation, reason = "within the scale")]
    let x = (left + share * (right - left)).round() as i32;
    x
}

fn draw_scale(canvas: &Canvas<'_>, end: f64, bottom_px: i32, name: &str) -> Drawn {
    let text = number_text(0.0, end);
    for tick in 0..=TICKS {
        let value = end * f64::from(tick) / f64::from(TICKS);
        let x = x_px(value, end);
        canvas.draw(&PathElement::new([(x, TOP_PX), (x, bottom_px)], GRID))?;
        draw_text(canvas, &text(&value), (x, bottom_px + 12), HPos::Center, false)?;
    }
    draw_text(canvas, name, ((SCALE_PX[0] + SCALE_PX[1]) / 2, bottom_px + 34), HPos::Center, true)
}

fn draw_bar(canvas: &Canvas<'_>, bar: &TornadoBar, end: f64, y: i32) -> Drawn {
    let rectangle = |from: f64, to: f64, colour: RGBColor| {
        let corners = [(x_px(from, end), y - HALF_BAR_PX), (x_px(to, end), y + HALF_BAR_PX)];
        Rectangle::new(corners, colour.filled())
    };
    let [outer, inner] = if bar.is_grey { [GREY_BAR, GREY_INNER] } else { [BAR, INNER] };
    draw_text(canvas, &bar.label, (NAMES_PX, y), HPos::Right, false)?;
    canvas.draw(&rectangle(0.0, bar.value, if bar.inner.is_some() { outer } else { inner }))?;
    if let Some(value) = bar.inner {
        canvas.draw(&rectangle(0.0, value.min(bar.value), inner))?;
    }
    let [low, high] = bar.interval_95.map(|bound| x_px(bound, end));
    canvas.draw(&PathElement::new([(low, y), (high, y)], BLACK))?;
    for x in [low, high] {
        canvas.draw(&PathElement::new([(x, y - HALF_CROSS_PX), (x, y + HALF_CROSS_PX)], BLACK))?;
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
        let bar = |label: &str, value, interval_95| TornadoBar {
            label: label.to_owned(),
            value,
            interval_95,
            inner: Some(0.5 * value),
            note: format!("{label}!"),
            is_grey: false,
        };
        let bars = [bar("steering", 0.6, [0.5, 0.7]), bar("<b>", 0.01, [-0.1, f64::INFINITY])];
        let text = tornado(&bars, ["factor", "index", "note"], "total index").unwrap();
        assert!(text.contains("steering!") && text.contains("&lt;b&gt;") && text.contains("total index"), "{text}");
        assert_eq!(x_px(-0.1, 1.0), SCALE_PX[0]);
        assert_eq!(x_px(f64::INFINITY, 1.0), SCALE_PX[1]);
        assert_eq!(text, tornado(&bars, ["factor", "index", "note"], "total index").unwrap());
        assert!(tornado(&[], ["", "", ""], "").is_ok());
    }
}
