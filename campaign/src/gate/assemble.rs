//! Assembles the gates of a campaign: the gates of the command line, of a preset, and of the
//! project files.

use closecall_scenarios::criteria::Expression;
use closecall_scenarios::sampling::Design;

use super::{GateSet, GateSource, GateSpec, ProjectError, ProjectFile};

/// The gates that a preset adds.
#[derive(Clone, Copy, Debug)]
pub struct PresetGates {
    /// The preset's name.
    pub name: &'static str,
    /// The criteria.
    pub require: &'static [&'static str],
}

/// Gates that do not fit the campaign.
#[derive(Debug, thiserror::Error)]
pub enum AssemblyError {
    /// A criterion needs a baseline, and there is none.
    #[error("`{expression}` compares with a baseline: it needs a paired campaign")]
    NoBaseline {
        /// The criterion.
        expression: Box<Expression>,
    },
    /// Two criteria of the command line bound the same value on the same side: one would hide the
    /// other.
    #[error("the gates `{first}` and `{second}` contradict each other: give one of them")]
    Contradiction {
        /// The first criterion.
        first: Box<Expression>,
        /// The second criterion.
        second: Box<Expression>,
    },
    /// A gate on a probability needs independent samples.
    #[error(
        "a gate on the probability of a collision needs independent samples: the design `random` draws them, and `{design}` does not"
    )]
    DependentSamples {
        /// The sampling design.
        design: Design,
    },
    /// A criterion of a preset is wrong.
    #[error("{message}")]
    Preset {
        /// What is wrong.
        message: String,
    },
    /// The project file cannot be used.
    #[error(transparent)]
    Project(#[from] ProjectError),
}

impl GateSet {
    /// Adds the criteria of the command line, then of a preset, then of the project files. They lie
    /// in the folder of this process and above it.
    ///
    /// # Errors
    /// [`AssemblyError`] if a gate does not fit the campaign.
    pub fn assemble(
        &mut self,
        command_line: Vec<Expression>,
        preset: Option<PresetGates>,
        is_paired: bool,
        design: Design,
    ) -> Result<(), AssemblyError> {
        if let Some([first, second]) = Expression::contradiction(&command_line) {
            return Err(AssemblyError::Contradiction { first: Box::new(first), second: Box::new(second) });
        }
        for expression in command_line {
            if expression.needs_pairs() && !is_paired {
                return Err(AssemblyError::NoBaseline { expression: Box::new(expression) });
            }
            self.push(GateSpec { expression, source: GateSource::CommandLine });
        }
        for (name, text) in preset.iter().flat_map(|preset| preset.require.iter().map(|text| (preset.name, text))) {
            let expression: Result<Expression, _> = text.parse();
            let expression = expression.map_err(|error| AssemblyError::Preset { message: error.to_string() })?;
            self.push(GateSpec { expression, source: GateSource::Preset(name) });
        }
        let here = std::env::current_dir().ok();
        for project in here.map(|folder| ProjectFile::find(&folder)).transpose()?.unwrap_or_default() {
            self.notes.extend(project.foreign_owner());
            project.add_to(self)?;
        }
        if self.probability.is_some() && design != Design::Random {
            return Err(AssemblyError::DependentSamples { design });
        }
        Ok(())
    }
}
