//! The road monitor: does a LiDAR see the road where the road is?
//!
//! The road near the sensor is always there, so that a faultless sensor gets returns of known range
//! in all directions. The monitor looks at some beams of each scan ([`RoadBeam`]), and compares
//! them with the returns of a faultless sensor. A vehicle in a beam gives a return, too.
//!
//! | alarm | statistic | bound |
//! |---|---|---|
//! | a sector is blocked | all beams of successive visits without a return: the product of their probabilities | 10⁻⁹, and two visits |
//! | returns are missing | number of beams without a return in 25 scans | probability 10⁻⁹, by Chernoff |
//! | the road is too high or too low | more than four fifths of the heights in 50 scans or more beyond three standard deviations and the tolerance of the mounting | see below |
//! | the ranges scatter | more than an eighth of the heights in 50 scans or more beyond three standard deviations on either side | see below |
//!
//! *Chernoff.* If λ beams without a return are expected, k or more of them have at most the
//! probability exp(−λ)·(e·λ/k)^k, whatever the probabilities of the single beams are (Chernoff
//! 1952, Annals of Mathematical Statistics 23).
//!
//! *Heights.* A height lies beyond three standard deviations on one side with a probability of
//! 0.00135. The two heights of a scan share the error of the levelling, so they count as one: by
//! the same bound, more than an eighth of 80 heights, six pairs, has the probability 2·10⁻¹⁰ on one
//! side alone, and more than four fifths far less. Counts, unlike moments, bear the returns of
//! tyres and side guards among the heights: these are all too high, and between two trucks they are
//! two thirds.
//!
//! *Sectors.* A sensor that loses returns everywhere is not blocked. The probability of a return in
//! a sector is therefore multiplied by the share of the beams that gave one in the latest 25 scans.
//! A sensor with a blocked sector, however wide, does not lose returns elsewhere. A visit of
//! several beams without any return therefore says nothing of missing returns. Without such visits,
//! fewer misses are expected, so that the bound holds.

use closecall_traffic::maths;

use super::{Alarm, Alarms};

/// Negative logarithm of the probability of a false alarm in one decision, 10⁻⁹. Ten hours at 25 Hz
/// have 1.8 million visits and 54,000 other decisions: 0.002 false alarms.
const DECISION: f64 = 20.723_265_836_946_41;
/// Number of visits without a return, at least, after which a sector counts as blocked (an
/// assumption): one visit may meet a puddle.
const EMPTY_VISITS: u32 = 2;
/// Greatest probability of a return that the monitor assumes.
const MOST_CERTAIN: f64 = 1.0 - 1e-6;
/// Probability of a return below which a beam does not count as one that should have a return.
const LEAST_PROBABILITY: f64 = 0.5;
/// Number of scans over which missing returns are counted.
const RETURN_SCANS: u32 = 25;
/// Number of scans over which heights are counted, at least: the SCALA looks once in all
/// directions.
const HEIGHT_SCANS: u32 = 50;
/// Number of heights that a bare road would give, at least, for a decision. The SCALA sees 70 to
/// 110 in 50 scans: so many depends on the pitch of the ego.
const LEAST_EXPECTED: f64 = 90.0;
/// Share of the heights that a bare road would give, at least, for a decision (an assumption):
/// where vehicles hide more of the road, most heights may be returns of their tyres and bumpers.
const LEAST_SEEN: f64 = 0.9;
/// Standard deviations beyond which a height is unusual.
const UNUSUAL: f64 = 3.0;
/// Tolerance of the angle of a mounting (rad): 0.1°, to which production measures it (Kim et al.
/// 2020, arXiv 2008.10542).
const TOLERANCE_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;
/// Heights beyond the tolerance, of so many, above which the alarm is raised.
const MOST: [u32; 2] = [4, 5];
/// Inverse of the share of unusual heights on either side above which the alarm is raised.
const MANY: u32 = 8;

/// The height of a return above the place where a faultless sensor would see the road.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RoadHeight {
    /// Height (m).
    pub(crate) offset_m: f64,
    /// Standard deviation of the height with a faultless sensor (m).
    pub(crate) sd_m: f64,
    /// Range of the road (m).
    pub(crate) range_m: f64,
}

/// A beam that the monitor looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RoadBeam {
    /// Probability that a faultless sensor gets a return of the bare road, at least (-).
    pub(crate) probability: f64,
    /// Whether the beam has given a return, of whatever it is.
    pub(crate) has_returned: bool,
    /// Whether a return of the bare road would tell its height.
    pub(crate) tells_height: bool,
    /// The height of the return, if it may be a return of the road.
    pub(crate) height: Option<RoadHeight>,
}

impl RoadBeam {
    /// Forgets what the beam tells of the height of the road.
    pub(crate) fn forget_height(&mut self) {
        (self.tells_height, self.height) = (false, None);
    }
}

/// The latest visits of a sector.
#[derive(Clone, Copy, Debug, Default)]
struct Sector {
    /// Number of the latest successive visits without a return.
    empty_visits: u32,
    /// Logarithm of the probability that a faultless sensor has them.
    log_probability: f64,
    is_blocked: bool,
}

/// The returns in some scans.
#[derive(Clone, Copy, Debug, Default)]
struct Returns {
    scans: u32,
    /// Number of beams that should have a return, and number of those without, as expected and as
    /// counted.
    beams: u32,
    expected_misses: f64,
    misses: u32,
    /// Number of beams of the visits without any return, which are not among these beams.
    empty: u32,
}

/// The heights in some scans.
#[derive(Clone, Copy, Debug, Default)]
struct Heights {
    scans: u32,
    heights: u32,
    /// Number of heights that a bare road would give.
    expected: f64,
    /// Numbers of heights that are unusually great, and unusually small.
    unusual: [u32; 2],
    /// The same, beyond the tolerance of the mounting.
    beyond_tolerance: [u32; 2],
}

/// The road monitor of one LiDAR.
#[derive(Clone, Debug)]
pub(crate) struct RoadMonitor {
    sectors: Vec<Sector>,
    /// Number of blocked sectors.
    blocked: usize,
    returns: Returns,
    heights: Heights,
    /// Whether returns were missing in the latest scans that were counted, and the share of the
    /// beams that gave one.
    is_missing_returns: bool,
    returned_share: f64,
    /// The alarms of the latest heights that were counted.
    of_heights: Alarms,
}

impl RoadMonitor {
    /// Returns the monitor of a sensor with this number of sectors.
    pub(crate) fn new(sectors: usize) -> Self {
        let sectors = vec![Sector::default(); sectors];
        Self {
            sectors,
            blocked: 0,
            returns: Returns::default(),
            heights: Heights::default(),
            is_missing_returns: false,
            returned_share: 1.0,
            of_heights: Alarms::NONE,
        }
    }

    /// Notes the beams of a visit of a sector.
    pub(crate) fn observe(&mut self, sector: usize, beams: &[RoadBeam]) {
        self.sectors[sector].visit(beams, self.returned_share, &mut self.blocked);
        let is_empty = beams.len() > 1 && !beams.iter().any(|beam| beam.has_returned);
        for beam in beams {
            self.returns.count(beam, is_empty);
            self.heights.count(beam);
        }
    }

    /// Notes that all visits of a scan are noted.
    pub(crate) fn end_scan(&mut self) {
        self.returns.scans += 1;
        self.heights.scans += 1;
        if self.returns.scans >= RETURN_SCANS {
            let returns = std::mem::take(&mut self.returns);
            let are_missing = returns.are_missing();
            if are_missing && !self.is_missing_returns {
                // The visits so far have counted with too great a probability of a return.
                self.sectors.iter_mut().filter(|sector| !sector.is_blocked).for_each(Sector::forget);
            }
            (self.is_missing_returns, self.returned_share) = (are_missing, returns.returned_share());
        }
        if self.heights.scans >= HEIGHT_SCANS && self.heights.expected >= LEAST_EXPECTED {
            self.of_heights = std::mem::take(&mut self.heights).alarms();
        }
    }

    /// Returns the alarms after the latest scan.
    pub(crate) fn alarms(&self) -> Alarms {
        self.of_heights
            .with_if(Alarm::BlockedSector, self.blocked > 0)
            .with_if(Alarm::MissingReturns, self.is_missing_returns)
    }
}

impl Sector {
    fn forget(&mut self) {
        *self = Self::default();
    }

    fn visit(&mut self, beams: &[RoadBeam], returned_share: f64, blocked: &mut usize) {
        if beams.iter().any(|beam| beam.has_returned) {
            *blocked -= usize::from(self.is_blocked);
            self.forget();
            return;
        }
        let log = |beam: &RoadBeam| maths::ln(1.0 - (beam.probability * returned_share).clamp(0.0, MOST_CERTAIN));
        let log_probability: f64 = beams.iter().map(log).sum();
        if !(log_probability < 0.0) {
            return;
        }
        self.empty_visits = self.empty_visits.saturating_add(1);
        self.log_probability += log_probability;
        if !self.is_blocked && self.empty_visits >= EMPTY_VISITS && self.log_probability < -DECISION {
            self.is_blocked = true;
            *blocked += 1;
        }
    }
}

impl Returns {
    fn count(&mut self, beam: &RoadBeam, is_visit_empty: bool) {
        if beam.probability < LEAST_PROBABILITY {
            return;
        }
        if is_visit_empty {
            self.empty += 1;
        } else {
            self.beams += 1;
            self.expected_misses += 1.0 - beam.probability.min(MOST_CERTAIN);
            self.misses += u32::from(!beam.has_returned);
        }
    }

    /// Returns the share of the beams outside blocked sectors that have given a return. If returns
    /// are missing, visits without any are among the losses.
    fn returned_share(self) -> f64 {
        let empty = if self.are_missing() { self.empty } else { 0 };
        let (misses, beams) = (self.misses + empty, self.beams + empty);
        if beams > 0 { 1.0 - f64::from(misses) / f64::from(beams) } else { 1.0 }
    }

    /// Returns whether more returns are missing than a faultless sensor loses.
    fn are_missing(self) -> bool {
        evidence(self.misses.into(), self.expected_misses) > DECISION
    }
}

impl Heights {
    fn count(&mut self, beam: &RoadBeam) {
        if beam.tells_height {
            self.expected += beam.probability;
        }
        let Some(RoadHeight { offset_m, sd_m, range_m }) = beam.height else { return };
        self.heights += 1;
        let (unusual_m, tolerance_m) = (UNUSUAL * sd_m, TOLERANCE_RAD * range_m);
        for (side, beyond_m) in [offset_m, -offset_m].into_iter().enumerate() {
            self.unusual[side] += u32::from(beyond_m > unusual_m);
            self.beyond_tolerance[side] += u32::from(beyond_m > unusual_m + tolerance_m);
        }
    }

    fn alarms(self) -> Alarms {
        let is_counted = f64::from(self.heights) >= LEAST_SEEN * self.expected;
        let [most, of_all] = MOST;
        let is_most = |count: &u32| count * of_all > most * self.heights;
        let is_high_or_low = is_counted && self.beyond_tolerance.iter().any(is_most);
        let scatters = is_counted && self.unusual.iter().all(|count| count * MANY > self.heights);
        Alarms::NONE.with_if(Alarm::WrongHeight, is_high_or_low).with_if(Alarm::NoisyRanges, scatters)
    }
}

/// Returns the negative logarithm of a bound on the probability of so many events or more, if
/// `expected` are expected.
fn evidence(events: f64, expected: f64) -> f64 {
    if events > expected && expected > 0.0 { events * maths::ln(events / expected) - events + expected } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, StandardNormal, Stream, stream};
    use rand::RngExt;

    use super::*;

    const SECTORS: usize = 89;
    /// Beams of a visit of the SCALA, and their probabilities of a return.
    const PROBABILITIES: [f64; 4] = [0.99, 0.9999, 0.9999, 0.996];
    const SD_M: f64 = 0.0045;

    /// A sensor with a fault, as it sees the road.
    #[derive(Clone, Copy)]
    struct Sensor {
        /// Share of the returns that are lost in addition.
        dropout: f64,
        /// Sectors that are blocked.
        blocked: [usize; 2],
        offset_m: f64,
        /// Standard deviation of the heights (m).
        sd_m: f64,
        /// Share of the heights that are returns of something low on the road.
        clutter: f64,
    }

    const FAULTLESS: Sensor = Sensor { dropout: 0.0, blocked: [0; 2], offset_m: 0.0, sd_m: SD_M, clutter: 0.0 };

    /// Returns the number of scans after which the monitor raises an alarm for the first time, with
    /// the alarms; `None` if it never does. Two sectors are visited in each scan.
    fn first(sensor: Sensor, scans: usize, rng: &mut Stream) -> Option<(usize, Alarms)> {
        let mut monitor = RoadMonitor::new(SECTORS);
        for scan in 0..scans {
            for visit in [2 * scan, 2 * scan + 1] {
                let sector = visit % SECTORS;
                let is_blocked = (sensor.blocked[0]..sensor.blocked[1]).contains(&sector);
                let beams: [RoadBeam; 4] = std::array::from_fn(|layer| {
                    let probability = PROBABILITIES[layer];
                    let [returned, lost, clutter]: [f64; 3] = rng.random();
                    let has_returned = returned < probability && lost >= sensor.dropout && !is_blocked;
                    let deviate: f64 = rng.sample(StandardNormal);
                    let offset_m = sensor.offset_m + sensor.sd_m * deviate;
                    let offset_m = if clutter < sensor.clutter { 0.08 } else { offset_m };
                    let height = RoadHeight { offset_m, sd_m: SD_M, range_m: 7.25 };
                    // The footprint of the steepest layer alone is shorter than a pulse.
                    let tells_height = layer == 0;
                    let height = (has_returned && tells_height).then_some(height);
                    RoadBeam { probability, has_returned, tells_height, height }
                });
                monitor.observe(sector, &beams);
            }
            monitor.end_scan();
            if !monitor.alarms().is_empty() {
                return Some((scan + 1, monitor.alarms()));
            }
        }
        None
    }

    fn rng(seed: u64) -> Stream {
        stream(seed, 0, &ActorId::new("ego").unwrap(), "road-monitor")
    }

    #[test]
    fn ten_hours_of_a_faultless_sensor_raise_nothing() {
        // 900,000 scans. The bounds allow one false alarm in some thousand hours.
        assert_eq!(first(FAULTLESS, 900_000, &mut rng(1)), None);
        // An hour beside trucks, and with a mounting at the end of its tolerance.
        assert_eq!(first(Sensor { clutter: 0.5, ..FAULTLESS }, 90_000, &mut rng(2)), None);
        assert_eq!(first(Sensor { offset_m: 0.0126, ..FAULTLESS }, 90_000, &mut rng(3)), None);
    }

    #[test]
    fn each_fault_is_noticed_within_its_time_and_for_its_reason() {
        let faults = [
            (Sensor { dropout: 0.6, ..FAULTLESS }, Alarm::MissingReturns, 25),
            (Sensor { offset_m: 0.05, ..FAULTLESS }, Alarm::WrongHeight, 50),
            (Sensor { offset_m: -0.05, ..FAULTLESS }, Alarm::WrongHeight, 50),
            // A noise of 0.3 m of the range.
            (Sensor { sd_m: 0.0255, ..FAULTLESS }, Alarm::NoisyRanges, 100),
            (Sensor { blocked: [43, 44], ..FAULTLESS }, Alarm::BlockedSector, 90),
        ];
        for (sensor, alarm, within) in faults {
            for seed in 0..200 {
                let (scans, alarms) = first(sensor, 1_000, &mut rng(seed)).unwrap();
                assert!(scans <= within && alarms.iter().eq([alarm]), "{alarm:?}: {alarms:?} after {scans} scans");
            }
        }
    }

    #[test]
    fn a_sector_is_free_again_with_its_first_return() {
        let beam = |has_returned| RoadBeam { probability: 0.99, has_returned, tells_height: false, height: None };
        let mut monitor = RoadMonitor::new(2);
        for _ in 0..3 {
            monitor.observe(0, &[beam(false); 4]);
            monitor.observe(1, &[beam(false); 4]);
        }
        assert!(monitor.alarms().contains(Alarm::BlockedSector));
        monitor.observe(0, &[beam(false), beam(true), beam(false), beam(false)]);
        assert!(monitor.alarms().contains(Alarm::BlockedSector), "the other sector is blocked");
        monitor.observe(1, &[beam(true); 4]);
        assert!(monitor.alarms().is_empty());
    }

    #[test]
    fn no_returns_where_none_are_expected_are_no_fault() {
        let nothing = RoadBeam { probability: 0.0, has_returned: false, tells_height: false, height: None };
        let doubtful = RoadBeam { probability: 0.3, ..nothing };
        let mut monitor = RoadMonitor::new(1);
        for scan in 0..10 * RETURN_SCANS {
            monitor.observe(0, &[nothing; 4]);
            monitor.observe(0, &[RoadBeam { has_returned: scan % 3 == 0, ..doubtful }; 4]);
            monitor.end_scan();
            assert!(monitor.alarms().is_empty());
        }
    }

    #[test]
    fn a_sensor_that_loses_returns_everywhere_is_not_blocked() {
        let mut monitor = RoadMonitor::new(SECTORS);
        let mut rng = rng(5);
        let mut times = 0;
        for scan in 0..10_000 {
            let beams: [RoadBeam; 4] = std::array::from_fn(|layer| {
                let returned: f64 = rng.random();
                let probability = PROBABILITIES[layer];
                RoadBeam { probability, has_returned: returned < 0.4, tells_height: false, height: None }
            });
            monitor.observe(scan % SECTORS, &beams);
            monitor.end_scan();
            let alarms = monitor.alarms();
            assert!(!alarms.contains(Alarm::BlockedSector));
            times += usize::from(alarms.contains(Alarm::MissingReturns));
        }
        assert!(times > 9_900, "{times}");
    }

    #[test]
    fn a_lossy_sensor_needs_more_visits() {
        // Of a sensor that loses half of its returns by design, ten visits of four beams are rare.
        let beam = RoadBeam { probability: 0.5, has_returned: false, tells_height: false, height: None };
        let mut monitor = RoadMonitor::new(1);
        let visits = (1..).find(|_| {
            monitor.observe(0, &[beam; 4]);
            monitor.alarms().contains(Alarm::BlockedSector)
        });
        assert_eq!(visits, Some(8), "2^-32 is below 1e-9, and 2^-28 is not");
    }

    #[test]
    fn the_evidence_is_the_bound_of_chernoff() {
        // exp(-1)·(e/10)^10 = 8.1e-7.
        assert!((evidence(10.0, 1.0) + maths::ln(8.103e-7_f64)).abs() < 1e-3, "{}", evidence(10.0, 1.0));
        assert_eq!(evidence(1.0, 2.0), 0.0);
        assert_eq!(evidence(0.0, 0.0), 0.0);
    }
}
