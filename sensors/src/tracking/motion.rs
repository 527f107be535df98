//! How vehicles move along one axis of the road: the models between which a filter may switch.
//!
//! Nobody drives with white acceleration: a vehicle holds its speed and its lane for many seconds, and then brakes or
//! changes lanes for some. One spectral density that covers both is far too cautious in the first case and far too sure
//! of itself in the second. So each axis has a few modes, one of which holds at a time, and from one to the other of
//! which it switches at given rates (interacting multiple models: Blom and Bar-Shalom 1988; the acceleration of a mode
//! is Singer's, 1970: exponentially correlated).
//!
//! | axis | mode | acceleration | lasts |
//! |---|---|---|---|
//! | along | holds its speed | 0.2 m/s² for 6.5 s: the unsteady foot of free driving (Herman et al. 1959: 0.1 m/s² and more) | 33 s |
//! | along | drives | 0.8 m/s² for 1 s: the acceleration and coasting of traffic | 4 s |
//! | along | brakes | 4 m/s² for 1.5 s: up to the full braking of an emergency | 2 s |
//! | across | keeps its lane | 0.215 m/s² for 0.2 s, and a lateral speed dies out within a second: a weave of 0.1 m/s, as at an SDLP of 0.2 m | 60 s |
//! | across | changes lanes | 1.1 m/s² for 2 s: 3.75 m on a quintic within 3.4 to 8 s (the 5 to 95 % of lane changes on US-101) reach 1.9 to 0.3 m/s² | 1 s |
//!
//! White acceleration comes on top: 0.0001 to 0.1 m²/s³ along, 0.001 and 0.002 m²/s³ across.
//!
//! How soon a mode ends depends on the [`Situation`]: who closes in on E in its lane has to brake or to change lanes, the sooner
//! the nearer, and who has nothing before it has no reason to. The rates rise with 1/TTC.
//!
//! What has no source above (rates, how they rise, how far drivers foresee) was chosen on the library's scenarios, with seeds of
//! its own; `validate_perception` judges it on others.

/// Most modes that an axis has.
pub(crate) const MODES: usize = 3;

/// How long before it would run into E a vehicle begins to do something about it [s].
const FORESEES_S: f64 = 14.0;
/// It does not do more for being nearer than this [s].
const LEAST_TTC_S: f64 = 0.5;

/// E's rear bumper in road axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EgoRear {
    pub(crate) s_m: f64,
    pub(crate) d_m: f64,
    /// Along the road.
    pub(crate) speed_mps: f64,
    /// Half of a lane: a vehicle whose middle is no further to the side of E's drives in E's lane.
    pub(crate) half_lane_m: f64,
}

/// A vehicle behind E in road axes, at the same time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Behind {
    /// Its front.
    pub(crate) front_s_m: f64,
    /// Its middle line.
    pub(crate) d_m: f64,
    /// Along the road.
    pub(crate) speed_mps: f64,
}

/// What a vehicle has before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Situation {
    /// 1/TTC to E less what it is when the vehicle begins to care [1/s]; 0 where it has no reason to do anything.
    urgency_per_s: f64,
}

impl Situation {
    /// Nothing that would make it do anything else than before.
    pub(crate) const FREE: Self = Self { urgency_per_s: 0.0 };

    /// That of a vehicle behind E.
    pub(crate) fn of(other: &Behind, ego: &EgoRear) -> Self {
        let (gap_m, closing_mps) = (ego.s_m - other.front_s_m, other.speed_mps - ego.speed_mps);
        let is_behind = gap_m > 0.0 && (other.d_m - ego.d_m).abs() < ego.half_lane_m;
        if is_behind && closing_mps * FORESEES_S > gap_m {
            let ttc_s = (gap_m / closing_mps).max(LEAST_TTC_S);
            Self { urgency_per_s: 1.0 / ttc_s - 1.0 / FORESEES_S }
        } else {
            Self::FREE
        }
    }
}

/// One way of moving.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mode {
    /// Spectral density of white acceleration [m²/s³].
    pub(crate) white_m2ps3: f64,
    /// Standard deviation of the acceleration that persists [m/s²].
    pub(crate) acceleration_sd_mps2: f64,
    /// How long that persists [s]; 0 where there is none.
    pub(crate) persistence_s: f64,
    /// Time within which a speed dies out [s]; infinite where it stays.
    pub(crate) calming_s: f64,
    /// Rates of switching to each mode [1/s] with nothing ahead; that to itself is not used.
    pub(crate) to_per_s: [f64; MODES],
    /// By how much these rise with the urgency of the [`Situation`] [1].
    pub(crate) urged_to: [f64; MODES],
    /// Probability before anything is known [1].
    pub(crate) prior: f64,
}

/// Spectral density of the white acceleration along the direction of travel [m²/s³].
///
/// From recorded traffic: over NGSIM US-101 (10,212 pairs of speeds 1 s apart) the variance of the change of speed is
/// 0.75, 0.79, 0.75 and 0.76 m²/s² for each second between them at lags of 0.5, 1, 2 and 3 s. That it grows in
/// proportion to the lag is what white acceleration means: an average over all that drivers do.
const ALONG_WHITE_M2PS3: f64 = 0.75;

/// The same across it [m²/s³]: 0.034 to 0.069 in the same recordings, measurement errors included.
const ACROSS_WHITE_M2PS3: f64 = 0.05;

const fn white(white_m2ps3: f64) -> [Mode; 1] {
    [Mode {
        white_m2ps3,
        acceleration_sd_mps2: 0.0,
        persistence_s: 0.0,
        calming_s: f64::INFINITY,
        to_per_s: [0.0; MODES],
        urged_to: [0.0; MODES],
        prior: 1.0,
    }]
}

/// A single mode for sensors that measure speed, or only what is near.
pub(crate) const ALONG_WHITE: &[Mode] = &white(ALONG_WHITE_M2PS3);
/// The same across.
pub(crate) const ACROSS_WHITE: &[Mode] = &white(ACROSS_WHITE_M2PS3);

impl Mode {
    /// Rates of switching to each mode in a situation [1/s].
    pub(crate) fn rates_per_s(&self, situation: Situation) -> [f64; MODES] {
        std::array::from_fn(|to| self.to_per_s[to] + self.urged_to[to] * situation.urgency_per_s)
    }
}

/// Along the road: holds its speed, drives, brakes.
pub(crate) const ALONG: &[Mode] = &[
    Mode {
        white_m2ps3: 0.000_1,
        acceleration_sd_mps2: 0.2,
        persistence_s: 6.5,
        calming_s: f64::INFINITY,
        to_per_s: [0.0, 0.025, 0.005],
        urged_to: [0.0, 1.3, 0.5],
        prior: 0.6,
    },
    Mode {
        white_m2ps3: 0.01,
        acceleration_sd_mps2: 0.8,
        persistence_s: 1.0,
        calming_s: f64::INFINITY,
        to_per_s: [0.2, 0.0, 0.05],
        urged_to: [0.0, 0.0, 0.2],
        prior: 0.38,
    },
    Mode {
        white_m2ps3: 0.1,
        acceleration_sd_mps2: 4.0,
        persistence_s: 1.5,
        calming_s: f64::INFINITY,
        to_per_s: [0.1, 0.4, 0.0],
        urged_to: [0.0; MODES],
        prior: 0.02,
    },
];

/// Across it: keeps its lane, changes lanes.
pub(crate) const ACROSS: &[Mode] = &[
    Mode {
        white_m2ps3: 0.002,
        acceleration_sd_mps2: 0.215,
        persistence_s: 0.22,
        calming_s: 0.9,
        to_per_s: [0.0, 0.016, 0.0],
        urged_to: [0.0, 4.0, 0.0],
        prior: 0.9,
    },
    Mode {
        white_m2ps3: 0.001,
        acceleration_sd_mps2: 1.1,
        persistence_s: 2.0,
        calming_s: f64::INFINITY,
        to_per_s: [1.0, 0.0, 0.0],
        urged_to: [0.0; MODES],
        prior: 0.1,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    const EGO: EgoRear = EgoRear { s_m: 1_000.0, d_m: -5.6, speed_mps: 30.0, half_lane_m: 1.875 };

    fn situation(gap_m: f64, closing_mps: f64, aside_m: f64) -> Situation {
        let (front_s_m, speed_mps) = (EGO.s_m - gap_m, EGO.speed_mps + closing_mps);
        Situation::of(&Behind { front_s_m, d_m: EGO.d_m + aside_m, speed_mps }, &EGO)
    }

    fn urgency_per_s(gap_m: f64, closing_mps: f64, aside_m: f64) -> f64 {
        situation(gap_m, closing_mps, aside_m).urgency_per_s
    }

    #[test]
    fn two_seconds_before_e_hardly_anybody_just_goes_on() {
        let urgency_per_s = 1.0 / 2.0 - 1.0 / 14.0;
        let near = situation(20.0, 10.0, 0.0);
        for (modes, to) in [(ALONG, 1), (ALONG, 2), (ACROSS, 1)] {
            let expected_per_s = modes[0].to_per_s[to] + modes[0].urged_to[to] * urgency_per_s;
            let rate_per_s = modes[0].rates_per_s(near)[to];
            assert!((rate_per_s - expected_per_s).abs() < 1e-9, "{rate_per_s} {expected_per_s}");
            assert!(rate_per_s > 10.0 * modes[0].rates_per_s(Situation::FREE)[to], "{rate_per_s}");
        }
        // Who has braked or changed lanes is done with it as soon as anybody.
        assert_eq!(ALONG[2].rates_per_s(near), ALONG[2].to_per_s);
        assert_eq!(ACROSS[1].rates_per_s(near), ACROSS[1].to_per_s);
    }

    #[test]
    fn who_closes_in_has_to_do_something_the_sooner_the_nearer() {
        assert_eq!(urgency_per_s(100.0, 5.0, 0.0), 0.0);
        let urgencies_per_s = [60.0, 30.0, 10.0, 1.0].map(|gap_m| urgency_per_s(gap_m, 8.0, 1.0));
        assert!(urgencies_per_s.is_sorted() && urgencies_per_s[0] > 0.0, "{urgencies_per_s:?}");
        assert_eq!(urgency_per_s(1.0, 8.0, 0.0), urgency_per_s(0.1, 8.0, 0.0));
    }

    #[test]
    fn who_falls_back_drives_elsewhere_or_is_past_has_no_reason_to() {
        for (gap_m, closing_mps, aside_m) in
            [(5.0, -1.0, 0.0), (5.0, 8.0, 3.75), (-1.0, 8.0, 0.0), (5.0, f64::NAN, 0.0), (f64::NAN, 8.0, 0.0)]
        {
            assert_eq!(urgency_per_s(gap_m, closing_mps, aside_m), 0.0, "{gap_m} {closing_mps} {aside_m}");
        }
    }
}
