//! The commands as functions of another program, such as a Python program: keywords make the
//! arguments, and the result is a value.

use std::path::PathBuf;

use clap::Args;
use closecall_simulation::controller::exec::take_bad_ends;
use serde::Deserialize;
use serde_json::Value;

use super::CliError;
use super::backend::choose_backend;
use super::campaign::{CampaignArgs, run_campaign};
use super::command::ONNXRUNTIME_VARIABLE;
use super::keywords::arguments;
use super::output::warn;
use super::trajectories::{find_criticality, find_fit, find_lane_changes};
use crate::exit_code::ExitCode;

/// The arguments of a campaign, and of the networks that it runs.
#[derive(Debug, Args, Deserialize)]
struct Campaign {
    #[command(flatten)]
    #[serde(rename = "..campaign")]
    campaign: CampaignArgs,
    #[arg(long)]
    onnxruntime: Option<PathBuf>,
}

/// Calls a function with keywords, a JSON object, and returns its exit code and its result.
///
/// # Errors
/// A keyword is wrong, or the function has no result.
pub fn call(function: &str, keywords: &str) -> Result<(ExitCode, Value), CliError> {
    let answer = match function {
        "campaign" => return campaign(&arguments(keywords)?),
        "lane_changes" => find_lane_changes(&arguments(keywords)?),
        "criticality" => find_criticality(&arguments(keywords)?),
        "fit" => find_fit(&arguments(keywords)?),
        _ => return Err(CliError::usage(format!("there is no function `{function}`"))),
    };
    let answer = answer?;
    Ok((answer.code(), answer.value))
}

fn campaign(args: &Campaign) -> Result<(ExitCode, Value), CliError> {
    let from_environment = || std::env::var_os(ONNXRUNTIME_VARIABLE).map(PathBuf::from);
    choose_backend(args.onnxruntime.clone().or_else(from_environment).as_deref());
    let mut report = Value::Null;
    let code = run_campaign(&args.campaign, &mut |conclusion| report = conclusion.json());
    take_bad_ends().iter().for_each(warn);
    let code = code?;
    Ok((code, report))
}
