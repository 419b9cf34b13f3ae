"""A capture with a mirror ball in a room, and the true panorama at the ball's middle, by Mitsuba 3.9.

    pip install mitsuba numpy && python3 make.py

Three cameras look at the ball from three sides. The panorama is traced without the ball: latitude and longitude, z
up, the left edge looking along +y and then over +x, as the program has it.
"""
import json
import math

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
T = mi.ScalarTransform4f
SIZE, RADIUS, MIDDLE, REFLECTANCE = 160, 0.05, [0.3, -0.2, 1.1], [0.9, 0.85, 0.8]


def matte(r, g, b):
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [r, g, b]}}}


def wall(transform, bsdf, **more):
    return {"type": "rectangle", "to_world": transform, "bsdf": bsdf, **more}


# Room of 5 x 4 x 2.6 m: name, corners counter-clockwise seen from inside, colour.
X, Y, Z = 2.5, 2.0, 2.6
WALLS = {
    "floor": ([[-X, -Y, 0], [X, -Y, 0], [X, Y, 0], [-X, Y, 0]], (0.45, 0.35, 0.25)),
    "ceiling": ([[-X, -Y, Z], [-X, Y, Z], [X, Y, Z], [X, -Y, Z]], (0.8, 0.8, 0.8)),
    "north": ([[-X, Y, 0], [X, Y, 0], [X, Y, Z], [-X, Y, Z]], (0.3, 0.5, 0.7)),
    "south": ([[X, -Y, 0], [-X, -Y, 0], [-X, -Y, Z], [X, -Y, Z]], (0.7, 0.65, 0.6)),
    "east": ([[X, Y, 0], [X, -Y, 0], [X, -Y, Z], [X, Y, Z]], (0.7, 0.3, 0.2)),
    "west": ([[-X, -Y, 0], [-X, Y, 0], [-X, Y, Z], [-X, -Y, Z]], (0.25, 0.55, 0.3)),
}
room = {"type": "scene", "integrator": {"type": "path", "max_depth": 12, "rr_depth": 30}}
with open("scene.obj", "w") as out:
    for index, (name, (corners, colour)) in enumerate(WALLS.items()):
        a, b, c, d = (np.array(corner, float) for corner in corners)
        # Mitsuba's rectangle spans -1 to 1.
        middle, u, v = (a + c) / 2, (b - a) / 2, (d - a) / 2
        matrix = np.column_stack([[*u, 0], [*v, 0], [*np.cross(u, v), 0], [*middle, 1]])
        room[name] = wall(T(matrix), matte(*colour))
        for corner in corners:
            out.write("v {} {} {}\n".format(*corner))
        out.write(f"usemtl {name}\nf " + " ".join(str(4 * index + k) for k in range(1, 5)) + "\n")
# A window as a lamp, and a second lamp near the floor.
room["window"] = wall(T().translate([0.6, Y - 0.01, 1.4]).rotate([1, 0, 0], 90).scale([0.7, 0.6, 1]), matte(0, 0, 0),
                      emitter={"type": "area", "radiance": {"type": "rgb", "value": [4.0, 4.4, 5.0]}})
room["lamp"] = wall(T().translate([-X + 0.02, -0.8, 0.7]).rotate([0, 1, 0], 90).scale([0.3, 0.25, 1]), matte(0, 0, 0),
                    emitter={"type": "area", "radiance": {"type": "rgb", "value": [6.0, 4.0, 2.0]}})
room["box"] = {"type": "cube", "to_world": T().translate([1.4, -1.2, 0.4]).scale([0.4, 0.3, 0.4]), "bsdf": matte(0.7, 0.7, 0.7)}
ball = {"type": "sphere", "center": MIDDLE, "radius": RADIUS,
        "bsdf": {"type": "conductor", "material": "none",
                 "specular_reflectance": {"type": "rgb", "value": REFLECTANCE}}}
with_ball = mi.load_dict({**room, "ball": ball})
frames, outlines = [], {}
for index, degrees in enumerate([20, 140, 260]):
    turn = math.radians(degrees)
    place = np.array(MIDDLE) + [0.9 * math.cos(turn), 0.9 * math.sin(turn), 0.25]
    distance = np.linalg.norm(np.array(MIDDLE) - place)
    # Not quite at the middle of the picture, where the outline is no circle.
    target = np.array(MIDDLE) + [0.006, -0.004, 0.005]
    fov = 2 * math.degrees(math.asin(RADIUS / distance)) * 1.35
    sensor = mi.load_dict({
        "type": "perspective", "fov": fov, "to_world": T().look_at(place.tolist(), target.tolist(), [0, 0, 1]),
        "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}, "pixel_format": "rgb",
                 "component_format": "float16"},
        "sampler": {"type": "independent", "sample_count": 1024},
    })
    picture = mi.render(with_ball, sensor=sensor, seed=index)
    mi.Bitmap(picture).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float16, False).write(f"{index}.exr")
    back = (place - target) / np.linalg.norm(place - target)
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    axes = np.column_stack([right, np.cross(back, right), back])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, place
    frames.append({"file_path": f"{index}.exr", "transform_matrix": matrix.tolist()})
    focal = SIZE / 2 / math.tan(math.radians(fov) / 2)
    # Where rays touch the ball: directions at its angular radius from its middle.
    axis = (np.array(MIDDLE) - place) / distance
    e = np.cross(axis, [0, 0, 1])
    e /= np.linalg.norm(e)
    f, alpha = np.cross(axis, e), math.asin(RADIUS / distance)
    points = []
    for around in [0.3, 1.7, 2.9, 4.1, 5.5]:
        ray = axes.T @ (math.cos(alpha) * axis + math.sin(alpha) * (math.cos(around) * e + math.sin(around) * f))
        points.append([round(SIZE / 2 - focal * ray[0] / ray[2], 2), round(SIZE / 2 + focal * ray[1] / ray[2], 2)])
    outlines[f"{index}.exr"] = points
with open("transforms.json", "w") as out:
    json.dump({"camera_model": "PINHOLE", "w": SIZE, "h": SIZE, "fl_x": focal, "fl_y": focal, "cx": SIZE / 2,
               "cy": SIZE / 2, "frames": frames}, out, indent=1)
with open("ball.json", "w") as out:
    json.dump({"middle": MIDDLE, "radius": RADIUS, "reflectance": REFLECTANCE, "outlines": outlines}, out, indent=1)
# The truth.
scene = mi.load_dict(room)
W, H, SUB, REPEAT = 96, 48, 6, 24
i, j = np.meshgrid(np.arange(W * SUB), np.arange(H * SUB))
azimuth, polar = (i.ravel() + 0.5) / (W * SUB) * 2 * math.pi, (j.ravel() + 0.5) / (H * SUB) * math.pi
direction = np.stack([np.sin(polar) * np.sin(azimuth), np.sin(polar) * np.cos(azimuth), np.cos(polar)])
total = 0
for seed in range(REPEAT):
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(azimuth))
    rays = mi.RayDifferential3f(mi.Point3f(*MIDDLE), mi.Vector3f(*[mi.Float(d) for d in direction]))
    color, _, _ = scene.integrator().sample(scene, sampler, rays)
    total = total + np.array(color).T if np.array(color).shape[0] == 3 else total + np.array(color)
truth = (total / REPEAT).reshape(H, SUB, W, SUB, 3).mean((1, 3)).astype(np.float32)
mi.Bitmap(truth).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float16, False).write("truth.exr")
print(truth.mean((0, 1)), truth.max())
