//! Assembly of ordered rows into complete tracks.

use std::collections::{BTreeMap, VecDeque};

use closecall_traffic::Time;

use super::assemble::{Step, assemble_track, step};
use super::continuity::{Continuity, CutEnds, FrameClock, bridge, compared_until, hides_crossing, is_jump};
use super::data::RecordedTrack;
use super::error::TrajectoryFileProblem;
use super::order::{Order, TimeOrder, VehicleOrder};
use super::source::{ReadError, Row};

/// Offset between the numbers of a split track's pieces.
///
/// The second piece of vehicle 884 is track 1,000,000,000,884, and so on. This number depends
/// neither on the rest of the file nor on the order of its rows. Vehicle numbers lie below this
/// offset.
pub const PIECE_STRIDE: u64 = 1_000_000_000_000;

/// Maximum number of rows held for incomplete tracks. Three million rows cover 8 hours at 100 Hz.
const MAX_OPEN_ROWS: usize = 3 << 20;

/// Builds tracks from rows.
pub(super) struct TrackBuilder {
    clock: FrameClock,
    start: Time,
    order: OrderCheck,
    /// Rows of incomplete tracks, with bridged gaps, by vehicle number and origin.
    open: BTreeMap<(u64, Time), Vec<Row>>,
    open_rows: usize,
    max_open_rows: usize,
    /// The last rows of complete tracks, by vehicle and origin. If the rows arrive by vehicle, this is
    /// only the latest track. If the rows arrive by time, these are the tracks that end shortly before
    /// the latest row.
    ends: BTreeMap<(u64, Time), Row>,
    /// Pieces completed so far, by vehicle number.
    pieces: BTreeMap<u64, Pieces>,
    ready: VecDeque<RecordedTrack>,
    continuity: Continuity,
}

/// The completed pieces of a vehicle.
#[derive(Clone, Copy, Debug, Default)]
struct Pieces {
    count: u64,
    /// Origin of the latest piece.
    origin: Time,
    /// `true` if the end of the latest piece cuts off a lane change.
    ends_cut: bool,
}

/// The check of the row order that the builder applies.
enum OrderCheck {
    Sorted,
    Vehicle(VehicleOrder),
    Time(TimeOrder),
}

impl TrackBuilder {
    /// Creates a builder for rows that are already sorted by vehicle and time.
    pub(super) fn for_sorted(clock: FrameClock, start: Time) -> Self {
        Self {
            clock,
            start,
            order: OrderCheck::Sorted,
            open: BTreeMap::new(),
            open_rows: 0,
            max_open_rows: usize::MAX,
            ends: BTreeMap::new(),
            pieces: BTreeMap::new(),
            ready: VecDeque::new(),
            continuity: Continuity::default(),
        }
    }

    /// Creates a builder for rows that arrive in `order`, which it checks.
    pub(super) fn for_stream(clock: FrameClock, start: Time, order: Order) -> Self {
        let order = match order {
            Order::Vehicle => OrderCheck::Vehicle(VehicleOrder::default()),
            Order::Time => OrderCheck::Time(TimeOrder::default()),
        };
        Self { order, max_open_rows: MAX_OPEN_ROWS, ..Self::for_sorted(clock, start) }
    }

    /// Adds the next row.
    ///
    /// # Errors
    /// Fails if the order breaks, if too many rows are held, or if the row contradicts the previous
    /// one. The row is then left out.
    pub(super) fn push(&mut self, row: Row) -> Result<(), ReadError> {
        let key = (row.number, row.origin);
        match &mut self.order {
            OrderCheck::Sorted => self.close_all_but(key)?,
            OrderCheck::Vehicle(order) => {
                order.check(&row, self.clock)?;
                self.close_all_but(key)?;
            }
            OrderCheck::Time(order) => {
                if order.check(&row)? {
                    self.close_before(row.time)?;
                }
            }
        }
        let rows = self.open.entry(key).or_default();
        let mut begins_after_gap = rows.is_empty();
        if let Some(before) = rows.last() {
            if row.repeats(before) {
                self.continuity.repeated_rows += 1;
                return Ok(());
            }
            let step = step(before, &row, self.clock)?;
            let missing = if step == Step::Gap { bridge(before, &row, self.clock) } else { Some(Vec::new()) };
            let is_jump = is_jump(before, &row);
            match missing {
                Some(missing) if !is_jump => {
                    self.continuity.recorded_crossings += u64::from(before.lane != row.lane);
                    self.continuity.bridged_gaps += u64::from(!missing.is_empty());
                    self.continuity.bridged_frames += missing.len() as u64;
                    self.open_rows += missing.len();
                    rows.extend(missing);
                }
                missing => {
                    // Beyond a long gap, the number may well belong to another vehicle.
                    self.continuity.jumps += u64::from(missing.is_some());
                    begins_after_gap = missing.is_none();
                    let complete = std::mem::take(rows);
                    self.close(&complete)?;
                }
            }
        }
        if begins_after_gap && let Some(end) = self.ends.get(&(row.vehicle_id, row.origin)) {
            self.continuity.hidden_crossings += u64::from(hides_crossing(end, &row));
        }
        self.open_rows += 1;
        if self.open_rows > self.max_open_rows {
            return Err(ReadError::new(row.line, TrajectoryFileProblem::TooManyOpen { allowed: self.max_open_rows }));
        }
        self.open.entry(key).or_default().push(row);
        Ok(())
    }

    /// Removes and returns the next complete track.
    pub(super) fn pop(&mut self) -> Option<RecordedTrack> {
        self.ready.pop_front()
    }

    /// Returns how the rows so far became tracks.
    pub(super) fn continuity(&self) -> Continuity {
        Continuity {
            vehicles: self.pieces.len() as u64,
            pieces: self.pieces.values().map(|pieces| pieces.count).sum(),
            ..self.continuity
        }
    }

    /// Returns the complete tracks that [`TrackBuilder::pop`] has not removed yet.
    pub(super) fn ready(&self) -> impl Iterator<Item = &RecordedTrack> {
        self.ready.iter()
    }

    /// Completes all tracks.
    pub(super) fn finish(&mut self) -> Result<(), ReadError> {
        let open = std::mem::take(&mut self.open);
        open.into_values().try_for_each(|rows| self.close(&rows))
    }

    /// Completes all tracks unless the track of `key` is among the incomplete tracks.
    fn close_all_but(&mut self, key: (u64, Time)) -> Result<(), ReadError> {
        if self.open.contains_key(&key) { Ok(()) } else { self.finish() }
    }

    /// Completes the tracks that no row at `now` or later can continue.
    fn close_before(&mut self, now: Time) -> Result<(), ReadError> {
        let clock = self.clock;
        let is_over = |rows: &Vec<Row>| rows.last().is_none_or(|row| clock.bridged_until(row.time) < now);
        let over: Vec<_> = self.open.iter().filter(|(_, rows)| is_over(rows)).map(|(key, _)| *key).collect();
        self.ends.retain(|_, end| compared_until(end.time) >= now);
        over.into_iter().try_for_each(|key| self.open.remove(&key).map_or(Ok(()), |rows| self.close(&rows)))
    }

    /// Completes one track from its rows.
    fn close(&mut self, rows: &[Row]) -> Result<(), ReadError> {
        self.open_rows = self.open_rows.saturating_sub(rows.len());
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Ok(()) };
        if matches!(self.order, OrderCheck::Vehicle(_)) {
            self.ends.clear();
        }
        self.ends.insert((last.vehicle_id, last.origin), *last);
        let pieces = self.pieces.entry(first.number).or_default();
        let Pieces { count: piece, origin, ends_cut } = *pieces;
        let cut = CutEnds::of(rows, self.clock.period);
        *pieces = Pieces { count: piece + 1, origin: first.origin, ends_cut: cut.end };
        if piece > 0 && origin == first.origin {
            // The previous piece ended at a gap or a jump, not at the edge of the recording.
            self.continuity.edge_crossings -= u64::from(ends_cut);
            self.continuity.split_crossings += u64::from(ends_cut) + u64::from(cut.start);
        } else {
            self.continuity.edge_crossings += u64::from(cut.start);
        }
        self.continuity.edge_crossings += u64::from(cut.end);
        // A vehicle has a further number on each further road, which the pieces on the roads before
        // may have taken.
        let offset = first.number.saturating_sub(first.vehicle_id);
        let roads_before = if offset.is_multiple_of(PIECE_STRIDE) { offset / PIECE_STRIDE } else { 0 };
        let own_number = first.number - roads_before * PIECE_STRIDE;
        if own_number >= PIECE_STRIDE && piece > 0 {
            // The number already belongs to a piece of a split track, so no number is left for the
            // pieces of this vehicle.
            return Err(ReadError::new(first.line, TrajectoryFileProblem::SplitPiece { track: first.number }));
        }
        let on_road = |road: u64| self.pieces.get(&(own_number + road * PIECE_STRIDE));
        let splits_before: u64 = (0..roads_before).filter_map(on_road).map(|pieces| pieces.count - 1).sum();
        let track_id = first.number + (splits_before + piece) * PIECE_STRIDE;
        if piece > 0 && self.pieces.contains_key(&track_id) {
            return Err(ReadError::new(first.line, TrajectoryFileProblem::SplitPiece { track: track_id }));
        }
        self.ready.extend(assemble_track(track_id, rows, self.start));
        Ok(())
    }
}
