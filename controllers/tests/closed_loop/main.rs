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
        eprintln!(
            "bound {bound} {ledger:?} engaged {engaged} passed {passed} sim/wall {:.0}",
            sim / start.elapsed().as_secs_f64()
        );
    }
    if std::env::var("ONLY").is_ok() {
        return;
    }
    for (name, case) in [
        ("no brake", Case { front_brakes: false, ..Case::HEADLINE }),
        ("follows", Case { front_brakes: false, rear: Rear::Follows, ..Case::HEADLINE }),
        ("blocked", Case { front_brakes: false, rear: Rear::IsBlocked, ..Case::HEADLINE }),
        ("slow", Case { front_brakes: false, slow_approach: true, ..Case::HEADLINE }),
    ] {
        let (ledger, pairs) = paired(&case, n);
        let c = |f: &dyn Fn(&encounter::Outcome) -> bool| {
            (pairs.iter().filter(|(a, _)| f(a)).count(), pairs.iter().filter(|(_, b)| f(b)).count())
        };
        let mut gaps: Vec<f64> = pairs.iter().flat_map(|(a, b)| [a.least_rear_gap_m, b.least_rear_gap_m]).collect();
        gaps.sort_by(f64::total_cmp);
        let mut br: Vec<f64> = pairs.iter().map(|(_, b)| b.hardest_rear_braking_mps2).collect();
        br.sort_by(f64::total_cmp);
        eprintln!(
            "{name} {ledger:?} cut {:?} passed {:?} aborted {:?} engaged {:?} least gaps {:?} braking with mis {:?}",
            c(&|o| o.cut_out),
            c(&|o| o.passed),
            c(&|o| o.aborted),
            c(&|o| o.engaged),
            &gaps[..5],
            (br[br.len() / 2], br[br.len() - 1])
        );
        if name == "no brake" {
            for arm in 0..2 {
                let mut dev: Vec<f64> = pairs
                    .iter()
                    .enumerate()
                    .filter_map(|(i, p)| {
                        let o = if arm == 0 { p.0 } else { p.1 };
                        o.crossing_thw_s.map(|t| t - encounter::sample(&case, i as u64).cut_out_thw_s)
                    })
                    .collect();
                dev.sort_by(f64::total_cmp);
                eprintln!(
                    "  thw deviation arm {arm}: min {:.3} p10 {:.3} med {:.3} p90 {:.3} max {:.3}",
                    dev[0],
                    dev[dev.len() / 10],
                    dev[dev.len() / 2],
                    dev[dev.len() * 9 / 10],
                    dev[dev.len() - 1]
                );
            }
            let gains: Vec<f64> =
                pairs.iter().filter_map(|(_, b)| Some(b.thw_critical_s? - b.thw_engaged_s?)).collect();
            eprintln!(
                "  gains: n {} mean {:.2}, share >=1.9: {:.2}",
                gains.len(),
                gains.iter().sum::<f64>() / gains.len() as f64,
                gains.iter().filter(|g| **g >= 1.9).count() as f64 / gains.len() as f64
            );
        }
    }
}

#[test]
fn adhoc_cases() {
    let case = Case { front_brakes: std::env::var("FB").is_ok(), ..Case::HEADLINE };
    let (_, pairs) = paired(&case, 300);
    for (i, (_, b)) in pairs.iter().enumerate() {
        if b.collision.is_some() {
            let d = encounter::sample(&case, i as u64);
            let tc = (120.0) / d.closing_mps;
            eprintln!(
                "{i} brakes at {:.1} nominal enc {tc:.1} closing {:.1} brake {:.1} react {:.2} T {:.1} thw {:.2} col {:?} at {:.1} crossed {} without {:?}",
                d.brake_at_s,
                d.closing_mps,
                d.brake_mps2,
                d.reaction_s,
                d.duration_s,
                d.cut_out_thw_s,
                b.collision,
                b.time_s,
                b.crossing_thw_s.is_some(),
                pairs[i].0.collision
            );
            if false {
                eprintln!("{i} {:?}\n   {b:?}", encounter::sample(&case, i as u64));
            }
        }
    }
    let Ok(which) = std::env::var("TRACE") else { return };
    let which: u64 = which.parse().unwrap();
    let drawn = encounter::sample(&case, which);
    let mut world = encounter::world(&case, &drawn, which, true);
    while world.time.s() < 60.0 && world.collision().is_none() {
        world.step();
        if world.time.is_multiple_of(closecall_traffic::Time::from_ms(200)) {
            let (e, f, r) = (&world.actors[0], &world.actors[1], &world.actors[2]);
            eprintln!(
                "{} E v {:.2} a {:.2} thw {:.2} {:?} | R gap {:.2} v {:.2} a {:.2} d {:.2} notes {:?}",
                world.time,
                e.state.speed_mps,
                e.state.acceleration_mps2,
                world::gap_m(f, e) / e.state.speed_mps,
                world.ego_command.map(|c| (c.state, c.reason)),
                world::gap_m(e, r),
                r.state.speed_mps,
                r.state.acceleration_mps2,
                r.state.d_m + 5.625,
                r.notes.last()
            );
        }
    }
}
