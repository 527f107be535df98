//! The commands for the actions that a text proposes.

use closecall_campaign::action::{Action, Replay, Resume, SavedSample};

/// Returns a word as a shell reads it, with quotes if it needs them.
pub(super) fn quoted(word: &str) -> String {
    shlex::try_quote(word).map_or_else(|_| word.to_owned(), |quoted| quoted.into_owned())
}

/// Returns the command of this program for an action.
pub(super) fn command_for(action: &Action<'_>) -> String {
    match *action {
        Action::Replay(replay) => replay_command(&replay),
        Action::Explain(sample) => sample_command("explain", sample),
        Action::ExplainAll(folder) => format!("closecall explain {}", quoted(folder)),
        Action::Minimize(sample) => sample_command("minimize", sample),
        Action::Run { file, controller } => {
            format!("closecall run {}{}", quoted(file), option("--controller", controller))
        }
        // The call of another program is one word.
        Action::Repeat([call]) => call.clone(),
        Action::Repeat(words) => words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" "),
        Action::Resume(resume) => resume_command(resume),
        Action::ResumeForeign(folder) => format!("closecall campaign SCENARIO … --out {} --resume", quoted(folder)),
        Action::View { folder, is_in_browser: false } => format!("closecall view --recordings {}", quoted(folder)),
        Action::View { folder, is_in_browser: true } => format!("closecall view --recordings --web {}", quoted(folder)),
    }
}

/// Returns an option with its value, with a space before it; nothing without a value.
fn option(name: &str, value: Option<&str>) -> String {
    value.map_or_else(String::new, |value| format!(" {name} {}", quoted(value)))
}

fn sample_command(command: &str, SavedSample { folder, sample, scenario }: SavedSample<'_>) -> String {
    format!("closecall {command} {} {sample}{}", quoted(folder), option("--scenario", scenario))
}

fn replay_command(replay: &Replay<'_>) -> String {
    let settings: String = replay.settings.iter().map(|setting| option("--set", Some(setting))).collect();
    let paired = if replay.is_paired { " --paired" } else { "" };
    let controller = option("--controller", replay.controller);
    format!(
        "{}{paired}{controller}{settings}{}",
        sample_command("replay", replay.sample),
        option("--record", replay.recording)
    )
}

/// Returns the command that resumes a campaign: the command that started it, without the options
/// that would end it at the same sample again, and with the folder in which its results are. A
/// command with paths that are relative to another folder runs there.
fn resume_command(Resume { command, retries_errors, moved_to, working_folder }: Resume<'_>) -> String {
    if let [call] = command {
        return resume_call(call, retries_errors, moved_to);
    }
    let is_kept = |word: &&str| !matches!(*word, "--fail-fast" | "--resume");
    let words: Vec<&str> = command.iter().map(String::as_str).filter(is_kept).collect();
    let (words, is_named) = moved_to.map_or((words.clone(), false), |folder| with_folder(&words, folder));
    let folder = moved_to.iter().filter(|_| !is_named).flat_map(|folder| ["--out", folder]);
    let is_retried = retries_errors && !command.iter().any(|word| word == "--retry-errors");
    let resumed = std::iter::once("--resume").chain(is_retried.then_some("--retry-errors"));
    let resumed = words.into_iter().chain(folder).chain(resumed).map(quoted).collect::<Vec<_>>().join(" ");
    match working_folder {
        Some(folder) => format!("cd {} && {resumed}", quoted(folder)),
        None => resumed,
    }
}

/// Returns the words of a command with another folder for its results, and whether it names one.
fn with_folder<'a>(words: &[&'a str], folder: &'a str) -> (Vec<&'a str>, bool) {
    const OPTIONS: [&str; 3] = ["--out", "--output", "-o"];
    let (mut replaced, mut is_value, mut is_named) = (Vec::new(), false, false);
    for &word in words {
        let is_joined = word.split_once('=').is_some_and(|(option, _)| OPTIONS.contains(&option))
            || (word.starts_with("-o") && word.len() > 2);
        match (is_value, is_joined) {
            (true, _) => replaced.push(folder),
            (false, true) => replaced.extend(["--out", folder]),
            (false, false) => replaced.push(word),
        }
        is_named |= is_value || is_joined;
        is_value = !is_value && OPTIONS.contains(&word);
    }
    (replaced, is_named)
}

/// Returns the call that resumes a campaign: the call of another program that started it, likewise.
fn resume_call(call: &str, retries_errors: bool, moved_to: Option<&str>) -> String {
    let call = [", fail_fast=True", ", resume=True", ", retry_errors=True"]
        .iter()
        .fold(call.to_owned(), |call, word| call.replace(word, ""));
    let call = moved_to.map_or_else(
        || call.clone(),
        |folder| {
            let named = call.split_once("out='").and_then(|(before, rest)| Some((before, rest.split_once('\'')?.1)));
            match named {
                Some((before, after)) => format!("{before}out='{folder}'{after}"),
                None => format!("{}, out='{folder}')", call.trim_end_matches(')')),
            }
        },
    );
    let retried = if retries_errors { ", retry_errors=True" } else { "" };
    format!("{}, resume=True{retried})", call.trim_end_matches(')'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_resume_command_is_the_command_with_quotes_and_resume() {
        let resumed = |text: &str, retries_errors, moved_to| {
            let command = shlex::split(text).unwrap_or_default();
            command_for(&Action::Resume(Resume { command: &command, retries_errors, moved_to, working_folder: None }))
        };
        assert_eq!(
            resumed("closecall campaign 'a b.toml' --out x --fail-fast", false, None),
            "closecall campaign 'a b.toml' --out x --resume"
        );
        assert_eq!(resumed("c campaign --resume --out x", true, None), "c campaign --out x --resume --retry-errors");
        assert_eq!(resumed("c campaign x --resume", false, Some("a b")), "c campaign x --out 'a b' --resume");
        // A folder that was copied or moved is not the one that the command names.
        for named in ["-o r/old", "--out r/old", "--out=r/old", "-or/old", "--output r/old"] {
            let command = resumed(&format!("c campaign x {named} -n 4"), false, Some("r/new"));
            assert!(command.contains(" r/new -n 4 --resume") && !command.contains("r/old"), "{command}");
        }
    }

    #[test]
    fn a_command_that_is_shown_can_be_copied_into_a_shell() {
        let command = ["closecall", "campaign", "a.toml", "--gate", "upper(induced) <= 0.02"].map(str::to_owned);
        let shown = "closecall campaign a.toml --gate 'upper(induced) <= 0.02'";
        assert_eq!(command_for(&Action::Repeat(&command)), shown);
        let call = ["closecall.campaign(['x'], out='y')".to_owned()];
        assert_eq!(command_for(&Action::Repeat(&call)), call[0], "a call in Python is no command of a shell");
    }

    #[test]
    fn a_command_with_the_paths_of_another_folder_runs_there() {
        let command = ["closecall", "campaign", "own/a.toml", "--out", "x"].map(str::to_owned);
        let resumed = |working_folder| {
            let moved_to = Some("/there/x y");
            command_for(&Action::Resume(Resume { command: &command, retries_errors: false, moved_to, working_folder }))
        };
        let there = "closecall campaign own/a.toml --out '/there/x y' --resume";
        assert_eq!(resumed(None), there);
        assert_eq!(resumed(Some("/the re")), format!("cd '/the re' && {there}"));
    }

    #[test]
    fn the_resume_call_is_the_call_with_resume() {
        let call = ["closecall.campaign(['x'], out='y', fail_fast=True)".to_owned()];
        let plain = Resume { command: &call, retries_errors: false, moved_to: None, working_folder: None };
        let resumed = |retries_errors| command_for(&Action::Resume(Resume { retries_errors, ..plain }));
        assert_eq!(resumed(false), "closecall.campaign(['x'], out='y', resume=True)");
        assert_eq!(resumed(true), "closecall.campaign(['x'], out='y', resume=True, retry_errors=True)");
        let moved = Resume { moved_to: Some("z"), ..plain };
        assert_eq!(command_for(&Action::Resume(moved)), "closecall.campaign(['x'], out='z', resume=True)");
    }

    #[test]
    fn a_replay_names_what_differs_from_a_plain_run() {
        let saved_sample = SavedSample { folder: "a b", sample: 7, scenario: Some("s") };
        let plain = Replay::new(saved_sample);
        assert_eq!(command_for(&Action::Replay(plain)), "closecall replay 'a b' 7 --scenario s");
        let settings = ["mis.disabled=[\"holding\"]".to_owned()];
        let full = Replay {
            is_paired: true,
            controller: Some("exec:./a b"),
            settings: &settings,
            recording: Some("x.rrd"),
            ..plain
        };
        assert_eq!(
            command_for(&Action::Replay(full)),
            "closecall replay 'a b' 7 --scenario s --paired --controller 'exec:./a b' --set 'mis.disabled=[\"holding\"]' \
             --record x.rrd"
        );
    }
}
