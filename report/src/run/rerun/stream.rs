//! The writer of a film's entities, on the timelines of the recording.
//!
//! The timelines `time` and `step` hold the run without changes. A file cannot tell the viewer at
//! which moment to open: the viewer opens a timeline at its first moment. So a third timeline,
//! [`OPENING_TIMELINE`], repeats `time`, but begins one step earlier with a copy of the critical
//! moment. The file opens at the copy. Playing on from there shows the whole run, and so does a
//! change to `time`.
//!
//! ```text
//!  opening   ◉ critical moment │ 0.00 s  0.04 s  …  end
//!  time                        │ 0.00 s  0.04 s  …  end
//! ```

use std::ops::Range;

use closecall_traffic::Time;
use rerun::{
    AsComponents, Clear, EntityPath, RecordingStreamError, Scalars, SerializationResult, SerializedComponentColumn,
    TimeColumn,
};

use super::RecordingError;
use super::recording::Recording;
use crate::run::film::Film;

/// Timeline of the simulated time.
pub(super) const TIME_TIMELINE: &str = "time";
/// Timeline of the control step numbers.
pub(super) const STEP_TIMELINE: &str = "step";
/// Timeline of the simulated time that begins with a copy of the critical moment.
pub(super) const OPENING_TIMELINE: &str = "opening";

/// A function that returns the columns of a range of rows.
pub(super) trait BuildColumns: Fn(Range<usize>) -> SerializationResult<Self::Columns> {
    /// The columns, one for each component.
    type Columns: Iterator<Item = SerializedComponentColumn>;
}

impl<F, C> BuildColumns for F
where
    F: Fn(Range<usize>) -> SerializationResult<C>,
    C: Iterator<Item = SerializedComponentColumn>,
{
    type Columns = C;
}

/// Writes the entities of one film into a recording.
pub(super) struct Writer<'a> {
    recording: &'a Recording,
    /// Prefix of the entity paths of this film.
    root: String,
    /// Whether the recording has no other film. The scene then has room for speeds and headways.
    pub(super) is_alone: bool,
    /// Duration of a control step.
    period: Time,
    /// Times of the first and the last frame of the recording.
    span: [Time; 2],
    /// Time of the frame that is copied to the beginning of the opening timeline.
    critical: Time,
}

impl<'a> Writer<'a> {
    /// Creates the writer of one film whose entity paths begin with `root`. `span` holds the first
    /// and the last moment of any film, `critical` the moment at which the recording opens.
    pub(super) fn new(
        recording: &'a Recording,
        film: &Film,
        root: &str,
        is_alone: bool,
        span: [Time; 2],
        critical: Time,
    ) -> Self {
        Self { recording, critical, root: root.to_owned(), is_alone, period: film.period, span }
    }

    /// Returns the share of the time axis that a duration takes.
    pub(super) fn share_of_run(&self, duration: Time) -> f64 {
        duration.s() / (self.end() - self.span[0]).s()
    }

    /// Returns the end of the recording: one step after the last frame of its longest film.
    pub(super) fn end(&self) -> Time {
        self.span[1] + self.period
    }

    /// Returns the path of an entity of this film.
    pub(super) fn path(&self, entity: &str) -> EntityPath {
        format!("{}{entity}", self.root).into()
    }

    /// Writes components that hold for the whole run.
    pub(super) fn write_static(&self, entity: &str, archetype: &impl AsComponents) -> Result<(), RecordingError> {
        self.recording.log_static(self.path(entity), archetype)
    }

    /// Writes components that hold for the whole run, of an entity beside the entities of the
    /// films.
    pub(super) fn write_static_of_all(
        &self,
        entity: &str,
        archetype: &impl AsComponents,
    ) -> Result<(), RecordingError> {
        self.recording.log_static(entity.into(), archetype)
    }

    /// Writes rows like [`Self::write_curve`], of an entity beside the entities of the films.
    pub(super) fn write_curve_of_all(
        &self,
        entity: &str,
        times: &[Time],
        build: impl BuildColumns,
    ) -> Result<(), RecordingError> {
        self.curve(entity.into(), times, build)
    }

    fn curve(&self, path: EntityPath, times: &[Time], build: impl BuildColumns) -> Result<(), RecordingError> {
        if times.is_empty() {
            return Ok(());
        }
        let columns = build(0..times.len()).map_err(RecordingStreamError::from)?;
        self.recording.send_columns(path, self.timelines(times), columns)
    }

    /// Writes one row of components for each of `times`, which must ascend, and a copy of the row
    /// that holds at the critical moment. `build` returns the columns of a range of rows.
    pub(super) fn write_rows(
        &self,
        entity: &str,
        times: &[Time],
        build: impl BuildColumns,
    ) -> Result<(), RecordingError> {
        self.copy_critical_row(entity, times, &build)?;
        self.write_curve(entity, times, build)
    }

    /// Writes a copy of the row that holds at the critical moment.
    fn copy_critical_row(&self, entity: &str, times: &[Time], build: &impl BuildColumns) -> Result<(), RecordingError> {
        let until_critical = times.partition_point(|&time| time <= self.critical);
        let Some(shown) = until_critical.checked_sub(1) else { return Ok(()) };
        let columns = build(shown..shown + 1).map_err(RecordingStreamError::from)?;
        self.recording.send_columns(self.path(entity), self.copy_time(), columns)?;
        self.clear_copy(entity, times[0])
    }

    /// Writes rows like [`Self::write_rows`], in pieces of at most `piece` rows, for rows of many
    /// values: a recording is encoded piece by piece, and each is in memory several times then.
    pub(super) fn write_rows_in_pieces(
        &self,
        entity: &str,
        times: &[Time],
        piece: usize,
        build: impl BuildColumns,
    ) -> Result<(), RecordingError> {
        self.copy_critical_row(entity, times, &build)?;
        (0..times.len()).step_by(piece).try_for_each(|first| {
            let rows = first..(first + piece).min(times.len());
            let columns = build(rows.clone()).map_err(RecordingStreamError::from)?;
            self.recording.send_columns(self.path(entity), self.timelines(&times[rows]), columns)
        })
    }

    /// Writes rows like [`Self::write_rows`], without a copy. For data that a view shows over the
    /// whole run at once.
    pub(super) fn write_curve(
        &self,
        entity: &str,
        times: &[Time],
        build: impl BuildColumns,
    ) -> Result<(), RecordingError> {
        self.curve(self.path(entity), times, build)
    }

    /// Writes components that hold from `time` on.
    pub(super) fn write_from(
        &self,
        entity: &str,
        time: Time,
        archetype: &dyn AsComponents,
    ) -> Result<(), RecordingError> {
        self.write_each(entity, &[(time, archetype)])
    }

    /// Writes several components. Each holds from its time until the time of the next. The times
    /// must ascend.
    pub(super) fn write_each(&self, entity: &str, whats: &[(Time, &dyn AsComponents)]) -> Result<(), RecordingError> {
        let until_critical = whats.partition_point(|(time, _)| *time <= self.critical);
        if let Some(shown) = until_critical.checked_sub(1) {
            self.recording.send_row(self.path(entity), self.copy_time(), whats[shown].1)?;
            self.clear_copy(entity, whats[0].0)?;
        }
        for (time, archetype) in whats {
            self.recording.send_row(self.path(entity), self.timelines(&[*time]), *archetype)?;
        }
        Ok(())
    }

    /// Removes an entity and its children from `time` on.
    pub(super) fn write_clear(&self, entity: &str, time: Time) -> Result<(), RecordingError> {
        self.write_from(entity, time, &Clear::recursive())
    }

    /// Writes the values of a plotted curve. An absent value leaves a gap.
    pub(super) fn write_series(
        &self,
        entity: &str,
        times: &[Time],
        values: &[Option<f64>],
    ) -> Result<(), RecordingError> {
        self.write_curve(entity, times, |range| {
            let values = &values[range];
            let lengths: Vec<usize> = values.iter().map(|value| usize::from(value.is_some())).collect();
            Scalars::new(values.iter().flatten().copied()).columns(lengths)
        })
    }

    /// Removes the copy of an entity whose first row comes after the start of the run.
    fn clear_copy(&self, entity: &str, first: Time) -> Result<(), RecordingError> {
        if first <= self.span[0] {
            return Ok(());
        }
        let start = TimeColumn::new_duration_nanos(OPENING_TIMELINE, [self.span[0].ns()]);
        self.recording.send_row(self.path(entity), vec![start], &Clear::flat())
    }

    /// Returns the moment of the copy.
    fn copy_time(&self) -> Vec<TimeColumn> {
        vec![TimeColumn::new_duration_nanos(OPENING_TIMELINE, [(self.span[0] - self.period).ns()])]
    }

    /// Returns `times` on each timeline.
    fn timelines(&self, times: &[Time]) -> Vec<TimeColumn> {
        let ns = || times.iter().map(|time| time.ns());
        vec![
            TimeColumn::new_duration_nanos(TIME_TIMELINE, ns()),
            TimeColumn::new_sequence(STEP_TIMELINE, ns().map(|ns| ns / self.period.ns())),
            TimeColumn::new_duration_nanos(OPENING_TIMELINE, ns()),
        ]
    }
}

/// Returns the indices of the first value and of every value that differs from the one before.
pub(super) fn changes<T: PartialEq>(values: &[T]) -> Vec<usize> {
    (0..values.len()).filter(|&row| row == 0 || values[row] != values[row - 1]).collect()
}
