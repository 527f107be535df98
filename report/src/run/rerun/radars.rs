//! The detections of the rear radars, as points in the ego frame: one entity for each radar, with
//! one row for each scan.
//!
//! A radar measures no height, so its points lie at one height. Each point has the measured values
//! (`range_m`, `azimuth_rad`, `radial_mps`), and the truth: whether a vehicle is there (`exists`),
//! and the name of the vehicle (`vehicle`). A ghost does not exist: it has the colour of a track
//! without a vehicle. Its `vehicle` is the vehicle that a guard rail mirrors, or empty for a fault.
//!
//! The unit is in the name, and in the metadata of the column, as the type of the component.

use std::sync::Arc;

use arrow::array::{ArrayRef, BooleanArray, Float64Array, StringArray};

use closecall_sensors::tracking::RadarDetection;
use closecall_sensors::{RadarReturn, RadarSource};
use closecall_traffic::{Time, maths};
use rerun::{
    ComponentDescriptor, ComponentIdentifier, Points3D, SerializationResult, SerializedComponentBatch,
    SerializedComponentColumn,
};

use super::RecordingError;
use super::palette;
use super::stream::Writer;
use crate::run::film::Film;
use crate::units::unit_of;

/// Entities of the left and of the right radar.
const ENTITIES: [&str; 2] = ["world/ego/radars/left", "world/ego/radars/right"];
/// Radius of the ball that shows a detection (m).
const RADIUS_M: f32 = 0.25;
/// Height at which detections are drawn (m).
const HEIGHT_M: f32 = 0.6;

/// Writes the detections of both radars.
pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
    let scans: Vec<(Time, &[Vec<RadarReturn>; 2])> =
        film.frames.iter().filter_map(|frame| Some((frame.time, frame.radar_returns.as_ref()?))).collect();
    if scans.is_empty() {
        return Ok(());
    }
    let times: Vec<Time> = scans.iter().map(|(time, _)| *time).collect();
    for (index, entity) in ENTITIES.into_iter().enumerate() {
        let of_radar: Vec<&[RadarReturn]> = scans.iter().map(|(_, returns)| &returns[index][..]).collect();
        write_radar(writer, film, entity, &times, &of_radar)?;
    }
    Ok(())
}

/// Writes the scans of one radar.
fn write_radar(
    writer: &Writer<'_>,
    film: &Film,
    entity: &str,
    times: &[Time],
    scans: &[&[RadarReturn]],
) -> Result<(), RecordingError> {
    writer.write_static(entity, &Points3D::update_fields().with_radii([RADIUS_M]).with_show_labels(false))?;
    writer.write_rows(entity, times, |range| {
        let scans = &scans[range];
        let all = || scans.iter().flat_map(|scan| scan.iter());
        let lengths: Vec<usize> = scans.iter().map(|scan| scan.len()).collect();
        let numbers = |name: &'static str, value: fn(&RadarDetection) -> f64| {
            let values = Float64Array::from_iter_values(all().map(|one| value(&one.measured)));
            column(name, Arc::new(values), &lengths)
        };
        let exists: BooleanArray = all().map(|one| Some(one.source.exists())).collect();
        let vehicles = StringArray::from_iter_values(all().map(|one| vehicle(film, one.source)).collect::<Vec<_>>());
        let measured = [
            numbers("range_m", |measured| measured.range_m)?,
            numbers("azimuth_rad", |measured| measured.azimuth_rad)?,
            numbers("radial_mps", |measured| measured.radial_mps)?,
            column("exists", Arc::new(exists), &lengths)?,
            column("vehicle", Arc::new(vehicles), &lengths)?,
        ];
        let points = Points3D::update_fields()
            .with_positions(all().map(|one| place_m(&one.measured)))
            .with_colors(all().map(|one| if one.source.exists() { palette::RADAR } else { palette::FALSE_TRACK }))
            .with_labels(all().map(label))
            .columns(lengths.clone())?;
        Ok(points.chain(measured))
    })
}

/// Returns a column with the values of so many detections in each row.
fn column(name: &'static str, values: ArrayRef, lengths: &[usize]) -> SerializationResult<SerializedComponentColumn> {
    let (component, component_type) = (ComponentIdentifier::from(name), unit_of(name).map(Into::into));
    let descriptor = ComponentDescriptor { archetype: None, component, component_type };
    SerializedComponentBatch::new(values, descriptor).partitioned(lengths.iter().copied())
}

/// Returns the place of a detection in the ego frame (m).
fn place_m(measured: &RadarDetection) -> [f32; 3] {
    let (sin, cos) = maths::sin_cos(measured.azimuth_rad);
    let [x_m, y_m] = measured.sensor_m;
    [(x_m - measured.range_m * cos) as f32, (y_m + measured.range_m * sin) as f32, HEIGHT_M]
}

/// Returns the label of a detection: its radial speed, and whether it is a ghost.
fn label(one: &RadarReturn) -> String {
    let ghost = if one.source.exists() { "" } else { ", a vehicle that does not exist" };
    format!("{:.1} m/s{ghost}", one.measured.radial_mps)
}

/// Returns the name of the vehicle of a detection; empty if there is none.
fn vehicle(film: &Film, source: RadarSource) -> &str {
    match source {
        RadarSource::Vehicle(actor) | RadarSource::MirrorImage(actor) => {
            film.actors.get(actor).map_or("", |actor| actor.name.as_str())
        }
        RadarSource::Fault => "",
    }
}
