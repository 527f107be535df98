//! Measures how often the campaign's statistics are correct, on a scenario with a known probability
//! of a collision.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- validate-statistics 1000
//! ```
//!
//! Runs the given number of campaigns (default: 1,000), each with its own seed, on
//! `tests/fixtures/known-probability.toml`, whose collision probability is 0.05 by construction.
//! The validation fails (exit code 1) if the exact 95 % intervals contain the true probability in
//! less than 93.5 % of the campaigns, or if the sequential mode, evaluated after every sample, is
//! ever wrong in more than 5 % of them. The limit of the gate equals the true probability, which is
//! the hardest case.
//!
//! The methods for rare events are validated before: see [`validate_rare`](crate::validate_rare).
//! With the word `rare` only they are.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use closecall_campaign::execution::{Campaign, CampaignError, End};
use closecall_campaign::ledger::{ArmCounts, Inference};
use closecall_campaign::probability::{Answer, ProbabilityGate};
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::workers::Workers;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_simulation::Arm;
use closecall_simulation::controller::BuiltIn;
use closecall_traffic::statistics::interval::clopper_pearson;
use closecall_traffic::statistics::sequence::{evidence_above, evidence_below, is_certain};

/// Collision probability of the scenario, by construction.
const TRUTH: f64 = 0.05;
/// Confidence level of the bounds.
const CONFIDENCE: f64 = 0.95;
/// Number of samples of a campaign of fixed length.
const FIXED: u64 = 200;
/// Largest number of samples of a sequential campaign, which stops when it is certain.
const MOST: u64 = 2_000;
/// Smallest share of campaigns whose interval must contain the true probability: two standard
/// errors of 1,000 campaigns below 95 %.
const LEAST_COVERAGE: f64 = 0.935;

/// The result of one campaign.
struct CampaignResult {
    counts: ArmCounts,
    /// Whether the confidence sequence excluded the true probability at any time.
    is_ever_outside: bool,
}

/// Runs one campaign of at most `samples` samples, until `stops` returns true.
fn run(seed: u64, samples: u64, stops: impl Fn(&ArmCounts) -> bool) -> Result<CampaignResult, CampaignError> {
    let path = Path::new(crate::ROOT).join("tests/fixtures/known-probability.toml");
    let file = ScenarioFile::load(&path, &[]).expect("the fixture is a valid scenario");
    let arms = vec![Arm { controller: BuiltIn::Acc.factory(), sensors: None }];
    let sampling = Sampling { seed, design: Design::Random, samples };
    let jobs = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let workers = Workers { jobs, sample_timeout: Duration::from_secs(60) };
    let work = Arc::new(Work { file, sampling, arms, checks: CheckPlan::default(), retry_crashed: 0 });
    let campaign = Campaign::new(vec![work.clone()], workers);
    let mut summary = campaign.summary();
    let mut is_ever_outside = false;
    campaign.run(None, |next| {
        summary.push(next.record);
        let counts = summary.total().arms[0];
        let (hits, samples) = (counts.collisions, counts.outcomes);
        // The two-sided bounds exclude the true probability if either side has refuted it.
        is_ever_outside |= [evidence_below, evidence_above]
            .iter()
            .any(|evidence| is_certain(evidence(hits, samples, TRUTH), 0.5 * (1.0 + CONFIDENCE)));
        if stops(&counts) { ControlFlow::Break(End::Scenario) } else { ControlFlow::Continue(()) }
    })?;
    let total = summary.total();
    assert_eq!((total.errors(), total.invalid, total.checks.flips), (0, 0, 0), "{total:?}");
    Ok(CampaignResult { counts: total.arms[0], is_ever_outside })
}

pub(crate) fn main(words: Vec<String>) -> Result<ExitCode, Box<dyn std::error::Error>> {
    let is_rare = words.first().is_some_and(|word| word == "rare");
    let count = words.into_iter().nth(usize::from(is_rare));
    let campaigns: u64 = count.map_or(Ok(1_000), |text| text.parse())?;
    let rare = crate::validate_rare::validate(campaigns)?;
    if is_rare {
        return Ok(if rare { ExitCode::SUCCESS } else { ExitCode::FAILURE });
    }
    let gate = ProbabilityGate::new(TRUTH, CONFIDENCE)?;
    let (mut covered, mut below, mut above, mut outside) = (0_u64, 0_u64, 0_u64, 0_u64);
    for seed in 0..campaigns {
        let fixed = run(seed, FIXED, |_| false)?.counts;
        let [low, high] = clopper_pearson(fixed.collisions, fixed.outcomes, 0.95);
        covered += u64::from(low <= TRUTH && TRUTH <= high);
        let peeked = run(seed, MOST, |counts| gate.is_settled(counts, 1))?;
        let answer = gate.judge(&peeked.counts, 1, Inference::Sequential).answer;
        below += u64::from(answer == Answer::Below);
        above += u64::from(answer == Answer::Above);
        outside += u64::from(peeked.is_ever_outside);
    }
    let share = |count: u64| count as f64 / campaigns as f64;
    let report = format!(
        "{campaigns} campaigns, collision probability {TRUTH}\n\
         exact intervals at 95 % cover it, n = {FIXED}:              {:.1} %\n\
         stopped wrongly as below a gate at {TRUTH}, up to {MOST}:   {:.1} %\n\
         stopped wrongly as above a gate at {TRUTH}, up to {MOST}:   {:.1} %\n\
         95 % confidence sequence ever without it until then: {:.1} %\n",
        100.0 * share(covered),
        100.0 * share(below),
        100.0 * share(above),
        100.0 * share(outside),
    );
    std::io::Write::write_all(&mut std::io::stdout(), report.as_bytes())?;
    let is_right = rare
        && share(covered) >= LEAST_COVERAGE
        && [below, above, outside].iter().all(|&wrong| share(wrong) <= 1.0 - CONFIDENCE);
    Ok(if is_right { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
