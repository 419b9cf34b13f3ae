//! A sketch of a thing: its corners and edges can be clicked to choose which of them is drawn next.

use eframe::egui::{self, Color32, FontId, Pos2, Rect, Sense, Stroke as Line, Vec2, pos2, vec2};

use super::overlay::EDGE;
use crate::app::modelling::ModelPage;
use crate::app::modelling::tool::{Target, Tool, edge_targets};
use crate::app::theme;
use crate::model::things::corner_names;
use crate::model::{Model, Place, Shape, Support, Thing};

/// Height of the sketch, in points.
const HEIGHT: f32 = 168.0;
/// Around it there is room for names.
const MARGIN: f32 = 24.0;

/// The sketch of a thing; clicks choose what is shown next.
pub fn diagram_ui(ui: &mut egui::Ui, page: &mut ModelPage, model: &Model, index: usize) {
    let thing = &model.things[index];
    if thing.shape == Shape::Cylinder {
        rims_ui(ui, page, model, index);
        return;
    }
    let size = vec2(ui.available_width(), HEIGHT);
    let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, ui.visuals().extreme_bg_color);
    let corners = placed(&sketch(thing), rect.shrink(MARGIN));
    let names = corner_names(thing);
    let text = ui.visuals().text_color();
    for target in edge_targets(model, index) {
        let Target::Edge([Place::Corner { corner: a, .. }, Place::Corner { corner: b, .. }]) =
            target
        else {
            continue;
        };
        let ends = [corners[a], corners[b]];
        // Not over the corners, which are chosen more often.
        let handle = Rect::from_center_size(ends[0].lerp(ends[1], 0.5), Vec2::splat(18.0));
        let name = format!("Edge {} to {}", names[a], names[b]);
        let response =
            ui.interact(handle, ui.scope_id().with(("edge", index, a, b)), Sense::click());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
        let count = target.count(model, page.shown);
        let is_on = page.tool == Tool::Mark(target);
        let color = if count > 0 { EDGE } else { text.gamma_multiply(0.55) };
        let width = if is_on { 3.5 } else { 1.5 };
        let color = if is_on { theme::ACCENT } else { color };
        painter.line_segment(ends, Line::new(width, color));
        let middle = handle.center();
        if response.hovered() || is_on {
            painter.circle(middle, 4.0, ui.visuals().window_fill, Line::new(1.5, color));
        }
        let times = if count == 1 { "stroke" } else { "strokes" };
        let help = format!("{name}: {count} {times} here. Click to draw pieces of it.");
        if response.on_hover_text(help).clicked() {
            page.tool = Tool::Mark(target);
        }
    }
    let middle = corners.iter().fold(Vec2::ZERO, |sum, own| sum + own.to_vec2())
        / corners.len().max(1) as f32;
    for (corner, (at, name)) in corners.iter().zip(&names).enumerate() {
        let target = Target::Place(Place::Corner { thing: index, corner });
        let handle = Rect::from_center_size(*at, Vec2::splat(16.0));
        let response =
            ui.interact(handle, ui.scope_id().with(("corner", index, corner)), Sense::click());
        let label = format!("Corner {name}");
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &label));
        let is_shown = target.count(model, page.shown) > 0;
        let is_on = page.tool == Tool::Mark(target);
        let fill = match (is_on, is_shown) {
            (true, _) => theme::ACCENT,
            (false, true) => EDGE,
            (false, false) => ui.visuals().window_fill,
        };
        let radius = if is_on || response.hovered() { 6.5 } else { 5.0 };
        painter.circle(*at, radius, fill, Line::new(1.2, text));
        let away = (at.to_vec2() - middle).normalized();
        let number: String = name.chars().filter(char::is_ascii_digit).collect();
        let short = if is_on { name.clone() } else { number };
        let color = if is_on { ui.visuals().strong_text_color() } else { text };
        let galley = painter.layout_no_wrap(short, FontId::proportional(11.0), color);
        // The whole name stands below or above its corner, a number beside it.
        let place = match is_on {
            true => *at + vec2(0.0, 15.0 * away.y.signum()),
            false => *at + 13.0 * away,
        };
        let own = Rect::from_center_size(place, galley.size());
        // The name of the next one is long, and stays within the sketch.
        let inside = rect.shrink(2.0);
        let shift = (inside.min - own.min).max(Vec2::ZERO) + (inside.max - own.max).min(Vec2::ZERO);
        painter.galley(own.min + shift, galley, Color32::WHITE);
        let help = match is_shown {
            true => format!("{name}: shown in this photograph. Click to show it anew."),
            false => format!("{name}: click, then click where the photograph shows it."),
        };
        if response.on_hover_text(help).clicked() {
            page.tool = Tool::Mark(target);
        }
    }
    ui.weak(
        "Click a corner or an edge, then draw it; orange is drawn here already. Space skips a corner \
         that is not seen.",
    );
}

/// The circles of a cylinder.
fn rims_ui(ui: &mut egui::Ui, page: &mut ModelPage, model: &Model, index: usize) {
    for (top, name) in [(true, "Top circle"), (false, "Bottom circle")] {
        let target = Target::Rim(index, top);
        let count = target.count(model, page.shown);
        let times = if count == 1 { "point" } else { "points" };
        let button = egui::Button::selectable(page.tool == Tool::Mark(target), name)
            .shortcut_text(format!("{count} {times} here"));
        let button = button.min_size(vec2(ui.available_width(), 0.0));
        let help = "Click points on this circle, three or more and far apart";
        if ui.add(button).on_hover_text(help).clicked() {
            page.tool = Tool::Mark(target);
        }
    }
}

/// The corners of a thing of no particular size, seen from the front and above: right, away, up.
fn sketch(thing: &Thing) -> Vec<[f32; 3]> {
    let regular = |count: usize| -> Vec<[f32; 2]> {
        // The first side is in front.
        let turn = std::f32::consts::TAU / count as f32;
        let at = |i: usize| (i as f32 - 0.5) * turn - 0.5 * std::f32::consts::PI;
        (0..count).map(|i| [at(i).cos(), at(i).sin()]).collect()
    };
    let square = vec![[-1.0, -0.8], [1.0, -0.8], [1.0, 0.8], [-1.0, 0.8]];
    let raised = |outline: &[[f32; 2]], tall: f32| -> Vec<[f32; 3]> {
        let level = |z: f32| outline.iter().map(move |[x, y]| [*x, *y, z]);
        level(0.0).chain(level(tall)).collect()
    };
    match &thing.shape {
        Shape::Room { corners, rectilinear, openings } => {
            let outline = match (*rectilinear, *corners) {
                (_, 4) => square,
                (true, count) => stairs(count),
                (false, count) => regular(count),
            };
            let mut all = raised(&outline, 1.3);
            for opening in openings {
                let (a, b) = (outline[opening.wall], outline[(opening.wall + 1) % corners]);
                // Seen from inside, a wall runs from the left to the right against the outline.
                for (s, z) in [(0.65, 0.3), (0.35, 0.3), (0.35, 0.9), (0.65, 0.9)] {
                    all.push([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), z]);
                }
            }
            all
        }
        Shape::Box { .. } => raised(&square, 1.1),
        Shape::Prism { corners: 4 } => raised(&square, 1.1),
        Shape::Prism { corners } => raised(&regular(*corners), 1.1),
        Shape::Polygon { corners } => {
            let outline = if *corners == 4 { square } else { regular(*corners) };
            let is_upright = matches!(thing.on, Support::Side(_));
            let at = |[x, y]: [f32; 2]| if is_upright { [x, 0.0, y] } else { [x, y, 0.0] };
            outline.into_iter().map(at).collect()
        }
        Shape::Cylinder => Vec::new(),
    }
}

/// An outline of right angles: a corner with steps.
fn stairs(count: usize) -> Vec<[f32; 2]> {
    let steps = count / 2 - 1;
    let mut outline = vec![[0.0, 0.0], [steps as f32, 0.0]];
    for step in 0..steps {
        let x = (steps - step) as f32;
        outline.push([x, (step + 1) as f32]);
        outline.push([x - 1.0, (step + 1) as f32]);
    }
    outline.truncate(count);
    outline
}

/// The sketch in a rectangle.
fn placed(corners: &[[f32; 3]], rect: Rect) -> Vec<Pos2> {
    let flat: Vec<Vec2> =
        corners.iter().map(|[x, y, z]| vec2(x + 0.42 * y, -z - 0.36 * y)).collect();
    let low = flat.iter().fold(Vec2::splat(f32::INFINITY), |a, b| a.min(*b));
    let high = flat.iter().fold(Vec2::splat(f32::NEG_INFINITY), |a, b| a.max(*b));
    let size = (high - low).max(Vec2::splat(1e-3));
    let scale = (rect.width() / size.x).min(rect.height() / size.y);
    let middle = 0.5 * (low + high);
    let at = |own: Vec2| rect.center() + scale * (own - middle);
    flat.into_iter().map(at).map(|own| pos2(own.x, own.y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Opening, Surfaces};

    /// Every corner has a place of its own, wherever it is to be clicked.
    #[test]
    fn corners_of_sketches_are_apart() {
        let opening = Opening { id: "door".into(), wall: 3 };
        for shape in [
            Shape::Room { corners: 4, rectilinear: true, openings: vec![opening.clone()] },
            Shape::Room { corners: 6, rectilinear: true, openings: vec![opening] },
            Shape::Room { corners: 10, rectilinear: true, openings: Vec::new() },
            Shape::Room { corners: 5, rectilinear: false, openings: Vec::new() },
            Shape::Box { flush: None },
            Shape::Prism { corners: 3 },
            Shape::Prism { corners: 7 },
            Shape::Polygon { corners: 5 },
        ] {
            let thing = Thing {
                id: "a".into(),
                shape,
                on: Support::Floor,
                held: Vec::new(),
                surfaces: Surfaces::default(),
            };
            let rect = Rect::from_min_size(Pos2::ZERO, vec2(260.0, HEIGHT)).shrink(MARGIN);
            let all = placed(&sketch(&thing), rect);
            assert_eq!(all.len(), corner_names(&thing).len());
            for (index, a) in all.iter().enumerate() {
                assert!(rect.expand(0.1).contains(*a));
                for b in &all[index + 1..] {
                    assert!(a.distance(*b) > 9.0, "{:?}: {a} {b}", thing.shape);
                }
            }
        }
    }
}
