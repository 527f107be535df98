//! A library that cannot be used as a controller is refused before the first sample, with a message
//! that names the reason.

use std::collections::BTreeMap;
use std::path::Path;

use crate::native_controllers::{campaign, compile, lib};
use crate::support::{code, folder, message, program, stderr};

/// A part of the message for each library that is refused.
fn refusals(folder: &Path) -> BTreeMap<&'static str, (String, i32, Vec<String>)> {
    let platform = format!("{} {}", std::env::consts::ARCH, std::env::consts::OS);
    let source = |name: &str, text: &str| {
        let path = folder.join(format!("{name}.c"));
        std::fs::write(&path, text).unwrap();
        compile(path.to_str().unwrap(), &folder.join(format!("{name}.so")), &[])
    };
    let complete = |abi: &str, more: &str| {
        format!(
            "#include <stdint.h>\n#include <stdlib.h>\nuint32_t closecall_controller_abi(void) {{ return {abi}; }}\n\
             void *closecall_controller_create(const void *s) {{ (void)s; return NULL; }}\n\
             int32_t closecall_controller_step(void *c, const void *i, void *o) {{ return 0; }}\n\
             void closecall_controller_destroy(void *c) {{}}\n{more}"
        )
    };
    let text = folder.join("text.so");
    std::fs::write(&text, "not a library\n").unwrap();
    // The file of this machine with the number of another processor: 183 is AArch64, 62 is x86-64.
    let foreign = source("foreign", &complete("1", ""));
    let mut bytes = std::fs::read(&foreign).unwrap();
    bytes[18] = if bytes[18] == 183 { 62 } else { 183 };
    std::fs::write(&foreign, bytes).unwrap();
    let other = if cfg!(target_arch = "aarch64") { "x86_64" } else { "aarch64" };
    BTreeMap::from([
        ("no file", (lib(&folder.join("absent.so")), 6, vec!["failed to read".to_owned(), "absent.so".to_owned()])),
        ("text", (lib(&text), 3, vec!["text.so is not a shared library".to_owned(), platform.clone()])),
        ("platform", (lib(&foreign), 3, vec![format!("is a library for {other} linux; expected one for {platform}")])),
        (
            "abi",
            (
                lib(&source("abi", &complete("7", ""))),
                3,
                vec!["has version 7 of the interface, this is version 1".to_owned()],
            ),
        ),
        (
            "symbol",
            (
                lib(&source("symbol", "int closecall_controller_abi(void) { return 1; }")),
                3,
                vec![
                    "does not export `closecall_controller_create`, `closecall_controller_step`".to_owned(),
                    "it exports `closecall_controller_abi`".to_owned(),
                ],
            ),
        ),
        (
            "names of C++",
            (
                lib(&source("names", "int _Z24closecall_controller_abiv(void) { return 1; }")),
                3,
                vec!["which are names of C++: declare the functions `extern \"C\"`".to_owned()],
            ),
        ),
        (
            "missing reference",
            (
                lib(&source("reference", &complete("1", "int absent(void);\nint use(void) { return absent(); }"))),
                3,
                vec!["undefined symbol: absent".to_owned()],
            ),
        ),
        (
            "crash",
            (
                lib(&source("crash", &complete("1", "__attribute__((constructor)) void c(void) { abort(); }"))),
                3,
                vec!["failed to load the controller".to_owned(), "signal: 6 (SIGABRT)".to_owned()],
            ),
        ),
    ])
}

#[test]
fn a_library_that_cannot_be_used_is_refused_before_the_first_sample() {
    let folder = folder();
    for (case, (controller, expected, parts)) in refusals(folder.path()) {
        let out = folder.path().join("out");
        let output = campaign(&controller, &out, "1", None, &[]);
        assert_eq!(code(&output), expected, "{case}: {}", stderr(&output));
        assert!(!out.exists(), "{case}");
        for part in parts {
            assert!(message(&output).contains(&part), "{case}: {}", stderr(&output));
        }
        let run = program().args(["run", "low-thw-overtake", "--controller", &controller]).output().unwrap();
        assert_eq!(code(&run), expected, "{case}: {}", stderr(&run));
    }
    let output = program().args(["run", "low-thw-overtake", "--controller", "lib:"]).output().unwrap();
    assert_eq!(code(&output), 2, "{}", stderr(&output));
}
