//! The tables of a run that are requested.

use std::path::Path;

use closecall_scenarios::atomic::WriteError;
use closecall_simulation::{Observer, RunEvent, StepView};
use closecall_traffic::Time;

use crate::{ScanWriter, TraceWriter};

/// The trace and the scans of a run, each only if it is requested.
pub struct RunTables {
    trace: Option<TraceWriter>,
    scans: Option<ScanWriter>,
}

impl RunTables {
    /// Creates the writers of the files, whose extensions give the formats.
    ///
    /// # Errors
    /// [`WriteError`] if an extension is wrong, or if a file cannot be created.
    pub fn new(trace: Option<&Path>, scans: Option<&Path>) -> Result<Self, WriteError> {
        let trace = trace.map(TraceWriter::new).transpose()?;
        Ok(Self { trace, scans: scans.map(ScanWriter::new).transpose()? })
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
