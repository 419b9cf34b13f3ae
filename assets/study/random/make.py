"""Random captures with known truth, rendered by Mitsuba 3: `python make.py OUT [--kinds K,...] [--each N]`.

Each capture is a folder that `lobelia reconstruct` takes (see the guide on formats) with a
`truth.json`. A capture depends only on its kind and its number: the same pair gives the same scene.

kinds  room       a corner whose ceiling and other walls are not modelled, lit by hidden lamps
       window     a modelled room, lit through one or two windows by a sky and, half the time, a sun
       open       things on the ground below a clear sky and a sun
       overcast   the same below an overcast sky
       texture    room or window; two walls carry a print of 10 to 35 %, of which no tag tells
       coat       room or window; floor and half of the things have a dielectric coat
       clutter    room or window; small things are photographed and not modelled
       furnished  window with coats, prints and clutter, and more things

Needs numpy, mitsuba and pyoidn (PyPI), and LLVM 19 (`DRJIT_LIBLLVM_PATH` says where, if not in the
system's place). Photographs are denoised: what noise is left is a few percent. Lengths are metres, z
is up, radiance is in an arbitrary unit.
"""
import argparse
import json
import math
import pathlib
from dataclasses import dataclass, field

import mitsuba as mi
import numpy as np
import pyoidn

mi.set_variant('llvm_ad_rgb')
from mitsuba import ScalarTransform4f as Transform  # noqa: E402

KINDS = 'room window open overcast texture coat clutter furnished'.split()
WIDTH, HEIGHT, VIEWS, DEPTH = 160, 120, 8, 12


@dataclass
class Material:
    """`print`: amplitude of the texture relative to `rho`; `roughness`: of the coat, None without."""
    rho: np.ndarray
    print: float = 0.0
    roughness: float = None


@dataclass
class Surface:
    """Triangles of one material; `known` surfaces are in scene.obj."""
    name: str
    material: str
    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    known: bool = True


@dataclass
class Scene:
    rng: np.random.Generator
    surfaces: list = field(default_factory=list)
    materials: dict = field(default_factory=dict)
    lights: dict = field(default_factory=dict)
    boxes: list = field(default_factory=list)
    cameras: list = field(default_factory=list)

    def material(self, name, low=0.08, high=0.8, **more):
        """A new material: a brightness and a tint."""
        tint = self.rng.uniform(0.6, 1.4, 3) if self.rng.random() < 0.6 else np.ones(3)
        rho = np.clip(self.rng.uniform(low, high) * tint / tint.mean(), 0.03, 0.85)
        self.materials[name] = Material(rho, **more)
        return name

    def add(self, name, material, parts, known=True):
        vertices, faces, uv, count = [], [], [], 0
        for v, f, t in parts:
            vertices.append(v), faces.append(f + count), uv.append(t)
            count += len(v)
        self.surfaces.append(Surface(name, material, np.concatenate(vertices),
                                     np.concatenate(faces), np.concatenate(uv), known))

    def stands(self, centre, size, gap=0.05):
        """Is the place free for a thing with this footprint?"""
        return all(np.any(np.abs(np.subtract(centre, c)) > (np.add(size, s)) / 2 + gap)
                   for c, s in ((b[0][:2], b[1][:2]) for b in self.boxes))


def quad(a, b, c, d):
    """Counter-clockwise seen from the front; texture coordinates in metres."""
    v = np.array([a, b, c, d], float)
    x = (v[1] - v[0]) / np.linalg.norm(v[1] - v[0])
    y = v[3] - v[0] - x * np.dot(v[3] - v[0], x)
    y /= np.linalg.norm(y)
    return v, np.array([[0, 1, 2], [0, 2, 3]]), np.stack([(v - v[0]) @ x, (v - v[0]) @ y], 1)


def box(base, size, angle=0.0):
    """A box that stands on `base`, the middle of its foot; without its foot."""
    x, y, z = np.array(size) / [2, 2, 1]
    turn = np.array([[math.cos(angle), math.sin(angle), 0], [-math.sin(angle), math.cos(angle), 0],
                     [0, 0, 1]])
    corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0],
                        [-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]]) @ turn + base
    sides = [(4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return [quad(*corners[list(side)]) for side in sides]


def table(base, size):
    """A slab on four legs."""
    x, y, z = size
    slab = box(np.add(base, [0, 0, z - 0.04]), (x, y, 0.04))
    low = z - 0.04
    under = quad(*(np.add(base, [sx * x / 2, sy * y / 2, low])
                   for sx, sy in [(-1, 1), (1, 1), (1, -1), (-1, -1)]))
    legs = [part for sx in (-1, 1) for sy in (-1, 1)
            for part in box(np.add(base, [sx * (x / 2 - .05), sy * (y / 2 - .05), 0]), (.06, .06, low))]
    return slab + [under] + legs


def turned(base, profile, steps=20):
    """A solid of revolution about z, from (radius, height) pairs, bottom to top."""
    angle = np.linspace(0, 2 * math.pi, steps, endpoint=False)
    rings = np.array([[[r * math.cos(a), r * math.sin(a), h] for a in angle] for r, h in profile])
    v = rings.reshape(-1, 3) + base
    faces = []
    for i in range(len(profile) - 1):
        for j in range(steps):
            a, b = i * steps + j, i * steps + (j + 1) % steps
            faces += [[a, b, b + steps], [a, b + steps, a + steps]]
    return [(v, np.array(faces), v[:, :2] - np.array(base)[:2])]


def ball(base, radius):
    angles = np.linspace(-math.pi / 2, math.pi / 2, 12)
    return turned(base, [(max(radius * math.cos(a), 1e-4), radius * (1 + math.sin(a))) for a in angles])


def cylinder(base, radius, height):
    return turned(base, [(radius, 0), (radius, height), (1e-4, height)])


def wall(corner, along, length, height, openings=()):
    """Vertical, seen from the left of `along`'s right turn; `openings` as (from, to, low, high)."""
    along = np.array(along, float)

    def part(a, b, low, high):
        at = [corner + along * s + [0, 0, z] for s, z in [(a, low), (b, low), (b, high), (a, high)]]
        return quad(*at)

    parts, done = [], 0.0
    for a, b, low, high in sorted(openings):
        parts += [part(done, a, 0, height), part(a, b, 0, low), part(a, b, high, height)]
        done = b
    return parts + [part(done, length, 0, height)]


def reveal(corner, along, opening, depth):
    """The four sides of an opening, going outward."""
    a, b, low, high = opening
    along = np.array(along, float)
    out = np.array([along[1], -along[0], 0.0]) * depth
    at = [corner + along * s + [0, 0, z] for s, z in [(a, low), (b, low), (b, high), (a, high)]]
    return [quad(at[i], at[i] + out, at[(i + 1) % 4] + out, at[(i + 1) % 4]) for i in range(4)]


def interior(scene, windows):
    """A room of four walls; with `windows` all of it is modelled, else a corner of it is."""
    rng = scene.rng
    w, d, h = rng.uniform(3.2, 5.2), rng.uniform(3.2, 5.2), rng.uniform(2.4, 3.0)
    scene.add('floor', scene.material('floor'), [quad((0, 0, 0), (w, 0, 0), (w, d, 0), (0, d, 0))])
    scene.add('ceiling', scene.material('ceiling', 0.5, 0.85),
              [quad((0, d, h), (w, d, h), (w, 0, h), (0, 0, h))], known=windows)
    # Inward normals: each wall runs so that the room is on its left.
    runs = [((w, 0, 0), (0, 1, 0), d), ((w, d, 0), (-1, 0, 0), w), ((0, d, 0), (0, -1, 0), d),
            ((0, 0, 0), (1, 0, 0), w)]
    glazed = set(rng.choice(4, rng.integers(1, 3), replace=False)) if windows else set()
    for i, (corner, along, length) in enumerate(runs):
        corner = np.array(corner, float)
        openings = []
        if i in glazed:
            wide = rng.uniform(0.9, 1.8)
            start = rng.uniform(0.3, length - wide - 0.3)
            openings = [(start, start + wide, rng.uniform(0.6, 1.0), rng.uniform(1.8, 2.2))]
            if 'frame' not in scene.materials:
                scene.material('frame', 0.5, 0.85)
            scene.add(f'frame{i}', 'frame', reveal(corner, along, openings[0], 0.2))
        scene.add(f'wall{i}', scene.material(f'wall{i}', 0.3, 0.85),
                  wall(corner, along, length, h, openings), known=windows or i in (0, 1))
    return w, d, h


def things(scene, w, d, count, low=0.3):
    """Things on the floor between the walls, each of its own material."""
    rng = scene.rng
    for i in range(count):
        for _ in range(40):
            kind = rng.choice(['box', 'table', 'ball', 'cylinder', 'cupboard'])
            size = {'box': rng.uniform(low, 0.9, 3), 'table': rng.uniform([.8, .6, .5], [1.5, 1, .9]),
                    'ball': np.full(3, rng.uniform(low, .7)),
                    'cylinder': rng.uniform(low, .7) * np.ones(3) * [1, 1, 1.4],
                    'cupboard': rng.uniform([.5, .4, 1], [1.1, .6, 1.9])}[kind]
            at = np.array([rng.uniform(size[0] / 2 + .1, w - size[0] / 2 - .1),
                           rng.uniform(size[1] / 2 + .1, d - size[1] / 2 - .1)])
            if scene.stands(at, size[:2]):
                break
        else:
            continue
        scene.boxes.append((np.append(at, 0), size))
        base = np.append(at, 0.0)
        parts = {'box': lambda: box(base, size), 'cupboard': lambda: box(base, size),
                 'table': lambda: table(base, size), 'ball': lambda: ball(base, size[0] / 2),
                 'cylinder': lambda: cylinder(base, size[0] / 2, size[2])}[kind]()
        scene.add(f'{kind}{i}', scene.material(f'{kind}{i}'), parts)


def clutter(scene, w, d):
    """Small things on the floor and on flat tops, photographed and not modelled."""
    rng = scene.rng
    tops = [(c[:2], s[:2], s[2]) for c, s in scene.boxes]
    for i in range(14):
        size = rng.uniform(.05, .2)
        if tops and rng.random() < .6:
            centre, extent, z = tops[rng.integers(len(tops))]
            at = np.append(centre + rng.uniform(-.35, .35, 2) * extent, z)
        else:
            at = np.array([rng.uniform(.2, w - .2), rng.uniform(.2, d - .2), 0])
        parts = box(at, rng.uniform(.5, 1.5, 3) * size, rng.uniform(0, 3)) if rng.random() < .5 \
            else ball(at, size / 2)
        scene.add(f'small{i}', scene.material(f'small{i}'), parts, known=False)


def lamps(scene, w, d, h):
    """Two or three lamps that no photograph is aimed at."""
    rng = scene.rng
    for i in range(rng.integers(2, 4)):
        colour = rng.uniform([.8, .7, .45], [1, 1, 1.1])
        at = np.array([rng.uniform(.4, w - .4), rng.uniform(.4, d - .4), h - rng.uniform(.05, .4)])
        radiance = {'type': 'rgb', 'value': (colour * rng.uniform(15, 45)).tolist()}
        emitter = {'type': 'area', 'radiance': radiance}
        if rng.random() < .5:
            shape = {'type': 'sphere', 'center': at.tolist(), 'radius': rng.uniform(.06, .18)}
        else:
            half = rng.uniform(.1, .3, 2)
            shape = {'type': 'rectangle', 'to_world': Transform().translate(at.tolist())
                     .rotate([1, 0, 0], 180).scale([half[0], half[1], 1])}
        scene.lights[f'lamp{i}'] = shape | {'emitter': emitter}


def outside(scene, overcast=False, sun=True, towards=None):
    """A sky over ground; `towards`: unit vector, horizontal, from which the sun comes (None: any)."""
    rng = scene.rng
    rows, columns = 64, 128
    up = np.cos((np.arange(rows) + .5) / rows * math.pi)[:, None, None]
    if overcast:
        sky = rng.uniform(.8, 1.5) * (1 + 2 * up) / 3 * np.array([.95, 1, 1.05])
        ground = rng.uniform(.1, .25)
    else:
        horizon, zenith = rng.uniform([.7, .8, .9], [1, 1, 1.1]), rng.uniform([.2, .35, .8], [.4, .6, 1])
        height = np.sqrt(np.maximum(up, 0))
        sky = (horizon * (1 - height) + zenith * height) * rng.uniform(.8, 2)
        ground = rng.uniform(.15, .5)
    image = np.where(up > 0, sky, ground * np.array([1, .95, .85])) * np.ones((rows, columns, 3))
    scene.lights['sky'] = {'type': 'envmap', 'bitmap': mi.Bitmap(image.astype(np.float32)),
                           'to_world': Transform().rotate([1, 0, 0], 90)}
    if sun and not overcast:
        elevation = rng.uniform(.35, 1.1)
        azimuth = rng.uniform(0, 2 * math.pi)
        if towards is not None:
            azimuth = math.atan2(towards[1], towards[0]) + rng.uniform(-.7, .7)
        down = -np.array([math.cos(azimuth) * math.cos(elevation),
                          math.sin(azimuth) * math.cos(elevation), math.sin(elevation)])
        scene.lights['sun'] = {'type': 'directional', 'direction': down.tolist(), 'irradiance': {
            'type': 'rgb', 'value': (rng.uniform(4, 14) * np.array([1, .93, .8])).tolist()}}


def view(eye, target):
    """World from camera, OpenGL axes (+x right, +y up, looking along -z)."""
    forward = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(right, forward), -forward, eye], 1)
    return matrix


def look_inside(scene, w, d, windows):
    """From beside the walls across the room; where only a corner is modelled, into that."""
    rng = scene.rng
    for i in range(VIEWS):
        for _ in range(200):
            turn = 2 * math.pi * (i + rng.uniform(-.4, .4)) / VIEWS
            if windows:
                eye = np.array([w, d]) / 2 * (1 + .85 * np.array([math.cos(turn), math.sin(turn)]))
                target = np.array([w, d]) * rng.uniform(.3, .7, 2)
            else:
                eye = np.array([w, d]) * rng.uniform(.05, .45, 2)
                target = np.array([w, d]) * rng.uniform(.6, 1, 2)
            if scene.stands(eye, [.4, .4]) and np.linalg.norm(target - eye) > 1.2:
                break
        height = rng.uniform(.4, 1.8 if windows else 1.2)
        scene.cameras.append(view(np.append(eye, rng.uniform(1.3, 1.9)), np.append(target, height)))


def compose(kind, number):
    scene = Scene(np.random.default_rng([KINDS.index(kind), number]))
    rng = scene.rng
    if kind in ('open', 'overcast'):
        scene.add('ground', scene.material('ground', .1, .5),
                  [quad((0, 0, 0), (6, 0, 0), (6, 6, 0), (0, 6, 0))])
        scene.add('beyond', scene.material('beyond', .1, .4),
                  [quad((-40, -40, -.02), (46, -40, -.02), (46, 46, -.02), (-40, 46, -.02))], known=False)
        if rng.random() < .6:
            scene.add('wall', scene.material('wall', .3, .8), box((3, 5.7, 0), (5, .2, 2.2)))
            scene.boxes.append(((3, 5.7, 0), (5, .4, 2.2)))
        things(scene, 6, 5.4, rng.integers(4, 8))
        outside(scene, overcast=kind == 'overcast')
        for i in range(VIEWS):
            angle = math.pi * (1.05 + .9 * (i + rng.uniform(.1, .9)) / VIEWS)
            eye = [3 + 5 * math.cos(angle), 3 + 4.5 * math.sin(angle), rng.uniform(1.3, 2.4)]
            scene.cameras.append(view(eye, [3, 3.2, rng.uniform(.1, .6)]))
        return scene
    windows = kind in ('window', 'furnished') or kind != 'room' and rng.random() < .5
    w, d, h = interior(scene, windows)
    things(scene, w, d, rng.integers(5, 9) if kind == 'furnished' else rng.integers(3, 6))
    if windows:
        glazed = [s for s in scene.surfaces if s.name.startswith('frame')]
        towards = glazed[0].vertices.mean(0)[:2] - [w / 2, d / 2]
        outside(scene, sun=rng.random() < .5, towards=towards)
    else:
        lamps(scene, w, d, h)
    if kind in ('coat', 'furnished'):
        names = [n for n in scene.materials if not n.startswith(('wall', 'ceiling', 'frame'))]
        for name in ['floor'] + [n for n in names if n != 'floor' and rng.random() < .5]:
            scene.materials[name].roughness = float(rng.uniform(.05, .3))
    if kind in ('texture', 'furnished'):
        for name in ('wall0', 'wall1'):
            scene.materials[name].print = float(rng.uniform(.1, .35))
    if kind in ('clutter', 'furnished'):
        clutter(scene, w, d)
    look_inside(scene, w, d, windows)
    return scene


def bsdf(material):
    """Mitsuba's description; a print is a smooth random pattern that repeats every 2 metres."""
    colour = {'type': 'rgb', 'value': material.rho.tolist()}
    if material.print:
        colour = {'type': 'bitmap', 'bitmap': mi.Bitmap(pattern(material).astype(np.float32)),
                  'raw': True, 'to_uv': Transform().scale([.5, .5, 1])}
    if material.roughness:
        return {'type': 'roughplastic', 'diffuse_reflectance': colour, 'int_ior': 1.5,
                'alpha': material.roughness, 'nonlinear': True, 'distribution': 'ggx'}
    return {'type': 'twosided', 'bsdf': {'type': 'diffuse', 'reflectance': colour}}


def pattern(material):
    y, x = np.mgrid[0:64, 0:64] / 64 * 2 * math.pi
    waves = np.sin(3 * x + np.sin(2 * y)) * np.sin(5 * y + np.sin(x))
    return np.clip(material.rho * (1 + material.print * np.sqrt(2) * waves[..., None]), .02, .95)


def effective(material):
    """Effective diffuse albedo, lit at 45 degrees: what leaves without being mirrored by the coat."""
    if material.print:
        return pattern(material).mean((0, 1))
    if not material.roughness:
        return material.rho
    plastic = mi.load_dict(bsdf(material))
    context = mi.BSDFContext()
    context.component = 1
    count = 200000
    points = np.random.default_rng(1).random((2, count)).astype(np.float32)
    out = mi.warp.square_to_cosine_hemisphere(mi.Point2f(points))
    at = mi.SurfaceInteraction3f()
    at.wi = mi.Vector3f(math.sqrt(.5), 0, math.sqrt(.5))
    value = plastic.eval(context, at, out) / mi.warp.square_to_cosine_hemisphere_pdf(out)
    return np.array(value).reshape(3, -1).mean(1)


def described(scene):
    """The scene as Mitsuba's dictionary."""
    result = {'type': 'scene', 'integrator': {
        'type': 'aov', 'aovs': 'albedo:albedo,normal:sh_normal',
        'path': {'type': 'path', 'max_depth': DEPTH}}} | scene.lights
    for surface in scene.surfaces:
        mesh = mi.Mesh(surface.name, len(surface.vertices), len(surface.faces), has_vertex_texcoords=True,
                       props=properties(scene.materials[surface.material]))
        values = mi.traverse(mesh)
        values['vertex_positions'] = surface.vertices.astype(np.float32).ravel()
        values['faces'] = surface.faces.astype(np.uint32).ravel()
        values['vertex_texcoords'] = surface.uv.astype(np.float32).ravel()
        values.update()
        result[f'surface_{surface.name}'] = mesh
    return result


def properties(material):
    made = mi.Properties()
    made['bsdf'] = mi.load_dict(bsdf(material))
    made['face_normals'] = True
    return made


def write(scene, folder, kind, samples):
    (folder / 'images').mkdir(parents=True, exist_ok=True)
    width = math.radians(68)
    focal = WIDTH / 2 / math.tan(width / 2)
    loaded = mi.load_dict(described(scene))
    flip = np.diag([-1.0, 1, -1, 1])
    for i, matrix in enumerate(scene.cameras):
        sensor = mi.load_dict({
            'type': 'perspective', 'fov': math.degrees(width), 'fov_axis': 'x', 'near_clip': .01,
            'to_world': mi.ScalarTransform4f(matrix @ flip),
            'film': {'type': 'hdrfilm', 'width': WIDTH, 'height': HEIGHT, 'rfilter': {'type': 'box'},
                     'pixel_format': 'rgb', 'component_format': 'float32'},
            'sampler': {'type': 'independent', 'sample_count': samples}})
        layers = np.array(mi.render(loaded, sensor=sensor, spp=samples, seed=i))
        colour, albedo, normal = (np.ascontiguousarray(layers[..., k:k + 3]) for k in (0, 3, 6))
        clean = pyoidn.denoise(colour, albedo=albedo, normal=normal, hdr=True)
        mi.Bitmap(clean).convert(component_format=mi.Struct.Type.Float16).write(
            str(folder / f'images/{i:03}.exr'))
    frames = [{'file_path': f'images/{i:03}.exr', 'transform_matrix': m.tolist()}
              for i, m in enumerate(scene.cameras)]
    known = [s for s in scene.surfaces if s.known]
    names = sorted({s.material for s in known})
    tags = [{'name': n, 'kind': 'specular' if scene.materials[n].roughness else 'diffuse',
             'surfaces': [s.name for s in known if s.material == n]} for n in names]
    truth = {'kind': kind, 'groups': {s.name: s.material for s in known}, 'materials': {
        n: {'model': 'roughplastic' if scene.materials[n].roughness else 'diffuse',
            'rho_d': np.round(effective(scene.materials[n]), 5).tolist()} for n in names}}
    for name, value in [('transforms', {'camera_model': 'PINHOLE', 'w': WIDTH, 'h': HEIGHT, 'fl_x': focal,
                                        'fl_y': focal, 'cx': WIDTH / 2, 'cy': HEIGHT / 2, 'frames': frames}),
                        ('tags', {'materials': tags}), ('truth', truth)]:
        (folder / f'{name}.json').write_text(json.dumps(value, indent=1))
    with open(folder / 'scene.obj', 'w') as obj:
        count = 1
        for s in known:
            obj.write(f'o {s.name}\nusemtl {s.name}\n')
            obj.writelines('v %.6g %.6g %.6g\n' % tuple(v) for v in s.vertices)
            obj.writelines('f %d %d %d\n' % tuple(f + count) for f in s.faces)
            count += len(s.vertices)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('out', type=pathlib.Path)
    parser.add_argument('--kinds', default=','.join(KINDS))
    parser.add_argument('--each', type=int, default=8, help='captures of each kind')
    parser.add_argument('--samples', type=int, default=64, help='paths for each pixel')
    options = parser.parse_args()
    for number in range(options.each):
        for kind in options.kinds.split(','):
            folder = options.out / f'{kind}-{number}'
            if not (folder / 'truth.json').exists():
                write(compose(kind, number), folder, kind, options.samples)
            print(folder, flush=True)


if __name__ == '__main__':
    main()
