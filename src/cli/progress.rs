//! The progress of a long command whose work is no campaign: a bar on a terminal, else a line every 30 s.

use std::io::{IsTerminal as _, stderr};

use closecall_campaign::session;
use closecall_report::heartbeat::Heartbeat;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output::print_error;

/// Does work that reports the number of its steps that are done, and of all. `unit` names the steps.
pub(super) fn watched<T>(unit: &'static str, work: impl FnOnce(&(dyn Fn([u64; 2]) + Sync)) -> T) -> T {
    let bar = ProgressBar::new(0);
    if session::is_active() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    if let Ok(style) = ProgressStyle::with_template(&format!("{{bar:40}} {{pos}}/{{len}} {unit}, {{elapsed}}")) {
        bar.set_style(style);
    }
    let of_bar = bar.clone();
    let progress = move || [of_bar.position(), of_bar.length().unwrap_or_default()];
    let is_silent = session::is_active() || stderr().is_terminal();
    let _heartbeat = (!is_silent).then(|| Heartbeat::of(unit, progress, |line| print_error(format_args!("{line}\n"))));
    let done = work(&|[done, all]| {
        bar.set_length(all);
        bar.set_position(done);
    });
    bar.finish_and_clear();
    done
}
