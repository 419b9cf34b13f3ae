#!/usr/bin/env bash
# Makes the guide's pictures of the import page, of relighting and of the studies, with a mouse and keys that
# nobody holds. The import page shows a COLMAP model that is made here of the shipped example: its cameras, and
# points on its surfaces that the photographs observe with an error of half a pixel.
#
#   assets/guide/pages.sh [dark|light] [FOLDER] [import|exposures|relight|speed|stability]
#
# Needs what walk.sh needs, and for the picture of exposure series LOBELIA_CAPTURES, a folder that has
# `corner-bracketed`; without it that picture is left out.
walk=pages
pages=${3:-import exposures relight speed stability}
. "$(dirname "$0")/window.sh"

# A field of a page: its place and what is typed into it.
field() { click "$1" "$2"; keys ctrl+a; text "$3"; keys Return; }
# What the window keeps of unsaved work would be offered by the next.
close() {
    kill "$window"
    wait "$window" 2>/dev/null || true
    window=
    find "$XDG_CONFIG_HOME/lobelia" -mindepth 1 -not -name studio.json -delete
}

example=$PWD/assets/examples/corner
python3 - "$example" "$work/scan" <<'PY'
import json, math, pathlib, random, shutil, sys

capture, out = map(pathlib.Path, sys.argv[1:])
UNIT = 0.42   # metres; COLMAP's models have no unit of their own
ERROR = 0.5   # pixels, in each coordinate
random.seed(1)
out.mkdir(parents=True)
shutil.copytree(capture / "images", out / "images")
vertices, triangles = [], []
for line in (capture / "scene.obj").read_text().splitlines():
    words = line.split()
    if words[:1] == ["v"]:
        vertices.append([float(word) for word in words[1:4]])
    elif words[:1] == ["f"]:
        corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
        triangles += [[corners[0], a, b] for a, b in zip(corners[1:], corners[2:])]


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def is_seen(point, eye):
    """Whether nothing stands between them (Möller and Trumbore)."""
    ray = sub(point, eye)
    for a, b, c in ([vertices[k] for k in triangle] for triangle in triangles):
        e, f = sub(b, a), sub(c, a)
        p = cross(ray, f)
        determinant = dot(e, p)
        if abs(determinant) < 1e-12:
            continue
        t = sub(eye, a)
        q = cross(t, e)
        u, v, along = dot(t, p) / determinant, dot(ray, q) / determinant, dot(f, q) / determinant
        if u >= 0 and v >= 0 and u + v <= 1 and 1e-6 < along < 1 - 1e-6:
            return False
    return True


def quaternion(m):
    """Of a rotation, w first; no turn of the example's cameras is by 180 degrees."""
    w = math.sqrt(max(0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2
    return [w, (m[2][1] - m[1][2]) / 4 / w, (m[0][2] - m[2][0]) / 4 / w, (m[1][0] - m[0][1]) / 4 / w]


cameras = json.loads((capture / "transforms.json").read_text())
views = []
for frame in cameras["frames"]:
    m = frame["transform_matrix"]
    # From the world to a camera that looks along +z, with y down.
    rows = [[sign * m[k][axis] for k in range(3)] for axis, sign in ((0, 1), (1, -1), (2, -1))]
    views.append((pathlib.Path(frame["file_path"]).name, rows, [m[k][3] for k in range(3)]))
f, g, cx, cy = (cameras[key] for key in ("fl_x", "fl_y", "cx", "cy"))
areas = [math.hypot(*cross(sub(vertices[b], vertices[a]), sub(vertices[c], vertices[a]))) for a, b, c in triangles]
points, observed = [], [[] for _ in views]
while len(points) < 250:
    a, b, c = (vertices[k] for k in random.choices(triangles, areas)[0])
    u, v = random.random(), random.random()
    if u + v > 1:
        u, v = 1 - u, 1 - v
    point = [a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]) for k in range(3)]
    track, distances = [], []
    for view, (_, rows, eye) in enumerate(views):
        x, y, z = (dot(row, sub(point, eye)) for row in rows)
        if z <= 0:
            continue
        pixel = [f * x / z + cx, g * y / z + cy]
        if 2 < pixel[0] < cameras["w"] - 2 and 2 < pixel[1] < cameras["h"] - 2 and is_seen(point, eye):
            error = [random.gauss(0, ERROR), random.gauss(0, ERROR)]
            track.append((view, [p + e for p, e in zip(pixel, error)]))
            distances.append(math.hypot(*error))
    if len(track) < 2:
        continue
    number = len(points) + 1
    places = []
    for view, pixel in track:
        places.append(f"{view + 1} {len(observed[view])}")
        observed[view].append(f"{pixel[0]} {pixel[1]} {number}")
    at = " ".join(str(x / UNIT) for x in point)
    points.append(f"{number} {at} 128 128 128 {sum(distances) / len(distances)} " + " ".join(places))
(out / "cameras.txt").write_text(f"1 PINHOLE {cameras['w']} {cameras['h']} {f} {g} {cx} {cy}\n")
(out / "points3D.txt").write_text("\n".join(points) + "\n")
with open(out / "images.txt", "w") as file:
    for view, (name, rows, eye) in enumerate(views):
        turn = " ".join(map(str, quaternion(rows)))
        shift = " ".join(str(-dot(row, eye) / UNIT) for row in rows)
        file.write(f"{view + 1} {turn} {shift} 1 {name}\n" + " ".join(observed[view]) + "\n")
with open(out / "room.ply", "w") as file:
    file.write(f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\n")
    file.write("property float x\nproperty float y\nproperty float z\n")
    file.write(f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    file.writelines(" ".join(str(x / UNIT) for x in vertex) + "\n" for vertex in vertices)
    file.writelines("3 " + " ".join(map(str, triangle)) + "\n" for triangle in triangles)
PY
cd "$work"

open() {
    start "$@"
    pause 6
}

for page in $pages; do
    case $page in
    import)
        open
        keys ctrl+i
        pause 2
        field 198 92 scan/images
        field 198 117 scan/room.ply
        field 198 142 room-capture
        field 126 221 0.42
        field 172 67 scan
        pause 8
        picture import
        click 490 45    # Photographs
        pause 3
        picture check
        ;;
    exposures)
        [ -n "${LOBELIA_CAPTURES:-}" ] || continue
        cp -r "$LOBELIA_CAPTURES/corner-bracketed" bracketed
        open
        keys ctrl+i
        pause 2
        field 172 67 bracketed
        pause 8
        click 15 502    # Merge 6 series to radiance
        pause 24
        click 583 45    # Exposures
        pause 3
        picture exposures
        ;;
    relight)
        open
        state "$work/ready.png"
        close
        open "$example"
        keys ctrl+r
        wait_job
        keys F5
        pause 1
        click 964 255   # All of the recovered light: off
        command_ "add sphere light"
        pause 8
        click 296 98    # Before | after
        pause 60        # pictures come after twice as many paths each: without much noise
        picture relight
        ;;
    speed | stability)
        open
        state "$work/ready.png"
        close
        open "$example"
        keys F6
        pause 1
        if [ "$page" = speed ]; then
            click 100 92    # Error of reflectance
            click 274 67    # Run study
        else
            command_ "show stability"
            for row in 175 250 275; do click 13 $row; done   # noise, lens, focal length
            click 148 116   # Draft
            click 42 67     # Run study
        fi
        wait_job 7200
        picture "study-$page"
        ;;
    *) fail "there is no page \"$page\"" ;;
    esac
    close
done
echo "The pictures are in $out"
