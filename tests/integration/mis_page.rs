//! The tables of `docs/evidence/mis.md` are those that `examples/write_mis` writes.

use crate::support::all_of_library;

#[path = "../../examples/write_mis/tables.rs"]
mod tables;

use tables::{Study, between_markers, page_with};

const PAGE: &str = include_str!("../../docs/evidence/mis.md");

/// The rows of the tables: the cells of each.
fn rows(tables: &str) -> Vec<Vec<String>> {
    let rows = tables.lines().filter(|line| line.starts_with("| `"));
    rows.map(|line| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()).collect()
}

#[test]
fn the_committed_tables_have_the_form_that_the_program_writes_and_state_their_command() {
    let written = Study { samples: 3, member_samples: 2, seed: 1001 }.tables().unwrap();
    let committed = between_markers(PAGE).unwrap();
    let names: Vec<String> =
        all_of_library().iter().map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    for tables in [written.as_str(), committed] {
        let expected = names.iter().flat_map(|name| {
            ["mis", "mis-extended", "gap-1.6"].map(|arm| vec![format!("`{name}`"), format!("`{arm}`")])
        });
        let (scenarios, ensemble) = tables.split_once("### The driver ensemble").unwrap();
        let found = rows(scenarios);
        assert_eq!(found.iter().map(|row| row[..2].to_vec()).collect::<Vec<_>>(), expected.collect::<Vec<_>>());
        for row in &found {
            assert_eq!(row.len(), 12, "{row:?}");
            let count = |index: usize| row[index].parse::<u64>().unwrap();
            assert_eq!(count(2), count(4) + count(8), "without = prevented + both: {row:?}");
        }
        let members = rows(ensemble);
        assert!(members.len() >= 3 * 6 && members.iter().all(|row| row.len() == 10), "{members:?}");
        assert!(members.iter().any(|row| row[0] == "`low-thw-overtake`" && row[1] == "`mis`"), "{members:?}");
    }
    // The page differs from what was written in its numbers alone.
    let without_numbers = |text: &str| text.replace(|c: char| c.is_ascii_digit() || "-.%() to".contains(c), "");
    let heads = |text: &str| {
        text.lines().filter(|line| !line.starts_with("| `")).map(without_numbers).collect::<Vec<_>>().join("\n")
    };
    assert_eq!(heads(committed).trim(), heads(&written).trim());
    let (_, command) = committed.split_once("`cargo run --release --example write_mis -- -n ").unwrap();
    let (samples, rest) = command.split_once(" --member-samples ").unwrap();
    let (_, rest) = rest.split_once(" --seed ").unwrap();
    let seed = rest.split_once('`').unwrap().0;
    assert!(samples.parse::<u64>().unwrap() >= 100, "{samples}");
    assert!(committed.contains(&format!("{samples} samples of each scenario with seed {seed},")));
    // Seed 1 was looked at while constants were chosen.
    assert_ne!(seed, "1");
    let replaced = page_with(PAGE, &written).unwrap();
    assert!(
        replaced.contains("-n 3 --member-samples 2 --seed 1001")
            && replaced.ends_with(PAGE.rsplit("write_mis: end -->").next().unwrap())
    );
}
