//! The list of the panels: the file, the place, the name and the command of each.

use serde::{Deserialize, Serialize};

/// Where a panel stands at first, in the workspaces that have that place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// One of its own, in `layout.rs`.
    Own,
    /// A tab on the right.
    Right,
    /// A tab below the 3D view.
    Lower,
    /// A tab in the workspace of the studies, and in no other.
    Study,
}

/// What stands in a panel's line.
struct Entry {
    place: Place,
    title: &'static str,
    command: &'static str,
    help: &'static str,
}

// A new one comes behind the last of its place: in a layout that was saved before, it stands beside
// the one in the line above.
/// Hands the lines of all panels to a macro: what layouts call the panel, its file in `panels/`, its
/// place, what its tab says, its command, and what it is for.
macro_rules! panes {
    ($take:ident) => {
        $take! {
            Outliner outliner Own, "Outliner", "Show outliner", "Photographs, surfaces, materials and lights";
            Viewport view Own, "3D view", "Show 3D view", "Geometry, cameras, samples and lights";
            Tags tags Right, "Tags", "Show tags", "Materials and which surfaces have them";
            KnownLight known_light Right, "Known light", "Show known light", "Lights whose shape and place are known";
            Charts charts Right, "Charts", "Show charts", "Grey cards and colour charts in the photographs";
            Run run Right, "Run", "Show run", "Method, options and progress";
            Inspector inspector Right, "Inspector", "Show inspector", "Every number of the selection";
            Relight relight Right, "Relight", "Show relight", "Other light, materials and objects";
            Convergence convergence Lower, "Convergence", "Show convergence", "Error against iteration";
            SampleErrors sample_errors Lower, "Error per sample", "Show error per sample",
                "Computed against measured radiance";
            Samples samples Lower, "Samples", "Show samples", "Table of samples";
            Lights lights Lower, "Lights", "Show lights", "Table of virtual and known lights";
            Materials materials Lower, "Materials", "Show materials", "Table of reflectances with intervals";
            Compare compare Lower, "Compare", "Show compare", "Photographs beside renderings of the results";
            Masks masks Lower, "Masks", "Show masks", "Pixels of photographs that are left out, and tools to \
                 draw them";
            Log log Lower, "Log", "Show log", "Messages and warnings";
            Speed speed Study, "Speed and accuracy", "Show speed and accuracy",
                "How the error falls with computing time on this capture";
            Stability stability Study, "Stability", "Show stability", "How large errors of this capture may be";
        }
    };
}

pub(super) use panes;

macro_rules! pane {
    ($($pane:ident $file:ident $place:ident, $title:literal, $command:literal, $help:literal;)*) => {
        /// A panel. Layouts that are saved have the names as they stand here.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum Pane {
            $($pane,)*
        }

        impl Pane {
            /// Those of a place in their order there.
            pub const ALL: [Self; [$(Self::$pane),*].len()] = [$(Self::$pane),*];

            fn entry(self) -> Entry {
                match self {
                    $(Self::$pane => Entry {
                        place: Place::$place,
                        title: $title,
                        command: $command,
                        help: $help,
                    },)*
                }
            }
        }
    };
}

panes!(pane);

impl Pane {
    pub fn place(self) -> Place {
        self.entry().place
    }

    /// What its tab says.
    pub fn title(self) -> &'static str {
        self.entry().title
    }

    /// The name of the command that shows it, and what it is for.
    pub fn command(self) -> (&'static str, &'static str) {
        let Entry { command, help, .. } = self.entry();
        (command, help)
    }
}
