//! Step 0 of a sampled lane change: a driver that is calibrated to the recording, and how well it
//! reproduces the recording.
//!
//! Two parameters are calibrated first: the desired speed and cc1. If they do not reproduce the
//! recording, all parameters but cc0 and cc6 are. If these do not either, the lane change is not
//! sampled: its steps would vary another manoeuvre than the recorded one.
//!
//! **Bounds.** They hold from the start to the end of the lane change. The error along the road is
//! the mixed relative error of Kesting and Treiber, *Calibrating Car-Following Models by Using
//! Trajectory Data*, Transportation Research Record 2088 (2008), √(⟨Δs²/s⟩/⟨s⟩): at most 29 %, the
//! largest error that they report for calibrated models. Where nobody is ahead, s is the gap that
//! Wiedemann 99 keeps with its published parameters. The root mean square across the road is at
//! most 0.28 m, the standard deviation with which the drivers of US-101 weave in their lanes.

use std::fmt;
use std::path::Path;

use closecall_controllers::Wiedemann99Config;
use closecall_recorded::encounter::RecordedEncounter;
use closecall_recorded::following::FollowingInstant;
use closecall_scenarios::{SampledEncounter, Setting, name_of_other, sampled};
use closecall_simulation::calibration::{Calibrated, ahead_of, calibrate_replaced, value_of};
use closecall_traffic::Time;
use serde::Serialize;

use super::sampling::{SampledRun, StepError, StepRun, run_step};

/// Largest relative error along the road (-); see the module documentation.
const LARGEST_RELATIVE_ERROR: f64 = 0.29;
/// Largest root mean square error across the road (m); see the module documentation.
const LARGEST_ACROSS_M: f64 = 0.28;

/// Published gap at standstill (m) and time headway (s) of Wiedemann 99.
const PUBLISHED_CC0_M: f64 = 1.5;
const PUBLISHED_CC1_S: f64 = 0.9;

/// How well step 0 reproduces the recording, from the start to the end of the lane change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reproduction {
    /// The mixed relative error of the gap (-).
    pub relative_error: f64,
    /// The root mean square error across the road (m).
    pub across_rms_m: f64,
    /// The largest error along the road (m).
    pub largest_along_m: f64,
    /// Time by which step 0 crosses the marking later than recorded (s); `None` if it never does.
    pub crosses_later_s: Option<f64>,
    /// Number of calibrated parameters.
    pub calibrated_parameters: usize,
    /// The calibrated desired speed (m/s).
    pub desired_speed_mps: Option<f64>,
    /// The calibrated cc1 (s).
    pub cc1_s: Option<f64>,
    /// The first collision of the vehicle that changes lanes before the end of its lane change, if
    /// there is one.
    pub collision: Option<String>,
}

impl Reproduction {
    /// Compares step 0 with the recording at the instants of `ahead`, which hold the vehicle ahead.
    fn new(
        [recorded, run]: [&SampledRun; 2],
        ahead: &[(Time, Option<FollowingInstant>)],
        driver: &Wiedemann99Config,
        calibrated: Calibrated,
        collision: Option<String>,
    ) -> Self {
        let mut largest_along_m: f64 = 0.0;
        let (mut weighted_m, mut across_m2, mut gaps_m, mut count) = (0.0, 0.0, 0.0, 0_u32);
        let mut simulated = run.positions.iter().peekable();
        let mut before: Option<(Time, f64)> = None;
        for ((time, s_m, d_m), (_, instant)) in recorded.positions.iter().zip(ahead) {
            while simulated.next_if(|(own, ..)| own < time).is_some() {}
            let Some((_, own_s_m, own_d_m)) = simulated.next_if(|(own, ..)| own == time) else { continue };
            let speed_mps = before.map_or(0.0, |(then, then_m)| (s_m - then_m) / (*time - then).s());
            before = Some((*time, *s_m));
            let free_m = PUBLISHED_CC0_M + PUBLISHED_CC1_S * speed_mps.max(0.0);
            // A recorded gap may be smaller than its error.
            let gap_m = instant.map_or(free_m, |instant| instant.gap_m().max(PUBLISHED_CC0_M));
            let along_m = own_s_m - s_m;
            largest_along_m = largest_along_m.max(along_m.abs());
            weighted_m += along_m * along_m / gap_m;
            across_m2 += (own_d_m - d_m).powi(2);
            gaps_m += gap_m;
            count += 1;
        }
        // Without a common instant both errors are not numbers, and exceed every bound.
        let calibrated_parameters = match calibrated {
            Calibrated::SpeedAndHeadway => 2,
            Calibrated::All => 9,
        };
        Self {
            relative_error: (weighted_m / gaps_m).sqrt(),
            across_rms_m: (across_m2 / f64::from(count)).sqrt(),
            largest_along_m,
            crosses_later_s: recorded.crossing_s.zip(run.crossing_s).map(|(recorded_s, own_s)| own_s - recorded_s),
            calibrated_parameters,
            desired_speed_mps: value_of(driver, "desired-speed-mps"),
            cc1_s: value_of(driver, "cc1-s"),
            collision,
        }
    }

    /// Returns whether step 0 reproduces the recording within the bounds.
    fn is_within_bounds(&self) -> bool {
        self.relative_error <= LARGEST_RELATIVE_ERROR
            && self.across_rms_m <= LARGEST_ACROSS_M
            && self.crosses_later_s.is_some()
            && self.collision.is_none()
    }
}

/// Returns a value that is shown with two digits: one beyond its bound is rounded up, so that it
/// does not look like the bound.
fn shown_beyond(value: f64, bound: f64) -> f64 {
    if value > bound { (100.0 * value).ceil() / 100.0 } else { value }
}

impl fmt::Display for Reproduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let crossing = self.crosses_later_s.map_or("does not cross the marking".to_owned(), |later_s| match later_s {
            later_s if later_s < 0.0 => format!("crosses the marking {:.2} s earlier", -later_s),
            later_s => format!("crosses the marking {later_s:.2} s later"),
        });
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
        write!(
            f,
            "step 0 ({} calibrated parameters: desired speed {} m/s, cc1 = {} s …) departs from the recording by up to \
             {:.1} m along the road, {:.0} % of the gap (at most {:.0} %), and by {:.2} m across (at most {:.2} m), and \
             {crossing}",
            self.calibrated_parameters,
            number(self.desired_speed_mps),
            number(self.cc1_s),
            self.largest_along_m,
            100.0 * shown_beyond(self.relative_error, LARGEST_RELATIVE_ERROR),
            100.0 * LARGEST_RELATIVE_ERROR,
            shown_beyond(self.across_rms_m, LARGEST_ACROSS_M),
            LARGEST_ACROSS_M,
        )?;
        match &self.collision {
            Some(collision) => write!(f, "; {collision}"),
            None => Ok(()),
        }
    }
}

/// Step 0 of a sampled lane change.
#[derive(Clone, Debug)]
pub struct StepZero {
    /// The encounter, without vehicles whose recorded movements would end the run before the lane
    /// change.
    pub encounter: RecordedEncounter,
    /// The calibrated driver.
    pub driver: Wiedemann99Config,
    /// The scenario of the encounter, with the calibrated driver.
    pub step: SampledEncounter,
    /// The recorded lane change.
    pub recorded: SampledRun,
    /// The run of the scenario.
    pub run: StepRun,
    /// How well it reproduces the recording.
    pub reproduction: Reproduction,
}

/// The reason why a lane change has no step 0.
#[derive(Debug, thiserror::Error)]
pub enum StepZeroError {
    /// The step cannot be run.
    #[error(transparent)]
    Step(#[from] StepError),
    /// No calibrated driver reproduces the recording.
    #[error("no driver reproduces the recording: {0}")]
    NotReproduced(Box<Reproduction>),
}

/// Calibrates the driver of an encounter, and runs step 0. The second argument holds the path that
/// names the source in error messages, and further settings.
///
/// A run ends with the first collision. Recorded positions of two other vehicles may overlap, or do
/// so after the end of a record, when a vehicle keeps its last speed. If the run then ends before
/// the vehicle crosses the marking, one of the two is left out.
///
/// # Errors
/// [`StepZeroError`] if the step cannot be run, or if no driver reproduces the recording.
pub fn step_zero(
    encounter: &RecordedEncounter,
    inputs: (&Path, &[Setting]),
    seed: u64,
) -> Result<StepZero, StepZeroError> {
    let mut encounter = encounter.clone();
    loop {
        let zero = closest(&encounter, inputs, seed)?;
        if zero.reproduction.is_within_bounds() {
            return Ok(zero);
        }
        match in_collision(&encounter, &zero.run.run) {
            Some(index) => encounter.vehicles.remove(index),
            None => return Err(StepZeroError::NotReproduced(Box::new(zero.reproduction))),
        };
    }
}

/// Returns the index of a vehicle without a role that collides with another one before the vehicle
/// that changes lanes crosses the marking.
fn in_collision(encounter: &RecordedEncounter, run: &SampledRun) -> Option<usize> {
    let [one, other] = run.others_in_collision.as_ref().filter(|_| run.crossing_s.is_none())?;
    let index_of = |name: &String| {
        let mut others = encounter.vehicles.iter().enumerate().skip(encounter.roles());
        let named = others.find(|(_, vehicle)| name_of_other(vehicle.trajectory.track_id) == *name);
        named.map(|(index, _)| index)
    };
    index_of(other).or_else(|| index_of(one))
}

/// Returns the step 0 of the calibrated driver that reproduces the recording, or else of the closer
/// one.
fn closest(
    encounter: &RecordedEncounter,
    (source, settings): (&Path, &[Setting]),
    seed: u64,
) -> Result<StepZero, StepZeroError> {
    let built = |driver: &Wiedemann99Config| {
        sampled(encounter, (driver, None), (source, settings)).map_err(StepError::Scenario)
    };
    let start = built(&Wiedemann99Config::default())?;
    let until = Time::from_s(start.lane_change_s[1]);
    let ahead = ahead_of(encounter, &start.others, until);
    let recorded = SampledRun::recorded(encounter, &start);
    let attempt = |calibrated: Calibrated| -> Result<StepZero, StepZeroError> {
        let driver = calibrate_replaced(encounter, &ahead, calibrated);
        let step = built(&driver)?;
        let run = run_step(encounter, "step 0".to_owned(), None, &step, seed)?;
        // A collision of two other vehicles is one of their recorded positions. It matters if the
        // run ends with it before the crossing.
        let collision = run.run.collision.as_ref().filter(|(_, time_s)| *time_s <= until.s());
        let collision = collision.map(|(other, time_s)| format!("it collides with {other} at {time_s:.2} s"));
        let reproduction = Reproduction::new([&recorded, &run.run], &ahead, &driver, calibrated, collision);
        let (encounter, recorded) = (encounter.clone(), recorded.clone());
        Ok(StepZero { encounter, driver, step, recorded, run, reproduction })
    };
    let simple = attempt(Calibrated::SpeedAndHeadway)?;
    if simple.reproduction.is_within_bounds() {
        return Ok(simple);
    }
    let full = attempt(Calibrated::All)?;
    let is_simple_closer = simple.reproduction.relative_error < full.reproduction.relative_error;
    Ok(if is_simple_closer && !full.reproduction.is_within_bounds() { simple } else { full })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_beyond_its_bound_does_not_look_like_the_bound() {
        assert_eq!(format!("{:.2}", shown_beyond(0.2801, 0.28)), "0.29");
        assert_eq!(format!("{:.2}", shown_beyond(0.2799, 0.28)), "0.28");
        assert_eq!(format!("{:.0} %", 100.0 * shown_beyond(0.2901, 0.29)), "30 %");
        assert!(shown_beyond(f64::NAN, 0.28).is_nan());
    }
}
