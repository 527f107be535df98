//! The tables of a run that are requested.

use std::path::Path;

use closecall_scenarios::Scenario;
use closecall_simulation::{Arm, Observer, RunEvent, SettlingView, StepView};
use closecall_traffic::Time;
use closecall_traffic::atomic::WriteError;

use crate::tables::{ClusterWriter, ScanWriter, TraceWriter, TrackWriter};

/// The files of the tables, each only if it is requested.
#[derive(Clone, Copy, Debug, Default)]
pub struct TableFiles<'a> {
    /// The states of all vehicles.
    pub trace: Option<&'a Path>,
    /// The returns of the LiDARs.
    pub scans: Option<&'a Path>,
    /// The tracks beside the truth.
    pub tracks: Option<&'a Path>,
    /// The clusters and boxes of the LiDARs.
    pub clusters: Option<&'a Path>,
}

/// The tables of a run, each only if it is requested.
pub struct RunTables {
    trace: Option<TraceWriter>,
    scans: Option<ScanWriter>,
    tracks: Option<TrackWriter>,
    clusters: Option<ClusterWriter>,
}

impl RunTables {
    /// Creates the writers of the files of a run in this arm, whose extensions give the formats.
    ///
    /// # Errors
    /// [`WriteError`] if an extension is wrong, if a file cannot be created, or if scans or
    /// clusters are requested of an arm without a LiDAR.
    pub fn new((scenario, arm): (&Scenario, Option<&Arm>), files: TableFiles<'_>) -> Result<Self, WriteError> {
        let mode = arm.and_then(|arm| arm.sensors).unwrap_or_else(|| scenario.sensors.mode());
        Ok(Self {
            trace: files.trace.map(TraceWriter::new).transpose()?,
            scans: files.scans.map(|path| ScanWriter::new(path, mode)).transpose()?,
            tracks: files.tracks.map(TrackWriter::new).transpose()?,
            clusters: files.clusters.map(|path| ClusterWriter::new(path, mode)).transpose()?,
        })
    }

    /// Writes the files.
    ///
    /// # Errors
    /// [`WriteError`] if a file cannot be written completely.
    pub fn finish(self) -> Result<(), WriteError> {
        self.trace.map(TraceWriter::finish).transpose()?;
        self.scans.map(ScanWriter::finish).transpose()?;
        self.tracks.map(TrackWriter::finish).transpose()?;
        self.clusters.map(ClusterWriter::finish).transpose()?;
        Ok(())
    }

    /// Returns the writers that are there.
    fn writers(&mut self) -> impl Iterator<Item = &mut dyn Observer> {
        let trace = self.trace.iter_mut().map(|writer| writer as &mut dyn Observer);
        let scans = self.scans.iter_mut().map(|writer| writer as &mut dyn Observer);
        let tracks = self.tracks.iter_mut().map(|writer| writer as &mut dyn Observer);
        let clusters = self.clusters.iter_mut().map(|writer| writer as &mut dyn Observer);
        trace.chain(scans).chain(tracks).chain(clusters)
    }
}

impl Observer for RunTables {
    fn step(&mut self, view: &StepView<'_>) {
        self.writers().for_each(|writer| writer.step(view));
    }

    fn settling(&mut self, view: &SettlingView<'_>) {
        self.writers().for_each(|writer| writer.settling(view));
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
