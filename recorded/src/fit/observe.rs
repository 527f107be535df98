//! Extraction of the values of each quantity from trajectory data.

use std::collections::BTreeMap;

use closecall_traffic::metrics::{CRITICAL_THW_S, bumper_gap_m, time_headway_s};
use closecall_traffic::statistics::quantiles::median;
use closecall_traffic::{Lane, Side, Time, Trajectory, TrajectoryPoint};

use crate::filters::{PERIOD, SmoothedTrajectoryData};
use crate::lane_change::{LaneChange, detect};

/// Largest headway at which a vehicle counts as following (s); see the module documentation.
const FOLLOWING_THW_S: f64 = 3.0;

/// Shortest time gap of adaptive cruise control (s): half of the 1 s that driver's manuals call the
/// shortest setting.
const SHORTEST_ACC_S: f64 = 0.5;

/// Shortest total time of following for which a pair of vehicles counts.
const MIN_FOLLOWING: Time = Time::from_ms(2_000);

/// A quantity to which a distribution is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Headway to the lead vehicle of the old lane when the centre crosses the marking (s).
    CutOutThw,
    /// The same, for values below the critical headway only (s).
    CriticalCutOutThw,
    /// Duration of complete lane changes (s).
    LaneChangeDuration,
    /// Width of the peak of lateral speed of complete lane changes (s).
    LaneChangeWidth,
    /// Closing speed to the lead vehicle of the old lane when the manoeuvre starts (m/s).
    Closing,
    /// Speed when the centre crosses the marking (m/s).
    CrossingSpeed,
    /// Median headway of a pair while following (s).
    FrontThw,
    /// The same, only for values that are critical but not shorter than the headways of adaptive
    /// cruise control (s).
    ShortFrontThw,
    /// Median speed of the following vehicle of a pair (m/s).
    FollowingSpeed,
}

impl Quantity {
    /// All quantities, in the order of output.
    pub const ALL: [Self; 9] = [
        Self::CutOutThw,
        Self::CriticalCutOutThw,
        Self::LaneChangeDuration,
        Self::LaneChangeWidth,
        Self::Closing,
        Self::CrossingSpeed,
        Self::FrontThw,
        Self::ShortFrontThw,
        Self::FollowingSpeed,
    ];

    /// Returns the name of the scenario parameter, which ends with its unit.
    pub const fn name(self) -> &'static str {
        match self {
            Self::CutOutThw => "cut-out-thw-s",
            Self::CriticalCutOutThw => "critical-cut-out-thw-s",
            Self::LaneChangeDuration => "lane-change-duration-s",
            Self::LaneChangeWidth => "lane-change-width-s",
            Self::Closing => "closing-mps",
            Self::CrossingSpeed => "crossing-mps",
            Self::FrontThw => "front-thw-s",
            Self::ShortFrontThw => "short-front-thw-s",
            Self::FollowingSpeed => "following-mps",
        }
    }

    /// Returns the quantity that this quantity is a part of, and the range of its values (in its
    /// unit): from the first number up to below the second. `None` if it is no part of another
    /// quantity.
    pub const fn part_of(self) -> Option<(Self, [f64; 2])> {
        match self {
            Self::CriticalCutOutThw => Some((Self::CutOutThw, [0.0, CRITICAL_THW_S])),
            Self::ShortFrontThw => Some((Self::FrontThw, [SHORTEST_ACC_S, CRITICAL_THW_S])),
            _ => None,
        }
    }

    /// Returns a description of the values, for the comments of the output file.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::CutOutThw => "headway to the old lane's lead at the crossing, lane changes to the left, at most 3 s",
            Self::CriticalCutOutThw => "the values of cut-out-thw-s that are critical: below 0.9 s",
            Self::LaneChangeDuration => "whole manoeuvre of complete lane changes",
            Self::LaneChangeWidth => "peak width of complete lane changes",
            Self::Closing => "closing speed to the old lane's lead at the start, lane changes to the left, approaching",
            Self::CrossingSpeed => "speed at the crossing of all lane changes",
            Self::FrontThw => "median headway of each pair that follows for 2 s or more, at most 3 s",
            Self::ShortFrontThw => {
                "the values of front-thw-s that adaptive cruise control might keep and that are critical: 0.5 to 0.9 s"
            }
            Self::FollowingSpeed => "median speed of each pair that follows for 2 s or more",
        }
    }
}

/// The values of each quantity, in the order of trajectory data sets, tracks and time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    values: BTreeMap<Quantity, Vec<f64>>,
    /// The values of each lane change and of each pair of vehicles, for correlations.
    rows: Vec<BTreeMap<Quantity, f64>>,
}

impl Samples {
    /// Returns the values of one quantity.
    pub fn values(&self, quantity: Quantity) -> &[f64] {
        self.values.get(&quantity).map_or(&[], Vec::as_slice)
    }

    /// Appends the values of another trajectory data set.
    pub fn extend(&mut self, other: Self) {
        for (quantity, values) in other.values {
            self.values.entry(quantity).or_default().extend(values);
        }
        self.rows.extend(other.rows);
    }

    /// Returns the values of two quantities of the lane changes or pairs that have both.
    pub(super) fn pairs(&self, a: Quantity, b: Quantity) -> (Vec<f64>, Vec<f64>) {
        self.rows.iter().filter_map(|row| Some((*row.get(&a)?, *row.get(&b)?))).unzip()
    }

    /// Begins the values of a further lane change or pair.
    fn begin(&mut self) {
        self.rows.push(BTreeMap::new());
    }

    fn push(&mut self, quantity: Quantity, value: f64) {
        if let Some(row) = self.rows.last_mut() {
            row.insert(quantity, value);
        }
        self.values.entry(quantity).or_default().push(value);
    }

    /// Adds a headway to a quantity, and to the quantity that is a part of it if it is in its
    /// range.
    fn push_headway(&mut self, part: Quantity, thw_s: f64) {
        let Some((whole, [from_s, to_s])) = part.part_of() else { return };
        self.push(whole, thw_s);
        if (from_s..to_s).contains(&thw_s) {
            self.push(part, thw_s);
        }
    }
}

/// Extracts the values of all quantities from one trajectory data set.
pub fn observe(data: &SmoothedTrajectoryData) -> Samples {
    let mut samples = Samples::default();
    for change in detect(data) {
        observe_lane_change(data, &change, &mut samples);
    }
    observe_following(data, &mut samples);
    samples
}

fn observe_lane_change(data: &SmoothedTrajectoryData, change: &LaneChange, samples: &mut Samples) {
    samples.begin();
    samples.push(Quantity::CrossingSpeed, change.speed_mps);
    if change.complete {
        samples.push(Quantity::LaneChangeDuration, change.duration_s);
        samples.push(Quantity::LaneChangeWidth, change.width_s);
    }
    if change.direction != Side::Left {
        return;
    }
    let crossing = Time::from_s(change.crossing_s);
    let Some(lead) = lead_in(data, change.track_id, Lane(change.from_lane), crossing) else { return };
    let Ok(thw_s) = time_headway_s(lead.gap_m, lead.follower.speed_mps) else { return };
    if thw_s > FOLLOWING_THW_S {
        return;
    }
    samples.push_headway(Quantity::CriticalCutOutThw, thw_s);
    // The closing speed to the same lead vehicle at the start of the manoeuvre, or when both are
    // first recorded.
    let follower = &data.tracks[lead.follower_index].trajectory;
    let other = &data.tracks[lead.lead_index].trajectory;
    let Some((earliest, _)) = follower.span().zip(other.span()).map(|(a, b)| (a.0.max(b.0), ())) else { return };
    let start = Time::from_s(change.start_s).max(earliest).min(crossing);
    if let Some((follower, other)) = follower.at(start).zip(other.at(start)) {
        let closing_mps = follower.speed_mps - other.speed_mps;
        if closing_mps > 0.0 {
            samples.push(Quantity::Closing, closing_mps);
        }
    }
}

/// A vehicle and its lead vehicle at one instant.
struct LeadPair<'a> {
    follower: &'a TrajectoryPoint,
    follower_index: usize,
    lead_index: usize,
    /// Gap bumper to bumper (m).
    gap_m: f64,
}

/// Returns track `track_id` and the nearest vehicle in `lane` that is entirely ahead of it at
/// `time`.
fn lead_in(data: &SmoothedTrajectoryData, track_id: u64, lane: Lane, time: Time) -> Option<LeadPair<'_>> {
    let present = data.present_at(time);
    let follower = present.iter().find(|presence| data.look_up(**presence).0.track_id == track_id)?;
    let (own_track, own_point) = data.look_up(*follower);
    let ahead = present.iter().filter(|presence| presence.track_index != follower.track_index).filter_map(|presence| {
        let (track, point) = data.look_up(*presence);
        let gap_m = gap_m((own_track, own_point), (track, point));
        (point.lane == lane && gap_m >= 0.0).then_some((gap_m, presence.track_index))
    });
    let (gap_m, lead_index) = ahead.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(LeadPair { follower: own_point, follower_index: follower.track_index, lead_index, gap_m })
}

/// Returns the gap between two vehicles, bumper to bumper (m).
fn gap_m(rear: (&Trajectory, &TrajectoryPoint), front: (&Trajectory, &TrajectoryPoint)) -> f64 {
    bumper_gap_m(front.1.s_m - rear.1.s_m, front.0.dimensions.length_m, rear.0.dimensions.length_m)
}

/// Adds the median headway and speed of each pair of vehicles that follow each other for long
/// enough.
fn observe_following(data: &SmoothedTrajectoryData, samples: &mut Samples) {
    let mut pairs: BTreeMap<(usize, usize), Vec<(f64, f64)>> = BTreeMap::new();
    let spans = data.tracks.iter().filter_map(|track| track.trajectory.span());
    let Some((mut time, last)) = spans.reduce(|(a, b), (c, d)| (a.min(c), b.max(d))) else { return };
    while time <= last {
        for following in following_at(data, time) {
            let instants = pairs.entry((following.follower_index, following.lead_index)).or_default();
            instants.push((following.thw_s, following.speed_mps));
        }
        time += PERIOD;
    }
    for instants in pairs.into_values() {
        if PERIOD * (instants.len() as i64) < MIN_FOLLOWING {
            continue;
        }
        samples.begin();
        let (headways, speeds): (Vec<f64>, Vec<f64>) = instants.into_iter().unzip();
        samples.push_headway(Quantity::ShortFrontThw, median(headways));
        samples.push(Quantity::FollowingSpeed, median(speeds));
    }
}

/// A vehicle that follows another vehicle at one instant.
struct Following {
    follower_index: usize,
    lead_index: usize,
    /// Time headway (s).
    thw_s: f64,
    /// Speed of the following vehicle (m/s).
    speed_mps: f64,
}

/// Returns all pairs of neighbours in one lane in which one follows the other at `time`.
fn following_at(data: &SmoothedTrajectoryData, time: Time) -> Vec<Following> {
    let mut present: Vec<_> = data.present_at(time).to_vec();
    present.sort_by(|a, b| {
        let (a, b) = (data.look_up(*a).1, data.look_up(*b).1);
        a.lane.cmp(&b.lane).then(a.s_m.total_cmp(&b.s_m))
    });
    let follows = present.windows(2).filter_map(|pair| {
        let (rear, front) = (data.look_up(pair[0]), data.look_up(pair[1]));
        let gap_m = gap_m(rear, front);
        let thw_s = time_headway_s(gap_m, rear.1.speed_mps).ok()?;
        let counts = rear.1.lane == front.1.lane && gap_m >= 0.0 && thw_s <= FOLLOWING_THW_S;
        let [follower_index, lead_index] = [pair[0].track_index, pair[1].track_index];
        counts.then_some(Following { follower_index, lead_index, thw_s, speed_mps: rear.1.speed_mps })
    });
    follows.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filters::smooth;
    use crate::trajectory_data::test_support::{changing_track, straight_track, trajectory_data_of};

    /// A vehicle at 30 m/s changes lanes to the left behind a lead vehicle at 26 m/s.
    fn overtaking() -> Samples {
        let follower = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110);
        let lead = straight_track(2, 40.0, 26.0, -5.25, 110);
        observe(&smooth(&trajectory_data_of(vec![follower, lead])))
    }

    #[test]
    fn a_lane_change_gives_headway_closing_speed_and_duration() {
        let samples = overtaking();
        // The crossing is at 5.5 s or one frame later, with a gap of 40 − 4.5 − 4·t (m) at 30 m/s.
        let thw_s = samples.values(Quantity::CutOutThw)[0];
        assert!((thw_s - (35.5 - 4.0 * 5.5) / 30.0).abs() < 0.4 / 30.0 + 1e-6, "{thw_s}");
        assert!((samples.values(Quantity::Closing)[0] - 4.0).abs() < 1e-6);
        assert!((samples.values(Quantity::LaneChangeDuration)[0] - 5.0).abs() < 0.25);
        assert!((samples.values(Quantity::CrossingSpeed)[0] - 30.0).abs() < 1e-6);
    }

    #[test]
    fn each_pair_that_follows_long_enough_gives_one_value() {
        let pair = |frames| {
            let lead = straight_track(2, 44.5, 20.0, -1.75, frames);
            observe(&smooth(&trajectory_data_of(vec![straight_track(1, 0.0, 20.0, -1.75, frames), lead])))
        };
        assert_eq!(pair(18).values(Quantity::FrontThw), [0.0; 0]);
        let samples = pair(20);
        let [thw_s] = samples.values(Quantity::FrontThw) else { panic!("one pair") };
        assert!((thw_s - 2.0).abs() < 1e-6);
    }

    #[test]
    fn a_vehicle_with_a_long_headway_does_not_follow() {
        let tracks = vec![straight_track(1, 0.0, 20.0, -1.75, 50), straight_track(2, 70.0, 20.0, -1.75, 50)];
        assert!(observe(&smooth(&trajectory_data_of(tracks))).values(Quantity::FrontThw).is_empty());
    }
}
