//! The design point: the failing point of standard normal space that is nearest to the origin.
//!
//! ```text
//!  z₂ │      ╲ fails
//!     │  ●····╲···◆ start     1. along the ray: the first failing point
//!     │   ╲    ╲              2. along the normal of the boundary there
//!     │    ●◀───● ╲           3. beside it, at random
//!     └──────────────▶ z₁     4. without each coordinate that is not needed
//! ```
//!
//! The distance of the design point to the origin is the reliability index β (A. M. Hasofer and
//! N. C. Lind, *Exact and invariant second-moment code format*, Journal of the Engineering
//! Mechanics Division, ASCE, 100 (1974) 111–121). The usual search is the iteration of Hasofer,
//! Lind, Rackwitz and Fiessler, which needs a limit state function that has a gradient. A run says
//! only whether a point fails. The iteration here therefore estimates the normal of the
//! boundary from the places at which rays beside the present one cross the boundary. A step counts
//! only if it leads to a failing point that is nearer. Where the boundary has an edge or a jump, no
//! such step is found, and an evolution strategy of the kind (1 + λ) goes on (H.-G. Beyer and
//! H.-P. Schwefel, *Evolution strategies: a comprehensive introduction*, Natural Computing 1 (2002)
//! 3–52).
//!
//! Every step ends with a point that has been run and that fails. The result is the nearest failing
//! point that was tried. A nearer one may exist.

use closecall_traffic::maths::{exp, ln};
use closecall_traffic::{StandardNormal, Stream};
use rand::RngExt;

/// Number of points of a ray that are tried at once (-), and number of such rounds, each on the
/// section before the first failing point (-): together they resolve 1/729 of the distance.
const SECTIONS: usize = 8;
const ROUNDS: usize = 3;
/// Distance from the present ray of the rays that estimate the normal (standard deviations): an
/// assumption; 0.2 to 1 are plausible. A smaller one would measure the resolution of the boundary.
const RAY_DISTANCE_SD: f64 = 0.5;
/// Shares of the present distance between which such a ray is expected to cross the boundary (-),
/// and number of bisections between them (-): assumptions. They resolve 1/256 of the distance.
const CROSSING: [f64; 2] = [0.5, 1.5];
const BISECTIONS: usize = 8;
/// Shares of the way to the point that the normal leads to (-).
const WAYS: [f64; 4] = [1.0, 0.7, 0.4, 0.2];
/// Shares by which the points that are tried in each of these directions are nearer than the
/// present one (-).
const NEARER: [f64; 6] = [0.3, 0.15, 0.07, 0.03, 0.01, 0.003];
/// Number of points of a round that are drawn at random (-), and number of rounds without a nearer
/// failing point after which the search ends (-): assumptions; 10 to 100 and 2 to 10 are plausible.
const DRAWN: usize = 30;
const PATIENCE: usize = 4;
/// Smallest and largest move of a drawn direction (radians), and share by which its point is nearer
/// (-): assumptions. Both are drawn, because a search does not know how narrow its region is.
const MOVES: [f64; 2] = [0.01, 0.7];
const SHARES: [f64; 2] = [0.002, 0.3];
/// Share by which a round of all steps has to come nearer for another one to follow (-): an
/// assumption; 0.001 to 0.02 are plausible.
const PROGRESS: f64 = 0.005;

/// Says which points fail, as long as its budget lasts.
pub(super) trait Cases {
    /// Returns how many points can still be tried.
    fn affordable(&self) -> usize;

    /// Returns whether each of the points fails.
    fn fail(&mut self, points: &[Vec<f64>]) -> Vec<bool>;
}

/// A search from one failing point on.
pub(super) struct DesignPoint<'a, C> {
    cases: &'a mut C,
    /// The nearest failing point so far.
    point: Vec<f64>,
}

/// Returns the distance of a point to the origin.
fn length(point: &[f64]) -> f64 {
    point.iter().map(|z| z * z).sum::<f64>().sqrt()
}

fn scaled(point: &[f64], factor: f64) -> Vec<f64> {
    point.iter().map(|z| factor * z).collect()
}

/// Returns the point of length 1 in the direction of another one; `None` at the origin.
fn unit(point: &[f64]) -> Option<Vec<f64>> {
    let length = length(point);
    (length > 0.0 && length.is_finite()).then(|| scaled(point, 1.0 / length))
}

/// Draws a number whose logarithm is uniform between two bounds.
fn log_uniform([low, high]: [f64; 2], rng: &mut Stream) -> f64 {
    exp(ln(low) + (ln(high) - ln(low)) * rng.random::<f64>())
}

impl<'a, C: Cases> DesignPoint<'a, C> {
    /// Starts at a point that fails. The origin is known to pass.
    pub(super) fn new(cases: &'a mut C, failing: Vec<f64>) -> Self {
        Self { cases, point: failing }
    }

    /// Returns the nearest failing point so far.
    pub(super) fn into_point(self) -> Vec<f64> {
        self.point
    }

    /// Returns whether each point fails, and keeps the nearest failing one if it is nearer than the
    /// present one. `None` if they cannot all be tried.
    fn fail(&mut self, points: &[Vec<f64>]) -> Option<Vec<bool>> {
        if points.len() > self.cases.affordable() {
            return None;
        }
        let fails = self.cases.fail(points);
        let failing = points.iter().zip(&fails).filter(|(_, fails)| **fails).map(|(point, _)| point);
        let nearest = failing.min_by(|a, b| length(a).total_cmp(&length(b)));
        if let Some(nearest) = nearest.filter(|nearest| length(nearest) < length(&self.point)) {
            self.point.clone_from(nearest);
        }
        Some(fails)
    }

    /// Returns whether one of the points fails and is nearer than the present one; `None` if they
    /// cannot all be tried.
    fn has_nearer(&mut self, points: &[Vec<f64>]) -> Option<bool> {
        let before = length(&self.point);
        self.fail(points)?;
        Some(length(&self.point) < before)
    }

    /// Moves along the ray to the origin, to the first failing point.
    pub(super) fn draw_in(&mut self) -> Option<()> {
        let (end, mut passing, mut failing) = (self.point.clone(), 0.0, 1.0);
        for _ in 0..ROUNDS {
            let width = (failing - passing) / (SECTIONS + 1) as f64;
            let shares: Vec<f64> = (1..=SECTIONS).map(|section| passing + section as f64 * width).collect();
            let points: Vec<Vec<f64>> = shares.iter().map(|share| scaled(&end, *share)).collect();
            let fails = self.fail(&points)?;
            let first = fails.iter().position(|fails| *fails).unwrap_or(SECTIONS);
            failing = shares.get(first).copied().unwrap_or(failing);
            passing = first.checked_sub(1).map_or(passing, |before| shares[before]);
        }
        Some(())
    }

    /// Moves along the normal of the boundary, which is estimated around the present point.
    ///
    /// Let the boundary be the plane a·z = 1, on which the present point x lies. The ray through
    /// x + h·eᵢ crosses it at t·(x + h·eᵢ), hence aᵢ = (1/t − 1)/h. The point of the plane that is
    /// nearest to the origin is a/(a·a).
    fn along_normal(&mut self) -> Option<bool> {
        let start = self.point.clone();
        let ray = |index: usize| {
            let mut ray = start.clone();
            // Away from the origin, so that no ray points back.
            ray[index] += if ray[index] < 0.0 { -RAY_DISTANCE_SD } else { RAY_DISTANCE_SD };
            ray
        };
        let rays: Vec<Vec<f64>> = (0..start.len()).map(ray).collect();
        let mut brackets = vec![CROSSING; rays.len()];
        for _ in 0..BISECTIONS {
            let middles: Vec<f64> = brackets.iter().map(|[low, high]| 0.5 * (low + high)).collect();
            let points: Vec<Vec<f64>> = rays.iter().zip(&middles).map(|(ray, t)| scaled(ray, *t)).collect();
            let fails = self.fail(&points)?;
            for ((bracket, middle), fails) in brackets.iter_mut().zip(middles).zip(fails) {
                bracket[usize::from(fails)] = middle;
            }
        }
        let slope = |index: usize| {
            let [low, high] = brackets[index];
            (2.0 / (low + high) - 1.0) / (rays[index][index] - start[index])
        };
        let normal: Vec<f64> = (0..start.len()).map(slope).collect();
        let target = scaled(&normal, 1.0 / normal.iter().map(|a| a * a).sum::<f64>());
        if !target.iter().all(|z| z.is_finite()) {
            return Some(length(&self.point) < length(&start));
        }
        let mut points = Vec::new();
        for way in WAYS {
            let between: Vec<f64> = start.iter().zip(&target).map(|(from, to)| (1.0 - way) * from + way * to).collect();
            let Some(direction) = unit(&between) else { continue };
            points.extend(NEARER.map(|share| scaled(&direction, (1.0 - share) * length(&start))));
        }
        self.fail(&points)?;
        Some(length(&self.point) < length(&start))
    }

    /// Tries points beside the present one that are nearer to the origin.
    fn at_random(&mut self, rng: &mut Stream) -> Option<bool> {
        let present = length(&self.point);
        let Some(direction) = unit(&self.point) else { return Some(false) };
        for _ in 0..PATIENCE {
            let drawn = (0..DRAWN).filter_map(|_| {
                let (move_rad, share) = (log_uniform(MOVES, rng), log_uniform(SHARES, rng));
                let aside: Vec<f64> = direction.iter().map(|_| rng.sample::<f64, _>(StandardNormal)).collect();
                let aside = scaled(&unit(&aside)?, move_rad);
                let moved: Vec<f64> = direction.iter().zip(aside).map(|(z, aside)| z + aside).collect();
                Some(scaled(&unit(&moved)?, (1.0 - share) * present))
            });
            let drawn: Vec<Vec<f64>> = drawn.collect();
            if self.has_nearer(&drawn)? {
                return Some(true);
            }
        }
        Some(false)
    }

    /// Sets coordinates to 0 as long as the point fails: first each coordinate alone, then, the
    /// largest first, several of those together without which the point still fails.
    fn without_coordinates(&mut self) -> Option<bool> {
        let start = self.point.clone();
        let mut moved: Vec<usize> = (0..start.len()).filter(|index| start[*index] != 0.0).collect();
        if moved.len() < 2 {
            return Some(false);
        }
        moved.sort_by(|a, b| start[*b].abs().total_cmp(&start[*a].abs()));
        let without = |left_out: &[usize]| {
            let mut point = start.clone();
            left_out.iter().for_each(|index| point[*index] = 0.0);
            point
        };
        let alone: Vec<Vec<f64>> = moved.iter().map(|index| without(&[*index])).collect();
        let fails = self.fail(&alone)?;
        let spare = moved.into_iter().zip(fails).filter(|(_, fails)| *fails);
        let spare: Vec<usize> = spare.map(|(index, _)| index).collect();
        let together: Vec<Vec<f64>> = (2..=spare.len()).map(|count| without(&spare[..count])).collect();
        self.fail(&together)?;
        Some(length(&self.point) < length(&start))
    }

    /// Searches until a round of all steps comes no nearer, or no more points can be tried. Returns
    /// whether it ended because no step came nearer.
    pub(super) fn search(&mut self, rng: &mut Stream) -> bool {
        // A step for which too few runs are left ends the search: the present point always fails.
        self.rounds(rng).is_some()
    }

    fn rounds(&mut self, rng: &mut Stream) -> Option<()> {
        self.draw_in()?;
        if self.without_coordinates()? {
            self.draw_in()?;
        }
        loop {
            let before = length(&self.point);
            if self.along_normal()? {
                self.draw_in()?;
            }
            if !has_progress(before, length(&self.point)) && self.at_random(rng)? {
                self.draw_in()?;
            }
            if self.without_coordinates()? {
                self.draw_in()?;
            }
            if !has_progress(before, length(&self.point)) {
                return Some(());
            }
        }
    }
}

fn has_progress(before: f64, after: f64) -> bool {
    after < (1.0 - PROGRESS) * before
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, stream};

    use super::*;

    /// Whether a point fails.
    type Region = fn(&[f64]) -> bool;

    struct Tried {
        region: Region,
        left: usize,
        failing: Vec<Vec<f64>>,
    }

    impl Cases for Tried {
        fn affordable(&self) -> usize {
            self.left
        }

        fn fail(&mut self, points: &[Vec<f64>]) -> Vec<bool> {
            self.left = self.left.checked_sub(points.len()).unwrap();
            let fails: Vec<bool> = points.iter().map(|point| (self.region)(point)).collect();
            let failing = points.iter().zip(&fails).filter(|(_, fails)| **fails);
            self.failing.extend(failing.map(|(point, _)| point.clone()));
            fails
        }
    }

    /// Searches from a failing point on with so many points. Returns the nearest failing point.
    fn searched(region: Region, start: &[f64], budget: usize) -> Vec<f64> {
        assert!(region(start));
        let mut cases = Tried { region, left: budget, failing: vec![start.to_vec()] };
        let mut design = DesignPoint::new(&mut cases, start.to_vec());
        let mut rng = stream(7, 0, &ActorId::new("scenario").unwrap(), "minimize/design-point");
        design.search(&mut rng);
        let point = design.into_point();
        assert!(region(&point), "{point:?} passes");
        assert!(cases.failing.contains(&point), "{point:?} was never tried");
        assert!(cases.failing.iter().all(|other| length(other) >= length(&point)), "{point:?} is not the nearest");
        point
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn the_design_point_of_a_half_space_is_the_foot_of_its_normal() {
        // β is 2.5 along (3, 4, 0, …)/5, whatever the other coordinates of the start are.
        let half_space: Region = |z| dot(z, &[0.6, 0.8]) >= 2.5;
        let start = [0.5, 3.2, -1.1, 0.7, 1.6, -0.3, 0.9, -2.0];
        let point = searched(half_space, &start, 1_000);
        assert!((length(&point) - 2.5).abs() < 0.05, "{point:?}");
        assert!((point[0] - 1.5).abs() < 0.4 && (point[1] - 2.0).abs() < 0.3, "{point:?}");
        assert!(point[2..].iter().all(|z| z.abs() < 0.4), "{point:?}");
    }

    #[test]
    fn the_corner_of_a_region_is_found_where_no_normal_leads() {
        let corner: Region = |z| z[0] >= 2.0 && z[1] <= -1.5;
        let point = searched(corner, &[3.0, -3.0, 1.2, 0.4], 2_000);
        assert!(length(&point) < 1.03 * 2.5, "{point:?}");
        assert_eq!(&point[2..], [0.0, 0.0], "coordinates that are not needed are left out");
    }

    #[test]
    fn a_curved_boundary_is_followed_to_its_nearest_point() {
        // A parabola with its vertex 2 from the origin.
        let curved: Region = |z| z[0] - 0.3 * z[1] * z[1] >= 2.0;
        let point = searched(curved, &[5.0, 2.5, 0.5], 1_500);
        assert!(length(&point) < 2.06, "{point:?}");
    }

    #[test]
    fn a_nearer_region_that_no_step_meets_is_not_claimed() {
        // The region at −1 is nearer, and no failing sample leads there.
        let two: Region = |z| z[0] >= 3.0 || z[0] <= -1.0 && z[1].abs() < 0.01;
        let point = searched(two, &[3.5, 0.5], 1_000);
        assert!((length(&point) - 3.0).abs() < 0.05, "{point:?}");
    }

    #[test]
    fn a_failing_island_on_the_ray_is_nearer_than_its_end() {
        let island: Region = |z| z[0] >= 4.0 || (1.0..2.0).contains(&z[0]);
        let point = searched(island, &[4.2, 0.0], 200);
        assert!((1.0..1.02).contains(&length(&point)), "{point:?}");
    }

    #[test]
    fn a_small_budget_leaves_the_nearest_point_that_it_paid_for() {
        let half_space: Region = |z| z[0] >= 2.0;
        assert_eq!(searched(half_space, &[3.0, 1.0], 0), [3.0, 1.0]);
        let near = searched(half_space, &[3.0, 1.0], 30);
        assert!(length(&near) < length(&[3.0, 1.0]), "{near:?}");
    }

    #[test]
    fn a_search_with_the_same_numbers_ends_at_the_same_bits() {
        let half_space: Region = |z| dot(z, &[0.6, 0.8]) >= 2.5;
        let twice = [0, 1].map(|_| searched(half_space, &[1.0, 3.2, -1.1], 700));
        assert_eq!(twice[0], twice[1]);
    }
}
