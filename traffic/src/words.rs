//! Counts in words: `1 sample`, `2 samples`.

use std::fmt::Display;

/// Returns a count with its noun, which is in the singular for 1: `1 sample`, `0 samples`,
/// `2 approaches`.
pub fn counted<T: Display + PartialEq + From<u8>>(count: T, noun: &str) -> String {
    let ending = match (count == T::from(1), noun.ends_with("ch")) {
        (true, _) => "",
        (false, true) => "es",
        (false, false) => "s",
    };
    format!("{count} {noun}{ending}")
}

/// Returns the verb of a count of things: `1 sample was`, `2 samples were`.
pub fn was<T: PartialEq + From<u8>>(count: T) -> &'static str {
    if count == T::from(1) { "was" } else { "were" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_one_is_singular() {
        assert_eq!([0_u64, 1, 2].map(|count| counted(count, "sample")), ["0 samples", "1 sample", "2 samples"]);
        assert_eq!([1_usize, 21].map(|count| counted(count, "approach")), ["1 approach", "21 approaches"]);
        assert_eq!(counted(1_u16, "lane change"), "1 lane change");
        assert_eq!([0_u64, 1, 2].map(was), ["were", "was", "were"]);
    }
}
