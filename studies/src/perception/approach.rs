//! One approach: a vehicle comes from behind, and the sensors watch it.

use closecall_sensors::{Health, NoiseKey, Perception, Scene, SceneVehicle, SensorError, Sensors, TrackAudit};
use closecall_traffic::{
    ActorId, CONTROL_STEP, Road, Source, StandardNormal, Stream, Track, TrackStatus, Vehicle, VehicleClass,
    VehicleState, maths, stream,
};
use rand::RngExt;
use rand::distr::Distribution;

use crate::perception::cases::{Case, ego_lane};

pub(crate) mod watching;

/// Speed of the ego (m/s).
const EGO_MPS: f64 = 30.0;
/// Position of the ego along the road at the start (m).
const EGO_S_M: f64 = 1_000.0;
/// Gap from the front of the approaching vehicle to the rear of the ego, at the start and at the
/// end (m).
pub const GAPS_M: [f64; 2] = [150.0, 5.0];
/// Closing speeds (m/s): 10 to 50 km/h, as in the scenarios of the library.
const CLOSING_MPS: [f64; 2] = [2.8, 13.9];
/// Standard deviation of the lateral position of a vehicle whose first track is looked for (m): the
/// lane keeping of the rear vehicles in the library. A vehicle that is always in line with the
/// sensor is struck at the same heights and edges in every approach.
const LANE_KEEPING_M: f64 = 0.2;
/// Distance beyond the visibility from which on an approach in fog is watched (m).
const BEFORE_VISIBLE_M: f64 = 30.0;
/// Gap of the car in between (m).
const SCREEN_GAP_M: f64 = 25.0;
/// Gap at which a vehicle appears for the time to confirm (m), and the longest time that is waited
/// (steps).
pub const APPEARS_AT_M: f64 = 40.0;
const WAIT_STEPS: i64 = 100;
/// Time at which it appears (steps): 6 s.
const APPEARS_AFTER_STEPS: i64 = 150;
/// Distance beyond which a track and a vehicle do not belong together (m): the cut-off of GOSPA, a
/// usual value for vehicles.
const CUTOFF_M: f64 = 5.0;

/// The observation of one control step.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// True gap from the front of the vehicle to the ego's rear (m).
    pub gap_m: f64,
    /// The confirmed track of the vehicle, if there is one.
    pub tracked: Option<Tracked>,
    /// Generalised optimal sub-pattern assignment metric of all confirmed rear tracks (m):
    /// Rahmathullah, García-Fernández and Svensson (2017), with p = 2 and α = 2.
    pub gospa_m: f64,
}

/// The error of a track.
#[derive(Clone, Copy, Debug)]
pub struct Tracked {
    /// Errors of the position of the front along the road, and of the position across it (m).
    pub position_m: [f64; 2],
    /// Error of the speed over ground (m/s).
    pub speed_mps: f64,
    /// Whether the most probable class is the true one.
    pub is_class_right: bool,
    /// Score of the most probable class.
    pub confidence: f64,
}

/// The observations of one approach.
#[derive(Clone, Debug, Default)]
pub struct Approach {
    /// Every control step from the first gap on.
    pub observations: Vec<Observation>,
    /// Normalised squared errors of the tracks that belong to a vehicle; 4 on average if their
    /// covariance is right.
    pub nees: Vec<f64>,
    /// Number of steps in which the ego knew that its rear sensors had failed.
    pub failed_steps: u64,
    /// Number of times that the track of a vehicle changed its id.
    pub id_switches: u64,
    /// Number of confirmed tracks that belonged to no vehicle, and were classified as one.
    pub false_tracks: u64,
    /// Time from the appearance of a vehicle until its track is confirmed (s); `None` if it was not
    /// within 4 s.
    pub confirmed_after_s: Option<f64>,
}

/// The place of an approach in the study.
#[derive(Clone, Copy, Debug)]
pub struct Address {
    /// The seed of the study.
    pub seed: u64,
    /// The number of the approach, the same in all cases.
    pub run: u64,
}

/// Runs one approach of a case.
///
/// # Errors
/// [`SensorError`] if a sensor model fails.
pub fn approach(case: &Case, sensors: &Sensors, road: &Road, at: Address) -> Result<Approach, SensorError> {
    let ego_id = ego_name();
    let mut rng = stream(at.seed, at.run, &ego_id, "approach");
    let mut approach = drive(case, sensors, road, at, &mut rng)?;
    approach.confirmed_after_s = time_to_confirm(case, sensors, road, at)?;
    Ok(approach)
}

#[expect(clippy::unwrap_used, reason = "a legal name")]
fn ego_name() -> ActorId {
    ActorId::new("ego").unwrap()
}

/// The ego, the vehicle that approaches, and the vehicle in between.
struct Traffic {
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
}

impl Traffic {
    fn new(case: &Case, road: &Road, gap_m: f64, closing_mps: f64) -> Self {
        let ego_d_m = road.lane_centre_m(ego_lane(road), 0.0);
        let vehicle = |actor, class, s_m, d_m, speed_mps| SceneVehicle {
            actor,
            vehicle: Vehicle::typical(class),
            state: VehicleState { s_m, d_m, speed_mps, ..VehicleState::default() },
            pitch_rad: 0.0,
        };
        let ego = vehicle(0, VehicleClass::Car, EGO_S_M, ego_d_m, EGO_MPS);
        let ego = SceneVehicle { pitch_rad: case.ego_pitch_rad, ..ego };
        let behind = |actor, class, gap_m: f64, offset_m: f64, speed_mps| {
            let half_m = 0.5 * Vehicle::typical(class).dimensions.length_m;
            let s_m = EGO_S_M - 0.5 * ego.vehicle.dimensions.length_m - gap_m - half_m;
            vehicle(actor, class, s_m, ego_d_m + offset_m, speed_mps)
        };
        let mut target = behind(1, case.class, gap_m, case.offset_m, EGO_MPS + closing_mps);
        let appearance = &mut target.vehicle.appearance;
        (appearance.paint_reflectivity, appearance.plate) = (case.paint, case.plate);
        if let Some(shape) = case.shape {
            // As for a vehicle of a fleet, the other dimensions stay as they are.
            appearance.body_shape = shape;
            target.vehicle.dimensions.height_m = shape.usual_dimensions().height_m;
        }
        let screen = case.is_screened.then(|| behind(2, VehicleClass::Car, SCREEN_GAP_M, 0.0, EGO_MPS));
        Self { ego, others: std::iter::once(target).chain(screen).collect() }
    }

    fn advance(&mut self) {
        for vehicle in self.others.iter_mut().chain([&mut self.ego]) {
            vehicle.state.s_m += vehicle.state.speed_mps * CONTROL_STEP.s();
        }
    }

    fn front_x_m(&self, vehicle: &SceneVehicle) -> f64 {
        vehicle.state.s_m + 0.5 * vehicle.vehicle.dimensions.length_m - self.ego.state.s_m
    }

    fn gap_m(&self) -> f64 {
        -self.front_x_m(&self.others[0]) - 0.5 * self.ego.vehicle.dimensions.length_m
    }

    /// Returns position of the front, and lateral position, relative to the ego, of each other
    /// vehicle (m).
    fn truths_m(&self) -> Vec<[f64; 2]> {
        self.others.iter().map(|other| [self.front_x_m(other), other.state.d_m - self.ego.state.d_m]).collect()
    }
}

fn build(sensors: &Sensors, at: Address) -> Result<Box<dyn Perception>, SensorError> {
    sensors.build(&NoiseKey { seed: at.seed, sample: at.run, ego: ego_name(), actors: [].into() })
}

fn drive(case: &Case, sensors: &Sensors, road: &Road, at: Address, rng: &mut Stream) -> Result<Approach, SensorError> {
    let [from, to] = CLOSING_MPS;
    let closing_mps = from + (to - from) * rng.random::<f64>();
    // The offset varies the distances at which each side of the alternating mirror scans the
    // vehicle.
    let start_m = GAPS_M[0] + closing_mps * 2.0 * CONTROL_STEP.s() * rng.random::<f64>();
    let traffic = Traffic::new(case, road, start_m, closing_mps);
    observe(case, road, traffic, &mut *build(sensors, at)?)
}

/// Observes an approach of these vehicles with this perception.
fn observe(
    case: &Case,
    road: &Road,
    mut traffic: Traffic,
    perception: &mut dyn Perception,
) -> Result<Approach, SensorError> {
    let mut audit = TrackAudit::default();
    let mut approach = Approach::default();
    // A vehicle in the way is not driven through.
    let last_m = if case.is_screened { SCREEN_GAP_M + 10.0 } else { GAPS_M[1] };
    for step in 0.. {
        let gap_m = traffic.gap_m();
        if gap_m < last_m {
            break;
        }
        let scene = Scene {
            time: CONTROL_STEP * step,
            road,
            environment: &case.environment,
            ego: traffic.ego,
            others: &traffic.others,
        };
        let tracks = perception.step(&scene)?;
        audit.observe(tracks, &scene)?;
        let confirmed: Vec<&Track> = confirmed(tracks).collect();
        let truths_m = traffic.truths_m();
        approach.observations.push(Observation {
            gap_m,
            tracked: nearest(&confirmed, truths_m[0]).map(|track| errors(track, truths_m[0], &traffic.others[0])),
            gospa_m: gospa_m(&truths_m, &confirmed),
        });
        approach.failed_steps += u64::from(perception.health().rear == Health::Failed);
        traffic.advance();
    }
    approach.id_switches = audit.id_switches;
    approach.false_tracks = audit.false_tracks() as u64;
    approach.nees = audit.nees;
    Ok(approach)
}

/// An approach that is followed from the first gap on.
struct Course<'a> {
    case: &'a Case,
    sensors: &'a Sensors,
    road: &'a Road,
    /// The approach whose movement it has.
    at: Address,
    /// The approach whose noise of the sensors it has.
    noise: Address,
    /// Standard deviation of the lateral position of the vehicle (m).
    lane_keeping_m: f64,
    /// The first gap (m).
    from_m: f64,
}

/// Drives an approach, and calls `see` with the gap (m), the confirmed track, and the traffic in
/// each step, until `see` returns false.
fn follow(course: &Course<'_>, mut see: impl FnMut(f64, Option<&Track>, &Traffic) -> bool) -> Result<(), SensorError> {
    let Course { case, sensors, road, at, noise, lane_keeping_m, from_m } = *course;
    let mut rng = stream(at.seed, at.run, &ego_name(), "approach");
    let [slowest, fastest] = CLOSING_MPS;
    let closing_mps = slowest + (fastest - slowest) * rng.random::<f64>();
    let start_m = from_m + closing_mps * 2.0 * CONTROL_STEP.s() * rng.random::<f64>();
    let deviation: f64 = StandardNormal.sample(&mut rng);
    let case = &Case { offset_m: case.offset_m + lane_keeping_m * deviation, ..case.clone() };
    let mut traffic = Traffic::new(case, road, start_m, closing_mps);
    let mut perception = build(sensors, noise)?;
    for step in 0.. {
        let gap_m = traffic.gap_m();
        let time = CONTROL_STEP * step;
        let scene = Scene { time, road, environment: &case.environment, ego: traffic.ego, others: &traffic.others };
        let tracks = perception.step(&scene)?;
        let confirmed: Vec<&Track> = confirmed(tracks).collect();
        if gap_m < GAPS_M[1] || !see(gap_m, nearest(&confirmed, traffic.truths_m()[0]), &traffic) {
            break;
        }
        traffic.advance();
    }
    Ok(())
}

/// The gaps of an approach at which a vehicle has a track that a function can act on: confirmed, and
/// existing at least as likely as not (m). A gap that is never reached is the gap at the end of the
/// approach.
///
/// ```text
///   ego ▕ track, but for short losses ▏ track at some gaps ▏ no track
///       5                          lasting               first
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sightings {
    /// The first gap with a track.
    pub(crate) first_m: f64,
    /// The gap from which on the track is never lost for more than [`LONGEST_LOSS_STEPS`].
    pub(crate) lasting_m: f64,
    /// The first gap, not beyond `lasting_m`, at which the track is classified as a vehicle.
    pub(crate) classified_m: f64,
    /// Length of the gaps between `lasting_m` and `first_m` with a track.
    pub(crate) beyond_m: f64,
}

/// Longest loss of a track that lasts (steps): 0.48 s. The function in the library tolerates 0.5 s.
const LONGEST_LOSS_STEPS: u32 = 12;
/// Share of the gap from which on a track lasts at which the approach ends (-): an assumption. Where
/// the gap is so much smaller, the received power is nearly three times as large.
const SETTLED_SHARE: f64 = 0.6;

/// The watch of an approach.
struct Watch {
    sightings: Sightings,
    /// Number of latest steps without a track.
    missed: u32,
    /// The gap of the step before (m).
    last_m: f64,
}

impl Watch {
    fn new() -> Self {
        let [_, end_m] = GAPS_M;
        let sightings = Sightings { first_m: end_m, lasting_m: end_m, classified_m: end_m, beyond_m: 0.0 };
        Self { sightings, missed: LONGEST_LOSS_STEPS + 1, last_m: end_m }
    }

    /// Adds a step at this gap (m). `track` tells whether there is a track, and whether it is
    /// classified as a vehicle.
    fn observe(&mut self, gap_m: f64, track: Option<bool>) {
        let [_, end_m] = GAPS_M;
        let Sightings { first_m, lasting_m, classified_m, beyond_m } = &mut self.sightings;
        let Some(is_classified) = track else {
            self.missed = self.missed.saturating_add(1);
            return;
        };
        *first_m = first_m.max(gap_m);
        if self.missed > LONGEST_LOSS_STEPS {
            // The track before was one of those beyond.
            *beyond_m += if *lasting_m > end_m { *lasting_m - self.last_m } else { 0.0 };
            (*lasting_m, *classified_m) = (gap_m, end_m);
        }
        if is_classified {
            *classified_m = classified_m.max(gap_m);
        }
        (self.missed, self.last_m) = (0, gap_m);
    }

    /// Returns whether the track has lasted, and been classified, for so long that nothing will
    /// change at this gap (m) and below.
    fn is_settled(&self, gap_m: f64) -> bool {
        let [_, end_m] = GAPS_M;
        self.missed == 0 && self.sightings.classified_m > end_m && gap_m < SETTLED_SHARE * self.sightings.lasting_m
    }
}

/// Returns the first gap of an approach (m). In fog, no vehicle is seen from farther than the
/// visibility, and each step there costs twenty times as much as in clear air.
fn first_gap_m(case: &Case) -> f64 {
    let [far_m, _] = GAPS_M;
    far_m.min(case.environment.visibility_m + BEFORE_VISIBLE_M)
}

/// Returns the gaps at which the vehicle has a track, in an approach with the noise of another one.
///
/// # Errors
/// [`SensorError`] if a sensor model fails.
pub(crate) fn sightings(
    case: &Case,
    sensors: &Sensors,
    road: &Road,
    at: Address,
    noise: Address,
) -> Result<Sightings, SensorError> {
    let mut watch = Watch::new();
    let course = Course { case, sensors, road, at, noise, lane_keeping_m: LANE_KEEPING_M, from_m: first_gap_m(case) };
    follow(&course, |gap_m, track, _| {
        let track = track.filter(|track| track.existence >= 0.5).map(|track| track.class.is_vehicle());
        watch.observe(gap_m, track);
        !watch.is_settled(gap_m)
    })?;
    Ok(watch.sightings)
}

/// Returns the scores of the true class between two gaps (m).
///
/// # Errors
/// [`SensorError`] if a sensor model fails.
pub(crate) fn scores(
    case: &Case,
    sensors: &Sensors,
    road: &Road,
    at: Address,
    [near_m, far_m]: [f64; 2],
) -> Result<Vec<f64>, SensorError> {
    let mut scores = Vec::new();
    // The track has settled when the vehicle reaches the gaps.
    let course = Course { case, sensors, road, at, noise: at, lane_keeping_m: 0.0, from_m: far_m + 20.0 };
    follow(&course, |gap_m, track, _| {
        scores.extend(track.filter(|_| gap_m <= far_m).map(|track| track.class.0[case.class as usize]));
        gap_m >= near_m
    })?;
    Ok(scores)
}

/// Returns the time until a vehicle that appears at [`APPEARS_AT_M`] has a confirmed track (s).
fn time_to_confirm(case: &Case, sensors: &Sensors, road: &Road, at: Address) -> Result<Option<f64>, SensorError> {
    let case = Case { is_screened: false, ..case.clone() };
    let mut traffic = Traffic::new(&case, road, APPEARS_AT_M, 0.0);
    let mut perception = build(sensors, at)?;
    for step in 0..WAIT_STEPS {
        // A fault of the studied scenario has begun by then.
        let time = CONTROL_STEP * (APPEARS_AFTER_STEPS + step);
        let scene = Scene { time, road, environment: &case.environment, ego: traffic.ego, others: &traffic.others };
        let tracks = perception.step(&scene)?;
        let confirmed: Vec<&Track> = confirmed(tracks).collect();
        if nearest(&confirmed, traffic.truths_m()[0]).is_some() {
            return Ok(Some((CONTROL_STEP * step).s()));
        }
        traffic.advance();
    }
    Ok(None)
}

/// Returns the rear tracks that a controller may act on.
pub(crate) fn confirmed(tracks: &[Track]) -> impl Iterator<Item = &Track> {
    tracks.iter().filter(|track| track.source == Source::Rear && track.status != TrackStatus::Tentative)
}

/// Returns front and lateral position of a track (m).
fn position_m(track: &Track) -> [f64; 2] {
    [track.x_m() + 0.5 * track.length_m, track.y_m()]
}

fn distance_m([x, y]: [f64; 2], [to_x, to_y]: [f64; 2]) -> f64 {
    maths::hypot(x - to_x, y - to_y)
}

/// Returns the nearest track within the cut-off.
pub(crate) fn nearest<'a>(tracks: &[&'a Track], truth_m: [f64; 2]) -> Option<&'a Track> {
    let apart_m = |track: &Track| distance_m(position_m(track), truth_m);
    let nearest = tracks.iter().min_by(|a, b| apart_m(a).total_cmp(&apart_m(b)))?;
    (apart_m(nearest) <= CUTOFF_M).then_some(*nearest)
}

pub(crate) fn errors(track: &Track, truth_m: [f64; 2], vehicle: &SceneVehicle) -> Tracked {
    let at_m = position_m(track);
    let (best, confidence) = (0..track.class.0.len())
        .map(|class| (class, track.class.0[class]))
        .fold((0, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best });
    Tracked {
        position_m: [at_m[0] - truth_m[0], at_m[1] - truth_m[1]],
        speed_mps: track.vx_mps() - vehicle.state.speed_mps,
        is_class_right: best == vehicle.vehicle.class as usize,
        confidence,
    }
}

/// Returns the GOSPA metric: the least over all assignments of √(Σ d² + c²/2 · (missed + false))
/// (m).
fn gospa_m(truths_m: &[[f64; 2]], tracks: &[&Track]) -> f64 {
    let mut free: Vec<[f64; 2]> = tracks.iter().map(|track| position_m(track)).collect();
    least_m2(truths_m, &mut free).sqrt()
}

/// Returns the least sum of squares, by trying each assignment: there are one or two vehicles.
fn least_m2(truths_m: &[[f64; 2]], free: &mut Vec<[f64; 2]>) -> f64 {
    let alone_m2 = 0.5 * CUTOFF_M * CUTOFF_M;
    let Some((first, rest)) = truths_m.split_first() else { return alone_m2 * free.len() as f64 };
    let mut least = alone_m2 + least_m2(rest, free);
    for index in 0..free.len() {
        let apart_m = distance_m(free[index], *first);
        if apart_m < CUTOFF_M {
            let taken = free.swap_remove(index);
            least = least.min(apart_m * apart_m + least_m2(rest, free));
            free.push(taken);
            let last = free.len() - 1;
            free.swap(index, last);
        }
    }
    least
}

#[cfg(test)]
mod tests;
