//! The pages of `docs/evidence` have the sections that `xtask write-evidence` writes, of the
//! outcomes of this version.

use std::path::PathBuf;

use crate::support::{ROOT, all_of_library, families_of_library, traffic_of_library};

#[path = "../../xtask/src/write_evidence/mod.rs"]
#[expect(dead_code, reason = "the program's entry is not called")]
mod write_evidence;

use write_evidence::page::{Section, Size, between_markers, outcomes, with_other_rows, with_section};

/// Returns a committed section.
fn committed(section: Section) -> String {
    let page = std::fs::read_to_string(PathBuf::from(ROOT).join(section.page())).unwrap();
    between_markers(&page, section).unwrap_or_else(|missing| panic!("{}: {missing}", section.page())).to_owned()
}

/// The rows of the tables: the cells of each.
fn rows(tables: &str) -> Vec<Vec<String>> {
    let rows = tables.lines().filter(|line| line.starts_with("| `"));
    rows.map(|line| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()).collect()
}

/// The names of the scenarios of a folder of the library.
fn names(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect()
}

#[test]
fn no_section_is_older_than_the_outcomes_that_it_shows() {
    let stale: Vec<String> = Section::ALL
        .into_iter()
        .filter_map(|section| {
            let row = committed(section).lines().nth(4).unwrap_or_default().to_owned();
            let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
            let [commit, date, machine, command, shown] = cells[..] else {
                return Some(format!("{}: {row}", section.name()));
            };
            assert!(!commit.contains("unknown") && date.starts_with("20") && !machine.contains("unknown"), "{row}");
            assert!(command.contains(&format!("write-evidence {} -n ", section.name())), "{row}");
            // Seed 1 was looked at while constants were chosen.
            assert!(!command.contains("--seed 1`"), "{row}");
            (shown != outcomes(section).unwrap()).then(|| section.name())
        })
        .collect();
    assert!(
        stale.is_empty(),
        "outcomes have changed since these were measured: {stale:?}; `just evidence` writes them"
    );
}

#[test]
fn every_measurement_names_its_commit_date_machine_and_command() {
    let pages = std::fs::read_dir(PathBuf::from(ROOT).join("docs/evidence")).unwrap();
    let pages = pages.map(|entry| entry.unwrap().path()).filter(|path| path.extension().is_some_and(|end| end == "md"));
    let mut measurements = 0;
    for page in pages {
        let text = std::fs::read_to_string(&page).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        for (index, _) in lines.iter().enumerate().filter(|(_, line)| line.starts_with("| commit | date |")) {
            let row = lines[index + 2];
            let cells: Vec<&str> = row.trim_matches('|').split(" | ").map(str::trim).collect();
            let is_hash = |word: &str| word.len() >= 6 && word.chars().all(|c| c.is_ascii_hexdigit());
            let has_commit = cells[0].split([' ', ',', ';']).any(is_hash);
            let names_all = has_commit && cells[1].starts_with("20") && cells.iter().all(|cell| !cell.is_empty());
            assert!(cells.len() >= 4 && names_all, "{}: {row}", page.display());
            measurements += 1;
        }
        assert!(!text.contains("not recorded"), "{}", page.display());
    }
    assert!(measurements > 40, "{measurements}");
}

#[test]
fn the_committed_sections_have_the_form_that_the_program_writes() {
    let size = Size { samples: 3, member_samples: 2, seed: 1001 };
    for section in [Section::Arms, Section::Slowing] {
        let written = write_evidence::written(section, size, &[]).unwrap();
        let head = |text: &str| -> Vec<String> {
            text.lines()
                .filter(|line| line.starts_with("| ") && line.contains(" without | with |"))
                .map(str::to_owned)
                .collect()
        };
        assert_eq!(head(&committed(section)), head(&written), "{section:?}");
        let page = std::fs::read_to_string(PathBuf::from(ROOT).join(section.page())).unwrap();
        let replaced = with_section(&page, section, &written).unwrap();
        assert!(between_markers(&replaced, section).unwrap().contains("-n 3 --member-samples 2 --seed 1001"));
        assert_eq!(page.split("<!-- ").count(), replaced.split("<!-- ").count());
    }
}

#[test]
fn rows_of_some_scenarios_join_the_others_of_the_same_outcomes() {
    let section = |outcomes: &str, rows: &[&str]| {
        let command = "| 1a2b | 2026-11-29 | any | `just xtask write-evidence scenarios -n 9 --seed 1001` |";
        format!("{command} {outcomes} |\n\n| scenario | arm |\n|---|---|\n{}\n", rows.join("\n"))
    };
    let older =
        section("c0ffee", &["| `a` | `x` | 1 |", "| `a` | `y` | 1 |", "| `b` | `x` | 1 |", "| `b` | `y` | 1 |"]);
    let new = section("c0ffee", &["| `a` | `x` | 9 |", "| `a` | `y` | 9 |", "| `c` | `x` | 9 |"]);
    let joined =
        ["| `a` | `x` | 9 |", "| `a` | `y` | 9 |", "| `b` | `x` | 1 |", "| `b` | `y` | 1 |", "| `c` | `x` | 9 |"];
    assert_eq!(with_other_rows(&new, &older).unwrap(), section("c0ffee", &joined).trim_end());
    assert!(with_other_rows(&new, &older.replace("c0ffee", "decade")).unwrap_err().contains("outcomes have changed"));
}

#[test]
fn every_scenario_of_the_library_is_in_the_tables() {
    let [aeb, acc, recorded, anchor, ramp] = families_of_library();
    let names: Vec<String> =
        [all_of_library(), ramp, traffic_of_library()].iter().flat_map(|paths| names(paths)).collect();
    let expected = names
        .iter()
        .flat_map(|name| ["mis", "mis-extended", "gap-1.6"].map(|arm| vec![format!("`{name}`"), format!("`{arm}`")]));
    let listed = [rows(&committed(Section::Scenarios)), rows(&committed(Section::Traffic))].concat();
    assert_eq!(listed.iter().map(|row| row[..2].to_vec()).collect::<Vec<_>>(), expected.collect::<Vec<_>>());
    for row in &listed {
        assert_eq!(row.len(), 13, "{row:?}");
        let count = |index: usize| row[index].parse::<u64>().unwrap();
        assert_eq!(count(3), count(5) + count(9), "without = prevented + both: {row:?}");
    }
    let others: Vec<Vec<String>> =
        rows(&committed(Section::OtherFunctions)).iter().map(|row| row[..2].to_vec()).collect();
    let others_expected: Vec<Vec<String>> = [acc, aeb]
        .iter()
        .flat_map(|paths| self::names(paths))
        .map(|name| vec![format!("`{name}`"), "`acc+aeb`".to_owned()])
        .collect();
    assert_eq!(others, others_expected);
    let page = std::fs::read_to_string(PathBuf::from(ROOT).join(Section::Scenarios.page())).unwrap();
    let recorded = self::names(&recorded);
    assert!(
        !recorded.is_empty() && recorded.iter().all(|name| page.contains(&format!("| `{name}` |"))),
        "{recorded:?}"
    );
    let anchor = self::names(&anchor);
    assert!(!anchor.is_empty() && anchor.iter().all(|name| committed(Section::Anchor).contains(name)), "{anchor:?}");
    let agreement = rows(&committed(Section::Agreement));
    assert_eq!(
        agreement.iter().map(|row| row[0].clone()).collect::<Vec<_>>(),
        names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>()
    );
    for (row, arm) in agreement.iter().zip(listed.iter().step_by(3)) {
        assert_eq!(row.len(), 6, "{row:?}");
        let count = |cell: &str| cell.parse::<u64>().unwrap();
        assert!((1..=count(&arm[2])).contains(&count(&row[1])), "the first of the same samples: {row:?} {arm:?}");
        assert!(count(&row[2]) <= count(&arm[4]), "collisions of `mis` with full sensors: {row:?} {arm:?}");
    }
    let members = rows(&committed(Section::Ensemble));
    assert!(members.len() >= 3 * 6 && members.iter().all(|row| row.len() == 10), "{members:?}");
    assert!(members.iter().any(|row| row[0] == "`low-thw-overtake`" && row[1] == "`mis`"), "{members:?}");
}

#[test]
fn the_readme_says_where_the_system_fails_by_the_figures_of_the_tables() {
    let readme = std::fs::read_to_string(PathBuf::from(ROOT).join("README.md")).unwrap();
    let (_, failures) = readme.split_once("**Where the system fails**").unwrap();
    let words: Vec<&str> = failures.split_whitespace().collect();
    let failures = words.join(" ");
    let listed = [rows(&committed(Section::Scenarios)), rows(&committed(Section::Traffic))].concat();
    for scenario in ["rear-vehicles-one-after-another", "rear-vehicle-is-followed", "busy-overtake"] {
        let row = listed.iter().find(|row| row[0] == format!("`{scenario}`") && row[1] == "`mis`").unwrap();
        let (_, text) = failures.split_once(&format!("{scenario}`) ")).unwrap_or_else(|| panic!("no {scenario}"));
        let prevented = format!("{} of {}", row[5], row[3]);
        assert!(text.starts_with(&prevented) || text.starts_with(&format!("it prevents {prevented}")), "{row:?}");
    }
}
