//! Overlap of oriented boxes.

use closecall_traffic::geometry::OrientedBox;
use nalgebra::Vector2;

/// Returns the intersection over union of two boxes: 0 if they are apart, 1 if they are the same.
pub fn intersection_over_union(a: &OrientedBox, b: &OrientedBox) -> f64 {
    if (a.centre_m() - b.centre_m()).norm() > a.radius_m() + b.radius_m() {
        return 0.0;
    }
    let common = area(&clipped(a.corners_m().to_vec(), &b.corners_m()));
    let union = a.length_m * a.width_m + b.length_m * b.width_m - common;
    if union > 0.0 { (common / union).clamp(0.0, 1.0) } else { 0.0 }
}

/// Cuts a convex polygon by the edges of another polygon, whose corners are counter-clockwise
/// (Sutherland and Hodgman, 1974).
fn clipped(mut polygon: Vec<Vector2<f64>>, by: &[Vector2<f64>; 4]) -> Vec<Vector2<f64>> {
    for (index, start) in by.iter().enumerate() {
        let edge = by[(index + 1) % by.len()] - start;
        let inside = |point: &Vector2<f64>| edge.perp(&(point - start));
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (place, point) in polygon.iter().enumerate() {
            let next = &polygon[(place + 1) % polygon.len()];
            let (inside_m, next_inside_m) = (inside(point), inside(next));
            if inside_m >= 0.0 {
                kept.push(*point);
            }
            if inside_m * next_inside_m < 0.0 {
                kept.push(point + (next - point) * (inside_m / (inside_m - next_inside_m)));
            }
        }
        polygon = kept;
    }
    polygon
}

fn area(polygon: &[Vector2<f64>]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(a, b)| a.perp(b)).sum::<f64>().abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxed(x_m: f64, y_m: f64, yaw_rad: f64) -> OrientedBox {
        OrientedBox { x_m, y_m, yaw_rad, length_m: 4.0, width_m: 2.0 }
    }

    #[test]
    fn overlaps_in_closed_form() {
        let a = boxed(0.0, 0.0, 0.0);
        for (other, expected) in [
            (a, 1.0),
            (boxed(2.0, 0.0, 0.0), 4.0 / 12.0),
            (boxed(0.0, 1.0, 0.0), 4.0 / 12.0),
            (boxed(0.0, 0.0, std::f64::consts::FRAC_PI_2), 4.0 / 12.0),
            (boxed(0.0, 0.0, std::f64::consts::PI), 1.0),
            (boxed(4.1, 0.0, 0.0), 0.0),
            (boxed(50.0, 0.0, 1.0), 0.0),
        ] {
            let overlap = intersection_over_union(&a, &other);
            assert!((overlap - expected).abs() < 1e-9, "{other:?}: {overlap} instead of {expected}");
            assert!((intersection_over_union(&other, &a) - expected).abs() < 1e-9, "symmetric");
        }
        let turned = [boxed(1.0, 1.0, 0.7), boxed(1.5, 0.6, 0.9)];
        let shifted = turned.map(|shape| OrientedBox { x_m: shape.x_m + 100.0, y_m: shape.y_m - 7.0, ..shape });
        let [first, second] = [turned, shifted].map(|[a, b]| intersection_over_union(&a, &b));
        assert!((first - second).abs() < 1e-9 && first > 0.3);
    }
}
