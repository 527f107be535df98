//! The network of the rear camera runs on kernels that depend on the processor, and so do the
//! mathematical functions of the C library. Outcomes do not depend on the choice: the code calls
//! the functions of `libm` by name instead (`docs/explanation/determinism.md`). The ray cast, whose
//! vector registers no variable chooses, is compared in `sensors/src/lidar/tests/cast.rs`.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Output;

use object::{Object, ObjectSymbol};

use crate::support::{folder, library, program, stderr, stdout};

/// The variables that tell `tract` (`+avx2,-fma`) and the GNU C library the abilities of the
/// processor.
const INSTRUCTION_SETS: [&str; 2] = ["TRACT_CPU_ISA", "GLIBC_TUNABLES"];

/// Runs a paired campaign as if the processor had these instruction sets.
fn campaign(out: &Path, sensors: &str, samples: &str, instruction_sets: [&str; 2]) -> Output {
    let mut program = program();
    program.envs(INSTRUCTION_SETS.into_iter().zip(instruction_sets));
    program.args(["campaign", "--seed", "7", "-n", samples, "--paired", "--no-gate", "--sensors", sensors]);
    program.args(["--no-validity-checks", "--record", "failures:0", "--jobs", "1", "--out"]);
    program.arg(out).arg(library("low-thw-overtake")).output().expect("the program starts")
}

#[test]
#[cfg(target_arch = "x86_64")]
fn outcomes_do_not_depend_on_vector_instructions() {
    let folder = folder();
    let none = ["-avx,-avx2,-fma,-f16c,-avx512f,-avx512vnni", "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F,-AVX"];
    for (sensors, samples) in [("full", "3"), ("object", "50")] {
        let [all, none] = [("all", ["", ""]), ("none", none)].map(|(name, sets)| {
            let out = folder.path().join(format!("{sensors}-{name}"));
            stdout(&campaign(&out, sensors, samples, sets), 0);
            std::fs::read(out.join("journal.jsonl")).unwrap()
        });
        assert!(all.len() > 5_000 && all == none, "{sensors}: the journals differ");
    }
    // The network heeds the variable: it refuses what belongs to another processor.
    let refused = campaign(&folder.path().join("refused"), "full", "3", ["-neon", ""]);
    assert!(!refused.status.success() && stderr(&refused).contains(INSTRUCTION_SETS[0]), "{}", stderr(&refused));
}

/// Functions of the C library whose last digits depend on its version and on the processor. With
/// an `f` behind, they are of single precision.
const INEXACT: [&str; 35] = [
    "sin", "cos", "sincos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
    "exp", "exp2", "exp10", "expm1", "log", "log2", "log10", "log1p", "pow", "cbrt", "hypot", "erf", "erfc", "lgamma",
    "tgamma", "j0", "j1", "jn", "y0", "y1", "yn",
];
/// The same, with both names in full.
const INEXACT_TOO: [&str; 2] = ["lgamma_r", "lgammaf_r"];

#[test]
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn the_program_exports_no_function_under_the_name_of_one_of_the_c_library() {
    let bytes = std::fs::read(env!("CARGO_BIN_EXE_closecall")).unwrap();
    let program = object::File::parse(&*bytes).unwrap();
    let symbols = |is_import: bool| -> BTreeSet<&str> {
        let symbols = program.dynamic_symbols().filter(|symbol| symbol.is_undefined() == is_import);
        symbols.map(|symbol| symbol.name().unwrap()).collect()
    };
    // What no program can do without shows that the list is read.
    assert!(symbols(true).len() > 50 && symbols(true).contains("memcpy"), "{:?}", symbols(true));
    let exported = symbols(false);
    let single = INEXACT.map(|name| format!("{name}f"));
    let names = INEXACT.into_iter().chain(single.iter().map(String::as_str)).chain(INEXACT_TOO);
    let inexact: Vec<&str> = names.filter(|name| exported.contains(name)).collect();
    assert!(inexact.is_empty(), "{inexact:?}");
}
