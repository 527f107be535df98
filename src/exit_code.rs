//! Exit codes. They carry a verdict or the kind of a failure, never a count.

use closecall_campaign::verdict::{Decision, Judgement};
use closecall_scenarios::atomic::WriteError;
use closecall_simulation::scenario::ScenarioError;

/// What the program ends with.
///
/// | code | name | meaning |
/// |---|---|---|
/// | 0 | pass | done; every gate that was asked for is met |
/// | 1 | fail | a gate is not met: more collisions than allowed, a regression |
/// | 2 | usage | the command line is wrong |
/// | 3 | invalid input | a scenario or a recording cannot be used; nothing was run |
/// | 4 | inconclusive | too few samples for the bound asked for |
/// | 5 | sample error | some sample ended in an error |
/// | 6 | i/o | a file or folder cannot be read or written |
/// | 7 | invalid | a validity check of the simulator failed |
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum ExitCode {
    /// Done; every gate is met.
    Pass = 0,
    /// More collisions than allowed.
    Fail = 1,
    /// The command line is wrong.
    Usage = 2,
    /// A scenario or a recording cannot be used.
    InvalidInput = 3,
    /// Too few samples for the bound asked for.
    Inconclusive = 4,
    /// Some sample ended in an error.
    SampleError = 5,
    /// A file or folder cannot be read or written.
    Io = 6,
    /// A validity check of the simulator failed.
    Invalid = 7,
}

/// Where several hold, the first of these is the answer.
const PRECEDENCE: [ExitCode; 7] = [
    ExitCode::Io,
    ExitCode::InvalidInput,
    ExitCode::SampleError,
    ExitCode::Invalid,
    ExitCode::Fail,
    ExitCode::Inconclusive,
    ExitCode::Usage,
];

impl ExitCode {
    /// The one answer where several hold; pass where none does.
    pub fn first_of(codes: impl IntoIterator<Item = Self>) -> Self {
        let held: Vec<Self> = codes.into_iter().collect();
        PRECEDENCE.into_iter().find(|code| held.contains(code)).unwrap_or(Self::Pass)
    }
}

impl From<ExitCode> for std::process::ExitCode {
    fn from(code: ExitCode) -> Self {
        Self::from(code as u8)
    }
}

impl From<&ScenarioError> for ExitCode {
    fn from(error: &ScenarioError) -> Self {
        match error {
            ScenarioError::Set { .. } => Self::Usage,
            ScenarioError::Read { .. } => Self::Io,
            ScenarioError::NotText { .. }
            | ScenarioError::Empty { .. }
            | ScenarioError::Syntax { .. }
            | ScenarioError::Value { .. } => Self::InvalidInput,
        }
    }
}

impl From<&Judgement> for ExitCode {
    fn from(judged: &Judgement) -> Self {
        match judged.decision {
            Decision::Pass => Self::Pass,
            Decision::Fail => Self::Fail,
            Decision::Inconclusive => Self::Inconclusive,
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
    fn the_graver_answer_wins() {
        assert_eq!(ExitCode::first_of([]), ExitCode::Pass);
        assert_eq!(ExitCode::first_of([ExitCode::Fail, ExitCode::SampleError]), ExitCode::SampleError);
        assert_eq!(ExitCode::first_of([ExitCode::Inconclusive, ExitCode::Fail, ExitCode::Pass]), ExitCode::Fail);
        assert_eq!(ExitCode::first_of([ExitCode::Invalid, ExitCode::InvalidInput, ExitCode::Io]), ExitCode::Io);
    }
}
