//! The road from above at one instant, in a frame that goes along with E.

use closecall_traffic::{Lane, Measured};

use super::colours::colour;
use super::svg::{Anchor, Area, Letters, Stroke, Svg};
use crate::run::film::{Film, Frame};
use closecall_simulation::outcome::CRITICAL_THW_S;

const ASPHALT: &str = "#e9eaec";
const MARKING: &str = "#9aa0a6";
const BRAKE: &str = "#ff1a1a";
const INDICATOR: &str = "#ffab00";
const CRITICAL: &str = "#c40018";
const SAFE: &str = "#1e7d32";
/// Length of dash and gap of a lane marking in the picture [px].
const DASH: &str = "9 9";
/// Letters of names and headways [px].
const LETTERS: f64 = 10.0;

/// What is shown behind E and ahead of it [m].
pub(super) type Reach = [f64; 2];

/// The lanes that any vehicle drives in, widened by nothing: where the picture's rows are [m], from the left edge.
fn rows_m(film: &Film) -> [f64; 2] {
    [0.0, film.road.right_edge_m()]
}

/// A strip in the making.
struct Strip<'a> {
    film: &'a Film,
    frame: &'a Frame,
    area: Area,
    reach: Reach,
}

/// Draws a frame into `area`.
pub(super) fn draw(svg: &mut Svg, film: &Film, row: usize, (area, reach): (Area, Reach)) {
    let Some(frame) = film.frames.get(row) else { return };
    let strip = Strip { film, frame, area, reach };
    svg.rect(area, ASPHALT);
    svg.clipped(area, |svg| {
        strip.lanes(svg);
        strip.gaps(svg);
        for actor in (0..film.cast.len()).filter(|&actor| film.is_there(actor, row)) {
            strip.vehicle(svg, actor);
        }
        if film.worst_collision().is_some_and(|collision| collision.time <= frame.time) {
            strip.impact(svg);
        }
    });
}

impl Strip<'_> {
    fn at(&self, s_m: f64, d_m: f64) -> [f64; 2] {
        let ahead_m = s_m - self.frame.states[self.film.ego].s_m;
        let [left_m, right_m] = rows_m(self.film);
        let along = (ahead_m - self.reach[0]) / (self.reach[1] - self.reach[0]);
        let across = (left_m - d_m) / (left_m - right_m);
        [self.area.left + along * self.area.width, self.area.top + across * self.area.height]
    }

    fn lanes(&self, svg: &mut Svg) {
        let road = &self.film.road;
        let own_m = self.frame.states[self.film.ego].s_m;
        let ends = [own_m + self.reach[0], own_m + self.reach[1]];
        for lane in 1..road.lanes() {
            let d_m = road.lane_centre_m(Lane(lane)) - 0.5 * road.lane_width_m();
            let stroke = Stroke { colour: MARKING, width: 1.0, dash: Some(DASH) };
            svg.line(self.at(ends[0], d_m), self.at(ends[1], d_m), stroke);
        }
        for d_m in rows_m(self.film) {
            svg.line(self.at(ends[0], d_m), self.at(ends[1], d_m), Stroke::solid(MARKING, 2.5));
        }
    }

    /// The body with its arrow-like front, its brake light, its indicator and its name.
    fn vehicle(&self, svg: &mut Svg, actor: usize) {
        let (state, member) = (&self.frame.states[actor], &self.film.cast[actor]);
        let (half_m, side_m) = (0.5 * member.vehicle.dimensions.length_m, 0.5 * member.vehicle.dimensions.width_m);
        let corner = |[along, across]: [f64; 2]| self.at(state.s_m + along * half_m, state.d_m + across * side_m);
        let shape = [[-1.0, -1.0], [0.5, -1.0], [1.0, -0.5], [1.0, 0.5], [0.5, 1.0], [-1.0, 1.0]].map(corner);
        let paint = colour(actor, self.film.ego);
        svg.polygon(&shape, paint, Stroke::solid("#ffffff", 0.6));
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
        let [x, _] = corner([0.0, 0.0]);
        // E's name stands below, the others' above: who passes does not cover it.
        let y = if actor == self.film.ego { corner([0.0, -1.0])[1] + 11.0 } else { corner([0.0, 1.0])[1] - 3.0 };
        let letters = Letters { size: LETTERS, colour: paint, anchor: Anchor::Middle };
        svg.text([x, y], &format!("{} {:.1} m/s", member.name, state.speed_mps), letters);
    }

    /// The gaps before and behind E with their headways.
    fn gaps(&self, svg: &mut Svg) {
        let (own, margins) = (&self.frame.states[self.film.ego], &self.frame.margins);
        let half_m = 0.5 * self.film.cast[self.film.ego].vehicle.dimensions.length_m;
        let mut draw = |sign: f64, gap_m: Measured, thw_s: Measured| {
            let (Ok(gap_m), Ok(thw_s)) = (gap_m, thw_s) else { return };
            if !(gap_m > 0.0) {
                return;
            }
            let colour = if thw_s < CRITICAL_THW_S { CRITICAL } else { SAFE };
            let ends = [half_m, half_m + gap_m].map(|along_m| self.at(own.s_m + sign * along_m, own.d_m));
            svg.line(ends[0], ends[1], Stroke::solid(colour, 2.0));
            let letters = Letters { size: LETTERS, colour, anchor: Anchor::Middle };
            let middle = [0.5 * (ends[0][0] + ends[1][0]), ends[0][1] - 4.0];
            svg.text(middle, &format!("{thw_s:.2} s"), letters);
        };
        draw(1.0, margins.gap_front_m, margins.thw_front_s);
        draw(-1.0, margins.gap_rear_m, margins.thw_rear_s);
    }

    /// A burst where the first of the two that collided is.
    fn impact(&self, svg: &mut Svg) {
        let Some(collision) = self.film.worst_collision() else { return };
        let of = |name: &str| self.film.cast.iter().position(|member| member.name == name);
        let ends = collision.between.each_ref().map(|id| of(id.as_str()));
        let [Some(first), Some(second)] = ends else { return };
        let [a, b] = [first, second].map(|actor| {
            let state = &self.frame.states[actor];
            self.at(state.s_m, state.d_m)
        });
        let [x, y] = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        const SPIKES: i32 = 8;
        let burst: Vec<[f64; 2]> = (0..2 * SPIKES)
            .map(|spike| {
                let (sin, cos) = (std::f64::consts::PI * f64::from(spike) / f64::from(SPIKES)).sin_cos();
                let radius = if spike % 2 == 0 { 13.0 } else { 6.0 };
                [x + radius * cos, y + radius * sin]
            })
            .collect();
        svg.polygon(&burst, "#ffd400", Stroke::solid(CRITICAL, 1.5));
    }
}
