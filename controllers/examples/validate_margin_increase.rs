//! The paired study that supports the default values of this crate, in its small closed loop. It compares runs with and
//! without the margin increase system, for three bounds on its braking, and in encounters in which the lead vehicle
//! does not brake.
//!
//! `cargo run --release -p closecall-controllers --example validate_margin_increase -- [SAMPLES] [SEED]`
//!
//! The figures in the documentation use seed 1 (a tuning seed) and 1000 samples.

#![expect(clippy::print_stdout, reason = "the table is what this example is for")]
#![expect(clippy::unwrap_used, reason = "a wrong setup may panic in an example")]

#[path = "../tests/closed_loop/encounter.rs"]
mod encounter;
#[path = "../tests/closed_loop/study.rs"]
mod study;
#[path = "../tests/closed_loop/world.rs"]
mod world;

use encounter::{Case, Outcome, Rear, sample};
use study::paired;

/// Returns the quantile `share` of sorted values.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len() - 1;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index of a list")]
    let index = (share * last as f64).round() as usize;
    sorted[index.min(last)]
}

fn main() {
    let mut arguments = std::env::args().skip(1).map_while(|argument| argument.parse::<u64>().ok());
    let samples = arguments.next().unwrap_or(1000);
    let headline = Case { seed: arguments.next().unwrap_or(1), ..Case::HEADLINE };
    println!("{samples} samples, seed {}", headline.seed);
    println!("bound  d_c  without  with  prevented  induced  ego into lead");
    for critical_gap_m in [5.0, 10.0] {
        for max_deceleration_mps2 in [1.0, 2.0, 3.0] {
            let case = Case { max_deceleration_mps2, critical_gap_m, ..headline };
            let (ledger, _) = paired(&case, samples);
            println!(
                "{max_deceleration_mps2:5} {critical_gap_m:4} {:8} {:5} {:10} {:8} {:14}",
                ledger.without, ledger.with, ledger.prevented, ledger.induced, ledger.with_front
            );
        }
    }
    let calm = Case { front_brakes: false, ..headline };
    println!("lead does not brake   collisions without, with  aborted  least gap in lane [m]");
    for (name, case) in [
        ("overtakes", calm),
        ("follows", Case { rear: Rear::Follows, ..calm }),
        ("blocked", Case { rear: Rear::IsBlocked, ..calm }),
        ("slow approach", Case { slow_approach: true, ..calm }),
    ] {
        let (ledger, pairs) = paired(&case, samples);
        let both = || pairs.iter().flat_map(|(a, b)| [a, b]);
        let aborted = both().filter(|outcome| outcome.aborted).count();
        let least_m = both().map(|outcome| outcome.least_rear_gap_m).fold(f64::INFINITY, f64::min);
        println!("{name:20} {:19} {:5} {aborted:8} {least_m:10.2}", ledger.without, ledger.with);
        if name == "overtakes" {
            headways(&case, &pairs);
        }
    }
}

/// Prints how well the rear vehicle meets its requested time headway, and the ego its goal.
fn headways(case: &Case, pairs: &[(Outcome, Outcome)]) {
    for (arm, pick) in [("without", 0), ("with", 1)] {
        let outcomes = pairs.iter().map(|pair| if pick == 0 { pair.0 } else { pair.1 });
        let mut off: Vec<f64> = (0..)
            .zip(outcomes)
            .filter_map(|(index, outcome)| Some(outcome.crossing_thw_s? - sample(case, index).cut_out_thw_s))
            .collect();
        off.sort_by(f64::total_cmp);
        let [low, middle, high] = [0.01, 0.5, 0.99].map(|share| quantile(&off, share));
        println!(
            "  {arm}: headway at the marking minus the requested one [s]: 1 % {low:.3}, median {middle:.3}, 99 % {high:.3}"
        );
    }
    let gained = |outcome: &Outcome| Some(outcome.thw_critical_s? - outcome.thw_engaged_s?);
    let engaged = pairs.iter().filter(|(_, with)| with.engaged).count();
    let in_reach: Vec<_> = pairs.iter().filter(|(_, with)| with.in_reach).collect();
    let least = in_reach.iter().filter_map(|(_, with)| gained(with)).fold(f64::INFINITY, f64::min);
    println!("  engaged {engaged}, goal said to be in reach {}, least gain of these {least:.2} s", in_reach.len());
}
