//! The drivers and the ego stack in a small closed loop of their own.
//!
//! The figures behind these bounds, with more samples: `cargo run --release -p closecall-controllers --example
//! validate_margin_increase`.

#![expect(clippy::unwrap_used, reason = "what is set up wrongly here may panic")]

mod encounter;
mod following;
mod golden;
mod overtaking;
mod paper_figure;
mod study;
mod world;

use closecall_traffic::Side;
use encounter::{Case, Rear, run, sample};
use proptest::prelude::*;
use study::paired;

#[test]
fn the_margin_increase_system_prevents_most_collisions() {
    let samples = 150;
    let (ledger, _) = paired(&Case::HEADLINE, samples);
    let share = ledger.without as f64 / samples as f64;
    assert!((0.15..=0.50).contains(&share), "{ledger:?}");
    assert!(2 * ledger.with <= ledger.without, "{ledger:?}");
    assert_eq!(ledger.with_front, 0, "E ran into F: {ledger:?}");
}

#[test]
fn nobody_collides_while_f_does_not_brake() {
    let calm = Case { front_brakes: false, ..Case::HEADLINE };
    for case in [
        calm,
        Case { rear: Rear::Follows, ..calm },
        Case { rear: Rear::IsBlocked, ..calm },
        Case { slow_approach: true, ..calm },
    ] {
        let (_, pairs) = paired(&case, 60);
        for (index, (without, with)) in pairs.iter().enumerate() {
            assert_eq!((without.collision, with.collision), (None, None), "sample {index} of {case:?}");
        }
    }
}

#[test]
fn an_overtaker_crosses_the_marking_at_the_headway_asked_for() {
    let case = Case { front_brakes: false, ..Case::HEADLINE };
    for index in 0..100 {
        let outcome = run(&case, index, false);
        let thw_s = outcome.crossing_thw_s.unwrap();
        assert!((thw_s - sample(&case, index).cut_out_thw_s).abs() < 0.1, "sample {index}: {thw_s}");
        assert!(outcome.cut_out && outcome.passed, "sample {index}");
    }
}

#[test]
fn a_goal_said_to_be_in_reach_is_reached() {
    let case = Case { front_brakes: false, ..Case::HEADLINE };
    let mut in_reach = 0;
    for index in 0..150 {
        let outcome = run(&case, index, true);
        if outcome.in_reach {
            in_reach += 1;
            let gained_s = outcome.thw_critical_s.unwrap() - outcome.thw_engaged_s.unwrap();
            assert!(gained_s > 1.9, "sample {index}: {gained_s} s, {:?}", sample(&case, index));
        }
    }
    assert!(in_reach > 30, "{in_reach}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Where one overtakes on the right, all happens as it does on the left, to the last bit.
    #[test]
    fn a_mirrored_road_gives_a_mirrored_encounter(
        seed in 0_u64..1_000, index in 0_u64..1_000, with_mis: bool, front_brakes: bool, blocked: bool,
    ) {
        let rear = if blocked { Rear::IsBlocked } else { Rear::Overtakes };
        let left = Case { seed, rear, front_brakes, ..Case::HEADLINE };
        let right = Case { side: Side::Right, ..left };
        prop_assert_eq!(run(&left, index, with_mis), run(&right, index, with_mis));
    }
}
