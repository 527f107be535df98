//! The plant: how one vehicle responds to the commands of its driver.
//!
//! ```text
//!  commanded acceleration ─▶ friction limit ─▶ first-order lag ─▶ jerk limit ─▶ speed ─▶ distance travelled
//!  commanded lane change  ─▶ quintic path over that distance ─┬─▶ kinematic bicycle: course, slip, yaw rate
//!  weaving of the driver  ─▶ deviation over that distance ────┘
//! ```
//!
//! A vehicle may have a lateral path from the start, such as the recorded one. It follows this path
//! over the distance, as it follows the path of a lane change, until the first lane change.
//!
//! Lags and jerk limits are assumptions of the order of published brake-system responses: a
//! passenger car or a motorcycle builds up full braking in 0.1 to 0.3 s, a lorry in 0.2 to 0.4 s,
//! and an articulated lorry in 0.4 to 1.0 s (accident analysts' tables: nilgens.com,
//! wien.gerichts-sv.at, unfallanalyse.hamburg). The kinematic bicycle (Rajamani, *Vehicle Dynamics
//! and Control*, 2012, ch. 2) is inverted: the vehicle follows the path exactly, and course, slip
//! angle and yaw rate are those that the bicycle needs for it. The lateral acceleration is limited
//! when the path is planned: a lane change that would need more than the tyres provide is made
//! longer, and the check of a scenario rejects weaving that would.

use closecall_controllers::{Deviation, LaneChange, Weave};
use closecall_scenarios::lateral_grip_mps2;
use closecall_traffic::{
    GRAVITY_MPS2, Indicator, LARGEST_JERK_MPS3, Lane, LateralPath, Road, Vehicle, VehicleClass, VehicleState, maths,
};

use super::path::{LanePath, LateralState};

/// Shortest distance of a lane change, even at walking pace (m): an assumption, the order of a
/// car's turning circle.
const SHORTEST_LANE_CHANGE_M: f64 = 10.0;
/// Speed at which a vehicle stands that is slowing down and not driven (m/s): numerical. A control
/// law that approaches its gap exponentially would never stand; wheel speed sensors do not resolve
/// such a speed.
const STANDING_MPS: f64 = 0.01;
/// Quasi-static brake dive of the body (rad per m/s²): an assumption, about 1.5° at 1 g.
const DIVE_RAD_PER_MPS2: f64 = 0.0027;

/// The strongest acceleration and braking of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Performance {
    /// Largest acceleration (m/s²).
    pub max_acceleration_mps2: f64,
    /// Strongest braking (m/s²), on a road with this friction.
    pub max_deceleration_mps2: f64,
}

impl Performance {
    /// Returns the performance of a vehicle of this class on a road with this friction.
    pub fn of(class: VehicleClass, friction: f64) -> Self {
        let capability = Capability::for_class(class);
        Self {
            max_acceleration_mps2: capability.max_acceleration_mps2,
            max_deceleration_mps2: capability.brake_share * friction * GRAVITY_MPS2,
        }
    }
}

/// Limits of the actuators of a vehicle class: assumptions.
#[derive(Clone, Copy, Debug)]
struct Capability {
    /// Time constant of the actuators (s).
    lag_s: f64,
    /// Largest jerk, as a magnitude (m/s³).
    jerk_limit_mps3: f64,
    /// Largest acceleration (m/s²).
    max_acceleration_mps2: f64,
    /// Fraction of the friction that the brakes can use.
    brake_share: f64,
}

impl Capability {
    const fn for_class(class: VehicleClass) -> Self {
        match class {
            VehicleClass::Car => {
                Self { lag_s: 0.15, jerk_limit_mps3: LARGEST_JERK_MPS3, max_acceleration_mps2: 4.0, brake_share: 1.0 }
            }
            VehicleClass::Truck => {
                Self { lag_s: 0.3, jerk_limit_mps3: 15.0, max_acceleration_mps2: 1.0, brake_share: 0.75 }
            }
            VehicleClass::Motorcycle => {
                Self { lag_s: 0.15, jerk_limit_mps3: 30.0, max_acceleration_mps2: 5.0, brake_share: 0.9 }
            }
        }
    }
}

/// A lane change in progress.
#[derive(Clone, Copy, Debug)]
struct LaneChangePath {
    path: LanePath,
    target: Lane,
    /// Distance travelled on the path (m).
    travelled_m: f64,
}

/// One vehicle under the control of its driver.
#[derive(Clone, Debug)]
pub(crate) struct Plant {
    capability: Capability,
    brake_light_from_mps2: f64,
    wheelbase_m: f64,
    friction: f64,
    /// Fraction of the difference to the commanded acceleration that the actuators cover in one
    /// step.
    lag_share: f64,
    step_s: f64,
    state: VehicleState,
    /// The lane change in progress.
    lane_change: Option<LaneChangePath>,
    /// The lateral path that the vehicle follows until its first lane change.
    path: Option<LateralPath>,
    /// The lateral state that the driver intends: on the lane's centre line, or on the path of the
    /// lane change. It is relative to the driving line of `guide` if there is one.
    intended: LateralState,
    /// The lane whose driving line the driver follows, on a road whose lanes change their widths. The
    /// lanes of another road, and a lateral path, need none.
    guide: Option<Lane>,
    weave: Option<Weave>,
    /// Distance travelled along the lane since the start (m): the argument of `weave`.
    distance_m: f64,
    /// Deviation from the intended lateral state.
    deviation: Deviation,
    /// Direction of motion relative to the lane (rad).
    course_rad: f64,
}

impl Plant {
    /// Creates a vehicle that stands on the centre line of its lane or moves along it. `weave` is
    /// the driver's deviation from that line, `friction` the road's, and `step_s` the length of a
    /// step.
    pub(crate) fn new(
        vehicle: &Vehicle,
        state: VehicleState,
        weave: Option<Weave>,
        friction: f64,
        step_s: f64,
    ) -> Self {
        let capability = Capability::for_class(vehicle.class);
        Self {
            capability,
            brake_light_from_mps2: vehicle.brake_light_from_mps2,
            wheelbase_m: vehicle.dimensions.wheelbase_m(),
            friction,
            lag_share: 1.0 - maths::exp(-step_s / capability.lag_s),
            step_s,
            state,
            lane_change: None,
            path: None,
            intended: LateralState { d_m: state.d_m, ..LateralState::default() },
            guide: None,
            weave,
            distance_m: 0.0,
            deviation: Deviation::default(),
            course_rad: 0.0,
        }
    }

    /// Returns the same vehicle on a lateral path.
    pub(crate) fn with_path(self, path: Option<LateralPath>) -> Self {
        let Some(path) = path else { return self };
        let intended = on_path(&path, 0.0);
        Self { path: Some(path), intended, course_rad: maths::atan(intended.slope), ..self }
    }

    /// Returns the same vehicle in the lane of a road.
    pub(crate) fn in_lane_of(mut self, road: &Road) -> Self {
        if road.has_changing_lanes() && self.path.is_none() {
            let lane = road.lane_of(&self.state);
            let line = driving_line(road, lane, self.state.s_m, self.state.d_m);
            self.guide = Some(lane);
            self.intended.d_m -= line.d_m;
            self.course_rad = maths::atan(line.slope);
        }
        self
    }

    /// Returns the same vehicle with actuators that follow the command at once.
    pub(crate) fn with_ideal_actuators(self) -> Self {
        let capability = Capability { lag_s: 0.0, jerk_limit_mps3: f64::INFINITY, ..self.capability };
        Self { capability, lag_share: 1.0, ..self }
    }

    /// Returns the current state.
    pub(crate) fn state(&self) -> &VehicleState {
        &self.state
    }

    /// Returns the target lane of the lane change in progress, or `None` if there is none.
    pub(crate) fn lane_change_target(&self) -> Option<Lane> {
        self.lane_change.map(|change| change.target)
    }

    /// Returns the lateral deviation from the path that the driver intends, positive to the left
    /// (m).
    pub(crate) fn lateral_deviation_m(&self) -> f64 {
        self.deviation.offset_m
    }

    /// Returns the pitch of the body, positive nose down (rad).
    pub(crate) fn pitch_rad(&self) -> f64 {
        -self.state.acceleration_mps2 * DIVE_RAD_PER_MPS2
    }

    /// Puts the vehicle where its bumper meets another one: it gets this speed (m/s), and is moved
    /// along the road by `shift_m`.
    pub(crate) fn meet(&mut self, speed_mps: f64, shift_m: f64) {
        self.state.speed_mps = speed_mps;
        self.state.s_m += shift_m;
    }

    /// Starts a lane change, or replaces the one in progress. The path becomes longer than
    /// requested if the tyres could not provide the lateral acceleration otherwise.
    pub(crate) fn change_lane(&mut self, change: LaneChange, road: &Road) {
        self.path = None;
        let mut target_m = road.lane_centre_m(change.target, self.state.s_m);
        if road.has_changing_lanes() {
            let line = |lane| driving_line(road, lane, self.state.s_m, self.state.d_m);
            let from = self.guide.map_or(LateralState::default(), line);
            self.intended = self.intended.plus(&from).minus(&line(change.target));
            self.guide = Some(change.target);
            target_m = 0.0;
        }
        let requested_m = change.duration_s * self.state.speed_mps;
        let mut path = LanePath::new(self.intended, target_m, requested_m.max(SHORTEST_LANE_CHANGE_M));
        let limit_per_m = lateral_grip_mps2(self.friction) / (self.state.speed_mps * self.state.speed_mps).max(1.0);
        // The second derivative falls with the square of the length, so that a few steps of 10 %
        // suffice.
        while path.max_second_derivative_per_m() > limit_per_m && path.length_m() < 10.0 * requested_m.max(100.0) {
            path = LanePath::new(self.intended, target_m, 1.1 * path.length_m());
        }
        self.lane_change = Some(LaneChangePath { path, target: change.target, travelled_m: 0.0 });
    }

    /// Moves the vehicle by one step with the commanded acceleration (m/s²), which must be finite.
    pub(crate) fn step(&mut self, commanded_mps2: f64, indicator: Indicator, road: &Road) {
        let before = self.state;
        let grip_mps2 = self.friction * GRAVITY_MPS2;
        let lateral_mps2 = before.speed_mps * before.yaw_rate_radps;
        let longitudinal_grip_mps2 = (grip_mps2 * grip_mps2 - lateral_mps2 * lateral_mps2).max(0.0).sqrt();
        let max_braking_mps2 = longitudinal_grip_mps2.min(self.capability.brake_share * grip_mps2);
        let max_acceleration_mps2 = self.capability.max_acceleration_mps2.min(longitudinal_grip_mps2);
        let limited_mps2 = commanded_mps2.clamp(-max_braking_mps2, max_acceleration_mps2);

        let max_change_mps2 = self.capability.jerk_limit_mps3 * self.step_s;
        let change_mps2 =
            (self.lag_share * (limited_mps2 - before.acceleration_mps2)).clamp(-max_change_mps2, max_change_mps2);
        let acceleration_mps2 = before.acceleration_mps2 + change_mps2;
        let Advance { speed_mps, distance_m } = advance(before.speed_mps, acceleration_mps2, self.step_s);
        let is_held = speed_mps < STANDING_MPS && acceleration_mps2 <= 0.0 && commanded_mps2 <= 0.0;
        let speed_mps = if is_held { 0.0 } else { speed_mps };
        self.state.speed_mps = speed_mps;
        self.state.acceleration_mps2 = if speed_mps > 0.0 { acceleration_mps2 } else { 0.0 };
        let holds_at_standstill = speed_mps == 0.0 && commanded_mps2 <= 0.0;
        self.state.brake_light = commanded_mps2 <= -self.brake_light_from_mps2 || holds_at_standstill;
        self.state.indicator = indicator;
        self.steer(distance_m, road);
    }

    /// Moves the vehicle by `distance_m` along its path.
    fn steer(&mut self, distance_m: f64, road: &Road) {
        // Path and weaving are functions of the distance in the direction of the lane.
        // The functions below are exact at zero: most vehicles drive straight on.
        let along_m = if self.course_rad == 0.0 { distance_m } else { distance_m * maths::cos(self.course_rad) };
        self.distance_m += along_m;
        if let Some(weave) = &mut self.weave {
            self.deviation = weave.at(self.distance_m);
        }
        if let Some(change) = &mut self.lane_change {
            change.travelled_m += along_m;
            self.intended = change.path.at(change.travelled_m);
            if change.travelled_m >= change.path.length_m() {
                self.lane_change = None;
            }
        } else if let Some(path) = &self.path {
            self.intended = on_path(path, self.distance_m);
        }
        let mut lateral = self.lateral();
        if let Some(lane) = self.guide {
            let s_m = road.advanced_m(self.state.s_m, self.state.d_m, along_m);
            lateral = lateral.plus(&driving_line(road, lane, s_m, self.state.d_m));
            if self.lane_change.is_none() {
                // A lane that ends may begin again: the vehicle then stays in the lane to which it came.
                self.guide = Some(road.followed_lane(lane, s_m));
            }
        }
        let LateralState { d_m, slope, second_derivative_per_m } = lateral;
        let (course_rad, curvature_per_m) = if slope == 0.0 {
            (slope, second_derivative_per_m)
        } else {
            (maths::atan(slope), second_derivative_per_m / maths::powf(1.0 + slope * slope, 1.5))
        };
        self.course_rad = course_rad;
        // Slip angle at the centre of the box, half a wheelbase ahead of the rear axle.
        let slip_sin = (0.5 * self.wheelbase_m * curvature_per_m).clamp(-0.5, 0.5);
        let slip_rad = if slip_sin == 0.0 { slip_sin } else { maths::asin(slip_sin) };
        self.state.d_m = d_m;
        self.state.heading_rad = course_rad - slip_rad;
        self.state.yaw_rate_radps =
            self.state.speed_mps * (curvature_per_m + road.parallel_curvature_per_m(self.state.s_m, 0.0));
        // In a curve, a distance along the lane differs from the distance along the road's
        // reference line.
        self.state.s_m = road.advanced_m(self.state.s_m, d_m, along_m);
    }

    /// Returns the actual lateral state: the intended one plus the deviation.
    fn lateral(&self) -> LateralState {
        LateralState {
            d_m: self.intended.d_m + self.deviation.offset_m,
            slope: self.intended.slope + self.deviation.slope,
            second_derivative_per_m: self.intended.second_derivative_per_m + self.deviation.second_derivative_per_m,
        }
    }
}

/// Returns the lateral state on the driving line of a lane at `s_m`. Its derivatives are with respect
/// to the distance along the lane of a vehicle at `d_m`.
fn driving_line(road: &Road, lane: Lane, s_m: f64, d_m: f64) -> LateralState {
    let [line_m, slope, second_derivative_per_m] = road.driving_line(lane, s_m);
    let scale = road.path_scale(s_m, d_m);
    LateralState {
        d_m: line_m,
        slope: slope / scale,
        second_derivative_per_m: second_derivative_per_m / (scale * scale),
    }
}

/// Returns the lateral state after a distance along a lateral path (m).
fn on_path(path: &LateralPath, travelled_m: f64) -> LateralState {
    let [d_m, slope, second_derivative_per_m] = path.at(travelled_m);
    LateralState { d_m, slope, second_derivative_per_m }
}

/// Speed after one step, and the distance travelled in it.
struct Advance {
    speed_mps: f64,
    distance_m: f64,
}

/// Advances by one step of constant acceleration. If the speed reaches zero within the step, the
/// vehicle stops there.
fn advance(speed_mps: f64, acceleration_mps2: f64, step_s: f64) -> Advance {
    let after_mps = speed_mps + acceleration_mps2 * step_s;
    if after_mps > 0.0 {
        Advance { speed_mps: after_mps, distance_m: 0.5 * (speed_mps + after_mps) * step_s }
    } else if speed_mps > 0.0 {
        Advance { speed_mps: 0.0, distance_m: speed_mps * speed_mps / (-2.0 * acceleration_mps2) }
    } else {
        Advance { speed_mps: 0.0, distance_m: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use closecall_controllers::LaneKeepingConfig;
    use closecall_traffic::{ActorId, Alignment, AlignmentPoint, Check, PHYSICS_STEP, Parameters, Side, stream};

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
        // The ideal distance is v²/(2µg). The actuator lag adds about 0.2 s at 30 m/s.
        let ideal_m = 30.0 * 30.0 / (2.0 * 0.9 * GRAVITY_MPS2);
        assert!(car.state().s_m > ideal_m && car.state().s_m < ideal_m + 30.0 * 0.35, "{}", car.state().s_m);
    }

    #[test]
    fn a_vehicle_that_slows_down_exponentially_comes_to_a_standstill_and_starts_again() {
        let road = Road::straight(3);
        let mut car = car(1.0);
        for _ in 0..3_000 {
            let commanded_mps2 = -0.4 * car.state().speed_mps;
            car.step(commanded_mps2, Indicator::Off, &road);
        }
        assert_eq!((car.state().speed_mps, car.state().acceleration_mps2), (0.0, 0.0));
        for _ in 0..10 {
            car.step(0.05, Indicator::Off, &road);
        }
        assert!(car.state().speed_mps > 0.0 && car.state().speed_mps < STANDING_MPS, "{:?}", car.state());
    }

    #[test]
    fn a_vehicle_in_its_lane_follows_an_s_curve_with_the_lateral_acceleration_of_its_curvature() {
        let points = [[20.0, 0.0], [120.0, 0.002], [180.0, 0.002], [300.0, -0.001], [360.0, -0.001]];
        let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
        let road = Road::straight(3).with_alignment(Alignment::new(&points).unwrap());
        let mut car = car(30.0);
        let (mut driven_m, mut largest_mps2) = (0.0, 0.0_f64);
        let mut before = road.plane_pose(0.0, -5.625, 0.0);
        for _ in 0..1_300 {
            let s_m = car.state().s_m;
            car.step(0.0, Indicator::Off, &road);
            let state = *car.state();
            assert_eq!((state.d_m, state.heading_rad), (-5.625, 0.0));
            let lateral_mps2 = state.speed_mps * state.yaw_rate_radps;
            assert!((lateral_mps2 - 900.0 * road.curvature_at_per_m(s_m)).abs() < 1e-9, "{lateral_mps2} at {s_m}");
            largest_mps2 = largest_mps2.max(lateral_mps2);
            // In the plane, it drives as far as its speed says.
            let pose = road.plane_pose(state.s_m, state.d_m, 0.0);
            driven_m += maths::hypot(pose.x_m - before.x_m, pose.y_m - before.y_m);
            before = pose;
        }
        assert!((largest_mps2 - 1.8).abs() < 1e-9, "{largest_mps2}");
        assert!(car.state().s_m > 360.0 && (driven_m - 30.0 * 1_300.0 * STEP_S).abs() < 1e-3, "{driven_m}");
    }

    #[test]
    fn a_lane_change_takes_the_requested_time_and_ends_on_the_centre() {
        let road = Road::straight(3);
        let mut car = car(30.0);
        car.change_lane(LaneChange { target: Lane(1), duration_s: 5.0 }, &road);
        let mut crossing_s = 0.0;
        for step in 0..500 {
            assert!(car.lane_change_target().is_some(), "ended after {step} steps");
            car.step(0.0, Indicator::Left, &road);
            if car.state().d_m < -3.75 {
                crossing_s = f64::from(step + 1) * STEP_S;
            }
        }
        car.step(0.0, Indicator::Off, &road);
        assert!(car.lane_change_target().is_none());
        assert!((crossing_s - 2.5).abs() < 0.05, "{crossing_s}");
        assert!((car.state().d_m + 1.875).abs() < 1e-9);
        assert!(car.state().heading_rad.abs() < 1e-9);
    }

    #[test]
    fn a_lane_change_to_a_wider_lane_ends_on_its_centre() {
        // The car starts on the centre of lane 2.
        let road = Road::straight(3).with_lane_widths(&[4.0, 3.25, 3.75]);
        for (target, centre_m) in [(Lane(3), -9.125), (Lane(1), -2.0)] {
            let mut car = car(30.0);
            assert!((car.state().d_m - road.lane_centre_m(Lane(2), 0.0)).abs() < 1e-12);
            car.change_lane(LaneChange { target, duration_s: 5.0 }, &road);
            for _ in 0..=500 {
                car.step(0.0, Indicator::Off, &road);
            }
            assert!(car.lane_change_target().is_none());
            assert!((car.state().d_m - centre_m).abs() < 1e-9, "{:?}", car.state());
            assert!(
                (road.lane_at(car.state().s_m, car.state().d_m), car.state().heading_rad.abs() < 1e-9)
                    == (target, true)
            );
        }
    }

    #[test]
    fn a_vehicle_follows_its_path_at_any_speed_until_it_changes_lanes() {
        let road = Road::straight(3);
        let points: Vec<[f64; 2]> =
            (0..10).map(|index| f64::from(index) * 20.0).map(|x| [x, -6.0 + 0.005 * x]).collect();
        let path = LateralPath::new(&points).unwrap();
        for commanded_mps2 in [0.0, -4.0] {
            let mut car = car(30.0).with_path(Some(path.clone()));
            for _ in 0..300 {
                car.step(commanded_mps2, Indicator::Off, &road);
                let expected_m = path.at(car.state().s_m)[0];
                assert!((car.state().d_m - expected_m).abs() < 1e-9, "{:?} {expected_m}", car.state());
            }
            car.change_lane(LaneChange { target: Lane(1), duration_s: 3.0 }, &road);
            let before_m = car.state().d_m;
            car.step(0.0, Indicator::Left, &road);
            assert!((car.state().d_m - before_m).abs() < 0.01, "the lane change starts where the vehicle is");
            for _ in 0..1_200 {
                car.step(0.5, Indicator::Off, &road);
            }
            assert!((car.state().d_m + 1.875).abs() < 1e-9, "{:?}", car.state());
        }
    }

    #[test]
    fn a_lane_change_takes_longer_if_the_tyres_limit_it() {
        let road = Road::straight(3);
        let mut car = car(33.0);
        car.change_lane(LaneChange { target: Lane(1), duration_s: 0.5 }, &road);
        let mut largest_mps2: f64 = 0.0;
        for _ in 0..400 {
            car.step(0.0, Indicator::Left, &road);
            largest_mps2 = largest_mps2.max((car.state().speed_mps * car.state().yaw_rate_radps).abs());
        }
        assert!(largest_mps2 <= lateral_grip_mps2(0.9) * 1.01, "{largest_mps2}");
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
                let course_rad = maths::asin(lateral_mps / 30.0);
                assert!((course_rad - car.state().heading_rad).abs() < 0.01);
                previous = car.state().d_m;
            }
        }
    }

    #[test]
    fn a_weaving_vehicle_starts_on_its_path_and_keeps_its_deviation_in_a_lane_change() {
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
            // The slope of the weaving changes the distance along the lane, and so the lane change,
            // by some millimetres.
            let deviation_m = weaving.state().d_m - straight.state().d_m;
            assert!((deviation_m - weaving.lateral_deviation_m()).abs() < 0.005, "step {step}: {deviation_m}");
            widest_m = widest_m.max(deviation_m.abs());
        }
        assert!((0.3..1.2).contains(&widest_m), "{widest_m}");
        // A vehicle at standstill does not move sideways.
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
