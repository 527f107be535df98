//! The two radars with their random errors, their faults, and the scans that wait for the tracker.
//!
//! Every scan takes the same number of random values of each vehicle in the scene, whether the
//! vehicle is seen or not. Two runs that differ only in the ego's behaviour therefore have the same
//! errors at the same times. For traffic that overtakes on the right, the radars and the signs of
//! the angles are swapped, so that a mirrored scene has mirrored errors.

use std::collections::VecDeque;

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{CONTROL_STEP, Road, Side, StandardNormal, Stream, Time, VehicleState, maths};
use rand::RngExt;

use super::config::RearRadar;
use super::measure::{Echo, Mount, Reflector, mirrored, rails_m};
use super::output::{MountedRadars, RadarReturn, RadarSource};
use super::rain::range_in_rain_m;
use crate::external::OutsideRadarScan;
use crate::faults::{FaultList, NOTICED_AFTER_SCANS, RadarFault};
use crate::monitors::{Alarm, Alarms};
use crate::object::DEGRADED_SHARE;
use crate::surroundings::{OtherVehicle, transform_scene};
use crate::tracking::{RadarDetection, RadarScan};
use crate::{Health, NoiseKey, Scene, SensorError};

/// The random streams of the radar on the side on which vehicles overtake, and of the other one.
const CHANNELS: [&str; 2] = ["rear-radar-passing", "rear-radar-slow"];
/// The sides of the radars, in the order of all lists.
const SIDES: [Side; 2] = [Side::Left, Side::Right];

/// The random numbers for one path of the signal of one radar to one vehicle.
#[derive(Clone, Copy, Debug)]
struct Draws {
    /// Decides whether there is an image in a rail (0 to 1).
    image: f64,
    /// Decides whether the radar detects what is there (0 to 1).
    detection: f64,
    /// Errors of range, azimuth and radial speed (standard deviations).
    errors: [f64; 3],
}

/// The random streams of both radars for one vehicle.
#[derive(Clone, Debug)]
struct TargetStreams {
    /// Index in the scenario's list of actors.
    actor: usize,
    streams: [Stream; 2],
}

impl TargetStreams {
    /// Returns the numbers of a scan: for the direct path, the path by way of the rail on the side
    /// on which vehicles overtake, and by way of the other rail.
    fn draw(&mut self, channel: usize) -> [Draws; 3] {
        let rng = &mut self.streams[channel];
        std::array::from_fn(|_| Draws {
            image: rng.random(),
            detection: rng.random(),
            errors: std::array::from_fn(|_| rng.sample(StandardNormal)),
        })
    }
}

/// A scan of one radar whose processing latency has not elapsed.
#[derive(Clone, Debug)]
struct PendingScan {
    time: Time,
    /// Number of the step from which on the tracker has the scan of a radar that is not late.
    usual_step: u64,
    /// Number of the step from which on the tracker may have the scan.
    due_step: u64,
    road: Road,
    ego: VehicleState,
    detections: Vec<RadarDetection>,
}

/// The pair of radars with its state.
#[derive(Clone, Debug)]
pub(crate) struct RearRadars {
    model: RearRadar,
    key: NoiseKey,
    faults: FaultList<RadarFault>,
    targets: Vec<TargetStreams>,
    others: Vec<OtherVehicle>,
    /// The scans of the left and of the right radar that wait for the tracker. They arrive in their
    /// order.
    pending: [VecDeque<PendingScan>; 2],
    /// The scans that a program has not had, each with the number of the step from which on the
    /// tracker may have it; `None` without a program.
    untold: Option<VecDeque<(u64, OutsideRadarScan)>>,
    /// Time of the latest scan, and its detections by the left and by the right radar.
    latest: (Option<Time>, [Vec<RadarReturn>; 2]),
    /// Numbers of latest successive scans in which the left and the right radar delivered nothing.
    dead_scans: [u32; 2],
    /// Numbers of latest successive scans whose time stamps show that they have arrived late.
    late_scans: [u32; 2],
    /// Whether dirt and rain leave so little of the range that the monitors of the radars report
    /// it.
    are_short: [bool; 2],
}

/// What one radar looks at in one scan.
#[derive(Clone, Copy)]
struct View<'a> {
    scene: &'a Scene<'a>,
    frame: &'a EgoFrame<'a>,
    others: &'a [OtherVehicle],
    mount: Mount,
    fault: Option<RadarFault>,
}

impl RearRadars {
    /// Creates the radars before their first step, with random streams keyed by `key`.
    pub(crate) fn new(model: RearRadar, key: &NoiseKey) -> Self {
        Self {
            model,
            key: key.clone(),
            faults: FaultList::default(),
            targets: Vec::new(),
            others: Vec::new(),
            pending: [VecDeque::new(), VecDeque::new()],
            untold: None,
            latest: (None, [Vec::new(), Vec::new()]),
            dead_scans: [0; 2],
            late_scans: [0; 2],
            are_short: [false; 2],
        }
    }

    /// Returns the same radars with faults.
    pub(crate) fn with_faults(self, faults: FaultList<RadarFault>) -> Self {
        Self { faults, ..self }
    }

    /// Returns the same radars, which keep their scans for a program.
    pub(crate) fn with_program(self) -> Self {
        Self { untold: Some(VecDeque::new()), ..self }
    }

    /// Returns the scans that have arrived and that no program has had. The tracker may have a scan
    /// that arrives in this step from `due_step` on. A dead radar has no scans.
    pub(crate) fn arrived(&mut self, due_step: u64) -> Vec<OutsideRadarScan> {
        let Some(untold) = &mut self.untold else { return Vec::new() };
        let (arrived, later): (VecDeque<_>, VecDeque<_>) = untold.drain(..).partition(|(due, _)| *due <= due_step);
        *untold = later;
        arrived.into_iter().map(|(_, scan)| scan).collect()
    }

    /// Returns the health of the two radars together: failed if both have delivered nothing for a
    /// while. It is degraded if one of them has, if the time stamps have shown for a while that a
    /// radar is late, or if dirt and rain cost a radar more than half of its range.
    pub(crate) fn health(&self) -> Health {
        let are_late = self.late_scans.map(|scans| self.is_noticed(scans));
        match self.dead_scans.map(|scans| self.is_noticed(scans)) {
            [true, true] => Health::Failed,
            [false, false] if !(are_late.contains(&true) || self.are_short.contains(&true)) => Health::Ok,
            _ => Health::Degraded,
        }
    }

    /// Returns what the monitors of the two radars have noticed.
    pub(crate) fn alarms(&self) -> Alarms {
        Alarms::NONE
            .with_if(Alarm::NothingNew, self.dead_scans.iter().any(|scans| self.is_noticed(*scans)))
            .with_if(Alarm::ShortRange, self.are_short.contains(&true))
            .with_if(Alarm::LateScans, self.late_scans.iter().any(|scans| self.is_noticed(*scans)))
    }

    /// Returns whether so many successive scans have taken long enough for the ego to notice.
    fn is_noticed(&self, scans: u32) -> bool {
        f64::from(scans) * self.model.period_s() >= f64::from(NOTICED_AFTER_SCANS) * CONTROL_STEP.s()
    }

    /// Returns the radars with their latest scan.
    pub(crate) fn mounted(&self) -> MountedRadars<'_> {
        let (time, [left, right]) = &self.latest;
        MountedRadars { health: self.health(), time: *time, returns: [left, right] }
    }

    /// Measures `scene`, which the ego believes to be `believed`, if a scan is due. The tracker may
    /// have the scan from `due_step` on.
    ///
    /// # Errors
    /// [`SensorError`] if the state of a vehicle is not finite.
    pub(crate) fn sense(&mut self, [scene, believed]: [&Scene<'_>; 2], due_step: u64) -> Result<(), SensorError> {
        if !self.model.is_due(scene.time) {
            return Ok(());
        }
        let mut others = std::mem::take(&mut self.others);
        let result = self.scan(scene, &mut others);
        self.others = others;
        let (time, ego) = (scene.time, believed.ego.state);
        let returns = result?;
        for ((side, pending), returns) in SIDES.into_iter().zip(&mut self.pending).zip(&returns) {
            let fault = self.faults.of_side(side).at(time).unwrap_or_default();
            let (usual_step, due_step) = (due_step, due_step + fault.delay_steps());
            let detections: Vec<RadarDetection> = returns.iter().map(|one| one.measured).collect();
            if let Some(untold) = self.untold.as_mut().filter(|_| !fault.is_dead) {
                // The scans of a radar arrive in their order.
                let latest = untold.iter().rev().find(|(_, scan)| scan.side == side);
                let due_step = due_step.max(latest.map_or(0, |(due_step, _)| *due_step));
                untold.push_back((due_step, OutsideRadarScan { side, time, detections: detections.clone() }));
            }
            let road = believed.road.clone();
            pending.push_back(PendingScan { time, usual_step, due_step, road, ego, detections });
        }
        self.latest = (Some(time), returns);
        Ok(())
    }

    /// Returns the detections of the left and of the right radar.
    fn scan(
        &mut self,
        scene: &Scene<'_>,
        others: &mut Vec<OtherVehicle>,
    ) -> Result<[Vec<RadarReturn>; 2], SensorError> {
        let frame = transform_scene(scene, others)?;
        let passing = scene.road.overtaking_side();
        let mut returns = [Vec::new(), Vec::new()];
        for (index, side) in SIDES.into_iter().enumerate() {
            let fault = self.faults.of_side(side).at(scene.time);
            let is_dead = fault.is_some_and(|fault| fault.is_dead);
            let range_m = self.range_m(fault, scene);
            self.are_short[index] = range_m < DEGRADED_SHARE * self.model.range_m;
            self.dead_scans[index] = if is_dead { self.dead_scans[index].saturating_add(1) } else { 0 };
            let mount = self.model.mount(side, scene.ego.vehicle.dimensions.length_m);
            let view = View { scene, frame: &frame, others: &others[..], mount, fault };
            for (place, other) in view.others.iter().enumerate() {
                let target = self.target(other.actor);
                let draws = self.targets[target].draw(usize::from(side != passing));
                self.detect(view, place, draws, &mut returns[index]);
            }
            returns[index].extend(self.ghost(view, side));
        }
        Ok(returns)
    }

    /// Appends the detections of the vehicle with this place in the list.
    fn detect(&self, view: View<'_>, place: usize, draws: [Draws; 3], returns: &mut Vec<RadarReturn>) {
        let point = view.mount.nearest_point(&view.others[place]);
        let mut others = view.others.iter().enumerate().filter(|(other, _)| *other != place);
        if others.any(|(_, other)| view.mount.is_hidden_by(&point, other)) {
            return;
        }
        let [direct, images @ ..] = draws;
        let actor = view.others[place].actor;
        let with = |source: RadarSource| move |measured: RadarDetection| RadarReturn { measured, source };
        returns.extend(self.detection(view, &point, &direct).map(with(RadarSource::Vehicle(actor))));
        let road = view.scene.road;
        if !road.has_guard_rails() {
            return;
        }
        let [left_m, right_m] = rails_m(road);
        let rails_m = match road.overtaking_side() {
            Side::Left => [left_m, right_m],
            Side::Right => [right_m, left_m],
        };
        for (rail_m, draws) in rails_m.into_iter().zip(images) {
            if draws.image < self.model.ghost_probability {
                let image = self.detection(view, &mirrored(&point, rail_m, view.frame), &draws);
                returns.extend(image.map(with(RadarSource::MirrorImage(actor))));
            }
        }
    }

    /// Returns the measurement of a point; `None` if it is not detected.
    fn detection(&self, view: View<'_>, point: &Reflector, draws: &Draws) -> Option<RadarDetection> {
        let model = &self.model;
        let fault = view.fault.unwrap_or_default();
        let echo = self.echo(view, point)?;
        let probability = model.detection_probability * (1.0 - fault.dropout);
        if !(draws.detection < probability) {
            return None;
        }
        let turned = match view.scene.road.overtaking_side() {
            Side::Left => 1.0,
            Side::Right => -1.0,
        };
        let [range, azimuth, speed] = draws.errors;
        Some(RadarDetection {
            sensor_m: view.mount.at_m,
            range_m: (echo.range_m + model.range_sd_m * range).max(0.0),
            azimuth_rad: echo.azimuth_rad + turned * model.azimuth_sd_rad * azimuth + fault.yaw_rad,
            radial_mps: echo.radial_mps + model.speed_sd_mps * speed,
            range_sd_m: model.range_sd_m,
            azimuth_sd_rad: model.azimuth_sd_rad,
            radial_sd_mps: model.speed_sd_mps,
        })
    }

    /// Returns the range of a radar with this fault, in the rain of the scene (m).
    fn range_m(&self, fault: Option<RadarFault>, scene: &Scene<'_>) -> f64 {
        let clean_share = fault.map_or(1.0, |fault| fault.range_share);
        range_in_rain_m(self.model.range_m * clean_share, scene.environment.rain_mm_per_h)
    }

    /// Returns what a radar with its faults measures of a point, without errors; `None` if the
    /// faults leave nothing, or if the point is not in view.
    fn echo(&self, view: View<'_>, point: &Reflector) -> Option<Echo> {
        let fault = view.fault.unwrap_or_default();
        let range_m = self.range_m(view.fault, view.scene);
        let echo = view.mount.echo(point, view.scene.ego.state.speed_mps, range_m)?;
        (!fault.is_dead && !fault.hides(echo.azimuth_rad.to_degrees())).then_some(echo)
    }

    /// Returns the detection of a vehicle that does not exist, which a fault adds: in the ego's
    /// lane, without random errors. It ends where it would reach the bumper.
    fn ghost(&self, view: View<'_>, side: Side) -> Option<RadarReturn> {
        let fault = view.fault?;
        let [gap_m, closing_mps] = fault.ghost?;
        let scene = view.scene;
        let since_s = self.faults.of_side(side).since_s(scene.time, |fault| fault.ghost.is_some())?;
        let gap_m = gap_m - closing_mps * since_s;
        if !(gap_m >= 0.0) {
            return None;
        }
        let (ego, ego_length_m) = (scene.ego.state, scene.ego.vehicle.dimensions.length_m);
        let point = view.frame.point(ego.s_m - 0.5 * ego_length_m - gap_m, ego.d_m);
        let (sin, cos) = maths::sin_cos(point.road_yaw_rad);
        let speed_mps = ego.speed_mps + closing_mps;
        let reflector = Reflector { at_m: [point.x_m, point.y_m], velocity_mps: [speed_mps * cos, speed_mps * sin] };
        let echo = self.echo(view, &reflector)?;
        let measured = RadarDetection {
            sensor_m: view.mount.at_m,
            range_m: echo.range_m,
            azimuth_rad: echo.azimuth_rad + fault.yaw_rad,
            radial_mps: echo.radial_mps,
            range_sd_m: self.model.range_sd_m,
            azimuth_sd_rad: self.model.azimuth_sd_rad,
            radial_sd_mps: self.model.speed_sd_mps,
        };
        Some(RadarReturn { measured, source: RadarSource::Fault })
    }

    /// Returns the index of the streams of a vehicle, and adds them if the vehicle is new.
    fn target(&mut self, actor: usize) -> usize {
        self.targets.iter().position(|target| target.actor == actor).unwrap_or_else(|| {
            let streams = CHANNELS.map(|channel| self.key.stream_about(channel, actor));
            self.targets.push(TargetStreams { actor, streams });
            self.targets.len() - 1
        })
    }

    /// Calls `use_scan` with each scan that the tracker may have in `step`, in the order of their
    /// times, up to the time `before`, which is excluded. Scans of both radars of the same time
    /// that arrive in the same step are one.
    ///
    /// A scan is late if it arrives more than a period after its usual step.
    pub(crate) fn pass_due(&mut self, step: u64, before: Option<Time>, mut use_scan: impl FnMut(&RadarScan<'_>)) {
        let is_next = |scan: &PendingScan| scan.due_step <= step && before.is_none_or(|before| scan.time < before);
        loop {
            let next =
                |pending: &VecDeque<PendingScan>| pending.front().filter(|scan| is_next(scan)).map(|scan| scan.time);
            let Some(time) = self.pending.iter().filter_map(next).min() else { return };
            let mut arrived: [Option<PendingScan>; 2] = [None, None];
            for (arrived, pending) in arrived.iter_mut().zip(&mut self.pending) {
                *arrived = pending.pop_front_if(|scan| scan.time == time && is_next(scan));
            }
            for (late_scans, scan) in self.late_scans.iter_mut().zip(&arrived) {
                let Some(scan) = scan else { continue };
                let late_s = step.saturating_sub(scan.usual_step) as f64 * CONTROL_STEP.s();
                *late_scans = if late_s > self.model.period_s() { late_scans.saturating_add(1) } else { 0 };
            }
            let Some(first) = arrived.iter().flatten().next() else { return };
            let detections =
                arrived.each_ref().map(|scan| scan.as_ref().map(|scan| &scan.detections[..]).unwrap_or_default());
            use_scan(&RadarScan { time, road: &first.road, ego: first.ego, detections });
        }
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, Check, Environment, Parameters, VehicleClass};

    use super::*;
    use crate::SceneVehicle;
    use crate::radar::RearRadarConfig;
    use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};

    const EGO_MPS: f64 = 30.0;
    const EGO_S_M: f64 = 1_000.0;

    fn radars(text: &str, seed: u64) -> RearRadars {
        let model = toml::from_str::<RearRadarConfig>(text).unwrap().check(&Parameters::default()).unwrap();
        RearRadars::new(model, &NoiseKey { seed, sample: 1, ego: ActorId::new("ego").unwrap(), actors: [].into() })
    }

    /// Returns a scene with one car behind the ego.
    fn scene<'a>(road: &'a Road, others: &'a [SceneVehicle], time: Time) -> Scene<'a> {
        let ego = with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), EGO_MPS);
        Scene { time, road, environment: &Environment::CLEAR_DAY, ego, others }
    }

    /// Returns the detections of the left and of the right radar in so many scans of one scene.
    fn detections(
        radars: &mut RearRadars,
        road: &Road,
        others: &[SceneVehicle],
        scans: i64,
    ) -> [Vec<RadarDetection>; 2] {
        let mut all = [Vec::new(), Vec::new()];
        // A scan is due in every second step.
        for step in 0..2 * scans {
            let scene = scene(road, others, CONTROL_STEP * step);
            radars.sense([&scene, &scene], 0).unwrap();
            radars.pass_due(0, None, |scan| {
                for (all, detections) in all.iter_mut().zip(scan.detections) {
                    all.extend_from_slice(detections);
                }
            });
        }
        all
    }

    /// Returns a car in the left lane, 50 m behind the ego.
    fn car(speed_mps: f64) -> SceneVehicle {
        with_speed(scene_vehicle(1, VehicleClass::Car, EGO_S_M - 50.0, OWN_LANE_M + 3.75), speed_mps)
    }

    /// Returns what the left radar measures of the first vehicle without errors.
    fn true_echo(radars: &RearRadars, road: &Road, others: &[SceneVehicle]) -> Echo {
        let scene = scene(road, others, Time::ZERO);
        let mut surroundings = Vec::new();
        transform_scene(&scene, &mut surroundings).unwrap();
        let mount = radars.model.mount(Side::Left, scene.ego.vehicle.dimensions.length_m);
        mount.echo(&mount.nearest_point(&surroundings[0]), EGO_MPS, radars.model.range_m).unwrap()
    }

    #[test]
    fn errors_have_the_stated_spread_and_no_bias() {
        let (mut radars, road) = (radars("detection-probability = 1.0", 3), Road::straight(3));
        let truth = true_echo(&radars, &road, &[car(38.0)]);
        assert!(truth.radial_mps < -7.9 && truth.radial_mps > -8.0, "{truth:?}");
        let [measured, _] = detections(&mut radars, &road, &[car(38.0)], 10_000);
        assert_eq!(measured.len(), 10_000, "each scan detects the car");
        let model = radars.model;
        type Value = fn(&RadarDetection) -> f64;
        let columns: [(Value, f64, f64); 3] = [
            (|detection| detection.range_m, truth.range_m, model.range_sd_m),
            (|detection| detection.azimuth_rad, truth.azimuth_rad, model.azimuth_sd_rad),
            (|detection| detection.radial_mps, truth.radial_mps, model.speed_sd_mps),
        ];
        for (value, truth, sd) in columns {
            let errors: Vec<f64> = measured.iter().map(|detection| value(detection) - truth).collect();
            let count = errors.len() as f64;
            let mean = errors.iter().sum::<f64>() / count;
            let spread = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
            // Four standard errors of the mean and of the standard deviation of 10,000 draws.
            assert!(mean.abs() < 0.04 * sd && (spread / sd - 1.0).abs() < 0.03, "{mean} {spread} for {sd}");
        }
    }

    #[test]
    fn a_vehicle_is_detected_with_the_stated_probability() {
        let mut radars = radars("detection-probability = 0.6", 5);
        let [measured, _] = detections(&mut radars, &Road::straight(3), &[car(38.0)], 10_000);
        // Four standard errors.
        assert!((measured.len() as f64 / 10_000.0 - 0.6).abs() < 0.02, "{}", measured.len());
    }

    #[test]
    fn ghosts_lie_beyond_the_rail_and_come_with_the_stated_probability() {
        let road = Road::straight(3).with_guard_rails();
        let text = "detection-probability = 1.0\nghost-probability = 0.2\nrange-sd-m = 0.01\nazimuth-sd-deg = 0.01\n";
        let mut radars = radars(text, 7);
        let [measured, _] = detections(&mut radars, &road, &[car(38.0)], 5_000);
        let left_m = |detection: &RadarDetection| {
            OWN_LANE_M
                + detection.sensor_m[1]
                + detection.range_m * closecall_traffic::maths::sin(detection.azimuth_rad)
        };
        let [left_rail_m, right_rail_m] = rails_m(&road);
        let direct = measured.iter().filter(|at| (right_rail_m..left_rail_m).contains(&left_m(at))).count();
        assert_eq!(direct, 5_000, "one detection of the car in each scan");
        // The side of the car that faces the radar is 2.15 m to the left of it.
        let side_m = OWN_LANE_M + 3.75 - 0.5 * car(38.0).vehicle.dimensions.width_m;
        for rail_m in [left_rail_m, right_rail_m] {
            let image_m = 2.0 * rail_m - side_m;
            let ghosts = measured.iter().filter(|at| (left_m(at) - image_m).abs() < 0.2).count();
            // Four standard errors of 5,000 draws.
            assert!((ghosts as f64 / 5_000.0 - 0.2).abs() < 0.023, "{ghosts} at {image_m} m");
        }
        let [without_rails, _] = detections(&mut radars, &Road::straight(3), &[car(38.0)], 100);
        assert_eq!(without_rails.len(), 100, "nothing mirrors without a rail");
    }

    #[test]
    fn each_detection_has_its_vehicle_and_an_image_is_no_vehicle() {
        let road = Road::straight(3).with_guard_rails();
        let mut radars = radars("detection-probability = 1.0\nghost-probability = 1.0\nazimuth-sd-deg = 0.01", 7);
        let empty = radars.mounted();
        assert!(empty.time.is_none() && empty.returns.iter().all(|returns| returns.is_empty()));
        let [measured, _] = detections(&mut radars, &road, &[car(38.0)], 1);
        let mounted = radars.mounted();
        assert_eq!((mounted.time, mounted.health), (Some(Time::ZERO), Health::Ok));
        let [left, _] = mounted.returns;
        assert_eq!(left.iter().map(|one| one.measured).collect::<Vec<_>>(), measured);
        let [left_rail_m, right_rail_m] = rails_m(&road);
        assert_eq!(left.len(), 3, "the car and two images: {left:?}");
        for one in left {
            let RadarDetection { sensor_m, range_m, azimuth_rad, .. } = one.measured;
            let left_m = OWN_LANE_M + sensor_m[1] + range_m * closecall_traffic::maths::sin(azimuth_rad);
            let is_on_road = (right_rail_m..left_rail_m).contains(&left_m);
            assert_eq!(one.source.exists(), is_on_road, "{one:?}");
            assert_eq!(one.source, if is_on_road { RadarSource::Vehicle(1) } else { RadarSource::MirrorImage(1) });
        }
    }

    #[test]
    fn a_radar_that_is_turned_to_the_left_sees_everything_farther_left_and_nothing_notices_it() {
        let road = Road::straight(3);
        let of_yaw = |yaw_deg: f64| {
            let list = FaultList::throughout_of(RadarFault { yaw_rad: yaw_deg.to_radians(), ..RadarFault::default() });
            let mut radars = radars("detection-probability = 1.0", 1).with_faults(list);
            let [left, _] = detections(&mut radars, &road, &[car(38.0)], 100);
            (left, radars.health())
        };
        let ((usual, _), (turned, health)) = (of_yaw(0.0), of_yaw(2.0));
        assert_eq!((usual.len(), turned.len(), health), (100, 100, Health::Ok));
        for (usual, turned) in usual.iter().zip(&turned) {
            assert!((turned.azimuth_rad - usual.azimuth_rad - 2.0_f64.to_radians()).abs() < 1e-12);
            assert_eq!((turned.range_m, turned.radial_mps), (usual.range_m, usual.radial_mps));
        }
    }

    #[test]
    fn a_ghost_approaches_in_the_lane_of_the_ego_and_ends_at_its_bumper() {
        let road = Road::straight(3);
        let fault = RadarFault { ghost: Some([20.0, 10.0]), ..RadarFault::default() };
        let with = |fault: RadarFault| radars("", 1).with_faults(FaultList::throughout_of(fault));
        let mut pair = with(fault);
        // 2.4 s of scans: the ghost would reach the bumper after 2 s.
        for measured in detections(&mut pair, &road, &[], 30) {
            let first = measured[0];
            let x_m = first.range_m * maths::cos(first.azimuth_rad);
            let y_m = first.range_m * maths::sin(first.azimuth_rad);
            assert!((x_m - 20.0).abs() < 1e-9 && (y_m + first.sensor_m[1]).abs() < 1e-9, "{first:?}");
            assert!((-10.0..-9.9).contains(&first.radial_mps), "{first:?}");
            assert!(measured.windows(2).all(|scans| scans[1].range_m < scans[0].range_m));
            assert_eq!(measured.len(), 25);
        }
        detections(&mut pair, &road, &[], 1);
        for returns in pair.mounted().returns {
            assert_eq!(returns.iter().map(|one| one.source).collect::<Vec<_>>(), [RadarSource::Fault]);
        }
        let mut dead = with(RadarFault { is_dead: true, ..fault });
        assert!(detections(&mut dead, &road, &[], 30).iter().all(Vec::is_empty));
    }

    #[test]
    fn rain_shortens_the_range_and_only_the_range() {
        let road = Road::straight(3);
        // The car is 45 m away. The range of 50 m falls to 48 m at 10 mm/h, and to 40 m at 200
        // mm/h.
        let in_rain = |rain_mm_per_h: f64, range_m: u32| {
            let text = format!("detection-probability = 1.0\nrange-m = {range_m}");
            let mut pair = radars(&text, 1);
            let environment = Environment { rain_mm_per_h, ..Environment::CLEAR_DAY };
            let others = [car(38.0)];
            let scene = Scene { environment: &environment, ..scene(&road, &others, Time::ZERO) };
            pair.sense([&scene, &scene], 0).unwrap();
            (pair.mounted().returns.map(<[RadarReturn]>::to_vec), pair.health())
        };
        let (dry, _) = in_rain(0.0, 50);
        assert_eq!(dry.each_ref().map(Vec::len), [1, 1]);
        assert_eq!(in_rain(10.0, 50).0, dry, "the errors stay");
        let (cloudburst, health) = in_rain(200.0, 50);
        assert!(cloudburst.iter().all(Vec::is_empty) && health == Health::Ok);
        assert_eq!(in_rain(200.0, 300).1, Health::Degraded, "more than half of the range is lost");
    }

    #[test]
    fn a_late_radar_is_noticed_by_its_time_stamps_and_the_other_one_arrives_in_time() {
        let road = Road::straight(3);
        for (delay_s, late, health) in [(0.2, 5, Health::Degraded), (0.08, 2, Health::Ok)] {
            let fault = RadarFault { delay_s, side: Some(Side::Left), ..RadarFault::default() };
            let mut radars = radars("detection-probability = 1.0", 1).with_faults(FaultList::throughout_of(fault));
            let mut arrived = Vec::new();
            for step in 0..40_i64 {
                let number = u64::try_from(step).unwrap();
                let scene = scene(&road, &[], CONTROL_STEP * step);
                radars.sense([&scene, &scene], number).unwrap();
                radars.pass_due(number, None, |scan| arrived.push((step, scan.time)));
            }
            // Each scan arrives twice: from the right radar at once, from the left one late.
            let at_once = arrived.iter().filter(|(step, time)| CONTROL_STEP * *step == *time).count();
            let later = arrived.iter().filter(|(step, time)| CONTROL_STEP * (*step - late) == *time).count();
            assert_eq!(at_once, 20);
            assert!(later >= 18 && arrived.len() == at_once + later, "{arrived:?}");
            assert_eq!(radars.health(), health, "late by {delay_s} s");
        }
    }

    #[test]
    fn a_program_gets_each_scan_once_when_it_arrives_and_none_of_a_dead_radar() {
        let road = Road::straight(3);
        let told = |fault: RadarFault| {
            let radars = radars("detection-probability = 1.0", 1).with_faults(FaultList::throughout_of(fault));
            let mut pair = radars.with_program();
            let mut told = Vec::new();
            for step in 0..20_i64 {
                let number = u64::try_from(step).unwrap();
                let others = [car(38.0)];
                let scene = scene(&road, &others, CONTROL_STEP * step);
                // The tracker has a latency of three steps, the program has none.
                pair.sense([&scene, &scene], number + 3).unwrap();
                told.extend(pair.arrived(number + 3).into_iter().map(|scan| (step, scan)));
            }
            told
        };
        let usual = told(RadarFault::default());
        assert_eq!(usual.len(), 20, "ten scans of each radar");
        assert!(usual.iter().all(|(step, scan)| CONTROL_STEP * *step == scan.time && scan.detections.len() == 1));
        let late = told(RadarFault { delay_s: 0.2, side: Some(Side::Left), ..RadarFault::default() });
        let left: Vec<_> = late.iter().filter(|(_, scan)| scan.side == Side::Left).collect();
        assert_eq!((left.len(), late.len()), (8, 18));
        assert!(left.iter().all(|(step, scan)| CONTROL_STEP * (*step - 5) == scan.time));
        let dead = told(RadarFault { is_dead: true, side: Some(Side::Right), ..RadarFault::default() });
        assert!(dead.len() == 10 && dead.iter().all(|(_, scan)| scan.side == Side::Left));
    }

    #[test]
    fn another_vehicle_changes_no_error_of_the_first() {
        let road = Road::straight(3);
        let other = with_speed(scene_vehicle(2, VehicleClass::Car, EGO_S_M - 30.0, OWN_LANE_M - 3.75), 30.0);
        // The angle tells the two apart.
        let text = "azimuth-sd-deg = 0.1";
        let [alone, _] = detections(&mut radars(text, 9), &road, &[car(38.0)], 200);
        let [both, _] = detections(&mut radars(text, 9), &road, &[car(38.0), other], 200);
        let of_car: Vec<_> = both.into_iter().filter(|detection| detection.azimuth_rad > 0.0).collect();
        assert_eq!(alone, of_car);
    }

    #[test]
    fn a_mirrored_scene_has_mirrored_errors() {
        let road = Road::straight(3);
        let mirrored_car = with_speed(scene_vehicle(1, VehicleClass::Car, EGO_S_M - 50.0, OWN_LANE_M - 3.75), 38.0);
        let [left, _] = detections(&mut radars("", 9), &road, &[car(38.0)], 100);
        let [_, right] = detections(&mut radars("", 9), &road.mirrored().unwrap(), &[mirrored_car], 100);
        assert_eq!(left.len(), right.len());
        for (left, right) in left.iter().zip(&right) {
            assert!((left.azimuth_rad + right.azimuth_rad).abs() < 1e-12, "{left:?} {right:?}");
            assert!((left.range_m - right.range_m).abs() < 1e-9 && (left.radial_mps - right.radial_mps).abs() < 1e-9);
        }
    }

    #[test]
    fn a_dead_a_blocked_and_a_dirty_radar_detect_what_they_still_can() {
        let road = Road::straight(3);
        let seen = |fault: RadarFault| {
            let list = FaultList::throughout_of(fault);
            let mut radars = radars("detection-probability = 1.0", 1).with_faults(list);
            let counts = detections(&mut radars, &road, &[car(38.0)], 100).map(|all| all.len());
            (counts, radars.health())
        };
        let usual = RadarFault::default();
        assert_eq!(seen(usual), ([100, 100], Health::Ok));
        assert_eq!(seen(RadarFault { is_dead: true, ..usual }), ([0, 0], Health::Failed));
        assert_eq!(seen(RadarFault { is_dead: true, side: Some(Side::Left), ..usual }), ([0, 100], Health::Degraded));
        // The car is 45 m behind, 3 m to the left.
        let blocked = |from_deg, to_deg| RadarFault::default().with_blocked(from_deg, to_deg);
        assert_eq!(seen(blocked(0.0, 10.0)), ([0, 0], Health::Ok));
        assert_eq!(seen(blocked(-10.0, 0.0)), ([100, 100], Health::Ok));
        // The range of 90 m falls to 36 m, or to 54 m.
        assert_eq!(seen(RadarFault { range_share: 0.4, ..usual }), ([0, 0], Health::Degraded));
        assert_eq!(seen(RadarFault { range_share: 0.6, ..usual }), ([100, 100], Health::Ok));
        let ([left, _], _) = seen(RadarFault { dropout: 0.5, ..usual });
        assert!((30..=70).contains(&left), "{left}");
    }
}
