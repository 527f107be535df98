use closecall_traffic::{ActorId, Check, PHYSICS_STEP, Parameters, VehicleClass, stream};

use super::acceleration::ASSUMED_BRAKING_MPS2;
use super::*;
use crate::driver::testing::{car_ahead, with_input};
use crate::driver::{LaneNeighbours, LapseConfig, Lead, Neighbour, Neighbours};

/// Observes a lead vehicle with this motion and brake light from a vehicle at 30 m/s, and returns
/// it as perceived.
fn observe(perception: &mut Perception, time: Time, lead: Lead, brake_light: bool) -> PerceivedVehicle {
    let own = LaneNeighbours { lead: Some(car_ahead(lead, brake_light)), ..LaneNeighbours::default() };
    let neighbours = Neighbours { own, ..Neighbours::default() };
    let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
    with_input(time, &neighbours, |input| perception.observe(input, &mut rng).ahead.unwrap())
}

/// Returns a lead vehicle that keeps its speed.
fn steady(gap_m: f64, speed_mps: f64) -> Lead {
    Lead { gap_m, speed_mps, acceleration_mps2: 0.0 }
}

#[test]
fn a_steady_approach_is_extrapolated_exactly() {
    let mut perception = Perception::new(0.9, None);
    let mut time = Time::ZERO;
    for _ in 0..500 {
        let gap_m = 50.0 - 5.0 * time.s();
        let seen = observe(&mut perception, time, steady(gap_m, 25.0), false);
        assert!((seen.lead.gap_m - gap_m).abs() < 1e-9 && seen.lead.speed_mps == 25.0, "{seen:?} at {time}");
        time += PHYSICS_STEP;
    }
}

#[test]
fn a_brake_light_is_perceived_after_the_reaction_time_and_implies_an_ordinary_braking() {
    let mut perception = Perception::new(0.9, None);
    let mut time = Time::ZERO;
    let mut first = None;
    while first.is_none() {
        let on = time >= Time::from_s(2.0);
        let seen = observe(&mut perception, time, steady(30.0, 30.0), on);
        if seen.brake_light {
            assert_eq!(seen.lead.acceleration_mps2, -ASSUMED_BRAKING_MPS2);
            first = Some(time);
        }
        time += PHYSICS_STEP;
    }
    assert_eq!(first, Some(Time::from_s(2.9)));
}

#[test]
fn a_small_speed_difference_at_a_large_gap_is_not_noticed() {
    // 1.85 m · 5 m/s / g² falls below 0.003 rad/s beyond 55.5 m, and below 0.0006 rad/s beyond 124
    // m.
    let mut perception = Perception::new(0.0, None);
    let mut time = Time::ZERO;
    for (gap_m, speed_mps, perceived_mps) in [
        (60.0, 25.0, 30.0),
        (50.0, 25.0, 25.0),
        (60.0, 26.0, 26.0),
        // Below the attended threshold, the perceived speed stays at 26 m/s until the observed one
        // differs enough from it.
        (130.0, 25.5, 26.0),
        (60.0, 27.0, 26.0),
        (60.0, 29.9, 26.0),
        (30.0, 29.0, 29.0),
    ] {
        let seen = observe(&mut perception, time, steady(gap_m, speed_mps), false);
        assert_eq!(seen.lead.speed_mps, perceived_mps, "{gap_m} m, {speed_mps} m/s");
        time += PHYSICS_STEP;
    }
}

#[test]
fn a_vehicle_that_stops_is_not_extrapolated_backwards() {
    // From 6 m/s at 6 m/s² it stands after one second and 3 m: 3 m less than at constant speed.
    // Later it stays there.
    assert_eq!(accelerated_displacement_m(6.0, -6.0, 1.0), -3.0);
    assert_eq!(6.0 * 2.5 + accelerated_displacement_m(6.0, -6.0, 2.5), 3.0);
    assert_eq!(accelerated_displacement_m(0.0, -6.0, 1.0), 0.0);
    assert_eq!(accelerated_displacement_m(10.0, 2.0, 1.0), 1.0);
}

#[test]
fn a_full_memory_replaces_its_oldest_observation() {
    let mut perception = Perception::new(MAX_REACTION_S, None);
    let mut time = Time::ZERO;
    for step in 0..2_000_u32 {
        let seen = observe(&mut perception, time, steady(f64::from(step), 30.0), false);
        let due = step.saturating_sub(300);
        assert!((seen.lead.gap_m - f64::from(due)).abs() < 1e-6, "{step}: {seen:?}");
        time += PHYSICS_STEP;
    }
    assert_eq!(perception.memory.len(), MEMORY_CAPACITY);
    assert_eq!(perception.memory.capacity(), MEMORY_CAPACITY);
}

#[test]
fn a_brake_light_during_a_lapse_is_perceived_one_reaction_time_after_the_lapse() {
    let lapse = LapseConfig { at_s: Some(1.5.into()), every_s: None, duration_s: 2.0.into(), duration_sigma: None };
    let lapse = lapse.check(&Parameters::default()).unwrap();
    let mut perception = Perception::new(0.9, None).with_lapses(Some(lapse));
    let mut time = Time::ZERO;
    let seen = |perception: &mut Perception, time: Time| {
        observe(perception, time, steady(30.0, 30.0), time >= Time::from_s(2.0)).brake_light
    };
    while !seen(&mut perception, time) {
        time += PHYSICS_STEP;
    }
    assert_eq!(time, Time::from_s(1.5 + 2.0 + 0.9));
}

/// Returns a driver that looks through the vehicle ahead.
fn anticipating(anticipation: f64) -> Perception {
    let config = PerceptionConfig { anticipation: Some(anticipation.into()), evidence: None };
    Perception::new(0.9, None).with_settings(config.check(&Parameters::default()).unwrap())
}

/// Returns a driver's perception, at `time`, of a steady vehicle ahead if the vehicle beyond it
/// brakes at 6 m/s² from 2 s on.
fn seen_before_a_braking_one(perception: &mut Perception, time: Time) -> PerceivedVehicle {
    let on = time >= Time::from_s(2.0);
    let acceleration_mps2 = if on { -6.0 } else { 0.0 };
    let speed_mps = 30.0 + acceleration_mps2 * (time.s() - 2.0).max(0.0);
    let own = LaneNeighbours { lead: Some(car_ahead(steady(20.0, 30.0), false)), ..LaneNeighbours::default() };
    let beyond = Neighbour { actor: 2, ..car_ahead(Lead { gap_m: 50.0, speed_mps, acceleration_mps2 }, on) };
    let neighbours = Neighbours { own, beyond: Some(beyond), ..Neighbours::default() };
    let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
    with_input(time, &neighbours, |input| perception.observe(input, &mut rng).ahead.unwrap())
}

#[test]
fn a_driver_who_anticipates_expects_braking_one_reaction_time_after_the_brake_light_beyond() {
    let [mut none, mut half, mut full] = [0.0, 0.5, 1.0].map(anticipating);
    let mut time = Time::ZERO;
    while time < Time::from_s(2.9) {
        for perception in [&mut none, &mut half, &mut full] {
            assert!(!seen_before_a_braking_one(perception, time).brake_light, "{time}");
        }
        time += PHYSICS_STEP;
    }
    let seen = seen_before_a_braking_one(&mut full, time);
    assert!(seen.brake_light, "{seen:?}");
    assert_eq!(seen.lead.acceleration_mps2, -ASSUMED_BRAKING_MPS2);
    // The vehicle directly ahead still keeps its speed, and is perceived to.
    assert_eq!(seen.lead.speed_mps, 30.0);
    assert_eq!(seen_before_a_braking_one(&mut half, time).lead.acceleration_mps2, -0.5 * ASSUMED_BRAKING_MPS2);
    let seen = seen_before_a_braking_one(&mut none, time);
    assert!(!seen.brake_light && seen.lead.acceleration_mps2 == 0.0, "{seen:?}");
}

/// Returns the time from the start of braking at `braking_mps2`, 15 m ahead and with its brake
/// light on, until a driver who accumulates evidence perceives it (s).
fn noticed_after_s(braking_mps2: f64) -> f64 {
    let config = PerceptionConfig { anticipation: None, evidence: Some(EvidenceConfig::default()) };
    let mut perception = Perception::new(0.1, None).with_settings(config.check(&Parameters::default()).unwrap());
    let mut time = Time::ZERO;
    loop {
        let lead = Lead {
            gap_m: 15.0 - 0.5 * braking_mps2 * time.s() * time.s(),
            speed_mps: 30.0 - braking_mps2 * time.s(),
            acceleration_mps2: -braking_mps2,
        };
        let seen = observe(&mut perception, time, lead, true);
        if seen.brake_light {
            assert!(seen.lead.acceleration_mps2 < 0.0 && seen.lead.speed_mps < 30.0, "{seen:?}");
            return time.s();
        }
        time += PHYSICS_STEP;
    }
}

#[test]
fn accumulated_evidence_is_noticed_later_behind_a_vehicle_that_brakes_gently() {
    let [hard_s, gentle_s] = [8.0, 1.0].map(noticed_after_s);
    // ∫(b·t/15 − 0.0155)dt = 0.0888 gives 0.61 s for 8 m/s² and 1.9 s for 1 m/s², plus the delay of
    // 0.1 s.
    assert!((0.6..0.85).contains(&hard_s) && (1.6..2.1).contains(&gentle_s), "{hard_s} {gentle_s}");
}

#[test]
fn a_driver_without_a_reaction_time_has_no_perception_to_set() {
    let none = Parameters::default();
    let config = PerceptionConfig { anticipation: Some(1.5.into()), evidence: None };
    assert_eq!(check_perception(Some(&config), false, &none).unwrap_err().path.to_string(), "perception");
    let error = check_perception(Some(&config), true, &none).unwrap_err();
    assert_eq!(error.path.to_string(), "perception.anticipation");
    let config = PerceptionConfig {
        anticipation: None,
        evidence: Some(EvidenceConfig { threshold: None, gating_per_s: Some(0.9.into()) }),
    };
    let error = check_perception(Some(&config), true, &none).unwrap_err();
    assert_eq!(error.path.to_string(), "perception.evidence.gating-per-s");
}

/// Returns the perception of a driver at 30 m/s. The nearest vehicle is 15 m ahead at the same
/// speed until it has left the lane at 3 s. The next vehicle, of the same kind, drives 17 m/s
/// slower.
fn seen_behind_a_leader_that_leaves(perception: &mut Perception, time: Time, class: VehicleClass) -> PerceivedScene {
    let near = Neighbour { class, ..car_ahead(steady(15.0, 30.0), false) };
    let next = Neighbour { actor: 2, ..car_ahead(steady(110.0 - 17.0 * time.s(), 13.0), false) };
    let has_left = time >= Time::from_s(3.0);
    let own = LaneNeighbours { lead: Some(if has_left { next } else { near }), ..LaneNeighbours::default() };
    let neighbours = Neighbours { own, beyond: (!has_left).then_some(next), ..Neighbours::default() };
    let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
    with_input(time, &neighbours, |input| perception.observe(input, &mut rng))
}

/// Returns the time after which a driver with a reaction time of 0.9 s perceives the next vehicle
/// as the vehicle ahead (s), and the perceived speed (m/s).
fn next_vehicle_perceived_after_s(class: VehicleClass) -> (f64, f64) {
    let mut perception = Perception::new(0.9, None);
    let mut time = Time::ZERO;
    loop {
        let ahead = seen_behind_a_leader_that_leaves(&mut perception, time, class).ahead.unwrap();
        if ahead.actor == 2 {
            return ((time - Time::from_s(3.0)).s(), ahead.lead.speed_mps);
        }
        time += PHYSICS_STEP;
    }
}

#[test]
fn a_driver_whose_leader_pulls_out_brakes_for_the_next_vehicle_without_a_new_reaction_time() {
    assert_eq!(next_vehicle_perceived_after_s(VehicleClass::Car), (0.0, 13.0));
    // A vehicle that a truck has hidden is new, and costs the full reaction time.
    assert!((next_vehicle_perceived_after_s(VehicleClass::Truck).0 - 0.9).abs() < 1e-9);
}

#[test]
fn a_driver_sees_position_and_speed_of_the_second_leader_through_a_car_but_not_through_a_truck() {
    let at = Time::from_s(2.0);
    let seen = |class| {
        let mut perception = Perception::new(0.9, None);
        let mut scene = seen_behind_a_leader_that_leaves(&mut perception, Time::ZERO, class);
        let mut time = Time::ZERO;
        while time < at {
            time += PHYSICS_STEP;
            scene = seen_behind_a_leader_that_leaves(&mut perception, time, class);
        }
        scene.beyond
    };
    let beyond = seen(VehicleClass::Car).unwrap();
    assert!((beyond.lead.gap_m - (110.0 - 17.0 * 2.0)).abs() < 1e-9 && beyond.lead.speed_mps == 13.0, "{beyond:?}");
    assert_eq!(seen(VehicleClass::Truck), None);
}

/// Returns the time after which a driver with a reaction time of 1.25 s perceives a brake light
/// that goes on at 3 s (s), 30 m behind a vehicle that is slower by `closing_mps` at that moment.
fn light_perceived_after_s(closing_mps: f64) -> f64 {
    let mut perception = Perception::new(1.25, None);
    let mut time = Time::ZERO;
    loop {
        let on = time >= Time::from_s(3.0);
        let gap_m = 30.0 - closing_mps * (time.s() - 3.0);
        if observe(&mut perception, time, steady(gap_m, 30.0 - closing_mps), on).brake_light {
            return (time - Time::from_s(3.0)).s();
        }
        time += PHYSICS_STEP;
    }
}

#[test]
fn a_driver_reacts_faster_where_the_time_to_collision_is_short() {
    assert!((light_perceived_after_s(0.0) - 1.25).abs() < 1e-9);
    // At 10 m/s the time to collision is 3 s.
    assert!((light_perceived_after_s(10.0) - 1.0).abs() < 0.011, "{}", light_perceived_after_s(10.0));
}
