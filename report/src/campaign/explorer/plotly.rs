//! The script of Plotly, which the crate `plotly` carries.

use plotly::Plot;

const BEGIN: &str = "<script type=\"text/javascript\">";
const END: &str = "</script>";

/// Returns the script. The crate's text holds a second script, for formulas, which no chart needs.
pub(super) fn script() -> String {
    let sources = Plot::offline_js_sources();
    let script = sources.split_once(BEGIN).and_then(|(_, rest)| rest.split_once(END));
    script.map_or_else(String::new, |(script, _)| script.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_is_plotly_and_nothing_else() {
        let script = script();
        assert!(script.contains("plotly.js v"), "{}", &script[..200.min(script.len())]);
        assert!(script.len() > 1_000_000 && !script.contains("MathJax.loader"));
    }
}
