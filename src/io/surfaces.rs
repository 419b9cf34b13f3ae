//! The parts of a mesh file that become surfaces.

/// By which of its parts a mesh file is divided into surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SurfacesBy {
    /// Materials, or else groups or objects.
    #[default]
    Materials,
    /// `g` of OBJ, meshes of glTF, solids of STL, or else what there is.
    Groups,
    /// `o` of OBJ, nodes of glTF, solids of STL, or else what there is.
    Objects,
}
