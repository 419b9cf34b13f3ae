//! Whether the directories of a RAW file with the structure of TIFF are all there.
//!
//! The decoder goes without what it cannot find, so that a file cut off within them would lose its
//! levels and crop unseen. Structure: TIFF 6.0, Section 2; SubIFDs: TIFF/EP and DNG.

/// Tag of the places of further directories.
const SUB_DIRECTORIES: u16 = 330;
/// Bytes of a value of each type, from 1 on.
const SIZES: [usize; 13] = [1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4];
/// Files have a handful.
const MOST_DIRECTORIES: usize = 32;

/// False where a directory, or a value that it points to, lies beyond the end of the file. Files of
/// another structure are taken as they are.
pub(super) fn is_whole(bytes: &[u8]) -> bool {
    let is_little = match bytes {
        [b'I', b'I', 42, 0, ..] => true,
        [b'M', b'M', 0, 42, ..] => false,
        _ => return true,
    };
    let file = File { bytes, is_little };
    let mut places: Vec<usize> = file.long(4).into_iter().collect();
    let mut seen = 0;
    while let Some(place) = places.pop() {
        seen += 1;
        if seen > MOST_DIRECTORIES {
            break;
        }
        if file.directory(place, &mut places).is_none() {
            return false;
        }
    }
    seen > 0
}

struct File<'a> {
    bytes: &'a [u8],
    is_little: bool,
}

impl File<'_> {
    /// Adds the places of its sub-directories; `None` where something is cut off.
    fn directory(&self, place: usize, places: &mut Vec<usize>) -> Option<()> {
        let count = self.short(place)?;
        for index in 0..usize::from(count) {
            let entry = place + 2 + 12 * index;
            let (tag, kind) = (self.short(entry)?, self.short(entry + 2)?);
            let (number, value) = (self.long(entry + 4)?, self.long(entry + 8)?);
            let Some(size) = usize::from(kind).checked_sub(1).and_then(|kind| SIZES.get(kind))
            else {
                continue;
            };
            let length = number.checked_mul(*size)?;
            let start = if length <= 4 { entry + 8 } else { value };
            self.bytes.get(start..start.checked_add(length)?)?;
            if tag == SUB_DIRECTORIES && *size == 4 {
                let further =
                    (0..number.min(MOST_DIRECTORIES)).filter_map(|i| self.long(start + 4 * i));
                places.extend(further);
            }
        }
        Some(())
    }

    fn short(&self, place: usize) -> Option<u16> {
        let own = self.bytes.get(place..)?.first_chunk()?;
        Some(if self.is_little { u16::from_le_bytes(*own) } else { u16::from_be_bytes(*own) })
    }

    fn long(&self, place: usize) -> Option<usize> {
        let own = self.bytes.get(place..)?.first_chunk()?;
        let own = if self.is_little { u32::from_le_bytes(*own) } else { u32::from_be_bytes(*own) };
        usize::try_from(own).ok()
    }
}
