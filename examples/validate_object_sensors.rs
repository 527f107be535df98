//! Compares the verdicts of the object-level sensors with those of the full chain, sample by sample.
//!
//!     cargo run --release --example validate_object_sensors -- -n 1000
//!
//! Prints Cohen's κ and the collision rates in clear air, rain (10 mm/h), fog (visibility 100 m) and at night, and lists every sample on
//! which the modes differ with its reason. The exit code is 1 if some κ is below 0.8, or if rates differ by more than 2 percentage
//! points. A thousand samples take about half an hour on two cores.
#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use closecall::simulation::scenario::source;
use closecall_perception::agreement::Agreement;

/// The weather: its name and its settings.
const CONDITIONS: [(&str, &[&str]); 4] = [
    ("clear air", &[]),
    ("rain, 10 mm/h", &["environment.rain-mm-per-h=10"]),
    ("fog, 100 m", &["environment.visibility-m=100"]),
    ("night", &["environment.light=\"night\""]),
];
/// Least agreement and largest difference of the rates that are asked for.
const MIN_KAPPA: f64 = 0.8;
const MAX_DIFFERENCE: f64 = 0.02;

/// Compares the object-level sensors with the full chain.
#[derive(Parser)]
struct Args {
    /// The scenario: a name of the library, or a file
    #[arg(default_value = "low-thw-overtake")]
    scenario: String,
    /// Number of samples in each condition
    #[arg(short = 'n', long, default_value_t = 1_000)]
    samples: u64,
    /// The seed
    #[arg(long, default_value_t = 2026)]
    seed: u64,
    /// Only the conditions whose names contain this text, such as `fog`
    #[arg(long, default_value = "")]
    condition: String,
}

fn main() -> Result<ExitCode, Box<dyn std::error::Error>> {
    let args = Args::parse();
    println!("{}, {} samples, seed {}", args.scenario, args.samples, args.seed);
    let (mut agrees, mut lists) = (true, String::new());
    for (name, settings) in CONDITIONS.into_iter().filter(|(name, _)| name.contains(&args.condition)) {
        let settings = settings.iter().map(|text| text.parse()).collect::<Result<Vec<_>, _>>()?;
        let file = source::load(Path::new(&args.scenario), &settings)?;
        let agreement = Agreement::of(&file, args.seed, args.samples)?;
        let [object, full] = agreement.rates();
        let kappa = agreement.kappa();
        agrees &= kappa.is_none_or(|kappa| kappa >= MIN_KAPPA) && (object - full).abs() <= MAX_DIFFERENCE;
        let shown = kappa.map_or_else(|| "-".to_owned(), |kappa| format!("{kappa:.3}"));
        let differing: Vec<_> = agreement.pairs.iter().filter(|pair| pair.differs()).collect();
        println!(
            "{name}: kappa {shown}, collisions {:.1} % object, {:.1} % full, {} differ",
            100.0 * object,
            100.0 * full,
            differing.len()
        );
        for pair in differing {
            let rear =
                pair.rear.map_or_else(String::new, |(class, paint)| format!("{}, paint {paint:.2}", class.name()));
            let only = if pair.object.has_collided { "object" } else { "full" };
            lists.push_str(&format!(
                "{name}, sample {}: collides with {only} only; {rear}; {}\n",
                pair.sample,
                pair.reason()
            ));
        }
    }
    print!("{lists}");
    Ok(if agrees { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
