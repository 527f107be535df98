//! The Wiedemann 99 driver: adapts perception and model to the simulation loop.

use closecall_traffic::Stream;

use super::{Wiedemann99, Wiedemann99Model};
use crate::driver::pedals::Pedals;
use crate::driver::perception::{PerceivedScene, PerceivedVehicle, Perception};
use crate::driver::{
    COASTING_DECELERATION_MPS2, Driver, DriverAction, DriverError, DriverInput, DriverNote, Lead, Looks, check_finite,
    finite,
};

/// Share of the hardest braking above which braking counts as emergency braking: an assumption; it
/// marks the log only.
const EMERGENCY_BRAKING_SHARE: f64 = 0.75;

/// Time headway below which a driver releases the accelerator because of a brake light ahead (s):
/// an assumption, the longest headway that drivers keep in car-following (Fancher et al. 1996: 0.6
/// to 3 s).
const COASTING_FOR_LIGHT_THW_S: f64 = 3.0;

/// Time headway below which a driver brakes because of a brake light ahead, instead of only
/// releasing the accelerator (s): an assumption; 1 to 3 are plausible.
const BRAKING_FOR_LIGHT_THW_S: f64 = 2.0;

/// 1/TTC from which a driver who is about to overtake brakes for a brake light ahead (1/s). Drivers
/// begin ordinary braking at 0.100 behind a vehicle that brakes at 0.15 g, at 0.132 behind one that
/// brakes at 0.39 g, and at 0.192 behind a standing one, all at 60 mph (Kiefer et al. 2003, as
/// quoted in Markkula's code for HFES 2014). Range: 0.10 to 0.25.
const BRAKE_ONSET_PER_S: f64 = 0.10;

/// Speed difference above which the vehicle ahead pulls away, so that its brake light does not
/// matter (m/s): an assumption; 1 to 4 are plausible.
const PULLING_AWAY_MPS: f64 = 2.0;

/// A human driver who follows the lead vehicle by the Wiedemann 99 model and stays in the lane.
#[derive(Clone, Debug)]
pub struct Wiedemann99Driver {
    settings: Wiedemann99,
    model: Wiedemann99Model,
    /// The model behind the second leader.
    beyond_model: Wiedemann99Model,
    desired_mps: Option<f64>,
    perception: Option<Perception>,
    emergency: EmergencyBrakingDetector,
    pedals: Pedals,
}

impl Wiedemann99Driver {
    /// Creates a driver for one run.
    pub fn new(settings: Wiedemann99) -> Self {
        Self {
            settings,
            model: Wiedemann99Model::new(&settings),
            beyond_model: Wiedemann99Model::new(&settings),
            desired_mps: settings.desired_speed_mps,
            perception: None,
            emergency: EmergencyBrakingDetector::new(settings.hardest_braking_mps2),
            pedals: Pedals::new(settings.brake_build_up_mps3),
        }
    }

    /// Observes the surroundings and returns them as perceived, or `None` if the driver knows the
    /// truth at once.
    fn observe(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Option<PerceivedScene> {
        let reaction = self.settings.reaction?;
        let settings = &self.settings;
        let new = || {
            Perception::new(reaction.draw_s(rng), None).with_lapses(settings.lapse).with_settings(settings.perception)
        };
        Some(self.perception.get_or_insert_with(new).observe(input, rng))
    }
}

impl Driver for Wiedemann99Driver {
    fn step(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError> {
        check_finite(input)?;
        let speed_mps = input.own.speed_mps;
        let long_term_mps = *self.desired_mps.get_or_insert_with(|| default_desired_mps(input));
        let desired_mps = input.desired_now_mps(long_term_mps);
        let mut acceleration_mps2 = if let Some(PerceivedScene { ahead, beyond, .. }) = self.observe(input, rng) {
            let requested_mps2 =
                self.model.acceleration_mps2(speed_mps, desired_mps, ahead.as_ref().map(|vehicle| &vehicle.lead));
            let requested_mps2 = brake_for_brake_light(requested_mps2, speed_mps, ahead.as_ref());
            let beyond_mps2 =
                beyond.map(|beyond| self.beyond_model.acceleration_mps2(speed_mps, desired_mps, Some(&beyond.lead)));
            let requested_mps2 = self.settings.perception.respond_mps2(requested_mps2, beyond_mps2);
            self.pedals.apply_mps2(requested_mps2, input.time)
        } else {
            let lead = nearest_lead(input);
            self.model.acceleration_mps2(speed_mps, desired_mps, lead.as_ref())
        };
        acceleration_mps2 = finite(acceleration_mps2, "acceleration of a follower", input.time)?;
        Ok(DriverAction {
            acceleration_mps2,
            note: self.emergency.detect(acceleration_mps2),
            ..DriverAction::default()
        })
    }

    fn looks(&self) -> Looks {
        Looks { beyond: self.settings.perception.looks_beyond(), ..Looks::AHEAD }
    }
}

/// Returns the true state of the nearest vehicle ahead, in the lane or in the path.
pub(crate) fn nearest_lead(input: &DriverInput<'_>) -> Option<Lead> {
    let near = input.neighbours;
    let pair = [near.own.lead.as_ref(), near.in_path.as_ref()];
    pair.into_iter().flatten().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m)).map(|neighbour| Lead {
        gap_m: neighbour.gap_m,
        speed_mps: neighbour.speed_mps,
        acceleration_mps2: neighbour.acceleration_mps2,
    })
}

/// Returns the desired speed of a driver whose scenario gives none (m/s): the larger of the road's
/// speed limit and the vehicle's own speed. It is called at the first step.
pub(crate) fn default_desired_mps(input: &DriverInput<'_>) -> f64 {
    input.own.speed_mps.max(input.road.speed_limit_mps())
}

/// Returns `requested_mps2`, or at most the acceleration with released accelerator if a near
/// vehicle ahead shows its brake light.
fn coast_for_brake_light(requested_mps2: f64, speed_mps: f64, ahead: Option<&PerceivedVehicle>) -> f64 {
    match ahead {
        Some(vehicle)
            if vehicle.brake_light
                && vehicle.lead.gap_m < COASTING_FOR_LIGHT_THW_S * speed_mps
                && vehicle.lead.speed_mps < speed_mps + PULLING_AWAY_MPS =>
        {
            requested_mps2.min(-COASTING_DECELERATION_MPS2)
        }
        _ => requested_mps2,
    }
}

/// Limits the acceleration as [`coast_for_brake_light`] does. If the vehicle ahead is near enough
/// to be followed, the driver also brakes at least as strongly as that vehicle: humans brake first,
/// and assess afterwards how hard they must brake.
pub(crate) fn brake_for_brake_light(requested_mps2: f64, speed_mps: f64, ahead: Option<&PerceivedVehicle>) -> f64 {
    let limited_mps2 = coast_for_brake_light(requested_mps2, speed_mps, ahead);
    match ahead {
        Some(vehicle) if limited_mps2 <= -COASTING_DECELERATION_MPS2 && vehicle.brake_light => {
            let follows = vehicle.lead.gap_m < BRAKING_FOR_LIGHT_THW_S * speed_mps;
            if follows { limited_mps2.min(vehicle.lead.acceleration_mps2) } else { limited_mps2 }
        }
        _ => limited_mps2,
    }
}

/// Limits the acceleration as [`coast_for_brake_light`] and [`brake_while_overtaking`] do, for a
/// driver who is about to overtake the vehicle ahead.
pub(crate) fn brake_before_overtaking(requested_mps2: f64, speed_mps: f64, ahead: Option<&PerceivedVehicle>) -> f64 {
    brake_while_overtaking(coast_for_brake_light(requested_mps2, speed_mps, ahead), speed_mps, ahead)
}

/// Returns `requested_mps2`. If the overtaken vehicle shows its brake light and the gap closes so
/// fast that drivers brake, returns at most the acceleration of that vehicle. The driver then
/// brakes even if steering alone would avoid a collision: the brake light says that the prediction
/// may be wrong. The light alone does not make a driver who is already pulling out release the
/// accelerator: it leaves the lane of that vehicle.
pub(crate) fn brake_while_overtaking(requested_mps2: f64, speed_mps: f64, ahead: Option<&PerceivedVehicle>) -> f64 {
    match ahead {
        Some(vehicle)
            if vehicle.brake_light
                && speed_mps - vehicle.lead.speed_mps > BRAKE_ONSET_PER_S * vehicle.lead.gap_m.max(0.0) =>
        {
            requested_mps2.min(vehicle.lead.acceleration_mps2)
        }
        _ => requested_mps2,
    }
}

/// Detects the start of emergency braking.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmergencyBrakingDetector {
    hardest_braking_mps2: f64,
    brakes: bool,
}

impl EmergencyBrakingDetector {
    pub(crate) fn new(hardest_braking_mps2: f64) -> Self {
        Self { hardest_braking_mps2, brakes: false }
    }

    /// Returns [`DriverNote::EmergencyBraking`] at the first step at which `acceleration_mps2` is
    /// emergency braking.
    pub(crate) fn detect(&mut self, acceleration_mps2: f64) -> Option<DriverNote> {
        let before = self.brakes;
        self.brakes = acceleration_mps2 <= -EMERGENCY_BRAKING_SHARE * self.hardest_braking_mps2;
        (self.brakes && !before).then_some(DriverNote::EmergencyBraking)
    }
}
