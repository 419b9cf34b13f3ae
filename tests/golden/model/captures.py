"""Makes strokes for three captures, as a person would draw them with an error of one pixel.

    python captures.py CAPTURES [SEED FOLDER]

reads scene.obj and transforms.json of CAPTURES/{corner-diffuse,coloured-light,boxes-artificial} and
writes for each a NAME.json (a model.json: corners that a photograph shows are picked; pieces of
edges are drawn; each coordinate is off by Gaussian noise of 1 px)
and a NAME.truth.json (cameras and corners without noise), beside this script with seed 20, or with
another seed into another folder. boxes-one is one photograph of the boxes. numpy alone; shares no
code with the program. The captures are synthetic ones of this project.
"""
import json
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent


def read_obj(file):
    vertices, groups, name = [], {}, None
    for line in file.read_text().splitlines():
        parts = line.split()
        if not parts:
            continue
        if parts[0] == "v":
            vertices.append([float(x) for x in parts[1:4]])
        elif parts[0] == "usemtl":
            name = parts[1]
        elif parts[0] == "f":
            corners = [int(p.split("/")[0]) - 1 for p in parts[1:]]
            for k in range(1, len(corners) - 1):
                groups.setdefault(name, []).append([corners[0], corners[k], corners[k + 1]])
    return np.array(vertices), {name: np.array(t) for name, t in groups.items()}


class Camera:
    def __init__(self, root, frame):
        self.name = frame["file_path"]
        self.size = (root["w"], root["h"])
        self.focal, self.centre = root["fl_x"], np.array([root["cx"], root["cy"]])
        matrix = np.array(frame["transform_matrix"])
        self.rotation, self.position = matrix[:3, :3], matrix[:3, 3]

    def project(self, point):
        x, y, z = self.rotation.T @ (np.asarray(point) - self.position)
        if z > -0.05:
            return None
        return np.array([x, -y]) / -z * self.focal + self.centre

    def inside(self, pixel, border=3.0):
        return pixel is not None and all(border <= pixel[k] <= self.size[k] - border for k in (0, 1))


def hits(origin, target, a, b, c):
    """Whether anything lies before the target on the way to it (Moeller, Trumbore, all triangles)."""
    direction = target - origin
    e1, e2 = b - a, c - a
    p = np.cross(direction, e2)
    det = np.einsum("ij,ij->i", e1, p)
    det = np.where(np.abs(det) > 1e-12, det, np.inf)
    t = origin - a
    u = np.einsum("ij,ij->i", t, p) / det
    q = np.cross(t, e1)
    v = q @ direction / det
    w = np.einsum("ij,ij->i", e2, q) / det
    return bool(np.any((u > 1e-6) & (v > 1e-6) & (u + v < 1 - 1e-6) & (w > 1e-6) & (w < 1 - 2e-3)))


class Scene:
    def __init__(self, folder):
        self.vertices, self.groups = read_obj(folder / "scene.obj")
        root = json.loads((folder / "transforms.json").read_text())
        self.cameras = [Camera(root, frame) for frame in root["frames"]]
        corners = self.vertices[np.concatenate(list(self.groups.values()))]
        self.triangles = corners[:, 0], corners[:, 1], corners[:, 2]

    def sees(self, camera, point):
        pixel = camera.project(point)
        if not camera.inside(pixel):
            return None
        return None if hits(camera.position, np.asarray(point), *self.triangles) else pixel

    def run(self, camera, a, b):
        """The longest visible piece of an edge: its ends in pixels, or None."""
        places = [(1 - s) * np.asarray(a) + s * np.asarray(b) for s in np.linspace(0.01, 0.99, 99)]
        best, own = [], []
        for place in places + [None]:
            pixel = None if place is None else self.sees(camera, place)
            if pixel is None:
                if len(own) > len(best):
                    best = own
                own = []
            else:
                own.append(pixel)
        return (best[0], best[-1]) if len(best) > 1 else None

    def box(self, group):
        """Bottom corners counter-clockwise seen from above, then those of the top."""
        corners = np.unique(np.round(self.vertices[np.unique(self.groups[group])], 6), axis=0)
        middle = corners.mean(0)
        low, high = corners[:, 2].min(), corners[:, 2].max()
        bottom = corners[np.isclose(corners[:, 2], low)]
        turn = np.arctan2(bottom[:, 1] - middle[1], bottom[:, 0] - middle[0])
        bottom = bottom[np.argsort(turn)]
        # The wider side first, as somebody would who thinks of width and depth.
        if np.linalg.norm(bottom[1] - bottom[0]) < np.linalg.norm(bottom[2] - bottom[1]) - 1e-9:
            bottom = np.roll(bottom, -1, axis=0)
        top = bottom + [0, 0, high - low]
        assert len(bottom) == 4
        return np.concatenate([bottom, top])


RING = [(0, 1), (1, 2), (2, 3), (3, 0)]
EDGES = RING + [(a + 4, b + 4) for a, b in RING] + [(k, k + 4) for k in range(4)]


class Strokes:
    def __init__(self, scene, seed, sd=1.0):
        self.scene, self.random, self.sd, self.list = scene, np.random.default_rng(seed), sd, []

    def off(self, pixel):
        return [round(float(x), 3) for x in pixel + self.sd * self.random.normal(size=2)]

    def thing(self, camera, name, names, corners, edges, shortest=20.0):
        seen = {}
        for own, corner in zip(names, corners):
            pixel = self.scene.sees(camera, corner)
            if pixel is not None:
                seen[own] = pixel
                self.list.append({"kind": "pick", "photograph": camera.name,
                                  "at": f"{name}.{own}", "pixel": self.off(pixel)})
        for a, b in edges:
            for start, end in self.pieces(self.scene.run(camera, corners[a], corners[b]), shortest):
                self.list.append({"kind": "edge", "photograph": camera.name,
                                  "between": [f"{name}.{names[a]}", f"{name}.{names[b]}"],
                                  "from": self.off(start), "to": self.off(end)})

    def pieces(self, run, shortest):
        """A visible run of an edge as a line detector finds it: in pieces of PIECE px or less."""
        if not run or np.linalg.norm(run[1] - run[0]) < shortest:
            return []
        count = int(np.ceil(np.linalg.norm(run[1] - run[0]) / PIECE))
        ends = [run[0] + (run[1] - run[0]) * k / count for k in range(count + 1)]
        return list(zip(ends, ends[1:]))

    def marks(self, cameras, count, seed=7):
        """Points of surfaces that three photographs or two thirds of them show: a stain, the corner
        of a shadow or of a print, whose place nobody knows."""
        random, found = np.random.default_rng(seed), []
        a, b, c = self.scene.triangles
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        while len(found) < count:
            k = random.choice(len(areas), p=areas / areas.sum())
            u, v = sorted(random.random(2))
            place = u * a[k] + (v - u) * b[k] + (1 - v) * c[k]
            seen = [(camera, self.scene.sees(camera, place)) for camera in cameras]
            seen = [(camera, pixel) for camera, pixel in seen if pixel is not None]
            if len(seen) >= min(3, max(2, 2 * len(cameras) // 3)):
                found.append(place)
                self.list += [{"kind": "pick", "photograph": camera.name, "at": f"mark{len(found)}",
                               "pixel": self.off(pixel)} for camera, pixel in seen]
        return [{"id": f"mark{k + 1}"} for k in range(count)]

    def lines(self, camera, edges, shortest=60.0):
        for axis, a, b in edges:
            run = self.scene.run(camera, a, b)
            if run and np.linalg.norm(run[1] - run[0]) > shortest:
                self.list.append({"kind": "line", "photograph": camera.name, "axis": axis,
                                  "from": self.off(run[0]), "to": self.off(run[1])})


def truth(scene, cameras, corners):
    return {
        "cameras": [{"file_path": c.name, "focal_px": c.focal, "rotation": c.rotation.tolist(),
                     "position": c.position.tolist()} for c in cameras],
        "corners": {name: np.asarray(p).tolist() for name, p in corners.items()},
        "size_m": float(np.linalg.norm(np.ptp(scene.vertices, axis=0))),
    }


def model(cameras, things, strokes):
    return {
        "format": "lobelia-model", "version": 1,
        "photographs": [{"file_path": c.name, "w": c.size[0], "h": c.size[1]} for c in cameras],
        "things": things, "points": [], "strokes": strokes,
    }


def boxes_of(scene, groups):
    return {group: scene.box(group) for group in groups}


BOX = [f"bottom{k}" for k in range(1, 5)] + [f"top{k}" for k in range(1, 5)]
MARKS = 16
PIECE = 80
ROOM = [f"floor{k}" for k in range(1, 5)] + [f"ceiling{k}" for k in range(1, 5)]


def corner(scene, seed):
    """corner-diffuse and coloured-light: a floor, two walls, three boxes.

    No photograph shows where floor and walls end, so these numbers are typed."""
    x, y, height = 3.5, 3.3, 3.0
    floor = np.array([[0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0]], float)
    corners = np.concatenate([floor, floor + [0, 0, height]])
    boxes = {name: scene.box(name) for name in ["box1", "box2", "box3"]}
    strokes = Strokes(scene, seed)
    for camera in scene.cameras:
        # The corner at the ceiling belongs to the walls, the far ones to nothing that is there.
        strokes.thing(camera, "room", [ROOM[k] for k in (0, 1, 3, 4)], [corners[k] for k in (0, 1, 3, 4)],
                      [(0, 1), (2, 0), (0, 3)])
        for name, own in boxes.items():
            strokes.thing(camera, name, BOX, own, EDGES)
        strokes.lines(camera, [("x", corners[0], corners[1]), ("y", corners[0], corners[3]),
                               ("z", corners[0], corners[4])])
    things = [{"id": "room", "kind": "room", "corners": 4, "rectilinear": True,
               "hold": {"x2": x, "y2": y, "height": height},
               "surfaces": {"floor": "floor", "wall1": "wall2", "wall4": "wall1", "wall2": None,
                            "wall3": None, "ceiling": None}}]
    things += [{"id": name, "kind": "box", "surface": name} for name in boxes]
    points = strokes.marks(scene.cameras, MARKS)
    return strokes, corners, boxes, things, points, "room.floor1"


def pages(scene, cover):
    """The pages of the open book as a box on its cover: they bulge by 6 mm between its corners."""
    sides = [cover[1] - cover[0], cover[3] - cover[0]]
    axes = [side / np.linalg.norm(side) for side in sides]
    vertices = scene.vertices[np.unique(scene.groups["book_pages"])]
    along = [(vertices - cover[0]) @ axis for axis in axes]
    (a, c), (b, d) = ((own.min(), own.max()) for own in along)
    ring = [cover[0] + u * axes[0] + v * axes[1] for u, v in [(a, b), (c, b), (c, d), (a, d)]]
    low = vertices[:, 2].min()
    # As high as the mesh is at its corners.
    near = np.linalg.norm((vertices - ring[0])[:, :2], axis=1) < 1e-3
    high = vertices[near, 2].max()
    return np.array([[x, y, z] for z in (low, high) for x, y, _ in ring])


def table(scene, seed, cameras):
    """boxes-artificial: a floor, boxes on it and on each other, a book."""
    floor = np.array([[-1.5, -1.3, 0], [1.5, -1.3, 0], [1.5, 1.3, 0], [-1.5, 1.3, 0]])
    corners = np.concatenate([floor, floor + [0, 0, 1]])
    boxes = {name: scene.box(name) for name in ["cardboard1", "cardboard2", "cardboard3", "book_cover"]}
    strokes = Strokes(scene, seed)
    for camera in cameras:
        strokes.thing(camera, "room", ROOM[:4], corners[:4], RING)
        for name, own in boxes.items():
            strokes.thing(camera, name, BOX, own, EDGES)
        strokes.lines(camera, [("x", corners[0], corners[1]), ("x", corners[3], corners[2]),
                               ("y", corners[0], corners[3]), ("y", corners[1], corners[2])])
    boxes["book_pages"] = pages(scene, boxes["book_cover"])
    for camera in cameras:
        strokes.thing(camera, "book_pages", BOX, boxes["book_pages"], EDGES)
    things = [{"id": "room", "kind": "room", "corners": 4, "rectilinear": True,
               "hold": {"y1": -1.3, "height": 1.0} | ({"x2": 1.5} if len(cameras) == 1 else {}),
               "surfaces": {"floor": "floor", "wall1": None, "wall2": None, "wall3": None,
                            "wall4": None, "ceiling": None}}]
    for name in boxes:
        thing = {"id": name, "kind": "box", "surface": name}
        if name == "cardboard3":
            thing["on"] = "cardboard2.top"
        if name == "book_cover":
            thing["hold"] = {"height": 0.008}
        if name == "book_pages":
            thing["on"] = "book_cover.top"
        things.append(thing)
    points = strokes.marks(cameras, MARKS) if len(cameras) > 1 else []
    return strokes, corners, boxes, things, points, "cardboard1.bottom1"


def files(scene, cameras, made):
    """The model with an origin and a known length: two places far apart that are seen often."""
    strokes, corners, boxes, things, points, origin = made
    everything = {f"room.{name}": place for name, place in zip(ROOM, corners)}
    for thing, own in boxes.items():
        everything |= {f"{thing}.{name}": place for name, place in zip(BOX, own)}
    picks = [stroke["at"] for stroke in strokes.list if stroke["kind"] == "pick" and "." in stroke["at"]]
    often = sorted({p for p in picks if picks.count(p) >= min(2, len(cameras))})
    length, a, b = max((np.linalg.norm(everything[a] - everything[b]), a, b)
                       for a in often for b in often if a < b)
    typed = [{"kind": "position", "at": origin, "position": [round(float(x), 6) for x in everything[origin]]},
             {"kind": "length", "between": [a, b], "length_m": round(float(length), 6)}]
    model = {
        "format": "lobelia-model", "version": 1,
        "photographs": [{"file_path": c.name, "w": c.size[0], "h": c.size[1]} for c in cameras],
        "things": things, "points": points, "strokes": strokes.list + typed,
    }
    truth = {
        "made_by": "tests/golden/model/captures.py",
        "size_m": round(float(np.linalg.norm(np.ptp(scene.vertices, axis=0))), 6),
        "cameras": [{"file_path": c.name, "focal_px": c.focal, "rotation": c.rotation.tolist(),
                     "position": c.position.tolist()} for c in cameras],
        "corners": {name: np.asarray(place).tolist() for name, place in everything.items()},
    }
    return model, truth


def write(name, value):
    (HERE / f"{name}.json").write_text(json.dumps(value, separators=(",", ":")) + "\n")


def make(captures, seed):
    made = {}
    for name in ["corner-diffuse", "coloured-light"]:
        scene = Scene(captures / name)
        made[name] = files(scene, scene.cameras, corner(scene, seed))
    scene = Scene(captures / "boxes-artificial")
    made["boxes-artificial"] = files(scene, scene.cameras, table(scene, seed, scene.cameras))
    one = [scene.cameras[1]]
    made["boxes-one"] = files(scene, one, table(scene, seed, one))
    return made


if __name__ == "__main__":
    # Another seed than the stored one is for finding out how results scatter.
    seed, folder = (int(sys.argv[2]), Path(sys.argv[3])) if len(sys.argv) > 3 else (20, HERE)
    HERE = folder
    for name, (model, truth) in make(Path(sys.argv[1]), seed).items():
        write(name, model)
        write(f"{name}.truth", truth)
