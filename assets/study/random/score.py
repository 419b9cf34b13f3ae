#!/usr/bin/env python3
"""Reconstructs the captures of make.py and scores them: score.py LOBELIA CAPTURES OUT.csv [options]

Writes a line per capture, and prints a line per kind:

error       mean absolute error of the diffuse reflectances, nothing pinned
one_scale   the same after the best factor common to all of them: what is left is not the scale
inside      intervals that contain the truth, of `intervals`; `values` are all reflectances
half_width  median half width of the intervals

Options are passed to `lobelia reconstruct`. Textures are left out unless an option says otherwise:
they have no effect on the reflectances of whole materials. Needs Python 3 alone.
"""

import collections
import csv
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

COLUMNS = "capture kind error one_scale inside intervals values half_width".split()


def score(solution, truth):
    """The columns after `kind`."""
    pairs, half_widths, inside = [], [], 0
    for material in solution["materials"]:
        known = truth["materials"].get(material["name"])
        if known is None or material["diffuse"] is None:
            continue
        intervals = material.get("diffuse_interval") or [None] * 3
        for value, true, interval in zip(material["diffuse"], known["rho_d"], intervals):
            pairs.append((value, true))
            if interval is not None:
                inside += interval[0] <= true <= interval[1]
                half_widths.append((interval[1] - interval[0]) / 2)
    if not pairs:
        return None

    def error(factor):
        return statistics.mean(abs(factor * value - true) for value, true in pairs)

    # The least sum of absolute differences is at one of the kinks.
    one_scale = min(error(true / value) for value, true in pairs if value > 0)
    half_width = statistics.median(half_widths) if half_widths else None
    return error(1), one_scale, inside, len(half_widths), len(pairs), half_width


def main():
    lobelia, captures, out = sys.argv[1:4]
    lines = []
    with tempfile.TemporaryDirectory() as scratch:
        for capture in sorted(pathlib.Path(captures).iterdir()):
            if not (capture / "truth.json").exists():
                continue
            truth = json.loads((capture / "truth.json").read_text())
            folder = pathlib.Path(scratch) / capture.name
            command = [lobelia, "reconstruct", capture, "--out", folder]
            command += ["--textures.enabled", "false", *sys.argv[4:]]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode != 0:
                print(f"{capture.name}: {done.stderr.strip()}", file=sys.stderr)
                continue
            columns = score(json.loads((folder / "solution.json").read_text()), truth)
            if columns is None:
                print(f"{capture.name}: no reflectances", file=sys.stderr)
                continue
            lines.append((capture.name, truth["kind"], *columns))
            print("{} error {:.4f} one scale {:.4f}".format(capture.name, *columns), flush=True)
    with open(out, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for name, kind, error, one, inside, intervals, values, half in lines:
            half = "" if half is None else f"{half:.4f}"
            writer.writerow([name, kind, f"{error:.4f}", f"{one:.4f}", inside, intervals, values, half])
    of_kind = collections.defaultdict(list)
    for line in lines:
        of_kind[line[1]].append(line)
        of_kind["all"].append(line)
    for kind, own in of_kind.items():
        mean, one = (statistics.mean(line[k] for line in own) for k in (2, 3))
        median = statistics.median(line[2] for line in own)
        inside, intervals, values = (sum(line[k] for line in own) for k in (4, 5, 6))
        print(
            f"{kind:10} {len(own):3} captures, error {mean:.4f} (median {median:.4f}), "
            f"one scale {one:.4f}, {inside} of {intervals} intervals hold the truth, "
            f"{values - intervals} of {values} reflectances without"
        )


if __name__ == "__main__":
    main()
