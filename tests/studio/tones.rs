//! Tone mapping in the 3D view, pixel by pixel.

use lobelia::app::viewport::ToneMapping;

use crate::viewport::{bare, keep, picture, window};

/// The specification of Khronos PBR Neutral: a colour of which all channels are from 0.08 to 0.8
/// loses 0.04 in each. The shader has a formula of its own; this compares it with those words.
#[test]
fn pbr_neutral_takes_the_shine_and_nothing_else_of_colours() {
    let mut window = window(bare());
    let settings = &mut window.state_mut().viewport.settings;
    (settings.wireframe, settings.cameras, settings.thumbnails) = (false, false, false);
    settings.grid = false;
    settings.exposure_ev = -1.0;
    let linear = picture(&mut window);
    window.state_mut().viewport.settings.tone_mapping = ToneMapping::Neutral;
    let neutral = picture(&mut window);
    keep(&neutral, "pbr-neutral");
    // IEC 61966-2-1.
    let decode = |code: u8| match f64::from(code) / 255.0 {
        dark if dark <= 0.040_45 => dark / 12.92,
        value => ((value + 0.055) / 1.055).powf(2.4),
    };
    // The photographs lie in the middle; bar and legend are in the corners.
    let (width, height) = linear.dimensions();
    let mut seen = 0;
    for (x, y) in
        (width / 3..width * 2 / 3).flat_map(|x| (height / 3..height * 2 / 3).map(move |y| (x, y)))
    {
        let [before, after] = [&linear, &neutral].map(|own| own.get_pixel(x, y).0);
        let channels = [0, 1, 2].map(|k| (decode(before[k]), decode(after[k])));
        // Edges are mixed with surfaces that no photograph shows, which are drawn as they are.
        let flat = [(1, 0), (0, 1)].into_iter().all(|(right, down)| {
            [(x - right, y - down), (x + right, y + down)].into_iter().all(|(x, y)| {
                let other = linear.get_pixel(x, y).0;
                std::iter::zip(before, other).all(|(own, other)| own.abs_diff(other) < 5)
            })
        });
        if !flat || before == after || !channels.iter().all(|(own, _)| (0.09..0.78).contains(own)) {
            continue;
        }
        seen += 1;
        // Half a code of both pictures, where the curve of sRGB is steepest.
        for (own, mapped) in channels {
            assert!((own - mapped - 0.04).abs() < 0.007, "{x} {y}: {before:?} {after:?}");
        }
    }
    assert!(seen > 2000, "{seen}");
}
