//! Scatter plots: points with a 95 % interval along each axis. Marked points stand out, and have
//! labels that cover neither a point nor another label.

use std::io;
use std::ops::Range;

use plotters::prelude::*;

use super::style::{ChartAxis, FILE_PX, axes, file_svg, label_text, number_text};

/// One point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ScatterPoint {
    /// The value along each axis.
    pub(crate) at: [f64; 2],
    /// The 95 % interval along each axis.
    pub(crate) intervals_95: [[f64; 2]; 2],
    /// The text beside the point, if the point is marked.
    pub(crate) label: String,
    /// True if the point stands out.
    pub(crate) is_marked: bool,
}

const MARKED: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
const OTHER: RGBColor = RGBColor(0x8d, 0x99, 0xa6);
/// Opacity of the intervals of points that are not marked.
const FAINT: f64 = 0.35;
/// Radius of the points (px).
const POINT_PX: i32 = 4;
/// Distances of a label from its point, sideways and up or down (px).
const ASIDE_PX: i32 = 7;
const ABOVE_PX: i32 = 14;
const BELOW_PX: i32 = 3;
/// Width of a letter and height of a line of a label (px).
const LETTER_PX: i32 = 7;
const LINE_PX: i32 = 14;
/// Lines above and below a point in which its label may stand.
const LINES: i32 = 3;
/// Free space at the ends of an axis, as a share of its range.
const MARGIN: f64 = 0.06;

/// Returns the SVG of the points. `names` are the names of the axes.
pub(crate) fn scatter(points: &[ScatterPoint], title: &str, names: [&str; 2]) -> io::Result<String> {
    let [across, up] = [0, 1].map(|axis| range(points, axis));
    let axis = |name, range: &Range<f64>| ChartAxis {
        name,
        range: range.clone(),
        labels: 10,
        text: Box::new(number_text(range.start, range.end)),
        has_grid: true,
    };
    let drawn = file_svg(FILE_PX, |canvas| {
        let mut plot = axes(canvas, Some(title), &axis(names[0], &across), &axis(names[1], &up))?;
        // Marked points are drawn last, over the others.
        let (marked, others): (Vec<&ScatterPoint>, Vec<&ScatterPoint>) =
            points.iter().partition(|point| point.is_marked);
        for point in others.into_iter().chain(marked.iter().copied()) {
            let [x, y] = point.at;
            let [[left, right], [low, high]] = point.intervals_95;
            let line = if point.is_marked { MARKED.to_rgba() } else { OTHER.mix(FAINT) };
            plot.draw_series([
                PathElement::new([(left, y), (right, y)], line),
                PathElement::new([(x, low), (x, high)], line),
            ])?;
            let colour = if point.is_marked { MARKED } else { OTHER };
            plot.draw_series([Circle::new((x, y), POINT_PX, colour.filled())])?;
        }
        let pixel = |point: &&ScatterPoint| plot.backend_coord(&(point.at[0], point.at[1]));
        let centres: Vec<(i32, i32)> = marked.iter().map(pixel).collect();
        let lengths: Vec<usize> = marked.iter().map(|point| point.label.chars().count()).collect();
        for (point, offset) in marked.iter().zip(label_offsets(&centres, &lengths)) {
            // A label without room is left out. The table beside the chart lists every point.
            if let Some(offset) = offset {
                let text = Text::new(point.label.clone(), offset, label_text(false));
                plot.draw_series([EmptyElement::at((point.at[0], point.at[1])) + text])?;
            }
        }
        Ok(())
    });
    drawn.map_err(|error| io::Error::other(error.to_string()))
}

/// Returns the offset of each point's label from the centre of the point (px). `lengths` are the
/// numbers of letters of the labels. No label covers another label, a point, or the edge of the
/// chart; `None` if a label has no room.
fn label_offsets(centres: &[(i32, i32)], lengths: &[usize]) -> Vec<Option<(i32, i32)>> {
    let overlap = |[left, top, right, bottom]: [i32; 4], other: [i32; 4]| {
        left < other[2] && other[0] < right && top < other[3] && other[1] < bottom
    };
    let point = |&(x, y): &(i32, i32)| [x - POINT_PX, y - POINT_PX, x + POINT_PX, y + POINT_PX];
    let mut occupied: Vec<[i32; 4]> = centres.iter().map(point).collect();
    let mut placed = Vec::with_capacity(centres.len());
    for (&(x, y), &letters) in centres.iter().zip(lengths) {
        let width = LETTER_PX * i32::try_from(letters).unwrap_or(i32::MAX / LETTER_PX);
        let area = |(across, up): (i32, i32)| [x + across, y + up, x + across + width, y + up + LINE_PX];
        let tops = (0..LINES).flat_map(|line| [-ABOVE_PX - line * LINE_PX, BELOW_PX + line * LINE_PX]);
        let mut offsets = tops.flat_map(|top| [(ASIDE_PX, top), (-ASIDE_PX - width, top)]);
        let is_free = |offset: &(i32, i32)| {
            let [left, top, right, bottom] = area(*offset);
            let is_inside =
                left >= 0 && top >= 0 && right <= FILE_PX.0.cast_signed() && bottom <= FILE_PX.1.cast_signed();
            is_inside && !occupied.iter().any(|other| overlap([left, top, right, bottom], *other))
        };
        let offset = offsets.find(is_free);
        occupied.extend(offset.map(area));
        placed.push(offset);
    }
    placed
}

/// Returns the range of an axis that holds all intervals.
fn range(points: &[ScatterPoint], axis: usize) -> Range<f64> {
    let ends = || points.iter().flat_map(|point| point.intervals_95[axis]).filter(|end| end.is_finite());
    let (low, high) = (ends().fold(f64::INFINITY, f64::min), ends().fold(f64::NEG_INFINITY, f64::max));
    if !(low < high) {
        return 0.0..1.0;
    }
    let margin = MARGIN * (high - low);
    low - margin..high + margin
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The area of a label (px).
    fn area((x, y): (i32, i32), (across, up): (i32, i32), letters: i32) -> [i32; 4] {
        [x + across, y + up, x + across + LETTER_PX * letters, y + up + LINE_PX]
    }

    #[test]
    fn labels_of_points_close_to_each_other_cover_no_label_and_no_point() {
        // Four combinations of a frontier, two of them almost at one place, and one at the right
        // edge.
        let centres = [(400, 200), (403, 204), (420, 210), (840, 300)];
        let offsets = label_offsets(&centres, &[23; 4]);
        let areas: Vec<[i32; 4]> =
            centres.iter().zip(&offsets).map(|(centre, offset)| area(*centre, offset.unwrap(), 23)).collect();
        for (index, one) in areas.iter().enumerate() {
            assert!(one[0] >= 0 && one[2] <= 860, "{one:?}");
            for other in &areas[index + 1..] {
                let is_apart = one[2] <= other[0] || other[2] <= one[0] || one[3] <= other[1] || other[3] <= one[1];
                assert!(is_apart, "{one:?} and {other:?}");
            }
            assert!(centres.iter().all(|(x, y)| *x < one[0] || *x > one[2] || *y < one[1] || *y > one[3]), "{one:?}");
        }
    }

    #[test]
    fn labels_without_room_are_left_out() {
        let offsets = label_offsets(&[(400, 200); 40], &[23; 40]);
        let shown = offsets.iter().flatten().count();
        assert!((2..40).contains(&shown), "{shown}");
        assert_eq!(offsets[0], Some((ASIDE_PX, -ABOVE_PX)));
    }
}
