//! Whether the object-level sensors agree with the full chain on the ego's collision, sample by
//! sample.
//!
//! Every sample is run in both modes with the margin increase system, and with the same random
//! numbers. Agreement beyond chance is Cohen's κ (J. Cohen, *A coefficient of agreement for nominal
//! scales*, 1960). Each sample on which the modes differ has a reason: the first difference of the
//! two runs that is large enough to matter.
//!
//! A second measure is the engagement of the system: the modes may agree on every collision, and
//! still engage at different distances of the rear vehicle.
//!
//! The full chain does not agree with itself if the noise of its sensors is drawn anew. No model of
//! it can agree better ([`Beside::OtherNoise`]).

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::{RearFit, SensorMode, Sensors};
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, SampleError, StepView, simulate};
use closecall_traffic::{Appearance, CONTROL_STEP, Time, VehicleClass};
use rayon::prelude::*;

use crate::perception::study::StudyError;

/// Time difference above which two times differ (s): more than the resolution of the tracks, which
/// is 0.04 s.
const DIFFERENT_S: f64 = 0.1;
/// Name of the vehicle that approaches, as in the scenarios of the library.
const REAR: &str = "rear";

/// The verdict of one run of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Whether the ego collided.
    pub has_collided: bool,
    /// Time at which the system engaged (s), if it did.
    pub engaged_at_s: Option<f64>,
    /// Gap behind the ego at that time (m), if it was observed and a vehicle was in the ego's lane.
    pub engaged_at_m: Option<f64>,
    /// Time at which it released (s), if it did.
    pub released_at_s: Option<f64>,
    /// Smallest gap behind the ego (m), if a vehicle was there.
    pub min_gap_rear_m: Option<f64>,
}

/// One sample in both modes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The sample.
    pub sample: u64,
    /// Class and appearance of the rear vehicle; `None` without one.
    pub rear: Option<(VehicleClass, Appearance)>,
    /// With object-level sensors.
    pub object: Verdict,
    /// With the full chain.
    pub full: Verdict,
}

/// The runs beside the runs with the full chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beside {
    /// With object-level sensors.
    Object,
    /// With object-level sensors and another fit than that which ships.
    Fit(&'static RearFit),
    /// With the full chain, and other noise of the sensors behind.
    OtherNoise,
}

/// All samples of a scenario in both modes.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// The samples, in order.
    pub pairs: Vec<Pair>,
}

/// The gaps behind the ego in a run.
#[derive(Debug, Default)]
struct RearGaps {
    /// Time (s) and gap (m) of each control step with a vehicle behind in the ego's lane.
    steps: Vec<(f64, f64)>,
}

impl RearGaps {
    /// Returns the gap at a time (m), if a vehicle is behind.
    fn at_m(&self, time_s: f64) -> Option<f64> {
        let half_step_s = 0.5 * CONTROL_STEP.s();
        self.steps.iter().find(|(at_s, _)| (at_s - time_s).abs() < half_step_s).map(|(_, gap_m)| *gap_m)
    }
}

impl Observer for RearGaps {
    fn step(&mut self, view: &StepView<'_>) {
        self.steps.extend(view.margins.gap_rear_m.ok().map(|gap_m| (view.time.s(), gap_m)));
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

impl Verdict {
    /// Returns the verdict of a run, without the gap at the engagement.
    pub fn of(outcome: &Outcome) -> Self {
        let mis = outcome.mis.as_ref().ok();
        Self {
            has_collided: outcome.ego_collided(),
            engaged_at_s: mis.and_then(|mis| mis.engaged_at_s.ok()),
            engaged_at_m: None,
            released_at_s: mis.and_then(|mis| mis.released_at_s.ok()),
            min_gap_rear_m: outcome.margins.min_gap_rear_m.ok(),
        }
    }

    /// Returns the verdict of a run with these gaps behind the ego.
    fn with_gaps(self, gaps: &RearGaps) -> Self {
        Self { engaged_at_m: self.engaged_at_s.and_then(|time_s| gaps.at_m(time_s)), ..self }
    }
}

impl Pair {
    /// Returns whether the modes differ on the collision.
    pub fn differs(&self) -> bool {
        self.object.has_collided != self.full.has_collided
    }

    /// Returns by how much farther behind the rear vehicle is at the engagement with object-level
    /// sensors than with the full chain (m), if both engage for a vehicle in the ego's lane.
    pub fn engagement_difference_m(&self) -> Option<f64> {
        self.object.engaged_at_m.zip(self.full.engaged_at_m).map(|(object_m, full_m)| object_m - full_m)
    }

    /// Returns the first difference of the two runs that is large enough to matter.
    pub fn reason(&self) -> String {
        reason([&self.object, &self.full], ["the object-level sensors", "the full chain"])
    }
}

/// Returns the first difference of two runs of a sample that is large enough to matter. `names` are
/// the names of the runs' sensors.
pub fn reason([first_verdict, second_verdict]: [&Verdict; 2], names: [&str; 2]) -> String {
    let differ = |change: &str, first: Option<f64>, second: Option<f64>| match (first, second) {
        (Some(first), Some(second)) if (first - second).abs() > DIFFERENT_S => Some(format!(
            "the system {change} {:.2} s {} with {}",
            (first - second).abs(),
            if first < second { "earlier" } else { "later" },
            names[0]
        )),
        (Some(_), None) => Some(format!("the system {change} only with {}", names[0])),
        (None, Some(_)) => Some(format!("the system {change} only with {}", names[1])),
        _ => None,
    };
    differ("engages", first_verdict.engaged_at_s, second_verdict.engaged_at_s)
        .or_else(|| differ("releases", first_verdict.released_at_s, second_verdict.released_at_s))
        .unwrap_or_else(|| {
            let missed = if first_verdict.has_collided { second_verdict } else { first_verdict };
            let gap = missed
                .min_gap_rear_m
                .map_or_else(String::new, |gap_m| format!(": the other run passes by {gap_m:.2} m"));
            format!("engaged and released within {DIFFERENT_S} s of each other, on the edge of a contact{gap}")
        })
}

impl Agreement {
    /// Runs all samples of a scenario in both modes. The result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// [`StudyError`] if a run fails.
    pub fn of(file: &ScenarioFile, seed: u64, samples: u64) -> Result<Self, StudyError> {
        Self::beside(Beside::Object, file, seed, samples)
    }

    /// Does the same as [`Self::of`] with these runs beside the runs with the full chain.
    ///
    /// # Errors
    /// [`StudyError`] if a run fails.
    pub fn beside(beside: Beside, file: &ScenarioFile, seed: u64, samples: u64) -> Result<Self, StudyError> {
        let sampling = Sampling { seed, design: Design::Random, samples };
        let pair = |sample| {
            let failed = |error: &dyn std::fmt::Display| StudyError::Run { sample, message: error.to_string() };
            let scenario = concrete(file, sampling, sample).map_err(|error| failed(&error))?;
            let key = RunKey { seed, sample };
            let run = |scenario: &Scenario, mode| {
                let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(mode) };
                let mut gaps = RearGaps::default();
                let outcome = simulate(scenario, key, &arm, &mut gaps);
                outcome
                    .map(|outcome| Verdict::of(&outcome).with_gaps(&gaps))
                    .map_err(|error: SampleError| failed(&error))
            };
            let rear = scenario.actors.iter().position(|actor| actor.id.as_str() == REAR).map(|index| {
                let vehicle = scenario.vehicle(index, key);
                (vehicle.class, vehicle.appearance)
            });
            let with_sensors = |sensors: Sensors, mode| run(&Scenario { sensors, ..scenario.clone() }, mode);
            let object = match beside {
                Beside::Object => run(&scenario, SensorMode::Object)?,
                Beside::Fit(fit) => with_sensors(scenario.sensors.with_rear_fit(fit), SensorMode::Object)?,
                Beside::OtherNoise => with_sensors(scenario.sensors.with_rear_draw(1), SensorMode::Full)?,
            };
            Ok(Pair { sample, rear, object, full: run(&scenario, SensorMode::Full)? })
        };
        Ok(Self { pairs: (0..samples).into_par_iter().map(pair).collect::<Result<_, StudyError>>()? })
    }

    /// Returns the collision rates with object-level sensors and with the full chain.
    pub fn rates(&self) -> [f64; 2] {
        let rate = |condition: fn(&Pair) -> bool| {
            self.pairs.iter().filter(|pair| condition(pair)).count() as f64 / self.pairs.len() as f64
        };
        [rate(|pair| pair.object.has_collided), rate(|pair| pair.full.has_collided)]
    }

    /// Returns by how much farther behind the rear vehicle is at the engagement with object-level
    /// sensors than with the full chain (m), in rising order: one number for each sample in which
    /// both engage for a vehicle in the ego's lane.
    pub fn engagement_differences_m(&self) -> Vec<f64> {
        let mut differences_m: Vec<f64> = self.pairs.iter().filter_map(Pair::engagement_difference_m).collect();
        differences_m.sort_unstable_by(f64::total_cmp);
        differences_m
    }

    /// Returns the number of samples in which the system engages in one mode alone.
    pub fn engaged_in_one_mode(&self) -> usize {
        self.pairs.iter().filter(|pair| pair.object.engaged_at_s.is_some() != pair.full.engaged_at_s.is_some()).count()
    }

    /// Returns Cohen's κ; `None` if no run or every run collides, so that chance alone explains the
    /// agreement.
    pub fn kappa(&self) -> Option<f64> {
        let [object, full] = self.rates();
        let agree = self.pairs.iter().filter(|pair| !pair.differs()).count() as f64 / self.pairs.len() as f64;
        let by_chance = object * full + (1.0 - object) * (1.0 - full);
        (by_chance < 1.0).then(|| (agree - by_chance) / (1.0 - by_chance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(object: bool, full: bool) -> Pair {
        let verdict = |has_collided| Verdict {
            has_collided,
            engaged_at_s: Some(3.0),
            engaged_at_m: Some(86.0),
            released_at_s: Some(9.0),
            min_gap_rear_m: Some(0.4),
        };
        Pair { sample: 0, rear: None, object: verdict(object), full: verdict(full) }
    }

    #[test]
    fn kappa_is_that_of_a_worked_table() {
        // 20 both, 15 neither, 5 and 10 only one: 35 of 50 agree, 25 by chance.
        let table = [(20, true, true), (5, true, false), (10, false, true), (15, false, false)];
        let pairs = table.iter().flat_map(|&(count, object, full)| std::iter::repeat_n(pair(object, full), count));
        let agreement = Agreement { pairs: pairs.collect() };
        assert!((agreement.kappa().unwrap() - 0.4).abs() < 1e-12);
        assert_eq!(agreement.rates(), [0.5, 0.6]);
        assert_eq!(Agreement { pairs: vec![pair(false, false)] }.kappa(), None);
    }

    #[test]
    fn an_engagement_in_one_mode_alone_has_no_distance() {
        let mut farther = pair(false, false);
        farther.object.engaged_at_m = Some(97.5);
        let mut alone = pair(false, false);
        (alone.full.engaged_at_s, alone.full.engaged_at_m) = (None, None);
        let agreement = Agreement { pairs: vec![farther, alone, pair(false, false)] };
        assert_eq!(agreement.engagement_differences_m(), [0.0, 11.5]);
        assert_eq!(agreement.engaged_in_one_mode(), 1);
    }

    #[test]
    fn the_gap_at_the_engagement_is_the_gap_of_the_same_step() {
        let gaps = RearGaps { steps: vec![(2.96, 88.0), (3.0, 87.5), (3.04, 87.0)] };
        assert_eq!([2.99, 3.0, 4.0].map(|time_s| gaps.at_m(time_s)), [Some(87.5), Some(87.5), None]);
    }

    #[test]
    fn a_reason_is_the_first_difference() {
        let mut differing = pair(true, false);
        assert!(
            differing.differs()
                && differing.reason().contains("on the edge of a contact: the other run passes by 0.40 m")
        );
        differing.object.released_at_s = Some(8.0);
        assert_eq!(differing.reason(), "the system releases 1.00 s earlier with the object-level sensors");
        differing.full.engaged_at_s = None;
        assert_eq!(differing.reason(), "the system engages only with the object-level sensors");
    }
}
