//! Measures the fulfilment of the method's promise: the headway that is gained, and the braking
//! around the crossing.
//!
//! ```text
//!  start ──────▶ R is near ──────▶ R is at the critical distance ──▶ R crosses
//!  │ least headway │ goal in reach? │ headway                    2 s │ 2 s: hardest braking
//! ```
//!
//! R is the vehicle behind the ego in its lane. All values are true states; the reports of a
//! controller do not count.

use std::collections::VecDeque;

use closecall_controllers::{
    ACTUATOR_LAG_S, ArrivalPrediction, BRAKE_RELEASE_JERK_MPS3, BrakingResponse, Encounter, GOAL_TOLERANCE_S,
    MisSettings,
};
use closecall_traffic::{Absent, Measured, Time};

use closecall_scenarios::outcome::Promise;

/// Time before and after the crossing in which the ego is not to brake hard: the paper's critical
/// time.
const AROUND_CROSSING: Time = Time::from_ms(2_000);

/// The ego at one physics step.
#[derive(Clone, Copy, Debug)]
pub(super) struct EgoMotion {
    pub(super) time: Time,
    pub(super) braking_mps2: f64,
    pub(super) thw_front_s: Measured,
}

/// Collects the fulfilment of the promise.
#[derive(Debug)]
pub(super) struct PromiseMeter {
    /// Smallest front time headway until a vehicle behind is near (s).
    least_thw_s: Measured,
    is_near: bool,
    in_reach: Option<bool>,
    raised_s: Measured,
    /// Braking of the last two seconds (m/s²).
    recent: VecDeque<(Time, f64)>,
    crossed_at: Option<Time>,
    crossing_braking_mps2: f64,
}

impl PromiseMeter {
    pub(super) fn new() -> Self {
        Self {
            least_thw_s: Err(Absent::NoLead),
            is_near: false,
            in_reach: None,
            raised_s: Err(Absent::NeverCritical),
            recent: VecDeque::new(),
            crossed_at: None,
            crossing_braking_mps2: 0.0,
        }
    }

    /// Adds one physics step. It must not be called after the ego's first collision.
    pub(super) fn observe(&mut self, now: &EgoMotion) {
        if let Ok(thw_s) = now.thw_front_s
            && !self.is_near
        {
            self.least_thw_s = Ok(self.least_thw_s.map_or(thw_s, |least_s| least_s.min(thw_s)));
        }
        match self.crossed_at {
            None => {
                self.recent.push_back((now.time, now.braking_mps2));
                while self.recent.front().is_some_and(|(time, _)| now.time - *time > AROUND_CROSSING) {
                    self.recent.pop_front();
                }
            }
            Some(crossed_at) if now.time - crossed_at <= AROUND_CROSSING => {
                self.crossing_braking_mps2 = self.crossing_braking_mps2.max(now.braking_mps2);
            }
            Some(_) => {}
        }
    }

    /// Notes that a vehicle behind is near, for the first time. `encounter` is the encounter of the
    /// ego with it and with the lead vehicle; `None` without a lead vehicle.
    pub(super) fn note_near(&mut self, encounter: Option<Encounter>, settings: &MisSettings) {
        if !self.is_near {
            self.is_near = true;
            self.in_reach = encounter.map(|encounter| is_in_reach(encounter, settings));
        }
    }

    /// Notes the front time headway when the vehicle behind is at the critical distance (s).
    pub(super) fn note_critical(&mut self, thw_front_s: Measured) {
        self.raised_s = thw_front_s.and_then(|thw_s| Ok(thw_s - self.least_thw_s?));
    }

    /// Notes that the vehicle behind has left the lane, for the first time.
    pub(super) fn note_crossed(&mut self, time: Time) {
        if self.crossed_at.is_none() {
            self.crossed_at = Some(time);
            self.crossing_braking_mps2 = self.recent.iter().fold(0.0, |most, (_, braking)| most.max(*braking));
        }
    }

    /// Returns what became of the promise.
    pub(super) fn finish(self) -> Promise {
        Promise {
            in_reach: self.in_reach,
            thw_raised_s: self.raised_s,
            crossing_braking_mps2: self.crossed_at.map(|_| self.crossing_braking_mps2).ok_or(Absent::NeverCrossed),
        }
    }
}

/// Returns true if braking within the limit reaches the goal before the vehicle behind arrives.
fn is_in_reach(encounter: Encounter, settings: &MisSettings) -> bool {
    let response = BrakingResponse {
        commanded_mps2: 0.0,
        braking_mps2: 0.0,
        build_up_mps3: settings.max_jerk_mps3,
        release_mps3: BRAKE_RELEASE_JERK_MPS3,
        lag_s: ACTUATOR_LAG_S,
    };
    let goal_s = encounter.front_gap_m / encounter.ego_mps + settings.thw_gain_s;
    let prediction = ArrivalPrediction { encounter, response };
    let braking = prediction.solve(goal_s, settings.max_deceleration_mps2).map(|solution| solution.deceleration_mps2);
    braking
        .and_then(|braking| prediction.headway_at_arrival_s(braking))
        .is_some_and(|thw_s| thw_s >= goal_s - GOAL_TOLERANCE_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reference point: the paper's figure.
    const REFERENCE: Encounter = Encounter {
        ego_mps: 30.0,
        front_gap_m: 21.0,
        lead_mps: 30.0,
        rear_gap_m: 100.0,
        closing_mps: 24.0 / 3.6,
        critical_gap_m: 5.0,
    };

    fn at(time_ms: i64, braking_mps2: f64, thw_s: f64) -> EgoMotion {
        EgoMotion { time: Time::from_ms(time_ms), braking_mps2, thw_front_s: Ok(thw_s) }
    }

    #[test]
    fn the_goal_is_in_reach_of_a_slow_vehicle_and_out_of_reach_of_a_fast_one() {
        let settings = MisSettings::PAPER;
        assert!(is_in_reach(Encounter { closing_mps: 5.0, ..REFERENCE }, &settings));
        assert!(!is_in_reach(Encounter { closing_mps: 12.0, ..REFERENCE }, &settings));
        assert!(is_in_reach(
            Encounter { closing_mps: 12.0, ..REFERENCE },
            &MisSettings { max_deceleration_mps2: 4.0, ..settings }
        ));
    }

    #[test]
    fn the_gain_counts_from_the_smallest_headway_before_the_vehicle_behind_is_near() {
        let mut meter = PromiseMeter::new();
        for (time_ms, thw_s) in [(0, 0.8), (10, 0.7), (20, 0.9)] {
            meter.observe(&at(time_ms, 0.0, thw_s));
        }
        meter.note_near(Some(REFERENCE), &MisSettings::PAPER);
        meter.observe(&at(30, 0.0, 0.2));
        meter.note_critical(Ok(2.6));
        let promise = meter.finish();
        assert!((promise.thw_raised_s.unwrap() - 1.9).abs() < 1e-12);
        assert_eq!(promise.crossing_braking_mps2, Err(Absent::NeverCrossed));
    }

    #[test]
    fn braking_counts_from_two_seconds_before_until_two_seconds_after_the_crossing() {
        let braking_of = |hard_at_ms: i64| {
            let mut meter = PromiseMeter::new();
            for time_ms in (0..10_000).step_by(10) {
                meter.observe(&at(time_ms, if time_ms == hard_at_ms { 5.0 } else { 0.5 }, 1.0));
                if time_ms == 5_000 {
                    meter.note_crossed(Time::from_ms(time_ms));
                }
            }
            meter.finish().crossing_braking_mps2.unwrap()
        };
        assert_eq!([2_990, 3_000, 5_000, 7_000, 7_010].map(braking_of), [0.5, 5.0, 5.0, 5.0, 0.5]);
    }
}
