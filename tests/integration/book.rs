//! The book holds together: its links resolve, its summary lists every page, and there is one
//! glossary.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use crate::architecture::LIBRARIES;
use crate::assumptions::sources;
use crate::readme::documents;
use crate::support::ROOT;

/// Returns the lines of a Markdown file outside its fenced blocks.
fn prose(markdown: &str) -> Vec<&str> {
    let mut is_code = false;
    let is_prose = |line: &&str| {
        let is_fence = line.starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    };
    markdown.lines().filter(is_prose).collect()
}

/// Returns the targets of the links and pictures of a Markdown file, without addresses of the web.
fn targets(markdown: &str) -> Vec<&str> {
    let ends = prose(markdown).into_iter().flat_map(|line| line.split("](").skip(1));
    let targets = ends.filter_map(|end| end.split_once(')').map(|(target, _)| target));
    targets.filter(|target| !target.contains("://") && !target.contains(' ')).collect()
}

/// Returns the anchors of a Markdown file: its explicit ids, and its headings as GitHub and mdBook
/// spell them.
fn anchors(markdown: &str) -> BTreeSet<String> {
    let ids = markdown.split("id=\"").skip(1).filter_map(|rest| rest.split_once('"')).map(|(id, _)| id.to_owned());
    let headings = prose(markdown).into_iter().filter(|line| line.starts_with('#'));
    let slugs = headings.map(|line| {
        let title = line.trim_start_matches('#').trim().to_lowercase();
        let kept = title.chars().filter(|c| c.is_alphanumeric() || "-_ ".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    });
    ids.chain(slugs).collect()
}

/// Returns a path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => _ = plain.pop(),
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// Returns the errors of the links of a document.
fn broken(path: &Path, markdown: &str) -> Vec<String> {
    let book = Path::new(ROOT).join("docs");
    let wrong = |target: &&str| {
        let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
        let aim = if file.is_empty() { path.to_owned() } else { plain(&path.with_file_name(file)) };
        let is_page = aim.extension().is_some_and(|end| end == "md");
        let has_anchor = anchor.is_empty()
            || !is_page
            || std::fs::read_to_string(&aim).is_ok_and(|text| anchors(&text).contains(anchor));
        // A page of the book links to nothing that the book does not contain.
        !aim.exists() || !has_anchor || path.starts_with(&book) && !aim.starts_with(&book)
    };
    targets(markdown).into_iter().filter(wrong).map(|target| format!("{}: {target}", path.display())).collect()
}

#[test]
fn every_link_of_the_documents_resolves() {
    let others = [".github/CONTRIBUTING.md", "ARCHITECTURE.md"].map(|path| Path::new(ROOT).join(path));
    let documents = documents().into_iter().chain(others);
    let wrong: Vec<String> =
        documents.flat_map(|path| broken(&path, &std::fs::read_to_string(&path).unwrap())).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_broken_link_is_found() {
    let page = Path::new(ROOT).join("docs/reference/glossary.md");
    let broken_links = |text: &str| broken(&page, text).len();
    assert_eq!(
        broken_links("[a](criteria.md) ![b](../how-to/looking/pair.png) [c](#terms-of-the-field) [d](https://x.org/y)"),
        0
    );
    for wrong in ["[a](nothing.md)", "[a](criteria.md#nothing)", "[a](#nothing)", "[a](../../README.md)"] {
        assert_eq!(broken_links(wrong), 1, "{wrong}");
    }
}

#[test]
fn the_summary_lists_every_page_once() {
    let book = Path::new(ROOT).join("docs");
    let summary = std::fs::read_to_string(book.join("SUMMARY.md")).unwrap();
    let mut listed: Vec<PathBuf> = targets(&summary).into_iter().map(|target| book.join(target)).collect();
    listed.sort();
    let is_page = |path: &PathBuf| path.starts_with(&book) && !path.ends_with("SUMMARY.md");
    let pages: Vec<PathBuf> = documents().into_iter().filter(is_page).collect();
    assert_eq!(listed, pages);
}

/// Phrases that a reader reads twice.
const HEAVY_PHRASES: [&str; 4] = ["of which", "that of", "those of", "for want of"];

/// Returns the heavy phrases in the documents and comments of a text. A line may cut a phrase.
fn heavy_phrases(text: &str) -> Vec<&'static str> {
    const COMMENTS: [&str; 4] = ["///", "//!", "//", "#"];
    let is_word = |word: &&str| !COMMENTS.contains(word);
    let words: Vec<String> = text.split_whitespace().filter(is_word).map(str::to_lowercase).collect();
    let spaced = format!(" {} ", words.join(" "));
    HEAVY_PHRASES.into_iter().filter(|phrase| spaced.contains(&format!(" {phrase} "))).collect()
}

#[test]
fn documents_and_sources_have_no_heavy_phrases() {
    // One is cut by a line of a comment.
    let found = heavy_phrases("//! A mixture, of\n//! which a tenth differs from that of\n/// water.");
    assert_eq!(found, ["of which", "that of"]);
    let own = Path::new(ROOT).join(file!());
    let folders = LIBRARIES.into_iter().chain(["src", "python", "tests", "examples", "xtask"]);
    let sources = folders.flat_map(|folder| sources(&Path::new(ROOT).join(folder)));
    for path in documents().into_iter().chain(sources).filter(|path| *path != own) {
        let heavy = heavy_phrases(&std::fs::read_to_string(&path).unwrap());
        assert!(heavy.is_empty(), "{}: {heavy:?}", path.display());
    }
}

/// Returns the counts of a campaign's result in a text, such as `148 of 227 collisions`.
fn counted_results(markdown: &str) -> Vec<String> {
    let text = prose(markdown).join(" ");
    let words: Vec<&str> = text.split_whitespace().collect();
    let is_number = |word: &str| word.trim_matches(',').replace(',', "").parse::<u64>().is_ok();
    let is_result = |words: &&[&str]| {
        let [share, of, all, what] = **words else { return false };
        is_number(share)
            && of == "of"
            && is_number(all)
            && (what.starts_with("collisions") || what.starts_with("encounters"))
    };
    words.windows(4).filter(is_result).map(|words| words.join(" ")).collect()
}

#[test]
fn a_reference_page_states_no_results() {
    assert_eq!(counted_results("it prevents 148 of 227 collisions. At 5 of 100 runs"), ["148 of 227 collisions."]);
    let references = Path::new(ROOT).join("docs/reference");
    for path in documents().into_iter().filter(|path| path.starts_with(&references)) {
        let results = counted_results(&std::fs::read_to_string(&path).unwrap());
        assert!(results.is_empty(), "{}: {results:?}: a result stands in docs/evidence", path.display());
    }
}

/// Returns the first and the last cell of each row of a glossary that begins with the term of a
/// paper.
fn terms(text: &str) -> Vec<(String, String)> {
    let lines = text.lines().map(|line| line.trim_start_matches("//!").trim());
    let table = lines.skip_while(|line| !line.starts_with("| paper |")).take_while(|line| line.starts_with('|'));
    let cells = table.map(|line| line.trim_matches('|').split('|').map(str::trim).collect::<Vec<_>>());
    cells.map(|cells| (cells[0].to_owned(), cells[cells.len() - 1].to_owned())).collect()
}

#[test]
fn the_glossary_of_the_book_is_that_of_the_code() {
    let read = |path: &str| terms(&std::fs::read_to_string(Path::new(ROOT).join(path)).unwrap());
    let terms = read("docs/reference/glossary.md");
    assert!(terms.len() > 20, "{terms:?}");
    assert_eq!(terms, read("traffic/src/lib.rs"));
}

/// Returns true if a page is the glossary, or links it.
fn explains_terms(markdown: &str) -> bool {
    markdown.starts_with("# Glossary") || targets(markdown).iter().any(|target| target.contains("glossary.md"))
}

#[test]
fn every_page_with_terms_or_letters_of_the_field_links_the_glossary() {
    let words = ["THW", "TTC", "TTCE", "DCE", "MIS", "NEES", "prevented", "induced", "trajectory data", "E", "F", "R"];
    let is_of_a_word = |character: char| character.is_alphanumeric() || "-_'".contains(character);
    let has_term = |markdown: &str| {
        let text = prose(markdown).join(" ");
        text.split(|character: char| !is_of_a_word(character)).any(|word| words.contains(&word))
    };
    for path in documents() {
        let markdown = std::fs::read_to_string(&path).unwrap();
        let is_page = path.components().any(|part| part.as_os_str() == "docs") && !path.ends_with("SUMMARY.md");
        assert!(!is_page || !has_term(&markdown) || explains_terms(&markdown), "{}", path.display());
    }
    assert!(!explains_terms("# Gates\n\nThe MIS.\n\n```text\n[glossary](glossary.md)\n```\n"));
    assert!(explains_terms("# Gates\n\nThe [MIS](glossary.md).\n"));
}
