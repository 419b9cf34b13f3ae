//! Masks over the photograph that is looked through: how they are drawn and displayed.

use std::sync::Arc;

use eframe::egui::{self, Color32, Key, Modifiers, PointerButton, Pos2, Response, Ui, Vec2, vec2};
use glam::DVec2;

use crate::app::viewport::Viewport;
use crate::app::viewport::background::Background;
use crate::app::viewport::content::{Content, ViewportEvent};
use crate::app::viewport::input::has_keys;
use crate::app::viewport::projection::{Projection, window};
use crate::scene::mask::{showing, surface_at};
use crate::scene::{Camera, Image, Photograph, Shape};

const COLOR: Color32 = Color32::from_rgb(255, 64, 129);
/// Opacity of the hatching and between it.
const HATCH: [f32; 2] = [0.75, 0.3];
/// Pixels of the picture of a mask from one stripe to the next.
const PERIOD: usize = 8;
/// Longest side of the picture of a mask.
const LONGEST_SIDE: usize = 1600;
/// Smallest and largest brush, in pixels of the photograph.
pub const RADII: std::ops::RangeInclusive<f32> = 0.5..=1000.0;
/// By which [ and ] change the brush.
const STEP: f32 = 1.2;
/// A line gets a new point where the cursor has moved this many points.
const MOVED: f32 = 1.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tool {
    Brush,
    Lasso,
    Box,
    Surface,
}

impl Tool {
    pub const ALL: [Self; 4] = [Self::Brush, Self::Lasso, Self::Box, Self::Surface];

    pub fn name(self) -> &'static str {
        match self {
            Self::Brush => "Brush",
            Self::Lasso => "Lasso",
            Self::Box => "Box",
            Self::Surface => "Surface",
        }
    }

    pub fn help(self) -> &'static str {
        match self {
            Self::Brush => {
                "Paint over what must not count; [ and ] change the size, Alt erases, Esc gives the \
                 stroke up"
            }
            Self::Lasso => "Draw around pixels to leave out; Alt erases, Esc abandons the stroke",
            Self::Box => "Drag a box over pixels to leave out; Alt erases, Esc abandons the stroke",
            Self::Surface => {
                "Click a surface: this photograph is left out wherever it shows it; Shift leaves all \
                 but the surface out, Alt erases"
            }
        }
    }
}

/// The tool in the hand, and what is being drawn with it.
pub struct Masking {
    pub tool: Option<Tool>,
    /// Of the brush, in pixels of the photograph.
    pub radius_px: f32,
    /// The tool erases, and paints with Alt.
    pub erases: bool,
    /// In pixels of the photograph; empty between strokes.
    line: Vec<DVec2>,
    /// Whether the stroke under way erases.
    is_erasing: bool,
    /// The pixels of the surface that was clicked, on their way.
    of_surface: Option<OfSurface>,
    overlay: Option<(Arc<Image>, egui::TextureHandle)>,
}

/// A thread looks for the pixels of a surface: a large photograph has millions.
struct OfSurface {
    photograph: usize,
    is_left_out: bool,
    pixels: Background<Vec<bool>>,
}

impl Default for Masking {
    fn default() -> Self {
        Self {
            tool: None,
            radius_px: 12.0,
            erases: false,
            line: Vec::new(),
            is_erasing: false,
            of_surface: None,
            overlay: None,
        }
    }
}

impl Masking {
    /// Whether a stroke is under way.
    pub fn is_drawing(&self) -> bool {
        !self.line.is_empty()
    }

    /// Forgets what belongs to a photograph.
    pub fn clear(&mut self) {
        self.line.clear();
        self.of_surface = None;
        self.overlay = None;
    }
}

/// The photograph under the tool.
pub(super) fn under<'a>(view: &Viewport, content: &'a Content) -> Option<(usize, &'a Photograph)> {
    let index = view.through?;
    let photograph = content.capture.as_ref()?.photographs.get(index)?;
    photograph.image.is_some().then_some((index, photograph))
}

/// Whether a tool has the photograph: clicks and drags are strokes.
pub fn is_active(view: &Viewport) -> bool {
    view.masking.tool.is_some() && view.through.is_some()
}

/// Draws with the tool; says whether the pointer is taken.
pub fn interact(
    view: &mut Viewport,
    ui: &Ui,
    response: &Response,
    content: &Content,
    p: &Projection,
    events: &mut Vec<ViewportEvent>,
) -> bool {
    let found = under(view, content);
    let (Some(tool), Some((index, photograph))) = (view.masking.tool, found) else {
        view.masking.line.clear();
        view.masking.of_surface = None;
        return false;
    };
    receive(&mut view.masking, index, events);
    if has_keys(ui, response) {
        for (key, factor) in [(Key::OpenBracket, 1.0 / STEP), (Key::CloseBracket, STEP)] {
            if ui.input_mut(|input| input.consume_key(Modifiers::NONE, key)) {
                let radius = view.masking.radius_px * factor;
                view.masking.radius_px = radius.clamp(*RADII.start(), *RADII.end());
            }
        }
    }
    let modifiers = ui.input(|input| input.modifiers);
    if response.contains_pointer() {
        ui.ctx().set_cursor_icon(match view.masking.of_surface {
            None => egui::CursorIcon::Crosshair,
            Some(_) => egui::CursorIcon::Progress,
        });
    }
    let camera = &photograph.camera;
    let place = |position: Pos2| pixel_at(camera, p, position - response.rect.min);
    if tool == Tool::Surface {
        let clicked = response.clicked_by(PointerButton::Primary);
        let position = response.interact_pointer_pos().filter(|_| clicked);
        if let Some(place) = position.and_then(place)
            && let Some(pixels) = of_surface(view, content, index, place, modifiers.shift, ui.ctx())
        {
            let is_left_out = view.masking.erases == modifiers.alt;
            view.masking.of_surface = Some(OfSurface { photograph: index, is_left_out, pixels });
        }
        return true;
    }
    let masking = &mut view.masking;
    if masking.is_drawing()
        && !ui.ctx().text_edit_focused()
        && ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Escape))
    {
        masking.line.clear();
        return true;
    }
    let pressed = response.is_pointer_button_down_on()
        && ui.input(|input| input.pointer.button_pressed(PointerButton::Primary));
    if pressed && let Some(place) = response.interact_pointer_pos().and_then(place) {
        response.request_focus();
        masking.is_erasing = masking.erases != modifiers.alt;
        masking.line = vec![place];
    } else if masking.is_drawing()
        && let Some(place) = response.interact_pointer_pos().and_then(place)
    {
        let step = f64::from(MOVED) / scale(camera, p);
        let is_far = masking.line.last().is_none_or(|last| last.distance(place) >= step);
        match tool {
            Tool::Box => {
                masking.line.truncate(1);
                masking.line.push(place);
            }
            _ if is_far => masking.line.push(place),
            _ => {}
        }
    }
    let is_down = ui.input(|input| input.pointer.primary_down());
    if masking.is_drawing() && !is_down {
        let line = std::mem::take(&mut masking.line);
        let shape = match tool {
            Tool::Box => Shape::Box([line[0], line[line.len() - 1]]),
            Tool::Lasso => Shape::Lasso(line),
            _ => Shape::Brush { line, radius_px: f64::from(masking.radius_px) },
        };
        let is_left_out = !masking.is_erasing;
        // What it changes is seen in the next frame.
        ui.ctx().request_repaint();
        events.push(ViewportEvent::Masked { photograph: index, shape, is_left_out });
    }
    true
}

/// Points of the window for a pixel of the photograph.
fn scale(camera: &Camera, p: &Projection) -> f64 {
    let (low, high) = window(camera);
    p.picture.map_or(1.0, |(_, size)| f64::from(size.x) / (high.x - low.x))
}

pub(super) fn pixel_at(camera: &Camera, p: &Projection, position: Vec2) -> Option<DVec2> {
    let ray = p.ray(glam::Vec2::new(position.x, position.y));
    camera.place(camera.position + ray.direction.as_dvec3())
}

pub(super) fn drawn_at(camera: &Camera, p: &Projection, pixel: DVec2) -> Option<Vec2> {
    let place = camera.position + camera.direction(pixel)?;
    let drawn = p.project(place.as_vec3())?;
    Some(vec2(drawn.x, drawn.y))
}

/// Looks for the pixels that show the surface below a place, or everything but it.
fn of_surface(
    view: &Viewport,
    content: &Content,
    photograph: usize,
    place: DVec2,
    all_but: bool,
    ctx: &egui::Context,
) -> Option<Background<Vec<bool>>> {
    let capture = content.capture.as_ref()?.clone();
    let caster = view.scene.caster.as_ref()?.clone();
    let camera = &capture.photographs[photograph].camera;
    let meant = surface_at(camera, &capture.mesh, &caster, place)?;
    Some(Background::run(ctx.clone(), move |send, is_wanted| {
        let camera = &capture.photographs[photograph].camera;
        let mut pixels = showing(camera, &capture.mesh, &caster, meant, is_wanted)?;
        pixels.iter_mut().for_each(|is_meant| *is_meant ^= all_but);
        send(pixels)
    }))
}

/// Takes the pixels of a surface once they are there; another photograph has no use for them.
fn receive(masking: &mut Masking, photograph: usize, events: &mut Vec<ViewportEvent>) {
    let Some(found) = masking.of_surface.take_if(|found| found.photograph == photograph) else {
        masking.of_surface = None;
        return;
    };
    let pixels = found.pixels.ready().next();
    match pixels {
        Some(pixels) => events.push(ViewportEvent::Masked {
            photograph,
            shape: Shape::Pixels(pixels),
            is_left_out: found.is_left_out,
        }),
        None => masking.of_surface = Some(found),
    }
}

/// The mask of the photograph, the stroke under way, and the brush.
pub fn draw(view: &mut Viewport, ui: &Ui, response: &Response, content: &Content, p: &Projection) {
    let Some((_, photograph)) = under(view, content) else {
        view.masking.overlay = None;
        return;
    };
    let camera = &photograph.camera;
    let painter = ui.painter_at(response.rect);
    let origin = response.rect.min;
    if let Some(image) = &photograph.image
        && let Some(texture) = overlay(&mut view.masking, ui.ctx(), image)
    {
        painter.add(stretched(camera, p, origin, texture));
    }
    let Some(tool) = view.masking.tool else { return };
    let masking = &view.masking;
    let radius = masking.radius_px * scale(camera, p) as f32;
    let color = if masking.is_erasing { Color32::WHITE } else { COLOR };
    let points: Vec<Pos2> =
        masking.line.iter().filter_map(|&own| Some(origin + drawn_at(camera, p, own)?)).collect();
    let thin = egui::Stroke::new(1.5, color);
    match tool {
        Tool::Brush => {
            let faint = color.gamma_multiply(0.5);
            if points.len() > 1 {
                painter.line(points, egui::Stroke::new(2.0 * radius, faint));
            } else if let [only] = points[..] {
                painter.circle_filled(only, radius, faint);
            }
            if let Some(cursor) = response.hover_pos() {
                painter.circle_stroke(cursor, radius, egui::Stroke::new(3.0, Color32::BLACK));
                painter.circle_stroke(cursor, radius, egui::Stroke::new(1.0, Color32::WHITE));
            }
        }
        Tool::Lasso => {
            painter.add(egui::Shape::closed_line(points, thin));
        }
        Tool::Box => {
            if let [from, .., to] = points[..] {
                let dragged = egui::Rect::from_two_pos(from, to);
                painter.rect_filled(dragged, 0.0, color.gamma_multiply(0.2));
                painter.rect_stroke(dragged, 0.0, thin, egui::StrokeKind::Middle);
            }
        }
        Tool::Surface => {}
    }
}

/// The picture of a photograph's mask; `None` where nothing is left out.
fn overlay<'a>(
    masking: &'a mut Masking,
    ctx: &egui::Context,
    image: &Arc<Image>,
) -> Option<&'a egui::TextureHandle> {
    let is_current = masking.overlay.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, image));
    if !is_current {
        masking.overlay = None;
        if image.masked_count() == 0 {
            return None;
        }
        let (width, height) = (image.width(), image.height());
        let step = width.max(height).div_ceil(LONGEST_SIDE).max(1);
        let size = [width.div_ceil(step), height.div_ceil(step)];
        let colors = HATCH.map(|opacity| COLOR.gamma_multiply(opacity));
        let mut pixels = Vec::with_capacity(size[0] * size[1]);
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            pixels.push(if image.is_masked(x * step, y * step) {
                colors[usize::from((x + y) % PERIOD >= PERIOD / 4)]
            } else {
                Color32::TRANSPARENT
            });
        }
        let picture = egui::ColorImage::new(size, pixels);
        let texture = ctx.load_texture("mask", picture, egui::TextureOptions::NEAREST);
        masking.overlay = Some((image.clone(), texture));
    }
    masking.overlay.as_ref().map(|(_, texture)| texture)
}

/// A picture of the photograph's size laid over it, bent as the lens bends.
fn stretched(
    camera: &Camera,
    p: &Projection,
    origin: Pos2,
    texture: &egui::TextureHandle,
) -> egui::Mesh {
    let steps: u32 = if camera.distortion.is_none() { 1 } else { 32 };
    let mut mesh = egui::Mesh::with_texture(texture.id());
    let size = DVec2::new(camera.width as f64, camera.height as f64);
    let part = |step: u32| f64::from(step) / f64::from(steps);
    let mut is_there = Vec::new();
    for (row, column) in (0..=steps).flat_map(|row| (0..=steps).map(move |column| (row, column))) {
        let uv = DVec2::new(part(column), part(row));
        let drawn = drawn_at(camera, p, uv * size);
        is_there.push(drawn.is_some());
        let pos = origin + drawn.unwrap_or_default();
        let uv = egui::pos2(uv.x as f32, uv.y as f32);
        mesh.vertices.push(egui::epaint::Vertex { pos, uv, color: Color32::WHITE });
    }
    for (row, column) in (0..steps).flat_map(|row| (0..steps).map(move |column| (row, column))) {
        let corner = row * (steps + 1) + column;
        let corners = [corner, corner + 1, corner + steps + 2, corner + steps + 1];
        if corners.iter().all(|&corner| is_there[corner as usize]) {
            mesh.add_triangle(corners[0], corners[1], corners[2]);
            mesh.add_triangle(corners[0], corners[2], corners[3]);
        }
    }
    mesh
}
