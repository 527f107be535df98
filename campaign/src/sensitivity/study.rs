//! Runs a study, and holds its results.

use std::sync::Arc;

use closecall_traffic::statistics::sensitivity::morris::{Effects, Trajectories};
use closecall_traffic::statistics::sensitivity::saltelli::{Design, Indices, MainEffect};
use closecall_traffic::{ActorId, Stream, stream};

use super::defaults::LeftOut;
use super::factor::{Factor, FactorKind};
use super::output::Output;
use super::plan::{Method, PlanFailure, SensitivityPlan};
use super::runs::{Cube, Ran, RunErrors, run};
use crate::stop::StopFlag;

/// Least number of effects other than zero with which an output takes part in the choice of
/// factors.
const MIN_EFFECTS: usize = 10;

/// The result of a study.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// The scenario's name.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// The settings of the command line.
    pub settings: Vec<String>,
    /// The controllers, the one under test last.
    pub controllers: Vec<String>,
    /// The outputs, the most important first.
    pub outputs: &'static [Output],
    /// The factors, in the order of the coordinates.
    pub factors: Vec<Factor>,
    /// The factors of the list that do not apply.
    pub left_out: Vec<LeftOut>,
    /// The screening, if it was asked for.
    pub screening: Option<Screening>,
    /// The decomposition, if it was asked for.
    pub decomposition: Option<Decomposition>,
}

/// The screening of all factors.
#[derive(Clone, Debug)]
pub struct Screening {
    /// Number of trajectories.
    pub trajectories: usize,
    /// Number of points.
    pub points: usize,
    /// The points without an output.
    pub errors: RunErrors,
    /// The effects of all factors on each output.
    pub effects: Vec<OutputEffects>,
}

/// The effects of all factors on one output.
#[derive(Clone, Debug)]
pub struct OutputEffects {
    /// The output.
    pub output: Output,
    /// The effects, in the order of the factors.
    pub of_factors: Vec<Effects>,
}

/// A factor, or several factors taken together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// The indices of its factors.
    pub factors: Vec<usize>,
    /// The name for readers.
    pub label: String,
}

/// The decomposition of the variance of the outputs.
#[derive(Clone, Debug)]
pub struct Decomposition {
    /// Number of rows.
    pub rows: usize,
    /// Number of points.
    pub points: usize,
    /// The points without an output.
    pub errors: RunErrors,
    /// The groups of factors.
    pub groups: Vec<Group>,
    /// The indices of all groups for each output.
    pub indices: Vec<OutputIndices>,
}

/// The indices of all groups for one output.
#[derive(Clone, Debug)]
pub struct OutputIndices {
    /// The output.
    pub output: Output,
    /// The mean of the output over all points that have one; `None` of no points.
    pub mean: Option<f64>,
    /// The indices, in the order of the groups.
    pub of_groups: Vec<Indices>,
    /// How each factor moves the mean, in the order of the factors, also of those that are in a
    /// group.
    pub main_effects: Vec<Option<MainEffect>>,
}

impl OutputIndices {
    /// Returns the numbers of the factors whose main effect is known, the largest first.
    pub fn strongest(&self) -> Vec<usize> {
        let index = |factor: &usize| self.main_effects[*factor].map_or(f64::NEG_INFINITY, |effect| effect.index.value);
        let mut order: Vec<usize> = (0..self.main_effects.len()).filter(|factor| index(factor).is_finite()).collect();
        order.sort_by(|a, b| index(b).total_cmp(&index(a)).then(a.cmp(b)));
        order
    }

    /// Returns the numbers of the groups, the one with the largest total index first, then those
    /// without one.
    pub fn order(&self) -> Vec<usize> {
        let total = |group: &usize| self.of_groups[*group].total.map_or(f64::NEG_INFINITY, |total| total.value);
        let mut order: Vec<usize> = (0..self.of_groups.len()).collect();
        order.sort_by(|a, b| total(b).total_cmp(&total(a)).then(a.cmp(b)));
        order
    }
}

impl Sensitivity {
    /// Returns the number of the factor that moves the mean of the first output most: by its main
    /// effect, else by its elementary effects. Chance is no assumption, and is not returned. `None`
    /// if nothing was seen to move the output.
    pub fn greatest(&self) -> Option<usize> {
        let moves = |factor: usize| match (&self.decomposition, &self.screening) {
            (Some(decomposition), _) => {
                decomposition.indices.first()?.main_effects[factor].map(|effect| effect.index.value)
            }
            (None, Some(screening)) => {
                screening.effects.first()?.of_factors[factor].mu_star.map(|mu_star| mu_star.value)
            }
            (None, None) => None,
        };
        let is_assumption = |factor: &usize| self.factors[*factor].kind != FactorKind::Chance;
        let moving = (0..self.factors.len()).filter(is_assumption).filter_map(|factor| Some((factor, moves(factor)?)));
        let moving = moving.filter(|(_, moved)| *moved > 0.0);
        // `max_by` returns the last of equal elements: the order is reversed to get the first.
        moving.rev().max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(factor, _)| factor)
    }

    /// Returns the errors of all runs.
    pub fn errors(&self) -> RunErrors {
        let mut errors = RunErrors::default();
        self.screening.iter().for_each(|screening| errors.add(&screening.errors));
        self.decomposition.iter().for_each(|decomposition| errors.add(&decomposition.errors));
        errors
    }
}

impl SensitivityPlan {
    /// Runs the study. `None` if `stop` has ended it early. `on_point` is called after each point.
    ///
    /// # Errors
    /// [`PlanFailure::Workers`] if no threads can be started.
    pub fn run(&self, stop: &StopFlag, on_point: &mut dyn FnMut()) -> Result<Option<Sensitivity>, PlanFailure> {
        let outputs = Output::of_study(self.arms.len() > 1);
        let cube = Arc::new(Cube { seed: self.seed, ..(*self.cube).clone() });
        let mut screening = None;
        if self.method != Method::Sobol {
            let Some(stage) = self.screen(&cube, outputs, stop, on_point)? else { return Ok(None) };
            screening = Some(stage);
        }
        let mut decomposition = None;
        if self.method != Method::Morris {
            let groups = self.groups(screening.as_ref());
            let Some(stage) = self.decompose(&cube, groups, outputs, stop, on_point)? else { return Ok(None) };
            decomposition = Some(stage);
        }
        Ok(Some(Sensitivity {
            scenario: cube.file.config().name.clone(),
            seed: self.seed,
            settings: self.settings.clone(),
            controllers: self.arms.iter().map(|arm| arm.controller.name().to_owned()).collect(),
            outputs,
            factors: self.factors.clone(),
            left_out: self.left_out.clone(),
            screening,
            decomposition,
        }))
    }

    fn screen(
        &self,
        cube: &Arc<Cube>,
        outputs: &[Output],
        stop: &StopFlag,
        on_point: &mut dyn FnMut(),
    ) -> Result<Option<Screening>, PlanFailure> {
        let design = Trajectories::new(self.factors.len(), self.trajectories, &mut self.random("morris"));
        let (points, of_runs) = (design.len(), design.clone());
        let point = move |index| of_runs.point(index);
        let runs = cube.samples(self.arms.clone(), point);
        let Some(ran) = run(runs, points, self.workers, stop, on_point)? else { return Ok(None) };
        let effects = outputs
            .iter()
            .enumerate()
            .map(|(index, output)| OutputEffects { output: *output, of_factors: design.effects(&ran.of(index)) });
        Ok(Some(Screening { trajectories: self.trajectories, points, effects: effects.collect(), errors: ran.errors }))
    }

    fn decompose(
        &self,
        cube: &Arc<Cube>,
        groups: Vec<Group>,
        outputs: &[Output],
        stop: &StopFlag,
        on_point: &mut dyn FnMut(),
    ) -> Result<Option<Decomposition>, PlanFailure> {
        let factors = groups.iter().map(|group| group.factors.clone()).collect();
        let design = Design::new(self.factors.len(), factors, self.rows, &mut self.random("sobol"));
        let (points, of_runs) = (design.len(), design.clone());
        let point = move |index| of_runs.point(index);
        let runs = cube.samples(self.arms.clone(), point);
        let Some(ran) = run(runs, points, self.workers, stop, on_point)? else { return Ok(None) };
        let indices = outputs
            .iter()
            .enumerate()
            .map(|(index, output)| output_indices(*output, &design, self.factors.len(), &ran.of(index)));
        let indices = indices.collect();
        let Ran { errors, .. } = ran;
        Ok(Some(Decomposition { rows: design.rows(), points, errors, groups, indices }))
    }

    /// Returns the groups of the decomposition: each factor that the screening found to matter,
    /// chance, and the rest together.
    fn groups(&self, screening: Option<&Screening>) -> Vec<Group> {
        let chance = self.factors.len() - 1;
        let single = |factor: usize| Group { factors: vec![factor], label: self.factors[factor].label() };
        let Some(screening) = screening.filter(|_| chance > self.top) else {
            return (0..=chance).map(single).collect();
        };
        let scores = scores(screening);
        let mut ranked: Vec<usize> = (0..chance).collect();
        ranked.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]).then(a.cmp(b)));
        let (kept, rest) = ranked.split_at(self.top);
        let label = format!("the other {} factors together", rest.len());
        let mut rest = rest.to_vec();
        rest.sort_unstable();
        kept.iter().copied().chain([chance]).map(single).chain([Group { factors: rest, label }]).collect()
    }

    fn random(&self, stage: &str) -> Stream {
        #[expect(clippy::expect_used, reason = "a constant, and a test draws from it")]
        let owner = ActorId::new("sensitivity").expect("a legal name");
        stream(self.seed, 0, &owner, stage)
    }
}

/// Returns how much each factor matters: its μ* as a share of the largest one, for the output for
/// which this share is largest. Outputs with few effects other than zero say too little, unless all
/// are such.
fn scores(screening: &Screening) -> Vec<f64> {
    let mu_star = |effects: &Effects| effects.mu_star.map_or(0.0, |mu_star| mu_star.value);
    let count = |output: &OutputEffects| {
        // Each effect of an event has the magnitude 2: the size of a step is ½.
        let sum: f64 = output.of_factors.iter().map(|effects| mu_star(effects) * effects.effects as f64).sum();
        if output.output.is_event() {
            (0.5 * sum).round()
        } else if sum > 0.0 {
            MIN_EFFECTS as f64
        } else {
            0.0
        }
    };
    let speaks = |output: &&OutputEffects| count(output) >= MIN_EFFECTS as f64;
    let any = screening.effects.iter().any(|output| speaks(&output));
    let factors = screening.effects.first().map_or(0, |output| output.of_factors.len());
    let mut scores = vec![0.0_f64; factors];
    for output in screening.effects.iter().filter(|output| !any || speaks(output)) {
        let most = output.of_factors.iter().map(mu_star).fold(0.0, f64::max);
        for (score, effects) in scores.iter_mut().zip(&output.of_factors).filter(|_| most > 0.0) {
            *score = score.max(mu_star(effects) / most);
        }
    }
    scores
}

fn output_indices(output: Output, design: &Design, factors: usize, outputs: &[Option<f64>]) -> OutputIndices {
    let values: Vec<f64> = outputs.iter().flatten().copied().collect();
    OutputIndices {
        output,
        mean: (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64),
        of_groups: design.indices(outputs),
        main_effects: (0..factors).map(|factor| design.main_effect(factor, outputs)).collect(),
    }
}
