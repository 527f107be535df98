//! The transport monitor: do the scans of a sensor arrive, and when?
//!
//! The ego knows the rate and the usual latency of a sensor. A scan that does not arrive leaves a
//! gap in the counter of the scans. A scan is late by the time of its arrival less its time stamp
//! and the usual latency. A late scan and a wrong clock look alike: only a clock that runs ahead
//! can make a scan arrive before its time.
//!
//! A faultless sensor of the model loses no scan and has a constant latency, so that no bound can
//! be passed by chance.

use closecall_traffic::CONTROL_STEP;

/// Share of the latest scans that are lost, or late, from which on the monitor raises its alarm (an
/// assumption; 5 to 50 % are plausible): a tracker bridges single scans.
const NOTICED_SHARE: f64 = 0.2;
/// Time over which scans are counted (s), and the fewest and the most scans.
const WINDOW_S: f64 = 1.0;
const WINDOW_SCANS: [f64; 2] = [5.0, 25.0];
/// Margin for rounding (s).
const MARGIN_S: f64 = 1e-6;

/// What the ego sees of the transport of one scan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Arrival {
    /// Whether the scan has not arrived.
    pub(crate) is_lost: bool,
    /// Time of arrival less the time stamp and the usual latency (s).
    pub(crate) lateness_s: f64,
}

/// The arrivals of the latest scans of one sensor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TransportMonitor {
    period_s: f64,
    /// The scans that count, in a bit mask: the latest scan has the lowest bit.
    window: u32,
    /// Number of scans from which on an alarm is raised.
    noticed_from: u32,
    /// Which of the latest scans are lost, and which are late.
    lost: u32,
    late: u32,
}

impl Default for TransportMonitor {
    /// Returns the monitor of a sensor that scans in each control step.
    fn default() -> Self {
        Self::new(CONTROL_STEP.s())
    }
}

impl TransportMonitor {
    /// Returns the monitor of a sensor with this time from a scan to the next (s).
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 25 scans")]
    pub(crate) fn new(period_s: f64) -> Self {
        let [fewest, most] = WINDOW_SCANS;
        let scans = (WINDOW_S / period_s).round().clamp(fewest, most);
        Self {
            period_s,
            window: (1 << scans as u32) - 1,
            noticed_from: ((NOTICED_SHARE * scans).ceil() as u32).max(2),
            lost: 0,
            late: 0,
        }
    }

    /// Notes the arrival of the next scan.
    pub(crate) fn observe(&mut self, arrival: Arrival) {
        let is_late = !arrival.is_lost && arrival.lateness_s.abs() > self.period_s + MARGIN_S;
        self.lost = (self.lost << 1 | u32::from(arrival.is_lost)) & self.window;
        self.late = (self.late << 1 | u32::from(is_late)) & self.window;
    }

    /// Returns whether many of the latest scans are lost.
    pub(crate) fn loses_scans(&self) -> bool {
        self.lost.count_ones() >= self.noticed_from
    }

    /// Returns whether the time stamps of many of the latest scans differ from their times of
    /// arrival by more than a period.
    pub(crate) fn is_late(&self) -> bool {
        self.late.count_ones() >= self.noticed_from
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(scans: impl IntoIterator<Item = Arrival>) -> [bool; 2] {
        let mut monitor = TransportMonitor::default();
        scans.into_iter().for_each(|scan| monitor.observe(scan));
        [monitor.loses_scans(), monitor.is_late()]
    }

    fn late(lateness_s: f64) -> Arrival {
        Arrival { is_lost: false, lateness_s }
    }

    const LOST: Arrival = Arrival { is_lost: true, lateness_s: 0.0 };

    #[test]
    fn scans_in_time_raise_nothing_and_neither_do_single_lost_ones() {
        assert_eq!(after([]), [false; 2]);
        assert_eq!(after([late(0.0); 1_000]), [false; 2]);
        assert_eq!(after([late(0.04); 1_000]), [false; 2], "a period is no more than a period");
        let every_tenth = (0..1_000).map(|scan| if scan % 10 == 0 { LOST } else { late(0.0) });
        assert_eq!(after(every_tenth), [false; 2]);
    }

    #[test]
    fn five_of_a_second_are_noticed_and_forgotten_after_a_second() {
        assert_eq!(after([LOST; 4]), [false; 2]);
        assert_eq!(after([LOST; 5]), [true, false]);
        assert_eq!(after([LOST; 5].into_iter().chain([late(0.0); 20])), [true, false]);
        assert_eq!(after([LOST; 5].into_iter().chain([late(0.0); 25])), [false; 2]);
        assert_eq!(after([late(0.05); 4]), [false; 2]);
        assert_eq!(after([late(0.05); 5]), [false, true]);
        assert_eq!(after([late(-0.05); 5]), [false, true], "a clock that runs ahead");
        assert_eq!(after([late(f64::NAN); 25]), [false; 2]);
    }

    #[test]
    fn a_slower_sensor_may_be_later_and_counts_at_least_five_scans() {
        let mut slow = TransportMonitor::new(0.1);
        (0..10).for_each(|_| slow.observe(late(0.05)));
        assert!(!slow.is_late());
        (0..2).for_each(|_| slow.observe(late(0.12)));
        assert!(slow.is_late(), "two of ten");
        let mut slowest = TransportMonitor::new(1.0);
        slowest.observe(LOST);
        assert!(!slowest.loses_scans());
        (0..3).for_each(|_| slowest.observe(late(0.0)));
        slowest.observe(LOST);
        assert!(slowest.loses_scans(), "two of five");
        slowest.observe(late(0.0));
        assert!(!slowest.loses_scans());
    }
}
