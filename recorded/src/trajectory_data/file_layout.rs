//! The layouts of trajectory files.

use serde::Serialize;

/// The layout of a trajectory file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// CSV in metres.
    Plain,
    /// NGSIM's 18 columns in feet.
    Ngsim18,
    /// The 25 columns of NGSIM's catalogue export.
    Ngsim25,
    /// The three files of a highD data set.
    Highd,
    /// The three files of an exiD data set.
    Exid,
    /// CommonRoad XML.
    Commonroad,
    /// A log of one vehicle that sees the lane markings.
    InCar,
    /// Floating car data (FCD) of SUMO.
    Sumo,
    /// A vehicle record of Vissim.
    Vissim,
    /// Trajectories of I-24 MOTION in JSON.
    I24,
    /// ASAM OpenLABEL.
    #[serde(rename = "openlabel")]
    OpenLabel,
    /// Messages of ASAM OSI.
    Osi,
}

impl Layout {
    /// Returns the name of the layout, as it appears in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Ngsim18 => "ngsim18",
            Self::Ngsim25 => "ngsim25",
            Self::Highd => "highd",
            Self::Exid => "exid",
            Self::Commonroad => "commonroad",
            Self::InCar => "in-car",
            Self::Sumo => "sumo",
            Self::Vissim => "vissim",
            Self::I24 => "i24",
            Self::OpenLabel => "openlabel",
            Self::Osi => "osi",
        }
    }
}
