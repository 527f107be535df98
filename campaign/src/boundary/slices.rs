//! Where a surface crosses 0: along the second parameter for values of the first one, and over the
//! whole rectangle.

use super::search::{SIDE, coordinates, grid};
use super::surface::{Predicted, Surface};

/// Number of values of the first parameter.
const SLICES: usize = 21;
/// Number of values of the second parameter at which a slice is predicted. An interval ends at one
/// of them, outside the band.
const STEPS: usize = 401;

/// The boundary at one value of the first parameter. All values are in the units of the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// The value of the first parameter.
    pub first: f64,
    /// The values of the second parameter at which the predicted margin crosses 0.
    pub crossings: Vec<Crossing>,
    /// Ranges of the second parameter in which the sign of the margin is not decided with 95 %.
    pub undecided: Vec<[f64; 2]>,
    /// Whether the predicted margin is negative in the whole range; `None` if it crosses 0.
    pub fails: Option<bool>,
}

/// A crossing of the boundary, in the unit of the second parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Where the mean crosses 0.
    pub second: f64,
    /// The range around it in which 0 is within the 95 % interval of the margin, cut at the ends of
    /// the parameter's range.
    pub interval_95: [f64; 2],
}

/// Shares of the rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// The event does not happen, with 97.5 % at each place.
    pub passes: f64,
    /// The event happens, with 97.5 % at each place.
    pub fails: f64,
    /// Neither.
    pub undecided: f64,
}

/// Values of the surface over a grid of the rectangle, for a figure. The first index belongs to the
/// first parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The predicted margins, in the unit of the number.
    pub means: Vec<Vec<f64>>,
    /// Whether the sign is decided with 95 %.
    pub decided: Vec<Vec<bool>>,
}

/// Returns the surface over the grid, and the shares of its places.
pub(super) fn map(surface: &Surface) -> (Map, Area) {
    let places = surface.predict(&grid());
    let share =
        |is: fn(&Predicted) -> bool| places.iter().filter(|place| is(place)).count() as f64 / places.len() as f64;
    let area = Area {
        passes: share(|place| place.is_decided() && place.mean > 0.0),
        fails: share(|place| place.is_decided() && place.mean < 0.0),
        undecided: share(|place| !place.is_decided()),
    };
    let columns = || places.chunks(SIDE);
    let means = columns().map(|column| column.iter().map(|place| place.mean).collect()).collect();
    let decided = columns().map(|column| column.iter().map(Predicted::is_decided).collect()).collect();
    (Map { means, decided }, area)
}

/// Returns the slices of a surface over a rectangle with these ends.
pub(super) fn slices(surface: &Surface, ranges: [[f64; 2]; 2]) -> Vec<Slice> {
    let value = |axis: usize, u: f64| ranges[axis][0] + u * (ranges[axis][1] - ranges[axis][0]);
    coordinates(SLICES)
        .map(|u| {
            let points: Vec<[f64; 2]> = coordinates(STEPS).map(|v| [u, v]).collect();
            let predicted = surface.predict(&points);
            let second = |index: usize| value(1, points[index][1]);
            let crossings: Vec<Crossing> = (0..STEPS - 1)
                .filter(|&index| (predicted[index].mean < 0.0) != (predicted[index + 1].mean < 0.0))
                .map(|index| {
                    let [before, after] = [index, index + 1].map(|index| predicted[index].mean);
                    let share = before / (before - after);
                    let interval_95 = around(&predicted, index).map(second);
                    Crossing { second: second(index) + share * (second(index + 1) - second(index)), interval_95 }
                })
                .collect();
            let fails = crossings.is_empty().then(|| predicted[0].mean < 0.0);
            let undecided = undecided(&predicted).into_iter().map(|ends| ends.map(second)).collect();
            Slice { first: value(0, u), crossings, undecided, fails }
        })
        .collect()
}

/// Returns the last decided place at or before `index`, and the first one after it, or the ends.
fn around(predicted: &[Predicted], index: usize) -> [usize; 2] {
    let last = predicted.len() - 1;
    let (mut low, mut high) = (index, index + 1);
    while low > 0 && !predicted[low].is_decided() {
        low -= 1;
    }
    while high < last && !predicted[high].is_decided() {
        high += 1;
    }
    [low, high]
}

/// Returns the ranges that are not decided, each with the decided places at its ends.
fn undecided(predicted: &[Predicted]) -> Vec<[usize; 2]> {
    let is_first =
        |index: &usize| !predicted[*index].is_decided() && (*index == 0 || predicted[*index - 1].is_decided());
    let last = predicted.len() - 1;
    (0..predicted.len())
        .filter(is_first)
        .map(|first| {
            let end = (first..=last).find(|index| predicted[*index].is_decided()).unwrap_or(last);
            [first.saturating_sub(1), end]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use closecall_traffic::maths;

    use super::super::search::tests::{Margin, searched};
    use super::*;

    /// Returns the slices of a margin over the unit square after 60 runs.
    fn of(margin: Margin, scramble: u32) -> Vec<Slice> {
        let (surface, _) = searched(margin, 60, scramble).surface().unwrap();
        slices(&surface, [[0.0, 1.0]; 2])
    }

    /// The share of the true crossings that lie in the interval of a crossing of their slice.
    fn covered(slices: &[Slice], crossings: fn(f64) -> Vec<f64>) -> f64 {
        let (mut all, mut inside) = (0, 0);
        for slice in slices {
            for truth in crossings(slice.first) {
                all += 1;
                let holds = |crossing: &Crossing| {
                    let [low, high] = crossing.interval_95;
                    low <= truth && truth <= high && high - low < 0.2
                };
                inside += u32::from(slice.crossings.iter().any(holds));
            }
        }
        assert!(all > 10);
        f64::from(inside) / f64::from(all)
    }

    #[test]
    fn the_boundary_of_a_line_and_of_a_curve_is_in_its_band() {
        for scramble in [1, 2, 3] {
            let line = covered(&of(|x, y| y - 0.2 - 0.6 * x, scramble), |x| vec![0.2 + 0.6 * x]);
            let curve = of(|x, y| y - 0.3 - 0.2 * maths::sin(6.0 * x), scramble);
            let curve = covered(&curve, |x| vec![0.3 + 0.2 * maths::sin(6.0 * x)]);
            assert!(line >= 0.9 && curve >= 0.9, "{scramble}: {line} {curve}");
        }
    }

    #[test]
    fn the_boundary_of_a_circle_is_crossed_twice_within_it_and_not_outside() {
        let slices = of(|x, y| maths::hypot(x - 0.5, y - 0.5) - 0.3, 5);
        // A slice that touches the circle is left out.
        let truth = |x: f64| {
            let square = 0.09 - (x - 0.5) * (x - 0.5);
            if square > 0.001 { vec![0.5 - square.sqrt(), 0.5 + square.sqrt()] } else { Vec::new() }
        };
        assert!(covered(&slices, truth) >= 0.9);
        let [left, middle] = [&slices[0], &slices[10]];
        assert!(left.crossings.is_empty() && left.fails == Some(false), "{left:?}");
        assert!(middle.crossings.len() == 2 && middle.fails.is_none(), "{middle:?}");
    }

    #[test]
    fn the_shares_of_the_area_are_those_of_the_margin() {
        let (surface, _) = searched(|x, y| y - 0.2 - 0.6 * x, 60, 1).surface().unwrap();
        let (map, area) = map(&surface);
        assert!((area.passes + area.fails + area.undecided - 1.0).abs() < 1e-12);
        assert!((area.fails - 0.5).abs() < 0.05 && area.undecided < 0.1, "{area:?}");
        assert!(map.means[0][40] > 0.0 && map.means[40][0] < 0.0 && map.decided[40][0]);
    }

    #[test]
    fn a_margin_that_never_reaches_the_bound_has_no_crossing() {
        let slices = of(|x, y| -1.0 - x * y, 2);
        assert!(slices.iter().all(|slice| slice.crossings.is_empty() && slice.fails == Some(true)));
        assert!(slices.iter().all(|slice| slice.undecided.is_empty()));
    }

    #[test]
    fn an_interval_reaches_to_the_decided_places_beside_it() {
        let place = |mean: f64| Predicted { mean, sd: 1.0 };
        let predicted = [-9.0, -3.0, -1.0, 1.0, 1.5, 4.0].map(place);
        assert_eq!(around(&predicted, 2), [1, 5]);
        assert_eq!(undecided(&predicted), [[1, 5]]);
        let open = [-1.0, 1.0, 5.0, 1.0].map(place);
        assert_eq!(around(&open, 0), [0, 2]);
        assert_eq!(undecided(&open), [[0, 2], [2, 3]]);
    }
}
