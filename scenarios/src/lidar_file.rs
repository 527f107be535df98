//! LiDARs whose scan pattern is a separate file. It is read together with the scenario file.
//!
//! The contents of the file replace `pattern-file` in the text of the scenario, and the table of
//! beams replaces `beams-file` in a pattern. All later steps (checking, hashing, a campaign's
//! manifest, replay) do not need the files.

use std::path::Path;

use closecall_sensors::lidar::{LidarConfig, LidarKindConfig};
use closecall_traffic::input::read_text;
use closecall_traffic::{KeyPath, Segment};
use toml_edit::{DocumentMut, Item, TableLike, Value};

use super::{ScenarioConfig, ScenarioError, locate};

/// The key of the file, and the key that its contents become.
const KEYS: [&str; 2] = ["pattern-file", "pattern"];
/// The key of the file with a table of beams, and the key that its contents become.
const BEAMS: [&str; 2] = ["beams-file", "beams"];

/// Puts the contents of each pattern file in place of its name, in the contents of a scenario file
/// and in its text. Returns the text, or `None` if no pattern file is named. `path` is the path of
/// the scenario file, and `origin` has its lines.
///
/// # Errors
/// [`ScenarioError`] with the path of the pattern file if the file cannot be read, or has a wrong
/// key.
pub(super) fn inline(
    path: &Path,
    text: &str,
    origin: &locate::Origin,
    config: &mut ScenarioConfig,
) -> Result<Option<String>, ScenarioError> {
    let mut document: Option<DocumentMut> = None;
    for ((key, index), lidar) in lidars(config) {
        let element = index.map_or_else(String::new, |index| format!("[{index}]"));
        let at = format!("sensors.{key}{element}");
        let (kind, pattern) = match (&lidar.pattern_file, &lidar.pattern) {
            (Some(name), _) => read(&path.with_file_name(name), &format!("{at}.{}", KEYS[0]))?,
            (None, Some(kind)) if kind.beams_file.is_some() => {
                let kind = with_beams(path, kind.clone(), &format!("{at}.{}.{}", KEYS[1], BEAMS[0]))?;
                let pattern = as_table(&kind, path)?;
                (kind, pattern)
            }
            _ => continue,
        };
        let syntax = |message: &str| {
            let key_of = |key: &str| Segment::Key(key.to_owned());
            let lidar = [key_of("sensors"), key_of(key)].into_iter().chain(index.map(Segment::Index));
            let line = origin.line_of(&KeyPath(lidar.chain([key_of(KEYS[0])]).collect()));
            ScenarioError::Syntax { path: path.to_owned(), line, message: format!("`{}`: {message}", KEYS[0]) }
        };
        if lidar.pattern_file.is_some() && lidar.pattern.is_some() {
            return Err(syntax("contradicts `pattern`: one of the two describes the LiDAR"));
        }
        let document = match &mut document {
            Some(document) => document,
            none => none.insert(text.parse().map_err(|_| syntax("the scenario is not TOML"))?),
        };
        let item = document.get_mut("sensors").and_then(|sensors| sensors.get_mut(key));
        let table = match index {
            None => item.and_then(Item::as_table_like_mut),
            Some(index) => item.and_then(|list| element_of(list, index)),
        };
        let table = table.ok_or_else(|| syntax("the sensor must be written as a table"))?;
        table.remove(KEYS[0]);
        table.insert(KEYS[1], Item::Value(Value::InlineTable(pattern)));
        lidar.pattern = Some(kind);
        lidar.pattern_file = None;
    }
    Ok(document.map(|document| document.to_string()))
}

/// Returns the LiDARs of a scenario with their keys. A LiDAR of a list has its index, too.
fn lidars(config: &mut ScenarioConfig) -> impl Iterator<Item = ((&'static str, Option<usize>), &mut LidarConfig)> {
    let front = config.sensors.front_lidar.as_mut().map(|lidar| (("front-lidar", None), lidar));
    let further = config.sensors.additional_rear_lidars.iter_mut().enumerate();
    let further = further.map(|(index, lidar)| (("additional-rear-lidars", Some(index)), lidar));
    std::iter::once((("rear-lidar", None), &mut config.sensors.rear_lidar)).chain(front).chain(further)
}

/// Returns the table at `index` of a list of tables, in either of the two forms of TOML.
fn element_of(list: &mut Item, index: usize) -> Option<&mut dyn TableLike> {
    match list {
        Item::ArrayOfTables(tables) => tables.get_mut(index).map(|table| table as &mut dyn TableLike),
        Item::Value(Value::Array(values)) => {
            values.get_mut(index).and_then(Value::as_inline_table_mut).map(|table| table as &mut dyn TableLike)
        }
        _ => None,
    }
}

/// Reads and checks a pattern file, which the key `key` names.
fn read(path: &Path, key: &str) -> Result<(LidarKindConfig, toml_edit::InlineTable), ScenarioError> {
    let text = read_text(path).map_err(|source| {
        let source = std::io::Error::new(source.kind(), format!("`{key}` names this file: {source}"));
        ScenarioError::Read { path: path.to_owned(), source }
    })?;
    let syntax = |line, message| ScenarioError::Syntax { path: path.to_owned(), line: Some(line), message };
    let config = LidarKindConfig::parse(&text).map_err(|error| {
        let line = locate::line_at(&text, error.span().map_or(0, |span| span.start));
        syntax(line, error.message().to_owned())
    })?;
    let config = with_beams(path, config, BEAMS[0])?;
    config.kind().map_err(|source| {
        let line = locate::line_of(&text, &source.path);
        ScenarioError::Value { path: path.to_owned(), line, source: Box::new(source), at: String::new() }
    })?;
    let table = as_table(&config, path)?;
    Ok((config, table))
}

/// Returns a pattern as a table of TOML. `path` is the path of the file that has it.
fn as_table(config: &LidarKindConfig, path: &Path) -> Result<toml_edit::InlineTable, ScenarioError> {
    let syntax = |message| ScenarioError::Syntax { path: path.to_owned(), line: Some(1), message };
    let plain = toml::to_string(config).map_err(|error| syntax(error.to_string()))?;
    let document: DocumentMut = plain.parse().map_err(|error: toml_edit::TomlError| syntax(error.to_string()))?;
    Ok(document.as_table().clone().into_inline_table())
}

/// Puts the contents of the table of beams in place of its name, if the pattern names one. `path`
/// is the path of the file that has the pattern, and `key` the key that names the table.
fn with_beams(path: &Path, config: LidarKindConfig, key: &str) -> Result<LidarKindConfig, ScenarioError> {
    let Some(name) = &config.beams_file else { return Ok(config) };
    let table = path.with_file_name(name);
    let syntax = |line, message| ScenarioError::Syntax { path: table.clone(), line: Some(line), message };
    if config.beams.is_some() {
        return Err(syntax(1, format!("`{key}` contradicts `{}`: one of the two describes the LiDAR", BEAMS[1])));
    }
    let text = read_text(&table).map_err(|source| {
        let source = std::io::Error::new(source.kind(), format!("`{key}` names this file: {source}"));
        ScenarioError::Read { path: table.clone(), source }
    })?;
    config.with_beams(&text).map_err(|error| syntax(error.line(), error.to_string()))
}

#[cfg(test)]
mod tests {
    use closecall_sensors::lidar::LidarModel;

    use super::super::{ScenarioFile, library};
    use super::*;

    fn parse(folder: &Path, pattern: &str) -> Result<ScenarioFile, ScenarioError> {
        std::fs::write(folder.join("mine.toml"), pattern).unwrap();
        let name = library::plain_names().next().unwrap();
        let text = format!("base = \"{name}\"\nsensors.rear-lidar.pattern-file = \"mine.toml\"\n");
        ScenarioFile::parse(&folder.join("scenario.toml"), &text, &[])
    }

    #[test]
    fn the_contents_of_the_file_become_part_of_the_scenario() {
        let folder = tempfile::tempdir().unwrap();
        let file = parse(folder.path(), LidarModel::Os1With64.file()).unwrap();
        let lidar = &file.config().sensors.rear_lidar;
        assert_eq!(lidar.pattern_file, None);
        assert_eq!(lidar.pattern, Some(LidarKindConfig::parse(LidarModel::Os1With64.file()).unwrap()));
        file.check().unwrap();
        // The text alone suffices, without the file.
        let again = ScenarioFile::parse(Path::new("elsewhere.toml"), file.text(), &[]).unwrap();
        assert_eq!(again.config(), file.config());
    }

    #[test]
    fn the_files_of_further_lidars_become_part_of_the_scenario_in_both_forms_of_a_list() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("mine.toml"), LidarModel::Os1With64.file()).unwrap();
        let base = format!("base = \"{}\"\n", library::plain_names().next().unwrap());
        for list in [
            "sensors.additional-rear-lidars = [{ name = \"a\" }, { name = \"b\", pattern-file = \"mine.toml\" }]\n",
            "[[sensors.additional-rear-lidars]]\nname = \"a\"\n\
             [[sensors.additional-rear-lidars]]\nname = \"b\"\npattern-file = \"mine.toml\"\n",
        ] {
            let path = folder.path().join("scenario.toml");
            let file = ScenarioFile::parse(&path, &format!("{base}{list}"), &[]).unwrap();
            let [_, second] = &file.config().sensors.additional_rear_lidars[..] else { panic!("two LiDARs") };
            assert_eq!(second.pattern, Some(LidarKindConfig::parse(LidarModel::Os1With64.file()).unwrap()));
            file.check().unwrap();
            let missing = format!("{base}{}", list.replace("mine.toml", "none.toml"));
            let error = ScenarioFile::parse(&path, &missing, &[]).unwrap_err();
            let cause = std::error::Error::source(&error).map(ToString::to_string).unwrap_or_default();
            assert!(cause.contains("`sensors.additional-rear-lidars[1].pattern-file` names this file"), "{cause}");
        }
    }

    /// The pattern of a LiDAR that does not scan a raster.
    const ROSETTE: &str = "name = \"rosette\"\nsource = \"a test\"\nbeams-file = \"beams.csv\"\n\
         half-field-deg = 30.0\nazimuth-step-deg = 0.2\nbeam-width-deg = 0.1\nbeam-height-deg = 0.1\n\
         layer-spacing-deg = 0.2\nrate-hz = 10.0\nrange-m = 80.0\nrange-reflectivity = 0.1\n\
         range-probability = 0.9\nrange-sd-m = 0.02\nrange-sd-at-threshold-m = 0.06\n";
    const BEAM_ROWS: &str = "azimuth_deg,elevation_deg,time_offset_us\n-12.5,0.5,0\n3.25,-1,50000\n";

    #[test]
    fn a_table_of_beams_becomes_part_of_the_scenario_from_a_pattern_file_or_from_a_pattern() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("beams.csv"), BEAM_ROWS).unwrap();
        let name = library::plain_names().next().unwrap();
        let inner = format!("base = \"{name}\"\n[sensors.rear-lidar.pattern]\n{ROSETTE}");
        for file in [
            parse(folder.path(), ROSETTE).unwrap(),
            ScenarioFile::parse(&folder.path().join("scenario.toml"), &inner, &[]).unwrap(),
        ] {
            let pattern = file.config().sensors.rear_lidar.pattern.as_ref().unwrap();
            let beams = vec![[-12.5, 0.5, 0.0], [3.25, -1.0, 50_000.0]];
            assert_eq!((&pattern.beams, &pattern.beams_file), (&Some(beams), &None));
            file.check().unwrap();
            let again = ScenarioFile::parse(Path::new("elsewhere.toml"), file.text(), &[]).unwrap();
            assert_eq!(again.config(), file.config());
        }
    }

    #[test]
    fn a_wrong_table_of_beams_is_named_with_file_line_column_and_allowed_range() {
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("beams.csv");
        let fails = |rows: &str, pattern: &str| {
            std::fs::write(&table, rows).unwrap();
            parse(folder.path(), pattern).unwrap_err().to_string()
        };
        let message = fails(&BEAM_ROWS.replace("3.25", "31"), ROSETTE);
        let wrong = "column `azimuth_deg` is `31`, but a number from -30 to 30 is needed";
        assert!(message.contains("beams.csv:3: ") && message.ends_with(wrong), "{message}");
        let message = fails("", ROSETTE);
        assert!(message.contains("beams.csv:1: ") && message.contains("time_offset_us"), "{message}");
        let both = format!("layers-deg = [0.0]\n{ROSETTE}");
        let message = fails(BEAM_ROWS, &both);
        assert!(message.contains("mine.toml:1: `layers-deg` contradicts `beams`"), "{message}");
        std::fs::remove_file(&table).unwrap();
        let error = parse(folder.path(), ROSETTE).unwrap_err();
        let cause = std::error::Error::source(&error).map(ToString::to_string).unwrap_or_default();
        assert!(error.is_io() && cause.contains("`beams-file` names this file"), "{cause}");
    }

    #[test]
    fn a_wrong_file_is_named_with_line_key_and_allowed_range() {
        let folder = tempfile::tempdir().unwrap();
        let shipped = LidarModel::Os1With64.file();
        let fails = |pattern: &str| parse(folder.path(), pattern).unwrap_err().to_string();
        let message = fails(&shipped.replace("rate-hz = 10.0", "rate-hz = 40.0"));
        assert!(
            message.contains("mine.toml:") && message.ends_with("`rate-hz` is 40, but a number from 1 to 25 is needed"),
            "{message}"
        );
        let message = fails(&shipped.replace("beam-width-deg", "beam-widht-deg"));
        assert!(message.contains("mine.toml:") && message.contains("unknown field `beam-widht-deg`"), "{message}");
        let message = fails("");
        assert!(message.contains("missing field"), "{message}");
        std::fs::remove_file(folder.path().join("mine.toml")).unwrap();
        let text = "base = \"free-overtake\"\nsensors.rear-lidar.pattern-file = \"mine.toml\"\n";
        let name = library::plain_names().next().unwrap();
        let text = text.replace("free-overtake", name);
        let error = ScenarioFile::parse(&folder.path().join("scenario.toml"), &text, &[]).unwrap_err();
        let (message, cause) = (error.to_string(), std::error::Error::source(&error).map(ToString::to_string));
        let said = format!("{message}: {}", cause.unwrap_or_default());
        assert!(error.is_io() && said.contains("mine.toml"), "{said}");
        assert!(said.contains("`sensors.rear-lidar.pattern-file` names this file"), "{said}");
    }
}
