//! Has the linker bind the module's mathematical functions to each other, see the crate `closecall-mathematics`: the calls would
//! otherwise go to the C library, which the Python interpreter has loaded.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-Bsymbolic-functions");
    }
}
