//! The tables of `docs/reference/output.md`, compared with the written files.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

/// The text of `docs/reference/output.md`.
pub(super) fn document() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/output.md")).unwrap()
}

/// The rows of the table behind a marker of `docs/reference/output.md`, each as its cells.
pub(super) fn rows(marker: &str) -> Vec<Vec<String>> {
    let text = document();
    let (_, after) = text.split_once(&format!("<!-- {marker}")).unwrap_or_else(|| panic!("no table `{marker}`"));
    let table =
        after.lines().skip(1).skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    table.skip(2).map(|line| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()).collect()
}

/// A documented key: its pattern, whether a reason may accompany it, and whether a test can expect
/// it.
struct Documented {
    pattern: String,
    may_be_absent: bool,
    is_rare: bool,
}

/// The keys of a table, with the keys of the tables that its marker includes.
fn documented(name: &str) -> Vec<Documented> {
    let text = document();
    let start = format!("<!-- keys: {name}");
    // The name of one table may begin the name of another.
    let is_of_table = |rest: &&str| rest.is_empty() || rest.starts_with(" + ");
    let includes = text.lines().filter_map(|line| line.strip_prefix(&start)?.strip_suffix(" -->")).find(is_of_table);
    let includes = includes.unwrap_or_else(|| panic!("docs/reference/output.md has no keys of `{name}`"));
    let mut all: Vec<Documented> = rows(&format!("keys: {name}{includes} -->"))
        .into_iter()
        .flat_map(|cells| {
            let key = cells[0].split('`').nth(1).unwrap().to_owned();
            let (may_be_absent, is_rare) = (cells[2].contains("reason beside it"), cells[0].contains('†'));
            // A list of two numbers documents its elements, too.
            let elements = (cells[1] == "list of 2 numbers").then(|| format!("{key}[]"));
            let patterns: Vec<String> = std::iter::once(key).chain(elements).flat_map(|key| expanded(&key)).collect();
            patterns.into_iter().map(move |pattern| Documented { pattern, may_be_absent, is_rare })
        })
        .collect();
    for include in includes.split(" + ").filter(|include| !include.is_empty()) {
        // A question mark says that the test holds these keys elsewhere, and need not see each of
        // them here.
        let (path, is_rare) = include.strip_suffix('?').map_or((include, false), |path| (path, true));
        let (prefix, section) = path.rsplit_once('.').unwrap_or(("", path));
        all.extend(documented(section).into_iter().map(|entry| Documented {
            pattern: if prefix.is_empty() { entry.pattern } else { format!("{prefix}.{}", entry.pattern) },
            is_rare: entry.is_rare || is_rare,
            ..entry
        }));
    }
    all
}

/// Every spelling of a pattern with `{a,b}`.
fn expanded(pattern: &str) -> Vec<String> {
    let open = pattern
        .match_indices('{')
        .find(|(index, _)| pattern[*index..].find('}').is_some_and(|end| pattern[*index..index + end].contains(',')));
    let Some((open, _)) = open else { return vec![pattern.to_owned()] };
    let close = open + pattern[open..].find('}').unwrap();
    let words = pattern[open + 1..close].split(',');
    words.flat_map(|word| expanded(&format!("{}{word}{}", &pattern[..open], &pattern[close + 1..]))).collect()
}

/// True if a pattern matches a path.
fn matches(pattern: &str, path: &str) -> bool {
    let (pattern, path): (Vec<&str>, Vec<&str>) = (pattern.split('.').collect(), path.split('.').collect());
    let same =
        |(pattern, part): (&&str, &&str)| pattern.starts_with('{') && !pattern.ends_with("[]") || pattern == part;
    pattern.len() == path.len() && pattern.iter().zip(&path).all(same)
}

/// The paths in a value: of its leaves, and of everything.
#[derive(Default)]
struct Paths {
    leaves: BTreeSet<String>,
    all: BTreeSet<String>,
}

impl Paths {
    fn of<'a>(values: impl IntoIterator<Item = &'a Value>) -> Self {
        let mut paths = Self::default();
        for value in values {
            paths.add("", value);
        }
        paths
    }

    fn add(&mut self, at: &str, value: &Value) {
        self.all.insert(at.to_owned());
        match value {
            Value::Object(map) if !map.is_empty() => {
                for (key, value) in map {
                    // Names of the user's choice may hold dots.
                    let key = key.replace('.', "_");
                    self.add(&if at.is_empty() { key } else { format!("{at}.{key}") }, value);
                }
            }
            Value::Array(list) if !list.is_empty() => list.iter().for_each(|value| self.add(&format!("{at}[]"), value)),
            Value::Object(_) | Value::Array(_) => {}
            _ => drop(self.leaves.insert(at.to_owned())),
        }
    }
}

/// Compares written keys with a table of keys, in both directions.
pub(super) fn hold<'a>(section: &str, values: impl IntoIterator<Item = &'a Value>) {
    let paths = Paths::of(values);
    let documented = documented(section);
    let is_documented = |path: &str| {
        let covers = |path: &str, absent: bool| {
            documented.iter().any(|entry| (!absent || entry.may_be_absent) && matches(&entry.pattern, path))
        };
        covers(path, false) || path.strip_suffix("_absent").is_some_and(|path| covers(path, true))
    };
    let unknown: Vec<_> = paths.leaves.iter().filter(|path| !is_documented(path)).collect();
    assert!(unknown.is_empty(), "docs/reference/output.md, {section}: written but not documented: {unknown:?}");
    let is_written = |entry: &&Documented| entry.is_rare || paths.all.iter().any(|path| matches(&entry.pattern, path));
    let missing: Vec<_> = documented.iter().filter(|entry| !is_written(entry)).map(|entry| &entry.pattern).collect();
    assert!(missing.is_empty(), "docs/reference/output.md, {section}: documented but not written: {missing:?}");
}
