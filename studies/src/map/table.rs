//! The map as text, and as a table for programs.

use std::fmt;

use super::{Map, MapPoint};

/// The map as text for readers.
#[derive(Clone, Copy, Debug)]
pub struct MapText<'a>(pub &'a Map);

impl fmt::Display for MapText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let map = self.0;
        writeln!(
            f,
            "margin of {} at {:.1} m/s: goal {:.1} s, at most {:.1} m/s²; theory / loop (s), * in time in the loop",
            map.controller, map.grid.speed_mps, map.goal_s, map.max_deceleration_mps2,
        )?;
        for &front_thw_s in &map.grid.front_thw_s {
            writeln!(f, "\nfront time headway {front_thw_s} s")?;
            write!(f, "  {:>8}", "km/h")?;
            map.grid.closing_kmh.iter().try_for_each(|kmh| write!(f, " {kmh:>12}"))?;
            writeln!(f)?;
            for &detection_m in &map.grid.detection_m {
                write!(f, "  {:>6} m", detection_m)?;
                let is_here = |p: &&MapPoint| p.front_thw_s == front_thw_s && p.detection_m == detection_m;
                for point in map.points.iter().filter(is_here) {
                    let number = |s: Option<f64>| s.map_or_else(|| "-".to_owned(), |s| format!("{s:.2}"));
                    let mark = if point.is_in_time_in_loop { "*" } else { " " };
                    write!(f, " {:>5}/{:>5}{mark}", number(point.theory_s), number(point.loop_s))?;
                }
                writeln!(f)?;
            }
        }
        let differing: Vec<&MapPoint> = map.points.iter().filter(|point| !point.agrees()).collect();
        writeln!(
            f,
            "\ntheory and loop differ by more than 0.2 s at {} of {} points",
            differing.len(),
            map.points.len()
        )?;
        for point in differing {
            let reason = point.reason.as_deref().unwrap_or_default();
            writeln!(f, "  {} km/h, {} m, {} s: {reason}", point.closing_kmh, point.detection_m, point.front_thw_s)?;
        }
        Ok(())
    }
}

/// Returns the points as CSV.
pub fn csv(map: &Map) -> String {
    let mut text =
        "closing_kmh,detection_m,front_thw_s,planned_mps2,theory_s,theory_at_once_s,loop_s,in_time_in_theory,\
                    in_time_in_loop,reason\n"
            .to_owned();
    for point in &map.points {
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.4}"));
        text.push_str(&format!(
            "{},{},{},{},{},{},{},{},{},\"{}\"\n",
            point.closing_kmh,
            point.detection_m,
            point.front_thw_s,
            number(point.planned_mps2),
            number(point.theory_s),
            number(point.theory_at_once_s),
            number(point.loop_s),
            point.is_in_time_in_theory,
            point.is_in_time_in_loop,
            point.reason.as_deref().unwrap_or_default().replace('"', "'"),
        ));
    }
    text
}
