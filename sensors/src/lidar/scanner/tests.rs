use super::super::cast::NO_FACE;
use super::super::cast::by_brute_force;
use super::super::pattern::{Column, Elevation, SUBRAY_COLUMNS, SUBRAY_ROWS, SUBRAYS};
use super::*;

/// Maximum relative difference between a distance in single and in double precision.
const PRECISION: f64 = 2e-5;

/// Returns all kinds of vector registers that this processor has.
fn levels() -> Vec<Level> {
    let best = Level::new();
    #[cfg(target_arch = "x86_64")]
    let narrower =
        [best.as_sse2().map(Level::Sse2), best.as_sse4_2().map(Level::Sse4_2), best.as_avx2().map(Level::Avx2)];
    #[cfg(not(target_arch = "x86_64"))]
    let narrower = [Some(Level::baseline())];
    narrower.into_iter().flatten().chain([best]).collect()
}

impl Scanner {
    /// Returns the scan of this scene, with its ground truth, in each kind of vector registers that
    /// this processor has. All of them draw the same number from the stream.
    pub(crate) fn scans_in_all_registers(&mut self, scene: &Scene<'_>, rng: &Stream) -> Vec<(LidarScan, ScanTruth)> {
        let scan_with = |level: Level| {
            self.level = level;
            self.scan(scene, &mut rng.clone());
            (self.scan.clone(), self.truth.clone())
        };
        levels().into_iter().map(scan_with).collect()
    }

    /// Asserts that all columns of a block whose road counts as ground also count as ground one by
    /// one, in this scene. Returns the number of columns of these blocks, and of all columns that
    /// count as ground.
    pub(crate) fn columns_of_bare_road(&mut self, scene: &Scene<'_>, rng: &mut Stream) -> [usize; 2] {
        self.scan(scene, rng);
        let sweep = self.latest.unwrap();
        let limits_m = [sweep.viewpoint.max_shift_m(self.sweep_s()) as f32, self.ground_reach_m];
        let Some(bare_road) = BareRoad::new(&self.targets, &sweep.link, sweep.pose, limits_m) else { return [0; 2] };
        let road = Road::new(&self.targets, &sweep.link);
        let mut counts = [0; 2];
        for index in 0..self.pattern.columns.len() {
            let bounds = self.pattern.line_bounds(sweep.mirror_side, index / BLOCK_COLUMNS);
            let is_block_covered = bare_road.covers_block(bounds, &road);
            let is_covered = bare_road.covers(self.pattern.centre_lines(sweep.mirror_side, index), &road);
            assert!(is_covered || !is_block_covered, "column {index}");
            counts = [counts[0] + usize::from(is_block_covered), counts[1] + usize::from(is_covered)];
        }
        counts
    }

    /// Asserts that three ray casts of a scene agree: the fast cast, the cast by brute force, and a
    /// cast in double precision that clips a ray at one plane after the other. The first two agree
    /// to the bit. The third may differ at edges.
    pub(crate) fn assert_cast_agrees_with_brute_force(&mut self, scene: &Scene<'_>) {
        let mirror_side = self.lidar.kind.mirror_side_at(scene.time);
        self.collect_targets(scene, mirror_side, &Viewpoint::new(scene, &self.lidar));
        self.active.start(&self.targets);
        let (mut hits, mut differ) = (0, 0);
        for (index, column) in self.pattern.columns.iter().enumerate() {
            let elevations = self.pattern.elevations(mirror_side, index);
            self.hits.clear();
            self.active.advance_to(index, &self.targets);
            for &part in self.active.parts() {
                let part = (&self.targets.parts[part], LayerMask::MAX);
                fearless_simd::dispatch!(Level::new(), simd => self.hits.cast(simd, (column, elevations), part, &self.targets));
            }
            let brute = by_brute_force(column, elevations, &self.targets);
            assert_eq!(self.hits.beams, brute.beams, "column {index}");
            if index % 5 == 0 {
                for layer in 0..elevations.len() {
                    let [rays, differing] = self.compare_exactly(column, elevations, layer);
                    hits += rays;
                    differ += differing;
                }
            }
        }
        assert!(differ <= 2 + hits / 200, "{differ} of {hits}");
    }

    /// Asserts that no return from droplets is missed for not being looked at, in the scan of this
    /// scene with the next random key. Returns the number of these returns, and of beams that are
    /// looked at.
    pub(crate) fn droplet_returns(&mut self, scene: &Scene<'_>, rng: &mut Stream) -> [usize; 2] {
        self.scan(scene, rng);
        let sweep = self.latest.unwrap();
        let air = Air::new(&sweep.link, sweep.noise);
        let mut counts = [0; 2];
        for (index, column) in self.pattern.columns.iter().enumerate() {
            let layers = self.pattern.kind().layers();
            soft::bound_clumps(index, layers, sweep.noise, &mut self.clumps);
            let column_air = AirColumn {
                first_beam: index * layers,
                layers,
                greatest_depth: soft::greatest_depth(&self.plumes, index, column.least_sine()),
                least_cosine: self.pattern.least_cosine,
                clumps: &self.clumps,
            };
            let receiver = Receiver {
                column_index: index,
                beams: self.pattern.kind().beams(),
                column,
                elevations: self.pattern.elevations(sweep.mirror_side, index),
                pose: sweep.pose,
                targets: &self.targets,
                plumes: &self.plumes,
                air,
                dropout: 0.0,
            };
            let [returns, looked_at] = receiver.droplet_returns(column_air.layers_with_returns(&air));
            counts = [counts[0] + returns, counts[1] + looked_at];
        }
        counts
    }

    /// Returns the number of sub-rays of a beam that hit something, and how many of them differ in
    /// double precision.
    fn compare_exactly(&self, column: &Column, elevations: &[Elevation], layer: usize) -> [usize; 2] {
        let group = elevations[layer].group;
        let hits = &self.hits.beams[layer];
        let mut counts = [0; 2];
        for subray in 0..SUBRAYS {
            let (across, upward) = (subray % SUBRAY_COLUMNS, subray / SUBRAY_COLUMNS);
            assert!(upward < SUBRAY_ROWS);
            let direction = [column.cos[group][across], column.sin[group][across], elevations[layer].tan[upward]];
            let exact = self.nearest_m(direction.map(f64::from));
            let quick = (hits.face[subray] != NO_FACE).then(|| 1.0 / f64::from(hits.inverse[subray]));
            counts[0] += usize::from(quick.is_some());
            counts[1] += usize::from(match (quick, exact) {
                (Some(quick), Some(exact)) => (quick / exact - 1.0).abs() > PRECISION * (1.0 + exact),
                (None, None) => false,
                _ => true,
            });
        }
        counts
    }

    /// Returns the distance at which a ray first enters a solid (m), found by clipping it at one
    /// plane after the other.
    fn nearest_m(&self, direction: [f64; 3]) -> Option<f64> {
        let mut nearest: Option<f64> = None;
        for part in &self.targets.parts {
            let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
            let sides = part
                .faces
                .front_facing()
                .map(|face| (face, -1.0))
                .chain(part.faces.back_facing().map(|face| (face, 1.0)));
            for (face, sign) in sides {
                let face = &self.targets.faces[face];
                let offset = sign * f64::from(face.offset_m);
                let along: f64 = face.inverse.iter().zip(direction).map(|(n, d)| f64::from(*n) * offset * d).sum();
                let at = offset / along;
                if along < 0.0 {
                    enter = enter.max(at);
                } else if along > 0.0 {
                    leave = leave.min(at);
                } else if offset < 0.0 {
                    leave = 0.0;
                }
            }
            if enter < leave && enter > 0.0 {
                nearest = Some(nearest.map_or(enter, |other| other.min(enter)));
            }
        }
        nearest
    }
}
