//! The clusters and boxes of a run before any is rejected: a Parquet table with one row per cluster
//! and per box of each scan.
//!
//! ```text
//!   points ─▶ DBSCAN ─▶ cluster ─▶ clusters of one vehicle merged, box fitted ─▶ box ─▶ class ─▶ tracker: corrects, starts, part, ignored
//!                          │                                                      │                            │
//!                   row of kind `cluster`                                  row of kind `box` ◀── what has become of it
//! ```
//!
//! The tracker takes a scan when its latency has elapsed, so that the fate of a box is filled in
//! later.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{ArrayRef, BooleanArray, Float64Array, RecordBatch, StringArray, UInt32Array};
use arrow::datatypes::{DataType, Field, Schema};
use closecall_sensors::lidar::PointSource;
use closecall_sensors::{BoxUse, Detection, Extent, MountedLidar, SeenBy, SensorError, SensorMode};
use closecall_simulation::{Observer, RunEvent, SettlingView, StepView};
use closecall_traffic::Time;
use closecall_traffic::atomic::{WriteError, check_writable};

use crate::tables::table::{check_parquet, field, required, write_batch};

/// A cluster or a box of a scan.
#[derive(Clone, Debug)]
struct ClusterRow {
    sensor: &'static str,
    frame: u32,
    time: Time,
    /// Number of the cluster or the box in its scan.
    number: u32,
    points: u32,
    /// Position in the ego's frame (m): the mean of a cluster's points, the centre of a box.
    at_m: [f64; 2],
    /// The object that most of the points come from, and its share of them.
    truth: Option<(String, f64)>,
    kind: RowKind,
}

/// What a row describes.
#[derive(Clone, Debug)]
enum RowKind {
    /// A cluster, with the number of the box that it has become a part of.
    Cluster(Option<u32>),
    /// A box, and what the tracker has made of it, as soon as it has.
    Box(Box<Detection>, Option<BoxUse>),
}

impl RowKind {
    fn detection(&self) -> Option<&Detection> {
        match self {
            Self::Cluster(_) => None,
            Self::Box(detection, _) => Some(detection),
        }
    }

    fn used(&self) -> Option<&BoxUse> {
        match self {
            Self::Cluster(_) => None,
            Self::Box(_, used) => used.as_ref(),
        }
    }
}

/// Observes a run and collects the clusters and boxes of its LiDARs.
#[derive(Clone, Debug, Default)]
pub struct ClusterRecorder {
    rows: Vec<ClusterRow>,
    /// Number of scans of each LiDAR, and the end of the latest.
    frames: BTreeMap<&'static str, (u32, Option<Time>)>,
    /// The first row of the boxes of a scan that the tracker has not had.
    waiting: BTreeMap<(&'static str, u64), usize>,
    /// The first error, after which nothing is collected.
    failed: Option<SensorError>,
}

impl ClusterRecorder {
    /// Appends the latest scan of a LiDAR, if it is a new one.
    fn append(&mut self, mounted: &MountedLidar<'_>, view: &StepView<'_>) -> Result<(), SensorError> {
        let (sensor, lidar) = (mounted.name, mounted.lidar);
        let (count, latest) = self.frames.entry(sensor).or_insert((0, None));
        if lidar.latest().end != view.time || *latest == Some(view.time) {
            return Ok(());
        }
        let (frame, time) = (*count, view.time);
        (*count, *latest) = (frame + 1, Some(time));
        let sign = if mounted.looks_ahead { -1.0 } else { 1.0 };
        let scan = lidar.latest();
        let truth = |points: &[u32]| truth_of(points, &|point| lidar.truth().points[point as usize].source, view);
        let of_box: BTreeMap<u32, u32> = (0..lidar.detections().len())
            .flat_map(|index| lidar.point_indices_of(index).iter().map(move |&point| (point, to_u32(index))))
            .collect();
        for (index, points) in lidar.clusters()?.iter().enumerate() {
            let mean = |values: &[f32]| {
                let sum: f64 = points.iter().map(|&point| f64::from(values[point as usize])).sum();
                sign * sum / points.len() as f64
            };
            self.rows.push(ClusterRow {
                sensor,
                frame,
                time,
                number: to_u32(index),
                points: to_u32(points.len()),
                at_m: [mean(&scan.x_m), mean(&scan.y_m)],
                truth: truth(points),
                kind: RowKind::Cluster(points.first().and_then(|point| of_box.get(point)).copied()),
            });
        }
        self.waiting.insert((sensor, mounted.scan), self.rows.len());
        for (index, detection) in mounted.detections.iter().enumerate() {
            let is_of_lidar = detection.seen_by == SeenBy::Lidar && index < lidar.detections().len();
            let (x_m, y_m) = detection.centre_m();
            self.rows.push(ClusterRow {
                sensor,
                frame,
                time,
                number: to_u32(index),
                points: to_u32(detection.points),
                at_m: [sign * x_m, sign * y_m],
                truth: if is_of_lidar { truth(lidar.point_indices_of(index)) } else { None },
                kind: RowKind::Box(Box::new(turned(detection, sign)), None),
            });
        }
        Ok(())
    }

    /// Returns the rows as one record batch.
    ///
    /// # Errors
    /// The error of a sensor model, or of Arrow.
    pub fn batch(&self) -> io::Result<RecordBatch> {
        if let Some(error) = &self.failed {
            return Err(io::Error::other(error.clone()));
        }
        let rows = &self.rows;
        let count = |of: &dyn Fn(&ClusterRow) -> Option<u32>| -> ArrayRef {
            Arc::new(rows.iter().map(of).collect::<UInt32Array>())
        };
        let number = |of: &dyn Fn(&ClusterRow) -> Option<f64>| -> ArrayRef {
            Arc::new(rows.iter().map(of).collect::<Float64Array>())
        };
        let text = |of: &dyn Fn(&ClusterRow) -> Option<&str>| -> ArrayRef {
            Arc::new(rows.iter().map(of).collect::<StringArray>())
        };
        let flag = |of: &dyn Fn(&Detection) -> bool| -> ArrayRef {
            Arc::new(rows.iter().map(|row| row.kind.detection().map(of)).collect::<BooleanArray>())
        };
        let of_box = |of: &dyn Fn(&Detection) -> f64| -> ArrayRef { number(&|row| row.kind.detection().map(of)) };
        let innovation = |axis: usize, is_variance: bool| {
            number(&|row| {
                let innovation = row.kind.used()?.innovation?[axis];
                Some(if is_variance { innovation.variance_m2 } else { innovation.innovation_m })
            })
        };
        let kind = |row: &ClusterRow| match row.kind {
            RowKind::Cluster(_) => "cluster",
            RowKind::Box(..) => "box",
        };
        let (length, area) = (Some("m"), Some("m²"));
        let optional = |name: &str, unit| field(name, DataType::Float64, unit);
        let columns: Vec<(Field, ArrayRef)> = vec![
            (required("sensor", DataType::Utf8, None), text(&|row| Some(row.sensor))),
            (required("frame", DataType::UInt32, None), count(&|row| Some(row.frame))),
            (required("time_s", DataType::Float64, Some("s")), number(&|row| Some(row.time.s()))),
            (required("kind", DataType::Utf8, None), text(&|row| Some(kind(row)))),
            (required("number", DataType::UInt32, None), count(&|row| Some(row.number))),
            (required("points", DataType::UInt32, None), count(&|row| Some(row.points))),
            (required("x_m", DataType::Float64, length), number(&|row| Some(row.at_m[0]))),
            (required("y_m", DataType::Float64, length), number(&|row| Some(row.at_m[1]))),
            (field("actor", DataType::Utf8, None), text(&|row| row.truth.as_ref().map(|(actor, _)| actor.as_str()))),
            (optional("actor_share", None), number(&|row| row.truth.as_ref().map(|(_, share)| *share))),
            (
                field("box", DataType::UInt32, None),
                count(&|row| if let RowKind::Cluster(of_box) = row.kind { of_box } else { None }),
            ),
            (
                field("seen_by", DataType::Utf8, None),
                text(&|row| row.kind.detection().map(|detection| seen_by_name(detection.seen_by))),
            ),
            (optional("measured_at_s", Some("s")), of_box(&|detection| detection.time.s())),
            (optional("face_x_m", length), of_box(&|detection| detection.face_x_m)),
            (optional("face_y_m", length), of_box(&|detection| detection.face_y_m)),
            (optional("range_sd_m", length), of_box(&|detection| detection.range_sd_m)),
            (optional("lateral_sd_m", length), of_box(&|detection| detection.lateral_sd_m)),
            (optional("heading_rad", Some("rad")), of_box(&|detection| detection.heading_rad)),
            (optional("length_m", length), of_box(&|detection| detection.length_m)),
            (field("length_is_seen", DataType::Boolean, None), flag(&|detection| detection.length == Extent::Seen)),
            (optional("width_m", length), of_box(&|detection| detection.width_m)),
            (field("width_is_seen", DataType::Boolean, None), flag(&|detection| detection.width == Extent::Seen)),
            (optional("top_m", length), of_box(&|detection| detection.top_m)),
            (optional("car", None), of_box(&|detection| detection.class.0[0])),
            (optional("truck", None), of_box(&|detection| detection.class.0[1])),
            (optional("motorcycle", None), of_box(&|detection| detection.class.0[2])),
            (optional("background", None), of_box(&|detection| detection.class.0[3])),
            (field("role", DataType::Utf8, None), text(&|row| row.kind.used().map(|used| used.role.name()))),
            (
                field("track", DataType::UInt32, None),
                count(&|row| row.kind.used().and_then(|used| Some(used.track?.0))),
            ),
            (optional("innovation_along_m", length), innovation(0, false)),
            (optional("innovation_along_variance_m2", area), innovation(0, true)),
            (optional("innovation_across_m", length), innovation(1, false)),
            (optional("innovation_across_variance_m2", area), innovation(1, true)),
        ];
        let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = columns.into_iter().unzip();
        RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).map_err(io::Error::other)
    }
}

impl Observer for ClusterRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        if self.failed.is_some() {
            return;
        }
        for lidar in view.perception.lidars() {
            if let Err(error) = self.append(&lidar, view) {
                self.failed = Some(error);
                return;
            }
        }
        let used = view.perception.used_boxes();
        for of_box in &used {
            let first = self.waiting.get(&(of_box.sensor, of_box.scan));
            let row = first.and_then(|first| self.rows.get_mut(first + of_box.used.index));
            if let Some(ClusterRow { kind: RowKind::Box(_, fate), .. }) = row {
                *fate = Some(of_box.used);
            }
        }
        for of_box in used {
            self.waiting.remove(&(of_box.sensor, of_box.scan));
        }
    }

    /// Counts the scans, as the table of scans does.
    fn settling(&mut self, view: &SettlingView<'_>) {
        for mounted in view.perception.lidars() {
            let (count, latest) = self.frames.entry(mounted.name).or_insert((0, None));
            if mounted.lidar.latest().end == view.time && *latest != Some(view.time) {
                (*count, *latest) = (*count + 1, Some(view.time));
            }
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

/// Returns the object that most of the points come from, and its share of them. Of two with the
/// same share it is the first by name.
fn truth_of(points: &[u32], source: &dyn Fn(u32) -> PointSource, view: &StepView<'_>) -> Option<(String, f64)> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for &point in points {
        let name = match source(point) {
            PointSource::Actor(index) => {
                view.scenario.actors.get(index).map_or_else(|| index.to_string(), |actor| actor.id.to_string())
            }
            other => other.name().to_owned(),
        };
        *counts.entry(name).or_default() += 1;
    }
    let (name, most) = counts.into_iter().rev().max_by_key(|(_, count)| *count)?;
    Some((name, most as f64 / points.len() as f64))
}

/// Returns a detection in the ego's frame. `sign` is −1 for a LiDAR that looks ahead.
fn turned(detection: &Detection, sign: f64) -> Detection {
    Detection { face_x_m: sign * detection.face_x_m, face_y_m: sign * detection.face_y_m, ..detection.clone() }
}

fn seen_by_name(seen_by: SeenBy) -> &'static str {
    match seen_by {
        SeenBy::Lidar => "lidar",
        SeenBy::CameraAlone => "camera",
    }
}

/// Returns an index as a column holds it. A scan has fewer points than the type has numbers.
fn to_u32(index: usize) -> u32 {
    u32::try_from(index).unwrap_or(u32::MAX)
}

/// Observes a run and writes the table of its clusters and boxes.
pub struct ClusterWriter {
    path: PathBuf,
    clusters: ClusterRecorder,
}

impl ClusterWriter {
    /// Creates a writer of the Parquet file `path`.
    ///
    /// # Errors
    /// [`WriteError`] if the sensors of this mode have no LiDAR, if the extension is another, or if
    /// no file can be created there.
    pub fn new(path: &Path, mode: SensorMode) -> Result<Self, WriteError> {
        if mode != SensorMode::Full {
            let message = "there are no clusters: only sensors of mode `full` have LiDARs";
            return Err(WriteError::new(path, io::Error::new(io::ErrorKind::InvalidInput, message)));
        }
        check_parquet(path, "clusters are a file *.parquet")?;
        check_writable(path)?;
        Ok(Self { path: path.to_owned(), clusters: ClusterRecorder::default() })
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`WriteError`] if a scan could not be clustered again, or if the file cannot be written
    /// completely.
    pub fn finish(self) -> Result<(), WriteError> {
        write_batch(&self.path, || self.clusters.batch())
    }
}

impl Observer for ClusterWriter {
    fn step(&mut self, view: &StepView<'_>) {
        self.clusters.step(view);
    }

    fn settling(&mut self, view: &SettlingView<'_>) {
        self.clusters.settling(view);
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
