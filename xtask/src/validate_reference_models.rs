//! Compares the reference models of UN Regulation 157 with published outcomes of cut-ins.
//!
//! Usage: `cargo run --release -p closecall-xtask -- validate-reference-models FILE.csv[.gz]`. The
//! table has the columns of `docs/reference/controllers.md`; rows of models other than
//! `CC_human_driver` and `FSM` are left out. The exit code is 1 if fewer than 99 % of the cases
//! of a model have the same outcome, or if the table has no case of a model.

use std::error::Error;
use std::fs::File;
use std::io::Write as _;
use std::io::{Read, stdout};
use std::path::Path;
use std::process::ExitCode;

use closecall::controllers::reference::{CarefulDriver, CutIn, FuzzySafetyModel};
use csv::StringRecord;
use flate2::read::MultiGzDecoder;

/// Smallest share of equal outcomes of each model.
const NEEDED_SHARE: f64 = 0.99;
/// The names of the models in the table.
const MODELS: [&str; 2] = ["CC_human_driver", "FSM"];
/// The columns that are read: model, four numbers of the cut-in, and 1 for a crash.
const COLUMNS: [&str; 6] =
    ["model", "ego_speed_kmh", "cut_in_speed_kmh", "front_distance_m", "lateral_speed_mps", "crash"];

/// The number of cases of one model, and the number with the same outcome.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Agreement {
    pub(crate) cases: u64,
    pub(crate) same: u64,
}

pub(crate) fn main(words: Vec<String>) -> Result<ExitCode, Box<dyn Error>> {
    let Some(path) = words.into_iter().next() else { return Err("no file: expected FILE.csv or FILE.csv.gz".into()) };
    let path = Path::new(&path);
    let file = File::open(path).map_err(|error| format!("failed to open {}: {error}", path.display()))?;
    let is_packed = path.extension().is_some_and(|extension| extension == "gz");
    let source: Box<dyn Read> = if is_packed { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) };
    let agreements = compare(source).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut is_good = true;
    for (name, Agreement { cases, same }) in MODELS.into_iter().zip(agreements) {
        writeln!(stdout(), "{name}: {same} of {cases} cases with the same outcome")?;
        is_good &= cases > 0 && same as f64 >= NEEDED_SHARE * cases as f64;
    }
    Ok(if is_good { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Runs each case of a table again.
pub(crate) fn compare(source: impl Read) -> Result<[Agreement; 2], Box<dyn Error>> {
    let mut table = csv::Reader::from_reader(source);
    let headers = table.headers()?.clone();
    let mut columns = [0; 6];
    for (column, name) in columns.iter_mut().zip(COLUMNS) {
        *column = headers.iter().position(|header| header == name).ok_or_else(|| format!("no column `{name}`"))?;
    }
    let mut agreements = [Agreement::default(); 2];
    for row in table.records() {
        let row = row?;
        let Some(model) = MODELS.iter().position(|name| *name == &row[columns[0]]) else { continue };
        let cut_in = cut_in(&row, &columns)?;
        let collides = match model {
            0 => cut_in.ends_in_collision(&mut CarefulDriver::default()),
            _ => cut_in.ends_in_collision(&mut FuzzySafetyModel::default()),
        };
        agreements[model].cases += 1;
        agreements[model].same += u64::from(collides == (number(&row, columns[5])? != 0.0));
    }
    Ok(agreements)
}

/// Returns the cut-in of a row.
fn cut_in(row: &StringRecord, columns: &[usize; 6]) -> Result<CutIn, Box<dyn Error>> {
    Ok(CutIn {
        speed_mps: number(row, columns[1])? / 3.6,
        other_speed_mps: number(row, columns[2])? / 3.6,
        gap_m: number(row, columns[3])?,
        lateral_mps: number(row, columns[4])?,
    })
}

/// Returns the number in a column.
fn number(row: &StringRecord, column: usize) -> Result<f64, Box<dyn Error>> {
    let line = row.position().map_or(0, |position| position.line());
    row[column].parse().map_err(|_| format!("line {line}: `{}` is not a number", &row[column]).into())
}
