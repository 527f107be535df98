//! A flight over traffic: pictures of each instant, detections, and trajectory data from them.

use std::borrow::Cow;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::filters::{PERIOD, smooth};
use crate::lane_change::detect;
use crate::trajectory_data::{Carriageways, TrajectoryData};
use closecall_sensors::camera::Backend;
use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::{
    ActorId, BodyShape, Dimensions, Lane, Stream, Time, Trajectory, TrajectoryPoint, Vehicle, VehicleClass, stream,
};
use closecall_traffic::{StandardNormal, maths};
use rand::RngExt;
use rayon::prelude::*;
use serde::Serialize;

use crate::aerial::camera::{ALTITUDE_M, AerialCamera, OFF_NADIR_RAD, View};
use crate::aerial::detector::{DETECTED_FROM, Detector, ImageDetection};
use crate::aerial::error::AerialError;
use crate::aerial::footage::Footage;
use crate::aerial::footprint::{ExpectedSize, corrected, raw, silhouette};
use crate::aerial::ground::Ground;
use crate::aerial::picture::{AerialPicture, AerialScene, GroundVehicle, Light, exact_boxes};
use crate::aerial::tracker::{AerialTrack, GroundDetection, track};

/// Time between two pictures of [`Footage::Strip`]: every second one of a video of 25 Hz, as highD
/// has it.
pub const FRAME: Time = Time::from_ms(80);
/// Assumption: standard deviation, along each axis, of the constant error of georeferencing by
/// control points (m). Published errors of all causes together are 0.1 m (highD) and 0.2 m (Kruber
/// et al.).
const OFFSET_SIGMA_M: f64 = 0.1;
/// Assumption: standard deviation, along each axis, of what stabilisation leaves from picture to
/// picture (m): a quarter of a pixel.
const JITTER_SIGMA_M: f64 = 0.03;
/// Most lanes that a picture can show.
const MOST_LANES: u8 = 8;
/// Margin by which a vehicle has to be within the picture, so that it counts as watched (px).
const MARGIN_PX: f64 = 40.0;

/// Standard deviations of the width of a detected box on the ground (m), of cars and of trucks.
/// They are measured on 160 pictures of the training set at 11 to 34° from the nadir, against the
/// exact boxes (1.48 median absolute deviations of 426 cars and 241 trucks: 0.14 to 0.19 m and 0.28
/// to 0.32 m).
const DETECTED_WIDTH_SIGMA_M: [f64; 2] = [0.17, 0.30];

/// The boxes from which tracks are derived.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Boxes {
    /// Those that the detector finds in the pictures.
    #[default]
    Detected,
    /// The exact boxes around all vehicles in the picture, also around hidden ones: what a perfect
    /// detector would find. Errors that remain come from the geometry.
    Exact,
}

/// How the perspective bias is corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Correction {
    /// By the typical height of the class ([`corrected`]).
    #[default]
    ClassHeight,
    /// By a height that is estimated for each vehicle from its silhouette ([`silhouette`]).
    Silhouette,
}

/// The options of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FlightOptions {
    /// Altitude of the camera (m), 40 to 400.
    pub altitude_m: f64,
    /// Angle of its optical axis from the nadir (rad), 0 to 0.7.
    pub off_nadir_rad: f64,
    /// Rate and size of the pictures.
    pub footage: Footage,
    /// The boxes from which tracks are derived.
    pub boxes: Boxes,
    /// How the perspective bias is corrected.
    pub correction: Correction,
    /// Standard deviation, along each axis, of the constant error of georeferencing (m).
    pub offset_sigma_m: f64,
    /// Standard deviation, along each axis, of its error from picture to picture (m).
    pub jitter_sigma_m: f64,
    /// Time before and after each lane change that is watched (s), 2 to 1000.
    pub reach_s: f64,
    /// Seed of the errors, the paints and the ground.
    pub seed: u64,
}

impl Default for FlightOptions {
    fn default() -> Self {
        Self {
            altitude_m: ALTITUDE_M,
            off_nadir_rad: OFF_NADIR_RAD,
            footage: Footage::default(),
            boxes: Boxes::default(),
            correction: Correction::default(),
            offset_sigma_m: OFFSET_SIGMA_M,
            jitter_sigma_m: JITTER_SIGMA_M,
            reach_s: 7.0,
            seed: 0,
        }
    }
}

impl FlightOptions {
    fn check(&self) -> Result<(), AerialError> {
        for (option, value, range, allowed) in [
            ("altitude", self.altitude_m, 40.0..=400.0, "from 40 to 400 m"),
            ("off-nadir", self.off_nadir_rad.to_degrees(), 0.0..=40.0, "from 0 to 40 degrees"),
            ("time around a lane change", self.reach_s, 2.0..=1_000.0, "from 2 to 1000 s"),
            ("georeferencing offset", self.offset_sigma_m, 0.0..=5.0, "from 0 to 5 m"),
            ("georeferencing jitter", self.jitter_sigma_m, 0.0..=5.0, "from 0 to 5 m"),
        ] {
            if !range.contains(&value) {
                return Err(AerialError::Option { option, value, allowed });
            }
        }
        Ok(())
    }
}

/// The trajectory data that a flight yields.
#[derive(Clone, Debug)]
pub struct Flight {
    /// The true movement of the watched vehicles, while they are watched.
    pub truth: TrajectoryData,
    /// The tracks that the detector and the tracker derive from the pictures, with boxes as they
    /// are seen.
    pub raw: TrajectoryData,
    /// The same with the perspective bias corrected.
    pub corrected: TrajectoryData,
    /// Number of pictures.
    pub frames: usize,
    /// A picture from the middle of the flight, with the labels of its vehicles.
    pub example: AerialPicture,
}

/// Watches the traffic of `data` with a camera that follows it, on each carriageway by itself.
///
/// # Errors
/// [`AerialError`] if an option is out of range, if there is no lane change to watch, if no vehicle
/// is within a picture, or if the detector fails.
pub fn fly(data: &TrajectoryData, options: &FlightOptions, backend: &Backend) -> Result<Flight, AerialError> {
    fly_watched(data, options, backend, &|_| {})
}

/// Works like [`fly`], and reports the number of pictures that are searched, and of all.
///
/// # Errors
/// As [`fly`].
pub fn fly_watched(
    data: &TrajectoryData,
    options: &FlightOptions,
    backend: &Backend,
    progress: &(dyn Fn([u64; 2]) + Sync),
) -> Result<Flight, AerialError> {
    options.check()?;
    let period = options.footage.period();
    let roads = roads(data, options);
    let frames: usize = roads.iter().flat_map(|road| &road.spans).map(Vec::len).sum();
    let searched = AtomicU64::new(0);
    let on_picture = || progress([searched.fetch_add(1, Ordering::Relaxed) + 1, frames as u64]);
    let errors = georeferencing(options, frames)?;
    let mut errors = errors.as_slice();
    let (mut truth, mut seen, mut flat) = (Vec::new(), Vec::new(), Vec::new());
    let mut example = None;
    for (road, times) in roads.iter().flat_map(|road| road.spans.iter().map(move |times| (road, times))) {
        let Road { data, edges, .. } = road;
        let edges_m = &edges.edges_m;
        let scenes: Vec<AerialScene> = times.iter().map(|time| scene_at(data, edges_m, *time, options)).collect();
        let cameras: Vec<AerialCamera> = scenes.iter().map(|scene| camera_above(scene, edges_m, options)).collect();
        let [raw, corrected] = detections((&scenes, &cameras), options, backend, &on_picture)?;
        let (span_errors, rest) = errors.split_at(times.len());
        errors = rest;
        for (frames, all) in [(raw, &mut seen), (corrected, &mut flat)] {
            let tracks = track(&shifted(frames, span_errors), period.s());
            let first_id = all.iter().map(|track: &Trajectory| track.track_id).max().unwrap_or(0);
            all.extend(tracks.iter().map(|track| trajectory(track, first_id, [times[0], period], edges)));
        }
        truth.extend(watched(data, times, &cameras));
        let middle = times.len() / 2;
        example.get_or_insert_with(|| options.footage.picture(&scenes[middle], &cameras[middle]));
    }
    let Some(example) = example else { return Err(refused(data, "no vehicle changes lanes")) };
    if truth.is_empty() {
        return Err(refused(data, "no vehicle is within a picture: the lateral positions count from elsewhere"));
    }
    for (index, track) in truth.iter_mut().enumerate() {
        track.track_id = index as u64 + 1;
    }
    let named = |name: &str, all: Vec<Trajectory>| TrajectoryData {
        markings: data.markings.clone(),
        ..TrajectoryData::new(&format!("{}-{name}", data.name), period, all)
    };
    let (raw, corrected) = (named("aerial-raw", seen), named("aerial-corrected", flat));
    Ok(Flight { truth: named("truth", truth), raw, corrected, frames, example })
}

/// Returns the vehicles on the ground that each picture shows: as they are seen, and with the bias
/// corrected.
fn detections(
    (scenes, cameras): (&[AerialScene], &[AerialCamera]),
    options: &FlightOptions,
    backend: &Backend,
    on_picture: &(dyn Fn() + Sync),
) -> Result<[Vec<Vec<GroundDetection>>; 2], AerialError> {
    // A thread keeps its detector.
    let detect = |slot: &mut Option<Detector>, index: usize| -> Result<[Vec<GroundDetection>; 2], AerialError> {
        let detections = match options.boxes {
            Boxes::Exact => exact_detections(&scenes[index], &cameras[index]),
            Boxes::Detected => {
                let detector = match slot {
                    Some(detector) => detector,
                    None => slot.insert(Detector::shipped(backend)?),
                };
                let picture = options.footage.picture(&scenes[index], &cameras[index]);
                detector.detect(&options.footage.searched(picture.image), DETECTED_FROM)?
            }
        };
        on_picture();
        let ground = |is_corrected: bool| -> Vec<GroundDetection> {
            let all = detections.iter().filter_map(|detection| {
                let seen = raw(&cameras[index], &detection.image_box)?;
                let footprint =
                    if is_corrected { footprint(&cameras[index], &seen, detection.class, options) } else { seen };
                Some(GroundDetection { footprint, class: detection.class, score: detection.score })
            });
            all.collect()
        };
        Ok([ground(false), ground(true)])
    };
    let all: Vec<_> =
        (0..scenes.len()).into_par_iter().map_init(|| None, detect).collect::<Result<_, AerialError>>()?;
    let (seen, flat) = all.into_iter().map(|[a, b]| (a, b)).unzip();
    Ok([seen, flat])
}

/// Returns what a perfect detector would find: the exact boxes whose centres lie in the picture.
/// Motorcycles are no class of the detector.
fn exact_detections(scene: &AerialScene, camera: &AerialCamera) -> Vec<ImageDetection> {
    let [width, height] = camera.view().size_px.map(|side| side as f64);
    let detections = exact_boxes(scene, camera).into_iter().filter_map(|(index, image_box)| {
        let class = scene.vehicles[index].vehicle.class;
        let [column, row] = image_box.centre_px;
        let is_seen =
            class != VehicleClass::Motorcycle && (0.0..width).contains(&column) && (0.0..height).contains(&row);
        is_seen.then_some(ImageDetection { image_box, class, score: 1.0 })
    });
    detections.collect()
}

/// Returns the footprint of a vehicle of this class whose visible body covers the box `seen`.
fn footprint(camera: &AerialCamera, seen: &OrientedBox, class: VehicleClass, options: &FlightOptions) -> OrientedBox {
    match options.correction {
        Correction::ClassHeight => corrected(camera, seen, class.typical_dimensions().height_m),
        Correction::Silhouette => {
            let [car_m, truck_m] = DETECTED_WIDTH_SIGMA_M;
            let box_sigma_m = match (options.boxes, class) {
                (Boxes::Exact, _) => 0.0,
                (Boxes::Detected, VehicleClass::Truck) => truck_m,
                (Boxes::Detected, VehicleClass::Car | VehicleClass::Motorcycle) => car_m,
            };
            silhouette(camera, seen, &ExpectedSize::of(class).seen_with(box_sigma_m)).0
        }
    }
}

/// A carriageway, over which the camera flies by itself.
struct Road<'d> {
    /// The vehicles on it.
    data: Cow<'d, TrajectoryData>,
    edges: RoadEdges,
    /// The instants of the pictures, in spans without gaps.
    spans: Vec<Vec<Time>>,
}

/// The markings of a carriageway.
struct RoadEdges {
    /// Number of lanes to the left of the carriageway, with the unused one.
    lanes_before: u8,
    /// Positions of the markings of all lanes that have traffic (m), from the left edge on.
    edges_m: Vec<f64>,
}

/// Returns the carriageways of the traffic, which may be far apart: no picture shows two of them.
fn roads<'d>(data: &'d TrajectoryData, options: &FlightOptions) -> Vec<Road<'d>> {
    let carriageways = Carriageways::of(data.trajectories.iter());
    let road = |number: usize| {
        let mut part = Cow::Borrowed(data);
        if carriageways.count() > 1 {
            let is_on_it =
                |track: &Trajectory| track.points.first().is_some_and(|at| carriageways.at(at.d_m) == number);
            part.to_mut().trajectories.retain(is_on_it);
        }
        let (edges, spans) = (RoadEdges::of(&part, number), spans(&part, options));
        Road { data: part, edges, spans }
    };
    (0..carriageways.count()).map(road).collect()
}

/// Returns the instants of the pictures, all of them multiples of the time between two pictures:
/// those near a lane change, in spans without gaps.
fn spans(data: &TrajectoryData, options: &FlightOptions) -> Vec<Vec<Time>> {
    let mut crossings: Vec<Time> = detect(&smooth(data)).iter().map(|change| Time::from_s(change.crossing_s)).collect();
    crossings.sort();
    let reach = Time::from_s(options.reach_s);
    let recorded = data.trajectories.iter().filter_map(Trajectory::span).reduce(|(a, b), (c, d)| (a.min(c), b.max(d)));
    let Some((first, last)) = recorded.filter(|_| !crossings.is_empty()) else { return Vec::new() };
    let mut spans: Vec<Vec<Time>> = Vec::new();
    let period = options.footage.period();
    for tick in (first.ns() + period.ns() - 1).div_euclid(period.ns())..=last.ns().div_euclid(period.ns()) {
        let time = period * tick;
        if !crossings.iter().any(|crossing| (time - *crossing).ns().abs() <= reach.ns()) {
            continue;
        }
        match spans.last_mut() {
            Some(span) if span.last().is_some_and(|last| time - *last == period) => span.push(time),
            _ => spans.push(vec![time]),
        }
    }
    spans
}

fn refused(data: &TrajectoryData, reason: &str) -> AerialError {
    AerialError::Traffic { name: data.name.clone(), reason: reason.to_owned() }
}

/// Returns the state of a vehicle between two recorded instants; `None` outside of its track.
fn state_at(track: &Trajectory, time: Time) -> Option<TrajectoryPoint> {
    let right = track.points.partition_point(|point| point.time < time);
    let next = track.points.get(right)?;
    let Some(last) = right.checked_sub(1).map(|left| &track.points[left]) else {
        return (next.time == time).then_some(*next);
    };
    let share = (time - last.time).ns() as f64 / (next.time - last.time).ns() as f64;
    let mix = |a: f64, b: f64| a + share * (b - a);
    Some(TrajectoryPoint {
        time,
        s_m: mix(last.s_m, next.s_m),
        d_m: mix(last.d_m, next.d_m),
        speed_mps: mix(last.speed_mps, next.speed_mps),
        acceleration_mps2: mix(last.acceleration_mps2, next.acceleration_mps2),
        lateral_speed_mps: mix(last.lateral_speed_mps, next.lateral_speed_mps),
        lateral_acceleration_mps2: mix(last.lateral_acceleration_mps2, next.lateral_acceleration_mps2),
        lane: if share < 0.5 { last.lane } else { next.lane },
    })
}

fn scene_at(data: &TrajectoryData, edges_m: &[f64], time: Time, options: &FlightOptions) -> AerialScene {
    let present = data.trajectories.iter().filter_map(|track| Some((track, state_at(track, time)?)));
    let vehicles = present.map(|(track, point)| GroundVehicle {
        id: track.track_id,
        vehicle: body(track, options.seed),
        at_m: [point.s_m, point.d_m],
        yaw_rad: maths::atan2(point.lateral_speed_mps, point.speed_mps.max(1.0)),
        livery: None,
    });
    let ground = Ground::new(edges_m.to_vec(), options.seed);
    #[expect(clippy::cast_sign_loss, reason = "any key will do")]
    let key = options.seed ^ time.ns() as u64;
    AerialScene { ground, vehicles: vehicles.collect(), light: Light::NOON, key }
}

impl RoadEdges {
    /// Returns the markings of the carriageway with this number, counted from the left, whose traffic
    /// is `data`.
    fn of(data: &TrajectoryData, number: usize) -> Self {
        let width_m = data.markings.typical_lane_width_m();
        let lanes = || data.trajectories.iter().flat_map(|track| &track.points).map(|point| point.lane.0);
        let first = if number == 0 { 1 } else { lanes().min().unwrap_or(1).max(1) };
        let lanes_before = first - 1;
        let left_m = data.markings.left_edge_m(Lane(first)).or_else(|| {
            let right_m = data.markings.right_edge_m(Lane(first))?;
            Some(right_m + width_m)
        });
        let mut edges_m = vec![left_m.unwrap_or(0.0)];
        for lane in 1..=lanes().max().unwrap_or(1).saturating_sub(lanes_before).clamp(2, MOST_LANES) {
            let last_m = edges_m[edges_m.len() - 1];
            let edge_m = data.markings.right_edge_m(Lane(lanes_before.saturating_add(lane)));
            edges_m.push(edge_m.filter(|edge_m| *edge_m < last_m).unwrap_or(last_m - width_m));
        }
        Self { lanes_before, edges_m }
    }
}

/// Returns the body of a vehicle: a shape of its class that suits its length, with its own paint.
fn body(track: &Trajectory, seed: u64) -> Vehicle {
    let mut hash = (track.vehicle_id ^ seed.rotate_left(17)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    hash ^= hash >> 29;
    let shapes: Vec<BodyShape> = BodyShape::of_class(track.class)
        .iter()
        .copied()
        .filter(|shape| (shape.usual_dimensions().length_m / track.dimensions.length_m - 1.0).abs() < 0.3)
        .collect();
    #[expect(clippy::cast_possible_truncation, reason = "a remainder")]
    let shape = shapes.get((hash % shapes.len().max(1) as u64) as usize).copied();
    let mut vehicle = Vehicle::typical(track.class);
    vehicle.appearance.body_shape = shape.unwrap_or(BodyShape::of_class(track.class)[0]);
    let height_m = vehicle.appearance.body_shape.usual_dimensions().height_m;
    vehicle.dimensions = Dimensions { height_m, ..track.dimensions };
    let grey = u8::try_from(30 + (hash >> 8) % 200).unwrap_or(128);
    vehicle.appearance.paint_rgb = [grey; 3];
    vehicle
}

/// Returns the camera above the mean position of the vehicles, which looks at the middle of the
/// road.
fn camera_above(scene: &AerialScene, edges_m: &[f64], options: &FlightOptions) -> AerialCamera {
    let count = scene.vehicles.len().max(1) as f64;
    let s_m = scene.vehicles.iter().map(|vehicle| vehicle.at_m[0]).sum::<f64>() / count;
    let middle_m = 0.5 * (edges_m[0] + edges_m[edges_m.len() - 1]);
    // The roofs of tall vehicles lean to the left.
    let target_m = [s_m, middle_m + 0.5];
    let strip = View::beside_road(target_m, options.altitude_m, options.off_nadir_rad);
    AerialCamera::new(options.footage.view(strip))
}

/// Returns the error of georeferencing of each picture (m).
fn georeferencing(options: &FlightOptions, frames: usize) -> Result<Vec<[f64; 2]>, AerialError> {
    let mut rng = stream(options.seed, 0, &ActorId::new("ego")?, "georeferencing");
    let normal = |sigma_m: f64, rng: &mut Stream| sigma_m * rng.sample::<f64, _>(StandardNormal);
    let offset = [0, 1].map(|_| normal(options.offset_sigma_m, &mut rng));
    Ok((0..frames).map(|_| offset.map(|offset| offset + normal(options.jitter_sigma_m, &mut rng))).collect())
}

/// Returns the detections of each picture, displaced by its error of georeferencing (m).
fn shifted(mut frames: Vec<Vec<GroundDetection>>, errors_m: &[[f64; 2]]) -> Vec<Vec<GroundDetection>> {
    for (detections, [x_m, y_m]) in frames.iter_mut().zip(errors_m) {
        for detection in detections {
            detection.footprint.x_m += x_m;
            detection.footprint.y_m += y_m;
        }
    }
    frames
}

/// Returns the trajectory of a track, whose number counts on after those `before`, from the time of
/// the first picture and the time between two; lanes are those between the known markings.
fn trajectory(track: &AerialTrack, before: u64, [start, period]: [Time; 2], edges: &RoadEdges) -> Trajectory {
    let RoadEdges { lanes_before, edges_m } = edges;
    let lane_at = |d_m: f64| {
        let passed = edges_m[1..edges_m.len() - 1].iter().filter(|edge_m| d_m < **edge_m).count();
        Lane(u8::try_from(passed + 1).unwrap_or(u8::MAX).saturating_add(*lanes_before))
    };
    let point = |point: &crate::aerial::tracker::TrackPoint| TrajectoryPoint {
        time: start + period * point.frame as i64,
        s_m: point.at_m[0],
        // Positions to the left of the road are not part of a lane.
        d_m: point.at_m[1].min(edges_m[0]),
        speed_mps: point.speed_mps[0].max(0.0),
        acceleration_mps2: point.acceleration_mps2[0],
        lateral_speed_mps: point.speed_mps[1],
        lateral_acceleration_mps2: point.acceleration_mps2[1],
        lane: lane_at(point.at_m[1]),
    };
    let [length_m, width_m] = track.size_m;
    let dimensions = Dimensions { length_m, width_m, ..track.class.typical_dimensions() };
    let points = track.points.iter().map(point).collect();
    let track_id = before + track.id;
    Trajectory { track_id, vehicle_id: track_id, class: track.class, dimensions, points }
}

/// Returns the true movement of each vehicle at the instants at which it is within the picture. A
/// vehicle that leaves and comes back becomes several tracks of the same vehicle.
fn watched(data: &TrajectoryData, times: &[Time], cameras: &[AerialCamera]) -> Vec<Trajectory> {
    let mut pieces = Vec::new();
    for track in data.trajectories.iter().filter(|track| track.class != VehicleClass::Motorcycle) {
        let mut open: Vec<TrajectoryPoint> = Vec::new();
        let mut push = |points: Vec<TrajectoryPoint>| {
            if points.len() > 1 {
                pieces.push(track.with_points(points));
            }
        };
        for (time, camera) in times.iter().zip(cameras) {
            let state = state_at(track, *time).filter(|point| is_within(camera, point));
            match state {
                Some(point) => open.push(point),
                None => push(std::mem::take(&mut open)),
            }
        }
        push(open);
    }
    pieces
}

fn is_within(camera: &AerialCamera, point: &TrajectoryPoint) -> bool {
    let [width, height] = camera.view().size_px.map(|side| side as f64);
    camera
        .project([point.s_m, point.d_m, 0.0])
        .is_some_and(|[column, row]| (MARGIN_PX..width - MARGIN_PX).contains(&column) && (0.0..height).contains(&row))
}

// The criteria for lane changes use a common clock. The interval of two pictures must not be longer
// than its period.
const _: () = assert!(FRAME.ns() <= PERIOD.ns() && Footage::Published.period().ns() <= PERIOD.ns());
