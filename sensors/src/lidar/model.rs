//! The LiDARs whose patterns ship with Closecall.

use std::sync::OnceLock;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{LidarKind, LidarKindConfig};

/// A LiDAR whose pattern ships with Closecall.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum LidarModel {
    /// The second generation of the Valeo SCALA.
    #[serde(rename = "scala-2")]
    Scala2,
    /// The Ouster OS1 with 64 channels, at 10 Hz.
    #[serde(rename = "os1-64")]
    Os1With64,
    /// The Ouster OS1 with 128 channels, at 10 Hz.
    #[serde(rename = "os1-128")]
    Os1With128,
    /// The Hesai PandarXT-16, at 10 Hz.
    #[serde(rename = "pandar-xt-16")]
    PandarXt16,
}

impl LidarModel {
    /// All models.
    pub const ALL: [Self; 4] = [Self::Scala2, Self::Os1With64, Self::Os1With128, Self::PandarXt16];

    /// Returns the text of the model's file.
    pub const fn file(self) -> &'static str {
        match self {
            Self::Scala2 => include_str!("../../lidars/scala-2.toml"),
            Self::Os1With64 => include_str!("../../lidars/os1-64.toml"),
            Self::Os1With128 => include_str!("../../lidars/os1-128.toml"),
            Self::PandarXt16 => include_str!("../../lidars/pandar-xt-16.toml"),
        }
    }

    /// Returns the model's pattern and range.
    pub fn kind(self) -> &'static LidarKind {
        static SHIPPED: [OnceLock<&'static LidarKind>; LidarModel::ALL.len()] =
            [const { OnceLock::new() }; LidarModel::ALL.len()];
        SHIPPED[self as usize].get_or_init(|| {
            let kind = LidarKindConfig::parse(self.file()).map_err(|error| error.to_string());
            let kind = kind.and_then(|config| config.kind().map_err(|error| error.to_string()));
            kind.unwrap_or_else(|error| unreachable!("a test reads every shipped file: {error}"))
        })
    }
}
