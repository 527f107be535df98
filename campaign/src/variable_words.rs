//! Words of a message that differ from sample to sample although they are no numbers: names that
//! are drawn at random, and the plural beside a number.
//!
//! Both functions return a text that is compared with others and never shown.

/// The folders of temporary files (Filesystem Hierarchy Standard 3.0, sections 3.18 and 5.15; the
/// last one is a folder of macOS), each with the number of folders below it whose names are random.
const TEMPORARY: [(&str, usize); 4] = [("/tmp/", 1), ("/var/tmp/", 1), ("/dev/shm/", 1), ("/var/folders/", 4)];
/// The folder in which macOS keeps some of them.
const PRIVATE: &str = "/private";

/// Shortest part of the name of a temporary file that is drawn at random (characters): `mkstemp`
/// draws six.
const RANDOM_CHARS: usize = 6;
/// Shortest hexadecimal word that is an identity and no error code (digits): error codes have up to
/// eight.
const IDENTITY_DIGITS: usize = 12;
/// The lengths of the parts of a UUID (RFC 9562, section 4).
const UUID_PARTS: [usize; 5] = [8, 4, 4, 4, 12];

/// Number of words after a number that it counts: `2 tracks`, `2 confirmed tracks`.
const COUNTED_WORDS: usize = 2;

/// Returns a message with `#` for each name that is drawn at random: a temporary folder or file, a
/// UUID, a hash.
pub(super) fn without_random_names(message: &str) -> String {
    let is_end = |c: char| c.is_whitespace() || "\"'`()[]{}<>=,;:|".contains(c);
    let mut text = String::with_capacity(message.len());
    for piece in message.split_inclusive(is_end) {
        let word = piece.trim_end_matches(is_end);
        text.push_str(&without_identities(&without_temporary_names(word)));
        text.push_str(&piece[word.len()..]);
    }
    text
}

/// Returns a path in a folder of temporary files without the names there; another word as it is.
fn without_temporary_names(word: &str) -> String {
    let path = word.strip_prefix(PRIVATE).unwrap_or(word);
    let root = TEMPORARY.iter().find_map(|(root, folders)| Some((*root, *folders, path.strip_prefix(*root)?)));
    let Some((root, folders, below)) = root else { return word.to_owned() };
    let (within, name) = below.rsplit_once('/').map_or((None, below), |(within, name)| (Some(within), name));
    let mut parts: Vec<String> = within.into_iter().flat_map(|within| within.split('/')).map(str::to_owned).collect();
    // A file deeper than the random folders has a name of its own.
    parts.push(if parts.len() < folders { without_random_parts(name) } else { name.to_owned() });
    let last = parts.len() - 1;
    for folder in parts.iter_mut().take(folders.min(last)) {
        "#".clone_into(folder);
    }
    format!("{root}{}", parts.join("/"))
}

/// Returns the name of a temporary file with `#` for its parts that are drawn at random.
fn without_random_parts(name: &str) -> String {
    if name.trim_start_matches('.').starts_with("tmp") {
        return "#".to_owned();
    }
    let is_random = |part: &str| {
        let has = |is: fn(char) -> bool| part.contains(is);
        let is_mixed = has(|c| c.is_ascii_lowercase()) && has(|c| c.is_ascii_uppercase());
        part.len() >= RANDOM_CHARS && (is_mixed || has(|c| c.is_ascii_digit()))
    };
    replaced(name, |c| !c.is_ascii_alphanumeric(), is_random)
}

/// Returns a word with `#` for each UUID and each hash in it.
fn without_identities(word: &str) -> String {
    let is_uuid = |part: &str| {
        let lengths = part.split('-').map(str::len);
        lengths.eq(UUID_PARTS) && part.chars().all(|c| c.is_ascii_hexdigit() || c == '-')
    };
    let is_hash = |part: &str| {
        let (has_digit, has_letter) = (part.contains(|c: char| c.is_ascii_digit()), part.contains(char::is_alphabetic));
        part.len() >= IDENTITY_DIGITS && has_digit && has_letter && part.chars().all(|c| c.is_ascii_hexdigit())
    };
    let text = replaced(word, |c| !c.is_ascii_alphanumeric() && c != '-', is_uuid);
    replaced(&text, |c| !c.is_ascii_alphanumeric(), is_hash)
}

/// Returns a text with `#` for each part between separators that `is_random`.
fn replaced(text: &str, is_separator: impl Fn(char) -> bool + Copy, is_random: impl Fn(&str) -> bool) -> String {
    let parts = text.split_inclusive(is_separator).map(|piece| {
        let part = piece.trim_end_matches(is_separator);
        let end = &piece[part.len()..];
        format!("{}{end}", if is_random(part) { "#" } else { part })
    });
    parts.collect()
}

/// Returns a text whose numbers are `#` with the words that agree with a number in one form:
/// `# tracks are` and `# track is` become the same.
pub(super) fn in_one_number(text: &str) -> String {
    if !text.contains('#') {
        return text.to_owned();
    }
    let is_in_word = |c: char| c.is_alphanumeric() || c == '_' || c == '#';
    let (mut one, mut rest, mut counted) = (String::with_capacity(text.len()), text, 0);
    while !rest.is_empty() {
        let (word, after) = rest.split_at(rest.find(|c: char| !is_in_word(c)).unwrap_or(rest.len()));
        let (gap, next) = after.split_at(after.find(is_in_word).unwrap_or(after.len()));
        match word {
            "is" | "are" => one.push_str("is"),
            "was" | "were" => one.push_str("was"),
            "has" | "have" => one.push_str("has"),
            noun if counted > 0 => one.push_str(&stem(noun)),
            other => one.push_str(other),
        }
        counted =
            if word.contains('#') { COUNTED_WORDS } else { counted.saturating_sub(usize::from(!word.is_empty())) };
        // A number counts nothing in the next sentence.
        if gap.contains(['.', ':', ';', '|']) {
            counted = 0;
        }
        one.push_str(gap);
        rest = next;
    }
    one
}

/// Returns the part that a noun has in common with its plural: `track`, `class`, `cas` of `case`,
/// `entry`.
fn stem(noun: &str) -> String {
    // Units have no plural: `ms`.
    const SHORTEST: usize = 3;
    if noun.len() < SHORTEST {
        return noun.to_owned();
    }
    if let Some(stem) = noun.strip_suffix("ies") {
        return format!("{stem}y");
    }
    let is_singular = ["ss", "us", "is"].iter().any(|end| noun.ends_with(end));
    let stem = if is_singular { noun } else { noun.strip_suffix('s').unwrap_or(noun) };
    stem.strip_suffix('e').unwrap_or(stem).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_drawn_at_random_are_left_out() {
        for (message, expected) in [
            ("cannot open '/tmp/tmpk3x_9ab1/map.bin'", "cannot open '/tmp/#/map.bin'"),
            ("cannot open /tmp/.tmpAbCdEf", "cannot open /tmp/#"),
            ("/tmp/model.a8XbQ2: no such file", "/tmp/model.#: no such file"),
            ("/dev/shm/ring-Xy12Za.bin is full", "/dev/shm/ring-#.bin is full"),
            ("/private/var/folders/zz/zyx_n0000/T/tmpab12/map.bin", "/var/folders/#/#/#/#/map.bin"),
            ("run 3f2504e0-4f89-41d3-9a0c-0305e82c3301 is lost", "run # is lost"),
            ("commit a9993e364706816aba3e25717850c26c9cd0d89d", "commit #"),
        ] {
            assert_eq!(without_random_names(message), expected);
        }
        for kept in [
            "cannot open /tmp/map.bin",
            "cannot open /home/me/tmpk3x_9ab1/map.bin",
            "code c0000005",
            "code 1099511627776",
            "the sensors are deaf: effaced",
            "",
        ] {
            assert_eq!(without_random_names(kept), kept);
        }
    }

    #[test]
    fn words_agree_with_one_number() {
        for (one, other) in [
            ("# track is lost", "# tracks are lost"),
            ("# track has vanished", "# tracks have vanished"),
            ("# confirmed track has no class", "# confirmed tracks have no class"),
            ("there was # box", "there were # boxes"),
            ("# case, # class, # bus, # entry", "# cases, # classes, # buses, # entries"),
        ] {
            assert_eq!(in_one_number(one), in_one_number(other));
        }
        for (one, other) in [
            ("# tracks are lost", "# lanes are lost"),
            ("the track is lost", "the tracks are lost"),
            ("# is late. Tracks lost", "# is late. Track lost"),
        ] {
            assert_ne!(in_one_number(one), in_one_number(other));
        }
    }
}
