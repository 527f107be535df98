//! No circle of imports runs over more than four files of a crate.
//!
//! ```text
//! files of a crate ─▶ paths in them: `use crate::a::B`, `super::c::d()` ─▶ file that declares the
//! name ─▶ files that reach each other
//! ```
//!
//! A file that only passes a name on is no dependency of its user: a path through a re-export leads
//! to the file that declares the name.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::architecture::{code_of, sources};
use crate::support::ROOT;

/// Largest number of files in a circle.
const MOST_FILES: usize = 4;
/// Longest chain of re-exports that is followed.
const MOST_REEXPORTS: usize = 8;
/// The folders of the crates.
const CRATES: [&str; 12] = [
    "traffic/src",
    "recorded/src",
    "scenarios/src",
    "sensors/src",
    "controllers/src",
    "simulation/src",
    "campaign/src",
    "studies/src",
    "report/src",
    "src",
    "python/src",
    "xtask/src",
];

/// The path of a module or of a name in it, from the root of its crate.
type Names = Vec<String>;

/// What a file declares and uses.
struct File {
    /// The code without tests and comments.
    code: String,
    /// The names that `use` brings into the file, with their paths.
    imports: BTreeMap<String, Names>,
}

/// The files of a crate by their modules.
struct Crate(BTreeMap<Names, File>);

/// Returns the paths of a `use`, whose braces are opened.
fn expanded(tree: &str) -> Vec<String> {
    let Some((before, inner)) = tree.split_once('{') else { return vec![tree.trim().to_owned()] };
    let inner = inner.trim_end().strip_suffix('}').unwrap_or(inner);
    let mut depth = 0_u32;
    let mut parts = vec![String::new()];
    for c in inner.chars() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if c == ',' && depth == 0 {
            parts.push(String::new());
        } else if let Some(part) = parts.last_mut() {
            part.push(c);
        }
    }
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| expanded(&format!("{}{}", before.trim(), part.trim()))).collect()
}

/// Returns the names of a path such as `crate::a::B`, as it reads from the root of the crate;
/// `None` if it leads elsewhere.
fn absolute(module: &[String], path: &str, has_child: impl Fn(&str) -> bool) -> Option<Names> {
    let mut segments: Vec<&str> = path.split("::").map(str::trim).collect();
    let first = *segments.first()?;
    let mut base: Names = module.to_vec();
    match first {
        "crate" => base.clear(),
        "self" => {}
        "super" => {
            base.pop();
        }
        child if has_child(child) => segments.insert(0, "self"),
        _ => return None,
    }
    for segment in &segments[1..] {
        if *segment == "super" {
            base.pop();
        } else if *segment != "self" {
            base.push((*segment).to_owned());
        }
    }
    Some(base)
}

/// Returns the statements `use …` of some code, and the code without them and without `mod name;`.
fn split_uses(code: &str) -> (Vec<String>, String) {
    let (mut uses, mut rest, mut open) = (Vec::new(), String::new(), String::new());
    for line in code.lines() {
        let text = line.trim_start();
        let statement = text.strip_prefix("pub ").unwrap_or(text);
        let statement = statement
            .split_once(") ")
            .filter(|(before, _)| before.starts_with("pub("))
            .map_or(statement, |(_, after)| after);
        if statement.starts_with("mod ") && statement.ends_with(';') {
            continue;
        }
        if open.is_empty() && !statement.starts_with("use ") {
            rest.push_str(line);
            rest.push('\n');
            continue;
        }
        open.push_str(if open.is_empty() { &statement["use ".len()..] } else { text });
        if let Some(whole) = open.trim_end().strip_suffix(';') {
            uses.extend(expanded(whole));
            open.clear();
        }
    }
    (uses, rest)
}

/// Returns the paths in code that is no `use`: words that `::` joins.
fn paths(code: &str) -> impl Iterator<Item = &str> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    code.split(move |c: char| !is_part(c)).map(|word| word.trim_matches(':')).filter(|word| word.contains("::"))
}

impl Crate {
    /// Reads the files of a crate.
    fn read(folder: &Path) -> Self {
        let files = sources(folder).into_iter().map(|path| {
            let text = std::fs::read_to_string(&path).unwrap();
            let code: String = code_of(&text).map(|(_, line)| format!("{line}\n")).collect();
            let relative = path.strip_prefix(folder).unwrap().with_extension("");
            let mut module: Names = relative.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
            if module.last().is_some_and(|last| ["mod", "lib", "main"].contains(&last.as_str())) {
                module.pop();
            }
            (module, code)
        });
        Self::of(files)
    }

    fn of(files: impl Iterator<Item = (Names, String)>) -> Self {
        // A crate with a library and a program has two roots. The library comes first.
        let mut codes: BTreeMap<Names, String> = BTreeMap::new();
        for (module, code) in files {
            codes.entry(module).or_insert(code);
        }
        let modules: BTreeSet<Names> = codes.keys().cloned().collect();
        let file = |(module, code): (Names, String)| {
            let (uses, code) = split_uses(&code);
            let has_child = |child: &str| modules.contains(&[&module[..], &[child.to_owned()]].concat());
            let imports = uses.iter().filter_map(|path| {
                let (path, name) =
                    path.split_once(" as ").map_or((path.as_str(), None), |(path, name)| (path, Some(name)));
                let names = absolute(&module, path, has_child)?;
                let name = name.map(str::to_owned).or_else(|| names.last().cloned())?;
                Some((name, names))
            });
            let imports = imports.collect();
            (module, File { code, imports })
        };
        Self(codes.into_iter().map(file).collect())
    }

    /// Returns the module that declares a name.
    fn declaring(&self, path: &[String], depth: usize) -> Names {
        let length = (0..=path.len()).rev().find(|length| self.0.contains_key(&path[..*length])).unwrap_or(0);
        let (module, rest) = path.split_at(length);
        let import = rest.first().and_then(|name| self.0.get(module)?.imports.get(name));
        match import {
            Some(import) if depth < MOST_REEXPORTS && import != path => {
                self.declaring(&[import, &rest[1..]].concat(), depth + 1)
            }
            _ => module.to_vec(),
        }
    }

    /// Returns the modules whose names a module uses. A name that the module passes on counts only
    /// if it uses that name itself.
    fn used_by(&self, module: &Names) -> BTreeSet<Names> {
        let file = &self.0[module];
        let has_child = |child: &str| self.0.contains_key(&[&module[..], &[child.to_owned()]].concat());
        let has_word = |name: &str| {
            let is_part = |c: char| c.is_alphanumeric() || c == '_';
            file.code.split(|c: char| !is_part(c)).any(|word| word == name)
        };
        // Of an imported module, the names count that a path through it uses.
        let is_module = |names: &Names| self.0.contains_key(names);
        let imported = file.imports.iter().filter(|(name, names)| !is_module(names) && has_word(name));
        let imported = imported.map(|(_, names)| names.clone());
        let through_import = |path: &str| {
            let (first, rest) = path.split_once("::")?;
            let import = file.imports.get(first)?;
            Some(import.iter().cloned().chain(rest.split("::").map(str::to_owned)).collect())
        };
        let inline =
            paths(&file.code).filter_map(|path| absolute(module, path, has_child).or_else(|| through_import(path)));
        let used = imported.chain(inline).map(|names| self.declaring(&names, 0));
        used.filter(|other| other != module).collect()
    }

    /// Returns the groups of more than [`MOST_FILES`] files in which each one uses every other one,
    /// directly or through others.
    fn circles(&self) -> Vec<Vec<String>> {
        let used: BTreeMap<&Names, BTreeSet<Names>> =
            self.0.keys().map(|module| (module, self.used_by(module))).collect();
        let reached = |start: &Names| {
            let (mut reached, mut open) = (BTreeSet::new(), vec![start.clone()]);
            while let Some(module) = open.pop() {
                open.extend(used[&module].iter().filter(|other| reached.insert((*other).clone())).cloned());
            }
            reached
        };
        let reached: BTreeMap<&Names, BTreeSet<Names>> =
            self.0.keys().map(|module| (module, reached(module))).collect();
        let circle = |module: &Names| -> Vec<String> {
            let others = reached[module].iter().filter(|other| reached[other].contains(module));
            others.map(|other| if other.is_empty() { "the root".to_owned() } else { other.join("/") }).collect()
        };
        let circles: BTreeSet<Vec<String>> = self.0.keys().map(circle).collect();
        circles.into_iter().filter(|circle| circle.len() > MOST_FILES).collect()
    }
}

#[test]
fn no_circle_of_imports_runs_over_more_than_four_files() {
    let circles: Vec<String> = CRATES
        .iter()
        .flat_map(|folder| {
            let circles = Crate::read(&Path::new(ROOT).join(folder)).circles();
            circles.into_iter().map(move |circle| format!("{folder}: {}", circle.join(", ")))
        })
        .collect();
    assert!(circles.is_empty(), "move a type to where it belongs:\n{}", circles.join("\n"));
}

#[test]
fn a_circle_of_five_files_is_found_and_one_through_a_reexport_is_not() {
    let file = |module: &str, code: &str| {
        (module.split('/').filter(|name| !name.is_empty()).map(str::to_owned).collect::<Names>(), code.to_owned())
    };
    let chain = |last: &str| {
        Crate::of(
            [
                file("", "mod a;\nmod b;\nmod c;\nmod d;\nmod e;\npub use e::{E, Leaf as Renamed};\n"),
                file("a", "use crate::b::{self, B};\nstruct A(B);\nfn f() { b::g(); }\n"),
                file("b", "pub struct B(super::c::C);\n"),
                file("c", "use super::d::{\n    D,\n    Other,\n};\npub struct C(D, Other);\n"),
                file("d", "use crate::E;\npub struct D(E);\npub struct Other;\n"),
                file("e", last),
            ]
            .into_iter(),
        )
        .circles()
    };
    assert_eq!(chain("use crate::a::A;\npub struct E(A);\n"), [["a", "b", "c", "d", "e"]]);
    assert_eq!(chain("pub use crate::a::A;\npub struct E;\npub struct Leaf;\n"), [[""; 0]; 0]);
}
