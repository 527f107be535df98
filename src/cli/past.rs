//! Campaigns that lie in a folder: what was run, read back from the manifest.

use std::path::Path;
use std::sync::Arc;

use super::CliError;
use super::args::{Sensing, arm};
use crate::campaign::folder::{Folder, FolderError};
use crate::campaign::manifest::{Manifest, ManifestScenario};
use crate::campaign::runner::Work;
use crate::campaign::summary::Summary;
use crate::report::overview::Overview;
use crate::scenario::ScenarioFile;
use crate::simulation::Arm;

/// The scenarios of a campaign, as it ran them. `folder` serves messages.
pub(super) fn works(folder: &Path, manifest: &Manifest) -> Result<Vec<Arc<Work>>, CliError> {
    let arms = arms(manifest)?;
    let work = |scenario| {
        let file = scenario_file(folder, scenario)?;
        Ok(Arc::new(Work { file, sampling: manifest.sampling, arms: arms.clone(), checks: manifest.checks }))
    };
    manifest.scenarios.iter().map(work).collect()
}

/// The arms of a campaign, the baseline first.
pub(super) fn arms(manifest: &Manifest) -> Result<Vec<Arm>, CliError> {
    let unknown = |name: &str| CliError::Usage { message: format!("the campaign's sensors `{name}` are not known") };
    let sensing = |name: &String| Sensing::from_name(name).ok_or_else(|| unknown(name));
    let sensing = manifest.sensors.as_ref().map(sensing).transpose()?;
    Ok(manifest.arms.iter().map(|controller| arm(controller, sensing)).collect())
}

/// A scenario as the campaign ran it.
pub(super) fn scenario_file(folder: &Path, scenario: &ManifestScenario) -> Result<ScenarioFile, CliError> {
    if blake3::hash(scenario.text.as_bytes()).to_string() != scenario.blake3 {
        let message = format!("the text of `{}` has been changed since the campaign was run", scenario.name);
        return Err(FolderError::Content { path: folder.join("manifest.json"), line: 1, message }.into());
    }
    let path = folder.join(format!("manifest.json#{}", scenario.name));
    Ok(ScenarioFile::parse(&path, &scenario.text, &[])?)
}

/// The counts of what the journal holds, and what its reports show.
pub(super) fn findings(folder: &Folder, works: &[Arc<Work>]) -> Result<(Summary, Overview), CliError> {
    let name = |arm: &Arm| arm.controller.name().to_owned();
    let names: Vec<String> = works.first().map_or_else(Vec::new, |work| work.arms.iter().map(name).collect());
    let mut overview = Overview::new(works.iter().map(|work| &work.file), &names);
    let mut summary = Summary::new(names).with_inference(folder.manifest()?.inference);
    let mut records = folder.records()?.peekable();
    for work in works {
        let name = &work.file.config().name;
        summary.begin(name);
        while let Some(record) =
            records.next_if(|record| record.as_ref().map_or(true, |record| record.scenario == *name))
        {
            let record = record?;
            overview.take(&record);
            if let Some(ego) = work.file.ego_id() {
                summary.take(&record, ego);
            }
        }
    }
    Ok((summary, overview))
}
