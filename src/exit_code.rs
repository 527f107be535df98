//! Exit codes. An exit code is a verdict or the kind of a failure, never a count.

use closecall_campaign::compare::Regression;
use closecall_campaign::failure::FailureKind;
use closecall_campaign::interrupt::Signal;
use closecall_campaign::verdict::{Decision, Judgement};
use closecall_scenarios::ScenarioError;
use closecall_traffic::atomic::WriteError;

/// The exit code of the program.
///
/// | code | name | meaning |
/// |---|---|---|
/// | 0 | pass | the command is done, and every gate is met |
/// | 1 | fail | a gate is not met: for example more collisions than allowed, or a regression |
/// | 2 | usage | the command line is wrong |
/// | 3 | invalid input | a scenario, trajectory file or network cannot be used; nothing was run |
/// | 4 | inconclusive | there are too few samples for the requested bound, or nothing was judged |
/// | 5 | sample error | at least one sample ended in an error |
/// | 6 | i/o | a file or folder cannot be read or written |
/// | 7 | invalid | a validity check of the simulator failed |
/// | 130 | interrupted | Ctrl-C (SIGINT) ended the command |
/// | 143 | terminated | SIGTERM ended the command |
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum ExitCode {
    /// The command is done, and every gate is met.
    Pass = 0,
    /// A gate is not met.
    Fail = 1,
    /// The command line is wrong.
    Usage = 2,
    /// A scenario, trajectory file or network cannot be used.
    InvalidInput = 3,
    /// There are too few samples for the requested bound, or nothing was judged.
    Inconclusive = 4,
    /// At least one sample ended in an error.
    SampleError = 5,
    /// A file or folder cannot be read or written.
    Io = 6,
    /// A validity check of the simulator failed.
    Invalid = 7,
    /// Ctrl-C ended the command: 128 plus the number of SIGINT.
    Interrupted = 130,
    /// SIGTERM ended the command: 128 plus its number.
    Terminated = 143,
}

/// The exit codes in the order of precedence: if several apply, the first one is returned.
const PRECEDENCE: [ExitCode; 9] = [
    ExitCode::Interrupted,
    ExitCode::Terminated,
    ExitCode::Io,
    ExitCode::InvalidInput,
    ExitCode::SampleError,
    ExitCode::Invalid,
    ExitCode::Fail,
    ExitCode::Inconclusive,
    ExitCode::Usage,
];

impl ExitCode {
    /// Returns the code with the highest precedence; [`ExitCode::Pass`] if `codes` is empty.
    pub fn first_of(codes: impl IntoIterator<Item = Self>) -> Self {
        let codes: Vec<Self> = codes.into_iter().collect();
        PRECEDENCE.into_iter().find(|code| codes.contains(code)).unwrap_or(Self::Pass)
    }
}

impl From<ExitCode> for std::process::ExitCode {
    fn from(code: ExitCode) -> Self {
        Self::from(code as u8)
    }
}

/// Returns 128 plus the number of the signal.
impl From<Signal> for ExitCode {
    fn from(signal: Signal) -> Self {
        match signal {
            Signal::Interrupt => Self::Interrupted,
            Signal::Terminate => Self::Terminated,
        }
    }
}

impl From<Regression> for ExitCode {
    fn from(regression: Regression) -> Self {
        match regression {
            Regression::None => Self::Pass,
            Regression::NewErrors | Regression::NotCompared => Self::SampleError,
            Regression::Worse => Self::Fail,
            Regression::HoldsAlways => Self::Inconclusive,
        }
    }
}

impl From<&ScenarioError> for ExitCode {
    fn from(error: &ScenarioError) -> Self {
        FailureKind::from(error).into()
    }
}

impl From<&Judgement> for ExitCode {
    fn from(judged: &Judgement) -> Self {
        match judged.decision {
            Decision::Pass | Decision::Measured => Self::Pass,
            Decision::Fail => Self::Fail,
            Decision::Inconclusive | Decision::NotJudged | Decision::Overridden => Self::Inconclusive,
            Decision::SampleError => Self::SampleError,
            Decision::Invalid => Self::Invalid,
        }
    }
}

impl From<&WriteError> for ExitCode {
    fn from(_: &WriteError) -> Self {
        Self::Io
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_with_the_highest_precedence_is_returned() {
        assert_eq!(ExitCode::first_of([]), ExitCode::Pass);
        assert_eq!(ExitCode::first_of([ExitCode::Fail, ExitCode::SampleError]), ExitCode::SampleError);
        assert_eq!(ExitCode::first_of([ExitCode::Inconclusive, ExitCode::Fail, ExitCode::Pass]), ExitCode::Fail);
        assert_eq!(ExitCode::first_of([ExitCode::Invalid, ExitCode::InvalidInput, ExitCode::Io]), ExitCode::Io);
    }
}
