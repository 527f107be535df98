//! The platform of a shared library, as its file states it.

use std::env::consts::{ARCH, OS};
use std::path::Path;

use closecall_traffic::input;
use object::{Architecture, BinaryFormat, Object, ObjectKind};

use crate::external::error::LoadError;

/// Largest number of functions that a message lists.
const MAX_LISTED: usize = 12;

/// Returns the platform of this program.
fn this_platform() -> String {
    format!("{ARCH} {OS}")
}

/// Largest shared library (bytes): a limit of this program.
const MOST_LIBRARY_BYTES: u64 = 4 << 30;

/// Checks that a file is a shared library for this platform, and that it exports the functions
/// `needed`. `prefix` is the beginning of the names that a message lists.
///
/// # Errors
/// [`LoadError`] that names the expected and the actual content.
pub(crate) fn check(path: &Path, needed: &[&str], prefix: &str) -> Result<(), LoadError> {
    let shown = path.display().to_string();
    let bytes =
        input::read(path, MOST_LIBRARY_BYTES).map_err(|source| LoadError::Read { path: shown.clone(), source })?;
    let not_a_library =
        |reason: String| LoadError::NotALibrary { path: shown.clone(), reason, expected: this_platform() };
    let file = object::File::parse(&*bytes).map_err(|error| not_a_library(format!("it cannot be parsed ({error})")))?;
    let (arch, os) = (arch(file.architecture()), os(file.format()));
    if arch != ARCH || os != family(OS) {
        let actual = format!("{arch} {os}");
        return Err(LoadError::Platform { path: shown, actual, expected: this_platform() });
    }
    if file.kind() != ObjectKind::Dynamic {
        return Err(not_a_library(format!("it is {}", kind(file.kind()))));
    }
    let names: Vec<String> = file
        .exports()
        .map_err(|error| not_a_library(format!("its symbols cannot be read ({error})")))?
        .iter()
        .filter_map(|export| std::str::from_utf8(export.name()).ok())
        // Names of Mach-O begin with an underscore.
        .map(|name| if os == "macos" { name.trim_start_matches('_') } else { name }.to_owned())
        .collect();
    let missing: Vec<String> =
        needed.iter().filter(|name| !names.iter().any(|exported| exported == *name)).map(ToString::to_string).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let of_interface: Vec<String> = names.iter().filter(|name| name.starts_with(prefix)).cloned().collect();
    let mut actual = if of_interface.is_empty() { names } else { of_interface };
    actual.sort();
    actual.truncate(MAX_LISTED);
    Err(LoadError::Symbol { path: shown, missing, actual })
}

/// Returns the name of an architecture, as Rust names it.
fn arch(architecture: Architecture) -> String {
    match architecture {
        Architecture::X86_64 => "x86_64".to_owned(),
        Architecture::I386 => "x86".to_owned(),
        Architecture::Aarch64 => "aarch64".to_owned(),
        Architecture::Arm => "arm".to_owned(),
        Architecture::Riscv64 => "riscv64".to_owned(),
        other => format!("{other:?}").to_lowercase(),
    }
}

/// Returns the system that has files of this format.
fn os(format: BinaryFormat) -> &'static str {
    match format {
        BinaryFormat::Elf => "linux",
        BinaryFormat::MachO => "macos",
        BinaryFormat::Pe | BinaryFormat::Coff => "windows",
        _ => "another system",
    }
}

/// Returns one system for all systems with the same file format.
fn family(os: &str) -> &str {
    match os {
        "macos" | "windows" => os,
        _ => "linux",
    }
}

fn kind(kind: ObjectKind) -> &'static str {
    match kind {
        ObjectKind::Executable => "a program",
        ObjectKind::Relocatable => "an object file that is not linked",
        ObjectKind::Core => "a memory dump",
        _ => "of another kind",
    }
}
