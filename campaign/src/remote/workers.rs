//! Cuts a campaign into blocks of samples, and puts their results in order.
//!
//! The number of samples in a block follows from how long the samples before have taken: a block
//! takes about a second, so that little is lost with a machine, and the cost of a block is small
//! beside it. No result depends on it.

use std::collections::VecDeque;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::answer::Expected;
use super::content::Content;
use super::engine::Cluster;
use super::error::RemoteError;
use crate::campaign_error::CampaignError;
use crate::manifest::Manifest;
use crate::rare::{Point, PointRunner};
use crate::runner::Work;
use crate::stop::StopFlag;
use crate::workers::{Finished, OnFinished, SampleRunner, Samples};

/// Time that a block is to take (s).
const BLOCK_S: f64 = 1.0;
/// Number of samples in a block, as long as no sample is done.
const FIRST_BLOCK: usize = 4;
/// Largest number of samples in a block.
const LARGEST_BLOCK: usize = 1_000;
/// Number of blocks that are submitted for each that can run at the same time. Those that wait show
/// the cluster that it may grow.
const BLOCKS_PER_SLOT: usize = 2;
/// Number of blocks that are submitted in addition, so that a cluster without machines grows, too.
const SPARE_BLOCKS: usize = 16;
/// Number of samples, and of further ones for each block that can run at the same time, that may be
/// ahead of the last result returned. They wait in memory if a machine has failed and its block
/// runs again.
const WINDOW: usize = 20_000;
const WINDOW_PER_SLOT: usize = 1_000;
/// Longest time between two looks at the request to stop.
const POLL_INTERVAL: Duration = Duration::from_millis(100);
/// Time that blocks have to end after a stop was requested. The rest run again on resuming.
const STOP_TIMEOUT: Duration = Duration::from_secs(5);

/// The machines of a cluster that run the samples of one campaign.
pub struct RemoteWorkers {
    cluster: Box<dyn Cluster>,
    version: String,
    configuration: String,
    /// Number of blocks submitted so far, over all scenarios.
    blocks: AtomicU64,
}

impl fmt::Debug for RemoteWorkers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RemoteWorkers").field("configuration", &self.configuration).finish_non_exhaustive()
    }
}

impl Drop for RemoteWorkers {
    fn drop(&mut self) {
        self.cluster.close();
    }
}

/// A block that was submitted.
struct Block {
    id: u64,
    content: Content,
    results: Option<Vec<Finished>>,
}

/// How long the samples have taken.
#[derive(Default)]
struct Pace {
    samples: usize,
    spent_s: f64,
}

impl Pace {
    fn push(&mut self, results: &[Finished]) {
        self.samples += results.len();
        self.spent_s += results.iter().map(|done| done.wall_s.iter().sum::<f64>() + done.check_s).sum::<f64>();
    }

    /// Returns the number of samples of the next block.
    fn block_len(&self) -> usize {
        if self.samples == 0 {
            return FIRST_BLOCK;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
        let fitting = (BLOCK_S * self.samples as f64 / self.spent_s) as usize;
        fitting.clamp(1, LARGEST_BLOCK)
    }
}

impl SampleRunner for RemoteWorkers {
    fn run(
        &self,
        (number, work): (usize, &Arc<Work>),
        samples: &mut dyn Iterator<Item = u64>,
        stop: &StopFlag,
        on_finished: &mut OnFinished<'_>,
    ) -> Result<(), CampaignError> {
        let mut next = |most: usize| Content::Samples((&mut *samples).take(most).collect());
        let done = self.run_blocks(number, work, &mut next, stop, on_finished);
        // After an error, a stop or an end before the last sample, blocks are left.
        self.cluster.cancel();
        done
    }
}

impl PointRunner for RemoteWorkers {
    fn run_points(
        &self,
        (number, work): (usize, &Arc<Work>),
        points: &[Point],
        stop: &StopFlag,
        on_finished: &mut OnFinished<'_>,
    ) -> Result<(), CampaignError> {
        let mut rest = points.iter().cloned();
        let mut next = |most: usize| Content::Points(rest.by_ref().take(most).collect());
        let done = self.run_blocks(number, work, &mut next, stop, on_finished);
        self.cluster.cancel();
        done
    }
}

/// Returns the content of the next block, of at most this many samples or points; an empty one if
/// there are no more.
type NextContent<'a> = dyn FnMut(usize) -> Content + 'a;

impl RemoteWorkers {
    /// Returns the workers of a cluster for the campaign of `manifest`.
    pub fn new(cluster: Box<dyn Cluster>, manifest: &Manifest) -> Self {
        let (version, configuration) = (manifest.closecall_version.clone(), manifest.configuration());
        Self { cluster, version, configuration, blocks: AtomicU64::new(0) }
    }

    fn run_blocks(
        &self,
        number: usize,
        work: &Arc<Work>,
        next: &mut NextContent<'_>,
        stop: &StopFlag,
        on_finished: &mut OnFinished<'_>,
    ) -> Result<(), CampaignError> {
        let (mut blocks, mut pace) = (VecDeque::<Block>::new(), Pace::default());
        let mut stopped: Option<Instant> = None;
        loop {
            if stop.is_set() {
                stopped.get_or_insert_with(Instant::now);
            }
            if stopped.is_none() {
                self.submit(number, next, &mut blocks, &pace)?;
            }
            if blocks.is_empty() {
                return Ok(());
            }
            for (id, bytes) in self.cluster.wait(POLL_INTERVAL).map_err(RemoteError::from)? {
                let block = blocks.iter_mut().find(|block| block.id == id && block.results.is_none());
                let block = block.ok_or(RemoteError::NotAwaited { block: id })?;
                let results = self.decode(work, block, &bytes)?;
                pace.push(&results);
                block.results = Some(results);
            }
            if stop.is_abandoned() {
                return Ok(());
            }
            while let Some(results) = blocks.front_mut().and_then(|block| block.results.take()) {
                blocks.pop_front();
                for finished in results {
                    if on_finished(finished)?.is_break() {
                        return Ok(());
                    }
                }
            }
            if stopped.is_some_and(|at| at.elapsed() >= STOP_TIMEOUT) {
                return Ok(());
            }
        }
    }

    /// Submits blocks until enough of them wait.
    fn submit(
        &self,
        number: usize,
        next: &mut NextContent<'_>,
        blocks: &mut VecDeque<Block>,
        pace: &Pace,
    ) -> Result<(), RemoteError> {
        let slots = self.cluster.capacity()?;
        let mut awaited = blocks.iter().filter(|block| block.results.is_none()).count();
        let mut ahead: usize = blocks.iter().map(|block| block.content.len()).sum();
        while awaited < BLOCKS_PER_SLOT * slots + SPARE_BLOCKS && ahead < WINDOW + WINDOW_PER_SLOT * slots {
            let content = next(pace.block_len());
            if content.is_empty() {
                break;
            }
            let id = self.blocks.fetch_add(1, Ordering::Relaxed);
            self.cluster.submit(id, number, &content.numbers())?;
            (awaited, ahead) = (awaited + 1, ahead + content.len());
            blocks.push_back(Block { id, content, results: None });
        }
        Ok(())
    }

    fn decode(&self, work: &Work, block: &Block, bytes: &[u8]) -> Result<Vec<Finished>, RemoteError> {
        let (version, configuration, content) = (&self.version, &self.configuration, &block.content);
        let first = match content {
            Content::Samples(samples) => samples.first().copied().unwrap_or_default(),
            Content::Points(_) => 0,
        };
        Expected { version, configuration, work, content }.decode(bytes).map_err(|message| RemoteError::Answer {
            block: block.id,
            scenario: work.scenario().to_owned(),
            samples: content.len(),
            first,
            message,
        })
    }
}

#[cfg(test)]
mod tests;
