//! The study of emergency braking against crash records, as text for the console, with its chart.

use std::fmt::{self, Display, Formatter};
use std::io;

use closecall_studies::anchor::{Anchor, LEAST_COLLISIONS, Paired, Quantity, Row};
use closecall_traffic::statistics::sensitivity::jackknife::Estimate;
use closecall_traffic::words::counted;

use super::aligned::{error_lines, write_rows};
use crate::charts::{ScatterPoint, scatter};

/// The study as text.
#[derive(Clone, Copy, Debug)]
pub(super) struct AnchorText<'a>(pub(super) &'a Anchor);

/// The names of the columns behind the column of the name.
pub(super) const HEADS: [&str; 5] =
    ["samples", "strikes without, with", "ratio (95 %)", "struck without, with", "ratio (95 %)"];

/// Returns the cells of a row behind its name.
pub(super) fn cells(row: &Row) -> [String; 5] {
    let counts = |paired: &Paired| format!("{}, {}", paired.without(), paired.with());
    [row.samples.to_string(), counts(&row.striking), ratio(&row.striking), counts(&row.struck), ratio(&row.struck)]
}

/// Returns a ratio with its interval; a dash if there is none.
fn ratio(paired: &Paired) -> String {
    let text = |Estimate { value, interval_95: [low, high] }| format!("{value:.2} ({low:.2} to {high:.2})");
    paired.ratio().map_or_else(|| "-".to_owned(), text)
}

/// Returns the name of a row, with the setting of a variation.
pub(super) fn name(row: &Row) -> String {
    let short = |setting: &String| setting.rsplit_once("ego-stack.").map_or(setting.clone(), |(_, key)| key.to_owned());
    row.setting.as_ref().map_or_else(|| row.name.clone(), |setting| format!("{} ({})", row.name, short(setting)))
}

/// Returns what follows for a quantity, in words.
pub(super) fn conclusion(anchor: &Anchor, quantity: Quantity) -> String {
    let (what, published) = (quantity.text(), quantity.published());
    let Some([low, high]) = anchor.range(quantity) else {
        return format!(
            "{what}: no drivers have {LEAST_COLLISIONS} collisions without emergency braking, so nothing can be said: run more samples"
        );
    };
    let verdict = if anchor.covers(quantity) == Some(true) { "COVERED" } else { "MISSED" };
    let agreeing: Vec<&str> = anchor.agreeing(quantity).collect();
    let agreeing = if agreeing.is_empty() { "none".to_owned() } else { agreeing.join(", ") };
    let mover = anchor.mover(quantity).map_or_else(String::new, |(row, change)| moved(&name(row), change));
    format!(
        "{what}: published {published:.2}, ensemble {low:.2} to {high:.2}: {verdict}; intervals that contain it: {agreeing}{mover}"
    )
}

/// Returns which variation moves a ratio most, as the end of a sentence.
fn moved(variation: &str, change: [f64; 2]) -> String {
    let [own, moved] = change.map(|ratio| format!("{ratio:.2}"));
    if own == moved {
        return format!("; no variation moves it from {own}");
    }
    format!("; the variation that moves it most: {variation}, from {own} to {moved}")
}

impl Display for AnchorText<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let anchor = self.0;
        let (scenario, arms, samples) =
            (&anchor.scenario, anchor.controllers.join(" and "), counted(anchor.samples, "sample"));
        writeln!(f, "{scenario}: {arms}, {samples} of each row, seed {}\n", anchor.seed)?;
        let rows = |head: &str, rows: &[Row]| {
            let head = std::iter::once(head.to_owned()).chain(HEADS.map(str::to_owned)).collect::<Vec<_>>();
            let row = |row: &Row| std::iter::once(name(row)).chain(cells(row)).collect::<Vec<_>>();
            std::iter::once(head).chain(rows.iter().map(row)).collect::<Vec<_>>()
        };
        write_rows(f, &rows("drivers", &anchor.members))?;
        if !anchor.without_effect.is_empty() {
            writeln!(f, "  without effect, and not run: {}", anchor.without_effect.join(", "))?;
        }
        writeln!(f)?;
        write_rows(f, &rows("one assumption varied", &anchor.variations))?;
        writeln!(f)?;
        for quantity in Quantity::ALL {
            writeln!(f, "{}", conclusion(anchor, quantity))?;
        }
        for line in error_lines(&anchor.errors, "samples") {
            writeln!(f, "{line}")?;
        }
        writeln!(
            f,
            "Published: Cicchino 2017, doi 10.1016/j.aap.2016.11.009, all rear-end collisions that the police recorded. With fewer \
             than {LEAST_COLLISIONS} collisions without emergency braking a ratio is no part of a range."
        )
    }
}

/// Returns the chart of both ratios of each member.
pub(super) fn charts(anchor: &Anchor) -> io::Result<Vec<(&'static str, String)>> {
    let point = |row: &Row| {
        let [striking, struck] = Quantity::ALL.map(|quantity| row.paired(quantity).ratio());
        let (striking, struck) = (striking?, struck?);
        Some(ScatterPoint {
            at: [striking.value, struck.value],
            intervals_95: [striking.interval_95, struck.interval_95],
            label: String::new(),
            is_marked: false,
        })
    };
    let at = Quantity::ALL.map(Quantity::published);
    let published = ScatterPoint {
        at,
        intervals_95: at.map(|value| [value; 2]),
        label: "Cicchino 2017".to_owned(),
        is_marked: true,
    };
    let points: Vec<ScatterPoint> = anchor.members.iter().filter_map(point).chain([published]).collect();
    Ok(vec![(
        "ratios",
        scatter(&points, &anchor.scenario, ["ratio of striking", "ratio of being struck from behind"])?,
    )])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variation_that_moves_nothing_is_not_the_one_that_moves_it_most() {
        assert_eq!(moved("late", [0.5, 0.62]), "; the variation that moves it most: late, from 0.50 to 0.62");
        for unmoved in [[0.0, 0.0], [0.5, 0.501]] {
            assert!(moved("late", unmoved).starts_with("; no variation moves it from 0."), "{unmoved:?}");
        }
    }
}
