//! Evaluation of the metrics over the window of a lane change.

use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::metrics::{
    CRITICAL_THW_S, Encounter, Moving, Settling, bumper_gap_m, closest_encounter, curvilinear_encounter,
    required_deceleration_mps2, time_headway_s, time_to_collision_s,
};
use closecall_traffic::{Absent, Lane, Time, Trajectory, TrajectoryPoint, maths};

use super::running::RunningChanges;
use super::{
    CRITICAL_A_LAT_MPS2, CRITICAL_A_LON_MPS2, CRITICAL_DCE_M, CRITICAL_DISTANCE_M, CRITICAL_SPEED_FACTOR,
    CRITICAL_TTCE_S, CriticalLaneChange, CurvilinearMetrics, DEFAULT_SPEED_LIMIT_MPS, ENCOUNTER_HORIZON_S, Evaluation,
    FollowingMetrics, MetricResult, Metrics,
};
use crate::filters::{PERIOD, SmoothedTrajectoryData};
use crate::lane_change::{LaneChange, detect};
use crate::trajectory_data::Carriageways;

/// Speed below which a vehicle is assumed to point along the road, because its direction of
/// movement is noise (m/s).
const HEADING_FROM_MPS: f64 = 1.0;

/// Acceleration beyond which a recorded value is an error (m/s²): no tyre brakes harder.
const IMPLAUSIBLE_MPS2: f64 = 12.0;
/// Speed beyond which a recorded value is an error (m/s): 360 km/h.
const IMPLAUSIBLE_MPS: f64 = 100.0;

/// What counts as critical, beside the thresholds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Judgement {
    /// Speed limit (m/s); `None` if it is not known.
    pub speed_limit_mps: Option<f64>,
    /// True if a short TTCE is critical by itself. Otherwise TTCE only decides whether DCE is
    /// evaluated.
    pub ttce_alone: bool,
    /// True if the encounters along the lanes are computed, too ([`CurvilinearMetrics`]). They
    /// change no other value.
    pub curvilinear: bool,
}

/// Detects all lane changes of `data` and evaluates their metrics.
pub fn criticality(data: &SmoothedTrajectoryData, judgement: &Judgement) -> Vec<CriticalLaneChange> {
    let lane_changes = detect(data);
    let running = judgement.curvilinear.then(|| RunningChanges::of(data, &lane_changes));
    let carriageways = &Carriageways::of(data.trajectories());
    let traffic = Traffic { data, carriageways, running: running.as_ref() };
    let evaluated = lane_changes.into_iter().filter_map(|lane_change| {
        let Evaluation { metrics, following, curvilinear } =
            evaluate(traffic, &lane_change, window(&lane_change), judgement)?;
        let instant = instant_of_crossing(data, &lane_change)?;
        let at_crossing = evaluate(traffic, &lane_change, [instant, instant], judgement)?;
        Some(CriticalLaneChange { lane_change, metrics, following, curvilinear, at_crossing })
    });
    evaluated.collect()
}

/// Returns the instant of the common clock that is nearest to the crossing. Of two equally near
/// ones, this is the later one: at the crossing, the vehicle is in its new lane. Returns the
/// crossing itself if the track has no instant within half a period of it, and `None` if `data`
/// does not have the track.
fn instant_of_crossing(data: &SmoothedTrajectoryData, lane_change: &LaneChange) -> Option<Time> {
    let track = &data.tracks[data.track_index(lane_change.track_id)?].trajectory;
    let crossing = Time::from_s(lane_change.crossing_s);
    let distance_ns = |time: &Time| (*time - crossing).ns().abs();
    let times = track.points.iter().map(|point| point.time).rev();
    let nearest = times.min_by_key(distance_ns);
    Some(nearest.filter(|time| 2 * distance_ns(time) <= PERIOD.ns()).unwrap_or(crossing))
}

/// Returns the first and the last instant of a lane change. The estimated manoeuvre may end before
/// the crossing, or begin after it: the crossing belongs to the window.
pub(super) fn window(lane_change: &LaneChange) -> [Time; 2] {
    let LaneChange { start_s, crossing_s, end_s, .. } = *lane_change;
    [Time::from_s(start_s.min(crossing_s)), Time::from_s(end_s.max(crossing_s))]
}

/// The traffic among which opponents are searched.
#[derive(Clone, Copy)]
struct Traffic<'a> {
    data: &'a SmoothedTrajectoryData,
    carriageways: &'a Carriageways,
    /// The lane changes that the vehicles complete, if encounters along the lanes are asked for.
    running: Option<&'a RunningChanges>,
}

/// Evaluates the metrics of one lane change from the first to the last instant of a window. Returns
/// `None` if `data` does not have its track.
fn evaluate(
    Traffic { data, carriageways, running }: Traffic<'_>,
    lane_change: &LaneChange,
    [start, end]: [Time; 2],
    judgement: &Judgement,
) -> Option<Evaluation> {
    let ego_index = data.track_index(lane_change.track_id)?;
    let ego = &data.tracks[ego_index].trajectory;
    let mut extremes = Extremes::default();
    for point in ego.points.iter().filter(|point| point.time >= start && point.time <= end) {
        let others = data.present_at(point.time).iter().filter(|presence| presence.track_index != ego_index);
        let others = others.map(|&presence| VehicleState::new(data.look_up(presence)));
        let is_opponent = |other: &VehicleState<'_>| carriageways.share(other.point.d_m, point.d_m);
        let others: Vec<VehicleState<'_>> = others.filter(is_opponent).collect();
        let ego = VehicleState::new((ego, point));
        extremes.observe(&ego, &others, Lane(lane_change.to_lane));
        if let Some(running) = running {
            extremes.observe_curvilinear(&ego, &others, running);
        }
    }
    let curvilinear = running.map(|_| extremes.curvilinear(judgement));
    Some(Evaluation { metrics: extremes.metrics(judgement), following: extremes.following(), curvilinear })
}

/// The state of one vehicle at one instant.
#[derive(Clone, Copy)]
struct VehicleState<'a> {
    track: &'a Trajectory,
    point: &'a TrajectoryPoint,
    moving: Moving,
}

impl<'a> VehicleState<'a> {
    fn new((track, point): (&'a Trajectory, &'a TrajectoryPoint)) -> Self {
        let (vx_mps, vy_mps) = (point.speed_mps, point.lateral_speed_mps);
        let yaw_rad = if maths::hypot(vx_mps, vy_mps) < HEADING_FROM_MPS { 0.0 } else { maths::atan2(vy_mps, vx_mps) };
        let (length_m, width_m) = (track.dimensions.length_m, track.dimensions.width_m);
        let shape = OrientedBox { x_m: point.s_m, y_m: point.d_m, yaw_rad, length_m, width_m };
        Self { track, point, moving: Moving { shape, vx_mps, vy_mps } }
    }

    /// Returns the movement of a vehicle that completes its lane change, if one is running, and
    /// else keeps its lateral position.
    fn settling(&self, running: &RunningChanges) -> Settling {
        let to_go_m = running.end_m(self.track.track_id, self.point.time).map(|end_m| end_m - self.point.d_m);
        let lateral_mps = self.moving.vy_mps;
        // A vehicle that moves away from where its lane change ended does not complete it yet.
        let completes_after_s =
            to_go_m.filter(|to_go_m| to_go_m * lateral_mps > 0.0).map(|to_go_m| to_go_m / lateral_mps);
        Settling { moving: self.moving, settles_after_s: completes_after_s.unwrap_or(0.0) }
    }

    /// Returns the gap from this vehicle's front to the rear of `other` (m), or `None` if `other`
    /// is not ahead.
    fn gap_to_m(&self, other: &Self) -> Option<f64> {
        let ahead_m = other.point.s_m - self.point.s_m;
        let gap_m = bumper_gap_m(ahead_m, self.track.dimensions.length_m, other.track.dimensions.length_m);
        let reach_m = 0.5 * (self.track.dimensions.width_m + other.track.dimensions.width_m);
        let overlaps_across = (other.point.d_m - self.point.d_m).abs() < reach_m;
        (ahead_m > 0.0 && (gap_m >= 0.0 || overlaps_across)).then_some(gap_m)
    }
}

/// The most critical value of a metric so far, with its opponent and time.
#[derive(Clone, Copy)]
struct Extreme {
    value: f64,
    opponent: Option<u64>,
    time_s: f64,
}

/// Returns the result of a metric: its most critical value, or the reason `otherwise` if there is
/// none.
fn metric_record(extreme: Option<Extreme>, otherwise: Absent, is_critical: impl Fn(f64) -> bool) -> MetricResult {
    match extreme {
        Some(Extreme { value, opponent, time_s }) => {
            MetricResult::Value { value, opponent, time_s, critical: is_critical(value) }
        }
        None => MetricResult::Absent { absent: otherwise },
    }
}

/// Returns the result of a metric of the vehicle alone, which is critical above `critical`. A value
/// above `limit` is an error of the recording, and never critical.
fn magnitude_record(extreme: Option<Extreme>, limit: f64, critical: f64) -> MetricResult {
    match extreme {
        Some(extreme) if !(extreme.value <= limit) => MetricResult::Absent { absent: Absent::Implausible },
        extreme => metric_record(extreme, Absent::NotRecorded, |value| value > critical),
    }
}

/// Replaces `kept` by `new` if `new` is smaller.
fn keep_smaller(kept: &mut Option<Extreme>, new: Extreme) {
    if kept.is_none_or(|kept| new.value < kept.value) {
        *kept = Some(new);
    }
}

/// Replaces `kept` by `new` if `new` is larger.
fn keep_larger(kept: &mut Option<Extreme>, new: Extreme) {
    if kept.is_none_or(|kept| new.value > kept.value) {
        *kept = Some(new);
    }
}

/// The most critical encounters over a window, by one motion model.
#[derive(Default)]
struct EncounterExtremes {
    dce: Option<Extreme>,
    ttce: Option<Extreme>,
    has_encounter_beyond_horizon: bool,
}

impl EncounterExtremes {
    /// Updates both extremes with an encounter. `against` turns a value into an extreme.
    fn observe(&mut self, encounter: Result<Encounter, Absent>, against: impl Fn(f64) -> Extreme) {
        match encounter {
            Ok(encounter) => {
                keep_smaller(&mut self.ttce, against(encounter.ttce_s));
                if encounter.ttce_s < CRITICAL_TTCE_S {
                    keep_smaller(&mut self.dce, against(encounter.dce_m));
                }
            }
            Err(reason) => self.has_encounter_beyond_horizon |= reason == Absent::BeyondHorizon,
        }
    }

    /// Returns the results of DCE and TTCE.
    fn results(&self, has_opponent: bool, judgement: &Judgement) -> [MetricResult; 2] {
        let no_ttce = match (has_opponent, self.has_encounter_beyond_horizon) {
            (false, _) => Absent::NoOpponent,
            (true, true) => Absent::BeyondHorizon,
            (true, false) => Absent::NotApproaching,
        };
        // If there are encounters, but none near enough in time, DCE is absent because of the
        // horizon.
        let no_dce = if self.ttce.is_some() { Absent::BeyondHorizon } else { no_ttce };
        [
            metric_record(self.dce, no_dce, |value| value < CRITICAL_DCE_M),
            metric_record(self.ttce, no_ttce, |value| judgement.ttce_alone && value < CRITICAL_TTCE_S),
        ]
    }
}

/// The most critical values of all metrics over a window.
#[derive(Default)]
struct Extremes {
    distance: Option<Extreme>,
    speed: Option<Extreme>,
    a_lon: Option<Extreme>,
    a_lat: Option<Extreme>,
    thw: Option<Extreme>,
    ttc: Option<Extreme>,
    drac: Option<Extreme>,
    has_lead: bool,
    /// At constant velocity.
    straight: EncounterExtremes,
    /// Along the lanes.
    curvilinear: EncounterExtremes,
    has_opponent: bool,
    was_standing_behind_lead: bool,
}

impl Extremes {
    /// Updates every extreme with the vehicles at one instant; `target` is the lane that the
    /// vehicle changes to.
    fn observe(&mut self, ego: &VehicleState<'_>, others: &[VehicleState<'_>], target: Lane) {
        let time_s = ego.point.time.s();
        let alone = |value| Extreme { value, opponent: None, time_s };
        keep_larger(&mut self.speed, alone(ego.point.speed_mps));
        keep_larger(&mut self.a_lon, alone(ego.point.acceleration_mps2.abs()));
        keep_larger(&mut self.a_lat, alone(ego.point.lateral_acceleration_mps2.abs()));
        self.observe_headway(ego, others, target);
        for other in others {
            self.has_opponent = true;
            let against = |value| Extreme { value, opponent: Some(other.track.track_id), time_s };
            keep_smaller(&mut self.distance, against(ego.moving.shape.distance_m(&other.moving.shape)));
            self.straight.observe(closest_encounter(&ego.moving, &other.moving, ENCOUNTER_HORIZON_S), against);
        }
    }

    /// Updates the encounters along the lanes with the vehicles at one instant.
    fn observe_curvilinear(&mut self, ego: &VehicleState<'_>, others: &[VehicleState<'_>], running: &RunningChanges) {
        let own = ego.settling(running);
        for other in others {
            let (opponent, time_s) = (Some(other.track.track_id), ego.point.time.s());
            let encounter = curvilinear_encounter(&own, &other.settling(running), ENCOUNTER_HORIZON_S);
            self.curvilinear.observe(encounter, |value| Extreme { value, opponent, time_s });
        }
    }

    fn observe_headway(&mut self, ego: &VehicleState<'_>, others: &[VehicleState<'_>], target: Lane) {
        let nearest_in = |lane: Lane| {
            let in_lane = others.iter().filter(move |other| other.point.lane == lane);
            let ahead = in_lane.filter_map(|other| Some((ego.gap_to_m(other)?, other)));
            ahead.min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let leads = [nearest_in(ego.point.lane), nearest_in(target)];
        for (gap_m, lead) in leads.iter().flatten() {
            self.observe_closing(ego, lead, *gap_m);
        }
        let nearest = leads.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((gap_m, lead)) = nearest else { return };
        match time_headway_s(gap_m, ego.point.speed_mps) {
            Ok(value) => {
                let (opponent, time_s) = (Some(lead.track.track_id), ego.point.time.s());
                keep_smaller(&mut self.thw, Extreme { value, opponent, time_s });
            }
            Err(_) => self.was_standing_behind_lead = true,
        }
    }

    /// Updates TTC and DRAC with a vehicle ahead.
    fn observe_closing(&mut self, ego: &VehicleState<'_>, lead: &VehicleState<'_>, gap_m: f64) {
        self.has_lead = true;
        let against = |value| Extreme { value, opponent: Some(lead.track.track_id), time_s: ego.point.time.s() };
        let (ego_mps, lead_mps) = (ego.point.speed_mps, lead.point.speed_mps);
        if let Ok(ttc_s) = time_to_collision_s(gap_m, ego_mps, lead_mps) {
            keep_smaller(&mut self.ttc, against(ttc_s));
        }
        if let Ok(drac_mps2) = required_deceleration_mps2(gap_m, ego_mps, lead_mps, 0.0) {
            keep_larger(&mut self.drac, against(drac_mps2));
        }
    }

    fn following(&self) -> FollowingMetrics {
        let otherwise = if self.has_lead { Absent::NotApproaching } else { Absent::NoLead };
        FollowingMetrics {
            ttc_s: metric_record(self.ttc, otherwise, |_| false),
            drac_mps2: metric_record(self.drac, otherwise, |_| false),
        }
    }

    fn curvilinear(&self, judgement: &Judgement) -> CurvilinearMetrics {
        let [dce_curvilinear_m, ttce_curvilinear_s] = self.curvilinear.results(self.has_opponent, judgement);
        CurvilinearMetrics { dce_curvilinear_m, ttce_curvilinear_s }
    }

    fn metrics(&self, judgement: &Judgement) -> Metrics {
        let speed_limit_mps = judgement.speed_limit_mps.unwrap_or(DEFAULT_SPEED_LIMIT_MPS);
        let no_lead = if self.was_standing_behind_lead { Absent::Standstill } else { Absent::NoLead };
        let [dce_m, ttce_s] = self.straight.results(self.has_opponent, judgement);
        Metrics {
            distance_m: metric_record(self.distance, Absent::NoOpponent, |value| value < CRITICAL_DISTANCE_M),
            speed_mps: magnitude_record(self.speed, IMPLAUSIBLE_MPS, CRITICAL_SPEED_FACTOR * speed_limit_mps),
            a_lon_mps2: magnitude_record(self.a_lon, IMPLAUSIBLE_MPS2, CRITICAL_A_LON_MPS2),
            a_lat_mps2: magnitude_record(self.a_lat, IMPLAUSIBLE_MPS2, CRITICAL_A_LAT_MPS2),
            thw_s: metric_record(self.thw, no_lead, |value| value < CRITICAL_THW_S),
            dce_m,
            ttce_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criticality::{Counted, shares};
    use crate::filters::smooth;
    use crate::trajectory_data::test_support::{changing_track, straight_track, trajectory_data_of};

    /// A lane change from lane 2 to lane 1 between 3 and 8 s at 30 m/s, evaluated against `others`.
    fn evaluated(others: Vec<Trajectory>) -> CriticalLaneChange {
        let mut tracks = vec![changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110)];
        tracks.extend(others);
        let mut evaluations = criticality(&smooth(&trajectory_data_of(tracks)), &Judgement::default());
        assert_eq!(evaluations.len(), 1);
        evaluations.remove(0)
    }

    fn absent(record: MetricResult) -> Option<Absent> {
        match record {
            MetricResult::Absent { absent } => Some(absent),
            MetricResult::Value { .. } => None,
        }
    }

    #[test]
    fn a_vehicle_alone_on_the_road_has_no_opponent() {
        let metrics = evaluated(Vec::new()).metrics;
        assert_eq!(absent(metrics.distance_m), Some(Absent::NoOpponent));
        assert_eq!(absent(metrics.thw_s), Some(Absent::NoLead));
        assert_eq!(absent(metrics.dce_m), Some(Absent::NoOpponent));
        assert_eq!(absent(metrics.ttce_s), Some(Absent::NoOpponent));
        assert!((metrics.speed_mps.value().unwrap() - 30.0).abs() < 1e-6);
        // The quintic path's largest lateral acceleration is 10/√3 · L/T².
        let a_lat = metrics.a_lat_mps2.value().unwrap();
        assert!((a_lat - 5.7735 * 3.5 / 25.0).abs() < 0.05, "{a_lat}");
        assert!(metrics.a_lon_mps2.value().unwrap() < 1e-6);
        assert!(metrics.named().iter().all(|(_, record)| !record.is_critical()));
    }

    #[test]
    fn the_headway_to_the_lead_vehicle_in_the_old_lane_counts() {
        // Both drive at 30 m/s, 19.5 m bumper to bumper: 0.65 s.
        let metrics = evaluated(vec![straight_track(2, 24.0, 30.0, -5.25, 110)]).metrics;
        assert!((metrics.thw_s.value().unwrap() - 0.65).abs() < 1e-6);
        assert!(metrics.thw_s.is_critical());
        assert!((metrics.distance_m.value().unwrap() - 19.5).abs() < 0.05);
        let json = serde_json::to_value(metrics.thw_s).unwrap();
        assert_eq!((&json["opponent"], &json["critical"]), (&2.into(), &true.into()));
    }

    #[test]
    fn a_lead_vehicle_counts_in_the_target_lane_and_not_in_a_third_lane() {
        let target = evaluated(vec![straight_track(2, 64.5, 30.0, -1.75, 110)]).metrics;
        assert!((target.thw_s.value().unwrap() - 2.0).abs() < 1e-6);
        let elsewhere = evaluated(vec![straight_track(2, 64.5, 30.0, -8.75, 110)]).metrics;
        assert_eq!(absent(elsewhere.thw_s), Some(Absent::NoLead));
    }

    #[test]
    fn a_fast_vehicle_that_approaches_in_the_target_lane_is_an_encounter() {
        let metrics = evaluated(vec![straight_track(2, -70.0, 38.0, -1.75, 110)]).metrics;
        let ttce_s = metrics.ttce_s.value().unwrap();
        assert!(ttce_s < 2.6 && !metrics.ttce_s.is_critical(), "TTCE is the gate of DCE: {ttce_s}");
        assert!(metrics.dce_m.is_critical());
        assert_eq!(absent(metrics.thw_s), Some(Absent::NoLead));
    }

    #[test]
    fn a_vehicle_on_another_carriageway_is_no_opponent() {
        // As fast as the vehicle in the target lane of the test before, behind a strip of 32 m
        // without vehicles, and behind one of 6 m.
        let beyond = |d_m: f64| evaluated(vec![straight_track(2, -70.0, 38.0, d_m, 110)]).metrics;
        assert_eq!(absent(beyond(-40.0).ttce_s), Some(Absent::NoOpponent));
        assert_eq!(absent(beyond(-40.0).distance_m), Some(Absent::NoOpponent));
        assert!(beyond(-12.25).ttce_s.value().is_some());
    }

    #[test]
    fn a_vehicle_that_drives_away_is_no_encounter() {
        let metrics = evaluated(vec![straight_track(2, 50.0, 40.0, -8.75, 110)]).metrics;
        assert_eq!(absent(metrics.ttce_s), Some(Absent::NotApproaching));
        assert_eq!(serde_json::to_value(metrics.dce_m).unwrap()["absent"], "not-approaching");
    }

    #[test]
    fn the_speed_limit_decides_whether_a_speed_is_critical() {
        let track = changing_track(1, (0.0, 45.0), (-5.25, -1.75), (3.0, 5.0), 110);
        let data = smooth(&trajectory_data_of(vec![track]));
        let by_limit = |speed_limit_mps| {
            let judgement = Judgement { speed_limit_mps, ..Judgement::default() };
            criticality(&data, &judgement)[0].metrics.speed_mps.is_critical()
        };
        assert!(by_limit(None) && !by_limit(Some(36.1)));
    }

    #[test]
    fn a_short_ttce_is_critical_by_itself_only_if_asked_for() {
        let tracks = vec![
            changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110),
            straight_track(2, -70.0, 38.0, -1.75, 110),
        ];
        let data = smooth(&trajectory_data_of(tracks));
        for ttce_alone in [false, true] {
            let judgement = Judgement { ttce_alone, ..Judgement::default() };
            assert_eq!(criticality(&data, &judgement)[0].metrics.ttce_s.is_critical(), ttce_alone);
        }
    }

    /// The metrics by both motion models of a lane change from lane 3 to lane 2 between 3 and 8 s
    /// at 30 m/s, against one other vehicle.
    fn both_models(other: Trajectory) -> (Metrics, CurvilinearMetrics) {
        let tracks = vec![changing_track(1, (0.0, 30.0), (-8.75, -5.25), (3.0, 5.0), 110), other];
        let judgement = Judgement { curvilinear: true, ..Judgement::default() };
        let change = criticality(&smooth(&trajectory_data_of(tracks)), &judgement).remove(0);
        (change.metrics, change.curvilinear.unwrap())
    }

    #[test]
    fn a_vehicle_beyond_the_new_lane_is_near_at_constant_velocity_and_not_along_the_lanes() {
        // A slower vehicle drives in lane 1. In the middle of the lane change, the lateral speed of
        // 1.3 m/s carries the vehicle that changes lanes by 3.3 m until it has passed, 2.5 s later.
        let (straight, along) = both_models(straight_track(2, 75.5, 20.0, -1.75, 110));
        assert!(straight.dce_m.is_critical(), "{straight:?}");
        // Both are 1.8 m wide, and 3.5 m apart in their lanes: 1.7 m. Until it is in its new lane,
        // the box is turned to the left by up to 1.6 degrees: its corner reaches 0.06 m further.
        let along_m = along.dce_curvilinear_m.value().unwrap();
        assert!((1.6..1.75).contains(&along_m) && !along.dce_curvilinear_m.is_critical(), "{along_m}");
    }

    #[test]
    fn a_slower_vehicle_in_the_new_lane_is_a_collision_course_along_the_lanes() {
        let (_, along) = both_models(straight_track(2, 80.0, 20.0, -5.25, 110));
        assert_eq!(along.dce_curvilinear_m.value(), Some(0.0));
        assert!(along.dce_curvilinear_m.is_critical() && along.ttce_curvilinear_s.value().unwrap() < 2.6, "{along:?}");
        assert!(!along.ttce_curvilinear_s.is_critical(), "TTCE is the gate of DCE");
    }

    #[test]
    fn a_vehicle_that_sways_keeps_its_lateral_position_along_the_lanes() {
        // A faster vehicle passes in lane 4, and sways by 0.3 m at up to 0.9 m/s.
        let mut swaying = straight_track(2, -70.0, 38.0, -12.25, 110);
        for (k, point) in swaying.points.iter_mut().enumerate() {
            let phase = 0.3 * k as f64;
            point.d_m -= 0.3 * maths::sin(phase);
            point.lateral_speed_mps -= 0.9 * maths::cos(phase);
        }
        let (straight, along) = both_models(swaying);
        let (straight_m, along_m) = (straight.dce_m.value().unwrap(), along.dce_curvilinear_m.value().unwrap());
        // 7 m between the lanes, less the sway and the width of a vehicle.
        assert!((along_m - 4.9).abs() < 0.15, "{along_m}");
        assert!(straight_m < along_m - 0.5, "{straight_m} {along_m}");
    }

    #[test]
    fn metrics_along_the_lanes_are_there_only_if_asked_for_and_change_no_other_value() {
        let tracks = || {
            vec![
                changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110),
                straight_track(2, -70.0, 38.0, -1.75, 110),
            ]
        };
        let by = |curvilinear| {
            let judgement = Judgement { curvilinear, ..Judgement::default() };
            criticality(&smooth(&trajectory_data_of(tracks())), &judgement).remove(0)
        };
        let (without, with) = (by(false), by(true));
        assert_eq!((without.metrics, without.following), (with.metrics, with.following));
        assert_eq!(without.at_crossing.metrics, with.at_crossing.metrics);
        let [without, with] = [without, with].map(|change| serde_json::to_value(change).unwrap());
        assert!(without.get("curvilinear").is_none() && without["at_crossing"].get("dce_curvilinear_m").is_none());
        assert!(with["curvilinear"]["dce_curvilinear_m"]["value"].is_number(), "{with}");
        assert!(with["at_crossing"]["ttce_curvilinear_s"]["value"].is_number(), "{with}");
        let names: Vec<_> = by(true).named().map(|(name, ..)| name).collect();
        assert_eq!((names.len(), names[9], names[10]), (11, "dce_curvilinear_m", "ttce_curvilinear_s"));
        assert_eq!(by(false).named().count(), 9);
        let alone = criticality(
            &smooth(&trajectory_data_of(tracks()[..1].to_vec())),
            &Judgement { curvilinear: true, ..Judgement::default() },
        );
        assert_eq!(absent(alone[0].curvilinear.unwrap().dce_curvilinear_m), Some(Absent::NoOpponent));
    }

    #[test]
    fn the_shares_state_encounters_along_the_lanes_apart_and_do_not_count_them() {
        // DCE is critical at constant velocity only.
        let tracks = vec![
            changing_track(1, (0.0, 30.0), (-8.75, -5.25), (3.0, 5.0), 110),
            straight_track(2, 75.5, 20.0, -1.75, 110),
        ];
        let data = smooth(&trajectory_data_of(tracks));
        let by = |curvilinear| {
            shares(&criticality(&data, &Judgement { curvilinear, ..Judgement::default() }), Counted::Complete)
        };
        let (without, with) = (by(false), by(true));
        assert_eq!((without.metrics.len(), with.metrics.len()), (7, 9));
        assert_eq!(without.metrics, with.metrics[..7]);
        assert_eq!((without.any, with.any), (1, 1));
        let [dce, ttce] = &with.metrics[7..] else { panic!("two metrics along the lanes") };
        assert_eq!((dce.metric, dce.critical, dce.absent), ("dce_curvilinear_m", 0, 0));
        assert_eq!((ttce.metric, ttce.critical), ("ttce_curvilinear_s", 0));
    }

    #[test]
    fn the_window_contains_the_crossing() {
        // A vehicle ahead in the target lane brakes hard, so that the headway falls with time.
        let mut lead = straight_track(2, 60.0, 30.0, -1.75, 110);
        for (k, point) in lead.points.iter_mut().enumerate() {
            point.s_m -= 0.004 * (k * k) as f64;
        }
        let ego = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (3.0, 5.0), 110);
        let data = smooth(&trajectory_data_of(vec![ego, lead]));
        let whole = detect(&data).remove(0);
        let traffic = Traffic { data: &data, carriageways: &Carriageways::default(), running: None };
        let thw_s = |change: &LaneChange| {
            let evaluation = evaluate(traffic, change, window(change), &Judgement::default()).unwrap();
            evaluation.metrics.thw_s.value().unwrap()
        };
        // The estimated end of a manoeuvre can lie before its crossing.
        let early = LaneChange { end_s: whole.crossing_s - 1.0, ..whole.clone() };
        let until_crossing = LaneChange { end_s: whole.crossing_s, ..whole.clone() };
        assert_eq!(thw_s(&early), thw_s(&until_crossing));
        assert!(thw_s(&early) > thw_s(&whole), "{} {}", thw_s(&early), thw_s(&whole));
    }

    #[test]
    fn ttc_and_drac_have_their_closed_form_and_the_crossing_its_own_values() {
        // The lead vehicle in the target lane is 45.5 m ahead at first, and 4 m/s slower.
        let evaluation = evaluated(vec![straight_track(2, 50.0, 26.0, -1.75, 110)]);
        let crossing_s = evaluation.lane_change.crossing_s;
        let gap_m = 45.5 - 4.0 * crossing_s;
        let value = |name: &str| evaluation.named().find(|(metric, ..)| *metric == name).unwrap();
        let (_, whole, crossing) = value("ttc_s");
        assert!((crossing.value().unwrap() - gap_m / 4.0).abs() < 1e-6, "{crossing:?}");
        assert!(whole.value().unwrap() <= crossing.value().unwrap());
        let (_, whole, crossing) = value("drac_mps2");
        assert!((crossing.value().unwrap() - 16.0 / (2.0 * gap_m)).abs() < 1e-6, "{crossing:?}");
        assert!(whole.value().unwrap() >= crossing.value().unwrap() && !whole.is_critical());
        let (_, _, thw) = value("thw_s");
        assert!((thw.value().unwrap() - gap_m / 30.0).abs() < 1e-6);
        assert!(matches!(thw, MetricResult::Value { time_s, .. } if (time_s - crossing_s).abs() < 1e-9));
        let alone = evaluated(Vec::new());
        assert_eq!(absent(alone.following.ttc_s), Some(Absent::NoLead));
        let away = evaluated(vec![straight_track(2, 50.0, 40.0, -5.25, 110)]);
        assert_eq!(absent(away.following.drac_mps2), Some(Absent::NotApproaching));
    }

    #[test]
    fn all_values_at_the_crossing_have_one_instant_the_later_of_two_equally_near() {
        // Crossings lie on frames of 10 Hz: on instants of 5 Hz, and halfway between them.
        let mut halfway = 0;
        for frame in 0..4 {
            let start_s = 3.05 + 0.1 * f64::from(frame);
            let tracks = vec![
                changing_track(1, (0.0, 30.0), (-5.25, -1.75), (start_s, 5.0), 120),
                straight_track(2, 50.0, 26.0, -1.75, 120),
                straight_track(3, -40.0, 34.0, -1.75, 120),
            ];
            let change = criticality(&smooth(&trajectory_data_of(tracks)), &Judgement::default()).remove(0);
            let crossing = Time::from_s(change.lane_change.crossing_s);
            let past_ns = crossing.ns() % PERIOD.ns();
            halfway += usize::from(2 * past_ns == PERIOD.ns());
            let later = if 2 * past_ns >= PERIOD.ns() { PERIOD.ns() - past_ns } else { -past_ns };
            let instant = Time::from_ns(crossing.ns() + later);
            let values = change.named().filter_map(|(name, _, at_crossing)| match at_crossing {
                MetricResult::Value { time_s, .. } => Some((name, Time::from_s(time_s))),
                MetricResult::Absent { .. } => None,
            });
            let values: Vec<_> = values.collect();
            assert!(values.len() >= 7, "{values:?}");
            assert!(values.iter().all(|(_, time)| *time == instant), "{instant}: {values:?}");
        }
        assert!(halfway > 0);
    }

    #[test]
    fn shares_refer_to_complete_lane_changes_unless_all_are_asked_for() {
        let close = evaluated(vec![straight_track(2, 24.0, 30.0, -5.25, 110)]);
        let mut cut_off = close.clone();
        cut_off.lane_change.complete = false;
        let changes = [close, evaluated(Vec::new()), cut_off];
        for (counted, critical, total) in [(Counted::Complete, 1, 2), (Counted::All, 2, 3)] {
            let counts = shares(&changes, counted);
            let thw = counts.metrics.iter().find(|share| share.metric == "thw_s").unwrap();
            assert_eq!((thw.critical, thw.absent, thw.share), (critical, 1, Some(critical as f64 / total as f64)));
            assert_eq!((counts.lane_changes, counts.left_out, counts.any), (total, 3 - total, critical));
        }
        assert_eq!(shares(&[], Counted::All).metrics[0].share, None);
    }
}
