//! The result of a boundary.

use super::check::{Doubt, LeaveOneOut, without_value};
use super::plan::BoundaryPlan;
use super::search::{START_RUNS, Searched};
use super::slices::{Area, Map, Slice, map, slices};
use super::surface::{FEWEST, are_equal};
use crate::sensitivity::RunErrors;

/// A boundary along two parameters.
#[derive(Clone, Debug)]
pub struct Boundary {
    /// The scenario's name.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// The sample whose random numbers all runs share.
    pub sample: u64,
    /// The settings of the command line.
    pub settings: Vec<String>,
    /// The controllers that were run, the one under test last.
    pub controllers: Vec<String>,
    /// The event whose boundary it is.
    pub event: String,
    /// The number that the event bounds.
    pub quantity: String,
    /// The two parameters.
    pub keys: [String; 2],
    /// The ranges of the parameters.
    pub ranges: [[f64; 2]; 2],
    /// The runs, in their order.
    pub runs: Vec<Ran>,
    /// The runs without an outcome.
    pub errors: RunErrors,
    /// The surface; `None` if the runs have none.
    pub surveyed: Option<Surveyed>,
    /// Whether the number is the same in all runs that have it.
    has_equal_values: bool,
}

/// One run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ran {
    /// The values of the two parameters.
    pub at: [f64; 2],
    /// The value of the number; `None` if the run ended in an error or does not have it.
    pub value: Option<f64>,
    /// Whether the event happens; `None` without a value.
    pub happens: Option<bool>,
    /// True for a run that fills the rectangle, false for one near the boundary.
    pub is_start: bool,
}

/// What the Gaussian process says.
#[derive(Clone, Debug)]
pub struct Surveyed {
    /// The boundary at values of the first parameter, in their order.
    pub slices: Vec<Slice>,
    /// The shares of the rectangle.
    pub area: Area,
    /// The surface over a grid of the rectangle.
    pub map: Map,
    /// Each run predicted from the others.
    pub check: LeaveOneOut,
    /// Standard deviation with which single runs scatter about the surface, in the unit of the
    /// number. Slices, area and map describe the surface, and leave it out.
    pub noise_sd: f64,
    /// The reasons to doubt the surface.
    pub doubts: Vec<Doubt>,
}

impl Boundary {
    pub(super) fn new(plan: &BoundaryPlan, searched: &Searched, values: &[Option<f64>], errors: RunErrors) -> Self {
        let ranges = [0, 1].map(|axis| [plan.axes[axis].low, plan.axes[axis].high]);
        let place =
            |point: [f64; 2]| [0, 1].map(|axis| ranges[axis][0] + point[axis] * (ranges[axis][1] - ranges[axis][0]));
        let ran = |(index, (point, value)): (usize, (&[f64; 2], &Option<f64>))| Ran {
            at: place(*point),
            value: *value,
            happens: value.map(|value| plan.event.happens(value)),
            is_start: index < START_RUNS,
        };
        let runs: Vec<Ran> = searched.points.iter().zip(values).enumerate().map(ran).collect();
        let surveyed = surveyed(searched, &runs, ranges);
        let has_equal_values = are_equal(&searched.margins.iter().flatten().copied().collect::<Vec<_>>());
        Self {
            scenario: plan.file.config().name.clone(),
            seed: plan.seed,
            sample: plan.sample,
            settings: plan.file.settings().iter().map(ToString::to_string).collect(),
            controllers: plan.arms.iter().map(|arm| arm.controller.name().to_owned()).collect(),
            event: plan.event.to_string(),
            quantity: plan.event.quantity.to_string(),
            keys: [0, 1].map(|axis| plan.axes[axis].key.clone()),
            ranges,
            runs,
            errors,
            surveyed,
            has_equal_values,
        }
    }

    /// Returns true if there is a surface, and nothing is a reason to doubt it.
    pub fn is_conclusive(&self) -> bool {
        self.surveyed.as_ref().is_some_and(|surveyed| surveyed.doubts.is_empty())
    }

    /// Returns the number of runs with a value.
    pub fn runs_with_value(&self) -> usize {
        self.runs.iter().filter(|run| run.value.is_some()).count()
    }

    /// Returns why there is no surface.
    pub fn absent(&self) -> String {
        match self.runs_with_value() {
            few if few < FEWEST => format!("{few} runs have a value of `{}`; {FEWEST} are required", self.quantity),
            _ if self.has_equal_values => {
                format!("`{}` has the same value in all runs: it depends on neither parameter", self.quantity)
            }
            _ => format!("no surface could be fitted to the values of `{}`: they are too different", self.quantity),
        }
    }
}

fn surveyed(searched: &Searched, runs: &[Ran], ranges: [[f64; 2]; 2]) -> Option<Surveyed> {
    let (surface, indices) = searched.surface()?;
    let margins: Vec<f64> = searched.margins.iter().flatten().copied().collect();
    let check = LeaveOneOut::new(&surface.leave_one_out(), &margins, &indices);
    let (map, area) = map(&surface);
    let mut doubts = check.doubts(area);
    let on_bound = on_bound(runs, &searched.margins);
    doubts.extend((on_bound > 0).then_some(Doubt::OnBound { on_bound, runs: margins.len() }));
    doubts.extend(without_value(runs.len() - margins.len(), runs.len()));
    let noise_sd = surface.noise_sd();
    Some(Surveyed { slices: slices(&surface, ranges), area, map, check, noise_sd, doubts })
}

/// Returns the number of runs in which the event happens with a margin of 0. A smallest gap is 0 in
/// each collision, for example, so that `min_gap_rear_m <= 0` has no negative margin.
fn on_bound(runs: &[Ran], margins: &[Option<f64>]) -> usize {
    let is_on_bound = |(run, margin): &(&Ran, &Option<f64>)| run.happens == Some(true) && **margin == Some(0.0);
    runs.iter().zip(margins).filter(is_on_bound).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_that_happens_at_its_bound_is_a_reason_to_doubt_the_surface() {
        let run = |happens| Ran { at: [0.0, 0.0], value: Some(0.0), happens: Some(happens), is_start: true };
        let runs = [true, true, false, true].map(run);
        assert_eq!(on_bound(&runs, &[Some(0.0), Some(-0.0), Some(0.0), Some(-1.0)]), 2);
        let doubt = Doubt::OnBound { on_bound: 2, runs: 4 }.to_string();
        assert!(doubt.starts_with("in 2 of 4 runs the number is equal to the bound"), "{doubt}");
    }
}
