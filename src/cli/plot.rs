//! `closecall plot`: draws an encounter as a static figure.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::runner::{Sampling, concrete};
use closecall_report::run::figure::{PictureFile, encounter, parse_width_mm};
use closecall_report::run::film::{Film, Level, film_arms};
use closecall_scenarios::Scenario;
use closecall_scenarios::causal::LETTERS;
use closecall_scenarios::sampling::Design;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::{Arm, RunKey};

use super::CliError;
use super::args::SetArgs;
use super::arms::{ArmArgs, ComparisonArgs};
use super::backend::check_backend_of;
use super::help::{examples, heading};
use super::output::{during, print_error, print_written, textln};
use super::protect::{files_of_campaign, files_of_scenario, protect};
use super::saved::{TrustArgs, check_record, difference_from_journal};
use crate::exit_code::ExitCode;

/// Arguments of `closecall plot`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall plot low-thw-overtake -o encounter.svg",
    "closecall plot closecall-results 34 -o sample-34.pdf",
    "closecall plot low-thw-overtake --sample 7 --paired --width-mm 160 -o pair.png",
]))]
pub(super) struct PlotArgs {
    /// Scenario file, name of a scenario of the library, or the folder of a campaign
    source: PathBuf,
    /// Number of the sample; required for the folder of a campaign
    #[arg(value_name = "SAMPLE")]
    number: Option<u64>,
    /// Number of the sample, as an option
    #[arg(long, conflicts_with = "number", help_heading = heading::SAMPLES)]
    sample: Option<u64>,
    /// Seed of the random numbers [default: 0; a campaign has its own seed]
    #[arg(long, help_heading = heading::SAMPLES)]
    seed: Option<u64>,
    /// Name of the scenario; required if the campaign has several
    #[arg(long, help_heading = heading::SAMPLES)]
    scenario: Option<String>,
    #[command(flatten)]
    comparison: ComparisonArgs,
    #[command(flatten)]
    arm: ArmArgs,
    #[command(flatten)]
    trust: TrustArgs,
    #[command(flatten)]
    set: SetArgs,
    /// File to write; its extension, .svg, .png or .pdf, determines the format
    #[arg(short, long = "out", alias = "output", value_name = "FILE.svg|FILE.png|FILE.pdf", value_parser = PictureFile::parse, help_heading = heading::OUTPUT)]
    output: PictureFile,
    /// Width on paper in mm, from 50 to 1200; of a PNG file at 300 pixels per inch [default: 900 px
    /// of CSS, 238 mm]
    #[arg(long, value_name = "MM", value_parser = parse_width_mm, help_heading = heading::OUTPUT)]
    width_mm: Option<f32>,
}

pub(super) fn plot(args: &PlotArgs) -> Result<ExitCode, CliError> {
    let (films, difference) =
        if args.source.is_dir() { films_of_campaign(args)? } else { (films_of_scenario(args)?, None) };
    args.output.write(&encounter(&films), args.width_mm)?;
    for film in &films {
        textln!("{}: {}", film.title(), film.headline());
    }
    textln!("{LETTERS}");
    print_written(args.output.path());
    Ok(difference.map_or(ExitCode::Pass, |difference| {
        print_error(format_args!("{difference}\n"));
        ExitCode::Invalid
    }))
}

/// Films a sample of a scenario file, in every arm.
fn films_of_scenario(args: &PlotArgs) -> Result<Vec<Film>, CliError> {
    if args.scenario.is_some() {
        return Err(CliError::usage("--scenario chooses a scenario of a campaign: name its folder instead of a file"));
    }
    let (set, of_arms) = args.set.by_arm();
    let file = set.load(&args.source)?;
    protect(
        &[files_of_scenario(&file), args.comparison.files(&args.arm)].concat(),
        &[("--out", Some(args.output.path()))],
    )?;
    let (seed, sample) = (args.seed.unwrap_or(0), args.number.or(args.sample).unwrap_or(0));
    let sampling = Sampling { seed, design: Design::Random, samples: sample.saturating_add(1) };
    let scenario = concrete(&file, sampling, sample).map_err(|source| CliError::Sample { sample, source })?;
    films(&scenario, RunKey { seed, sample }, &args.comparison.arms(&args.arm, &file, &of_arms)?)
}

/// Films a sample of a campaign as the campaign ran it, in every arm. Returns the films, and a message
/// if one of them is another run than the campaign's.
fn films_of_campaign(args: &PlotArgs) -> Result<(Vec<Film>, Option<String>), CliError> {
    if args.seed.is_some() || !args.set.settings.is_empty() {
        return Err(CliError::usage("a campaign has its own seed and settings: --seed and --set cannot change them"));
    }
    if !args.comparison.arms.is_empty() {
        return Err(CliError::usage("a campaign has its own arms, and all are drawn: --arms cannot change them"));
    }
    if args.arm.controller.is_named() || args.arm.sensors.is_some() {
        return Err(CliError::usage(
            "a campaign has its own controllers and sensors: --controller and --sensors cannot change them",
        ));
    }
    let Some(sample) = args.number.or(args.sample) else {
        return Err(CliError::usage(
            "a campaign has many samples: name one, as `closecall plot DIR SAMPLE -o FILE.svg`",
        ));
    };
    protect(&files_of_campaign(&args.source), &[("--out", Some(args.output.path()))])?;
    let (timeout_ms, memory_mib) = args.arm.controller.limits.stated();
    let mut saved = args.trust.open(&args.source)?;
    saved.limit(timeout_ms, memory_mib);
    let mut arms = saved.arms()?;
    let (scenario, key) = saved.sample(args.scenario.as_deref(), sample)?;
    check_record(saved.folder(), &scenario.name, sample)?;
    if args.comparison.paired && arms.len() < 2 {
        let sensors = arms.first().and_then(|tested| tested.sensors);
        arms.insert(0, Arm { controller: ControllerChoice::ACC.factory(), sensors });
    }
    let films = films(&scenario, key, &arms)?;
    let difference = difference_from_journal(&saved, films.iter().filter_map(Film::outcome))?;
    Ok((films, difference))
}

fn films(scenario: &Scenario, key: RunKey, arms: &[Arm]) -> Result<Vec<Film>, CliError> {
    check_backend_of(scenario, arms)?;
    let work = format!("running sample {} of {}", key.sample, scenario.name);
    during(work, || film_arms(scenario, key, arms, Level::Objects))
        .map_err(|source| CliError::Sample { sample: key.sample, source })
}
