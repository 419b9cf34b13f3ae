"""Whether the export for Mitsuba 3 renders the picture that `lobelia render` makes: a z-test.

    python3 mitsuba_export.py LOBELIA CAPTURE SOLUTION [--edits FILE] [--camera 0] [--seeds 4] [--spp 16]

Both render one camera with several seeds. Over blocks of 16 by 16 pixels the difference of the
means is divided by its standard error, which comes from the differences between seeds, pixel by
pixel: if both have the same expectation, the scores are normal with mean 0 and deviation 1. Fails
(exit code 1) where their mean square is beyond 4.5 of its own deviations, or any score beyond 5.
Pixels that show anything beyond the geometry are left out: there lobelia shows the recovered sky.
Mitsuba's llvm_ad_rgb needs LLVM 16 or later (DRJIT_LIBLLVM_PATH); 15 crashes on processors with AVX-512.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

BLOCK = 16

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("lobelia")
parser.add_argument("capture")
parser.add_argument("solution")
parser.add_argument("--edits")
parser.add_argument("--camera", type=int, default=0)
parser.add_argument("--seeds", type=int, default=4)
parser.add_argument("--spp", type=int, default=16)
parser.add_argument("--keep", help="a folder for the export and all pictures")
arguments = parser.parse_args()


def run(*command):
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)


def picture(file):
    import mitsuba as mi

    main_layer = dict(mi.Bitmap(str(file)).split())["<root>"]
    names = [field.name for field in main_layer.struct_()]
    values = np.array(main_layer, dtype=float)
    alpha = values[..., names.index("A")] if "A" in names else np.ones(values.shape[:2])
    return values[..., [names.index(channel) for channel in "RGB"]], alpha


def main(folder):
    edits = ["--edits", arguments.edits] if arguments.edits else []
    run(arguments.lobelia, "export", arguments.capture, "--solution", arguments.solution,
        "--out", folder, "--format", "mitsuba", "-q", *edits)
    with open(os.path.join(arguments.capture, "transforms.json"), encoding="utf-8") as file:
        cameras = json.load(file)
    name = os.path.splitext(os.path.basename(cameras["frames"][arguments.camera]["file_path"]))[0]
    cameras["frames"] = [cameras["frames"][arguments.camera]]
    one = os.path.join(folder, "one.json")
    with open(one, "w", encoding="utf-8") as file:
        json.dump(cameras, file)
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    sets, covered = [[], []], 1.0
    for seed in range(1, arguments.seeds + 1):
        ours, theirs = [os.path.join(folder, f"{who}-{seed}") for who in ("lobelia", "mitsuba")]
        run(arguments.lobelia, "render", arguments.capture, "--solution", arguments.solution,
            "--cameras", one, "--out", ours, "--spp", arguments.spp, "--seed", seed,
            "--denoise", "false", "-q", *edits)
        run(sys.executable, os.path.join(folder, "mitsuba", "render.py"), "--spp", arguments.spp,
            "--seed", seed, "--camera", arguments.camera, "--out", theirs)
        for pictures, where in zip(sets, (ours, theirs)):
            radiance, alpha = picture(os.path.join(where, name + ".exr"))
            pictures.append(radiance)
            if where == ours:
                covered = covered * (alpha > 1 - 1e-4)[..., None]
    return compare(*[np.array(pictures) * covered for pictures in sets])


def blocks(values):
    """Means over blocks, of the last three axes (rows, columns, channels)."""
    *many, height, width, channels = values.shape
    rows, columns = height // BLOCK, width // BLOCK
    cut = values[..., : rows * BLOCK, : columns * BLOCK, :]
    return cut.reshape(*many, rows, BLOCK, columns, BLOCK, channels).mean(axis=(-4, -2))


def compare(ours, theirs):
    seeds = len(ours)
    variance = [blocks(set_.var(axis=0, ddof=1)) / (seeds * BLOCK * BLOCK) for set_ in (ours, theirs)]
    means = [blocks(set_.mean(axis=0)) for set_ in (ours, theirs)]
    error = np.sqrt(variance[0] + variance[1])
    lit = error > 0
    scores = (means[0] - means[1])[lit] / error[lit]
    square, count = np.mean(scores**2), scores.size
    deviations = (square - 1) / np.sqrt(2 / count)
    ratio = means[0].sum(axis=(0, 1)) / means[1].sum(axis=(0, 1))
    relative = np.median(error[lit] / np.maximum(means[1][lit], 1e-12))
    print(f"{count} blocks and channels, {seeds} seeds of {arguments.spp} paths a pixel")
    print(f"z: mean {scores.mean():+.3f}, mean square {square:.3f} ({deviations:+.1f} deviations), "
          f"largest {np.abs(scores).max():.2f}, beyond 2: {np.mean(np.abs(scores) > 2):.1%}")
    print("ratio of the pictures, R G B: " + " ".join(f"{value:.5f}" for value in ratio)
          + f"; standard error of a block, median {relative:.2%}")
    # What is dark in one must be in the other.
    dark = np.abs((means[0] - means[1])[~lit])
    return abs(deviations) < 4.5 and np.abs(scores).max() < 5 and (dark < 1e-6).all()


try:
    import mitsuba  # noqa: F401
except ImportError:
    print("skipped: no Mitsuba 3 here")
    sys.exit(0)
if arguments.keep:
    os.makedirs(arguments.keep, exist_ok=True)
    passed = main(arguments.keep)
else:
    with tempfile.TemporaryDirectory() as temporary:
        passed = main(temporary)
print("passed" if passed else "FAILED")
sys.exit(0 if passed else 1)
