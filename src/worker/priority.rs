//! A lower priority for the background threads of the window, so that on a machine with few cores a
//! frame does not wait for them.

/// Lowers the priority of this thread, where that is possible.
pub fn lower() {
    #[cfg(target_os = "linux")]
    // SAFETY: takes numbers only. On Linux, process 0 is the calling thread. Whether it succeeds
    // changes no result.
    unsafe {
        libc::setpriority(libc::PRIO_PROCESS, 0, 10);
    }
}

/// Starts the threads of parallel work with the lower priority.
pub fn lower_all() {
    // Threads that run already, as in tests with several windows, keep their priority.
    let _ = rayon::ThreadPoolBuilder::new().start_handler(|_| lower()).build_global();
}
