//! The ground as an aerial camera sees it: lanes, markings, shoulders and verges, with patches and
//! grain.

/// Width of a marking (m): 0.15 m on German motorways (RMS).
const MARKING_M: f64 = 0.15;
/// Length of a dash, and of a dash with its gap (m): 6 m and 18 m on German motorways (RMS).
const DASH_M: [f64; 2] = [6.0, 18.0];
/// Paved width beside the outer markings, on the left and on the right (m).
const SHOULDER_M: [f64; 2] = [1.0, 2.5];
/// Linear reflectance of the paint of markings.
const PAINT: f64 = 0.55;

/// The ground along a straight road.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Lateral positions of the markings (m), from the left edge of the road to the right one.
    pub markings_m: Vec<f64>,
    /// Key of the patches and the grain.
    pub key: u64,
    /// Linear reflectance of the pavement (0 to 1).
    pub pavement: f64,
    /// Linear reflectance of the verge: red, green and blue (0 to 1).
    pub verge: [f64; 3],
}

impl Ground {
    /// Creates the ground of a road of dry asphalt and grass.
    pub fn new(markings_m: Vec<f64>, key: u64) -> Self {
        Self { markings_m, key, pavement: 0.12, verge: [0.07, 0.11, 0.03] }
    }

    /// Returns the reflectance at a point: red, green and blue.
    pub(crate) fn albedo(&self, [x_m, y_m]: [f64; 2]) -> [f64; 3] {
        let grain = self.noise(x_m / 0.25, y_m / 0.25, 1) - 0.5;
        let patch = self.noise(x_m / 9.0, y_m / 2.5, 2) - 0.5;
        let (left_m, right_m) = self.edges_m();
        if y_m > left_m + SHOULDER_M[0] || y_m < right_m - SHOULDER_M[1] {
            let tufts = self.noise(x_m / 1.7, y_m / 1.7, 3);
            // Bushes are dark.
            let bush = if self.noise(x_m / 4.0, y_m / 4.0, 4) > 0.8 { 0.45 } else { 1.0 };
            return self.verge.map(|value| value * bush * (0.7 + 0.6 * tufts + 0.3 * grain));
        }
        if self.is_painted(x_m, y_m) {
            return [PAINT * (1.0 + 0.2 * grain); 3];
        }
        // Strips of repaired pavement, and joints across the road.
        let repaired =
            if self.noise((x_m / 23.0).floor() * 5.3, (y_m / 1.8).floor() * 7.1, 5) > 0.9 { 0.6 } else { 1.0 };
        let joint = if (x_m.rem_euclid(41.0)) < 0.2 { 0.7 } else { 1.0 };
        [self.pavement * repaired * joint * (1.0 + 0.35 * patch + 0.35 * grain); 3]
    }

    fn edges_m(&self) -> (f64, f64) {
        (self.markings_m.first().copied().unwrap_or(0.0), self.markings_m.last().copied().unwrap_or(-7.0))
    }

    fn is_painted(&self, x_m: f64, y_m: f64) -> bool {
        let last = self.markings_m.len().saturating_sub(1);
        self.markings_m.iter().enumerate().any(|(index, marking_m)| {
            let is_solid = index == 0 || index == last;
            (y_m - marking_m).abs() < 0.5 * MARKING_M && (is_solid || x_m.rem_euclid(DASH_M[1]) < DASH_M[0])
        })
    }

    /// Returns smooth noise (0 to 1).
    fn noise(&self, x: f64, y: f64, layer: u64) -> f64 {
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let at = |dx: f64, dy: f64| unit(self.key ^ layer << 56, x0 + dx, y0 + dy);
        let top = at(0.0, 0.0) * (1.0 - fx) + at(1.0, 0.0) * fx;
        let bottom = at(0.0, 1.0) * (1.0 - fx) + at(1.0, 1.0) * fx;
        top * (1.0 - fy) + bottom * fy
    }
}

/// Returns a number from 0 to 1 that depends on a key and two whole numbers.
pub(crate) fn unit(key: u64, x: f64, y: f64) -> f64 {
    #[expect(clippy::cast_possible_truncation, reason = "whole numbers, far below 2³¹")]
    let (x, y) = (x as i32, y as i32);
    #[expect(clippy::cast_sign_loss, reason = "the bits of the number are wanted")]
    let mut bits = key ^ (u64::from(x as u32) << 32 | u64::from(y as u32));
    // Finaliser of SplitMix64 (Steele et al., 2014).
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}
