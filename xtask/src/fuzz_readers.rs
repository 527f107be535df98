//! Feeds damaged files to the readers of trajectory data, and looks for panics, hangs and invalid
//! results.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- fuzz-readers commonroad 120
//! cargo run --release -p closecall-xtask -- fuzz-readers all 60 7
//! ```
//!
//! Arguments: the reader (`ngsim`, `csv`, `highd`, `exid`, `commonroad`, `in-car`, or `all` for one
//! after the other), the seconds per reader, and a seed (default 0). The fuzzer starts from the
//! small files in `scenarios/fuzz`. It changes single bytes, replaces fields, swaps columns,
//! repeats and deletes lines, copies and deletes blocks, replaces separators, and cuts off ends. It
//! compresses a quarter of the results with gzip, and damages half of those again. It needs no
//! special compiler.
//!
//! It reports: a panic; more than two seconds for one file of some kilobytes; a number that is not
//! finite; a track that is empty, lacks line numbers or is not evenly spaced; two tracks with one
//! number; an error that does not name the file. It then writes the damaged file and prints its
//! path.

use std::io::{Cursor, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use closecall_recorded::trajectory_data::{BadRows, ReadOptions, Tracks, TrajectoryFileError, open, open_from};

const READERS: [&str; 6] = ["ngsim", "csv", "highd", "exid", "commonroad", "in-car"];

/// Maximum time for one file.
const MAX_DURATION: Duration = Duration::from_secs(2);

/// Number of attempts for a file that exceeds the maximum time.
const ATTEMPTS: u32 = 3;

/// Maximum number of damages per file.
const MAX_DAMAGES: u64 = 6;

/// Maximum size of a damaged file (bytes).
const MAX_BYTES: usize = 1 << 18;

/// Values at which readers, here or elsewhere, have failed.
const VALUES: [&str; 30] = [
    "",
    "0",
    "-0",
    "1",
    "-1",
    "0.0",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "1e308",
    "1e-320",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "999999999999",
    "1000000000",
    "255",
    "256",
    "1,156",
    "\"",
    "\"1,2",
    ";",
    "1;2;3",
    "é",
    "\0",
    "0x1f",
    "true",
    "&amp;",
    "<x>",
];

/// A small random number generator (SplitMix64), so that a seed reproduces a run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Returns a random number below `end`.
    fn below(&mut self, end: usize) -> usize {
        if end == 0 { 0 } else { usize::try_from(self.next() % end as u64).unwrap_or(0) }
    }

    fn pick<'t, T>(&mut self, items: &'t [T]) -> Option<&'t T> {
        let index = self.below(items.len());
        items.get(index)
    }

    /// Returns a random range of at most `most` items within `length`.
    fn range(&mut self, length: usize, most: usize) -> std::ops::Range<usize> {
        let start = self.below(length);
        start..(start + self.below(most) + 1).min(length)
    }
}

/// Returns the ranges of the parts of `bytes` between separators.
fn parts(bytes: &[u8], is_separator: impl Fn(u8) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut start = 0;
    let mut ranges = Vec::new();
    for (index, byte) in bytes.iter().enumerate() {
        if is_separator(*byte) {
            ranges.push(start..index);
            start = index + 1;
        }
    }
    ranges.push(start..bytes.len());
    ranges
}

/// Damages `bytes` once, in a random way.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    let lines = parts(bytes, |byte| byte == b'\n');
    let line = random.pick(&lines).cloned().unwrap_or(0..0);
    match random.below(12) {
        0 => {
            let index = random.below(bytes.len());
            if let Some(byte) = bytes.get_mut(index) {
                *byte ^= 1 << random.below(8);
            }
        }
        1 => bytes.truncate(random.below(bytes.len() + 1)),
        2 => {
            let range = random.range(bytes.len(), 40);
            bytes.drain(range);
        }
        3 => {
            let block = bytes[random.range(bytes.len(), 200)].to_vec();
            let index = random.below(bytes.len() + 1);
            bytes.splice(index..index, block);
        }
        // Replace a field of a line or the content of an element.
        4..=6 => {
            let fields = parts(bytes, |byte| b",; \n<>\"".contains(&byte));
            let field = random.pick(&fields).cloned().unwrap_or(0..0);
            let value = random.pick(&VALUES).copied().unwrap_or_default();
            bytes.splice(field, value.bytes());
        }
        // Repeat a line at another position.
        7 => {
            let text = bytes[line.start..(line.end + 1).min(bytes.len())].to_vec();
            let at = random.pick(&lines).map_or(0, |other| other.start);
            let text = text.repeat(1 + random.below(20));
            bytes.splice(at..at, text);
        }
        8 => {
            bytes.drain(line.start..(line.end + 1).min(bytes.len()));
        }
        // Swap two columns in every line.
        9 => swap_columns(bytes, random),
        10 => {
            let fields = parts(bytes, |byte| b",; \n<>".contains(&byte));
            let (first, second) = (random.pick(&fields).cloned(), random.pick(&fields).cloned());
            if let (Some(first), Some(second)) = (first, second) {
                let text = bytes[first].to_vec();
                bytes.splice(second, text);
            }
        }
        _ => {
            let (from, to) =
                [(&b"\n"[..], &b"\r\n"[..]), (b",", b"\t"), (b",", b";"), (b"\n", b""), (b"<", b"<<")][random.below(5)];
            let mut out = Vec::new();
            for byte in bytes.iter() {
                if from == [*byte] { out.extend_from_slice(to) } else { out.push(*byte) }
            }
            *bytes = out;
        }
    }
    bytes.truncate(MAX_BYTES);
}

fn swap_columns(bytes: &mut Vec<u8>, random: &mut Random) {
    let (first, second) = (random.below(18), random.below(18));
    let mut out = Vec::with_capacity(bytes.len());
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let mut fields: Vec<&[u8]> = line.split(|byte| *byte == b',').collect();
        if first.max(second) < fields.len() {
            fields.swap(first, second);
        }
        out.extend_from_slice(&fields.join(&b','));
    }
    *bytes = out;
}

/// The intact files of one reader from which fuzzing starts: name and content.
type Corpus = Vec<(String, Vec<u8>)>;

fn corpus(reader: &str) -> std::io::Result<Corpus> {
    let folder = Path::new(crate::ROOT).join("scenarios/fuzz").join(reader);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        files.push((name, std::fs::read(&path)?));
    }
    files.sort();
    Ok(files)
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    drop(encoder.write_all(bytes));
    encoder.finish().unwrap_or_default()
}

/// Returns the first defect in the result of a reader, if any.
fn judge(tracks: Result<Tracks<'_>, TrajectoryFileError>) -> Option<String> {
    let mut tracks = match tracks {
        Ok(tracks) => tracks,
        Err(error) => return judge_error(&error),
    };
    let mut numbers = std::collections::BTreeSet::new();
    loop {
        let track = match tracks.next_track() {
            Ok(Some(track)) => track,
            Ok(None) => return None,
            Err(error) => return judge_error(&error),
        };
        let points = &track.trajectory.points;
        if points.is_empty() || points.len() != track.lines.len() || !numbers.insert(track.trajectory.track_id) {
            return Some(format!("track {} is empty, lacks lines or comes twice", track.trajectory.track_id));
        }
        let is_finite = |point: &closecall_traffic::TrajectoryPoint| {
            [
                point.s_m,
                point.d_m,
                point.speed_mps,
                point.acceleration_mps2,
                point.lateral_speed_mps,
                point.lateral_acceleration_mps2,
            ]
            .iter()
            .all(|value| value.is_finite())
        };
        if !points.iter().all(is_finite) {
            return Some("a number is not finite".to_owned());
        }
        let period_ns = tracks.period().ns();
        let is_even = |pair: &[closecall_traffic::TrajectoryPoint]| {
            ((pair[1].time - pair[0].time).ns() - period_ns).abs() * 20 <= period_ns
        };
        if period_ns <= 0 || !points.windows(2).all(is_even) {
            return Some("the instants of a track are not evenly spaced".to_owned());
        }
    }
}

fn judge_error(error: &TrajectoryFileError) -> Option<String> {
    let name = error.path.file_name()?.to_string_lossy().into_owned();
    (!error.to_string().contains(&name)).then(|| format!("an error does not name the file: {error}"))
}

/// The state of fuzzing one reader.
struct Target {
    reader: String,
    corpus: Corpus,
    folder: tempfile::TempDir,
    random: Random,
}

impl Target {
    fn damaged(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for _ in 0..1 + self.random.next() % MAX_DAMAGES {
            damage(&mut bytes, &mut self.random);
        }
        if self.random.below(4) == 0 {
            bytes = packed(&bytes);
            if self.random.below(2) == 0 {
                damage(&mut bytes, &mut self.random);
            }
        }
        bytes
    }

    /// Reads a damaged file. Returns the defect found, if any, or the panic.
    fn judged(
        &self,
        name: &String,
        bytes: &[u8],
        options: ReadOptions,
        window: usize,
    ) -> std::io::Result<std::thread::Result<Option<String>>> {
        if self.reader != "highd" && self.reader != "exid" {
            let path = PathBuf::from(name);
            return Ok(catch_unwind(AssertUnwindSafe(|| judge(open_from(Cursor::new(bytes), &path, options, window)))));
        }
        for (other, whole) in &self.corpus {
            let path = self.folder.path().join(other);
            // Some file systems wait for the disk when a file is overwritten.
            drop(std::fs::remove_file(&path));
            std::fs::write(&path, if other == name { bytes } else { whole })?;
        }
        let path = self.folder.path().join("07_tracks.csv");
        Ok(catch_unwind(AssertUnwindSafe(|| judge(open(&path, options)))))
    }

    /// Damages and reads one file. Returns the defect, if any, and the damaged file.
    fn once(&mut self) -> std::io::Result<Option<(String, Corpus)>> {
        let which = self.random.below(self.corpus.len());
        let Some((name, bytes)) = self.corpus.get(which).cloned() else { return Ok(None) };
        let bytes = self.damaged(&bytes);
        let bad_rows = if self.random.below(2) == 0 { BadRows::Reject } else { BadRows::Skip };
        let window = [usize::MAX, 1 << 20, 16][self.random.below(3)];
        let options = ReadOptions { bad_rows, ..ReadOptions::default() };
        let mut judged = Ok(None);
        let mut fastest = Duration::MAX;
        // On a busy machine, any file may be slow once.
        for _ in 0..ATTEMPTS {
            let begun = Instant::now();
            judged = self.judged(&name, &bytes, options, window)?;
            fastest = fastest.min(begun.elapsed());
            if fastest <= MAX_DURATION {
                break;
            }
        }
        let wrong = match judged {
            Err(_) => Some("a panic".to_owned()),
            Ok(None) if fastest > MAX_DURATION => Some(format!("it took {:.1} s", fastest.as_secs_f64())),
            Ok(wrong) => wrong,
        };
        Ok(wrong.map(|wrong| (wrong, vec![(name, bytes)])))
    }
}

#[expect(clippy::print_stdout, reason = "a task speaks to people")]
fn fuzz(reader: &str, seconds: u64, seed: u64) -> std::io::Result<bool> {
    let folder = tempfile::tempdir()?;
    let mut target = Target { reader: reader.to_owned(), corpus: corpus(reader)?, folder, random: Random(seed) };
    let begun = Instant::now();
    let mut count = 0_u64;
    while begun.elapsed() < Duration::from_secs(seconds) {
        count += 1;
        if let Some((wrong, files)) = target.once()? {
            for (name, bytes) in files {
                let path = std::env::temp_dir().join(format!("fuzz-{reader}-{seed}-{count}-{name}"));
                std::fs::write(&path, bytes)?;
                println!("{reader}: {wrong}: {}", path.display());
            }
            return Ok(false);
        }
    }
    println!("{reader}: {count} damaged files, nothing wrong");
    Ok(true)
}

#[expect(clippy::print_stderr, reason = "a task speaks to people")]
pub(crate) fn main(args: Vec<String>) -> ExitCode {
    let (reader, seconds, seed) =
        (args.first(), args.get(1).map(|text| text.parse()), args.get(2).map(|text| text.parse()));
    let (Some(reader), Some(Ok(seconds)), Ok(seed)) = (reader, seconds, seed.unwrap_or(Ok(0))) else {
        eprintln!("usage: fuzz-readers {}|all SECONDS [SEED]", READERS.join("|"));
        return ExitCode::from(2);
    };
    let readers: Vec<&str> = READERS.into_iter().filter(|name| reader == "all" || reader == name).collect();
    let mut is_fine = !readers.is_empty();
    for reader in readers {
        match fuzz(reader, seconds, seed) {
            Ok(fine) => is_fine &= fine,
            Err(error) => {
                eprintln!("failed to fuzz {reader}: {error}");
                is_fine = false;
            }
        }
    }
    if is_fine { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
