//! How long the window's updates take: all that a frame does but drawing.

use std::time::Duration;

/// Updates since a run began.
#[derive(Default)]
pub struct Probe {
    secs: Vec<f32>,
}

/// Hours of updates, 4 MB.
const MOST: usize = 1 << 20;

impl Probe {
    pub fn restart(&mut self) {
        self.secs.clear();
    }

    pub fn add(&mut self, update: Duration) {
        if self.secs.len() < MOST {
            self.secs.push(update.as_secs_f32());
        }
    }

    /// What 99 % of the updates stay below, and the longest; `None` before there is any.
    pub fn report(&self) -> Option<String> {
        let mut sorted = self.secs.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let longest = sorted.last()?;
        let most = sorted[(sorted.len() - 1) * 99 / 100];
        Some(format!(
            "99 % of {} updates of the window took less than {:.1} ms, the longest {:.1} ms",
            sorted.len(),
            1e3 * most,
            1e3 * longest
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_of_a_hundred_is_not_what_most_stay_below() {
        let mut probe = Probe::default();
        assert_eq!(probe.report(), None);
        for ms in (1..=100).rev() {
            probe.add(Duration::from_millis(ms));
        }
        let report = probe.report().unwrap();
        assert!(report.contains("99 % of 100") && report.contains("99.0 ms"), "{report}");
        assert!(report.contains("100.0 ms"), "{report}");
        probe.restart();
        assert_eq!(probe.report(), None);
    }
}
