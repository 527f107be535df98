//! The writer of a film's entities, on the three timelines of the recording.
//!
//! The timelines `time` and `step` span the whole run. The viewer opens a timeline at its latest moment, and a file
//! cannot set another one. A third timeline, [`OPENING_TIMELINE`], therefore ends shortly after the critical moment.
//! The blueprint selects it, so that the viewer opens at the critical moment.

use std::ops::Range;

use closecall_traffic::Time;
use rerun::{
    AsComponents, Clear, RecordingStream, RecordingStreamError, Scalars, SerializationResult,
    SerializedComponentColumn, TimeCell, TimeColumn,
};

use super::RecordingError;

/// Timeline of the simulated time.
pub(super) const TIME_TIMELINE: &str = "time";
/// Timeline of the control step numbers.
pub(super) const STEP_TIMELINE: &str = "step";
/// Timeline of the simulated time that ends shortly after the critical moment.
pub(super) const OPENING_TIMELINE: &str = "until_critical";

/// Writes the entities of one film into a recording.
pub(super) struct Writer<'a> {
    stream: &'a RecordingStream,
    /// The last moment on the opening timeline.
    opening_end: Time,
    /// Prefix of the entity paths of this film; empty for the only film of a recording.
    root: String,
    /// Duration of a control step.
    period: Time,
}

impl<'a> Writer<'a> {
    /// Creates the writer of one film whose entity paths begin with `root`.
    pub(super) fn new(stream: &'a RecordingStream, opening_end: Time, root: &str, period: Time) -> Self {
        Self { stream, opening_end, root: root.to_owned(), period }
    }

    /// Returns the path of an entity of this film.
    pub(super) fn path(&self, entity: &str) -> String {
        format!("{}{entity}", self.root)
    }

    /// Writes components that hold for the whole run.
    pub(super) fn write_static(&self, entity: &str, what: &impl AsComponents) -> Result<(), RecordingError> {
        Ok(self.stream.log_static(self.path(entity), what)?)
    }

    /// Writes one row of components for each of `times`, which must ascend. `build` returns the columns of a range of
    /// rows.
    pub(super) fn write_rows<C>(
        &self,
        entity: &str,
        times: &[Time],
        build: impl Fn(Range<usize>) -> SerializationResult<C>,
    ) -> Result<(), RecordingError>
    where
        C: Iterator<Item = SerializedComponentColumn>,
    {
        let until_opening = times.partition_point(|&time| time <= self.opening_end);
        for range in [0..until_opening, until_opening..times.len()] {
            if range.is_empty() {
                continue;
            }
            let columns = build(range.clone()).map_err(RecordingStreamError::from)?;
            self.stream.send_columns(self.path(entity), self.timelines(&times[range]), columns)?;
        }
        Ok(())
    }

    /// Writes components that hold from `time` on.
    pub(super) fn write_from(&self, entity: &str, time: Time, what: &impl AsComponents) -> Result<(), RecordingError> {
        for timeline in self.timelines(&[time]) {
            let cell = TimeCell::new(timeline.timeline().typ(), timeline.times_raw()[0]);
            self.stream.set_time(*timeline.timeline().name(), cell);
        }
        let logged = self.stream.log(self.path(entity), what);
        self.stream.reset_time();
        Ok(logged?)
    }

    /// Removes an entity and its children from `time` on.
    pub(super) fn write_clear(&self, entity: &str, time: Time) -> Result<(), RecordingError> {
        self.write_rows(entity, &[time], |_| Clear::recursive().columns_of_unit_batches())
    }

    /// Writes the values of a plotted curve. An absent value leaves a gap.
    pub(super) fn write_series(
        &self,
        entity: &str,
        times: &[Time],
        values: &[Option<f64>],
    ) -> Result<(), RecordingError> {
        self.write_rows(entity, times, |range| {
            let values = &values[range];
            let lengths: Vec<usize> = values.iter().map(|value| usize::from(value.is_some())).collect();
            Scalars::new(values.iter().flatten().copied()).columns(lengths)
        })
    }

    /// Returns `times` on each timeline. The opening timeline is left out if any of them is later than its end.
    fn timelines(&self, times: &[Time]) -> Vec<TimeColumn> {
        let ns = || times.iter().map(|time| time.ns());
        let mut timelines = vec![
            TimeColumn::new_duration_nanos(TIME_TIMELINE, ns()),
            TimeColumn::new_sequence(STEP_TIMELINE, ns().map(|ns| ns / self.period.ns())),
        ];
        if times.last().is_some_and(|&last| last <= self.opening_end) {
            timelines.push(TimeColumn::new_duration_nanos(OPENING_TIMELINE, ns()));
        }
        timelines
    }
}

/// Returns the indices of the first value and of every value that differs from the one before.
pub(super) fn changes<T: PartialEq>(values: &[T]) -> Vec<usize> {
    (0..values.len()).filter(|&row| row == 0 || values[row] != values[row - 1]).collect()
}
