//! Opens an address in the browser.

use std::process::{Command, Stdio};

/// Programs that open an address in the browser.
const OPENERS: [&str; 3] = ["xdg-open", "open", "explorer.exe"];

/// Opens an address in the browser, if there is a program for that.
pub fn open_in_browser(address: &str) {
    for program in OPENERS {
        let silent = Command::new(program).arg(address).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        if silent.is_ok() {
            return;
        }
    }
}
