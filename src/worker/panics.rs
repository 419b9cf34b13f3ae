//! Where a panic happened, for messages and the log.

use std::panic::{set_hook, take_hook};
use std::sync::{Mutex, PoisonError};

/// Source file and line of the latest panic of any thread.
static LATEST: Mutex<Option<String>> = Mutex::new(None);

/// Has every panic logged with its file and line. Those off the main thread are caught and become
/// error messages: those of decoders on damaged files, and the worker's. Rust's own report of them
/// only confuses, unless RUST_BACKTRACE asks for it.
pub fn record_panics() {
    let report = take_hook();
    let reports_all = std::env::var_os("RUST_BACKTRACE").is_some();
    set_hook(Box::new(move |panic| {
        let thread = std::thread::current();
        let place = panic.location().map(|place| format!("{}:{}", place.file(), place.line()));
        log::error!(
            "panic at {} in the thread {}: {}",
            place.as_deref().unwrap_or("an unknown place"),
            thread.name().unwrap_or("without a name"),
            message(panic.payload())
        );
        *LATEST.lock().unwrap_or_else(PoisonError::into_inner) = place;
        if reports_all || thread.name() == Some("main") {
            report(panic);
        }
    }));
}

/// Source file and line of the latest panic, once.
pub(super) fn latest_place() -> Option<String> {
    LATEST.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// What a panic said.
pub(super) fn message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}
