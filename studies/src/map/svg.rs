//! The picture of the map: one panel for each front time headway.
//!
//! ```text
//!           ▬▬▬▬▬ bands: how often the paper's system is in time ▬▬▬▬▬
//!  100 m │ margin in the loop │ …       one row for each detection distance
//!        │ margin in theory   │
//!             10 km/h           …       one column for each speed difference
//! ```

use super::{Map, MapPoint};

/// Least width of a cell (px).
const MIN_CELL_WIDTH_PX: f64 = 58.0;
/// Height of a cell (px).
const CELL_HEIGHT_PX: f64 = 40.0;
/// Width of a letter (px).
const LETTER_PX: f64 = 7.0;
/// Distance between the labels of two bands (px).
const BETWEEN_LABELS_PX: f64 = 8.0;
/// Margins around the cells (px).
const LEFT_PX: f64 = 70.0;
const TOP_PX: f64 = 62.0;
const BOTTOM_PX: f64 = 44.0;
const RIGHT_PX: f64 = 16.0;

/// How often the paper's system is in time, by the speed difference of the rear vehicle.
struct Region {
    share: &'static str,
    colour: &'static str,
    contains: fn(closing_kmh: f64) -> bool,
}

/// The regions of the paper. Between 25 and 30 km/h the paper states no share.
const REGIONS: [Region; 4] = [
    Region { share: "always", colour: "#2a9d4a", contains: |closing_kmh| closing_kmh < 20.0 },
    Region { share: "59 %", colour: "#e0b030", contains: |closing_kmh| (20.0..=25.0).contains(&closing_kmh) },
    Region {
        share: "not stated",
        colour: "#c8c8c8",
        contains: |closing_kmh| closing_kmh > 25.0 && closing_kmh <= 30.0,
    },
    Region { share: "never", colour: "#c94a3b", contains: |closing_kmh| closing_kmh > 30.0 },
];

/// Returns the panel of one front time headway as SVG.
pub fn panel(map: &Map, front_thw_s: f64) -> String {
    let grid = &map.grid;
    let (columns, rows) = (grid.closing_kmh.len() as f64, grid.detection_m.len() as f64);
    let title = format!("front time headway {front_thw_s} s: margin in the loop (theory below) [s]");
    let caption = "speed difference of the rear vehicle [km/h]; left: detection distance";
    let bands = bands(map);
    let cell_px = cell_width(&[title.as_str(), caption], &bands, columns);
    let (width, height) = (LEFT_PX + columns * cell_px + RIGHT_PX, TOP_PX + rows * CELL_HEIGHT_PX + BOTTOM_PX);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"DejaVu Sans, sans-serif\" font-size=\"12\" role=\"img\"><title>Margin at a front time headway of {front_thw_s} s</title>\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>"
    );
    text(&mut svg, [LEFT_PX, 18.0], "start", &title);
    for band in &bands {
        let (x, width) = (LEFT_PX + band.first as f64 * cell_px, band.columns as f64 * cell_px);
        let colour = band.colour;
        svg.push_str(&format!("<rect x=\"{x}\" y=\"28\" width=\"{width}\" height=\"8\" fill=\"{colour}\"/>"));
        text(&mut svg, [x + 0.5 * width, 52.0], "middle", &band.label);
    }
    for (row, &detection_m) in grid.detection_m.iter().rev().enumerate() {
        let y = TOP_PX + row as f64 * CELL_HEIGHT_PX;
        text(&mut svg, [LEFT_PX - 8.0, y + 0.5 * CELL_HEIGHT_PX + 4.0], "end", &format!("{detection_m} m"));
        for (column, &closing_kmh) in grid.closing_kmh.iter().enumerate() {
            let is_here = |point: &&MapPoint| {
                point.front_thw_s == front_thw_s && point.detection_m == detection_m && point.closing_kmh == closing_kmh
            };
            if let Some(point) = map.points.iter().find(is_here) {
                cell(&mut svg, map, point, [LEFT_PX + column as f64 * cell_px, y], cell_px);
            }
        }
    }
    for (column, closing_kmh) in grid.closing_kmh.iter().enumerate() {
        let x = LEFT_PX + (column as f64 + 0.5) * cell_px;
        text(&mut svg, [x, TOP_PX + rows * CELL_HEIGHT_PX + 16.0], "middle", &closing_kmh.to_string());
    }
    text(&mut svg, [LEFT_PX, height - 8.0], "start", caption);
    svg.push_str("</svg>");
    svg
}

/// Adjacent columns in one region of the paper, drawn as a bar above them.
struct Band {
    /// Index of the first column.
    first: usize,
    /// Number of columns.
    columns: usize,
    colour: &'static str,
    label: String,
}

/// Returns the bands of the regions that have a column.
fn bands(map: &Map) -> Vec<Band> {
    let closing_kmh = &map.grid.closing_kmh;
    let band = |Region { share, colour, contains }| {
        let first = closing_kmh.iter().position(|&value| contains(value))?;
        let last = closing_kmh.iter().rposition(|&value| contains(value))?;
        Some(Band { first, columns: last - first + 1, colour, label: format!("paper: {share}") })
    };
    REGIONS.into_iter().filter_map(band).collect()
}

/// Returns the width of a cell (px): the lines fit into the picture, and each label above its band.
fn cell_width(lines: &[&str], bands: &[Band], columns: f64) -> f64 {
    let text_px = |text: &str| LETTER_PX * text.chars().count() as f64;
    let for_lines = lines.iter().map(|line| text_px(line) / columns);
    let for_bands = bands.iter().map(|band| (text_px(&band.label) + BETWEEN_LABELS_PX) / band.columns as f64);
    for_lines.chain(for_bands).fold(MIN_CELL_WIDTH_PX, f64::max).ceil()
}

/// Draws a cell with its upper left corner at this place, with this width (px).
fn cell(svg: &mut String, map: &Map, point: &MapPoint, [x, y]: [f64; 2], width: f64) {
    let share = point.loop_s.map_or(0.0, |s| (s / map.goal_s).clamp(0.0, 1.0));
    // From white to green. A point in time has a dark frame.
    let channel = |from: f64, to: f64| (from + share * (to - from)).round();
    let (red, green, blue) = (channel(250.0, 120.0), channel(246.0, 200.0), channel(240.0, 140.0));
    let frame = if point.is_in_time_in_loop { "#14532d" } else { "#d0d0d0" };
    svg.push_str(&format!(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"rgb({red},{green},{blue})\" stroke=\"{frame}\" \
         stroke-width=\"{}\"/>",
        x + 1.5,
        y + 1.5,
        width - 3.0,
        CELL_HEIGHT_PX - 3.0,
        if point.is_in_time_in_loop { 2 } else { 1 },
    ));
    let number = |s: Option<f64>| s.map_or_else(|| "-".to_owned(), |s| format!("{s:.2}"));
    let mark = if point.agrees() { "" } else { " !" };
    text(svg, [x + 0.5 * width, y + 17.0], "middle", &format!("{}{mark}", number(point.loop_s)));
    text(svg, [x + 0.5 * width, y + 32.0], "middle", &number(point.theory_s));
}

fn text(svg: &mut String, [x, y]: [f64; 2], anchor: &str, words: &str) {
    svg.push_str(&format!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{words}</text>"));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn band(first: usize, columns: usize, label: &str) -> Band {
        Band { first, columns, colour: "#c8c8c8", label: label.to_owned() }
    }

    #[test]
    fn a_map_of_few_columns_has_room_for_its_lines_and_for_the_label_of_each_band() {
        let line = "speed difference of the rear vehicle [km/h]; left: detection distance";
        for columns in 1..12 {
            let width = cell_width(&[line], &[], f64::from(columns));
            assert!(
                width >= MIN_CELL_WIDTH_PX && f64::from(columns) * width >= LETTER_PX * line.chars().count() as f64
            );
        }
        let bands = [band(0, 1, "paper: always"), band(1, 1, "paper: 59 %"), band(2, 6, "paper: not stated")];
        let width = cell_width(&[], &bands, 8.0);
        let ends = bands.iter().map(|band| {
            let middle = (band.first as f64 + 0.5 * band.columns as f64) * width;
            let half = 0.5 * LETTER_PX * band.label.chars().count() as f64;
            [middle - half, middle + half]
        });
        let ends: Vec<[f64; 2]> = ends.collect();
        assert!(ends.windows(2).all(|pair| pair[0][1] < pair[1][0]), "{ends:?}");
        // Many columns in each band need no more room.
        assert_eq!(cell_width(&[line], &[band(0, 9, "paper: always")], 9.0), MIN_CELL_WIDTH_PX);
    }
}
