//! The mathematical functions of a program, the same on every processor and system.
//!
//! `f64::sin` and its like are calls of the C library, which may have several versions of a function and select one by what the processor can do (the GNU
//! C library by fused multiply-add and AVX2); their last digits differ. This crate defines these functions under the names by which they are called,
//! with the code of the crate [`libm`], which consists of IEEE 754 operations only. The linker then takes these for all
//! calls of the program, also for those of libraries such as `rand_distr` and `statrs`:
//!
//! ```text
//!   program, its crates and libraries ── sin, exp, powf, … ─▶ this crate ─▶ libm
//!   shared libraries that it loads    ── sin, exp, powf, … ─▶ the C library
//! ```
//!
//! A crate needs no more than `use closecall_mathematics as _;`. A shared library that is made of such crates must be linked with
//! `-Bsymbolic-functions`, because its calls would otherwise go to the program that loads it.
//!
//! Left out are functions whose results are exact, such as `sqrt`, `floor`, `fma` and `fmod`: IEEE 754 or their definition leaves no choice.
//! `asinh` and the like are composed of these by Rust's standard library.

#![expect(
    unsafe_code,
    reason = "the functions have the names and signatures of the C standard, by which they are called"
)]

/// Defines functions of `libm` under their names in C.
macro_rules! define {
    ($number:ty: $($name:ident($($argument:ident),+))+) => {$(
        #[unsafe(no_mangle)]
        extern "C" fn $name($($argument: $number),+) -> $number {
            libm::$name($($argument),+)
        }
    )+};
}

define! {
    f64:
    sin(x) cos(x) tan(x) asin(x) acos(x) atan(x) atan2(y, x)
    sinh(x) cosh(x) tanh(x)
    exp(x) exp2(x) exp10(x) expm1(x) log(x) log2(x) log10(x) log1p(x)
    pow(x, y) cbrt(x) hypot(x, y)
}

define! {
    f32:
    sinf(x) cosf(x) tanf(x) asinf(x) acosf(x) atanf(x) atan2f(y, x)
    sinhf(x) coshf(x) tanhf(x)
    expf(x) exp2f(x) exp10f(x) expm1f(x) logf(x) log2f(x) log10f(x) log1pf(x)
    powf(x, y) cbrtf(x) hypotf(x, y)
}

/// Sine and cosine of one angle (rad): the compiler asks for both at once where it sees both.
#[unsafe(no_mangle)]
extern "C" fn sincos(x: f64, sine: &mut f64, cosine: &mut f64) {
    (*sine, *cosine) = libm::sincos(x);
}

/// Like [`sincos`], in single precision.
#[unsafe(no_mangle)]
extern "C" fn sincosf(x: f32, sine: &mut f32, cosine: &mut f32) {
    (*sine, *cosine) = libm::sincosf(x);
}

#[cfg(test)]
mod tests;
