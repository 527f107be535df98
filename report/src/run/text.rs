//! The outcome of a run as text.

use std::fmt;

use closecall_scenarios::causal::VehicleLetters;
use closecall_scenarios::outcome::{Collision, Moment, Outcome};
use closecall_traffic::Measured;

/// Returns a touch in words.
pub(super) fn touch_text(touch: &Collision) -> String {
    let [striking, struck] = touch.roles().map(|index| touch.between[index].as_str());
    format!("touch: {striking} meets {struck} at {:.2} s with {:.2} m/s", touch.time.s(), touch.relative_speed_mps)
}

/// Returns an outcome in one line.
pub fn outcome_line(outcome: &Outcome) -> String {
    let result = if outcome.ego_collided() { "COLLISION" } else { "no collision" };
    let rear = outcome.margins.min_gap_rear_m.map_or("-".to_owned(), |gap_m| format!("{gap_m:.1} m"));
    let engaged = match &outcome.mis {
        Ok(mis) => mis.engaged_at_s.map_or("not engaged".to_owned(), |time_s| format!("engaged at {time_s:.1} s")),
        Err(_) => String::new(),
    };
    let (sample, controller) = (outcome.sample, &outcome.controller);
    let line = format!("sample {sample}  {controller:<5} {result:<12}  smallest rear gap {rear:>7}  {engaged}");
    line.trim_end().to_owned()
}

/// The outcome of a run as text for human readers, over several lines.
#[derive(Clone, Copy, Debug)]
pub struct OutcomeText<'a> {
    /// The outcome.
    pub outcome: &'a Outcome,
    /// The event and its cause, in one sentence.
    pub sentence: &'a str,
    /// The letters of its vehicles.
    pub letters: &'a VehicleLetters,
}

impl fmt::Display for OutcomeText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { outcome, sentence, letters } = self;
        writeln!(
            f,
            "{} · {} · seed {} · sample {} · ended at {} ({})",
            outcome.scenario,
            outcome.controller,
            outcome.seed,
            outcome.sample,
            outcome.duration,
            serde_json::to_string(&outcome.end).unwrap_or_default().trim_matches('"'),
        )?;
        writeln!(f, "  {sentence}")?;
        for (name, value) in outcome.parameters.iter() {
            writeln!(f, "  {name} = {}", value.readable())?;
        }
        for at in &outcome.moments {
            writeln!(f, "  {} at {:.2} s", letters.moment_label(at), at.time.s())?;
        }
        for collision in &outcome.collisions {
            let [first, second] = &collision.between;
            writeln!(
                f,
                "  COLLISION of {first} and {second} at {:.2} s, relative speed {:.1} m/s, ΔV {:.1} and {:.1} m/s",
                collision.time.s(),
                collision.relative_speed_mps,
                collision.delta_v_mps[0],
                collision.delta_v_mps[1],
            )?;
        }
        for touch in &outcome.touches {
            writeln!(f, "  {}", touch_text(touch))?;
        }
        if outcome.collisions.is_empty() {
            writeln!(f, "  no collision")?;
        }
        let line = |name: &str, value: Measured, unit: &str| match value {
            Ok(value) => format!("  {name}: {value:.2} {unit}\n"),
            Err(absent) => format!("  {name}: none, {absent}\n"),
        };
        f.write_str(&line("smallest front time headway", outcome.margins.min_thw_front_s, "s"))?;
        f.write_str(&line("smallest rear time headway", outcome.margins.min_thw_rear_s, "s"))?;
        f.write_str(&line("largest deceleration", Ok(outcome.margins.max_deceleration_mps2), "m/s²"))?;
        match &outcome.mis {
            Ok(mis) => {
                f.write_str(&line("MIS engaged at", mis.engaged_at_s, "s"))?;
                f.write_str(&line("  front time headway then", mis.thw_front_at_engagement_s, "s"))?;
                let when = outcome.reached(Moment::CriticalDistance).map_or_else(
                    || "at the critical distance".to_owned(),
                    |reached| format!("when {}", letters.moment_text(reached)),
                );
                f.write_str(&line(&format!("  front time headway {when}"), mis.thw_front_at_critical_s, "s"))?;
                writeln!(f, "  MIS: {}", mis.reason_words())
            }
            Err(_) => Ok(()),
        }
    }
}
