//! The sampling designs and their names, and the samples of a parameter space.

use std::fmt;
use std::str::FromStr;

use closecall_traffic::Parameters;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{coverage, grid, random, sobol};
use crate::parameters::{ParameterSpace, Variation};

/// The sampling design: how a parameter space is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Design {
    /// Independent random samples, from which rates and their confidence intervals can be
    /// estimated.
    #[default]
    Random,
    /// A scrambled Sobol sequence, which covers the space more evenly.
    Sobol,
    /// All combinations of some levels of each parameter. All points have the same weight, so that
    /// a share of them is not a probability if labels have different weights.
    Grid,
    /// Random samples that visit in turn the bins which `[coverage]` names under `fill`. A share of them is no probability: each bin
    /// has a weight, the probability that the distributions give it.
    Coverage,
}

/// The error for a word that is not the name of a design.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{word}` is not a sampling design: one of `random`, `sobol`, `grid`, `coverage` is needed")]
pub struct UnknownDesign {
    word: String,
}

impl Design {
    /// All designs.
    pub const ALL: [Self; 4] = [Self::Random, Self::Sobol, Self::Grid, Self::Coverage];

    /// Returns the name of the design, as on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Sobol => "sobol",
            Self::Grid => "grid",
            Self::Coverage => "coverage",
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
        let design = Self::ALL.into_iter().find(|design| design.name() == word);
        design.ok_or_else(|| UnknownDesign { word: word.to_owned() })
    }
}

impl ParameterSpace {
    /// Returns the number of samples of a design if up to `n` are requested: `n`, or the size of
    /// the largest grid within `n`. If no parameter varies, all samples are the same encounter, and
    /// there is one.
    pub fn samples(&self, design: Design, n: u64) -> u64 {
        match design {
            _ if self.variation() == Variation::None => n.min(1),
            Design::Random | Design::Sobol | Design::Coverage => n,
            Design::Grid => grid::Grid::within(self, n).points(),
        }
    }

    /// Returns the parameter values of sample `index` in a campaign of up to `n` samples.
    ///
    /// Only the grid depends on `n`. After its last point ([`Self::samples`]) it starts again from
    /// the first.
    pub fn sample(&self, design: Design, seed: u64, index: u64, n: u64) -> Parameters {
        match design {
            Design::Random => random::sample(self, seed, index),
            Design::Sobol => sobol::sample(self, seed, index),
            Design::Grid => grid::Grid::within(self, n).point(self, index),
            Design::Coverage => coverage::sample(self, seed, index),
        }
    }
}
