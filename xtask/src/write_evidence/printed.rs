//! Sections that consist of a command's output.

use std::error::Error;
use std::process::Command;

use super::page::{self, Size};

/// Returns the output of a command. The program is in the folder of this program.
fn output(words: &[&str]) -> Result<Vec<u8>, Box<dyn Error>> {
    let program = std::env::current_exe()?.with_file_name("closecall");
    let output = Command::new(program).args(words).current_dir(page::root()).env("COLUMNS", "120").output()?;
    if !output.status.success() {
        return Err(format!("{}: {}", words.join(" "), String::from_utf8_lossy(&output.stderr)).into());
    }
    Ok(output.stdout)
}

/// Returns the figures that a command prints for programs.
pub(super) fn json(words: &[&str]) -> Result<serde_json::Value, Box<dyn Error>> {
    Ok(serde_json::from_slice(&output(&[words, &["--format", "json"]].concat())?)?)
}

/// Returns a command and its output, as blocks of Markdown.
fn printed(words: &[&str]) -> Result<String, Box<dyn Error>> {
    let text = output(words)?;
    let text = String::from_utf8_lossy(&text);
    Ok(format!("`closecall {}` prints:\n\n```\n{}\n```\n", words.join(" "), text.trim_end()))
}

/// The outputs of the study that the page leaves out.
const OTHER_OUTPUTS: [&str; 4] =
    ["induced collisions", "harm prevented", "collisions in the baseline", "collisions in the arm under test"];

/// The factors that move the number of prevented collisions.
pub(super) fn sensitivity(size: Size) -> Result<String, Box<dyn Error>> {
    let seed = size.seed.to_string();
    let text = printed(&["study", "sensitivity", "low-thw-overtake", "--seed", &seed, "--sensors", "object"])?;
    let mut is_other = false;
    let is_kept = |paragraph: &&str| {
        // A table that is indented belongs to the output above it.
        if !paragraph.starts_with(' ') {
            is_other = OTHER_OUTPUTS.iter().any(|output| paragraph.starts_with(output));
        }
        !is_other
    };
    let kept: Vec<&str> = text.split("\n\n").filter(is_kept).collect();
    Ok(kept.join("\n\n").replacen(" prints:", " prints, without its other outputs:", 1))
}

/// What settings of the system prevent, induce and cost.
pub(super) fn frontier(size: Size) -> Result<String, Box<dyn Error>> {
    let (seed, samples) = (size.seed.to_string(), size.samples.to_string());
    let mut text = String::new();
    for scenario in ["low-thw-overtake", "lead-brakes-at-any-time"] {
        let mut words = vec!["study", "frontier", scenario, "--sensors", "object", "-n", &samples, "--seed", &seed];
        let settings = ["max-deceleration-mps2=1.0,2.0,3.0", "engage-gap-m=100,150", "thw-gain-s=2,3"];
        let settings = settings.map(|values| format!("actor.ego.driver.ego-stack.mis.{values}"));
        settings.iter().for_each(|values| words.extend(["--vary", values]));
        text.push_str(&printed(&words)?);
        text.push('\n');
    }
    Ok(text)
}

/// Emergency braking against crash records.
pub(super) fn anchor(size: Size) -> Result<String, Box<dyn Error>> {
    printed(&["study", "anchor", "-n", &size.samples.to_string(), "--seed", &size.seed.to_string()])
}
