//! The same scenario, changed in ways that must not matter: what the validity checks run.

use closecall_traffic::{Road, Time, VehicleState};

use super::{Actor, Scenario, Trigger};

impl Scenario {
    /// The same, with vehicles and human drivers at twice the rate. Sensors and ego controller keep theirs, which are
    /// properties of the devices, and so do the streams of their errors; drivers draw theirs once in a run.
    #[must_use]
    pub fn at_half_step(&self) -> Self {
        Self { physics_step: Time::from_ns(self.physics_step.ns() / 2), ..self.clone() }
    }

    /// The same, with the list of actors reversed.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let last = self.actors.len() - 1;
        let actors = self.actors.iter().rev().map(|actor| actor.renumbered(|place| last - place)).collect();
        Self { actors, ego: last - self.ego, ..self.clone() }
    }

    /// The mirror image, in which left is right. Nothing on a bend, which has none with positions along its left edge.
    pub fn mirrored(&self) -> Option<Self> {
        let road = self.road.mirrored()?;
        let mirrored = |actor: &Actor| Actor {
            start: mirrored(&actor.start, &self.road),
            driver: actor.driver.mirrored(),
            ..actor.clone()
        };
        Some(Self { road, actors: self.actors.iter().map(mirrored).collect(), ..self.clone() })
    }
}

impl Actor {
    /// The same actor, where others have other places in the list.
    fn renumbered(&self, place: impl Fn(usize) -> usize) -> Self {
        let mut actor = self.clone();
        for event in &mut actor.events {
            event.when = match event.when {
                Trigger::At(time) => Trigger::At(time),
                Trigger::ThwBelow { from, to, thw_s } => Trigger::ThwBelow { from: place(from), to: place(to), thw_s },
                Trigger::CutOutStarted { actor, delay } => Trigger::CutOutStarted { actor: place(actor), delay },
            };
        }
        actor
    }
}

fn mirrored(state: &VehicleState, road: &Road) -> VehicleState {
    VehicleState {
        d_m: road.right_edge_m() - state.d_m,
        heading_rad: -state.heading_rad,
        yaw_rate_radps: -state.yaw_rate_radps,
        indicator: state.indicator.mirrored(),
        ..*state
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::ScenarioFile;
    use super::*;

    fn headline() -> Scenario {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library/low-thw-overtake-at-cut-out.toml");
        let file = ScenarioFile::load(&path, &[]).unwrap();
        file.concrete(&file.space().nominal()).unwrap()
    }

    #[test]
    fn twice_reversed_or_mirrored_is_the_same() {
        let scenario = headline();
        let reversed = scenario.reversed();
        assert_eq!(reversed.ego_id(), scenario.ego_id());
        assert_ne!(reversed.ego, scenario.ego);
        assert_eq!(format!("{:?}", reversed.reversed()), format!("{scenario:?}"));
        let mirrored = scenario.mirrored().unwrap();
        assert_ne!(mirrored.road.overtaking_side(), scenario.road.overtaking_side());
        assert_eq!(format!("{:?}", mirrored.mirrored().unwrap()), format!("{scenario:?}"));
    }

    #[test]
    fn events_refer_to_the_same_actors() {
        let scenario = headline();
        let named = |scenario: &Scenario| -> Vec<String> {
            let events = scenario.actors.iter().flat_map(|actor| &actor.events);
            let cut_outs = events.filter_map(|event| match event.when {
                Trigger::CutOutStarted { actor, .. } => Some(scenario.actors[actor].id.to_string()),
                _ => None,
            });
            cut_outs.collect()
        };
        assert_eq!(named(&scenario), ["rear"]);
        assert_eq!(named(&scenario.reversed()), ["rear"]);
    }

    #[test]
    fn a_bend_has_no_mirror_image() {
        let mut scenario = headline();
        scenario.road = scenario.road.with_curvature(0.001);
        assert!(scenario.mirrored().is_none());
    }
}
