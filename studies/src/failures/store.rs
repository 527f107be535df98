//! The file of the causes in a campaign's folder.

use closecall_campaign::folder::Folder;
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::input;

use super::FailureRow;

/// The name of the file.
pub const CAUSES: &str = "causes.json";

/// Reads the rows that previous explanations of the campaign have kept. A file that cannot be read
/// counts as none: the rows can be made again.
pub fn read_rows(folder: &Folder) -> Vec<FailureRow> {
    let text = input::read_text(&folder.file(CAUSES)).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

/// Writes the rows.
///
/// # Errors
/// [`WriteError`] if the file cannot be written. An existing file then stays as it is.
pub fn write_rows(folder: &Folder, rows: &[FailureRow]) -> Result<(), WriteError> {
    let path = folder.file(CAUSES);
    let text = serde_json::to_string_pretty(rows).map_err(|error| WriteError::new(&path, error.into()))?;
    write_file(&path, |file| file.write_all(text.as_bytes()))
}
