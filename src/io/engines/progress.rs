//! Reads progress from the lines of an engine's log.

use super::Told;
use crate::watch::Watch;

/// Follows a log.
pub(super) struct Steps<'a> {
    watch: &'a Watch,
    tell: &'a dyn Fn(Told),
    photographs: usize,
    name: String,
    total: u64,
    done: u64,
}

impl<'a> Steps<'a> {
    pub fn new(watch: &'a Watch, tell: &'a dyn Fn(Told), photographs: usize) -> Self {
        Self { watch, tell, photographs, name: String::new(), total: 0, done: 0 }
    }

    /// Hands a line on, and counts what it tells.
    pub fn take(&mut self, line: &str) {
        let text = line.strip_prefix("step: ").unwrap_or(line);
        (self.tell)(Told::Line(text.to_owned()));
        let Some((name, done, total)) = step(line, self.photographs) else { return };
        if (name, total) != (self.name.as_str(), self.total) {
            if name != self.name {
                (self.tell)(Told::Step(name.to_owned()));
            }
            (self.name, self.total, self.done) = (name.to_owned(), total, 0);
            self.watch.begin(total);
        }
        // Whether it is cancelled is asked where the program is watched.
        let _ = self.watch.advance(done.saturating_sub(self.done));
        self.done = self.done.max(done);
    }
}

/// The name of a step, what is done of it, and of how much.
fn step(line: &str, photographs: usize) -> Option<(&str, u64, u64)> {
    if let Some(own) = line.strip_prefix("step: ") {
        let (name, _) = own.split_once(" [")?;
        let (done, total) = counts(own)?;
        return Some((name, done, total));
    }
    if line.contains("Processed file [") {
        let (done, total) = counts(line)?;
        return Some(("Extracting features", done, total));
    }
    // Both numbers count blocks of photographs: of the first against the second.
    if line.contains("Processing block [") || line.contains("Matching block [") {
        let inner = line.rsplit_once('[')?.1.split_once(']')?.0;
        let mut pairs = inner.split(',').map(|own| fraction(own.trim()));
        let ((a, rows), (b, columns)) = (pairs.next()??, pairs.next()??);
        let done =
            (a.saturating_sub(1)).saturating_mul(columns).saturating_add(b.saturating_sub(1));
        return Some(("Matching photographs", done, rows.saturating_mul(columns)));
    }
    // COLMAP 3: "Registering image #7 (3)"; 4: "… (num_reg_frames=3)".
    if line.contains("Registering image #") {
        let inner = line.rsplit_once('(')?.1.split_once(')')?.0;
        let number = inner.rsplit('=').next()?;
        return Some(("Placing photographs", number.parse().ok()?, photographs as u64));
    }
    None
}

/// The last `[A/B]` of a line.
fn counts(line: &str) -> Option<(u64, u64)> {
    fraction(line.rsplit_once('[')?.1.split_once(']')?.0)
}

fn fraction(text: &str) -> Option<(u64, u64)> {
    let (done, total) = text.split_once('/')?;
    Some((done.parse().ok()?, total.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_all_engines_are_understood() {
        let known = [
            ("step: Matching pairs [15/190]", ("Matching pairs", 15, 190)),
            (
                "I2026 1 feature_extraction.cc:270] Processed file [3/4]",
                ("Extracting features", 3, 4),
            ),
            ("Processed file [1/12]", ("Extracting features", 1, 12)),
            ("x] Processing block [2/3, 1/3]", ("Matching photographs", 3, 9)),
            ("Matching block [1/1, 1/1]", ("Matching photographs", 0, 1)),
            ("x] Registering image #2 (num_reg_frames=5)", ("Placing photographs", 5, 9)),
            ("Registering image #3 (4)", ("Placing photographs", 4, 9)),
        ];
        for (line, expected) in known {
            assert_eq!(step(line, 9), Some(expected), "{line}");
        }
        for line in ["", "step: x", "Matching block [", "Processing block [1/2]", "a [1/2]"] {
            assert_eq!(step(line, 9), None, "{line}");
        }
    }

    #[test]
    fn counts_go_on_and_begin_anew_with_each_step() {
        let watch = Watch::new();
        let told = std::cell::RefCell::new(Vec::new());
        let tell = |own| told.borrow_mut().push(own);
        let mut steps = Steps::new(&watch, &tell, 3);
        for line in ["Processed file [1/3]", "Processed file [3/3]", "Registering image #1 (2)"] {
            steps.take(line);
        }
        let progress = watch.progress();
        assert_eq!((progress.done, progress.total), (2, 3));
        let steps = told.into_inner().into_iter().filter(|own| matches!(own, Told::Step(_)));
        assert_eq!(steps.count(), 2);
    }
}
