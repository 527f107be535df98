//! Droplets in the air: spray behind vehicles, fog, rain. They dim what lies behind them and send false returns.
//!
//! ```text
//!        ┌──────┐ ░ ░ ▒▒        plume: as wide as the vehicle, as long as it drives in a quarter of a second
//!   ◀── E│      │▒▒▒▒▒ ░ ░░
//!        └o────o┘▒▒▒▒░▒ ░
//! ```
//!
//! A layer of droplets of extinction α and depth ΔR sends back like a surface of ρ = π·α·ΔR/S, where S is the ratio of
//! extinction to backscatter: 18.8 sr for water droplets at 905 nm (O'Connor, Illingworth and Hogan 2004). ΔR is the
//! length of the pulse. Droplets come in clumps: the extinction along a beam is exponentially distributed about its
//! mean, and neighbouring columns share it.
//!
//! How dense spray is has been measured only roughly. The sizes here are assumptions that give what recordings show
//! (Walz et al. 2021, "A benchmark for spray from nearby cutting vehicles"; Linnhoff et al. 2022, "Simulating road spray
//! effects in automotive lidar sensor models"): nothing below 40 to 50 km/h, much more with speed and water, tens to
//! hundreds of false points, most of them within 10 m behind a vehicle.

use closecall_traffic::{Environment, Vehicle, VehicleClass};

use super::cast::SubRays;
use super::echo::PULSE_M;
use super::noise::{Noise, Purpose};
use super::pattern::LAYERS;
use super::power::LinkBudget;
use super::solid::Solid;
use super::targets::{FaceRange, Targets};
use super::{Material, PointSource};

/// Extinction over backscatter of water droplets at 905 nm (sr).
const LIDAR_RATIO_SR: f32 = 18.8;
/// Speed below which tyres throw up no spray (m/s).
const SPRAY_FROM_MPS: f64 = 12.0;
/// Mean extinction in the plume of a car at the reference speed on a film of 1 mm (1/m) (assumption).
const SPRAY_PER_M_AND_MM: f64 = 0.008;
const SPRAY_REFERENCE_MPS: f64 = 30.0;
/// Deeper water runs off to the sides (mm) (assumption).
const MAX_FILM_MM: f64 = 3.0;
/// Time for which a plume hangs together (s) (assumption).
const PLUME_LIFE_S: f64 = 0.25;
const PLUME_HEIGHT_M: f64 = 1.4;
/// Columns that share one clump of droplets.
const CLUMP_COLUMNS: usize = 3;
/// Share of the backscatter of fog that varies within a pulse's length; the receiver filters out the rest
/// (assumption).
const FOG_CLUMPINESS: f32 = 0.1;
/// Light and receiver overlap fully only beyond some metres (m): half at this distance (assumption).
const OVERLAP_M: f32 = 2.0;
const NEAREST_M: f32 = 0.5;

/// A cloud of droplets with clear bounds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plume {
    pub(crate) faces: FaceRange,
    /// Mean extinction (1/m).
    pub(crate) extinction_per_m: f32,
}

/// A false return.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SoftEcho {
    pub(crate) range_m: f32,
    pub(crate) power: f32,
    pub(crate) source: PointSource,
}

/// What droplets do to one beam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DropletEffect {
    /// The nearest false return, were it strong enough.
    pub(crate) echo: Option<SoftEcho>,
    /// Depth (m) and mean optical depth of the plumes that the beam crosses.
    near_m: f32,
    optical_depth: f32,
}

impl DropletEffect {
    /// Share of the light from `range_m` that gets through the plumes.
    pub(crate) fn transmission(&self, range_m: f32) -> f32 {
        if self.optical_depth > 0.0 && range_m > self.near_m { (-2.0 * self.optical_depth).exp() } else { 1.0 }
    }
}

/// The plume behind a vehicle in its own frame, and its mean extinction (1/m); nothing where it is dry or slow.
pub(crate) fn spray_plume(vehicle: &Vehicle, speed_mps: f64, environment: &Environment) -> Option<(Solid, f32)> {
    let film_mm = environment.water_film_mm.min(MAX_FILM_MM);
    let speed = (speed_mps - SPRAY_FROM_MPS) / (SPRAY_REFERENCE_MPS - SPRAY_FROM_MPS);
    if !(film_mm > 0.0 && speed > 0.0) {
        return None;
    }
    let tyres = match vehicle.class {
        VehicleClass::Car => 1.0,
        VehicleClass::Truck => 3.0,
        VehicleClass::Motorcycle => 0.4,
    };
    let rear = -0.5 * vehicle.dimensions.length_m;
    let half = 0.5 * vehicle.dimensions.width_m;
    let low = [rear - PLUME_LIFE_S * speed_mps, -half, 0.0];
    let high = [rear, half, PLUME_HEIGHT_M.min(vehicle.dimensions.height_m)];
    #[expect(clippy::cast_possible_truncation, reason = "powers need no more than single precision")]
    let extinction = (SPRAY_PER_M_AND_MM * film_mm * tyres * speed * speed) as f32;
    Some((Solid::cuboid(low, high, Material::Water), extinction))
}

/// What the beam with this centre meets in the air.
pub(crate) fn droplet_effect(
    beam: usize,
    centre: &SubRays,
    plumes: &[Plume],
    of: (&Targets, &LinkBudget, Noise),
) -> DropletEffect {
    let (targets, link, noise) = of;
    let mut found = DropletEffect { echo: fog(beam, link, noise), near_m: f32::INFINITY, optical_depth: 0.0 };
    // Logarithms are drawn by those beams alone that need them: not by those that cross no plume, ...
    let mut clump = None;
    let depth = noise.uniform(beam, Purpose::Depth);
    let mut has_echo = false;
    for plume in plumes {
        let Some([from, to]) = plume_interval_m(centre, plume.faces, targets) else { continue };
        let clump = *clump.get_or_insert_with(|| {
            let column = beam / LAYERS;
            let clump_at = (column / CLUMP_COLUMNS) * LAYERS + beam % LAYERS;
            -noise.uniform(clump_at, Purpose::Plume).ln()
        });
        let extinction = plume.extinction_per_m * clump;
        let before = found.optical_depth;
        found.near_m = found.near_m.min(from);
        found.optical_depth += extinction * (to - from);
        // ... nor by those that end beyond it: −ln u ≥ 1 − u.
        if has_echo || 0.5 * (1.0 - depth) >= found.optical_depth {
            continue;
        }
        let ends_at = -0.5 * depth.ln();
        if ends_at < found.optical_depth {
            has_echo = true;
            let range_m = from + (ends_at - before) / extinction;
            let echo = SoftEcho { range_m, power: soft_power(extinction, range_m, link), source: PointSource::Spray };
            if found.echo.is_none_or(|other| range_m < other.range_m) {
                found.echo = Some(echo);
            }
        }
    }
    found
}

/// Between which ranges a beam is inside of a plume (m).
fn plume_interval_m(centre: &SubRays, faces: FaceRange, targets: &Targets) -> Option<[f32; 2]> {
    let slant = (1.0 + centre.tan[0] * centre.tan[0]).sqrt();
    let along = |face: usize| centre.inverse_distances(targets.faces[face].inverse)[0];
    let nearest = faces.front_facing().map(along).fold(1.0 / NEAREST_M, f32::min);
    let farthest = faces.back_facing().map(along).fold(0.0, f32::max);
    (nearest > farthest && farthest > 0.0).then(|| [slant / nearest, slant / farthest])
}

/// Power of a clump of droplets (thresholds).
fn soft_power(extinction_per_m: f32, range_m: f32, link: &LinkBudget) -> f32 {
    let reflectivity = std::f32::consts::PI * extinction_per_m * PULSE_M / LIDAR_RATIO_SR;
    let square = range_m * range_m;
    let overlap = square / (square + OVERLAP_M * OVERLAP_M);
    link.gain_m2 * reflectivity * overlap / square * link.transmission(range_m)
}

/// The clump of fog or rain that this beam meets first.
fn fog(beam: usize, link: &LinkBudget, noise: Noise) -> Option<SoftEcho> {
    if !link.has_fog() {
        return None;
    }
    let depth = -0.5 * noise.uniform(beam, Purpose::FogDepth).ln();
    let range_m = NEAREST_M + depth / link.extinction_per_m;
    let clump = -noise.uniform(beam, Purpose::FogClump).ln();
    let power = soft_power(link.extinction_per_m * FOG_CLUMPINESS * clump, range_m, link);
    Some(SoftEcho { range_m, power, source: PointSource::Fog })
}
