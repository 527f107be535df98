//! Measures how often the intervals of the methods for rare events cover, and how many runs they
//! need, on functions of known probability and on a scenario.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- validate-statistics rare 1000
//! ```
//!
//! Each method estimates each probability in the given number of repetitions (default: 1,000), each
//! with its own seed, on a function with one region of failure, on one with two, and on one whose
//! score leads away from the second region. A method that finds one region only would cover in no
//! repetition. One repetition in fifty of the first function's also runs on
//! `tests/fixtures/known-rare-probability.toml`, through all of a campaign. The validation fails
//! (exit code 1) if an interval covers in less than 93 % or in more than 97 % of the repetitions,
//! or if importance sampling needs more runs for a relative width of 0.5 than 1/10, 1/50 and 1/500
//! of plain sampling at 1e-3, 1e-5 and 1e-6. Subset simulation has to save as much at 1e-5 and
//! 1e-6; at 1e-3 it saves nothing.

use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;

use closecall_campaign::rare::{
    Goal, Method, Nearness, Point, RareError, RarePlan, Response, Seed, Simulator, importance, subset,
};
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::stop::StopFlag;
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::workers::Workers;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_simulation::Arm;
use closecall_simulation::controller::BuiltIn;
use closecall_traffic::statistics::normal::TruncatedStandardNormal;

/// The probabilities, and the least factor by which they need fewer runs than plain sampling.
const CASES: [(f64, f64); 3] = [(1e-3, 10.0), (1e-5, 50.0), (1e-6, 500.0)];
/// The relative width that is asked for.
const WIDTH: f64 = 0.5;
/// Shares of the repetitions between which an interval has to cover.
const COVERED: [f64; 2] = [0.93, 0.97];
/// Dimensions of the functions.
const DIMENSIONS: usize = 4;
/// Probability of a collision in the fixture.
const OF_FIXTURE: f64 = 3.166_793e-5;

/// The regions of failure.
#[derive(Clone, Copy, Debug)]
enum Regions {
    One,
    Two,
    /// Two. The first rises late: a search follows the score of the other one.
    Hidden,
}

/// A function in place of a simulation.
struct Function {
    regions: Regions,
    limits: [f64; 2],
}

impl Function {
    fn new(regions: Regions, probability: f64) -> Self {
        let shares = match regions {
            Regions::One => [1.0, 1.0],
            Regions::Two => [0.7, 0.3],
            Regions::Hidden => [0.5, 0.5],
        };
        let standard = TruncatedStandardNormal::new(f64::NEG_INFINITY, f64::INFINITY);
        let beyond = |share: f64| standard.map_or(f64::NAN, |standard| -standard.quantile(share * probability));
        Self { regions, limits: shares.map(beyond) }
    }

    fn response(&self, point: &Point) -> Response {
        let (z, [up, down]) = (point.normals[0], self.limits);
        let along = point.normals.iter().sum::<f64>() / (DIMENSIONS as f64).sqrt();
        let (score, is_event) = match self.regions {
            Regions::One => (along - up, along > up),
            Regions::Two => ((z - up).max(-z - down), z > up || z < -down),
            Regions::Hidden => ((z - up).max(0.4 * (-z - down)), z > up || z < -down),
        };
        Response { score, events: [is_event, false] }
    }
}

impl Simulator for Function {
    type Error = Infallible;

    fn run(&mut self, points: &[Point]) -> Result<Vec<Response>, Infallible> {
        Ok(points.iter().map(|point| self.response(point)).collect())
    }
}

/// What repetitions add up to.
#[derive(Default)]
struct Total {
    repetitions: u64,
    covered: u64,
    without: u64,
    runs: f64,
    /// Sum of the relative widths.
    width: f64,
    /// Sum of the estimates, relative to the truth.
    ratio: f64,
}

impl Total {
    fn push(&mut self, truth: f64, runs: u64, estimate: Option<(f64, [f64; 2])>) {
        self.repetitions += 1;
        self.runs += runs as f64;
        match estimate {
            Some((value, [low, high])) => {
                self.covered += u64::from(low <= truth && truth <= high);
                self.width += (high - low) / value;
                self.ratio += value / truth;
            }
            None => self.without += 1,
        }
    }

    fn coverage(&self) -> f64 {
        self.covered as f64 / self.repetitions as f64
    }

    /// Returns the factor by which plain sampling needs more runs for the same width.
    fn saving(&self, truth: f64) -> f64 {
        let width = self.width / (self.repetitions - self.without).max(1) as f64;
        let plain = (2.0 * 1.96 / width).powi(2) * (1.0 - truth) / truth;
        plain / (self.runs / self.repetitions as f64)
    }

    fn line(&self, truth: f64) -> String {
        let with_interval = (self.repetitions - self.without).max(1) as f64;
        format!(
            "covers in {:.1} %, {} without an interval, {:.0} runs, 1/{:.0} of plain sampling, relative width {:.2}, mean {:.3} of the truth",
            100.0 * self.coverage(),
            self.without,
            self.runs / self.repetitions as f64,
            self.saving(truth),
            self.width / with_interval,
            self.ratio / with_interval,
        )
    }
}

fn of_function(method: Method, regions: Regions, probability: f64, repetitions: u64) -> Total {
    let goal = Goal { relative_width: WIDTH, budget: 2_000_000, value: 0 };
    let mut function = Function::new(regions, probability);
    let mut total = Total::default();
    for seed in 0..repetitions {
        let (means, runs) = match method {
            Method::Importance => {
                let Ok(estimate) = importance(&mut function, DIMENSIONS, Seed(seed), goal);
                (estimate.means, estimate.runs)
            }
            Method::Subset => {
                let Ok(estimate) = subset(&mut function, DIMENSIONS, Seed(seed), goal);
                (estimate.means, estimate.runs)
            }
            // It states no probability.
            Method::Search => (None, 0),
        };
        let interval = means.and_then(|[mean, ..]| Some((mean.value, mean.interval_of_probability(0.95)?)));
        total.push(probability, runs, interval);
    }
    total
}

fn of_scenario(method: Method, repetitions: u64) -> Result<Total, Box<dyn std::error::Error>> {
    let file = ScenarioFile::load(&Path::new(crate::ROOT).join("tests/fixtures/known-rare-probability.toml"), &[])?;
    let arms = vec![Arm { controller: BuiltIn::Acc.factory(), sensors: None }];
    let goal = Goal { relative_width: WIDTH, budget: 2_000_000, value: 0 };
    let nearness = Nearness::new("collision".parse()?, None)?;
    let plan = RarePlan { method, nearness, goal, workers: Workers::default(), remote: None, part: None };
    let mut total = Total::default();
    for seed in 0..repetitions {
        let sampling = Sampling { seed, design: Design::Random, samples: 1 };
        let (file, arms) = (file.clone(), arms.clone());
        let work = Arc::new(Work { file, sampling, arms, checks: CheckPlan::off(), retry_crashed: 0 });
        let report = plan
            .run((0, &work), None, &StopFlag::default(), &mut || {})
            .map_err(|error: RareError| error.to_string())?;
        let interval = report.main().and_then(|estimate| Some((estimate.value, estimate.interval_95?)));
        total.push(OF_FIXTURE, report.runs, interval);
    }
    Ok(total)
}

/// Returns whether the methods hold what they promise.
pub(crate) fn validate(repetitions: u64) -> Result<bool, Box<dyn std::error::Error>> {
    let mut is_right = true;
    for method in [Method::Importance, Method::Subset] {
        for regions in [Regions::One, Regions::Two, Regions::Hidden] {
            for (probability, saving) in CASES {
                let total = of_function(method, regions, probability, repetitions);
                print(&format!("{method}, {regions:?}, {probability:e}: {}\n", total.line(probability)))?;
                let asks_for_saving = method == Method::Importance || probability < 1e-4;
                let saves = !asks_for_saving || total.saving(probability) >= saving;
                // Subset simulation follows the score, and promises nothing of a region that the
                // score hides.
                let is_promised = method == Method::Importance || !matches!(regions, Regions::Hidden);
                let covers = (COVERED[0]..=COVERED[1]).contains(&total.coverage());
                is_right &= !is_promised || saves && covers;
            }
        }
        let total = of_scenario(method, repetitions.div_ceil(50))?;
        print(&format!("{method}, scenario, {OF_FIXTURE:e}: {}\n", total.line(OF_FIXTURE)))?;
    }
    Ok(is_right)
}

fn print(line: &str) -> std::io::Result<()> {
    std::io::Write::write_all(&mut std::io::stdout(), line.as_bytes())
}
