//! How the samples of a campaign are drawn.

use closecall_scenarios::sampling::Design;

/// How the samples of a campaign are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Sampling {
    /// The campaign's seed.
    pub seed: u64,
    /// The sampling design, which lays out the values of the parameters.
    #[serde(with = "design_by_name")]
    pub design: Design,
    /// Number of samples of each scenario.
    pub samples: u64,
}

mod design_by_name {
    use closecall_scenarios::sampling::Design;
    use serde::{Deserialize, Deserializer, Serializer, de};

    pub(super) fn serialize<S: Serializer>(design: &Design, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(design.name())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Design, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}
