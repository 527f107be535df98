//! The cost as text.

use std::fmt;

use super::{Cost, ScenarioCost};
use closecall_traffic::words::counted;

/// The cost as text for readers.
#[derive(Clone, Copy, Debug)]
pub struct CostText<'a>(pub &'a Cost);

impl fmt::Display for CostText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "cost where nothing happens (no vehicle collides, and the lead vehicle does not brake, in any arm):"
        )?;
        self.0.scenarios.iter().try_for_each(|scenario| write_scenario(f, scenario))
    }
}

fn write_scenario(f: &mut fmt::Formatter<'_>, cost: &ScenarioCost) -> fmt::Result {
    if let Some(why) = cost.why_none() {
        return writeln!(f, " {}: {why}", cost.scenario);
    }
    let timed = match cost.timed_samples {
        0 => String::new(),
        timed => format!(", time lost in {timed} of them"),
    };
    writeln!(f, " {}: {}{timed}", cost.scenario, counted(cost.samples, "sample"))?;

    for arm in &cost.arms {
        let smallest = |values: Option<[f64; 3]>| {
            values.map_or_else(|| "none".to_owned(), |[p1, p5, p50]| format!("{p1:.2}, {p5:.2}, {p50:.2} s"))
        };
        let [below_1, below_half] = arm.share_thw_below.map(|share| 100.0 * share);
        let [mean_mps, p95_mps] = arm.speed_lost_mps;
        let lost = arm.time_lost_s.map_or_else(String::new, |s| format!(", {s:.2} s lost"));
        writeln!(
            f,
            "  {:<12} smallest rear headway (1, 5, 50 %): {}; below 1 s {below_1:.1} %, below 0.5 s {below_half:.1} %",
            arm.controller,
            smallest(arm.min_thw_rear_s),
        )?;
        writeln!(
            f,
            "  {:<12} smallest rear TTC: {}; below 2.6 s {:.1} %; {mean_mps:.2} m/s slower in the mean, {p95_mps:.2} m/s at \
                 95 %{lost}; {:.1} engagements per hour",
            "",
            smallest(arm.min_ttc_rear_s),
            100.0 * arm.share_ttc_below,
            arm.engagements_per_hour,
        )?;
    }
    Ok(())
}
