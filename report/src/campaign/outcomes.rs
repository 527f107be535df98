//! The table of a campaign's outcomes, as Parquet: one row for each sample and controller.
//!
//! The file depends on the rows alone: the same rows give the same bytes, however they were
//! computed. It states neither time nor place. The metadata of the columns hold the units, and the
//! metadata of the file hold the manifest. The names of the columns consist of lower-case letters,
//! digits and underscores, so SQL needs no quotes. A margin that does not exist is null, and the
//! column `<margin>_absent` gives the reason.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, BooleanArray, Float64Array, RecordBatch, StringArray, UInt64Array};
use arrow::datatypes::{DataType, Field, Schema};
use closecall_traffic::{Absent, Measured, ParameterName, Parameters, Value};
use parquet::arrow::ArrowWriter;
use parquet::file::metadata::KeyValue;
use serde::Serialize;

use crate::table::{ROWS_PER_BATCH, field, properties, required};
use crate::units::unit_of;
use closecall_campaign::manifest::Manifest;
use closecall_campaign::record::SampleFailure;
use closecall_scenarios::criteria::Measure;
use closecall_scenarios::harm::harm;
use closecall_scenarios::outcome::{Ahead, Collision, MisSummary, Outcome, ReasonSpan, worse};
use closecall_scenarios::promise::Goal;
use closecall_traffic::atomic::{WriteError, write_file};

/// One sample in one arm.
#[derive(Clone, Debug)]
pub struct OutcomeRow {
    /// The scenario's name.
    pub scenario: String,
    /// The campaign's seed.
    pub seed: u64,
    /// The sample's number.
    pub sample: u64,
    /// The controller's name.
    pub controller: String,
    /// The outcome, or the error that the sample ended in.
    pub result: Result<Outcome, SampleFailure>,
}

impl OutcomeRow {
    fn outcome(&self) -> Option<&Outcome> {
        self.result.as_ref().ok()
    }

    /// Returns the first collision of the ego.
    pub fn ego_collision(&self) -> Option<&Collision> {
        self.outcome()?.ego_collisions().next()
    }
}

/// The type of a parameter's column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterKind {
    /// Numbers.
    Number,
    /// Text. If a parameter has numbers and labels, the numbers are written as text.
    Label,
}

/// Returns the columns for the parameters of several scenarios, in the order of their names.
pub fn parameter_columns<'a>(
    parameters: impl IntoIterator<Item = &'a Parameters>,
) -> BTreeMap<ParameterName, ParameterKind> {
    let mut columns = BTreeMap::new();
    for (name, value) in parameters.into_iter().flat_map(Parameters::iter) {
        let kind = match value {
            Value::Number(_) => ParameterKind::Number,
            Value::Label(_) => ParameterKind::Label,
        };
        let column = columns.entry(name.clone()).or_insert(kind);
        if kind == ParameterKind::Label {
            *column = kind;
        }
    }
    columns
}

/// The key under which the metadata of the file holds the manifest, as JSON.
const MANIFEST_KEY: &str = "closecall:manifest";

/// Writes the table, with the `manifest` of the campaign in its metadata. The rows are encoded in
/// batches, so that memory is bounded.
///
/// # Errors
/// The first error of `rows`, or [`WriteError`]. An existing file then stays as it is.
pub fn write_outcomes<E: From<WriteError>>(
    path: &Path,
    manifest: Option<&Manifest>,
    parameters: &BTreeMap<ParameterName, ParameterKind>,
    rows: impl Iterator<Item = Result<OutcomeRow, E>>,
) -> Result<(), E> {
    let columns = columns(parameters);
    let schema = Arc::new(Schema::new(columns.iter().map(Column::field).collect::<Vec<_>>()));
    let mut rows = rows.fuse();
    let mut row_error = None;
    let written = write_file(path, |file| {
        let options = properties().into_builder().set_key_value_metadata(Some(metadata(&columns, manifest))).build();
        let mut writer = ArrowWriter::try_new(file, schema.clone(), Some(options)).map_err(io::Error::other)?;
        loop {
            let group: Result<Vec<OutcomeRow>, E> = rows.by_ref().take(ROWS_PER_BATCH).collect();
            let group = match group {
                Ok(group) => group,
                Err(error) => {
                    row_error = Some(error);
                    return Err(io::Error::other("a row is an error"));
                }
            };
            if group.is_empty() {
                break;
            }
            let arrays = columns.iter().map(|column| column.array(&group)).collect();
            let batch = RecordBatch::try_new(schema.clone(), arrays).map_err(io::Error::other)?;
            writer.write(&batch).map_err(io::Error::other)?;
        }
        writer.close().map_err(io::Error::other)?;
        Ok(())
    });
    match row_error {
        Some(error) => Err(error),
        None => Ok(written?),
    }
}

/// Returns the metadata of the file: the units, and the part of the manifest that determines the
/// outcomes. A part of a campaign, or another command line, would change the bytes, but not the
/// outcomes.
fn metadata(columns: &[Column], manifest: Option<&Manifest>) -> Vec<KeyValue> {
    let mut entries = units(columns);
    if let Some(text) = manifest.and_then(Manifest::determining_json) {
        entries.push(KeyValue::new(MANIFEST_KEY.to_owned(), text));
    }
    entries
}

/// Returns the units once more, for readers that do not decode Arrow's own schema: one entry for
/// each column with a unit.
fn units(columns: &[Column]) -> Vec<KeyValue> {
    let unit =
        |column: &Column| column.unit.map(|unit| KeyValue::new(format!("unit:{}", column.name), unit.to_owned()));
    columns.iter().filter_map(unit).collect()
}

/// Returns one value of a row, or `None` if the row lacks it.
type Cell<T> = Box<dyn Fn(&OutcomeRow) -> Option<T>>;

/// The columns in which every row has a value, even if the sample ended in an error.
const REQUIRED: [&str; 5] = ["scenario", "seed", "sample", "controller", "status"];

/// How the cells of a column are computed from the rows.
enum Cells {
    Text(Cell<String>),
    Number(Cell<f64>),
    Count(Cell<u64>),
    Flag(Cell<bool>),
}

/// A column of the table.
pub(super) struct Column {
    /// The column's name.
    pub(super) name: String,
    unit: Option<&'static str>,
    cells: Cells,
}

/// The value of a cell for a reader: a flag is a word, a count a number.
pub(super) enum CellValue {
    Number(f64),
    Word(String),
}

impl Column {
    /// Returns true if the cells are numbers.
    pub(super) const fn is_number(&self) -> bool {
        matches!(self.cells, Cells::Number(_) | Cells::Count(_))
    }

    /// Returns the value of a row.
    pub(super) fn value(&self, row: &OutcomeRow) -> Option<CellValue> {
        match &self.cells {
            Cells::Text(value) => value(row).map(CellValue::Word),
            Cells::Number(value) => value(row).map(CellValue::Number),
            Cells::Count(value) => value(row).map(|count| CellValue::Number(count as f64)),
            Cells::Flag(value) => value(row).map(|flag| CellValue::Word(if flag { "yes" } else { "no" }.to_owned())),
        }
    }

    fn field(&self) -> Field {
        let data_type = match self.cells {
            Cells::Text(_) => DataType::Utf8,
            Cells::Number(_) => DataType::Float64,
            Cells::Count(_) => DataType::UInt64,
            Cells::Flag(_) => DataType::Boolean,
        };
        if REQUIRED.contains(&self.name.as_str()) {
            required(&self.name, data_type, self.unit)
        } else {
            field(&self.name, data_type, self.unit)
        }
    }

    fn array(&self, rows: &[OutcomeRow]) -> ArrayRef {
        match &self.cells {
            Cells::Text(value) => Arc::new(rows.iter().map(value).collect::<StringArray>()),
            Cells::Number(value) => Arc::new(rows.iter().map(value).collect::<Float64Array>()),
            Cells::Count(value) => Arc::new(rows.iter().map(value).collect::<UInt64Array>()),
            Cells::Flag(value) => Arc::new(rows.iter().map(value).collect::<BooleanArray>()),
        }
    }
}

/// The columns of the table, in order.
#[derive(Default)]
struct Columns(Vec<Column>);

impl Columns {
    fn text(&mut self, name: &str, value: impl Fn(&OutcomeRow) -> Option<String> + 'static) {
        self.0.push(Column { name: name.to_owned(), unit: None, cells: Cells::Text(Box::new(value)) });
    }

    fn count(&mut self, name: &str, value: impl Fn(&OutcomeRow) -> Option<u64> + 'static) {
        self.0.push(Column { name: name.to_owned(), unit: None, cells: Cells::Count(Box::new(value)) });
    }

    fn flag(&mut self, name: &str, value: impl Fn(&OutcomeRow) -> Option<bool> + 'static) {
        self.0.push(Column { name: name.to_owned(), unit: None, cells: Cells::Flag(Box::new(value)) });
    }

    fn number(&mut self, name: &str, unit: &'static str, value: impl Fn(&OutcomeRow) -> Option<f64> + 'static) {
        self.0.push(Column { name: name.to_owned(), unit: Some(unit), cells: Cells::Number(Box::new(value)) });
    }

    /// Adds a column for a value, and one for the reason of its absence.
    fn measured(&mut self, name: &str, unit: &'static str, value: fn(&Outcome) -> Measured) {
        self.number(name, unit, move |row| value(row.outcome()?).ok());
        self.text(&format!("{name}_absent"), move |row| value(row.outcome()?).err().map(|absent| absent.to_string()));
    }

    /// Adds the same two columns for a value of the margin increase system.
    fn mis(&mut self, name: &str, unit: &'static str, value: fn(&MisSummary) -> Measured) {
        let measured = move |outcome: &Outcome| outcome.mis.as_ref().map_err(|absent| *absent).and_then(value);
        self.number(name, unit, move |row| measured(row.outcome()?).ok());
        self.text(&format!("{name}_absent"), move |row| {
            measured(row.outcome()?).err().map(|absent| absent.to_string())
        });
    }
}

/// Returns the columns of the table.
pub(super) fn columns(parameters: &BTreeMap<ParameterName, ParameterKind>) -> Vec<Column> {
    let mut columns = Columns::default();
    key_columns(&mut columns);
    for (name, kind) in parameters {
        parameter_column(&mut columns, name, *kind);
    }
    collision_columns(&mut columns);
    encounter_columns(&mut columns);
    margin_columns(&mut columns);
    mis_columns(&mut columns);
    columns.0
}

fn key_columns(columns: &mut Columns) {
    columns.text("scenario", |row| Some(row.scenario.clone()));
    columns.count("seed", |row| Some(row.seed));
    columns.count("sample", |row| Some(row.sample));
    columns.text("controller", |row| Some(row.controller.clone()));
    columns.text("status", |row| Some(if row.result.is_ok() { "ok" } else { "error" }.to_owned()));
    columns.text("error_kind", |row| row.result.as_ref().err().map(|error| error.kind.clone()));
    columns.text("error_message", |row| row.result.as_ref().err().map(|error| error.message.clone()));
    columns.text("end", |row| word(&row.outcome()?.end));
    columns.number("duration_s", "s", |row| Some(row.outcome()?.duration.s()));
}

/// How the name of a parameter's column begins.
pub(super) const PARAMETER: &str = "param_";

/// Returns the name of a parameter's column: `param_closing_mps` for the parameter `closing-mps`.
fn parameter_column_name(name: &ParameterName) -> String {
    format!("{PARAMETER}{}", name.as_str().replace('-', "_"))
}

/// Adds the column of a parameter. The end of the parameter's name is its unit.
fn parameter_column(columns: &mut Columns, name: &ParameterName, kind: ParameterKind) {
    let (column, unit) = (parameter_column_name(name), unit_of(name.as_str()));
    let name = name.clone();
    match kind {
        ParameterKind::Number => {
            let value = move |row: &OutcomeRow| match row.outcome()?.parameters.get(&name)? {
                Value::Number(value) => Some(*value),
                Value::Label(_) => None,
            };
            columns.0.push(Column { name: column, unit, cells: Cells::Number(Box::new(value)) });
        }
        ParameterKind::Label => {
            columns.text(&column, move |row| row.outcome()?.parameters.get(&name).map(ToString::to_string));
        }
    }
}

fn collision_columns(columns: &mut Columns) {
    columns.count("collisions", |row| Some(row.outcome()?.collisions.len() as u64));
    columns.count("touches", |row| Some(row.outcome()?.touches.len() as u64));
    columns.number("touch_relative_speed_mps", "m/s", |row| {
        row.outcome()?.touches.iter().map(|touch| touch.relative_speed_mps).reduce(worse)
    });
    for name in ["ego_strikes", "ego_is_struck", "ego_touched"] {
        columns.flag(name, move |row| Some(Measure::named(name)?.of(row.outcome()?)? == 1.0));
    }
    columns.number("impact_speed_mps", "m/s", |row| Measure::named("impact_speed_mps")?.of(row.outcome()?));
    columns.flag("ego_collided", |row| Some(row.outcome()?.ego_collided()));
    columns.flag("others_collided", |row| Some(row.outcome()?.others_collided()));
    // Of no collisions, the sum is negative zero.
    let harm_of = |row: &OutcomeRow| Some(harm(row.outcome()?) + 0.0);
    columns.0.push(Column { name: "harm".to_owned(), unit: None, cells: Cells::Number(Box::new(harm_of)) });
    let first = |row: &OutcomeRow| row.outcome()?.collisions.first().cloned();
    columns.number("collision_time_s", "s", move |row| Some(first(row)?.time.s()));
    for (index, vehicle) in ["first", "second"].into_iter().enumerate() {
        columns.text(&format!("collision_between_{vehicle}"), move |row| Some(first(row)?.between[index].to_string()));
        columns.text(&format!("collision_struck_side_{vehicle}"), move |row| word(&first(row)?.struck_side[index]));
        columns.number(&format!("collision_delta_v_{vehicle}_mps"), "m/s", move |row| {
            Some(first(row)?.delta_v_mps[index])
        });
    }
    columns.text("collision_closed_by", move |row| word(&first(row)?.closed_by));
    columns.text("collision_phase", move |row| word(&first(row)?.phase));
    columns.number("collision_relative_speed_mps", "m/s", move |row| Some(first(row)?.relative_speed_mps));
}

/// The events of the encounter, from the ground truth.
fn encounter_columns(columns: &mut Columns) {
    for name in ["rear_near", "rear_cut_out", "rear_crossed", "hazard", "rear_critical", "rear_passed", "lead_braked"] {
        columns.flag(name, move |row| Some(Measure::named(name)?.of(row.outcome()?)? == 1.0));
    }
}

fn ahead(outcome: &Outcome, value: fn(&Ahead) -> Measured) -> Measured {
    outcome.ahead.as_ref().map_or(Err(Absent::NotRecorded), value)
}

fn margin_columns(columns: &mut Columns) {
    columns.measured("min_thw_front_s", "s", |outcome| outcome.margins.min_thw_front_s);
    columns.measured("min_thw_rear_s", "s", |outcome| outcome.margins.min_thw_rear_s);
    columns.measured("min_gap_front_m", "m", |outcome| outcome.margins.min_gap_front_m);
    columns.measured("min_gap_rear_m", "m", |outcome| outcome.margins.min_gap_rear_m);
    columns.measured("min_ttc_front_s", "s", |outcome| ahead(outcome, |ahead| ahead.min_ttc_front_s));
    columns.measured("emergency_braking_at_s", "s", |outcome| ahead(outcome, |ahead| ahead.emergency_braking_at_s));
    columns.measured("min_ttc_rear_s", "s", |outcome| outcome.margins.min_ttc_rear_s);
    let margins = |row: &OutcomeRow| Some(row.outcome()?.margins);
    columns.number("max_deceleration_mps2", "m/s²", move |row| Some(margins(row)?.max_deceleration_mps2));
    columns.number("max_jerk_mps3", "m/s³", move |row| Some(margins(row)?.max_jerk_mps3));
    columns.number("max_speed_deficit_mps", "m/s", move |row| Some(margins(row)?.max_speed_deficit_mps));
    for (name, unit) in [("unprompted_deficit_mps", "m/s"), ("time_lost_s", "s"), ("imposed_braking_mps2", "m/s²")] {
        columns.number(name, unit, move |row| Measure::named(name)?.of(row.outcome()?));
    }
}

/// Returns all reasons of the system with their intervals, in order of time.
fn reasons_text(reasons: &[ReasonSpan]) -> String {
    let text = |span: &ReasonSpan| format!("{} {:.2} to {:.2} s", span.reason, span.from_s, span.until_s);
    reasons.iter().map(text).collect::<Vec<_>>().join("; ")
}

fn mis_columns(columns: &mut Columns) {
    columns.mis("mis_engaged_at_s", "s", |mis| mis.engaged_at_s);
    columns.mis("mis_released_at_s", "s", |mis| mis.released_at_s);
    columns.mis("mis_thw_front_at_engagement_s", "s", |mis| mis.thw_front_at_engagement_s);
    columns.mis("mis_thw_front_at_critical_s", "s", |mis| mis.thw_front_at_critical_s);
    columns.mis("mis_mean_deceleration_mps2", "m/s²", |mis| mis.mean_deceleration_mps2);
    columns.flag("mis_goal_in_reach", move |row| row.outcome()?.mis.as_ref().ok()?.goal_in_reach);
    columns.text("mis_reason", move |row| {
        Some(row.outcome()?.mis.as_ref().map_or_else(ToString::to_string, |mis| mis.reason.to_string()))
    });
    columns.text("mis_reasons", move |row| Some(reasons_text(&row.outcome()?.mis.as_ref().ok()?.reasons)));
    columns.text("mis_goal", move |row| Some(Goal::of(row.outcome()?)?.text().to_owned()));
    for (name, unit) in [("thw_raised_s", "s"), ("crossing_braking_mps2", "m/s²")] {
        columns.number(name, unit, move |row| Measure::named(name)?.of(row.outcome()?));
    }
}

/// Returns the name of an enum's variant, as JSON writes it too.
fn word(variant: &impl Serialize) -> Option<String> {
    serde_json::to_value(variant).ok()?.as_str().map(str::to_owned)
}

#[cfg(test)]
pub(super) mod tests;
