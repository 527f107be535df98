//! The proportions of motorcycles with their riders. The rider is the larger part of the visible
//! area.

/// Radius of the wheels (m).
pub const WHEEL_RADIUS_M: f32 = 0.31;
/// Distance of the steering head behind the front end (m).
pub const HEAD_BACK_M: f32 = 0.45;
/// Longitudinal position of the rider's hip (m).
pub const HIP_X_M: f32 = -0.35;
/// The rider's body.
pub const RIDER: Rider = Rider {
    seat: 0.48,
    shoulder_below_top_m: 0.30,
    head_below_top_m: 0.15,
    head_ahead_m: 0.1,
    head_radii_m: [0.15, 0.13, 0.15],
};

/// The measures of a rider, which are the same on every motorcycle.
#[derive(Clone, Copy, Debug)]
pub struct Rider {
    /// Height of the seat (share of the height).
    pub seat: f32,
    /// Distance of the shoulders below the top of the helmet (m).
    pub shoulder_below_top_m: f32,
    /// Distance of the middle of the helmet below its top (m).
    pub head_below_top_m: f32,
    /// Distance of the middle of the helmet ahead of the hip, without the rider's lean (m).
    pub head_ahead_m: f32,
    /// Half extents of the helmet along, across and up (m).
    pub head_radii_m: [f32; 3],
}

/// A fairing or shield.
#[derive(Clone, Copy, Debug)]
pub struct Fairing {
    /// Half of the width (m).
    pub half_width_m: f32,
    /// Height of the upper edge (share of the height).
    pub top: f32,
}

/// The headlamps.
#[derive(Clone, Copy, Debug)]
pub struct Lamps {
    /// Half of the width of a lamp (m).
    pub half_width_m: f32,
    /// Half of the height of a lamp (m).
    pub half_height_m: f32,
    /// Half of the distance between two lamps (m), or 0 for a single lamp.
    pub half_distance_m: f32,
}

/// Proportions of a motorcycle with its rider.
#[derive(Clone, Copy, Debug)]
pub struct MotorcycleProportions {
    /// The fairing, if there is one.
    pub fairing: Option<Fairing>,
    /// The headlamps.
    pub lamps: Lamps,
    /// Distance by which the rider's shoulders lean forward (m).
    pub lean_m: f32,
    /// Height of the handlebar (share of the height).
    pub bar: f32,
    /// Width of each side case (m); 0 for none.
    pub cases_m: f32,
    /// Reflectance of the rider's suit (linear red, green, blue).
    pub suit: [f32; 3],
}

pub(super) const NAKED_BIKE: MotorcycleProportions = MotorcycleProportions {
    fairing: None,
    lamps: Lamps { half_width_m: 0.09, half_height_m: 0.09, half_distance_m: 0.0 },
    lean_m: 0.15,
    bar: 0.66,
    cases_m: 0.0,
    suit: [0.03, 0.03, 0.035],
};

pub(super) const SPORT_BIKE: MotorcycleProportions = MotorcycleProportions {
    fairing: Some(Fairing { half_width_m: 0.26, top: 0.72 }),
    lamps: Lamps { half_width_m: 0.07, half_height_m: 0.05, half_distance_m: 0.10 },
    lean_m: 0.40,
    bar: 0.60,
    cases_m: 0.0,
    suit: [0.35, 0.04, 0.03],
};

pub(super) const TOURER: MotorcycleProportions = MotorcycleProportions {
    fairing: Some(Fairing { half_width_m: 0.32, top: 0.80 }),
    lamps: Lamps { half_width_m: 0.10, half_height_m: 0.07, half_distance_m: 0.09 },
    lean_m: 0.05,
    bar: 0.63,
    cases_m: 0.18,
    suit: [0.12, 0.13, 0.14],
};

pub(super) const SCOOTER: MotorcycleProportions = MotorcycleProportions {
    fairing: Some(Fairing { half_width_m: 0.24, top: 0.68 }),
    lamps: Lamps { half_width_m: 0.08, half_height_m: 0.07, half_distance_m: 0.0 },
    lean_m: 0.0,
    bar: 0.64,
    cases_m: 0.0,
    suit: [0.10, 0.14, 0.25],
};

pub(super) const CHOPPER: MotorcycleProportions = MotorcycleProportions {
    fairing: None,
    lamps: Lamps { half_width_m: 0.09, half_height_m: 0.09, half_distance_m: 0.0 },
    lean_m: -0.10,
    bar: 0.74,
    cases_m: 0.12,
    suit: [0.05, 0.03, 0.02],
};

pub(super) const TRAIL_BIKE: MotorcycleProportions = MotorcycleProportions {
    fairing: Some(Fairing { half_width_m: 0.18, top: 0.74 }),
    lamps: Lamps { half_width_m: 0.08, half_height_m: 0.09, half_distance_m: 0.0 },
    lean_m: 0.05,
    bar: 0.66,
    cases_m: 0.0,
    suit: [0.45, 0.42, 0.05],
};
