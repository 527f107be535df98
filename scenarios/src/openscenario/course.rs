//! The course of an OpenDRIVE road as an alignment: lines, arcs and spirals are its pieces, and
//! curves of third degree are replaced by pieces whose curvature changes linearly.
//!
//! The curvature of a curve is sampled along its length. The samples that a linear interpolation
//! reproduces are left out (Douglas and Peucker 1973), until few points remain. The line that
//! results is compared with the positions in the file: it may deviate by [`MOST_DEVIATION_M`]. If it
//! deviates more, more points remain, up to [`Alignment::MAX_POINTS`].

use std::path::Path;

use closecall_traffic::{Alignment, AlignmentPoint, maths};

use super::dom::{ImportError, Node, number};

/// Largest distance between a point of the file's reference line and the imported line (m). An
/// assumption: 0.05 to 0.5 are plausible, because the markings of a lane are 0.15 m wide.
const MOST_DEVIATION_M: f64 = 0.1;
/// Distance between two samples of the curvature of a curve (m).
const SAMPLE_M: f64 = 5.0;
/// Steps of the integral of the length of a curve between two samples.
const STEPS: u32 = 16;
/// Smallest deviation of the curvature that matters (1/m), and the factor by which it grows until
/// few enough points remain.
const LEAST_TOLERANCE_PER_M: f64 = 1e-7;
const TOLERANCE_FACTOR: f64 = 1.5;
/// Number of points of an alignment that a reader of the scenario still takes in. A line that follows
/// curves of third degree with as many has no more.
const FEW_POINTS: usize = 64;

/// A point of the reference line of the file.
#[derive(Clone, Copy, Debug)]
struct Sample {
    s_m: f64,
    curvature_per_m: f64,
    /// Position in the plane (m), if the file gives it.
    at_m: Option<[f64; 2]>,
}

/// A curve (u, v)(p) of third degree.
#[derive(Clone, Copy, Debug)]
struct Curve {
    u: [f64; 4],
    v: [f64; 4],
    /// The end of p, or `None` if the curve ends where its length is reached.
    end: Option<f64>,
}

impl Curve {
    fn at(&self, p: f64) -> [f64; 2] {
        [self.u, self.v].map(|[a, b, c, d]| a + p * (b + p * (c + p * d)))
    }

    fn slope(&self, p: f64) -> [f64; 2] {
        [self.u, self.v].map(|[_, b, c, d]| b + p * (2.0 * c + p * 3.0 * d))
    }

    fn speed(&self, p: f64) -> f64 {
        let [u, v] = self.slope(p);
        maths::hypot(u, v)
    }

    fn curvature_per_m(&self, p: f64) -> f64 {
        let [u, v] = self.slope(p);
        let [u_bend, v_bend] = [self.u, self.v].map(|[_, _, c, d]| 2.0 * c + 6.0 * d * p);
        let speed = self.speed(p);
        (u * v_bend - v * u_bend) / (speed * speed * speed)
    }

    /// Returns the values of p at `count` + 1 positions with equal distances along a curve of this
    /// length (m).
    fn along(&self, count: u32, length_m: f64) -> Vec<f64> {
        let steps = f64::from(count * STEPS);
        // A curve y(x) is at least as long as its part along x.
        let end = self.end.unwrap_or(length_m);
        let mut lengths_m = vec![0.0];
        let step = end / steps;
        let mut length = 0.0;
        for index in 0..count * STEPS {
            let from = f64::from(index) * step;
            // Simpson's rule.
            let speeds = self.speed(from) + 4.0 * self.speed(from + 0.5 * step) + self.speed(from + step);
            length += speeds * step / 6.0;
            lengths_m.push(length);
        }
        let total_m = if self.end.is_some() { length } else { length_m };
        let at = |sample: u32| {
            let wanted_m = total_m * f64::from(sample) / f64::from(count);
            let after = lengths_m.partition_point(|length_m| *length_m < wanted_m).clamp(1, lengths_m.len() - 1);
            let [from_m, to_m] = [lengths_m[after - 1], lengths_m[after]];
            (after as f64 - 1.0 + (wanted_m - from_m) / (to_m - from_m)) * step
        };
        (0..=count).map(at).collect()
    }
}

/// Returns the alignment of a road that is not only lines, or the reason why it has none. Notes say
/// how exactly it follows curves of third degree.
///
/// # Errors
/// [`ImportError`] if a piece lacks a number.
pub(super) fn alignment(
    path: &Path,
    plan: &Node,
    notes: &mut Vec<String>,
) -> Result<Result<Alignment, String>, ImportError> {
    let mut samples: Vec<Sample> = Vec::new();
    let mut start_m = 0.0;
    let mut has_curves = false;
    for geometry in plan.all("geometry") {
        let Some(shape) = geometry.children.first() else { continue };
        let length_m = number(path, geometry, "length")?;
        has_curves |= matches!(shape.name.as_str(), "poly3" | "paramPoly3");
        piece(path, (geometry, shape), (start_m, length_m), &mut samples)?;
        start_m += length_m;
    }
    let most_per_m = samples.iter().map(|sample| sample.curvature_per_m.abs()).fold(0.0, f64::max);
    let range = Alignment::CURVATURE_PER_M;
    if !samples.iter().all(|sample| range.contains(sample.curvature_per_m)) {
        let allowed_per_m = range.high();
        return Ok(Err(format!(
            "a curvature of up to {most_per_m:.4} 1/m, and a scenario has up to {allowed_per_m} 1/m"
        )));
    }
    let points = spaced(&samples);
    let with_tolerance = |steps: u32| {
        simplified(
            &points,
            (0..steps).fold(LEAST_TOLERANCE_PER_M, |tolerance_per_m, _| tolerance_per_m * TOLERANCE_FACTOR),
        )
    };
    let few_points = if has_curves { FEW_POINTS } else { Alignment::MAX_POINTS };
    let (mut steps, mut kept) = (0, with_tolerance(0));
    while kept.len() > few_points {
        steps += 1;
        kept = with_tolerance(steps);
    }
    let (line, deviation_m) = loop {
        let line = match Alignment::new(&kept) {
            Ok(line) => line,
            Err(error) => return Ok(Err(format!("a course that is no alignment ({error})"))),
        };
        let Some(deviation_m) = deviation_m(path, plan, &samples, &line) else {
            return Ok(Err("a course whose pieces do not say where they begin".to_owned()));
        };
        if deviation_m <= MOST_DEVIATION_M {
            break (line, deviation_m);
        }
        let finer = steps.checked_sub(1).map(with_tolerance).filter(|finer| finer.len() <= Alignment::MAX_POINTS);
        let Some(finer) = finer else {
            return Ok(Err(format!(
                "a course from which {} points of a curvature that changes linearly deviate by {deviation_m:.2} m, and \
                 {MOST_DEVIATION_M} m are allowed",
                line.points().len()
            )));
        };
        (steps, kept) = (steps - 1, finer);
    };
    if has_curves {
        notes.push(format!(
            "curves of third degree: pieces with a linear curvature follow them within {deviation_m:.3} m"
        ));
    }
    Ok(Ok(line))
}

/// Appends the samples of a piece that begins at `start_m` and has this length (m).
fn piece(
    path: &Path,
    (geometry, shape): (&Node, &Node),
    (start_m, length_m): (f64, f64),
    samples: &mut Vec<Sample>,
) -> Result<(), ImportError> {
    let value = |name: &str| match shape.raw(name) {
        Some(_) => number(path, shape, name),
        None => Ok(0.0),
    };
    let of_geometry = |name: &str| number(path, geometry, name).ok();
    let start = of_geometry("x").zip(of_geometry("y")).zip(of_geometry("hdg"));
    let in_plane = |[u_m, v_m]: [f64; 2]| {
        start.map(|((x_m, y_m), heading_rad)| {
            let (sin, cos) = maths::sin_cos(heading_rad);
            [x_m + u_m * cos - v_m * sin, y_m + u_m * sin + v_m * cos]
        })
    };
    let cubic = |names: [&str; 4]| -> Result<[f64; 4], ImportError> {
        let [a, b, c, d] = names.map(&value);
        Ok([a?, b?, c?, d?])
    };
    let curve = match shape.name.as_str() {
        "poly3" => Curve { u: [0.0, 1.0, 0.0, 0.0], v: cubic(["a", "b", "c", "d"])?, end: None },
        "paramPoly3" => Curve {
            u: cubic(["aU", "bU", "cU", "dU"])?,
            v: cubic(["aV", "bV", "cV", "dV"])?,
            end: Some(if shape.raw("pRange") == Some("arcLength") { length_m } else { 1.0 }),
        },
        name => {
            let ends_per_m = match name {
                "arc" => [number(path, shape, "curvature")?; 2],
                "spiral" => [number(path, shape, "curvStart")?, number(path, shape, "curvEnd")?],
                _ => [0.0; 2],
            };
            let at = |s_m, curvature_per_m, at_m| Sample { s_m, curvature_per_m, at_m };
            samples.push(at(start_m, ends_per_m[0], in_plane([0.0; 2])));
            // A piece below 1 m has no alignment of its own; the next piece shows where it ends.
            let ends = [(0.0, ends_per_m[0]), (length_m, ends_per_m[1])];
            let ends = ends.map(|(s_m, curvature_per_m)| AlignmentPoint { s_m, curvature_per_m });
            let end = Alignment::new(&ends).ok().map(|line| line.pose(length_m));
            samples.push(at(start_m + length_m, ends_per_m[1], end.and_then(|end| in_plane([end.x_m, end.y_m]))));
            return Ok(());
        }
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before the cast")]
    let count = (length_m / SAMPLE_M).clamp(1.0, 10_000.0) as u32;
    samples.extend(curve.along(count, length_m).into_iter().enumerate().map(|(index, p)| Sample {
        s_m: start_m + length_m * index as f64 / f64::from(count),
        curvature_per_m: curve.curvature_per_m(p),
        at_m: in_plane(curve.at(p)),
    }));
    Ok(())
}

/// Returns the curvature at positions that an alignment can have: 1 m apart or more, or a jump.
fn spaced(samples: &[Sample]) -> Vec<AlignmentPoint> {
    let mut points: Vec<AlignmentPoint> = Vec::new();
    for sample in samples {
        let point = AlignmentPoint { s_m: sample.s_m, curvature_per_m: sample.curvature_per_m };
        let place = |back: usize| points.len().checked_sub(back).map(|index| points[index].s_m);
        match (place(2), place(1)) {
            (_, Some(last_m)) if last_m < point.s_m && point.s_m < last_m + Alignment::LEAST_SPACING_M => {}
            (Some(before_m), Some(last_m)) if before_m == point.s_m && last_m == point.s_m => {
                points.pop();
                points.push(point);
            }
            _ => points.push(point),
        }
    }
    points
}

/// Returns the points without those that the line between their neighbours reproduces.
fn simplified(points: &[AlignmentPoint], tolerance_per_m: f64) -> Vec<AlignmentPoint> {
    let mut is_kept = vec![false; points.len()];
    let mut open = Vec::new();
    if let Some(last) = points.len().checked_sub(1) {
        (is_kept[0], is_kept[last]) = (true, true);
        open.push([0, last]);
    }
    while let Some([first, last]) = open.pop() {
        let [from, to] = [points[first], points[last]];
        let error_per_m = |index: usize| {
            let share = if to.s_m > from.s_m { (points[index].s_m - from.s_m) / (to.s_m - from.s_m) } else { 0.0 };
            let line_per_m = from.curvature_per_m + (to.curvature_per_m - from.curvature_per_m) * share;
            (points[index].curvature_per_m - line_per_m).abs()
        };
        let worst = (first + 1..last).max_by(|a, b| error_per_m(*a).total_cmp(&error_per_m(*b)));
        if let Some(worst) = worst.filter(|worst| error_per_m(*worst) > tolerance_per_m) {
            is_kept[worst] = true;
            open.extend([[first, worst], [worst, last]]);
        }
    }
    points.iter().zip(is_kept).filter(|(_, is_kept)| *is_kept).map(|(point, _)| *point).collect()
}

/// Returns the largest distance between the line and the points of the file (m), or `None` if a
/// piece does not say where it begins.
fn deviation_m(path: &Path, plan: &Node, samples: &[Sample], line: &Alignment) -> Option<f64> {
    let first = plan.all("geometry").next()?;
    let value = |name| number(path, first, name).ok();
    let (x_m, y_m, heading_rad) = (value("x")?, value("y")?, value("hdg")?);
    if !plan.all("geometry").all(|geometry| ["x", "y", "hdg"].iter().all(|name| geometry.raw(name).is_some())) {
        return None;
    }
    let (sin, cos) = maths::sin_cos(heading_rad);
    let away_m = samples.iter().filter_map(|sample| {
        let pose = line.pose(sample.s_m);
        let [at_x_m, at_y_m] = sample.at_m?;
        let (line_x_m, line_y_m) = (x_m + pose.x_m * cos - pose.y_m * sin, y_m + pose.x_m * sin + pose.y_m * cos);
        Some(maths::hypot(at_x_m - line_x_m, at_y_m - line_y_m))
    });
    Some(away_m.fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::super::dom::parse;
    use super::*;

    /// Returns the answer for pieces `(x, y, hdg, length, shape)` of a reference line, and its
    /// notes.
    fn read(pieces: &[(f64, f64, f64, f64, &str)]) -> (Result<Alignment, String>, Vec<String>) {
        let (path, mut notes) = (Path::new("road.xodr"), Vec::new());
        let mut text = "<planView>".to_owned();
        for (x, y, hdg, length, shape) in pieces {
            text += &format!("<geometry x=\"{x}\" y=\"{y}\" hdg=\"{hdg}\" length=\"{length}\"><{shape}/></geometry>");
        }
        let plan = parse(path, &(text + "</planView>")).unwrap();
        (alignment(path, &plan, &mut notes).unwrap(), notes)
    }

    /// Returns the pieces of an alignment from s = 0 on, with the start (100, −20) and the heading
    /// 0.7.
    fn pieces<'a>(line: &Alignment, shapes: &[(f64, &'a str)]) -> Vec<(f64, f64, f64, f64, &'a str)> {
        let (sin, cos) = maths::sin_cos(0.7);
        let mut s_m = 0.0;
        let piece = |(length_m, shape): &(f64, &'a str)| {
            let pose = line.pose(s_m);
            s_m += length_m;
            let at_m = [100.0 + pose.x_m * cos - pose.y_m * sin, -20.0 + pose.x_m * sin + pose.y_m * cos];
            (at_m[0], at_m[1], 0.7 + pose.yaw_rad, *length_m, *shape)
        };
        shapes.iter().map(piece).collect()
    }

    fn points(points: &[[f64; 2]]) -> Vec<AlignmentPoint> {
        points.iter().map(|&[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m }).collect()
    }

    const SHAPES: [(f64, &str); 5] = [
        (100.0, "line"),
        (120.0, "spiral curvStart=\"0\" curvEnd=\"0.002\""),
        (80.0, "arc curvature=\"0.002\""),
        (200.0, "spiral curvStart=\"0.002\" curvEnd=\"-0.001\""),
        (50.0, "line"),
    ];

    fn s_curve() -> Vec<AlignmentPoint> {
        points(&[[0.0, 0.0], [100.0, 0.0], [220.0, 0.002], [300.0, 0.002], [500.0, -0.001], [500.0, 0.0], [550.0, 0.0]])
    }

    #[test]
    fn lines_arcs_and_spirals_are_the_pieces_of_the_alignment() {
        let expected = s_curve();
        let (line, notes) = read(&pieces(&Alignment::new(&expected).unwrap(), &SHAPES));
        assert_eq!(line.unwrap().points(), expected);
        assert!(notes.is_empty(), "{notes:?}");
    }

    #[test]
    fn a_road_of_many_pieces_is_followed_exactly_and_one_of_many_curves_by_as_many_points_as_it_needs() {
        let bends: Vec<[f64; 2]> =
            (0..200_u8).map(|index| [40.0 * f64::from(index), [0.0, 0.002, -0.001][usize::from(index % 3)]]).collect();
        let expected = points(&bends);
        let texts: Vec<String> = bends
            .windows(2)
            .map(|pair| format!("spiral curvStart=\"{}\" curvEnd=\"{}\"", pair[0][1], pair[1][1]))
            .collect();
        let shapes: Vec<(f64, &str)> = texts.iter().map(|text| (40.0, text.as_str())).collect();
        let (line, notes) = read(&pieces(&Alignment::new(&expected).unwrap(), &shapes));
        assert_eq!(line.unwrap().points(), expected);
        assert!(notes.is_empty(), "{notes:?}");
        // A hundred waves of third degree, 2 m to the left and back: 64 points are too few for them.
        let slope = |x: f64, sign: f64| sign * 12.0 * (x - x * x / 100.0) / 10_000.0;
        let length_m: f64 = (0..10_000).map(|step| 0.01 * maths::hypot(1.0, slope(0.01 * f64::from(step), 1.0))).sum();
        let wave = |sign: f64| format!("poly3 a=\"0\" b=\"0\" c=\"{}\" d=\"{}\"", sign * 6e-4, sign * -4e-6);
        let waves = [1.0, -1.0].map(wave);
        let at = |index: u32| {
            let is_back = index % 2;
            (100.0 * f64::from(index), 2.0 * f64::from(is_back), 0.0, length_m, waves[is_back as usize].as_str())
        };
        let (line, notes) = read(&(0..100).map(at).collect::<Vec<_>>());
        let count = line.unwrap().points().len();
        assert!((101..=Alignment::MAX_POINTS).contains(&count), "{count}");
        assert!(notes[0].contains("follow them within 0.0"), "{notes:?}");
    }

    #[test]
    fn a_piece_that_begins_elsewhere_or_in_another_direction_is_no_alignment() {
        let whole = pieces(&Alignment::new(&s_curve()).unwrap(), &SHAPES);
        for (key, by) in [(0, 0.2), (1, -0.2), (2, 0.01)] {
            let mut kinked = whole.clone();
            match key {
                0 => kinked[3].0 += by,
                1 => kinked[3].1 += by,
                _ => kinked[4].2 += by,
            }
            let reason = read(&kinked).0.unwrap_err();
            assert!(reason.contains("m are allowed"), "{key}: {reason}");
        }
        let mut tight = whole;
        tight[2].4 = "arc curvature=\"0.01\"";
        assert!(read(&tight).0.unwrap_err().contains("a curvature of up to 0.0100 1/m"));
    }

    #[test]
    fn a_curve_of_third_degree_is_followed_within_the_stated_distance() {
        // v = u³/(6·R·L) is the usual approximation of a clothoid, here to R = 1389 m.
        for shape in [
            "paramPoly3 pRange=\"arcLength\" bU=\"1\" dV=\"1e-6\"",
            "poly3 a=\"0\" b=\"0\" c=\"0\" d=\"1e-6\"",
            "paramPoly3 bU=\"120\" dV=\"1.728\"",
        ] {
            let (line, notes) = read(&[(0.0, 0.0, 0.0, 120.0, shape)]);
            let line = line.unwrap();
            assert!(line.points().len() <= Alignment::MAX_POINTS && line.points().len() > 2, "{shape}");
            let stated_m: f64 = notes[0].split("within ").nth(1).unwrap().strip_suffix(" m").unwrap().parse().unwrap();
            // The points of the curve, at the arc length of the closed line.
            let (mut s_m, mut before, mut worst_m) = (0.0, [0.0; 2], 0.0_f64);
            for step in 1..=1_190 {
                let u: f64 = 0.1 * f64::from(step);
                let at = [u, 1e-6 * u * u * u];
                s_m += maths::hypot(at[0] - before[0], at[1] - before[1]);
                before = at;
                let pose = line.pose(s_m);
                worst_m = worst_m.max(maths::hypot(pose.x_m - at[0], pose.y_m - at[1]));
            }
            assert!(stated_m <= MOST_DEVIATION_M && worst_m <= MOST_DEVIATION_M, "{shape}: {stated_m} {worst_m}");
        }
    }
}
