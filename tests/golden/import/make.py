#!/usr/bin/env python3
"""Small sources of every camera format, and where their programs put points.

Needs numpy, opencv-python-headless, pycolmap and trimesh. Writes tests/data/import/ and projections.json
here. COLMAP's pixels are pycolmap's own; the others are the formulas that each program documents,
written out below, by OpenCV where its model is the same. All pixels count from the image's corner.

    python3 tests/golden/import/make.py
"""
import json
import shutil
import struct
from pathlib import Path

import cv2
import numpy as np
import pycolmap

HERE = Path(__file__).parent
DATA = HERE.parent.parent / "data" / "import"
W, H = 160, 120
rng = np.random.default_rng(20261121)
points = rng.uniform(-1, 1, (12, 3))


def look_at(eye, target=(0, 0, 0)):
    """World to camera, computer vision axes."""
    z = np.asarray(target, float) - eye
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.1, 0, 1.0])
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z])
    return R, -R @ eye


eyes = np.array([[4.0, 0.3, 1.5], [-1.0, 4.2, 1.0], [-3.5, -2.0, 2.0]])
poses = [look_at(eye) for eye in eyes]
cases = []


def case(name, source, images):
    cases.append({"name": name, "source": source, "images": images})


def image(name, size, pixels):
    return {"name": name, "size": list(size), "pixels": np.asarray(pixels).tolist()}


def brown(p, k, t=(0, 0)):
    x, y = p[:, 0], p[:, 1]
    r2 = x * x + y * y
    radial = 1 + sum(c * r2 ** (i + 1) for i, c in enumerate(k))
    return np.stack([x * radial + t[1] * (r2 + 2 * x * x) + 2 * t[0] * x * y,
                     y * radial + t[0] * (r2 + 2 * y * y) + 2 * t[1] * x * y], 1)


def vision(R, t):
    X = points @ R.T + t
    return X[:, :2] / X[:, 2:]


# COLMAP: every perspective model, written and projected by COLMAP itself.
reconstruction = pycolmap.Reconstruction()
models = {"SIMPLE_PINHOLE": [210, 81.5, 58.2], "PINHOLE": [210, 214, 78.3, 61.1],
          "SIMPLE_RADIAL": [205, 80.7, 60.9, -0.15], "RADIAL": [205, 79.2, 60.4, -0.2, 0.08],
          "OPENCV": [200, 204, 78.9, 61.7, -0.2, 0.07, 0.004, -0.006],
          "FULL_OPENCV": [200, 203, 81.2, 59.1, 0.1, 0.05, 0.003, -0.005, 0.02, 0.2, -0.03, 0.01]}
track = {i: pycolmap.Track() for i in range(len(points))}
observed, shots = {}, []
for number, (model, params) in enumerate(models.items(), 1):
    camera = pycolmap.Camera(model=model, width=W, height=H, params=params, camera_id=number)
    reconstruction.add_camera_with_trivial_rig(camera)
    R, t = poses[number % 3]
    pose = pycolmap.Rigid3d(pycolmap.Rotation3d(R), t)
    pixels = np.array([camera.img_from_cam(pose * X) for X in points])
    noisy = pixels + rng.normal(0, 0.4, pixels.shape)
    name = f"sub folder/{number} ä.png"
    own = pycolmap.Image(name=name, camera_id=number, image_id=number)
    own.points2D = pycolmap.Point2DList([pycolmap.Point2D(xy) for xy in noisy])
    reconstruction.add_image_with_trivial_frame(own, pose)
    for i in range(len(points)):
        track[i].add_element(number, i)
    observed[number] = np.linalg.norm(noisy - pixels, axis=1)
    shots.append(image(name, (W, H), pixels))
for i, X in enumerate(points):
    reconstruction.add_point3D(X, track[i], np.array([1, 2, 3], np.uint8))
for identity in reconstruction.points3D:
    own = reconstruction.points3D[identity]
    index = own.track.elements[0].point2D_idx
    own.error = float(np.mean([errors[index] for errors in observed.values()]))
for kind in ("text", "binary"):
    folder = DATA / f"colmap_{kind}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (reconstruction.write_text if kind == "text" else reconstruction.write_binary)(str(folder))
    for extra in ("rigs", "frames"):
        for suffix in ("txt", "bin"):
            (folder / f"{extra}.{suffix}").unlink(missing_ok=True)
    case(f"COLMAP {kind}", f"colmap_{kind}", shots)

# AliceVision, versions before and since the focal length was in millimetres, and since the kind of
# distortion stands apart. Whole numbers are pixel centres there: half a pixel to the corner.
def alicevision(file, version, intrinsic, focal, k, t):
    views, out, shots = [], [], []
    for i, (R, tr) in enumerate(poses):
        views.append({"viewId": str(100 + i), "poseId": str(100 + i), "intrinsicId": "7",
                      "path": f"C:\\photos\\a {i}.jpg", "width": str(W), "height": str(H)})
        out.append({"poseId": str(100 + i), "pose": {"transform": {
            "rotation": [repr(float(v)) for v in R.flatten(order="F")],
            "center": [repr(float(v)) for v in -R.T @ tr]}, "locked": "0"}})
        uv = brown(vision(R, tr), k, t) * focal + np.array([W, H]) / 2 + [-3.25, 2.5]
        shots.append(image(f"a {i}.jpg", (W, H), uv + 0.5))
    views.append({**views[0], "viewId": "999", "poseId": "999", "path": "/x/never seen.jpg"})
    root = {"version": version, "views": views, "poses": out,
            "intrinsics": [{"intrinsicId": "7", "width": str(W), "height": str(H), **intrinsic}]}
    (DATA / file).write_text(json.dumps(root, indent=1).replace("/", "\\/"))
    case(f"AliceVision {'.'.join(version)}", file, shots)


offset = ["-3.25", "2.5"]
alicevision("meshroom_1.2.6.sfm", ["1", "2", "6"],
            {"type": "brown", "sensorWidth": "36", "focalLength": "45", "pixelRatio": "1.02",
             "principalPoint": offset, "distortionParams": ["-0.2", "0.1", "0.02", "0.005", "-0.007"]},
            np.array([200, 204.0]), [-0.2, 0.1, 0.02], [0.005, -0.007])
alicevision("meshroom_1.2.8.json", ["1", "2", "8"],
            {"type": "pinhole", "distortionType": "radialk3", "undistortionType": "none",
             "sensorWidth": "36", "focalLength": "45", "pixelRatio": "1",
             "principalPoint": offset, "distortionParams": ["-0.2", "0.1", "0.02"]},
            np.array([200, 200.0]), [-0.2, 0.1, 0.02], [0, 0])
alicevision("meshroom_1.0.sfm", ["1", "0", "0"],
            {"type": "radial3", "pxFocalLength": "200", "principalPoint": [str(W / 2 - 3.25), str(H / 2 + 2.5)],
             "distortionParams": ["-0.2", "0.1", "0.02"]},
            np.array([200, 200.0]), [-0.2, 0.1, 0.02], [0, 0])

# RealityCapture: angles in degrees, lengths of the longer side; axes as nerfstudio has them.
lines, shots = ["#cameras 3", "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2"], []
for i, (R, tr) in enumerate(poses):
    C = -R.T @ tr
    G = R.T @ np.diag([1.0, -1, -1])  # OpenGL axes in the world
    pitch = np.arcsin(G[2, 1])
    yaw = np.arctan2(-G[0, 1], G[1, 1])
    roll = np.arctan2(-G[2, 0], G[2, 2])
    k, t = [-0.2, 0.1, 0.02, -0.01], [0.004, -0.006]
    values = [*C, *np.degrees([-yaw, pitch, roll]), 45.0, 0.012, -0.02, *k, *t]
    lines.append(f"rc {i}.png," + ",".join(repr(float(v)) for v in values))
    c, s = np.cos, np.sin
    Rz = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    Rx = np.array([[1, 0, 0], [0, c(pitch), -s(pitch)], [0, s(pitch), c(pitch)]])
    Ry = np.array([[c(roll), 0, s(roll)], [0, 1, 0], [-s(roll), 0, c(roll)]])
    X = (points - C) @ (Rz @ Rx @ Ry)
    p = np.stack([X[:, 0] / -X[:, 2], -X[:, 1] / -X[:, 2]], 1)
    uv = (brown(p, k, t) * 45 / 36 + [0.012, -0.02]) * max(W, H) + np.array([W, H]) / 2
    shots.append(image(f"rc {i}.png", (W, H), uv))
(DATA / "realitycapture.csv").write_text("\r\n".join(lines) + "\r\n")
case("RealityCapture", "realitycapture.csv", shots)

# Metashape: x' = x (1 + K1 r2 + ...) + P1 (r2 + 2 x2) + 2 P2 x y, in the chunk's coordinates.
A = cv2.Rodrigues(np.array([0.2, -0.4, 0.7]))[0]
S, T = 2.5, np.array([0.3, -0.1, 0.8])
rows, shots = [], []
for i, (R, tr) in enumerate(poses):
    C = -R.T @ tr
    M = np.eye(4)
    M[:3, :3] = A.T @ R.T
    M[:3, 3] = A.T @ (C - T) / S
    text = " ".join(repr(float(v)) for v in M.flatten())
    rows.append(f'<camera id="{i}" sensor_id="0" component_id="0" label="ms {i}"><transform>{text}</transform></camera>')
    f, cx, cy, b1 = 200.0, 2.75, -1.5, 3.0
    k, (P1, P2) = [-0.2, 0.1, 0.02, -0.01], (0.006, -0.004)
    p = vision(R, tr)
    x, y = p[:, 0], p[:, 1]
    r2 = x * x + y * y
    radial = 1 + k[0] * r2 + k[1] * r2**2 + k[2] * r2**3 + k[3] * r2**4
    xd = x * radial + P1 * (r2 + 2 * x * x) + 2 * P2 * x * y
    yd = y * radial + P2 * (r2 + 2 * y * y) + 2 * P1 * x * y
    uv = np.stack([W * 0.5 + cx + xd * f + xd * b1, H * 0.5 + cy + yd * f], 1)
    shots.append(image(f"ms {i}.png", (W, H), uv))
numbers = lambda values: " ".join(repr(float(v)) for v in np.asarray(values).flatten())
(DATA / "metashape.xml").write_text(f"""<?xml version="1.0" encoding="UTF-8"?>
<document version="2.0.0"><chunk label="Chunk 1" enabled="true">
<sensors next_id="1"><sensor id="0" label="cam" type="frame"><resolution width="{W}" height="{H}"/>
<calibration type="frame" class="initial"><resolution width="{W}" height="{H}"/><f>999</f></calibration>
<calibration type="frame" class="adjusted"><resolution width="{W}" height="{H}"/>
<f>200</f><cx>2.75</cx><cy>-1.5</cy><b1>3</b1><k1>-0.2</k1><k2>0.1</k2><k3>0.02</k3><k4>-0.01</k4>
<p1>0.006</p1><p2>-0.004</p2></calibration></sensor></sensors>
<components next_id="1"><component id="0" label="Component 1"><transform>
<rotation locked="false">{numbers(A)}</rotation><translation locked="false">{numbers(T)}</translation>
<scale locked="false">{S}</scale></transform></component></components>
<cameras next_id="4">{chr(10).join(rows)}
<camera id="3" sensor_id="0" label="ms lost"/></cameras>
</chunk></document>
""")
case("Metashape", "metashape.xml", shots)

# Bundler: P = RX + t, p = -P / P.z, p' = f r(p) p, from the image's middle with y up.
flip = np.diag([1.0, -1, -1])
lines, shots = ["# Bundle file v0.3", "4 1"], []
for i, (R, tr) in enumerate(poses):
    B, t = flip @ R, flip @ tr
    lines += ["198.5 -0.2 0.07"] + [numbers(row) for row in B] + [numbers(t)]
    P = points @ B.T + t
    p = -P[:, :2] / P[:, 2:]
    r2 = (p**2).sum(1)
    q = 198.5 * p * (1 - 0.2 * r2 + 0.07 * r2**2)[:, None]
    shots.append(image(f"bu {i}.png", (W, H), np.stack([W / 2 + q[:, 0], H / 2 - q[:, 1]], 1)))
lines += ["0 0 0"] * 5 + ["0 0 0", "255 255 255", "1 0 0 1.0 2.0"]
(DATA / "bundle.out").write_text("\n".join(lines) + "\n")
(DATA / "bundle.list.txt").write_text("".join(f"./photos/bu {i}.png 0 198.5\r\n" for i in range(4)))
case("Bundler", "bundle.out", shots)

# OpenSfM, by OpenCV in lengths of the longer side.
shots, out = [], {}
for i, (R, tr) in enumerate(poses):
    r = cv2.Rodrigues(R)[0].flatten()
    out[f"os {i}.png"] = {"rotation": r.tolist(), "translation": tr.tolist(), "camera": "c"}
    K = np.array([[1.24, 0, 0.011], [0, 1.27, -0.017], [0, 0, 1]])
    n = cv2.projectPoints(points, r, tr, K, np.array([-0.2, 0.1, 0.003, -0.004, 0.02]))[0][:, 0]
    shots.append(image(f"os {i}.png", (W, H), n * max(W, H) + np.array([W, H]) / 2))
(DATA / "opensfm.json").write_text(json.dumps([{"cameras": {"c": {
    "projection_type": "brown", "width": W, "height": H, "focal_x": 1.24, "focal_y": 1.27, "c_x": 0.011,
    "c_y": -0.017, "k1": -0.2, "k2": 0.1, "k3": 0.02, "p1": 0.003, "p2": -0.004}},
    "shots": out, "points": {}}]))
case("OpenSfM", "opensfm.json", shots)

# glTF: the specification's projection matrix, below a parent that is moved and scaled.
nodes, shots = [{"name": "parent", "translation": [0.5, -1, 2], "scale": [2, 2, 2], "children": [1, 2, 3]}], []
P = np.eye(4)
P[:3, :3] *= 2
P[:3, 3] = [0.5, -1, 2]
yfov, aspect = 0.6, 1.3
f = 1 / np.tan(yfov / 2)
projection = np.array([[f / aspect, 0, 0, 0], [0, f, 0, 0], [0, 0, -1, -0.02], [0, 0, -1, 0]])
for i, (R, tr) in enumerate(poses):
    world = np.eye(4)
    world[:3, :3] = R.T @ flip
    world[:3, 3] = -R.T @ tr
    local = np.linalg.inv(P) @ world
    local = local.astype(np.float32).astype(float)
    nodes.append({"name": f"gl {i}", "camera": 0, "matrix": local.T.flatten().tolist()})
    full = P @ local
    full[:3, :3] /= 2 * 0.5
    for column in range(3):
        full[:3, column] /= np.linalg.norm(full[:3, column])
    clip = np.c_[points, np.ones(len(points))] @ (projection @ np.linalg.inv(full)).T
    ndc = clip[:, :2] / clip[:, 3:]
    shots.append(image(f"gl {i}.png", (W, H), np.stack([(ndc[:, 0] + 1) / 2 * W, (1 - ndc[:, 1]) / 2 * H], 1)))
(DATA / "cameras.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "scene": 0,
    "scenes": [{"nodes": [0]}], "nodes": nodes, "cameras": [{"type": "perspective", "perspective": {
        "yfov": yfov, "aspectRatio": aspect, "znear": 0.01}}]}))
case("glTF", "cameras.gltf", shots)

# transforms.json with OpenCV's rational model, by OpenCV, and nerfstudio's applied transform.
frames, shots = [], []
K = np.array([[200, 0, 81.5], [0, 203, 58.5], [0, 0, 1.0]])
coefficients = np.array([0.1, 0.05, 0.003, -0.005, 0.02, 0.2, -0.03, 0.01])
for i, (R, tr) in enumerate(poses):
    world = np.eye(4)
    world[:3, :3] = R.T @ flip
    world[:3, 3] = -R.T @ tr
    frames.append({"file_path": f"./train/nf {i}", "transform_matrix": world.tolist()})
    uv = cv2.projectPoints(points, cv2.Rodrigues(R)[0], tr, K, coefficients)[0][:, 0]
    shots.append(image(f"nf {i}.png", (W, H), uv))
(DATA / "rational.json").write_text(json.dumps({"camera_model": "FULL_OPENCV", "w": W, "h": H,
    "fl_x": 200, "fl_y": 203, "cx": 81.5, "cy": 58.5, "aabb_scale": 16,
    **dict(zip(["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"], coefficients.tolist())), "frames": frames}))
case("transforms.json", "rational.json", shots)

(HERE / "projections.json").write_text(json.dumps({"points": points.tolist(), "cases": cases}))

# A house of two boxes in every mesh format, by trimesh.
import trimesh
a = trimesh.creation.box((2, 3, 1))
b = trimesh.creation.box((0.5, 0.5, 0.5))
b.apply_translation([3, 0, 0])
whole = trimesh.util.concatenate([a, b])
for name, options in {"ascii.ply": {"encoding": "ascii"}, "little.ply": {}, "text.stl": {"file_type": "stl_ascii"},
                      "binary.stl": {}, "scene.glb": {}}.items():
    whole.export(DATA / ("boxes_" + name), **options)
big = (DATA / "boxes_little.ply").read_bytes()
head, body = big.split(b"end_header\n", 1)
vertices, faces = len(whole.vertices), len(whole.faces)
assert len(body) == vertices * 12 + faces * 13, "layout of trimesh's PLY"
swapped = b"".join(struct.pack(">f", *struct.unpack_from("<f", body, 4 * i)) for i in range(3 * vertices))
for i in range(faces):
    count, *own = struct.unpack_from("<B3i", body, vertices * 12 + 13 * i)
    swapped += struct.pack(">B3i", count, *own)
(DATA / "boxes_big.ply").write_bytes(head.replace(b"little", b"big") + b"end_header\n" + swapped)
scene = trimesh.Scene()
for mesh, name in ((a, "house"), (b, "shed")):
    mesh.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.PBRMaterial(name=name))
    scene.add_geometry(mesh, node_name=name, geom_name=name)
scene.export(DATA / "boxes_materials.glb")
