//! Has the linker bind the module's mathematical functions to each other, see the crate `closecall-mathematics`: the calls would
//! otherwise go to the C library, which the Python interpreter has loaded.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let is_apple = env::var("CARGO_CFG_TARGET_VENDOR").is_ok_and(|vendor| vendor == "apple");
    if env::var_os("CARGO_CFG_UNIX").is_some() && !is_apple {
        println!("cargo::rustc-link-arg-cdylib=-Wl,--exclude-libs,ALL");
    }
}
