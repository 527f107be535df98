//! `closecall tool export`: writes a sample in formats of other tools.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use closecall_campaign::arguments::whole;
use closecall_campaign::runner::{Sampling, concrete, run_guarded};
use closecall_campaign::saved::SavedCampaign;
use closecall_report::exchange::{Case, CaseFiles, Form, Motion, write_case};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{RunKey, Scenario, ScenarioFile};
use closecall_simulation::Arm;
use closecall_traffic::Parameters;

use super::CliError;
use super::args::{SensorsChoice, SetArgs};
use super::arms::ControllerArgs;
use super::backend::check_backend_of;
use super::help::{examples, heading};
use super::output::{print_error, print_written, textln};
use super::protect::{files_of_campaign, files_of_controller, files_of_scenario, protect};
use super::saved::{TrustArgs, difference_from_journal};
use crate::exit_code::ExitCode;

/// The form of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FormChoice {
    /// Every vehicle follows the trajectory that it drove
    OpenLoop,
    /// Starts and manoeuvres with triggers; a controller drives the ego
    ClosedLoop,
    /// The closed loop with parameters, a value set and distributions
    Logical,
    /// CommonRoad XML 2020a: the other vehicles as they drove, and a planning problem for the ego
    Commonroad,
}

impl From<FormChoice> for Form {
    fn from(form: FormChoice) -> Self {
        match form {
            FormChoice::OpenLoop => Self::OpenLoop,
            FormChoice::ClosedLoop => Self::ClosedLoop,
            FormChoice::Logical => Self::Logical,
            FormChoice::Commonroad => Self::CommonRoad,
        }
    }
}

/// Arguments of `closecall tool export`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall tool export low-thw-overtake -o case",
    "closecall tool export closecall-results 34 -o case",
    "closecall tool export late-braking.toml 3 --seed 1 --form logical --value-sets 100 -o case",
]))]
pub(super) struct ExportArgs {
    /// Scenario file, name of a scenario of the library, or folder of a campaign
    #[arg(value_name = "SCENARIO|DIR")]
    source: PathBuf,
    /// Number of the sample
    #[arg(default_value_t = 0)]
    sample: u64,
    /// Folder for the case: OpenSCENARIO XML 1.3, OpenDRIVE 1.8 and a catalogue of vehicles, or
    /// CommonRoad XML
    #[arg(short, long = "out", alias = "output", value_name = "FOLDER", help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// Forms to write [default: open-loop,closed-loop,logical]
    #[arg(long = "form", value_enum, value_delimiter = ',', value_name = "FORM,…", help_heading = heading::OUTPUT)]
    forms: Vec<FormChoice>,
    /// Number of samples in the value set of the logical form, from SAMPLE on
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = whole::<u64, 1, 100_000>, help_heading = heading::OUTPUT)]
    value_sets: u64,
    /// Seed of the random numbers [default: 0, or the seed of the campaign]
    #[arg(long, value_parser = closecall_campaign::arguments::seed, help_heading = heading::SAMPLES)]
    seed: Option<u64>,
    /// Name of the scenario of a campaign; required if it has several
    #[arg(long, value_name = "NAME", help_heading = heading::SAMPLES)]
    scenario: Option<String>,
    /// Controller of the campaign's arm [default: the controller under test]
    #[arg(long, value_name = "NAME", help_heading = heading::CONTROLLER)]
    arm: Option<String>,
    #[command(flatten)]
    controller: ControllerArgs,
    /// Depth of the sensor simulation [default: as in the scenario]
    #[arg(long, value_enum, help_heading = heading::CONTROLLER)]
    sensors: Option<SensorsChoice>,
    #[command(flatten)]
    set: SetArgs,
    #[command(flatten)]
    trust: TrustArgs,
}

/// A sample that is to be exported.
struct Chosen {
    file: ScenarioFile,
    scenario: Scenario,
    key: RunKey,
    arm: Arm,
    value_sets: Vec<Parameters>,
    inputs: Vec<PathBuf>,
    /// The campaign whose run it is; `None` if it is no run of a campaign.
    campaign: Option<SavedCampaign>,
}

pub(super) fn export(args: &ExportArgs) -> Result<ExitCode, CliError> {
    if args.value_sets != 1 && !args.forms.is_empty() && !args.forms.contains(&FormChoice::Logical) {
        return Err(CliError::usage("--value-sets is of the logical form, and --form names others only"));
    }
    let chosen = if args.source.is_dir() { chosen_in_campaign(args)? } else { chosen_in_file(args)? };
    let forms = match args.forms.as_slice() {
        [] => Form::OPENSCENARIO.to_vec(),
        forms => forms.iter().map(|form| Form::from(*form)).collect(),
    };
    let Chosen { file, scenario, key, arm, value_sets, inputs, campaign } = &chosen;
    let written = forms.iter().flat_map(|form| form.files()).map(|name| args.output.join(name)).collect::<Vec<_>>();
    let outputs: Vec<_> = written.iter().map(|path| ("--out", Some(path.as_path()))).collect();
    protect(inputs, &outputs)?;
    check_backend_of(scenario, std::slice::from_ref(arm))?;
    let mut motion = Motion::default();
    let mut difference = None;
    if forms.iter().any(|form| form.needs_run()) {
        let outcome = run_guarded(scenario, *key, arm, &mut motion)
            .map_err(|source| CliError::Sample { sample: key.sample, source })?;
        let difference_from = |saved| difference_from_journal(saved, [&outcome]);
        difference = campaign.as_ref().map(difference_from).transpose()?.flatten();
    }
    let (controller, motion) = (arm.controller.name(), &motion);
    let files = Case { file, scenario, key: *key, controller, motion, value_sets }.files(&forms);
    must_leave_nothing(&files, &args.output)?;
    write_case(&args.output, &files)?;
    files.files.iter().for_each(|(name, _)| print_written(&args.output.join(name)));
    for (form, unsaid) in &files.unsaid {
        textln!("{}: not said in the file:", form.name());
        unsaid.iter().for_each(|statement| textln!("  {statement}"));
    }
    Ok(difference.map_or(ExitCode::Pass, |difference| {
        print_error(format_args!("{difference}\n"));
        ExitCode::Invalid
    }))
}

/// Returns an error if the folder has a file of an earlier case that would remain: it would be taken
/// for a file of this case.
fn must_leave_nothing(files: &CaseFiles, folder: &Path) -> Result<(), CliError> {
    match files.left_in(folder).first() {
        None => Ok(()),
        Some(left) => Err(CliError::usage(format!(
            "{} is of an earlier export, and would stay beside the new files: remove it, or name another folder",
            left.display()
        ))),
    }
}

fn chosen_in_file(args: &ExportArgs) -> Result<Chosen, CliError> {
    if args.scenario.is_some() || args.arm.is_some() {
        let path = args.source.display();
        return Err(CliError::usage(format!("--scenario and --arm belong to a campaign, and {path} is no folder")));
    }
    let file = args.set.load(&args.source)?;
    let seed = args.seed.unwrap_or_default();
    let end = args.sample.saturating_add(args.value_sets);
    let sampling = Sampling { seed, design: Design::Random, samples: end };
    let fail = |source| CliError::Sample { sample: args.sample, source };
    let scenario = concrete(&file, sampling, args.sample).map_err(fail)?;
    let drawn = (args.sample..end).map(|sample| file.space().sample(Design::Random, seed, sample, end));
    let arm = super::arms::arm(&args.controller.choice(file.config().function)?, args.sensors);
    let inputs = files_of_scenario(&file);
    let key = RunKey { seed, sample: args.sample };
    Ok(Chosen { value_sets: drawn.collect(), scenario, key, arm, inputs, file, campaign: None })
}

fn chosen_in_campaign(args: &ExportArgs) -> Result<Chosen, CliError> {
    if args.seed.is_some() || args.sensors.is_some() {
        return Err(CliError::usage("a campaign has its own seed and sensors: leave out --seed and --sensors"));
    }
    if args.controller.is_named() {
        return Err(CliError::usage(
            "a campaign has its own controllers: --arm names one of them, and not --controller",
        ));
    }
    let saved = args.trust.open(&args.source)?;
    saved.folder().check_journal()?;
    let name = args.scenario.as_deref();
    let (scenario, key) = saved.sample_with(name, args.sample, &args.set.settings)?;
    let file = saved.file(name)?;
    let file = ScenarioFile::parse(file.path(), file.text(), &args.set.settings)?;
    let manifest = saved.manifest();
    let sampling = manifest.sampling;
    let count = file.space().samples(sampling.design, sampling.samples);
    let end = args.sample.saturating_add(args.value_sets).min(count);
    let drawn = (args.sample..end).map(|sample| file.space().sample(sampling.design, key.seed, sample, count));
    let inputs = inputs_of(&args.source, manifest.arms.iter().flat_map(files_of_controller));
    let (value_sets, arm) = (drawn.collect(), saved.arm(args.arm.as_deref())?);
    let campaign = args.set.settings.is_empty().then_some(saved);
    Ok(Chosen { value_sets, arm, scenario, key, inputs, file, campaign })
}

fn inputs_of(folder: &Path, controllers: impl Iterator<Item = PathBuf>) -> Vec<PathBuf> {
    files_of_campaign(folder).into_iter().chain(controllers).collect()
}
