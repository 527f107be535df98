//! The page of the map of margins, in the style of all pages.

use std::path::{Path, PathBuf};

use closecall_studies::map::{Map, MapPoint, csv, panel};
use closecall_traffic::atomic::{WriteError, create_folder, write_file};
use maud::{Markup, PreEscaped, html};

use crate::campaign::html::page::{document, head, number, number_heads, table, text_heads};

/// Writes `map.html`, a picture for each front time headway, `map.csv` and `map.json` into a
/// folder, which is created if it does not exist. Returns the paths.
///
/// # Errors
/// [`WriteError`] if a file cannot be written.
pub fn write_map(folder: &Path, map: &Map) -> Result<Vec<PathBuf>, WriteError> {
    create_folder(folder)?;
    let mut files = vec![
        (folder.join("map.html"), page(map).into_string()),
        (folder.join("map.csv"), csv(map)),
        (folder.join("map.json"), serde_json::to_string_pretty(map).unwrap_or_default()),
    ];
    for &front_thw_s in &map.grid.front_thw_s {
        files.push((folder.join(format!("map-{front_thw_s}-s.svg")), panel(map, front_thw_s)));
    }
    for (path, text) in &files {
        write_file(path, |file| file.write_all(text.as_bytes()))?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

fn page(map: &Map) -> Markup {
    let title = format!("Margin that {} reaches", map.controller);
    let about = format!(
        "Goal {} s with at most {} m/s², ego and lead vehicle at {:.1} m/s, {} points",
        map.goal_s,
        map.max_deceleration_mps2,
        map.grid.speed_mps,
        map.points.len()
    );
    let differing: Vec<&MapPoint> = map.points.iter().filter(|point| !point.agrees()).collect();
    let seconds = |s: Option<f64>| s.map_or_else(|| "-".to_owned(), |s| format!("{s:.2}"));
    let heads = html! {
        (number_heads(&["speed difference [km/h]", "detection [m]", "front headway [s]", "theory [s]", "loop [s]"]))
        (text_heads(&["why"]))
    };
    let rows = html! {
        @for point in &differing {
            tr {
                (number(point.closing_kmh)) (number(point.detection_m)) (number(point.front_thw_s))
                (number(seconds(point.theory_s))) (number(seconds(point.loop_s)))
                td { (point.reason.as_deref().unwrap_or_default()) }
            }
        }
    };
    let body = html! {
        (head(&title, &[], &about))
        p {
            "The margin is the gain of the front time headway from the engagement until the rear vehicle is "
            (map.critical_gap_m) " m behind. The rear vehicle keeps its speed, and all tracks are true. The system engages from a speed "
            "difference of " (format!("{:.0}", map.engages_from_kmh)) " km/h on. Thick frames: in time in the loop. Bars: the region of the "
            "paper, in time always below 20 km/h, in 59 % of the cases up to 25 km/h, never above 30 km/h."
        }
        @for &front_thw_s in &map.grid.front_thw_s {
            figure.broad tabindex="0" { (PreEscaped(panel(map, front_thw_s))) }
        }
        section {
            h2 { "Theory and loop" }
            p {
                "They differ by more than 0.2 s of margin, or only one of them has a margin, at " (differing.len()) " of "
                (map.points.len()) " points, which the pictures mark by an exclamation mark."
            }
            @if !differing.is_empty() { (table(&heads, &rows)) }
        }
    };
    document(&title, &body)
}
