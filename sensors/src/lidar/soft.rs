//! Droplets in the air: spray behind vehicles, fog and rain. They attenuate the beams and give false returns.
//!
//! ```text
//!        ┌──────┐ ░ ░ ▒▒        plume: as wide as the vehicle, as long as the distance it drives in 0.25 s
//!   ◀──  │ ego  │▒▒▒▒▒ ░ ░░
//!        └o────o┘▒▒▒▒░▒ ░
//! ```
//!
//! A layer of droplets with extinction α and depth ΔR reflects like a surface of ρ = π·α·ΔR/S, where S is the ratio of
//! extinction to backscatter: 18.8 sr for water droplets at 905 nm (O'Connor, Illingworth and Hogan 2004). ΔR is the
//! length of the pulse. Droplets occur in clumps: the extinction along a beam is exponentially distributed about its
//! mean, and neighbouring columns share the same value.
//!
//! The density of spray has been measured only roughly. The values here are assumptions that reproduce published
//! measurements (Walz et al. 2021, "A benchmark for spray from nearby cutting vehicles"; Linnhoff et al. 2022,
//! "Simulating road spray effects in automotive lidar sensor models"): no spray below 40 to 50 km/h, a strong increase
//! with speed and water, tens to hundreds of false points, most of them within 10 m behind a vehicle.

use std::ops::Range;

use closecall_traffic::{Environment, Vehicle, VehicleClass, maths};
use nalgebra::Isometry3;

use super::echo::PULSE_M;
use super::noise::{Noise, Purpose};
use super::power::{LinkBudget, MIN_POWER};
use super::solid::Solid;
use super::targets::{FaceRange, Targets};
use super::{Material, PointSource};

/// Ratio of extinction to backscatter of water droplets at 905 nm (sr).
const LIDAR_RATIO_SR: f32 = 18.8;
/// Speed below which tyres raise no spray (m/s).
const SPRAY_FROM_MPS: f64 = 12.0;
/// Mean extinction in the plume of a car, per mm of water film, at the reference speed (1/m per mm; assumption).
const SPRAY_PER_M_AND_MM: f64 = 0.008;
/// Reference speed (m/s).
const SPRAY_REFERENCE_MPS: f64 = 30.0;
/// Depth of the water film above which more water raises no more spray, because it runs off to the sides (mm;
/// assumption).
const MAX_FILM_MM: f64 = 3.0;
/// Time after which a plume has dispersed (s; assumption).
const PLUME_LIFE_S: f64 = 0.25;
/// Maximum height of a plume (m).
const PLUME_HEIGHT_M: f64 = 1.4;
/// Number of neighbouring columns that share a clump of droplets.
const CLUMP_COLUMNS: usize = 3;
/// Share of the backscatter of fog that varies within the length of a pulse (assumption). The receiver filters out the
/// constant rest.
const FOG_CLUMPINESS: f32 = 0.1;
/// Distance at which the laser beam and the receiver's field of view overlap by half (m; assumption). They overlap
/// fully only beyond some metres.
const OVERLAP_M: f32 = 2.0;
/// Minimum distance of a return from droplets (m).
const NEAREST_M: f32 = 0.5;

/// A spray plume: a cloud of droplets with sharp bounds.
#[derive(Clone, Debug)]
pub(crate) struct Plume {
    pub(crate) faces: FaceRange,
    /// Columns that may cross the plume.
    pub(crate) columns: Range<usize>,
    /// Mean extinction (1/m).
    pub(crate) extinction_per_m: f32,
    /// Length of the longest path through the plume (m).
    pub(crate) longest_m: f32,
    /// Extent of the plume across the sensor's axis (m).
    pub(crate) across_m: f32,
}

impl Plume {
    /// Returns a plume in the shape of a solid, of this mean extinction (1/m), whose pose in the sensor's frame is given.
    #[expect(clippy::cast_possible_truncation, reason = "bounds of metres")]
    pub(crate) fn new(
        (faces, columns): (FaceRange, Range<usize>),
        (solid, pose): (&Solid, &Isometry3<f64>),
        extinction_per_m: f32,
    ) -> Self {
        let corners = || solid.corners().map(|corner| pose * corner);
        let diagonals = corners().flat_map(|from| corners().map(move |to| to - from));
        let [longest, across] =
            diagonals.fold([0.0; 2], |[longest, across], way| [way.norm().max(longest), way.y.max(across)]);
        Self { faces, columns, extinction_per_m, longest_m: longest as f32, across_m: across as f32 }
    }
}

/// A false return from droplets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SoftEcho {
    /// Distance from the sensor (m).
    pub(crate) range_m: f32,
    /// Received power, in multiples of the detection threshold.
    pub(crate) power: f32,
    pub(crate) source: PointSource,
}

/// The effect of droplets on a beam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DropletEffect {
    /// The nearest false return, which may be too weak to be detected.
    pub(crate) echo: Option<SoftEcho>,
    /// Distance at which the beam enters the first plume (m).
    near_m: f32,
    /// Optical depth of all plumes that the beam crosses.
    optical_depth: f32,
}

impl DropletEffect {
    /// Returns true if the false return may be detected.
    pub(crate) fn is_detectable(&self) -> bool {
        self.echo.is_some_and(|echo| echo.power > MIN_POWER)
    }

    /// Returns the share of the light from `range_m` that the plumes transmit, on the way out and back.
    pub(crate) fn transmission(&self, range_m: f32) -> f32 {
        if self.optical_depth > 0.0 && range_m > self.near_m { maths::exp(-2.0 * self.optical_depth) } else { 1.0 }
    }
}

/// Returns the plume behind a vehicle, in the vehicle's own frame, and its mean extinction (1/m). Returns `None` if the
/// road is dry or the vehicle slow.
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

/// The place of a beam in the pattern.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BeamIndex {
    pub(crate) column: usize,
    pub(crate) layer: usize,
    /// Number of layers.
    pub(crate) layers: usize,
}

impl BeamIndex {
    /// Returns the number of the beam in the scan.
    pub(crate) fn beam(self) -> usize {
        self.column * self.layers + self.layer
    }

    /// Returns the number that stands for the clump of droplets that the beam may meet.
    fn clump(self) -> usize {
        (self.column / CLUMP_COLUMNS) * self.layers + self.layer
    }
}

/// Returns the effect of the droplets on the beam whose centre has this direction.
pub(crate) fn droplet_effect(
    at: BeamIndex,
    centre: [f32; 3],
    plumes: &[Plume],
    of: (&Targets, &LinkBudget, Noise),
) -> DropletEffect {
    let (targets, link, noise) = of;
    let beam = at.beam();
    let mut found = DropletEffect { echo: fog(beam, link, noise), near_m: f32::INFINITY, optical_depth: 0.0 };
    // Logarithms are computed only if needed: not for a beam that crosses no plume, ...
    let mut clump = None;
    let depth = noise.uniform(beam, Purpose::Depth);
    let mut has_echo = false;
    for plume in plumes.iter().filter(|plume| plume.columns.contains(&at.column)) {
        let Some([from, to]) = plume_interval_m(centre, plume.faces, targets) else { continue };
        let clump = *clump.get_or_insert_with(|| -maths::ln(noise.uniform(at.clump(), Purpose::Plume)));
        let extinction = plume.extinction_per_m * clump;
        let before = found.optical_depth;
        found.near_m = found.near_m.min(from);
        found.optical_depth += extinction * (to - from);
        // ... nor for one that surely returns no light from this plume, since −ln u ≥ 1 − u.
        if has_echo || 0.5 * (1.0 - depth) >= found.optical_depth {
            continue;
        }
        let ends_at = -0.5 * maths::ln(depth);
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

/// Returns a bound of the optical depth in spray of the beams of a column, for clumps of mean density, times the cosine of their elevation.
/// `sine` is the least sine of their azimuths.
pub(crate) fn greatest_depth(plumes: &[Plume], column: usize, sine: f32) -> f32 {
    let crossed = plumes.iter().filter(|plume| plume.columns.contains(&column));
    // A beam leaves a plume at its sides: the path times the sine is at most the extent across.
    let path_m = |plume: &Plume| plume.longest_m.min(plume.across_m / sine);
    crossed.map(|plume| plume.extinction_per_m * path_m(plume)).sum()
}

/// Sets, for each layer, a bound of the density of the clump in spray that the beams of a column meet, relative to the mean.
///
/// Neighbouring columns share clumps: nothing happens except at the first of them.
pub(crate) fn bound_clumps(column: usize, layers: usize, noise: Noise, bounds: &mut Vec<f32>) {
    if column.is_multiple_of(CLUMP_COLUMNS) {
        let clump = |layer| noise.uniform(BeamIndex { column, layer, layers }.clump(), Purpose::Plume);
        bounds.clear();
        bounds.extend((0..layers).map(|layer| most_logarithm(clump(layer)) * ROUNDING));
    }
}

/// Returns false if spray surely gives no return on the beam, whose column has this [`greatest_depth`], whose elevation has this cosine,
/// and whose clump has this bound.
///
/// It does not know which plumes the beam crosses, and takes no logarithm: most beams need nothing else.
pub(crate) fn may_return_from_spray(beam: usize, [greatest_depth, cosine, clump]: [f32; 3], noise: Noise) -> bool {
    // −ln u ≥ 2·(1 − u)/(1 + u)
    let depth = noise.uniform(beam, Purpose::Depth);
    (1.0 - depth) * cosine < greatest_depth * clump * (1.0 + depth)
}

/// Returns false if the return from fog on the beam is surely too weak to be detected.
pub(crate) fn may_return_from_fog(beam: usize, link: &LinkBudget, noise: Noise) -> bool {
    let depth = noise.uniform(beam, Purpose::FogDepth);
    let from_m = NEAREST_M + (1.0 - depth) / ((1.0 + depth) * link.extinction_per_m);
    let clump = most_logarithm(noise.uniform(beam, Purpose::FogClump)) * ROUNDING;
    // The light is at most that from the nearest place that it may come from: exp(−x) ≤ 1/(1 + x).
    let unattenuated = power_in_clear_air(link.extinction_per_m * FOG_CLUMPINESS * clump, from_m, link);
    unattenuated > MIN_POWER * (1.0 + 2.0 * link.extinction_per_m * from_m)
}

/// Factor that covers the rounding errors of bounds in single precision.
const ROUNDING: f32 = 1.001;

/// Returns an upper bound of −ln u, for u between 0 and 1, by at most 0.06 too great.
fn most_logarithm(u: f32) -> f32 {
    // The bits of a number, read as an integer, are its exponent and what its mantissa exceeds 1 by, which is at most the logarithm of
    // the mantissa to the base of two.
    const BIAS: f32 = 127.0;
    const MANTISSA: f32 = 8_388_608.0;
    std::f32::consts::LN_2 * (BIAS - u.to_bits() as f32 / MANTISSA)
}

/// Returns the ranges at which a beam enters and leaves a plume (m), or `None` if it does not cross the plume.
fn plume_interval_m([cos, sin, tan]: [f32; 3], faces: FaceRange, targets: &Targets) -> Option<[f32; 2]> {
    let slant = (1.0 + tan * tan).sqrt();
    let along = |face: usize| {
        let inverse = targets.faces[face].inverse;
        inverse[0] * cos + inverse[1] * sin + inverse[2] * tan
    };
    let nearest = faces.front_facing().map(along).fold(1.0 / NEAREST_M, f32::min);
    let farthest = faces.back_facing().map(along).fold(0.0, f32::max);
    (nearest > farthest && farthest > 0.0).then(|| [slant / nearest, slant / farthest])
}

/// Returns the received power from a clump of droplets, in multiples of the detection threshold.
fn soft_power(extinction_per_m: f32, range_m: f32, link: &LinkBudget) -> f32 {
    power_in_clear_air(extinction_per_m, range_m, link) * link.transmission(range_m)
}

/// Returns what [`soft_power`] returns if the air before the clump takes no light.
fn power_in_clear_air(extinction_per_m: f32, range_m: f32, link: &LinkBudget) -> f32 {
    let reflectivity = std::f32::consts::PI * extinction_per_m * PULSE_M / LIDAR_RATIO_SR;
    let square = range_m * range_m;
    let overlap = square / (square + OVERLAP_M * OVERLAP_M);
    link.gain_m2 * reflectivity * overlap / square
}

/// Returns the return from the first clump of fog or rain that the beam hits, or `None` if the air is clear.
fn fog(beam: usize, link: &LinkBudget, noise: Noise) -> Option<SoftEcho> {
    if !link.has_fog() {
        return None;
    }
    let depth = -0.5 * maths::ln(noise.uniform(beam, Purpose::FogDepth));
    let range_m = NEAREST_M + depth / link.extinction_per_m;
    let clump = -maths::ln(noise.uniform(beam, Purpose::FogClump));
    let power = soft_power(link.extinction_per_m * FOG_CLUMPINESS * clump, range_m, link);
    Some(SoftEcho { range_m, power, source: PointSource::Fog })
}
