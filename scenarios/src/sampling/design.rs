//! The designs by name, and the samples of a parameter space.

use std::fmt;
use std::str::FromStr;

use closecall_traffic::Parameters;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{grid, random, sobol};
use crate::parameters::ParameterSpace;

/// How a parameter space is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Design {
    /// Independent random numbers: rates and their intervals can be estimated from them.
    #[default]
    Random,
    /// A scrambled Sobol sequence, which covers the space more evenly.
    Sobol,
    /// Every combination of some levels of each parameter. All points count alike: their share is not a probability
    /// where labels have different weights.
    Grid,
}

/// A word that is no design.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{word}` is not a sampling design: one of `random`, `sobol`, `grid` is needed")]
pub struct UnknownDesign {
    word: String,
}

impl Design {
    /// Every design.
    pub const ALL: [Self; 3] = [Self::Random, Self::Sobol, Self::Grid];

    /// The design's name as it stands on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Sobol => "sobol",
            Self::Grid => "grid",
        }
    }
}

impl fmt::Display for Design {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Design {
    type Err = UnknownDesign;
    fn from_str(word: &str) -> Result<Self, UnknownDesign> {
        let known = Self::ALL.into_iter().find(|design| design.name() == word);
        known.ok_or_else(|| UnknownDesign { word: word.to_owned() })
    }
}

impl ParameterSpace {
    /// How many samples a design has when up to `n` are asked for: `n`, or the points of the largest grid within `n`.
    pub fn samples(&self, design: Design, n: u64) -> u64 {
        match design {
            Design::Random | Design::Sobol => n,
            Design::Grid => grid::Grid::within(self, n).points(),
        }
    }

    /// The values of sample `index` of a campaign of up to `n` samples.
    ///
    /// Only the grid depends on `n`; beyond its last point ([`Self::samples`]) it begins again.
    pub fn sample(&self, design: Design, seed: u64, index: u64, n: u64) -> Parameters {
        match design {
            Design::Random => random::sample(self, seed, index),
            Design::Sobol => sobol::sample(self, seed, index),
            Design::Grid => grid::Grid::within(self, n).point(self, index),
        }
    }
}
