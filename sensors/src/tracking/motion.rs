//! Motion models of vehicles along one axis of the road: the modes between which a filter switches.
//!
//! White acceleration does not describe driving. A vehicle holds its speed and its lane for many
//! seconds, and then brakes or changes lanes for a few. A single spectral density for both is far
//! too conservative in the first case and far too confident in the second. Each axis therefore has
//! a few modes. One mode holds at a time, and the vehicle switches between them at given rates
//! (interacting multiple models: Blom and Bar-Shalom 1988). The acceleration of a mode is
//! exponentially correlated (Singer 1970).
//!
//! | axis | mode | acceleration | mean duration |
//! |---|---|---|---|
//! | along | holds its speed | 0.2 m/s² for 6.5 s: unsteady pedal control in free driving (Herman et al. 1959: 0.1 m/s² and more) | 33 s |
//! | along | drives | 0.8 m/s² for 1 s: accelerating and coasting in traffic | 4 s |
//! | along | brakes | 4 m/s² for 1.5 s: up to emergency braking | 2 s |
//! | across | keeps its lane | 0.46 m/s² for 0.36 s drives a lateral speed that decays in the same time: weaving with 0.12 m/s | 60 s |
//! | across | changes lanes | 1.1 m/s² for 2 s: 3.75 m on a quintic within 3.4 to 8 s (the 5 to 95 % of lane changes on US-101) reach 1.9 to 0.3 m/s² | 1 s |
//!
//! A driver with a standard deviation of lateral position (SDLP) of 0.2 m whose steering has the
//! lags of the drivers on US-101 (4.1, 0.4 and 0.4 s at 30 m/s) weaves with 0.12 m/s and 0.36 m/s²
//! at 33 m/s. The mode that keeps its lane has the last two lags at this speed, and a driving
//! acceleration that gives this speed.
//!
//! White acceleration is added: 0.0001 to 0.1 m²/s³ along, 0.001 m²/s³ across.
//!
//! The rates depend on the [`Situation`]. A vehicle that approaches the ego in the ego's lane has
//! to brake or to change lanes, the sooner the nearer it is. A vehicle with a free lane ahead has
//! no reason to. The rates rise with 1/TTC (time to collision).
//!
//! The values without a source above (the rates, their rise with 1/TTC, and the drivers'
//! anticipation time) were tuned on the library's scenarios with separate seeds.
//! `just xtask validate-perception` judges them on other seeds.

/// Maximum number of modes of an axis.
pub const MODES: usize = 3;

/// TTC to the ego below which a vehicle starts to react (s).
const ANTICIPATION_S: f64 = 14.0;
/// TTC below which the urgency rises no further (s).
const MIN_TTC_S: f64 = 0.5;

/// The ego's rear bumper in road axes.
#[derive(Clone, Copy, Debug)]
pub struct EgoRear {
    /// Position along the road (m).
    pub s_m: f64,
    /// Lateral position of the ego's centre line (m); positive to the left.
    pub d_m: f64,
    /// Speed along the road (m/s).
    pub speed_mps: f64,
    /// Half of the lane width (m). A vehicle drives in the ego's lane if its lateral offset from
    /// the ego is smaller.
    pub half_lane_m: f64,
}

/// A vehicle behind the ego in road axes, at the same time as [`EgoRear`].
#[derive(Clone, Copy, Debug)]
pub struct RearVehicle {
    /// Position of the front (m).
    pub front_s_m: f64,
    /// Lateral position of the centre line (m).
    pub d_m: f64,
    /// Speed along the road (m/s).
    pub speed_mps: f64,
}

/// The traffic situation of a vehicle, which determines its rates of switching between modes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// 1/TTC to the ego minus its value at the time of the first reaction (1/s); 0 without a reason
    /// to react.
    urgency_per_s: f64,
}

impl Situation {
    /// A situation without a reason to react.
    pub const FREE: Self = Self { urgency_per_s: 0.0 };

    /// Returns the situation of a vehicle relative to the ego.
    #[inline]
    pub fn of(other: &RearVehicle, ego: &EgoRear) -> Self {
        let (gap_m, closing_mps) = (ego.s_m - other.front_s_m, other.speed_mps - ego.speed_mps);
        let is_behind = gap_m > 0.0 && (other.d_m - ego.d_m).abs() < ego.half_lane_m;
        if is_behind && closing_mps * ANTICIPATION_S > gap_m {
            let ttc_s = (gap_m / closing_mps).max(MIN_TTC_S);
            Self { urgency_per_s: 1.0 / ttc_s - 1.0 / ANTICIPATION_S }
        } else {
            Self::FREE
        }
    }
}

/// One mode of motion along one axis.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// Spectral density of the white acceleration (m²/s³).
    pub white_density_m2ps3: f64,
    /// Standard deviation of the correlated acceleration (m/s²).
    pub acceleration_sd_mps2: f64,
    /// Correlation time of this acceleration (s); 0 if there is none.
    pub persistence_s: f64,
    /// Time constant with which a speed decays (s); infinite if it does not decay.
    pub speed_decay_s: f64,
    /// Rates of switching to each mode in a free situation (1/s); the mode's own entry is not used.
    pub switch_rates_per_s: [f64; MODES],
    /// Increase of each rate per unit of the [`Situation`]'s urgency.
    pub urgency_gains: [f64; MODES],
    /// Prior probability of the mode.
    pub prior_probability: f64,
}

/// Spectral density of the white acceleration along the direction of travel (m²/s³), for a single
/// mode.
///
/// It follows from the trajectory data of NGSIM US-101 (10,212 pairs of speeds 1 s apart). The
/// variance of the speed change is 0.75, 0.79, 0.75 and 0.76 m²/s² per second of lag at lags of
/// 0.5, 1, 2 and 3 s. A variance in proportion to the lag is the property of white acceleration,
/// here as an average over all manoeuvres.
const ALONG_WHITE_M2PS3: f64 = 0.75;

/// Spectral density of the white acceleration across the direction of travel (m²/s³), for a single
/// mode.
///
/// The same data give 0.034 to 0.069, measurement errors included.
const ACROSS_WHITE_M2PS3: f64 = 0.05;

/// Returns a single mode of white acceleration.
const fn white_mode(white_density_m2ps3: f64) -> [Mode; 1] {
    [Mode {
        white_density_m2ps3,
        acceleration_sd_mps2: 0.0,
        persistence_s: 0.0,
        speed_decay_s: f64::INFINITY,
        switch_rates_per_s: [0.0; MODES],
        urgency_gains: [0.0; MODES],
        prior_probability: 1.0,
    }]
}

/// The single mode along the road, for sensors that measure speed or see only nearby vehicles.
pub const ALONG_WHITE_MODE: &[Mode] = &white_mode(ALONG_WHITE_M2PS3);
/// The single mode across the road, for the same sensors.
pub const ACROSS_WHITE_MODE: &[Mode] = &white_mode(ACROSS_WHITE_M2PS3);

impl Mode {
    /// Returns the rates of switching to each mode in a situation (1/s).
    #[inline]
    pub fn rates_per_s(&self, situation: Situation) -> [f64; MODES] {
        std::array::from_fn(|to| self.switch_rates_per_s[to] + self.urgency_gains[to] * situation.urgency_per_s)
    }
}

/// The modes along the road: holds its speed, drives, brakes.
pub const ALONG_MODES: &[Mode] = &[
    Mode {
        white_density_m2ps3: 0.000_1,
        acceleration_sd_mps2: 0.2,
        persistence_s: 6.5,
        speed_decay_s: f64::INFINITY,
        switch_rates_per_s: [0.0, 0.025, 0.005],
        urgency_gains: [0.0, 1.3, 0.5],
        prior_probability: 0.6,
    },
    Mode {
        white_density_m2ps3: 0.01,
        acceleration_sd_mps2: 0.8,
        persistence_s: 1.0,
        speed_decay_s: f64::INFINITY,
        switch_rates_per_s: [0.2, 0.0, 0.05],
        urgency_gains: [0.0, 0.0, 0.2],
        prior_probability: 0.38,
    },
    Mode {
        white_density_m2ps3: 0.1,
        acceleration_sd_mps2: 4.0,
        persistence_s: 1.5,
        speed_decay_s: f64::INFINITY,
        switch_rates_per_s: [0.1, 0.4, 0.0],
        urgency_gains: [0.0; MODES],
        prior_probability: 0.02,
    },
];

/// The modes across the road: keeps its lane, changes lanes.
pub const ACROSS_MODES: &[Mode] = &[
    Mode {
        white_density_m2ps3: 0.001,
        acceleration_sd_mps2: 0.46,
        persistence_s: 0.36,
        speed_decay_s: 0.36,
        switch_rates_per_s: [0.0, 0.016, 0.0],
        urgency_gains: [0.0, 4.0, 0.0],
        prior_probability: 0.9,
    },
    Mode {
        white_density_m2ps3: 0.001,
        acceleration_sd_mps2: 1.1,
        persistence_s: 2.0,
        speed_decay_s: f64::INFINITY,
        switch_rates_per_s: [1.0, 0.0, 0.0],
        urgency_gains: [0.0; MODES],
        prior_probability: 0.1,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    const EGO: EgoRear = EgoRear { s_m: 1_000.0, d_m: -5.6, speed_mps: 30.0, half_lane_m: 1.875 };

    fn situation(gap_m: f64, closing_mps: f64, lateral_m: f64) -> Situation {
        let (front_s_m, speed_mps) = (EGO.s_m - gap_m, EGO.speed_mps + closing_mps);
        Situation::of(&RearVehicle { front_s_m, d_m: EGO.d_m + lateral_m, speed_mps }, &EGO)
    }

    fn urgency_per_s(gap_m: f64, closing_mps: f64, lateral_m: f64) -> f64 {
        situation(gap_m, closing_mps, lateral_m).urgency_per_s
    }

    #[test]
    fn at_a_ttc_of_2_s_modes_switch_over_ten_times_faster() {
        let urgency_per_s = 1.0 / 2.0 - 1.0 / 14.0;
        let near = situation(20.0, 10.0, 0.0);
        for (modes, to) in [(ALONG_MODES, 1), (ALONG_MODES, 2), (ACROSS_MODES, 1)] {
            let expected_per_s = modes[0].switch_rates_per_s[to] + modes[0].urgency_gains[to] * urgency_per_s;
            let rate_per_s = modes[0].rates_per_s(near)[to];
            assert!((rate_per_s - expected_per_s).abs() < 1e-9, "{rate_per_s} {expected_per_s}");
            assert!(rate_per_s > 10.0 * modes[0].rates_per_s(Situation::FREE)[to], "{rate_per_s}");
        }
        // Urgency does not change how long a vehicle brakes or changes lanes.
        assert_eq!(ALONG_MODES[2].rates_per_s(near), ALONG_MODES[2].switch_rates_per_s);
        assert_eq!(ACROSS_MODES[1].rates_per_s(near), ACROSS_MODES[1].switch_rates_per_s);
    }

    #[test]
    fn urgency_rises_as_an_approaching_vehicle_comes_nearer() {
        assert_eq!(urgency_per_s(100.0, 5.0, 0.0), 0.0);
        let urgencies_per_s = [60.0, 30.0, 10.0, 1.0].map(|gap_m| urgency_per_s(gap_m, 8.0, 1.0));
        assert!(urgencies_per_s.is_sorted() && urgencies_per_s[0] > 0.0, "{urgencies_per_s:?}");
        assert_eq!(urgency_per_s(1.0, 8.0, 0.0), urgency_per_s(0.1, 8.0, 0.0));
    }

    #[test]
    fn a_vehicle_that_falls_back_or_is_in_another_lane_or_past_has_no_urgency() {
        for (gap_m, closing_mps, lateral_m) in
            [(5.0, -1.0, 0.0), (5.0, 8.0, 3.75), (-1.0, 8.0, 0.0), (5.0, f64::NAN, 0.0), (f64::NAN, 8.0, 0.0)]
        {
            assert_eq!(urgency_per_s(gap_m, closing_mps, lateral_m), 0.0, "{gap_m} {closing_mps} {lateral_m}");
        }
    }
}
