use std::fmt::Write as _;

use arrow::array::{Array, AsArray};
use arrow::datatypes::{Float64Type, UInt64Type};
use arrow::util::display::array_value_to_string;
use closecall_controllers::Reason;
use closecall_traffic::geometry::BoxSide;
use closecall_traffic::{Absent, ActorId, Time};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::*;
use crate::table::ROWS_PER_GROUP;
use closecall_scenarios::outcome::{ClosedBy, Cost, EndReason, Margins, Phase, Promise};

fn parameters(rear_class: &str) -> Parameters {
    let values = [("closing-mps", Value::Number(6.5)), ("rear-class", Value::Label(rear_class.to_owned()))];
    values.into_iter().map(|(name, value)| (ParameterName::new(name).unwrap(), value)).collect()
}

fn outcome(sample: u64, controller: &str) -> Outcome {
    let id = |name| ActorId::new(name).unwrap();
    let hit = Collision {
        time: Time::from_ms(14_520),
        between: [id("ego"), id("rear")],
        struck_side: [BoxSide::Rear, BoxSide::Front],
        closed_by: ClosedBy::Second,
        phase: Phase::Critical,
        relative_speed_mps: 6.25,
        delta_v_mps: [3.125, 3.5],
    };
    let margins = Margins {
        min_thw_front_s: Ok(0.7),
        min_thw_rear_s: Ok(0.2),
        min_gap_front_m: Ok(21.0),
        min_gap_rear_m: Ok(if controller == "acc" { 0.0 } else { 5.5 }),
        min_ttc_rear_s: Err(Absent::NotApproaching),
        max_deceleration_mps2: 0.8,
        max_jerk_mps3: 2.5,
        max_speed_deficit_mps: 1.5,
    };
    let mis = MisSummary {
        engaged_at_s: Ok(4.52),
        released_at_s: Err(Absent::NotReleased),
        thw_front_at_engagement_s: Ok(0.7),
        thw_front_at_critical_s: Ok(2.6),
        mean_deceleration_mps2: Ok(0.75),
        goal_in_reach: Some(true),
        reason: Reason::Engaged,
        reasons: vec![ReasonSpan { reason: Reason::Engaged, from_s: 4.52, until_s: 16.52 }],
        decided_s: Some([4.52, 9.0]),
        unavailable: None,
    };
    Outcome {
        scenario: "low-thw-overtake".to_owned(),
        seed: 1,
        sample,
        controller: controller.to_owned(),
        ego: ActorId::new("ego").unwrap(),
        parameters: parameters("car"),
        end: if controller == "acc" { EndReason::Collision } else { EndReason::Duration },
        duration: Time::from_ms(16_520),
        collisions: if controller == "acc" { vec![hit] } else { Vec::new() },
        touches: Vec::new(),
        moments: Vec::new(),
        margins,
        mis: if controller == "acc" { Err(Absent::NoMis) } else { Ok(mis) },
        cost: Some(Cost {
            unprompted_deficit_mps: 0.25,
            prompted_deficit_mps: 8.5,
            time_lost_s: 1.75,
            imposed_braking_mps2: 0.5,
        }),
        promise: Some(Promise {
            in_reach: Some(true),
            thw_raised_s: Ok(1.95),
            crossing_braking_mps2: if controller == "acc" { Err(Absent::NeverCrossed) } else { Ok(0.75) },
        }),
        ahead: Some(Ahead { min_ttc_front_s: Ok(2.5), emergency_braking_at_s: Err(Absent::NoEmergencyBraking) }),
    }
}

/// Returns a row with a collision, one without, and one with an error.
pub(crate) fn rows() -> Vec<OutcomeRow> {
    let row = |sample, controller: &str, result| OutcomeRow {
        scenario: "low-thw-overtake".to_owned(),
        seed: 1,
        sample,
        controller: controller.to_owned(),
        result,
    };
    let failure = SampleFailure { kind: "panic".to_owned(), message: "a panic: <index> & \"bounds\"".to_owned() };
    vec![row(0, "acc", Ok(outcome(0, "acc"))), row(0, "mis", Ok(outcome(0, "mis"))), row(1, "mis", Err(failure))]
}

fn write(folder: &Path, name: &str, rows: Vec<OutcomeRow>) -> std::path::PathBuf {
    let path = folder.join(name);
    let columns = parameter_columns(rows.iter().filter_map(|row| Some(&row.outcome()?.parameters)));
    write_outcomes(&path, None, &columns, rows.into_iter().map(Ok::<_, WriteError>)).unwrap();
    path
}

fn read(path: &Path) -> Vec<RecordBatch> {
    let file = std::fs::File::open(path).unwrap();
    ParquetRecordBatchReaderBuilder::try_new(file).unwrap().build().unwrap().map(Result::unwrap).collect()
}

#[test]
fn the_table_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let batches = read(&write(folder.path(), "a.parquet", rows()));
    let batch = &batches[0];
    let mut text = String::new();
    for (column, field) in batch.schema().fields().iter().enumerate() {
        let unit = field.metadata().get("unit").map_or("-", String::as_str);
        let array = batch.column(column);
        let cells: Vec<String> = (0..batch.num_rows())
            .map(|row| if array.is_null(row) { "null".to_owned() } else { array_value_to_string(array, row).unwrap() })
            .collect();
        writeln!(text, "{} [{unit}] {}: {}", field.name(), field.data_type(), cells.join(" | ")).unwrap();
    }
    insta::assert_snapshot!(text);
}

#[test]
fn the_same_rows_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let first = std::fs::read(write(folder.path(), "a.parquet", rows())).unwrap();
    let second = std::fs::read(write(folder.path(), "b.parquet", rows())).unwrap();
    assert_eq!(first, second);
    let mut other = rows();
    other[1].sample = 7;
    assert_ne!(first, std::fs::read(write(folder.path(), "c.parquet", other)).unwrap());
}

#[test]
fn more_rows_than_a_group_keep_their_order() {
    let folder = tempfile::tempdir().unwrap();
    let count = ROWS_PER_GROUP as u64 + 3;
    let many = (0..count).map(|sample| OutcomeRow { sample, ..rows().swap_remove(1) }).collect();
    let batches = read(&write(folder.path(), "a.parquet", many));
    let samples: Vec<u64> =
        batches.iter().flat_map(|batch| batch["sample"].as_primitive::<UInt64Type>().values().to_vec()).collect();
    assert_eq!(samples, (0..count).collect::<Vec<_>>());
    assert_eq!(batches[0]["min_thw_front_s"].as_primitive::<Float64Type>().value(0).to_bits(), 0.7_f64.to_bits());
}

#[test]
fn an_error_among_the_rows_leaves_the_existing_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.parquet");
    std::fs::write(&path, "old").unwrap();
    let rows = rows().into_iter().map(Ok).chain([Err(WriteError::new(Path::new("journal"), io::Error::other("cut")))]);
    let error = write_outcomes(&path, None, &BTreeMap::new(), rows).unwrap_err();
    assert_eq!(error.to_string(), "failed to write journal: cut");
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
}

#[test]
fn a_parameter_that_is_a_label_in_any_scenario_is_text() {
    let mut mixed = Parameters::default();
    mixed.insert(ParameterName::new("rear-class").unwrap(), Value::Number(1.0));
    let columns = parameter_columns([&mixed, &parameters("truck")]);
    let kinds: Vec<(&str, ParameterKind)> = columns.iter().map(|(name, kind)| (name.as_str(), *kind)).collect();
    assert_eq!(kinds, [("closing-mps", ParameterKind::Number), ("rear-class", ParameterKind::Label)]);
}

#[test]
fn no_column_needs_quotes_in_sql_and_those_with_a_value_in_each_row_are_not_nullable() {
    let folder = tempfile::tempdir().unwrap();
    let batches = read(&write(folder.path(), "a.parquet", rows()));
    for field in batches[0].schema().fields() {
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        assert!(field.name().chars().all(is_plain), "{}", field.name());
        assert_eq!(field.is_nullable(), !REQUIRED.contains(&field.name().as_str()), "{}", field.name());
    }
}

/// Returns the tally of a sample with this outcome in one arm.
fn tally(outcome: Outcome) -> closecall_campaign::ledger::Tally {
    closecall_campaign::record::ArmRecord::new(outcome.controller.clone(), Ok(outcome)).tally()
}

#[test]
fn a_touch_is_no_collision_in_any_count_and_has_columns_of_its_own() {
    use closecall_campaign::ledger::PairFate;

    let hit = outcome(0, "acc");
    let contact = Collision { relative_speed_mps: 0.25, ..hit.collisions[0].clone() };
    let touched = Outcome { collisions: Vec::new(), touches: vec![contact], ..hit.clone() };
    assert!(hit.ego_collided() && !touched.ego_collided() && touched.ego_touched() && !touched.others_collided());
    let both = Outcome { touches: touched.touches.clone(), ..hit.clone() };
    assert!(both.ego_collided() && both.ego_touched(), "a touch does not hide the collision");
    let fate = |baseline: &Outcome, tested: &Outcome| PairFate::of(&tally(baseline.clone()), &tally(tested.clone()));
    assert_eq!(fate(&hit, &touched), Some(PairFate::Prevented));
    assert_eq!(fate(&touched, &hit), Some(PairFate::Induced));
    assert_eq!(fate(&touched, &both), Some(PairFate::Induced));
    assert_eq!(fate(&touched, &touched), Some(PairFate::Neither));
    assert_eq!([&hit, &touched, &both].map(|outcome| tally(outcome.clone()).touched), [false, true, true]);
    let folder = tempfile::tempdir().unwrap();
    let rows = vec![OutcomeRow { result: Ok(touched), ..rows().swap_remove(0) }];
    let batch = &read(&write(folder.path(), "touch.parquet", rows))[0];
    let cell = |name: &str| array_value_to_string(batch.column_by_name(name).unwrap(), 0).unwrap();
    let names =
        ["collisions", "touches", "touch_relative_speed_mps", "ego_touched", "ego_collided", "impact_speed_mps"];
    assert_eq!(names.map(cell), ["0", "1", "0.25", "true", "false", "0.0"]);
}
