//! Every constant of the controllers, drivers, rear radars and the import of OpenSCENARIO that is an
//! assumption is in the lists of `docs/reference/assumptions.md`, and nothing else is.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::support::ROOT;

/// Returns the Rust files below a folder.
pub(crate) fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|end| end == "rs") {
            files.push(path);
        }
    }
    files
}

/// Returns the constants of a file whose doc comments call them assumptions.
fn assumed(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut docs = String::new();
    for line in text.lines().map(str::trim) {
        if let Some(doc) = line.strip_prefix("///") {
            docs.push_str(doc);
            continue;
        }
        if let Some((_, rest)) = line.split_once("const ")
            && docs.to_lowercase().contains("assumption")
            && let Some((name, _)) = rest.split_once(':')
        {
            names.push(name.to_owned());
        }
        docs.clear();
    }
    names
}

const PAGE: &str = include_str!("../../docs/reference/assumptions.md");
/// The heading of the list of the rear radars, which follows the list of the controllers.
const OF_RADARS: &str = "## Rear radars";
/// The heading of the list of the import, which follows the list of the rear radars.
const OF_IMPORT: &str = "## Import of OpenSCENARIO";

/// Returns the first cells of a table of assumptions.
fn listed(list: &str) -> BTreeSet<String> {
    let rows = list.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.filter_map(|row| row.split_once('`')).map(|(name, _)| name.to_owned()).collect()
}

#[test]
fn every_assumed_constant_of_the_controllers_is_listed() {
    let files = sources(&Path::new(ROOT).join("controllers/src"));
    let assumed: BTreeSet<String> =
        files.iter().flat_map(|path| assumed(&std::fs::read_to_string(path).unwrap())).collect();
    assert!(assumed.len() > 40, "{assumed:?}");
    let (of_controllers, _) = PAGE.split_once(OF_RADARS).unwrap();
    assert_eq!(listed(of_controllers), assumed);
}

#[test]
fn every_assumed_constant_of_the_rear_radars_is_listed() {
    let folder = Path::new(ROOT).join("sensors/src");
    let files = sources(&folder.join("radar")).into_iter().chain([folder.join("tracking/radar.rs")]);
    let assumed: BTreeSet<String> = files.flat_map(|path| assumed(&std::fs::read_to_string(path).unwrap())).collect();
    let (_, of_radars) = PAGE.split_once(OF_RADARS).unwrap();
    let (of_radars, _) = of_radars.split_once(OF_IMPORT).unwrap();
    assert_eq!(listed(of_radars), assumed);
}

#[test]
fn every_assumed_constant_of_the_import_is_listed_with_its_file() {
    let files = sources(&Path::new(ROOT).join("scenarios/src/openscenario"));
    let of_file = |path: &PathBuf| -> Vec<(String, String)> {
        let file = path.file_name().unwrap().to_string_lossy().into_owned();
        assumed(&std::fs::read_to_string(path).unwrap()).into_iter().map(|name| (name, file.clone())).collect()
    };
    let assumed: BTreeSet<(String, String)> = files.iter().flat_map(of_file).collect();
    assert!(assumed.len() > 10, "{assumed:?}");
    let (_, of_import) = PAGE.split_once(OF_IMPORT).unwrap();
    let rows = of_import.lines().filter_map(|line| line.strip_prefix("| `"));
    let listed: Vec<_> = rows
        .map(|row| {
            let (name, rest) = row.split_once("` | ").unwrap();
            (name.to_owned(), rest.split(' ').next().unwrap().to_owned())
        })
        .collect();
    assert_eq!(listed.len(), assumed.len(), "a row stands twice");
    assert_eq!(listed.into_iter().collect::<BTreeSet<_>>(), assumed);
}
