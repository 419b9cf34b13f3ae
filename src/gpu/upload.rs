//! A scene in the memory of a card.

use bytemuck::Pod;
use wgpu::Buffer;

use super::device::{Gpu, TooLarge};
use crate::render::Pass;
use crate::render::packed::{self, Group, PackedTrees, Parts, Tables};

/// What a card holds of the scene of the last pass.
pub struct Uploaded {
    parts: Parts,
    /// Without their words.
    pub trees: PackedTrees,
    pub tables: Tables,
    tree: Buffer,
    triangles: Buffer,
    small: Buffer,
    large: Buffer,
    choices: Buffer,
    photographs: Buffer,
}

impl Uploaded {
    /// The scene of a pass; what `former` holds of it is used again.
    pub fn new(former: Option<Self>, pass: &Pass, gpu: &Gpu) -> Result<Self, TooLarge> {
        let parts = Parts::new(pass);
        let tables = Tables::new(pass);
        let small = buffer(gpu, "the tables", &tables.words)?;
        let kept =
            |group: Group| former.as_ref().filter(|former| former.parts.has_same(group, &parts));
        let (trees, tree, triangles) = match kept(Group::Geometry) {
            Some(held) => (held.trees.clone(), held.tree.clone(), held.triangles.clone()),
            None => {
                let mut trees = packed::trees(pass);
                let tree = buffer(gpu, "the triangles", &std::mem::take(&mut trees.words))?;
                (trees, tree, buffer(gpu, "the normals", &packed::planes(pass))?)
            }
        };
        let large = match kept(Group::Images) {
            Some(held) => held.large.clone(),
            None => buffer(gpu, "textures and environment maps", &packed::images(pass))?,
        };
        let choices = match kept(Group::Choices) {
            Some(held) => held.choices.clone(),
            None => buffer(gpu, "the probabilities of lights", &packed::choices(pass))?,
        };
        let photographs = match kept(Group::Photographs) {
            Some(held) => held.photographs.clone(),
            None => buffer(gpu, "the photographs", &packed::photographs(pass))?,
        };
        Ok(Self { parts, trees, tables, tree, triangles, small, large, choices, photographs })
    }

    /// In the order of their bindings.
    pub fn buffers(&self) -> [&Buffer; 6] {
        let Self { tree, triangles, small, large, choices, photographs, .. } = self;
        [tree, triangles, small, large, choices, photographs]
    }
}

/// A buffer with some values, unless it is larger than the card takes.
fn buffer<T: Pod>(gpu: &Gpu, what: &'static str, values: &[T]) -> Result<Buffer, TooLarge> {
    let (bytes, most) = (size_of_val(values) as u64, gpu.most_bytes());
    if bytes > most {
        return Err(TooLarge { what, bytes, most });
    }
    Ok(gpu.table(what, values))
}
