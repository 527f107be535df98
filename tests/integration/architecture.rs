//! The table of crates in `ARCHITECTURE.md` is the one of the workspace: `cargo metadata` has the same crates, folders and imports.

use std::collections::BTreeSet;
use std::fmt::{self, Display, Formatter};
use std::path::Path;
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

/// Returns the crates of the workspace.
fn workspace() -> Vec<Crate> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(["metadata", "--no-deps", "--offline", "--format-version", "1"]).current_dir(ROOT);
    let metadata: Value = serde_json::from_str(&stdout(&command.output().unwrap(), 0)).unwrap();
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

/// Returns what is wrong with a table of the crates.
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
