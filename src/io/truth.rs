//! `truth.json` of test captures: the true values. Only scoring reads it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::{Error, json};
use crate::math::rgb::Rgb;

/// The true reflectances of a test capture.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Truth {
    /// True material of each surface (`usemtl` group).
    #[serde(default)]
    pub groups: BTreeMap<String, String>,
    pub materials: BTreeMap<String, TrueMaterial>,
}

/// Diffuse, or modified Phong as in the paper's Eq. 12.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct TrueMaterial {
    /// Where there is a texture, its mean over the surface's texels.
    pub rho_d: Rgb,
    #[serde(default)]
    pub rho_s: Option<Rgb>,
    #[serde(default)]
    pub n: Option<f64>,
    /// The true texture, relative to the capture.
    #[serde(default)]
    pub texture: Option<PathBuf>,
}

impl Truth {
    pub fn read(file: &Path) -> Result<Self, Error> {
        let text = json::read_text(file)?;
        serde_json::from_str(&text).map_err(|failure| json::broken(file, &failure))
    }

    /// The truth of a capture's folder, where there is one.
    pub fn beside(capture: &Path) -> Result<Option<Self>, Error> {
        let file = capture.join("truth.json");
        if file.exists() { Self::read(&file).map(Some) } else { Ok(None) }
    }

    /// The true material of a surface; a surface that no group names is one of its own name.
    pub fn of_surface(&self, surface: &str) -> Option<(&str, &TrueMaterial)> {
        let name = self.groups.get(surface).map_or(surface, String::as_str);
        self.materials.get_key_value(name).map(|(name, material)| (name.as_str(), material))
    }
}
