//! Work of the window's threads gives way to the thread that draws: on a machine of few cores a frame
//! would wait for them.

/// Lowers the priority of this thread, where that is possible.
pub fn lower() {
    #[cfg(target_os = "linux")]
    // SAFETY: takes numbers only. On Linux, process 0 is the calling thread. Whether it succeeds
    // changes no result.
    unsafe {
        libc::setpriority(libc::PRIO_PROCESS, 0, 10);
    }
}

/// The same for the threads that parallel work is shared among, of which there are none yet.
pub fn lower_all() {
    // Where there are some, as in tests with several windows, they stay as they are.
    let _ = rayon::ThreadPoolBuilder::new().start_handler(|_| lower()).build_global();
}
