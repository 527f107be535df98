//! The README and the pages of `docs/` show commands that work, with the output that they print.
//!
//! Each document is followed from top to bottom in a separate folder, as a reader does it:
//!
//! - In a `sh` block every line that starts with a known program is run. It must end with exit code 0, or with the one
//!   that a comment at the end of the line gives: `closecall check broken.toml  # exit code 3`.
//! - A block whose info string has a second word is a file of that name: `toml my.toml`.
//! - A `text` block that is the next one after a `sh` block is the output of its commands, to the
//!   letter. Only the wall time of a campaign, its number of threads and the share of its validity
//!   checks may differ. If its last line is `…`, it is the beginning of the output.
//!
//! With `CLOSECALL_WRITE_DOCUMENTS=1` the documents get the outputs that their commands print.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::support::{ROOT, code, folder};

/// What a reader has from the repository.
const COPIED: [&str; 3] = ["scenarios/library", "examples", "tests/fixtures"];

/// Lines of `sh` blocks that start with one of these are run.
const PROGRAMS: [&str; 4] = ["closecall ", "cp ", "mkdir ", "sed "];

/// The same as `closecall `, without an installed program.
const FROM_SOURCE: &str = "cargo run --release -- ";

/// The smallest number of commands in all documents together.
const LEAST_COMMANDS: usize = 8;

/// The smallest number of lines of an output that is cut.
const LEAST_SHOWN: usize = 3;

/// A fenced block of a Markdown file.
#[derive(Debug, PartialEq, Eq)]
struct Block {
    /// The line of the opening fence, counted from 1.
    line: usize,
    /// The words after the opening fence.
    info: String,
    text: String,
}

/// Returns the fenced blocks of a Markdown file.
fn blocks(markdown: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut open: Option<Block> = None;
    for (index, line) in markdown.lines().enumerate() {
        match (line.strip_prefix("```"), open.take()) {
            (Some(info), None) => {
                open = Some(Block { line: index + 1, info: info.trim().to_owned(), text: String::new() });
            }
            (Some(_), Some(block)) => blocks.push(block),
            (None, Some(mut block)) => {
                block.text += line;
                block.text.push('\n');
                open = Some(block);
            }
            (None, None) => {}
        }
    }
    assert_eq!(open, None, "a block is not closed");
    blocks
}

/// A line of a `sh` block that is run.
#[derive(Debug, PartialEq, Eq)]
struct Line {
    command: String,
    exit_code: i32,
}

/// Returns the lines of a `sh` block that are run.
fn lines(block: &str) -> Vec<Line> {
    let joined = block.replace("\\\n", " ");
    let run = |line: &str| {
        let line = line.replace(FROM_SOURCE, "closecall ");
        let (command, comment) = line.split_once(" #").unwrap_or((&line, ""));
        let exit_code = comment.trim().strip_prefix("exit code ").map_or(0, |number| number.parse().unwrap());
        Line { command: command.trim().to_owned(), exit_code }
    };
    let is_run = |line: &Line| PROGRAMS.iter().any(|program| line.command.starts_with(program));
    joined.lines().map(run).filter(is_run).collect()
}

/// Returns a text without what differs between machines: the wall time and the number of threads of
/// a campaign.
fn without_wall_time(text: &str) -> Vec<String> {
    const SIMULATED: &str = " simulated seconds in ";
    let steady = |line: &str| match line.split_once(SIMULATED) {
        Some((simulated, rest)) if rest.contains(" thread") => format!("{simulated}{SIMULATED}"),
        _ if line.trim_start().starts_with("\"wall_s\":") => "\"wall_s\":".to_owned(),
        _ => line.to_owned(),
    };
    text.trim_end().lines().map(steady).collect()
}

/// The last line of a `text` block that shows only the beginning of an output.
const CUT: &str = "…";

/// Whether a `text` block shows the output of its commands.
fn shows(shown: &str, printed: &str) -> bool {
    let (mut shown, printed) = (without_wall_time(shown), without_wall_time(printed));
    if shown.last().is_some_and(|line| line == CUT) {
        shown.pop();
        return shown.len() >= LEAST_SHOWN && shown.len() < printed.len() && printed.starts_with(&shown);
    }
    shown == printed
}

/// Returns what a `text` block should show: as much of the output as it shows now.
fn cut_like(shown: &str, printed: &str) -> String {
    let kept = shown.trim_end().lines().count() - 1;
    if shown.trim_end().lines().last() == Some(CUT) && kept < printed.trim_end().lines().count() {
        let lines: Vec<&str> = printed.lines().take(kept).chain([CUT]).collect();
        return lines.join("\n");
    }
    printed.to_owned()
}

/// Copies a folder with everything in it.
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// A reader's folder, which is `/tmp` in the document's commands, too.
struct Reader {
    folder: tempfile::TempDir,
}

impl Reader {
    fn new() -> Self {
        let folder = folder();
        for name in COPIED {
            copy(&Path::new(ROOT).join(name), &folder.path().join(name));
        }
        Self { folder }
    }

    /// The path that stands for `/tmp/`.
    fn own_tmp(&self) -> String {
        format!("{}/", self.folder.path().display())
    }

    fn run(&self, command: &str) -> Output {
        let program = Path::new(env!("CARGO_BIN_EXE_closecall"));
        let mut path = program.parent().unwrap().as_os_str().to_owned();
        path.push(":");
        path.push(std::env::var_os("PATH").unwrap_or_default());
        Command::new("sh")
            .args(["-c", &command.replace("/tmp/", &self.own_tmp())])
            .current_dir(self.folder.path())
            .env("PATH", path)
            .env_remove("GITHUB_STEP_SUMMARY")
            .output()
            .unwrap()
    }

    /// Runs a `sh` block, and returns the output of its commands: their standard output, or else
    /// their complaints. The error lists the commands that ended with another exit code than the
    /// document says.
    fn run_block(&self, block: &Block) -> Result<String, String> {
        let (mut printed, mut complaints, mut wrong) = (String::new(), String::new(), String::new());
        for Line { command, exit_code } in lines(&block.text) {
            let output = self.run(&command);
            let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).replace(&self.own_tmp(), "/tmp/");
            if code(&output) != exit_code {
                wrong += &format!("`{command}` ended with exit code {}: {}\n", code(&output), text(&output.stderr));
            }
            printed += &text(&output.stdout);
            complaints += &text(&output.stderr);
        }
        if wrong.is_empty() { Ok(if printed.is_empty() { complaints } else { printed }) } else { Err(wrong) }
    }
}

/// If this variable of the environment is set, the documents are written anew with the output of
/// their commands.
const WRITES: &str = "CLOSECALL_WRITE_DOCUMENTS";

/// Returns a document with another text in the block that opens in this line, counted from 1.
fn with_block(document: &str, line: usize, text: &str) -> String {
    let lines: Vec<&str> = document.lines().collect();
    let end = (line..lines.len()).find(|index| lines[*index] == "```").unwrap();
    let mut written = lines[..line].join("\n");
    written.push('\n');
    written.push_str(text.trim_end());
    written.push('\n');
    written.push_str(&lines[end..].join("\n"));
    written.push('\n');
    written
}

/// The outputs of a document, and their errors.
#[derive(Debug, Default)]
struct Findings {
    commands: usize,
    outputs: usize,
    /// True if one of the outputs comes from a campaign.
    has_campaign: bool,
    wrong: Vec<String>,
}

/// Follows a document from top to bottom.
fn follow(path: &Path) -> Findings {
    let blocks = blocks(&std::fs::read_to_string(path).unwrap());
    let reader = Reader::new();
    let mut findings = Findings::default();
    let mut outputs = Vec::new();
    for (index, block) in blocks.iter().enumerate() {
        let place = format!("{}:{}", path.strip_prefix(ROOT).unwrap().display(), block.line);
        let mut words = block.info.split_whitespace();
        match (words.next(), words.next()) {
            (Some("sh"), _) => {}
            (_, Some(file)) => {
                std::fs::write(reader.folder.path().join(file), &block.text).unwrap();
                continue;
            }
            _ => continue,
        }
        findings.commands += lines(&block.text).len();
        let printed = reader.run_block(block).unwrap_or_else(|wrong| {
            findings.wrong.push(format!("{place}: {wrong}"));
            String::new()
        });
        let Some(shown) = blocks.get(index + 1).filter(|next| next.info == "text") else { continue };
        if lines(&block.text).is_empty() {
            continue;
        }
        findings.outputs += 1;
        findings.has_campaign |= lines(&block.text).iter().any(|line| line.command.starts_with("closecall campaign "));
        if !shows(&shown.text, &printed) {
            outputs.push((shown.line, cut_like(&shown.text, &printed)));
            findings.wrong.push(format!("{place} shows\n{}\nbut the commands print\n{printed}", shown.text));
        }
    }
    if std::env::var_os(WRITES).is_some() {
        // From the last to the first: the lines of the others stay.
        let document = std::fs::read_to_string(path).unwrap();
        let written = outputs.iter().rev().fold(document, |text, (line, output)| with_block(&text, *line, output));
        std::fs::write(path, written).unwrap();
    }
    findings
}

/// Returns the README and the pages below `docs/`, in alphabetical order.
pub(crate) fn documents() -> Vec<PathBuf> {
    let mut documents = vec![Path::new(ROOT).join("README.md")];
    let mut folders = vec![Path::new(ROOT).join("docs")];
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "md") {
                documents.push(path);
            }
        }
    }
    documents.sort();
    documents
}

#[test]
fn documents_show_commands_that_work_with_the_output_that_they_print() {
    let mut commands = 0;
    let mut wrong = Vec::new();
    for path in documents() {
        let findings = follow(&path);
        if path == Path::new(ROOT).join("README.md") {
            assert!(findings.has_campaign, "the README shows no output of a campaign: {findings:?}");
        }
        commands += findings.commands;
        wrong.extend(findings.wrong);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(commands >= LEAST_COMMANDS, "the documents show only {commands} commands");
}

#[test]
fn a_block_is_read_with_its_commands_and_exit_codes() {
    let markdown = "Words.\n```sh\ncargo build --release\ncargo run --release -- check a.toml \\\n  b.toml\n\
                    closecall run c.toml  # exit code 3\n```\n\n```toml c.toml\nname = 1\n```\n```\na\n```\n";
    let read_blocks = blocks(markdown);
    let infos: Vec<(usize, &str)> = read_blocks.iter().map(|block| (block.line, block.info.as_str())).collect();
    assert_eq!(infos, [(2, "sh"), (9, "toml c.toml"), (12, "")]);
    assert_eq!(read_blocks[1].text, "name = 1\n");
    let line = |command: &str, exit_code| Line { command: command.to_owned(), exit_code };
    assert_eq!(
        lines(&read_blocks[0].text),
        [line("closecall check a.toml    b.toml", 0), line("closecall run c.toml", 3)]
    );
}

#[test]
fn a_block_gets_another_output_and_the_rest_of_the_document_stays() {
    let document = "A\n```text\nold\nlines\n```\nB\n```text\nother\n```\n";
    assert_eq!(with_block(document, 2, "new\n"), "A\n```text\nnew\n```\nB\n```text\nother\n```\n");
    assert_eq!(with_block(document, 7, "new"), "A\n```text\nold\nlines\n```\nB\n```text\nnew\n```\n");
}

#[test]
fn only_wall_times_and_threads_may_differ() {
    let printed = "a: 20 samples\n400 simulated seconds in 0.3 s on 2 threads\nPASS\n";
    let elsewhere = "a: 20 samples\n400 simulated seconds in 12.0 s on 16 threads\nPASS";
    assert_eq!(without_wall_time(printed), without_wall_time(elsewhere));
    for (from, to) in [("400", "401"), ("20 samples", "21 samples"), ("PASS", "..."), ("simulated", "")] {
        assert_ne!(without_wall_time(printed), without_wall_time(&elsewhere.replace(from, to)), "{to}");
    }
}

#[test]
fn the_beginning_of_an_output_is_shown_only_with_a_mark_and_to_the_letter() {
    let printed = "a: 20 samples\none\ntwo\nPASS\nmet: all\n";
    assert!(shows("a: 20 samples\none\ntwo\nPASS\n…\n", printed));
    for wrong in ["a: 20 samples\none\ntwo\nPASS\n", "a: 20 samples\none\nother\n…\n", "…\n", "one\ntwo\nPASS\n…\n"]
    {
        assert!(!shows(wrong, printed), "{wrong}");
    }
    assert_eq!(cut_like("a: 19 samples\none\n…\n", printed), "a: 20 samples\none\n…");
}
