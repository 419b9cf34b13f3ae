#!/usr/bin/env python3
"""Errors of the captures of known truth: accuracy.py LOBELIA CAPTURES [--pictures] [NAME ...]

Reconstructs every capture of captures.toml that is in the folder CAPTURES (or those named) and writes, beside
this script:

accuracy.csv   a line per capture and run; the run is `joint` (default options), `paper` (`--method paper`) or
               `pinned` (default options, with the reflectance of the one material that has most samples given)
    error, largest       absolute error of the diffuse reflectances, its mean and its maximum
    one_scale            the mean after the best factor common to all of them
    inside, intervals    how many of the intervals contain the true value (specular reflectances have some, too)
    without, half_width  reflectances without an interval, and the mean half width of the intervals
    held_out             relative error at held-out samples, mean of the channels
    area, area_one_scale the errors weighted by the pixels that show a material, where truth.json counts them
    seconds              of the run, on a machine that may do other work as well
pictures.csv   with --pictures, a line per capture, method and kind of picture: PSNR in dB, FLIP and relative RMS,
               means over the pictures. 64 paths a pixel, denoised
    view                 cameras that are not among the photographs; the only one for the run `paper`
    relit, light_only    the first of them with truth.json's added light; the added light alone
    inserted             the first of them with truth.json's added object

Captures that were measured replace their lines; others stay. `tables.py` writes the tables of the guide from both
files. Needs Python 3.11 alone.
"""

import csv
import json
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import tomllib

HERE = pathlib.Path(__file__).parent
ACCURACY = (
    "capture run build error largest one_scale inside intervals without half_width held_out area area_one_scale seconds"
).split()
PICTURES = "capture run build kind pictures psnr flip relative_rms".split()
SPP = "64"


def lobelia(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{arguments[0]}: {done.stderr.strip()}")
    return done.stdout


def by_area(solution, truth):
    """Errors weighted by the pixels that show a material (over 1 % of all), as they are and after one scale."""
    total = sum(material.get("seen_px", 0) for material in truth["materials"].values())
    rows = []
    for material in solution["materials"]:
        names = {truth["groups"][group] for group in material["surfaces"] if group in truth["groups"]}
        if total == 0 or len(names) != 1:
            continue
        known = truth["materials"][names.pop()]
        weight = known.get("seen_px", 0) / total
        if weight >= 0.01 and known.get("rho_d") is not None:
            values = material["diffuse"] or [0, 0, 0]
            rows += [(weight, value, true) for value, true in zip(values, known["rho_d"])]
    if not rows:
        return None, None

    def error(factor):
        return sum(w * abs(factor * value - true) for w, value, true in rows) / sum(w for w, *_ in rows)

    scale = sum(w * value * true for w, value, true in rows) / sum(w * value**2 for w, value, _ in rows)
    return error(1), error(scale)


def accuracy(program, capture, truth, folder):
    solution = json.loads((folder / "solution.json").read_text())
    lobelia(program, "score", capture, folder, "--json", folder / "score.json")
    score = json.loads((folder / "score.json").read_text())
    intervals = score["intervals"]
    held_out = (solution.get("rms") or {}).get("held_out")
    area, area_one_scale = by_area(solution, truth)
    return [
        score["raw"]["mean_diffuse"],
        score["raw"]["largest_diffuse"],
        score["common_scale"]["mean_diffuse"],
        intervals["inside"],
        intervals["of"],
        intervals["without"],
        intervals["mean_half_width"],
        statistics.mean(held_out) if held_out else None,
        area,
        area_one_scale,
        solution["seconds"]["total"],
    ]


def pinned(capture, folder, solution, truth):
    """A copy of the capture in which the material with most samples has its true reflectance."""
    materials = [
        material
        for material in json.loads(solution.read_text())["materials"]
        if material["diffuse"] is not None
        and len({truth["groups"].get(group) for group in material["surfaces"]}) == 1
    ]
    most = max(materials, key=lambda material: material["samples"])
    true = truth["materials"][truth["groups"][most["surfaces"][0]]]["rho_d"]
    shutil.copytree(capture, folder, ignore=shutil.ignore_patterns("truth"))
    tags = json.loads((folder / "tags.json").read_text())
    for material in tags["materials"]:
        if material["name"] == most["name"]:
            material["known_diffuse"] = true
    (folder / "tags.json").write_text(json.dumps(tags))
    return folder


def pictures(program, capture, truth, solution, scratch, run):
    cameras = json.loads((capture / "truth/transforms.json").read_text())
    light, added = truth.get("added_light"), truth.get("added_object")
    lights, objects = [], []
    if light:
        lights = [{"name": "added", "kind": "rectangle"} | {k: light[k] for k in ("corners", "normal", "radiance")}]
    if added:
        objects = [
            {
                "mesh": str(capture / added["obj"]),
                "world_from_object": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
                "materials": {name: {"diffuse": m["rho_d"]} for name, m in added["materials"].items()},
            }
        ]
    kinds = {
        "view": ("file_path", {}),
        "relit": ("relit", {"lights": lights}),
        "light_only": ("light_only", {"lights": lights, "original_light": 0}),
        "inserted": ("inserted", {"objects": objects}),
    }
    if run == "paper":
        kinds = {"view": kinds["view"]}
    for kind, (key, edits) in kinds.items():
        frames = [frame for frame in cameras["frames"] if key in frame]
        own, true = scratch / f"{kind}-own", scratch / f"{kind}-true"
        shutil.rmtree(own, ignore_errors=True)
        shutil.rmtree(true, ignore_errors=True)
        if not frames:
            continue
        true.mkdir(parents=True)
        names = [pathlib.Path(frame[key]).name for frame in frames]
        for frame, name in zip(frames, names):
            shutil.copy(capture / "truth" / frame[key], true / name)
        listed = [
            {"file_path": name, "transform_matrix": frame["transform_matrix"]}
            for frame, name in zip(frames, names)
        ]
        (scratch / "cameras.json").write_text(json.dumps(cameras | {"frames": listed}))
        (scratch / "edits.json").write_text(json.dumps(edits))
        arguments = ["render", capture, "--solution", solution, "--cameras", scratch / "cameras.json"]
        arguments += ["--edits", scratch / "edits.json", "--out", own, "--spp", SPP, "--quiet"]
        lobelia(program, *arguments)
        arguments = ["score", capture, solution, "--renders", own, "--truth-images", true]
        lobelia(program, *arguments, "--json", scratch / "score.json")
        scores = json.loads((scratch / "score.json").read_text())["pictures"]
        means = [statistics.mean(score[key] for score in scores) for key in ("psnr_db", "mean_flip", "relative_rms")]
        yield [kind, len(scores), *means]


def update(name, columns, keys, lines):
    """Replaces the lines of `name` that have the first `keys` columns of a new one."""
    path = HERE / name
    rows = {}
    if path.exists():
        with open(path, newline="") as file:
            reader = csv.reader(file)
            if next(reader) == columns:
                rows = {tuple(row[key] for key in keys): row for row in reader}
    for line in lines:
        row = ["" if v is None else f"{v:.4g}" if isinstance(v, float) else str(v) for v in line]
        rows[tuple(row[key] for key in keys)] = row
    with open(path, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows[key] for key in sorted(rows))


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--pictures"]
    with_pictures = len(arguments) + 1 < len(sys.argv)
    program, folder, *names = arguments
    if not names:
        listed = tomllib.loads((HERE / "captures.toml").read_text())
        names = [entry["name"] for entry in listed["capture"] + listed["furnished"]]
    command = ["git", "-C", HERE, "describe", "--always", "--dirty"]
    build = subprocess.run(command, capture_output=True, text=True).stdout.strip()
    for name in names:
        capture = pathlib.Path(folder).resolve() / name
        if not (capture / "truth.json").exists():
            print(f"{name}: not in {folder}, left out", file=sys.stderr)
            continue
        truth = json.loads((capture / "truth.json").read_text())
        with tempfile.TemporaryDirectory() as scratch:
            scratch = pathlib.Path(scratch)
            for run in ("joint", "paper", "pinned"):
                of_run, options = capture, ["--quiet"]
                if run == "paper":
                    options += ["--method", "paper"]
                if run == "pinned":
                    of_run = pinned(capture, scratch / "capture", scratch / "joint/solution.json", truth)
                lobelia(program, "reconstruct", of_run, "--out", scratch / run, *options)
                line = accuracy(program, capture, truth, scratch / run)
                update("accuracy.csv", ACCURACY, (0, 1), [[name, run, build, *line]])
                print(f"{name} {run}: {line[0]:.4f}, {line[2]:.4f} after one scale", flush=True)
                if with_pictures and run != "pinned" and (capture / "truth/transforms.json").exists():
                    for line in pictures(program, capture, truth, scratch / run, scratch, run):
                        update("pictures.csv", PICTURES, (0, 1, 3), [[name, run, build, *line]])
                        print(f"{name} {run} {line[0]}: {line[2]:.1f} dB, FLIP {line[3]:.3f}", flush=True)


if __name__ == "__main__":
    main()
