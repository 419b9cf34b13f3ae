"""Makes a capture with many photographs of many pixels out of a small one, to measure memory and time.

    python3 assets/study/enlarge.py CAPTURE OUT --factor 9 --photographs 100

needs NumPy and OpenEXR. Every photograph is enlarged by a whole factor, bilinearly, and stored as half floats; its
camera's intrinsics grow with it. Where more photographs are asked for than there are, they come again: as links to the
same file, with the camera turned by a little for each, so that no two see the same.
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


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("capture")
    parser.add_argument("out")
    parser.add_argument("--factor", type=int, default=9)
    parser.add_argument("--photographs", type=int)
    arguments = parser.parse_args()
    cameras = json.load(open(os.path.join(arguments.capture, "transforms.json")))
    frames = [frame for frame in cameras["frames"] if frame.get("hdr", True)]
    count = arguments.photographs or len(frames)
    os.makedirs(os.path.join(arguments.out, "images"), exist_ok=True)
    for name in os.listdir(arguments.capture):
        if name.endswith((".obj", ".mtl")) or name == "tags.json":
            shutil.copy(os.path.join(arguments.capture, name), arguments.out)
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
