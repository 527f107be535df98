//! A custom controller in one file: the controller, the factory that creates one for each sample,
//! and a campaign that compares it with the built-in cruise control.
//!
//! ```text
//! cargo run --release --example own_controller [SCENARIO.toml] [SAMPLES]
//! ```
//!
//! `RoomMaker` uses the built-in cruise control and emergency braking, but decelerates by at least
//! 0.5 m/s² while a vehicle is close behind, like a driver that feels pressed. It does not predict
//! when the rear vehicle arrives, and is therefore no substitute for the margin increase system.

use std::path::PathBuf;
use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Duration;

use closecall_campaign::execution::{Campaign, CampaignError};
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::summary::Counts;
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::workers::Workers;
use closecall_controllers::{
    ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack, EgoState, Reason,
};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, ControllerFactory};
use closecall_traffic::TrackStatus;

/// Rear time headway below which the controller decelerates (s).
const PRESSED_BELOW_S: f64 = 1.5;

/// Smallest deceleration while a vehicle is close behind (m/s²).
const EASING_MPS2: f64 = 0.5;

/// A controller that increases the front gap while a vehicle is close behind.
struct RoomMaker {
    cruise: EgoStack,
}

impl RoomMaker {
    /// Returns whether a confirmed track in the ego's lane is behind it at a short time headway.
    fn is_pressed(input: &EgoInput<'_>) -> bool {
        input.tracks.iter().any(|track| {
            let gap_m = -track.x_m() - 0.5 * (track.length_m + input.odometry.length_m);
            let is_behind = track.x_m() < 0.0 && track.lane[1] >= 0.5 && track.status == TrackStatus::Confirmed;
            is_behind && gap_m < PRESSED_BELOW_S * track.vx_mps()
        })
    }
}

impl EgoController for RoomMaker {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        // The built-in stack rejects input that is not finite. A controller without it should call
        // `input.check_finite()`.
        let cruise = self.cruise.step(input)?;
        if !Self::is_pressed(input) || cruise.state == EgoState::EmergencyBraking {
            return Ok(cruise);
        }
        let acceleration_mps2 = cruise.acceleration_mps2.min(-EASING_MPS2);
        Ok(EgoCommand { acceleration_mps2, state: EgoState::Increasing, reason: Reason::External, plan: None })
    }
}

/// Creates a controller for each sample, so that no state is carried over between samples.
pub(crate) struct RoomMakers;

impl ControllerFactory for RoomMakers {
    fn name(&self) -> &str {
        "room-maker"
    }

    fn has_mis(&self, _: &EgoSettings) -> bool {
        false
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(RoomMaker { cruise: EgoStack::without_mis(*settings) })
    }
}

/// Wall-time limit of a sample. A sample that exceeds it ends as an error.
const SAMPLE_TIMEOUT: Duration = Duration::from_secs(300);

/// Runs a campaign of two arms, the built-in `acc` and `tested`, on the same samples.
pub(crate) fn against_cruise_control(
    file: ScenarioFile,
    tested: Arc<dyn ControllerFactory>,
    samples: u64,
) -> Result<Counts, CampaignError> {
    let arms = vec![BuiltIn::Acc.factory(), tested].into_iter().map(|controller| Arm { controller, sensors: None });
    let sampling = Sampling { seed: 1, design: Design::Random, samples };
    let work = Arc::new(Work { file, sampling, arms: arms.collect(), checks: CheckPlan::default(), retry_crashed: 0 });
    let jobs = available_parallelism().unwrap_or(std::num::NonZeroUsize::MIN);
    let workers = Workers { jobs, sample_timeout: SAMPLE_TIMEOUT };
    Ok(Campaign::new(vec![work], workers).count()?.total())
}

#[expect(clippy::print_stdout, reason = "an example prints its result")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().map_or_else(|| PathBuf::from("scenarios/library/low-thw-overtake.toml"), PathBuf::from);
    let samples = arguments.next().map_or(Ok(200), |text| text.parse())?;
    let file = ScenarioFile::load(&path, &[])?;
    let name = file.config().name.clone();
    let counts = against_cruise_control(file, Arc::new(RoomMakers), samples)?;
    let [cruise, own] = &counts.arms[..] else { unreachable!("two arms were run") };
    println!("{name}: {} samples, {} errors", counts.samples, counts.errors());
    println!("  collisions: acc {}, room-maker {}", cruise.collisions, own.collisions);
    println!("  {} prevented, {} induced", counts.pairs.prevented, counts.pairs.induced);
    Ok(())
}
