//! Rasterisation of triangles with a depth buffer.

/// A corner of a triangle in the image: column, row (samples), and distance along the optical axis
/// (m).
pub(crate) type Corner = [f64; 3];

/// What each sample of an image shows.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    width: usize,
    height: usize,
    /// Inverse distance of the nearest face (1/m); 0 for the ground.
    nearness: Vec<f32>,
    /// Colour index of the nearest face; 0 for the ground.
    pub(crate) face: Vec<u32>,
    /// True if the ground is in the shadow of a vehicle.
    pub(crate) is_shadowed: Vec<bool>,
}

impl Samples {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let count = width * height;
        Self { width, height, nearness: vec![0.0; count], face: vec![0; count], is_shadowed: vec![false; count] }
    }

    /// Draws a face: it covers the samples whose middle it contains, and hides what is farther
    /// away.
    pub(crate) fn draw(&mut self, corners: &[Corner; 3], face: u32) {
        self.each_sample(corners, |samples, index, nearness| {
            if nearness > samples.nearness[index] {
                samples.nearness[index] = nearness;
                samples.face[index] = face;
            }
        });
    }

    /// Draws the shadow of a face on the ground.
    pub(crate) fn shade(&mut self, corners: &[Corner; 3]) {
        self.each_sample(corners, |samples, index, _| samples.is_shadowed[index] = true);
    }

    fn each_sample(&mut self, corners: &[Corner; 3], mut visit: impl FnMut(&mut Self, usize, f32)) {
        let [a, b, c] = corners;
        let doubled = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if doubled.abs() < 1e-9 {
            return;
        }
        let Some((columns, rows)) = self.bounds(corners) else { return };
        let inverse = corners.map(|corner| 1.0 / corner[2]);
        for row in rows {
            let y = row as f64 + 0.5;
            for column in columns.clone() {
                let x = column as f64 + 0.5;
                let weight =
                    |p: &Corner, q: &Corner| ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / doubled;
                let weights = [weight(b, c), weight(c, a), weight(a, b)];
                if weights.iter().all(|weight| *weight >= 0.0) {
                    let nearness: f64 = weights.iter().zip(&inverse).map(|(weight, inverse)| weight * inverse).sum();
                    visit(self, row * self.width + column, nearness as f32);
                }
            }
        }
    }

    /// Returns the columns and rows that a triangle can cover; `None` if it lies outside.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the image")]
    fn bounds(&self, corners: &[Corner; 3]) -> Option<(std::ops::Range<usize>, std::ops::Range<usize>)> {
        let range = |axis: usize, count: usize| {
            let low = corners.iter().map(|corner| corner[axis]).fold(f64::INFINITY, f64::min);
            let high = corners.iter().map(|corner| corner[axis]).fold(f64::NEG_INFINITY, f64::max);
            let clamped = |value: f64| value.clamp(0.0, count as f64) as usize;
            clamped(low.floor())..clamped(high.ceil())
        };
        let (columns, rows) = (range(0, self.width), range(1, self.height));
        (!columns.is_empty() && !rows.is_empty()).then_some((columns, rows))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_face_hides_the_farther_one_in_any_order() {
        let near = [[0.0, 0.0, 10.0], [8.0, 0.0, 10.0], [0.0, 8.0, 10.0]];
        let far = near.map(|[x, y, _]| [x, y, 20.0]);
        for order in [[(near, 1), (far, 2)], [(far, 2), (near, 1)]] {
            let mut samples = Samples::new(8, 8);
            order.iter().for_each(|(corners, face)| samples.draw(corners, *face));
            assert_eq!(samples.face[0], 1);
            assert_eq!(samples.face[63], 0, "beyond the hypotenuse");
        }
    }

    #[test]
    fn both_orientations_are_drawn_and_triangles_outside_are_not() {
        let triangle = [[1.0, 1.0, 5.0], [6.0, 1.0, 5.0], [1.0, 6.0, 5.0]];
        let covered = |corners: [Corner; 3]| {
            let mut samples = Samples::new(8, 8);
            samples.draw(&corners, 1);
            samples.face.iter().filter(|face| **face == 1).count()
        };
        let [a, b, c] = triangle;
        assert_eq!(covered(triangle), covered([a, c, b]));
        assert!((10..=16).contains(&covered(triangle)));
        assert_eq!(covered(triangle.map(|[x, y, z]| [x - 20.0, y, z])), 0);
    }
}
