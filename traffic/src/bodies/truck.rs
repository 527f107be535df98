//! The proportions of trucks: a cab, and the load or trailer behind it.
//!
//! ```text
//!      bonnet  cab    gap  load
//!             ┌───┐   ┌────────────────┐
//!       ______│   │   │                │
//!      │______│___│___│________________│
//!         o      o  o            o o o
//! ```

use super::HalfExtent;

/// Length of a cab without its bonnet (m).
pub const CAB_M: f32 = 2.2;
/// Gap between the cab and the load (m).
pub const LOAD_GAP_M: f32 = 0.35;
/// Height of the underside of a box or a tarpaulin (m).
pub const LOAD_FLOOR_M: f32 = 1.15;
/// Height of a tank's underside (m).
pub const TANK_FLOOR_M: f32 = 1.1;
/// Distance by which the upper edge of the windscreen, and the front edge of the roof, lie behind
/// its lower edge (m).
pub const SCREEN_RAKE_M: [f32; 2] = [0.12, 0.45];
/// The deck of an open platform.
pub const DECK: Slab = Slab { centre_m: 1.15, half_height_m: 0.12 };
/// The load on an open platform.
pub const CRATE: Slab = Slab { centre_m: 1.8, half_height_m: 0.55 };

/// The sun visor above the windscreen; coaches have none.
pub const VISOR: Visor =
    Visor { back_m: 0.12, half_depth_m: 0.14, half_width: 0.44, above_screen_m: 0.1, half_height_m: 0.06 };

/// The measures of a sun visor.
#[derive(Clone, Copy, Debug)]
pub struct Visor {
    /// Distance of its middle behind the windscreen's lower edge (m).
    pub back_m: f32,
    /// Half of its extent along the truck (m).
    pub half_depth_m: f32,
    /// Half of its width (share of the width).
    pub half_width: f32,
    /// Height of its middle above the windscreen's upper edge (m).
    pub above_screen_m: f32,
    /// Half of the height (m).
    pub half_height_m: f32,
}

/// The heights of a block.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    /// Height of the middle (m).
    pub centre_m: f32,
    /// Half of the height (m).
    pub half_height_m: f32,
}

/// The part of the truck behind the cab.
#[derive(Clone, Copy, Debug)]
pub enum Load {
    /// A tarpaulin of this colour (linear red, green, blue).
    Tarpaulin([f32; 3]),
    /// A box of this colour (linear red, green, blue).
    Box([f32; 3]),
    /// A round tank.
    Tank,
    /// An open platform with a low load.
    Platform,
    /// The passenger compartment of a coach, which forms one body with the cab.
    Coach,
}

/// Proportions of a truck.
#[derive(Clone, Copy, Debug)]
pub struct TruckProportions {
    /// Height of the cab's roof (share of the height).
    pub cab_height: f32,
    /// Length of the bonnet ahead of the windscreen (m), or 0 for a cab over the engine.
    pub bonnet_m: f32,
    /// Heights of the windscreen's lower and upper edge (shares of the cab's height).
    pub windscreen: [f32; 2],
    /// Extent of the grille.
    pub grille: HalfExtent,
    /// What stands behind the cab.
    pub load: Load,
}

pub(super) const TARPAULIN_TRAILER: TruckProportions = TruckProportions {
    cab_height: 0.90,
    bonnet_m: 0.0,
    windscreen: [0.52, 0.80],
    grille: HalfExtent { width: 0.30, height: 0.10 },
    load: Load::Tarpaulin([0.15, 0.25, 0.5]),
};

pub(super) const BOX_TRAILER: TruckProportions = TruckProportions {
    cab_height: 0.76,
    bonnet_m: 0.0,
    windscreen: [0.54, 0.88],
    grille: HalfExtent { width: 0.36, height: 0.07 },
    load: Load::Box([0.75, 0.75, 0.74]),
};

pub(super) const TANKER: TruckProportions = TruckProportions {
    cab_height: 0.88,
    bonnet_m: 0.0,
    windscreen: [0.50, 0.80],
    grille: HalfExtent { width: 0.26, height: 0.12 },
    load: Load::Tank,
};

pub(super) const BONNETED_TRACTOR: TruckProportions = TruckProportions {
    cab_height: 0.78,
    bonnet_m: 1.6,
    windscreen: [0.60, 0.82],
    grille: HalfExtent { width: 0.20, height: 0.16 },
    load: Load::Box([0.7, 0.7, 0.68]),
};

pub(super) const PLATFORM_TRUCK: TruckProportions = TruckProportions {
    cab_height: 1.0,
    bonnet_m: 0.0,
    windscreen: [0.52, 0.86],
    grille: HalfExtent { width: 0.30, height: 0.06 },
    load: Load::Platform,
};

pub(super) const COACH: TruckProportions = TruckProportions {
    cab_height: 1.0,
    bonnet_m: 0.0,
    windscreen: [0.36, 0.86],
    grille: HalfExtent { width: 0.15, height: 0.03 },
    load: Load::Coach,
};

pub(super) const BOX_TRUCK: TruckProportions = TruckProportions {
    cab_height: 0.74,
    bonnet_m: 0.0,
    windscreen: [0.50, 0.88],
    grille: HalfExtent { width: 0.30, height: 0.06 },
    load: Load::Box([0.65, 0.66, 0.6]),
};
