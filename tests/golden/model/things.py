"""Makes things.json and things.truth.json: a room with one thing of every kind, in four photographs.

    python things.py

Made with numpy, which shares no code with the program. Strokes are off by Gaussian noise of 0.5 px
(seed 3). The room is an L of 4.2 x 3.6 m with a door and a window; a table stands in it, a box on it, a
cupboard against a wall, a prism and a can on the floor, a poster hangs on a wall, a board leans.
"""
import json
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
random = np.random.default_rng(3)
W, H, F = 1600, 1200, 1000.0


def box(x, y, yaw, w, d, h, low=0.0):
    c, s = np.cos(yaw), np.sin(yaw)
    ring = [(-.5, -.5), (.5, -.5), (.5, .5), (-.5, .5)]
    flat = [(x + a * w * c - b * d * s, y + a * w * s + b * d * c) for a, b in ring]
    return {f"{n}{k + 1}": (*p, z) for n, z in (("bottom", low), ("top", low + h)) for k, p in enumerate(flat)}


def raised(ring, low, high, names):
    return {f"{n}{k + 1}": (*p, z) for n, z in zip(names, (low, high)) for k, p in enumerate(ring)}


floor = [(0, 0), (4.2, 0), (4.2, 2.0), (2.6, 2.0), (2.6, 3.6), (0, 3.6)]
room = raised(floor, 0, 2.5, ("floor", "ceiling"))
# Left lower, right lower, right upper, left upper as seen from inside: wall 1 has y = 0, x falls to the right.
room |= {f"door{k}": p for k, p in zip((1, 2, 3, 4), [(3.4, 0, 0), (2.5, 0, 0), (2.5, 0, 2.0), (3.4, 0, 2.0)])}
room |= {f"window{k}": p for k, p in zip((1, 2, 3, 4), [(0, 1.0, .9), (0, 2.3, .9), (0, 2.3, 2.1), (0, 1.0, 2.1)])}
things = {
    "room": room,
    "table": box(1.5, 1.6, 0.4, 1.2, 0.7, 0.72),
    "case": box(1.6, 1.55, 1.0, 0.4, 0.3, 0.25, 0.72),
    # Against wall 6, x = 0, from y = 2.5 to 3.2 (left to right), 0.4 deep.
    "cupboard": raised([(0, 3.2), (0, 2.5), (0.4, 2.5), (0.4, 3.2)], 0, 1.3, ("bottom", "top")),
    "wedge": raised([(2.9, 0.9), (3.5, 1.0), (3.1, 1.5)], 0, 0.5, ("bottom", "top")),
    "poster": {f"corner{k}": p for k, p in zip((1, 2, 3, 4), [(1.9, 0, 1.1), (1.1, 0, 1.1), (1.1, 0, 1.9), (1.9, 0, 1.9)])},
    "board": {f"corner{k}": p for k, p in zip((1, 2, 3, 4), [(2.0, 2.9, 0), (2.5, 2.7, 0), (2.55, 2.85, .9), (2.05, 3.05, .9)])},
}
can = dict(x=0.8, y=0.7, radius=0.2, height=0.45)


def look(position, target):
    z = np.asarray(position, float) - target
    z /= np.linalg.norm(z)
    x = np.cross([0, 0, 1], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], 1), np.array(position, float)


places = [((4.0, 1.8, 1.6), (0.8, 0.9, 0.7)), ((2.4, 3.4, 1.7), (1.4, 0.6, 0.6)), ((0.3, 0.3, 2.0), (2.1, 2.0, 0.5)),
          ((3.9, 0.3, 1.5), (0.9, 1.9, 0.8))]
cameras = [look(*place) for place in places]


def project(camera, point):
    p = camera[0].T @ (np.asarray(point, float) - camera[1])
    if p[2] > -0.2:
        return None
    pixel = np.array([p[0], -p[1]]) / -p[2] * F + [W / 2, H / 2]
    return pixel if 0 < pixel[0] < W and 0 < pixel[1] < H else None


def off(pixel):
    return [round(float(x), 3) for x in pixel + 0.5 * random.normal(size=2)]


strokes = []
for index, camera in enumerate(cameras):
    photograph = f"images/{index}.jpg"
    for axis in range(3):
        found = 0
        for start in [(0.2, 0.1, 0.0), (0.3, 3.4, 0.0), (0.0, 0.5, 2.2), (1.0, 0.0, 0.3), (0.0, 3.0, 0.2), (2.0, 0.0, 1.0)]:
            ends = [project(camera, start), project(camera, np.array(start) + np.eye(3)[axis])]
            if all(end is not None for end in ends) and found < 3:
                found += 1
                strokes.append({"kind": "line", "photograph": photograph, "axis": "xyz"[axis],
                                "from": off(ends[0]), "to": off(ends[1])})
    for name, corners in things.items():
        for corner, place in corners.items():
            pixel = project(camera, place)
            if pixel is not None:
                strokes.append({"kind": "pick", "photograph": photograph, "at": f"{name}.{corner}", "pixel": off(pixel)})
    for circle, z in (("bottom", 0.0), ("top", can["height"])):
        for angle in np.arange(6) * 1.05 + 0.2:
            pixel = project(camera, (can["x"] + can["radius"] * np.cos(angle), can["y"] + can["radius"] * np.sin(angle), z))
            if pixel is not None:
                strokes.append({"kind": "rim", "photograph": photograph, "at": f"can.{circle}", "pixel": off(pixel)})
strokes += [{"kind": "position", "at": "room.floor1", "position": [0, 0, 0]},
            {"kind": "length", "between": ["room.floor1", "room.floor2"], "length_m": 4.2}]
# The first stroke is a line, the second a pick: tests damage them.
first = next(k for k, s in enumerate(strokes) if s["kind"] == "pick")
strokes.insert(1, strokes.pop(first))
model = {
    "format": "lobelia-model", "version": 1,
    "lenses": [{"id": "lens", "fit": ["focal_px"]}],
    "photographs": [{"file_path": f"images/{k}.jpg", "lens": "lens", "w": W, "h": H} for k in range(len(cameras))],
    "things": [
        {"id": "room", "kind": "room", "corners": 6, "rectilinear": True, "surfaces": {"ceiling": None},
         "openings": [{"id": "door", "wall": 1}, {"id": "window", "wall": 6}], "hold": {"door.bottom": 0}},
        {"id": "table", "kind": "box", "surface": "table"},
        {"id": "case", "kind": "box", "on": "table.top"},
        {"id": "cupboard", "kind": "box", "flush": "room.wall6"},
        {"id": "wedge", "kind": "prism", "corners": 3},
        {"id": "poster", "kind": "polygon", "corners": 4, "on": "room.wall1"},
        {"id": "board", "kind": "polygon", "corners": 4, "on": "free"},
        {"id": "can", "kind": "cylinder"}],
    "strokes": strokes,
}
truth = {
    "made_by": "tests/golden/model/things.py", "size_m": float(np.linalg.norm([4.2, 3.6, 2.5])),
    "cameras": [{"file_path": f"images/{k}.jpg", "focal_px": F, "rotation": r.tolist(), "position": p.tolist()}
                for k, (r, p) in enumerate(cameras)],
    "corners": {f"{name}.{corner}": [float(x) for x in place] for name, own in things.items() for corner, place in own.items()},
    "can": can,
}
for name, value in (("things", model), ("things.truth", truth)):
    (HERE / f"{name}.json").write_text(json.dumps(value, separators=(",", ":")) + "\n")
