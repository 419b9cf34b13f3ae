"""The least error that cameras can have, by the strokes that are stored.

    python bound.py [NAME]

For each camera of NAME (corner-diffuse) the Cramer-Rao bound of a person who knows every corner of
the model exactly, and draws the stored strokes with Gaussian noise of 1 px in each coordinate:
unknown are only the poses, the focal length, and the places of the points. No unbiased way to
calibrate does better, and one that must find the corners as well does worse. Prints how often the
worst camera of a capture keeps within 0.15 degrees and 0.5 % of its distance; then the same with
the focal length known, too. numpy alone; shares no code with the program.
"""
import json
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent


def turn(w):
    angle = np.linalg.norm(w)
    if angle < 1e-15:
        return np.eye(3)
    x, y, z = w / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def project(pose, focal, point, centre):
    x, y, z = pose[0].T @ (point - pose[1])
    return np.array([x, -y]) / -z * focal + centre


def residuals(unknowns, model, truth, names, marks):
    cameras, focal = truth["cameras"], truth["cameras"][0]["focal_px"] + unknowns[0]
    poses = {}
    for k, own in enumerate(cameras):
        w, t = unknowns[1 + 6 * k: 4 + 6 * k], unknowns[4 + 6 * k: 7 + 6 * k]
        poses[own["file_path"]] = (np.array(own["rotation"]) @ turn(w), np.array(own["position"]) + t)
    places = {name: np.array(place) for name, place in truth["corners"].items()}
    for k, mark in enumerate(names):
        places[mark] = marks[mark] + unknowns[1 + 6 * len(cameras) + 3 * k:][:3]
    sizes = {own["file_path"]: np.array([own["w"], own["h"]], float) for own in model["photographs"]}
    along = {"x": "room.floor2", "y": "room.floor4", "z": "room.ceiling1"}
    rows = []
    for stroke in model["strokes"]:
        if "photograph" not in stroke:
            continue
        pose, centre = poses[stroke["photograph"]], 0.5 * sizes[stroke["photograph"]]
        if stroke["kind"] == "pick":
            rows += list(project(pose, focal, places[stroke["at"]], centre) - stroke["pixel"])
            continue
        ends = ["room.floor1", along[stroke["axis"]]] if stroke["kind"] == "line" else stroke["between"]
        # The distance of both ends of the piece from the edge, whose own ends may lie behind the
        # camera: the plane through it and the camera gives the line in the photograph.
        a, b = [pose[0].T @ (places[end] - pose[1]) for end in ends]
        n = np.cross(a, b)
        line = np.array([n[0], -n[1]]) / focal
        offset = -n[2] - line @ centre
        rows += [(line @ np.array(stroke[end]) + offset) / np.linalg.norm(line) for end in ("from", "to")]
    return np.array(rows)


def triangulated(model, truth, mark):
    """The point that its picks show: the middle of the rays."""
    poses = {own["file_path"]: own for own in truth["cameras"]}
    sizes = {own["file_path"]: (own["w"], own["h"]) for own in model["photographs"]}
    a, b = np.zeros((3, 3)), np.zeros(3)
    for stroke in model["strokes"]:
        if stroke.get("at") == mark and stroke["kind"] == "pick":
            own, (w, h) = poses[stroke["photograph"]], sizes[stroke["photograph"]]
            x, y = stroke["pixel"]
            ray = np.array(own["rotation"]) @ [(x - w / 2), -(y - h / 2), -own["focal_px"]]
            ray /= np.linalg.norm(ray)
            across = np.eye(3) - np.outer(ray, ray)
            a, b = a + across, b + across @ np.array(own["position"])
    return np.linalg.solve(a, b)


def bound(name):
    model = json.loads((HERE / f"{name}.json").read_text())
    truth = json.loads((HERE / f"{name}.truth.json").read_text())
    names = [point["id"] for point in model["points"]]
    marks = {mark: triangulated(model, truth, mark) for mark in names}
    count = 1 + 6 * len(truth["cameras"]) + 3 * len(names)
    at = lambda x: residuals(x, model, truth, names, marks)
    steps = 1e-5 * np.eye(count)
    jacobian = np.array([(at(step) - at(-step)) / 2e-5 for step in steps]).T
    rms = np.sqrt(np.mean(at(np.zeros(count)) ** 2))
    print(f"{name}: {len(jacobian)} numbers drawn, {rms:.2f} px from the truth in the mean")
    middle = np.mean(list(truth["corners"].values()), axis=0)
    distance = [np.linalg.norm(np.array(own["position"]) - middle) for own in truth["cameras"]]
    random = np.random.default_rng(0)
    for known, what in [(False, "focal length unknown"), (True, "focal length known")]:
        own = jacobian[:, 1:] if known else jacobian
        covariance = np.linalg.inv(own.T @ own)
        drawn = random.multivariate_normal(np.zeros(len(covariance)), covariance, 100_000)
        first = 0 if known else 1
        poses = drawn[:, first:first + 6 * len(distance)].reshape(len(drawn), -1, 2, 3)
        lengths = np.linalg.norm(poses, axis=3)
        turned = np.degrees(lengths[:, :, 0]).max(axis=1)
        moved = (lengths[:, :, 1] / distance).max(axis=1)
        print(f"  {what}: worst rotation {turned.mean():.3f} degrees in the mean, within 0.15 in "
              f"{100 * np.mean(turned < 0.15):.0f} %; worst position {100 * moved.mean():.2f} %, "
              f"within 0.5 % in {100 * np.mean(moved < 0.005):.0f} %; "
              f"both {100 * np.mean((turned < 0.15) & (moved < 0.005)):.0f} %")


if __name__ == "__main__":
    bound(sys.argv[1] if len(sys.argv) > 1 else "corner-diffuse")
