//! One target a reader: the name of the binary says which (`cargo fuzz run ply`).
#![no_main]

#[path = "../readers.rs"]
mod readers;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let name = env!("CARGO_BIN_NAME");
    let reader = readers::READERS.iter().find(|(own, ..)| *own == name);
    (reader.expect("a reader of the target's name").2)(bytes);
});
