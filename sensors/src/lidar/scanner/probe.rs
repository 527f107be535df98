//! The beams that the road monitor looks at: what they measure, and what a faultless sensor would
//! measure of the road.
//!
//! The sweep leaves the returns of the bare road out, because the detector would discard them. For
//! a few columns they are measured here, with the noise that the complete scan has, and with the
//! faults of the sensor. The faultless sensor has the pose that the ego believes the sensor to
//! have, above a level, dry road of the darkest usual asphalt.

use std::f64::consts::FRAC_1_SQRT_2;

use closecall_traffic::{Environment, maths};
use fearless_simd::Simd;

use super::super::bare_road::{Road, cast_ground};
use super::super::echo::{Echo, Echoes};
use super::super::kind::THRESHOLD_OVER_NOISE;
use super::super::noise::MAX_NORMAL;
use super::super::power::LinkBudget;
use super::super::receiver::Receiver;
use super::super::soft::Air;
use super::super::targets::{Face, LayerMask};
use super::super::{Material, PointSource};
use super::{Scanner, Sweep};
use crate::monitors::{RoadBeam, RoadHeight};

/// Reflectivity of the darkest usual asphalt: worn asphalt has 0.1 to 0.2 (Herold and Roberts
/// 2005, "Spectral characteristics of asphalt road aging and deterioration").
const DARKEST_ASPHALT: f32 = 0.1;
/// Number of layers that are looked at, from the lowest to the highest that sees the road.
const ROAD_LAYERS: usize = 4;
/// Probability of a return with which a layer sees the road.
const SEES: f64 = 0.99;
/// Distance of a return above or below the road up to which it may be a return of the road (m): the
/// underside of most vehicles is higher.
const NEAR_ROAD_M: f32 = 0.3;

impl Scanner {
    /// Writes the beams of these columns of the latest scan into `beams`, the same number for each
    /// column. Writes none before the first scan, and if no layer sees the road.
    pub(crate) fn probe(&mut self, columns: &[usize], environment: &Environment, beams: &mut Vec<RoadBeam>) {
        beams.clear();
        let Some(sweep) = self.latest else { return };
        let faultless = LinkBudget::new(&self.lidar, environment);
        let road = self.expected_road(&sweep);
        if self.road_layers == 0 {
            self.road_layers = self.layers_that_see(&sweep, (&road, &faultless));
        }
        if self.road_layers == 0 {
            return;
        }
        self.measure(&sweep, columns);
        for &column in columns {
            let mut left = self.road_layers;
            while left != 0 {
                let layer = left.trailing_zeros() as usize;
                left &= left - 1;
                beams.push(self.road_beam(&sweep, [column, layer], (&road, &faultless)));
            }
        }
    }

    /// Measures the beams of these columns.
    fn measure(&mut self, sweep: &Sweep, columns: &[usize]) {
        self.swap_probed();
        self.clear();
        self.scan.axis_azimuth_rad = self.lidar.azimuth_rad;
        fearless_simd::dispatch!(self.level, simd => self.measure_in(simd, sweep, columns));
        self.spoil(sweep);
        self.swap_probed();
    }

    /// Exchanges the scan and the returns of the beams that are looked at.
    fn swap_probed(&mut self) {
        std::mem::swap(&mut self.scan, &mut self.probed.0);
        std::mem::swap(&mut self.truth, &mut self.probed.1);
    }

    #[inline(always)]
    fn measure_in<S: Simd>(&mut self, simd: S, sweep: &Sweep, columns: &[usize]) {
        let (sweep_s, wanted) = (self.sweep_s(), self.road_layers);
        let road = Road::new(&self.targets, &sweep.link);
        let air = Air::new(&sweep.link, sweep.noise);
        for &index in columns {
            let column = &self.pattern.columns[index];
            let elevations = self.pattern.elevations(sweep.mirror_side, index);
            let before_end_s = sweep_s - f64::from(column.offset_ns) * 1e-9;
            let receiver = Receiver {
                column_index: index,
                beams: self.pattern.kind().beams(),
                column,
                elevations,
                pose: sweep.pose.deskewed(sweep.viewpoint.deskew(before_end_s)),
                targets: &self.targets,
                plumes: &self.plumes,
                air,
                dropout: self.lidar.dropout as f32,
            };
            self.droplets.compute(0, |layer| receiver.droplet_effect(layer));
            self.hits.clear();
            for part in self.targets.parts.iter().filter(|part| part.columns.contains(&index)) {
                self.hits.cast(simd, (column, elevations), (part, wanted), &self.targets);
            }
            cast_ground(simd, (column, elevations), (&self.targets, &road), (None, wanted), &mut self.hits);
            let layers = self.hits.need_echoes() & wanted;
            receiver.receive(simd, &self.hits, &self.droplets, layers, &mut self.scan, &mut self.truth);
        }
    }

    /// Returns the surface of a level road, as a sensor sees it that is mounted as the ego
    /// believes.
    fn expected_road(&self, sweep: &Sweep) -> Face {
        let height_m = sweep.pose.sensor_z_m();
        Face {
            inverse: sweep.pose.road_inverse(),
            #[cfg(test)]
            offset_m: height_m,
            strength_m: DARKEST_ASPHALT * height_m,
            material: Material::Asphalt,
            source: PointSource::Ground,
        }
    }

    /// Returns the echoes of the road in a beam, which is the beam of `layer` in `column`.
    fn expected_echoes(
        &self,
        sweep: &Sweep,
        [column, layer]: [usize; 2],
        (road, faultless): (&Face, &LinkBudget),
    ) -> Echoes {
        let elevation = &self.pattern.elevations(sweep.mirror_side, column)[layer];
        let mut echoes = Echoes::NONE;
        echoes.set_ground(self.pattern.columns[column].centre[elevation.group], elevation, road, faultless);
        echoes
    }

    /// Returns the layers to look at, as a bit mask.
    fn layers_that_see(&self, sweep: &Sweep, expected: (&Face, &LinkBudget)) -> LayerMask {
        let layers = self.pattern.kind().layers();
        if layers == 1 {
            // The beams of a table look up and down in turn.
            return 1;
        }
        let middle = self.pattern.columns.len() / 2;
        let sees = |layer: &usize| {
            let echoes = self.expected_echoes(sweep, [middle, *layer], expected);
            1.0 - probability_of_none(echoes.as_slice(), 1.0, expected.1) >= SEES
        };
        let (Some(first), Some(last)) = ((0..layers).find(sees), (0..layers).rfind(sees)) else { return 0 };
        let layer = |place: usize| first + (last - first) * place / (ROAD_LAYERS - 1);
        (0..ROAD_LAYERS).fold(0, |mask, place| mask | LayerMask::from(true) << layer(place))
    }

    /// Returns a beam with its expectation.
    fn road_beam(&self, sweep: &Sweep, at: [usize; 2], expected: (&Face, &LinkBudget)) -> RoadBeam {
        let echoes = self.expected_echoes(sweep, at, expected);
        let beam = at[0] * self.pattern.kind().layers() + at[1];
        let returned = self.probed.0.beam.iter().position(|of| usize::from(*of) == beam);
        // Of several echoes, the first may be missed.
        let only = if let [echo] = echoes.as_slice() { Some(echo) } else { None };
        let height = match (only, returned) {
            (Some(echo), Some(point)) => self.road_height(sweep, at, echo, point, expected.1),
            _ => None,
        };
        let kept = 1.0 - self.lidar.dropout;
        let probability = 1.0 - probability_of_none(echoes.as_slice(), kept, expected.1);
        RoadBeam { probability, has_returned: returned.is_some(), tells_height: only.is_some(), height }
    }

    /// Returns the height of a point above the place at which a beam should see the road; `None` if
    /// the point is no return of the road.
    fn road_height(
        &self,
        sweep: &Sweep,
        [column, layer]: [usize; 2],
        echo: &Echo,
        point: usize,
        faultless: &LinkBudget,
    ) -> Option<RoadHeight> {
        let elevation = &self.pattern.elevations(sweep.mirror_side, column)[layer];
        let [cos, sin] = self.pattern.columns[column].centre[elevation.group];
        let [tan, cosine] = elevation.centre;
        let level = echo.range_m * cosine;
        let [ahead_m, _, expected_m] = sweep.pose.ego_frame_point_m([level * cos, level * sin, level * tan]);
        let offset_m = self.probed.0.z_m[point] - expected_m;
        let range_m = f64::from(echo.range_m);
        let sine = f64::from(sweep.pose.sensor_z_m()) / range_m;
        let range_sd_m = f64::from(faultless.range_sd_m(echo.power));
        // The ego pitches about its centre, so an error of the pitch also moves the sensor.
        let levelling_sd_m = f64::from(ahead_m) * self.lidar.levelling_sd_rad;
        let sd_m = maths::hypot(range_sd_m * sine, levelling_sd_m);
        (offset_m.abs() < NEAR_ROAD_M).then_some(RoadHeight { offset_m: offset_m.into(), sd_m, range_m })
    }
}

/// Returns the probability that a faultless sensor, which keeps this share of its returns, detects
/// none of these echoes.
fn probability_of_none(echoes: &[Echo], kept: f64, faultless: &LinkBudget) -> f64 {
    echoes.iter().map(|echo| 1.0 - kept * detection_probability(echo, faultless)).product()
}

/// Returns the probability with which the power of an echo and the noise of the receiver exceed the
/// threshold.
fn detection_probability(echo: &Echo, faultless: &LinkBudget) -> f64 {
    let power = echo.power * faultless.transmission(echo.range_m);
    let above = (power - 1.0) * THRESHOLD_OVER_NOISE;
    if !(above > -MAX_NORMAL) || echo.range_m > faultless.max_range_m {
        0.0
    } else if above >= MAX_NORMAL {
        1.0
    } else {
        0.5 * maths::erfc(-f64::from(above) * FRAC_1_SQRT_2)
    }
}

#[cfg(test)]
mod tests;
