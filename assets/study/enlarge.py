"""Makes a capture with many photographs of many pixels out of a small one, to measure memory and time.

    python3 assets/study/enlarge.py CAPTURE OUT --factor 9 --photographs 100 --triangles 1000000

needs NumPy and OpenEXR. Every photograph is enlarged by a whole factor, bilinearly, and stored as half floats; its
camera's intrinsics grow with it. Where more photographs are asked for than there are, they come again: as links to the
same file, with the camera turned by a little for each, so that no two see the same. Triangles are quartered at the
middles of their edges while they stay fewer than are asked for, and some of them then divided in three.
"""
import argparse
import json
import math
import os
import pathlib
import shutil
import sys

import numpy as np

sys.path.append(str(pathlib.Path(__file__).parents[1] / "examples" / "generator"))
from exrio import read_exr, write_exr  # noqa: E402


def along(pixels, factor, axis):
    """Enlarged along one axis, the middle of every new pixel between those of the old ones."""
    count = pixels.shape[axis]
    place = np.clip((np.arange(count * factor) + 0.5) / factor - 0.5, 0, count - 1)
    low = np.minimum(place.astype(int), count - 2)
    part = (place - low).astype(np.float32)
    part = part.reshape([-1 if a == axis else 1 for a in range(3)])
    return np.take(pixels, low, axis) * (1 - part) + np.take(pixels, low + 1, axis) * part


def turned(matrix, radians):
    """A camera turned about its own y axis."""
    c, s = math.cos(radians), math.sin(radians)
    turn = np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])
    return (np.array(matrix) @ turn).tolist()


class Mesh:
    """An OBJ file whose triangles can be divided. Shared edges stay shared, so that no ray slips through."""

    def __init__(self, file):
        self.lines, self.values, self.faces = [], {"v": [], "vt": []}, 0
        for line in open(file):
            words = line.split()
            if words and words[0] in self.values:
                self.values[words[0]].append([float(word) for word in words[1:]])
            elif words and words[0] == "f":
                corners = [tuple(int(part) if part else 0 for part in word.split("/")[:2]) for word in words[1:]]
                corners = [corner if len(corner) == 2 else (*corner, 0) for corner in corners]
                # A polygon is a fan of triangles.
                own = [[corners[0], *pair] for pair in zip(corners[1:], corners[2:])]
                self.lines.append(own)
                self.faces += len(own)
            elif line.strip():
                self.lines.append(line.rstrip("\n"))
        self.middles = {}

    def middle(self, *corners):
        """A corner between others; positions are shared by all faces that have the same ones."""
        made = []
        for part, name in enumerate(("v", "vt")):
            indices = tuple(sorted(corner[part] for corner in corners))
            if 0 in indices:
                made.append(0)
                continue
            if (name, indices) not in self.middles:
                values = self.values[name]
                values.append([sum(v) / len(v) for v in zip(*(values[index - 1] for index in indices))])
                self.middles[name, indices] = len(values)
            made.append(self.middles[name, indices])
        return tuple(made)

    def quartered(self, triangle):
        a, b, c = triangle
        ab, bc, ca = self.middle(a, b), self.middle(b, c), self.middle(c, a)
        return [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]

    def in_three(self, triangle):
        a, b, c = triangle
        m = self.middle(a, b, c)
        return [[a, b, m], [b, c, m], [c, a, m]]

    def divided(self, by, most):
        """Divides triangles while there are fewer than so many."""
        for place, line in enumerate(self.lines):
            if isinstance(line, list):
                divided = []
                for triangle in line:
                    parts = by(triangle) if self.faces < most else [triangle]
                    self.faces += len(parts) - 1
                    divided += parts
                self.lines[place] = divided

    def grow(self, count):
        while 4 * self.faces <= count:
            self.divided(self.quartered, math.inf)
        while self.faces < count:
            self.divided(self.in_three, count)

    def write(self, file):
        def corner(indices):
            return f"{indices[0]}/{indices[1]}" if indices[1] else str(indices[0])

        with open(file, "w") as out:
            for name, values in self.values.items():
                for value in values:
                    print(name, *(f"{v:.9g}" for v in value), file=out)
            for line in self.lines:
                if isinstance(line, str):
                    print(line, file=out)
                else:
                    for triangle in line:
                        print("f", *map(corner, triangle), file=out)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("capture")
    parser.add_argument("out")
    parser.add_argument("--factor", type=int, default=9)
    parser.add_argument("--photographs", type=int)
    parser.add_argument("--triangles", type=int)
    arguments = parser.parse_args()
    cameras = json.load(open(os.path.join(arguments.capture, "transforms.json")))
    frames = [frame for frame in cameras["frames"] if frame.get("hdr", True)]
    count = arguments.photographs or len(frames)
    os.makedirs(os.path.join(arguments.out, "images"), exist_ok=True)
    for name in os.listdir(arguments.capture):
        if name.endswith((".obj", ".mtl")) or name == "tags.json":
            shutil.copy(os.path.join(arguments.capture, name), arguments.out)
            if arguments.triangles and name.endswith(".obj"):
                mesh = Mesh(os.path.join(arguments.capture, name))
                mesh.grow(arguments.triangles)
                mesh.write(os.path.join(arguments.out, name))
    for own in [cameras, *frames]:
        for key in ("fl_x", "fl_y", "cx", "cy", "w", "h"):
            if key in own:
                own[key] *= arguments.factor
    made = []
    for index in range(count):
        frame = dict(frames[index % len(frames)])
        path = f"images/{index:03}.exr"
        file = os.path.join(arguments.out, path)
        again = index // len(frames)
        if again == 0:
            pixels = read_exr(os.path.join(arguments.capture, frame["file_path"]))
            write_exr(file, along(along(pixels, arguments.factor, 0), arguments.factor, 1))
        else:
            if os.path.lexists(file):
                os.remove(file)
            os.symlink(f"{index % len(frames):03}.exr", file)
            frame["transform_matrix"] = turned(frame["transform_matrix"], 1e-5 * again)
        made.append({**frame, "file_path": path})
    json.dump({**cameras, "frames": made}, open(os.path.join(arguments.out, "transforms.json"), "w"), indent=1)


main()
