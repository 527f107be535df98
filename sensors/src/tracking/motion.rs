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
//! | along | holds its speed | white, slight | 4 s |
//! | along | drives | 0.7 m/s² for 2 s: the acceleration and coasting of traffic | 4 s |
//! | along | brakes | 4 m/s² for 1.5 s: up to the full braking of an emergency | 2 s |
//! | across | keeps its lane | none to speak of; a lateral speed dies out within a second | 7 s |
//! | across | changes lanes | 0.8 m/s² for 1 s: 3.75 m on a quintic within 3.4 to 8 s (the 5 to 95 % of lane changes on US-101) reach 1.9 to 0.3 m/s² | 3 s |
//!
//! The rates and strengths were chosen on the library's scenarios with seeds of their own; `validate_perception` judges
//! them on others.

/// Most modes that an axis has.
pub(crate) const MODES: usize = 3;

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
    /// Rates of switching to each mode [1/s]; that to itself is not used.
    pub(crate) to_per_s: [f64; MODES],
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
        prior: 1.0,
    }]
}

/// A single mode for sensors that measure speed, or only what is near.
pub(crate) const ALONG_WHITE: &[Mode] = &white(ALONG_WHITE_M2PS3);
/// The same across.
pub(crate) const ACROSS_WHITE: &[Mode] = &white(ACROSS_WHITE_M2PS3);

/// Along the road: holds its speed, drives, brakes.
pub(crate) const ALONG: &[Mode] = &[
    Mode {
        white_m2ps3: 0.002,
        acceleration_sd_mps2: 0.0,
        persistence_s: 0.0,
        calming_s: f64::INFINITY,
        to_per_s: [0.0, 0.25, 0.04],
        prior: 0.6,
    },
    Mode {
        white_m2ps3: 0.01,
        acceleration_sd_mps2: 0.7,
        persistence_s: 2.0,
        calming_s: f64::INFINITY,
        to_per_s: [0.25, 0.0, 0.06],
        prior: 0.38,
    },
    Mode {
        white_m2ps3: 0.1,
        acceleration_sd_mps2: 4.0,
        persistence_s: 1.5,
        calming_s: f64::INFINITY,
        to_per_s: [0.1, 0.4, 0.0],
        prior: 0.02,
    },
];

/// Across it: keeps its lane, changes lanes.
pub(crate) const ACROSS: &[Mode] = &[
    Mode {
        white_m2ps3: 0.000_2,
        acceleration_sd_mps2: 0.0,
        persistence_s: 0.0,
        calming_s: 1.0,
        to_per_s: [0.0, 0.15, 0.0],
        prior: 0.9,
    },
    Mode {
        white_m2ps3: 0.001,
        acceleration_sd_mps2: 0.8,
        persistence_s: 1.0,
        calming_s: f64::INFINITY,
        to_per_s: [0.3, 0.0, 0.0],
        prior: 0.1,
    },
];
