//! Two egos that are slower than the other traffic from the first second on, and know nothing about
//! the vehicles behind them.
//!
//! ```text
//!  speed  ────╮                                    blind: 1 m/s² until 9.5 m/s slower
//!             ╰──╮                                 crawl: 2 m/s² until 20 m/s slower
//!                ╰──────────── start − deficit     beneath: cruise control and emergency braking of the scenario
//! ```
//!
//! They are references, not systems: a slower ego has a longer gap ahead, and needs to brake less.
//! A system deserves credit only for collisions that it prevents beyond the number that these egos
//! prevent at the same cost. A requirement that lets them pass does not test a system that looks
//! back.
//!
//! The two rates and deficits are assumptions. `blind` stays just below the 10 m/s by which an ego
//! may be slower (requirement MIS-6) and brakes as gently as the paper's system. `crawl` has twice
//! both values.

use super::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack};

/// Time in which the ego would reach its speed if the braking were not limited (s): an assumption
/// that keeps the ego from oscillating; 0.2 to 2 are plausible.
const RESPONSE_S: f64 = 0.5;

/// The deceleration and the final speed deficit of an ego that slows down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slowing {
    /// Largest deceleration (m/s²).
    pub deceleration_mps2: f64,
    /// Amount by which the ego is slower in the end than at its start (m/s).
    pub deficit_mps: f64,
}

impl Slowing {
    /// The controller `blind`.
    pub const BLIND: Self = Self { deceleration_mps2: 1.0, deficit_mps: 9.5 };
    /// The controller `crawl`.
    pub const CRAWL: Self = Self { deceleration_mps2: 2.0, deficit_mps: 20.0 };

    /// Returns the acceleration towards the speed `deficit_mps` below `start_mps` (m/s²).
    fn acceleration_mps2(self, start_mps: f64, speed_mps: f64) -> f64 {
        let target_mps = (start_mps - self.deficit_mps).max(0.0);
        ((target_mps - speed_mps) / RESPONSE_S).clamp(-self.deceleration_mps2, self.deceleration_mps2)
    }
}

/// A stack without a margin increase system that slows down from its first step on.
#[derive(Clone, Debug)]
pub struct Slower {
    stack: EgoStack,
    slowing: Slowing,
    start_mps: Option<f64>,
}

impl Slower {
    /// Creates a controller for one run.
    pub fn new(settings: EgoSettings, slowing: Slowing) -> Self {
        Self { stack: EgoStack::without_mis(settings), slowing, start_mps: None }
    }
}

impl EgoController for Slower {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let command = self.stack.step(input)?;
        let speed_mps = input.odometry.speed_mps;
        let start_mps = *self.start_mps.get_or_insert(speed_mps);
        let slowing_mps2 = self.slowing.acceleration_mps2(start_mps, speed_mps);
        Ok(EgoCommand { acceleration_mps2: command.acceleration_mps2.min(slowing_mps2), ..command })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ego_slows_at_its_rate_and_keeps_the_lower_speed() {
        for (slowing, rate_mps2, deficit_mps) in [(Slowing::BLIND, 1.0, 9.5), (Slowing::CRAWL, 2.0, 20.0)] {
            let (start_mps, step_s) = (30.0, 0.04);
            let mut speed_mps = start_mps;
            assert_eq!(slowing.acceleration_mps2(start_mps, speed_mps), -rate_mps2);
            for _ in 0..1_000 {
                speed_mps += step_s * slowing.acceleration_mps2(start_mps, speed_mps);
            }
            assert!((speed_mps - (start_mps - deficit_mps)).abs() < 1e-6, "{speed_mps}");
            assert!(slowing.acceleration_mps2(start_mps, speed_mps - 1.0) > 0.0, "it does not stay below its speed");
        }
        assert_eq!(Slowing::CRAWL.acceleration_mps2(10.0, 0.0), 0.0, "no speed is negative");
    }
}
