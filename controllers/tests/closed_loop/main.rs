//! The drivers and the ego stack in a small closed loop of their own.

mod encounter;
mod study;
mod world;

use encounter::{Case, Rear};
use study::paired;

#[test]
fn adhoc() {
    let n: u64 = std::env::var("N").map_or(100, |n| n.parse().unwrap());
    for bound in [1.0, 2.0, 3.0] {
        let case = Case { max_deceleration_mps2: bound, ..Case::HEADLINE };
        let start = std::time::Instant::now();
        let (ledger, pairs) = paired(&case, n);
        let engaged = pairs.iter().filter(|(_, b)| b.engaged).count();
        let passed = pairs.iter().filter(|(a, _)| a.passed).count();
        let sim: f64 = pairs.iter().map(|(a, b)| a.time_s + b.time_s).sum();
        eprintln!("bound {bound} {ledger:?} engaged {engaged} passed {passed} sim/wall {:.0}", sim / start.elapsed().as_secs_f64());
    }
    for (name, case) in [
        ("no brake", Case { front_brakes: false, ..Case::HEADLINE }),
        ("follows", Case { front_brakes: false, rear: Rear::Follows, ..Case::HEADLINE }),
        ("blocked", Case { front_brakes: false, rear: Rear::IsBlocked, ..Case::HEADLINE }),
        ("slow", Case { front_brakes: false, slow_approach: true, ..Case::HEADLINE }),
    ] {
        let (ledger, pairs) = paired(&case, n);
        let c = |f: &dyn Fn(&encounter::Outcome) -> bool| (pairs.iter().filter(|(a, _)| f(a)).count(), pairs.iter().filter(|(_, b)| f(b)).count());
        let mut gaps: Vec<f64> = pairs.iter().flat_map(|(a, b)| [a.least_rear_gap_m, b.least_rear_gap_m]).collect();
        gaps.sort_by(f64::total_cmp);
        let mut br: Vec<f64> = pairs.iter().map(|(_, b)| b.hardest_rear_braking_mps2).collect();
        br.sort_by(f64::total_cmp);
        eprintln!("{name} {ledger:?} cut {:?} passed {:?} aborted {:?} engaged {:?} least gaps {:?} braking with mis {:?}", c(&|o| o.cut_out), c(&|o| o.passed), c(&|o| o.aborted), c(&|o| o.engaged), &gaps[..5], (br[br.len()/2], br[br.len()-1]));
        if name == "no brake" {
            for arm in 0..2 {
                let mut dev: Vec<f64> = pairs.iter().enumerate().filter_map(|(i, p)| {
                    let o = if arm == 0 { p.0 } else { p.1 };
                    o.crossing_thw_s.map(|t| t - encounter::sample(&case, i as u64).cut_out_thw_s)
                }).collect();
                dev.sort_by(f64::total_cmp);
                eprintln!("  thw deviation arm {arm}: min {:.3} p10 {:.3} med {:.3} p90 {:.3} max {:.3}", dev[0], dev[dev.len()/10], dev[dev.len()/2], dev[dev.len()*9/10], dev[dev.len()-1]);
            }
            let gains: Vec<f64> = pairs.iter().filter_map(|(_, b)| Some(b.thw_critical_s? - b.thw_engaged_s?)).collect();
            eprintln!("  gains: n {} mean {:.2}, share >=1.9: {:.2}", gains.len(), gains.iter().sum::<f64>()/gains.len() as f64, gains.iter().filter(|g| **g >= 1.9).count() as f64 / gains.len() as f64);
        }
    }
}
