//! The workspaces, a line each: key, panels that stand in front at first, the part of the height
//! that the lower panels take, and what it is for.

use eframe::egui::Key;

use super::panes::Pane;

/// What stands in a workspace's line.
struct Entry {
    key: Key,
    front: [Pane; 2],
    lower: f32,
    name: &'static str,
    command: &'static str,
    help: &'static str,
}

/// A workspace whose lower panels take at least this part of the height is for plots and tables.
const PLOTTED: f32 = 0.4;
/// What these need, in points.
const PLOT: f32 = 180.0;

macro_rules! workspaces {
    ($($workspace:ident $key:ident, [$right:ident, $lower:ident], $part:literal, $help:literal;)*) => {
        /// An arrangement of the panels for one kind of work. Layouts that are saved have the names
        /// as they stand here.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Workspace {
            $($workspace,)*
        }

        impl Workspace {
            /// In the order of the menu bar.
            pub const ALL: [Self; [$(Self::$workspace),*].len()] = [$(Self::$workspace),*];

            fn entry(self) -> Entry {
                match self {
                    $(Self::$workspace => Entry {
                        key: Key::$key,
                        front: [Pane::$right, Pane::$lower],
                        lower: $part,
                        name: stringify!($workspace),
                        command: concat!("Workspace ", stringify!($workspace)),
                        help: $help,
                    },)*
                }
            }
        }
    };
}

workspaces! {
    Capture F1, [Inspector, Log], 0.26, "Photographs, cameras and geometry: is everything there?";
    Tag F2, [Tags, Materials], 0.26, "Which surfaces share a material, and what is known of it";
    Reconstruct F3, [Run, Convergence], 0.42, "Options, the run, and its convergence";
    Inspect F4, [Inspector, Samples], 0.42, "Samples, lights, materials and their errors";
    Relight F5, [Relight, Materials], 0.18,
        "Other light, other materials, and objects set into the scene";
    Study F6, [Run, Speed], 1.0,
        "Error against computing time, and how large errors of the capture may be";
}

impl Workspace {
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    pub fn help(self) -> &'static str {
        self.entry().help
    }

    /// The name of the command that shows it, and its key.
    pub fn command(self) -> (&'static str, Key) {
        let Entry { command, key, .. } = self.entry();
        (command, key)
    }

    /// The panels that stand in front at first, on the right and below.
    pub fn front(self) -> [Pane; 2] {
        self.entry().front
    }

    /// The part of the height that the lower panels take.
    pub fn lower(self) -> f32 {
        self.entry().lower
    }

    /// The same in a window of some height, in points. Where the workspace is for plots and tables, a tab
    /// bar, controls and a plot have to fit, but about half of the height stays the 3D view's.
    pub fn lower_in(self, height: f32) -> f32 {
        let Entry { lower, .. } = self.entry();
        if lower < PLOTTED { lower } else { lower.max((PLOT / height).min(0.55)) }
    }
}
