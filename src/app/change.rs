//! One undoable change of a project, with the name that undo shows.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::given::GivenLight;
use super::relight::Added;
use crate::io::edits::Unread;
use crate::io::project::Masks;
use crate::math::rgb::Rgb;
use crate::reconstruct::Options;
use crate::render::edits::Edits;
use crate::scene::MaterialKind;
use crate::scene::charts::LaidChart;

/// One change of tags or options.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    Assign {
        surfaces: BTreeSet<usize>,
        material: usize,
    },
    Unassign {
        surfaces: BTreeSet<usize>,
    },
    NewMaterial {
        surfaces: BTreeSet<usize>,
    },
    Rename {
        material: usize,
        name: String,
    },
    Merge {
        from: usize,
        into: usize,
    },
    Delete {
        material: usize,
    },
    Kind {
        material: usize,
        kind: MaterialKind,
    },
    Textured {
        material: usize,
        textured: bool,
    },
    Known {
        material: usize,
        diffuse: Option<Rgb>,
    },
    KnownDeviation {
        material: usize,
        deviation: Option<Rgb>,
    },
    Option {
        section: &'static str,
        name: &'static str,
        text: String,
    },
    ForgetStart {
        material: String,
    },
    DefaultOptions,
    /// Takes all materials away that no surface has.
    DeleteEmpty,
    /// All options at once, under a name.
    Options {
        name: String,
        options: Box<Options>,
    },
    /// What could not be read is found, or given up.
    Unread {
        name: &'static str,
        edits: Arc<Edits>,
        unread: Arc<Vec<Unread>>,
    },
    /// Other light is known than was before.
    Given {
        name: &'static str,
        of: Option<Added>,
        given: Arc<GivenLight>,
    },
    /// Other pixels of photographs are left out.
    Masks {
        name: &'static str,
        masks: Arc<Masks>,
    },
    /// Charts in photographs are added, changed or removed.
    Charts {
        name: &'static str,
        charts: Arc<Vec<LaidChart>>,
    },
    /// The scene is relit in another way.
    Relight {
        name: &'static str,
        of: Option<Added>,
        edits: Arc<Edits>,
    },
}

impl Change {
    /// What undo calls it.
    pub fn name(&self) -> String {
        match self {
            Self::Assign { .. } => "assign material".to_owned(),
            Self::Unassign { .. } => "take material away".to_owned(),
            Self::NewMaterial { .. } => "new material".to_owned(),
            Self::Rename { .. } => "rename material".to_owned(),
            Self::Merge { .. } => "merge materials".to_owned(),
            Self::Delete { .. } => "delete material".to_owned(),
            Self::Kind { kind: MaterialKind::Specular, .. } => "make specular".to_owned(),
            Self::Kind { .. } => "make diffuse".to_owned(),
            Self::Textured { .. } => "switch texture".to_owned(),
            Self::Known { .. } => "known reflectance".to_owned(),
            Self::KnownDeviation { .. } => "deviation of known reflectance".to_owned(),
            Self::Option { section, name, .. } => format!("{section}.{name}"),
            Self::ForgetStart { .. } => "remove start value".to_owned(),
            Self::DeleteEmpty => "remove empty materials".to_owned(),
            Self::DefaultOptions => "reset all options".to_owned(),
            Self::Options { name, .. } => name.clone(),
            Self::Given { name, .. }
            | Self::Relight { name, .. }
            | Self::Masks { name, .. }
            | Self::Charts { name, .. }
            | Self::Unread { name, .. } => (*name).to_owned(),
        }
    }

    /// Whether it changes the same value as another: within a gesture they are one step.
    pub fn is_of_value_of(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Known { material: a, diffuse: Some(_) },
                Self::Known { material: b, diffuse: Some(_) },
            )
            | (
                Self::KnownDeviation { material: a, deviation: Some(_) },
                Self::KnownDeviation { material: b, deviation: Some(_) },
            ) => a == b,
            (
                Self::Option { section: a, name: x, .. },
                Self::Option { section: b, name: y, .. },
            ) => a == b && x == y,
            (Self::Relight { name: a, of: x, .. }, Self::Relight { name: b, of: y, .. })
            | (Self::Given { name: a, of: x, .. }, Self::Given { name: b, of: y, .. }) => {
                a == b && x == y
            }
            _ => false,
        }
    }
}
