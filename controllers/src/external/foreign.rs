//! Calls of functions of a library that an exception of C++ must not leave.
//!
//! Rust cannot catch an exception of another language, nor read its text. The runtime of C++ can: it
//! ends the process with the type and the text of an exception that nothing catches. On Linux with
//! x86-64, a call therefore looks like the first function of a thread:
//!
//! ```text
//!  Rust ──▶ barrier: no caller in its unwind table ──▶ run ──▶ function of the library ──▶ throw
//!           └─ names the function ◀─────────── search for a handler ◀──────────────────────┘
//!              end of the stack ──────────────────────────────────▶ std::terminate: "what(): …"
//! ```
//!
//! Elsewhere the frame of the call names the function as the exception passes it, and ends the
//! process itself. The text of the exception is then lost.

use std::io::{Write as _, stderr};

/// Returns what an exception that leaves a function means for the author of the library.
fn left_text(function: &str) -> String {
    format!(
        "the library threw a C++ exception out of {function}: catch it inside the function, and answer with an error"
    )
}

/// Writes to standard error that an exception leaves a function.
fn tell_left(function: &str) {
    // Nothing else can be done if standard error is closed.
    drop(writeln!(stderr().lock(), "{}", left_text(function)));
}

/// Calls a function of a library, whose name is for messages. If an exception leaves the function,
/// the process writes so to standard error and aborts.
pub fn foreign_call<T>(function: &'static str, call: impl FnOnce() -> T) -> T {
    boundary::call(function, call)
}

#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod boundary {
    #![expect(unsafe_code, reason = "the unwind table of a call is written by hand")]

    use std::arch::naked_asm;
    use std::cell::Cell;
    use std::ffi::{c_int, c_void};
    use std::process::abort;

    /// The answer of a personality routine that has no handler (`_URC_CONTINUE_UNWIND` of the
    /// Itanium C++ ABI).
    const CONTINUE_UNWIND: c_int = 8;
    /// What the classes of C++ exceptions have in common: the last of their eight bytes, which says
    /// whether the exception is a copy, differs. From libstdc++ and from libc++.
    const CPP_CLASSES: [u64; 2] = [u64::from_be_bytes(*b"GNUCC++\0"), u64::from_be_bytes(*b"CLNGC++\0")];
    const LAST_BYTE: u64 = 0xff;

    thread_local! {
        /// The function that the latest call of this thread calls.
        static CALLED: Cell<&'static str> = const { Cell::new("a function of the library") };
    }

    /// A call before and after it.
    struct Slot<F, T> {
        call: Option<F>,
        result: Option<T>,
    }

    pub(super) fn call<T, F: FnOnce() -> T>(function: &'static str, call: F) -> T {
        CALLED.set(function);
        let mut slot = Slot { call: Some(call), result: None };
        // SAFETY: `run` gets the slot of its own type, which lives until `barrier` returns.
        unsafe { barrier((&raw mut slot).cast(), run::<T, F>) };
        // `barrier` returns only after `run` has.
        slot.result.unwrap_or_else(|| abort())
    }

    /// Makes the call of a slot.
    ///
    /// # Safety
    /// The pointer is that of a slot of this type, which nothing else uses.
    unsafe extern "C-unwind" fn run<T, F: FnOnce() -> T>(slot: *mut c_void) {
        // SAFETY: the caller vouches for the pointer.
        let slot = unsafe { &mut *slot.cast::<Slot<F, T>>() };
        slot.result = slot.call.take().map(|call| call());
    }

    /// Calls `run` with `slot`. Its unwind table has no caller: the search for a handler ends here,
    /// after it has asked `search`.
    ///
    /// # Safety
    /// `run` can be called with `slot`.
    #[unsafe(naked)]
    unsafe extern "C-unwind" fn barrier(slot: *mut c_void, run: unsafe extern "C-unwind" fn(*mut c_void)) {
        naked_asm!(
            ".cfi_startproc",
            // The address of `search` is relative to its place in the table, in four bytes.
            ".cfi_personality 0x1b, {search}",
            ".cfi_undefined rip",
            "sub rsp, 8",
            ".cfi_adjust_cfa_offset 8",
            "call rsi",
            "add rsp, 8",
            ".cfi_adjust_cfa_offset -8",
            "ret",
            ".cfi_endproc",
            search = sym search,
        )
    }

    /// Is asked for a handler of an exception that has left the function of the library, and has
    /// none.
    extern "C" fn search(_: c_int, _: c_int, class: u64, _: *mut c_void, _: *mut c_void) -> c_int {
        super::tell_left(CALLED.get());
        if CPP_CLASSES.contains(&(class & !LAST_BYTE)) {
            // The runtime of C++ ends the process, with the text of the exception.
            return CONTINUE_UNWIND;
        }
        // Another runtime may go on after an exception that nothing catches.
        abort();
    }
}

#[cfg(not(all(target_os = "linux", target_arch = "x86_64")))]
mod boundary {
    /// A call of a function, which an exception leaves if this value is dropped.
    struct Left(&'static str);

    impl Drop for Left {
        fn drop(&mut self) {
            super::tell_left(self.0);
            std::process::abort();
        }
    }

    pub(super) fn call<T>(function: &'static str, call: impl FnOnce() -> T) -> T {
        let left = Left(function);
        let result = call();
        std::mem::forget(left);
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_returns_what_the_function_returns() {
        assert_eq!(foreign_call("closecall_controller_abi", || 1), 1);
        let text = "kept".to_owned();
        assert_eq!(foreign_call("closecall_controller_abi", move || text), "kept");
    }

    #[test]
    fn the_message_names_the_function_and_what_to_do() {
        let text = left_text("closecall_controller_step");
        assert!(text.contains("out of closecall_controller_step: catch it inside the function"), "{text}");
    }
}
