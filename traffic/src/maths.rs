//! Mathematical functions whose results have the same bits on every processor and system.
//!
//! `f64::sin` and similar functions call the C library. That library may have several versions of a
//! function, and select one by the features of the processor. The GNU C library selects by fused
//! multiply-add and AVX2. The last digits of the versions differ. The functions of this module come
//! from the crate [`libm`], which consists of IEEE 754 operations only. `.ci/clippy.toml` forbids
//! the others in the whole workspace.
//!
//! Functions with exact results, such as `sqrt`, `floor` and `mul_add`, come from the standard
//! library: IEEE 754 leaves no choice.

/// Defines functions by the functions of `libm` for double and for single precision.
macro_rules! define {
    ($($(#[$doc:meta])+ $name:ident($($argument:ident),+) = $double:ident, $single:ident;)+) => {
        mod sealed {
            /// The functions of one type of numbers.
            pub trait Functions: Sized {
                $(fn $name($($argument: Self),+) -> Self;)+
                fn sin_cos(x_rad: Self) -> (Self, Self);
            }

            impl Functions for f64 {
                $(#[inline]
                fn $name($($argument: Self),+) -> Self {
                    libm::$double($($argument),+)
                })+

                #[inline]
                fn sin_cos(x_rad: Self) -> (Self, Self) {
                    libm::sincos(x_rad)
                }
            }

            impl Functions for f32 {
                $(#[inline]
                fn $name($($argument: Self),+) -> Self {
                    libm::$single($($argument),+)
                })+

                #[inline]
                fn sin_cos(x_rad: Self) -> (Self, Self) {
                    libm::sincosf(x_rad)
                }
            }
        }

        $(
            $(#[$doc])+
            #[inline]
            #[must_use]
            pub fn $name<T: Real>($($argument: T),+) -> T {
                T::$name($($argument),+)
            }
        )+
    };
}

/// A number of double or of single precision: `f64` or `f32`.
pub trait Real: sealed::Functions {}

impl Real for f64 {}
impl Real for f32 {}

define! {
    /// Sine of an angle (rad).
    sin(x_rad) = sin, sinf;
    /// Cosine of an angle (rad).
    cos(x_rad) = cos, cosf;
    /// Tangent of an angle (rad).
    tan(x_rad) = tan, tanf;
    /// Angle whose sine is `x` (rad).
    asin(x) = asin, asinf;
    /// Angle whose cosine is `x` (rad).
    acos(x) = acos, acosf;
    /// Angle between -π/2 and π/2 whose tangent is `x` (rad).
    atan(x) = atan, atanf;
    /// Direction of the vector (`x`, `y`), between -π and π (rad).
    atan2(y, x) = atan2, atan2f;
    /// Hyperbolic tangent.
    tanh(x) = tanh, tanhf;
    /// e to the power of `x`.
    exp(x) = exp, expf;
    /// 2 to the power of `x`.
    exp2(x) = exp2, exp2f;
    /// e to the power of `x`, minus 1. Accurate where `x` is small.
    exp_m1(x) = expm1, expm1f;
    /// Natural logarithm.
    ln(x) = log, logf;
    /// Natural logarithm of 1 + `x`. Accurate where `x` is small.
    ln_1p(x) = log1p, log1pf;
    /// Logarithm to base 2.
    log2(x) = log2, log2f;
    /// Logarithm to base 10.
    log10(x) = log10, log10f;
    /// `x` to the power of `y`.
    powf(x, y) = pow, powf;
    /// Cube root.
    cbrt(x) = cbrt, cbrtf;
    /// Length of the vector (`x`, `y`), without overflow on the way.
    hypot(x, y) = hypot, hypotf;
    /// Complementary error function.
    erfc(x) = erfc, erfcf;
}

/// Sine and cosine of an angle (rad).
#[inline]
#[must_use]
pub fn sin_cos<T: Real>(x_rad: T) -> (T, T) {
    T::sin_cos(x_rad)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn sine_and_cosine_together_equal_the_single_functions(x_rad in -50.0..50.0_f64) {
            let (sine, cosine): (f64, f64) = sin_cos(x_rad);
            prop_assert_eq!((sine.to_bits(), cosine.to_bits()), (sin(x_rad).to_bits(), cos(x_rad).to_bits()));
            let x_rad = x_rad as f32;
            let (sine, cosine): (f32, f32) = sin_cos(x_rad);
            prop_assert_eq!((sine.to_bits(), cosine.to_bits()), (sin(x_rad).to_bits(), cos(x_rad).to_bits()));
        }
    }

    #[test]
    #[expect(clippy::disallowed_methods, reason = "the functions of the standard library are the reference")]
    fn the_names_agree_with_the_standard_library() {
        let close = |ours: f64, reference: f64| assert!((ours - reference).abs() < 1e-15, "{ours} {reference}");
        let (x, y) = (0.7_f64, 0.4_f64);
        close(sin(x), x.sin());
        close(cos(x), x.cos());
        close(tan(x), x.tan());
        close(asin(x), x.asin());
        close(acos(x), x.acos());
        close(atan(x), x.atan());
        close(atan2(y, -x), y.atan2(-x));
        close(tanh(x), x.tanh());
        close(exp(x), x.exp());
        close(exp_m1(x), x.exp_m1());
        close(ln(x), x.ln());
        close(ln_1p(x), x.ln_1p());
        close(log2(x), x.log2());
        close(log10(x), x.log10());
        close(powf(x, y), x.powf(y));
        close(cbrt(x), x.cbrt());
        close(hypot(x, y), x.hypot(y));
    }
}
