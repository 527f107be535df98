//! The proportions of passenger cars.
//!
//! ```text
//!            roof ________
//!               /  glass  \___ deck          heights are shares of the car's height,
//!   cowl ______/            \  |             positions are shares of its length, from the front
//!  nose /   bonnet             |
//!       |_( )____________( )___|
//! ```

use super::HalfExtent;

/// Half of the width of the greenhouse at its foot (share of the width).
pub const GREENHOUSE_FOOT_HALF_WIDTH: f32 = 0.475;

/// Proportions of a car's body.
#[derive(Clone, Copy, Debug)]
pub struct CarProportions {
    /// Height of the nose's upper edge (share of the height).
    pub nose: f32,
    /// Height of the belt line, where the windows begin (share of the height).
    pub belt: f32,
    /// Position of the windscreen's lower edge (share of the length, from the front).
    pub cowl: f32,
    /// Position of the roof's front edge (share of the length, from the front).
    pub roof_front: f32,
    /// Position of the roof's rear edge (share of the length, from the front).
    pub roof_rear: f32,
    /// Position of the rear window's lower edge (share of the length, from the front).
    pub deck: f32,
    /// Half of the width of the roof (share of the width).
    pub roof_half_width: f32,
    /// Extent of a headlamp.
    pub headlamp: HalfExtent,
    /// Extent of the grille.
    pub grille: HalfExtent,
    /// Ground clearance below the body (share of the height).
    pub clearance: f32,
}

pub(super) const SALOON: CarProportions = CarProportions {
    nose: 0.52,
    belt: 0.64,
    cowl: 0.27,
    roof_front: 0.41,
    roof_rear: 0.70,
    deck: 0.86,
    roof_half_width: 0.36,
    headlamp: HalfExtent { width: 0.11, height: 0.045 },
    grille: HalfExtent { width: 0.19, height: 0.065 },
    clearance: 0.12,
};

pub(super) const HATCHBACK: CarProportions = CarProportions {
    nose: 0.54,
    belt: 0.63,
    cowl: 0.24,
    roof_front: 0.40,
    roof_rear: 0.88,
    deck: 0.98,
    roof_half_width: 0.37,
    headlamp: HalfExtent { width: 0.10, height: 0.055 },
    grille: HalfExtent { width: 0.22, height: 0.03 },
    clearance: 0.12,
};

pub(super) const ESTATE: CarProportions = CarProportions {
    nose: 0.52,
    belt: 0.62,
    cowl: 0.26,
    roof_front: 0.40,
    roof_rear: 0.92,
    deck: 0.99,
    roof_half_width: 0.37,
    headlamp: HalfExtent { width: 0.12, height: 0.04 },
    grille: HalfExtent { width: 0.17, height: 0.08 },
    clearance: 0.12,
};

pub(super) const COUPE: CarProportions = CarProportions {
    nose: 0.52,
    belt: 0.66,
    cowl: 0.32,
    roof_front: 0.48,
    roof_rear: 0.66,
    deck: 0.93,
    roof_half_width: 0.33,
    headlamp: HalfExtent { width: 0.12, height: 0.04 },
    grille: HalfExtent { width: 0.25, height: 0.05 },
    clearance: 0.09,
};

pub(super) const SUV: CarProportions = CarProportions {
    nose: 0.58,
    belt: 0.64,
    cowl: 0.25,
    roof_front: 0.37,
    roof_rear: 0.90,
    deck: 0.99,
    roof_half_width: 0.38,
    headlamp: HalfExtent { width: 0.10, height: 0.035 },
    grille: HalfExtent { width: 0.22, height: 0.085 },
    clearance: 0.14,
};

pub(super) const VAN: CarProportions = CarProportions {
    nose: 0.46,
    belt: 0.54,
    cowl: 0.14,
    roof_front: 0.26,
    roof_rear: 0.985,
    deck: 0.995,
    roof_half_width: 0.45,
    headlamp: HalfExtent { width: 0.08, height: 0.055 },
    grille: HalfExtent { width: 0.22, height: 0.045 },
    clearance: 0.10,
};

pub(super) const CITY_CAR: CarProportions = CarProportions {
    nose: 0.52,
    belt: 0.62,
    cowl: 0.18,
    roof_front: 0.36,
    roof_rear: 0.90,
    deck: 0.98,
    roof_half_width: 0.39,
    headlamp: HalfExtent { width: 0.09, height: 0.075 },
    grille: HalfExtent { width: 0.12, height: 0.03 },
    clearance: 0.12,
};

pub(super) const MINIVAN: CarProportions = CarProportions {
    nose: 0.50,
    belt: 0.57,
    cowl: 0.17,
    roof_front: 0.36,
    roof_rear: 0.93,
    deck: 0.99,
    roof_half_width: 0.39,
    headlamp: HalfExtent { width: 0.11, height: 0.06 },
    grille: HalfExtent { width: 0.20, height: 0.04 },
    clearance: 0.11,
};

pub(super) const PICKUP: CarProportions = CarProportions {
    nose: 0.60,
    belt: 0.66,
    cowl: 0.26,
    roof_front: 0.35,
    roof_rear: 0.58,
    deck: 0.62,
    roof_half_width: 0.38,
    headlamp: HalfExtent { width: 0.09, height: 0.055 },
    grille: HalfExtent { width: 0.27, height: 0.08 },
    clearance: 0.17,
};
