//! The scanner: turns a scene into a scan, whose points have noise and a time of measurement each.
//!
//! The scan ends at the scene's time, and its sweep takes 14.8 ms. Each solid is frozen at the
//! instant at which the sweep crosses the middle of its vehicle. The error is small: the sweep
//! crosses the width of a vehicle in 0.4 ms at 30 m and in 4 ms at 3 m, and the vehicle moves
//! relative to the ego by millimetres to centimetres in that time.

use closecall_traffic::{Stream, Time};
use fearless_simd::{Level, Simd};

use super::bare_road::{BareRoad, Road, cast_ground};
use super::cast::{ActiveParts, ColumnHits};
use super::ground::ground_reach_m;
use super::kind::Resolution;
use super::noise::Noise;
use super::pattern::{BLOCK_COLUMNS, Pattern};
use super::power::LinkBudget;
use super::rail_returns::RailReturns;
use super::receiver::{Receiver, SensorPoseEstimate};
use super::roadside::PlacedSolid;
use super::soft::{self, Air, AirColumn, ColumnDroplets, Plume};
use super::solid::Solid;
use super::spoil::{Added, Spoiler};
use super::targets::{LayerMask, Targets};
use super::viewpoint::Viewpoint;
use super::{LaneGeometry, Lidar, LidarScan, MirrorSide, ScanTruth};
use crate::Scene;
use crate::faults::LidarFault;

/// The input of a sweep besides the targets. It is kept, so that the latest sweep can be repeated.
#[derive(Clone, Copy, Debug)]
struct Sweep {
    mirror_side: MirrorSide,
    viewpoint: Viewpoint,
    pose: SensorPoseEstimate,
    link: LinkBudget,
    noise: Noise,
    /// What tells the returns of guard rails that the detector would discard; `None` if the sensor
    /// has a fault.
    rails: Option<RailReturns>,
    /// The effect of a fault on the points, and the road if it has guard rails.
    fault: Option<(LidarFault, Option<LaneGeometry>)>,
}

/// The extent of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Extent {
    /// All returns.
    Complete,
    /// All returns, up to the first column that has one.
    UntilFirst,
    /// All returns except returns of the bare road and of guard rails that the detector would
    /// discard.
    WithoutBackground,
}

/// The scanner of the rear LiDAR. It keeps no state from scan to scan except the latest sweep and
/// allocated memory.
#[derive(Clone, Debug)]
pub struct Scanner {
    lidar: Lidar,
    pattern: &'static Pattern,
    /// The vector registers in which a sweep runs.
    level: Level,
    /// Distance up to which the road may give returns (m).
    ground_reach_m: f32,
    targets: Targets,
    plumes: Vec<Plume>,
    /// What [`soft::bound_clumps`] sets.
    clumps: Vec<f32>,
    solids: Vec<Solid>,
    guard_rails: Vec<PlacedSolid>,
    active: ActiveParts,
    hits: ColumnHits,
    droplets: ColumnDroplets,
    scan: LidarScan,
    truth: ScanTruth,
    /// The points that a fault adds.
    added: Vec<Added>,
    latest: Option<Sweep>,
    /// Number of false alarms in the latest scan.
    false_alarms: usize,
    /// The returns of the beams that a monitor looks at, in the latest scan.
    probed: (LidarScan, ScanTruth),
    /// The layers that it looks at; none before the first scan that sees the road.
    road_layers: LayerMask,
}

/// Number of returns for which memory is reserved, of the beams that a monitor looks at.
const PROBED_POINTS: usize = 64;

/// Returns the vector registers of this processor in which a sweep is fastest. AVX-512 gains
/// nothing over AVX2, since all lanes fit into AVX2 registers. It takes longer where it calls
/// functions that use narrower registers.
fn fastest_level() -> Level {
    let widest = Level::new();
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = widest.as_avx2() {
        return Level::Avx2(avx2);
    }
    widest
}

impl Scanner {
    /// Creates a scanner with this configuration.
    pub fn new(lidar: Lidar) -> Self {
        Self {
            lidar,
            pattern: Pattern::shared(lidar.kind),
            level: fastest_level(),
            ground_reach_m: ground_reach_m(&lidar),
            targets: Targets::default(),
            plumes: Vec::new(),
            clumps: Vec::new(),
            solids: Vec::new(),
            guard_rails: Vec::new(),
            active: ActiveParts::default(),
            hits: ColumnHits::new(lidar.kind.layers()),
            droplets: ColumnDroplets::new(lidar.kind.layers()),
            // One return per beam. Unused memory is never touched.
            scan: LidarScan::with_capacity(lidar.kind.beams()),
            truth: ScanTruth { points: Vec::with_capacity(lidar.kind.beams()) },
            added: Vec::new(),
            latest: None,
            false_alarms: 0,
            probed: (LidarScan::with_capacity(PROBED_POINTS), ScanTruth { points: Vec::with_capacity(PROBED_POINTS) }),
            road_layers: 0,
        }
    }

    /// Returns the latest scan, without the points of the bare road and of guard rails that the
    /// detector would discard.
    pub fn latest(&self) -> &LidarScan {
        &self.scan
    }

    /// Returns the ground truth of the latest scan.
    pub fn truth(&self) -> &ScanTruth {
        &self.truth
    }

    /// Adds the points that the latest scan leaves out, and what the sensor reports of all echoes.
    pub fn complete(&mut self) {
        self.scan.echoes.are_noted = true;
        self.repeat(Extent::Complete);
    }

    /// Returns true if the latest scan has no point, not even one of the bare road.
    pub fn is_dark(&mut self) -> bool {
        // A monitor of the output knows how many false alarms to expect.
        if self.scan.len() > self.false_alarms {
            return false;
        }
        let is_spoilt = self.latest.is_some_and(|sweep| sweep.fault.is_some());
        self.repeat(if is_spoilt { Extent::Complete } else { Extent::UntilFirst });
        let is_dark = self.scan.len() <= self.false_alarms;
        self.clear();
        is_dark
    }

    /// Scans the scene. The scan ends at the scene's time. Draws exactly one number from `rng`.
    ///
    /// Points that the detector would discard are left out; see [`Scanner::complete`].
    pub fn scan(&mut self, scene: &Scene<'_>, rng: &mut Stream) -> &LidarScan {
        self.scan_with((scene, &LaneGeometry::from_scene(scene)), rng, None)
    }

    /// Replaces the latest scan by one without points, as of a sensor that is silent. Draws exactly
    /// one number from `rng`.
    pub(crate) fn blank(&mut self, time: Time, rng: &mut Stream) {
        Noise::draw(rng);
        self.clear();
        self.stamp(time);
        self.latest = None;
    }

    /// Keeps the latest scan as the scan at `time`, as of a sensor that is frozen. Draws exactly
    /// one number from `rng`.
    pub(crate) fn hold(&mut self, time: Time, rng: &mut Stream) {
        Noise::draw(rng);
        self.stamp(time);
    }

    /// Scans the scene with a fault of the sensor, as [`Scanner::scan`] does without one. `lane` is
    /// the road that the detector assumes.
    pub(crate) fn scan_with(
        &mut self,
        (scene, lane): (&Scene<'_>, &LaneGeometry),
        rng: &mut Stream,
        fault: Option<&LidarFault>,
    ) -> &LidarScan {
        let drawn = Noise::draw(rng);
        let noise = if self.lidar.is_exact { drawn.silenced() } else { drawn };
        let mirror_side = self.lidar.kind.mirror_side_at(scene.time);
        let actual = fault.map_or(self.lidar, |fault| self.lidar.with_fault(fault));
        let viewpoint = Viewpoint::new(scene, &actual);
        self.collect_targets(scene, mirror_side, &viewpoint);
        let pose = SensorPoseEstimate::new(scene, &self.lidar, noise);
        let link = LinkBudget::new(&actual, scene.environment);
        self.begin(scene.time, mirror_side, &pose, &link);
        // With a fault, a point may be elsewhere than its return. The limits hold for a sensor that
        // looks straight back along a straight road, whatever the map says.
        let is_plain = fault.is_none() && !self.lidar.is_turned() && scene.road.is_straight();
        let rails = if is_plain { RailReturns::new(lane, &link, self.lidar.kind.beam_height_deg) } else { None };
        let fault = fault
            .filter(|fault| fault.changes_points())
            .map(|fault| (*fault, scene.road.has_guard_rails().then(|| LaneGeometry::from_scene(scene))));
        let sweep = Sweep { mirror_side, viewpoint, pose, link, noise, rails, fault };
        self.latest = Some(sweep);
        self.sweep(&sweep, Extent::WithoutBackground);
        self.raise_false_alarms(&sweep);
        self.spoil(&sweep);
        &self.scan
    }

    /// Repeats the latest sweep with another extent.
    fn repeat(&mut self, extent: Extent) {
        if let Some(sweep) = self.latest {
            self.clear();
            self.sweep(&sweep, extent);
            if extent == Extent::UntilFirst {
                self.false_alarms = 0;
            } else {
                self.raise_false_alarms(&sweep);
            }
            self.spoil(&sweep);
        }
    }

    /// Spoils the points of the scan if the sensor has a fault.
    fn spoil(&mut self, sweep: &Sweep) {
        let Some((fault, rails)) = &sweep.fault else { return };
        let spoiler = Spoiler {
            fault,
            noise: sweep.noise.of_faults(),
            pose: &sweep.pose,
            link: &sweep.link,
            pattern: self.pattern,
            mirror_side: sweep.mirror_side,
            rails: rails.as_ref(),
        };
        spoiler.spoil(&mut self.scan, &mut self.truth, &mut self.added);
    }

    /// Sweeps over all columns and appends their returns to the scan.
    fn sweep(&mut self, sweep: &Sweep, extent: Extent) {
        fearless_simd::dispatch!(self.level, simd => self.sweep_in(simd, sweep, extent));
    }

    /// Does what [`Scanner::sweep`] does in one kind of vector registers. The results have the same
    /// bits in all registers: each lane takes the steps of a single sub-ray, and sums over lanes
    /// follow the order of the lanes.
    #[inline(always)]
    fn sweep_in<S: Simd>(&mut self, simd: S, sweep: &Sweep, extent: Extent) {
        let sweep_s = self.sweep_s();
        #[expect(clippy::cast_possible_truncation, reason = "a bound of a metre, with a margin")]
        let max_shift_m = sweep.viewpoint.max_shift_m(sweep_s) as f32;
        let bare_road = BareRoad::new(&self.targets, &sweep.link, sweep.pose, [max_shift_m, self.ground_reach_m]);
        let omitted = bare_road.as_ref().filter(|_| extent == Extent::WithoutBackground);
        let road = Road::new(&self.targets, &sweep.link);
        let in_air = !self.plumes.is_empty() || sweep.link.has_fog();
        let air = Air::new(&sweep.link, sweep.noise);
        self.active.start(&self.targets);
        let columns = self.pattern.columns.len();
        let mut is_block_covered = false;
        let mut next = 0;
        while next < columns {
            let index = next;
            next += 1;
            if index % BLOCK_COLUMNS == 0 {
                let bounds = self.pattern.line_bounds(sweep.mirror_side, index / BLOCK_COLUMNS);
                is_block_covered = omitted.is_some_and(|bare| bare.covers_block(bounds, &road));
            }
            self.active.advance_to(index, &self.targets);
            let parts = self.active.parts();
            if is_block_covered && !in_air && parts.is_empty() {
                next = self.active.idle_until().min(index - index % BLOCK_COLUMNS + BLOCK_COLUMNS);
                continue;
            }
            let column = &self.pattern.columns[index];
            let elevations = self.pattern.elevations(sweep.mirror_side, index);
            let before_end_s = sweep_s - f64::from(column.offset_ns) * 1e-9;
            let pose = || sweep.pose.deskewed(sweep.viewpoint.deskew(before_end_s));
            let is_road_discarded = is_block_covered
                || omitted.is_some_and(|bare| bare.covers(self.pattern.centre_lines(sweep.mirror_side, index), &road));
            let are_rails_discarded = || {
                let are_discarded = |returns: RailReturns| {
                    returns.are_discarded(simd, column, elevations, &pose(), parts, &self.targets)
                };
                !self.active.has_rails() || sweep.rails.is_some_and(are_discarded)
            };
            // Where the detector would discard all returns of the road and of guard rails, those
            // beams are left that may meet something else.
            let solid = match is_road_discarded && are_rails_discarded() {
                true => self.active.solid_layers(),
                false => LayerMask::MAX,
            };
            let with_droplets = if in_air {
                if !self.plumes.is_empty() {
                    soft::bound_clumps(index, elevations.len(), sweep.noise, &mut self.clumps);
                }
                let column_air = AirColumn {
                    first_beam: index * elevations.len(),
                    layers: elevations.len(),
                    greatest_depth: soft::greatest_depth(&self.plumes, index, column.least_sine()),
                    least_cosine: self.pattern.least_cosine,
                    clumps: &self.clumps,
                };
                column_air.layers_with_returns(&air)
            } else {
                0
            };
            if solid | with_droplets == 0 {
                continue;
            }
            let receiver = Receiver {
                column_index: index,
                beams: self.pattern.kind().beams(),
                column,
                elevations,
                pose: pose(),
                targets: &self.targets,
                plumes: &self.plumes,
                air,
                dropout: self.lidar.dropout as f32,
            };
            self.droplets.compute(with_droplets, |layer| receiver.droplet_effect(layer));
            let wanted = solid | self.droplets.detectable;
            if wanted == 0 {
                continue;
            }
            self.hits.clear();
            for &part in parts {
                let part = &self.targets.parts[part];
                self.hits.cast(simd, (column, elevations), (part, wanted), &self.targets);
            }
            cast_ground(simd, (column, elevations), (&self.targets, &road), (omitted, wanted), &mut self.hits);
            let layers = self.hits.need_echoes() & wanted | self.droplets.detectable;
            receiver.receive(simd, &self.hits, &self.droplets, layers, &mut self.scan, &mut self.truth);
            if extent == Extent::UntilFirst && !self.scan.is_empty() {
                return;
            }
        }
    }

    /// Returns the duration of a sweep (s).
    fn sweep_s(&self) -> f64 {
        self.pattern.kind().sweep_ns * 1e-9
    }

    /// Removes all points of the scan.
    fn clear(&mut self) {
        self.scan.clear();
        self.truth.points.clear();
    }

    /// Clears the scan and sets its times and its mirror side.
    fn begin(&mut self, end: Time, mirror_side: MirrorSide, pose: &SensorPoseEstimate, link: &LinkBudget) {
        self.clear();
        self.stamp(end);
        self.scan.mirror_side = mirror_side;
        self.scan.echoes.are_noted = false;
        let (mount_height_m, ground_reach_m) = (self.lidar.mount_height_m, self.ground_reach_m);
        let threshold_per_m2 = 1.0 / f64::from(link.gain_m2);
        self.scan.resolution =
            Resolution { mount_height_m, ground_reach_m, threshold_per_m2, ..self.pattern.kind().resolution };
        (self.scan.sensor_x_m, self.scan.sensor_y_m) = (pose.sensor_x_m(), pose.sensor_y_m());
        self.scan.axis_azimuth_rad = self.lidar.azimuth_rad;
    }

    /// Sets the times of the scan.
    fn stamp(&mut self, end: Time) {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a sweep of the SCALA has 14,777,777 ns, and none more than a second"
        )]
        let sweep = Time::from_ns(self.pattern.kind().sweep_ns as i64);
        self.scan.start = end - sweep;
        self.scan.end = end;
    }
}

mod collect;
mod points;
mod probe;
#[cfg(test)]
mod tests;
