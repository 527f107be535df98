//! The inverse of the complementary error function, accurate to 11 digits, with the same bits on
//! every processor.
//!
//! The fits come from the crate `statrs` 0.19 (from Math.NET and Boost); a test compares both. That
//! crate calls the logarithm of the C library, whose last digit depends on the processor. Here the
//! logarithm comes from [`crate::maths`].

use crate::maths::ln;

/// A fit by a quotient of two polynomials and an offset.
struct Fit {
    offset: f64,
    /// Coefficients from the lowest power on.
    numerator: &'static [f64],
    /// Coefficients from the lowest power on.
    denominator: &'static [f64],
}

impl Fit {
    fn quotient(&self, x: f64) -> f64 {
        let polynomial = |coefficients: &[f64]| coefficients.iter().rev().fold(0.0, |sum, value| sum * x + value);
        polynomial(self.numerator) / polynomial(self.denominator)
    }
}

/// Returns the x for which erfc(x) is `value`.
pub fn erfc_inv(value: f64) -> f64 {
    if value <= 0.0 {
        f64::INFINITY
    } else if value >= 2.0 {
        f64::NEG_INFINITY
    } else if value > 1.0 {
        -right(value - 1.0, 2.0 - value)
    } else {
        right(1.0 - value, value)
    }
}

/// Returns the x ≥ 0 for which erf(x) is `p` and erfc(x) is `q` = 1 - `p`.
fn right(p: f64, q: f64) -> f64 {
    if p <= 0.5 {
        let factor = p * (p + 10.0);
        factor * MIDDLE.offset + factor * MIDDLE.quotient(p)
    } else if q >= 0.25 {
        (-2.0 * ln(q)).sqrt() / (SHOULDER.offset + SHOULDER.quotient(q - 0.25))
    } else {
        let x = (-ln(q)).sqrt();
        // The last interval is open: there is always one that ends behind x.
        let at = TAIL.iter().position(|(end, ..)| x < *end).unwrap_or(TAIL.len() - 1);
        let (_, origin, fit) = &TAIL[at];
        fit.offset * x + fit.quotient(x - origin) * x
    }
}

/// For probabilities from 0.5 to 1.5.
const MIDDLE: Fit = Fit {
    offset: 0.08913147449493408,
    numerator: &[
        -0.0005087819496582806,
        -0.008368748197417368,
        0.03348066254097446,
        -0.012692614766297404,
        -0.03656379714117627,
        0.02198786811111689,
        0.008226878746769157,
        -0.005387729650712429,
    ],
    denominator: &[
        1.0,
        -0.9700050433032906,
        -1.5657455823417585,
        1.5622155839842302,
        0.662328840472003,
        -0.7122890234154284,
        -0.05273963823400997,
        0.07952836873415717,
        -0.0023339375937419,
        0.0008862163904564247,
    ],
};

/// For probabilities from 0.25 to 0.5.
const SHOULDER: Fit = Fit {
    offset: 2.249481201171875,
    numerator: &[
        -0.20243350835593876,
        0.10526468069939171,
        8.3705032834312,
        17.644729840837403,
        -18.851064805871424,
        -44.6382324441787,
        17.445385985570866,
        21.12946554483405,
        -3.6719225470772936,
    ],
    denominator: &[
        1.0,
        6.242641248542475,
        3.971343795334387,
        -28.66081804998,
        -20.14326346804852,
        48.560921310873994,
        10.826866735546016,
        -22.643693341313973,
        1.7211476576120028,
    ],
};

/// For smaller probabilities: the end of each interval of √(-ln q), the origin of its polynomials,
/// and the fit.
const TAIL: [(f64, f64, Fit); 5] = [
    (
        3.0,
        1.125,
        Fit {
            offset: 0.807220458984375,
            numerator: &[
                -0.1311027816799519,
                -0.16379404719331705,
                0.11703015634199525,
                0.38707973897260434,
                0.3377855389120359,
                0.14286953440815717,
                0.029015791000532906,
                0.0021455899538880526,
                -6.794655751811263e-07,
                2.8522533178221704e-08,
                -6.81149956853777e-10,
            ],
            denominator: &[
                1.0,
                3.4662540724256723,
                5.381683457070069,
                4.778465929458438,
                2.5930192162362027,
                0.848854343457902,
                0.15226433829533179,
                0.011059242293464892,
            ],
        },
    ),
    (
        6.0,
        3.0,
        Fit {
            offset: 0.9399557113647461,
            numerator: &[
                -0.0350353787183178,
                -0.0022242652921344794,
                0.018557330651423107,
                0.009508047013259196,
                0.0018712349281955923,
                0.00015754461742496055,
                4.60469890584318e-06,
                -2.304047769118826e-10,
                2.6633922742578204e-12,
            ],
            denominator: &[
                1.0,
                1.3653349817554064,
                0.7620591645536234,
                0.22009110576413124,
                0.03415891436709477,
                0.00263861676657016,
                7.646752923027944e-05,
            ],
        },
    ),
    (
        18.0,
        6.0,
        Fit {
            offset: 0.9836282730102539,
            numerator: &[
                -0.016743100507663373,
                -0.0011295143874558028,
                0.001056288621524929,
                0.00020938631748758808,
                1.4962478375834237e-05,
                4.4969678992770644e-07,
                4.625961635228786e-09,
                -2.811287356288318e-14,
                9.905570997331033e-17,
            ],
            denominator: &[
                1.0,
                0.5914293448864175,
                0.1381518657490833,
                0.016074608709367652,
                0.0009640118070051656,
                2.7533547476472603e-05,
                2.82243172016108e-07,
            ],
        },
    ),
    (
        44.0,
        18.0,
        Fit {
            offset: 0.9971456527709961,
            numerator: &[
                -0.002497821279189813,
                -7.79190719229054e-06,
                2.5472303741302746e-05,
                1.6239777734251093e-06,
                3.963410113048012e-08,
                4.116328311909442e-10,
                1.4559628671867504e-12,
                -1.1676501239718427e-18,
            ],
            denominator: &[
                1.0,
                0.2071231122144225,
                0.01694108381209759,
                0.0006905382656226846,
                1.4500735981823264e-05,
                1.4443775662814415e-07,
                5.097612765997785e-10,
            ],
        },
    ),
    (
        f64::INFINITY,
        44.0,
        Fit {
            offset: 0.9994134902954102,
            numerator: &[
                -0.0005390429110190785,
                -2.8398759004727723e-07,
                8.994651148922914e-07,
                2.2934585926592085e-08,
                2.2556144486350015e-10,
                9.478466275030226e-13,
                1.3588013010892486e-15,
                -3.4889039339994887e-22,
            ],
            denominator: &[
                1.0,
                0.08457462340018994,
                0.002820929847262647,
                4.682929219408942e-05,
                3.999688121938621e-07,
                1.6180929088790448e-09,
                2.315586083102596e-12,
            ],
        },
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_equal_statrs() {
        let inner = (1..40_000).map(|step| f64::from(step) / 20_000.0);
        // Powers of 10, down to the smallest number.
        let outer = (0..3_200).map(|step| crate::maths::powf(10.0, -0.1 * f64::from(step)));
        for value in inner.chain(outer).chain([0.0, -1.0, 2.0, 3.0, f64::MIN_POSITIVE]) {
            let (x, expected) = (erfc_inv(value), statrs::function::erf::erfc_inv(value));
            // The logarithm of the C library may differ in the last digit.
            let is_close = x == expected || (x - expected).abs() <= 2.0 * f64::EPSILON * expected.abs();
            assert!(is_close, "{value}: {x} {expected}");
        }
    }
}
