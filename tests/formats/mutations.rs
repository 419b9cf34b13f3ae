//! Every reader on changed copies of its stored files: it ends in a value or a message, soon, and
//! without a panic. Bounded, the same on every run; `LOBELIA_FUZZ_SECONDS` makes it as long as that
//! for each reader, `LOBELIA_FUZZ_READER` picks one, and `LOBELIA_FUZZ_SEED` another beginning. The
//! fuzz targets of `fuzz/` drive the same readers by coverage.

use std::time::{Duration, Instant};

use crate::data;

#[path = "../../fuzz/readers.rs"]
mod readers;

/// Changes a reader without a time limit, in one test run of all.
const CHANGES: u64 = 1500;
/// A hang, also on a machine that does ten other things; files of the corpus take milliseconds.
const PATIENCE: Duration = Duration::from_secs(60);

/// Marsaglia's xorshift64.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, end: usize) -> usize {
        (self.roll() % end.max(1) as u64) as usize
    }
}

/// What makes readers stumble.
const WORDS: [&[u8]; 24] = [
    b"nan",
    b"-1",
    b"0",
    b"1e999",
    b"99999999999999999999",
    b"4294967295",
    b"2147483648",
    b"-0",
    b"\"",
    b"[",
    b"{",
    b"}",
    b"<",
    b">",
    b",",
    b"\n",
    b"\0",
    b"\xFF\xFE",
    b"#",
    b" ",
    b"inf",
    b"\xFF\xFF\xFF\xFF\xFF\xFF\xFF\x7F",
    b"\0\0\0\x80",
    b"1e-45",
];

fn change(bytes: &[u8], other: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..1 + dice.below(6) {
        let at = dice.below(bytes.len() + 1);
        let end = (at + dice.below(24)).min(bytes.len());
        let word = WORDS[dice.below(WORDS.len())];
        match dice.below(9) {
            0 | 1 if at < bytes.len() => bytes[at] ^= 1 << dice.below(8),
            2 if at < bytes.len() => bytes[at] = dice.roll() as u8,
            3 => drop(bytes.splice(at..at, word.iter().copied())),
            4 => {
                let end = (at + word.len()).min(bytes.len());
                bytes.splice(at..end, word.iter().copied());
            }
            5 => drop(bytes.drain(at..end)),
            6 => {
                let copy = bytes[at..end].to_vec();
                let to = dice.below(bytes.len() + 1);
                bytes.splice(to..to, copy);
            }
            7 if dice.below(8) == 0 => bytes.truncate(at),
            8 => {
                let from = dice.below(other.len() + 1);
                let until = (from + dice.below(64)).min(other.len());
                bytes.splice(at..end, other[from..until].iter().copied());
            }
            _ => {}
        }
    }
    bytes
}

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

#[test]
fn changed_files_end_in_a_value_or_a_message() {
    let only = std::env::var("LOBELIA_FUZZ_READER").ok();
    let limit = number("LOBELIA_FUZZ_SECONDS").map(Duration::from_secs);
    let seed = number("LOBELIA_FUZZ_SEED").unwrap_or(1);
    for (name, corpus, read) in readers::READERS {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let corpus: Vec<Vec<u8>> =
            corpus.iter().map(|path| std::fs::read(data(path)).unwrap()).collect();
        let mut dice = Dice(0x9E37_79B9_7F4A_7C15 ^ (seed << 32) ^ name.len() as u64);
        let (began, mut count, mut slowest) = (Instant::now(), 0, Duration::ZERO);
        while limit.map_or(count < CHANGES, |limit| began.elapsed() < limit) {
            let (first, second) = (dice.below(corpus.len()), dice.below(corpus.len()));
            let changed = change(&corpus[first], &corpus[second], &mut dice);
            let started = Instant::now();
            let outcome = std::panic::catch_unwind(|| read(&changed));
            slowest = slowest.max(started.elapsed());
            if outcome.is_err() || slowest > PATIENCE {
                let kept = std::env::temp_dir().join(format!("lobelia-{name}-{count}"));
                std::fs::write(&kept, &changed).unwrap();
                panic!("{name}: change {count} takes {slowest:?} or panics: {}", kept.display());
            }
            count += 1;
        }
        println!("{name}: {count} changed files, the slowest in {slowest:?}");
    }
}
