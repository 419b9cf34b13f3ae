//! Reads numbers from the buffers of a glTF file, and checks each range first.

use gltf::Accessor;
use gltf::accessor::{DataType, Dimensions};

use super::{Reader, invalid};
use crate::io::Error;

impl Reader<'_> {
    /// The vectors of an accessor; only those that the buffer holds.
    pub(super) fn vectors<const N: usize>(
        &self,
        accessor: &Accessor,
        place: &str,
    ) -> Result<Vec<[f32; N]>, Error> {
        let wanted = [Dimensions::Scalar, Dimensions::Vec2, Dimensions::Vec3][N - 1];
        if accessor.dimensions() != wanted {
            return Err(self.wrong(place, format!("an accessor is no {wanted:?}")));
        }
        let (kind, is_normalized) = (accessor.data_type(), accessor.normalized());
        let mut vectors = vec![[0.0; N]; 0];
        match accessor.view() {
            Some(view) => {
                let size = accessor.size();
                let stride = view.stride().unwrap_or(size);
                let data =
                    self.range(&view, accessor.offset(), accessor.count(), stride, size, place)?;
                for index in 0..accessor.count() {
                    let item = &data[index * stride..index * stride + size];
                    vectors
                        .push(std::array::from_fn(|axis| number(kind, is_normalized, item, axis)));
                }
            }
            // Zeros, of which a sparse part replaces some: bounded by that part.
            None if accessor
                .sparse()
                .is_some_and(|sparse| accessor.count() <= 64 * sparse.count()) =>
            {
                vectors.resize(accessor.count(), [0.0; N]);
            }
            None => return Err(self.wrong(place, "an accessor has no data".to_owned())),
        }
        if let Some(sparse) = accessor.sparse() {
            let (indices, values) = (sparse.indices(), sparse.values());
            let kind_of = match indices.index_type() {
                gltf::accessor::sparse::IndexType::U8 => DataType::U8,
                gltf::accessor::sparse::IndexType::U16 => DataType::U16,
                gltf::accessor::sparse::IndexType::U32 => DataType::U32,
            };
            let (width, size) = (kind_of.size(), accessor.size());
            let count = sparse.count();
            let places =
                self.range(&indices.view(), indices.offset(), count, width, width, place)?;
            let data = self.range(&values.view(), values.offset(), count, size, size, place)?;
            for entry in 0..count {
                let index = whole(kind_of, &places[entry * width..]);
                let item = &data[entry * size..(entry + 1) * size];
                let Some(vector) = vectors.get_mut(index as usize) else {
                    return Err(self.wrong(place, "a sparse accessor names no element".to_owned()));
                };
                *vector = std::array::from_fn(|axis| number(kind, is_normalized, item, axis));
            }
        }
        Ok(vectors)
    }

    pub(super) fn indices(&self, accessor: &Accessor, place: &str) -> Result<Vec<u32>, Error> {
        let kind = accessor.data_type();
        let is_index = matches!(kind, DataType::U8 | DataType::U16 | DataType::U32);
        let (Some(view), Dimensions::Scalar, true) =
            (accessor.view(), accessor.dimensions(), is_index)
        else {
            return Err(self.wrong(place, "the indices are no whole numbers".to_owned()));
        };
        let size = kind.size();
        let stride = view.stride().unwrap_or(size);
        let data = self.range(&view, accessor.offset(), accessor.count(), stride, size, place)?;
        Ok((0..accessor.count()).map(|index| whole(kind, &data[index * stride..])).collect())
    }

    /// The bytes of `count` items of a view, checked to be there.
    fn range(
        &self,
        view: &gltf::buffer::View,
        offset: usize,
        count: usize,
        stride: usize,
        size: usize,
        place: &str,
    ) -> Result<&[u8], Error> {
        let buffer = self.buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
        let length =
            count.checked_sub(1).and_then(|last| last.checked_mul(stride)?.checked_add(size));
        let data = length.and_then(|length| {
            let own = buffer.get(view.offset()..view.offset().checked_add(view.length())?)?;
            own.get(offset..offset.checked_add(length)?)
        });
        if stride < size && count > 1 {
            return Err(self.wrong(place, "the items of a buffer overlap".to_owned()));
        }
        data.ok_or_else(|| {
            self.wrong(place, "an accessor reaches beyond its buffer, or is empty".to_owned())
        })
    }

    fn wrong(&self, place: &str, problem: String) -> Error {
        invalid(self.file, place, problem, "Copy the file with its buffers, or export it again")
    }
}

fn whole(kind: DataType, item: &[u8]) -> u32 {
    match kind {
        DataType::U8 => item[0].into(),
        DataType::U16 => u16::from_le_bytes([item[0], item[1]]).into(),
        _ => u32::from_le_bytes([item[0], item[1], item[2], item[3]]),
    }
}

/// A component as a number; normalised integers are fractions of the largest.
fn number(kind: DataType, is_normalized: bool, item: &[u8], axis: usize) -> f32 {
    let size = kind.size();
    let own = &item[axis * size..(axis + 1) * size];
    let (value, largest) = match kind {
        DataType::I8 => (f32::from(own[0] as i8), 127.0),
        DataType::U8 => (f32::from(own[0]), 255.0),
        DataType::I16 => (f32::from(i16::from_le_bytes([own[0], own[1]])), 32767.0),
        DataType::U16 => (f32::from(u16::from_le_bytes([own[0], own[1]])), 65535.0),
        DataType::U32 => (whole(kind, own) as f32, 4294967295.0),
        DataType::F32 => return f32::from_le_bytes([own[0], own[1], own[2], own[3]]),
    };
    if is_normalized { (value / largest).max(-1.0) } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normalised_numbers_are_at_least_minus_one() {
        assert_eq!(number(DataType::I8, true, &[0x80], 0), -1.0);
    }
}
