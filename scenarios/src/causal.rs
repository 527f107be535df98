//! The events of a run in one sentence: who struck whom, how long after which cause, the actions of
//! the margin increase system (MIS) with their reasons, and the faults that held.
//!
//! ```text
//!  R struck E from behind at 9.2 m/s (ΔV R 5.1, E 5.1 m/s) at 13.50 s, 4.5 s after F braked; the MIS stayed off: passing lane
//!  occupied, 3.6 to 9.6 s; faults: none
//! ```

use std::fmt;

use closecall_controllers::Reason;
use closecall_sensors::SensorMode;
use closecall_sensors::faults::StatedFault;
use closecall_traffic::geometry::BoxSide;
use closecall_traffic::{ActorId, Time};

use super::Scenario;
use crate::outcome::{Collision, MisSummary, Moment, Outcome, ReachedMoment};
use crate::promise::SHORTFALL_S;

/// The key of [`VehicleLetters`], for every output that uses them.
pub const LETTERS: &str = "E is the ego, F the lead vehicle, R the rear vehicle";

/// The letters of the vehicles of an encounter: E is the ego, F the lead vehicle, R the rear
/// vehicle. Any other vehicle has its name, see [`unlettered`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VehicleLetters {
    lead: Option<ActorId>,
    rear: Option<ActorId>,
}

/// Returns the name of a vehicle without a letter, as a text shows it beside letters: *vehicle R* is
/// a vehicle that is named R, and may be elsewhere than behind the ego.
pub fn unlettered(name: &str) -> &str {
    match name {
        "E" => "vehicle E",
        "F" => "vehicle F",
        "R" => "vehicle R",
        _ => name,
    }
}

impl VehicleLetters {
    /// Returns the letters of a scenario, see [`Scenario::lead_and_rear`].
    pub fn of(scenario: &Scenario) -> Self {
        let id = |index: usize| scenario.actors[index].id.clone();
        let [lead, rear] = scenario.lead_and_rear().map(|index| index.map(id));
        Self { lead, rear }
    }

    /// Returns the letter of a vehicle, or its name if it has none. `ego` is the name of the ego.
    pub fn of_vehicle<'a>(&self, ego: &ActorId, vehicle: &'a ActorId) -> &'a str {
        match vehicle {
            _ if vehicle == ego => "E",
            _ => self.of_other(vehicle),
        }
    }

    /// Returns the letter of a vehicle besides the ego, or its name if it has none.
    fn of_other<'a>(&self, vehicle: &'a ActorId) -> &'a str {
        match vehicle {
            _ if self.lead.as_ref() == Some(vehicle) => "F",
            _ if self.rear.as_ref() == Some(vehicle) => "R",
            _ => unlettered(vehicle.as_str()),
        }
    }

    /// Returns the letter or the name of the vehicle that reached a moment.
    fn of_moment<'a>(&self, reached: &'a ReachedMoment) -> &'a str {
        reached.vehicle.as_ref().map_or(reached.moment.unnamed_vehicle(), |vehicle| self.of_other(vehicle))
    }

    /// Returns what happens at a moment, with the letter or the name of its vehicle: *R comes
    /// near*.
    pub fn moment_text(&self, reached: &ReachedMoment) -> String {
        reached.moment.text(self.of_moment(reached))
    }

    /// Returns the letter of a moment in brackets, if it has one, and what happens: *(b) R comes
    /// near*.
    pub fn moment_label(&self, reached: &ReachedMoment) -> String {
        let text = self.moment_text(reached);
        match reached.moment.letter() {
            Some(letter) => format!("({letter}) {text}"),
            None => text,
        }
    }
}

/// The sentence about a run.
#[derive(Clone, Copy, Debug)]
pub struct CausalSentence<'a> {
    /// The outcome of the run.
    pub outcome: &'a Outcome,
    /// The letters of its vehicles.
    pub letters: &'a VehicleLetters,
    /// The faults that were injected.
    pub faults: &'a [StatedFault],
    /// The vehicle for which the MIS engaged, in words, if that is known: its letter or name, or
    /// that it does not exist.
    pub engaged_for: Option<&'a str>,
    /// The front time headway that the MIS is to gain (s), if the arm has one.
    pub goal_s: Option<f64>,
}

impl CausalSentence<'_> {
    fn letter<'a>(&self, vehicle: &'a ActorId) -> &'a str {
        self.letters.of_vehicle(&self.outcome.ego, vehicle)
    }

    /// Returns the ego's first collision or, if there is none, the first of any vehicles.
    fn first(&self) -> Option<&Collision> {
        self.outcome.ego_collisions().next().or(self.outcome.collisions.first())
    }

    /// Returns who struck whom: *R struck E*.
    pub fn who(&self, collision: &Collision) -> String {
        let [striking, struck] = collision.roles().map(|role| self.letter(&collision.between[role]));
        format!("{striking} struck {struck}")
    }

    /// Returns who struck whom on which side, and how fast: *R struck E from behind at 9.2 m/s*.
    pub fn struck(&self, collision: &Collision) -> String {
        let [striking, struck] = collision.roles();
        let [own_side, side] = [striking, struck].map(|role| collision.struck_side[role]);
        let [striking_name, struck_name] = [striking, struck].map(|role| self.letter(&collision.between[role]));
        let how = match (own_side, side) {
            (BoxSide::Front, BoxSide::Rear) => format!("struck {struck_name} from behind"),
            (BoxSide::Front, BoxSide::Front) => format!("struck {struck_name} head-on"),
            (BoxSide::Rear, BoxSide::Front) => format!("rolled back into the front of {struck_name}"),
            (_, BoxSide::Left) => format!("struck {struck_name} on its left side"),
            (_, BoxSide::Right) => format!("struck {struck_name} on its right side"),
            (_, BoxSide::Front) => format!("struck the front of {struck_name}"),
            (_, BoxSide::Rear) => format!("struck the rear of {struck_name}"),
        };
        format!("{striking_name} {how} at {:.1} m/s", collision.relative_speed_mps)
    }

    /// Returns the change of velocity of each vehicle: *ΔV R 5.1, E 5.1 m/s*.
    pub fn delta_v(&self, collision: &Collision) -> String {
        let texts = collision.roles().map(|role| (self.letter(&collision.between[role]), collision.delta_v_mps[role]));
        let [(striking, striking_mps), (struck, struck_mps)] = texts;
        format!("ΔV {striking} {striking_mps:.1}, {struck} {struck_mps:.1} m/s")
    }

    /// Returns how long before the collision the lead vehicle began to brake.
    fn after_braking(&self, collision: &Collision) -> String {
        match self.outcome.reached(Moment::FrontBrakes) {
            Some(reached) if reached.time <= collision.time => {
                let lead = self.letters.of_moment(reached);
                format!(", {:.1} s after {lead} braked", (collision.time - reached.time).s())
            }
            _ => ", F had not braked".to_owned(),
        }
    }

    /// Returns the actions of the MIS with their reasons; nothing if the controller has none.
    fn mis(&self) -> Option<String> {
        let mis = self.outcome.mis.as_ref().ok()?;
        let gone = mis.unavailable.map_or_else(String::new, |gone| {
            format!(", without its sensors for {:.1} s from {:.1} s on", gone.lasted_s, gone.from_s)
        });
        let did = match mis.engaged_at_s {
            Ok(engaged_at_s) => {
                let vehicle = self.engaged_for.map_or_else(String::new, |vehicle| format!(" for {vehicle}"));
                let delay = mis.delay_words().map_or_else(String::new, |words| format!("; not sooner: {words}"));
                format!("the MIS engaged{vehicle} at {engaged_at_s:.1} s{}{delay}", self.engaged(mis, engaged_at_s))
            }
            Err(_) => format!("the MIS stayed off: {}", mis.reason_words()),
        };
        Some(format!("{did}{gone}"))
    }

    /// Returns whether and when an ego without an MIS braked in an emergency. `None` if it has an
    /// MIS, or the outcome does not say it.
    pub fn emergency_braking(&self) -> Option<String> {
        let ahead = self.outcome.ahead.filter(|_| self.outcome.mis.is_err())?;
        Some(match ahead.emergency_braking_at_s {
            Ok(at_s) => format!("E braked in an emergency at {at_s:.1} s{}", self.since_braking(at_s)),
            Err(_) => "E did not brake in an emergency".to_owned(),
        })
    }

    /// Returns how long before or after the braking of the lead vehicle a time lies.
    fn since_braking(&self, time_s: f64) -> String {
        self.outcome.reached(Moment::FrontBrakes).map_or_else(String::new, |reached| {
            let before_s = reached.time.s() - time_s;
            let side = if before_s >= 0.0 { "before" } else { "after" };
            format!(", {:.1} s {side} {} braked", before_s.abs(), self.letters.of_moment(reached))
        })
    }

    /// Returns how long before or after the braking the MIS engaged, and how much it could do.
    fn engaged(&self, mis: &MisSummary, engaged_at_s: f64) -> String {
        let when = self.since_braking(engaged_at_s);
        let headways_s =
            mis.thw_front_at_engagement_s.and_then(|before_s| Ok([before_s, mis.thw_front_at_critical_s?]));
        let gained = headways_s.map_or_else(
            |_| String::new(),
            |[before_s, after_s]| format!(", front headway {before_s:.2} to {after_s:.2} s"),
        );
        let goal = match mis.reason {
            Reason::EngagedGoalOutOfReach => self.missed_goal(headways_s.ok()),
            _ => String::new(),
        };
        format!("{when}{gained}{goal}")
    }

    /// Returns the goal that was out of reach when the MIS engaged, and by how much the headway at
    /// the critical distance misses it; nothing if the headway reaches it all the same.
    /// `headways_s` are the headways at the engagement and at the critical distance.
    fn missed_goal(&self, headways_s: Option<[f64; 2]>) -> String {
        let Some(goal_s) = self.goal_s else { return ", its goal out of reach".to_owned() };
        let missing_s = headways_s.map(|[before_s, after_s]| goal_s - (after_s - before_s));
        match missing_s {
            Some(missing_s) if missing_s < SHORTFALL_S => String::new(),
            Some(missing_s) => format!(", {missing_s:.2} s short of its goal of +{goal_s} s, which was out of reach"),
            None => format!(", its goal of +{goal_s} s out of reach"),
        }
    }

    /// Returns the faults that began before the first collision, or in the run.
    fn faults(&self) -> String {
        let end = self.first().map_or(self.outcome.duration, |collision| collision.time);
        let has_begun = |fault: &&StatedFault| fault.from_s <= end.s();
        let texts: Vec<String> = self.faults.iter().filter(has_begun).map(ToString::to_string).collect();
        if texts.is_empty() { "none".to_owned() } else { texts.join("; ") }
    }
}

/// Returns the sentence about a run of a scenario, in which the command line may have set the mode
/// of the sensors. `goal_s` is the front time headway that the MIS of the arm is to gain (s).
pub fn causal_sentence(
    scenario: &Scenario,
    sensors: Option<SensorMode>,
    goal_s: Option<f64>,
    outcome: &Outcome,
) -> String {
    let faults = sensors.map_or(scenario.sensors, |mode| scenario.sensors.with_mode(mode)).stated_faults();
    let letters = VehicleLetters::of(scenario);
    CausalSentence { outcome, letters: &letters, faults: &faults, engaged_for: None, goal_s }.to_string()
}

impl CausalSentence<'_> {
    /// Returns the part of the sentence about the vehicles.
    pub fn happened(&self) -> String {
        let Some(first) = self.first() else {
            let braked = self.outcome.reached(Moment::FrontBrakes).map_or_else(String::new, |reached| {
                format!("; {} braked at {}", self.letters.of_moment(reached), seconds(reached.time))
            });
            return format!("no vehicle collided{braked}");
        };
        let at = seconds(first.time);
        let others = self.outcome.collisions.iter().filter(|other| *other != first).map(|other| {
            let when = if other.time < first.time { "before it" } else { "then" };
            format!("; {when} {} at {}", self.struck(other), seconds(other.time))
        });
        let others: String = others.collect();
        format!("{} ({}) at {at}{}{others}", self.struck(first), self.delta_v(first), self.after_braking(first))
    }

    /// Returns the part of the sentence about the system and the faults.
    pub fn reason(&self) -> String {
        let did = self.mis().or_else(|| self.emergency_braking()).map_or_else(String::new, |did| format!("{did}; "));
        format!("{did}faults: {}", self.faults())
    }
}

impl fmt::Display for CausalSentence<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.happened(), self.reason())
    }
}

fn seconds(time: Time) -> String {
    format!("{:.2} s", time.s())
}

#[cfg(test)]
mod tests {
    use closecall_sensors::faults::SensorGroup;
    use closecall_traffic::{Absent, Parameters};

    use super::*;
    use crate::outcome::{Ahead, ClosedBy, EndReason, Margins, Phase, ReachedMoment, ReasonSpan};

    fn id(name: &str) -> ActorId {
        ActorId::new(name).unwrap()
    }

    fn letters() -> VehicleLetters {
        VehicleLetters { lead: Some(id("front")), rear: Some(id("rear")) }
    }

    fn collision(between: [&str; 2], sides: [BoxSide; 2], closed_by: ClosedBy) -> Collision {
        Collision {
            time: Time::from_ms(13_500),
            between: between.map(id),
            struck_side: sides,
            closed_by,
            phase: Phase::Critical,
            relative_speed_mps: 9.2,
            delta_v_mps: [5.1, 5.2],
        }
    }

    fn reached(moment: Moment, time_ms: i64, vehicle: &str) -> ReachedMoment {
        ReachedMoment { moment, time: Time::from_ms(time_ms), vehicle: Some(id(vehicle)) }
    }

    fn outcome(collisions: Vec<Collision>, reason: Reason) -> Outcome {
        let none = Err(Absent::NoFollower);
        Outcome {
            scenario: "s".to_owned(),
            seed: 1,
            sample: 0,
            controller: "mis".to_owned(),
            ego: id("ego"),
            parameters: Parameters::default(),
            end: EndReason::Collision,
            duration: Time::from_ms(15_500),
            collisions,
            touches: Vec::new(),
            moments: vec![reached(Moment::FrontBrakes, 9_000, "front")],
            margins: Margins {
                min_thw_front_s: none,
                min_thw_rear_s: none,
                min_gap_front_m: none,
                min_gap_rear_m: none,
                min_ttc_rear_s: none,
                max_deceleration_mps2: 0.0,
                max_jerk_mps3: 0.0,
                max_speed_deficit_mps: 0.0,
            },
            mis: Ok(MisSummary {
                engaged_at_s: Err(Absent::NeverEngaged),
                released_at_s: Err(Absent::NeverEngaged),
                thw_front_at_engagement_s: Err(Absent::NeverEngaged),
                thw_front_at_critical_s: Err(Absent::NeverEngaged),
                mean_deceleration_mps2: Err(Absent::NeverEngaged),
                goal_in_reach: None,
                reason,
                reasons: Vec::new(),
                decided_s: None,
                unavailable: None,
            }),
            cost: None,
            promise: None,
            ahead: None,
        }
    }

    fn sentence(outcome: &Outcome, faults: &[StatedFault]) -> String {
        CausalSentence { outcome, letters: &letters(), faults, engaged_for: None, goal_s: Some(2.0) }.to_string()
    }

    #[test]
    fn a_moment_names_the_vehicle_that_reached_it_and_not_always_r() {
        let label = |moment, vehicle| letters().moment_label(&reached(moment, 1_000, vehicle));
        assert_eq!(label(Moment::CriticalDistance, "rear"), "(e) R is at the critical distance");
        assert_eq!(label(Moment::CriticalDistance, "second"), "(e) second is at the critical distance");
        assert_eq!(label(Moment::Hazard, "third"), "(a) E brakes hard in front of third");
        assert_eq!(label(Moment::Concluded, "third"), "third has passed E");
        assert_eq!(label(Moment::FrontBrakes, "front"), "(d) F brakes");
        assert_eq!(label(Moment::FrontBrakes, "rear"), "(d) R brakes", "it has overtaken, and is ahead now");
    }

    #[test]
    fn a_moment_of_a_journal_without_vehicles_names_neither_r_nor_f() {
        let unnamed = |moment| ReachedMoment { vehicle: None, ..reached(moment, 1_000, "rear") };
        assert_eq!(letters().moment_text(&unnamed(Moment::RearNear)), "the vehicle behind comes near");
        assert_eq!(letters().moment_text(&unnamed(Moment::FrontBrakes)), "the vehicle ahead brakes");
    }

    #[test]
    fn outcomes_are_compared_without_the_vehicles_of_moments_if_one_journal_lacks_them() {
        let named = outcome(Vec::new(), Reason::RearFar);
        let older = named.without_vehicles_of_moments();
        assert!(named.has_same_bits(&named.clone()) && named.has_same_bits(&older) && older.has_same_bits(&named));
        let other = Outcome { moments: vec![reached(Moment::FrontBrakes, 9_000, "rear")], ..named.clone() };
        assert!(!named.has_same_bits(&other), "another vehicle");
        let later = Outcome { moments: vec![reached(Moment::FrontBrakes, 9_040, "front")], ..named };
        assert!(!later.has_same_bits(&older), "another time");
    }

    #[test]
    fn the_sentence_names_the_vehicle_ahead_that_braked() {
        let rear_end = collision(["ego", "rear"], [BoxSide::Rear, BoxSide::Front], ClosedBy::Second);
        let moments = vec![reached(Moment::FrontBrakes, 9_000, "left-2")];
        let run = Outcome { moments, ..outcome(vec![rear_end], Reason::PassingLaneOccupied) };
        assert!(sentence(&run, &[]).contains(", 4.5 s after left-2 braked; "), "{}", sentence(&run, &[]));
    }

    #[test]
    fn the_sentence_says_who_struck_whom_after_what_and_why_the_system_did_not_act() {
        let rear_end = collision(["ego", "rear"], [BoxSide::Rear, BoxSide::Front], ClosedBy::Second);
        let mut run = outcome(vec![rear_end], Reason::PassingLaneOccupied);
        run.mis.as_mut().unwrap().reasons =
            vec![ReasonSpan { reason: Reason::PassingLaneOccupied, from_s: 3.6, until_s: 9.6 }];
        assert_eq!(
            sentence(&run, &[]),
            "R struck E from behind at 9.2 m/s (ΔV R 5.2, E 5.1 m/s) at 13.50 s, 4.5 s after F braked; the MIS stayed off: passing \
             lane occupied, 3.6 to 9.6 s; faults: none"
        );
    }

    #[test]
    fn an_engagement_for_a_vehicle_that_does_not_exist_says_so() {
        let mut run = outcome(Vec::new(), Reason::Engaged);
        run.mis.as_mut().unwrap().engaged_at_s = Ok(2.0);
        let (letters, goal_s) = (letters(), None);
        let told = |engaged_for| {
            CausalSentence { outcome: &run, letters: &letters, faults: &[], engaged_for, goal_s }.reason()
        };
        assert_eq!(
            told(Some("a vehicle that does not exist")),
            "the MIS engaged for a vehicle that does not exist at 2.0 s, 7.0 s before F braked; faults: none"
        );
        assert_eq!(told(None), "the MIS engaged at 2.0 s, 7.0 s before F braked; faults: none");
    }

    #[test]
    fn an_ego_without_an_mis_is_told_by_its_emergency_braking() {
        let run = |emergency_braking_at_s, mis| {
            let run = outcome(Vec::new(), Reason::RearFar);
            let ahead = Some(Ahead { min_ttc_front_s: Ok(2.5), emergency_braking_at_s });
            Outcome { ahead, mis: if mis { run.mis } else { Err(Absent::NoMis) }, ..run }
        };
        let told = |run: &Outcome| sentence(run, &[]);
        let never = Err(Absent::NoEmergencyBraking);
        assert_eq!(
            told(&run(Ok(9.8), false)),
            "no vehicle collided; F braked at 9.00 s; E braked in an emergency at 9.8 s, 0.8 s after F braked; faults: none"
        );
        assert!(told(&run(never, false)).contains("; E did not brake in an emergency; faults: none"));
        assert!(!told(&run(Ok(9.8), true)).contains("emergency"), "the MIS is what is judged");
        let older = Outcome { ahead: None, ..run(never, false) };
        assert!(!told(&older).contains("emergency"), "a journal that does not say it");
    }

    #[test]
    fn a_late_engagement_says_why_it_was_not_sooner() {
        let mut run = outcome(Vec::new(), Reason::Engaged);
        let mis = run.mis.as_mut().unwrap();
        mis.engaged_at_s = Ok(6.2);
        mis.decided_s = Some([2.7, 9.0]);
        mis.reasons = vec![ReasonSpan { reason: Reason::NoRear, from_s: 2.0, until_s: 6.2 }];
        let told = sentence(&run, &[]);
        let expected = "before F braked; not sooner: vehicle behind not seen in the lane, 2.7 to 6.2 s; faults: none";
        assert!(told.ends_with(expected), "{told}");
    }

    #[test]
    fn a_goal_out_of_reach_says_how_much_was_missing() {
        let told = |after_s| {
            let mut run = outcome(Vec::new(), Reason::EngagedGoalOutOfReach);
            let mis = run.mis.as_mut().unwrap();
            mis.engaged_at_s = Ok(6.2);
            mis.thw_front_at_engagement_s = Ok(0.75);
            mis.thw_front_at_critical_s = after_s;
            let told = sentence(&run, &[]);
            told.split("F braked").last().unwrap().trim_end_matches("; faults: none").to_owned()
        };
        let short = ", front headway 0.75 to 1.50 s, 1.25 s short of its goal of +2 s, which was out of reach";
        assert_eq!(told(Ok(1.5)), short);
        assert_eq!(told(Err(Absent::NeverCritical)), ", its goal of +2 s out of reach");
        assert_eq!(told(Ok(3.0)), ", front headway 0.75 to 3.00 s", "it gained more than it had foreseen");
    }

    #[test]
    fn sides_and_other_vehicles_have_words() {
        let struck = |between, sides, closed_by| {
            let run = outcome(vec![collision(between, sides, closed_by)], Reason::NoRear);
            sentence(&run, &[]).split(" at ").next().unwrap().to_owned()
        };
        use BoxSide::{Front, Left, Rear, Right};
        use ClosedBy::{Both, First, Second};
        assert_eq!(struck(["ego", "front"], [Front, Rear], First), "E struck F from behind");
        assert_eq!(struck(["ego", "left-2"], [Left, Front], Second), "left-2 struck E on its left side");
        assert_eq!(struck(["left-2", "rear"], [Right, Left], Second), "R struck left-2 on its right side");
        assert_eq!(struck(["F", "rear"], [Right, Left], Second), "R struck vehicle F on its right side");
        assert_eq!(struck(["R", "OverTaker"], [Right, Left], First), "vehicle R struck OverTaker on its left side");
        assert_eq!(struck(["ego", "rear"], [Front, Front], Both), "E struck R head-on");
    }

    #[test]
    fn a_fault_that_begins_after_the_collision_is_not_named() {
        let fault = |from_s| StatedFault {
            group: SensorGroup::Rear,
            sensor: "rear LiDAR".to_owned(),
            effects: "dead".to_owned(),
            from_s,
            until_s: f64::INFINITY,
        };
        let rear_end = collision(["ego", "rear"], [BoxSide::Rear, BoxSide::Front], ClosedBy::Second);
        let run = outcome(vec![rear_end], Reason::RearSensorsFailed);
        let end = |faults: &[StatedFault]| sentence(&run, faults).split("; faults: ").nth(1).unwrap().to_owned();
        assert_eq!(end(&[fault(2.0)]), "rear LiDAR dead from 2.0 s on");
        assert_eq!(end(&[fault(14.0)]), "none");
        assert_eq!(end(&[fault(f64::NEG_INFINITY), fault(14.0)]), "rear LiDAR dead");
        let harmless = outcome(vec![], Reason::RearSensorsFailed);
        assert_eq!(
            sentence(&harmless, &[fault(14.0)]),
            "no vehicle collided; F braked at 9.00 s; the MIS stayed off: not available: rear sensors failed; faults: rear LiDAR \
             dead from 14.0 s on"
        );
    }
}
