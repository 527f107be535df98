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

/// Returns the combinations with samples in which only other vehicles collide, in a sentence:
/// there, the other columns do not add up to the collisions with the system. `None` if there are
/// none.
pub(super) fn others(frontier: &Frontier) -> Option<String> {
    let of_point = |point: &Point| {
        let settings = frontier.keys.iter().zip(&point.values).map(|(key, value)| format!("{}={value}", short(key)));
        format!(
            "{} ({})",
            counted(point.collisions_of_others_only(), "sample"),
            settings.collect::<Vec<_>>().join(", ")
        )
    };
    let counts: Vec<String> =
        frontier.points.iter().filter(|point| point.collisions_of_others_only() > 0).map(of_point).collect();
    let tested = frontier.controllers.last().map_or("", String::as_str);
    (!counts.is_empty()).then(|| {
        format!(
            "Only vehicles other than the ego collide with {tested} in {}. Such a sample is induced or not prevented, and is no \
             collision of the column \"with\".",
            counts.join(", ")
        )
    })
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
        if let Some(others) = others(frontier) {
            writeln!(f, "\n{others}")?;
        }
        if let Some(reason) = without_collisions(frontier) {
            return writeln!(f, "\n{reason}");
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

/// Returns why a frontier has no chart and no mark, in a sentence. `None` if a sample collides
/// without the system.
pub(super) fn without_collisions(frontier: &Frontier) -> Option<String> {
    let baseline = frontier.controllers.first().map_or("", String::as_str);
    let is_without = |point: &Point| point.collisions_without == 0 && point.prevented.is_none();
    frontier.points.iter().all(is_without).then(|| {
        format!(
            "With {baseline} no sample collides, so that there is nothing to prevent: no combination is marked, and there is no \
             chart. More samples may show more."
        )
    })
}

/// Returns the charts of a frontier with their names. A chart without a point is left out.
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
    let charts = [("induced", induced, "induced, of all samples [%]"), ("speed", lost, "mean speed lost [m/s]")];
    let drawn = charts.into_iter().filter(|(_, points, _)| !points.is_empty());
    drawn.map(|(name, points, across)| Ok((name, scatter(&points, &title, [across, prevented])?))).collect()
}

#[cfg(test)]
mod tests {
    use closecall_campaign::ledger::Pairs;
    use closecall_campaign::sensitivity::RunErrors;

    use super::*;

    /// A frontier of two combinations. In the second, so many samples have a collision of other
    /// vehicles only.
    fn frontier(both_of_others: u64) -> Frontier {
        let point = |value: &str, both_of_others| Point {
            values: vec![value.to_owned()],
            samples: 40,
            collisions_without: 6,
            collisions: 4 - both_of_others,
            pairs: Pairs { prevented: 3, induced: 1, both: 3, neither: 33, both_of_others, ..Pairs::default() },
            prevented: None,
            induced: None,
            speed_lost_mps: None,
            is_optimal: false,
        };
        Frontier {
            scenario: "s".to_owned(),
            seed: 1,
            samples: 40,
            settings: Vec::new(),
            controllers: vec!["acc".to_owned(), "mis".to_owned()],
            keys: vec!["actor.ego.driver.ego-stack.mis.hold-s".to_owned()],
            points: vec![point("1", 0), point("2", both_of_others)],
            errors: RunErrors::default(),
        }
    }

    #[test]
    fn a_frontier_without_a_collision_to_prevent_has_no_chart_and_says_why() {
        let mut nothing = frontier(0);
        nothing.points.iter_mut().for_each(|point| point.collisions_without = 0);
        assert!(charts(&nothing).unwrap().is_empty());
        let text = FrontierText(&nothing).to_string();
        assert!(text.contains("With acc no sample collides") && !text.contains(OPTIMAL), "{text}");
        assert!(!FrontierText(&frontier(0)).to_string().contains("no sample collides"));
    }

    #[test]
    fn the_text_explains_figures_that_do_not_add_up_because_others_collide() {
        let text = FrontierText(&frontier(1)).to_string();
        let sentence = "Only vehicles other than the ego collide with mis in 1 sample (hold-s=2). Such a sample";
        assert!(text.contains(sentence), "{text}");
        assert!(!FrontierText(&frontier(0)).to_string().contains("other than the ego"));
    }
}
