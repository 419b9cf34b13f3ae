//! Named sets of options, from fast to accurate. They are settings of `lobelia study speed` on the
//! Pareto front of seconds and error over the test captures.

use crate::choices;

choices! {
    /// How much time a result may take.
    Quality {
        /// A first look.
        Draft = "draft",
        /// Every option's own default.
        Standard = "standard",
        /// For the last run.
        Fine = "fine",
    }
}

/// An option by its section and name, and its value as text.
pub type Change = (&'static str, &'static str, &'static str);

impl Quality {
    /// All qualities, fastest first.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Standard, Self::Fine];

    /// The options that differ from their defaults.
    pub fn changes(self) -> &'static [Change] {
        match self {
            Self::Draft => &[
                ("samples", "count", "600"),
                ("transport", "rays", "196"),
                ("joint", "light_sets", "1"),
                ("joint", "max_lamps", "3"),
            ],
            Self::Standard => &[],
            Self::Fine => &[
                ("samples", "count", "5000"),
                ("transport", "rays", "900"),
                ("joint", "light_sets", "12"),
            ],
        }
    }
}
