//! The network of the rear camera runs on kernels that are chosen by what the processor can do. Outcomes do not depend on the choice.
//! `docs/determinism.md` says what is promised beyond that.

use std::path::Path;
use std::process::Output;

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
