//! A recorded encounter as a film, in E's place the vehicle that was E: to be looked at beside the run that re-enacts it.
//!
//! Clock, road and places are those of the scenario that is made from the encounter, so that both can be drawn into one
//! another. Vehicles are shown at the period of the simulation's control steps, interpolated between recorded instants.

use closecall_scenarios::encounter::{EGO, RecordedEncounter};
use closecall_traffic::{Environment, Time, Trajectory, Vehicle};

use super::traffic::{frame, rows, straight_road};
use super::{Film, Level, Member, TrafficFilmError};
use closecall_simulation::CONTROL_STEP;
use closecall_simulation::scenario::actor_name;

/// A film of a recorded encounter, its frames a control step apart.
///
/// # Errors
/// [`TrafficFilmError`] where its lanes make no road.
pub fn film_encounter(encounter: &RecordedEncounter, level: Level) -> Result<Film, TrafficFilmError> {
    let tracks: Vec<&Trajectory> = encounter.vehicles.iter().map(|vehicle| &vehicle.trajectory).collect();
    let steps = encounter.end.ns() / CONTROL_STEP.ns();
    let times = || (0..=steps).map(|step| CONTROL_STEP * step);
    let member = |(place, track): (usize, &&Trajectory)| Member {
        name: actor_name(place, track),
        vehicle: Vehicle { dimensions: track.dimensions, ..Vehicle::typical(track.class) },
        rows: rows(track, times()),
        is_plotted: true,
    };
    let [ego, _, rear] = encounter.protagonists();
    Ok(Film {
        title: format!("{}: track {} behind track {}", encounter.recording, rear.track_id, ego.track_id),
        arm: "recorded".to_owned(),
        level,
        period: CONTROL_STEP,
        road: straight_road(encounter.lanes, encounter.lane_width_m)?,
        environment: Environment::CLEAR_DAY,
        cast: tracks.iter().enumerate().map(member).collect(),
        ego: EGO,
        frames: times().map(|time| frame(&tracks, time)).collect(),
        happenings: Vec::new(),
        notes: notes(encounter),
        acceleration_limits: Vec::new(),
        camera: None,
        outcome: None,
        highlight: Some(encounter.crossing),
        foreword: String::new(),
    })
}

/// The lane changes of the three who make the encounter.
fn notes(encounter: &RecordedEncounter) -> Vec<(Time, String)> {
    let mut notes = Vec::new();
    for (place, vehicle) in encounter.vehicles.iter().take(encounter.protagonists().len()).enumerate() {
        let name = actor_name(place, &vehicle.trajectory);
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
