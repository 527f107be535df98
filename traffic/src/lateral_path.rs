//! The lateral path of a vehicle: its lateral position as a function of the distance along the
//! road.
//!
//! Between two points of the path, the lateral position is a quintic polynomial. Its first and
//! second derivatives at the points are the derivatives of the parabola through the point and its
//! two neighbours, so that the lateral acceleration of a vehicle on the path does not jump. The
//! path ends parallel to the road.

use crate::Quintic;

/// A lateral path: at least two points with increasing distances.
#[derive(Clone, Debug, PartialEq)]
pub struct LateralPath {
    /// Distance at the start of each piece (m), and the piece.
    pieces: Vec<(f64, Quintic)>,
}

impl LateralPath {
    /// Creates the path through points: each the distance along the road since the start (m) and
    /// the lateral position, positive to the left (m). Returns `None` unless the distances start at
    /// 0 and increase, and there are at least two points.
    pub fn new(points: &[[f64; 2]]) -> Option<Self> {
        let increases = points.windows(2).all(|pair| pair[1][0] > pair[0][0]);
        let starts_at_zero = points.first().is_some_and(|first| first[0] == 0.0);
        if points.len() < 2 || !increases || !starts_at_zero {
            return None;
        }
        let states: Vec<[f64; 3]> = (0..points.len()).map(|index| state(points, index)).collect();
        let piece = |index: usize| {
            let [from_m, to_m] = [points[index][0], points[index + 1][0]];
            (from_m, Quintic::between(states[index], states[index + 1], to_m - from_m))
        };
        Some(Self { pieces: (0..points.len() - 1).map(piece).collect() })
    }

    /// Returns the lateral position (m) after a distance of `travelled_m` along the road, and its
    /// first and second derivative with respect to this distance. Beyond the end, it is the state
    /// at the end.
    pub fn at(&self, travelled_m: f64) -> [f64; 3] {
        let after = self.pieces.partition_point(|(from_m, _)| *from_m <= travelled_m);
        let (from_m, piece) = &self.pieces[after.saturating_sub(1)];
        piece.at((travelled_m - from_m).clamp(0.0, piece.length()))
    }

    /// Returns the largest magnitude of the second derivative (1/m), from samples at every 10 % of
    /// each piece.
    pub fn largest_second_derivative_per_m(&self) -> f64 {
        let in_piece = |piece: &Quintic| {
            let at = |tenth: i32| piece.at(piece.length() * f64::from(tenth) / 10.0)[2].abs();
            (0..=10).map(at).fold(0.0, f64::max)
        };
        self.pieces.iter().map(|(_, piece)| in_piece(piece)).fold(0.0, f64::max)
    }

    /// Returns the mirror image on a road whose right edge is at `right_edge_m`.
    #[must_use]
    pub fn mirrored(&self, right_edge_m: f64) -> Self {
        let piece = |(from_m, piece): &(f64, Quintic)| {
            let [from, to] = [0.0, piece.length()].map(|x| {
                let [d_m, first, second] = piece.at(x);
                [right_edge_m - d_m, -first, -second]
            });
            (*from_m, Quintic::between(from, to, piece.length()))
        };
        Self { pieces: self.pieces.iter().map(piece).collect() }
    }
}

/// Returns the lateral position at a point, and the derivatives of the parabola through
/// the point and its neighbours. The last point has none.
fn state(points: &[[f64; 2]], index: usize) -> [f64; 3] {
    let [x, d] = points[index];
    if index + 1 == points.len() {
        return [d, 0.0, 0.0];
    }
    let middle = index.clamp(1, points.len().max(3) - 2);
    let (Some(before), Some(at), Some(after)) = (points.get(middle - 1), points.get(middle), points.get(middle + 1))
    else {
        let [next_x, next_d] = points[index + 1];
        return [d, (next_d - d) / (next_x - x), 0.0];
    };
    let slopes = [(at[1] - before[1]) / (at[0] - before[0]), (after[1] - at[1]) / (after[0] - at[0])];
    let curvature = (slopes[1] - slopes[0]) / (after[0] - before[0]);
    [d, slopes[0] + curvature * (2.0 * x - before[0] - at[0]), 2.0 * curvature]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_goes_through_its_points_and_ends_parallel_to_the_road() {
        let points = [[0.0, -5.0], [10.0, -4.8], [25.0, -3.0], [40.0, -1.9]];
        let path = LateralPath::new(&points).unwrap();
        for [x, d] in points {
            assert!((path.at(x)[0] - d).abs() < 1e-12, "{x}");
        }
        assert!(path.at(40.0)[1..].iter().all(|slope| slope.abs() < 1e-12), "{:?}", path.at(40.0));
        assert_eq!(path.at(1_000.0), path.at(40.0));
        // Neither the slope nor its derivative jumps between two pieces.
        for x in [10.0, 25.0] {
            let [before, after] = [-1e-9, 1e-9].map(|shift| path.at(x + shift));
            assert!((before[1] - after[1]).abs() < 1e-7 && (before[2] - after[2]).abs() < 1e-6, "{before:?} {after:?}");
        }
    }

    #[test]
    fn a_parabola_is_reproduced_with_its_derivatives() {
        let parabola = |x: f64| -4.0 + 0.02 * x - 0.001 * x * x;
        let points: Vec<[f64; 2]> = [0.0, 3.0, 7.0, 12.0, 20.0, 31.0].map(|x| [x, parabola(x)]).to_vec();
        let path = LateralPath::new(&points).unwrap();
        for step in 0..200 {
            let x = 0.1 * f64::from(step);
            let [d, slope, second] = path.at(x);
            assert!((d - parabola(x)).abs() < 1e-12 && (slope - 0.02 + 0.002 * x).abs() < 1e-12, "{x}: {d} {slope}");
            assert!((second + 0.002).abs() < 1e-10, "{x}: {second}");
        }
        let bend = LateralPath::new(&points[..2]).unwrap().largest_second_derivative_per_m();
        assert!(bend > 0.0 && path.largest_second_derivative_per_m() >= 0.002 - 1e-10, "{bend}");
    }

    #[test]
    fn a_mirrored_path_is_the_mirror_image() {
        let path = LateralPath::new(&[[0.0, -5.0], [10.0, -4.8], [25.0, -3.0], [40.0, -1.9]]).unwrap();
        let mirrored = path.mirrored(-11.25);
        for step in 0..50 {
            let ([d, slope, second], image) = (path.at(f64::from(step)), mirrored.at(f64::from(step)));
            assert!((image[0] + 11.25 + d).abs() < 1e-9 && (image[1] + slope).abs() < 1e-9);
            assert!((image[2] + second).abs() < 1e-9, "{step}");
        }
    }

    #[test]
    fn points_that_make_no_path_are_refused() {
        let unordered: [&[[f64; 2]]; 5] = [
            &[],
            &[[0.0, 1.0]],
            &[[1.0, 1.0], [2.0, 1.0]],
            &[[0.0, 1.0], [0.0, 2.0]],
            &[[0.0, 1.0], [f64::NAN, 2.0], [3.0, 1.0]],
        ];
        for points in unordered {
            assert_eq!(LateralPath::new(points), None, "{points:?}");
        }
        assert!(LateralPath::new(&[[0.0, 1.0], [2.0, 1.5]]).is_some());
    }
}
