//! The ground: the road surface with its markings, the verge, and the shadows and headlamp beams of
//! vehicles on it.
//!
//! The markings follow German practice for motorways: edge lines are 0.30 m wide, lane lines are
//! 0.15 m wide and dashed, with dashes of 6 m every 18 m.

use closecall_traffic::{Road, maths};

use super::bounds::Bounds;
use super::hash::{PlaneNoise, split};
use super::light::Illumination;
use super::mesh::{Vec3, each};

mod course;
mod lanes;
use course::GroundCourse;
pub(crate) use lanes::{GroundNoise as GroundNoiseLanes, GroundRow};

const EDGE_LINE_HALF_M: f32 = 0.15;
const LANE_LINE_HALF_M: f32 = 0.075;
const DASH_M: f32 = 6.0;
const DASH_EVERY_M: f32 = 18.0;
/// The distances at which dashes begin to merge into a uniform grey line and at which they have
/// merged (m), because a pixel row then spans several of them.
const DASHES_MERGE_M: [f32; 2] = [60.0, 110.0];
/// Widths of the paved shoulder left of the leftmost lane and right of the rightmost lane (m).
const SHOULDER_M: [f32; 2] = [1.3, 2.6];
/// Distance beyond which the grain of the asphalt is finer than a pixel (m).
const GRAIN_TO_M: f32 = 50.0;
const ASPHALT: Vec3 = [0.105, 0.105, 0.108];
const PAINT: Vec3 = [0.62, 0.62, 0.60];
const GRASS: Vec3 = [0.075, 0.11, 0.035];
const GRASS_KEY: u64 = 0x0067_7261_7373;
const ASPHALT_KEY: u64 = 0x6173_7068;
/// Slope above the horizon of the part of the sky that a wet road mirrors (-).
const MIRRORED_SLOPE: f32 = 0.02;
/// Share of the sky's light under a vehicle (-).
const DARKEST: f32 = 0.12;
/// Least vertical part of the direction to the sun, which bounds the length of shadows (-).
const LEAST_SUN: f32 = 0.05;

/// The road surface as seen from one position of the lens.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    /// Position of the lens in road coordinates (s, d) (m), with s modulo the period of the
    /// textures.
    s_m: f32,
    d_m: f32,
    /// Cosine and sine of the ego's heading relative to the road.
    cos: f32,
    sin: f32,
    curvature_per_m: f32,
    /// The line of a road with an alignment, which `curvature_per_m` does not describe.
    course: Option<GroundCourse>,
    lanes: GroundLanes,
}

/// The lanes whose markings are on the ground.
#[derive(Clone, Debug)]
enum GroundLanes {
    /// Lanes of one width (m).
    Equal { width_m: f32, lanes: f32 },
    /// The lateral positions of the markings from the left edge on (m), and the number of the last one.
    Each { markings_m: [f32; MOST_MARKINGS], last: usize },
    /// The same at places along the road about the lens, between which the markings are lines, and the
    /// right edge of the road (m).
    Along { places: Vec<[f32; MOST_MARKINGS]>, last: usize, right_m: f32 },
}

/// Distance between two places of the markings (m). A marking with a kink between two of them deviates
/// by a quarter of the kink per metre: 6 cm where an acceleration lane ends.
const PLACE_EVERY_M: f32 = 4.0;
/// Number of places on each side of the lens: to the end of the ground.
const PLACES_REACH: usize = 88;
const PLACES: usize = 2 * PLACES_REACH + 1;
const _: () = assert!(PLACE_EVERY_M * PLACES_REACH as f32 >= GROUND_TO_M);

/// Largest number of markings along a road.
const MOST_MARKINGS: usize = 9;

impl GroundLanes {
    /// Creates the lanes about a lens at `s_m`.
    fn new(road: &Road, s_m: f64) -> Self {
        let markings_at = |s_m: f64| {
            let marking_m = |number: usize| road.full_boundary_m(u8::try_from(number).unwrap_or(u8::MAX), s_m) as f32;
            std::array::from_fn(marking_m)
        };
        let last = road.lanes().into();
        match road.equal_lane_width_m() {
            Some(width_m) => Self::Equal { width_m: width_m as f32, lanes: f32::from(road.lanes()) },
            None if road.has_changing_lanes() => {
                let at_m = |place: usize| s_m + f64::from(PLACE_EVERY_M) * (place as f64 - PLACES_REACH as f64);
                let places = (0..PLACES).map(|place| markings_at(at_m(place))).collect();
                Self::Along { places, last, right_m: road.right_edge_m() as f32 }
            }
            None => Self::Each { markings_m: markings_at(s_m), last },
        }
    }

    /// Returns the lateral position of the right edge (m).
    fn right_m(&self) -> f32 {
        match self {
            Self::Equal { width_m, lanes } => -lanes * width_m,
            Self::Each { markings_m, last } => markings_m[*last],
            Self::Along { right_m, .. } => *right_m,
        }
    }

    /// Returns the distance from the nearest marking (m), and whether it is an edge line. `ahead` is
    /// the distance along the road from the lens (m).
    fn nearest_marking(&self, ahead: f32, d: f32) -> (f32, bool) {
        match self {
            Self::Equal { width_m, lanes } => {
                let line = (split(-d / width_m + 0.5).0 as f32).clamp(0.0, *lanes);
                ((d + line * width_m).abs(), line == 0.0 || line == *lanes)
            }
            Self::Each { markings_m, last } => {
                let mut nearest = (f32::INFINITY, false);
                for (number, marking_m) in markings_m[..=*last].iter().enumerate() {
                    let off = (d - marking_m).abs();
                    if off < nearest.0 {
                        nearest = (off, number == 0 || number == *last);
                    }
                }
                nearest
            }
            Self::Along { places, last, .. } => {
                let place = (ahead / PLACE_EVERY_M + PLACES_REACH as f32).clamp(0.0, (PLACES - 1) as f32);
                let (from, share) = split(place);
                #[expect(clippy::cast_sign_loss, reason = "clamped to the places")]
                let from = (from as usize).min(PLACES - 2);
                let share = if place >= (PLACES - 1) as f32 { 1.0 } else { share };
                let mut nearest = (f32::INFINITY, false);
                for (number, (before_m, behind_m)) in
                    places[from].iter().zip(&places[from + 1]).take(last + 1).enumerate()
                {
                    let off = (d - (before_m + (behind_m - before_m) * share)).abs();
                    // Where a lane has no width, its edge line is the marking.
                    let is_edge = number == 0 || number == *last;
                    if off < nearest.0 || (is_edge && off == nearest.0) {
                        nearest = (off, is_edge);
                    }
                }
                nearest
            }
        }
    }
}

/// A shadow or a headlamp beam that one vehicle casts on the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// Position of the vehicle in the ground frame (m).
    pub(crate) at: [f32; 2],
    /// Cosine and sine of the vehicle's heading in the ground frame.
    pub(crate) turn: [f32; 2],
    /// Half length, half width and height of the vehicle (m).
    pub(crate) extent: Vec3,
    /// Effect on the ground.
    pub(crate) kind: PatchKind,
}

/// The effect of a vehicle on the light that reaches the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PatchKind {
    /// The vehicle hides part of the sky and the sun.
    Shadow,
    /// The vehicle's headlamps illuminate the road ahead of it.
    Beam,
}

/// Extent of the contact shadow beyond the vehicle's box (m).
pub(crate) const CONTACT_SHADOW_M: f32 = 0.6;
/// Maximum length of a shadow cast by the sun (m).
pub(crate) const LONGEST_SHADOW_M: f32 = 8.0;
/// Range of the headlamps on the road, and their maximum reach to each side (m).
pub(crate) const BEAM_M: [f32; 2] = [45.0, 8.0];

/// The noise of grass and asphalt, with its latest cells.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GroundNoise {
    grass: PlaneNoise,
    grain: PlaneNoise,
    wear: PlaneNoise,
}

/// The light that may reach the ground that a pixel shows.
#[derive(Clone, Copy)]
pub(crate) struct GroundLight<'a> {
    pub(crate) light: &'a Illumination,
    /// Shadows and beams of the pixel's row, with their bounds in the image. They have no effect
    /// outside of these.
    pub(crate) patches: &'a [(Bounds, Patch)],
    /// Left edge of the pixel (px).
    pub(crate) left_px: f32,
}

/// The combined effect of all patches on one point of the ground: the visible shares of sky and
/// sun, and the added light of headlamps.
struct PatchLight {
    sky: f32,
    sun: f32,
    beam: f32,
}

impl Ground {
    /// Creates the surface of `road` for a lens at (`s_m`, `d_m`) in a vehicle with this heading
    /// relative to the road.
    pub(crate) fn new(road: &Road, s_m: f64, d_m: f64, heading_rad: f64) -> Self {
        /// Period at which s is wrapped to keep numbers small (m): a multiple of the periods of
        /// dashes and textures.
        const PERIOD_M: f64 = 18.0 * 512.0;
        Self {
            s_m: s_m.rem_euclid(PERIOD_M) as f32,
            d_m: d_m as f32,
            cos: maths::cos(heading_rad) as f32,
            sin: maths::sin(heading_rad) as f32,
            curvature_per_m: road.constant_curvature_per_m().unwrap_or(f64::NAN) as f32,
            course: road.alignment().map(|_| GroundCourse::new(road, s_m, d_m)),
            lanes: GroundLanes::new(road, s_m),
        }
    }

    /// Returns the road coordinates (s, d) (m) of the point (x, y) of the ground frame.
    ///
    /// The reference line is a circle of curvature κ that touches the X axis. Then d = −q/(1 +
    /// √(1 + κ·q)) for q = κ·(X² + Y²) − 2·Y, which stays exact as κ → 0. The arc length s follows
    /// from X/(1 − κ·Y) to third order, which suffices because it only positions dashes and
    /// textures.
    fn road_position(&self, x: f32, y: f32) -> (f32, f32) {
        let along = self.cos * x - self.sin * y;
        let across = self.d_m + self.sin * x + self.cos * y;
        if let Some(course) = &self.course {
            let [ahead_m, d] = course.position_m(along, across - self.d_m);
            return (self.s_m + ahead_m, d);
        }
        let k = self.curvature_per_m;
        if k == 0.0 {
            // What follows then gives the same bits.
            return (self.s_m + along, across);
        }
        let q = k * (along * along + across * across) - 2.0 * across;
        let d = -q / (1.0 + (1.0 + k * q).max(0.0).sqrt());
        let tangent = along / (1.0 - k * across);
        let bend = k * tangent;
        (self.s_m + tangent * (1.0 - bend * bend / 3.0), d)
    }

    /// Returns the radiance of the ground at the point (x, y) of the ground frame, after the ego
    /// has moved by `travelled_m` along s.
    pub(crate) fn radiance(
        &self,
        [x, y]: [f32; 2],
        travelled_m: f32,
        lit: &GroundLight<'_>,
        noise: &mut GroundNoise,
    ) -> Vec3 {
        let light = lit.light;
        let (s, d) = self.road_position(x, y);
        let s = s + travelled_m;
        let run = -x;
        let (albedo, gloss) = self.albedo([s, d], run, light.wetness, noise);
        let cast = patch_light(lit, [x, y]);
        let up = light.to_sun[2].max(0.0);
        let mirrored = light.sky(MIRRORED_SLOPE);
        each(|channel| {
            let illumination =
                light.ambient[channel] * cast.sky + light.sun[channel] * up * cast.sun + light.beam * cast.beam;
            albedo[channel] * illumination + gloss * cast.sky * mirrored[channel]
        })
    }

    /// Returns the reflectance, and the share of the sky's light that a wet surface mirrors. `run`
    /// is the horizontal distance from the lens (m).
    fn albedo(&self, [s, d]: [f32; 2], run: f32, wetness: f32, noise: &mut GroundNoise) -> (Vec3, f32) {
        let right = self.lanes.right_m();
        // The texture fades with distance, as a pixel spans more than one of its cells.
        let detail = 1.0 / (1.0 + run * run / 400.0);
        if d > SHOULDER_M[0] || d < right - SHOULDER_M[1] {
            let shade = 0.75 + 0.5 * noise.grass.at(GRASS_KEY, 0.7 * s, 1.3 * d) * (0.3 + 0.7 * detail);
            return (GRASS.map(|value| value * shade), 0.0);
        }
        // A wet surface is darker, and reflects the sky at grazing angles.
        let gloss = wetness * (run / (run + 25.0)) * 0.55;
        let dark = 1.0 - 0.45 * wetness;
        let painted = self.paint_share(s, d, run);
        let grain = if run < GRAIN_TO_M {
            1.0 + 0.35 * (noise.grain.at(ASPHALT_KEY, 9.0 * s, 9.0 * d) - 0.5) * detail
        } else {
            1.0
        };
        let wear = 1.0 - 0.12 * noise.wear.at(ASPHALT_KEY, 0.05 * s, 0.8 * d);
        let albedo = each(|i| (ASPHALT[i] + (PAINT[i] - ASPHALT[i]) * painted) * grain * wear * dark);
        (albedo, gloss)
    }

    /// Returns the share of the surface at this position that is covered by paint (0 to 1).
    fn paint_share(&self, s: f32, d: f32, run: f32) -> f32 {
        let (off, is_edge) = self.lanes.nearest_marking(s - self.s_m, d);
        if is_edge {
            return if off < EDGE_LINE_HALF_M { 1.0 } else { 0.0 };
        }
        if off >= LANE_LINE_HALF_M {
            return 0.0;
        }
        let phase = split(s / DASH_EVERY_M).1 * DASH_EVERY_M;
        let dash = if phase < DASH_M { 1.0 } else { 0.0 };
        let merged = ((run - DASHES_MERGE_M[0]) / (DASHES_MERGE_M[1] - DASHES_MERGE_M[0])).clamp(0.0, 1.0);
        dash + (DASH_M / DASH_EVERY_M - dash) * merged
    }
}

fn patch_light(lit: &GroundLight<'_>, at: [f32; 2]) -> PatchLight {
    let light = lit.light;
    let mut cast = PatchLight { sky: 1.0, sun: 1.0, beam: 0.0 };
    for (bounds, patch) in lit.patches {
        if lit.left_px > bounds[2] || lit.left_px + 1.0 < bounds[0] {
            continue;
        }
        let [cos, sin] = patch.turn;
        let (dx, dy) = (at[0] - patch.at[0], at[1] - patch.at[1]);
        let (along, left) = (cos * dx + sin * dy, cos * dy - sin * dx);
        match patch.kind {
            PatchKind::Shadow => {
                cast.sky *= contact(patch, along, left);
                if light.sun[0] > 0.0 && in_sun_shadow(patch, [along, left], light.to_sun) {
                    cast.sun = 0.0;
                }
            }
            PatchKind::Beam => cast.beam += headlamp_beam(along - patch.extent[0], left),
        }
    }
    cast
}

/// Returns the share of the sky's light that reaches the ground under and beside a vehicle.
fn contact(patch: &Patch, along: f32, left: f32) -> f32 {
    let outside = (along.abs() - patch.extent[0]).max(left.abs() - patch.extent[1]).max(0.0);
    let open = (outside / CONTACT_SHADOW_M).min(1.0);
    DARKEST + (1.0 - DARKEST) * open * (2.0 - open)
}

/// Returns `true` if the line from the ground to the sun passes through the vehicle's box.
fn in_sun_shadow(patch: &Patch, [along, left]: [f32; 2], to_sun: Vec3) -> bool {
    let reach = (patch.extent[2] / to_sun[2].max(LEAST_SUN)).min(LONGEST_SHADOW_M);
    let (mut from, mut to) = (0.0_f32, reach);
    for (start, (rate, half)) in [along, left].into_iter().zip(ways(patch, to_sun)) {
        let (a, b) = ((-half - start) / rate, (half - start) / rate);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    from < to
}

/// Returns for the axes along and across a vehicle how fast the way to the sun leads along it,
/// never 0, and half the extent that casts a shadow (m).
fn ways(patch: &Patch, to_sun: Vec3) -> [(f32, f32); 2] {
    let [cos, sin] = patch.turn;
    let way = [cos * to_sun[0] + sin * to_sun[1], cos * to_sun[1] - sin * to_sun[0]];
    let [along, across] = way.map(|rate| if rate.abs() < 1e-6 { 1e-6 } else { rate });
    [(along, patch.extent[0]), (across, 0.92 * patch.extent[1])]
}

/// Returns the light of a pair of dipped headlamps on the road, `ahead` of them and to their `left`
/// (m), in units of [`Illumination::beam`].
fn headlamp_beam(ahead: f32, left: f32) -> f32 {
    let [far, wide] = BEAM_M;
    if !(ahead > 0.0 && ahead < far) {
        return 0.0;
    }
    let half = (1.5 + 0.15 * ahead).min(wide);
    let across = 1.0 - (left / half) * (left / half);
    if across <= 0.0 {
        return 0.0;
    }
    let along = (1.0 - ahead / far) * (1.0 - ahead / far) * ahead / (ahead + 3.0);
    along * across * across
}

/// Distance at which the ground ends in woods (m).
pub(super) const GROUND_TO_M: f32 = 350.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn road_coordinates_agree_with_the_road_model() {
        let road = Road::straight(3).with_curvature(0.002);
        let (s0, d0, heading) = (640.0, -5.6, 0.02);
        let ground = Ground::new(&road, s0, d0, heading);
        let lens = road.plane_pose(s0, d0, heading);
        for (x, y) in [(-10.0, 1.0), (-60.0, -4.0), (-120.0, 3.0)] {
            let (sin, cos) = maths::sin_cos(lens.yaw_rad);
            let plane = (lens.x_m + cos * x - sin * y, lens.y_m + sin * x + cos * y);
            let (s, d) = road.road_position_m(plane.0, plane.1, s0);
            let (got_s, got_d) = ground.road_position(x as f32, y as f32);
            assert!((f64::from(got_d) - d).abs() < 0.01, "{got_d} {d}");
            assert!((f64::from(got_s) - s).abs() < 0.1, "{got_s} {s}");
        }
    }

    #[test]
    fn edge_lines_are_solid_and_lane_lines_are_dashed() {
        let ground = Ground::new(&Road::straight(3), 0.0, -5.6, 0.0);
        assert_eq!(ground.paint_share(3.0, 0.0, 10.0), 1.0);
        assert_eq!(ground.paint_share(3.0, -11.25, 10.0), 1.0);
        assert_eq!(ground.paint_share(3.0, -3.75, 10.0), 1.0);
        assert_eq!(ground.paint_share(9.0, -3.75, 10.0), 0.0);
        assert_eq!(ground.paint_share(3.0, -1.9, 10.0), 0.0);
    }

    #[test]
    fn the_markings_lie_at_the_edges_of_lanes_of_their_own_widths() {
        let ground = Ground::new(&Road::straight(3).with_lane_widths(&[3.25, 3.5, 4.0]), 0.0, -5.0, 0.0);
        for (d, expected) in [(0.0, 1.0), (-3.25, 1.0), (-3.5, 0.0), (-6.75, 1.0), (-7.0, 0.0), (-10.75, 1.0)] {
            assert_eq!(ground.paint_share(3.0, d, 10.0), expected, "{d}");
        }
        // The lane lines are dashed and narrow, the edge lines solid and wide.
        let between_dashes = [0.0, -3.25, -6.75, -10.75].map(|d| ground.paint_share(9.0, d, 10.0));
        assert_eq!(between_dashes, [1.0, 0.0, 0.0, 1.0]);
        assert_eq!([-0.1, -3.35].map(|d| ground.paint_share(3.0, d, 10.0)), [1.0, 0.0]);
        assert_eq!(ground.lanes.right_m(), -10.75);
    }

    #[test]
    fn a_shadow_falls_on_the_side_away_from_the_sun() {
        let patch = Patch { at: [0.0; 2], turn: [1.0, 0.0], extent: [2.3, 0.9, 1.5], kind: PatchKind::Shadow };
        let to_sun = [0.0, 0.8, 0.6];
        assert!(in_sun_shadow(&patch, [0.0, -1.5], to_sun));
        assert!(!in_sun_shadow(&patch, [0.0, 1.5], to_sun));
    }
}
