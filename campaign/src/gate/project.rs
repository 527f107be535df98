//! The project file, `closecall.toml`: gates for every campaign that is run in a folder or below
//! it.
//!
//! The files of all folders above count. A nearer file may demand more than a file above it. If a
//! nearer file demands less, the verdict names the weakened gate, as for a gate of the command
//! line.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use closecall_scenarios::criteria::{Expression, GateConfig};
use closecall_scenarios::source::PROJECT_FILE;
use closecall_traffic::input::{is_of_content, read_text};
use serde::Deserialize;

use super::{GateSet, GateSource, GateSpec, ProbabilitySpec};
use crate::probability::ProbabilityGate;

/// A project file that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("failed to read {}: {message}", path.display())]
pub struct ProjectError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong, with the line.
    pub message: String,
    /// Whether the operating system failed to read the file.
    pub is_io: bool,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct ProjectConfig {
    #[serde(default)]
    gate: GateConfig,
}

/// A project file that has been read.
#[derive(Debug)]
pub struct ProjectFile {
    path: PathBuf,
    gate: GateConfig,
}

impl ProjectFile {
    /// Reads the project files of `folder` and of the folders above it, the nearest first.
    ///
    /// # Errors
    /// [`ProjectError`] if a file cannot be read, has an unknown key or an invalid criterion, or
    /// two criteria that contradict each other.
    pub fn find(folder: &Path) -> Result<Vec<Self>, ProjectError> {
        let mut files = Vec::new();
        for path in folder.ancestors().map(|folder| folder.join(PROJECT_FILE)) {
            // A file that exists but cannot be read may hold gates, so it is an error and not left
            // out. The metadata of the link itself also find a broken link, for example into a
            // submodule that is not checked out.
            match path.symlink_metadata().map_err(|error| (error.kind(), error)) {
                Ok(_) => files.push(Self::read(&path)?),
                Err((ErrorKind::NotFound | ErrorKind::NotADirectory | ErrorKind::PermissionDenied, _)) => {}
                Err((_, error)) => return Err(ProjectError { path, message: error.to_string(), is_io: true }),
            }
        }
        Ok(files)
    }

    fn read(path: &Path) -> Result<Self, ProjectError> {
        let fail = |message: String, is_io| ProjectError { path: path.to_owned(), message, is_io };
        let text = read_text(path).map_err(|error| fail(error.to_string(), !is_of_content(&error)))?;
        let config: ProjectConfig = toml::from_str(&text).map_err(|error| fail(error.to_string(), false))?;
        if let Some([first, second]) = Expression::contradiction(&config.gate.require) {
            return Err(fail(format!("`gate.require`: `{first}` and `{second}` contradict each other"), false));
        }
        Ok(Self { path: path.to_owned(), gate: config.gate })
    }

    /// Returns a message if the file belongs to another user, for example in a folder that others
    /// can write to.
    pub fn foreign_owner(&self) -> Option<String> {
        #[cfg(unix)]
        {
            use std::os::unix::fs::MetadataExt as _;
            let owner = self.path.metadata().ok()?.uid();
            if owner != rustix::process::geteuid().as_raw() {
                let path = self.path.display();
                return Some(format!("the gates of {path} are used, which belongs to another user (number {owner})"));
            }
        }
        None
    }

    /// Adds the gates of the file that no gate of the set replaces. The set holds the gates of the
    /// command line, of a preset and of nearer files. A preset replaces no gate of the file that
    /// demands more.
    ///
    /// # Errors
    /// [`ProjectError`] if the largest probability or its confidence is out of range.
    pub fn add_to(self, set: &mut GateSet) -> Result<(), ProjectError> {
        let source = GateSource::ProjectFile(self.path.clone());
        for expression in self.gate.require {
            let weaker = set.weaker_than(&expression);
            set.weakened.extend(weaker);
            set.drop_weaker_preset(&expression);
            set.push(GateSpec { expression, source: source.clone() });
        }
        if let Some(max) = self.gate.max_probability {
            let confidence = self.gate.confidence.unwrap_or(ProbabilityGate::CONFIDENCE);
            let gate = ProbabilityGate::new(max, confidence).map_err(|error| ProjectError {
                path: self.path,
                message: error.to_string(),
                is_io: false,
            })?;
            let weaker = set.weaker_than_probability(&gate);
            set.weakened.extend(weaker);
            if set.probability.is_none() {
                set.probability = Some(ProbabilitySpec { gate, source });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn add_all(folder: &Path, set: &mut GateSet) {
        ProjectFile::find(folder).unwrap().into_iter().for_each(|file| file.add_to(set).unwrap());
    }

    #[test]
    fn a_nearer_project_file_hides_no_gate_of_one_above() {
        let root = tempfile::tempdir().unwrap();
        let below = root.path().join("a/b");
        std::fs::create_dir_all(&below).unwrap();
        let of_both = |nearer: &str| {
            let above = "[gate]\nrequire = ['count(ego_collided) <= 3']\nmax-probability = 0.01\n";
            std::fs::write(root.path().join(PROJECT_FILE), above).unwrap();
            std::fs::write(below.join(PROJECT_FILE), nearer).unwrap();
            let mut set = GateSet::default();
            add_all(&below, &mut set);
            let gates: Vec<String> = set.specs.iter().map(|spec| spec.expression.to_string()).collect();
            (gates, set.probability.map(|spec| spec.gate.max()), set.weakened)
        };
        assert_eq!(of_both(""), (vec!["count(ego_collided) <= 3".to_owned()], Some(0.01), Vec::new()));
        let stricter = of_both("[gate]\nrequire = ['count(ego_collided) <= 0']\nmax-probability = 0.001\n");
        assert_eq!(stricter, (vec!["count(ego_collided) <= 0".to_owned()], Some(0.001), Vec::new()));
        let (gates, max, weakened) = of_both("[gate]\nrequire = ['count(ego_collided) <= 9']\nmax-probability = 0.5\n");
        assert_eq!((gates, max), (vec!["count(ego_collided) <= 9".to_owned()], Some(0.5)));
        let nearer = below.join(PROJECT_FILE).display().to_string();
        assert_eq!(
            weakened,
            [
                format!("gate count(ego_collided) <= 3, replaced by count(ego_collided) <= 9 ({nearer})"),
                format!("gate max-probability 0.01, replaced by 0.5 ({nearer})")
            ]
        );
    }

    #[test]
    fn a_project_file_above_adds_what_the_set_does_not_have() {
        let root = tempfile::tempdir().unwrap();
        let below = root.path().join("a/b");
        std::fs::create_dir_all(&below).unwrap();
        let text = "[gate]\nrequire = ['count(ego_collided) <= 0', 'max(max_jerk_mps3) <= 3']\n";
        std::fs::write(root.path().join(PROJECT_FILE), text).unwrap();
        let mut set = GateSet::of(["count(ego_collided) <= 5".parse().unwrap()]);
        add_all(&below, &mut set);
        let gates: Vec<String> = set.specs.iter().map(|spec| spec.expression.to_string()).collect();
        assert_eq!(gates, ["count(ego_collided) <= 5", "max(max_jerk_mps3) <= 3"]);
    }

    #[test]
    fn both_sides_of_a_range_are_judged_and_contradictory_bounds_are_refused() {
        let root = tempfile::tempdir().unwrap();
        let write = |text: &str| std::fs::write(root.path().join(PROJECT_FILE), text).unwrap();
        write("[gate]\nrequire = ['share(engaged) >= 0.1', 'share(engaged) <= 0.5']\n");
        let gates_beside = |command_line: &str| {
            let mut set = GateSet::of([command_line.parse().unwrap()]);
            add_all(root.path(), &mut set);
            set.specs.iter().map(|spec| spec.expression.to_string()).collect::<Vec<_>>()
        };
        let range = ["share(engaged) >= 0.1", "share(engaged) <= 0.5"];
        assert_eq!(gates_beside("count(induced) <= 0"), [&["count(induced) <= 0"], &range[..]].concat());
        // A gate of the command line replaces the one on its side.
        assert_eq!(gates_beside("share(engaged) <= 0.9"), ["share(engaged) <= 0.9", range[0]]);
        write("[gate]\nrequire = ['share(engaged) <= 0.9', 'share(engaged) <= 0.5']\n");
        let message = ProjectFile::find(root.path()).unwrap_err().message;
        assert!(message.contains("<= 0.9") && message.contains("<= 0.5"), "{message}");
    }

    #[test]
    fn a_gate_that_demands_less_than_the_gate_of_the_project_is_named() {
        let root = tempfile::tempdir().unwrap();
        let text = "[gate]\nrequire = ['count(ego_collided) <= 3']\nmax-probability = 0.01\n";
        std::fs::write(root.path().join(PROJECT_FILE), text).unwrap();
        let weakened = |gate: &str, max_probability: Option<f64>| {
            let mut set = GateSet::of([gate.parse().unwrap()]);
            let gate = max_probability.map(|max| ProbabilityGate::new(max, ProbabilityGate::CONFIDENCE).unwrap());
            set.probability = gate.map(|gate| ProbabilitySpec { gate, source: GateSource::CommandLine });
            add_all(root.path(), &mut set);
            set.weakened
        };
        assert_eq!(
            weakened("count(ego_collided) <= 39", Some(0.5)),
            [
                "gate count(ego_collided) <= 3, replaced by count(ego_collided) <= 39 (command line)",
                "gate max-probability 0.01, replaced by 0.5 (command line)"
            ]
        );
        for (gate, max_probability) in [
            ("count(ego_collided) <= 3", None),
            ("count(ego_collided) <= 0", Some(0.01)),
            ("count(induced) <= 9", None),
        ] {
            assert_eq!(weakened(gate, max_probability), Vec::<String>::new(), "{gate}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_project_file_that_cannot_be_read_is_not_left_out() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join(PROJECT_FILE);
        let is_refused = || ProjectFile::find(root.path()).unwrap_err().is_io;
        std::os::unix::fs::symlink("/nonexistent/closecall.toml", &path).unwrap();
        assert!(is_refused(), "a link that leads nowhere");
        std::fs::remove_file(&path).unwrap();
        std::fs::create_dir(&path).unwrap();
        assert!(is_refused(), "a folder");
        std::fs::remove_dir(&path).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        assert!(is_refused(), "a named pipe");
    }

    #[test]
    fn an_unknown_key_is_refused() {
        let root = tempfile::tempdir().unwrap();
        std::fs::write(root.path().join(PROJECT_FILE), "[gates]\n").unwrap();
        assert!(ProjectFile::find(root.path()).unwrap_err().message.contains("gates"));
    }
}
