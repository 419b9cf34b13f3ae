//! Notes and warnings about an import, collected over all photographs.

use std::path::Path;

use super::{Import, Shot, gathered};

/// Cameras that see nothing of the mesh: other units, axes or coordinates.
pub(super) fn blind(import: &Import) -> Option<String> {
    let mesh = &import.geometry.as_ref()?.mesh;
    let step = (mesh.triangles.len() / 2000).max(1);
    let sees = |shot: &Shot| {
        mesh.triangles.iter().step_by(step).any(|triangle| {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
            shot.camera.project((a + b + c) / 3.0).is_some()
        })
    };
    let count = import.shots.iter().filter(|shot| !sees(shot)).count();
    (count > 0).then(|| {
        format!(
            "{count} of {} cameras see nothing of the mesh: if that is not so, mesh and cameras are \
             in different coordinates (--mesh-units, --mesh-up, --undo-applied-transform).",
            import.shots.len()
        )
    })
}

/// What is worth a word, gathered over all photographs.
#[derive(Default)]
pub(super) struct Notes {
    pub missing: Vec<String>,
    pub ambiguous: Vec<String>,
    pub sizeless: Vec<String>,
    pub damaged: Vec<String>,
    pub misshapen: Vec<String>,
    pub scaled: Vec<String>,
    pub undistorted: Vec<String>,
}

impl Notes {
    pub fn warnings(&self, file: &Path, found: usize) -> Vec<String> {
        let missing = match found {
            0 => {
                "the photograph was not found, as none was. The cameras are written all the same: \
                 import again with --images, or put the photographs where the new transforms.json \
                 names them."
            }
            _ => "the photograph was not found; its camera is left out.",
        };
        let lists = [
            (&self.missing, missing),
            (&self.ambiguous, "several photographs have this name; its camera is left out."),
            (
                &self.sizeless,
                "without the photograph its size is not known; the camera is left out.",
            ),
            (&self.misshapen, "the photograph has another shape than its camera; left out."),
            (&self.scaled, "the photograph was scaled after its camera was found; so is the lens."),
            (
                &self.undistorted,
                "the photograph is undistorted already; the lens terms are left out.",
            ),
        ];
        let mut warnings: Vec<String> =
            lists.iter().filter_map(|(places, what)| gathered(file, places, what)).collect();
        if let Some(first) = self.damaged.first() {
            let count = self.damaged.len();
            warnings.push(format!("{count} photographs cannot be used; the first: {first}"));
        }
        warnings
    }
}
