//! The tracks of a run: a Parquet table with one row per control step and track, beside the vehicle
//! that each is matched with.
//!
//! The rows hold all that a test of the tracker's consistency needs: state, covariance, and the
//! errors of the nearest face. They are matched as by
//! [`TrackAudit`](closecall_sensors::TrackAudit).

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{ArrayRef, BooleanArray, Float64Array, RecordBatch, StringArray, UInt32Array};
use arrow::datatypes::{DataType, Field, Schema};
use closecall_sensors::{Scene, SceneVehicle, SensorError, TrackMatch, TrackMatcher};
use closecall_simulation::{Observer, RunEvent, StepView};
use closecall_traffic::atomic::{WriteError, check_writable};
use closecall_traffic::{ClassScores, Source, Time, Track, TrackStatus, VehicleClass};

use crate::tables::table::{check_parquet, field, required, write_batch};

/// The columns of the upper triangle of the covariance of `[x, y, vx, vy]`, with row, column and
/// unit.
const COVARIANCE: [(&str, [usize; 2], &str); 10] = [
    ("cov_x_x", [0, 0], "m²"),
    ("cov_x_y", [0, 1], "m²"),
    ("cov_x_vx", [0, 2], "m²/s"),
    ("cov_x_vy", [0, 3], "m²/s"),
    ("cov_y_y", [1, 1], "m²"),
    ("cov_y_vx", [1, 2], "m²/s"),
    ("cov_y_vy", [1, 3], "m²/s"),
    ("cov_vx_vx", [2, 2], "m²/s²"),
    ("cov_vx_vy", [2, 3], "m²/s²"),
    ("cov_vy_vy", [3, 3], "m²/s²"),
];

/// The columns of the errors, with their units.
const ERRORS: [(&str, &str); 4] =
    [("error_x_m", "m"), ("error_y_m", "m"), ("error_vx_mps", "m/s"), ("error_vy_mps", "m/s")];

/// A track at one control step.
#[derive(Clone, Debug)]
struct TrackRow {
    time: Time,
    track: Track,
    /// The vehicle that it is matched with, by name.
    truth: Option<(String, TrackMatch)>,
}

/// Observes a run and collects its tracks.
#[derive(Clone, Debug, Default)]
pub struct TrackRecorder {
    rows: Vec<TrackRow>,
    matcher: TrackMatcher,
    others: Vec<SceneVehicle>,
    /// The first error, after which nothing is collected.
    failed: Option<SensorError>,
}

impl TrackRecorder {
    /// Appends the tracks of one step of a recording. `truth` has the vehicles that its labels
    /// show, if there are any, with the name of each.
    pub fn record(&mut self, time: Time, tracks: &[Track], truth: Option<(&Scene<'_>, &dyn Fn(usize) -> String)>) {
        match truth {
            None => self.append((time, tracks), Ok(vec![None; tracks.len()]), &|actor| actor.to_string()),
            Some((scene, name)) => {
                let matched = self.matcher.observe(tracks, scene);
                self.append((time, tracks), matched, name);
            }
        }
    }

    /// Appends the tracks of one step with their matches. `name` names a vehicle.
    fn append(
        &mut self,
        (time, tracks): (Time, &[Track]),
        matched: Result<Vec<Option<TrackMatch>>, SensorError>,
        name: &dyn Fn(usize) -> String,
    ) {
        match matched {
            Ok(matches) => self.rows.extend(tracks.iter().zip(matches).map(|(track, matched)| TrackRow {
                time,
                track: track.clone(),
                truth: matched.map(|matched| (name(matched.actor), matched)),
            })),
            Err(error) => self.failed = Some(error),
        }
    }

    /// Writes the rows as the Parquet file `path`.
    ///
    /// # Errors
    /// [`WriteError`] as [`TrackWriter::new`] and [`TrackWriter::finish`] return it.
    pub fn write(self, path: &Path) -> Result<(), WriteError> {
        write_batch(path, || self.batch())
    }

    /// Returns the rows as one record batch.
    ///
    /// # Errors
    /// The error of the matching if the truth of a step was not finite, or an error of Arrow.
    pub fn batch(&self) -> io::Result<RecordBatch> {
        if let Some(error) = &self.failed {
            return Err(io::Error::other(error.clone()));
        }
        let rows = &self.rows;
        let mut columns: Vec<(Field, ArrayRef)> = Vec::new();
        let mut number = |name: &str, unit: Option<&str>, of: &dyn Fn(&Track) -> f64| {
            let values: Float64Array = rows.iter().map(|row| Some(of(&row.track))).collect();
            columns.push((required(name, DataType::Float64, unit), Arc::new(values)));
        };
        number("x_m", Some("m"), &Track::x_m);
        number("y_m", Some("m"), &Track::y_m);
        number("vx_mps", Some("m/s"), &Track::vx_mps);
        number("vy_mps", Some("m/s"), &Track::vy_mps);
        for (name, [row, column], unit) in COVARIANCE {
            number(name, Some(unit), &|track| track.covariance[(row, column)]);
        }
        number("heading_rad", Some("rad"), &|track| track.heading_rad);
        number("length_m", Some("m"), &|track| track.length_m);
        number("width_m", Some("m"), &|track| track.width_m);
        for class in VehicleClass::ALL {
            number(class.name(), None, &|track| track.class.0[class as usize]);
        }
        number("background", None, &|track| track.class.0[ClassScores::BACKGROUND]);
        number("class_score", None, &|track| track.class.0[track.class.best_vehicle_class() as usize]);
        number("existence", None, &|track| track.existence);
        for (index, name) in ["lane_left", "lane_own", "lane_right"].into_iter().enumerate() {
            number(name, None, &|track| track.lane[index]);
        }
        let text = |of: &dyn Fn(&Track) -> &'static str| -> ArrayRef {
            Arc::new(rows.iter().map(|row| Some(of(&row.track))).collect::<StringArray>())
        };
        let mut all: Vec<(Field, ArrayRef)> = vec![
            (
                required("time_s", DataType::Float64, Some("s")),
                Arc::new(rows.iter().map(|row| Some(row.time.s())).collect::<Float64Array>()),
            ),
            (
                required("track", DataType::UInt32, None),
                Arc::new(rows.iter().map(|row| Some(row.track.id.0)).collect::<UInt32Array>()),
            ),
            (required("source", DataType::Utf8, None), text(&|track| source_name(track.source))),
            (required("status", DataType::Utf8, None), text(&|track| status_name(track.status))),
            (
                required("confirmed", DataType::Boolean, None),
                Arc::new(
                    rows.iter().map(|row| Some(row.track.status != TrackStatus::Tentative)).collect::<BooleanArray>(),
                ),
            ),
            (required("class", DataType::Utf8, None), text(&|track| track.class.best_vehicle_class().name())),
        ];
        all.append(&mut columns);
        let truth = |of: &dyn Fn(&TrackMatch) -> f64| -> ArrayRef {
            let values = rows.iter().map(|row| row.truth.as_ref().map(|(_, matched)| of(matched)));
            Arc::new(values.collect::<Float64Array>())
        };
        let actors: StringArray = rows.iter().map(|row| row.truth.as_ref().map(|(actor, _)| &**actor)).collect();
        all.push((field("actor", DataType::Utf8, None), Arc::new(actors)));
        all.push((field("distance_m", DataType::Float64, Some("m")), truth(&|matched| matched.distance_m)));
        for (index, (name, unit)) in ERRORS.into_iter().enumerate() {
            all.push((field(name, DataType::Float64, Some(unit)), truth(&|matched| matched.error[index])));
        }
        let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = all.into_iter().unzip();
        RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).map_err(io::Error::other)
    }
}

impl Observer for TrackRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        if self.failed.is_some() {
            return;
        }
        let ego = view.scenario.ego;
        self.others.clear();
        self.others
            .extend(view.vehicles.iter().enumerate().filter(|(actor, _)| *actor != ego).map(|(_, other)| *other));
        let scene = Scene {
            time: view.time,
            road: &view.scenario.road,
            environment: &view.scenario.environment,
            ego: view.vehicles[ego],
            others: &self.others,
        };
        let matched = self.matcher.observe(view.tracks, &scene);
        self.append((view.time, view.tracks), matched, &|actor| view.scenario.actors[actor].id.to_string());
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

fn source_name(source: Source) -> &'static str {
    match source {
        Source::Front => "front",
        Source::Surround => "surround",
        Source::Rear => "rear",
    }
}

fn status_name(status: TrackStatus) -> &'static str {
    match status {
        TrackStatus::Tentative => "tentative",
        TrackStatus::Confirmed => "confirmed",
        TrackStatus::Coasting => "coasting",
    }
}

/// Observes a run and writes the table of its tracks.
pub struct TrackWriter {
    path: PathBuf,
    tracks: TrackRecorder,
}

impl TrackWriter {
    /// Creates a writer of the Parquet file `path`.
    ///
    /// # Errors
    /// [`WriteError`] if the extension is another, or if no file can be created there.
    pub fn new(path: &Path) -> Result<Self, WriteError> {
        check_parquet(path, "tracks are a file *.parquet")?;
        check_writable(path)?;
        Ok(Self { path: path.to_owned(), tracks: TrackRecorder::default() })
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`WriteError`] if the truth of a step was not finite, or if the file cannot be written
    /// completely.
    pub fn finish(self) -> Result<(), WriteError> {
        write_batch(&self.path, || self.tracks.batch())
    }
}

impl Observer for TrackWriter {
    fn step(&mut self, view: &StepView<'_>) {
        self.tracks.step(view);
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
