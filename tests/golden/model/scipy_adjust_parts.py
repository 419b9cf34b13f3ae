"""Residuals of strokes, written anew from their description in the guide (assets/guide/modelling.md)."""
import numpy as np


def rotation(w):
    """exp of the cross-product matrix, valid for complex steps."""
    t = np.sqrt(w @ w + 1e-300)
    k = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    return np.eye(3) + np.sin(t) / t * k + (1 - np.cos(t)) / (t * t) * (k @ k)


def image(camera, point):
    """y down, z forward."""
    p = (camera[0] @ rotation(camera[1])).T @ (point - camera[2])
    return np.array([p[0], -p[1], -p[2]])


def distort(lens, u):
    f, cx, cy, k1, k2 = lens
    r2 = u @ u
    return f * u * (1 + k1 * r2 + k2 * r2 * r2) + np.array([cx, cy])


def undistort(lens, pixel):
    f, cx, cy, k1, k2 = lens
    d = (np.asarray(pixel) - np.array([cx, cy])) / f
    u = d
    for _ in range(100):
        r2 = u @ u
        u = d / (1 + k1 * r2 + k2 * r2 * r2)
    return u


def project(lens, camera, point):
    p = image(camera, point)
    return distort(lens, p[:2] / p[2])


def cross2(a, b):
    return a[0] * b[1] - a[1] * b[0]


def norm(v):
    return np.sqrt(v @ v)


def box(v, low=0.0):
    x, y, yaw, w, d, h = v
    c, s = np.cos(yaw), np.sin(yaw)
    ring = [(-.5, -.5), (.5, -.5), (.5, .5), (-.5, .5)]
    flat = [np.array([x + a * w * c - b * d * s, y + a * w * s + b * d * c]) for a, b in ring]
    return [np.append(p, z) for z in (low, low + h) for p in flat]


def axis_line(lens, camera, axis, a, b):
    ua, ub = undistort(lens, a), undistort(lens, b)
    d = (camera[0] @ rotation(camera[1])).T @ np.eye(3)[axis]
    d = np.array([d[0], -d[1], -d[2]])
    m, h = (ua + ub) / 2, (ua - ub) / 2
    t = d[:2] - m * d[2]
    return np.sqrt(2) * lens[0] * cross2(h, t) / norm(t)


def edge(lens, camera, p, q, a, b):
    n = np.cross(image(camera, p), image(camera, q))
    return [lens[0] * (n @ np.append(undistort(lens, e), 1)) / norm(n[:2]) for e in (a, b)]


def look(position, target):
    z = np.asarray(position, float) - target
    z /= np.linalg.norm(z)
    x = np.cross([0, 0, 1], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], 1)


def complex_jacobian(fun, x):
    columns = []
    for i in range(len(x)):
        step = x.astype(complex)
        step[i] += 1e-30j
        columns.append(np.imag(fun(step)) / 1e-30)
    return np.stack(columns, 1)
