use closecall_traffic::{ActorId, Check, Indicator, Parameters, Road, Vehicle, VehicleClass, VehicleState, stream};

use super::*;
use crate::driver::{LapseConfig, Neighbours};

const STEP: Time = Time::from_ms(10);

/// Observes a lead vehicle with the given gap, speed, acceleration and brake light from a vehicle at 30 m/s, and
/// returns it as perceived.
fn observe(
    perception: &mut Perception,
    time: Time,
    (gap_m, speed_mps, acceleration_mps2, brake_light): (f64, f64, f64, bool),
) -> PerceivedVehicle {
    let road = Road::straight(3);
    let own = VehicleState { s_m: 30.0 * time.s(), d_m: -5.625, speed_mps: 30.0, ..VehicleState::default() };
    let lead = Neighbour {
        actor: 1,
        gap_m,
        speed_mps,
        acceleration_mps2,
        brake_light,
        indicator: Indicator::Off,
        class: VehicleClass::Car,
        length_m: 4.6,
        width_m: 1.85,
        lateral_offset_m: 0.0,
    };
    let neighbours =
        Neighbours { own: LaneNeighbours { lead: Some(lead), ..LaneNeighbours::default() }, ..Neighbours::default() };
    let vehicle = Vehicle::typical(VehicleClass::Car);
    let input = DriverInput {
        time,
        vehicle: &vehicle,
        own: &own,
        neighbours: &neighbours,
        road: &road,
        changing_to: None,
        lateral_deviation_m: 0.0,
        desired_speed_offset_mps: 0.0,
    };
    let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
    perception.observe(&input, &mut rng).ahead.unwrap()
}

#[test]
fn a_steady_approach_is_extrapolated_exactly() {
    let mut perception = Perception::new(0.9, None);
    let mut time = Time::ZERO;
    for _ in 0..500 {
        let gap_m = 50.0 - 5.0 * time.s();
        let seen = observe(&mut perception, time, (gap_m, 25.0, 0.0, false));
        assert!((seen.lead.gap_m - gap_m).abs() < 1e-9 && seen.lead.speed_mps == 25.0, "{seen:?} at {time}");
        time += STEP;
    }
}

#[test]
fn a_brake_light_is_perceived_after_the_reaction_time_and_implies_an_ordinary_braking() {
    let mut perception = Perception::new(0.9, None);
    let mut time = Time::ZERO;
    let mut first = None;
    while first.is_none() {
        let on = time >= Time::from_s(2.0);
        let seen = observe(&mut perception, time, (30.0, 30.0, 0.0, on));
        if seen.brake_light {
            assert_eq!(seen.lead.acceleration_mps2, -ASSUMED_BRAKING_MPS2);
            first = Some(time);
        }
        time += STEP;
    }
    assert_eq!(first, Some(Time::from_s(2.9)));
}

#[test]
fn a_small_speed_difference_at_a_large_gap_is_not_noticed() {
    // 1.85 m · 5 m/s / g² falls below 0.003 rad/s beyond 55.5 m, and below 0.0006 rad/s beyond 124 m.
    let mut perception = Perception::new(0.0, None);
    let mut time = Time::ZERO;
    for (gap_m, speed_mps, perceived_mps) in [
        (60.0, 25.0, 30.0),
        (50.0, 25.0, 25.0),
        (60.0, 26.0, 26.0),
        // Below the attended threshold, the perceived speed stays at 26 m/s until the observed one differs enough from
        // it.
        (130.0, 25.5, 26.0),
        (60.0, 27.0, 26.0),
        (60.0, 29.9, 26.0),
        (30.0, 29.0, 29.0),
    ] {
        let seen = observe(&mut perception, time, (gap_m, speed_mps, 0.0, false));
        assert_eq!(seen.lead.speed_mps, perceived_mps, "{gap_m} m, {speed_mps} m/s");
        time += STEP;
    }
}

#[test]
fn a_vehicle_that_stops_is_not_extrapolated_backwards() {
    // From 6 m/s at 6 m/s² it stands after one second and 3 m: 3 m less than at constant speed. Later it stays there.
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
        let seen = observe(&mut perception, time, (f64::from(step), 30.0, 0.0, false));
        let due = step.saturating_sub(300);
        assert!((seen.lead.gap_m - f64::from(due)).abs() < 1e-6, "{step}: {seen:?}");
        time += STEP;
    }
    assert_eq!(perception.memory.len(), MEMORY_CAPACITY);
    assert_eq!(perception.memory.capacity(), MEMORY_CAPACITY);
}

#[test]
fn a_brake_light_during_a_lapse_is_perceived_one_reaction_time_after_the_lapse() {
    let lapse = LapseConfig { at_s: Some(1.5.into()), every_s: None, duration_s: 2.0.into() };
    let lapse = lapse.check(&Parameters::default()).unwrap();
    let mut perception = Perception::new(0.9, None).with_lapses(Some(lapse));
    let mut time = Time::ZERO;
    let seen = |perception: &mut Perception, time: Time| {
        observe(perception, time, (30.0, 30.0, 0.0, time >= Time::from_s(2.0))).brake_light
    };
    while !seen(&mut perception, time) {
        time += STEP;
    }
    assert_eq!(time, Time::from_s(1.5 + 2.0 + 0.9));
}
