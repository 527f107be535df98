//! The scenario's events: when they set in, and what they then ask of their actor.

use closecall_traffic::Time;
use closecall_traffic::metrics::time_headway_s;

use crate::scenario::{Brake, Event, Scenario, Trigger};
use crate::world::World;

/// One event in its course.
struct Running {
    actor: usize,
    event: Event,
    /// When it set in.
    since: Option<Time>,
}

/// All events of a run.
pub(super) struct Events {
    running: Vec<Running>,
    /// When each actor started to change lanes in order to overtake.
    cut_outs: Vec<Option<Time>>,
}

/// How fast a braking actor closes in on its final speed once it is nearly reached [1/s].
const SPEED_GAIN_PER_S: f64 = 4.0;

impl Events {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let running = scenario
            .actors
            .iter()
            .enumerate()
            .flat_map(|(actor, setup)| {
                setup.events.iter().map(move |event| Running { actor, event: event.clone(), since: None })
            })
            .collect();
        Self { running, cut_outs: vec![None; scenario.actors.len()] }
    }

    /// Notes that `actor` started to change lanes.
    pub(super) fn cut_out_started(&mut self, actor: usize, time: Time) {
        self.cut_outs[actor].get_or_insert(time);
    }

    /// Sets in what is due, and calls `started` with the name of each event that does.
    pub(super) fn update(&mut self, world: &World, mut started: impl FnMut(&str)) {
        let now = world.time();
        for running in &mut self.running {
            if running.since.is_none() && is_due(&running.event.when, world, &self.cut_outs, now) {
                running.since = Some(now);
                started(running.event.id.as_str());
            }
        }
    }

    /// The acceleration that the events ask of `actor`, if any has set in: the hardest.
    pub(super) fn asked_mps2(&self, actor: usize, world: &World) -> Option<f64> {
        self.running
            .iter()
            .filter(|running| running.actor == actor && running.since.is_some())
            .map(|running| braking_mps2(&running.event.then, world.state(actor).speed_mps))
            .min_by(f64::total_cmp)
    }
}

fn is_due(when: &Trigger, world: &World, cut_outs: &[Option<Time>], now: Time) -> bool {
    match *when {
        Trigger::At(time) => now >= time,
        Trigger::CutOutStarted { actor, delay } => cut_outs[actor].is_some_and(|since| now >= since + delay),
        Trigger::ThwBelow { from, to, thw_s } => world
            .neighbours(from)
            .own
            .lead
            .filter(|lead| lead.actor == to)
            .and_then(|lead| time_headway_s(lead.gap_m, world.state(from).speed_mps).ok())
            .is_some_and(|now_s| now_s < thw_s),
    }
}

/// The braking of an event: constant, easing out where the speed asked for is reached.
fn braking_mps2(brake: &Brake, speed_mps: f64) -> f64 {
    let left_mps = speed_mps - brake.to_speed_mps;
    if brake.to_speed_mps == 0.0 {
        -brake.deceleration_mps2
    } else {
        -(SPEED_GAIN_PER_S * left_mps).min(brake.deceleration_mps2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn braking_is_constant_and_ends_at_the_speed_asked_for() {
        let brake = Brake { deceleration_mps2: 5.0, to_speed_mps: 20.0 };
        assert_eq!(braking_mps2(&brake, 30.0), -5.0);
        assert_eq!(braking_mps2(&brake, 20.0), 0.0);
        assert!(braking_mps2(&brake, 19.0) > 0.0);
        assert_eq!(braking_mps2(&Brake { to_speed_mps: 0.0, ..brake }, 0.1), -5.0);
    }
}
