//! The sensors' view of a vehicle, step by step: on an approach, after it appears, and while it
//! brakes and changes lanes.

use closecall_sensors::{Perception, Scene, SensorError, Sensors};
use closecall_traffic::{CONTROL_STEP, Road, Track, TrackStatus, maths};

use super::{APPEARS_AT_M, Address, Course, GAPS_M, Traffic, WAIT_STEPS, build, confirmed, errors, follow, nearest};
use crate::perception::cases::Case;

/// Fewest steps that the sensors watch an empty road before a vehicle appears.
const EMPTY_STEPS: i64 = 10;
/// Number of different times of appearance, in steps: a second, which holds each phase of a mirror
/// and of a camera at 5 Hz.
const PHASES: i64 = 25;
/// Gap (m) and closing speed (m/s) at which a vehicle that will brake and change lanes begins, and
/// the time for which it keeps its speed and lane (steps): 2 s. All vehicles are then within the
/// range of the full chain in fog (100 m).
const BEFORE_MANOEUVRE_M: f64 = 35.0;
const BEFORE_MANOEUVRE_MPS: f64 = 5.0;
const BEFORE_MANOEUVRE_STEPS: i64 = 50;
/// Its deceleration (m/s²) and its speed across the road (m/s): firm braking, and a usual lane
/// change.
const BRAKING_MPS2: f64 = 3.0;
const ACROSS_MPS: f64 = 1.0;
/// Changes at which the lag is measured: of the speed (m/s), and of the position across the road
/// (m).
const CHANGES: [f64; 2] = [2.0, 0.5];
/// Longest time for which a manoeuvre is watched (steps): 2 s, in which the vehicle neither stops
/// nor leaves the next lane.
const MANOEUVRE_STEPS: i64 = 50;
/// Number of steps before a manoeuvre whose mean error is the error of the track at rest.
const REST_STEPS: usize = 10;

/// The sensors' view of a vehicle in one control step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// True gap from the front of the vehicle to the ego's rear (m).
    pub(crate) gap_m: f64,
    /// The confirmed track of the vehicle, if there is one.
    pub(crate) seen: Option<Seen>,
}

/// A confirmed track in one control step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Errors along (m), across (m), of the speed along the road (m/s), and of the speed across it
    /// (m/s).
    pub(crate) errors: [f64; 4],
    /// Whether the latest scan has not detected the vehicle.
    pub(crate) is_coasting: bool,
}

/// Times from the appearance of a vehicle until its track reaches a state (s); `None` if it does
/// not within 4 s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Delays {
    /// The track is confirmed.
    pub(crate) confirmed_s: Option<f64>,
    /// The track is confirmed, exists at least as likely as not, and is classified as a vehicle:
    /// the state that a function waits for.
    pub(crate) classified_s: Option<f64>,
}

/// Returns all steps of an approach, down to a gap of `near_m` (m).
///
/// # Errors
/// [`SensorError`] if a sensor model fails.
pub(crate) fn steps(
    case: &Case,
    sensors: &Sensors,
    road: &Road,
    at: Address,
    near_m: f64,
) -> Result<Vec<Step>, SensorError> {
    let mut steps = Vec::new();
    let course = Course { case, sensors, road, at, noise: at, lane_keeping_m: 0.0, from_m: GAPS_M[0] };
    follow(&course, |gap_m, track, traffic| {
        let seen = track.map(|track| seen(track, traffic));
        steps.push(Step { gap_m, seen });
        gap_m >= near_m
    })?;
    Ok(steps)
}

fn seen(track: &Track, traffic: &Traffic) -> Seen {
    let errors = errors(track, traffic.truths_m()[0], &traffic.others[0]);
    let state = &traffic.others[0].state;
    let across_mps = state.speed_mps * maths::sin(state.heading_rad);
    Seen {
        errors: [errors.position_m[0], errors.position_m[1], errors.speed_mps, track.vy_mps() - across_mps],
        is_coasting: track.status == TrackStatus::Coasting,
    }
}

/// Returns the confirmed track of the vehicle in the next step.
fn track_of<'a>(
    perception: &'a mut dyn Perception,
    case: &Case,
    road: &Road,
    traffic: &Traffic,
    step: i64,
) -> Result<Option<&'a Track>, SensorError> {
    let time = CONTROL_STEP * step;
    let scene = Scene { time, road, environment: &case.environment, ego: traffic.ego, others: &traffic.others };
    let tracks: Vec<&Track> = confirmed(perception.step(&scene)?).collect();
    Ok(traffic.truths_m().first().and_then(|truth_m| nearest(&tracks, *truth_m)))
}

/// Returns the delays of a vehicle that appears 40 m behind the ego on an empty road, and keeps its
/// distance.
///
/// # Errors
/// [`SensorError`] if a sensor model fails.
pub(crate) fn delays(case: &Case, sensors: &Sensors, road: &Road, at: Address) -> Result<Delays, SensorError> {
    let mut traffic = Traffic::new(case, road, APPEARS_AT_M, 0.0);
    let vehicles = std::mem::take(&mut traffic.others);
    let mut perception = build(sensors, at)?;
    let appears = EMPTY_STEPS + i64::try_from(at.run).unwrap_or(0) % PHASES;
    let mut delays = Delays::default();
    let mut travelled_m = 0.0;
    for step in 0..appears + WAIT_STEPS {
        if step == appears {
            traffic.others.clone_from(&vehicles);
            traffic.others[0].state.s_m += travelled_m;
        }
        if let Some(track) = track_of(perception.as_mut(), case, road, &traffic, step)? {
            let since_s = Some((CONTROL_STEP * (step - appears)).s());
            delays.confirmed_s = delays.confirmed_s.or(since_s);
            if track.existence >= 0.5 && track.class.is_vehicle() {
                delays.classified_s = since_s;
                break;
            }
        }
        travelled_m += traffic.ego.state.speed_mps * CONTROL_STEP.s();
        traffic.advance();
    }
    Ok(delays)
}

/// Returns by how much later than the vehicle its track slows down, and moves across the road (s). Returns `None` if a track is
/// missing meanwhile.
///
/// # Errors
/// [`SensorError`] if a sensor model fails.
pub(crate) fn lags_s(
    case: &Case,
    sensors: &Sensors,
    road: &Road,
    at: Address,
) -> Result<Option<[f64; 2]>, SensorError> {
    let mut traffic = Traffic::new(case, road, BEFORE_MANOEUVRE_M, BEFORE_MANOEUVRE_MPS);
    let mut perception = build(sensors, at)?;
    let (mut at_rest, mut moving) = (Vec::new(), Vec::new());
    let start_mps = traffic.others[0].state.speed_mps;
    let start_d_m = traffic.others[0].state.d_m;
    let before = BEFORE_MANOEUVRE_STEPS + i64::try_from(at.run).unwrap_or(0) % PHASES;
    for step in 0..before + MANOEUVRE_STEPS {
        let track = track_of(perception.as_mut(), case, road, &traffic, step)?.map(|track| seen(track, &traffic));
        let state = &mut traffic.others[0].state;
        match track {
            Some(seen) if step < before => at_rest.push([-seen.errors[2], seen.errors[1]]),
            // Errors are the errors of the track relative to the truth. Truth and error add up to
            // the value of the track.
            Some(seen) => {
                moving.push([start_mps - state.speed_mps - seen.errors[2], state.d_m - start_d_m + seen.errors[1]])
            }
            None if step >= before => return Ok(None),
            None => {}
        }
        if step >= before {
            let slower_mps = BRAKING_MPS2 * CONTROL_STEP.s();
            (state.speed_mps, state.acceleration_mps2) = (state.speed_mps - slower_mps, -BRAKING_MPS2);
            state.heading_rad = maths::asin(ACROSS_MPS / state.speed_mps);
            state.d_m += ACROSS_MPS * CONTROL_STEP.s();
        }
        traffic.advance();
    }
    let rest = &at_rest[at_rest.len().saturating_sub(REST_STEPS)..];
    let lag_s = |axis: usize, per_s: f64| {
        let bias = rest.iter().map(|errors| errors[axis]).sum::<f64>() / rest.len().max(1) as f64;
        let shown: Vec<f64> = moving.iter().map(|errors| errors[axis] - bias).collect();
        Some(crossing_s(&shown, CHANGES[axis])? - CHANGES[axis] / per_s)
    };
    Ok(lag_s(0, BRAKING_MPS2).zip(lag_s(1, ACROSS_MPS)).map(|(along_s, across_s)| [along_s, across_s]))
}

/// Returns the time at which values, one of each control step, first reach a level (s); between two
/// steps, they change evenly.
fn crossing_s(values: &[f64], level: f64) -> Option<f64> {
    let index = values.iter().position(|value| *value >= level)?;
    let share = match index.checked_sub(1).map(|before| values[before]) {
        Some(before) => (level - before) / (values[index] - before) - 1.0,
        None => 0.0,
    };
    Some((index as f64 + share) * CONTROL_STEP.s())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_crossed_between_two_steps() {
        assert_eq!(crossing_s(&[0.0, 0.0, 1.0], 1.0), Some(0.08));
        assert!((crossing_s(&[0.0, 0.4, 0.6], 0.5).unwrap() - 0.06).abs() < 1e-12);
        assert_eq!(crossing_s(&[0.0, 0.4], 0.5), None);
        assert_eq!(crossing_s(&[0.7], 0.5), Some(0.0));
    }
}
