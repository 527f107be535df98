//! The paper's figure: v_E 30 m/s, THW_F 0.7 s, Δv 24 km/h, R at 100 m, d_c 5 m.

use closecall_controllers::EgoState;
use closecall_traffic::VehicleClass;

use crate::encounter::{Case, Sample, world};
use crate::world::gap_m;

const DRAWN: Sample = Sample {
    cruise_mps: 30.0,
    closing_mps: 24.0 / 3.6,
    front_thw_s: 0.7,
    cut_out_thw_s: 0.2,
    cc1_s: 0.02,
    duration_s: 6.8,
    reaction_s: 0.9,
    brake_at_s: 0.0,
    brake_mps2: 0.0,
    class: VehicleClass::Car,
};

#[test]
fn one_metre_per_second_squared_gains_two_seconds() {
    let case = Case { front_brakes: false, ..Case::HEADLINE };
    let mut world = world(&case, &DRAWN, 0, true);
    let mut engaged = None;
    let mut rear_gap_m = f64::INFINITY;
    while rear_gap_m > 5.0 {
        world.step();
        let (ego, front, rear) = (&world.actors[0], &world.actors[1], &world.actors[2]);
        let thw_s = gap_m(front, ego) / ego.state.speed_mps;
        rear_gap_m = gap_m(ego, rear);
        if engaged.is_none() && world.ego_command.unwrap().state == EgoState::Increasing {
            assert!(rear_gap_m <= 100.0 && rear_gap_m > 99.0, "{rear_gap_m}");
            let plan = world.ego_command.unwrap().plan.unwrap();
            assert!(plan.goal_in_reach && plan.thw_at_critical_s.unwrap() >= 2.63, "{plan:?}");
            engaged = Some((world.time.s(), ego.state.speed_mps, thw_s));
        }
    }
    let (ego, front) = (&world.actors[0], &world.actors[1]);
    let (time_s, speed_mps, thw_s) = engaged.unwrap();
    let mean_mps2 = (speed_mps - ego.state.speed_mps) / (world.time.s() - time_s);
    let gained_s = gap_m(front, ego) / ego.state.speed_mps - thw_s;
    assert!((0.9..=1.1).contains(&mean_mps2), "{mean_mps2}");
    assert!((1.9..=2.1).contains(&gained_s), "{gained_s}");
}
