//! The tables of a run that are requested.

use std::path::Path;

use closecall_scenarios::Scenario;
use closecall_simulation::{Arm, Observer, RunEvent, StepView};
use closecall_traffic::Time;
use closecall_traffic::atomic::WriteError;

use crate::tables::{ScanWriter, TraceWriter};

/// The trace and the scans of a run, each only if it is requested.
pub struct RunTables {
    trace: Option<TraceWriter>,
    scans: Option<ScanWriter>,
}

impl RunTables {
    /// Creates the writers of the files of a run in this arm, whose extensions give the formats.
    ///
    /// # Errors
    /// [`WriteError`] if an extension is wrong, if a file cannot be created, or if scans are requested of an arm without a LiDAR.
    pub fn new(
        (scenario, arm): (&Scenario, Option<&Arm>),
        trace: Option<&Path>,
        scans: Option<&Path>,
    ) -> Result<Self, WriteError> {
        let mode = arm.and_then(|arm| arm.sensors).unwrap_or_else(|| scenario.sensors.mode());
        let trace = trace.map(TraceWriter::new).transpose()?;
        Ok(Self { trace, scans: scans.map(|path| ScanWriter::new(path, mode)).transpose()? })
    }

    /// Writes the files.
    ///
    /// # Errors
    /// [`WriteError`] if a file cannot be written completely.
    pub fn finish(self) -> Result<(), WriteError> {
        self.trace.map(TraceWriter::finish).transpose()?;
        self.scans.map(ScanWriter::finish).transpose()?;
        Ok(())
    }
}

impl Observer for RunTables {
    fn step(&mut self, view: &StepView<'_>) {
        if let Some(trace) = &mut self.trace {
            trace.step(view);
        }
        if let Some(scans) = &mut self.scans {
            scans.step(view);
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
