"""Makes tracks.json: photographs with strokes and an engine's points, and what SciPy makes of them.

    python tracks.py > tracks.json

Made with SciPy and numpy. Cameras, lens, drawn points and all points of the engine are adjusted at
once, in the coordinates of the world, by scipy.optimize.least_squares; the program eliminates the
engine's points instead, in the engine's coordinates. The cost is that of the guide
(assets/guide/modelling.md): Cauchy's loss of scale 3 px of each coordinate of what was drawn and of
the distance of an engine's point from its pixel, the latter in units of their own standard
deviation; focal length and k1 are drawn to the engine's with standard deviations of 5 % and 0.05.
"""
import json

import numpy as np
from scipy.optimize import least_squares

from scipy_adjust_parts import axis_line, complex_jacobian, look, norm, project, rotation

random = np.random.default_rng(8)
LOSS = 3.0
LENS = (900.0, 600.0, 450.0, -0.08, 0.0)
CAMERAS, POINTS, OUTLIERS = 5, 70, 6


def robust(r, axis=None):
    """Residuals of which half the squares are Cauchy's loss of the residuals, or of their lengths."""
    s = (r * r if axis is None else np.sum(r * r, axis, keepdims=True)) / LOSS ** 2
    return r * np.sqrt(np.log1p(s) / (s + 1e-300))


places = [np.array([3 * np.cos(a), 3 * np.sin(a), 1.5 + 0.3 * np.sin(3 * a)]) for a in np.linspace(-2.4, 0.2, CAMERAS)]
bases = [look(p, [0.1, -0.2, 0.3]) for p in places]
truth = [(base, np.zeros(3), place) for base, place in zip(bases, places)]
points = random.uniform([-1, -1, 0], [1, 1, 1], (POINTS, 3))
marks = {"p": np.array([0.0, 0.0, 0.0]), "q": np.array([1.0, 0.0, 0.0])}

strokes = []
for index, camera in enumerate(truth):
    name = f"{index}.exr"
    for at, place in marks.items():
        pixel = project(LENS, camera, place) + random.normal(size=2)
        strokes.append({"kind": "pick", "photograph": name, "at": at, "pixel": list(pixel)})
    for axis in (2, 0):
        start = random.uniform(-0.6, 0.4, 3)
        ends = [project(LENS, camera, p) + random.normal(size=2) for p in (start, start + np.eye(3)[axis])]
        strokes.append({"kind": "line", "photograph": name, "axis": "xyz"[axis],
                        "from": list(ends[0]), "to": list(ends[1])})
strokes.append({"kind": "position", "at": "p", "position": [0, 0, 0], "sd_m": 0.001})
strokes.append({"kind": "length", "between": ["p", "q"], "length_m": 1.0, "sd_m": 0.001})

tracks = []
for k, point in enumerate(points):
    shown = sorted(random.choice(CAMERAS, random.integers(2, CAMERAS + 1), replace=False).tolist())
    tracks.append([(i, project(LENS, truth[i], point) + 0.4 * random.normal(size=2)) for i in shown])
# One of many: of two, either may be taken for the wrong one.
long = [k for k, track in enumerate(tracks) if len(track) > 3][::-1]
for k in range(OUTLIERS):
    i, pixel = tracks[long[4 * k]][0]
    tracks[long[4 * k]][0] = (i, pixel + np.array([34.0, -29.0]))
seen = np.array([(k, i) for k, track in enumerate(tracks) for i, _ in track])
pixels = np.array([pixel for track in tracks for _, pixel in track])

# The engine has all in coordinates of its own, with a wrong lens, and each camera and point off.
turn, scale, shift = rotation(np.array([0.3, -1.1, 2.0])), 0.37, np.array([3.0, -1.0, 2.0])
engine_lens = (945.0, 600.0, 450.0, 0.0, 0.0)
engine = []
for base, _, place in truth:
    off = base @ rotation(0.01 * random.normal(size=3))
    engine.append((turn @ off, scale * (turn @ (place + 0.05 * random.normal(size=3))) + shift))
engine_points = [scale * (turn @ (p + 0.05 * random.normal(size=3))) + shift for p in points]


def unpack(x):
    lens = [900 * x[0], LENS[1], LENS[2], x[1], 0.0]
    cameras = [(base, x[2 + 6 * i:5 + 6 * i], x[5 + 6 * i:8 + 6 * i]) for i, base in enumerate(bases)]
    rest = x[2 + 6 * CAMERAS:].reshape(-1, 3)
    return lens, cameras, {"p": rest[0], "q": rest[1]}, rest[2:]


def off_tracks(x):
    lens, cameras, _, places = unpack(x)
    return np.array([project(lens, cameras[i], places[k]) for k, i in seen]) - pixels


def residuals(x, sd):
    lens, cameras, at, _ = unpack(x)
    drawn, typed = [], []
    for s in strokes:
        if s["kind"] == "position":
            typed += list((at[s["at"]] - np.array(s["position"])) / s["sd_m"])
        elif s["kind"] == "length":
            typed.append((norm(at["p"] - at["q"]) - s["length_m"]) / s["sd_m"])
        else:
            camera = cameras[int(s["photograph"].split(".")[0])]
            if s["kind"] == "pick":
                drawn += list(project(lens, camera, at[s["at"]]) - np.array(s["pixel"]))
            else:
                drawn.append(axis_line(lens, camera, "xyz".index(s["axis"]), s["from"], s["to"]))
    typed += [(lens[0] - engine_lens[0]) / (0.05 * engine_lens[0]), (lens[3] - engine_lens[3]) / 0.05]
    return np.concatenate([robust(np.array(drawn)), typed, robust(off_tracks(x), 1).ravel() / sd])


x = np.concatenate([[1.0, LENS[3]], np.concatenate([np.append(np.zeros(3), p) for p in places]),
                    *marks.values(), points.ravel()])
sd = 0.4
for _ in range(40):
    result = least_squares(lambda x: residuals(x, sd), x, jac=lambda x: complex_jacobian(lambda y: residuals(y, sd), x),
                           ftol=1e-15, xtol=1e-15, gtol=1e-15, x_scale="jac", max_nfev=500)
    x = result.x
    off = np.sum(off_tracks(x) ** 2, 1)
    freedom = 2 * len(seen) - 3 * POINTS - (6 * CAMERAS + 2) + 7
    last, sd = sd, max(np.sqrt(np.sum(off / (1 + off / LOSS ** 2)) / freedom), 0.25)
    if abs(sd - last) < 1e-13:
        break


def quaternion(m):
    """w, x, y, z of a rotation that is not near a half turn."""
    w = np.sqrt(1 + np.trace(m)) / 2
    return [w, (m[2, 1] - m[1, 2]) / (4 * w), (m[0, 2] - m[2, 0]) / (4 * w), (m[1, 0] - m[0, 1]) / (4 * w)]


def line(position, track):
    return " ".join(str(v) for v in position) + "  " + " ".join(f"{i}@{p[0]},{p[1]}" for i, p in track)


lens, cameras, at, _ = unpack(x)
print(json.dumps({
    "made_by": "SciPy least_squares, tests/golden/model/tracks.py",
    "model": {
        "format": "lobelia-model", "version": 2,
        "lenses": [{"id": "lens", "focal_px": engine_lens[0], "principal_px": list(LENS[1:3]),
                    "k1": 0.0, "k2": 0.0, "fit": ["focal_px", "k1"]}],
        "photographs": [{"file_path": f"{k}.exr", "w": 1200, "h": 900,
                         "found": {"rotation": quaternion(r), "position": list(p), "distance": 3 * scale}}
                        for k, (r, p) in enumerate(engine)],
        "points": [{"id": "p"}, {"id": "q"}], "strokes": strokes,
        "found_points": [line(p, t) for p, t in zip(engine_points, tracks)],
    },
    "track_px": sd,
    "lens": list(lens),
    "cameras": [{"rotation": (base @ rotation(w)).tolist(), "position": list(c)} for base, w, c in cameras],
    "points": [list(at[k]) for k in "pq"],
    "optimality": float(result.optimality),
}, separators=(",", ":")))
