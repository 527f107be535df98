//! The observer that records the film of a run.

use closecall_controllers::{CheckedDriver, EgoSettings};
use closecall_sensors::lidar::RearLidar;
use closecall_sensors::{Detection, NoiseKey, RadarReturn, SensorMode};
use closecall_studies::attribution::Motion;
use closecall_traffic::{Time, VehicleState};

use super::knowledge::rear_seen;
use super::{Film, FilmActor, Frame, Level, Limit, Part, Scan};
use closecall_scenarios::Scenario;
use closecall_scenarios::causal::VehicleLetters;
use closecall_scenarios::outcome::{Outcome, Phase};
use closecall_simulation::{Arm, CONTROL_STEP, Observer, RunEvent, RunKey, StepView};

/// Gravitational acceleration (m/s²). Its product with the friction coefficient is the largest
/// deceleration that the road allows.
const GRAVITY_MPS2: f64 = 9.81;

// A run has more than a million LiDAR points, so a film keeps only some of its scans: sparse ones
// throughout, dense ones in the critical and the overtaking phase up to a maximum number, and
// always the scan nearest to the smallest rear headway. The dense ones lack the bare road: the
// simulation traces none of it, and adding it costs more than a control step.

/// Number of frames between two pairs of kept scans, one of each side of the mirror, in all phases.
const SPARSE_SCAN_INTERVAL: usize = 400;
/// Number of frames between two kept scans in the critical and the overtaking phase.
const DENSE_SCAN_INTERVAL: usize = 5;
/// Maximum number of dense scans in a film.
const MAX_DENSE_SCANS: usize = 24;

/// Observes a run and records its film.
pub struct FilmRecorder {
    film: Film,
    /// The scenario and the run, for the other driver in the place of the ego.
    run: (Scenario, RunKey),
    motion: Motion,
    dense_scan_count: usize,
    /// The kept scans of each LiDAR: the number of new scans until the next kept one in all phases,
    /// and whether to keep the next scan of the two phases.
    due: Vec<(usize, bool)>,
    /// The smallest rear headway in the critical phase so far (s).
    smallest_s: f64,
    /// The index of its frame, with the LiDARs that have a scan then.
    closest: Option<(usize, Vec<KeptLidar>)>,
}

/// A LiDAR with its latest scan, which is completed if the film keeps it.
struct KeptLidar {
    name: &'static str,
    /// Whether the LiDAR is the first one that looks back.
    is_main: bool,
    looks_ahead: bool,
    lidar: RearLidar,
    detections: Vec<Detection>,
}

impl FilmRecorder {
    /// Creates a recorder for one run.
    pub fn new(scenario: &Scenario, key: RunKey, arm: &Arm, level: Level) -> Self {
        let name = arm.controller.name();
        let sensors = match arm.sensors {
            Some(mode) => scenario.sensors.with_mode(mode),
            None => scenario.sensors,
        };
        let actors = scenario.actors.iter().map(|actor| actor.id.clone()).collect();
        let noise_key = NoiseKey { seed: key.seed, sample: key.sample, ego: scenario.ego_id().clone(), actors };
        let lead_and_rear = scenario.lead_and_rear();
        let film_actor = |(index, actor): (usize, &closecall_scenarios::Actor)| FilmActor {
            name: actor.id.to_string(),
            vehicle: scenario.vehicle(index, key),
            present_frames: 0..usize::MAX,
            part: Part::of_index(index, scenario.ego, lead_and_rear),
            is_plotted: true,
        };
        let film = Film {
            title: format!("{} · {name} · seed {} · sample {}", scenario.name, key.seed, key.sample),
            arm: name.to_owned(),
            has_mis: stack(scenario).is_some_and(|stack| stack.mis().is_some()),
            level,
            period: CONTROL_STEP,
            road: scenario.road.clone(),
            environment: scenario.environment,
            actors: scenario.actors.iter().enumerate().map(film_actor).collect(),
            ego: scenario.ego,
            frames: Vec::new(),
            happenings: Vec::new(),
            notes: Vec::new(),
            acceleration_limits: limits(scenario, arm),
            cameras: match sensors.mode() == SensorMode::Full && level == Level::Full {
                true => sensors.rear_cameras().map(|camera| (*camera, noise_key.clone())).collect(),
                false => Vec::new(),
            },
            outcome: None,
            avoidable: Vec::new(),
            letters: VehicleLetters::of(scenario),
            faults: sensors.stated_faults(),
            goal_s: arm.goal_s(scenario),
            highlight: None,
            foreword: String::new(),
            settings: Vec::new(),
        };
        let (run, motion) = ((scenario.clone(), key), Motion::default());
        Self { film, run, motion, dense_scan_count: 0, due: Vec::new(), smallest_s: f64::INFINITY, closest: None }
    }

    /// Completes the film with the outcome of the run.
    #[must_use]
    pub fn finish(self, outcome: &Outcome) -> Film {
        let mut film = self.film;
        let frame_count = film.frames.len();
        for actor in &mut film.actors {
            actor.present_frames.end = frame_count;
        }
        film.outcome = Some(outcome.clone());
        let (scenario, key) = &self.run;
        film.avoidable = self.motion.avoidable(outcome, scenario, *key);
        film.mark_relevant();
        if let Some((index, lidars)) = self.closest
            && let Some(frame) = film.frames.get_mut(index)
        {
            frame.other_scans.clear();
            for KeptLidar { name, is_main, looks_ahead, lidar, detections } in lidars {
                let scan = Scan::completed(&lidar, &detections);
                match is_main {
                    true => frame.scan = scan,
                    false => frame.other_scans.extend(scan.map(|scan| (name, scan.in_ego_frame(looks_ahead)))),
                }
            }
        }
        film
    }

    /// Returns the scans of a control step that the film keeps: the scan of the first rear LiDAR,
    /// and the scans of the others.
    fn scans(&mut self, view: &StepView<'_>) -> (Option<Scan>, Vec<(&'static str, Scan)>) {
        if self.film.level < Level::Full {
            return (None, Vec::new());
        }
        let index = self.film.frames.len();
        let is_eventful =
            matches!(view.phase, Phase::Critical | Phase::Overtaking) && index.is_multiple_of(DENSE_SCAN_INTERVAL);
        let is_dense = is_eventful && self.dense_scan_count < MAX_DENSE_SCANS;
        self.dense_scan_count += usize::from(is_dense);
        let lidars = view.perception.lidars();
        self.due.resize(lidars.len(), (0, false));
        let first_rear = lidars.iter().position(|lidar| !lidar.looks_ahead);
        let (mut main, mut others) = (None, Vec::new());
        for (at, lidar) in lidars.iter().enumerate() {
            let due = &mut self.due[at];
            // Two successive scans show both sides of the mirror.
            *due = (if index.is_multiple_of(SPARSE_SCAN_INTERVAL) { 2 } else { due.0 }, due.1 || is_dense);
            // A sensor below the rate of the control loop has no new scan in some steps.
            if lidar.lidar.latest().end != view.time {
                continue;
            }
            let (sparse, dense) = std::mem::take(due);
            due.0 = sparse.saturating_sub(1);
            let scan = match (sparse > 0, dense) {
                (true, _) => Scan::completed(lidar.lidar, lidar.detections),
                (false, true) => Some(Scan::of(lidar.lidar, lidar.detections)),
                (false, false) => None,
            };
            if first_rear == Some(at) {
                main = scan;
            } else {
                others.extend(scan.map(|scan| (lidar.name, scan.in_ego_frame(lidar.looks_ahead))));
            }
        }
        let has_new = |at: usize| lidars[at].lidar.latest().end == view.time;
        if first_rear.is_some_and(has_new)
            && let Ok(thw_s) = view.margins.thw_rear_s
            && is_eventful
            && view.phase == Phase::Critical
            && thw_s < self.smallest_s
        {
            self.smallest_s = thw_s;
            let kept = |at: usize| KeptLidar {
                name: lidars[at].name,
                is_main: first_rear == Some(at),
                looks_ahead: lidars[at].looks_ahead,
                lidar: lidars[at].lidar.clone(),
                detections: lidars[at].detections.to_vec(),
            };
            self.closest = Some((index, (0..lidars.len()).filter(|at| has_new(*at)).map(kept).collect()));
        }
        (main, others)
    }
}

/// Returns the ego stack of a scenario.
fn stack(scenario: &Scenario) -> Option<&EgoSettings> {
    match &scenario.actors[scenario.ego].driver {
        CheckedDriver::Ego(settings) => Some(settings),
        CheckedDriver::Human(_) => None,
    }
}

/// Returns the comfort limit of the MIS, if the arm has one, and the friction limit.
fn limits(scenario: &Scenario, arm: &Arm) -> Vec<Limit> {
    let mut limits = Vec::new();
    if let Some(mis) = arm.mis(scenario) {
        limits.push(Limit { name: "MIS comfort limit".to_owned(), value: -mis.max_deceleration_mps2 });
    }
    let friction_mps2 = -GRAVITY_MPS2 * scenario.environment.friction;
    limits.push(Limit { name: "friction limit".to_owned(), value: friction_mps2 });
    limits
}

impl Observer for FilmRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        let keeps_objects = self.film.level >= Level::Objects;
        let keeps_images = self.film.level >= Level::Full;
        let (scan, other_scans) = self.scans(view);
        let radars = view.perception.rear_radars();
        self.film.frames.push(Frame {
            time: view.time,
            states: view.vehicles.iter().map(|vehicle| vehicle.state).collect(),
            pitches_rad: view.vehicles.iter().map(|vehicle| vehicle.pitch_rad).collect(),
            margins: *view.margins,
            tracks: if keeps_objects { view.tracks.to_vec() } else { Vec::new() },
            rear_seen: rear_seen(view.tracks, view.vehicles, self.film.ego),
            command: Some(*view.command),
            phase: Some(view.phase),
            health: Some(view.perception.health()),
            alarms: view.perception.alarms(),
            rear_fields: if keeps_objects { view.perception.rear_fields() } else { Vec::new() },
            scan,
            other_scans,
            radar_health: radars.map(|radars| radars.health),
            radar_returns: radars
                .filter(|radars| keeps_objects && radars.time == Some(view.time))
                .map(|radars| radars.returns.map(<[RadarReturn]>::to_vec)),
            rear_images: match keeps_images {
                true => {
                    let images = view.perception.rear_images().into_iter();
                    images.filter(|image| image.time == view.time).cloned().collect()
                }
                false => Vec::new(),
            },
            failed_cameras: view.perception.failed_cameras().to_vec(),
        });
    }

    fn event(&mut self, time: Time, event: &RunEvent) {
        self.film.happenings.push((time, event.clone()));
        self.motion.event(time, event);
    }

    fn moved(&mut self, time: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        self.motion.moved(time, vehicles);
    }
}
