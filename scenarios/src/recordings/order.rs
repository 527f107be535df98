//! The order in which a recording's rows come, and what follows from it for the memory it takes.
//!
//! | order | rows that are kept |
//! |---|---|
//! | any, up to [`WINDOW_ROWS`] rows | all |
//! | by vehicle: the rows of one vehicle stand together | those of one vehicle |
//! | by time: no row is earlier than the one before | those of the vehicles that are on the road at that time |
//!
//! NGSIM's original files and highD's are sorted by vehicle. Longer files in no order are refused with the line at which
//! the order breaks: sorting them needs disk, and `sort` does that better.

use std::collections::BTreeMap;

use closecall_traffic::Time;

use super::RecordingProblem;
use super::source::{Refusal, Row};

/// Recordings of up to so many rows may be in any order, and the beginning of longer ones, of this length, tells the
/// period, the start of time, the lane markings and whether the numbers are plausible: about an hour of one vehicle a
/// second at 10 Hz for 30 s each.
pub const WINDOW_ROWS: usize = 1 << 20;

/// The order of a recording that is longer than the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Vehicle,
    Time,
}

/// The order of `rows`, or where the one that held longer breaks.
pub(super) fn order_of(rows: &[Row], period: Time) -> Result<Order, Refusal> {
    let mut by_vehicle = VehicleOrder::default();
    let vehicle_breaks = rows.iter().find_map(|row| by_vehicle.check(row, period).err());
    let mut by_time = TimeOrder::default();
    let time_breaks = rows.iter().find_map(|row| by_time.check(row).err());
    match (vehicle_breaks, time_breaks) {
        (None, _) => Ok(Order::Vehicle),
        (_, None) => Ok(Order::Time),
        (Some(vehicle), Some(time)) => Err(if vehicle.line > time.line { vehicle } else { time }),
    }
}

/// Sees to it that the rows of a vehicle stand together.
#[derive(Default)]
pub(super) struct VehicleOrder {
    current: Option<(u64, Time, Time)>,
    ends: BTreeMap<u64, (Time, Time)>,
}

impl VehicleOrder {
    /// A vehicle may come back later, as numbers recur, but not go on where it was left.
    pub(super) fn check(&mut self, row: &Row, period: Time) -> Result<(), Refusal> {
        let unsorted = || {
            let problem = RecordingProblem::NotByVehicle { vehicle: row.number, rows: WINDOW_ROWS };
            Err(Refusal::new(row.line, problem))
        };
        match &mut self.current {
            Some((number, origin, time)) if (*number, *origin) == (row.number, row.origin) => {
                if row.time <= *time {
                    // Two rows of one frame are a flaw of their own, told where the track is put together.
                    return if row.time == *time { Ok(()) } else { unsorted() };
                }
                *time = row.time;
            }
            current => {
                if let Some((number, origin, time)) = current.take() {
                    self.ends.insert(number, (origin, time));
                }
                if let Some((origin, end)) = self.ends.get(&row.number)
                    && *origin == row.origin
                    && row.time <= *end + period + Time::from_ns(period.ns() / 2)
                {
                    return unsorted();
                }
                *current = Some((row.number, row.origin, row.time));
            }
        }
        Ok(())
    }
}

/// Sees to it that time never goes back.
#[derive(Default)]
pub(super) struct TimeOrder {
    now: Option<Time>,
}

impl TimeOrder {
    /// True where `row` is the first of its instant.
    pub(super) fn check(&mut self, row: &Row) -> Result<bool, Refusal> {
        let before = self.now.unwrap_or(row.time);
        if row.time < before {
            let back_s = (before - row.time).s();
            return Err(Refusal::new(row.line, RecordingProblem::NotByTime { back_s, rows: WINDOW_ROWS }));
        }
        self.now = Some(row.time);
        Ok(row.time > before)
    }
}
