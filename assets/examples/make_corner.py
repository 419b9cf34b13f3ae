#!/usr/bin/env python3
"""Makes the example capture corner/ out of the generator's full-size corner-diffuse.

make_corner.py SOURCE [OUT]

SOURCE is a capture of 640 x 480 pixels as generator/make.py writes it; OUT is corner/ beside this
script by default. The images are halved by averaging 2 x 2 pixels of linear radiance, which is
what a sensor of half the resolution behind the same box filter would have measured, so only the
intrinsics change. Needs numpy and OpenEXR (pip install numpy OpenEXR).
"""
import json
import pathlib
import shutil
import sys

import numpy as np
import OpenEXR

FACTOR = 2


def read_rgb(path):
    with OpenEXR.File(str(path)) as file:
        return np.asarray(file.channels()["RGB"].pixels, np.float64)


def write_rgb(path, image):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    pixels = np.ascontiguousarray(image.astype(np.float16))
    with OpenEXR.File(header, {"RGB": pixels}) as file:
        file.write(str(path))


def halved(image):
    height, width, channels = image.shape
    blocks = image.reshape(height // FACTOR, FACTOR, width // FACTOR, FACTOR, channels)
    return blocks.mean(axis=(1, 3))


def cameras(transforms):
    # Pixel coordinates count from the image's corner, so all of them scale alike.
    for key in ("fl_x", "fl_y", "cx", "cy"):
        transforms[key] /= FACTOR
    for key in ("w", "h"):
        assert transforms[key] % FACTOR == 0
        transforms[key] //= FACTOR
    return transforms


def truth(answers):
    # The held-out views are not part of the example, and these describe nothing else.
    for key in ("added_light", "added_object"):
        answers.pop(key, None)
    answers["name"] = "corner"
    renderer = answers["renderer"]
    renderer["downsized"] = (
        f"by averaging {FACTOR} x {FACTOR} pixels after rendering; samples per pixel, filters in"
        " pixels and the noise below are those of the full size"
    )
    return answers


def write_json(path, value):
    path.write_text(json.dumps(value, indent=1) + "\n")


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    source = pathlib.Path(sys.argv[1])
    here = pathlib.Path(__file__).resolve().parent
    out = pathlib.Path(sys.argv[2]) if len(sys.argv) == 3 else here / "corner"
    (out / "images").mkdir(parents=True, exist_ok=True)
    transforms = json.loads((source / "transforms.json").read_text())
    for frame in transforms["frames"]:
        write_rgb(out / frame["file_path"], halved(read_rgb(source / frame["file_path"])))
    write_json(out / "transforms.json", cameras(transforms))
    write_json(out / "truth.json", truth(json.loads((source / "truth.json").read_text())))
    for name in ("scene.obj", "scene.mtl", "tags.json"):
        shutil.copyfile(source / name, out / name)


if __name__ == "__main__":
    main()
