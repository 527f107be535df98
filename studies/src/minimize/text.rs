//! A minimized case in words.

use std::fmt;
use std::path::Path;

use closecall_campaign::action::CommandFor;

use super::{Minimized, MinimizedFiles};

/// A minimized case as text for readers.
#[derive(Clone, Copy, Debug)]
pub struct MinimizedText<'a> {
    /// The case.
    pub minimized: &'a Minimized,
    /// Its files.
    pub files: &'a MinimizedFiles,
    /// The commands that run them.
    pub command_for: CommandFor,
}

impl fmt::Display for MinimizedText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { minimized, files, command_for } = self;
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
            writeln!(f, "  {}{} (sample: {})", offset.words, distance.unwrap_or_default(), offset.sampled)?;
        }
        if let Some(distance_sd) = minimized.distance_sd {
            writeln!(f, "  together {distance_sd:.2} standard deviations from the nominal case")?;
        }
        if let Some(why) = &minimized.why_more_than_three {
            writeln!(f, "  {why}")?;
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
