//! The order of a file's rows, and its effect on the use of memory.
//!
//! | order | rows held in memory |
//! |---|---|
//! | any, up to [`WINDOW_ROWS`] rows | all |
//! | by vehicle: the rows of one vehicle are consecutive | the rows of one vehicle |
//! | by time: no row is earlier than the one before | the rows of the vehicles on the road at that time |
//!
//! NGSIM's original files and highD's are sorted by vehicle. The reader rejects longer unsorted
//! files, with the line at which the order breaks: sorting them needs disk space, and `sort` does
//! that better.

use std::collections::BTreeMap;

use closecall_traffic::Time;

use super::continuity::FrameClock;
use super::error::TrajectoryFileProblem;
use super::source::{ReadError, Row};

/// Maximum number of rows of an unsorted file.
///
/// In a longer file, the first rows up to this number determine the period, the start time, the
/// lane markings and whether the numbers are plausible. They cover about an hour of traffic at one
/// vehicle per second, each recorded for 30 s at 10 Hz.
pub const WINDOW_ROWS: usize = 1 << 20;

/// Like [`WINDOW_ROWS`], for readers that keep memory small: a quarter of an hour of traffic, which
/// takes 40 MiB.
pub const STREAM_ROWS: usize = 1 << 18;

/// The order of the rows in a file that is longer than the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Vehicle,
    Time,
}

/// Determines the order of `rows`. If neither order holds, returns the error of the order that
/// breaks later.
pub(super) fn order_of(rows: &[Row], clock: FrameClock) -> Result<Order, ReadError> {
    let mut by_vehicle = VehicleOrder::default();
    let vehicle_breaks = rows.iter().find_map(|row| by_vehicle.check(row, clock).err());
    let mut by_time = TimeOrder::default();
    let time_breaks = rows.iter().find_map(|row| by_time.check(row).err());
    match (vehicle_breaks, time_breaks) {
        (None, _) => Ok(Order::Vehicle),
        (_, None) => Ok(Order::Time),
        (Some(vehicle), Some(time)) => Err(if vehicle.line > time.line { vehicle } else { time }),
    }
}

/// Checks that the rows of each vehicle are consecutive.
#[derive(Default)]
pub(super) struct VehicleOrder {
    current: Option<(u64, Time, Time)>,
    ends: BTreeMap<u64, (Time, Time)>,
}

impl VehicleOrder {
    /// Checks the next row. A vehicle number may recur later, but its track must not continue after
    /// rows of other vehicles.
    pub(super) fn check(&mut self, row: &Row, clock: FrameClock) -> Result<(), ReadError> {
        let unsorted = || {
            let problem = TrajectoryFileProblem::NotByVehicle { vehicle: row.number, rows: WINDOW_ROWS };
            Err(ReadError::new(row.line, problem))
        };
        match &mut self.current {
            Some((number, origin, time)) if (*number, *origin) == (row.number, row.origin) => {
                if row.time <= *time {
                    // Two rows of one frame are a separate problem, which `assemble::step` reports.
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
                    && row.time <= clock.bridged_until(*end)
                {
                    return unsorted();
                }
                *current = Some((row.number, row.origin, row.time));
            }
        }
        Ok(())
    }
}

/// Checks that time never decreases.
#[derive(Default)]
pub(super) struct TimeOrder {
    now: Option<Time>,
}

impl TimeOrder {
    /// Checks the next row. Returns `true` if it is the first row of its instant.
    pub(super) fn check(&mut self, row: &Row) -> Result<bool, ReadError> {
        let before = self.now.unwrap_or(row.time);
        if row.time < before {
            let back_s = (before - row.time).s();
            return Err(ReadError::new(row.line, TrajectoryFileProblem::NotByTime { back_s, rows: WINDOW_ROWS }));
        }
        self.now = Some(row.time);
        Ok(row.time > before)
    }
}
