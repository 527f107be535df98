//! Actions that a user can take next, such as to run a sample again.
//!
//! A library knows the possible actions, such as to run a sample again. The program that calls the
//! library knows how its user asks for them, and passes a [`CommandFor`]. So no library names an
//! option of the command line.

/// Returns the command by which the user of a program does something.
pub type CommandFor = fn(&Action<'_>) -> String;

/// Something that a user can do with a campaign or a scenario.
#[derive(Clone, Copy, Debug)]
pub enum Action<'a> {
    /// Runs a sample of a saved campaign again.
    Replay(Replay<'a>),
    /// Explains a failing sample.
    Explain(SavedSample<'a>),
    /// Explains all failing samples of the campaign in this folder.
    ExplainAll(&'a str),
    /// Finds the smallest case of a failing sample that still fails.
    Minimize(SavedSample<'a>),
    /// Runs a scenario file.
    Run {
        /// The file.
        file: &'a str,
        /// The controller; `None` for the usual one.
        controller: Option<&'a str>,
    },
    /// Runs the command that started a campaign again.
    Repeat(&'a [String]),
    /// Resumes a campaign.
    Resume(Resume<'a>),
    /// Resumes the campaign in this folder, which another user or another machine has written: with
    /// a command line that the user knows.
    ResumeForeign(&'a str),
    /// Opens the recordings of a campaign.
    View {
        /// The campaign's folder.
        folder: &'a str,
        /// True if they open in the browser.
        is_in_browser: bool,
    },
}

/// A sample of a saved campaign.
#[derive(Clone, Copy, Debug)]
pub struct SavedSample<'a> {
    /// The campaign's folder.
    pub folder: &'a str,
    /// The sample's number.
    pub sample: u64,
    /// The name of its scenario; `None` if the campaign has only one.
    pub scenario: Option<&'a str>,
}

/// A sample that is run again.
#[derive(Clone, Copy, Debug)]
pub struct Replay<'a> {
    /// The sample.
    pub sample: SavedSample<'a>,
    /// True if it runs in all arms of the campaign.
    pub is_paired: bool,
    /// The controller; `None` for the one under test.
    pub controller: Option<&'a str>,
    /// Settings that change the scenario, each as `key=value`.
    pub settings: &'a [String],
    /// The recording to write; `None` for no recording.
    pub recording: Option<&'a str>,
}

impl<'a> Replay<'a> {
    /// Returns a plain run of a sample.
    pub const fn new(sample: SavedSample<'a>) -> Self {
        Self { sample, is_paired: false, controller: None, settings: &[], recording: None }
    }
}

/// A campaign that goes on.
#[derive(Clone, Copy, Debug)]
pub struct Resume<'a> {
    /// The words of the command that started it.
    pub command: &'a [String],
    /// True if samples that ended in an error are run again.
    pub retries_errors: bool,
    /// The folder to which its results have been moved; `None` if they are where they were.
    pub moved_to: Option<&'a str>,
    /// The folder to which the paths of the command are relative; `None` if it is the folder in
    /// which the user is.
    pub working_folder: Option<&'a str>,
}
