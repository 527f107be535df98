//! Compares a recorded encounter with the run that re-enacts it, by metrics of closeness.
//!
//! Both are evaluated over the same part of the encounter: from the start until the rear vehicle
//! crosses the lane marking. A collision of the ego or the end of the run ends the evaluation
//! earlier.

use std::fmt::Write as _;

use closecall_recorded::encounter::{REAR_INDEX, RecordedEncounter};
use closecall_traffic::metrics::time_headway_s;
use closecall_traffic::{Absent, Measured, Time};

use super::{Film, Frame, headway_text};
use closecall_scenarios::RearDriver;
use closecall_scenarios::outcome::worse;

/// Metrics of one encounter that say how close it was.
#[derive(Clone, Copy, Debug)]
pub struct EncounterMetrics {
    /// Time at which the rear vehicle crosses the lane marking (s).
    pub crossing_s: Measured,
    /// Time headway of the ego to the lead vehicle at the last frame before the crossing (s).
    pub thw_front_at_crossing_s: Measured,
    /// Time headway of the rear vehicle to the ego at the last frame before the crossing (s).
    pub thw_rear_at_crossing_s: Measured,
    /// Smallest time headway of the ego before the crossing (s).
    pub min_thw_front_s: Measured,
    /// Smallest time headway of the rear vehicle to the ego before the crossing (s).
    pub min_thw_rear_s: Measured,
    /// Largest deceleration of the ego before the crossing (m/s²).
    pub max_deceleration_mps2: f64,
}

/// Metrics of a recorded encounter and of the simulated run that re-enacts it.
#[derive(Clone, Copy, Debug)]
pub struct EncounterComparison {
    /// Metrics of the recorded encounter.
    pub recorded: EncounterMetrics,
    /// Metrics of the simulated run.
    pub simulated: EncounterMetrics,
}

impl EncounterComparison {
    /// Evaluates both films of an encounter. The ego, the lead and the rear vehicle must have the
    /// same indices in the simulated film as in the encounter.
    pub fn new(encounter: &RecordedEncounter, recorded: &Film, simulated: &Film) -> Self {
        let from_lane = encounter.home;
        let crosses = |frame: &&Frame| simulated.road.lane_of(&frame.states[REAR_INDEX]) != from_lane;
        let crossing = simulated.frames.iter().find(crosses).map(|frame| frame.time);
        Self {
            recorded: EncounterMetrics::measure(recorded, Some(encounter.crossing)),
            simulated: EncounterMetrics::measure(simulated, crossing),
        }
    }

    /// Returns the name of each metric with its text for the recorded encounter and for the
    /// simulated run.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, [String; 2])> {
        ROWS.iter().map(|Row { name, unit, metric }| {
            let text = |metrics| match metric(metrics) {
                Ok(value) => format!("{value:.2} {unit}"),
                Err(Absent::NeverCrossed) => "never".to_owned(),
                Err(_) => "-".to_owned(),
            };
            (*name, [text(&self.recorded), text(&self.simulated)])
        })
    }

    /// Says that the rear vehicle never crosses the marking in the simulation, if so. The metrics
    /// at the crossing are then missing, and the other metrics cover the whole run.
    pub fn never_crosses(&self) -> Option<String> {
        (self.simulated.crossing_s == Err(Absent::NeverCrossed)).then(|| {
            "the rear vehicle never crosses the marking: from the recorded crossing on, the encounter is not comparable \
             with the recorded one"
                .to_owned()
        })
    }

    /// Returns the comparison as Markdown: the vehicles, the metrics of each side, and how the run
    /// deviates from the recorded encounter.
    pub fn markdown(&self, encounter: &RecordedEncounter, simulated: &Film, driver: RearDriver) -> String {
        let [ego, front, rear] = encounter.ego_lead_rear().map(|track| track.track_id);
        let (arm, start_s) = (simulated.arm_label(), encounter.start.s());
        let mut page = format!("**Recorded, and {arm}**\n\n");
        let result = simulated.result().map_or(String::new(), |result| format!("{result}; "));
        for (side, name, result) in [(&self.recorded, "recorded", ""), (&self.simulated, arm, &result)] {
            // Writing to a string cannot fail.
            let _ = writeln!(page, "- **{name}:** {result}{}", side.sentence());
        }
        let rear_driver = match driver {
            RearDriver::Model => "R drives like a human",
            RearDriver::Recorded => "R drives as recorded, whatever E does",
        };
        if let Some(warning) = self.never_crosses() {
            let _ = writeln!(page, "- **{arm}:** {warning}");
        }
        page.extend(simulated.system_line());
        let missing_count = encounter.vehicles.len().saturating_sub(simulated.actors.len());
        let missing_text = match missing_count {
            0 => String::new(),
            count => format!("; {count} of the vehicles around are not simulated"),
        };
        let _ = writeln!(
            page,
            "- Track {rear} (R) behind {ego} (E) behind {front} (F), alike at {start_s:.1} s; {rear_driver}{missing_text}; data: `{}`\n",
            encounter.data_name
        );
        page
    }
}

/// A metric of the comparison.
struct Row {
    name: &'static str,
    unit: &'static str,
    metric: fn(&EncounterMetrics) -> Measured,
}

const ROWS: [Row; 6] = [
    Row { name: "R crosses the marking at", unit: "s", metric: |metrics| metrics.crossing_s },
    Row { name: "E's headway to F then", unit: "s", metric: |metrics| metrics.thw_front_at_crossing_s },
    Row { name: "R's headway to E then", unit: "s", metric: |metrics| metrics.thw_rear_at_crossing_s },
    Row { name: "E's hardest braking until then", unit: "m/s²", metric: |metrics| Ok(metrics.max_deceleration_mps2) },
    Row { name: "E's smallest headway until then", unit: "s", metric: |metrics| metrics.min_thw_front_s },
    Row { name: "R's smallest headway until then", unit: "s", metric: |metrics| metrics.min_thw_rear_s },
];

impl EncounterMetrics {
    /// Returns the headways at the crossing, as one line.
    fn sentence(&self) -> String {
        let text = |value: Measured| value.map_or("-".to_owned(), headway_text);
        match self.crossing_s {
            Ok(crossing_s) => {
                let [front, rear] = [self.thw_front_at_crossing_s, self.thw_rear_at_crossing_s].map(text);
                format!("front {front}, rear {rear} as R crosses at {crossing_s:.2} s")
            }
            Err(_) => "R never crosses the marking".to_owned(),
        }
    }

    /// Evaluates a film up to `crossing`, the time at which the rear vehicle crosses the marking,
    /// if it does.
    fn measure(film: &Film, crossing: Option<Time>) -> Self {
        let collided_at = film.worst_collision().map(|collision| collision.time);
        let until = [crossing, collided_at].into_iter().flatten().min();
        let frames = || film.frames.iter().take_while(|frame| until.is_none_or(|until| frame.time < until));
        let rear = |frame: &Frame| headway_s(film, frame, REAR_INDEX);
        // A crossing after the collision is not part of the encounter and does not count.
        let crossing = crossing.filter(|crossing| collided_at.is_none_or(|collided_at| *crossing <= collided_at));
        let before = frames().last().filter(|_| crossing.is_some());
        let at_crossing = |value: &dyn Fn(&Frame) -> Measured| before.map_or(Err(Absent::NeverCrossed), value);
        let smallest = |value: &dyn Fn(&Frame) -> Measured, absent| {
            frames().filter_map(|frame| value(frame).ok()).min_by(f64::total_cmp).ok_or(absent)
        };
        let decelerations = frames().map(|frame| -frame.states[film.ego].acceleration_mps2);
        Self {
            crossing_s: crossing.map(Time::s).ok_or(Absent::NeverCrossed),
            thw_front_at_crossing_s: at_crossing(&|frame| frame.margins.thw_front_s),
            thw_rear_at_crossing_s: at_crossing(&rear),
            min_thw_front_s: smallest(&|frame| frame.margins.thw_front_s, Absent::NoLead),
            min_thw_rear_s: smallest(&rear, Absent::NoFollower),
            max_deceleration_mps2: decelerations.fold(0.0, worse),
        }
    }
}

/// Returns the time headway of a vehicle to the ego along the road (s), whichever lanes the two are
/// in.
fn headway_s(film: &Film, frame: &Frame, actor: usize) -> Measured {
    let (ego, other) = (&frame.states[film.ego], &frame.states[actor]);
    let half_lengths_m = [film.ego, actor].map(|actor| 0.5 * film.actors[actor].vehicle.dimensions.length_m);
    time_headway_s(ego.s_m - other.s_m - half_lengths_m.iter().sum::<f64>(), other.speed_mps)
}
