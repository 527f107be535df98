//! Typed properties of a recording, for programs that query it: scenario, seed, sample, parameters,
//! and per arm the outcome.
//!
//! ```text
//!  __properties                   name of the recording
//!  __properties/run               scenario, seed, sample, verdict, settings
//!  __properties/parameters        one value per sampled parameter
//!  __properties/arms/ARM          collided, smallest headways, when the MIS engaged, what happened in words, and so on
//!  __properties/arms/ARM/collision_N   each collision: who struck whom, struck sides, ΔV, phase, by whom it was avoidable
//! ```
//!
//! The unit is in the name of each property, and in the metadata of its column, as the type of the
//! component.

use std::sync::Arc;

use arrow::array::{ArrayRef, BooleanArray, Float64Array, StringArray, UInt64Array};
use closecall_scenarios::outcome::{Collision, Outcome};
use closecall_studies::attribution::Avoidable;
use closecall_traffic::{Measured, Value};
use rerun::{AsComponents, ComponentDescriptor, ComponentIdentifier, SerializedComponentBatch};

use super::RecordingError;
use super::collisions::side_word;
use super::plots::phase_name;
use super::recording::Recording;
use crate::run::film::Film;
use crate::units::unit_of;

/// Name of the property of an arm that holds its critical moment (s).
pub(super) const CRITICAL_MOMENT: &str = "critical_moment_s";

/// Writes the properties of the recording.
pub(super) fn write(recording: &Recording, films: &[Film]) -> Result<(), RecordingError> {
    let title =
        films.iter().map(|film| format!("{} ({})", film.title, film.arm_label())).collect::<Vec<_>>().join(" and ");
    recording.send_title(&title)?;
    let Some((film, outcome)) = films.iter().rev().find_map(|film| Some((film, film.outcome.as_ref()?))) else {
        return Ok(());
    };
    Properties::default()
        .text("scenario", &outcome.scenario)?
        .count("seed", outcome.seed)?
        .count("sample", outcome.sample)?
        .text("settings", &film.settings.join(" "))?
        .text("verdict", Film::verdict_word(films))?
        .push(recording, "run")?;
    let mut parameters = Properties::default();
    for (name, value) in outcome.parameters.iter() {
        parameters = match value {
            Value::Number(number) => parameters.number(&name.to_string(), Ok(*number))?,
            other => parameters.text(&name.to_string(), &other.to_string())?,
        };
    }
    parameters.push(recording, "parameters")?;
    for (film, outcome) in films.iter().filter_map(|film| Some((film, film.outcome.as_ref()?))) {
        of_arm(film, outcome)?.push(recording, &format!("arms/{}", film.arm))?;
        for (number, collision) in outcome.collisions.iter().enumerate() {
            let entity = format!("arms/{}/collision_{}", film.arm, number + 1);
            of_collision(collision, film.avoidable.get(number).copied().flatten())?.push(recording, &entity)?;
        }
    }
    Ok(())
}

/// Returns the properties of one arm.
fn of_arm(film: &Film, outcome: &Outcome) -> Result<Properties, RecordingError> {
    let margins = &outcome.margins;
    let happened = film.sentence().map_or_else(String::new, |sentence| sentence.to_string());
    let faults: Vec<String> = film.faults.iter().map(ToString::to_string).collect();
    let mut properties = Properties::default()
        .text("controller", &outcome.controller)?
        .text("happened", &happened)?
        .text("faults", &faults.join("; "))?
        .flag("ego_collided", outcome.ego_collided())?
        .count("collisions", outcome.collisions.len() as u64)?
        .count("touches", outcome.touches.len() as u64)?
        .number("duration_s", Ok(outcome.duration.s()))?
        .number(CRITICAL_MOMENT, Ok(film.critical_moment().s()))?
        .number("min_thw_front_s", margins.min_thw_front_s)?
        .number("min_thw_rear_s", margins.min_thw_rear_s)?
        .number("min_gap_front_m", margins.min_gap_front_m)?
        .number("min_gap_rear_m", margins.min_gap_rear_m)?
        .number("min_ttc_rear_s", margins.min_ttc_rear_s)?
        .number("max_deceleration_mps2", Ok(margins.max_deceleration_mps2))?;
    if let Some(collision) = film.worst_collision() {
        properties = properties
            .number("collision_time_s", Ok(collision.time.s()))?
            .number("collision_relative_speed_mps", Ok(collision.relative_speed_mps))?;
    }
    if let Ok(mis) = &outcome.mis {
        properties = properties
            .number("mis_engaged_at_s", mis.engaged_at_s)?
            .number("mis_thw_front_at_critical_s", mis.thw_front_at_critical_s)?
            .text("mis_reason", &mis.reason.to_string())?;
    }
    Ok(properties)
}

/// Returns the properties of one collision.
fn of_collision(collision: &Collision, avoidable: Option<Avoidable>) -> Result<Properties, RecordingError> {
    let [striking, struck] = collision.roles();
    let properties = Properties::default()
        .number("time_s", Ok(collision.time.s()))?
        .text("striking", collision.between[striking].as_str())?
        .text("striking_side", side_word(collision.struck_side[striking]))?
        .text("struck", collision.between[struck].as_str())?
        .text("struck_side", side_word(collision.struck_side[struck]))?
        .text("phase", phase_name(collision.phase))?
        .number("relative_speed_mps", Ok(collision.relative_speed_mps))?
        .number("delta_v_striking_mps", Ok(collision.delta_v_mps[striking]))?
        .number("delta_v_struck_mps", Ok(collision.delta_v_mps[struck]))?;
    match avoidable {
        Some(avoidable) => properties.text("avoidable_by", avoidable.words()),
        None => Ok(properties),
    }
}

/// Values of one entity. A value that does not exist has no column.
#[derive(Default)]
struct Properties(Vec<SerializedComponentBatch>);

impl AsComponents for Properties {
    fn as_serialized_batches(&self) -> Vec<SerializedComponentBatch> {
        self.0.clone()
    }
}

impl Properties {
    fn with(mut self, name: &str, array: ArrayRef) -> Result<Self, RecordingError> {
        let name = name.replace('-', "_");
        let component = ComponentIdentifier::try_new(&name).map_err(RecordingError::encode)?;
        let component_type = unit_of(&name).map(Into::into);
        let descriptor = ComponentDescriptor { archetype: None, component, component_type };
        self.0.push(SerializedComponentBatch::new(array, descriptor));
        Ok(self)
    }

    fn text(self, name: &str, text: &str) -> Result<Self, RecordingError> {
        self.with(name, Arc::new(StringArray::from(vec![text])))
    }

    fn count(self, name: &str, count: u64) -> Result<Self, RecordingError> {
        self.with(name, Arc::new(UInt64Array::from(vec![count])))
    }

    fn flag(self, name: &str, flag: bool) -> Result<Self, RecordingError> {
        self.with(name, Arc::new(BooleanArray::from(vec![flag])))
    }

    fn number(self, name: &str, value: Measured) -> Result<Self, RecordingError> {
        match value {
            Ok(value) => self.with(name, Arc::new(Float64Array::from(vec![value]))),
            Err(_) => Ok(self),
        }
    }

    fn push(self, recording: &Recording, entity: &str) -> Result<(), RecordingError> {
        if self.0.is_empty() {
            return Ok(());
        }
        recording.send_property(entity, &self)
    }
}
