//! The floating-point environment of a thread: rounding mode, treatment of subnormal numbers, and
//! exceptions.
//!
//! Foreign code may change it and not restore it: with `fesetround`, or with the start-up code that
//! `-ffast-math` links into a library. The simulation after the call would then compute other
//! numbers. The environment is therefore restored after each call.

#![expect(unsafe_code, reason = "the registers of the floating-point environment are read and written")]

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use std::arch::asm;

/// The floating-point environment, which is restored when this value is dropped. On other
/// processors than x86-64 and AArch64, nothing is kept.
#[derive(Debug, PartialEq, Eq)]
pub struct Arithmetic {
    #[cfg(target_arch = "x86_64")]
    mxcsr: u32,
    #[cfg(target_arch = "x86_64")]
    x87: u16,
    #[cfg(target_arch = "aarch64")]
    fpcr: u64,
}

impl Arithmetic {
    /// Keeps the environment of this thread.
    #[cfg(target_arch = "x86_64")]
    #[inline(never)]
    pub fn keep() -> Self {
        let (mut mxcsr, mut x87) = (0_u32, 0_u16);
        // SAFETY: both instructions write to the variables that they are given.
        unsafe {
            asm!("stmxcsr [{}]", in(reg) &raw mut mxcsr, options(nostack, preserves_flags));
            asm!("fnstcw [{}]", in(reg) &raw mut x87, options(nostack, preserves_flags));
        }
        Self { mxcsr, x87 }
    }

    /// Keeps the environment of this thread.
    #[cfg(target_arch = "aarch64")]
    #[inline(never)]
    pub fn keep() -> Self {
        let fpcr: u64;
        // SAFETY: the instruction reads a register.
        unsafe { asm!("mrs {}, fpcr", out(reg) fpcr, options(nostack, preserves_flags)) };
        Self { fpcr }
    }

    /// Keeps nothing.
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    pub fn keep() -> Self {
        Self {}
    }
}

impl Drop for Arithmetic {
    #[cfg(target_arch = "x86_64")]
    #[inline(never)]
    fn drop(&mut self) {
        // SAFETY: the values come from an earlier read of the same registers. A pending exception
        // is cleared first, since loading the control word would raise it.
        unsafe {
            asm!("fnclex", options(nostack, preserves_flags));
            asm!("fldcw [{}]", in(reg) &raw const self.x87, options(nostack, preserves_flags));
            asm!("ldmxcsr [{}]", in(reg) &raw const self.mxcsr, options(nostack, preserves_flags));
        }
    }

    #[cfg(target_arch = "aarch64")]
    #[inline(never)]
    fn drop(&mut self) {
        // SAFETY: the value comes from an earlier read of the same register.
        unsafe { asm!("msr fpcr, {}", in(reg) self.fpcr, options(nostack, preserves_flags)) };
    }

    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    fn drop(&mut self) {}
}

#[cfg(all(test, unix, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use std::ffi::c_int;
    use std::hint::black_box;

    use super::*;

    /// `FE_UPWARD` of the C library.
    #[cfg(target_arch = "x86_64")]
    const UPWARD: c_int = 0x800;
    #[cfg(target_arch = "aarch64")]
    const UPWARD: c_int = 0x40_0000;

    unsafe extern "C" {
        fn fesetround(mode: c_int) -> c_int;
    }

    fn third() -> f64 {
        black_box(1.0) / black_box(3.0)
    }

    #[test]
    fn another_rounding_mode_does_not_stay() {
        let nearest = third();
        let kept = Arithmetic::keep();
        // SAFETY: the value is a rounding mode.
        assert_eq!(unsafe { fesetround(UPWARD) }, 0);
        let upward = third();
        drop(kept);
        assert!(upward > nearest);
        assert_eq!(third().to_bits(), nearest.to_bits());
        assert_eq!(Arithmetic::keep(), Arithmetic::keep());
    }
}
