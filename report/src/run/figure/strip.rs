//! A road strip: the road from above at one instant, in a frame that moves with the ego.

use closecall_traffic::{Measured, VehicleState, maths};

use super::chart::tick_text;
use super::colours::colour;
use super::svg::{Anchor, Area, Stroke, Svg, TextStyle};
use crate::run::film::{Film, Frame};
use closecall_scenarios::outcome::CRITICAL_THW_S;

pub(super) const ASPHALT: &str = "#e9eaec";
const MARKING: &str = "#9aa0a6";
const BRAKE: &str = "#ff1a1a";
const INDICATOR: &str = "#ffab00";
pub(super) const CRITICAL: &str = "#c40018";
pub(super) const SAFE: &str = "#1a6e2c";
/// Lengths of the dashes and gaps of a lane marking in the picture (px).
const DASH: &str = "9 9";
const SCALE: &str = "#555555";
/// Distance between two marks of the scale (m), and their length in the picture (px).
const MARK_EVERY_M: f64 = 25.0;
const MARK_PX: f64 = 6.0;
/// Length of a gap in the picture from which on its headway has room (px).
const HEADWAY_PX: f64 = 28.0;
/// Width of a letter as a share of the font size.
const LETTER: f64 = 0.6;
/// Height of a letter above and below the line of writing, as shares of the font size.
const ASCENT: f64 = 0.8;
const DESCENT: f64 = 0.25;
/// Distance between a vehicle's body and its label (px).
const BESIDE_PX: f64 = 1.0;
/// Font size of names and headways (px).
const FONT_SIZE_PX: f64 = 10.0;

/// Rear and front end of the visible part of the road, relative to the ego (m).
pub(super) type Reach = [f64; 2];

/// Returns the lateral positions of the left and the right edge of the road (m), which bound the
/// strip.
fn road_edges_m(film: &Film) -> [f64; 2] {
    [0.0, film.road.right_edge_m()]
}

/// A strip that is being drawn.
struct Strip<'a> {
    film: &'a Film,
    frame: &'a Frame,
    area: Area,
    reach: Reach,
}

/// Draws the frame `frame_index` into `area`. The vehicles of `other`, another film of the same
/// sample, appear as outlines.
pub(super) fn draw(svg: &mut Svg, film: &Film, other: Option<&Film>, frame_index: usize, area: Area, reach: Reach) {
    let Some(frame) = film.frames.get(frame_index) else { return };
    let strip = Strip { film, frame, area, reach };
    svg.rect(area, ASPHALT);
    svg.clipped(area, |svg| {
        strip.lanes(svg);
        if let Some(other) = other {
            strip.outlines(svg, other);
        }
        let mut occupied = strip.gaps(svg);
        let present: Vec<usize> = (0..film.actors.len()).filter(|&actor| film.is_present(actor, frame_index)).collect();
        for &actor in &present {
            strip.vehicle(svg, actor);
        }
        strip.labels(svg, &present, &mut occupied);
        if film.worst_collision().is_some_and(|collision| collision.time <= frame.time) {
            strip.impact(svg);
        }
    });
    for mark_m in marks_m(reach) {
        let x = area.left + (mark_m - reach[0]) / (reach[1] - reach[0]) * area.width;
        svg.line([x, area.bottom()], [x, area.bottom() - MARK_PX], Stroke::solid(MARKING, 1.0));
    }
}

/// Writes the distances from the ego at the marks below a strip.
pub(super) fn scale(svg: &mut Svg, area: Area, reach: Reach) {
    let style = |anchor| TextStyle { size: FONT_SIZE_PX, colour: SCALE, anchor };
    for mark_m in marks_m(reach) {
        let x = area.left + (mark_m - reach[0]) / (reach[1] - reach[0]) * area.width;
        svg.text([x, area.bottom() + 12.0], &tick_text(mark_m), style(Anchor::Middle));
    }
    svg.text([area.right() + 8.0, area.bottom() + 12.0], "m from E", style(Anchor::Start));
}

/// Returns the positions of the marks of the scale, relative to the ego (m).
fn marks_m([rear_m, front_m]: Reach) -> impl Iterator<Item = f64> {
    let first = (rear_m / MARK_EVERY_M).ceil();
    (0..).map(move |mark| (first + f64::from(mark)) * MARK_EVERY_M).take_while(move |&mark_m| mark_m <= front_m)
}

/// Returns true if two areas have a common part.
fn overlap(one: Area, other: Area) -> bool {
    one.left < other.right() && other.left < one.right() && one.top < other.bottom() && other.top < one.bottom()
}

impl Strip<'_> {
    /// Returns the picture coordinates of a point in the road frame.
    fn at(&self, s_m: f64, d_m: f64) -> [f64; 2] {
        let ahead_m = s_m - self.frame.states[self.film.ego].s_m;
        let [left_m, right_m] = road_edges_m(self.film);
        let along = (ahead_m - self.reach[0]) / (self.reach[1] - self.reach[0]);
        let across = (left_m - d_m) / (left_m - right_m);
        [self.area.left + along * self.area.width, self.area.top + across * self.area.height]
    }

    /// Draws the lane markings and the edges of the road.
    fn lanes(&self, svg: &mut Svg) {
        let road = &self.film.road;
        let own_m = self.frame.states[self.film.ego].s_m;
        let ends = [own_m + self.reach[0], own_m + self.reach[1]];
        for lane in 1..road.lanes() {
            let stretches_m = if road.has_changing_lanes() { road.stretches_m(ends) } else { vec![ends] };
            for stretch_m in stretches_m {
                let [from, to] = stretch_m.map(|s_m| self.at(s_m, road.full_boundary_m(lane, s_m)));
                svg.line(from, to, Stroke { colour: MARKING, width: 1.0, dash: Some(DASH) });
            }
        }
        for edge in [0, road.lanes()] {
            for stretch_m in road.stretches_m(ends) {
                let [from, to] = stretch_m.map(|s_m| self.at(s_m, road.boundary_at_m(edge, s_m)));
                svg.line(from, to, Stroke::solid(MARKING, 2.5));
            }
        }
    }

    /// Returns the outline of a vehicle's body with its pointed front.
    fn shape(&self, film: &Film, actor: usize, state: &VehicleState) -> [[f64; 2]; 6] {
        let size = &film.actors[actor].vehicle.dimensions;
        let (half_m, side_m) = (0.5 * size.length_m, 0.5 * size.width_m);
        let corner = |[along, across]: [f64; 2]| self.at(state.s_m + along * half_m, state.d_m + across * side_m);
        [[-1.0, -1.0], [0.5, -1.0], [1.0, -0.5], [1.0, 0.5], [0.5, 1.0], [-1.0, 1.0]].map(corner)
    }

    /// Draws the outlines of the vehicles of another film at the same time.
    fn outlines(&self, svg: &mut Svg, other: &Film) {
        let index = other.frames.partition_point(|frame| frame.time <= self.frame.time).saturating_sub(1);
        let Some(frame) = other.frames.get(index) else { return };
        for actor in (0..other.actors.len()).filter(|&actor| other.is_present(actor, index)) {
            let shape = self.shape(other, actor, &frame.states[actor]);
            svg.polygon(&shape, "none", Stroke::solid(colour(other, actor), 1.0));
        }
    }

    /// Draws the body, the brake light and the indicator.
    fn vehicle(&self, svg: &mut Svg, actor: usize) {
        let state = &self.frame.states[actor];
        let shape = self.shape(self.film, actor, state);
        svg.polygon(&shape, colour(self.film, actor), Stroke::solid("#ffffff", 0.6));
        let corner = |along_and_across| self.corner(actor, along_and_across);
        if state.brake_light {
            svg.line(corner([-1.0, -0.9]), corner([-1.0, 0.9]), Stroke::solid(BRAKE, 4.0));
        }
        let side = match state.indicator {
            closecall_traffic::Indicator::Off => None,
            closecall_traffic::Indicator::Left => Some(1.0),
            closecall_traffic::Indicator::Right => Some(-1.0),
        };
        if let Some(side) = side {
            svg.circle(corner([-1.0, side]), 3.0, INDICATOR);
        }
    }

    /// Returns a point of a vehicle in the picture. The coordinates are shares of half the body's
    /// length and width.
    fn corner(&self, actor: usize, [along, across]: [f64; 2]) -> [f64; 2] {
        let (state, size) = (&self.frame.states[actor], &self.film.actors[actor].vehicle.dimensions);
        self.at(state.s_m + along * 0.5 * size.length_m, state.d_m + across * 0.5 * size.width_m)
    }

    /// Writes the name and the speed of the ego, the lead and the rear vehicle in the picture, and
    /// of each vehicle that collides. `occupied` has the areas of other texts. A label covers no
    /// other text, and no body if there is room elsewhere. A label without room is left out.
    fn labels(&self, svg: &mut Svg, present: &[usize], occupied: &mut Vec<Area>) {
        let bodies: Vec<Area> = present.iter().map(|&actor| self.body(actor)).collect();
        let is_other = |actor: &usize| *actor != self.film.ego;
        let is_named = |actor: &usize| self.film.is_labelled(*actor) && overlap(self.body(*actor), self.area);
        let mut named: Vec<usize> = present.iter().copied().filter(is_named).collect();
        named.sort_by_key(is_other);
        for actor in named {
            let text = format!("{} {:.1} m/s", self.film.vehicle_label(actor), self.frame.states[actor].speed_mps);
            let width = LETTER * FONT_SIZE_PX * text.chars().count() as f64;
            let places = self.places(actor, width);
            let is_free = |place: &Area| !occupied.iter().any(|other| overlap(*place, *other));
            let covers_no_body = |place: &Area| !bodies.iter().any(|body| overlap(*place, *body));
            let mut free = places.into_iter().filter(is_free);
            let Some(first) = free.next() else { continue };
            let place = std::iter::once(first).chain(free).find(covers_no_body).unwrap_or(first);
            let style = TextStyle { size: FONT_SIZE_PX, colour: colour(self.film, actor), anchor: Anchor::Middle };
            svg.text([place.left + 0.5 * width, place.top + ASCENT * FONT_SIZE_PX], &text, style);
            occupied.push(place);
        }
    }

    /// Returns the places of a label of this width (px) inside the picture, the best first. The
    /// name of the ego is below its body, and the names of the others are above: a vehicle beside
    /// the ego covers neither. The others' names extend away from the ego, so that the headway has
    /// room.
    fn places(&self, actor: usize, width: f64) -> Vec<Area> {
        let body = self.body(actor);
        let height = (ASCENT + DESCENT) * FONT_SIZE_PX;
        let (above, below) = (body.top - BESIDE_PX - height, body.bottom() + BESIDE_PX);
        let (from_rear, from_front, centred) =
            (body.left, body.right() - width, body.left + 0.5 * (body.width - width));
        let ahead_m = self.frame.states[actor].s_m - self.frame.states[self.film.ego].s_m;
        let (tops, lefts) = match actor == self.film.ego {
            true => ([below, above], [centred, from_rear, from_front]),
            false if ahead_m > 0.0 => ([above, below], [from_rear, centred, from_front]),
            false => ([above, below], [from_front, centred, from_rear]),
        };
        // The name of a vehicle that collides goes a line further away rather than be left out.
        let further = tops.map(|top| if top < body.top { top - height } else { top + height });
        let tops = tops.into_iter().chain(further.into_iter().filter(|_| self.film.collides(actor)));
        let places = tops.flat_map(|top| {
            lefts.map(|left| {
                let left = left.min(self.area.right() - width).max(self.area.left);
                Area { left, top, width, height }
            })
        });
        // In the left lane there may be room only ahead of the body, or behind it.
        let top = body.top + 0.5 * (body.height - height);
        let beside =
            [body.right() + BESIDE_PX, body.left - BESIDE_PX - width].map(|left| Area { left, top, width, height });
        let fits = |place: &Area| place.left >= self.area.left && place.right() <= self.area.right();
        let places = places.chain(beside.into_iter().filter(fits));
        places.filter(|place| place.top >= self.area.top && place.bottom() <= self.area.bottom()).collect()
    }

    /// Returns the area of a vehicle's body.
    fn body(&self, actor: usize) -> Area {
        let ([left, top], [right, bottom]) = (self.corner(actor, [-1.0, 1.0]), self.corner(actor, [1.0, -1.0]));
        Area { left, top, width: right - left, height: bottom - top }
    }

    /// Draws the gaps in front of and behind the ego with their time headways. Returns the areas of
    /// the headways.
    fn gaps(&self, svg: &mut Svg) -> Vec<Area> {
        let (ego, margins) = (&self.frame.states[self.film.ego], &self.frame.margins);
        let half_m = 0.5 * self.film.actors[self.film.ego].vehicle.dimensions.length_m;
        let mut areas = Vec::new();
        let mut draw = |sign: f64, gap_m: Measured, thw_s: Measured| {
            let (Ok(gap_m), Ok(thw_s)) = (gap_m, thw_s) else { return };
            if !(gap_m > 0.0) {
                return;
            }
            let colour = if thw_s < CRITICAL_THW_S { CRITICAL } else { SAFE };
            let ends = [half_m, half_m + gap_m].map(|along_m| self.at(ego.s_m + sign * along_m, ego.d_m));
            svg.line(ends[0], ends[1], Stroke::solid(colour, 2.0));
            // A gap may reach beyond the picture.
            let seen = ends.map(|[x, _]| x.min(self.area.right()).max(self.area.left));
            if (seen[1] - seen[0]).abs() < HEADWAY_PX {
                return;
            }
            let style = TextStyle { size: FONT_SIZE_PX, colour, anchor: Anchor::Middle };
            let [x, y] = [0.5 * (seen[0] + seen[1]), ends[0][1] - 4.0];
            let text = format!("{thw_s:.2} s");
            let width = LETTER * FONT_SIZE_PX * text.chars().count() as f64;
            let (top, height) = (y - ASCENT * FONT_SIZE_PX, (ASCENT + DESCENT) * FONT_SIZE_PX);
            areas.push(Area { left: x - 0.5 * width, top, width, height });
            svg.text([x, y], &text, style);
        };
        draw(1.0, margins.gap_front_m, margins.thw_front_s);
        draw(-1.0, margins.gap_rear_m, margins.thw_rear_s);
        areas
    }

    /// Draws a burst halfway between the two vehicles of the collision.
    fn impact(&self, svg: &mut Svg) {
        let Some(collision) = self.film.worst_collision() else { return };
        let index_of = |name: &str| self.film.actors.iter().position(|actor| actor.name == name);
        let ends = collision.between.each_ref().map(|id| index_of(id.as_str()));
        let [Some(first), Some(second)] = ends else { return };
        let [a, b] = [first, second].map(|actor| {
            let state = &self.frame.states[actor];
            self.at(state.s_m, state.d_m)
        });
        let [x, y] = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        const SPIKES: i32 = 8;
        let burst: Vec<[f64; 2]> = (0..2 * SPIKES)
            .map(|spike| {
                let (sin, cos) = maths::sin_cos(std::f64::consts::PI * f64::from(spike) / f64::from(SPIKES));
                let radius = if spike % 2 == 0 { 13.0 } else { 6.0 };
                [x + radius * cos, y + radius * sin]
            })
            .collect();
        svg.polygon(&burst, "#ffd400", Stroke::solid(CRITICAL, 1.5));
    }
}
