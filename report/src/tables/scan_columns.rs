//! The columns of the table of LiDAR returns.

use std::io;
use std::sync::Arc;

use arrow::array::{
    ArrayRef, Float32Array, Float64Array, Int32Array, RecordBatch, StringArray, UInt16Array, UInt32Array,
};
use arrow::datatypes::{DataType, Field, Schema};
use closecall_sensors::MountedLidar;
use closecall_sensors::lidar::{MirrorSide, PointSource, RearLidar};

use crate::tables::table::{field, required};

/// Returns the factor of x and y in the ego's frame. The points of a LiDAR that looks ahead lie in
/// the frame of an ego that is turned by half a turn.
pub(crate) const fn sign(lidar: &MountedLidar<'_>) -> f32 {
    if lidar.looks_ahead { -1.0 } else { 1.0 }
}

/// The returns of some scans, column by column.
#[derive(Default)]
pub(crate) struct ScanColumns {
    sensor: Vec<&'static str>,
    frame: Vec<u32>,
    time_s: Vec<f64>,
    mirror_side: Vec<Option<&'static str>>,
    beam: Vec<u16>,
    column: Vec<u16>,
    layer: Vec<u16>,
    angles_rad: [Vec<f32>; 2],
    range_m: Vec<f32>,
    sensor_x_m: Vec<f32>,
    at_m: [Vec<f32>; 3],
    intensity: Vec<f32>,
    echo_pulse_width_ns: Vec<f32>,
    offset_ns: Vec<u32>,
    cluster: Vec<Option<i32>>,
    source: Vec<String>,
    true_range_m: Vec<f32>,
}

impl ScanColumns {
    /// Returns the number of rows.
    pub(crate) fn len(&self) -> usize {
        self.frame.len()
    }

    /// Appends the latest scan of a LiDAR, which must be complete, as its scan number `frame`.
    /// `actor` names an actor.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "angles in single precision, as the pattern; fewer clusters than points"
    )]
    pub(crate) fn append(
        &mut self,
        (mounted, frame): (&MountedLidar<'_>, u32),
        lidar: &RearLidar,
        actor: &dyn Fn(usize) -> String,
    ) {
        let (scan, truth) = (lidar.latest(), lidar.truth());
        let mut clusters = vec![None; scan.len()];
        for cluster in 0..lidar.detections().len() {
            for &point in lidar.point_indices_of(cluster) {
                clusters[point as usize] = Some(cluster as i32);
            }
        }
        let side = lidar.has_mirror_sides().then_some(match scan.mirror_side {
            MirrorSide::Plus => "plus",
            MirrorSide::Minus => "minus",
        });
        for point in 0..scan.len() {
            let beam = lidar.point_beam(point);
            self.sensor.push(mounted.name);
            self.frame.push(frame);
            self.time_s.push(scan.end.s());
            self.mirror_side.push(side);
            self.beam.push(scan.beam[point]);
            self.column.push(beam.column);
            self.layer.push(beam.layer);
            self.angles_rad[0].push(beam.azimuth_rad as f32);
            self.angles_rad[1].push(beam.elevation_rad as f32);
            self.range_m.push(beam.range_m);
            self.sensor_x_m.push(sign(mounted) * scan.sensor_x_m);
            self.at_m[0].push(sign(mounted) * scan.x_m[point]);
            self.at_m[1].push(sign(mounted) * scan.y_m[point]);
            self.at_m[2].push(scan.z_m[point]);
            self.intensity.push(scan.echoes.intensity[point]);
            self.echo_pulse_width_ns.push(scan.echoes.pulse_width_ns[point]);
            self.offset_ns.push(scan.offset_ns[point]);
            self.source.push(match truth.points[point].source {
                PointSource::Actor(index) => actor(index),
                other => other.name().to_owned(),
            });
            self.true_range_m.push(truth.points[point].range_m);
        }
        self.cluster.extend(clusters);
    }

    /// Returns the schema of the table.
    pub(crate) fn schema() -> Arc<Schema> {
        let single = |name: &str, unit| required(name, DataType::Float32, Some(unit));
        let columns: Vec<Field> = vec![
            required("sensor", DataType::Utf8, None),
            required("frame", DataType::UInt32, None),
            required("time_s", DataType::Float64, Some("s")),
            field("mirror_side", DataType::Utf8, None),
            required("beam", DataType::UInt16, None),
            required("column", DataType::UInt16, None),
            required("layer", DataType::UInt16, None),
            single("azimuth_rad", "rad"),
            single("elevation_rad", "rad"),
            single("range_m", "m"),
            single("sensor_x_m", "m"),
            single("x_m", "m"),
            single("y_m", "m"),
            single("z_m", "m"),
            required("intensity", DataType::Float32, None),
            single("echo_pulse_width_ns", "ns"),
            required("offset_ns", DataType::UInt32, Some("ns")),
            field("cluster", DataType::Int32, None),
            required("source", DataType::Utf8, None),
            single("true_range_m", "m"),
        ];
        Arc::new(Schema::new(columns))
    }

    /// Returns the rows, and keeps none.
    pub(crate) fn take_batch(&mut self) -> io::Result<RecordBatch> {
        let rows = std::mem::take(self);
        let single = |values: Vec<f32>| -> ArrayRef { Arc::new(Float32Array::from(values)) };
        let [azimuth_rad, elevation_rad] = rows.angles_rad.map(single);
        let [x_m, y_m, z_m] = rows.at_m.map(single);
        let whole = |values: Vec<u16>| -> ArrayRef { Arc::new(UInt16Array::from(values)) };
        let columns: Vec<ArrayRef> = vec![
            Arc::new(StringArray::from(rows.sensor)),
            Arc::new(UInt32Array::from(rows.frame)),
            Arc::new(Float64Array::from(rows.time_s)),
            Arc::new(StringArray::from(rows.mirror_side)),
            whole(rows.beam),
            whole(rows.column),
            whole(rows.layer),
            azimuth_rad,
            elevation_rad,
            single(rows.range_m),
            single(rows.sensor_x_m),
            x_m,
            y_m,
            z_m,
            single(rows.intensity),
            single(rows.echo_pulse_width_ns),
            Arc::new(UInt32Array::from(rows.offset_ns)),
            Arc::new(Int32Array::from(rows.cluster)),
            Arc::new(StringArray::from(rows.source)),
            single(rows.true_range_m),
        ];
        RecordBatch::try_new(Self::schema(), columns).map_err(io::Error::other)
    }
}
