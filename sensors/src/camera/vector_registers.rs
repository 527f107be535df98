//! Restores the vector registers after inference.
//!
//! The matrix kernels of tract 0.23 for AVX2 and AVX-512 are written in assembly and return with
//! values in the upper parts of the vector registers. On most processors every later instruction of
//! the older SSE set, which the compiler generates for all other code, then depends on these values
//! or costs extra, until a `vzeroupper` clears them (Intel, *64 and IA-32 Architectures
//! Optimization Reference Manual*, "Mixing AVX code with SSE code"). The instruction changes no
//! value that Rust code can observe.

/// Clears the upper parts of the vector registers, if the processor has them.
pub(super) fn clear_upper_parts() {
    #[cfg(target_arch = "x86_64")]
    if let Some(level) = fearless_simd::Level::new().as_avx2() {
        vzeroupper(level);
    }
}

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    fn vzeroupper(level: Avx2) {
        std::arch::x86_64::_mm256_zeroupper();
    }
);
