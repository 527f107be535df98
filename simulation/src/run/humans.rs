//! The human drivers of a run, each with random streams of its own.

use closecall_controllers::{CheckedDriver, Driver, Wander, Weave};
use closecall_traffic::{Road, Stream, stream};

use super::RunKey;
use crate::scenario::{Actor, Scenario};

/// The channels of a human driver's random streams.
const DRIVER_CHANNEL: &str = "driver";
const LANE_CHANNEL: &str = "lane-keeping";
const SPEED_CHANNEL: &str = "speed-keeping";

/// One human driver.
pub(super) struct Human {
    pub(super) actor: usize,
    pub(super) driver: Box<dyn Driver>,
    pub(super) rng: Stream,
    pub(super) wander: Option<Wander>,
}

/// Everyone but E.
pub(super) fn humans(scenario: &Scenario, key: RunKey) -> Vec<Human> {
    let mut humans = Vec::with_capacity(scenario.actors.len());
    for (actor, setup) in scenario.actors.iter().enumerate() {
        if let CheckedDriver::Human(human) = &setup.driver {
            let rng = |channel| stream(key.seed, key.sample, &setup.id, channel);
            humans.push(Human {
                actor,
                driver: human.build(),
                rng: rng(DRIVER_CHANNEL),
                wander: setup.speed_keeping.and_then(|keeping| keeping.wander(rng(SPEED_CHANNEL))),
            });
        }
    }
    humans
}

/// How an actor weaves in a run.
pub(super) fn weave(actor: &Actor, road: &Road, key: RunKey) -> Option<Weave> {
    let rng = || stream(key.seed, key.sample, &actor.id, LANE_CHANNEL);
    actor.lane_keeping.and_then(|keeping| keeping.weave(road.overtaking_side(), rng()))
}
