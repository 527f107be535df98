//! A writer of SVG pictures, with the few shapes that the figures need.

use crate::escape::escaped;
use std::fmt::Write as _;

/// The font of all text. Rendering as PNG uses the bundled font of this name.
pub(super) const FONT: &str = "DejaVu Sans";

/// A rectangle of the picture (px).
#[derive(Clone, Copy, Debug)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Area {
    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }
}

/// The style of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stroke<'a> {
    pub(super) colour: &'a str,
    pub(super) width: f64,
    /// Lengths of dashes and gaps (px); `None` for a solid line.
    pub(super) dash: Option<&'a str>,
}

impl<'a> Stroke<'a> {
    pub(super) fn solid(colour: &'a str, width: f64) -> Self {
        Self { colour, width, dash: None }
    }
}

/// The part of a text that its point marks.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// The style of a text.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextStyle<'a> {
    pub(super) size: f64,
    pub(super) colour: &'a str,
    pub(super) anchor: Anchor,
}

/// A picture that is being drawn.
#[derive(Debug)]
pub(super) struct Svg {
    size: [f64; 2],
    body: String,
    /// Number of clip paths so far, which makes their names unique.
    clip_count: usize,
}

/// Colour of the halos of texts.
const HALO: &str = "#ffffff";
/// The halo of a text, drawn below it.
const HALO_ATTRIBUTES: &str =
    " paint-order=\"stroke\" stroke=\"#ffffff\" stroke-width=\"2.5\" stroke-linejoin=\"round\"";

// Writing to a string cannot fail, so that the results of `write!` are ignored.
impl Svg {
    pub(super) fn new(size: [f64; 2]) -> Self {
        Self { size, body: String::new(), clip_count: 0 }
    }

    /// Returns the text of the SVG file.
    pub(super) fn finish(self) -> String {
        let [width, height] = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"'{FONT}', sans-serif\">\n\
             <rect width=\"{width:.0}\" height=\"{height:.0}\" fill=\"#ffffff\"/>\n{}</svg>\n",
            self.body
        )
    }

    /// Draws a filled rectangle.
    pub(super) fn rect(&mut self, area: Area, fill: &str) {
        let Area { left, top, width, height } = area;
        let _ = writeln!(
            self.body,
            "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{width:.2}\" height=\"{height:.2}\" fill=\"{fill}\"/>"
        );
    }

    /// Draws the outline of a rectangle.
    pub(super) fn frame(&mut self, area: Area, stroke: Stroke<'_>) {
        let (right, bottom) = (area.right(), area.bottom());
        let (left, top) = (area.left, area.top);
        self.polyline(&[[left, top], [right, top], [right, bottom], [left, bottom], [left, top]], stroke);
    }

    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: Stroke<'_>) {
        self.polyline(&[from, to], stroke);
    }

    pub(super) fn polyline(&mut self, points: &[[f64; 2]], stroke: Stroke<'_>) {
        let mut text = String::new();
        for [x, y] in points {
            let _ = write!(text, "{x:.2},{y:.2} ");
        }
        let dash = stroke.dash.map_or(String::new(), |dash| format!(" stroke-dasharray=\"{dash}\""));
        let _ = writeln!(
            self.body,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.2}\"{dash}/>",
            text.trim_end(),
            stroke.colour,
            stroke.width
        );
    }

    /// Draws a filled polygon with an outline.
    pub(super) fn polygon(&mut self, points: &[[f64; 2]], fill: &str, stroke: Stroke<'_>) {
        let mut text = String::new();
        for [x, y] in points {
            let _ = write!(text, "{x:.2},{y:.2} ");
        }
        let _ = writeln!(
            self.body,
            "<polygon points=\"{}\" fill=\"{fill}\" stroke=\"{}\" stroke-width=\"{:.2}\"/>",
            text.trim_end(),
            stroke.colour,
            stroke.width
        );
    }

    pub(super) fn circle(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str) {
        let _ = writeln!(self.body, "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\" fill=\"{fill}\"/>");
    }

    /// The text has a white halo, so that it is legible on lines.
    pub(super) fn text(&mut self, [x, y]: [f64; 2], text: &str, style: TextStyle<'_>) {
        let anchor = match style.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        // White text stands on dark bars, which need no halo.
        let halo = if style.colour == HALO { "" } else { HALO_ATTRIBUTES };
        let _ = writeln!(
            self.body,
            "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{:.1}\" fill=\"{}\" text-anchor=\"{anchor}\"{halo}>{}</text>",
            style.size,
            style.colour,
            escaped(text)
        );
    }

    /// Calls `draw` and clips all that it draws to `area`.
    pub(super) fn clipped(&mut self, area: Area, draw: impl FnOnce(&mut Self)) {
        self.clip_count += 1;
        let name = format!("clip{}", self.clip_count);
        let Area { left, top, width, height } = area;
        let _ = writeln!(
            self.body,
            "<clipPath id=\"{name}\"><rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{width:.2}\" \
             height=\"{height:.2}\"/></clipPath>\n<g clip-path=\"url(#{name})\">"
        );
        draw(self);
        self.body.push_str("</g>\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped() {
        let mut svg = Svg::new([10.0, 10.0]);
        let style = TextStyle { size: 8.0, colour: "#000", anchor: Anchor::Start };
        svg.text([0.0, 0.0], "a < b & \"c\"", style);
        assert!(svg.finish().contains(">a &lt; b &amp; &quot;c&quot;</text>"));
    }
}
