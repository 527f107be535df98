//! The command line that resumes a campaign.

/// Returns a word as a shell reads it, with quotes if it needs them.
pub fn quoted(word: &str) -> String {
    shlex::try_quote(word).map_or_else(|_| word.to_owned(), |quoted| quoted.into_owned())
}

/// Returns the command line that resumes the campaign that `args` started: without the options that would end it at the
/// same sample again. With `retry_errors` it also runs the samples again that ended in an error.
pub fn resume_command(args: impl Iterator<Item = String>, retry_errors: bool) -> String {
    let mut words: Vec<String> = args.filter(|word| word != "--fail-fast").collect();
    let wanted = [("--resume", true), ("--retry-errors", retry_errors)];
    for (option, is_wanted) in wanted {
        if is_wanted && !words.iter().any(|word| word == option) {
            words.push(option.to_owned());
        }
    }
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_resume_command_is_the_command_with_quotes_and_resume() {
        let of = |text: &str, retry| resume_command(shlex::split(text).unwrap_or_default().into_iter(), retry);
        assert_eq!(
            of("closecall campaign 'a b.toml' --out x --fail-fast", false),
            "closecall campaign 'a b.toml' --out x --resume"
        );
        assert_eq!(of("c campaign --resume --out x", true), "c campaign --resume --out x --retry-errors");
    }
}
