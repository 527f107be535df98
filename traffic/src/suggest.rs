//! Suggestions for misspelt words in messages.

/// Smallest similarity of two words (Jaro-Winkler, 0 to 1) at which a message suggests one word for
/// the other. clap suggests options from about the same value on.
const SIMILAR: f64 = 0.8;

/// Returns the candidate that is most similar to `word`, or `None` if none is similar.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let similarity = |candidate: &&'a str| strsim::jaro_winkler(&word.to_lowercase(), &candidate.to_lowercase());
    let scored = candidates.into_iter().filter(|candidate| *candidate != word);
    let best = scored.map(|candidate| (similarity(&candidate), candidate)).max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(similarity, _)| *similarity >= SIMILAR).map(|(_, candidate)| candidate)
}

/// Returns the end of a message that suggests a word for `word`: `; did you mean ...`. The
/// candidates are the words between backquotes in `listing`; a `$` before a candidate is ignored.
/// Returns an empty text if none is similar.
pub fn hint(word: &str, listing: &str) -> String {
    let candidates = listing.split('`').skip(1).step_by(2).map(|word| word.trim_start_matches('$'));
    nearest(word, candidates).map(|word| format!("; did you mean `{word}`?")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_similar_word_is_suggested_and_no_other() {
        let words = "`duration-s`, `road`, `environment`, `sensors`";
        assert_eq!(hint("duration", words), "; did you mean `duration-s`?");
        assert_eq!(hint("Sensor", words), "; did you mean `sensors`?");
        assert_eq!(hint("enviroment", words), "; did you mean `environment`?");
        assert_eq!(hint("weather", words), "");
        assert_eq!(hint("road", ""), "");
    }
}
