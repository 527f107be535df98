//! A recorded encounter beside its simulation, as text and as JSON.

use std::fmt;

use closecall_recorded::encounter::RecordedEncounter;
use closecall_scenarios::outcome::Outcome;
use serde_json::{Value, json};

use crate::json;
use crate::run::film::{EncounterComparison, Film};

/// The simulated run of an encounter beside the recorded one.
#[derive(Clone, Copy, Debug)]
pub struct Reenactment<'a> {
    /// The recorded encounter.
    pub encounter: &'a RecordedEncounter,
    /// The metrics of the encounter, and the metrics of the run.
    pub comparison: &'a EncounterComparison,
    /// The film of the recorded traffic, and the film of the run.
    pub films: &'a [Film; 2],
    /// The outcome of the run.
    pub outcome: &'a Outcome,
}

impl Reenactment<'_> {
    /// Returns the comparison as JSON.
    pub fn json(&self) -> Value {
        let [ego, front, rear] = self.encounter.ego_lead_rear().map(|track| track.track_id);
        json!({
            "trajectory_data": self.encounter.data_name,
            "track_id": rear,
            "ego_track_id": ego,
            "front_track_id": front,
            "start_s": self.encounter.start.s(),
            "recorded": json::encounter_metrics(&self.comparison.recorded),
            "simulated": json::encounter_metrics(&self.comparison.simulated),
            "outcome": json::outcome(self.outcome),
        })
    }
}

impl fmt::Display for Reenactment<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { encounter, comparison, films: [recorded, simulated], .. } = self;
        let [ego, front, rear] = encounter.ego_lead_rear().map(|track| track.track_id);
        writeln!(
            f,
            "{}: rear vehicle: track {rear}; ego: track {ego}; lead vehicle: track {front}",
            encounter.data_name
        )?;
        let start_s = encounter.start.s();
        writeln!(f, "start: {start_s:.1} s of the trajectory file, with recorded positions and speeds")?;
        writeln!(f, "  {:<32} {:>16} {:>16}", "", recorded.arm(), simulated.arm())?;
        for (name, [recorded, simulated]) in comparison.rows() {
            writeln!(f, "  {name:<32} {recorded:>16} {simulated:>16}")?;
        }
        writeln!(f, "{}: {}", simulated.arm(), simulated.headline())?;
        for verdict in simulated.mis_summary().into_iter().chain(comparison.never_crosses()) {
            writeln!(f, "{}: {verdict}", simulated.arm())?;
        }
        Ok(())
    }
}
