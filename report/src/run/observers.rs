//! The observers of a run whose output is requested.

use closecall_simulation::{Observer, RunEvent, StepView};
use closecall_traffic::Time;

use super::film::FilmRecorder;
use super::trace::TraceWriter;

/// A recorder and a trace that observe the same run, each only if it is requested.
pub struct RunObservers<'a> {
    /// The recorder of the film.
    pub recorder: Option<&'a mut FilmRecorder>,
    /// The writer of the trace.
    pub trace: Option<&'a mut TraceWriter>,
}

impl Observer for RunObservers<'_> {
    fn step(&mut self, view: &StepView<'_>) {
        if let Some(recorder) = &mut self.recorder {
            recorder.step(view);
        }
        if let Some(trace) = &mut self.trace {
            trace.step(view);
        }
    }

    fn event(&mut self, time: Time, what: &RunEvent) {
        if let Some(recorder) = &mut self.recorder {
            recorder.event(time, what);
        }
        if let Some(trace) = &mut self.trace {
            trace.event(time, what);
        }
    }
}
