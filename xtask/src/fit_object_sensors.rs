//! Fits the rear object-level sensor to the full chain, and writes the file that ships.
//!
//!     cargo run --release -p closecall-xtask -- fit-object-sensors                # sensors/data/rear-object.toml
//!     cargo run --release -p closecall-xtask -- fit-object-sensors -n 2 -o own.toml
//!     cargo run --release -p closecall-xtask -- fit-object-sensors --errors       # the errors alone, with the ranges as built
//!     cargo run --release -p closecall-xtask -- fit-object-sensors --ranges       # the ranges alone, with the errors as built
//!     cargo run --release -p closecall-xtask -- fit-object-sensors --pitched      # the ranges under pitches of the ego alone
//!     cargo run --release -p closecall-xtask -- fit-object-sensors --validate --seed 1
//!
//! A fit takes some minutes. The next build puts the figures into the sensor. With `--validate`,
//! the program measures the errors, delays and misses of the sensor and of the full chain. It
//! writes them into the file as `[validation]`, and prints every difference that matters. The
//! results depend on the seed and on the number of approaches, and not on the number of threads.

#![expect(clippy::print_stdout, reason = "a command prints its result")]

use std::path::{Path, PathBuf};

use closecall::scenarios::source;
use closecall::traffic::atomic::write_file;
use closecall_sensors::{Chain, RearFit};
use closecall_studies::perception::fit::{FitPlan, at_bounds, fit, fit_errors, fit_pitched, fit_ranges};
use closecall_studies::perception::validation::{Measured, differences, measure, table};

/// First line of the file.
const HEAD: &str =
    "# The rear object-level sensor, fitted to the full chain by xtask fit-object-sensors. Not edited by hand.\n\n";

/// Fits the rear object-level sensor to the full chain.
/// What the command line says.
#[derive(clap::Parser)]
pub(crate) struct Args {
    /// Number of approaches of each point of the grid
    #[arg(short = 'n', long, default_value_t = 6)]
    approaches: u64,
    /// The seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The file to write
    #[arg(short, long, default_value = "sensors/data/rear-object.toml")]
    output: PathBuf,
    /// The fit to validate, or whose ranges or errors stay, in place of the one that is built in
    #[arg(long)]
    fit: Option<PathBuf>,
    /// Fit the errors and losses alone; the ranges stay as they are
    #[arg(long, conflicts_with = "validate")]
    errors: bool,
    /// Fit the ranges alone; the errors, losses and scores stay as they are
    #[arg(long, conflicts_with_all = ["validate", "errors"])]
    ranges: bool,
    /// Fit the ranges under pitches of the ego alone; all else stays as it is
    #[arg(long, conflicts_with_all = ["validate", "errors", "ranges"])]
    pitched: bool,
    /// Measure the sensor as built beside the full chain, in place of a fit
    #[arg(long)]
    validate: bool,
}

pub(crate) fn main(args: Args) -> Result<(), Box<dyn std::error::Error>> {
    let file = source::load(Path::new("low-thw-overtake"), &[])?;
    let plan = FitPlan {
        file: &file,
        seed: args.seed,
        approaches: args.approaches,
        command: format!(
            "cargo run --release -p closecall-xtask -- fit-object-sensors {}{}-n {} --seed {}",
            args.fit.as_ref().map_or_else(String::new, |path| format!("--fit {} ", path.display())),
            match args {
                Args { validate: true, .. } => "--validate ",
                Args { errors: true, .. } => "--errors ",
                Args { ranges: true, .. } => "--ranges ",
                Args { pitched: true, .. } => "--pitched ",
                _ => "",
            },
            args.approaches,
            args.seed
        ),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let fitted = match &args.fit {
        Some(path) => read_fit(path)?,
        None => RearFit::shipped()?.clone(),
    };
    let model = match args {
        Args { validate: true, .. } => validated(&plan, fitted)?,
        Args { errors: true, .. } => fit_errors(&plan, &fitted)?,
        Args { ranges: true, .. } => fit_ranges(&plan, &fitted)?,
        Args { pitched: true, .. } => fit_pitched(&plan, &fitted)?,
        _ => fit(&plan)?,
    };
    at_bounds(&model).iter().for_each(|warning| println!("warning: {warning}"));
    let text = format!("{HEAD}{}", toml::to_string(&model)?);
    write_file(&args.output, |file| file.write_all(text.as_bytes()))?;
    println!("written: {}", args.output.display());
    Ok(())
}

/// Reads the file of a fit.
///
/// # Errors
/// A text that names the file, and what is wrong with it.
pub(crate) fn read_fit(path: &Path) -> Result<RearFit, String> {
    std::fs::read_to_string(path)
        .map_err(|error| error.to_string())
        .and_then(|text| RearFit::parse(&text).map_err(|error| error.to_string()))
        .map_err(|error| format!("failed to read {}: {error}", path.display()))
}

/// Returns the fit with measurements of its tracks and of the full chain's tracks.
fn validated(plan: &FitPlan<'_>, fit: RearFit) -> Result<RearFit, Box<dyn std::error::Error>> {
    let measured = measure(plan, Some(&fit), |_, _, _| true)?;
    let table = table(plan, &measured);
    print(&measured);
    for row in differences(&table) {
        let [visibility_m, rain_mm_per_h] = row.weather;
        println!(
            "differs: {}, paint {}, visibility {visibility_m} m, rain {rain_mm_per_h} mm/h: {} {} in the full chain, {} at object level",
            row.class.name(),
            row.paint,
            row.figure,
            row.full,
            row.object
        );
    }
    Ok(RearFit { validation: Some(table), ..fit })
}

/// Prints what was measured: root mean square errors along (m), across (m) and of the speed (m/s)
/// up to 50 m and beyond, their correlation times (s), delays (s), misses, and lags (s).
fn print(measured: &[Measured]) {
    for row in measured {
        let (class, paint, [visibility_m, rain_mm_per_h]) = row.at;
        println!("{}, paint {paint}, visibility {visibility_m} m, rain {rain_mm_per_h} mm/h", class.name());
        for chain in [Chain::Full, Chain::Object] {
            let errors = row.of(chain);
            let [near, far] = errors.near_far_sd;
            println!(
                "  {chain:?}: near {near:.3?}, far {far:.3?}, time {:.1?}, after {:.2?}, missed {:.3} (longest {:.2} s), coasting {:.3}, lag {:.2?}",
                errors.time_s, errors.after_s, errors.missed, errors.longest_gap_s, errors.coasting, errors.lag_s
            );
        }
    }
}
