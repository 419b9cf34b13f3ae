"""A small exposure series, and what OpenCV 5.0 makes of it.

    python3 make.py            (needs numpy, opencv-python and OpenEXR)

writes beside itself:

exposures.png   5 exposures of 48 x 32 pixels, one below the other, RGB, 8 bits
response.csv    createCalibrateDebevec(samples 70, lambda 10): value, red, green, blue
merged.exr      createMergeDebevec with that response, 32-bit floats

The scene is smooth and the exposures are chosen so that no code reaches 0 or 250: what is
clipped, OpenCV counts a little, and lobelia not at all. Exposure times are 1, 2, 4, 8 and 16 s.
"""
import os

import cv2
import numpy as np
import OpenEXR

HERE = os.path.dirname(os.path.abspath(__file__))
WIDTH, HEIGHT = 48, 32
TIMES = np.array([1, 2, 4, 8, 16], np.float32)

rng = np.random.default_rng(5)
x, y = np.meshgrid((np.arange(WIDTH) + 0.5) / WIDTH, (np.arange(HEIGHT) + 0.5) / HEIGHT)
scene = np.stack([
    0.004 * np.exp(2.3 * x + 0.3 * np.sin(9 * y)),
    0.005 * np.exp(2.3 * y + 0.2 * np.sin(8 * x)),
    0.006 * np.exp(1.8 * (1 - x) * (1 + 0.2 * y)),
], -1)


def response(exposure):
    """A film-like curve, 0 to 255, noise of half a code."""
    code = 255 * exposure ** 0.55 / (exposure ** 0.55 + 0.3) * 1.05
    return np.rint(code + 0.5 * rng.standard_normal(code.shape))


exposures = [response(scene * time).astype(np.int64) for time in TIMES]
assert min(e.min() for e in exposures) >= 1 and max(e.max() for e in exposures) < 249
stack = [np.ascontiguousarray(e.astype(np.uint8)[:, :, ::-1]) for e in exposures]
curve = cv2.createCalibrateDebevec(samples=70, lambda_=10).process(stack, TIMES)
merged = cv2.createMergeDebevec().process(stack, TIMES, curve)[:, :, ::-1]

cv2.imwrite(os.path.join(HERE, "exposures.png"), np.concatenate(stack))
with open(os.path.join(HERE, "response.csv"), "w") as out:
    out.write("value,red,green,blue\n")
    for value, (blue, green, red) in enumerate(curve.reshape(256, 3)):
        out.write(f"{value},{red:.8g},{green:.8g},{blue:.8g}\n")
header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
with OpenEXR.File(header, {"RGB": np.ascontiguousarray(merged, np.float32)}) as out:
    out.write(os.path.join(HERE, "merged.exr"))
print("codes", min(e.min() for e in exposures), "to", max(e.max() for e in exposures))
