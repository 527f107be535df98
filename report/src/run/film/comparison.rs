//! A recorded encounter and the run that re-enacts it, in the numbers that decide how close it was.
//!
//! Both are measured alike: from the start until R crosses the marking, or to E's first collision, or the end.

use std::fmt::Write as _;

use closecall_scenarios::encounter::{REAR, RecordedEncounter};
use closecall_traffic::metrics::time_headway_s;
use closecall_traffic::{Absent, Measured, Time};

use super::{Film, Frame};
use closecall_simulation::outcome::worse;
use closecall_simulation::scenario::RearDriver;

/// How close an encounter was.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// When R crosses the marking [s].
    pub crossing_s: Measured,
    /// E's time headway to F just before [s].
    pub thw_front_at_crossing_s: Measured,
    /// R's time headway to E just before [s].
    pub thw_rear_at_crossing_s: Measured,
    /// E's smallest time headway until then [s].
    pub min_thw_front_s: Measured,
    /// R's smallest time headway to E until then [s].
    pub min_thw_rear_s: Measured,
    /// E's hardest braking until then [m/s²].
    pub max_deceleration_mps2: f64,
}

/// The recorded encounter and the simulated run.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// As recorded.
    pub recorded: Course,
    /// As simulated.
    pub simulated: Course,
}

impl Comparison {
    /// Measures both films of an encounter. In the scenario E, F and R have the places that they have in the encounter.
    pub fn new(encounter: &RecordedEncounter, recorded: &Film, simulated: &Film) -> Self {
        let home = encounter.home;
        let crosses = |frame: &&Frame| simulated.road.lane_at(frame.states[REAR].d_m) != home;
        let crossing = simulated.frames.iter().find(crosses).map(|frame| frame.time);
        Self { recorded: Course::of(recorded, Some(encounter.crossing)), simulated: Course::of(simulated, crossing) }
    }

    /// The quantities by name, each as recorded and as simulated.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, [String; 2])> {
        ROWS.iter().map(|(name, unit, of)| {
            let shown = |course| match of(course) {
                Ok(value) => format!("{value:.2} {unit}"),
                Err(Absent::NeverCrossed) => "never".to_owned(),
                Err(_) => "-".to_owned(),
            };
            (*name, [shown(&self.recorded), shown(&self.simulated)])
        })
    }

    /// What is compared, what came of it, and what the two have in common, as Markdown.
    pub fn markdown(&self, encounter: &RecordedEncounter, simulated: &Film, driver: RearDriver) -> String {
        let [ego, front, rear] = encounter.protagonists().map(|track| track.track_id);
        let (arm, start_s) = (simulated.arm(), encounter.start.s());
        let mut page = format!(
            "### Recorded beside {arm}\n\n**Track {rear} (R) behind {ego} (E) behind {front} (F): both halves start alike, at \
             {start_s:.1} s of the recording; then {arm} drives E.**\n\n| | recorded | {arm} |\n|---|---|---|\n"
        );
        for (name, [recorded, simulated]) in self.rows() {
            // Writing to a string cannot fail.
            let _ = writeln!(page, "| {name} | {recorded} | {simulated} |");
        }
        let rear_driver = match driver {
            RearDriver::Driver => "R is a human driver who reacts, and pulls out at the recorded headway",
            RearDriver::Recorded => "R drives as recorded, whatever E does",
        };
        let missing = encounter.vehicles.len().saturating_sub(simulated.cast.len());
        let left_out = match missing {
            0 => String::new(),
            count => format!("; {count} of the vehicles around are not simulated"),
        };
        let _ = writeln!(
            page,
            "\nIn the run, F drives as recorded; {rear_driver}{left_out}. The thin outlines are the vehicles of the other \
             half. Recording: `{}`.\n",
            encounter.recording
        );
        page
    }
}

/// A quantity of the comparison: its name, its unit, and where it is.
type Row = (&'static str, &'static str, fn(&Course) -> Measured);

const ROWS: [Row; 6] = [
    ("R crosses the marking at", "s", |course| course.crossing_s),
    ("E's headway to F then", "s", |course| course.thw_front_at_crossing_s),
    ("R's headway to E then", "s", |course| course.thw_rear_at_crossing_s),
    ("E's hardest braking until then", "m/s²", |course| Ok(course.max_deceleration_mps2)),
    ("E's smallest headway until then", "s", |course| course.min_thw_front_s),
    ("R's smallest headway until then", "s", |course| course.min_thw_rear_s),
];

impl Course {
    fn of(film: &Film, crossing: Option<Time>) -> Self {
        let touched = film.worst_collision().map(|collision| collision.time);
        let until = [crossing, touched].into_iter().flatten().min();
        let frames = || film.frames.iter().take_while(|frame| until.is_none_or(|until| frame.time < until));
        let rear = |frame: &Frame| headway_s(film, frame, REAR);
        // Where E collided before, R has not crossed: what came later is no encounter.
        let crossing = crossing.filter(|crossing| touched.is_none_or(|touched| *crossing <= touched));
        let before = frames().last().filter(|_| crossing.is_some());
        let then = |of: &dyn Fn(&Frame) -> Measured| before.map_or(Err(Absent::NeverCrossed), of);
        let least = |of: &dyn Fn(&Frame) -> Measured, absent| {
            frames().filter_map(|frame| of(frame).ok()).min_by(f64::total_cmp).ok_or(absent)
        };
        let braking = frames().map(|frame| -frame.states[film.ego].acceleration_mps2);
        Self {
            crossing_s: crossing.map(Time::s).ok_or(Absent::NeverCrossed),
            thw_front_at_crossing_s: then(&|frame| frame.margins.thw_front_s),
            thw_rear_at_crossing_s: then(&rear),
            min_thw_front_s: least(&|frame| frame.margins.thw_front_s, Absent::NoLead),
            min_thw_rear_s: least(&rear, Absent::NoFollower),
            max_deceleration_mps2: braking.fold(0.0, worse),
        }
    }
}

/// The time headway of a vehicle to E along the road [s], whichever lanes the two are counted to.
fn headway_s(film: &Film, frame: &Frame, actor: usize) -> Measured {
    let (own, other) = (&frame.states[film.ego], &frame.states[actor]);
    let half_lengths_m = [film.ego, actor].map(|actor| 0.5 * film.cast[actor].vehicle.dimensions.length_m);
    time_headway_s(own.s_m - other.s_m - half_lengths_m.iter().sum::<f64>(), other.speed_mps)
}
