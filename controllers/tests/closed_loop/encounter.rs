//! The headline encounter, sampled: F, E, R and what may stand in the passing lane.

use closecall_controllers::{
    AccConfig, AebConfig, CheckedDriver, DriverConfig, DriverNote, EgoSettings, EgoStackConfig, EgoState, FollowConfig,
    HumanDriver, MisConfig, OvertakerConfig, PrescribedConfig, ReactionConfig, Wiedemann99Config,
};
use closecall_traffic::{ActorId, Check, Lane, Num, Parameters, RoadConfig, Side, Time, Vehicle, VehicleClass, stream};
use rand::RngExt;

use crate::world::{Actor, Who, World, gap_m};

/// Which driver comes from behind, and what the passing lane holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rear {
    /// Overtakes; the passing lane is empty.
    Overtakes,
    /// Overtakes when it can; the passing lane is blocked by vehicles no faster than E.
    IsBlocked,
    /// Comes close and stays.
    Follows,
}

/// What is varied on purpose; the rest is sampled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    pub(crate) seed: u64,
    pub(crate) rear: Rear,
    pub(crate) front_brakes: bool,
    /// Approach at 1 to 4 m/s instead of 10 to 50 km/h.
    pub(crate) slow_approach: bool,
    /// The side on which one overtakes.
    pub(crate) side: Side,
    pub(crate) max_deceleration_mps2: f64,
    pub(crate) critical_gap_m: f64,
}

impl Case {
    pub(crate) const HEADLINE: Self = Self {
        seed: 1,
        rear: Rear::Overtakes,
        front_brakes: true,
        slow_approach: false,
        side: Side::Left,
        max_deceleration_mps2: 1.0,
        critical_gap_m: 5.0,
    };
}

/// The drawn values of one sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) cruise_mps: f64,
    pub(crate) closing_mps: f64,
    pub(crate) front_thw_s: f64,
    pub(crate) cut_out_thw_s: f64,
    pub(crate) cc1_s: f64,
    pub(crate) duration_s: f64,
    pub(crate) reaction_s: f64,
    pub(crate) brake_at_s: f64,
    pub(crate) brake_mps2: f64,
    pub(crate) class: VehicleClass,
}

/// What came of one run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) collision: Option<(usize, usize)>,
    pub(crate) time_s: f64,
    pub(crate) cut_out: bool,
    pub(crate) aborted: bool,
    pub(crate) passed: bool,
    /// R's time headway to E when its centre crosses the marking.
    pub(crate) crossing_thw_s: Option<f64>,
    pub(crate) engaged: bool,
    /// Whether the goal was in reach when the system engaged.
    pub(crate) in_reach: bool,
    /// Front headway at engaging, and when R reached the critical distance or left the lane.
    pub(crate) thw_engaged_s: Option<f64>,
    pub(crate) thw_critical_s: Option<f64>,
    pub(crate) least_rear_gap_m: f64,
    pub(crate) hardest_rear_braking_mps2: f64,
}

const START_GAP_M: f64 = 120.0;

pub(crate) fn sample(case: &Case, index: u64) -> Sample {
    let mut rng = stream(case.seed, index, &ActorId::new("study").unwrap(), "parameters");
    let mut uniform = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let cruise_mps = uniform(30.0, 33.2);
    let closing_mps = if case.slow_approach { uniform(1.0, 4.0) } else { uniform(2.8, 13.9) };
    let quantiles = [0.15, 0.19, 0.24, 0.31, 0.40];
    let place = uniform(0.0, 4.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 3")]
    let low = (place as usize).min(3);
    let cut_out_thw_s = quantiles[low] + (place - low as f64) * (quantiles[low + 1] - quantiles[low]);
    // Irwin and Hall: the sum of twelve uniform numbers is nearly normal.
    let normal: f64 = (0..12).map(|_| uniform(0.0, 1.0)).sum::<f64>() - 6.0;
    let (reaction_s, cc1_s) = ((0.9 * (0.3 * normal).exp()).min(3.0), uniform(0.0, 0.05));
    let phase = uniform(0.0, 1.0);
    let arrival_s = (START_GAP_M - 100.0) / closing_mps;
    let encounter_s = START_GAP_M / closing_mps;
    let kind = uniform(0.0, 1.0);
    let normal: f64 = (0..12).map(|_| uniform(0.0, 1.0)).sum::<f64>() - 6.0;
    Sample {
        cruise_mps,
        closing_mps,
        front_thw_s: uniform(0.5, 0.9),
        cut_out_thw_s,
        cc1_s,
        duration_s: (6.8 + 1.2 * normal).clamp(4.0, 10.0),
        reaction_s,
        brake_at_s: arrival_s + phase * (encounter_s + 6.0 - arrival_s),
        brake_mps2: uniform(4.0, 8.0),
        class: if kind < 0.8 {
            VehicleClass::Car
        } else if kind < 0.9 {
            VehicleClass::Truck
        } else {
            VehicleClass::Motorcycle
        },
    }
}

fn ego(case: &Case, drawn: &Sample, with_mis: bool) -> EgoSettings {
    let config = DriverConfig::EgoStack(EgoStackConfig {
        acc: AccConfig { time_gap_s: drawn.front_thw_s.into(), set_speed_mps: None, standstill_gap_m: None },
        aeb: Some(AebConfig::default()),
        mis: with_mis.then(|| MisConfig {
            max_deceleration_mps2: Some(case.max_deceleration_mps2.into()),
            critical_gap_m: Some(case.critical_gap_m.into()),
            ..MisConfig::default()
        }),
        automated: true,
    });
    match config.check(&Parameters::default()).unwrap() {
        CheckedDriver::Ego(settings) => settings,
        CheckedDriver::Human(_) => unreachable!("an ego stack was asked for"),
    }
}

pub(crate) fn human(config: &DriverConfig) -> HumanDriver {
    match config.check(&Parameters::default()).unwrap() {
        CheckedDriver::Human(driver) => driver,
        CheckedDriver::Ego(_) => unreachable!("a human was asked for"),
    }
}

fn rear_driver(case: &Case, drawn: &Sample) -> HumanDriver {
    let reaction = ReactionConfig::Value(drawn.reaction_s.into());
    let follow = Wiedemann99Config { cc1_s: Some(drawn.cc1_s.into()), ..Wiedemann99Config::default() };
    human(&if case.rear == Rear::Follows {
        let cc1_s = Some(Num::Fixed(drawn.cut_out_thw_s));
        DriverConfig::Wiedemann99(Wiedemann99Config { reaction_s: Some(reaction), cc1_s, ..follow })
    } else {
        DriverConfig::Overtaker(OvertakerConfig {
            cut_out_thw_s: drawn.cut_out_thw_s.into(),
            follow: FollowConfig::Wiedemann99(follow),
            reaction_s: reaction,
            lane_change_duration_s: Some(drawn.duration_s.into()),
            evasive_lateral_mps2: None,
            lapse: None,
            returns: None,
        })
    })
}

/// The world of one sample: E, F, R, and what stands in the passing lane.
pub(crate) fn world(case: &Case, drawn: &Sample, index: u64, with_mis: bool) -> World {
    let road = RoadConfig {
        lanes: 3,
        lane_width_m: 3.75.into(),
        curvature_per_m: 0.0.into(),
        speed_limit_mps: 36.1.into(),
        overtaking_side: case.side,
        guard_rails: false,
    }
    .check(&Parameters::default())
    .unwrap();
    let own_d = road.lane_centre_m(Lane(2));
    let car = Vehicle::typical(VehicleClass::Car);
    let rear = Vehicle::typical(drawn.class);
    let rng = |name: &str| Box::new(stream(case.seed, index, &ActorId::new(name).unwrap(), "driver"));
    let keeps = |speed: f64| human(&DriverConfig::Prescribed(PrescribedConfig::speeds(&[[0.0, speed]]))).build();
    let cruise = drawn.cruise_mps;
    let car_m = car.dimensions.length_m;
    let front_s = 500.0 + car_m + drawn.front_thw_s * cruise;
    let rear_s = 500.0 - START_GAP_M - 0.5 * (car_m + rear.dimensions.length_m);
    let mut front = Actor::new(Who::Human(keeps(cruise), rng("front")), car, front_s, own_d, cruise);
    front.brakes = case.front_brakes.then_some((drawn.brake_at_s, drawn.brake_mps2));
    let mut actors = vec![
        Actor::new(Who::Ego(ego(case, drawn, with_mis).build()), car, 500.0, own_d, cruise),
        front,
        Actor::new(
            Who::Human(rear_driver(case, drawn).build(), rng("rear")),
            rear,
            rear_s,
            own_d,
            cruise + drawn.closing_mps,
        ),
    ];
    if case.rear == Rear::IsBlocked {
        let left_d = road.lane_centre_m(road.beside(Lane(2), case.side).unwrap());
        for offset_m in [-60.0, -20.0, 20.0, 60.0] {
            actors.push(Actor::new(Who::Human(keeps(cruise), rng("left")), car, 500.0 + offset_m, left_d, cruise));
        }
    }
    World::new(actors, road)
}

/// Runs one sample to its end.
pub(crate) fn run(case: &Case, index: u64, with_mis: bool) -> Outcome {
    let drawn = sample(case, index);
    let mut world = world(case, &drawn, index, with_mis);
    let mut outcome = Outcome { least_rear_gap_m: f64::INFINITY, ..Outcome::default() };
    let mut before = EgoState::Following;
    while world.time < Time::from_s(60.0) {
        world.step();
        let (ego, front, rear) = (&world.actors[0], &world.actors[1], &world.actors[2]);
        let rear_gap_m = gap_m(ego, rear);
        let thw_s = gap_m(front, ego) / ego.state.speed_mps;
        let crossed = world.road.lane_at(rear.state.d_m) != Lane(2);
        if crossed && outcome.crossing_thw_s.is_none() {
            outcome.crossing_thw_s = Some(rear_gap_m / rear.state.speed_mps);
        }
        if !crossed {
            outcome.least_rear_gap_m = outcome.least_rear_gap_m.min(rear_gap_m);
        }
        outcome.hardest_rear_braking_mps2 = outcome.hardest_rear_braking_mps2.max(-rear.state.acceleration_mps2);
        let state = world.ego_command.map_or(EgoState::Following, |command| command.state);
        if state == EgoState::Increasing && outcome.thw_engaged_s.is_none() {
            outcome.thw_engaged_s = Some(thw_s);
            outcome.engaged = true;
            outcome.in_reach =
                world.ego_command.and_then(|command| command.plan).is_some_and(|plan| plan.goal_in_reach);
        }
        if state == EgoState::Holding && before != EgoState::Holding && outcome.thw_critical_s.is_none() {
            outcome.thw_critical_s = Some(thw_s);
        }
        before = state;
        outcome.collision = world.collision();
        let stands = ego.state.speed_mps < 0.01 && (rear.state.speed_mps < 0.01 || rear_gap_m < -50.0);
        if outcome.collision.is_some() || stands {
            break;
        }
    }
    let rear = &world.actors[2];
    outcome.time_s = world.time.s();
    outcome.cut_out = rear.noted(DriverNote::CutOutStarted).is_some();
    outcome.aborted = rear.noted(DriverNote::CutOutAborted).is_some();
    outcome.passed = rear.noted(DriverNote::Passed).is_some();
    outcome
}
