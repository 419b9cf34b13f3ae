use super::*;

/// In memory, but as if it were elsewhere.
#[derive(Debug)]
struct Elsewhere(Vec<u8>);

impl Stored for Elsewhere {
    fn bytes(&self) -> &[u8] {
        &self.0
    }

    fn release(&self) {}
}

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels().map(|pixel| pixel.map(f32::to_bits)).collect()
}

#[test]
fn half_floats_are_used_where_they_lose_nothing() {
    let half = vec![[0.5, 65504.0, -0.0], [5.960_464_5e-8, f32::INFINITY, 1.0 + 1.0 / 1024.0]];
    let single = vec![[0.1, 1.0, 1.0], [65520.0, 1.0 + 1.0 / 4096.0, 1e-9]];
    for (pixels, bytes) in [(half, 6), (single, 12)] {
        let image = Image::new(2, 1, pixels.clone(), None);
        assert_eq!(image.byte_count(), 2 * bytes);
        let expected: Vec<[u32; 3]> = pixels.iter().map(|own| own.map(f32::to_bits)).collect();
        assert_eq!(bits(&image), expected);
        // The same once they are kept elsewhere.
        let written = image.bytes().to_vec();
        let mut kept = image.clone();
        assert!(!kept.keep(Box::new(Elsewhere(vec![0; 5]))));
        assert!(kept.keep(Box::new(Elsewhere(written))));
        assert_eq!((bits(&kept), kept.byte_count()), (expected, 2 * bytes));
        assert_eq!(kept, image);
        assert!(!kept.has_pixels_of(&image));
        kept.scale(|x, _| (x + 2) as f32);
        assert_eq!(kept.pixel(1, 0)[0], 3.0 * pixels[1][0]);
    }
}

#[test]
fn a_gain_is_that_of_stored_products() {
    let image = Image::new(2, 1, vec![[0.1, 0.2, 3.0], [7.0, f32::INFINITY, 0.3]], None);
    let mut scaled = image.clone();
    scaled.scale(|_, _| 0.7);
    let gained = image.with_gain(0.7);
    assert_eq!(bits(&gained), bits(&scaled));
    assert!(!gained.has_pixels_of(&image));
    let mut twice = image;
    twice.scale(|_, _| 0.7);
    twice.scale(|_, _| 0.3);
    assert_eq!(bits(&gained.with_gain(0.3)), bits(&twice));
}

#[test]
fn masks_and_what_is_invalid_are_counted_apart() {
    // More than one word of bits.
    let pixel = |index: usize| if index.is_multiple_of(10) { [-1.0; 3] } else { [1.0; 3] };
    let mut image = Image::new(100, 2, (0..200).map(pixel).collect(), None);
    assert_eq!((image.invalid_count(), image.masked_count()), (20, 0));
    image.mask(|x, y| y == 1 && x >= 70);
    assert_eq!((image.invalid_count(), image.masked_count()), (17, 30));
    assert_eq!(image.radiance(75, 1), None);
    assert_eq!(image.radiance_without_mask(75, 1), Some([1.0; 3]));
    assert_eq!(image.radiance_without_mask(70, 1), None);
    image.mask(|x, y| (x, y) == (1, 0));
    assert_eq!(image.masked_count(), 31);
    assert_eq!(image.mask_pixels().iter().filter(|own| **own).count(), 31);
    assert!(image.is_masked(1, 0) && image.measures_anything());
    image.set_mask(&[true; 200]);
    assert!(!image.measures_anything());
    image.set_mask(&[false; 200]);
    assert_eq!((image.invalid_count(), image.masked_count()), (20, 0));
}
