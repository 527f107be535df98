//! `closecall traffic calibrate`: fits car-following models to recorded pairs.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use closecall_recorded::following::read;
use closecall_report::{calibration, json::stamped};
use closecall_simulation::calibration::{FollowingModel, calibrate_watched};
use closecall_traffic::atomic::write_file;

use super::CliError;
use super::args::{Format, ReadFiles};
use super::help::{examples, heading};
use super::output::{outln, print_text, print_written};
use super::progress::watched;
use super::protect::{must_be_writable, protect};
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic calibrate`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic calibrate pairs.csv",
    "closecall traffic calibrate pairs.csv.gz --model wiedemann99",
    "closecall traffic calibrate one.csv two.csv -o member.toml --format json",
]))]
pub(super) struct CalibrateArgs {
    /// Files of recorded pairs: a table of pairs, or a platoon of the OpenACC database; plain or
    /// gzip
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Car-following model
    #[arg(long, value_enum, default_value_t = Model::Idm, help_heading = heading::METHOD)]
    model: Model,
    /// File for the pooled parameters, as a member of a driver ensemble
    /// (`closecall campaign --ensemble FILE`)
    #[arg(short, long = "out", alias = "output", value_name = "FILE.toml", help_heading = heading::OUTPUT)]
    output: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Model {
    Idm,
    Wiedemann99,
}

pub(super) fn calibrate(args: &CalibrateArgs) -> Result<ExitCode, CliError> {
    protect(&args.files, &[("--out", args.output.as_deref())])?;
    must_be_writable(args.output.as_deref())?;
    let data = read(&args.files)?;
    let mut files = ReadFiles::default();
    data.files.iter().try_for_each(|file| files.note(&file.path, &file.blake3))?;
    let model = match args.model {
        Model::Idm => FollowingModel::Idm,
        Model::Wiedemann99 => FollowingModel::Wiedemann99,
    };
    let result = watched("fits", |on_progress| calibrate_watched(model, &data, on_progress))
        .ok_or_else(|| CliError::Usage { message: calibration::no_pair(&data) })?;
    if let Some(path) = &args.output {
        let command = format!("closecall traffic calibrate --model {}", model.name());
        let member = calibration::member(&result, &data, &command);
        write_file(path, |file| file.write_all(member.as_bytes()))?;
        print_written(path);
    }
    match args.format {
        Format::Json => outln!("{:#}", stamped(calibration::json(&result, &data), None, None)),
        Format::Human => print_text(calibration::text(&result, &data)),
    }
    Ok(ExitCode::Pass)
}
