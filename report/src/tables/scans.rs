//! The points of the LiDARs of a run: a Parquet table with one row per return, or a folder of point
//! clouds (`crate::tables::pcd`).
//!
//! | column | meaning |
//! |---|---|
//! | `sensor` | name of the LiDAR: `rear-lidar` and `front-lidar`, unless the scenario gives them others |
//! | `frame`, `time_s` | number of the sensor's scan, and the time at which it ends (s) |
//! | `mirror_side` | `plus` or `minus` if the sensor has a mirror with two sides |
//! | `beam`, `column`, `layer` | beam = column · layers + layer; column 0 is the first that is swept, layer 0 the lowest |
//! | `azimuth_rad`, `elevation_rad` | direction of the beam's centre in the sensor's frame (rad): x along its axis, y to the left of that |
//! | `range_m` | measured range (m) |
//! | `sensor_x_m` | place of the sensor ahead of the ego's centre, by the measured pitch (m) |
//! | `x_m`, `y_m`, `z_m` | the point in the ego's vehicle frame at the end of the scan (m), with the ego's motion and measured pitch compensated |
//! | `intensity` | received power times range², scaled to the reflectivity of a target that fills the beam; the losses of the window are in it |
//! | `echo_pulse_width_ns` | time for which the echo exceeds the detection threshold (ns) |
//! | `offset_ns` | time of measurement after the start of the sweep (ns) |
//! | `cluster` | number of the box that the point belongs to; null for ground, rails and noise |
//! | `source`, `true_range_m` | the truth: the name of the actor, or `ground`, `guard-rail`, `spray`, `fog`, `false`; and the range without noise (m) |
//!
//! The scans are complete: they have the returns of the bare road, which a simulation leaves out
//! because the detector discards them. They begin with the second before the start in which the
//! sensors settle. With the poses and the labels beside them (`crate::tables::companions`), they
//! are a recording from which the processing chain gives the same tracks again.

use std::fs::File;
use std::io::{self, Seek};
use std::path::{Path, PathBuf};

use closecall_scenarios::Scenario;
use closecall_sensors::{MountedLidar, Perception, SensorMode};
use closecall_simulation::{Observer, RunEvent, SettlingView, StepView};
use closecall_traffic::Time;
use closecall_traffic::atomic::{WriteError, check_writable, write_file};
use parquet::arrow::ArrowWriter;

use crate::tables::companions::Companions;
use crate::tables::pcd::PcdFolder;
use crate::tables::scan_columns::ScanColumns;
use crate::tables::table::properties;

/// Number of rows that are collected before they are written.
const ROWS_IN_MEMORY: usize = 65_536;

/// Observes a run and writes the returns of its LiDARs.
pub struct ScanWriter {
    path: PathBuf,
    sink: Sink,
    /// Number of scans of each LiDAR, and the end of the latest.
    frames: Vec<(u32, Option<Time>)>,
    companions: Companions,
    /// The first error, after which nothing is written.
    failed: Option<io::Error>,
}

/// The destination of the scans.
enum Sink {
    /// A table, with the rows that are not written yet.
    Table(Box<ArrowWriter<File>>, Box<ScanColumns>),
    /// A folder of point clouds.
    Folder(PcdFolder),
}

impl ScanWriter {
    /// Creates a writer of the Parquet file or of the folder `path`, which ends in `.parquet` or
    /// `.pcd`.
    ///
    /// # Errors
    /// [`WriteError`] if the sensors of this mode have no LiDAR, if the extension is another, or if
    /// no file can be created there.
    pub fn new(path: &Path, mode: SensorMode) -> Result<Self, WriteError> {
        let fail = |error| WriteError::new(path, error);
        if mode != SensorMode::Full {
            let message = "the run has no LiDAR, which only sensors of mode `full` have";
            return Err(fail(io::Error::new(io::ErrorKind::InvalidInput, message)));
        }
        let sink = match path.extension().and_then(|extension| extension.to_str()) {
            Some("parquet") => {
                check_writable(path)?;
                let file = tempfile::tempfile().map_err(fail)?;
                let writer = ArrowWriter::try_new(file, ScanColumns::schema(), Some(properties()));
                let writer = writer.map_err(|error| fail(io::Error::other(error)))?;
                Sink::Table(Box::new(writer), Box::default())
            }
            Some("pcd") => Sink::Folder(PcdFolder::new(path).map_err(fail)?),
            _ => {
                let message = "scans are a file *.parquet or a folder *.pcd";
                return Err(fail(io::Error::new(io::ErrorKind::InvalidInput, message)));
            }
        };
        Ok(Self { path: path.to_owned(), sink, frames: Vec::new(), companions: Companions::default(), failed: None })
    }

    /// Completes the file or the folder.
    ///
    /// # Errors
    /// [`WriteError`] if a scan could not be completed, or if the file cannot be written
    /// completely. An existing file then stays as it is.
    pub fn finish(mut self) -> Result<(), WriteError> {
        let path = self.path.clone();
        let fail = |error| WriteError::new(&path, error);
        self.flush();
        if let Some(error) = self.failed {
            return Err(fail(error));
        }
        match self.sink {
            Sink::Table(writer, _) => {
                let mut file = writer.into_inner().map_err(|error| fail(io::Error::other(error)))?;
                file.rewind().map_err(fail)?;
                write_file(&path, |to| io::copy(&mut file, to).map(drop))?;
                self.companions.write_beside(&path)
            }
            Sink::Folder(folder) => {
                self.companions.write_in(folder.path())?;
                folder.finish(&path).map_err(fail)
            }
        }
    }

    /// Writes the collected rows.
    fn flush(&mut self) {
        if let (None, Sink::Table(writer, rows)) = (&self.failed, &mut self.sink) {
            let batch = rows.take_batch();
            let written = batch.and_then(|batch| writer.write(&batch).map_err(io::Error::other));
            self.failed = written.err();
        }
    }

    /// Appends the latest scans of all LiDARs, as far as they are new.
    fn observe(&mut self, perception: &dyn Perception, at: (Time, &Scenario)) {
        for (index, lidar) in perception.lidars().iter().enumerate() {
            self.append((index, lidar), at);
        }
        if matches!(&self.sink, Sink::Table(_, rows) if rows.len() >= ROWS_IN_MEMORY) {
            self.flush();
        }
    }

    /// Appends the latest scan of a LiDAR, if it is a new one.
    fn append(&mut self, (index, mounted): (usize, &MountedLidar<'_>), (time, scenario): (Time, &Scenario)) {
        let lidar = mounted.lidar;
        if self.frames.len() <= index {
            self.frames.resize(index + 1, (0, None));
        }
        let (count, latest) = &mut self.frames[index];
        if lidar.latest().end != time || *latest == Some(time) {
            return;
        }
        let frame = *count;
        (*count, *latest) = (frame + 1, Some(time));
        let complete = match lidar.completed() {
            Ok(complete) => complete,
            Err(error) => {
                self.failed.get_or_insert(io::Error::other(error));
                return;
            }
        };
        let actors = &scenario.actors;
        let name = |index: usize| actors.get(index).map_or_else(|| index.to_string(), |actor| actor.id.to_string());
        match &mut self.sink {
            Sink::Table(_, rows) => rows.append((mounted, frame), &complete, &name),
            Sink::Folder(folder) if self.failed.is_none() => {
                self.failed = folder.write(mounted, frame, &complete).err();
                self.companions.list(mounted, frame, &complete);
            }
            Sink::Folder(_) => {}
        }
    }
}

impl Observer for ScanWriter {
    fn step(&mut self, view: &StepView<'_>) {
        self.observe(view.perception, (view.time, view.scenario));
        self.companions.step(view);
    }

    fn settling(&mut self, view: &SettlingView<'_>) {
        self.observe(view.perception, (view.time, view.scenario));
        self.companions.pose(view.time, view.scenario, &view.ego.state);
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
