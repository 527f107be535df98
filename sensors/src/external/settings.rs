//! The keys of the `[sensors]` table that name a program, and what they are checked into.
//!
//! A program is a command or a shared library. The simulation runs both as processes.

use closecall_traffic::{ConfigError, Problem, Time};

use crate::kept::kept;

/// The value of `perception` that stands for the built-in chain.
pub const BUILT_IN: &str = "built-in";

/// What a program is, by the word before the colon of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProgramKind {
    /// A command: `exec:COMMAND`.
    Exec,
    /// A shared library: `lib:PATH`.
    Lib,
    /// An object of the Python program that runs Closecall: `python:NAME`. A file cannot name one
    /// that runs elsewhere.
    Hosted,
}

impl ProgramKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Exec, Self::Lib, Self::Hosted];

    /// Returns the word before the colon.
    pub const fn prefix(self) -> &'static str {
        match self {
            Self::Exec => "exec",
            Self::Lib => "lib",
            Self::Hosted => "python",
        }
    }

    /// Splits a value of `perception` into the kind and what follows the colon; `None` if it names
    /// no program.
    pub fn split(perception: &str) -> Option<(Self, &str)> {
        let (word, rest) = perception.split_once(':')?;
        let kind = Self::ALL.into_iter().find(|kind| kind.prefix() == word)?;
        (!rest.trim().is_empty()).then_some((kind, rest))
    }
}

/// Default time limit of each answer (ms), as for a controller.
pub const DEFAULT_PROGRAM_TIMEOUT_MS: u64 = 1_000;

/// Default limit of the memory of a program (MiB), as for a controller.
pub const DEFAULT_PROGRAM_MEMORY_MIB: u64 = 1_024;

/// Largest time limit (ms), as for a controller.
const MAX_TIMEOUT_MS: u64 = 600_000;

/// Largest limit of memory (MiB), as for a controller.
const MAX_MEMORY_MIB: u64 = 1_048_576;

/// Default distance of the columns and rows of an image that a program gets (px).
pub const DEFAULT_IMAGE_STEP: u8 = 2;

/// Largest such distance (px).
const MAX_IMAGE_STEP: u8 = 8;

/// The images that a program gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSettings {
    /// Time from an image to the next.
    pub period: Time,
    /// Every so many columns and rows of the image are rendered.
    pub step: u8,
}

/// The program that perceives in place of the built-in chain, with its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramSettings {
    /// What the program is.
    pub kind: ProgramKind,
    /// The command with its arguments, with the quotes of a shell, the path of the library, or the
    /// name of the object with its version.
    pub command: &'static str,
    /// Time limit of each answer (ms).
    pub timeout_ms: u64,
    /// Largest resident memory of the process (MiB).
    pub memory_mib: u64,
    /// The images of the rear camera that it gets, if it gets any.
    pub images: Option<ImageSettings>,
    /// The folder in which it runs; `None` for the folder of this program.
    pub folder: Option<&'static str>,
}

impl ProgramSettings {
    /// Returns the program as a scenario names it.
    pub fn name(&self) -> String {
        format!("{}:{}", self.kind.prefix(), self.command)
    }

    /// Returns the same program in another folder.
    pub(crate) fn in_folder(self, folder: &str) -> Self {
        Self { folder: Some(kept(folder)), ..self }
    }
}

/// The keys that name a program, before they are checked.
pub(crate) struct ProgramChecks<'a> {
    pub(crate) perception: &'a str,
    pub(crate) timeout_ms: u64,
    pub(crate) memory_mib: u64,
    /// Images per second (Hz), or 0 for none.
    pub(crate) image_hz: f64,
    pub(crate) image_step: u8,
}

/// Checks the keys that name a program. Returns `None` for the built-in chain.
pub(crate) fn check_program(keys: &ProgramChecks<'_>) -> Result<Option<ProgramSettings>, ConfigError> {
    let limit = |key: &str, value: u64, most: u64, allowed: &'static str| match value {
        value if (1..=most).contains(&value) => Ok(value),
        value => Err(ConfigError::new(key, Problem::WrongCount { value, allowed })),
    };
    let timeout_ms = limit("perception-timeout-ms", keys.timeout_ms, MAX_TIMEOUT_MS, "a number from 1 to 600000")?;
    let memory_mib = limit("perception-memory-mib", keys.memory_mib, MAX_MEMORY_MIB, "a number from 1 to 1048576")?;
    let image_step = keys.image_step;
    if !(1..=MAX_IMAGE_STEP).contains(&image_step) {
        let problem = Problem::WrongCount { value: image_step.into(), allowed: "a number from 1 to 8" };
        return Err(ConfigError::new("perception-image-step", problem));
    }
    // Less than one image in 1,000 s is none.
    let period = (keys.image_hz > 1e-3).then(|| Time::from_s(1.0 / keys.image_hz));
    let images = period.map(|period| ImageSettings { period, step: image_step });
    if keys.perception == BUILT_IN {
        return Ok(None);
    }
    let Some((kind, command)) = ProgramKind::split(keys.perception) else {
        let allowed = "`built-in`, `exec:COMMAND`, `lib:PATH`".to_owned();
        return Err(ConfigError::new(
            "perception",
            Problem::UnknownWord { value: keys.perception.to_owned(), allowed },
        ));
    };
    Ok(Some(ProgramSettings { kind, command: kept(command), timeout_ms, memory_mib, images, folder: None }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(perception: &str, timeout_ms: u64, memory_mib: u64) -> Result<Option<ProgramSettings>, String> {
        let keys = ProgramChecks { perception, timeout_ms, memory_mib, image_hz: 5.0, image_step: DEFAULT_IMAGE_STEP };
        check_program(&keys).map_err(|error| error.to_string())
    }

    #[test]
    fn a_command_is_kept_once_and_other_words_are_refused() {
        assert_eq!(check(BUILT_IN, 1_000, 1_024), Ok(None));
        let program = check("exec:python3 mine.py", 250, 64).unwrap().unwrap();
        assert_eq!((program.command, program.timeout_ms, program.memory_mib), ("python3 mine.py", 250, 64));
        assert_eq!(program.images, Some(ImageSettings { period: Time::from_ms(200), step: 2 }));
        let again = check("exec:python3 mine.py", 1, 1).unwrap().unwrap();
        assert!(std::ptr::eq(program.command, again.command));
        assert_eq!((program.kind, program.name()), (ProgramKind::Exec, "exec:python3 mine.py".to_owned()));
        let library = check("lib:./my perception.so", 250, 64).unwrap().unwrap();
        assert_eq!((library.kind, library.command), (ProgramKind::Lib, "./my perception.so"));
        assert_eq!(library.name(), "lib:./my perception.so");
        let object = check("python:Mine@1a2b", 250, 64).unwrap().unwrap();
        assert_eq!((object.kind, object.name()), (ProgramKind::Hosted, "python:Mine@1a2b".to_owned()));
        for wrong in ["", "python3 mine.py", "exec:", "exec:  ", "lib:", "fmu:./mine.fmu", "builtin"] {
            let error = check(wrong, 1_000, 1_024).unwrap_err();
            assert!(
                error.starts_with("`perception` is ") && error.contains("`exec:COMMAND`, `lib:PATH`"),
                "{wrong}: {error}"
            );
        }
    }

    #[test]
    fn limits_are_checked() {
        let error = check("exec:a", 0, 1_024).unwrap_err();
        assert_eq!(error, "`perception-timeout-ms` is 0, but a number from 1 to 600000 is needed");
        let error = check("exec:a", 1_000, 2_000_000).unwrap_err();
        assert_eq!(error, "`perception-memory-mib` is 2000000, but a number from 1 to 1048576 is needed");
    }
}
