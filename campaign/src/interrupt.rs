//! The answer to Ctrl-C (SIGINT) and SIGTERM. No process of a controller outlives the program.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use closecall_simulation::controller::exec::end_all;
use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;

use crate::stop::StopFlag;

/// A signal that ends the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Ctrl-C.
    Interrupt,
    /// SIGTERM, as a job scheduler sends it.
    Terminate,
}

impl Signal {
    /// Returns the name of the signal.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Interrupt => "SIGINT",
            Self::Terminate => "SIGTERM",
        }
    }
}

/// The state that the thread of the signals and the commands share.
struct State {
    /// The campaign that a signal stops; `None` if a signal ends the program at once.
    campaign: Option<StopFlag>,
    /// The signal that has stopped the campaign.
    received: Option<Signal>,
}

static STATE: Mutex<State> = Mutex::new(State { campaign: None, received: None });

fn state() -> MutexGuard<'static, State> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts the thread that receives the signals. `announce` is called with the first signal if it
/// stops a campaign, `exit` with one that ends the program.
pub fn watch(announce: fn(Signal), exit: fn(Signal)) {
    // A write beyond the user's limit of file sizes (`ulimit -f`) is then an error, no signal.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
    // Without the thread, a signal ends the program at once, as is the default of the system.
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else { return };
    let body = move || {
        for number in signals.forever() {
            let signal = if number == SIGTERM { Signal::Terminate } else { Signal::Interrupt };
            let mut state = state();
            match (&state.campaign, state.received) {
                (Some(campaign), None) => {
                    campaign.set();
                    state.received = Some(signal);
                    drop(state);
                    announce(signal);
                }
                _ => {
                    end_all();
                    exit(signal);
                }
            }
        }
    };
    drop(thread::Builder::new().name("signals".to_owned()).spawn(body));
}

/// From now on the first signal sets `campaign`, and only the second one ends the program.
pub fn stop_gracefully(campaign: &StopFlag) {
    state().campaign = Some(campaign.clone());
}

/// Returns the signal that has stopped the campaign. From now on a signal ends the program at once.
pub fn received() -> Option<Signal> {
    let mut state = state();
    state.campaign = None;
    state.received.take()
}
