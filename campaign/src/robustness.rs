//! Studies how much noise and offset the criteria for lane changes tolerate, over several
//! trajectory files and on all processors.

use std::path::{Path, PathBuf};

use closecall_recorded::robustness::{CriterionCounts, Measured, Robustness, Setup, Study};
use closecall_recorded::trajectory_data::{Layout, ReadOptions, Tracks, TrajectoryFileError, open};
use rayon::prelude::*;

/// The reason why files cannot be studied.
#[derive(Debug, thiserror::Error)]
pub enum RobustnessError {
    /// A trajectory file cannot be used.
    #[error(transparent)]
    TrajectoryData(#[from] TrajectoryFileError),
    /// The references of the files differ.
    #[error(
        "the references of the files differ, because an in-car log, recorded lanes, estimated lanes and lanes that nothing shows each \
         have their own: study them separately"
    )]
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

/// Number of rows whose tracks are studied at once, so that their memory does not grow with the file.
const ROWS_AT_ONCE: usize = 1 << 17;

/// The results of a study.
#[derive(Clone, Debug)]
pub struct StudiedFiles {
    /// The result of each file.
    pub each: Vec<Robustness>,
    /// The result of all files together.
    pub all: Robustness,
    /// `true` if a warning says why lane changes of a file may be wrong or missing.
    pub is_in_doubt: bool,
}

/// The study of one file.
struct FileStudy {
    result: Robustness,
    /// What a reader of results has to know of the file.
    warnings: Vec<String>,
    is_in_doubt: bool,
    /// BLAKE3 hash of the file.
    hash: String,
}

/// Studies trajectory files, and calls `warn` with what a reader of the results has to know of
/// them. Returns `None` if there are no files.
///
/// # Errors
/// [`RobustnessError`] if a file cannot be used, or if the files cannot be studied together.
pub fn robustness(
    files: &[PathBuf],
    options: ReadOptions,
    setup: &Setup,
    mut warn: impl FnMut(&Path, &str),
) -> Result<Option<StudiedFiles>, RobustnessError> {
    let mut hashes: Vec<String> = Vec::new();
    let mut studied: Option<StudiedFiles> = None;
    for path in files {
        let tracks = open(path, options)?;
        let FileStudy { result, warnings, is_in_doubt, hash } = study_of(tracks, setup, ROWS_AT_ONCE)?;
        warnings.iter().for_each(|warning| warn(path, warning));
        if let Some(earlier) = hashes.iter().position(|earlier| *earlier == hash) {
            return Err(RobustnessError::SameContent { first: files[earlier].clone(), second: path.clone() });
        }
        hashes.push(hash);
        match &mut studied {
            None => studied = Some(StudiedFiles { each: vec![result.clone()], all: result, is_in_doubt }),
            Some(studied) => {
                if !studied.all.add(&result) {
                    return Err(RobustnessError::Mixed);
                }
                studied.each.push(result);
                studied.is_in_doubt |= is_in_doubt;
            }
        }
    }
    Ok(studied)
}

/// Studies one file, the tracks of some rows at a time.
fn study_of(mut tracks: Tracks<'_>, setup: &Setup, rows_at_once: usize) -> Result<FileStudy, TrajectoryFileError> {
    let mut all = result_of(&tracks, Vec::new(), setup);
    let (mut measured, mut rows): (Vec<Measured>, usize) = (Vec::new(), 0);
    loop {
        let next = tracks.next_track()?;
        let is_last = next.is_none();
        if let Some(track) = next {
            rows += track.trajectory.points.len();
            measured.push((track.trajectory, track.markings));
        }
        if is_last || rows >= rows_at_once {
            rows = 0;
            let result = result_of(&tracks, std::mem::take(&mut measured), setup);
            // The file determines the kind of the reference, so that all results fit together.
            let _fits = all.add(&result);
        }
        if is_last {
            break;
        }
    }
    Ok(FileStudy { result: all, warnings: tracks.warnings(), is_in_doubt: tracks.is_in_doubt(), hash: tracks.hash() })
}

/// Studies some tracks of a file.
fn result_of(tracks: &Tracks<'_>, measured: Vec<Measured>, setup: &Setup) -> Robustness {
    let lanes = (tracks.layout() != Layout::InCar).then(|| tracks.lanes());
    let study = Study::of_file(lanes, measured, tracks.markings());
    // The results are in the order of the experiments for any number of threads.
    let results: Vec<Vec<CriterionCounts>> =
        Study::experiments(setup).par_iter().map(|experiment| study.run(experiment)).collect();
    study.robustness(setup, &results)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use closecall_recorded::lane_change::LaneReliability;
    use closecall_recorded::robustness::ReferenceKind;
    use closecall_recorded::trajectory_data::open_from;

    use super::*;

    /// Traffic in three lanes. Every sixth vehicle changes to the lane beside it.
    fn traffic() -> String {
        let mut text =
            "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
        for vehicle in 0..36_u32 {
            let lane = f64::from(vehicle % 3);
            for frame in 0..150 {
                let time_s = 0.1 * f64::from(frame);
                let tau = if vehicle % 6 == 1 { ((time_s - 4.0) / 5.0).clamp(0.0, 1.0) } else { 0.0 };
                let share = tau * tau * tau * (10.0 - 15.0 * tau + 6.0 * tau * tau);
                let right_m = 3.5 * (lane + 0.5 + share);
                let (s_m, lane) = (40.0 * f64::from(vehicle) + 25.0 * time_s, (right_m / 3.5).ceil());
                writeln!(text, "{vehicle},{frame},{time_s:.1},{s_m:.2},{right_m:.3},{lane},25,0,4.5,1.8,car").unwrap();
            }
        }
        text
    }

    #[test]
    fn a_file_studied_in_pieces_has_the_result_of_the_whole_by_the_lanes_that_the_traffic_shows() {
        let setup =
            Setup { noise_m_per_sqrt_s: vec![0.0, 0.5], offset_m: vec![0.0, 1.0], repetitions: 2, ..Setup::default() };
        for (lanes, kind) in [
            (LaneReliability::Reliable, ReferenceKind::RecordedLanes),
            (LaneReliability::Unreliable, ReferenceKind::EstimatedLanes),
        ] {
            let [whole, pieces] = [usize::MAX, 1_000].map(|rows_at_once| {
                let options = ReadOptions { lanes, ..ReadOptions::default() };
                let text = traffic();
                let tracks = open_from(text.as_bytes(), Path::new("a.csv"), options, usize::MAX).unwrap();
                study_of(tracks, &setup, rows_at_once).unwrap()
            });
            assert_eq!((whole.result.reference_kind, whole.result.reference), (kind, 6));
            assert_eq!(whole.result, pieces.result);
            assert!(!whole.is_in_doubt, "{:?}", whole.warnings);
        }
    }
}
