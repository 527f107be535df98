//! The `closecall` program.

/// Size from which an allocation has pages of its own, which return to the system when it is freed (B): the initial value of the GNU C
/// library.
///
/// The library raises it to the size of the largest such allocation that has been freed. The buffers of a run, some hundred
/// kilobytes each, then stay in the heap of each thread: 6 MB more for two threads with the full sensors.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const OWN_PAGES_FROM: std::ffi::c_int = 128 * 1024;

/// Keeps that size from growing.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_large_allocations_out_of_the_heap() {
    #[expect(unsafe_code, reason = "an option of the C library's allocator, set before there are other threads")]
    // SAFETY: the call changes a parameter of the allocator, and no other thread allocates.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, OWN_PAGES_FROM);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn keep_large_allocations_out_of_the_heap() {}

fn main() -> std::process::ExitCode {
    keep_large_allocations_out_of_the_heap();
    closecall::cli::main(&std::env::args_os().collect::<Vec<_>>()).into()
}
