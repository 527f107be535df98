//! Keeps the executable's mathematical functions (`mathematics`) to itself: the libraries that a process loads call those of the C library.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let is_apple = env::var("CARGO_CFG_TARGET_VENDOR").is_ok_and(|vendor| vendor == "apple");
    if env::var_os("CARGO_CFG_UNIX").is_some() && !is_apple {
        println!("cargo::rustc-link-arg-bins=-Wl,--exclude-libs,ALL");
    }
}
