//! Rows in a known order to complete tracks.

use std::collections::{BTreeMap, VecDeque};

use closecall_traffic::Time;

use super::assemble::{Step, step, track};
use super::order::{Order, TimeOrder, VehicleOrder};
use super::source::{Refusal, Row};
use super::{RecordedTrack, RecordingProblem};

/// The second piece of vehicle 884 is track 1,000,000,000,884, and so on: a number that depends neither on what else the
/// file holds nor on the order of its rows. Vehicle numbers themselves lie below this.
pub const PIECE_STRIDE: u64 = 1_000_000_000_000;

/// Rows of tracks that are not complete yet; more are refused rather than held: 3 million rows are 8 hours at 100 Hz.
const MOST_OPEN_ROWS: usize = 3 << 20;

/// Tracks in the making.
pub(super) struct Builder {
    period: Time,
    start: Time,
    order: Check,
    /// Rows without a gap, by vehicle.
    open: BTreeMap<(u64, Time), Vec<Row>>,
    open_rows: usize,
    most_open_rows: usize,
    /// Pieces that were given a number, by vehicle number.
    pieces: BTreeMap<u64, u64>,
    ready: VecDeque<RecordedTrack>,
}

enum Check {
    Sorted,
    Vehicle(VehicleOrder),
    Time(TimeOrder),
}

impl Builder {
    /// A builder of rows that are sorted by vehicle and by time already.
    pub(super) fn of_sorted(period: Time, start: Time) -> Self {
        Self {
            period,
            start,
            order: Check::Sorted,
            open: BTreeMap::new(),
            open_rows: 0,
            most_open_rows: usize::MAX,
            pieces: BTreeMap::new(),
            ready: VecDeque::new(),
        }
    }

    /// A builder of rows that come in `order`; which is checked.
    pub(super) fn of_stream(period: Time, start: Time, order: Order) -> Self {
        let order = match order {
            Order::Vehicle => Check::Vehicle(VehicleOrder::default()),
            Order::Time => Check::Time(TimeOrder::default()),
        };
        Self { order, most_open_rows: MOST_OPEN_ROWS, ..Self::of_sorted(period, start) }
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// Where the order breaks, or the row contradicts the one before. The row is then left out.
    pub(super) fn push(&mut self, row: Row) -> Result<(), Refusal> {
        let key = (row.number, row.origin);
        match &mut self.order {
            Check::Sorted => self.close_all_but(key)?,
            Check::Vehicle(order) => {
                order.check(&row, self.period)?;
                self.close_all_but(key)?;
            }
            Check::Time(order) => {
                if order.check(&row)? {
                    self.close_before(row.time)?;
                }
            }
        }
        let rows = self.open.entry(key).or_default();
        if let Some(before) = rows.last()
            && step(before, &row, self.period)? == Step::Gap
        {
            let complete = std::mem::take(rows);
            self.close(&complete)?;
        }
        self.open_rows += 1;
        if self.open_rows > self.most_open_rows {
            return Err(Refusal::new(row.line, RecordingProblem::TooManyOpen { allowed: self.most_open_rows }));
        }
        self.open.entry(key).or_default().push(row);
        Ok(())
    }

    /// The next complete track.
    pub(super) fn pop(&mut self) -> Option<RecordedTrack> {
        self.ready.pop_front()
    }

    /// The complete tracks that were not taken yet.
    pub(super) fn ready(&self) -> impl Iterator<Item = &RecordedTrack> {
        self.ready.iter()
    }

    /// Completes all tracks.
    pub(super) fn finish(&mut self) -> Result<(), Refusal> {
        let open = std::mem::take(&mut self.open);
        open.into_values().try_for_each(|rows| self.close(&rows))
    }

    fn close_all_but(&mut self, key: (u64, Time)) -> Result<(), Refusal> {
        if self.open.contains_key(&key) { Ok(()) } else { self.finish() }
    }

    /// Completes the tracks that are missing at the frame before `now`.
    fn close_before(&mut self, now: Time) -> Result<(), Refusal> {
        let missed = now - self.period - Time::from_ns(self.period.ns() / 2);
        let is_over = |rows: &Vec<Row>| rows.last().is_none_or(|row| row.time < missed);
        let over: Vec<_> = self.open.iter().filter(|(_, rows)| is_over(rows)).map(|(key, _)| *key).collect();
        over.into_iter().try_for_each(|key| self.open.remove(&key).map_or(Ok(()), |rows| self.close(&rows)))
    }

    fn close(&mut self, rows: &[Row]) -> Result<(), Refusal> {
        self.open_rows = self.open_rows.saturating_sub(rows.len());
        let Some(first) = rows.first() else { return Ok(()) };
        let pieces = self.pieces.entry(first.number).or_default();
        let piece = *pieces;
        *pieces += 1;
        if first.number >= PIECE_STRIDE && piece > 0 {
            // Such a number is that of a piece already; what is split again has none left.
            return Err(Refusal::new(first.line, RecordingProblem::SplitPiece { track: first.number }));
        }
        let track_id = first.number + piece * PIECE_STRIDE;
        if piece > 0 && self.pieces.contains_key(&track_id) {
            return Err(Refusal::new(first.line, RecordingProblem::SplitPiece { track: track_id }));
        }
        self.ready.extend(track(track_id, rows, self.start));
        Ok(())
    }
}
