use super::*;

#[test]
fn an_image_reads_the_same_from_its_file() {
    for value in [0.1, 0.125] {
        let pixels = (0..5000).map(|index| [index as f32 * value, value, 2.0]).collect();
        let image = Image::new(100, 50, pixels, Some(400.0));
        let mut kept = image.clone();
        keep(&mut kept).unwrap();
        assert!(!kept.has_pixels_of(&image));
        for _ in 0..2 {
            assert!(kept.pixels().eq(image.pixels()));
            assert_eq!(kept.invalid_count(), image.invalid_count());
            kept.release();
        }
        // Once more from there: the bytes of the first file are those of the second.
        keep(&mut kept).unwrap();
        assert_eq!(kept, image);
    }
}
