//! One target a reader: the name of the binary says which. With cargo-fuzz and a nightly compiler,
//! from the repository's root:
//!
//! ```sh
//! cargo +nightly fuzz run ply fuzz/corpus/ply tests/data/import -- -max_total_time=600
//! ```
#![no_main]

#[path = "../readers.rs"]
mod readers;

use std::panic::catch_unwind;
use std::sync::Once;

use libfuzzer_sys::fuzz_target;

static QUIET: Once = Once::new();

fuzz_target!(|bytes: &[u8]| {
    // Decoders of others panic on some damaged files, which their readers catch and turn into a
    // message. The fuzzer's hook would end at those; only what comes out of a reader is a fault.
    QUIET.call_once(|| std::panic::set_hook(Box::new(|_| ())));
    let name = env!("CARGO_BIN_NAME");
    let reader = readers::READERS.iter().find(|(own, ..)| *own == name);
    let read = reader.expect("a reader of the target's name").2;
    if catch_unwind(|| read(bytes)).is_err() {
        eprintln!("{name}: a panic came out of the reader");
        std::process::abort();
    }
});
