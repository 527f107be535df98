//! A case: one sample of a scenario, in files that other tools read.

use std::path::{Path, PathBuf};

use closecall_scenarios::{RunKey, Scenario, ScenarioFile};
use closecall_traffic::Parameters;
use closecall_traffic::atomic::{WriteError, create_folder, write_file};

use super::closed_loop::{Writer, classes, unsaid, unsaid_of_world};
use super::expression::Values;
use super::motion::Motion;
use super::road::UsedRoad;
use super::scenario::{CATALOG_FOLDER, ROAD_FILE};
use super::vehicles::{self, CATALOG};
use super::{commonroad, distribution, open_loop};

/// A form of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Every vehicle follows the trajectory that it drove.
    OpenLoop,
    /// Starts and manoeuvres of one sample; a controller drives the ego.
    ClosedLoop,
    /// The same file with parameters, beside their values and distributions.
    Logical,
    /// The other vehicles as they drove, and a planning problem for the ego, as CommonRoad XML
    /// 2020a.
    CommonRoad,
}

impl Form {
    /// The forms of OpenSCENARIO.
    pub const OPENSCENARIO: [Self; 3] = [Self::OpenLoop, Self::ClosedLoop, Self::Logical];
    /// All forms.
    pub const ALL: [Self; 4] = [Self::OpenLoop, Self::ClosedLoop, Self::Logical, Self::CommonRoad];

    /// Returns the name of the form.
    pub const fn name(self) -> &'static str {
        match self {
            Self::OpenLoop => "open loop",
            Self::ClosedLoop => "closed loop",
            Self::Logical => "logical",
            Self::CommonRoad => "CommonRoad",
        }
    }

    /// Returns whether the form has the motion of a run.
    pub const fn needs_run(self) -> bool {
        matches!(self, Self::OpenLoop | Self::CommonRoad)
    }

    /// Returns the files of the form, besides the road and the catalogue.
    pub const fn files(self) -> &'static [&'static str] {
        match self {
            Self::OpenLoop => &["open-loop.xosc"],
            Self::ClosedLoop => &["closed-loop.xosc"],
            Self::Logical => &["logical.xosc", "logical-values.xosc", "logical-distributions.xosc"],
            Self::CommonRoad => &["commonroad.xml"],
        }
    }
}

/// A sample of a scenario, with its run.
#[derive(Clone, Copy, Debug)]
pub struct Case<'a> {
    /// The scenario file.
    pub file: &'a ScenarioFile,
    /// The concrete scenario of the sample.
    pub scenario: &'a Scenario,
    /// Seed and number of the sample.
    pub key: RunKey,
    /// Name of the controller that drove the ego.
    pub controller: &'a str,
    /// The motion of the vehicles.
    pub motion: &'a Motion,
    /// The values of the parameters in each sample of the value set.
    pub value_sets: &'a [Parameters],
}

/// The files of a case, as texts.
#[derive(Clone, Debug, Default)]
pub struct CaseFiles {
    /// Each file with its text.
    pub files: Vec<(PathBuf, String)>,
    /// The properties that each form cannot express.
    pub unsaid: Vec<(Form, Vec<String>)>,
}

impl CaseFiles {
    /// Returns the files of a case in the folder that these files would not replace.
    pub fn left_in(&self, folder: &Path) -> Vec<PathBuf> {
        let names = Form::ALL.into_iter().flat_map(Form::files).map(Path::new);
        let others = names.filter(|name| self.files.iter().all(|(written, _)| written != name));
        others.map(|name| folder.join(name)).filter(|path| path.exists()).collect()
    }
}

impl Case<'_> {
    /// Returns the files of these forms.
    pub fn files(&self, forms: &[Form]) -> CaseFiles {
        let (config, scenario) = (self.file.config(), self.scenario);
        // A player drives the closed loop itself: each vehicle gets as far as it would at its
        // initial speed.
        let starts = scenario
            .actors
            .iter()
            .flat_map(|actor| [actor.start.s_m, actor.start.s_m + actor.start.speed_mps * scenario.duration.s()]);
        let driven = self.motion.steps.iter().flat_map(|(_, states)| states.iter().map(|state| state.s_m));
        let road = UsedRoad::new(&scenario.road, starts.chain(driven));
        let mut files = CaseFiles::default();
        for form in forms {
            let description = format!(
                "{}, sample {} of seed {}, {}: {}",
                config.name,
                self.key.sample,
                self.key.seed,
                self.controller,
                form.name()
            );
            let values = Values { sample: &scenario.parameters, are_named: *form == Form::Logical };
            let unsaid = match form {
                Form::OpenLoop | Form::CommonRoad => unsaid_of_world(config, scenario),
                Form::ClosedLoop | Form::Logical => unsaid(config, scenario, values.are_named),
            };
            let said = (description.as_str(), unsaid.as_slice());
            let writer = Writer { config, scenario, road, controller: self.controller, values };
            let names = form.files();
            let texts = match form {
                Form::OpenLoop => vec![Some(open_loop::document((config, scenario), self.motion, said))],
                Form::CommonRoad => vec![Some(commonroad::document(scenario, self.motion, road))],
                Form::ClosedLoop => vec![Some(writer.document(said, None))],
                Form::Logical => vec![
                    Some(writer.document(said, Some(self.file.text()))),
                    distribution::deterministic(names[0], &description, self.value_sets),
                    distribution::stochastic(names[0], config, said, (self.key.seed, self.value_sets.len() as u64)),
                ],
            };
            files.files.extend(names.iter().zip(texts).filter_map(|(name, text)| Some((name.into(), text?))));
            files.unsaid.push((*form, unsaid));
        }
        if forms == [Form::CommonRoad] {
            return files;
        }
        files.files.push((ROAD_FILE.into(), road.document(&config.name)));
        let named = scenario.actors.iter().map(|actor| (vehicles::entry_name(&actor.id), actor.vehicle));
        let vehicles: Vec<_> = named.chain(classes(config)).collect();
        let catalog = Path::new(CATALOG_FOLDER).join(format!("{CATALOG}.xosc"));
        files.files.push((catalog, vehicles::document(&vehicles)));
        files
    }
}

/// Writes the files of a case into a folder, which is created if it does not exist. Each appears
/// whole, or not at all.
///
/// # Errors
/// [`WriteError`] if a folder or a file cannot be written.
pub fn write_case(folder: &Path, files: &CaseFiles) -> Result<(), WriteError> {
    for (name, text) in &files.files {
        let path = folder.join(name);
        if let Some(parent) = path.parent() {
            create_folder(parent)?;
        }
        write_file(&path, |file| file.write_all(text.as_bytes()))?;
    }
    Ok(())
}
