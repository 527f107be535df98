//! Tests of each condition and transition, on the whole ego stack with hand-made tracks.

mod emergency;
mod engaging;
mod holding;
mod releasing;

use closecall_traffic::{
    CONTROL_STEP, ClassScores, Lane, Road, Source, Time, Track, TrackId, TrackStatus, VehicleClass,
};

use proptest::prelude::*;

use super::{Encounter, MisSettings};
use crate::ego::{
    Acc, ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack, EgoState, GapPolicy, Odometry,
    Reason, SensorAvailability,
};

const CAR_M: f64 = 4.6;

/// The reference point: the paper's figure.
pub(super) const REFERENCE: Encounter = Encounter {
    ego_mps: 30.0,
    front_gap_m: 21.0,
    lead_mps: 30.0,
    rear_gap_m: 100.0,
    closing_mps: 24.0 / 3.6,
    critical_gap_m: 5.0,
};

prop_compose! {
    /// Encounters of all kinds, with the paper's critical gap.
    pub(super) fn encounters()(
        ego_mps in 15.0..40.0, thw in 0.3..1.5, lead in -3.0..3.0, rear_gap_m in 6.0..120.0, closing_mps in 0.5..20.0,
    ) -> Encounter {
        Encounter {
            ego_mps, front_gap_m: thw * ego_mps, lead_mps: ego_mps + lead, rear_gap_m, closing_mps,
            critical_gap_m: 5.0,
        }
    }
}

/// A test bench in which every condition for engaging holds: the ego drives at 30 m/s, the lead
/// vehicle is at 21 m, and the rear vehicle is at 90 m and 8 m/s faster.
struct Bench {
    stack: EgoStack,
    time: Time,
    road: Road,
    lane: Lane,
    sensors: SensorAvailability,
    tracks: Vec<Track>,
}

fn track(id: u32, x_m: f64, speed_mps: f64, lane: usize) -> Track {
    let mut probability = [0.0; 3];
    probability[lane] = 1.0;
    Track {
        id: TrackId(id),
        source: if x_m > 0.0 { Source::Front } else { Source::Rear },
        status: TrackStatus::Confirmed,
        time: Time::ZERO,
        state: [x_m, 0.0, speed_mps, 0.0].into(),
        covariance: Default::default(),
        heading_rad: 0.0,
        length_m: CAR_M,
        width_m: 1.85,
        class: ClassScores::certain(VehicleClass::Car),
        existence: 1.0,
        lane: probability,
    }
}

impl Bench {
    fn new() -> Self {
        Self::with_automation(true)
    }

    const SETTINGS: EgoSettings = EgoSettings {
        acc: Acc { time_gap_s: 0.7, set_speed_mps: None, standstill_gap_m: 3.0, policy: GapPolicy::Constant },
        aeb: None,
        mis: Some(MisSettings::PAPER),
        automated: true,
        human: None,
        is_human: false,
    };

    fn with_automation(automated: bool) -> Self {
        Self::with_settings(EgoSettings { automated, ..Self::SETTINGS })
    }

    fn with_mis(mis: MisSettings) -> Self {
        Self::with_settings(EgoSettings { mis: Some(mis), ..Self::SETTINGS })
    }

    fn with_settings(settings: EgoSettings) -> Self {
        Self {
            stack: EgoStack::new(settings),
            time: Time::ZERO,
            road: Road::straight(3),
            lane: Lane(2),
            sensors: SensorAvailability::ALL,
            tracks: vec![track(1, 21.0 + CAR_M, 30.0, 1), track(2, -90.0 - CAR_M, 38.0, 1)],
        }
    }

    fn lead(&mut self) -> &mut Track {
        &mut self.tracks[0]
    }

    fn rear(&mut self) -> &mut Track {
        &mut self.tracks[1]
    }

    fn step(&mut self) -> EgoCommand {
        self.try_step().unwrap()
    }

    fn try_step(&mut self) -> Result<EgoCommand, ControllerError> {
        for track in &mut self.tracks {
            track.time = self.time;
        }
        let odometry = Odometry {
            speed_mps: 30.0,
            acceleration_mps2: 0.0,
            yaw_rate_radps: 0.0,
            lane: self.lane,
            lane_offset_m: 0.0,
            length_m: CAR_M,
            width_m: 1.85,
        };
        let (time, road) = (self.time, &self.road);
        self.time += CONTROL_STEP;
        let (tracks, sensors) = (&self.tracks, self.sensors);
        self.stack.step(&EgoInput { time, odometry, road, curvature_per_m: 0.0, tracks, sensors })
    }

    /// Steps for `seconds` and returns the last command.
    fn step_for(&mut self, seconds: f64) -> EgoCommand {
        let until = self.time + Time::from_s(seconds);
        let mut command = self.step();
        while self.time < until {
            command = self.step();
        }
        command
    }

    fn assert_not_engaged(&mut self, reason: Reason) {
        let command = self.step();
        assert_eq!((command.state, command.reason), (EgoState::Following, reason));
        assert_eq!(command.plan, None);
    }

    fn engaged() -> Self {
        let mut bench = Self::new();
        assert_eq!(bench.step().state, EgoState::Increasing);
        bench
    }

    fn assert_released(&mut self, within_s: f64, reason: Reason) {
        let command = self.step_for(within_s);
        assert_eq!((command.state, command.reason), (EgoState::Releasing, reason));
    }
}
