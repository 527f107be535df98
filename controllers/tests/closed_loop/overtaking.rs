//! The overtaking driver behind one slow vehicle: signalling, giving up, coming back.

use closecall_controllers::{
    DriverConfig, DriverNote, FollowConfig, LapseConfig, OvertakerConfig, PrescribedConfig, ReactionConfig,
    ReturnConfig, Wiedemann99Config,
};
use closecall_traffic::{ActorId, Indicator, Lane, Num, Road, Time, Vehicle, VehicleClass, stream};

use crate::encounter::human;
use crate::world::{Actor, Who, World, gap_m};

const SLOW: usize = 0;
const REAR: usize = 1;

fn who(config: &DriverConfig, name: &str) -> Who {
    Who::Human(human(config).build(), Box::new(stream(0, 0, &ActorId::new(name).unwrap(), "driver")))
}

fn overtaker() -> OvertakerConfig {
    OvertakerConfig {
        cut_out_thw_s: 0.4.into(),
        follow: FollowConfig::Wiedemann99(Wiedemann99Config { cc1_s: Some(0.1.into()), ..Default::default() }),
        reaction_s: ReactionConfig::Value(0.8.into()),
        lane_change_duration_s: Some(5.0.into()),
        evasive_lateral_mps2: None,
        lapse: None,
        returns: None,
    }
}

/// A slow vehicle at 28 m/s in the middle lane, and a fast one 90 m behind it.
fn world(rear: OvertakerConfig) -> World {
    let road = Road::straight(3);
    let d_m = road.lane_centre_m(Lane(2));
    let car = Vehicle::typical(VehicleClass::Car);
    let keeps = DriverConfig::Prescribed(PrescribedConfig::speeds(&[[0.0, 28.0]]));
    let slow = Actor::new(who(&keeps, "slow"), car, 200.0, d_m, 28.0);
    let rear = Actor::new(who(&DriverConfig::Overtaker(rear), "rear"), car, 110.0 - car.dimensions.length_m, d_m, 36.0);
    World::new(vec![slow, rear], road)
}

/// Steps until `done`, or fails after two minutes.
fn run_until(world: &mut World, mut done: impl FnMut(&World) -> bool) {
    while !done(world) {
        assert!(world.time < Time::from_s(120.0), "it never came to that");
        world.step();
        assert_eq!(world.collision(), None, "at {}", world.time);
    }
}

#[test]
fn it_signals_before_it_pulls_out() {
    let mut world = world(overtaker());
    run_until(&mut world, |world| world.actors[REAR].state.indicator == Indicator::Left);
    let signalled = world.time;
    run_until(&mut world, |world| world.actors[REAR].noted(DriverNote::CutOutStarted).is_some());
    let before_s = (world.time - signalled).s();
    assert!((1.8..2.2).contains(&before_s), "{before_s}");
}

#[test]
fn it_returns_once_it_has_passed_where_the_scenario_says_so() {
    let returns = ReturnConfig { after_s: Some(1.0.into()), thw_s: Some(0.8.into()) };
    let mut world = world(OvertakerConfig { returns: Some(returns), ..overtaker() });
    let lane = |world: &World| world.road.lane_at(world.actors[REAR].state.d_m);
    run_until(&mut world, |world| world.actors[REAR].noted(DriverNote::Passed).is_some());
    assert_eq!(lane(&world), Lane(1));
    let passed = world.time;
    run_until(&mut world, |world| world.actors[REAR].state.indicator == Indicator::Right);
    assert!((world.time - passed).s() >= 1.0);
    run_until(&mut world, |world| world.actors[REAR].state.d_m <= world.road.lane_centre_m(Lane(2)) + 1e-9);
    // The headway was there when it set out, and it has grown since: it is the faster one.
    assert!(gap_m(&world.actors[REAR], &world.actors[SLOW]) > 0.8 * 28.0);
}

#[test]
fn it_stays_in_the_passing_lane_where_the_scenario_does_not() {
    let mut world = world(overtaker());
    run_until(&mut world, |world| world.time >= Time::from_s(60.0));
    assert_eq!(world.road.lane_at(world.actors[REAR].state.d_m), Lane(1));
}

/// When the rear driver pulls out, undisturbed [s].
fn cut_out_s(rear: &OvertakerConfig) -> f64 {
    let mut world = world(rear.clone());
    run_until(&mut world, |world| world.actors[REAR].noted(DriverNote::CutOutStarted).is_some());
    world.time.s()
}

#[test]
fn it_gives_up_and_brakes_when_the_gap_closes() {
    let rear = overtaker();
    let closes_s = cut_out_s(&rear) + 0.1;
    let mut world = world(rear);
    // One in the passing lane, 30 m behind at the same speed, that shoots forward just as the other pulls out.
    let shoots = vec![[Num::Fixed(closes_s), Num::Fixed(5.0)], [Num::Fixed(closes_s + 2.0), Num::Fixed(0.0)]];
    let shoots = PrescribedConfig { acceleration_profile: Some(shoots), ..PrescribedConfig::default() };
    let car = Vehicle::typical(VehicleClass::Car);
    let behind_m = world.actors[REAR].state.s_m - 30.0 - car.dimensions.length_m;
    let left_m = world.road.lane_centre_m(Lane(1));
    world.actors.push(Actor::new(who(&DriverConfig::Prescribed(shoots), "shoots"), car, behind_m, left_m, 36.0));
    run_until(&mut world, |world| world.actors[REAR].noted(DriverNote::CutOutAborted).is_some());
    let mut hardest_mps2: f64 = 0.0;
    run_until(&mut world, |world| {
        hardest_mps2 = hardest_mps2.min(world.actors[REAR].state.acceleration_mps2);
        assert_eq!(world.road.lane_at(world.actors[REAR].state.d_m), Lane(2));
        (world.actors[REAR].state.d_m - world.road.lane_centre_m(Lane(2))).abs() < 1e-9
    });
    assert!(hardest_mps2 < -1.0, "{hardest_mps2}");
    // Once the other is past, it overtakes after all.
    run_until(&mut world, |world| world.actors[REAR].noted(DriverNote::Passed).is_some());
}

#[test]
fn who_looks_away_answers_a_brake_light_later() {
    let answers_at_s = |lapse: Option<LapseConfig>| {
        let follows = Wiedemann99Config {
            cc1_s: Some(0.9.into()),
            reaction_s: Some(ReactionConfig::Value(0.7.into())),
            lapse,
            ..Wiedemann99Config::default()
        };
        let mut world = world(overtaker());
        world.actors[REAR] = Actor::new(
            who(&DriverConfig::Wiedemann99(follows), "rear"),
            world.actors[REAR].vehicle,
            168.0,
            -5.625,
            28.0,
        );
        world.actors[SLOW].brakes = Some((3.0, 4.0));
        run_until(&mut world, |world| world.actors[REAR].command_mps2 < -1.0);
        world.time.s()
    };
    let attentive_s = answers_at_s(None);
    let lapse = LapseConfig { at_s: Some(2.5.into()), every_s: None, duration_s: 1.2.into() };
    assert!((answers_at_s(Some(lapse)) - (2.5 + 1.2 + 0.7)).abs() < 0.05);
    assert!((3.7..3.9).contains(&attentive_s), "{attentive_s}");
}
