//! The functions that a program calls are those of `libm`. This is another crate than the one that defines them, so that the linker decides
//! which are called.

use std::hint::black_box;

use closecall_mathematics as _;
use proptest::prelude::*;

#[expect(unsafe_code, reason = "what the compiler calls for a power of 10")]
mod powers_of_ten {
    unsafe extern "C" {
        pub(crate) safe fn exp10(x: f64) -> f64;
        pub(crate) safe fn exp10f(x: f32) -> f32;
    }
}

/// Compares a function of the standard library with that of `libm`, bit by bit.
macro_rules! assert_same {
    ($($called:expr => $libm:ident($($argument:expr),+);)+) => {$(
        prop_assert_eq!((stringify!($libm), $called.to_bits()), (stringify!($libm), libm::$libm($($argument),+).to_bits()));
    )+};
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn functions_of_double_precision_are_those_of_libm(x in -50.0..50.0, unit in -1.0..1.0, y in -3.0..3.0) {
        // The black boxes keep the compiler from computing values itself.
        let (x, unit, y) = (black_box::<f64>(x), black_box::<f64>(unit), black_box::<f64>(y));
        let positive = black_box(x.abs());
        assert_same! {
            x.sin() => sin(x); x.cos() => cos(x); x.tan() => tan(x);
            unit.asin() => asin(unit); unit.acos() => acos(unit); x.atan() => atan(x); x.atan2(y) => atan2(x, y);
            y.sinh() => sinh(y); y.cosh() => cosh(y); y.tanh() => tanh(y);
            x.exp() => exp(x); x.exp2() => exp2(x); y.exp_m1() => expm1(y); powers_of_ten::exp10(y) => exp10(y);
            positive.ln() => log(positive); positive.log2() => log2(positive); positive.log10() => log10(positive);
            positive.ln_1p() => log1p(positive); positive.powf(y) => pow(positive, y);
            x.cbrt() => cbrt(x); x.hypot(y) => hypot(x, y);
        }
    }

    #[test]
    fn functions_of_single_precision_are_those_of_libm(x in -50.0_f32..50.0, unit in -1.0_f32..1.0, y in -3.0_f32..3.0) {
        let (x, unit, y) = (black_box(x), black_box(unit), black_box(y));
        let positive = black_box(x.abs());
        assert_same! {
            x.sin() => sinf(x); x.cos() => cosf(x); x.tan() => tanf(x);
            unit.asin() => asinf(unit); unit.acos() => acosf(unit); x.atan() => atanf(x); x.atan2(y) => atan2f(x, y);
            y.sinh() => sinhf(y); y.cosh() => coshf(y); y.tanh() => tanhf(y);
            x.exp() => expf(x); x.exp2() => exp2f(x); y.exp_m1() => expm1f(y); powers_of_ten::exp10f(y) => exp10f(y);
            positive.ln() => logf(positive); positive.log2() => log2f(positive); positive.log10() => log10f(positive);
            positive.ln_1p() => log1pf(positive); positive.powf(y) => powf(positive, y);
            x.cbrt() => cbrtf(x); x.hypot(y) => hypotf(x, y);
        }
    }

    #[test]
    fn sine_and_cosine_together_are_those_of_libm(x in -50.0..50.0) {
        let both = f64::sin_cos(black_box(x));
        prop_assert_eq!((both.0.to_bits(), both.1.to_bits()), (libm::sin(x).to_bits(), libm::cos(x).to_bits()));
        #[expect(clippy::cast_possible_truncation, reason = "an angle in single precision is meant")]
        let x = black_box(x as f32);
        let both = x.sin_cos();
        prop_assert_eq!((both.0.to_bits(), both.1.to_bits()), (libm::sinf(x).to_bits(), libm::cosf(x).to_bits()));
    }
}
