//! Where members come from: files, folders, or the program; and the scenarios of an ensemble.

use std::path::{Path, PathBuf};

use closecall_traffic::input::read_text;
use closecall_traffic::suggest::nearest;

use super::shipped::{all, named, names};
use super::{Application, ApplyError, Member, MemberError};
use crate::ScenarioFile;

/// Reads members: `FILE`, `FOLDER` (each `*.toml` in it, in alphabetical order), or `NAME` of a
/// member that is part of the program. Without arguments, every member that is part of the program
/// is read.
///
/// # Errors
/// [`MemberError`] if there is no such member, if a file is not valid, or if two members have the
/// same name.
pub fn members(arguments: &[PathBuf]) -> Result<Vec<Member>, MemberError> {
    let mut members = Vec::new();
    for argument in arguments {
        if argument.is_dir() {
            members.extend(in_folder(argument)?);
        } else if argument.exists() || argument.extension().is_some_and(|extension| extension == "toml") {
            members.push(read(argument)?);
        } else {
            let name = argument.to_str().unwrap_or_default();
            members.push(named(name)?.ok_or_else(|| unknown(format!("there is no member `{name}`"), name))?);
        }
    }
    if arguments.is_empty() {
        members = all()?;
    }
    for (index, member) in members.iter().enumerate() {
        if let Some(same) = members[..index].iter().find(|earlier| earlier.name() == member.name()) {
            return Err(MemberError::SameName {
                first: same.path().to_owned(),
                second: member.path().to_owned(),
                name: member.name().to_owned(),
            });
        }
    }
    Ok(members)
}

/// The scenarios of an ensemble.
#[derive(Clone, Debug, Default)]
pub struct Ensemble {
    /// Each scenario with each member that changes it.
    pub entries: Vec<ScenarioFile>,
    /// The members without effect, as pairs of scenario and member.
    pub without_effect: Vec<(String, String)>,
}

/// Applies each member to each scenario.
///
/// # Errors
/// [`ApplyError`] if a value of a member is not valid for a driver of a scenario.
pub fn ensemble_of(files: &[ScenarioFile], members: &[Member]) -> Result<Ensemble, ApplyError> {
    let Ensemble { mut entries, mut without_effect } = Ensemble::default();
    for file in files {
        for member in members {
            match member.apply(file)? {
                Application::Entry(entry) => entries.push(*entry),
                Application::NoEffect => {
                    without_effect.push((file.config().name.clone(), member.name().to_owned()));
                }
            }
        }
    }
    Ok(Ensemble { entries, without_effect })
}

fn in_folder(folder: &Path) -> Result<Vec<Member>, MemberError> {
    let fail = |source| MemberError::Read { path: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.is_file() && path.extension().is_some_and(|extension| extension == "toml") {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(unknown(format!("{} contains no member (*.toml)", folder.display()), ""));
    }
    files.sort();
    files.iter().map(|path| read(path)).collect()
}

fn read(path: &Path) -> Result<Member, MemberError> {
    let text = read_text(path).map_err(|source| MemberError::Read { path: path.to_owned(), source })?;
    Member::parse(path, &text)
}

fn unknown(place: String, name: &str) -> MemberError {
    let allowed: Vec<String> = names().map(|name| format!("`{name}`")).collect();
    let suggestion =
        nearest(name, names()).map(|candidate| format!("; did you mean `{candidate}`?")).unwrap_or_default();
    MemberError::Unknown { place, names: allowed.join(", "), suggestion }
}
