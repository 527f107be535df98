//! Freed memory that goes back to the operating system.
//!
//! The GNU C library gives each thread a heap of its own, and keeps there what the thread frees. What the worker threads of a campaign have
//! freed would stay in the process while recordings need memory in another heap: some 5 MB for each thread with the full sensors.

/// Gives the operating system the pages that no allocation uses, of all heaps. Does nothing with another C library.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(crate) fn return_free_memory() {
    /// Number of bytes to keep at the end of the heap, besides what is used (B).
    const KEPT: usize = 0;
    #[expect(unsafe_code, reason = "a function of the C library's allocator without a safe counterpart")]
    // SAFETY: the function locks each heap that it looks at, and touches only memory that is free.
    unsafe {
        libc::malloc_trim(KEPT);
    }
}

/// Gives the operating system the pages that no allocation uses, of all heaps. Does nothing with another C library.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(crate) fn return_free_memory() {}
