//! The points of the LiDARs, in layers that the user can switch, and the boxes fitted to the
//! clusters. The layers of the rear LiDAR are below `lidar`, the layers of the other LiDARs below
//! `lidars/NAME`.
//!
//! | layer | points | colour |
//! |---|---|---|
//! | `clusters` | points that belong to a box | by box |
//! | `rejected` | points that belong to no box: ground, guard rails, spray, noise | by intensity |
//! | `intensity` | the points of `clusters` again | by intensity; together with `rejected`, the raw scan |
//!
//! The points of `clusters` and `rejected` equal the sensor's points to the bit. Each has its beam
//! (`beam`: column · layers + layer), the time after the start of the sweep at which it was
//! measured (`offset_ns`), and its intensity as a reflectivity (`intensity`).

use std::sync::Arc;

use arrow::array::{ArrayRef, Float32Array, UInt16Array, UInt32Array};

use closecall_sensors::Detection;
use closecall_traffic::Time;
use rerun::{
    Boxes3D, ComponentDescriptor, ComponentIdentifier, FillMode, Points3D, SerializationResult,
    SerializedComponentBatch, SerializedComponentColumn,
};

use super::RecordingError;
use super::palette::{self, Rgba};
use super::stream::Writer;
use super::vehicles::yaw_rotation;
use crate::run::film::{Film, Frame, NO_CLUSTER, Scan};

/// Number of scans that are encoded at a time.
const SCANS_PER_PIECE: usize = 8;
/// Radius of the ball that shows a point (m).
const POINT_RADIUS_M: f32 = 0.05;

/// Writes the layers of each LiDAR, and returns the entities that the scene hides until the user
/// switches them on.
pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<Vec<String>, RecordingError> {
    let main = film.frames.iter().filter_map(|frame| Some((frame.time, frame.scan.as_ref()?))).collect();
    let mut hidden = write_lidar(writer, "world/ego/lidar", main)?;
    let mut names: Vec<&str> =
        film.frames.iter().flat_map(|frame| frame.other_scans.iter().map(|(name, _)| *name)).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let of_name = |frame: &'_ Frame| frame.other_scans.iter().position(|(other, _)| *other == name);
        let kept = film.frames.iter().filter_map(|frame| Some((frame.time, &frame.other_scans[of_name(frame)?].1)));
        hidden.extend(write_lidar(writer, &format!("world/ego/lidars/{name}"), kept.collect())?);
    }
    Ok(hidden)
}

/// Writes the layers of a LiDAR below `root`, and returns those that are hidden at first.
fn write_lidar(writer: &Writer<'_>, root: &str, kept: Vec<(Time, &Scan)>) -> Result<Vec<String>, RecordingError> {
    if kept.is_empty() {
        return Ok(Vec::new());
    }
    let (times, scans): (Vec<Time>, Vec<&Scan>) = kept.into_iter().unzip();
    let is_clustered = |scan: &Scan, point: usize| scan.clusters[point] != NO_CLUSTER;
    let shade = |scan: &Scan, point: usize| palette::intensity(scan.shade(point));
    let path = |layer: &str| format!("{root}/{layer}");
    let of_cluster =
        |scan: &Scan, point: usize| is_clustered(scan, point).then(|| palette::cluster(scan.clusters[point]));
    write_layer(writer, &path("clusters"), &times, &scans, of_cluster, true)?;
    let by_intensity = |scan: &Scan, point: usize| is_clustered(scan, point).then(|| shade(scan, point));
    write_layer(writer, &path("intensity"), &times, &scans, by_intensity, false)?;
    let rejected = |scan: &Scan, point: usize| (!is_clustered(scan, point)).then(|| shade(scan, point));
    write_layer(writer, &path("rejected"), &times, &scans, rejected, true)?;
    write_boxes(writer, &format!("{root}/boxes"), &times, &scans)?;
    Ok(["intensity", "rejected", "boxes"].map(|layer| format!("{root}/{layer}")).to_vec())
}

/// The points of a layer, of all scans one after the other.
#[derive(Default)]
struct Layer {
    points_m: Vec<[f32; 3]>,
    colours: Vec<Rgba>,
    beams: Vec<u16>,
    offsets_ns: Vec<u32>,
    intensities: Vec<f32>,
    /// Number of points of each scan.
    lengths: Vec<usize>,
}

/// Returns the layer of the points for which `colour` returns a colour.
fn layer(scans: &[&Scan], colour: &impl Fn(&Scan, usize) -> Option<Rgba>) -> Layer {
    let mut layer = Layer::default();
    for scan in scans {
        let first = layer.points_m.len();
        for (point, at_m) in scan.points_m().enumerate() {
            if let Some(colour) = colour(scan, point) {
                layer.points_m.push(at_m);
                layer.colours.push(colour);
                layer.beams.push(scan.points.beam[point]);
                layer.offsets_ns.push(scan.points.offset_ns[point]);
                layer.intensities.push(scan.points.intensity[point]);
            }
        }
        layer.lengths.push(layer.points_m.len() - first);
    }
    layer
}

/// Writes the layer of the points for which `colour` returns a colour. The layer has the sensor's
/// measurements of the points unless another layer has them. A few scans at a time are in memory as
/// a layer.
fn write_layer(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    scans: &[&Scan],
    colour: impl Fn(&Scan, usize) -> Option<Rgba>,
    is_measured: bool,
) -> Result<(), RecordingError> {
    writer.write_static(entity, &Points3D::update_fields().with_radii([POINT_RADIUS_M]))?;
    writer.write_rows_in_pieces(entity, times, SCANS_PER_PIECE, |range| {
        let layer = layer(&scans[range], &colour);
        let measured = if is_measured { Some(layer.measured()?) } else { None };
        let points = Points3D::update_fields()
            .with_positions(layer.points_m)
            .with_colors(layer.colours)
            .columns(layer.lengths)?;
        Ok(points.chain(measured.into_iter().flatten()))
    })
}

impl Layer {
    /// Returns the sensor's measurements of the points besides their position.
    fn measured(&self) -> SerializationResult<[SerializedComponentColumn; 3]> {
        let column = |name: &'static str, array: ArrayRef| {
            let component = ComponentIdentifier::from(name);
            let descriptor = ComponentDescriptor { archetype: None, component, component_type: None };
            SerializedComponentBatch::new(array, descriptor).partitioned(self.lengths.iter().copied())
        };
        Ok([
            column("beam", Arc::new(UInt16Array::from(self.beams.clone())))?,
            column("offset_ns", Arc::new(UInt32Array::from(self.offsets_ns.clone())))?,
            column("intensity", Arc::new(Float32Array::from(self.intensities.clone())))?,
        ])
    }
}

/// Writes the boxes fitted to the clusters.
fn write_boxes(writer: &Writer<'_>, entity: &str, times: &[Time], scans: &[&Scan]) -> Result<(), RecordingError> {
    let fixed = Boxes3D::update_fields()
        .with_fill_mode(FillMode::MajorWireframe)
        .with_radii([0.02_f32])
        .with_colors([palette::BOX_FIT])
        .with_show_labels(false);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let scans = &scans[range];
        let all = || scans.iter().flat_map(|scan| &scan.boxes);
        let half = |extent_m: f64| (0.5 * extent_m) as f32;
        let centre = |detection: &Detection| {
            let (x_m, y_m) = detection.centre_m();
            [x_m as f32, y_m as f32, half(detection.top_m)]
        };
        Boxes3D::update_fields()
            .with_centers(all().map(centre))
            .with_half_sizes(
                all().map(|detection| [half(detection.length_m), half(detection.width_m), half(detection.top_m)]),
            )
            .with_quaternions(all().map(|detection| yaw_rotation(detection.heading_rad)))
            .with_labels(all().map(|detection| format!("{} points", detection.points)))
            .columns(scans.iter().map(|scan| scan.boxes.len()).collect::<Vec<_>>())
    })
}
