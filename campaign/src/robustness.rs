//! Studies how much noise and offset the criteria for lane changes tolerate, over several
//! trajectory files and on all processors.

use std::path::{Path, PathBuf};

use closecall_recorded::robustness::{CriterionCounts, Measured, Robustness, Setup, Study};
use closecall_recorded::trajectory_data::{ReadOptions, TrajectoryFileError, open};
use rayon::prelude::*;

/// The reason why files cannot be studied.
#[derive(Debug, thiserror::Error)]
pub enum RobustnessError {
    /// A trajectory file cannot be used.
    #[error(transparent)]
    TrajectoryData(#[from] TrajectoryFileError),
    /// The references of the files differ.
    #[error("in-car logs and recorded traffic have different references: study them separately")]
    Mixed,
    /// Two files have the same content: their lane changes would count twice.
    #[error("{} and {} have the same content", first.display(), second.display())]
    SameContent {
        /// The first of them.
        first: PathBuf,
        /// The other one.
        second: PathBuf,
    },
}

/// The study of one file.
struct FileStudy {
    study: Study,
    /// What a reader of results has to know of the file.
    warnings: Vec<String>,
    /// BLAKE3 hash of the file.
    hash: String,
}

/// Studies trajectory files, and calls `warn` with what a reader of the results has to know of
/// them. Returns the result of each file, and the result of all files together; `None` if there are
/// no files.
///
/// # Errors
/// [`RobustnessError`] if a file cannot be used, or if the files cannot be studied together.
pub fn robustness(
    files: &[PathBuf],
    options: ReadOptions,
    setup: &Setup,
    mut warn: impl FnMut(&Path, &str),
) -> Result<Option<(Vec<Robustness>, Robustness)>, RobustnessError> {
    let mut studies: Vec<FileStudy> = Vec::new();
    for path in files {
        let of_file = study_of(path, options)?;
        of_file.warnings.iter().for_each(|warning| warn(path, warning));
        if let Some(earlier) = studies.iter().position(|earlier| earlier.hash == of_file.hash) {
            return Err(RobustnessError::SameContent { first: files[earlier].clone(), second: path.clone() });
        }
        studies.push(of_file);
    }
    let (mut each, mut all): (Vec<Robustness>, Option<Robustness>) = (Vec::new(), None);
    for FileStudy { study, .. } in &studies {
        let experiments = Study::experiments(setup);
        // The results are in the order of the experiments for any number of threads.
        let results: Vec<Vec<CriterionCounts>> =
            experiments.par_iter().map(|experiment| study.run(experiment)).collect();
        let result = study.robustness(setup, &results);
        let fits = all.as_mut().is_none_or(|all| all.add(&result));
        if !fits {
            return Err(RobustnessError::Mixed);
        }
        all.get_or_insert_with(|| result.clone());
        each.push(result);
    }
    Ok(all.map(|all| (each, all)))
}

/// Reads one file.
fn study_of(path: &Path, options: ReadOptions) -> Result<FileStudy, TrajectoryFileError> {
    let mut tracks = open(path, options)?;
    let mut measured: Vec<Measured> = Vec::new();
    while let Some(track) = tracks.next_track()? {
        measured.push((track.trajectory, track.markings));
    }
    measured.sort_by_key(|(track, _)| track.track_id);
    let study = Study::with_lanes(options.lanes, measured, tracks.markings());
    Ok(FileStudy { study, warnings: tracks.warnings(), hash: tracks.hash() })
}
