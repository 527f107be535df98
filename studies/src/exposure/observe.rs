//! Encounters in trajectory data: the lead vehicle of a vehicle brakes while another comes near
//! from behind.

use closecall_recorded::filters::{Presence, SmoothedTrajectoryData};
use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{ENGAGEMENT_CLOSING_MPS, ENGAGEMENT_GAP_M, Trajectory, TrajectoryPoint};
use serde::Serialize;

/// Time for which the lead vehicle must not have braked before an event (s): an assumption. One
/// braking thus counts once.
const APART_S: f64 = 2.0;
/// Largest front time headway of the ego at which the lead vehicle matters (s): the headway below
/// which the system engages.
const SHORT_THW_S: f64 = 1.5;
/// Speed below which a time headway is meaningless (m/s).
const MIN_SPEED_MPS: f64 = 1.0;

/// The rule for events.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EventRule {
    /// Deceleration of the lead vehicle from which it counts as braking (m/s²).
    pub braking_mps2: f64,
}

/// The observation in trajectory data.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Observed {
    /// Names of the data.
    pub sources: Vec<String>,
    /// Distance that all vehicles drove (km).
    pub distance_km: f64,
    /// Time that all vehicles were seen (h).
    pub hours: f64,
    /// Times at which a vehicle comes near another from behind, which follows a third at a short
    /// headway.
    pub approaches: u64,
    /// Events: the lead vehicle begins to brake while the rear vehicle is near.
    pub events: u64,
    /// Speed differences of the rear vehicle at the beginning of each approach (m/s).
    pub closing_mps: Vec<f64>,
    /// Time headways of the rear vehicle to the ego at each event (s).
    pub rear_thw_s: Vec<f64>,
}

/// Adds what smoothed trajectory data shows.
pub fn observe(data: &SmoothedTrajectoryData, rule: EventRule, into: &mut Observed) {
    into.sources.push(data.name.clone());
    for (index, track) in data.tracks.iter().enumerate() {
        let points = &track.trajectory.points;
        if let (Some(first), Some(last)) = (points.first(), points.last()) {
            into.distance_km += (last.s_m - first.s_m).abs() / 1_000.0;
            into.hours += (last.time - first.time).s() / 3_600.0;
        }
        observe_ego(data, index, rule, into);
    }
}

/// Observes one vehicle as the ego.
fn observe_ego(data: &SmoothedTrajectoryData, ego: usize, rule: EventRule, into: &mut Observed) {
    let trajectory = &data.tracks[ego].trajectory;
    // The rear vehicle that is near, by the index of its track.
    let mut near = None;
    for point in &trajectory.points {
        let Some((lead, rear)) = neighbours(data, ego, trajectory, point) else {
            near = None;
            continue;
        };
        let closing_mps = rear.point.speed_mps - point.speed_mps;
        let thw_s = lead.gap_m / point.speed_mps.max(MIN_SPEED_MPS);
        let was_near = near == Some(rear.presence.track_index);
        // Once near, the rear vehicle stays near until it is out of reach: its approach ends when
        // it has come close.
        let is_near = thw_s < SHORT_THW_S
            && rear.gap_m <= ENGAGEMENT_GAP_M
            && (was_near || closing_mps >= ENGAGEMENT_CLOSING_MPS);
        if is_near && !was_near {
            into.approaches += 1;
            into.closing_mps.push(closing_mps);
        }
        if is_near && begins_to_brake(data, lead.presence, rule) {
            into.events += 1;
            into.rear_thw_s.push(rear.gap_m / rear.point.speed_mps.max(MIN_SPEED_MPS));
        }
        near = is_near.then_some(rear.presence.track_index);
    }
}

/// Returns whether a vehicle brakes, and did not brake in the time before. It need not have been
/// the lead vehicle then.
fn begins_to_brake(data: &SmoothedTrajectoryData, presence: Presence, rule: EventRule) -> bool {
    let (track, now) = data.look_up(presence);
    let brakes = |point: &TrajectoryPoint| point.acceleration_mps2 <= -rule.braking_mps2;
    let before = &track.points[..presence.point_index];
    let mut recent = before.iter().rev().take_while(|point| (now.time - point.time).s() <= APART_S);
    brakes(now) && !before.is_empty() && !recent.any(brakes)
}

/// A neighbour in the lane.
struct Neighbour<'a> {
    presence: Presence,
    point: &'a TrajectoryPoint,
    /// Gap, bumper to bumper (m).
    gap_m: f64,
}

/// Returns the vehicles ahead and behind in the ego's lane; `None` if one is missing.
fn neighbours<'a>(
    data: &'a SmoothedTrajectoryData,
    ego: usize,
    trajectory: &Trajectory,
    point: &TrajectoryPoint,
) -> Option<(Neighbour<'a>, Neighbour<'a>)> {
    let (mut ahead, mut behind) = (None::<Neighbour<'a>>, None::<Neighbour<'a>>);
    for &presence in data.present_at(point.time).iter().filter(|presence| presence.track_index != ego) {
        let (other, at) = data.look_up(presence);
        if at.lane != point.lane {
            continue;
        }
        let distance_m = at.s_m - point.s_m;
        let gap_m = bumper_gap_m(distance_m.abs(), trajectory.dimensions.length_m, other.dimensions.length_m);
        let nearest = if distance_m > 0.0 { &mut ahead } else { &mut behind };
        if nearest.as_ref().is_none_or(|neighbour| gap_m < neighbour.gap_m) {
            *nearest = Some(Neighbour { presence, point: at, gap_m });
        }
    }
    Some((ahead?, behind?))
}

#[cfg(test)]
mod tests {
    use closecall_recorded::filters::smooth;
    use closecall_recorded::trajectory_data::TrajectoryData;
    use closecall_traffic::{Dimensions, Lane, Time, VehicleClass};

    use super::*;

    const STEP_S: f64 = 0.04;

    fn track(track_id: u64, at: impl Fn(f64) -> (f64, f64, f64)) -> Trajectory {
        track_in(track_id, |_| 2, at)
    }

    fn track_in(track_id: u64, lane: impl Fn(f64) -> u8, at: impl Fn(f64) -> (f64, f64, f64)) -> Trajectory {
        let points = (0..350).map(|step| {
            let time_s = f64::from(step) * STEP_S;
            let (s_m, speed_mps, acceleration_mps2) = at(time_s);
            TrajectoryPoint {
                time: Time::from_s(time_s),
                s_m,
                d_m: -5.625,
                speed_mps,
                acceleration_mps2,
                lateral_speed_mps: 0.0,
                lateral_acceleration_mps2: 0.0,
                lane: Lane(lane(time_s)),
            }
        });
        let dimensions = Dimensions { length_m: 4.6, width_m: 1.8, height_m: 1.5 };
        Trajectory { track_id, vehicle_id: track_id, class: VehicleClass::Car, dimensions, points: points.collect() }
    }

    /// Three vehicles in a lane: the lead vehicle brakes by 6 m/s² from 12 s to 13 s, and the rear
    /// vehicle, which starts `rear_m` behind the ego, is 8 m/s faster.
    fn observed(rear_m: f64, braking_mps2: f64) -> Observed {
        let rear = |t: f64| (-rear_m + 38.0 * t, 38.0, 0.0);
        observed_in(
            vec![track(1, |t| braking_from(12.0, t)), track(2, |t| (30.0 * t, 30.0, 0.0)), track(3, rear)],
            braking_mps2,
        )
    }

    /// A vehicle 40 m ahead of the ego that brakes by 6 m/s² for 1 s.
    fn braking_from(start_s: f64, t: f64) -> (f64, f64, f64) {
        let braked = (t - start_s).clamp(0.0, 1.0);
        let lost_m = 3.0 * braked * braked + 6.0 * (t - start_s - 1.0).max(0.0);
        let is_braking = (start_s..start_s + 1.0).contains(&t);
        (40.0 + 30.0 * t - lost_m, 30.0 - 6.0 * braked, if is_braking { -6.0 } else { 0.0 })
    }

    fn observed_in(tracks: Vec<Trajectory>, braking_mps2: f64) -> Observed {
        let data = TrajectoryData::new("made", Time::from_s(STEP_S), tracks);
        let mut observed = Observed::default();
        observe(&smooth(&data), EventRule { braking_mps2 }, &mut observed);
        observed
    }

    #[test]
    fn a_braking_lead_vehicle_counts_if_a_rear_vehicle_is_near() {
        // At 12 s the rear vehicle is 130 − 96 = 34 m behind.
        let encounters = observed(130.0, 4.0);
        assert_eq!((encounters.events, encounters.approaches), (1, 1), "{encounters:?}");
        assert!(
            (encounters.closing_mps[0] - 8.0).abs() < 0.2 && (0.6..1.0).contains(&encounters.rear_thw_s[0]),
            "{encounters:?}"
        );
        assert!((encounters.distance_km - 1.35).abs() < 0.05, "{encounters:?}");
        assert_eq!(observed(320.0, 4.0).events, 0, "too far away");
        assert_eq!(observed(130.0, 7.0).events, 0, "braking less than that");
    }

    #[test]
    fn an_approach_is_that_of_one_rear_vehicle() {
        let scene = |leaves_s: f64| {
            let rear = track_in(3, |t| if t < leaves_s { 2 } else { 1 }, |t| (-130.0 + 38.0 * t, 38.0, 0.0));
            let follower = track(4, |t| (-70.0 + 30.0 * t, 30.0, 0.0));
            let lead = track(1, |t| braking_from(12.0, t));
            observed_in(vec![lead, track(2, |t| (30.0 * t, 30.0, 0.0)), rear, follower], 4.0)
        };
        // The faster vehicle passes the follower at 60 / 8 = 7.5 s, and is the rear vehicle from
        // then on.
        assert_eq!(scene(20.0).events, 1);
        assert_eq!(scene(11.0).events, 0, "the follower behind it never approached");
    }

    #[test]
    fn the_lead_vehicle_must_begin_to_brake() {
        let scene = |brakes_s: f64, arrives_s: f64| {
            let lead = track_in(1, |t| if t < arrives_s { 1 } else { 2 }, |t| braking_from(brakes_s, t));
            let ahead = track_in(4, |t| if t < arrives_s { 2 } else { 1 }, |t| (41.0 + 30.0 * t, 30.0, 0.0));
            let rear = track(3, |t| (-130.0 + 38.0 * t, 38.0, 0.0));
            observed_in(vec![lead, track(2, |t| (30.0 * t, 30.0, 0.0)), rear, ahead], 4.0)
        };
        assert_eq!(scene(12.0, 11.0).events, 1);
        assert_eq!(scene(12.0, 12.5).events, 0, "it brakes already when it becomes the lead vehicle");
    }
}
