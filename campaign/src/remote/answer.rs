//! The results of a block as bytes, and their checks.
//!
//! ```text
//!  {"closecall_version":…,"configuration":…,"wall_s":[[…],…],"check_s":[…]}
//!  one line of the journal for each sample, with its checksum
//! ```

use closecall_scenarios::outcome::Outcome;
use serde::{Deserialize, Serialize};

use super::content::Content;
use crate::journal;
use crate::rare::Point;
use crate::record::Record;
use crate::runner::Work;
use crate::workers::{Finished, Samples};

/// The first line of an answer.
#[derive(Serialize, Deserialize)]
struct Header {
    /// The version of the program that has run the block.
    closecall_version: String,
    /// The configuration that it has run.
    configuration: String,
    /// Wall time of each sample in each arm (s).
    wall_s: Vec<Vec<f64>>,
    /// Wall time of the validity checks of each sample (s).
    check_s: Vec<f64>,
}

/// Returns the results of a block as bytes.
pub(super) fn encode(version: &str, configuration: &str, results: &[Finished]) -> serde_json::Result<Vec<u8>> {
    let header = Header {
        closecall_version: version.to_owned(),
        configuration: configuration.to_owned(),
        wall_s: results.iter().map(|finished| finished.wall_s.clone()).collect(),
        check_s: results.iter().map(|finished| finished.check_s).collect(),
    };
    let mut bytes = serde_json::to_vec(&header)?;
    bytes.push(b'\n');
    for finished in results {
        bytes.extend(journal::line(&finished.record).map_err(serde_json::Error::io)?);
    }
    Ok(bytes)
}

/// The expected answer to a block.
pub(super) struct Expected<'a> {
    pub(super) version: &'a str,
    pub(super) configuration: &'a str,
    pub(super) work: &'a Work,
    pub(super) content: &'a Content,
}

impl Expected<'_> {
    /// Returns the results of a block in the order of its samples or points. Returns the fault if a
    /// sample is missing, or if one is of another campaign.
    pub(super) fn decode(&self, bytes: &[u8]) -> Result<Vec<Finished>, String> {
        let mut lines = bytes.split_inclusive(|byte| *byte == b'\n');
        let header: Header = serde_json::from_slice(lines.next().unwrap_or_default())
            .map_err(|error| format!("the answer has no header: {error}"))?;
        let (here, there) = (self.version, &header.closecall_version);
        if there != here {
            return Err(format!("they were made by Closecall {there}, and this program is {here}"));
        }
        if header.configuration != self.configuration {
            return Err("they are of another configuration".to_owned());
        }
        let records = lines.map(journal::parse).collect::<Result<Vec<_>, _>>()?;
        let counts = [records.len(), header.wall_s.len(), header.check_s.len()];
        if counts != [self.content.len(); 3] {
            return Err(format!("there are {} instead of {}", records.len(), self.content.len()));
        }
        let mut results = Vec::with_capacity(records.len());
        let times = header.wall_s.into_iter().zip(header.check_s);
        for (index, (record, (wall_s, check_s))) in records.into_iter().zip(times).enumerate() {
            match self.content {
                Content::Samples(samples) => self.work.identity().check(&record, samples[index])?,
                Content::Points(points) => check_point(self.work, &record, index, &points[index])?,
            }
            results.push(Finished { record, wall_s, check_s });
        }
        Ok(results)
    }
}

/// Checks that a record belongs to the point with this index.
fn check_point(work: &Work, record: &Record, index: usize, point: &Point) -> Result<(), String> {
    let names = work.arms.iter().map(|arm| arm.controller.name());
    let is_run = record.arms.iter().map(|arm| arm.controller.as_str()).eq(names);
    if record.scenario != work.scenario() || record.sample != index as u64 || !is_run {
        return Err(format!("there is another run in the place of point {index}"));
    }
    let parameters = work.file.space().at_normals(&point.normals);
    let is_of_point = |outcome: &Outcome| {
        (outcome.seed, outcome.sample) == (work.sampling.seed, point.noise) && outcome.parameters == parameters
    };
    match record.arms.iter().filter_map(|arm| arm.result.as_ref().ok()).all(is_of_point) {
        true => Ok(()),
        false => Err(format!("the run of point {index} has another seed or other values")),
    }
}
