//! The `closecall` program.

fn main() -> std::process::ExitCode {
    closecall::cli::main(&std::env::args_os().collect::<Vec<_>>()).into()
}
