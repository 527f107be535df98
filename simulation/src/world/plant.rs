//! The plant: how one vehicle answers what its driver asks for.
//!
//! ```text
//!  asked acceleration ─▶ friction limit ─▶ first-order lag ─▶ jerk limit ─▶ speed ─▶ distance travelled
//!  asked lane change  ─▶ quintic path over that distance ─┬─▶ kinematic bicycle: course, slip, yaw rate
//!  weave of its driver ─▶ deviation over that distance  ──┘
//! ```
//!
//! Lag and jerk limits are of the order of published brake-system responses: a passenger car builds up full braking
//! in 0.2 to 0.4 s, an air-braked truck in 0.4 to 0.6 s (UN R13 asks for at most 0.6 s to 75 % of the pressure).
//! The kinematic bicycle (Rajamani, *Vehicle Dynamics and Control*, 2012, ch. 2) is inverted: the path is followed
//! exactly, and course, slip angle and yaw rate are those that the bicycle needs for it. What the tyres cannot give
//! is refused when the path is planned: a lane change that would need more lateral acceleration is made longer, and the
//! scenario's check refuses a weave that would.

use closecall_controllers::{Deviation, LaneChange, Weave};
use closecall_traffic::{GRAVITY_MPS2, Indicator, Lane, Road, Vehicle, VehicleClass, VehicleState};

use super::path::{LanePath, LateralState};

/// Share of the friction that a driver can use sideways in an evasion without losing the vehicle.
const LATERAL_SHARE: f64 = 0.5;
/// Share of a vehicle's length between its axles.
const WHEELBASE_SHARE: f64 = 0.6;
/// A lane change needs some way even at walking pace: twice the steering circle of a car [m].
const SHORTEST_LANE_CHANGE_M: f64 = 10.0;
/// Quasi-static dive of the body [rad per m/s²]: about 1.5° at 1 g.
const DIVE_RAD_PER_MPS2: f64 = 0.0027;

/// The lateral acceleration up to which drivers steer on a road of this friction [m/s²].
pub(crate) fn lateral_grip_mps2(friction: f64) -> f64 {
    LATERAL_SHARE * friction * GRAVITY_MPS2
}

/// What a class of vehicles can do.
#[derive(Clone, Copy, Debug)]
struct Capability {
    /// Time constant of the actuators [s].
    lag_s: f64,
    /// Fastest change of acceleration [m/s³].
    jerk_limit_mps3: f64,
    /// Largest acceleration [m/s²].
    largest_acceleration_mps2: f64,
    /// Share of the friction that the brakes can use.
    brake_share: f64,
}

impl Capability {
    const fn of(class: VehicleClass) -> Self {
        match class {
            VehicleClass::Car => {
                Self { lag_s: 0.15, jerk_limit_mps3: 40.0, largest_acceleration_mps2: 4.0, brake_share: 1.0 }
            }
            VehicleClass::Truck => {
                Self { lag_s: 0.3, jerk_limit_mps3: 15.0, largest_acceleration_mps2: 1.0, brake_share: 0.75 }
            }
            VehicleClass::Motorcycle => {
                Self { lag_s: 0.15, jerk_limit_mps3: 30.0, largest_acceleration_mps2: 5.0, brake_share: 0.9 }
            }
        }
    }
}

/// One vehicle under the control of its driver.
#[derive(Clone, Debug)]
pub(crate) struct Plant {
    capability: Capability,
    brake_light_from_mps2: f64,
    wheelbase_m: f64,
    friction: f64,
    lag_share: f64,
    step_s: f64,
    state: VehicleState,
    path: Option<(LanePath, Lane)>,
    travelled_m: f64,
    /// Where the driver means to be.
    meant: LateralState,
    weave: Option<Weave>,
    /// The whole way so far, over which the weave is written.
    way_m: f64,
    deviation: Deviation,
}

impl Plant {
    /// A vehicle at rest on its lane's centre line or moving along it, about which its driver may weave from now on;
    /// `friction` is the road's, `step_s` the step.
    pub(crate) fn new(
        vehicle: &Vehicle,
        state: VehicleState,
        weave: Option<Weave>,
        friction: f64,
        step_s: f64,
    ) -> Self {
        let capability = Capability::of(vehicle.class);
        Self {
            capability,
            brake_light_from_mps2: vehicle.brake_light_from_mps2,
            wheelbase_m: WHEELBASE_SHARE * vehicle.dimensions.length_m,
            friction,
            lag_share: 1.0 - (-step_s / capability.lag_s).exp(),
            step_s,
            state,
            path: None,
            travelled_m: 0.0,
            meant: LateralState { d_m: state.d_m, ..LateralState::default() },
            weave,
            way_m: 0.0,
            deviation: Deviation::default(),
        }
    }

    /// The state now.
    pub(crate) fn state(&self) -> &VehicleState {
        &self.state
    }

    /// The target of the lane change under way.
    pub(crate) fn changing_to(&self) -> Option<Lane> {
        self.path.map(|(_, target)| target)
    }

    /// How far the vehicle is beside the path that its driver means to take, positive to the left [m].
    pub(crate) fn lateral_deviation_m(&self) -> f64 {
        self.deviation.offset_m
    }

    /// Pitch of the body, positive nose down [rad].
    pub(crate) fn pitch_rad(&self) -> f64 {
        -self.state.acceleration_mps2 * DIVE_RAD_PER_MPS2
    }

    /// Begins a lane change, or directs the one under way elsewhere.
    pub(crate) fn change_lane(&mut self, change: LaneChange, road: &Road) {
        let target_m = road.lane_centre_m(change.target);
        let wanted_m = change.duration_s * self.state.speed_mps;
        let mut path = LanePath::new(self.meant, target_m, wanted_m.max(SHORTEST_LANE_CHANGE_M));
        let bend_limit_per_m =
            lateral_grip_mps2(self.friction) / (self.state.speed_mps * self.state.speed_mps).max(1.0);
        // The curvature falls with the square of the length, so that a few stretches by a tenth suffice.
        while path.largest_bend_per_m() > bend_limit_per_m && path.length_m() < 10.0 * wanted_m.max(100.0) {
            path = LanePath::new(self.meant, target_m, 1.1 * path.length_m());
        }
        self.path = Some((path, change.target));
        self.travelled_m = 0.0;
    }

    /// Drives one step with the asked acceleration [m/s²], which must be finite.
    pub(crate) fn step(&mut self, asked_mps2: f64, indicator: Indicator, road: &Road) {
        let before = self.state;
        let grip_mps2 = self.friction * GRAVITY_MPS2;
        let lateral_mps2 = before.speed_mps * before.yaw_rate_radps;
        let left_mps2 = (grip_mps2 * grip_mps2 - lateral_mps2 * lateral_mps2).max(0.0).sqrt();
        let strongest_braking = left_mps2.min(self.capability.brake_share * grip_mps2);
        let wanted = asked_mps2.clamp(-strongest_braking, self.capability.largest_acceleration_mps2.min(left_mps2));

        let most = self.capability.jerk_limit_mps3 * self.step_s;
        let acceleration =
            before.acceleration_mps2 + (self.lag_share * (wanted - before.acceleration_mps2)).clamp(-most, most);
        let (speed, distance) = advance(before.speed_mps, acceleration, self.step_s);
        self.state.speed_mps = speed;
        self.state.acceleration_mps2 = if speed > 0.0 { acceleration } else { 0.0 };
        self.state.brake_light = asked_mps2 <= -self.brake_light_from_mps2 || (speed == 0.0 && asked_mps2 <= 0.0);
        self.state.indicator = indicator;
        self.steer(distance, road);
    }

    fn steer(&mut self, distance_m: f64, road: &Road) {
        // Way along the lane's direction: what the path is written over.
        let along_m = distance_m * self.lateral().slope.atan().cos();
        self.travelled_m += along_m;
        self.way_m += along_m;
        if let Some(weave) = &mut self.weave {
            self.deviation = weave.at(self.way_m);
        }
        if let Some((path, _)) = self.path {
            self.meant = path.at(self.travelled_m);
            if self.travelled_m >= path.length_m() {
                self.path = None;
            }
        }
        let LateralState { d_m, slope, bend_per_m } = self.lateral();
        let course_rad = slope.atan();
        let curvature_per_m = bend_per_m / (1.0 + slope * slope).powf(1.5);
        // Slip at the box's centre, half a wheelbase ahead of the rear axle.
        let slip_rad = (0.5 * self.wheelbase_m * curvature_per_m).clamp(-0.5, 0.5).asin();
        self.state.d_m = d_m;
        self.state.heading_rad = course_rad - slip_rad;
        self.state.yaw_rate_radps = self.state.speed_mps * (curvature_per_m + road.curvature_per_m());
        // Off the reference line of a bend, the same way along the lane is another way along the road.
        self.state.s_m += along_m / (1.0 - road.curvature_per_m() * d_m);
    }

    /// Where the vehicle is: beside the path by the deviation.
    fn lateral(&self) -> LateralState {
        LateralState {
            d_m: self.meant.d_m + self.deviation.offset_m,
            slope: self.meant.slope + self.deviation.slope,
            bend_per_m: self.meant.bend_per_m + self.deviation.bend_per_m,
        }
    }
}

/// Speed and distance after one step of constant acceleration, stopping for good where the speed reaches zero.
fn advance(speed_mps: f64, acceleration_mps2: f64, step_s: f64) -> (f64, f64) {
    let after = speed_mps + acceleration_mps2 * step_s;
    if after > 0.0 {
        (after, 0.5 * (speed_mps + after) * step_s)
    } else if speed_mps > 0.0 {
        (0.0, speed_mps * speed_mps / (-2.0 * acceleration_mps2))
    } else {
        (0.0, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use closecall_controllers::LaneKeepingConfig;
    use closecall_traffic::{ActorId, Check, PHYSICS_STEP, Parameters, Side, stream};

    use super::*;

    const STEP_S: f64 = PHYSICS_STEP.s();

    fn weaving(weave: Option<Weave>) -> Plant {
        let state = VehicleState { speed_mps: 30.0, d_m: -5.625, ..VehicleState::default() };
        Plant::new(&Vehicle::typical(VehicleClass::Car), state, weave, 0.9, STEP_S)
    }

    fn weave() -> Option<Weave> {
        let keeping = LaneKeepingConfig { sdlp_m: 0.3.into() }.check(&Parameters::default()).unwrap();
        keeping.weave(Side::Left, stream(1, 0, &ActorId::new("rear").unwrap(), "lane-keeping"))
    }

    fn car(speed_mps: f64) -> Plant {
        let state = VehicleState { speed_mps, d_m: -5.625, ..VehicleState::default() };
        Plant::new(&Vehicle::typical(VehicleClass::Car), state, None, 0.9, STEP_S)
    }

    #[test]
    fn braking_is_bounded_by_friction_and_ends_at_standstill() {
        let road = Road::straight(3);
        let mut car = car(30.0);
        let mut hardest: f64 = 0.0;
        for _ in 0..600 {
            car.step(-50.0, Indicator::Off, &road);
            hardest = hardest.min(car.state().acceleration_mps2);
        }
        assert!((-0.9 * GRAVITY_MPS2 - 1e-9..-0.89 * GRAVITY_MPS2).contains(&hardest), "{hardest}");
        assert_eq!(car.state().speed_mps, 0.0);
        // v²/2µg plus what the lag costs: about 30 m/s for 0.2 s.
        let ideal_m = 30.0 * 30.0 / (2.0 * 0.9 * GRAVITY_MPS2);
        assert!(car.state().s_m > ideal_m && car.state().s_m < ideal_m + 30.0 * 0.35, "{}", car.state().s_m);
    }

    #[test]
    fn a_lane_change_takes_the_asked_time_and_ends_on_the_centre() {
        let road = Road::straight(3);
        let mut car = car(30.0);
        car.change_lane(LaneChange { target: Lane(1), duration_s: 5.0 }, &road);
        let mut crossing_s = 0.0;
        for step in 0..500 {
            assert!(car.changing_to().is_some(), "ended after {step} steps");
            car.step(0.0, Indicator::Left, &road);
            if car.state().d_m < -3.75 {
                crossing_s = f64::from(step + 1) * STEP_S;
            }
        }
        car.step(0.0, Indicator::Off, &road);
        assert!(car.changing_to().is_none());
        assert!((crossing_s - 2.5).abs() < 0.05, "{crossing_s}");
        assert!((car.state().d_m + 1.875).abs() < 1e-9);
        assert!(car.state().heading_rad.abs() < 1e-9);
    }

    #[test]
    fn a_lane_change_that_the_tyres_cannot_give_takes_longer() {
        let road = Road::straight(3);
        let mut car = car(33.0);
        car.change_lane(LaneChange { target: Lane(1), duration_s: 0.5 }, &road);
        let mut lateral: f64 = 0.0;
        for _ in 0..400 {
            car.step(0.0, Indicator::Left, &road);
            lateral = lateral.max((car.state().speed_mps * car.state().yaw_rate_radps).abs());
        }
        assert!(lateral <= LATERAL_SHARE * 0.9 * GRAVITY_MPS2 * 1.01, "{lateral}");
        assert!((car.state().d_m + 1.875).abs() < 1e-9);
    }

    #[test]
    fn heading_and_lateral_speed_agree() {
        let road = Road::straight(3);
        for mut car in [weaving(None), weaving(weave())] {
            car.change_lane(LaneChange { target: Lane(1), duration_s: 5.0 }, &road);
            let mut previous = car.state().d_m;
            for _ in 0..400 {
                car.step(0.0, Indicator::Left, &road);
                let lateral_mps = (car.state().d_m - previous) / STEP_S;
                let course_rad = (lateral_mps / 30.0).asin();
                assert!((course_rad - car.state().heading_rad).abs() < 0.01);
                previous = car.state().d_m;
            }
        }
    }

    #[test]
    fn one_who_weaves_starts_on_its_path_and_changes_lanes_as_far_beside_it() {
        let road = Road::straight(3);
        let (mut straight, mut weaving) = (weaving(None), weaving(weave()));
        assert_eq!(straight.state(), weaving.state());
        let mut widest_m: f64 = 0.0;
        for step in 0..3_000 {
            if step == 1_000 {
                let change = LaneChange { target: Lane(1), duration_s: 5.0 };
                straight.change_lane(change, &road);
                weaving.change_lane(change, &road);
            }
            straight.step(0.0, Indicator::Off, &road);
            weaving.step(0.0, Indicator::Off, &road);
            // Slopes tilt the way along the lane by some millimetres, over which the lane change lies then.
            let beside_m = weaving.state().d_m - straight.state().d_m;
            assert!((beside_m - weaving.lateral_deviation_m()).abs() < 0.005, "step {step}: {beside_m}");
            widest_m = widest_m.max(beside_m.abs());
        }
        assert!((0.3..1.2).contains(&widest_m), "{widest_m}");
        // One who stands stays where it is.
        while weaving.state().speed_mps > 0.0 {
            weaving.step(-5.0, Indicator::Off, &road);
        }
        let stands_at_m = weaving.state().d_m;
        for _ in 0..100 {
            weaving.step(-5.0, Indicator::Off, &road);
        }
        assert_eq!(weaving.state().d_m.to_bits(), stands_at_m.to_bits());
    }
}
