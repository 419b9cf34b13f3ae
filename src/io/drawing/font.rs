//! The font of drawings: Ubuntu Light, as in the window. Its licence is beside it.

use std::sync::LazyLock;

use ttf_parser::{Face, GlyphId, OutlineBuilder};

static FACE: LazyLock<Option<Face<'static>>> =
    LazyLock::new(|| Face::parse(include_bytes!("../../../assets/fonts/Ubuntu-Light.ttf"), 0).ok());

fn glyphs(face: &Face<'static>, text: &str) -> Vec<(GlyphId, f32)> {
    let em = f32::from(face.units_per_em());
    text.chars()
        .map(|letter| {
            let glyph = face.glyph_index(letter).unwrap_or_default();
            (glyph, f32::from(face.glyph_hor_advance(glyph).unwrap_or(0)) / em)
        })
        .collect()
}

/// The width of a text in pixels at a size.
pub fn width(text: &str, size: f32) -> f32 {
    let Some(face) = FACE.as_ref() else { return 0.0 };
    size * glyphs(face, text).iter().map(|(_, advance)| advance).sum::<f32>()
}

/// Tells the outline of a text to a builder, in pixels from the start of its baseline, y down.
pub fn outline(text: &str, size: f32, builder: &mut impl OutlineBuilder) {
    let Some(face) = FACE.as_ref() else { return };
    let scale = size / f32::from(face.units_per_em());
    let mut x = 0.0;
    for (glyph, advance) in glyphs(face, text) {
        face.outline_glyph(glyph, &mut Placed { x, scale, builder });
        x += size * advance;
    }
}

struct Placed<'a, B> {
    x: f32,
    scale: f32,
    builder: &'a mut B,
}

impl<B: OutlineBuilder> Placed<'_, B> {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + self.scale * x, -self.scale * y)
    }
}

impl<B: OutlineBuilder> OutlineBuilder for Placed<'_, B> {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.builder.move_to(x, y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.builder.line_to(x, y);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.builder.quad_to(x1, y1, x, y);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.builder.curve_to(x1, y1, x2, y2, x, y);
    }
    fn close(&mut self) {
        self.builder.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_have_widths() {
        assert!(width("iii", 12.0) < width("WWW", 12.0));
        assert!((width("ab", 24.0) - 2.0 * width("ab", 12.0)).abs() < 1e-3);
        let face = FACE.as_ref().unwrap();
        // Letters that charts use.
        for letter in "aZ09.,%×°±≤…–()½¼".chars() {
            assert!(face.glyph_index(letter).is_some(), "{letter}");
        }
    }
}
