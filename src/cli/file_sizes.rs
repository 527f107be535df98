//! The limit of the size of a file (`RLIMIT_FSIZE`, which `ulimit -f` sets). A campaign whose
//! journal cannot have its size is refused before the first sample runs, and not in the middle of
//! them.
//!
//! The estimate is a lower one: a campaign that it refuses cannot come to its end. A campaign that
//! it lets run may still meet the limit, and then ends as on a full disk.

use std::io;
use std::path::Path;

use closecall_campaign::execution::Campaign;
use closecall_campaign::folder::REPORT;
use closecall_traffic::atomic::WriteError;
use closecall_traffic::words::counted;
use rustix::process::{Resource, getrlimit};

use super::CliError;

/// Bytes of the journal that one sample takes with one controller, at least. In `low-thw-overtake`
/// it takes 1,620 on average (docs/how-to/cluster.md). That three quarters of it suffice for a
/// scenario with few parameters is an assumption.
const JOURNAL_BYTES: u64 = 1_200;
/// Bytes of the report of a campaign, at least. The report of 100 pairs of `low-thw-overtake` has
/// 225,142. That half of it suffices for every campaign is an assumption.
const REPORT_BYTES: u64 = 112_000;

/// The largest file that a campaign writes.
#[derive(Clone, Debug, PartialEq, Eq)]
struct LargestFile {
    bytes: u64,
    /// What it holds.
    content: String,
}

impl LargestFile {
    /// Returns the largest file of a campaign. `samples` is `None` if the outcomes or the clock
    /// determine their number.
    fn of(samples: Option<u64>, arms: usize) -> Self {
        let controllers = counted(arms as u64, "controller");
        let journal = samples.map(|samples| Self {
            bytes: samples.saturating_mul(arms as u64).saturating_mul(JOURNAL_BYTES),
            content: format!("the journal of {} with {controllers}", counted(samples, "sample")),
        });
        let report = Self { bytes: REPORT_BYTES, content: REPORT.to_owned() };
        journal.filter(|journal| journal.bytes > report.bytes).unwrap_or(report)
    }

    /// Returns why the file cannot be written, if the limit (bytes) is too small for it.
    fn refusal(&self, limit_bytes: Option<u64>) -> Option<String> {
        let limit_bytes = limit_bytes.filter(|limit_bytes| *limit_bytes < self.bytes)?;
        let Self { bytes, content } = self;
        Some(format!(
            "no file may have more than {limit_bytes} bytes (`ulimit -f`), and {content} needs at least {bytes}: raise the limit, or \
             keep no results with --no-out"
        ))
    }
}

/// Checks that the files of a campaign fit the limit of their size. `has_open_end` says that the
/// outcomes or the clock determine the number of the samples.
pub(super) fn check_file_sizes(campaign: &Campaign, folder: &Path, has_open_end: bool) -> Result<(), CliError> {
    let samples = (!has_open_end).then(|| campaign.len());
    let arms = campaign.works.first().map_or(0, |work| work.arms.len());
    match LargestFile::of(samples, arms).refusal(getrlimit(Resource::Fsize).current) {
        Some(reason) => Err(WriteError::new(folder, io::Error::new(io::ErrorKind::FileTooLarge, reason)).into()),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_refused_only_below_what_the_largest_file_needs() {
        let journal = LargestFile::of(Some(1_000), 2);
        assert_eq!(journal.bytes, 2_400_000);
        for (limit_bytes, is_refused) in [(None, false), (Some(2_400_000), false), (Some(2_399_999), true)] {
            assert_eq!(journal.refusal(limit_bytes).is_some(), is_refused, "{limit_bytes:?}");
        }
        let reason = journal.refusal(Some(0)).unwrap();
        for said in ["more than 0 bytes", "`ulimit -f`", "1000 samples with 2 controllers", "at least 2400000"] {
            assert!(reason.contains(said), "{said}: {reason}");
        }
        // A campaign that may stop at any time needs the report alone.
        for few in [LargestFile::of(None, 2), LargestFile::of(Some(1), 1)] {
            assert_eq!((few.bytes, few.content.as_str()), (REPORT_BYTES, REPORT));
        }
        assert_eq!(LargestFile::of(Some(u64::MAX), 3).bytes, u64::MAX);
    }
}
