//! The picture of the map: one panel for each front time headway.

use super::{Map, MapPoint, PAPER_IN_TIME};

/// Size of a cell, and margins (px).
const CELL: [f64; 2] = [58.0, 40.0];
const LEFT: f64 = 70.0;
const TOP: f64 = 62.0;
const BOTTOM: f64 = 44.0;
const RIGHT: f64 = 16.0;

/// Returns the panel of one front time headway as SVG.
pub(super) fn panel(map: &Map, front_thw_s: f64) -> String {
    let grid = &map.grid;
    let (columns, rows) = (grid.closing_kmh.len() as f64, grid.detection_m.len() as f64);
    let (width, height) = (LEFT + columns * CELL[0] + RIGHT, TOP + rows * CELL[1] + BOTTOM);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"12\" role=\"img\"><title>Margin at a front time headway of {front_thw_s} s</title>\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>"
    );
    text(
        &mut svg,
        [LEFT, 18.0],
        "start",
        &format!("front time headway {front_thw_s} s: margin in the loop (theory below) [s]"),
    );
    bands(&mut svg, map);
    for (row, &detection_m) in grid.detection_m.iter().rev().enumerate() {
        let y = TOP + row as f64 * CELL[1];
        text(&mut svg, [LEFT - 8.0, y + 0.5 * CELL[1] + 4.0], "end", &format!("{detection_m} m"));
        for (column, &closing_kmh) in grid.closing_kmh.iter().enumerate() {
            let is_here = |p: &&MapPoint| {
                p.front_thw_s == front_thw_s && p.detection_m == detection_m && p.closing_kmh == closing_kmh
            };
            if let Some(point) = map.points.iter().find(is_here) {
                cell(&mut svg, map, point, [LEFT + column as f64 * CELL[0], y]);
            }
        }
    }
    for (column, closing_kmh) in grid.closing_kmh.iter().enumerate() {
        let x = LEFT + (column as f64 + 0.5) * CELL[0];
        text(&mut svg, [x, TOP + rows * CELL[1] + 16.0], "middle", &closing_kmh.to_string());
    }
    text(
        &mut svg,
        [LEFT, height - 8.0],
        "start",
        "speed difference of the rear vehicle [km/h]; left: detection distance",
    );
    svg.push_str("</svg>");
    svg
}

/// Draws the paper's region "in time" as bars above the columns whose speed difference lies in it.
fn bands(svg: &mut String, map: &Map) {
    let kmh = &map.grid.closing_kmh;
    let mut low = f64::NEG_INFINITY;
    let bands = PAPER_IN_TIME.into_iter().chain([(f64::INFINITY, "never")]);
    for ((high, share), colour) in bands.zip(["#2a9d4a", "#e0b030", "#c8c8c8", "#c94a3b"]) {
        // The paper: always below 20 km/h, a share up to 25 km/h, and never above 30 km/h.
        let is_in = |value: &f64| {
            if share == "always" {
                *value < high
            } else {
                *value > low && *value <= high || *value == 20.0 && share == "59 %"
            }
        };
        let columns: Vec<usize> = (0..kmh.len()).filter(|&column| is_in(&kmh[column])).collect();
        if let (Some(first), Some(last)) = (columns.first(), columns.last()) {
            let x = LEFT + *first as f64 * CELL[0];
            let width = (last - first + 1) as f64 * CELL[0];
            svg.push_str(&format!("<rect x=\"{x}\" y=\"28\" width=\"{width}\" height=\"8\" fill=\"{colour}\"/>"));
            text(svg, [x + 0.5 * width, 52.0], "middle", &format!("paper: {share}"));
        }
        low = high;
    }
}

fn cell(svg: &mut String, map: &Map, point: &MapPoint, [x, y]: [f64; 2]) {
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
        CELL[0] - 3.0,
        CELL[1] - 3.0,
        if point.is_in_time_in_loop { 2 } else { 1 },
    ));
    let number = |s: Option<f64>| s.map_or_else(|| "-".to_owned(), |s| format!("{s:.2}"));
    let mark = if point.agrees() { "" } else { " !" };
    text(svg, [x + 0.5 * CELL[0], y + 17.0], "middle", &format!("{}{mark}", number(point.loop_s)));
    text(svg, [x + 0.5 * CELL[0], y + 32.0], "middle", &number(point.theory_s));
}

fn text(svg: &mut String, [x, y]: [f64; 2], anchor: &str, words: &str) {
    svg.push_str(&format!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{words}</text>"));
}
