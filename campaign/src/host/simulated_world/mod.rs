//! Campaigns in a simulated world: worker processes, their pipes and the clock follow a schedule
//! that a seed determines.
//!
//! ```text
//!  seed ─▶ faults ─▶ simulated processes ─▶ Client ─▶ Campaign::run ─▶ journal ─▶ resume ─▶ verdict
//!                 └▶ signals, kills, full disks, damaged journals ────────┘
//! ```
//!
//! A schedule tests the real client, campaign, journal, repair and verdict. Only processes, clock,
//! signals and the room on the disk are simulated. It runs a small campaign in a folder, interrupts and resumes it, and ends
//! with a run without faults. Whatever happens,
//!
//! 1. every outcome in the journal belongs to the sample under which it is filed,
//! 2. no verdict and no baseline comes from a part of the samples,
//! 3. no PASS hides a sample without an outcome, and a record that the journal lacks is told,
//! 4. a check that takes too long is no defect of the simulator, and runs again on request,
//! 5. the last run completes the campaign to the records of an undisturbed one.
//!
//! The idea comes from FoundationDB (Zhou et al., "FoundationDB: A Distributed Unbundled
//! Transactional Key Value Store", SIGMOD 2021). `CLOSECALL_SCHEDULES=1000000` sets the number of
//! schedules and `CLOSECALL_FIRST_SCHEDULE=SEED` the first one; `CLOSECALL_SCHEDULE=SEED` runs one
//! alone.

mod machine;
mod process;
mod schedule;

use std::sync::Arc;

use rayon::prelude::*;

use machine::Reader;
use schedule::{Setup, Violation};

/// Number of schedules of a plain test run.
const SCHEDULES: u64 = 10_000;

fn number_from_env(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|text| text.parse().unwrap_or_else(|_| panic!("{name} is not a number: `{text}`")))
}

/// Runs one schedule for each seed. Returns the violation of the smallest seed that has one, and
/// the number of schedules that met a fault.
fn run(setup: &Setup, reader: Reader, seeds: std::ops::Range<u64>) -> (Option<(u64, Violation)>, usize) {
    let results: Vec<_> = seeds.into_par_iter().map(|seed| (seed, setup.run(seed, reader))).collect();
    let disturbed = results.iter().filter(|(_, result)| !matches!(result, Ok(0))).count();
    let first = results.into_iter().find_map(|(seed, result)| Some((seed, result.err()?)));
    (first, disturbed)
}

#[test]
fn no_schedule_files_a_wrong_outcome_or_hides_a_lost_one() {
    let setup = Arc::new(Setup::new());
    let seeds = match number_from_env("CLOSECALL_SCHEDULE") {
        Some(seed) => seed..seed + 1,
        None => {
            let first = number_from_env("CLOSECALL_FIRST_SCHEDULE").unwrap_or(0);
            first..first + number_from_env("CLOSECALL_SCHEDULES").unwrap_or(SCHEDULES)
        }
    };
    let count = seeds.end - seeds.start;
    let (violation, disturbed) = run(&setup, Reader::OfTheProgram, seeds);
    if let Some((seed, violation)) = violation {
        panic!("CLOSECALL_SCHEDULE={seed}: {violation}");
    }
    assert!(count == 1 || disturbed as u64 > count / 2, "{disturbed} of {count} schedules have a fault");
}

/// A client that does not compare the identity of an answer files the answer to an old question
/// under the sample that it asks for now.
#[test]
fn a_client_that_believes_every_answer_is_found_out() {
    let (violation, _) = run(&Setup::new(), Reader::Believing, 0..2_000);
    let (_, violation) = violation.expect("some schedule shows it");
    assert!(matches!(violation, Violation::OtherOutcome { .. } | Violation::OwnJournalRefused { .. }), "{violation}");
}

/// If a client does not count retries, a crash leaves no trace.
#[test]
fn a_client_that_repeats_in_silence_is_found_out() {
    let (violation, _) = run(&Setup::new(), Reader::Silent, 0..2_000);
    let (_, violation) = violation.expect("some schedule shows it");
    assert!(matches!(violation, Violation::SilentRetry { .. }), "{violation}");
}

/// If a client takes a time-out for a failed check, a slow machine makes a campaign invalid.
#[test]
fn a_client_that_takes_time_for_a_defect_is_found_out() {
    let (violation, _) = run(&Setup::new(), Reader::Blaming, 0..2_000);
    let (_, violation) = violation.expect("some schedule shows it");
    assert!(matches!(violation, Violation::TimeAsDefect { .. }), "{violation}");
}
