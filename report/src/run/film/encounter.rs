//! The film of a recorded encounter, to be viewed beside the run that re-enacts it.
//!
//! The recorded vehicle that the simulated ego replaces is the ego of the film. The film has the
//! clock, the road and the vehicle indices of the scenario that is made from the encounter, so one
//! film can be drawn into the other. The frames are one control step of the simulation apart.

use closecall_recorded::encounter::{EGO_INDEX, LEAD_INDEX, REAR_INDEX, RecordedEncounter};
use closecall_traffic::{Environment, Time, Trajectory, Vehicle};

use super::traffic::{frame_at, present_frames, straight_road};
use super::{Film, FilmActor, Level, Part, TrafficFilmError};
use closecall_scenarios::actor_name;
use closecall_scenarios::causal::VehicleLetters;
use closecall_simulation::CONTROL_STEP;

/// Returns the film of a recorded encounter, with one frame per control step.
///
/// # Errors
/// [`TrafficFilmError::Road`] if no road can be built from the recorded lanes.
pub fn film_encounter(encounter: &RecordedEncounter, level: Level) -> Result<Film, TrafficFilmError> {
    let tracks: Vec<&Trajectory> = encounter.vehicles.iter().map(|vehicle| &vehicle.trajectory).collect();
    let steps = encounter.end.ns() / CONTROL_STEP.ns();
    let times = || (0..=steps).map(|step| CONTROL_STEP * step);
    let film_actor = |(index, track): (usize, &&Trajectory)| FilmActor {
        name: actor_name(index, track),
        vehicle: Vehicle { dimensions: track.dimensions, ..Vehicle::typical(track.class) },
        present_frames: present_frames(track, times()),
        part: Part::of_index(index, EGO_INDEX, [Some(LEAD_INDEX), Some(REAR_INDEX)]),
        is_plotted: true,
    };
    let [ego, _, rear] = encounter.ego_lead_rear();
    Ok(Film {
        title: format!("{}: track {} behind track {}", encounter.data_name, rear.track_id, ego.track_id),
        arm: "recorded".to_owned(),
        has_mis: false,
        level,
        period: CONTROL_STEP,
        road: straight_road(encounter.lanes, encounter.lane_width_m)?,
        environment: Environment::CLEAR_DAY,
        actors: tracks.iter().enumerate().map(film_actor).collect(),
        ego: EGO_INDEX,
        frames: times().map(|time| frame_at(&tracks, time)).collect(),
        happenings: Vec::new(),
        notes: notes(encounter),
        acceleration_limits: Vec::new(),
        cameras: Vec::new(),
        outcome: None,
        avoidable: Vec::new(),
        letters: VehicleLetters::default(),
        faults: Vec::new(),
        goal_s: None,
        highlight: Some(encounter.crossing),
        foreword: String::new(),
        settings: Vec::new(),
    })
}

/// Returns notes about the lane changes of the ego, the lead and the rear vehicle.
fn notes(encounter: &RecordedEncounter) -> Vec<(Time, String)> {
    let mut notes = Vec::new();
    for (index, vehicle) in encounter.vehicles.iter().take(encounter.ego_lead_rear().len()).enumerate() {
        let name = actor_name(index, &vehicle.trajectory);
        for change in &vehicle.changes {
            let mut note = |recorded_s: f64, text: &str| {
                let time = encounter.time_of(recorded_s);
                if time >= Time::ZERO && time <= encounter.end {
                    notes.push((time, format!("{name} {text}")));
                }
            };
            note(change.start_s, "begins to change lanes");
            note(change.crossing_s, "crosses the marking");
            note(change.end_s, "has changed lanes");
        }
    }
    notes
}
