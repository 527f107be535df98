//! The model in the loop: perception before it, the loop's types around it.

use closecall_traffic::Stream;

use super::{Wiedemann99, Wiedemann99Model};
use crate::driver::perception::{Perceived, Perception};
use crate::driver::{
    Driver, DriverAction, DriverError, DriverInput, DriverNote, HARDEST_BRAKING_MPS2, LIFT_OFF_MPS2, Lead,
    check_finite, finite,
};

/// Share of the hardest braking from which on a driver brakes in an emergency.
const EMERGENCY_SHARE: f64 = 0.75;

/// Time headway within which a brake light ahead concerns a driver [s].
const LIGHT_CONCERNS_WITHIN_S: f64 = 3.0;

/// Time headway within which a driver brakes for a brake light ahead instead of waiting for what comes of it [s]: up to
/// about that the headways of car-following are observed (Fancher et al., *Intelligent Cruise Control Field Operational
/// Test*, DOT HS 808 849, 1998).
const LIGHT_IS_FOLLOWED_WITHIN_S: f64 = 2.0;

/// From this speed difference on the vehicle ahead pulls away, whatever its brake light shows [m/s].
const PULLS_AWAY_MPS: f64 = 2.0;

/// A human who follows by Wiedemann 99 and stays in its lane.
#[derive(Clone, Debug)]
pub struct Wiedemann99Driver {
    settings: Wiedemann99,
    model: Wiedemann99Model,
    desired_mps: Option<f64>,
    perception: Option<Perception>,
    emergency: Emergency,
}

impl Wiedemann99Driver {
    /// A driver for one run.
    pub fn new(settings: Wiedemann99) -> Self {
        Self {
            settings,
            model: Wiedemann99Model::new(&settings),
            desired_mps: settings.desired_speed_mps,
            perception: None,
            emergency: Emergency::default(),
        }
    }

    fn lead(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Option<Perceived> {
        let reaction = self.settings.reaction?;
        let new = || Perception::new(reaction.draw(rng), None).with_lapses(self.settings.lapse);
        self.perception.get_or_insert_with(new).look(input, rng).ahead
    }
}

impl Driver for Wiedemann99Driver {
    fn step(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError> {
        check_finite(input)?;
        let speed_mps = input.own.speed_mps;
        let usual_mps = *self.desired_mps.get_or_insert_with(|| usually_desired_mps(input));
        let desired_mps = input.desired_now_mps(usual_mps);
        let mut acceleration_mps2 = if self.settings.reaction.is_some() {
            let ahead = self.lead(input, rng);
            let wanted = self.model.acceleration_mps2(speed_mps, desired_mps, ahead.as_ref().map(|seen| &seen.lead));
            brake_for_light(wanted, speed_mps, ahead.as_ref())
        } else {
            let lead = nearest(input);
            self.model.acceleration_mps2(speed_mps, desired_mps, lead.as_ref())
        };
        acceleration_mps2 = finite(acceleration_mps2, "acceleration of a follower", input.time)?;
        Ok(DriverAction { acceleration_mps2, note: self.emergency.note(acceleration_mps2), ..DriverAction::default() })
    }
}

/// The nearer of the vehicle ahead in the lane and the one in the way, as it truly is.
pub(crate) fn nearest(input: &DriverInput<'_>) -> Option<Lead> {
    let near = input.neighbours;
    let pair = [near.own.lead.as_ref(), near.in_path.as_ref()];
    pair.into_iter().flatten().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m)).map(|neighbour| Lead {
        gap_m: neighbour.gap_m,
        speed_mps: neighbour.speed_mps,
        acceleration_mps2: neighbour.acceleration_mps2,
    })
}

/// The speed that a follower wants where its scenario names none [m/s]: the road's limit, or its own speed at the start if
/// that is higher.
pub(crate) fn usually_desired_mps(input: &DriverInput<'_>) -> f64 {
    input.own.speed_mps.max(input.road.speed_limit_mps())
}

/// Takes the foot off the accelerator where the vehicle ahead shows its brake light and is near.
pub(crate) fn lift_off_for_light(wanted_mps2: f64, speed_mps: f64, ahead: Option<&Perceived>) -> f64 {
    match ahead {
        Some(seen)
            if seen.brake_light
                && seen.lead.gap_m < LIGHT_CONCERNS_WITHIN_S * speed_mps
                && seen.lead.speed_mps < speed_mps + PULLS_AWAY_MPS =>
        {
            wanted_mps2.min(-LIFT_OFF_MPS2)
        }
        _ => wanted_mps2,
    }
}

/// The same for one who follows: where the vehicle ahead is so near that it is followed, one brakes like it at once, and
/// works out afterwards what is needed.
pub(crate) fn brake_for_light(wanted_mps2: f64, speed_mps: f64, ahead: Option<&Perceived>) -> f64 {
    let lifted_mps2 = lift_off_for_light(wanted_mps2, speed_mps, ahead);
    match ahead {
        Some(seen) if lifted_mps2 <= -LIFT_OFF_MPS2 && seen.brake_light => {
            let follows = seen.lead.gap_m < LIGHT_IS_FOLLOWED_WITHIN_S * speed_mps;
            if follows { lifted_mps2.min(seen.lead.acceleration_mps2) } else { lifted_mps2 }
        }
        _ => lifted_mps2,
    }
}

/// Says once when a driver begins to brake as hard as it can.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Emergency(bool);

impl Emergency {
    pub(crate) fn note(&mut self, acceleration_mps2: f64) -> Option<DriverNote> {
        let before = self.0;
        self.0 = acceleration_mps2 <= -EMERGENCY_SHARE * HARDEST_BRAKING_MPS2;
        (self.0 && !before).then_some(DriverNote::EmergencyBraking)
    }
}
