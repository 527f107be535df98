//! The commands that the README shows do what it says.

use std::path::Path;

use crate::support::{closecall, code, folder, stderr};

/// Every line of the README's shell blocks that runs the program, without its build.
fn commands() -> Vec<String> {
    let readme = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    let mut commands = Vec::new();
    let mut inside = false;
    for line in readme.lines() {
        if line.starts_with("```") {
            inside = line == "```sh";
        } else if let Some(command) = line.strip_prefix("cargo run --release -- ").or(line.strip_prefix("closecall "))
            && inside
        {
            commands.push(command.split(" #").next().unwrap_or_default().trim().to_owned());
        }
    }
    commands
}

#[test]
fn the_readme_s_commands_run() {
    let commands = commands();
    assert!(commands.len() >= 8, "{commands:?}");
    let folder = folder();
    let here = folder.path().to_str().unwrap();
    for command in commands {
        // What a command writes goes to a folder of the test's own.
        let args: Vec<String> =
            command.split_whitespace().map(|word| word.replace("/tmp/", &format!("{here}/"))).collect();
        let output = closecall(&args);
        assert_eq!(code(&output), 0, "{command}: {}", stderr(&output));
    }
}
