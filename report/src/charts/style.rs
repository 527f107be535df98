//! What the charts share: colours, sizes, and how one is drawn into a text.

use std::io;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::campaign::overview::Fate;

/// A chart in the making.
pub(super) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Size of letters [px].
pub(super) const LABEL_PX: i32 = 13;
pub(super) const DESCRIPTION_PX: i32 = 15;
/// Grey of axes and grids.
pub(super) const AXIS: RGBColor = RGBColor(0x55, 0x5f, 0x6b);
pub(super) const GRID: RGBColor = RGBColor(0xe3, 0xe7, 0xec);

/// The colour of each fate. They differ in lightness too, and none is told from another by red against green alone.
pub(super) const fn colour(fate: Fate) -> RGBColor {
    match fate {
        Fate::Passed => RGBColor(0xb5, 0xbf, 0xca),
        Fate::Prevented => RGBColor(0x1f, 0x77, 0xb4),
        Fate::Failed => RGBColor(0xe6, 0x7e, 0x22),
        Fate::Induced => RGBColor(0xb0, 0x00, 0x20),
        Fate::Error => RGBColor(0x11, 0x11, 0x11),
    }
}

/// The colour of an arm: the one under test stands out.
pub(super) const fn arm_colour(is_tested: bool) -> RGBColor {
    if is_tested { RGBColor(0x1f, 0x77, 0xb4) } else { RGBColor(0xe6, 0x7e, 0x22) }
}

/// Draws a chart of this size [px].
pub(super) fn draw(
    size: (u32, u32),
    paint: impl FnOnce(&Canvas<'_>) -> Result<(), Box<dyn std::error::Error>>,
) -> io::Result<String> {
    let mut svg = String::new();
    let canvas = SVGBackend::with_string(&mut svg, size).into_drawing_area();
    let painted = paint(&canvas).and_then(|()| Ok(canvas.present()?));
    drop(canvas);
    painted.map_err(|error| io::Error::other(error.to_string()))?;
    // The size follows the page; the picture's own is the largest.
    let fixed = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    Ok(svg.replacen(&fixed, &format!("style=\"max-width:{}px\"", size.0), 1))
}
