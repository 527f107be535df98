//! A minimized case in words.

use std::fmt;
use std::path::Path;

use closecall_campaign::action::CommandFor;
use closecall_traffic::readable;
use closecall_traffic::words::counted;

use super::{Minimized, MinimizedFiles, NearestFailure, WithoutOutcome};

/// A minimized case as text for readers.
#[derive(Clone, Copy, Debug)]
pub struct MinimizedText<'a> {
    /// The case.
    pub minimized: &'a Minimized,
    /// The files of the case.
    pub files: &'a MinimizedFiles,
    /// The commands that run them.
    pub command_for: CommandFor,
}

impl fmt::Display for MinimizedText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { minimized, files, command_for } = self;
        match &minimized.nearest {
            Some(nearest) => write_nearest(f, minimized, nearest)?,
            None => write_smallest(f, minimized)?,
        }
        if let Some(why) = &minimized.why_more_than_three {
            writeln!(f, "  {why}")?;
        }
        if let Some(WithoutOutcome { runs, message }) = &minimized.without_outcome {
            let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
            let runs = counted(*runs, "run");
            writeln!(f, "  {runs} of the search ended in an ERROR and count as not failing, such as: {message}")?;
        }
        writeln!(f, "{}", minimized.sentence)?;
        if let Some(reference) = &minimized.reference {
            writeln!(f, "no vehicle collides in it with {reference}")?;
        }
        let command = |path: &Path| minimized.run_command(&path.display().to_string(), *command_for);
        writeln!(f, "fails:  {}", command(&files.failing))?;
        match (&minimized.twin, &files.twin) {
            (Some(twin), Some(path)) => {
                writeln!(f, "passes when {}", twin.words)?;
                write!(f, "passes: {}", command(path))
            }
            _ => write!(f, "no near case that passes was found"),
        }
    }
}

fn write_smallest(f: &mut fmt::Formatter<'_>, minimized: &Minimized) -> fmt::Result {
    writeln!(
        f,
        "{} sample {} ({}, {} sensors): {} of {} parameters must be off their nominal values",
        minimized.scenario,
        minimized.sample,
        minimized.controller,
        minimized.sensors,
        minimized.off_nominal.len(),
        minimized.sampled_off_nominal,
    )?;
    for offset in &minimized.off_nominal {
        let distance = offset.distance_sd.map(|sd| format!(", {:.2} standard deviations off", sd.abs()));
        let sampled = offset.sampled.parse().map_or_else(|_| offset.sampled.clone(), readable);
        writeln!(f, "  {}{} (sample: {sampled})", offset.words, distance.unwrap_or_default())?;
    }
    match minimized.distance_sd {
        Some(distance_sd) => writeln!(f, "  together {distance_sd:.2} standard deviations from the nominal case"),
        None => Ok(()),
    }
}

fn write_nearest(f: &mut fmt::Formatter<'_>, minimized: &Minimized, nearest: &NearestFailure) -> fmt::Result {
    let Minimized { scenario, sample, controller, sensors, .. } = minimized;
    let distance_sd = minimized.distance_sd.unwrap_or_default();
    writeln!(
        f,
        "{scenario} ({controller}, {sensors} sensors): the nearest failure found is {distance_sd:.2} standard deviations from \
         the nominal case"
    )?;
    if minimized.off_nominal.is_empty() {
        writeln!(f, "  the nominal case itself fails with the random numbers of sample {sample}")?;
    }
    for offset in &minimized.off_nominal {
        let difference = offset.difference_words.as_ref().map(|words| format!(": {words}"));
        let distance = offset.distance_sd.map(|sd| format!(", {sd:+.2} standard deviations"));
        writeln!(f, "  {}{}{}", offset.words, difference.unwrap_or_default(), distance.unwrap_or_default())?;
    }
    writeln!(
        f,
        "  {}, from {} of {}, with the random numbers of sample {sample}",
        counted(nearest.runs, "run"),
        nearest.starts,
        counted(nearest.failing, "failing sample"),
    )?;
    writeln!(f, "  {}: a nearer failure may exist", nearest.why_it_ended())
}
