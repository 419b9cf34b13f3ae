"""Small joint problems (reflectances and emissions of one channel) with SciPy's answers, for
tests/joint/golden.rs; see README.md beside this file.

    python3 make.py        (rewrites systems.json)

The objective is written here once more, from its definition: half the sum of
  w r²                     r = log(L̂/L) or L̂/L − 1,  πL̂ = ρ_d (I + K E) + ρ_s (J + H E)
  λ_j (n_j (E_j − c_j))²   n_j = sqrt Σ w (k_ij ρ_0 / πL_i)², ρ_0 the reflectances `start`
  a (Σ c_m log ρ_m − t)²   for every anchor
with E ≥ 0, 0 ≤ ρ_s ≤ 1 and log ρ between log 0.0005 and `upper`.
"""
import json
import pathlib

import numpy as np
import scipy
from scipy.optimize import least_squares

rng = np.random.default_rng(3)
DARKEST = -7.6


def digits(a, n=5):
    return np.vectorize(lambda v: float(f"{v:.{n}g}"))(np.asarray(a, float))


def corner(rows, materials, lights, per):
    """Samples on three planes, materials in strips; lobes of power 12 of lights around."""
    material = np.arange(rows) % materials
    face = material % 3
    strip, strips = material // 3, -(-materials // 3)
    uv = 2 * rng.random((rows, 2))
    uv[:, 0] = (uv[:, 0] + 2 * strip) / strips
    points, normals = np.zeros((rows, 3)), np.zeros((rows, 3))
    for k in range(3):
        i = face == k
        points[np.ix_(i, [a for a in range(3) if a != k])] = uv[i]
        normals[i, k] = 1
    columns, places = [], []
    for _ in range(lights):
        direction = np.abs(rng.normal(size=3))
        light = 1 + 2.5 * direction / np.linalg.norm(direction)
        for _ in range(per):
            axis = 2 * rng.random(3) - light
            axis /= np.linalg.norm(axis)
            view = points - light
            distance = np.linalg.norm(view, axis=1)
            view /= distance[:, None]
            columns.append(np.maximum(view @ axis, 0) ** 12 * np.maximum(-(view * normals).sum(1), 0) / distance**2)
            places.append(light)
    # Light from the other two planes, strongest beside them: what tells the scale.
    nearness = np.exp(-2 * points) * (normals == 0)
    return material, points, normals, np.stack(columns, 1), np.array(places), 0.3 + nearness.sum(1)


def case(name, rows, materials, lights, per, reflectance, share, gloss=None, held=None):
    material, points, normals, diffuse, places, base = corner(rows, materials, lights, per)
    n = diffuse.shape[1]
    diffuse = digits(diffuse / diffuse.mean())
    emission = np.where(rng.random(n) < 0.4, rng.exponential(1, n), 0)
    emission *= (1 - share) / (diffuse @ emission).mean()
    base = digits(share * base / base.mean())
    c = dict(name=name, rows=rows, columns=n, materials=materials, material=material.tolist(), base=base.tolist(),
             diffuse=diffuse.T.ravel().tolist(), glossy=[None] * rows, specular=[], specular_base=[],
             weights=[1] * rows, ridge=[0] * n, centre=[0] * n, known=[None] * materials, upper=[0] * materials,
             relative_ridge=False, anchors=[], start=[0.5] * materials, pairs=[], robust=None)
    reflectance = np.array(reflectance)
    computed = reflectance[material] * (base + diffuse @ emission)
    if gloss is not None:
        of, rho, exponent = gloss
        shiny = np.flatnonzero(material == of)
        for g, row in enumerate(shiny):
            c["glossy"][row] = g
        eye = np.array([2.2, 2.8, 2.5])
        out = eye - points[shiny]
        out /= np.linalg.norm(out, axis=1)[:, None]
        up = normals[shiny]
        mirror = 2 * (out * up).sum(1)[:, None] * up - out
        towards = places[None] - points[shiny][:, None]
        towards /= np.linalg.norm(towards, axis=2)[:, :, None]
        cosine = np.maximum((towards * mirror[:, None]).sum(2), 0)
        specular = digits(diffuse[shiny] * (exponent + 2) / 2 * cosine**exponent)
        specular_base = digits(base[shiny] * (0.5 + rng.random(len(shiny))))
        computed[shiny] += rho * (specular_base + specular @ emission)
        c["specular"], c["specular_base"] = specular.T.ravel().tolist(), specular_base.tolist()
    c["radiance"] = digits(computed * (1 + 0.05 * rng.normal(size=rows)), 6).tolist()
    c.update(held or {})
    c["truth"] = dict(reflectance=reflectance.tolist(), specular=0 if gloss is None else gloss[1])
    c["answers"] = {objective: solve(c, objective) for objective in ("log", "relative")}
    cases.append(c)


def solve(c, objective):
    material = np.array(c["material"])
    materials, n, rows = c["materials"], c["columns"], c["rows"]
    # In single precision, as lobelia keeps couplings.
    diffuse = np.array(c["diffuse"], np.float32).astype(float).reshape(n, rows).T
    shiny = np.array([i for i, g in enumerate(c["glossy"]) if g is not None], int)
    specular = np.array(c["specular"], np.float32).astype(float).reshape(n, len(shiny)).T
    base, specular_base, radiance = np.array(c["base"]), np.array(c["specular_base"]), np.array(c["radiance"])
    root, ridge, centre = np.sqrt(c["weights"]), np.array(c["ridge"]), np.array(c["centre"])
    unit = np.array(c["start"])[material] / radiance
    squares = ((root * unit)[:, None] ** 2 * diffuse**2).sum(0)
    even = np.diag(np.sqrt(ridge * squares))
    # One unit for all pairs: the square of the sum of the norms of the columns in them.
    paired = np.sqrt(squares[sorted({j for p in c["pairs"] for j in p["columns"]})]).sum()
    for pair in c["pairs"]:
        (a, b), row = pair["columns"], np.zeros(n)
        row[a] = np.sqrt(pair["weight"]) * paired
        row[b] = -row[a]
        even = np.vstack([even, row])
    # A relative one is divided by the square of the light as a whole.
    norms, whole = np.sqrt(squares), sum(c["weights"])

    def part(e):
        return np.sqrt(whole / ((norms @ e) ** 2 + 1e-4 * whole)) if c["relative_ridge"] else 1.0

    anchors = [(np.array(a["combination"]), a["target"], np.sqrt(a["weight"])) for a in c["anchors"]]
    free = [m for m in range(materials) if c["known"][m] is None]
    tags = sorted(set(material[shiny].tolist()))
    onehot = np.eye(materials)[material]

    def split(x):
        u = np.array([0.0 if k is None else k for k in c["known"]])
        u[free] = x[n:n + len(free)]
        s = np.zeros(materials)
        s[tags] = x[n + len(free):]
        return x[:n], u, s

    def parts(x):
        e, u, s = split(x)
        g, h = base + diffuse @ e, specular_base + specular @ e
        value = np.exp(u)[material] * g
        value[shiny] += s[material[shiny]] * h
        return e, u, s, g, h, value

    def residual(x):
        e, u, s, g, h, value = parts(x)
        r = np.log(value / radiance) if objective == "log" else value / radiance - 1
        return np.concatenate([root * r, part(e) * (even @ (e - centre)), [w * (k @ u - t) for k, t, w in anchors]])

    def jacobian(x):
        e, u, s, g, h, value = parts(x)
        by = root / (value if objective == "log" else radiance)
        de = np.exp(u)[material][:, None] * diffuse
        de[shiny] += s[material[shiny]][:, None] * specular
        du = (onehot * (np.exp(u)[material] * g)[:, None])[:, free]
        ds = np.zeros((rows, materials))
        ds[shiny] = onehot[shiny] * h[:, None]
        top = by[:, None] * np.hstack([de, du, ds[:, tags]])
        drawn = part(e) * even
        if c["relative_ridge"]:
            drawn = drawn - np.outer(drawn @ e, norms) * (norms @ e) * part(e) ** 2 / whole
        more = [np.hstack([drawn, np.zeros((len(even), len(free) + len(tags)))])]
        more += [np.concatenate([np.zeros(n), w * k[free], np.zeros(len(tags))])[None] for k, t, w in anchors]
        return np.vstack([top] + more)

    def loss(z):
        # Cauchy's for the rows, least squares for the ridge and the anchors.
        out = np.array([z, np.ones_like(z), np.zeros_like(z)])
        if c["robust"] is not None:
            s2 = np.array(c["robust"])[material] ** 2
            t = 1 + z[:rows] / s2
            out[:, :rows] = s2 * np.log(t), 1 / t, -1 / (s2 * t**2)
        return out

    lower = np.concatenate([np.zeros(n), np.full(len(free), DARKEST), np.zeros(len(tags))])
    upper = np.concatenate([np.full(n, np.inf), np.array(c["upper"], float)[free], np.ones(len(tags))])
    answers = []
    for rho, e, s in ((0.5, 1.0, 0.1), (0.2, 0.1, 0.4)):
        x = np.concatenate([np.full(n, e), np.full(len(free), np.log(rho)), np.full(len(tags), s)])
        x = np.clip(x, lower, np.minimum(upper, 1e9) - 1e-3)
        options = dict(jac=jacobian, bounds=(lower, upper), x_scale="jac", ftol=1e-15, xtol=1e-15, gtol=1e-15,
                       max_nfev=20000, method="trf")
        if c["robust"] is not None:
            x = least_squares(residual, x, **options).x
            options["loss"] = loss
        done = least_squares(residual, x, **options)
        # trf stays inside the box: what it leaves a hair from a bound is put on it, and the rest
        # is solved again, while that lowers the objective.
        x, cost = done.x, done.cost
        low, high = x < lower + 1e-6, x > upper - 1e-6
        x = np.where(low, lower, np.where(high, upper, x))
        rest = np.flatnonzero(~(low | high))

        def put(y):
            z = x.copy()
            z[rest] = y
            return z

        more = dict(options, jac=lambda y: jacobian(put(y))[:, rest], bounds=(lower[rest], upper[rest]))
        again = least_squares(lambda y: residual(put(y)), x[rest], **more)
        if again.cost <= cost * (1 + 1e-12):
            x, cost = put(again.x), again.cost
        r, j = residual(x), jacobian(x)
        slopes = j.T @ (loss(r**2)[1] * r)
        cosine = slopes / np.maximum(np.linalg.norm(j, axis=0), 1e-300) / np.linalg.norm(r)
        kkt = max(np.abs(cosine[(x > lower) & (x < upper)]).max(), -cosine[x <= lower].min(initial=0),
                  cosine[x >= upper].max(initial=0))
        answers.append((cost, x, kkt))
    (a, x, kkt), (b, y, _) = sorted(answers, key=lambda answer: answer[0])
    e, u, s = split(x)
    away = np.abs(np.exp(x[n:n + len(free)]) - np.exp(y[n:n + len(free)])).max()
    print(f"{c['name']:28} {objective:9} {a:.9f} other start {b / a - 1:+.1e} rho {away:.1e} kkt {kkt:.1e} "
          f"lit {(e > 0).sum()} of {n} rho {np.exp(u).round(3)} s {s.round(3)}")
    assert b / a - 1 < 1e-9 and away < 1e-6 and kkt < 1e-6
    return dict(value=a, reflectance=np.exp(u).tolist(), specular=s.tolist(), emission=digits(e, 8).tolist())


cases = []
case("plain", 200, 4, 10, 3, [0.7, 0.3, 0.5, 0.2], 0.3)
case("weights and an upper bound", 120, 4, 8, 3, [0.75, 0.3, 0.9, 0.2], 0.25,
     held=dict(weights=[[1, 0.25, 0, 2, 1][i % 5] for i in range(120)], upper=[float(np.log(0.6)), 0, 0, 0]))
case("glossy", 200, 4, 10, 3, [0.4, 0.3, 0.6, 0.2], 0.3, gloss=(0, 0.2, 15.0))
case("known, ridge and anchor", 150, 4, 9, 3, [0.6, 0.3, 0.45, 0.2], 0.2,
     held=dict(known=[None, float(np.log(0.32)), None, None], start=[0.4, 0.3, 0.6, 0.5],
               ridge=[0.01 * (1 + j % 3) for j in range(27)], centre=[0.1 * (j % 2) for j in range(27)],
               anchors=[dict(combination=[1, 0, -1, 0], target=0.1, weight=40.0),
                        dict(combination=[0.25, 0.25, 0.25, 0.25], target=float(np.log(0.35)), weight=25.0)]))
case("Cauchy", 150, 4, 9, 3, [0.6, 0.3, 0.45, 0.2], 0.3, held=dict(robust=[0.1] * 4))
case("pairs and ridge, Cauchy by material", 150, 4, 9, 3, [0.6, 0.3, 0.45, 0.2], 0.3,
     held=dict(pairs=[dict(columns=[j, j + 3], weight=6e-5) for j in range(0, 18, 2)],
               ridge=[0.01 * (j % 3) if j >= 20 else 0 for j in range(27)],
               centre=[0.1 * (j % 2) for j in range(27)], robust=[0.1, 0.05, 0.2, 0.1]))
case("relative ridge and pairs, Cauchy", 150, 4, 9, 3, [0.6, 0.3, 0.45, 0.2], 0.3,
     held=dict(pairs=[dict(columns=[j, j + 3], weight=6e-4) for j in range(0, 18, 2)],
               ridge=[0.1 if j >= 20 else 0 for j in range(27)], robust=[0.1] * 4, relative_ridge=True))

out = pathlib.Path(__file__).with_name("systems.json")
made = f"make.py, Python numpy {np.__version__}, scipy {scipy.__version__}"
out.write_text(json.dumps(dict(made_by=made, cases=cases)) + "\n")
print(out.stat().st_size, "bytes")
