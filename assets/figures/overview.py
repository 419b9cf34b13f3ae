"""The picture at the head of the guide's page on results, from a capture and the solution that lobelia wrote for it.

    pip install numpy matplotlib OpenEXR
    python3 overview.py CAPTURE SOLUTION overview.png
"""
import csv
import json
import pathlib
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import OpenEXR

capture, solution, out = map(pathlib.Path, sys.argv[1:4])
cameras = json.loads((capture / "transforms.json").read_text())
frame = cameras["frames"][0]
with OpenEXR.File(str(capture / frame["file_path"])) as file:
    channels = file.channels()
    image = channels["RGB"].pixels if "RGB" in channels else np.stack(
        [channels[c].pixels for c in "RGB"], -1)
image = image.astype(float)
samples = list(csv.DictReader((solution / "samples.csv").open()))
lights = json.loads((solution / "lights.json").read_text())["lights"]
result = json.loads((solution / "solution.json").read_text())


def column(rows, *names):
    return np.array([[float(row[name]) for name in names] for row in rows])


def project(points):
    world_from_camera = np.array(frame["transform_matrix"])
    local = (points - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]
    u = cameras["fl_x"] * local[:, 0] / -local[:, 2] + cameras["cx"]
    v = cameras["fl_y"] * -local[:, 1] / -local[:, 2] + cameras["cy"]
    facing = np.einsum("ij,ij->i", column(samples, "nx", "ny", "nz"),
                       world_from_camera[:3, 3] - points) > 0
    return u, v, facing & (local[:, 2] < 0)


plt.rcParams.update({"font.size": 9, "font.family": "DejaVu Sans"})
figure = plt.figure(figsize=(13, 3.3), layout="constrained")
grid = figure.add_gridspec(1, 4, width_ratios=[1.15, 1.25, 1.15, 0.95])

shown = np.clip(image / np.percentile(image, 99), 0, 1) ** (1 / 2.2)
axes = figure.add_subplot(grid[0])
axes.imshow(shown)
axes.set_title("Photograph (HDR, tone-mapped)")
axes.axis("off")

axes = figure.add_subplot(grid[1])
axes.imshow(0.35 * shown + 0.65)
u, v, visible = project(column(samples, "x_m", "y_m", "z_m"))
error = 100 * column(samples, "relative_error_g")[:, 0]
dots = axes.scatter(u[visible], v[visible], c=error[visible], s=2, cmap="PuOr", vmin=-15, vmax=15)
axes.set_xlim(0, image.shape[1])
axes.set_ylim(image.shape[0], 0)
axes.set_title(f"{len(samples)} samples: relative error, green")
axes.axis("off")
figure.colorbar(dots, ax=axes, shrink=0.8, format="%+d %%")

axes = figure.add_subplot(grid[2], projection="3d")
points = column(samples, "x_m", "y_m", "z_m")
colours = np.clip(column(samples, "observed_r", "observed_g", "observed_b")
                  / np.percentile(image, 99), 0, 1) ** (1 / 2.2)
axes.scatter(*points.T, c=colours, s=1, depthshade=False)
discs = [light for light in lights if light["kind"] in ("sphere", "surface")]
lamps = [light for light in lights if light["kind"] == "lamp"]
for group, marker, label in ((discs, "o", None), (lamps, "*", "lamps found")):
    if not group:
        continue
    emission = np.array([np.sum([lobe["emission"] for lobe in light["lobes"]], 0)
                         for light in group])
    position = np.array([light["position"] for light in group])
    # What a light sends: its emission times its area.
    power = emission.max(1) * np.array([light["radius_m"] for light in group]) ** 2
    size = (8 + 60 * power / power.max()) * (2 if marker == "*" else 1)
    tint = np.clip(emission / np.maximum(emission.max(1, keepdims=True), 1e-12), 0, 1)
    axes.scatter(*position.T, c=tint, s=size, marker=marker, edgecolors="0.3", linewidths=0.5,
                 depthshade=False, label=label)
axes.set_title(f"{len(lamps)} lamps found, {len(discs)} background lights")
axes.set_box_aspect((1, 1, 1), zoom=1.15)
axes.set_xlabel("x (m)", labelpad=-8)
axes.set_ylabel("y (m)", labelpad=-8)
axes.set_zlabel("z (m)", labelpad=-9)
axes.tick_params(labelsize=6, pad=-3)
axes.view_init(22, 35)

axes = figure.add_subplot(grid[3])
truth_file = capture / "truth.json"
truth = json.loads(truth_file.read_text())["materials"] if truth_file.exists() else {}
names = [material["name"] for material in result["materials"]]
for channel, colour in enumerate(("#c0392b", "#27903c", "#2f6fbd")):
    for row, material in enumerate(result["materials"]):
        if material["diffuse"] is None:
            continue
        y = row + 0.22 * (channel - 1)
        interval = (material.get("diffuse_interval") or [None] * 3)[channel]
        if interval:
            axes.plot(interval, [y, y], color=colour, lw=2, solid_capstyle="butt")
        axes.plot(material["diffuse"][channel], y, "o", ms=3.5, color=colour)
        if material["name"] in truth:
            axes.plot(truth[material["name"]]["rho_d"][channel], y, "|", ms=8, color="black")
axes.set_yticks(range(len(names)), names)
axes.invert_yaxis()
axes.set_xlim(0, 1)
axes.set_xlabel("diffuse reflectance")
axes.set_title("Recovered, 95 % (black: truth)")
axes.grid(alpha=0.3)
figure.savefig(out, dpi=110)
