//! A human driver who enters the road on an acceleration lane and changes to the through lane.
//!
//! ```text
//!  ramp ── lane begins ──▶ looks for a gap ── gap accepted ──▶ changes lanes ──▶ follows in the through lane
//!                                │                  ▲
//!                                └─ end is near ─▶ brakes, stops before the end, waits
//! ```
//!
//! The car-following driver is the one of the scenario. Around it, this driver adds:
//!
//! - *Ramp.* Before the lane begins, the driver keeps its initial speed, which is the speed of the
//!   ramp. It accelerates in the acceleration lane.
//! - *Gap acceptance.* The change is mandatory: it gains nothing but the way. A gap is accepted if
//!   neither the driver nor the follower in the through lane must brake harder than a limit, and if
//!   a least gap is left to both ([`GapAcceptance`]). The limits grow towards the end of the lane,
//!   as in Vissim's necessary lane change ([`tolerance`]). Recorded drivers leave short gaps when
//!   they merge, less than 0.25 s ahead and behind, which grow afterwards; in free traffic most of
//!   them merge in the first half of the lane (Daamen, Loot and Hoogendoorn, *Empirical analysis of
//!   merging behavior at freeway on-ramp*, Transportation Research Record 2188 (2010) 108–118).
//! - *End of the lane.* Without a gap, the driver brakes as soon as a comfortable deceleration is
//!   needed to stop before the end. It then waits for a gap.
//! - *Change.* While the driver changes lanes, it follows the vehicle ahead in the through lane.
//!
//! The driver perceives the through lane as it perceives a passing lane: one reaction time late,
//! and without a speed difference too small to be noticed. The reaction time there is the typical
//! one, not the one drawn for the vehicle ahead. The driver does not adjust its speed to reach a
//! certain gap, and nobody in the through lane makes room for it: simplifications, which make
//! merging harder than it is.

use closecall_traffic::{AccelerationLane, Indicator, Side, Stream};

use super::overtaker::acceptance::{FOLLOWER_HEADWAY_S, GapAcceptance, Tolerance};
use super::perception::{PerceivedLane, Perception};
use super::{Driver, DriverAction, DriverError, DriverInput, DriverNote, Follow, LaneChange, Looks, check_finite};

/// Hardest braking that a driver accepts at the end of the lane, its own and the follower's (m/s²):
/// Vissim's defaults for a necessary lane change on a motorway (*An approach for handling
/// uncertainties related to behaviour and vehicle mixes in traffic simulation experiments with
/// automated vehicles*, Journal of Advanced Transportation 2020, 8850591, table 3). The values of
/// the other columns of that table are 3.5 to 4, and 2.5 to 4.
const MOST_BRAKING_MPS2: [f64; 2] = [4.0, 3.0];

/// Braking that a driver accepts far from the end, its own and the follower's (m/s²): from the same
/// table, whose other columns have 1, and 0.5 to 1.
const LEAST_BRAKING_MPS2: [f64; 2] = [1.0, 0.5];

/// Distance from the end over which the accepted braking falls by 1 m/s² (m): from the same table,
/// whose other columns have 160 to 200.
const DISTANCE_PER_MPS2_M: f64 = 200.0;

/// Share of its safe gap that a driver keeps to the vehicle ahead in the through lane when it
/// begins to change: an assumption; 0.1 to 1 are plausible. Vissim has such a factor for all lane
/// changes. The recorded gaps of less than 0.25 s (Daamen et al. 2010) are about a quarter of the
/// usual safe gap.
const SAFE_GAP_SHARE: f64 = 0.6;

/// Deceleration that, once it is needed to stop before the end of the lane, makes the driver brake
/// (m/s²): at least this is what 90 % of drivers choose when they must stop (Fambro, Fitzpatrick
/// and Koppa, NCHRP Report 400, 1997; the stopping sight distance of AASHTO rests on it). Range: 2
/// to 4.5.
pub const ENTRY_STOP_MPS2: f64 = 3.4;

/// Distance from the end of the lane at which the driver stops (m): an assumption, the gap at
/// standstill of the Intelligent Driver Model; 1 to 5 are plausible.
const STOP_BEFORE_END_M: f64 = 2.0;

/// Longest and shortest duration of the lane change (s). The longest is the usual duration of
/// single lane changes (Lee, Olsen and Wierwille, DOT HS 809 702, 2004), the shortest the duration
/// in Vissim.
const DURATION_S: [f64; 2] = [6.3, 3.0];

/// Gain with which the driver keeps the speed of the ramp (1/s): numerical, well below the
/// actuators' 1/0.15 s.
const RAMP_GAIN_PER_S: f64 = 1.0;

/// Least speed by which a distance is divided (m/s): numerical.
const MIN_SPEED_MPS: f64 = 0.1;

/// Returns the distance from the end of the acceleration lane that a driver at `speed_mps` needs in
/// order to stop before it (m).
pub fn entry_stop_distance_m(speed_mps: f64) -> f64 {
    speed_mps * speed_mps / (2.0 * ENTRY_STOP_MPS2) + STOP_BEFORE_END_M
}

/// Where the driver is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// On the ramp or in the acceleration lane.
    Entering,
    /// On its way to the through lane.
    Changing,
    /// In the through lanes.
    Merged,
}

/// A driver who merges, around the driver `D`, which follows the vehicle ahead.
pub(crate) struct MergingDriver<D> {
    driver: D,
    /// The car-following model of `driver`.
    follow: Follow,
    /// Reaction time to the vehicles in the through lane (s).
    reaction_s: f64,
    perception: Option<Perception>,
    phase: Phase,
    /// Initial speed (m/s), from the first step on.
    ramp_mps: Option<f64>,
    /// Whether the driver brakes for the end of the lane.
    stops: bool,
}

impl<D: Driver> MergingDriver<D> {
    /// Creates a driver for one run. `driver` follows by `follow`, and perceives after `reaction_s`
    /// (s).
    pub(crate) fn new(driver: D, follow: Follow, reaction_s: f64) -> Self {
        Self { driver, follow, reaction_s, perception: None, phase: Phase::Entering, ramp_mps: None, stops: false }
    }

    /// Drives on the ramp and in the acceleration lane.
    fn enter(
        &mut self,
        lane: &AccelerationLane,
        input: &DriverInput<'_>,
        rng: &mut Stream,
    ) -> Result<DriverAction, DriverError> {
        check_finite(input)?;
        let side = input.road.overtaking_side();
        let speed_mps = input.own.speed_mps;
        let ramp_mps = *self.ramp_mps.get_or_insert(speed_mps);
        let reaction_s = self.reaction_s;
        let perception = self.perception.get_or_insert_with(|| Perception::new(reaction_s, Some(side)));
        let scene = perception.observe(input, rng);
        let mut action = self.driver.step(input, rng)?;
        let rest_m = rest_m(lane, input);
        if input.own.s_m < lane.from_m {
            action.acceleration_mps2 = action.acceleration_mps2.min(RAMP_GAIN_PER_S * (ramp_mps - speed_mps));
        } else {
            action.indicator = Indicator::towards(side);
            let target = input.road.beside(input.road.lane_of(input.own), side);
            if let (Some(target), Some(through)) = (target, scene.adjacent(side))
                && self.accepts(through, speed_mps, rest_m)
            {
                self.phase = Phase::Changing;
                action.note = Some(DriverNote::CutOutStarted);
                action.lane_change =
                    Some(LaneChange { target, duration_s: entry_change_duration_s(speed_mps, rest_m) });
                return Ok(action);
            }
        }
        action.acceleration_mps2 = action.acceleration_mps2.min(self.most_before_end_mps2(speed_mps, rest_m));
        Ok(action)
    }

    /// Returns whether the driver accepts the gap in the through lane at this distance from the end
    /// of its own lane.
    fn accepts(&self, through: &PerceivedLane, speed_mps: f64, rest_m: f64) -> bool {
        let acceptance = GapAcceptance {
            speed_mps,
            overtaken_mps: speed_mps,
            safe_gap_m: SAFE_GAP_SHARE * self.follow.safe_gap_m(speed_mps),
            tolerance: tolerance(rest_m),
        };
        acceptance.is_free(through)
    }

    /// Returns the largest acceleration with which the driver stops before the end of the lane
    /// (m/s²): infinite until it must brake.
    fn most_before_end_mps2(&mut self, speed_mps: f64, rest_m: f64) -> f64 {
        let room_m = rest_m - STOP_BEFORE_END_M;
        let needed_mps2 = if room_m > 0.0 { speed_mps * speed_mps / (2.0 * room_m) } else { f64::INFINITY };
        self.stops |= needed_mps2 >= ENTRY_STOP_MPS2;
        if self.stops { -needed_mps2.min(self.follow.hardest_braking_mps2()) } else { f64::INFINITY }
    }

    /// Changes to the through lane, behind the vehicle ahead there.
    fn change(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError> {
        let side = input.road.overtaking_side();
        let mut neighbours = *input.neighbours;
        let through = match side {
            Side::Left => neighbours.left,
            Side::Right => neighbours.right,
        };
        // A vehicle ahead in the acceleration lane matters as long as it is in the path.
        if input.road.entry_lane() == Some(input.road.lane_of(input.own)) {
            neighbours.own.lead = through.and_then(|lane| lane.lead);
        }
        let action = self.driver.step(&DriverInput { neighbours: &neighbours, ..*input }, rng)?;
        Ok(DriverAction { indicator: Indicator::towards(side), ..action })
    }
}

impl<D: Driver> Driver for MergingDriver<D> {
    fn step(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError> {
        let is_changing = input.lane_change_target.is_some();
        self.phase = match self.phase {
            // An event of the scenario can begin the lane change, too.
            Phase::Entering if is_changing => Phase::Changing,
            Phase::Changing if !is_changing => Phase::Merged,
            phase => phase,
        };
        match (self.phase, input.road.acceleration_lane()) {
            (Phase::Entering, Some(lane)) => self.enter(lane, input, rng),
            (Phase::Changing, Some(_)) => self.change(input, rng),
            _ => self.driver.step(input, rng),
        }
    }

    fn looks(&self) -> Looks {
        Looks { adjacent: true, ..self.driver.looks() }
    }
}

/// Returns the distance from the front bumper to the end of the lane's full width (m).
fn rest_m(lane: &AccelerationLane, input: &DriverInput<'_>) -> f64 {
    let along_m = input.road.path_length_m([input.own.s_m, lane.to_m], input.own.d_m);
    along_m - 0.5 * input.vehicle.dimensions.length_m
}

/// Returns the braking that a driver accepts at this distance from the end of the lane (m), of
/// itself and of the follower.
fn tolerance(rest_m: f64) -> Tolerance {
    let less_mps2 = rest_m.max(0.0) / DISTANCE_PER_MPS2_M;
    let braking_mps2 = |which: usize| (MOST_BRAKING_MPS2[which] - less_mps2).max(LEAST_BRAKING_MPS2[which]);
    Tolerance { own_mps2: braking_mps2(0), follower_mps2: braking_mps2(1), follower_headway_s: FOLLOWER_HEADWAY_S }
}

/// Returns the duration of a lane change from an acceleration lane (s). In its middle, the centre of
/// the vehicle crosses the marking, before the end of the lane if the driver can steer that fast.
pub fn entry_change_duration_s(speed_mps: f64, rest_m: f64) -> f64 {
    let [longest_s, shortest_s] = DURATION_S;
    (2.0 * rest_m.max(0.0) / speed_mps.max(MIN_SPEED_MPS)).clamp(shortest_s, longest_s)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{
        ActorId, Check, Lane, PHYSICS_STEP, Parameters, Road, Time, Vehicle, VehicleClass, VehicleState, stream,
    };

    use super::*;
    use crate::driver::testing::car_ahead;
    use crate::driver::{IdmConfig, LaneNeighbours, Lead, Neighbour, Neighbours};
    use crate::{CheckedDriver, DriverConfig, HumanDriver};

    const LANE: AccelerationLane = AccelerationLane { from_m: 100.0, to_m: 350.0, taper_end_m: 410.0 };

    fn road(side: Side) -> Road {
        let road = Road::straight(3).with_acceleration_lane(LANE);
        if side == Side::Left { road } else { road.mirrored().unwrap() }
    }

    fn human() -> HumanDriver {
        match DriverConfig::Idm(IdmConfig::default()).check(&Parameters::default()).unwrap() {
            CheckedDriver::Human(human) => human,
            CheckedDriver::Ego(_) => unreachable!("an IDM driver is human"),
        }
    }

    /// The position of the centre (m) and the lane change with which a drive ended, if any, and the
    /// speed there (m/s).
    struct End {
        s_m: f64,
        speed_mps: f64,
        change: Option<LaneChange>,
    }

    /// Drives from 50 m before the lane at this speed, beside a through lane with these vehicles,
    /// until a lane change begins, or for a minute.
    fn drive(side: Side, speed_mps: f64, through: LaneNeighbours) -> End {
        let road = road(side);
        let vehicle = Vehicle::typical(VehicleClass::Car);
        let neighbours = match side {
            Side::Left => Neighbours { left: Some(through), ..Neighbours::default() },
            Side::Right => Neighbours { right: Some(through), ..Neighbours::default() },
        };
        let mut driver = human().build_merging();
        let mut rng = stream(0, 0, &ActorId::new("ramp").unwrap(), "driver");
        let d_m = road.lane_centre_m(road.entry_lane().unwrap(), 0.0);
        let mut own = VehicleState { s_m: 50.0, d_m, speed_mps, ..VehicleState::default() };
        for step in 0..6_000 {
            let input = DriverInput {
                time: Time::from_s(f64::from(step) * PHYSICS_STEP.s()),
                vehicle: &vehicle,
                own: &own,
                neighbours: &neighbours,
                road: &road,
                lane_change_target: None,
                lateral_deviation_m: 0.0,
                desired_speed_offset_mps: 0.0,
            };
            let action = driver.step(&input, &mut rng).unwrap();
            if action.lane_change.is_some() {
                return End { s_m: own.s_m, speed_mps: own.speed_mps, change: action.lane_change };
            }
            if own.s_m < LANE.from_m {
                assert!((own.speed_mps - speed_mps).abs() < 1e-9, "{} m/s on the ramp", own.speed_mps);
            }
            own.speed_mps = (own.speed_mps + action.acceleration_mps2 * PHYSICS_STEP.s()).max(0.0);
            own.s_m += own.speed_mps * PHYSICS_STEP.s();
        }
        End { s_m: own.s_m, speed_mps: own.speed_mps, change: None }
    }

    fn car(gap_m: f64, speed_mps: f64) -> Option<Neighbour> {
        Some(car_ahead(Lead { gap_m, speed_mps, acceleration_mps2: 0.0 }, false))
    }

    #[test]
    fn beside_an_empty_lane_the_driver_changes_where_the_lane_begins() {
        for (side, target) in [(Side::Left, Lane(2)), (Side::Right, Lane(2))] {
            let end = drive(side, 25.0, LaneNeighbours::default());
            let change = end.change.unwrap();
            assert_eq!(change.target, target);
            assert!((LANE.from_m..LANE.from_m + 0.5).contains(&end.s_m), "{} m", end.s_m);
            assert_eq!(change.duration_s, DURATION_S[0]);
        }
    }

    #[test]
    fn without_a_gap_the_driver_stops_before_the_end_of_the_lane() {
        for speed_mps in [15.0, 25.0, 33.0] {
            let end = drive(Side::Left, speed_mps, LaneNeighbours { alongside: car(-1.0, 25.0), ..Default::default() });
            assert!(end.change.is_none());
            let front_m = end.s_m + 0.5 * Vehicle::typical(VehicleClass::Car).dimensions.length_m;
            assert!(end.speed_mps < 0.1, "{} m/s", end.speed_mps);
            assert!((LANE.to_m - 5.0..LANE.to_m - 1.0).contains(&front_m), "the front stops at {front_m} m");
        }
    }

    #[test]
    fn the_driver_accepts_more_near_the_end_of_the_lane() {
        // At first the follower would have to brake by 2.4 m/s²: 10 m/s over 20.5 m.
        let end = drive(Side::Left, 25.0, LaneNeighbours { follower: car(34.0, 35.0), ..Default::default() });
        assert!(end.change.is_some() && (120.0..200.0).contains(&end.s_m), "{} m", end.s_m);
        let [far, near] = [250.0, 0.0].map(tolerance);
        assert_eq!((far.own_mps2, far.follower_mps2), (2.75, 1.75));
        assert_eq!((near.own_mps2, near.follower_mps2), (4.0, 3.0));
        assert_eq!((tolerance(900.0).own_mps2, tolerance(900.0).follower_mps2), (1.0, 0.5));
    }

    #[test]
    fn the_driver_does_not_change_closely_behind_a_vehicle_at_speed() {
        let end = drive(Side::Left, 25.0, LaneNeighbours { lead: car(5.0, 25.0), ..Default::default() });
        assert!(end.speed_mps < 5.0, "{} m/s", end.speed_mps);
    }

    #[test]
    fn while_changing_the_driver_brakes_behind_the_vehicle_ahead_in_the_through_lane() {
        let road = road(Side::Left);
        let vehicle = Vehicle::typical(VehicleClass::Car);
        let own = VehicleState { s_m: 150.0, d_m: -9.0, speed_mps: 25.0, ..VehicleState::default() };
        let mut rng = stream(0, 0, &ActorId::new("ramp").unwrap(), "driver");
        let mut acceleration_mps2 = |lead| {
            let left = LaneNeighbours { lead, ..Default::default() };
            let input = DriverInput {
                time: Time::ZERO,
                vehicle: &vehicle,
                own: &own,
                neighbours: &Neighbours { left: Some(left), ..Neighbours::default() },
                road: &road,
                lane_change_target: Some(Lane(2)),
                lateral_deviation_m: 0.0,
                desired_speed_offset_mps: 0.0,
            };
            human().build_merging().step(&input, &mut rng).unwrap().acceleration_mps2
        };
        let (alone_mps2, behind_mps2) = (acceleration_mps2(None), acceleration_mps2(car(15.0, 20.0)));
        assert!(alone_mps2 > 0.0 && behind_mps2 < -1.0, "{alone_mps2} {behind_mps2} m/s²");
    }

    #[test]
    fn the_lane_change_is_shorter_near_the_end_and_never_abrupt() {
        assert_eq!(entry_change_duration_s(25.0, 250.0), DURATION_S[0]);
        assert_eq!(entry_change_duration_s(25.0, 50.0), 4.0);
        assert_eq!(entry_change_duration_s(25.0, 1.0), DURATION_S[1]);
        assert_eq!(entry_change_duration_s(0.0, 2.0), DURATION_S[0]);
    }
}
