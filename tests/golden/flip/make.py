"""Pairs of pictures with their FLIP errors by NVIDIA's own implementation, for tests/study/flip.rs.

    pip install numpy flip-evaluator==1.7
    python3 make.py        # writes pairs.json beside this file

Each pair has a picture of smooth shading, edges, texture and saturated colour, and the same with a
shift, a tint, noise and a missing spot. Those of radiance also have a lamp 500 times as bright as
the rest.
"""
import json
import pathlib

import flip_evaluator
import numpy as np

WIDTH, HEIGHT, PPD = 32, 24, 67.0


def scene(shift):
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    x = x + shift
    red = 0.2 + 0.6 * x / WIDTH
    green = 0.5 + 0.3 * np.sin(x / 3) * np.cos(y / 4)
    blue = np.where((x // 5 + y // 6) % 2 == 0, 0.7, 0.1)
    return np.stack([red, green, blue], -1)


def pair(kind, seed):
    rng = np.random.default_rng(seed)
    truth = scene(0.0)
    test = scene(0.7) * [1.05, 0.97, 1.0] + rng.normal(0, 0.03, truth.shape)
    test[8:12, 10:15] = 0.05
    if kind == "hdr":
        truth, test = 0.3 * truth ** 2, 0.3 * np.abs(test) ** 2
        truth[3:6, 20:25] = [150.0, 120.0, 80.0]
        test[3:6, 20:25] = [110.0, 120.0, 90.0]
        truth, test = np.round(truth, 4), np.round(np.maximum(test, 0), 4)
    else:
        truth, test = (np.round(np.clip(v, 0, 1), 4) for v in (truth, test))
    truth, test = truth.astype(np.float32), test.astype(np.float32)
    # Linear numbers in both cases.
    errors, mean, used = flip_evaluator.evaluate(
        truth, test, kind.upper(), inputsRGB=False, applyMagma=False, parameters={"ppd": PPD})
    flat = lambda v: [float(f"{n:.6g}") for n in np.asarray(v).ravel()]
    return {"kind": kind, "width": WIDTH, "ppd": PPD, "truth": flat(truth), "test": flat(test),
            "errors": flat(errors), "mean": float(mean)}


pairs = [pair("ldr", 1), pair("hdr", 2), pair("hdr", 3)]
out = pathlib.Path(__file__).with_name("pairs.json")
out.write_text(json.dumps(pairs, separators=(",", ":")) + "\n")
for one in pairs:
    print(one["kind"], one["mean"])
