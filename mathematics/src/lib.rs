//! The mathematical functions of a program, the same on every processor and system.
//!
//! `f64::sin` and its like are calls of the C library, which may have several versions of a function and select one by what the processor can do (the GNU
//! C library by fused multiply-add and AVX2); their last digits differ. This crate defines these functions under the names by which they are called,
//! with the code of the crate [`libm`], which consists of IEEE 754 operations only. The linker then takes these for the
//! calls of the program, also for those of libraries such as `rand_distr` and `statrs`:
//!
//! ```text
//!   program, its crates and libraries ── sin, exp, powf, … ─▶ this crate ─▶ libm
//!   shared libraries that it loads    ── sin, exp, powf, … ─▶ the C library
//! ```
//!
//! A crate needs no more than `use closecall_mathematics as _;`. A program, or a shared library that is made of such crates, must be linked with
//! `--exclude-libs,ALL` where the linker makes ELF files: the shared libraries that a program loads would otherwise call its functions, and a
//! shared library those of the program that loads it.
//!
//! Calls with constant arguments are computed by the compiler, so that two builds of one source may differ in the last digit of a constant.
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
#[cfg(not(target_vendor = "apple"))]
mod both {
    use std::mem::MaybeUninit;

    #[unsafe(no_mangle)]
    extern "C" fn sincos(x: f64, sine: &mut MaybeUninit<f64>, cosine: &mut MaybeUninit<f64>) {
        let both = libm::sincos(x);
        sine.write(both.0);
        cosine.write(both.1);
    }

    #[unsafe(no_mangle)]
    extern "C" fn sincosf(x: f32, sine: &mut MaybeUninit<f32>, cosine: &mut MaybeUninit<f32>) {
        let both = libm::sincosf(x);
        sine.write(both.0);
        cosine.write(both.1);
    }
}

/// The names under which the compiler asks for both on Apple's systems.
#[cfg(target_vendor = "apple")]
mod both {
    /// Sine and cosine.
    #[repr(C)]
    struct Both<T>(T, T);

    #[unsafe(no_mangle)]
    extern "C" fn __sincos_stret(x: f64) -> Both<f64> {
        let (sine, cosine) = libm::sincos(x);
        Both(sine, cosine)
    }

    #[unsafe(no_mangle)]
    extern "C" fn __sincosf_stret(x: f32) -> Both<f32> {
        let (sine, cosine) = libm::sincosf(x);
        Both(sine, cosine)
    }

    #[unsafe(no_mangle)]
    extern "C" fn __exp10(x: f64) -> f64 {
        libm::exp10(x)
    }

    #[unsafe(no_mangle)]
    extern "C" fn __exp10f(x: f32) -> f32 {
        libm::exp10f(x)
    }
}
