//! The reference point of the paper: speed of the ego 30 m/s, front time headway 0.7 s, closing speed 24 km/h, rear
//! vehicle at 100 m, d_c 5 m. The figures come from the states of the vehicles, not from the system's own summary.

use closecall_controllers::EgoState;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::Time;

use crate::drive::{arm, scenario};

const SCENARIO: &str = include_str!("../../../scenarios/library/paper-figure.toml");

/// d_c (m).
const CRITICAL_GAP_M: f64 = 5.0;

/// The true state at one control step.
#[derive(Clone, Copy)]
struct Now {
    time_s: f64,
    speed_mps: f64,
    thw_front_s: f64,
}

/// The states at the engagement and when the rear vehicle is at the critical gap.
#[derive(Default)]
struct Figure {
    engaged: Option<Now>,
    critical: Option<Now>,
}

impl Observer for Figure {
    fn step(&mut self, view: &StepView<'_>) {
        let [ego, front, rear] = view.vehicles else { unreachable!("the scenario has three vehicles") };
        let length_m = ego.vehicle.dimensions.length_m;
        let rear_gap_m = ego.state.s_m - rear.state.s_m - length_m;
        let now = Now {
            time_s: view.time.s(),
            speed_mps: ego.state.speed_mps,
            thw_front_s: (front.state.s_m - ego.state.s_m - length_m) / ego.state.speed_mps,
        };
        if self.engaged.is_none() && view.command.state == EgoState::Increasing {
            assert!(rear_gap_m <= 100.0 && rear_gap_m > 99.0, "{rear_gap_m}");
            let plan = view.command.plan.unwrap();
            assert!(plan.goal_in_reach && plan.thw_at_critical_s.unwrap() >= 2.63, "{plan:?}");
            self.engaged = Some(now);
        }
        if rear_gap_m <= CRITICAL_GAP_M {
            self.critical.get_or_insert(now);
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

#[test]
fn one_metre_per_second_squared_gains_two_seconds() {
    let mut figure = Figure::default();
    simulate(&scenario(SCENARIO), RunKey { seed: 0, sample: 0 }, &arm(BuiltIn::Mis), &mut figure).unwrap();
    let (engaged, critical) = (figure.engaged.unwrap(), figure.critical.unwrap());
    let mean_mps2 = (engaged.speed_mps - critical.speed_mps) / (critical.time_s - engaged.time_s);
    assert!((0.9..=1.1).contains(&mean_mps2), "{mean_mps2}");
    let gained_s = critical.thw_front_s - engaged.thw_front_s;
    assert!((1.9..=2.1).contains(&gained_s), "{gained_s}");
}
