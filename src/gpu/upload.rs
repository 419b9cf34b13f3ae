//! A scene in the memory of a card.

use wgpu::{Buffer, BufferDescriptor, BufferUsages, Device, Limits, Queue};

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

/// A part of a scene is larger than a card takes at once.
#[derive(Debug, thiserror::Error)]
#[error("{what} of the scene take {} MB, more than the {} MB that the card takes at once", bytes >> 20, most >> 20)]
pub struct TooLarge {
    what: &'static str,
    bytes: u64,
    most: u64,
}

/// Makes buffers of a device.
struct Maker<'a> {
    device: &'a Device,
    queue: &'a Queue,
    limits: &'a Limits,
}

impl Uploaded {
    /// The scene of a pass; what `former` holds of it is used again.
    pub fn new(
        former: Option<Self>,
        pass: &Pass,
        (device, queue): (&Device, &Queue),
        limits: &Limits,
    ) -> Result<Self, TooLarge> {
        let maker = Maker { device, queue, limits };
        let parts = Parts::new(pass);
        let tables = Tables::new(pass);
        let small = maker.buffer("the tables", &tables.words)?;
        let kept =
            |group: Group| former.as_ref().filter(|former| former.parts.has_same(group, &parts));
        let (trees, tree, triangles) = match kept(Group::Geometry) {
            Some(held) => (held.trees.clone(), held.tree.clone(), held.triangles.clone()),
            None => {
                let mut trees = packed::trees(pass);
                let tree = maker.buffer("the triangles", &std::mem::take(&mut trees.words))?;
                (trees, tree, maker.buffer("the normals", &packed::planes(pass))?)
            }
        };
        let large = match kept(Group::Images) {
            Some(held) => held.large.clone(),
            None => maker.buffer("textures and environment maps", &packed::images(pass))?,
        };
        let choices = match kept(Group::Choices) {
            Some(held) => held.choices.clone(),
            None => maker.buffer("the probabilities of lights", &packed::choices(pass))?,
        };
        let photographs = match kept(Group::Photographs) {
            Some(held) => held.photographs.clone(),
            None => maker.buffer("the photographs", &packed::photographs(pass))?,
        };
        Ok(Self { parts, trees, tables, tree, triangles, small, large, choices, photographs })
    }

    /// In the order of their bindings.
    pub fn buffers(&self) -> [&Buffer; 6] {
        let Self { tree, triangles, small, large, choices, photographs, .. } = self;
        [tree, triangles, small, large, choices, photographs]
    }
}

impl Maker<'_> {
    fn buffer<T: bytemuck::Pod>(
        &self,
        what: &'static str,
        values: &[T],
    ) -> Result<Buffer, TooLarge> {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        let most = self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size);
        let size = bytes.len() as u64;
        if size > most {
            return Err(TooLarge { what, bytes: size, most });
        }
        let buffer = self.device.create_buffer(&BufferDescriptor {
            label: Some(what),
            // A binding must not be empty.
            size: size.max(16),
            usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if !bytes.is_empty() {
            self.queue.write_buffer(&buffer, 0, bytes);
        }
        Ok(buffer)
    }
}
