//! The collisions of a run as a table, for programs that query the recording. No view shows it.
//!
//! Each collision is one row, at the time of the first contact. A component has the name of the
//! same column in the table of outcomes, without `collision_`. The name ends with the unit, and the
//! type of the component states the unit too.

use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, StringArray};
use closecall_scenarios::outcome::Collision;
use closecall_traffic::Time;
use closecall_traffic::geometry::BoxSide;
use rerun::{
    ComponentDescriptor, ComponentIdentifier, SerializationResult, SerializedComponentBatch, SerializedComponentColumn,
};

use super::RecordingError;
use super::plots::phase_name;
use super::stream::Writer;
use crate::run::film::Film;
use crate::units::unit_of;

/// Entity of the table.
const ENTITY: &str = "collisions";

/// Writes the table of a film.
pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
    let collisions = film.collisions();
    let times: Vec<Time> = collisions.iter().map(|collision| collision.time).collect();
    writer.write_curve(ENTITY, &times, |range| {
        let collisions = &collisions[range];
        Ok([
            texts("between_first", collisions, |collision| collision.between[0].as_str())?,
            texts("between_second", collisions, |collision| collision.between[1].as_str())?,
            texts("struck_side_first", collisions, |collision| side_word(collision.struck_side[0]))?,
            texts("struck_side_second", collisions, |collision| side_word(collision.struck_side[1]))?,
            texts("striking", collisions, |collision| collision.between[collision.roles()[0]].as_str())?,
            texts("phase", collisions, |collision| phase_name(collision.phase))?,
            numbers("relative_speed_mps", collisions, |collision| collision.relative_speed_mps)?,
            numbers("delta_v_first_mps", collisions, |collision| collision.delta_v_mps[0])?,
            numbers("delta_v_second_mps", collisions, |collision| collision.delta_v_mps[1])?,
        ]
        .into_iter())
    })
}

/// Returns the name of a side, as the table of outcomes has it.
pub(super) const fn side_word(side: BoxSide) -> &'static str {
    match side {
        BoxSide::Front => "front",
        BoxSide::Rear => "rear",
        BoxSide::Left => "left",
        BoxSide::Right => "right",
    }
}

fn texts(
    name: &'static str,
    collisions: &[Collision],
    text: impl Fn(&Collision) -> &str,
) -> SerializationResult<SerializedComponentColumn> {
    column(name, Arc::new(StringArray::from_iter_values(collisions.iter().map(text))))
}

fn numbers(
    name: &'static str,
    collisions: &[Collision],
    number: impl Fn(&Collision) -> f64,
) -> SerializationResult<SerializedComponentColumn> {
    column(name, Arc::new(Float64Array::from_iter_values(collisions.iter().map(number))))
}

/// Returns a column with one value in each row.
fn column(name: &'static str, values: ArrayRef) -> SerializationResult<SerializedComponentColumn> {
    let (component, component_type) = (ComponentIdentifier::from(name), unit_of(name).map(Into::into));
    let rows = values.len();
    let descriptor = ComponentDescriptor { archetype: None, component, component_type };
    SerializedComponentBatch::new(values, descriptor).partitioned(vec![1; rows])
}
