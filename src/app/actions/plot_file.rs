//! The plots that can be saved, and their file formats.

use std::path::Path;

/// A plot that can be saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plotted {
    Convergence,
    SampleErrors,
}

/// What it is saved as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotFile {
    /// The numbers, with commas between them.
    Csv,
    /// A drawing.
    Svg,
}

impl Plotted {
    /// The name of its file, without its end.
    pub fn stem(self) -> &'static str {
        match self {
            Self::Convergence => "convergence",
            Self::SampleErrors => "samples",
        }
    }
}

impl PlotFile {
    pub const ALL: [(Self, &'static str, &'static str); 2] = [
        (Self::Csv, "Table (CSV)…", "The numbers, for spreadsheets and scripts"),
        (Self::Svg, "Drawing (SVG)…", "For papers and slides; lines and text stay sharp"),
    ];

    pub fn end(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Svg => "svg",
        }
    }

    /// Whether a file is named as one of these.
    pub fn is_end_of(self, path: &Path) -> bool {
        path.extension().is_some_and(|own| own.eq_ignore_ascii_case(self.end()))
    }
}
