"""Measures how time and memory of a reconstruction grow with the number of photographs.

    python3 assets/study/scale.py target/release/lobelia CAPTURE OUT --photographs 3 10 30 100 --samples.count 50000

CAPTURE is one that enlarge.py has made, with as many photographs as the most that are asked for; what is not known here
is handed on to the program. Every second it reads from /proc (Linux) what the program takes: its own memory (RssAnon),
all that is resident with the pages of files (VmHWM), and seconds of processors, which other programs beside it change
less than those of the clock. Writes OUT/scale.csv, with a line for each number of photographs; lines of earlier runs
stay. OUT/scale.svg shows the seconds of processors on logarithmic axes, with the exponents that fit them.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import re
import subprocess
import time

STAGES = ["load", "samples", "transport", "solve", "textures"]
COLORS = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#000000"]
TICK = os.sysconf("SC_CLK_TCK")


def subset(capture, folder, count):
    """The first photographs of a capture, by links."""
    folder.mkdir(parents=True, exist_ok=True)
    for own in capture.iterdir():
        link = folder / own.name
        if own.name != "transforms.json" and not link.exists():
            link.symlink_to(own.resolve())
    cameras = json.loads((capture / "transforms.json").read_text())
    if len(cameras["frames"]) < count:
        raise SystemExit(f"{capture} has {len(cameras['frames'])} photographs: make it with --photographs {count}")
    cameras["frames"] = cameras["frames"][:count]
    (folder / "transforms.json").write_text(json.dumps(cameras))
    return cameras


def status(pid):
    """Kilobytes of a process by their names, and seconds of processors."""
    text = pathlib.Path(f"/proc/{pid}/status").read_text()
    sizes = {name: int(size) for name, size in re.findall(r"(\w+):\s+(\d+) kB", text)}
    words = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return sizes, (int(words[11]) + int(words[12])) / TICK


def measure(program, capture, out, options):
    """One run: what it takes, its stages by seconds of processors, and the clock's."""
    log = out.with_suffix(".log")
    with open(log, "w") as file:
        command = [program, "reconstruct", str(capture), "--out", str(out), "--verbose", *options]
        run = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT)
    own, peak, spent, before = 0, 0, dict.fromkeys(STAGES, 0.0), 0.0
    while run.poll() is None:
        try:
            sizes, seconds = status(run.pid)
        except (OSError, IndexError):
            break
        own, peak = max(own, sizes.get("RssAnon", 0)), max(peak, sizes.get("VmHWM", 0))
        begun = re.findall(r"job 1: (\w+)$", log.read_text(), re.M)
        stage = next((stage for stage in reversed(begun) if stage in STAGES), "load")
        spent[stage] += seconds - before
        before = seconds
        time.sleep(1)
    if run.wait() != 0:
        raise SystemExit(f"the run failed: {log}")
    text = re.sub(r"\s+", " ", log.read_text())
    clock = float(re.search(r"seconds: .*?total ([\d.]+)", text)[1])
    return {"own_gb": own / 2**20, "peak_gb": peak / 2**20, "clock_s": clock, "total": sum(spent.values()), **spent}


def exponent(points):
    """Of the power law with least squares of logarithms; None of a single place."""
    logs = [(math.log(x), math.log(y)) for x, y in points if y > 0]
    mean = [sum(values) / len(logs) for values in zip(*logs)] if logs else [0, 0]
    spread = sum((x - mean[0]) ** 2 for x, _ in logs)
    return sum((x - mean[0]) * (y - mean[1]) for x, y in logs) / spread if spread > 0 else None


def chart(rows, file):
    """Seconds of processors against photographs, both logarithmic."""
    points = {stage: [(int(row["photographs"]), float(row[stage])) for row in rows] for stage in [*STAGES, "total"]}
    shown = [point for own in points.values() for point in own if point[1] > 0]
    low = [math.floor(math.log10(min(values))) for values in zip(*shown)]
    high = [math.ceil(math.log10(max(values))) for values in zip(*shown)]
    (width, height), (left, top) = (460, 340), (60, 20)

    def place(point):
        part = [(math.log10(v) - a) / max(b - a, 1) for v, a, b in zip(point, low, high)]
        return left + part[0] * width, top + (1 - part[1]) * height

    lines = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 760 420" font-family="sans-serif" font-size="13">',
        '<rect width="760" height="420" fill="white"/>',
    ]
    for axis in range(2):
        for power in range(low[axis], high[axis] + 1):
            ends = [[10**power if own == axis else 10**end[own] for own in range(2)] for end in (low, high)]
            (x1, y1), (x2, y2) = map(place, ends)
            lines.append(f'<path d="M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}" stroke="#ddd"/>')
            at = (x1, y1 + 18, "middle") if axis == 0 else (x1 - 6, y1 + 4, "end")
            lines.append(f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" text-anchor="{at[2]}">{10**power:g}</text>')
    lines.append(f'<text x="{left + width / 2}" y="405" text-anchor="middle">photographs</text>')
    lines.append(f'<text transform="translate(18 {top + height / 2}) rotate(-90)" text-anchor="middle">'
                 "seconds of processors</text>")
    for index, (stage, own) in enumerate(points.items()):
        color, grows = COLORS[index], exponent(own)
        path = "L".join("{:.1f} {:.1f}".format(*place(point)) for point in own if point[1] > 0)
        lines.append(f'<path d="M{path}" fill="none" stroke="{color}" stroke-width="2"/>')
        for point in own:
            if point[1] > 0:
                lines.append('<circle cx="{:.1f}" cy="{:.1f}" r="3.5" fill="{}"/>'.format(*place(point), color))
        y = top + 20 + 24 * index
        power = "" if grows is None else f": exponent {grows:.2f}"
        lines.append(f'<circle cx="540" cy="{y - 4}" r="5" fill="{color}"/><text x="552" y="{y}">{stage}{power}</text>')
        if grows is not None:
            print(f"{stage} grows with the exponent {grows:.2f}")
    file.write_text("\n".join([*lines, "</svg>", ""]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program")
    parser.add_argument("capture", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--photographs", type=int, nargs="*", default=[3, 10, 30, 100])
    arguments, options = parser.parse_known_args()
    table = arguments.out / "scale.csv"
    rows = {}
    if table.exists():
        with open(table, newline="") as file:
            rows = {int(row["photographs"]): row for row in csv.DictReader(file)}
    for count in arguments.photographs:
        folder = arguments.out / f"{count}-photographs"
        cameras = subset(arguments.capture, folder, count)
        frames = cameras["frames"]
        pixels = sum(frame.get("w", cameras.get("w")) * frame.get("h", cameras.get("h")) for frame in frames)
        row = {"photographs": count, "megapixels": f"{pixels / 1e6:.0f}"}
        measured = measure(arguments.program, folder, arguments.out / f"{count}-result", options)
        row.update({name: f"{value:.2f}" for name, value in measured.items()})
        rows[count] = row
        print(row, flush=True)
        with open(table, "w", newline="") as file:
            writer = csv.DictWriter(file, row.keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows[own] for own in sorted(rows))
    if rows:
        chart([rows[own] for own in sorted(rows)], arguments.out / "scale.svg")


main()
