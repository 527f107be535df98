//! Droplets in the air: spray behind vehicles, fog and rain. They attenuate the beams and give
//! false returns.
//!
//! ```text
//!        ┌──────┐ ░ ░ ▒▒        plume: as wide as the vehicle, as long as the distance it drives in 0.25 s
//!   ◀──  │ ego  │▒▒▒▒▒ ░ ░░
//!        └o────o┘▒▒▒▒░▒ ░
//! ```
//!
//! A layer of droplets with extinction α and depth ΔR reflects like a surface of ρ = π·α·ΔR/S,
//! where S is the ratio of extinction to backscatter: 18.8 sr for water droplets at 905 nm
//! (O'Connor, Illingworth and Hogan 2004). ΔR is the length of the pulse. Droplets occur in clumps:
//! the extinction along a beam is exponentially distributed about its mean, and neighbouring
//! columns share the same value.
//!
//! The density of spray has been measured only roughly. The values here are assumptions that
//! reproduce published measurements (Walz et al. 2021, "A benchmark for spray from nearby cutting
//! vehicles"; Linnhoff et al. 2022, "Simulating road spray effects in automotive lidar sensor
//! models"): no spray below 40 to 50 km/h, a strong increase with speed and water, tens to hundreds
//! of false points, most of them within 10 m behind a vehicle.

use std::ops::Range;

use closecall_traffic::{Environment, Vehicle, VehicleClass, maths};
use nalgebra::Isometry3;

use super::echo::PULSE_M;
use super::noise::{LEAST_UNIFORM, Noise, Purpose};
use super::power::{LinkBudget, MIN_POWER};
use super::solid::Solid;
use super::targets::{FaceRange, LayerMask, Targets, layers_below};
use super::{Material, PointSource};

/// Ratio of extinction to backscatter of water droplets at 905 nm (sr).
const LIDAR_RATIO_SR: f32 = 18.8;
/// Speed below which tyres raise no spray (m/s).
const SPRAY_FROM_MPS: f64 = 12.0;
/// Mean extinction in the plume of a car, per mm of water film, at the reference speed (1/m per mm;
/// assumption).
const SPRAY_PER_M_AND_MM: f64 = 0.008;
/// Reference speed (m/s).
const SPRAY_REFERENCE_MPS: f64 = 30.0;
/// Depth of the water film above which more water raises no more spray, because it runs off to the
/// sides (mm; assumption).
const MAX_FILM_MM: f64 = 3.0;
/// Time after which a plume has dispersed (s; assumption).
const PLUME_LIFE_S: f64 = 0.25;
/// Maximum height of a plume (m).
const PLUME_HEIGHT_M: f64 = 1.4;
/// Number of neighbouring columns that share a clump of droplets.
const CLUMP_COLUMNS: usize = 3;
/// Share of the backscatter of fog that varies within the length of a pulse (assumption). The
/// receiver filters out the constant rest.
const FOG_CLUMPINESS: f32 = 0.1;
/// Distance at which the laser beam and the receiver's field of view overlap by half (m;
/// assumption). They overlap fully only beyond some metres.
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
    /// Returns a plume in the shape of a solid, of this mean extinction (1/m), whose pose in the
    /// sensor's frame is given.
    #[expect(clippy::cast_possible_truncation, reason = "bounds of metres")]
    pub(crate) fn new(
        faces: FaceRange,
        columns: Range<usize>,
        solid: &Solid,
        pose: &Isometry3<f64>,
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

    /// Returns the share of the light from `range_m` that the plumes transmit, on the way out and
    /// back.
    pub(crate) fn transmission(&self, range_m: f32) -> f32 {
        if self.optical_depth > 0.0 && range_m > self.near_m { maths::exp(-2.0 * self.optical_depth) } else { 1.0 }
    }
}

/// Returns the plume behind a vehicle, in the vehicle's own frame, and its mean extinction (1/m).
/// Returns `None` if the road is dry or the vehicle slow.
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

    /// Returns the number of the clump of droplets that the beam may meet.
    fn clump(self) -> usize {
        (self.column / CLUMP_COLUMNS) * self.layers + self.layer
    }
}

/// Returns the effect of the droplets on the beam whose centre has this direction.
pub(crate) fn droplet_effect(
    at: BeamIndex,
    centre: [f32; 3],
    plumes: &[Plume],
    targets: &Targets,
    air: &Air<'_>,
) -> DropletEffect {
    let Air { link, noise, .. } = *air;
    let beam = at.beam();
    let fog = link.has_fog().then(|| fog(beam, air));
    let mut effect = DropletEffect { echo: fog, near_m: f32::INFINITY, optical_depth: 0.0 };
    // Logarithms are computed only if needed: not for a beam that crosses no plume, ...
    let (mut clump, mut depth, mut has_echo) = (None, None, false);
    for plume in plumes.iter().filter(|plume| plume.columns.contains(&at.column)) {
        let Some([from, to]) = plume_interval_m(centre, plume.faces, targets) else { continue };
        let clump = *clump.get_or_insert_with(|| -maths::ln(noise.uniform(at.clump(), Purpose::Plume)));
        let extinction = plume.extinction_per_m * clump;
        let before = effect.optical_depth;
        effect.near_m = effect.near_m.min(from);
        effect.optical_depth += extinction * (to - from);
        let depth = *depth.get_or_insert_with(|| noise.uniform(beam, Purpose::Depth));
        // ... nor for one that surely returns no light from this plume, since −ln u ≥ 1 − u.
        if has_echo || 0.5 * (1.0 - depth) >= effect.optical_depth {
            continue;
        }
        let ends_at = -0.5 * maths::ln(depth);
        if ends_at < effect.optical_depth {
            has_echo = true;
            let range_m = from + (ends_at - before) / extinction;
            let echo = SoftEcho { range_m, power: soft_power(extinction, range_m, link), source: PointSource::Spray };
            if effect.echo.is_none_or(|other| range_m < other.range_m) {
                effect.echo = Some(echo);
            }
        }
    }
    effect
}

/// Returns a bound of the optical depth in spray of the beams of a column, for clumps of mean
/// density, times the cosine of their elevation. `sine` is the least sine of their azimuths.
pub(crate) fn greatest_depth(plumes: &[Plume], column: usize, sine: f32) -> f32 {
    let crossed = plumes.iter().filter(|plume| plume.columns.contains(&column));
    // A beam leaves a plume at its sides: the path times the sine is at most the extent across.
    let path_m = |plume: &Plume| plume.longest_m.min(plume.across_m / sine);
    crossed.map(|plume| plume.extinction_per_m * path_m(plume)).sum()
}

/// The effects of droplets on the beams of a column.
#[derive(Clone, Debug, Default)]
pub(crate) struct ColumnDroplets {
    /// Effect on the beam of each layer, if it has been computed.
    effects: Vec<DropletEffect>,
    /// Bit mask of the layers whose effect has been computed.
    computed: LayerMask,
    /// Bit mask of the layers whose beams get a return from droplets that may be detected.
    pub(crate) detectable: LayerMask,
}

impl ColumnDroplets {
    /// Returns the effects for a pattern of so many layers, before they are computed.
    pub(crate) fn new(layers: usize) -> Self {
        let none = DropletEffect { echo: None, near_m: f32::INFINITY, optical_depth: 0.0 };
        Self { effects: vec![none; layers], ..Self::default() }
    }

    /// Computes the effects on the beams of these layers (a bit mask) anew. The other beams must
    /// get no return from droplets that may be detected.
    #[inline(always)]
    pub(crate) fn compute(&mut self, layers: LayerMask, effect: impl Fn(usize) -> DropletEffect) {
        (self.computed, self.detectable) = (layers, 0);
        let mut left = layers;
        while left != 0 {
            let layer = left.trailing_zeros() as usize;
            self.effects[layer] = effect(layer);
            self.detectable |= LayerMask::from(self.effects[layer].is_detectable()) << layer;
            left &= left - 1;
        }
    }

    /// Returns the effect on the beam of a layer, if it has been computed.
    pub(crate) fn computed(&self, layer: usize) -> Option<DropletEffect> {
        (self.computed >> layer & 1 == 1).then(|| self.effects[layer])
    }
}

/// Number of layers that are tested side by side.
const LANES: usize = 8;

/// Fog and rain in the air of a scan, and the random numbers of its beams.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Air<'a> {
    pub(crate) link: &'a LinkBudget,
    pub(crate) noise: Noise,
    /// Least random number of the depth with which fog or rain may give a return that can be
    /// detected: the densest clump that occurs is too far away with any smaller number.
    least_depth: f32,
}

impl<'a> Air<'a> {
    /// Returns the air of a scan.
    pub(crate) fn new(link: &'a LinkBudget, noise: Noise) -> Self {
        // A return is detected from at most the range at which the densest clump, without any loss
        // of light before it, has the least power: see `power_in_clear_air`.
        let densest = most_logarithm(LEAST_UNIFORM) * ROUNDING;
        let at_a_metre = power_in_clear_air(link.extinction_per_m * FOG_CLUMPINESS * densest, 1.0, link);
        let overlap = OVERLAP_M * OVERLAP_M;
        let square = at_a_metre * (1.0 + overlap) / MIN_POWER - overlap;
        let farthest_m = square.max(0.0).sqrt() * ROUNDING;
        // The nearest place that the light may come from, (1 − u)/((1 + u)·α), is beyond it.
        let optical = link.extinction_per_m * (farthest_m - NEAREST_M);
        Self { link, noise, least_depth: (1.0 - optical) / (1.0 + optical) / ROUNDING }
    }

    /// Returns the random number of the depth from which fog or rain returns light on a beam.
    #[inline(always)]
    fn fog_depth(&self, beam: usize) -> f32 {
        self.noise.uniform(beam, Purpose::FogDepth)
    }

    /// Returns false if the return from fog or rain on the beam is surely too weak to be detected.
    #[inline(always)]
    fn may_return_from_fog(&self, beam: usize) -> bool {
        let depth = self.fog_depth(beam);
        depth > self.least_depth && self.may_return_from(beam, depth)
    }

    /// Does what [`Air::may_return_from_fog`] does, for a depth that is not too great.
    #[inline(always)]
    fn may_return_from(&self, beam: usize, depth: f32) -> bool {
        let link = self.link;
        let from_m = NEAREST_M + (1.0 - depth) / ((1.0 + depth) * link.extinction_per_m);
        let clump = most_logarithm(self.noise.uniform(beam, Purpose::FogClump)) * ROUNDING;
        // The light is at most that from the nearest place that it may come from: exp(−x) ≤ 1/(1 +
        // x).
        let unattenuated = power_in_clear_air(link.extinction_per_m * FOG_CLUMPINESS * clump, from_m, link);
        unattenuated > MIN_POWER * (1.0 + 2.0 * link.extinction_per_m * from_m)
    }
}

/// What bounds the returns from droplets on the beams of a column.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AirColumn<'a> {
    /// Number of the lowest beam in the scan.
    pub(crate) first_beam: usize,
    /// Number of layers.
    pub(crate) layers: usize,
    /// See [`greatest_depth`].
    pub(crate) greatest_depth: f32,
    /// Least cosine of the elevation of a beam.
    pub(crate) least_cosine: f32,
    /// See [`bound_clumps`].
    pub(crate) clumps: &'a [f32],
}

impl AirColumn<'_> {
    /// Returns a bit mask of the layers on whose beams droplets may give a return that can be
    /// detected. On the others they surely do not.
    ///
    /// Written without branches, so that the layers are tested side by side in vector registers.
    #[inline(always)]
    pub(crate) fn layers_with_returns(&self, air: &Air<'_>) -> LayerMask {
        let (has_spray, has_fog) = (self.greatest_depth > 0.0, air.link.has_fog());
        if !has_spray && !has_fog {
            return 0;
        }
        let mut mask = 0;
        for first in (0..self.layers).step_by(LANES) {
            let mut may = [false; LANES];
            if has_spray && let Some(clumps) = self.clumps[first..].first_chunk::<LANES>() {
                for (lane, may) in may.iter_mut().enumerate() {
                    let bounds = [self.greatest_depth, self.least_cosine, clumps[lane]];
                    *may = may_return_from_spray(self.first_beam + first + lane, bounds, air.noise);
                }
            }
            if has_fog {
                let beam = |lane| self.first_beam + first + lane;
                let depths: [f32; LANES] = std::array::from_fn(|lane| air.fog_depth(beam(lane)));
                if depths.iter().any(|depth| *depth > air.least_depth) {
                    for (lane, may) in may.iter_mut().enumerate() {
                        *may |= air.may_return_from(beam(lane), depths[lane]);
                    }
                }
            }
            let lanes = may.into_iter().enumerate().fold(0, |lanes, (lane, may)| lanes | u32::from(may) << lane);
            mask |= LayerMask::from(lanes) << first;
        }
        mask & layers_below(self.layers)
    }
}

/// Sets, for each layer, a bound of the density of the clump in spray that the beams of a column
/// meet, relative to the mean. There are bounds for a multiple of [`LANES`] layers; those beyond
/// the pattern mean nothing.
///
/// Neighbouring columns share clumps: nothing happens except at the first of them.
#[inline(always)]
pub(crate) fn bound_clumps(column: usize, layers: usize, noise: Noise, bounds: &mut Vec<f32>) {
    if column.is_multiple_of(CLUMP_COLUMNS) {
        let clump = |layer| noise.uniform(BeamIndex { column, layer, layers }.clump(), Purpose::Plume);
        bounds.clear();
        for first in (0..layers).step_by(LANES) {
            let mut chunk = [0.0; LANES];
            for (lane, bound) in chunk.iter_mut().enumerate() {
                *bound = most_logarithm(clump(first + lane)) * ROUNDING;
            }
            bounds.extend_from_slice(&chunk);
        }
    }
}

/// Returns false if spray surely gives no return on the beam, whose column has this
/// [`greatest_depth`], whose elevation has at least this cosine, and whose clump has this bound.
///
/// It does not know which plumes the beam crosses, and takes no logarithm: most beams need nothing
/// else.
#[inline(always)]
fn may_return_from_spray(beam: usize, [greatest_depth, cosine, clump]: [f32; 3], noise: Noise) -> bool {
    // −ln u ≥ 2·(1 − u)/(1 + u)
    let depth = noise.uniform(beam, Purpose::Depth);
    (1.0 - depth) * cosine < greatest_depth * clump * (1.0 + depth)
}

/// Factor that covers the rounding errors of bounds in single precision.
const ROUNDING: f32 = 1.001;

/// Returns an upper bound of −ln u, for u between 0 and 1, by at most 0.06 too great.
#[inline(always)]
fn most_logarithm(u: f32) -> f32 {
    // The bits of a number, read as an integer, are its exponent and the excess of its mantissa
    // over 1. The excess is at most the logarithm of the mantissa to the base of two.
    const BIAS: f32 = 127.0;
    const MANTISSA: f32 = 8_388_608.0;
    std::f32::consts::LN_2 * (BIAS - u.to_bits() as f32 / MANTISSA)
}

/// Returns the ranges at which a beam enters and leaves a plume (m), or `None` if it does not cross
/// the plume.
fn plume_interval_m([cos, sin, tan]: [f32; 3], faces: FaceRange, targets: &Targets) -> Option<[f32; 2]> {
    let slant = (1.0 + tan * tan).sqrt();
    let along = |[x, y, z]: [f32; 3]| x * cos + y * sin + z * tan;
    let (mut nearest, mut farthest) = (1.0 / NEAREST_M, 0.0);
    for face in &targets.faces[faces.front_facing()] {
        let inverse = along(face.inverse);
        nearest = if inverse < nearest { inverse } else { nearest };
    }
    for face in &targets.faces[faces.back_facing()] {
        let inverse = along(face.inverse);
        farthest = if inverse > farthest { inverse } else { farthest };
    }
    (nearest > farthest && farthest > 0.0).then(|| [slant / nearest, slant / farthest])
}

/// Returns the received power from a clump of droplets, in multiples of the detection threshold.
fn soft_power(extinction_per_m: f32, range_m: f32, link: &LinkBudget) -> f32 {
    power_in_clear_air(extinction_per_m, range_m, link) * link.transmission(range_m)
}

/// Returns what [`soft_power`] returns if the air before the clump takes no light.
#[inline(always)]
fn power_in_clear_air(extinction_per_m: f32, range_m: f32, link: &LinkBudget) -> f32 {
    let reflectivity = std::f32::consts::PI * extinction_per_m * PULSE_M / LIDAR_RATIO_SR;
    let square = range_m * range_m;
    let overlap = square / (square + OVERLAP_M * OVERLAP_M);
    link.gain_m2 * reflectivity * overlap / square
}

/// Returns the return from the first clump of fog or rain that the beam hits.
fn fog(beam: usize, air: &Air<'_>) -> SoftEcho {
    let link = air.link;
    let depth = -0.5 * maths::ln(air.fog_depth(beam));
    let range_m = NEAREST_M + depth / link.extinction_per_m;
    // The power of a return that surely is too weak needs no logarithm.
    let power = || {
        let clump = -maths::ln(air.noise.uniform(beam, Purpose::FogClump));
        soft_power(link.extinction_per_m * FOG_CLUMPINESS * clump, range_m, link)
    };
    let power = if air.may_return_from_fog(beam) { power() } else { 0.0 };
    SoftEcho { range_m, power, source: PointSource::Fog }
}
