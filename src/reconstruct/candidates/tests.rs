use super::*;

#[test]
fn a_pixel_whose_number_does_not_fit_is_an_error() {
    let last = u32::MAX as usize;
    assert_eq!(Candidate::new(7, last), Ok(Candidate { buffer: 7, pixel: u32::MAX }));
    assert_eq!(Candidate::new(7, last + 1), Err(TooManyPoints(last + 1)));
    assert_eq!(Candidate::new(last + 1, 0), Err(TooManyPoints(last + 1)));
}

#[test]
fn materials_that_show_in_few_pixels_keep_theirs() {
    assert_eq!(shares(&[10, 20, 30], 60), None);
    let kept = |counts: &[usize], most| -> Vec<usize> {
        let part = |share: u32| f64::from(share) / f64::from(u32::MAX);
        let shares = shares(counts, most).unwrap();
        shares.iter().zip(counts).map(|(s, c)| (part(*s) * *c as f64).round() as usize).collect()
    };
    assert_eq!(kept(&[100, 5000, 0, 9000], 4100), [100, 2000, 0, 2000]);
    assert_eq!(kept(&[9000, 9000, 9000], 300), [100, 100, 100]);
}

#[test]
fn pixels_are_kept_at_random() {
    let count = (0..100_000).filter(|pixel| hash(7, 3, *pixel) < u32::MAX / 4).count();
    // Of a binomial distribution the standard deviation is 137.
    assert!(count.abs_diff(25_000) < 700, "{count}");
    assert!((0..100).any(|pixel| hash(7, 3, pixel) != hash(7, 4, pixel)));
}
