//! Watches a run and keeps what it sees.

use closecall_controllers::CheckedDriver;
use closecall_sensors::camera::Pipeline;
use closecall_sensors::{NoiseKey, SensorMode};
use closecall_traffic::Time;

use super::{Film, Frame, Level, Limit, Member, Scan};
use closecall_simulation::outcome::{Outcome, Phase};
use closecall_simulation::scenario::Scenario;
use closecall_simulation::{Arm, CONTROL_STEP, Happening, Observer, RunKey, StepView};

/// Acceleration of free fall [m/s²]: friction times this is the hardest braking that the road allows.
const GRAVITY_MPS2: f64 = 9.81;

/// A run has more than a million points. One scan in so many is kept, denser ones while the vehicle behind is critically
/// close or overtakes, up to a number; and always the one at the smallest headway.
const SPARSE: usize = 50;
const DENSE: usize = 3;
const MOST_DENSE: usize = 60;

/// Watches a run and makes a film of it.
pub struct FilmRecorder {
    film: Film,
    dense_scans: usize,
    /// The smallest rear headway so far [s], with its frame and scan.
    closest: Option<(f64, usize, Scan)>,
}

impl FilmRecorder {
    /// A recorder of one run.
    pub fn new(scenario: &Scenario, key: RunKey, arm: &Arm, level: Level) -> Self {
        let name = arm.controller.name();
        let sensors = match arm.sensors {
            Some(mode) => scenario.sensors.with_mode(mode),
            None => scenario.sensors,
        };
        let sees = sensors.mode() == SensorMode::Full && sensors.camera().pipeline != Pipeline::Off;
        let member = |actor: &closecall_simulation::scenario::Actor| Member {
            name: actor.id.to_string(),
            vehicle: actor.vehicle,
            rows: 0..usize::MAX,
            is_plotted: true,
        };
        let film = Film {
            title: format!("{} · {name} · seed {} · sample {}", scenario.name, key.seed, key.sample),
            arm: name.to_owned(),
            level,
            period: CONTROL_STEP,
            road: scenario.road,
            environment: scenario.environment,
            cast: scenario.actors.iter().map(member).collect(),
            ego: scenario.ego,
            frames: Vec::new(),
            happenings: Vec::new(),
            notes: Vec::new(),
            acceleration_limits: limits(scenario, arm),
            camera: (sees && level == Level::Full).then(|| {
                let ego = scenario.ego_id().clone();
                let actors = scenario.actors.iter().map(|actor| actor.id.clone()).collect();
                (*sensors.camera(), NoiseKey { seed: key.seed, sample: key.sample, ego, actors })
            }),
            outcome: None,
            highlight: None,
            foreword: String::new(),
        };
        Self { film, dense_scans: 0, closest: None }
    }

    /// The film, once the run's outcome is known.
    #[must_use]
    pub fn finish(self, outcome: &Outcome) -> Film {
        let mut film = self.film;
        let rows = film.frames.len();
        for member in &mut film.cast {
            member.rows.end = rows;
        }
        film.outcome = Some(outcome.clone());
        if let Some((_, row, scan)) = self.closest
            && let Some(frame) = film.frames.get_mut(row)
        {
            frame.scan.get_or_insert(scan);
        }
        film
    }

    /// The scan of a step, if it is one to keep.
    fn scan(&mut self, view: &StepView<'_>) -> Option<Scan> {
        if self.film.level < Level::Full {
            return None;
        }
        let row = self.film.frames.len();
        if let Ok(thw_s) = view.margins.thw_rear_s
            && self.closest.as_ref().is_none_or(|(least_s, ..)| thw_s < *least_s)
            && view.phase == Phase::Critical
        {
            self.closest = Scan::of(view.perception).map(|scan| (thw_s, row, scan));
        }
        let is_dense = matches!(view.phase, Phase::Critical | Phase::Overtaking)
            && row.is_multiple_of(DENSE)
            && self.dense_scans < MOST_DENSE;
        self.dense_scans += usize::from(is_dense);
        if is_dense || row.is_multiple_of(SPARSE) { Scan::of(view.perception) } else { None }
    }
}

/// The MIS's comfort limit where the arm has one, and what friction allows.
fn limits(scenario: &Scenario, arm: &Arm) -> Vec<Limit> {
    let mut limits = Vec::new();
    if let CheckedDriver::Ego(settings) = &scenario.actors[scenario.ego].driver
        && arm.controller.has_mis(settings)
        && let Some(mis) = settings.mis()
    {
        limits.push(Limit { name: "MIS comfort limit".to_owned(), value: -mis.max_deceleration_mps2 });
    }
    let friction_mps2 = -GRAVITY_MPS2 * scenario.environment.friction;
    limits.push(Limit { name: "friction limit".to_owned(), value: friction_mps2 });
    limits
}

impl Observer for FilmRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        let keeps_objects = self.film.level >= Level::Objects;
        let scan = self.scan(view);
        self.film.frames.push(Frame {
            time: view.time,
            states: view.vehicles.iter().map(|vehicle| vehicle.state).collect(),
            pitches_rad: view.vehicles.iter().map(|vehicle| vehicle.pitch_rad).collect(),
            margins: *view.margins,
            tracks: if keeps_objects { view.tracks.to_vec() } else { Vec::new() },
            command: Some(*view.command),
            phase: Some(view.phase),
            rear_field: view.perception.rear_field().filter(|_| keeps_objects),
            scan,
        });
    }

    fn happening(&mut self, time: Time, what: &Happening) {
        self.film.happenings.push((time, what.clone()));
    }
}
