//! Variations of a scenario: those that must not change its outcome, which the validity checks run,
//! and those in which nobody comes from behind.

use closecall_controllers::{CheckedDriver, HumanDriver, Prescribed};
use closecall_sensors::lidar::ClusteringCheck;
use closecall_traffic::{ENGAGEMENT_CLOSING_MPS, ENGAGEMENT_GAP_M, Road, Time, VehicleState};

use super::{Actor, Event, Scenario, Trigger};

/// Distance within which the nearest vehicle behind starts that does not approach (m): the distance
/// within which an approach counts.
const NEAR_M: f64 = ENGAGEMENT_GAP_M;

/// Largest speed with which the vehicles behind that do not approach come nearer (m/s): a quarter
/// of the closing speed that counts as an approach, which is a choice. In a minute they pass
/// through the distances at which a system may act.
const DRIFT_MPS: f64 = 0.25 * ENGAGEMENT_CLOSING_MPS;

/// Distance up to which the nearest of them does not come nearer at all (m): a choice.
const KEPT_M: f64 = 20.0;

impl Scenario {
    /// Returns the same scenario with half the step of the vehicle dynamics and the human drivers.
    /// The rates of the sensors and of the ego controller do not change, since they are properties
    /// of the devices. The random streams do not change either: sensor errors are drawn at the
    /// sensors' rate, and drivers draw once in a run.
    #[must_use]
    pub fn at_half_step(&self) -> Self {
        Self { physics_step: Time::from_ns(self.physics_step.ns() / 2), ..self.clone() }
    }

    /// Returns the same scenario with the list of actors in reverse order.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let last = self.actors.len() - 1;
        let actors = self.actors.iter().rev().map(|actor| actor.renumbered(|index| last - index)).collect();
        Self { actors, ego: last - self.ego, ..self.clone() }
    }

    /// Returns the same scenario whose LiDARs cluster each scan a second time, by another
    /// DBSCAN.
    #[must_use]
    pub fn with_clustering_check(&self, check: ClusteringCheck) -> Self {
        Self { sensors: self.sensors.with_clustering_check(check), ..self.clone() }
    }

    /// Returns the same scenario without the vehicles that start behind the ego, in any lane, and
    /// without the events of the others: nobody comes, and nothing happens ahead. Returns `None` if
    /// nobody is behind.
    pub fn with_nobody_behind(&self) -> Option<Self> {
        let ego_s_m = self.actors[self.ego].start.s_m;
        let stays: Vec<bool> = self.actors.iter().map(|actor| actor.start.s_m >= ego_s_m).collect();
        if !stays.contains(&false) {
            return None;
        }
        let ego = stays[..self.ego].iter().filter(|stays| **stays).count();
        let staying = self.actors.iter().zip(&stays).filter(|(_, stays)| **stays);
        let actors = staying.map(|(actor, _)| Actor { events: Vec::new(), ..actor.clone() }).collect();
        Some(Self { actors, ego, ..self.clone() })
    }

    /// Returns the same scenario in which the vehicles that start behind the ego, in any lane, keep
    /// their lane and a constant speed. They come nearer, but so slowly that it is no approach. They
    /// start so near that the ego can see one. The others have no events: somebody is behind, nobody
    /// approaches, and nothing happens ahead. Returns `None` if nobody is behind.
    pub fn with_nobody_approaching(&self) -> Option<Self> {
        let ego = self.actors[self.ego].start;
        let is_behind = |actor: &Actor| actor.start.s_m < ego.s_m;
        let behind_m = self.actors.iter().filter(|actor| is_behind(actor)).map(|actor| ego.s_m - actor.start.s_m);
        let nearest_m = behind_m.fold(f64::INFINITY, f64::min);
        let nearer_m = (nearest_m - NEAR_M).max(0.0);
        let room_m = (0.5 * (nearest_m.min(NEAR_M) - KEPT_M)).max(0.0);
        let most_mps = ego.speed_mps + DRIFT_MPS.min(room_m / self.duration.s());
        let changed = |actor: &Actor| {
            let mut actor = Actor { events: Vec::new(), ..actor.clone() };
            if is_behind(&actor) {
                let speed_mps = actor.start.speed_mps.min(most_mps);
                actor.driver = CheckedDriver::Human(HumanDriver::Prescribed(Prescribed::constant(speed_mps)));
                (actor.path, actor.speed_keeping) = (None, None);
                let s_m = actor.start.s_m + nearer_m;
                actor.start = VehicleState { s_m, speed_mps, acceleration_mps2: 0.0, ..actor.start };
            }
            actor
        };
        let actors = self.actors.iter().map(changed).collect();
        self.actors.iter().any(is_behind).then(|| Self { actors, ..self.clone() })
    }

    /// Returns the mirror image, in which left and right are swapped. Returns `None` on a curved
    /// road: positions are measured along its left edge, so that it has no exact mirror image.
    pub fn mirrored(&self) -> Option<Self> {
        let road = self.road.mirrored()?;
        let mirrored = |actor: &Actor| Actor {
            start: mirrored(&actor.start, &self.road),
            path: actor.path.as_ref().map(|path| path.mirrored(self.road.right_edge_m())),
            driver: actor.driver.mirrored(),
            events: actor.events.iter().map(|event| Event { then: event.then.mirrored(), ..event.clone() }).collect(),
            ..actor.clone()
        };
        Some(Self { road, actors: self.actors.iter().map(mirrored).collect(), ..self.clone() })
    }
}

impl Actor {
    /// Returns the same actor with new indices of actors in its events. `new_index` maps the old
    /// index to the new one.
    fn renumbered(&self, new_index: impl Fn(usize) -> usize) -> Self {
        let mut actor = self.clone();
        for event in &mut actor.events {
            event.when = match event.when {
                Trigger::At(time) => Trigger::At(time),
                Trigger::ThwBelow { from, to, thw_s } => {
                    Trigger::ThwBelow { from: new_index(from), to: new_index(to), thw_s }
                }
                Trigger::CutOutStarted { actor, delay } => Trigger::CutOutStarted { actor: new_index(actor), delay },
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
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake-at-cut-out.toml");
        let file = ScenarioFile::load(&path, &[]).unwrap();
        file.concrete(&file.space().nominal()).unwrap()
    }

    #[test]
    fn reversing_or_mirroring_twice_restores_the_scenario() {
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
    fn with_nobody_behind_the_vehicles_ahead_stay_and_nothing_happens() {
        let scenario = headline();
        let alone = scenario.with_nobody_behind().unwrap();
        let names = |scenario: &Scenario| scenario.actors.iter().map(|actor| actor.id.to_string()).collect::<Vec<_>>();
        assert_eq!(names(&scenario), ["ego", "front", "rear"]);
        assert_eq!(names(&alone), ["ego", "front"]);
        assert_eq!(alone.ego_id(), scenario.ego_id());
        assert!(!scenario.actors[1].events.is_empty() && alone.actors[1].events.is_empty());
        let reversed = scenario.reversed().with_nobody_behind().unwrap();
        assert_eq!((names(&reversed), reversed.ego), (vec!["front".to_owned(), "ego".to_owned()], 1));
        assert!(alone.with_nobody_behind().is_none());
    }

    #[test]
    fn with_nobody_approaching_the_vehicles_behind_come_nearer_too_slowly_to_count() {
        let scenario = headline();
        let kept = scenario.with_nobody_approaching().unwrap();
        let speeds_mps =
            |scenario: &Scenario| scenario.actors.iter().map(|actor| actor.start.speed_mps).collect::<Vec<_>>();
        let [before, after] = [&scenario, &kept].map(speeds_mps);
        assert!(before[2] > before[0] + 2.0);
        assert_eq!(after[..2], before[..2]);
        let drift_mps = after[2] - after[0];
        assert!((0.6..=0.7).contains(&drift_mps), "{drift_mps}");
        assert_eq!((kept.ego, kept.actors.len()), (scenario.ego, 3));
        let behind_m = |scenario: &Scenario| scenario.actors[0].start.s_m - scenario.actors[2].start.s_m;
        assert!(behind_m(&scenario) > 100.0 && (behind_m(&kept) - NEAR_M).abs() < 1e-9);
        assert!((50.0..70.0).contains(&(behind_m(&kept) - drift_mps * kept.duration.s())));
        let mut tailgated = scenario.clone();
        tailgated.actors[2].start.s_m = tailgated.actors[0].start.s_m - 15.0;
        let tailgated = tailgated.with_nobody_approaching().unwrap();
        assert_eq!((behind_m(&tailgated), speeds_mps(&tailgated)[2]), (15.0, before[0]));
        assert!(kept.actors.iter().all(|actor| actor.events.is_empty()));
        assert_eq!(kept.actors[0].driver, scenario.actors[0].driver);
        assert_ne!(kept.actors[2].driver, scenario.actors[2].driver);
        assert!(scenario.with_nobody_behind().unwrap().with_nobody_approaching().is_none());
    }

    #[test]
    fn a_curved_road_has_no_mirror_image() {
        let mut scenario = headline();
        scenario.road = scenario.road.with_curvature(0.001);
        assert!(scenario.mirrored().is_none());
    }
}
