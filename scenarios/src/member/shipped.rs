//! The members of `scenarios/ensemble`, which are part of the program.

use std::path::PathBuf;

use serde::Serialize;

use super::{Member, MemberError};

/// Embeds members of `scenarios/ensemble`, by their names.
macro_rules! embedded {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../../ensemble/", $name, ".toml")))),*]
    };
}

/// The members, each with its name and its text, in alphabetical order.
const SHIPPED: [(&str, &str); 13] = embedded![
    "alert",
    "anticipation-full",
    "anticipation-none",
    "calm-brakers",
    "distracted",
    "evidence",
    "glances",
    "hard-brakers",
    "idm",
    "slow",
    "steer-none",
    "steer-sharply",
    "typical",
];

/// A member, as a list of the ensemble describes it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct MemberEntry {
    /// The member's name.
    pub name: String,
    /// How its drivers drive.
    pub description: String,
    /// The member's settings, each as `key = value`.
    pub sets: Vec<String>,
    /// The source of each value.
    pub sources: Vec<String>,
}

impl std::fmt::Display for MemberEntry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}\n  {}", self.name, self.description)?;
        self.sets.iter().try_for_each(|set| write!(f, "\n  {set}"))
    }
}

/// Returns the names of the members, in alphabetical order.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.into_iter().map(|(name, _)| name)
}

/// Returns every member that is part of the program.
///
/// # Errors
/// [`MemberError`] if an embedded member is invalid, which is a defect of the program.
pub(super) fn all() -> Result<Vec<Member>, MemberError> {
    SHIPPED.into_iter().map(|(name, text)| Member::parse(&path(name), text)).collect()
}

/// Returns the member of that name, or `None` if there is none.
///
/// # Errors
/// [`MemberError`] if the embedded member is invalid, which is a defect of the program.
pub(super) fn named(name: &str) -> Result<Option<Member>, MemberError> {
    let shipped = SHIPPED.into_iter().find(|(member, _)| *member == name);
    shipped.map(|(name, text)| Member::parse(&path(name), text)).transpose()
}

/// Describes every member.
///
/// # Errors
/// [`MemberError`] if an embedded member is invalid, which is a defect of the program.
pub fn entries() -> Result<Vec<MemberEntry>, MemberError> {
    let entry = |member: &Member| {
        let (sets, sources) = member.values().into_iter().unzip();
        MemberEntry { name: member.name().to_owned(), description: member.description().to_owned(), sets, sources }
    };
    Ok(all()?.iter().map(entry).collect())
}

/// Returns the path by which messages name a member that is part of the program. No such file is
/// read.
fn path(name: &str) -> PathBuf {
    PathBuf::from(format!("ensemble/{name}.toml"))
}
