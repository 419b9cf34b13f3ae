//! What becomes of materials and lights when charts come, change and go.

use std::sync::Arc;

use super::Edit;
use crate::scene::charts::{ChartSurface, LaidChart, surfaces};
use crate::scene::{Capture, KnownLight, Material};

impl Edit {
    /// Exchanges the charts, and with them their surfaces and materials. `loaded` has those before.
    pub(super) fn set_charts(&mut self, charts: &Arc<Vec<LaidChart>>, loaded: &Capture) {
        let [before, after] = [&self.charts, charts].map(|charts| surfaces(charts));
        let first = loaded.surfaces.len() - before.len();
        // Where the surfaces before are found again, by their places behind those of the files.
        let is_same = |a: &ChartSurface, b: &ChartSurface| {
            a.name == b.name && a.known.is_some() == b.known.is_some()
        };
        let moved: Vec<Option<usize>> =
            before.iter().map(|own| after.iter().position(|other| is_same(own, other))).collect();
        let renumbered = |surface: usize| match surface.checked_sub(first) {
            None => Some(surface),
            Some(own) => moved[own].map(|own| first + own),
        };
        let emptied = |surfaces: &mut Vec<usize>| {
            let had = !surfaces.is_empty();
            *surfaces = surfaces.iter().filter_map(|&surface| renumbered(surface)).collect();
            had && surfaces.is_empty()
        };
        let gone: Vec<usize> = (0..self.materials.len())
            .filter(|&material| emptied(&mut self.materials[material].surfaces))
            .collect();
        for material in gone.into_iter().rev() {
            self.remove(material);
        }
        let given = Arc::make_mut(&mut self.given);
        given.lights.retain_mut(|light| match light {
            KnownLight::Visible { surfaces, .. } => !emptied(surfaces),
            KnownLight::Shape { .. } | KnownLight::Dome { .. } => true,
        });
        // A value that nobody changed is that of the chart.
        for (own, at) in before.iter().zip(&moved) {
            let (Some(known), Some(at)) = (own.known, at) else { continue };
            for material in &mut self.materials {
                if material.surfaces.contains(&(first + at))
                    && (material.known_diffuse, material.known_diffuse_sd)
                        == (Some(known[0]), Some(known[1]))
                    && let Some([reflectance, sd]) = after[*at].known
                {
                    material.known_diffuse = Some(reflectance);
                    material.known_diffuse_sd = Some(sd);
                }
            }
        }
        for (index, own) in after.iter().enumerate() {
            if let Some(known) = own.known.filter(|_| !moved.contains(&Some(index))) {
                let is_taken = self.materials.iter().any(|other| other.name == own.name);
                let name = if is_taken { self.free_name(&own.name) } else { own.name.clone() };
                self.materials.push(Material::of_chart(name, first + index, known));
            }
        }
        self.charts = charts.clone();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::change::Change;
    use crate::app::edit::tests::capture;
    use crate::app::given::surfaces_of;
    use crate::reconstruct::Options;
    use crate::scene::charts::{Chart, ChartKind, Placed, Table};

    /// Exchanges the charts of a project; the capture that is then reconstructed.
    fn put(loaded: &mut Capture, edit: &mut Edit, charts: Vec<LaidChart>) -> Capture {
        let charts = Arc::new(charts);
        edit.apply(&Change::Charts { name: "charts", charts: charts.clone() }, loaded).unwrap();
        *loaded = loaded.with_charts(charts);
        edit.capture(loaded, None)
    }

    /// Materials with the names of their surfaces.
    fn names(capture: &Capture) -> Vec<String> {
        let name = |own: &Material| {
            let surfaces = own.surfaces.iter().map(|&own| capture.surfaces[own].name.as_str());
            format!("{}: {}", own.name, surfaces.collect::<Vec<_>>().join(" "))
        };
        capture.materials.iter().map(name).collect()
    }

    /// A card on the floor, or one that cannot be used.
    fn card(name: &str, rho: f64, is_placed: bool) -> LaidChart {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let corners = corners.map(|(x, y)| glam::DVec3::new(x, y, 0.0));
        let chart = Chart {
            name: name.into(),
            kind: ChartKind::Grey,
            table: Table::card([rho; 3], [0.01; 3]),
            views: Vec::new(),
            size_m: None,
        };
        let placed = is_placed.then_some(Placed { corners, tilt_sd: 0.0 }).ok_or_else(String::new);
        LaidChart { chart, placed }
    }

    #[test]
    fn charts_bring_their_materials_and_take_them_along() {
        let mut loaded = capture();
        let mut edit = Edit::of(&loaded, Options::default());
        let plain = edit.clone();
        let mut put = |edit: &mut Edit, charts: Vec<LaidChart>| put(&mut loaded, edit, charts);
        let both = vec![card("a", 0.2, true), card("lost", 0.2, false), card("b", 0.3, true)];
        let with_both = put(&mut edit, both);
        assert_eq!(names(&with_both), ["s0: s0", "s1: s1", "s2: s2", "a: a", "b: b"]);
        assert_eq!((with_both.mesh.triangles.len(), with_both.surfaces.len()), (4, 5));
        assert!(!edit.same_reconstruction_inputs(&plain));
        // The first goes, and the surface of the second is where that was.
        let without = put(&mut edit, vec![card("b", 0.25, true)]);
        assert_eq!(names(&without), ["s0: s0", "s1: s1", "s2: s2", "b: b"]);
        assert_eq!(without.materials[3].known_diffuse, Some([0.25; 3]), "it follows the chart");
        // What somebody has changed stays.
        edit.materials[3].known_diffuse = Some([0.4; 3]);
        edit.materials[3].name = "mine".into();
        let again = put(&mut edit, vec![card("a", 0.2, true), card("b", 0.3, true)]);
        assert_eq!(names(&again), ["s0: s0", "s1: s1", "s2: s2", "mine: b", "a: a"]);
        assert_eq!(again.materials[3].known_diffuse, Some([0.4; 3]));
        // One that cannot be used any more is no surface.
        let none = put(&mut edit, vec![card("a", 0.2, false)]);
        assert_eq!(names(&none), ["s0: s0", "s1: s1", "s2: s2"]);
        assert!(none.mesh.triangles.is_empty() && none.mesh.positions.is_empty());
        assert!(edit.same_reconstruction_inputs(&plain));
    }

    #[test]
    fn a_light_of_a_chart_that_goes_is_none_and_others_find_their_surfaces() {
        let mut loaded = capture();
        let mut edit = Edit::of(&loaded, Options::default());
        put(&mut loaded, &mut edit, vec![card("a", 0.2, true), card("b", 0.3, true)]);
        let given = edit.given.with_visible(&[3].into()).with_visible(&[4].into());
        let given = Arc::new(given);
        edit.apply(&Change::Given { name: "lights", of: None, given }, &loaded).unwrap();
        put(&mut loaded, &mut edit, vec![card("b", 0.3, true)]);
        let surfaces: Vec<&[usize]> = edit.given.lights.iter().map(surfaces_of).collect();
        assert_eq!(surfaces, [[3]]);
    }
}
