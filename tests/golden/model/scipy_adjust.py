"""Makes adjust.json: models with strokes, and what SciPy's least_squares makes of them.

    python scipy_adjust.py > adjust.json

Made with SciPy and numpy. The residuals are written anew here from their description in the guide
(assets/guide/modelling.md), with derivatives by complex steps, and minimised by
scipy.optimize.least_squares (trf, Cauchy's loss of scale 3 for what was drawn, none for what was
typed; ftol, xtol, gtol 1e-15) from near the truth. Standard errors follow from the Jacobian there,
as the guide says.
"""
import json

import numpy as np
from scipy.optimize import least_squares

from scipy_adjust_parts import axis_line, box, complex_jacobian, edge, look, norm, project, rotation

random = np.random.default_rng(5)
LOSS = 3.0


def problem(name, lens, fit, outliers):
    size = (1200, 900)
    boxes = {"a": np.array([0.1, 0.2, 0.3, 0.8, 0.5, 0.6]), "b": np.array([1.2, 0.9, -0.4, 0.5, 0.7, 0.4]),
             "c": np.array([0.15, 0.25, 0.7, 0.3, 0.25, 0.2])}
    points = {"p": np.array([0.8, -0.5, 0.3]), "q": np.array([-0.6, 0.9, 0.1])}
    places = [(3.2, -2.1, 1.7), (-1.9, -3.0, 2.1), (3.6, 2.8, 1.4)]
    cameras = [(look(p, [0.4, 0.4, 0.2]), np.zeros(3), np.array(p)) for p in places]

    def corners(values):
        at = {}
        for thing in "abc":
            low = values["a"][5] if thing == "c" else 0.0
            names = [f"bottom{k}" for k in range(1, 5)] + [f"top{k}" for k in range(1, 5)]
            at |= {f"{thing}.{n}": p for n, p in zip(names, box(values[thing], low))}
        return at | {"p": values["p"], "q": values["q"]}

    truth = corners(boxes | points)
    strokes = []
    noise = lambda: random.normal(size=2)
    for index, camera in enumerate(cameras):
        photograph = f"{index}.exr"
        for at, place in truth.items():
            if random.random() < 0.8:
                strokes.append({"kind": "pick", "photograph": photograph, "at": at,
                                "pixel": list(project(lens, camera, place) + noise())})
        for a, b in [("a.bottom1", "a.bottom2"), ("b.top2", "b.top3"), ("c.bottom4", "c.top4")]:
            ends = [project(lens, camera, (1 - s) * truth[a] + s * truth[b]) + noise() for s in (.2, .9)]
            strokes.append({"kind": "edge", "photograph": photograph, "between": [a, b],
                            "from": list(ends[0]), "to": list(ends[1])})
        for axis, start in [(0, [-1, 1.5, 0]), (0, [-1, -1, 0]), (1, [-1, -1, 0]), (1, [1.5, -1, 0]), (2, [1.5, 1.5, 0])]:
            start = np.array(start, float)
            ends = [project(lens, camera, p) + noise() for p in (start, start + np.eye(3)[axis])]
            strokes.append({"kind": "line", "photograph": photograph, "axis": "xyz"[axis],
                            "from": list(ends[0]), "to": list(ends[1])})
    picks = [s for s in strokes if s["kind"] == "pick"]
    for k in range(outliers):
        picks[7 * k + 3]["pixel"][0] += 25.0
    strokes += [
        {"kind": "position", "at": "a.bottom1", "position": list(truth["a.bottom1"]), "sd_m": 0.002},
        {"kind": "position", "at": "b.bottom3", "position": list(truth["b.bottom3"] + [0.004, -0.002, 0]), "sd_m": 0.003},
        {"kind": "length", "between": ["a.bottom1", "a.bottom2"], "length_m": 0.803, "sd_m": 0.002},
    ]
    free = [i for i, key in enumerate(["focal_px", "principal_px", "principal_px", "k1", "k2"]) if key in fit]
    lens0 = np.array(lens, float)
    lens_scale = np.array([1000.0, 1000.0, 1000.0, 1.0, 1.0])

    def unpack(x):
        own = lens0.astype(x.dtype)
        own[free] = x[:len(free)] * lens_scale[free]
        at = len(free)
        views = []
        for base, _, _ in cameras:
            views.append((base, x[at:at + 3], x[at + 3:at + 6]))
            at += 6
        values = {}
        for name_, start in (boxes | points).items():
            values[name_] = x[at:at + len(start)]
            at += len(start)
        return own, views, values

    def residuals(x):
        own, views, values = unpack(x)
        at = corners(values)
        drawn, typed = [], []
        for s in strokes:
            if "photograph" in s:
                camera = views[int(s["photograph"].split(".")[0])]
            if s["kind"] == "pick":
                drawn += list(project(own, camera, at[s["at"]]) - np.array(s["pixel"]))
            elif s["kind"] == "edge":
                a, b = s["between"]
                drawn += edge(own, camera, at[a], at[b], s["from"], s["to"])
            elif s["kind"] == "line":
                drawn.append(axis_line(own, camera, "xyz".index(s["axis"]), s["from"], s["to"]))
            elif s["kind"] == "position":
                typed += list((at[s["at"]] - np.array(s["position"])) / s["sd_m"])
            else:
                a, b = s["between"]
                typed.append((norm(at[a] - at[b]) - s["length_m"]) / s["sd_m"])
        return np.array(drawn), np.array(typed)

    count = len(residuals(np.concatenate([lens0[free] / lens_scale[free]] + [
        np.concatenate([c[1], c[2]]) for c in cameras] + list((boxes | points).values())))[0])

    def fun(x):
        return np.concatenate(residuals(x))

    def loss(z):
        """Cauchy's of what was drawn, none of what was typed: value and derivatives by z."""
        rho = np.stack([np.log1p(z), 1 / (1 + z), -1 / (1 + z) ** 2])
        rho[:, count:] = np.stack([z, np.ones_like(z), np.zeros_like(z)])[:, count:]
        return rho

    x0 = np.concatenate([lens0[free] / lens_scale[free]] + [np.concatenate([c[1], c[2]]) for c in cameras]
                        + list((boxes | points).values()))
    result = least_squares(fun, x0 + 1e-3, jac=lambda x: complex_jacobian(fun, x), method="trf", loss=loss,
                           f_scale=LOSS, ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=3000, x_scale="jac")
    drawn, typed = residuals(result.x)
    J = complex_jacobian(fun, result.x)
    weights = np.concatenate([1 / (1 + (drawn / LOSS) ** 2), np.ones(len(typed))])
    r = np.concatenate([drawn, typed])
    variance = (4 + np.sum(weights * r * r)) / (4 + len(r) - len(result.x))
    errors = np.sqrt(variance * np.diag(np.linalg.inv(J.T @ (weights[:, None] * J))))
    own, views, values = unpack(result.x)
    _, _, sd = unpack(errors)
    things = [{"id": "a", "kind": "box"}, {"id": "b", "kind": "box"}, {"id": "c", "kind": "box", "on": "a.top"}]
    return {
        "name": name,
        "model": {
            "format": "lobelia-model", "version": 1,
            "lenses": [{"id": "lens", "focal_px": 1010.0 if "focal_px" in fit else lens[0],
                        "principal_px": [lens[1], lens[2]],
                        "k1": 0.0 if "k1" in fit else lens[3], "k2": 0.0 if "k2" in fit else lens[4], "fit": fit}],
            "photographs": [{"file_path": f"{k}.exr", "w": size[0], "h": size[1]} for k in range(3)],
            "things": things, "points": [{"id": "p"}, {"id": "q"}], "strokes": strokes,
        },
        "cost": float(result.cost),
        "lens": list(own),
        "cameras": [{"rotation": (base @ rotation(w)).tolist(), "position": list(c)} for base, w, c in views],
        "things": [list(values[k]) for k in "abc"],
        "points": [list(values[k]) for k in "pq"],
        "things_sd": [list(sd[k]) for k in "abc"],
        "stroke_px": float(np.sqrt(variance)),
        "optimality": float(result.optimality),
    }


cases = [
    problem("focal length", (1000.0, 600.0, 450.0, 0.0, 0.0), ["focal_px"], 0),
    problem("whole lens", (1000.0, 607.0, 441.0, -0.12, 0.03), ["focal_px", "principal_px", "k1", "k2"], 0),
    problem("outliers", (1000.0, 600.0, 450.0, -0.05, 0.0), ["focal_px"], 4),
]
print(json.dumps({"made_by": "SciPy least_squares, tests/golden/model/scipy_adjust.py", "cases": cases},
                 separators=(",", ":")))
