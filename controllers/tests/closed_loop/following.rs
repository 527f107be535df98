//! One vehicle behind another: reaction times as they show from outside.

use closecall_controllers::{DriverConfig, PrescribedConfig, ReactionConfig, Wiedemann99Config};
use closecall_traffic::{ActorId, Lane, Road, Time, Vehicle, VehicleClass, stream};
use proptest::prelude::*;

use crate::encounter::human;
use crate::world::{Actor, Who, World, gap_m};

/// cc0.
const STANDSTILL_GAP_M: f64 = 1.5;

/// How much nearer than cc0 one may come to rest [m].
const REST_M: f64 = 0.2;

/// A leader at 30 m/s that brakes at 5 s, and a follower at the same speed `gap` behind it.
fn pair(gap: f64, cc1_s: f64, reaction_s: f64, brake_mps2: f64) -> World {
    let road = Road::straight(3);
    let d_m = road.lane_centre_m(Lane(2));
    let car = Vehicle::typical(VehicleClass::Car);
    let who = |config: &DriverConfig, name: &str| {
        Who::Human(human(config).build(), Box::new(stream(0, 0, &ActorId::new(name).unwrap(), "driver")))
    };
    let leads = DriverConfig::Prescribed(PrescribedConfig::speeds(&[[0.0, 30.0]]));
    let follows = DriverConfig::Wiedemann99(Wiedemann99Config {
        cc1_s: Some(cc1_s.into()),
        reaction_s: Some(ReactionConfig::Value(reaction_s.into())),
        ..Wiedemann99Config::default()
    });
    let mut leader = Actor::new(who(&leads, "leader"), car, 100.0 + gap + car.dimensions.length_m, d_m, 30.0);
    leader.brakes = Some((5.0, brake_mps2));
    World::new(vec![leader, Actor::new(who(&follows, "follower"), car, 100.0, d_m, 30.0)], road)
}

/// How well it ends: the least gap until both stand [m], or less the speed of the impact [m/s].
fn ending(mut world: World) -> f64 {
    let mut least_m = f64::INFINITY;
    while world.time < Time::from_s(50.0) {
        world.step();
        let [leader, follower] = &world.actors[..] else { unreachable!("two vehicles drive here") };
        if world.collision().is_some() {
            return leader.state.speed_mps - follower.state.speed_mps;
        }
        least_m = least_m.min(gap_m(leader, follower));
    }
    least_m
}

#[test]
fn deceleration_follows_the_brake_light_by_the_reaction_time() {
    for reaction_s in [0.4, 0.9, 1.5] {
        let mut world = pair(29.0, 0.9, reaction_s, 6.0);
        let (mut light, mut answer) = (None, None);
        while answer.is_none() {
            let before_mps2 = world.actors[1].command_mps2;
            world.step();
            if world.actors[0].state.brake_light && light.is_none() {
                light = Some(world.time);
            }
            if light.is_some() && world.actors[1].command_mps2 < before_mps2.min(-0.5) {
                answer = Some(world.time);
            }
        }
        let delay_s = (answer.unwrap() - light.unwrap()).s();
        assert!((delay_s - reaction_s).abs() <= 0.02, "{delay_s} instead of {reaction_s}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// The plain braking case: a driver who follows in its band behind a leader who brakes to standstill at a constant rate.
    /// All who come to a stop roll up to cc0, so that reaction decides the least gap where room is short, and nothing else.
    /// One exception: who had to brake hard to the end may come to rest up to 0.2 m nearer than cc0, and how much of that
    /// it is does not follow the reaction time.
    #[test]
    fn a_longer_reaction_never_gives_a_larger_least_gap(
        in_band in 0.2..3.8, cc1 in 0.2..1.5, reaction in 0.0..1.8, longer in 0.05..1.0, braking in 2.0..8.0,
    ) {
        let gap = 1.5 + cc1 * 30.0 + in_band;
        let quick = ending(pair(gap, cc1, reaction, braking));
        let slow = ending(pair(gap, cc1, reaction + longer, braking));
        let tolerance_m = if quick > STANDSTILL_GAP_M - REST_M { REST_M } else { 0.02 };
        prop_assert!(slow <= quick + tolerance_m, "{slow} {quick}");
    }
}
