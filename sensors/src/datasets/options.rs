//! The options of a data set.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::Optics;

/// One of the two disjoint data sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Set {
    /// The set for training, with its own shapes and paints.
    Training,
    /// The set for evaluation, with the held-out shapes and paints.
    HeldOut,
}

/// The kind of content that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Content {
    /// Whole images with COCO annotations.
    Images,
    /// Crops in the format of the classifier's input.
    Crops,
}

/// How the cameras of a data set differ from the ideal one. The default is the ideal camera, with
/// which the network was trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraLooks {
    /// The lens.
    pub optics: Optics,
    /// Time from the reading of the first row of an image to the reading of the last (s).
    pub readout_s: f64,
    /// Brightness of the night sky, relative to the sky over a town (0 to 1).
    pub night_sky: f64,
}

impl Default for CameraLooks {
    fn default() -> Self {
        Self { optics: Optics::default(), readout_s: 0.0, night_sky: 1.0 }
    }
}

/// The options of a data set to be rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DatasetOptions {
    /// The set to render, training or held-out.
    pub set: Set,
    /// The content to render, images or crops.
    pub content: Content,
    /// Number of random scenes.
    pub scenes: u32,
    /// Seed of the scenes. 0 is a seed like any other.
    pub seed: u64,
    /// How the cameras differ from the ideal one. The scenes are the same for all of them.
    pub looks: CameraLooks,
    /// Least and largest number of vehicles in a scene: [`USUAL_VEHICLES`], or what an empty or a
    /// crowded road has. A scene without room has fewer.
    pub vehicles: [usize; 2],
}

/// Least and largest number of vehicles that a scene usually has.
pub const USUAL_VEHICLES: [usize; 2] = [1, 5];

/// Largest number of vehicles that may be asked for.
pub const MAX_VEHICLES: usize = 40;

impl Set {
    /// Returns the channel of the random stream for this set and purpose. The two sets use separate
    /// streams.
    pub(super) fn channel(self, purpose: &str) -> &'static str {
        match (self, purpose == "crops") {
            (Self::Training, true) => "training-crops",
            (Self::Training, false) => "training-scenes",
            (Self::HeldOut, true) => "held-out-crops",
            (Self::HeldOut, false) => "held-out-scenes",
        }
    }
}
