//! The data on the GPU. It is updated when shared data have changed, not in every frame.

use std::collections::BTreeSet;
use std::sync::Arc;

use eframe::{egui, wgpu};
use glam::Vec3;

use crate::app::viewport::background::{Background, Done};
use crate::app::viewport::content::{Content, Shading, ViewSettings};
use crate::app::viewport::gpu::{Globals, Pipelines, bind, note_upload, upload, upload_mesh};
use crate::app::viewport::known::{self, Look, UploadCache, bounds, has_same_photographs, same};
use crate::app::viewport::paint::{Batch, DepthMap};
use crate::app::viewport::palette::MaterialColors;
use crate::app::viewport::photographs::{self, Layers};
use crate::app::viewport::samples::{self, Scale};
use crate::app::viewport::{marks, surfaces, texels, thumbs};
use crate::geometry::bvh::RayCaster;
use crate::math::rgb::Radiance;
use crate::scene::Capture;

/// Everything on the GPU, and what it was made from.
pub struct Scene {
    pub device: wgpu::Device,
    queue: wgpu::Queue,
    pub pipelines: Arc<Pipelines>,
    globals_buffer: wgpu::Buffer,
    pub globals: wgpu::BindGroup,
    /// Grows with every upload, so that a picture that still holds is not drawn again.
    pub version: u64,
    pub capture: Option<Arc<Capture>>,
    /// The corners of the box around the geometry and the cameras.
    pub bounds: (Vec3, Vec3),
    /// Radiance that is shown almost white at an exposure of 0.
    pub bright: f32,
    pub caster: Option<Arc<RayCaster>>,
    background: Option<Background>,
    pub layers: Layers,
    /// The photograph that was asked for in full, and its texture once it is there.
    picture: Option<(usize, Option<wgpu::BindGroup>)>,
    picture_job: Option<Background>,
    /// The relit scene, and the same before that where it is wanted.
    pub relit: Option<(wgpu::BindGroup, Option<wgpu::BindGroup>)>,
    surface_rows: Vec<[u32; 4]>,
    surface_texture: wgpu::Texture,
    pub mesh: Vec<(wgpu::Buffer, u32)>,
    pub mesh_group: wgpu::BindGroup,
    pub points: Batch,
    pub sample_scale: Option<Scale>,
    pub discs: Batch,
    pub light_lines: Batch,
    pub lobes: Batch,
    /// Emission of the longest lobe.
    pub strongest_lobe: Option<f32>,
    pub frusta: Batch,
    /// The photographs in them.
    pub thumbs: Batch,
    pub grid: Batch,
    known: UploadCache,
}

impl Scene {
    pub fn new(device: wgpu::Device, queue: wgpu::Queue, window: wgpu::TextureFormat) -> Self {
        let pipelines = Arc::new(Pipelines::new(&device, window));
        Self::empty(device, queue, pipelines)
    }

    fn empty(device: wgpu::Device, queue: wgpu::Queue, pipelines: Arc<Pipelines>) -> Self {
        let (globals_buffer, globals) = pipelines.globals(&device);
        let layers = Layers::new(&device, &Capture::default());
        let surface_rows = surfaces::rows(
            &Capture::default(),
            &MaterialColors::default(),
            None,
            &BTreeSet::default(),
            &BTreeSet::default(),
        );
        let surface_texture = surfaces::texture(&device, &surface_rows);
        let mesh_group = mesh_group(&device, &pipelines, &surface_texture, &layers);
        Self {
            device,
            queue,
            pipelines,
            globals_buffer,
            globals,
            version: 0,
            capture: None,
            bounds: (Vec3::splat(-1.0), Vec3::ONE),
            bright: 1.0,
            caster: None,
            background: None,
            layers,
            picture: None,
            picture_job: None,
            relit: None,
            surface_rows,
            surface_texture,
            mesh: Vec::new(),
            mesh_group,
            points: None,
            sample_scale: None,
            discs: None,
            light_lines: None,
            lobes: None,
            strongest_lobe: None,
            frusta: None,
            thumbs: None,
            grid: None,
            known: UploadCache::default(),
        }
    }

    /// Gives everything back that was made from a capture.
    pub fn clear(&mut self) {
        let empty = Self::empty(self.device.clone(), self.queue.clone(), self.pipelines.clone());
        *self = Self { version: self.version + 1, ..empty };
    }

    /// The ball around everything.
    pub fn ball(&self) -> (Vec3, f32) {
        let (low, high) = self.bounds;
        (0.5 * (low + high), (0.5 * (high - low).length()).max(1e-3))
    }

    /// Brings everything up to date; true if the geometry is another than before.
    pub fn sync(
        &mut self,
        content: &Content,
        settings: &ViewSettings,
        look: &Look,
        ctx: &egui::Context,
    ) -> bool {
        let is_new = self.sync_capture(content.capture.as_ref(), ctx);
        self.receive();
        self.sync_surfaces(content);
        self.sync_samples(content, settings);
        self.sync_lights(content);
        self.sync_relit(content, settings);
        let filled = self.layers.filled().count();
        let lines = Some((content.selected_photograph, *look, filled));
        if self.known.lines != lines {
            self.known.lines = lines;
            self.sync_lines(content.selected_photograph, look);
        }
        is_new
    }

    fn sync_capture(&mut self, capture: Option<&Arc<Capture>>, ctx: &egui::Context) -> bool {
        if same(self.capture.as_ref(), capture) {
            return false;
        }
        let Some(capture) = capture else {
            self.clear();
            return true;
        };
        self.version += 1;
        let before = self.capture.replace(capture.clone());
        // An edit of the tags gives a new capture with the same geometry and photographs.
        if let Some(before) = before.filter(|before| has_same_photographs(before, capture)) {
            if !Arc::ptr_eq(&before.mesh, &capture.mesh) {
                self.sync_mesh(capture, ctx);
            }
            return false;
        }
        self.background = None;
        self.picture = None;
        self.picture_job = None;
        self.mesh.clear();
        self.caster = None;
        self.known.lines = None;
        self.bounds = bounds(capture);
        self.layers = Layers::new(&self.device, capture);
        self.mesh_group =
            mesh_group(&self.device, &self.pipelines, &self.surface_texture, &self.layers);
        self.background = Some(Background::prepare(
            capture.clone(),
            self.layers.photographs.clone(),
            self.layers.size,
            ctx.clone(),
        ));
        true
    }

    /// Takes another mesh beside the same photographs, as charts that come and go make it. What is on
    /// hand of the one before is shown until the new one is prepared.
    fn sync_mesh(&mut self, capture: &Arc<Capture>, ctx: &egui::Context) {
        self.caster = None;
        self.known.lines = None;
        self.bounds = bounds(capture);
        let missing = self.layers.missing();
        self.background =
            Some(Background::prepare(capture.clone(), missing, self.layers.size, ctx.clone()));
    }

    fn receive(&mut self) {
        let ready: Vec<Done> = self
            .background
            .iter()
            .chain(&self.picture_job)
            .flat_map(|background| background.ready().collect::<Vec<_>>())
            .collect();
        for done in ready {
            self.version += 1;
            match done {
                Done::Corners(corners) => {
                    self.mesh = upload_mesh(&self.device, &corners);
                    self.layers.forget_depths();
                }
                Done::Caster(caster) => self.caster = Some(caster),
                Done::Bright(bright) => self.bright = bright,
                Done::Layer { photograph, texels } => {
                    self.layers.fill(&self.queue, photograph, &texels);
                }
                Done::Picture { photograph, size, texels } => {
                    let group = photographs::picture(
                        &self.device,
                        &self.queue,
                        &self.pipelines,
                        size,
                        &texels,
                    );
                    self.picture = Some((photograph, group));
                    self.picture_job = None;
                }
            }
        }
    }

    fn sync_surfaces(&mut self, content: &Content) {
        let Some(capture) = &self.capture else { return };
        if self.known.surfaces.as_ref().is_some_and(|known| known.is_current(capture, content)) {
            return;
        }
        let rows = surfaces::rows(
            capture,
            &content.colors,
            content.of_results().map(|of| &**of).zip(content.solved.as_deref()),
            &content.selected_surfaces,
            &content.hidden_surfaces,
        );
        if rows.len() != self.surface_rows.len() {
            self.surface_texture = surfaces::texture(&self.device, &rows);
            self.mesh_group =
                mesh_group(&self.device, &self.pipelines, &self.surface_texture, &self.layers);
        }
        surfaces::write(&self.queue, &self.surface_texture, &rows);
        self.surface_rows = rows;
        self.version += 1;
        self.known.surfaces = Some(known::Surfaces::of(capture, content));
    }

    /// Whether some surface is drawn as one of which no reflectance is known.
    pub fn has_unknown_reflectance(&self) -> bool {
        self.surface_rows.iter().any(|row| row[2] & surfaces::UNKNOWN_REFLECTANCE != 0)
    }

    fn sync_samples(&mut self, content: &Content, settings: &ViewSettings) {
        let Some(cloud) = content.samples.as_ref().filter(|_| self.capture.is_some()) else {
            if self.known.samples.take().is_some() {
                self.version += 1;
                (self.points, self.sample_scale) = (None, None);
            }
            return;
        };
        let color = settings.sample_color;
        let now = known::Samples::of(cloud, color, content);
        if self.known.samples.as_ref().is_some_and(|known| known.is_current(&now)) {
            return;
        }
        let (points, scale) =
            samples::points(cloud, &content.result_colors, content.derived.as_deref(), color);
        self.points = upload(&self.device, &points);
        self.sample_scale = scale;
        self.version += 1;
        self.known.samples = Some(now);
    }

    fn sync_lights(&mut self, content: &Content) {
        let Some(products) = &content.lights else {
            if self.known.lights.take().is_some() {
                self.version += 1;
                (self.discs, self.light_lines, self.lobes) = (None, None, None);
                self.strongest_lobe = None;
            }
            return;
        };
        let now = known::Lights::of(products, content.solution.as_ref());
        if self.known.lights.as_ref().is_some_and(|known| known.is_current(&now)) {
            return;
        }
        let (lights, lobes) = products;
        let solution = content.solution.as_deref();
        let shapes = marks::lights(self.capture.as_deref(), lights, lobes, solution);
        self.discs = upload(&self.device, &shapes.discs);
        self.light_lines = upload(&self.device, &shapes.lines);
        self.lobes = upload(&self.device, &shapes.lobes);
        self.strongest_lobe = shapes.strongest;
        self.version += 1;
        self.known.lights = Some(now);
    }

    fn sync_relit(&mut self, content: &Content, settings: &ViewSettings) {
        let relit = content.relit.as_ref().filter(|_| settings.shading == Shading::Relit);
        if same(self.known.relit.as_ref(), relit) {
            return;
        }
        self.known.relit = relit.cloned();
        self.version += 1;
        self.relit = relit.and_then(|relit| {
            let upload = |pixels: &[(Radiance, f32)]| {
                let texels = texels::of_pixels(pixels, self.bright);
                let size = [relit.width, relit.height];
                photographs::picture(&self.device, &self.queue, &self.pipelines, size, &texels)
            };
            Some((upload(&relit.after)?, relit.before.as_deref().and_then(upload)))
        });
    }

    fn sync_lines(&mut self, selected: Option<usize>, look: &Look) {
        self.version += 1;
        let Some(capture) = &self.capture else {
            (self.frusta, self.thumbs, self.grid) = (None, None, None);
            return;
        };
        let depth = thumbs::depth(capture.photographs.len(), self.ball().1);
        let solid = [look.line[0], look.line[1], look.line[2], 1.0];
        let frusta = marks::frusta(capture, selected, look.accent, solid, depth);
        self.frusta = upload(&self.device, &frusta);
        let colors = [look.accent, solid];
        let thumbs = thumbs::thumbs(capture, self.layers.filled(), selected, colors, depth);
        self.thumbs = upload(&self.device, &thumbs);
        let ground = capture.mesh.bounds().unwrap_or(self.bounds);
        self.grid = upload(&self.device, &marks::grid(ground, look.line));
    }

    /// The photograph in full; starts to prepare it where it is not there.
    pub fn picture(&mut self, photograph: usize, ctx: &egui::Context) -> Option<wgpu::BindGroup> {
        let capture = self.capture.as_ref()?;
        if let Some((_, group)) = self.picture.as_ref().filter(|(index, _)| *index == photograph) {
            return group.clone();
        }
        // Before the exposure is known, the photograph has no unit to be stored in.
        if self.layers.photographs.is_empty() || self.is_preparing_exposure() {
            return None;
        }
        self.picture = Some((photograph, None));
        let limit = self.device.limits().max_texture_dimension_2d as usize;
        self.picture_job =
            Some(Background::picture(capture.clone(), photograph, self.bright, limit, ctx.clone()));
        None
    }

    /// The exposure is known before the ray tree is built, and before any photograph is made.
    fn is_preparing_exposure(&self) -> bool {
        self.caster.is_none()
    }

    /// Whether the background has delivered everything.
    pub fn is_filled(&self) -> bool {
        self.layers.is_complete()
    }

    /// A photograph's depth map that is still to be drawn; needs the mesh, which comes before the
    /// ray tree.
    pub fn next_depth_map(&self) -> Option<DepthMap> {
        let capture = self.capture.as_ref()?;
        self.caster.as_ref()?;
        let (device, queue) = (&self.device, &self.queue);
        self.layers.next_depth_map(device, queue, &self.pipelines, capture, self.ball())
    }

    pub fn write_globals(&self, globals: &Globals) {
        note_upload(size_of::<Globals>());
        self.queue.write_buffer(&self.globals_buffer, 0, bytemuck::bytes_of(globals));
    }
}

fn mesh_group(
    device: &wgpu::Device,
    pipelines: &Pipelines,
    surfaces: &wgpu::Texture,
    layers: &Layers,
) -> wgpu::BindGroup {
    let surfaces = surfaces.create_view(&wgpu::TextureViewDescriptor::default());
    let resources = [
        wgpu::BindingResource::TextureView(&surfaces),
        wgpu::BindingResource::TextureView(&layers.colors_view),
        wgpu::BindingResource::Sampler(&pipelines.smooth),
        wgpu::BindingResource::TextureView(&layers.depths_view),
    ];
    bind(device, &pipelines.mesh_layout, &resources)
}
