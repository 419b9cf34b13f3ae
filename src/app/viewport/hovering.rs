//! The object under the pointer, and the value of the picture there.

use eframe::egui::Response;
use glam::Vec2;

use super::content::{Content, PictureValue, Shading};
use super::picking::Picker;
use super::projection::Projection;
use super::{Viewport, input};
use crate::math::rgb::Radiance;
use crate::render::composite::covered_radiance;
use crate::scene::Capture;

impl Viewport {
    pub(super) fn hover(
        &mut self,
        response: &Response,
        content: &Content,
        projection: &Projection,
    ) {
        self.hovered = None;
        self.value = None;
        let Some(position) = response.hover_pos().filter(|_| response.contains_pointer()) else {
            return;
        };
        let Some((capture, caster)) = self.scene.capture.as_ref().zip(self.scene.caster.as_ref())
        else {
            return;
        };
        let picker = Picker { capture, caster, hidden: &content.hidden_surfaces };
        let local = position - response.rect.min;
        let at = Vec2::new(local.x, local.y);
        if let Some(photograph) = input::thumb_under(self, &picker, content, projection, at) {
            let name = capture.photographs[photograph].name.clone();
            response.clone().on_hover_ui_at_pointer(|ui| {
                ui.label(name);
                ui.weak("Double click to look through it");
            });
            return;
        }
        let layers = self.ranked(capture, content, projection);
        let photographs = layers.iter().map(|layer| self.scene.layers.photographs[*layer]);
        self.hovered = picker.value(projection, at, photographs);
        self.value = self.picture_value(capture, content, projection, at);
    }

    /// What is drawn at a position, before exposure and tone mapping.
    fn picture_value(
        &self,
        capture: &Capture,
        content: &Content,
        projection: &Projection,
        at: Vec2,
    ) -> Option<PictureValue> {
        let measured = |radiance: Option<Radiance>| {
            Some(radiance.map_or(PictureValue::NoMeasurement, PictureValue::Radiance))
        };
        if self.settings.shading == Shading::Relit {
            let relit = content.relit.as_ref().filter(|_| self.scene.relit.is_some())?;
            let part = (at / projection.size).clamp(Vec2::ZERO, Vec2::ONE);
            let is_before = self.settings.before.is_some_and(|line| part.x < line);
            let pixels = relit.before.as_ref().filter(|_| is_before).unwrap_or(&relit.after);
            let index = |part: f32, count: usize| ((part * count as f32) as usize).min(count - 1);
            let place = index(part.y, relit.height) * relit.width + index(part.x, relit.width);
            let &(radiance, coverage) = pixels.get(place)?;
            let seen = covered_radiance(radiance, coverage).unwrap_or(radiance);
            return Some(PictureValue::Radiance(seen));
        }
        if let Some(photograph) = self.through.filter(|_| self.settings.look_through_opacity > 0.0)
        {
            let photograph = capture.photographs.get(photograph)?;
            let image = photograph.image.as_ref()?;
            let ray = projection.ray(at);
            let seen = (ray.origin + ray.direction).as_dvec3();
            let (pixel, _) = photograph.camera.project(seen)?;
            let (x, y) = (pixel.x.floor(), pixel.y.floor());
            let is_inside = x >= 0.0
                && y >= 0.0
                && (x as usize) < image.width()
                && (y as usize) < image.height();
            return is_inside.then(|| measured(image.radiance(x as usize, y as usize)))?;
        }
        let hovered = self.hovered.as_ref()?;
        match self.settings.shading {
            Shading::Photograph if hovered.no_measurement.is_some() => measured(None),
            Shading::Photograph => {
                hovered.radiance.map(|(radiance, _)| PictureValue::Radiance(radiance))
            }
            Shading::Reflectance => {
                let surface = content.of_results()?.surfaces.get(hovered.surface)?;
                let own = content.solved.as_ref()?.reflectances.get(surface.material()?)?;
                own.as_ref().map(|own| PictureValue::Reflectance(own.diffuse))
            }
            _ => None,
        }
    }
}
