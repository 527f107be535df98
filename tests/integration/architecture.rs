//! The table of crates in `ARCHITECTURE.md` is the one of the workspace: `cargo metadata` has the
//! same crates, folders and imports. No library names an option of the command line. What tests
//! need builds no package of the program again.

use std::collections::BTreeSet;
use std::fmt::{self, Display, Formatter};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::support::{ROOT, stdout};

/// A crate of the workspace.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Crate {
    /// Name of the package without `closecall-`.
    name: String,
    /// Folder of its sources, relative to the root of the repository.
    folder: String,
    /// The crates that it imports outside its tests.
    imports: BTreeSet<String>,
}

/// Shows the row of a table.
impl Display for Crate {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let imports: Vec<&str> = self.imports.iter().map(String::as_str).collect();
        write!(f, "| {} | `{}` | … | {} |", self.name, self.folder, imports.join(", "))
    }
}

/// Returns the crates of the table, in its order.
fn table(page: &str) -> Vec<Crate> {
    let rows = page.lines().skip_while(|line| !line.starts_with("| crate | folder |")).skip(2);
    let rows = rows.take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [name, folder, _, imports] = cells[..] else { panic!("not four cells: {row}") };
        let imports = imports.split(", ").filter(|import| !import.is_empty()).map(str::to_owned).collect();
        Crate { name: name.to_owned(), folder: folder.trim_matches('`').to_owned(), imports }
    })
    .collect()
}

/// Returns the name of a package without `closecall-`, if it belongs to the workspace.
fn short(package: &str) -> Option<&str> {
    if package == "closecall" { Some(package) } else { package.strip_prefix("closecall-") }
}

/// Returns what cargo prints.
fn cargo(arguments: &str) -> String {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(arguments.split(' ')).arg("--offline").current_dir(ROOT);
    stdout(&command.output().unwrap(), 0)
}

/// Returns the crates of the workspace.
fn workspace() -> Vec<Crate> {
    let metadata: Value = serde_json::from_str(&cargo("metadata --no-deps --format-version 1")).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    packages
        .iter()
        .map(|package| {
            let manifest = Path::new(package["manifest_path"].as_str().unwrap());
            let folder = manifest.parent().unwrap().strip_prefix(metadata["workspace_root"].as_str().unwrap()).unwrap();
            let folder = if folder.as_os_str().is_empty() { Path::new("src") } else { folder };
            let is_import = |dependency: &&Value| dependency["kind"] != "dev";
            let imports = package["dependencies"].as_array().unwrap().iter().filter(is_import);
            Crate {
                name: short(package["name"].as_str().unwrap()).unwrap().to_owned(),
                folder: folder.to_str().unwrap().to_owned(),
                imports: imports.filter_map(|import| short(import["name"].as_str()?)).map(str::to_owned).collect(),
            }
        })
        .collect()
}

/// Returns the errors of a table of the crates.
fn wrong(table: &[Crate], workspace: &[Crate]) -> Vec<String> {
    let mut wrong = Vec::new();
    for of_workspace in workspace {
        let rows: Vec<&Crate> = table.iter().filter(|row| row.name == of_workspace.name).collect();
        if rows != [of_workspace] {
            wrong.push(format!("the row should be {of_workspace}"));
        }
    }
    for (index, row) in table.iter().enumerate() {
        if !workspace.iter().any(|of_workspace| of_workspace.name == row.name) {
            wrong.push(format!("the workspace has no crate `{}`", row.name));
        }
        for import in &row.imports {
            if !table[..index].iter().any(|above| above.name == *import) {
                wrong.push(format!("`{}` imports `{import}`, which does not stand above it", row.name));
            }
        }
    }
    wrong
}

fn page() -> String {
    std::fs::read_to_string(Path::new(ROOT).join("ARCHITECTURE.md")).unwrap()
}

#[test]
fn the_table_of_crates_is_that_of_the_workspace() {
    let wrong = wrong(&table(&page()), &workspace());
    assert!(wrong.is_empty(), "ARCHITECTURE.md:\n{}", wrong.join("\n"));
}

#[test]
fn a_wrong_table_of_crates_is_found() {
    let (page, workspace) = (page(), workspace());
    let problems = |from: &str, to: &str| {
        assert!(page.contains(from), "{from}");
        wrong(&table(&page.replacen(from, to, 1)), &workspace)
    };
    // An import that the page lacks, one that does not exist, one that points upwards.
    assert_eq!(problems("| sensors, traffic |", "| traffic |").len(), 1);
    assert_eq!(problems("| sensors, traffic |", "| controllers, sensors, traffic |").len(), 1);
    assert_eq!(problems("| sensors, traffic |", "| sensors, simulation, traffic |").len(), 2);
    // A crate that the page lacks, one that does not exist, and one in another folder.
    assert_eq!(problems("| studies |", "| foreign |").len(), 3 + 2);
    assert_eq!(problems("| `studies` |", "| `campaign/studies` |").len(), 1);
}

/// A dependency of tests that switches a feature of a package makes `cargo test` build it again,
/// and all that need it.
#[test]
fn the_tests_need_no_package_with_other_features_than_the_program() {
    let packages = |edges: &str| -> BTreeSet<String> {
        let tree = cargo(&format!("tree --workspace --prefix none --format {{p}},{{f}} --edges {edges}"));
        tree.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect()
    };
    let (program, tests) = (packages("normal"), packages("normal,dev"));
    let others: Vec<&String> = program.difference(&tests).collect();
    assert!(others.is_empty(), "{others:#?}");
    assert!(tests.iter().any(|package| package.starts_with("proptest ")));
}

/// The libraries. The command line, `src`, maps their messages to its options.
pub(crate) const LIBRARIES: [&str; 9] =
    ["traffic", "recorded", "scenarios", "sensors", "controllers", "simulation", "campaign", "studies", "report"];

/// Returns the source files below a folder, without the files of tests.
pub(crate) fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_test = path.file_stem().is_some_and(|stem| stem == "tests" || stem == "simulated_world");
        if path.is_dir() && !is_test {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") && !is_test {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// Returns the code of a file up to its unit tests, without comments on separate lines.
pub(crate) fn code_of(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let until_tests = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    until_tests.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//"))
}

/// Returns whether a line of code names an option such as `--resume`. A variable of a style sheet,
/// `--key:`, is none.
fn names_option(line: &str) -> bool {
    line.match_indices("--").any(|(at, _)| {
        let (before, after) = (&line[..at], &line[at + 2..]);
        let word = after.split(|c: char| !(c.is_ascii_lowercase() || c == '-')).next().unwrap_or_default();
        let begins = !before.ends_with(|c: char| c.is_alphanumeric() || c == '-');
        begins && word.starts_with(|c: char| c.is_ascii_lowercase()) && !after[word.len()..].starts_with(':')
    })
}

#[test]
fn no_library_names_an_option_of_the_command_line() {
    let mut named = Vec::new();
    for path in LIBRARIES.iter().flat_map(|library| sources(&Path::new(ROOT).join(library).join("src"))) {
        let text = std::fs::read_to_string(&path).unwrap();
        let lines = code_of(&text).filter(|(_, line)| names_option(line));
        named.extend(lines.map(|(number, line)| format!("{}:{}: {}", path.display(), number + 1, line.trim())));
    }
    assert!(
        named.is_empty(),
        "advice belongs in src/cli/advice.rs, commands in src/cli/actions.rs:\n{}",
        named.join("\n")
    );
}

#[test]
fn an_option_in_a_text_is_found() {
    for line in [r#"    "resume it with --resume","#, r#"write!(f, "(--max-flaky)")"#, r#"["--out".to_owned()]"#] {
        assert!(names_option(line), "{line}");
    }
    for line in [r#"style={ "--key:" (colour) }"#, "a -- b", "\"# ----- \"", "i--j", "\"x --> y\""] {
        assert!(!names_option(line), "{line}");
    }
}
