//! The human drivers of a run, each with its own random streams.

use closecall_controllers::{CheckedDriver, DesiredSpeedNoise, Driver, EgoDriver, EgoSettings, Looks, Weave};
use closecall_traffic::{Road, Stream, stream};

use super::RunKey;
use closecall_scenarios::{Actor, Scenario};

/// Names of the random streams of a human driver.
const DRIVER_CHANNEL: &str = "driver";
const LANE_CHANNEL: &str = "lane-keeping";
const SPEED_CHANNEL: &str = "speed-keeping";

/// The human driver of one vehicle.
pub(super) struct Human {
    /// Index of the vehicle in the list of actors.
    pub(super) actor: usize,
    pub(super) driver: Box<dyn Driver>,
    pub(super) rng: Stream,
    /// How the desired speed varies in time, or `None` if it is constant.
    pub(super) desired_speed_noise: Option<DesiredSpeedNoise>,
}

/// Creates the human drivers of all vehicles: of the ego only if the arm has `settings` in which a
/// human drives.
pub(super) fn human_drivers(scenario: &Scenario, key: RunKey, settings: &EgoSettings) -> Vec<Human> {
    let mut humans = Vec::with_capacity(scenario.actors.len());
    for (actor, setup) in scenario.actors.iter().enumerate() {
        let driver = match &setup.driver {
            CheckedDriver::Human(human) if starts_in_acceleration_lane(setup, &scenario.road) => {
                Some(human.build_merging())
            }
            CheckedDriver::Human(human) => Some(human.build()),
            CheckedDriver::Ego(_) => settings.driver().map(EgoDriver::build),
        };
        if let Some(driver) = driver {
            let rng = |channel| stream(key.seed, key.sample, &setup.id, channel);
            humans.push(Human {
                actor,
                driver,
                rng: rng(DRIVER_CHANNEL),
                desired_speed_noise: setup.speed_keeping.and_then(|keeping| keeping.wander(rng(SPEED_CHANNEL))),
            });
        }
    }
    humans
}

fn starts_in_acceleration_lane(actor: &Actor, road: &Road) -> bool {
    road.entry_lane() == Some(road.lane_of(&actor.start))
}

/// Returns how far the driver of each of `actors` vehicles looks. All others look ahead only.
pub(super) fn looks(humans: &[Human], actors: usize) -> Vec<Looks> {
    let mut looks = vec![Looks::AHEAD; actors];
    for human in humans {
        looks[human.actor] = human.driver.looks();
    }
    looks
}

/// Returns how the driver of an actor weaves in a run, or `None` if the driver does not.
pub(super) fn weave(actor: &Actor, road: &Road, key: RunKey) -> Option<Weave> {
    let rng = || stream(key.seed, key.sample, &actor.id, LANE_CHANNEL);
    actor.lane_keeping.and_then(|keeping| keeping.weave(road.overtaking_side(), rng()))
}
