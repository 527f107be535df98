//! Checks that interrupted and partitioned campaigns give the same `outcomes.parquet` as an
//! undisturbed one.
//!
//! A campaign of 10,000 paired samples is killed five times at random moments and resumed, once
//! with one job and once with two. Another one is split into three partitions, as for three
//! machines, and merged.
//!
//! ```sh
//! cargo build --release && cargo run --release -p closecall-xtask -- validate-durability [SAMPLES] [SEED]
//! ```
//!
//! The seed determines the moments, relative to the duration of the undisturbed campaign. Whether a
//! moment falls into a sample, a line of the journal or a report depends on the machine.

use std::error::Error;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use closecall_traffic::{ActorId, stream};
use rand::RngExt;

const KILLS: u64 = 5;
const PARTS: u64 = 3;

/// The campaign that all variants run.
struct Setup {
    binary: PathBuf,
    scenario: String,
    samples: String,
    seed: u64,
}

impl Setup {
    fn command(&self, out: &Path, more: &[&str]) -> Command {
        let mut command = Command::new(&self.binary);
        command.args(["campaign", &self.scenario, "-n", &self.samples, "--seed", &self.seed.to_string(), "--paired"]);
        command.args(["--recordings", "1", "--out"]).arg(out).args(more).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    fn run(&self, out: &Path, more: &[&str]) -> Result<Duration, Box<dyn Error>> {
        let started = Instant::now();
        let status = self.command(out, more).status()?;
        if status.success() { Ok(started.elapsed()) } else { Err(format!("{status}: {more:?}").into()) }
    }

    /// Starts a campaign once for each span and kills it after that span, then resumes it to its
    /// end. Returns how often it was killed before it had ended.
    fn run_killed(&self, out: &Path, jobs: &str, spans: &[Duration]) -> Result<u32, Box<dyn Error>> {
        let more = ["--jobs", jobs, "--resume"];
        let mut killed = 0;
        for span in spans {
            let mut child = self.command(out, &more).spawn()?;
            std::thread::sleep(*span);
            if child.try_wait()?.is_none() {
                killed += 1;
            }
            child.kill()?;
            child.wait()?;
            let journal = std::fs::metadata(out.join("journal.jsonl")).map_or(0, |journal| journal.len());
            say(format_args!("  killed after {:.2} s, the journal has {journal} bytes", span.as_secs_f64()))?;
        }
        self.run(out, &more)?;
        Ok(killed)
    }
}

fn say(text: std::fmt::Arguments<'_>) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_fmt(text)?;
    out.write_all(b"\n")?;
    out.flush()
}

fn hash(folder: &Path) -> Result<String, Box<dyn Error>> {
    let bytes = std::fs::read(folder.join("outcomes.parquet"))?;
    Ok(blake3::hash(&bytes).to_string())
}

pub(crate) fn main(words: Vec<String>) -> Result<(), Box<dyn Error>> {
    let mut args = words.into_iter();
    let samples = args.next().unwrap_or_else(|| "10000".to_owned());
    let seed = args.next().map_or(Ok(1), |seed| seed.parse())?;
    let root = Path::new(crate::ROOT);
    let setup = Setup {
        binary: root.join("target/release/closecall"),
        scenario: root.join("scenarios/library/low-thw-overtake.toml").display().to_string(),
        samples,
        seed,
    };
    let folder = tempfile::tempdir()?;
    let place = |name: &str| folder.path().join(name);
    let took = setup.run(&place("undisturbed"), &["--jobs", "2"])?;
    let expected = hash(&place("undisturbed"))?;
    say(format_args!(
        "undisturbed, {} samples, 2 jobs: {:.1} s, BLAKE3 {expected}",
        setup.samples,
        took.as_secs_f64()
    ))?;
    let mut rng = stream(seed, 0, &ActorId::new("validation")?, "kill");
    let mut same = true;
    let mut compare = |subject: &str, text: String| {
        same &= text == expected;
        say(format_args!("{subject}: {}", if text == expected { "the same" } else { "DIFFERENT" }))
    };
    for jobs in ["1", "2"] {
        let spans: Vec<Duration> = (0..KILLS).map(|_| took.mul_f64(0.5 * rng.random::<f64>())).collect();
        let killed = setup.run_killed(&place(jobs), jobs, &spans)?;
        compare(&format!("killed {killed} times, {jobs} jobs"), hash(&place(jobs))?)?;
    }
    let parts: Vec<PathBuf> = (1..=PARTS).map(|part| place(&format!("part-{part}"))).collect();
    for (part, out) in parts.iter().enumerate() {
        let jobs = if part == 0 { "1" } else { "2" };
        setup.run(out, &["--partition", &format!("{}/{PARTS}", part + 1), "--jobs", jobs])?;
    }
    let mut merge = Command::new(&setup.binary);
    merge.args(["tool", "merge"]).args(&parts).arg("--out").arg(place("merged")).args(["--recordings", "1"]);
    let status = merge.stdout(Stdio::null()).status()?;
    if !status.success() {
        return Err(format!("merge: {status}").into());
    }
    compare("three parts, merged", hash(&place("merged"))?)?;
    if same { Ok(()) } else { Err("not the same bytes".into()) }
}
