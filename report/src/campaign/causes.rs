//! The table of causes in the report of a campaign.

use std::path::PathBuf;

use closecall_campaign::action::CommandFor;
use closecall_campaign::folder::Folder;
use closecall_campaign::saved::SavedCampaign;
use closecall_studies::cost::{cost, section as cost_section};
use closecall_studies::failures::{CAUSES, Failures, campaign_failures, section, without_section, write_rows};
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::input;
use closecall_traffic::shown::shown;
use maud::{Markup, html};

/// The name of the report.
const REPORT: &str = "report.html";

/// Writes the causes of a campaign's failures: as a separate file, and into the report, if there is
/// one. Returns the paths.
///
/// # Errors
/// [`WriteError`] if a file cannot be written. Existing files then stay as they are.
pub fn write_causes(
    saved: &SavedCampaign,
    failures: &Failures,
    command_for: CommandFor,
) -> Result<Vec<PathBuf>, WriteError> {
    let folder = saved.folder();
    write_rows(folder, &failures.rows)?;
    let mut written = vec![folder.file(CAUSES)];
    let path = folder.file(REPORT);
    let page = input::read_text(&path).unwrap_or_default();
    if let Some([before, old, after]) = without_section(&page) {
        let table = section(failures, saved.manifest().scenarios.len() > 1, command_for).into_string();
        // The heading keeps the name by which the list of contents refers to it.
        let heading = old.find("<h2").and_then(|begin| old[begin..].split_inclusive('>').next());
        let table = shown(&table).replacen("<h2>", heading.unwrap_or("<h2>"), 1);
        write_file(&path, |file| file.write_all([before, &table, after].concat().as_bytes()))?;
        written.push(path);
    }
    Ok(written)
}

/// Returns the table of causes of a campaign, and its cost where nothing happens. A folder that
/// cannot be read again has none.
pub(super) fn table(folder: &Folder, command_for: CommandFor) -> Markup {
    let saved = SavedCampaign::of(folder.clone()).ok();
    let failures = saved.as_ref().and_then(|saved| campaign_failures(saved).ok()).unwrap_or_default();
    let cost = saved.as_ref().and_then(|saved| cost(saved).ok());
    let is_named = saved.is_some_and(|saved| saved.manifest().scenarios.len() > 1);
    html! { (section(&failures, is_named, command_for)) (cost.map_or_else(Markup::default, |cost| cost_section(&cost))) }
}
