//! Has the linker keep the executable's functions to itself, and lay it out so that processes need less memory, as far as the linker and the
//! system that builds it can.
//!
//! - The libraries that a process loads call the mathematical functions of the C library, wherever they run: the executable's own ones
//!   (`mathematics`) are not exported to them.
//! - Relative relocations take 4.5 MB of the executable, which every process reads when it starts; packed, they take 0.1 MB. The C library
//!   of GNU/Linux understands them from version 2.36 on. An executable that is built with this version or a later one needs it
//!   anyway, wherever it runs.
//! - The functions that campaigns call (`function-order.txt`, written by `examples/write_function_order`) are placed side by side. Scattered over
//!   50 MB of code they take up to 34 MB more memory, because the kernel maps 64 KB around each page that is used. LLD can do that, which
//!   Rust uses on `x86_64-unknown-linux-gnu`; other linkers are not asked to.

use std::env;
use std::error::Error;
use std::path::Path;
use std::process::{Command, Stdio};

/// First version of the GNU C library that loads packed relocations.
const FIRST_GLIBC: (u32, u32) = (2, 36);
/// Names of the functions that campaigns call: each line has the number of bytes shared with the name before, and the rest.
const FUNCTIONS: &str = "function-order.txt";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={FUNCTIONS}");
    let target = |key: &str| env::var(format!("CARGO_CFG_TARGET_{key}")).unwrap_or_default();
    if env::var_os("CARGO_CFG_UNIX").is_some() && target("VENDOR") != "apple" {
        println!("cargo::rustc-link-arg-bins=-Wl,--exclude-libs,ALL");
    }
    let is_gnu = target("OS") == "linux" && target("ENV") == "gnu" && env::var("HOST") == env::var("TARGET");
    if is_gnu && glibc().is_some_and(|version| version >= FIRST_GLIBC) {
        println!("cargo::rustc-link-arg-bins=-Wl,-z,pack-relative-relocs");
    }
    if is_gnu {
        let folder = env::var("OUT_DIR")?;
        let order = Path::new(&folder).join("function-order");
        std::fs::write(&order, names(&std::fs::read_to_string(FUNCTIONS)?).ok_or("function-order.txt is damaged")?)?;
        // Given one by one, as a path may have a comma.
        let arguments = [format!("--symbol-ordering-file={}", order.display()), "--no-warn-symbol-ordering".to_owned()];
        let arguments = arguments.iter().flat_map(|argument| ["-Xlinker", argument]).collect::<Vec<_>>();
        if links(Path::new(&folder), &arguments)? {
            arguments.iter().for_each(|argument| println!("cargo::rustc-link-arg-bins={argument}"));
        }
    }
    Ok(())
}

/// Returns the version of this system's GNU C library, if there is one that says so.
fn glibc() -> Option<(u32, u32)> {
    let output = Command::new("getconf").arg("GNU_LIBC_VERSION").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let mut parts = text.trim().strip_prefix("glibc ")?.split('.');
    Some((parts.next()?.parse().ok()?, parts.next()?.parse().ok()?))
}

/// Returns the names of a text, one per line, or `None` if a line is wrong.
fn names(text: &str) -> Option<String> {
    let (mut all, mut name) = (String::new(), String::new());
    for line in text.lines() {
        let (shared, rest) = line.split_once(' ')?;
        name.truncate(shared.parse().ok()?);
        name.push_str(rest);
        all.push_str(&name);
        all.push('\n');
    }
    Some(all)
}

/// Returns true if the linker of this build links an empty program with the arguments: one that does not know them refuses.
fn links(folder: &Path, arguments: &[&str]) -> Result<bool, Box<dyn Error>> {
    let source = folder.join("empty.rs");
    std::fs::write(&source, "fn main() {}\n")?;
    let mut rustc = Command::new(env::var("RUSTC")?);
    rustc.arg(&source).arg("-o").arg(folder.join("empty"));
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    rustc.args(flags.split('\x1f').filter(|flag| !flag.is_empty()));
    if let Ok(linker) = env::var("RUSTC_LINKER") {
        rustc.arg(format!("-Clinker={linker}"));
    }
    rustc.args(arguments.iter().map(|argument| format!("-Clink-arg={argument}")));
    Ok(rustc.stdout(Stdio::null()).stderr(Stdio::null()).status()?.success())
}
