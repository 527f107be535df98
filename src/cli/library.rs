//! `closecall list`: the scenario library, which is part of the program.

use std::path::PathBuf;

use clap::Args;
use closecall_simulation::scenario::ScenarioFile;
use serde_json::{Value, json};

use super::CliError;
use super::args::Format;
use super::json::stamped;
use super::output::outln;
use crate::exit_code::ExitCode;

/// Embeds scenarios of `scenarios/library`, by their names.
macro_rules! embedded {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../../scenarios/library/", $name, ".toml")))),*]
    };
}

/// The scenarios of the library, each with its name and its text, in alphabetical order.
const LIBRARY: [(&str, &str); 12] = embedded![
    "cut-in-into-margin",
    "empty-wet-road",
    "lead-brakes-at-any-time",
    "lead-brakes-partially",
    "left-lane-blocked",
    "low-thw-overtake",
    "low-thw-overtake-at-cut-out",
    "overtake-without-brake",
    "paper-figure",
    "rear-follower-stays",
    "rear-follower-stays-lead-brakes",
    "slow-approach",
];

/// Returns the names of the scenarios, in alphabetical order.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    LIBRARY.into_iter().map(|(name, _)| name)
}

/// Returns the text of a scenario, or `None` if the library has no scenario of that name.
pub(super) fn text(name: &str) -> Option<&'static str> {
    LIBRARY.into_iter().find(|(known, _)| *known == name).map(|(_, text)| text)
}

/// Returns the path by which messages and manifests name a scenario of the library.
pub(super) fn path(name: &str) -> PathBuf {
    PathBuf::from(format!("library/{name}.toml"))
}

/// Arguments of `closecall list`.
#[derive(Debug, Args)]
pub(super) struct ListArgs {
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// A scenario of the library, as it is listed.
struct Listed {
    name: &'static str,
    question: String,
    tags: Vec<String>,
    requirements: Vec<String>,
    parameters: usize,
    gates: Vec<String>,
}

impl Listed {
    fn of(name: &'static str, text: &str) -> Result<Self, CliError> {
        let file = ScenarioFile::parse(&path(name), text, &[])?;
        let config = file.config();
        Ok(Self {
            name,
            question: config.description.clone(),
            tags: config.tags.clone(),
            requirements: config.requirements.clone(),
            parameters: file.space().iter().len(),
            gates: gates(text),
        })
    }

    fn to_json(&self) -> Value {
        json!({
            "name": self.name,
            "question": self.question,
            "tags": self.tags,
            "requirements": self.requirements,
            "parameters": self.parameters,
            "gates": self.gates,
        })
    }
}

/// Returns the gates that the text of a scenario sets.
fn gates(text: &str) -> Vec<String> {
    let Ok(document) = text.parse::<toml::Table>() else { return Vec::new() };
    let required = document.get("gate").and_then(|gate| gate.get("require")).and_then(toml::Value::as_array);
    required.into_iter().flatten().filter_map(toml::Value::as_str).map(str::to_owned).collect()
}

pub(super) fn list(args: &ListArgs) -> Result<ExitCode, CliError> {
    let listed = LIBRARY.into_iter().map(|(name, text)| Listed::of(name, text)).collect::<Result<Vec<_>, _>>()?;
    match args.format {
        Format::Json => {
            let scenarios: Vec<Value> = listed.iter().map(Listed::to_json).collect();
            outln!("{:#}", stamped(json!({ "scenarios": scenarios }), None, None));
        }
        Format::Human => {
            for scenario in &listed {
                outln!("{}", scenario.name);
                outln!("  {}", scenario.question);
                outln!("  requirements: {}; {} parameters", scenario.requirements.join(", "), scenario.parameters);
                for gate in &scenario.gates {
                    outln!("  gate: {gate}");
                }
            }
            outln!("\nA command takes such a name in place of a file: `closecall run {}`.", listed[0].name);
            outln!("`closecall new NAME --from LIBRARY_NAME` writes a copy to start from.");
        }
    }
    Ok(ExitCode::Pass)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_holds_every_scenario_of_its_folder() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library");
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let scenarios = files.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
        let mut expected: Vec<String> =
            scenarios.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
        expected.sort();
        assert_eq!(names().collect::<Vec<_>>(), expected);
        for (name, text) in LIBRARY {
            let listed = Listed::of(name, text).unwrap();
            assert_eq!(listed.to_json()["name"], ScenarioFile::parse(&path(name), text, &[]).unwrap().config().name);
            assert!(listed.question.ends_with('?'), "{name}: {}", listed.question);
        }
    }

    #[test]
    fn gates_are_those_of_the_text() {
        assert_eq!(gates("[gate]\nrequire = ['count(ego_collided) <= 0']\n"), ["count(ego_collided) <= 0"]);
        assert_eq!(gates("name = 'a'\n"), Vec::<String>::new());
    }
}
