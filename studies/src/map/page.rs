//! The page of the map.

use std::path::{Path, PathBuf};

use closecall_traffic::atomic::{WriteError, create_folder, write_file};
use maud::{DOCTYPE, PreEscaped, html};

use super::table::csv;
use super::{Map, MapPoint, svg};

/// The style of a dark page. Pictures are drawn for white paper: their lightness is inverted, and
/// their hues stay.
const DARK: &str = ":root{color-scheme:light dark}\
                    @media screen and (prefers-color-scheme:dark){svg{filter:invert(1) hue-rotate(180deg)}}";

/// Writes `map.html`, a picture for each front time headway, `map.csv` and `map.json` into a
/// folder, which is created if it does not exist. Returns the paths.
///
/// # Errors
/// [`WriteError`] if a file cannot be written.
pub fn write_map(folder: &Path, map: &Map) -> Result<Vec<PathBuf>, WriteError> {
    create_folder(folder)?;
    let mut files = vec![
        (folder.join("map.html"), page(map)),
        (folder.join("map.csv"), csv(map)),
        (folder.join("map.json"), serde_json::to_string_pretty(map).unwrap_or_default()),
    ];
    for &front_thw_s in &map.grid.front_thw_s {
        files.push((folder.join(format!("map-{front_thw_s}-s.svg")), svg::panel(map, front_thw_s)));
    }
    for (path, text) in &files {
        write_file(path, |file| file.write_all(text.as_bytes()))?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

fn page(map: &Map) -> String {
    let differing: Vec<&MapPoint> = map.points.iter().filter(|point| !point.agrees()).collect();
    let number = |s: Option<f64>| s.map_or_else(|| "-".to_owned(), |s| format!("{s:.2}"));
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                title { "Margin of " (map.controller) }
                style { "body{font-family:sans-serif;max-width:72rem;margin:2rem auto;padding:0 1rem}td,th{padding:.2rem .6rem;text-align:left}svg{max-width:100%;height:auto}" (DARK) }
            }
            body {
                h1 { "Margin that the system reaches" }
                p {
                    "The margin is the gain of the front time headway from the engagement until the rear vehicle is "
                    (map.critical_gap_m) " m behind. The ego and the lead vehicle drive at " (format!("{:.1}", map.grid.speed_mps))
                    " m/s, the rear vehicle keeps its speed, and all tracks are true. The system (" (map.controller) ") aims at "
                    (map.goal_s) " s with at most " (map.max_deceleration_mps2) " m/s², and engages from a speed difference of "
                    (format!("{:.0}", map.engages_from_kmh)) " km/h on. Dark frames: in time in the loop. Bars: the region of the paper, in time "
                    "always below 20 km/h, in 59 % of the cases up to 25 km/h, never above 30 km/h."
                }
                @for &front_thw_s in &map.grid.front_thw_s { figure { (PreEscaped(svg::panel(map, front_thw_s))) } }
                h2 { "Theory and loop" }
                p {
                    "They differ by more than 0.2 s of margin, or only one of them has a margin, at " (differing.len()) " of "
                    (map.points.len()) " points, which the pictures mark by an exclamation mark."
                }
                @if !differing.is_empty() {
                    table {
                        tr { th { "km/h" } th { "m" } th { "s" } th { "theory [s]" } th { "loop [s]" } th { "why" } }
                        @for point in differing {
                            tr {
                                td { (point.closing_kmh) } td { (point.detection_m) } td { (point.front_thw_s) }
                                td { (number(point.theory_s)) } td { (number(point.loop_s)) }
                                td { (point.reason.as_deref().unwrap_or_default()) }
                            }
                        }
                    }
                }
            }
        }
    };
    page.into_string()
}
