//! The cost of the ego's driving for itself and for the vehicle behind it, before anything happens
//! ahead.
//!
//! ```text
//!   start ───────────▶ R meets the conditions ────────────▶ F brakes, or the ego collides
//!   │ slowing is unprompted │      slowing has a reason       │ the meter has ended
//! ```
//!
//! R is the vehicle behind the ego in its lane, F the lead vehicle. The conditions are the
//! system's: R is within 100 m, and approaches at 10 km/h or more. An ego that slows down makes R
//! approach. So the closing speed is relative to the lead vehicle's speed if that is higher: the
//! ego's own braking gives no reason for itself. All values are true states; the reports of a
//! controller do not count.

use closecall_traffic::{ENGAGEMENT_CLOSING_MPS, ENGAGEMENT_GAP_M};

use closecall_scenarios::outcome::Cost;

/// Error of a tracked closing speed that is not held against a controller (m/s): an assumption; 0.2
/// to 1 are plausible. A system that engages at 10 km/h as it measures them engages at a little
/// less now and then.
const CLOSING_TOLERANCE_MPS: f64 = 0.5;

/// The vehicle behind the ego in its lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rear {
    /// Gap to the ego (m).
    pub(super) gap_m: f64,
    /// Speed of the vehicle (m/s).
    pub(super) speed_mps: f64,
    /// Acceleration of the vehicle (m/s²).
    pub(super) acceleration_mps2: f64,
}

/// The meter's view of one physics step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instant {
    /// Speed of the ego (m/s).
    pub(super) own_mps: f64,
    /// Speed with which the ego's speed is compared (m/s), if there is one.
    pub(super) reference_mps: Option<f64>,
    /// Whether the brake light of the lead vehicle is on.
    pub(super) lead_brakes: bool,
    /// The vehicle behind, if there is one.
    pub(super) rear: Option<Rear>,
}

/// Collects the cost of a run.
#[derive(Debug)]
pub(super) struct CostMeter {
    cost: Cost,
    is_prompted: bool,
    has_ended: bool,
    late_s: f64,
    step_s: f64,
    /// The last speed with which the ego's speed was compared, or its own speed at the start (m/s).
    last_reference_mps: Option<f64>,
}

impl CostMeter {
    pub(super) fn new(step_s: f64) -> Self {
        Self {
            cost: Cost::default(),
            is_prompted: false,
            has_ended: false,
            late_s: 0.0,
            step_s,
            last_reference_mps: None,
        }
    }

    /// Adds one physics step. It must not be called after the ego's first collision.
    pub(super) fn observe(&mut self, now: &Instant) {
        self.has_ended |= now.lead_brakes;
        if self.has_ended {
            return;
        }
        // A lead vehicle counts only after a second. Until then, an ego that slows down would give
        // itself the reason.
        let last_mps = *self.last_reference_mps.get_or_insert(now.own_mps);
        let reference_mps = now.reference_mps.unwrap_or(last_mps);
        self.last_reference_mps = Some(reference_mps);
        if let Some(rear) = now.rear {
            self.cost.imposed_braking_mps2 = self.cost.imposed_braking_mps2.max(-rear.acceleration_mps2);
            let closing_mps = rear.speed_mps - reference_mps.max(now.own_mps);
            self.is_prompted |=
                rear.gap_m <= ENGAGEMENT_GAP_M && closing_mps >= ENGAGEMENT_CLOSING_MPS - CLOSING_TOLERANCE_MPS;
        }
        let Some(reference_mps) = now.reference_mps else { return };
        let deficit_mps = reference_mps - now.own_mps;
        let largest = match self.is_prompted {
            true => &mut self.cost.prompted_deficit_mps,
            false => &mut self.cost.unprompted_deficit_mps,
        };
        *largest = largest.max(deficit_mps);
        if reference_mps > 0.0 {
            self.late_s += self.step_s * deficit_mps / reference_mps;
            self.cost.time_lost_s = self.cost.time_lost_s.max(self.late_s);
        }
    }

    /// Returns the cost.
    pub(super) fn finish(self) -> Cost {
        self.cost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 0.01;

    /// An ego behind a lead vehicle of 30 m/s.
    fn at(own_mps: f64, gap_m: f64, rear_mps: f64) -> Instant {
        let rear = Some(Rear { gap_m, speed_mps: rear_mps, acceleration_mps2: 0.0 });
        Instant { own_mps, reference_mps: Some(30.0), lead_brakes: false, rear }
    }

    fn cost_of(steps: &[Instant]) -> Cost {
        let mut meter = CostMeter::new(STEP_S);
        steps.iter().for_each(|step| meter.observe(step));
        meter.finish()
    }

    #[test]
    fn slowing_counts_as_unprompted_until_a_vehicle_behind_gives_a_reason() {
        assert_eq!(cost_of(&[at(29.0, 120.0, 35.0)]).unprompted_deficit_mps, 1.0, "too far away");
        assert_eq!(cost_of(&[at(29.0, 90.0, 32.0)]).unprompted_deficit_mps, 1.0, "too slow");
        assert_eq!(cost_of(&[at(29.0, 90.0, 35.0)]).unprompted_deficit_mps, 0.0, "near and fast");
        let late = [at(29.0, 120.0, 35.0), at(30.0, 90.0, 35.0), at(22.0, 80.0, 35.0)];
        assert_eq!(cost_of(&late).unprompted_deficit_mps, 1.0, "what follows has a reason");
        assert_eq!(cost_of(&late).prompted_deficit_mps, 8.0);
        let alone = Instant { rear: None, ..at(25.0, 0.0, 0.0) };
        assert_eq!(cost_of(&[alone]).unprompted_deficit_mps, 5.0, "nobody is behind");
    }

    #[test]
    fn an_ego_that_slows_down_does_not_give_itself_the_reason() {
        // The rear vehicle closes at 10 m/s. The ego's own part is 9 m/s.
        assert_eq!(cost_of(&[at(21.0, 50.0, 31.0)]).unprompted_deficit_mps, 9.0);
    }

    #[test]
    fn an_ego_does_not_give_itself_the_reason_before_the_lead_vehicle_counts() {
        let unsettled = |own_mps| Instant { reference_mps: None, ..at(own_mps, 70.0, 31.5) };
        let steps = [unsettled(30.0), unsettled(28.5), at(28.0, 69.0, 31.5)];
        assert_eq!(cost_of(&steps).unprompted_deficit_mps, 2.0);
    }

    #[test]
    fn nothing_counts_once_the_lead_vehicle_brakes() {
        let braking = Instant { lead_brakes: true, ..at(30.0, 120.0, 35.0) };
        assert_eq!(cost_of(&[braking, at(10.0, 120.0, 35.0)]), Cost::default());
    }

    #[test]
    fn time_lost_is_the_most_that_the_ego_was_late() {
        let mut steps = vec![at(20.0, 50.0, 40.0); 300];
        steps.extend(vec![at(40.0, 50.0, 40.0); 300]);
        let lost_s = cost_of(&steps).time_lost_s;
        assert!((lost_s - 1.0).abs() < 1e-9, "{lost_s}");
    }

    #[test]
    fn braking_of_the_vehicle_behind_is_the_hardest() {
        let braking = |by_mps2: f64| {
            let rear = at(30.0, 50.0, 35.0).rear.map(|rear| Rear { acceleration_mps2: -by_mps2, ..rear });
            Instant { rear, ..at(30.0, 50.0, 35.0) }
        };
        assert_eq!(cost_of(&[braking(-1.0), braking(3.0), braking(2.0)]).imposed_braking_mps2, 3.0);
    }
}
