//! The cost as a part of a campaign's report.

use maud::{Markup, html};

use super::{ArmCost, Cost, ScenarioCost};

/// Returns the section of the report.
pub fn section(cost: &Cost) -> Markup {
    html! {
        h2 { "Cost where nothing happens" }
        p.note {
            "The samples in which no vehicle collides, and the lead vehicle does not brake, in any arm. Each sample has its smallest margin: the "
            "table has their 1st, 5th and 50th percentile. Speed lost: how much slower than the lead vehicle the ego becomes, in the mean and at the 95th "
            "percentile. Time lost: to the baseline, in the mean of some of the samples, which are run again. Rates are per hour of simulated "
            "encounters, not of driving."
        }
        div.wide tabindex="0" { table {
            thead { tr {
                th { "scenario" } th.number { "samples" } th { "controller" } th { "rear headway [s]" } th.number { "below 1 s" } th.number { "below 0.5 s" }
                th { "rear TTC [s]" } th.number { "below 2.6 s" } th { "speed lost [m/s]" } th.number { "time lost [s]" }
                th.number { "engagements per hour" }
            } }
            tbody { @for scenario in &cost.scenarios { (lines(scenario)) } }
        } }
    }
}

fn lines(cost: &ScenarioCost) -> Markup {
    html! {
        @if let Some(why) = cost.why_none() {
            tr { td { (cost.scenario) } td.number { "0" } td colspan="9" { (why) } }
        }
        @for arm in &cost.arms { (line(cost, arm)) }
    }
}

fn line(cost: &ScenarioCost, arm: &ArmCost) -> Markup {
    let smallest = |values: Option<[f64; 3]>| {
        values.map_or_else(|| "-".to_owned(), |[p1, p5, p50]| format!("{p1:.2} / {p5:.2} / {p50:.2}"))
    };
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    html! {
        tr {
            td { (cost.scenario) }
            td.number { (cost.samples) }
            td { (arm.controller) }
            td { (smallest(arm.min_thw_rear_s)) }
            td.number { (percent(arm.share_thw_below[0])) }
            td.number { (percent(arm.share_thw_below[1])) }
            td { (smallest(arm.min_ttc_rear_s)) }
            td.number { (percent(arm.share_ttc_below)) }
            td { (format!("{:.2} / {:.2}", arm.speed_lost_mps[0], arm.speed_lost_mps[1])) }
            td.number { (arm.time_lost_s.map_or_else(|| "-".to_owned(), |s| format!("{s:.2}"))) }
            td.number { (format!("{:.1}", arm.engagements_per_hour)) }
        }
    }
}
