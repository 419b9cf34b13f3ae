//! As much of Embree 3's interface as single rays need, loaded at run time.

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::ptr::null;

use glam::Vec3;
use libloading::{Library, Symbol};
use lobelia::geometry::bvh::Ray;

#[repr(C, align(16))]
struct RtcRay {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    far: f32,
    mask: c_uint,
    id: c_uint,
    flags: c_uint,
}

#[repr(C, align(16))]
struct RtcHit {
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: c_uint,
    geometry: c_uint,
    instance: [c_uint; 1],
}

#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    hit: RtcHit,
}

#[repr(C)]
struct RtcContext {
    flags: c_int,
    filter: *const c_void,
    instance: [c_uint; 1],
}

const INVALID: c_uint = c_uint::MAX;
const GEOMETRY_TYPE_TRIANGLE: c_int = 0;
const BUFFER_TYPE_INDEX: c_int = 0;
const BUFFER_TYPE_VERTEX: c_int = 1;
const FORMAT_UINT3: c_int = 0x5003;
const FORMAT_FLOAT3: c_int = 0x9003;

type Handle = *mut c_void;
type Commit = unsafe extern "C" fn(Handle);
type Intersect1 = unsafe extern "C" fn(Handle, *mut RtcContext, *mut RtcRayHit);
type Occluded1 = unsafe extern "C" fn(Handle, *mut RtcContext, *mut RtcRay);

/// A scene of one triangle mesh, kept until the process ends.
pub struct Embree {
    scene: Handle,
    intersect: Intersect1,
    occluded: Occluded1,
}

impl Embree {
    pub fn load(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, libloading::Error> {
        // SAFETY: the library's initialisers are those of a distribution's package; the
        // signatures are those of Embree 3's headers; buffers hold the counts they are told to.
        unsafe {
            // Never unloaded: its worker threads outlive the scene, and would wake to nothing.
            let library: &Library = Box::leak(Box::new(Library::new("libembree3.so.3")?));
            let new_device: Symbol<unsafe extern "C" fn(*const c_char) -> Handle> =
                library.get(b"rtcNewDevice")?;
            let new_scene: Symbol<unsafe extern "C" fn(Handle) -> Handle> =
                library.get(b"rtcNewScene")?;
            let new_geometry: Symbol<unsafe extern "C" fn(Handle, c_int) -> Handle> =
                library.get(b"rtcNewGeometry")?;
            let new_buffer: Symbol<
                unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void,
            > = library.get(b"rtcSetNewGeometryBuffer")?;
            let commit_geometry: Symbol<Commit> = library.get(b"rtcCommitGeometry")?;
            let attach: Symbol<unsafe extern "C" fn(Handle, Handle) -> c_uint> =
                library.get(b"rtcAttachGeometry")?;
            let release_geometry: Symbol<Commit> = library.get(b"rtcReleaseGeometry")?;
            let commit_scene: Symbol<Commit> = library.get(b"rtcCommitScene")?;

            let device = new_device(null());
            let geometry = new_geometry(device, GEOMETRY_TYPE_TRIANGLE);
            let vertices =
                new_buffer(geometry, BUFFER_TYPE_VERTEX, 0, FORMAT_FLOAT3, 12, positions.len());
            vertices.cast::<Vec3>().copy_from_nonoverlapping(positions.as_ptr(), positions.len());
            let indices =
                new_buffer(geometry, BUFFER_TYPE_INDEX, 0, FORMAT_UINT3, 12, triangles.len());
            indices
                .cast::<[u32; 3]>()
                .copy_from_nonoverlapping(triangles.as_ptr(), triangles.len());
            commit_geometry(geometry);
            let scene = new_scene(device);
            attach(scene, geometry);
            release_geometry(geometry);
            commit_scene(scene);

            Ok(Self {
                scene,
                intersect: *library.get(b"rtcIntersect1")?,
                occluded: *library.get(b"rtcOccluded1")?,
            })
        }
    }

    pub fn count_closest(&self, rays: &[Ray]) -> usize {
        let mut context = incoherent();
        let met = |ray: &&Ray| {
            let hit = RtcHit {
                normal: [0.0; 3],
                u: 0.0,
                v: 0.0,
                primitive: INVALID,
                geometry: INVALID,
                instance: [INVALID],
            };
            let mut both = RtcRayHit { ray: convert(ray), hit };
            // SAFETY: the scene is committed, and the structures are laid out as Embree's.
            unsafe { (self.intersect)(self.scene, &mut context, &mut both) };
            both.hit.geometry != INVALID
        };
        rays.iter().filter(met).count()
    }

    pub fn count_occluded(&self, rays: &[Ray]) -> usize {
        let mut context = incoherent();
        let met = |ray: &&Ray| {
            let mut ray = convert(ray);
            // SAFETY: the scene is committed, and the structures are laid out as Embree's.
            unsafe { (self.occluded)(self.scene, &mut context, &mut ray) };
            ray.far == f32::NEG_INFINITY
        };
        rays.iter().filter(met).count()
    }
}

/// As `rtcInitIntersectContext` leaves it.
fn incoherent() -> RtcContext {
    RtcContext { flags: 0, filter: null(), instance: [INVALID] }
}

fn convert(ray: &Ray) -> RtcRay {
    RtcRay {
        origin: ray.origin.to_array(),
        near: ray.t_min,
        direction: ray.direction.to_array(),
        time: 0.0,
        far: ray.t_max,
        mask: c_uint::MAX,
        id: 0,
        flags: 0,
    }
}
