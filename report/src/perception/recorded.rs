//! The result of a recording as text and as JSON.

use std::fmt::{self, Display, Formatter};

use serde_json::{Value, json};

use closecall_studies::perception::recorded::{RecordedStudy, TruthFigures, VehicleGroup};
use closecall_traffic::words::counted;

use super::number;
use crate::json::stamped;

/// The reason for which there are no figures by labels.
const NO_LABELS: &str = "the recording has no labels";

/// The result of a recording, with the names of the recording and of the scenario of the sensors.
#[derive(Clone, Debug)]
pub struct RecordedReport {
    /// The recording.
    pub recording: String,
    /// The scenario.
    pub scenario: String,
    /// The result.
    pub study: RecordedStudy,
}

impl RecordedReport {
    /// Returns the result as JSON.
    pub fn json(&self) -> Value {
        let RecordedStudy { lidars, duration_s, has_map, tracks, confirmed_lives_s, truth } = &self.study;
        let lidars: Vec<Value> = lidars
            .iter()
            .map(|of| json!({ "name": of.name, "scans": of.scans, "points": of.points, "outside": of.outside }))
            .collect();
        let lives = life_figures_s(confirmed_lives_s)
            .map(|[least, median, most]| json!({ "least": least, "median": median, "most": most }));
        let mut value = json!({
            "recording": self.recording, "scenario": self.scenario, "lidars": lidars, "duration_s": duration_s,
            "road": if *has_map { "map" } else { "path" },
            "tracks": { "number": tracks, "confirmed": confirmed_lives_s.len(), "life_s": lives },
            "truth": truth.as_ref().map(truth_json),
        });
        if truth.is_none() {
            value["truth_absent"] = json!(NO_LABELS);
        }
        stamped(value, None, None)
    }
}

fn truth_json(truth: &TruthFigures) -> Value {
    let group = |group: &VehicleGroup| {
        let figures = &group.figures;
        let rmse = |index: usize| figures.errors.map(|errors| errors[index].rmse.value);
        json!({
            "name": group.name, "vehicles": group.vehicles, "recall": group.recall, "range_m": figures.range_m.value,
            "along_rmse_m": rmse(0), "across_rmse_m": rmse(1), "speed_rmse_mps": rmse(2),
            "class_accuracy": figures.class_accuracy.map(|estimate| estimate.value),
        })
    };
    json!({
        "judged_s": truth.judged_s, "groups": truth.groups.iter().map(group).collect::<Vec<_>>(), "nees": truth.nees,
        "id_switches": truth.id_switches, "false_tracks": truth.false_tracks,
    })
}

/// Returns the least, the median and the greatest of some lives in order; `None` if there are none.
fn life_figures_s(lives_s: &[f64]) -> Option<[f64; 3]> {
    let middle = lives_s.get((lives_s.len().max(1) - 1) / 2)?;
    Some([*lives_s.first()?, 0.5 * (middle + lives_s[lives_s.len() / 2]), *lives_s.last()?])
}

impl Display for RecordedReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let RecordedStudy { lidars, duration_s, has_map, tracks, confirmed_lives_s, truth } = &self.study;
        writeln!(f, "{}: the chain of {} on {duration_s:.2} s of recorded scans", self.recording, self.scenario)?;
        for of in lidars {
            write!(f, "  {}: {}, {}", of.name, counted(of.scans, "scan"), counted(of.points, "point"))?;
            match of.outside {
                0 => writeln!(f)?,
                outside => writeln!(f, "; left out, because they are outside of the field of view: {outside}")?,
            }
        }
        writeln!(f, "  camera: none; a box has the class of its shape")?;
        match has_map {
            true => writeln!(f, "  road: place and heading from the poses")?,
            false => writeln!(f, "  road: along the path of the ego, with the lanes of {}", self.scenario)?,
        }
        write!(f, "  tracks: {tracks}, {} of them confirmed", confirmed_lives_s.len())?;
        match life_figures_s(confirmed_lives_s) {
            Some([least, median, most]) => {
                writeln!(f, ", which live {least:.2} to {most:.2} s (median {median:.2} s)")?;
            }
            None => writeln!(f)?,
        }
        let Some(truth) = truth else {
            return writeln!(f, "  truth: {NO_LABELS}; detection, errors and id switches cannot be stated");
        };
        let &TruthFigures { judged_s, nees, id_switches, false_tracks, .. } = truth;
        writeln!(
            f,
            "  truth: {judged_s:.2} s with labels, id switches {id_switches}, false tracks {false_tracks}, NEES {}",
            number(nees, 1)
        )?;
        writeln!(
            f,
            "  {:<12} {:>8} {:>15} {:>8} {:>9} {:>10} {:>8} {:>7}",
            "vehicles", "number", "first track (m)", "recall", "along (m)", "across (m)", "v (m/s)", "class"
        )?;
        for VehicleGroup { name, vehicles, recall, figures } in &truth.groups {
            let rmse = |index: usize| number(figures.errors.map(|errors| errors[index].rmse.value), 2);
            let class = number(figures.class_accuracy.map(|estimate| 100.0 * estimate.value), 0);
            writeln!(
                f,
                "  {name:<12} {vehicles:>8} {:>15.0} {:>6.0} % {:>9} {:>10} {:>8} {class:>5} %",
                figures.range_m.value,
                100.0 * recall,
                rmse(0),
                rmse(1),
                rmse(2)
            )?;
        }
        writeln!(
            f,
            "Errors are root mean squares. Vehicles count up to 150 m behind the ego. NEES is 4 for a consistent filter."
        )
    }
}
