//! The boundary of an event over two parameters: its line, its 95 % band, and the runs.

use std::io;

use plotters::prelude::*;

use super::style::{COLLISIONS, ChartAxis, Drawn, FILE_PX, Plot, axes, fate_colour, file_svg, number_text};
use crate::campaign::overview::Fate;
use crate::units::labelled;

/// A boundary to draw. The first index of `means` and `decided` belongs to the first parameter, and
/// both ends of its range have a value.
#[derive(Clone, Debug)]
pub(crate) struct BoundaryMap<'a> {
    /// The title.
    pub(crate) title: &'a str,
    /// The names of the parameters.
    pub(crate) names: [&'a str; 2],
    /// The ranges of the parameters.
    pub(crate) ranges: [[f64; 2]; 2],
    /// The predicted margins: negative where the event happens. Empty without a surface.
    pub(crate) means: &'a [Vec<f64>],
    /// Whether their signs are decided.
    pub(crate) decided: &'a [Vec<bool>],
    /// The runs.
    pub(crate) points: Vec<BoundaryPoint>,
}

/// A run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoundaryPoint {
    /// The values of the parameters.
    pub(crate) at: [f64; 2],
    /// Whether the event happens; `None` without a value.
    pub(crate) happens: Option<bool>,
}

/// Opacity of the places in which the event happens, and colour and opacity of the band.
const FAILS_OPACITY: f64 = 0.25;
const BAND: RGBColor = RGBColor(0x55, 0x5f, 0x6b);
const BAND_OPACITY: f64 = 0.3;
const LINE: RGBColor = RGBColor(0x11, 0x11, 0x11);
const LINE_PX: u32 = 2;
const POINT_PX: i32 = 3;

/// Returns the SVG of a boundary: runs with the event orange, without it grey, without a value
/// black; the places where the event happens in light orange, and the band in which this is not
/// decided in grey.
pub(crate) fn boundary_map(map: &BoundaryMap<'_>) -> io::Result<String> {
    let names = map.names.map(labelled);
    let axis = |index: usize| ChartAxis {
        name: &names[index],
        range: map.ranges[index][0]..map.ranges[index][1],
        labels: 10,
        text: Box::new(number_text(map.ranges[index][0], map.ranges[index][1])),
        has_grid: true,
    };
    let drawn = file_svg(FILE_PX, |canvas| {
        let mut plot = axes(canvas, Some(map.title), &axis(0), &axis(1))?;
        draw_places(&mut plot, map)?;
        for [from, to] in segments(map.means) {
            let ends = [from, to].map(|place| value(map, place));
            plot.draw_series([PathElement::new(ends.to_vec(), LINE.stroke_width(LINE_PX))])?;
        }
        for point in &map.points {
            let fate = match point.happens {
                Some(true) => Fate::Failed,
                Some(false) => Fate::Passed,
                None => Fate::Error,
            };
            let [x, y] = point.at;
            plot.draw_series([Circle::new((x, y), POINT_PX, fate_colour(fate).filled())])?;
        }
        Ok(())
    });
    drawn.map_err(|error| io::Error::other(error.to_string()))
}

/// Returns the values of the parameters at a place of the grid, which is counted in its cells.
fn value(map: &BoundaryMap<'_>, [x, y]: [f64; 2]) -> (f64, f64) {
    let (columns, rows) = (map.means.len(), map.means.first().map_or(0, Vec::len));
    let at = |axis: usize, place: f64, count: usize| {
        let [low, high] = map.ranges[axis];
        (low + place / (count.max(2) - 1) as f64 * (high - low)).clamp(low, high)
    };
    (at(0, x, columns), at(1, y, rows))
}

/// Shades the cell around each place of the grid.
fn draw_places(plot: &mut Plot<'_, '_>, map: &BoundaryMap<'_>) -> Drawn {
    for (x, (means, decided)) in map.means.iter().zip(map.decided).enumerate() {
        for (y, (mean, is_decided)) in means.iter().zip(decided).enumerate() {
            let shade = match (*is_decided, *mean < 0.0) {
                (false, _) => BAND.mix(BAND_OPACITY),
                (true, true) => COLLISIONS.mix(FAILS_OPACITY),
                (true, false) => continue,
            };
            let (x, y) = (x as f64, y as f64);
            let corners = [value(map, [x - 0.5, y - 0.5]), value(map, [x + 0.5, y + 0.5])];
            plot.draw_series([Rectangle::new(corners, shade.filled())])?;
        }
    }
    Ok(())
}

/// Returns the line on which values over a grid are 0, as segments in cells of the grid (marching
/// squares).
fn segments(means: &[Vec<f64>]) -> Vec<[[f64; 2]; 2]> {
    let mut segments = Vec::new();
    for (x, columns) in means.windows(2).enumerate() {
        let [left, right] = columns else { continue };
        for y in 0..left.len().min(right.len()).saturating_sub(1) {
            let (x_at, y_at) = (x as f64, y as f64);
            // The corners in their order around the cell.
            let corners = [
                ([x_at, y_at], left[y]),
                ([x_at + 1.0, y_at], right[y]),
                ([x_at + 1.0, y_at + 1.0], right[y + 1]),
                ([x_at, y_at + 1.0], left[y + 1]),
            ];
            let crossings: Vec<[f64; 2]> =
                (0..4).filter_map(|corner| crossing(corners[corner], corners[(corner + 1) % 4])).collect();
            // A saddle has four crossings, and any pairing of neighbours separates its corners.
            segments.extend(crossings.chunks_exact(2).map(|pair| [pair[0], pair[1]]));
        }
    }
    segments
}

/// Returns where the values of two corners cross 0.
fn crossing((from, before): ([f64; 2], f64), (to, after): ([f64; 2], f64)) -> Option<[f64; 2]> {
    let share = before / (before - after);
    ((before < 0.0) != (after < 0.0)).then(|| [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_follows_the_zeros_of_a_plane() {
        let means: Vec<Vec<f64>> = (0..5).map(|x| (0..5).map(|y| f64::from(x + y) - 3.5).collect()).collect();
        let segments = segments(&means);
        assert!(segments.len() >= 4);
        for place in segments.iter().flatten() {
            assert!((place[0] + place[1] - 3.5).abs() < 1e-12, "{place:?}");
        }
        assert!(super::segments(&[vec![1.0; 3], vec![2.0; 3]]).is_empty());
        assert!(super::segments(&[]).is_empty());
    }

    #[test]
    fn runs_and_places_have_the_colours_of_their_outcome() {
        let means = [vec![-2.0, -1.0, 1.0], vec![-1.0, 1.0, 2.0], vec![-1.0, 1.0, 3.0]];
        let decided = [vec![true, false, true], vec![true, true, true], vec![true, true, true]];
        let point = |x: f64, happens| BoundaryPoint { at: [x, 0.5], happens };
        let map = BoundaryMap {
            title: "t",
            names: ["closing-mps", "reaction-s"],
            ranges: [[0.0, 2.0], [0.0, 1.0]],
            means: &means,
            decided: &decided,
            points: vec![point(0.5, Some(true)), point(1.0, Some(false)), point(1.5, None)],
        };
        let svg = boundary_map(&map).unwrap();
        for (colour, what) in
            [("#DE7717", "failed"), ("#7D8895", "passed"), ("#111111", "no value"), ("#D35400", "area")]
        {
            assert!(svg.contains(colour), "{what}: {svg}");
        }
        assert!(svg.contains("closing [m/s]") && svg.contains("reaction [s]"), "{svg}");
        let empty = BoundaryMap { means: &[], decided: &[], points: Vec::new(), ..map };
        assert!(!boundary_map(&empty).unwrap().contains("#D35400"));
    }
}
