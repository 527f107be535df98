//! A frontier as text for the console, and its charts.

use std::fmt::{self, Display, Formatter};
use std::io;

use closecall_campaign::frontier::{Frontier, Point};
use closecall_traffic::statistics::sensitivity::jackknife::Estimate;
use closecall_traffic::words::counted;

use super::aligned::{error_lines, share, write_rows};
use crate::charts::{ScatterPoint, scatter};

/// The mark of a Pareto-optimal combination.
const OPTIMAL: &str = "◆";

/// A frontier as text.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrontierText<'a>(pub(super) &'a Frontier);

/// The names of the columns that follow the keys.
pub(super) const HEADS: [&str; 5] =
    ["collisions without", "with", "prevented (95 %)", "induced (95 %)", "speed lost (95 %)"];

/// Returns the cells of a combination that follow the cells of its values.
pub(super) fn cells(point: &Point) -> [String; 5] {
    let lost = point.speed_lost_mps.map_or_else(
        || "-".to_owned(),
        |Estimate { value, interval_95: [low, high] }| format!("{value:.2} m/s ({low:.2} to {high:.2})"),
    );
    [
        point.collisions_without.to_string(),
        point.collisions.to_string(),
        format!("{}: {}", point.pairs.prevented, share(point.prevented)),
        format!("{}: {}", point.pairs.induced, share(point.induced)),
        lost,
    ]
}

/// Returns the last part of a key.
pub(super) fn short(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

impl Display for FrontierText<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let frontier = self.0;
        let (scenario, samples, seed) = (&frontier.scenario, frontier.samples, frontier.seed);
        let (points, controllers) = (counted(frontier.points.len(), "combination"), frontier.controllers.join(" and "));
        let samples = counted(samples, "sample");
        writeln!(f, "{scenario}: {points}, {samples} each, {controllers}, seed {seed}\n")?;
        let keys = frontier.keys.iter().map(|key| short(key).to_owned());
        let mut rows =
            vec![std::iter::once(String::new()).chain(keys).chain(HEADS.map(str::to_owned)).collect::<Vec<_>>()];
        for point in &frontier.points {
            let mark = if point.is_optimal { OPTIMAL } else { "" }.to_owned();
            rows.push(std::iter::once(mark).chain(point.values.iter().cloned()).chain(cells(point)).collect());
        }
        write_rows(f, &rows)?;
        for line in error_lines(&frontier.errors, "runs") {
            writeln!(f, "{line}")?;
        }
        writeln!(
            f,
            "\n{OPTIMAL}: Pareto-optimal. No other combination prevents more, induces less or loses less speed without being \
             worse in another of the three. Intervals that overlap do not tell two combinations apart."
        )
    }
}

/// A value of a point with its interval.
type Placed = (f64, [f64; 2]);

/// Returns the charts of a frontier with their names.
pub(super) fn charts(frontier: &Frontier) -> io::Result<Vec<(&'static str, String)>> {
    let percent = |estimate: Option<Estimate>| {
        estimate.map(|Estimate { value, interval_95 }| (100.0 * value, interval_95.map(|bound| 100.0 * bound)))
    };
    let plain = |estimate: Option<Estimate>| estimate.map(|estimate| (estimate.value, estimate.interval_95));
    let points = |axes: &dyn Fn(&Point) -> Option<[Placed; 2]>| -> Vec<ScatterPoint> {
        let of_point = |point: &Point| {
            let [(x, across), (y, up)] = axes(point)?;
            let label = point.values.join(" · ");
            Some(ScatterPoint { at: [x, y], intervals_95: [across, up], label, is_marked: point.is_optimal })
        };
        frontier.points.iter().filter_map(of_point).collect()
    };
    let keys: Vec<&str> = frontier.keys.iter().map(|key| short(key)).collect();
    let title = format!("{}: {}", frontier.scenario, keys.join(" · "));
    let induced = points(&|point| Some([percent(point.induced)?, percent(point.prevented)?]));
    let lost = points(&|point| Some([plain(point.speed_lost_mps)?, percent(point.prevented)?]));
    let prevented = "prevented, of the collisions without the system [%]";
    Ok(vec![
        ("induced", scatter(&induced, &title, ["induced, of all samples [%]", prevented])?),
        ("speed", scatter(&lost, &title, ["mean speed lost [m/s]", prevented])?),
    ])
}
