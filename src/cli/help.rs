//! The form of each command's help: options under headings that name a purpose, and three examples
//! at the end.

/// The headings of options. Each names the purpose of its options.
pub(super) mod heading {
    /// The scenario, and changes of it.
    pub(in crate::cli) const SCENARIO: &str = "Scenario";
    /// The samples that run, and their number.
    pub(in crate::cli) const SAMPLES: &str = "Samples";
    /// The driver of the ego vehicle, its perception, and its references.
    pub(in crate::cli) const CONTROLLER: &str = "Controller and sensors";
    /// The used part of a trajectory file, and its interpretation.
    pub(in crate::cli) const DATA: &str = "Trajectory data";
    /// The varied or computed quantities of a study.
    pub(in crate::cli) const METHOD: &str = "Method";
    /// The random scenes of labelled images.
    pub(in crate::cli) const SCENES: &str = "Scenes";
    /// The criteria of a result.
    pub(in crate::cli) const GATES: &str = "Gates";
    /// How the simulator itself is checked.
    pub(in crate::cli) const VALIDITY: &str = "Validity checks";
    /// Where, how long and how fast the samples run.
    pub(in crate::cli) const EXECUTION: &str = "Execution";
    /// The repetition at every change of a file.
    pub(in crate::cli) const WATCH: &str = "At every change";
    /// The files of a continuous integration.
    pub(in crate::cli) const CI: &str = "CI job";
    /// The program that shows recordings.
    pub(in crate::cli) const VIEWER: &str = "Viewer";
    /// The printed and written output.
    pub(in crate::cli) const OUTPUT: &str = "Output";
}

/// Returns the end of a command's help: three command lines, the shortest first.
pub(super) fn examples(lines: [&str; 3]) -> String {
    format!("Examples:\n  {}", lines.join("\n  "))
}
