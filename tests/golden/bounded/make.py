"""Small bounded least-squares systems with SciPy's answers, for tests/solve.rs; see README.md beside this file.

    python3 make.py        (rewrites systems.json)
"""
import json
import pathlib

import numpy as np
import scipy
from scipy.optimize import lsq_linear, nnls

rng = np.random.default_rng(20)
cases = []


def lobes(rows, lights, per, spread):
    """Cosine lobes of lights seen on three planes; `spread` small gives near-duplicate columns."""
    face = rng.integers(0, 3, rows)
    uv = rng.random((rows, 2)) * 2
    points, normals = np.zeros((rows, 3)), np.zeros((rows, 3))
    for k in range(3):
        i = face == k
        points[np.ix_(i, [a for a in range(3) if a != k])] = uv[i]
        normals[i, k] = 1
    columns = []
    for _ in range(lights):
        direction = np.abs(rng.normal(size=3))
        light = 1 + 3 * direction / np.linalg.norm(direction)
        centre = rng.random(3) * 2
        for _ in range(per):
            axis = centre + spread * rng.random(3) - light
            axis /= np.linalg.norm(axis)
            view = points - light
            view /= np.linalg.norm(view, axis=1)[:, None]
            columns.append(np.maximum(view @ axis, 0) ** 20 * np.maximum(-(view * normals).sum(1), 0) * 0.3)
    return np.stack(columns, 1)


def add(name, a, b, lower=None, upper=None, weights=None, unique=True):
    a, b = np.asarray(a, float), np.asarray(b, float)
    w = np.ones(len(b)) if weights is None else weights
    wa, wb = a * w[:, None], b * w
    if lower is None:
        x, _ = nnls(wa, wb, maxiter=100 * a.shape[1])
    else:
        x = lsq_linear(wa, wb, (lower, upper), method="bvls", tol=1e-14, max_iter=2000).x
    residual = wa @ x - wb
    case = dict(name=name, rows=a.shape[0], columns=a.shape[1], matrix=a.T.ravel().tolist(), target=b.tolist(),
                unique=unique, x=x.tolist(), objective=0.5 * float(residual @ residual))
    if weights is not None:
        case["weights"] = weights.tolist()
    if lower is not None:
        # JSON has no infinities: null stands for an absent bound.
        case["lower"] = [float(v) if np.isfinite(v) else None for v in lower]
        case["upper"] = [float(v) if np.isfinite(v) else None for v in upper]
    cases.append(case)
    print(f"{name:28} {a.shape}  cond {np.linalg.cond(wa):.1e}  objective {case['objective']:.6e}")


digits = lambda a: np.asarray(np.round(a, 6))

a = digits(rng.normal(size=(40, 15)))
add("well conditioned", a, digits(rng.normal(size=40)))
a = digits(rng.random((30, 8)))
add("negative target, all at zero", a, -np.ones(30))
a = lobes(60, 8, 3, 0.3)
truth = np.where(rng.random(24) < 0.3, rng.exponential(3, 24), 0)
b = a @ truth * (1 + 0.01 * rng.normal(size=60))
w = 1 / np.maximum(b, 1e-3)
add("lobes", a, b, weights=w)
a = lobes(60, 4, 6, 1e-4)
b = a @ np.full(24, 0.5) * (1 + 0.02 * rng.normal(size=60))
add("near-duplicate lobes", a, b, unique=False)
a = digits(rng.random((30, 5))) @ digits(rng.random((5, 14)))
add("rank 5 of 14", a, digits(rng.random(30)), unique=False)
a = digits(rng.random((25, 6)))
add("duplicate columns", np.hstack([a, a, 2 * a[:, :3]]), digits(rng.random(25)), unique=False)
a = digits(rng.random((20, 7)))
a[:, [0, 4]] = 0
add("zero columns", a, digits(rng.random(20)))
add("more columns than rows", digits(rng.normal(size=(10, 25))), digits(rng.normal(size=10)), unique=False)
a = digits(rng.normal(size=(35, 12)))
lower = np.where(np.arange(12) % 3 == 0, -np.inf, -0.1 * np.arange(12) / 12)
upper = np.where(np.arange(12) % 4 == 1, np.inf, 0.05 + 0.1 * rng.random(12))
add("two-sided bounds", a, digits(rng.normal(size=35) * 2), lower, upper)
a = digits(rng.random((35, 12)))
add("box away from zero", a, digits(rng.random(35) * 20), np.full(12, 1.0), np.full(12, 2.5), weights=digits(rng.random(35)))
a = digits(rng.normal(size=(30, 6)))
add("unbounded", a, digits(rng.normal(size=30)), np.full(6, -np.inf), np.full(6, np.inf))

out = pathlib.Path(__file__).with_name("systems.json")
made = f"make.py, Python numpy {np.__version__}, scipy {scipy.__version__}"
out.write_text(json.dumps(dict(made_by=made, cases=cases)) + "\n")
print(out.stat().st_size, "bytes")
