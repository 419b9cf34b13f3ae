//! Measures how long updates of the window take (everything in a frame except drawing), and how
//! soon the capture of the command line is shown.

use std::time::{Duration, Instant};

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

/// From the program's start to a capture that is drawn.
pub struct Start {
    began: Instant,
    /// Window and graphics driver were there.
    driver: Duration,
    /// So was all that does not depend on the capture.
    window: Duration,
    /// The frame before this one had the geometry.
    geometry: Option<Duration>,
}

impl Start {
    pub fn new(began: Instant, driver: Instant) -> Self {
        let driver = driver.saturating_duration_since(began);
        Self { began, driver, window: began.elapsed(), geometry: None }
    }

    /// PathRequest at the beginning of a frame, when what the frame before drew is on the screen;
    /// says how long all of it took once the capture is drawn with its photographs.
    pub fn report(&mut self, has_geometry: bool, has_photographs: bool) -> Option<String> {
        if has_geometry {
            self.geometry.get_or_insert_with(|| self.began.elapsed());
        }
        let geometry = self.geometry.filter(|_| has_photographs)?;
        let [driver, window, geometry, photographs] =
            [self.driver, self.window, geometry, self.began.elapsed()].map(|d| d.as_secs_f64());
        Some(format!(
            "Since the program began: window and graphics driver {driver:.2} s, panels \
             {window:.2} s, the geometry drawn {geometry:.2} s, with photographs {photographs:.2} s"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_is_told_once_the_photographs_are_drawn() {
        let began = Instant::now();
        let mut start = Start::new(began, began + Duration::from_millis(120));
        assert_eq!(start.report(false, false), None);
        assert_eq!(start.report(true, false), None);
        let report = start.report(true, true).unwrap();
        assert!(
            report.contains("driver 0.12 s") && report.contains("with photographs"),
            "{report}"
        );
    }

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
