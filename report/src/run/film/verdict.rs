//! The verdict on a run or on a pair, in words: the collisions, whether the system prevented them,
//! and how close they were.

use closecall_campaign::ledger::{PairFate, Tally};
use closecall_scenarios::outcome::Outcome;
use closecall_traffic::Light;

use super::Film;

/// Visibility below which the weather is named (m). Koschmieder's visibility of clear air is far
/// above it.
const CLEAR_VISIBILITY_M: f64 = 2_000.0;

/// Returns the change by the system under test, by the rule of the campaigns.
fn fate(baseline: &Outcome, tested: &Outcome) -> Option<PairFate> {
    let [baseline, tested] = [baseline, tested].map(|outcome| Tally {
        collided: Some(outcome.ego_collided()),
        others_collided: outcome.others_collided(),
        ..Tally::default()
    });
    PairFate::of(&baseline, &tested)
}

/// Returns the verdict on a pair as one or two words.
pub(in crate::run) const fn fate_word(fate: PairFate) -> &'static str {
    match fate {
        PairFate::Prevented => "PREVENTED",
        PairFate::Induced => "INDUCED",
        PairFate::Both => "BOTH COLLIDE",
        PairFate::Neither => "NEITHER COLLIDES",
    }
}

impl Film {
    /// Returns the verdict on a pair, or on a single run, in capital letters.
    pub(crate) fn verdict_word(films: &[Self]) -> &'static str {
        match Self::pair_fate(films) {
            Some(fate) => fate_word(fate),
            None if films.iter().any(|film| film.worst_collision().is_some()) => "COLLISION",
            None => "NO COLLISION",
        }
    }

    /// Returns the verdict on a pair of films of runs, or `None` if one of them is recorded
    /// traffic.
    pub fn pair_fate(films: &[Self]) -> Option<PairFate> {
        match films {
            [baseline, tested] => fate(baseline.outcome()?, tested.outcome()?),
            _ => None,
        }
    }

    /// Returns the words for the arm: `without MIS` and `with MIS` for the built-in ego stack of a
    /// scenario that has the system, the controller's name for others.
    pub fn arm_label(&self) -> &str {
        match (self.arm.as_str(), self.has_mis) {
            ("acc", true) => "without MIS",
            ("mis", true) => "with MIS",
            (name, _) => name,
        }
    }

    /// Returns the collision, or its absence, and the smallest headways. `None` for recorded
    /// traffic.
    pub fn result(&self) -> Option<String> {
        let outcome = self.outcome.as_ref()?;
        let collision = match self.worst_collision() {
            Some(collision) => format!("{} ({:.2} s)", self.struck_text(collision), collision.time.s()),
            None => "no collision".to_owned(),
        };
        Some(format!("{collision}; smallest headway: {}", headways(outcome)))
    }

    /// Returns the smallest headways, also with the baseline of a pair, and since when the ego saw
    /// the vehicle behind.
    pub(in crate::run) fn headways_and_sight(&self, baseline: Option<&Self>) -> Option<String> {
        let sight = self.sight().map_or(String::new(), |sight| format!(" {sight}"));
        let of_baseline = |film: &Self| Some(format!("; {}: {}", film.arm_label(), headways(film.outcome.as_ref()?)));
        let compared = baseline.and_then(of_baseline).unwrap_or_default();
        Some(format!("Smallest headway: {}{compared}.{sight}", headways(self.outcome.as_ref()?)))
    }

    /// Returns the actions of the system, and since when it saw the vehicle behind, as a line of a
    /// list.
    pub(in crate::run) fn system_line(&self) -> Option<String> {
        let sight = self.sight().map_or(String::new(), |sight| format!(" {sight}"));
        Some(format!("- {}{sight}\n", self.mis_summary()?))
    }

    /// Returns the weather and light, or `None` on a clear, dry day.
    pub(in crate::run) fn weather(&self) -> Option<String> {
        let weather = &self.environment;
        let mut parts = Vec::new();
        match weather.light {
            Light::Day => (),
            Light::Dusk => parts.push("dusk".to_owned()),
            Light::Night => parts.push("night".to_owned()),
        }
        if weather.visibility_m < CLEAR_VISIBILITY_M {
            parts.push(format!("visibility {:.0} m", weather.visibility_m));
        }
        if weather.rain_mm_per_h > 0.0 {
            parts.push(format!("rain {:.1} mm/h", weather.rain_mm_per_h));
        }
        if weather.water_film_mm > 0.0 {
            parts.push(format!("water film {:.1} mm", weather.water_film_mm));
        }
        (!parts.is_empty()).then(|| parts.join(", "))
    }
}

/// Returns the smallest headways of a run.
fn headways(outcome: &Outcome) -> String {
    let margins = &outcome.margins;
    let headways = [("front", margins.min_thw_front_s), ("rear", margins.min_thw_rear_s)];
    let texts = headways.iter().filter_map(|(name, thw_s)| Some(format!("{name} {}", headway_text(thw_s.ok()?))));
    let texts: Vec<String> = texts.collect();
    if texts.is_empty() { "no vehicle near".to_owned() } else { texts.join(", ") }
}

/// Largest headway that is written in full (s). Beyond it the vehicles do not influence each other.
const MAX_WRITTEN_THW_S: f64 = 10.0;

/// Returns a headway as text. A standing follower would otherwise have a headway of hours.
pub(in crate::run) fn headway_text(thw_s: f64) -> String {
    if thw_s > MAX_WRITTEN_THW_S { format!("> {MAX_WRITTEN_THW_S:.0} s") } else { format!("{thw_s:.2} s") }
}
