//! A scene in the memory of a card.

use wgpu::{Buffer, BufferDescriptor, BufferUsages, Device, Limits, Queue};

use crate::render::Pass;
use crate::render::packed::{self, GROUPS, Group, PackedTrees, Parts, Tables};

/// What a card holds of the scene of the last pass.
pub struct Uploaded {
    parts: Parts,
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
        let is_same = GROUPS.map(|group| {
            former.as_ref().is_some_and(|former| former.parts.has_same(group, &parts))
        });
        let keeps = |group: Group| is_same[group as usize];
        let mut held = former;
        let mut keep = |group: Group, buffer: fn(&Uploaded) -> &Buffer| {
            held.as_mut().filter(|_| keeps(group)).map(|held| buffer(held).clone())
        };
        let (tree, triangles) = (
            keep(Group::Geometry, |held| &held.tree),
            keep(Group::Geometry, |held| &held.triangles),
        );
        let large = keep(Group::Images, |held| &held.large);
        let choices = keep(Group::Choices, |held| &held.choices);
        let photographs = keep(Group::Photographs, |held| &held.photographs);
        let (trees, tree, triangles) = match (held, tree, triangles) {
            (Some(held), Some(tree), Some(triangles)) => (held.trees, tree, triangles),
            _ => {
                let mut trees = packed::trees(pass);
                let tree = maker.buffer("the triangles", &std::mem::take(&mut trees.words))?;
                let triangles = maker.buffer("the normals", &packed::planes(pass))?;
                (trees, tree, triangles)
            }
        };
        let large = match large {
            Some(large) => large,
            None => maker.buffer("textures and environment maps", &packed::images(pass))?,
        };
        let choices = match choices {
            Some(choices) => choices,
            None => maker.buffer("the probabilities of lights", &packed::choices(pass))?,
        };
        let photographs = match photographs {
            Some(photographs) => photographs,
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
