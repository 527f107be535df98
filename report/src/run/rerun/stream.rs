//! Columns of values on the recording's three timelines.
//!
//! `time` and `step` span the whole run. The viewer opens a timeline that it follows at its latest moment, and a file
//! cannot say where else: so a third timeline, [`OPENING_TIMELINE`], carries what happened up to the critical moment and
//! nothing later. It is the one that the blueprint chooses.

use std::ops::Range;

use closecall_traffic::Time;
use rerun::{
    AsComponents, Clear, RecordingStream, RecordingStreamError, Scalars, SerializationResult,
    SerializedComponentColumn, TimeCell, TimeColumn,
};

use super::RecordError;

/// Simulated time in seconds.
pub(super) const TIME_TIMELINE: &str = "time";
/// Number of the control step.
pub(super) const STEP_TIMELINE: &str = "step";
/// Simulated time in seconds, which ends shortly after the critical moment.
pub(super) const OPENING_TIMELINE: &str = "until_critical";

/// Writes the entities of one recording.
pub(super) struct Writer<'a> {
    stream: &'a RecordingStream,
    /// The last moment on the opening timeline.
    opening: Time,
    /// Where the entities of this film lie: nothing for the only film of a file.
    root: String,
    /// Time of a step.
    period: Time,
}

impl<'a> Writer<'a> {
    pub(super) fn new(stream: &'a RecordingStream, opening: Time, root: &str, period: Time) -> Self {
        Self { stream, opening, root: root.to_owned(), period }
    }

    /// The path of an entity of this film.
    pub(super) fn path(&self, entity: &str) -> String {
        format!("{}{entity}", self.root)
    }

    /// What holds for the whole run.
    pub(super) fn fixed(&self, entity: &str, what: &impl AsComponents) -> Result<(), RecordError> {
        Ok(self.stream.log_static(self.path(entity), what)?)
    }

    /// One row for each of `times`, which ascend; `build` gives the columns of a range of the rows.
    pub(super) fn rows<C>(
        &self,
        entity: &str,
        times: &[Time],
        build: impl Fn(Range<usize>) -> SerializationResult<C>,
    ) -> Result<(), RecordError>
    where
        C: Iterator<Item = SerializedComponentColumn>,
    {
        let until_opening = times.partition_point(|&time| time <= self.opening);
        for range in [0..until_opening, until_opening..times.len()] {
            if range.is_empty() {
                continue;
            }
            let columns = build(range.clone()).map_err(RecordingStreamError::from)?;
            self.stream.send_columns(self.path(entity), self.timelines(&times[range]), columns)?;
        }
        Ok(())
    }

    /// Something that is so from `time` on, as a whole.
    pub(super) fn since(&self, entity: &str, time: Time, what: &impl AsComponents) -> Result<(), RecordError> {
        for timeline in self.timelines(&[time]) {
            let cell = TimeCell::new(timeline.timeline().typ(), timeline.times_raw()[0]);
            self.stream.set_time(*timeline.timeline().name(), cell);
        }
        let logged = self.stream.log(self.path(entity), what);
        self.stream.reset_time();
        Ok(logged?)
    }

    /// An entity that is no longer there from `time` on, with all that belongs to it.
    pub(super) fn gone(&self, entity: &str, time: Time) -> Result<(), RecordError> {
        self.rows(entity, &[time], |_| Clear::recursive().columns_of_unit_batches())
    }

    /// A series to plot; a value that is absent leaves a gap.
    pub(super) fn series(&self, entity: &str, times: &[Time], values: &[Option<f64>]) -> Result<(), RecordError> {
        self.rows(entity, times, |range| {
            let values = &values[range];
            let lengths: Vec<usize> = values.iter().map(|value| usize::from(value.is_some())).collect();
            Scalars::new(values.iter().flatten().copied()).columns(lengths)
        })
    }

    fn timelines(&self, times: &[Time]) -> Vec<TimeColumn> {
        let ns = || times.iter().map(|time| time.ns());
        let mut timelines = vec![
            TimeColumn::new_duration_nanos(TIME_TIMELINE, ns()),
            TimeColumn::new_sequence(STEP_TIMELINE, ns().map(|ns| ns / self.period.ns())),
        ];
        if times.last().is_some_and(|&last| last <= self.opening) {
            timelines.push(TimeColumn::new_duration_nanos(OPENING_TIMELINE, ns()));
        }
        timelines
    }
}

/// The rows at which a value differs from the row before, and the first.
pub(super) fn changes<T: PartialEq>(values: &[T]) -> Vec<usize> {
    (0..values.len()).filter(|&row| row == 0 || values[row] != values[row - 1]).collect()
}
