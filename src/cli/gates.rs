//! What a campaign is judged by, on the command line.

use clap::Args;

use crate::campaign::verdict::Gates;

/// The gates of a campaign.
#[derive(Clone, Debug, Args)]
pub(super) struct GateArgs {
    /// Fail where E collides in more samples than this
    #[arg(long, value_name = "K")]
    max_collisions: Option<u64>,
    /// In paired campaigns: fail where more collisions than this happen only with the controller under test
    #[arg(long, value_name = "K")]
    pub(super) max_induced: Option<u64>,
    /// Fail where E falls by more than this below the speed of the vehicle ahead, in any sample
    #[arg(long, value_name = "M/S", value_parser = super::args::positive)]
    max_speed_deficit_mps: Option<f64>,
}

impl GateArgs {
    pub(super) fn gates(&self) -> Gates {
        Gates {
            max_collisions: self.max_collisions,
            max_induced: self.max_induced,
            max_speed_deficit_mps: self.max_speed_deficit_mps,
        }
    }
}
