//! Numbers, texts and lists as bytes: little-endian, lists with their length first.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;

/// What can be written as bytes and read back, bit for bit.
pub(super) trait Binary: Sized {
    fn put(&self, out: &mut Vec<u8>);
    /// `None` where the bytes end too soon or say what cannot be.
    fn take(from: &mut &[u8]) -> Option<Self>;
}

/// A structure by its fields, in their order.
macro_rules! by_fields {
    ($($name:ident { $($field:ident),* $(,)? })*) => { $(
        impl $crate::io::binary::Binary for $name {
            fn put(&self, out: &mut Vec<u8>) {
                let Self { $($field),* } = self;
                $($field.put(out);)*
            }
            fn take(from: &mut &[u8]) -> Option<Self> {
                // Fields are taken in the order in which they are written.
                $(let $field = $crate::io::binary::Binary::take(from)?;)*
                Some(Self { $($field),* })
            }
        }
    )* };
}
pub(super) use by_fields;

macro_rules! numbers {
    ($($number:ty),*) => { $(
        impl Binary for $number {
            fn put(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
            fn take(from: &mut &[u8]) -> Option<Self> {
                let (bytes, rest) = from.split_first_chunk()?;
                *from = rest;
                Some(<$number>::from_le_bytes(*bytes))
            }
        }
    )* };
}
numbers!(u8, u32, u64, f32, f64);

impl Binary for usize {
    fn put(&self, out: &mut Vec<u8>) {
        (*self as u64).put(out);
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        u64::take(from)?.try_into().ok()
    }
}

impl Binary for bool {
    fn put(&self, out: &mut Vec<u8>) {
        u8::from(*self).put(out);
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        match u8::take(from)? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

impl<T: Binary> Binary for Vec<T> {
    fn put(&self, out: &mut Vec<u8>) {
        self.len().put(out);
        self.iter().for_each(|item| item.put(out));
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        let length = usize::take(from)?;
        // Every item has a byte at least: a length beyond the end asks for no memory.
        (length <= from.len()).then_some(())?;
        (0..length).map(|_| T::take(from)).collect()
    }
}

impl Binary for String {
    fn put(&self, out: &mut Vec<u8>) {
        self.len().put(out);
        out.extend_from_slice(self.as_bytes());
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        let length = usize::take(from)?;
        let (text, rest) = from.split_at_checked(length)?;
        *from = rest;
        String::from_utf8(text.to_vec()).ok()
    }
}

impl<T: Binary> Binary for Option<T> {
    fn put(&self, out: &mut Vec<u8>) {
        self.is_some().put(out);
        if let Some(own) = self {
            own.put(out);
        }
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        Some(if bool::take(from)? { Some(T::take(from)?) } else { None })
    }
}

impl<T: Binary, const N: usize> Binary for [T; N] {
    fn put(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|item| item.put(out));
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        let items: Option<Vec<T>> = (0..N).map(|_| T::take(from)).collect();
        items?.try_into().ok()
    }
}

impl<T: Binary> Binary for Arc<T> {
    fn put(&self, out: &mut Vec<u8>) {
        T::put(self, out);
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        T::take(from).map(Arc::new)
    }
}

impl Binary for Vec3 {
    fn put(&self, out: &mut Vec<u8>) {
        self.to_array().put(out);
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        <[f32; 3]>::take(from).map(Self::from_array)
    }
}

impl Binary for Range<usize> {
    fn put(&self, out: &mut Vec<u8>) {
        [self.start, self.end].put(out);
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        let [start, end] = Binary::take(from)?;
        Some(start..end)
    }
}

/// FNV-1a: tells a damaged file from a whole one.
pub(super) fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |sum, byte| {
        (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cut_is_noticed() {
        let value = (vec![Some("é".to_owned()), None], [1.5f64, f64::NAN]);
        let mut bytes = Vec::new();
        value.0.put(&mut bytes);
        value.1.put(&mut bytes);
        let take = |mut from: &[u8]| {
            let texts = Vec::<Option<String>>::take(&mut from)?;
            Some((texts, <[f64; 2]>::take(&mut from)?.map(f64::to_bits)))
        };
        assert_eq!(take(&bytes), Some((value.0.clone(), value.1.map(f64::to_bits))));
        for end in 0..bytes.len() {
            assert_eq!(take(&bytes[..end]), None, "{end}");
        }
        let huge = u64::MAX.to_le_bytes();
        assert_eq!(Vec::<u8>::take(&mut &huge[..]), None);
    }
}
