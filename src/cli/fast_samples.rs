//! `closecall campaign --fidelity MODE:FACTOR`: runs the samples of a campaign again, and more samples,
//! with fast sensors.
//!
//! ```text
//!  DIR           samples 0 … n         ─┐
//!  DIR/fidelity  samples 0 … n · FACTOR ─┴▶ DIR/fidelity.json, and the reports
//! ```
//!
//! The fast samples run after the campaign, in a folder of the same form: they are resumed, divided
//! among machines and merged like any campaign. The rates that follow from both are printed, but no
//! gate judges them. A gate needs a guaranteed bound, and the estimate is a normal approximation whose
//! coverage is tested. Gates judge the samples of the campaign alone.

use std::fmt;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

use closecall_campaign::execution::CampaignError;
use closecall_campaign::failures::Failures;
use closecall_campaign::folder::{FAST_SAMPLES, Folder, LockedFolder, MANIFEST};
use closecall_campaign::manifest::Manifest;
use closecall_campaign::merge::Parts;
use closecall_campaign::plan::Plan;
use closecall_campaign::remote::connect;
use closecall_campaign::runner::Work;
use closecall_campaign::saved::{SavedCampaign, works};
use closecall_campaign::session;
use closecall_campaign::summary::Summary;
use closecall_report::campaign::fidelity_text;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_studies::fidelity::Fidelity;
use closecall_traffic::words::counted;
use serde_json::{Value, json};

use super::CliError;
use super::argument::Argument;
use super::campaign::{Companion, Planned, progress_bar};
use super::file_sizes::check_file_sizes;
use super::output::{heartbeat, print_error};
use super::results::{Place, remember, remember_here};
use crate::exit_code::ExitCode;

/// The modes that can be fast, the slower one first.
const FAST_MODES: [SensorMode; 2] = [SensorMode::Object, SensorMode::GroundTruth];
/// Smallest number of fast samples, relative to the samples of the campaign. A factor of 1 would add
/// no sample.
const LEAST_FACTOR: u64 = 2;

/// The fast sensors of a campaign, and the number of its fast samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FidelityChoice {
    mode: SensorMode,
    /// Number of fast samples, relative to the samples of the campaign.
    factor: u64,
}

impl fmt::Display for FidelityChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.mode.name(), self.factor)
    }
}

impl FromStr for FidelityChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is not MODE:FACTOR, such as `object:20`: MODE is `object` or `ground-truth`, FACTOR a whole number of \
                 {LEAST_FACTOR} or more"
            )
        };
        let (mode, factor) = text.split_once(':').ok_or_else(wrong)?;
        let mode = FAST_MODES.into_iter().find(|fast| fast.name() == mode).ok_or_else(wrong)?;
        let factor: Option<u64> = factor.parse().ok();
        let factor = factor.filter(|factor| *factor >= LEAST_FACTOR).ok_or_else(wrong)?;
        Ok(Self { mode, factor })
    }
}

impl FidelityChoice {
    /// Refuses a campaign whose samples are not independent, whose number of samples is not fixed, or
    /// that keeps no results.
    pub(super) fn check(self, design: Design, is_sequential: bool, place: Place<'_>) -> Result<(), CliError> {
        let option = Argument("fidelity");
        if design != Design::Random {
            return Err(CliError::usage(format!(
                "{option} needs independent samples: the design `random` draws them, and `{design}` does not"
            )));
        }
        if is_sequential {
            let (certain, budget) = (Argument("until-certain"), Argument("time-budget"));
            return Err(CliError::usage(format!(
                "{option} needs a number of samples that is fixed in advance: it cannot be used with {certain} or {budget}"
            )));
        }
        if place == Place::Nowhere {
            return Err(CliError::usage(format!(
                "{option} keeps its fast samples in the folder of the results: leave out {}",
                Argument("no-out")
            )));
        }
        Ok(())
    }

    /// Returns the plan of the fast samples.
    fn plan(self, plan: &Plan) -> Result<Plan, CliError> {
        let option = Argument("fidelity");
        let no_slower = FAST_MODES.into_iter().skip_while(|mode| *mode != self.mode);
        for mode in no_slower {
            if let Some(scenario) = plan.scenario_in(mode) {
                return Err(CliError::usage(format!(
                    "{option} {self}: {scenario} may run with the sensors `{}`, and `{}` would be no faster: name slower sensors with {}",
                    mode.name(),
                    self.mode.name(),
                    Argument("sensors")
                )));
            }
        }
        let (number, factor) = (plan.sampling().samples, self.factor);
        let Some(samples) = number.checked_mul(factor) else {
            return Err(CliError::usage(format!("{option} {self}: {factor} times {number} samples are too many")));
        };
        Ok(plan.with_sensors(self.mode, samples)?)
    }
}

/// The fast samples of a running campaign.
pub(super) struct FastSamples<'a> {
    plan: Plan,
    /// The cluster that runs the samples, if this machine does not.
    ray: Option<&'a str>,
    retry_errors: bool,
    /// Folder of the fast samples, with its manifest; `None` if the results are not kept.
    kept: Option<(LockedFolder, Manifest)>,
    /// Number of fast samples that are done.
    done: u64,
    /// Why fast samples have no outcome, scenario by scenario.
    failures: Vec<Failures>,
    /// The rates, and their text.
    rates: Option<(Fidelity, String)>,
}

impl<'a> FastSamples<'a> {
    /// Plans the fast samples of a campaign.
    pub(super) fn new(choice: FidelityChoice, planned: &Planned<'a>) -> Result<Self, CliError> {
        let plan = choice.plan(planned.plan)?;
        let retry_errors = planned.end.retry_errors;
        Ok(Self { plan, ray: planned.ray, retry_errors, kept: None, done: 0, failures: Vec::new(), rates: None })
    }
}

impl Companion for FastSamples<'_> {
    fn begin(&mut self, folder: &Folder) -> Result<(), CliError> {
        let path = folder.file(FAST_SAMPLES);
        check_file_sizes(&self.plan.campaign(), &path, false)?;
        let manifest = self.plan.manifest(session::arguments())?;
        // The folder of the campaign is new or is resumed. The same is true of the fast samples.
        let locked = Folder::lock(&path, &manifest, true)?;
        remember_here(&locked.folder, &manifest);
        self.kept = Some((locked, manifest));
        Ok(())
    }

    fn end(&mut self, folder: &Folder) -> Result<(), CliError> {
        let Some((locked, manifest)) = &self.kept else { return Ok(()) };
        let mut campaign = self.plan.campaign();
        campaign.retry_errors = self.retry_errors;
        campaign.remote = connect(self.ray, manifest).map_err(CampaignError::from)?;
        session::stop_on_request(&mut campaign.stop);
        let (samples, mode) = (counted(campaign.len(), "sample"), self.plan.sensors.map_or("", SensorMode::name));
        print_error(format_args!("{samples} with the sensors `{mode}`\n"));
        let bar = progress_bar(campaign.len());
        let heartbeat = heartbeat(&bar);
        let (done, failures) = (&mut self.done, &mut self.failures);
        failures.resize(campaign.works.len(), Failures::default());
        let resumption = campaign.run(Some(locked), |next| {
            *done += 1;
            failures[next.work].push(next.record);
            bar.inc(1);
            session::report(bar.position(), bar.length().unwrap_or_default());
            if !next.is_new {
                // Records read from a file say nothing about how long the rest will take.
                bar.reset_eta();
            }
            ControlFlow::Continue(())
        })?;
        drop(heartbeat);
        bar.finish_and_clear();
        for message in resumption.messages() {
            print_error(format_args!("{FAST_SAMPLES}: {message}\n"));
        }
        // The rates leave these samples out.
        for (work, failures) in campaign.works.iter().zip(&self.failures) {
            for failure in failures.iter() {
                print_error(format_args!("{FAST_SAMPLES}: {}: {failure}\n", work.file.config().name));
            }
        }
        if campaign.stop.is_set() || manifest.partition.is_some() {
            return Ok(());
        }
        let fidelity = write_rates(folder, &locked.folder)?;
        let text = fidelity_text(folder, &fidelity);
        self.rates = Some((fidelity, text));
        Ok(())
    }

    fn samples(&self) -> [u64; 2] {
        [self.done, self.plan.campaign().len()]
    }

    fn text(&self, _: &Summary) -> String {
        match (&self.rates, &self.kept) {
            (Some((_, text)), _) => text.clone(),
            (None, Some((_, manifest))) if manifest.partition.is_some() => {
                "rates with fast sensors: `closecall tool merge` estimates them from all parts\n".to_owned()
            }
            (None, _) => "rates with fast sensors: none, because the results are not kept\n".to_owned(),
        }
    }

    fn json(&self) -> Option<(&'static str, Value)> {
        self.rates.as_ref().map(|(fidelity, _)| ("fidelity", json!(fidelity)))
    }

    fn code(&self, code: ExitCode) -> ExitCode {
        code
    }
}

/// Estimates the rates of a campaign with its fast samples, and writes them into its folder.
fn write_rates(folder: &Folder, fast: &Folder) -> Result<Fidelity, CliError> {
    let (full, fast) = (SavedCampaign::of(folder.clone())?, SavedCampaign::of(fast.clone())?);
    let fidelity = Fidelity::of(&full, &fast)?;
    fidelity.write(folder)?;
    Ok(fidelity)
}

/// The fast samples of all parts of a campaign.
pub(super) struct FastParts {
    parts: Parts,
    works: Vec<Arc<Work>>,
}

impl FastParts {
    /// Opens the fast samples of the folders of all parts of a campaign. Returns `None` if no part
    /// has any.
    pub(super) fn open(folders: &[PathBuf]) -> Result<Option<Self>, CliError> {
        let fast: Vec<PathBuf> = folders.iter().map(|folder| folder.join(FAST_SAMPLES)).collect();
        let lacks = |fast: &&PathBuf| !fast.join(MANIFEST).is_file();
        let without: Vec<&PathBuf> = fast.iter().filter(lacks).collect();
        if without.len() == fast.len() {
            return Ok(None);
        }
        if let Some(missing) = without.first() {
            return Err(CliError::usage(format!(
                "{} is missing, and other parts have fast samples: run the part again with --fidelity and --resume",
                missing.display()
            )));
        }
        let parts = Parts::open(&fast)?;
        let works = works(&fast[0], parts.manifest())?;
        parts.check(&works)?;
        Ok(Some(Self { parts, works }))
    }

    /// Writes the fast samples into the folder of the merged campaign, estimates its rates, and
    /// returns them with their text. `is_own` says that the folder is the user's own.
    pub(super) fn merge(&self, merged: &Folder, resume: bool, is_own: bool) -> Result<(Fidelity, String), CliError> {
        let locked = self.parts.merge(&self.works, &merged.file(FAST_SAMPLES), session::arguments(), resume)?;
        if is_own {
            remember(&locked.folder);
        }
        let fidelity = write_rates(merged, &locked.folder)?;
        let text = fidelity_text(merged, &fidelity);
        Ok((fidelity, text))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_choice_has_a_fast_mode_and_a_factor() {
        for text in ["object:20", "ground-truth:2"] {
            assert_eq!(text.parse::<FidelityChoice>().unwrap().to_string(), text);
        }
        for wrong in
            ["object", "full:20", "object:1", "object:0", "object:-2", "object:2.5", "object:", ":20", "20:object", ""]
        {
            let error = wrong.parse::<FidelityChoice>().unwrap_err();
            assert!(error.starts_with(&format!("`{wrong}` is not MODE:FACTOR")), "{error}");
        }
    }

    #[test]
    fn a_campaign_without_a_fixed_number_of_independent_samples_is_refused() {
        let choice: FidelityChoice = "object:20".parse().unwrap();
        let folder = Place::Named(Path::new("x"));
        choice.check(Design::Random, false, folder).unwrap();
        choice.check(Design::Random, false, Place::Default).unwrap();
        for (design, is_sequential, place, expected) in [
            (Design::Sobol, false, folder, "the design `random` draws them, and `sobol` does not"),
            (Design::Grid, false, folder, "`grid` does not"),
            (Design::Coverage, false, folder, "`coverage` does not"),
            (Design::Random, true, folder, "--until-certain or --time-budget"),
            (Design::Random, false, Place::Nowhere, "leave out --no-out"),
        ] {
            let error = choice.check(design, is_sequential, place).unwrap_err().to_string();
            assert!(error.contains(expected), "{expected}: {error}");
        }
    }
}
