//! What a campaign leaves in its folder once it is over, all made from its journal.

use std::collections::BTreeMap;
use std::fs;
use std::sync::Arc;

use closecall_traffic::ActorId;

use super::CliError;
use super::replay::record_sample;
use crate::campaign::folder::{Folder, FolderError};
use crate::campaign::manifest::Manifest;
use crate::campaign::record::Record;
use crate::campaign::runner::Work;
use crate::report::WriteError;
use crate::report::junit::write_junit;
use crate::report::outcomes::{OutcomeRow, parameter_columns, write_outcomes};
use crate::report::timings::{Timing, write_timings};
use crate::scenario::ScenarioFile;

/// Where recordings lie in a campaign's folder.
const RECORDINGS: &str = "recordings";

/// The recordings of failing samples: (scenario, sample, controller) to the path in the folder.
type Recordings = BTreeMap<(String, u64, String), String>;

/// Writes Parquet, recordings and JUnit, up to `recordings` failing samples of each scenario.
pub(super) fn reports(folder: &Folder, works: &[Arc<Work>], recordings: u64) -> Result<(), CliError> {
    let manifest = folder.manifest()?;
    let files: Vec<ScenarioFile> = works.iter().map(|work| work.file.clone()).collect();
    let files = &files[..];
    let nominal: Vec<_> = files.iter().map(|file| file.space().nominal()).collect();
    write_outcomes(&folder.file("outcomes.parquet"), &parameter_columns(&nominal), rows(folder, files, &manifest)?)?;
    write_timings(&folder.file("timings.parquet"), timings(folder, &manifest)?)?;
    let recorded = record_failures(folder, files, &manifest, recordings)?;
    let with_recordings = rows(folder, files, &manifest)?.map(|row| {
        row.map(|row| {
            let recording = recorded.get(&(row.scenario.clone(), row.sample, row.controller.clone())).cloned();
            (row, recording)
        })
    });
    write_junit(&folder.file("junit.xml"), with_recordings)?;
    Ok(())
}

/// The wall times, one row for each arm.
fn timings(folder: &Folder, manifest: &Manifest) -> Result<impl Iterator<Item = Timing> + use<>, CliError> {
    let controllers: Vec<String> = manifest.arms.iter().map(|arm| arm.name().to_owned()).collect();
    Ok(folder.wall_times()?.flat_map(move |time| {
        let of_arm = |(controller, wall_s): (&String, f64)| Timing {
            scenario: time.scenario.clone(),
            sample: time.sample,
            controller: controller.clone(),
            wall_s,
        };
        controllers.iter().zip(time.wall_s).map(of_arm).collect::<Vec<_>>()
    }))
}

/// The journal's records, one row for each arm.
fn rows<'a>(
    folder: &Folder,
    files: &'a [ScenarioFile],
    manifest: &'a Manifest,
) -> Result<impl Iterator<Item = Result<OutcomeRow, CliError>> + use<'a>, CliError> {
    let of_record = move |record: Result<Record, FolderError>| -> Vec<Result<OutcomeRow, CliError>> {
        let record = match record {
            Ok(record) => record,
            Err(error) => return vec![Err(error.into())],
        };
        let Some(ego) = ego(files, &record.scenario) else { return Vec::new() };
        let row = |arm: crate::campaign::record::ArmRecord| {
            Ok(OutcomeRow {
                scenario: record.scenario.clone(),
                ego: ego.clone(),
                seed: manifest.sampling.seed,
                sample: record.sample,
                controller: arm.controller,
                result: arm.result,
            })
        };
        record.arms.into_iter().map(row).collect()
    };
    Ok(folder.records()?.flat_map(of_record))
}

fn ego<'a>(files: &'a [ScenarioFile], scenario: &str) -> Option<&'a ActorId> {
    files.iter().find(|file| file.config().name == scenario)?.ego_id()
}

/// Runs the first failing samples of the arm under test again and records them.
fn record_failures(
    folder: &Folder,
    files: &[ScenarioFile],
    manifest: &Manifest,
    most: u64,
) -> Result<Recordings, CliError> {
    let path = folder.file(RECORDINGS);
    // The recordings of an earlier, identical campaign may have been more.
    if path.exists() {
        fs::remove_dir_all(&path).map_err(|source| WriteError::new(&path, source))?;
    }
    let mut recorded = Recordings::new();
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    for record in folder.records()? {
        let record = record?;
        let (Some(ego), Some(tested)) = (ego(files, &record.scenario), record.arms.last()) else { continue };
        let failed = tested.result.as_ref().is_ok_and(|outcome| outcome.ego_collided(ego));
        let count = counts.entry(record.scenario.clone()).or_default();
        if !failed || *count >= most {
            continue;
        }
        *count += 1;
        fs::create_dir_all(&path).map_err(|source| WriteError::new(&path, source))?;
        let name = format!("{RECORDINGS}/{}-{}-{}.rrd", record.scenario, record.sample, tested.controller);
        record_sample(folder, manifest, &record.scenario, record.sample, &folder.file(&name))?;
        recorded.insert((record.scenario.clone(), record.sample, tested.controller.clone()), name);
    }
    Ok(recorded)
}
