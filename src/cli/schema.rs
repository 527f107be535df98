//! `closecall tool schema`: prints the JSON Schema of scenario files.

use closecall_scenarios::strict_schema;

use super::output::outln;
use crate::exit_code::ExitCode;

pub(super) fn schema() -> ExitCode {
    outln!("{:#}", strict_schema());
    ExitCode::Pass
}
