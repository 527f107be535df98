//! The interface of an engine, and the engine of the program.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::error::EngineError;
use super::error::RemoteError;
use super::shipment::Shipment;
use super::workers::RemoteWorkers;
use crate::manifest::Manifest;
use crate::rare::PointRunner;
use crate::workers::SampleRunner;

static ENGINE: Mutex<Option<Arc<dyn Engine>>> = Mutex::new(None);

/// Runs blocks of samples on other machines.
pub trait Engine: Send + Sync {
    /// Connects to the cluster at `address`, which is to run blocks of one campaign.
    ///
    /// # Errors
    /// [`EngineError`] if there is no such cluster, or it cannot be used.
    fn connect(&self, address: &str, shipment: &Shipment) -> Result<Box<dyn Cluster>, EngineError>;
}

/// The machines that run the blocks of one campaign.
pub trait Cluster: Send + Sync {
    /// Returns the number of blocks that can run at the same time now. More are submitted, so that
    /// the cluster can grow.
    ///
    /// # Errors
    /// [`EngineError`] if the cluster cannot be reached.
    fn capacity(&self) -> Result<usize, EngineError>;

    /// Submits a block of the scenario with index `work`. `numbers` say what the block runs: they
    /// are handed to [`BlockRunner::run`] as they are.
    ///
    /// # Errors
    /// [`EngineError`] if the cluster cannot be reached.
    ///
    /// [`BlockRunner::run`]: super::BlockRunner::run
    fn submit(&self, block: u64, work: usize, numbers: &[u64]) -> Result<(), EngineError>;

    /// Waits for at most `timeout`, and returns the blocks that are done, each with what
    /// [`BlockRunner::run`] has returned.
    ///
    /// # Errors
    /// [`EngineError`] if a block has failed for good, or the cluster cannot be reached.
    ///
    /// [`BlockRunner::run`]: super::BlockRunner::run
    fn wait(&self, timeout: Duration) -> Result<Vec<(u64, Vec<u8>)>, EngineError>;

    /// Gives up all blocks that are not done.
    fn cancel(&self);

    /// Ends the connection.
    fn close(&self);
}

/// Sets the engine of the program. An earlier one is replaced.
pub fn set_engine(engine: Arc<dyn Engine>) {
    let earlier = ENGINE.lock().unwrap_or_else(PoisonError::into_inner).replace(engine);
    drop(earlier);
}

/// Connects to the cluster at `address`, if one is given.
///
/// # Errors
/// [`RemoteError`] if the program has no engine, a file cannot be shipped, or the cluster cannot be
/// used.
pub fn connect(address: Option<&str>, manifest: &Manifest) -> Result<Option<Arc<dyn SampleRunner>>, RemoteError> {
    Ok(workers(address, manifest)?.map(|workers| Arc::new(workers) as Arc<dyn SampleRunner>))
}

/// Connects to the cluster at `address`, if one is given, to run points of the search for a rare
/// event.
///
/// # Errors
/// As [`connect`].
pub fn connect_points(address: Option<&str>, manifest: &Manifest) -> Result<Option<Arc<dyn PointRunner>>, RemoteError> {
    Ok(workers(address, manifest)?.map(|workers| Arc::new(workers) as Arc<dyn PointRunner>))
}

fn workers(address: Option<&str>, manifest: &Manifest) -> Result<Option<RemoteWorkers>, RemoteError> {
    let Some(address) = address else { return Ok(None) };
    let engine = ENGINE.lock().unwrap_or_else(PoisonError::into_inner).clone().ok_or(RemoteError::NoEngine)?;
    let cluster = engine.connect(address, &Shipment::of(manifest)?)?;
    Ok(Some(RemoteWorkers::new(cluster, manifest)))
}
