//! The observers of a run whose output is requested.

use crate::exchange::OsiRecorder;
use crate::tables::RunTables;
use closecall_simulation::{Observer, RunEvent, SettlingView, StepView};
use closecall_traffic::{Time, VehicleState};

use super::film::FilmRecorder;

/// A recorder, tables and messages that observe the same run, each only if it is requested.
pub struct RunObservers<'a> {
    /// The recorder of the film.
    pub recorder: Option<&'a mut FilmRecorder>,
    /// The writer of the tables.
    pub tables: Option<&'a mut RunTables>,
    /// The recorder of OSI messages.
    pub osi: Option<&'a mut OsiRecorder>,
}

impl Observer for RunObservers<'_> {
    fn step(&mut self, view: &StepView<'_>) {
        if let Some(recorder) = &mut self.recorder {
            recorder.step(view);
        }
        if let Some(tables) = &mut self.tables {
            tables.step(view);
        }
        if let Some(osi) = &mut self.osi {
            osi.step(view);
        }
    }

    fn settling(&mut self, view: &SettlingView<'_>) {
        if let Some(tables) = &mut self.tables {
            tables.settling(view);
        }
    }

    fn event(&mut self, time: Time, event: &RunEvent) {
        if let Some(recorder) = &mut self.recorder {
            recorder.event(time, event);
        }
        if let Some(tables) = &mut self.tables {
            tables.event(time, event);
        }
        if let Some(osi) = &mut self.osi {
            osi.event(time, event);
        }
    }

    fn moved(&mut self, time: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        if let Some(recorder) = &mut self.recorder {
            recorder.moved(time, vehicles);
        }
    }
}
