//! The network of the rear camera runs on kernels that are chosen by what the processor can do, and so do the mathematical functions of
//! the C library. Outcomes do not depend on the choice: the program calls functions of its own instead (`docs/determinism.md`).

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Output;

use object::{Object, ObjectSymbol};

use crate::support::{folder, library, program, stderr, stdout};

/// The variable by which `tract` is told what the processor can do (`+avx2,-fma`).
const INSTRUCTION_SETS: &str = "TRACT_CPU_ISA";

/// Runs a campaign with the full sensors, as if the processor had these instruction sets.
fn campaign(out: &Path, instruction_sets: &str) -> Output {
    let mut program = program();
    program.env(INSTRUCTION_SETS, instruction_sets).args([
        "campaign",
        "--seed",
        "7",
        "-n",
        "3",
        "--paired",
        "--no-gate",
    ]);
    program.args(["--sensors", "full", "--no-validity-checks", "--record", "failures:0", "--jobs", "1", "--out"]);
    program.arg(out).arg(library("low-thw-overtake")).output().expect("the program starts")
}

#[test]
#[cfg(target_arch = "x86_64")]
fn outcomes_do_not_depend_on_the_vector_instructions_of_the_network() {
    let folder = folder();
    let [all, none] = [("all", ""), ("none", "-avx,-avx2,-fma,-f16c,-avx512f,-avx512vnni")].map(|(name, sets)| {
        let out = folder.path().join(name);
        stdout(&campaign(&out, sets), 0);
        std::fs::read(out.join("journal.jsonl")).unwrap()
    });
    assert!(all.len() > 5_000 && all == none, "the journals differ");
    // The network heeds the variable: it refuses what belongs to another processor.
    let refused = campaign(&folder.path().join("refused"), "-neon");
    assert!(!refused.status.success() && stderr(&refused).contains(INSTRUCTION_SETS), "{}", stderr(&refused));
}

/// Functions of the C library whose last digits depend on its version and on the processor; with the suffix `f`, those of single precision.
const INEXACT: [&str; 37] = [
    "sin", "cos", "sincos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
    "exp", "exp2", "exp10", "expm1", "log", "log2", "log10", "log1p", "pow", "cbrt", "hypot", "erf", "erfc", "lgamma",
    "lgamma_r", "tgamma", "gamma", "j0", "j1", "jn", "y0", "y1", "yn",
];

#[test]
#[cfg(target_os = "linux")]
fn the_program_calls_no_inexact_function_of_the_c_library() {
    let bytes = std::fs::read(env!("CARGO_BIN_EXE_closecall")).unwrap();
    let program = object::File::parse(&*bytes).unwrap();
    let undefined = program.dynamic_symbols().filter(|symbol| symbol.is_undefined());
    let imported: BTreeSet<String> = undefined.map(|symbol| symbol.name().unwrap().to_owned()).collect();
    // What no program can do without shows that the list is that of the imports.
    assert!(imported.len() > 50 && imported.contains("memcpy"), "{imported:?}");
    let both = INEXACT.iter().flat_map(|name| [(*name).to_owned(), format!("{name}f")]);
    let called: Vec<String> = both.filter(|name| imported.contains(name)).collect();
    assert!(called.is_empty(), "{called:?}");
}
