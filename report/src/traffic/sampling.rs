//! A sampled lane change, as a table and a figure. For each value of the varied parameter, they
//! show the path of the vehicle that changes lanes, and its time headways to the vehicle that it
//! overtakes (Opp₁) and to the vehicle that has overtaken it (Opp₂).
//!
//! The headway to Opp₁ counts from the start of the lane change until the centre of the vehicle
//! that changes lanes crosses the marking, as long as Opp₁ is ahead in the same lane. The headway
//! to Opp₂ counts from the start of the encounter to the end of the lane change, as soon as Opp₂ is
//! ahead in the other lane. If the vehicle that changes lanes is further ahead at an instant, both
//! headways of that instant are shorter by the same time. The smallest headway to Opp₂ can still be
//! the same: Opp₂ may be closest while it overtakes, before the lane change, and then drives away.

use std::fmt;

use closecall_campaign::runner::run_guarded;
use closecall_recorded::criticality::{Judgement, criticality};
use closecall_recorded::encounter::RecordedEncounter;
use closecall_recorded::filters::smooth;
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::{SampledEncounter, ScenarioError, opp2_of};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::{Arm, RunKey, SampleError};
use closecall_traffic::metrics::{bumper_gap_m, time_headway_s};
use closecall_traffic::{Lane, Time, Trajectory, TrajectoryPoint};
use serde::Serialize;

use super::reproduction::Reproduction;
use super::trajectory_charts::{ChartError, Legend, Line, LineChart};
use crate::charts::style::{Canvas, Drawn, file_svg};
use crate::run::film::{Film, TrafficFilmError, film_lane_change};
use closecall_simulation::trajectories::TrafficRecorder;

/// Distance below which two runs are the same (m).
const SAME_M: f64 = 0.01;

/// Size of the figure with its three charts (px).
const FIGURE_PX: (u32, u32) = (900, 1_260);

/// One run of a sampled lane change, or the recorded one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SampledRun {
    /// The varied parameter with its value; `recorded` for the recorded lane change, `step 0` for
    /// the calibrated driver.
    pub name: String,
    /// Value of the varied parameter; `None` for the recorded lane change and for step 0.
    pub value: Option<f64>,
    /// Time at which the centre crosses the marking (s); `None` if it never does.
    pub crossing_s: Option<f64>,
    /// Time headway to Opp₁ at the last instant before the crossing (s).
    pub thw_opp1_at_crossing_s: Option<f64>,
    /// Time headway to Opp₂ at that instant (s).
    pub thw_opp2_at_crossing_s: Option<f64>,
    /// Smallest time headway to Opp₁ (s).
    pub min_thw_opp1_s: Option<f64>,
    /// Smallest time headway to Opp₂ (s).
    pub min_thw_opp2_s: Option<f64>,
    /// The first collision of the vehicle that changes lanes: the other vehicle and the time (s).
    pub collision: Option<(String, f64)>,
    /// Names of the first two other vehicles that collide with each other.
    #[serde(skip)]
    pub(super) others_in_collision: Option<[String; 2]>,
    /// Positions of the vehicle that changes lanes: s and d (m).
    #[serde(skip)]
    path: Vec<(f64, f64)>,
    /// Positions of that vehicle with the time of each.
    #[serde(skip)]
    pub(super) positions: Vec<(Time, f64, f64)>,
    /// Positions of Opp₁ and of Opp₂: s and d (m).
    #[serde(skip)]
    opponents: [Vec<(f64, f64)>; 2],
    /// Time (s) and time headway (s) to Opp₁ and to Opp₂.
    #[serde(skip)]
    thw_s: [Vec<(f64, f64)>; 2],
}

/// The vehicles of one run whose headways are measured.
struct Vehicles<'a> {
    own: &'a Trajectory,
    opp1: Option<&'a Trajectory>,
    opp2: Option<&'a Trajectory>,
}

impl SampledRun {
    /// Evaluates the run of one step. `tracks` are the trajectories of its actors, in their order.
    pub fn simulated(
        name: String,
        value: Option<f64>,
        encounter: &RecordedEncounter,
        step: &SampledEncounter,
        tracks: &[Trajectory],
        outcome: &Outcome,
    ) -> Self {
        let [opp1, opp2] = [step.opp1, step.opp2].map(|index| index.map(|index| &tracks[index]));
        let vehicles = Vehicles { own: &tracks[step.lane_changer], opp1, opp2 };
        let actors = &step.file.config().actors;
        let own_id = &actors[step.lane_changer].id;
        let collision = outcome.collisions.iter().find(|collision| collision.involves(own_id));
        let collision = collision.and_then(|collision| {
            let other = collision.between.iter().find(|id| *id != own_id)?;
            Some((other.to_string(), collision.time.s()))
        });
        let of_others = outcome.collisions.iter().find(|collision| !collision.involves(own_id));
        let others_in_collision = of_others.map(|collision| collision.between.each_ref().map(ToString::to_string));
        let run = Self::measured(name, &vehicles, [encounter.home, encounter.target], step.lane_change_s);
        Self { value, collision, others_in_collision, ..run }
    }

    /// Evaluates the recorded lane change, with the vehicles of `step`.
    pub fn recorded(encounter: &RecordedEncounter, step: &SampledEncounter) -> Self {
        let track = |index: usize| &encounter.vehicles[index].trajectory;
        let vehicles = Vehicles {
            own: track(encounter.rear_index()),
            opp1: encounter.overtaken_index().map(track),
            opp2: step.recorded_opp2.map(track),
        };
        Self::measured("recorded".to_owned(), &vehicles, [encounter.home, encounter.target], step.lane_change_s)
    }

    fn measured(name: String, vehicles: &Vehicles<'_>, [home, target]: [Lane; 2], [start_s, end_s]: [f64; 2]) -> Self {
        let own = vehicles.own;
        let crossing = own.points.iter().find(|point| point.lane == target).map(|point| point.time);
        let is_before = |time_s: f64| crossing.is_none_or(|crossing| time_s < crossing.s());
        let to_opp1 = |opp1| headways(own, opp1, home, |time_s| time_s >= start_s && is_before(time_s));
        let opp1 = vehicles.opp1.map(to_opp1).unwrap_or_default();
        let opp2 = vehicles.opp2.map(|opp2| headways(own, opp2, target, |time_s| time_s <= end_s)).unwrap_or_default();
        let last_before = |series: &[(f64, f64)]| {
            let last = series.iter().rfind(|(time_s, _)| is_before(*time_s));
            last.map(|(_, thw_s)| *thw_s).filter(|_| crossing.is_some())
        };
        let smallest = |series: &[(f64, f64)]| series.iter().map(|(_, thw_s)| *thw_s).min_by(f64::total_cmp);
        Self {
            name,
            value: None,
            crossing_s: crossing.map(Time::s),
            thw_opp1_at_crossing_s: last_before(&opp1),
            thw_opp2_at_crossing_s: last_before(&opp2),
            min_thw_opp1_s: smallest(&opp1),
            min_thw_opp2_s: smallest(&opp2),
            collision: None,
            others_in_collision: None,
            path: path_of(own),
            positions: own.points.iter().map(|point| (point.time, point.s_m, point.d_m)).collect(),
            opponents: [vehicles.opp1, vehicles.opp2].map(|track| track.map(path_of).unwrap_or_default()),
            thw_s: [opp1, opp2],
        }
    }
}

impl SampledRun {
    /// Returns the largest distances along and across the road from another run at the same time
    /// (m).
    fn furthest_from(&self, other: &Self) -> (f64, f64) {
        let mut furthest = (0.0_f64, 0.0_f64);
        let mut others = self.positions.iter().peekable();
        for (time, s_m, d_m) in &other.positions {
            while others.next_if(|(own, ..)| own < time).is_some() {}
            if let Some((_, own_s_m, own_d_m)) = others.next_if(|(own, ..)| own == time) {
                furthest = (furthest.0.max((own_s_m - s_m).abs()), furthest.1.max((own_d_m - d_m).abs()));
            }
        }
        furthest
    }
}

/// Returns the time (s) and the time headway (s) of `own` to `other` at each instant that counts,
/// if `other` is entirely ahead in `lane`.
fn headways(own: &Trajectory, other: &Trajectory, lane: Lane, counts: impl Fn(f64) -> bool) -> Vec<(f64, f64)> {
    let lengths_m = [own.dimensions.length_m, other.dimensions.length_m];
    let at = |point: &TrajectoryPoint| {
        let ahead = other.at(point.time).filter(|ahead| ahead.lane == lane)?;
        let gap_m = bumper_gap_m(ahead.s_m - point.s_m, lengths_m[0], lengths_m[1]);
        let thw_s = time_headway_s(gap_m, point.speed_mps).ok().filter(|_| gap_m >= 0.0)?;
        Some((point.time.s(), thw_s))
    };
    own.points.iter().filter(|point| counts(point.time.s())).filter_map(at).collect()
}

/// Returns the positions of a vehicle: s and d (m).
fn path_of(track: &Trajectory) -> Vec<(f64, f64)> {
    track.points.iter().map(|point| (point.s_m, point.d_m)).collect()
}

/// The run of one step: what was measured, and a film of the lane change.
#[derive(Clone, Debug)]
pub struct StepRun {
    /// The measurements of the run.
    pub run: SampledRun,
    /// The film of the lane change; `None` if the vehicle never changes lanes.
    pub film: Option<Film>,
}

/// Runs one step of a sampled lane change. The sensors of the ego, which is behind all other
/// vehicles, are not simulated.
///
/// # Errors
/// [`StepError`] if the scenario cannot be run, or if no road can be drawn from its lanes.
pub fn run_step(
    encounter: &RecordedEncounter,
    name: String,
    value: Option<f64>,
    step: &SampledEncounter,
    seed: u64,
) -> Result<StepRun, StepError> {
    let scenario = step.file.concrete(&step.file.space().nominal())?;
    let arm = Arm { controller: ControllerChoice::ACC.factory(), sensors: Some(SensorMode::GroundTruth) };
    let mut recorder = TrafficRecorder::default();
    recorder.begin(&scenario);
    let outcome = run_guarded(&scenario, RunKey { seed, sample: 0 }, &arm, &mut recorder)?;
    let data = recorder.finish(&format!("{}, {name}", encounter.data_name));
    let run = SampledRun::simulated(name.clone(), value, encounter, step, &data.trajectories, &outcome);
    let smoothed = smooth(&data);
    let track_id = data.trajectories[step.lane_changer].track_id;
    let changes = criticality(&smoothed, &Judgement::default());
    let change = changes.iter().find(|change| change.lane_change.track_id == track_id);
    let film = change.map(|change| film_lane_change(&smoothed, change)).transpose()?;
    Ok(StepRun { run, film: film.map(|film| film.with_arm(name.replace(" = ", "-"))) })
}

/// The reason why a step has no run.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// The scenario is not valid.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The run has no outcome.
    #[error(transparent)]
    Run(#[from] SampleError),
    /// The lane change cannot be shown.
    #[error(transparent)]
    Film(#[from] TrafficFilmError),
}

/// A sampled lane change: the recorded one, then step 0, then one run for each value.
#[derive(Clone, Debug)]
pub struct Sampled {
    /// Name of the trajectory data, and the track that changes lanes.
    pub title: String,
    /// Track of Opp₁, if there is one.
    pub opp1: Option<u64>,
    /// Track of Opp₂, if there is one.
    pub opp2: Option<u64>,
    /// The recorded lane change, then the runs.
    pub runs: Vec<SampledRun>,
    /// How well step 0 reproduces the recording.
    pub reproduction: Reproduction,
    /// Opponents whose record ends before the lane change: the track, and the time (s).
    pub ends: Vec<(u64, f64)>,
}

impl fmt::Display for Sampled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { title, opp1, opp2, .. } = self;
        let named = |track: Option<u64>, lane: &str| {
            track.map_or_else(|| format!("no vehicle is ahead in the {lane} lane"), |track| format!("track {track}"))
        };
        writeln!(f, "{title}; Opp1: {}; Opp2: {}", named(*opp1, "old"), named(*opp2, "other"))?;
        writeln!(f, "                        crosses   smallest THW [s] to   THW [s] then to")?;
        writeln!(f, "                         at [s]      Opp1      Opp2     Opp1      Opp2")?;
        for run in &self.runs {
            let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
            write!(
                f,
                "{:<22} {:>8} {:>9} {:>9} {:>8} {:>9}",
                run.name,
                number(run.crossing_s),
                number(run.min_thw_opp1_s),
                number(run.min_thw_opp2_s),
                number(run.thw_opp1_at_crossing_s),
                number(run.thw_opp2_at_crossing_s),
            )?;
            match &run.collision {
                Some((other, time_s)) => writeln!(f, "  collides with {other} at {time_s:.2} s")?,
                None => writeln!(f)?,
            }
        }
        for remark in self.remarks() {
            writeln!(f, "{remark}")?;
        }
        Ok(())
    }
}

impl Sampled {
    /// Creates the sampled lane change of an encounter with the recorded lane change and step 0.
    /// `until_s` is the end of the lane change (s).
    pub fn new(
        encounter: &RecordedEncounter,
        recorded: SampledRun,
        step_0: SampledRun,
        reproduction: Reproduction,
        until_s: f64,
    ) -> Self {
        let track = |index: usize| &encounter.vehicles[index].trajectory;
        let title = format!("{}: lane change of track {}", encounter.data_name, encounter.rear().trajectory.track_id);
        let [opp1, opp2] = [encounter.overtaken_index(), opp2_of(encounter)].map(|index| index.map(track));
        let ends = [opp1, opp2].into_iter().flatten();
        let ends = ends.filter_map(|track| Some((track.track_id, track.span()?.1.s())));
        Self {
            title,
            opp1: opp1.map(|track| track.track_id),
            opp2: opp2.map(|track| track.track_id),
            runs: vec![recorded, step_0],
            reproduction,
            ends: ends.filter(|(_, end_s)| *end_s < until_s).collect(),
        }
    }

    /// Returns what a reader has to know of the runs: how well step 0 reproduces the recording,
    /// opponents whose record ends, runs that never cross the marking, and a parameter that changes
    /// nothing.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = vec![self.reproduction.to_string()];
        for (track_id, end_s) in &self.ends {
            remarks.push(format!(
                "track {track_id} is recorded until {end_s:.1} s, and keeps its last speed from then on"
            ));
        }
        for run in self.runs.iter().skip(1).filter(|run| run.crossing_s.is_none()) {
            remarks.push(format!("{} never crosses the marking", run.name));
        }
        for pair in self.runs.get(2..).unwrap_or_default().windows(2) {
            let (along_m, across_m) = pair[1].furthest_from(&pair[0]);
            if along_m < SAME_M && across_m < SAME_M {
                remarks.push(format!("{} changes nothing in relation to {}", pair[1].name, pair[0].name));
            }
        }
        remarks
    }

    /// Returns the runs as JSON.
    pub fn json(&self) -> serde_json::Value {
        let Self { title, opp1, opp2, runs, reproduction, .. } = self;
        serde_json::json!({
            "title": title,
            "opp1_track_id": opp1,
            "opp2_track_id": opp2,
            "reproduction": reproduction,
            "runs": runs,
            "remarks": self.remarks(),
        })
    }

    /// Draws the paths and the two headways of all runs as one figure (SVG).
    ///
    /// # Errors
    /// [`ChartError`] if the figure cannot be drawn.
    pub fn figure(&self) -> Result<String, ChartError> {
        let charts = self.charts();
        let draw = |canvas: &Canvas<'_>| -> Drawn {
            for (area, chart) in canvas.split_evenly((charts.len(), 1)).iter().zip(&charts) {
                chart.draw(area)?;
            }
            Ok(())
        };
        file_svg(FIGURE_PX, draw).map_err(|error| ChartError { title: self.title.clone(), message: error.to_string() })
    }

    fn charts(&self) -> Vec<LineChart> {
        let lines = |points: fn(&SampledRun) -> &Vec<(f64, f64)>| -> Vec<Line> {
            let line = |(colour, run): (usize, &SampledRun)| Line {
                name: run.name.clone(),
                points: points(run).clone(),
                colour,
                faint: false,
            };
            self.runs.iter().enumerate().map(line).collect()
        };
        let chart = |title: &str, [x_name, y_name]: [&str; 2], lines| LineChart {
            title: title.to_owned(),
            x_name: x_name.to_owned(),
            y_name: y_name.to_owned(),
            lines,
            level: None,
            legend: Legend::Right,
            bands: Vec::new(),
            marks: Vec::new(),
            most: None,
        };
        let time = "time [s]";
        // The opponents drive as recorded, in every run.
        let recorded = self.runs.first().into_iter().flat_map(|run| ["Opp1", "Opp2"].into_iter().zip(&run.opponents));
        let opponents = recorded.enumerate().filter(|(_, (_, path))| !path.is_empty()).map(|(index, (name, path))| {
            Line { name: name.to_owned(), points: path.clone(), colour: self.runs.len() + index, faint: true }
        });
        let paths = lines(|run| &run.path).into_iter().chain(opponents).collect();
        vec![
            chart(&self.title, ["along the road [m]", "across the road [m]"], paths),
            chart(
                "Time headway to Opp1, which is overtaken, during the lane change until the crossing",
                [time, "THW [s]"],
                lines(|run| &run.thw_s[0]),
            ),
            chart(
                "Time headway to Opp2, as soon as it is ahead in the other lane",
                [time, "THW [s]"],
                lines(|run| &run.thw_s[1]),
            ),
        ]
    }
}
