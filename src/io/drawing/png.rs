//! A drawing as PNG.

use std::path::Path;

use tiny_skia::{
    Color, FillRule, LineJoin, Paint, PathBuilder, Pixmap, Stroke, StrokeDash, Transform,
};
use ttf_parser::OutlineBuilder;

use super::super::{Error, png};
use super::font;
use super::{Anchor, Drawing, Form, Ink, Shape};

/// Pixels per unit of the drawing, for screens of today.
const DENSITY: f32 = 2.0;

pub(super) fn write(file: &Path, drawing: &Drawing, dark: bool) -> Result<(), Error> {
    let failed =
        |text: String| Error::Write { file: file.to_owned(), source: std::io::Error::other(text) };
    let size = |length: f32| (DENSITY * length).ceil() as u32;
    let mut pixmap = Pixmap::new(size(drawing.width), size(drawing.height))
        .ok_or_else(|| failed("the drawing is empty or too large".to_owned()))?;
    let [r, g, b] = Ink::Paper.rgb(dark);
    pixmap.fill(Color::from_rgba8(r, g, b, 255));
    for shape in &drawing.shapes {
        add(&mut pixmap, shape, dark);
    }
    let bytes: Vec<u8> =
        pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    png::write(file, pixmap.width() as usize, pixmap.height() as usize, &bytes)
}

fn paint(ink: Ink, opacity: f32, dark: bool) -> Paint<'static> {
    let [r, g, b] = ink.rgb(dark);
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(r, g, b, (255.0 * opacity) as u8);
    paint
}

fn path_of(points: &[[f32; 2]], closed: bool) -> Option<tiny_skia::Path> {
    let mut path = PathBuilder::new();
    let (first, rest) = points.split_first()?;
    path.move_to(first[0], first[1]);
    rest.iter().for_each(|[x, y]| path.line_to(*x, *y));
    if closed {
        path.close();
    }
    path.finish()
}

fn add(pixmap: &mut Pixmap, shape: &Shape, dark: bool) {
    let scale = Transform::from_scale(DENSITY, DENSITY);
    match shape {
        Shape::Line { points, ink, width, dashed } => {
            let dash = if *dashed { StrokeDash::new(vec![5.0, 4.0], 0.0) } else { None };
            let line_join = LineJoin::Round;
            let stroke = Stroke { width: *width, line_join, dash, ..Stroke::default() };
            if let Some(path) = path_of(points, false) {
                pixmap.stroke_path(&path, &paint(*ink, 1.0, dark), &stroke, scale, None);
            }
        }
        Shape::Area { points, ink, opacity } => {
            if let Some(path) = path_of(points, true) {
                let paint = paint(*ink, *opacity, dark);
                pixmap.fill_path(&path, &paint, FillRule::Winding, scale, None);
            }
        }
        Shape::Mark { at, form, radius, ink, filled } => {
            let path = match form {
                Form::Circle => PathBuilder::from_circle(at[0], at[1], *radius),
                form => path_of(&form.corners(*at, *radius), true),
            };
            let Some(path) = path else { return };
            let paint = paint(*ink, 1.0, dark);
            if *filled {
                pixmap.fill_path(&path, &paint, FillRule::Winding, scale, None);
            } else {
                let stroke = Stroke { width: 1.3, ..Stroke::default() };
                pixmap.stroke_path(&path, &paint, &stroke, scale, None);
            }
        }
        Shape::Text { at, text, size, anchor, ink, upright } => {
            let mut outline = Outline(PathBuilder::new());
            font::outline(text, *size, &mut outline);
            let Some(path) = outline.0.finish() else { return };
            let shift = match anchor {
                Anchor::Start => 0.0,
                Anchor::Middle => -0.5 * font::width(text, *size),
                Anchor::End => -font::width(text, *size),
            };
            let place = Transform::from_translate(at[0], at[1]).post_concat(scale);
            let place = if *upright { place.pre_rotate(-90.0) } else { place };
            let place = place.pre_translate(shift, 0.0);
            let paint = paint(*ink, 1.0, dark);
            pixmap.fill_path(&path, &paint, FillRule::Winding, place, None);
        }
    }
}

struct Outline(PathBuilder);

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to(x, y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to(x, y);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.0.quad_to(x1, y1, x, y);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.0.cubic_to(x1, y1, x2, y2, x, y);
    }
    fn close(&mut self) {
        self.0.close();
    }
}
