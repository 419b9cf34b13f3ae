"""Random captures with a ColorChecker on the floor, rendered by Mitsuba 3, and what it is good for.

`python make.py make OUT [--camera]` makes three rooms and an overcast yard as `../random/make.py` does, with a
chart that is photographed and not modelled, and one photograph more that is taken close to it. chart.json says
where that photograph shows its corners, each off by half a pixel (standard deviation), as clicks are. With
`--camera` all photographs are those of a camera whose channels are mixtures of Rec. 709.

`python make.py measure OUT LOBELIA` reconstructs each capture as it is, with the chart pinned by `lobelia chart`,
and with the true reflectance of the floor in tags.json, and prints the errors of all; `--json` of the chart is
kept beside.

Needs what ../random/make.py needs.
"""
import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys

import numpy as np

HERE = pathlib.Path(__file__).parent
GOLDEN = HERE / '../../../tests/golden/color/charts.json'
CAPTURES = [('room', 0), ('room', 1), ('room', 2), ('overcast', 0)]
PATCH, GAP = 0.040, 0.006
HEIGHT_M = 0.42
CAMERA = np.array([[.70, .25, .05], [.20, .75, .05], [.03, .22, .75]])


def random_captures():
    spec = importlib.util.spec_from_file_location('random_captures', HERE / '../random/make.py')
    module = importlib.util.module_from_spec(spec)
    sys.modules['random_captures'] = module
    spec.loader.exec_module(module)
    return module


def add_chart(make, scene):
    """A chart on the floor, where it is free; its corners from that of dark skin on, clockwise seen from above."""
    rng = np.random.default_rng(7)
    floor = next(s for s in scene.surfaces if s.name in ('floor', 'ground'))
    low, high = floor.vertices.min(0), floor.vertices.max(0)
    middle = np.mean([view[:3, 3] - 2.2 * view[:3, 2] for view in scene.cameras], axis=0)
    for _ in range(1000):
        at = np.clip(middle[:2] + rng.normal(0, .5, 2), low[:2] + .4, high[:2] - .4)
        if scene.stands(at, [.5, .5]):
            break
    turn = rng.uniform(0, 2 * np.pi)
    x = np.array([np.cos(turn), np.sin(turn), 0])
    y = np.array([np.sin(turn), -np.cos(turn), 0])
    size = np.array([6 * PATCH + 5 * GAP, 4 * PATCH + 3 * GAP])
    corner = np.append(at, 0) - x * size[0] / 2 - y * size[1] / 2

    def flat(left, top, width, height, z):
        at = corner + x * left + y * top + [0, 0, z]
        return make.quad(at + y * height, at + x * width + y * height, at + x * width, at)

    scene.materials['frame of chart'] = make.Material(np.full(3, .04))
    scene.add('frame of chart', 'frame of chart', [flat(-.012, -.012, size[0] + .024, size[1] + .024, .001)], False)
    for k, patch in enumerate(json.loads(GOLDEN.read_text())['patches']):
        name = f'chart {k}'
        scene.materials[name] = make.Material(np.clip(patch['rec709'], 0, 1))
        row, column = divmod(k, 6)
        scene.add(name, name, [flat(column * (PATCH + GAP), row * (PATCH + GAP), PATCH, PATCH, .002)], False)
    eye = np.append(at, 0) + [.05, -.1, HEIGHT_M]
    scene.cameras.append(make.view(eye, np.append(at, 0)))
    return [corner, corner + x * size[0], corner + x * size[0] + y * size[1], corner + y * size[1]]


def made(out, camera):
    make = random_captures()
    for kind, number in CAPTURES:
        folder = out / f'{kind}-{number}'
        scene = make.compose(kind, number)
        corners = add_chart(make, scene)
        make.write(scene, folder, kind, 128)
        cameras = json.loads((folder / 'transforms.json').read_text())
        view, focal = scene.cameras[-1], cameras['fl_x']
        seen = [view[:3, :3].T @ (corner - view[:3, 3]) for corner in corners]
        pixels = [[make.WIDTH / 2 - focal * p[0] / p[2], make.HEIGHT / 2 + focal * p[1] / p[2]] for p in seen]
        pixels = np.array(pixels) + np.random.default_rng(number).normal(0, .5, (4, 2))
        image = cameras['frames'][-1]['file_path']
        (folder / 'chart.json').write_text(json.dumps({'image': image, 'corners': pixels.round(2).tolist()}))
        if camera:
            for frame in cameras['frames']:
                file = str(folder / frame['file_path'])
                pixels = np.array(make.mi.Bitmap(file)).astype(np.float32) @ CAMERA.T
                make.mi.Bitmap(np.ascontiguousarray(pixels.astype(np.float32))).convert(
                    component_format=make.mi.Struct.Type.Float16).write(file)
        print(folder, flush=True)


def measure(out, lobelia):
    def run(*arguments):
        return subprocess.run([lobelia, *map(str, arguments)], check=True, capture_output=True, text=True).stdout

    print('capture,variant,raw error,largest')
    for kind, number in CAPTURES:
        folder = out / f'{kind}-{number}'
        chart = json.loads((folder / 'chart.json').read_text())
        corners = [f'{x},{y}' for x, y in chart['corners']]
        asked = ['chart', folder, '--image', chart['image'], '--quiet', '--corners', *corners]
        truth = json.loads((folder / 'truth.json').read_text())
        for variant in ('as it is', 'chart', 'chart and matrix', 'floor known'):
            copy = out / f'{kind}-{number} {variant}'
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(folder, copy)
            asked[1] = copy
            if variant.startswith('chart'):
                (copy / 'read.json').write_text(run(*asked, '--json', '--pin'))
            if variant.endswith('matrix'):
                run(*asked, '--matrix')
            if variant == 'floor known':
                tags = json.loads((copy / 'tags.json').read_text())
                for material in tags['materials']:
                    if material['name'] in ('floor', 'ground'):
                        material['known_diffuse'] = truth['materials'][material['name']]['rho_d']
                (copy / 'tags.json').write_text(json.dumps(tags))
            run('reconstruct', copy, '--out', copy / 'out', '--quiet')
            run('score', copy, copy / 'out', '--json', copy / 'score.json')
            raw = json.loads((copy / 'score.json').read_text())['raw']
            print(f"{kind}-{number},{variant},{raw['mean_diffuse']:.4f},{raw['largest_diffuse']:.4f}", flush=True)


if __name__ == '__main__':
    if sys.argv[1] == 'make':
        os.environ.setdefault('DRJIT_LIBLLVM_PATH', '/usr/lib/x86_64-linux-gnu/libLLVM-19.so')
        made(pathlib.Path(sys.argv[2]), '--camera' in sys.argv)
    else:
        measure(pathlib.Path(sys.argv[2]), sys.argv[3])
