//! Compares the verdicts of the object-level sensors with the verdicts of the full chain, sample by
//! sample.
//!
//!     cargo run --release -p closecall-xtask -- validate-object-sensors -n 1000
//!
//! Prints Cohen's κ, the collision rates and the differences of the engagement distances in clear
//! air, rain (10 mm/h), fog (visibility 100 m) and at night, and lists every sample on which the
//! modes differ with its reason. `--rows` writes all samples. The exit code is 1 in three cases:
//! some κ is below 0.8, or undefined because no run or every run collides; rates differ by more
//! than 2 percentage points; no condition has the given name. A thousand samples take about half an
//! hour on two cores.
#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::fmt::{self, Display, Formatter};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::fit_object_sensors::read_fit;
use closecall::scenarios::source;
use closecall::traffic::statistics::quantiles::quantile;
use closecall::traffic::{Appearance, Plate, VehicleClass};
use closecall_studies::perception::agreement::{Agreement, Beside, Pair};

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

/// Difference of the rear gaps at the engagement up to which the modes engage alike (m): the goal
/// of the requirement.
const NEAR_M: f64 = 5.0;

/// Compares the object-level sensors with the full chain.
/// What the command line says.
#[derive(clap::Parser)]
pub(crate) struct Args {
    /// The scenario: a name of the library, or a file
    #[arg(default_value = "low-thw-overtake")]
    scenario: String,
    /// Number of samples in each condition
    #[arg(short = 'n', long, default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(1..))]
    samples: u64,
    /// The seed
    #[arg(long, default_value_t = 2026)]
    seed: u64,
    /// Only the conditions whose names contain this text, such as `fog`
    #[arg(long, default_value = "")]
    condition: String,
    /// Compare the full chain with itself under other noise of the rear sensors, in place of the
    /// object-level sensors: no model can agree better
    #[arg(long, conflicts_with = "fit")]
    ceiling: bool,
    /// The fit of the object-level sensor, in place of the one that is built in
    #[arg(long)]
    fit: Option<PathBuf>,
    /// Also write each sample as a row of this CSV file: appearance of the rear vehicle, and gap
    /// and time of the engagement
    #[arg(long)]
    rows: Option<PathBuf>,
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Box<dyn std::error::Error>> {
    let comparison = compare(&args)?;
    print!("{comparison}");
    if let Some(path) = &args.rows {
        write_rows(path, &comparison)?;
    }
    Ok(if comparison.agrees() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The agreement in one condition.
struct Compared {
    name: &'static str,
    agreement: Agreement,
}

/// The agreement in each condition.
struct Comparison {
    scenario: String,
    samples: u64,
    seed: u64,
    conditions: Vec<Compared>,
}

/// Compares the verdicts in each condition that is asked for.
///
/// # Errors
/// If no condition has such a name, the scenario cannot be read, or a run fails.
fn compare(args: &Args) -> Result<Comparison, Box<dyn std::error::Error>> {
    let wanted = CONDITIONS.into_iter().filter(|(name, _)| name.contains(&args.condition));
    let beside = match &args.fit {
        Some(path) => Beside::Fit(Box::leak(Box::new(read_fit(path)?))),
        None if args.ceiling => Beside::OtherNoise,
        None => Beside::Object,
    };
    let mut conditions = Vec::new();
    for (name, settings) in wanted {
        let settings = settings.iter().map(|text| text.parse()).collect::<Result<Vec<_>, _>>()?;
        let file = source::load(Path::new(&args.scenario), &settings)?;
        conditions.push(Compared { name, agreement: Agreement::beside(beside, &file, args.seed, args.samples)? });
    }
    if conditions.is_empty() {
        let names = CONDITIONS.map(|(name, _)| name).join("`, `");
        return Err(
            format!("--condition is `{}`, which is part of no name; the names are `{names}`", args.condition).into()
        );
    }
    let Args { samples, seed, .. } = *args;
    Ok(Comparison { scenario: args.scenario.clone(), samples, seed, conditions })
}

impl Compared {
    /// Returns whether the verdicts agree. Without κ, chance alone explains them, and nothing is
    /// known.
    fn agrees(&self) -> bool {
        let [object, full] = self.agreement.rates();
        self.agreement.kappa().is_some_and(|kappa| kappa >= MIN_KAPPA) && (object - full).abs() <= MAX_DIFFERENCE
    }
}

impl Comparison {
    /// Returns whether something was compared, and agrees in each condition.
    fn agrees(&self) -> bool {
        let is_compared = |condition: &Compared| !condition.agreement.pairs.is_empty();
        !self.conditions.is_empty()
            && self.conditions.iter().all(|condition| is_compared(condition) && condition.agrees())
    }
}

impl Display for Comparison {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { scenario, samples, seed, .. } = self;
        writeln!(f, "{scenario}, {samples} samples, seed {seed}")?;
        for Compared { name, agreement } in &self.conditions {
            let [object, full] = agreement.rates().map(|rate| 100.0 * rate);
            let kappa = agreement.kappa();
            let kappa = kappa.map_or_else(|| "undefined".to_owned(), |kappa| format!("{kappa:.3}"));
            let differ = agreement.pairs.iter().filter(|pair| pair.differs()).count();
            writeln!(f, "{name}: kappa {kappa}, collisions {object:.1} % object, {full:.1} % full, {differ} differ")?;
            write_engagements(f, agreement)?;
        }
        for Compared { name, agreement } in &self.conditions {
            for pair in agreement.pairs.iter().filter(|pair| pair.differs()) {
                let rear = pair.rear.map_or_else(String::new, |(class, appearance)| described(class, &appearance));
                let only = if pair.object.has_collided { "object" } else { "full" };
                let (sample, reason) = (pair.sample, pair.reason());
                writeln!(f, "{name}, sample {sample}: collides with {only} only; {rear}; {reason}")?;
            }
        }
        Ok(())
    }
}

/// Writes how the distances of the engagements agree.
fn write_engagements(f: &mut Formatter<'_>, agreement: &Agreement) -> fmt::Result {
    let differences_m = agreement.engagement_differences_m();
    let (alone, samples) = (agreement.engaged_in_one_mode(), agreement.pairs.len());
    let near = differences_m.iter().filter(|difference_m| difference_m.abs() <= NEAR_M).count();
    write!(
        f,
        "  engagement: one mode alone in {alone} of {samples}; within {NEAR_M} m in {near} of {}",
        differences_m.len()
    )?;
    if differences_m.is_empty() {
        return writeln!(f);
    }
    let [low_m, high_m] = [0.05, 0.95].map(|share| quantile(&differences_m, share));
    writeln!(f, "; object less full, 5 to 95 %: {low_m:+.1} to {high_m:+.1} m")
}

fn described(class: VehicleClass, appearance: &Appearance) -> String {
    let Appearance { paint_reflectivity, body_shape, plate, .. } = appearance;
    let plate = match plate {
        Plate::Clean => "clean",
        Plate::Dirty => "dirty",
        Plate::None => "no",
    };
    format!("{}, {}, {plate} plate, paint {paint_reflectivity:.2}", class.name(), body_shape.name())
}

/// Writes one row for each sample and condition.
///
/// # Errors
/// If the file cannot be written.
fn write_rows(path: &Path, comparison: &Comparison) -> Result<(), Box<dyn std::error::Error>> {
    let mut rows = csv::Writer::from_path(path)?;
    rows.write_record([
        "condition",
        "sample",
        "class",
        "shape",
        "plate",
        "paint",
        "object_engaged_m",
        "full_engaged_m",
        "object_engaged_s",
        "full_engaged_s",
        "object_collided",
        "full_collided",
    ])?;
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.3}"));
    for Compared { name, agreement } in &comparison.conditions {
        for Pair { sample, rear, object, full } in &agreement.pairs {
            let [class, shape, plate, paint] = rear.map_or_else(Default::default, |(class, appearance)| {
                let Appearance { paint_reflectivity, body_shape, plate, .. } = appearance;
                [
                    class.name().to_owned(),
                    body_shape.name().to_owned(),
                    format!("{plate:?}").to_lowercase(),
                    format!("{paint_reflectivity:.4}"),
                ]
            });
            let [object_m, full_m, object_s, full_s] =
                [object.engaged_at_m, full.engaged_at_m, object.engaged_at_s, full.engaged_at_s].map(number);
            rows.write_record([
                (*name).to_owned(),
                sample.to_string(),
                class,
                shape,
                plate,
                paint,
                object_m,
                full_m,
                object_s,
                full_s,
                object.has_collided.to_string(),
                full.has_collided.to_string(),
            ])?;
        }
    }
    rows.flush()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use closecall_studies::perception::agreement::Verdict;

    use super::*;

    fn args(more: &[&str]) -> Args {
        Args::parse_from(["validate-object-sensors"].iter().chain(more))
    }

    #[test]
    fn a_condition_is_compared_and_each_differing_sample_listed() {
        let comparison = compare(&args(&["-n", "24", "--condition", "fog"])).unwrap();
        let text = comparison.to_string();
        assert_eq!(comparison.conditions.len(), 1);
        assert!(text.contains("fog, 100 m: kappa ") && !text.contains("undefined"), "{text}");
        let differ = comparison.conditions[0].agreement.pairs.iter().filter(|pair| pair.differs()).count();
        assert_eq!(text.matches(", sample ").count(), differ, "{text}");
    }

    #[test]
    fn an_unknown_condition_is_answered_with_the_names() {
        let message = compare(&args(&["--condition", "nihgt"])).err().unwrap().to_string();
        assert!(
            message.contains("`nihgt`") && message.contains("`rain, 10 mm/h`") && message.contains("`night`"),
            "{message}"
        );
        assert!(Args::try_parse_from(["validate-object-sensors", "-n", "0"]).is_err());
    }

    #[test]
    fn agreement_by_chance_or_without_a_comparison_does_not_count() {
        let verdict = |has_collided| Verdict {
            has_collided,
            engaged_at_s: None,
            engaged_at_m: None,
            released_at_s: None,
            min_gap_rear_m: None,
        };
        let pair = |object, full| Pair { sample: 0, rear: None, object: verdict(object), full: verdict(full) };
        let comparison = |conditions: &[&[Pair]]| Comparison {
            scenario: String::new(),
            samples: 0,
            seed: 0,
            conditions: conditions
                .iter()
                .map(|pairs| Compared { name: "night", agreement: Agreement { pairs: pairs.to_vec() } })
                .collect(),
        };
        assert!(comparison(&[&[pair(true, true), pair(false, false)]]).agrees());
        assert!(!comparison(&[&[pair(false, false)]]).agrees(), "no run collides");
        assert!(!comparison(&[&[pair(true, true)]]).agrees(), "every run collides");
        assert!(
            !comparison(&[&[pair(true, true), pair(false, false)], &[]]).agrees(),
            "no sample in the second condition"
        );
        assert!(!comparison(&[]).agrees(), "no condition");
        assert!(!comparison(&[&[pair(true, false), pair(false, true)]]).agrees());
    }
}
