"""Makes projection.json: camera files and where OpenCV puts points in their images.

Made with OpenCV 5.0.0 (opencv-python-headless 5.0.0.93) and numpy, by cv2.projectPoints, which
shares no code with this project. To remake it: pip install opencv-python-headless numpy, then
python make.py > projection.json.

OpenCV's camera looks along +z with y down, and its pixel (0, 0) is a pixel's centre; here the
camera looks along -z with y up, and cx, cy count from the image's corner, where the first
pixel's centre is (0.5, 0.5). Axes are turned below; the principal point is passed as it is, so
pixel positions count from the corner in both. The fourth radial coefficient of this project (of
r^8, nerfstudio's k4) does not exist in OpenCV, whose k4 stands in a denominator; it stays 0.
"""
import json
import cv2
import numpy as np

random = np.random.default_rng(7)


def rotation(axis_angle):
    return cv2.Rodrigues(np.asarray(axis_angle, float))[0]


def case(name, fields, w, h, fx, fy, cx, cy, k1=0, k2=0, p1=0, p2=0, k3=0):
    world_from_camera = rotation(random.normal(size=3))
    position = random.normal(size=3) * 3
    # Points in front of the camera, inside the image for a lens without distortion.
    u = random.uniform(0.1 * w, 0.9 * w, 40)
    v = random.uniform(0.1 * h, 0.9 * h, 40)
    depth = random.uniform(0.5, 9, 40)
    camera_cv = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(40)], 1) * depth[:, None]
    turn = np.diag([1.0, -1.0, -1.0])
    points = camera_cv @ turn @ world_from_camera.T + position
    cv_from_world = turn @ world_from_camera.T
    pixels, _ = cv2.projectPoints(
        points,
        cv2.Rodrigues(cv_from_world)[0],
        -cv_from_world @ position,
        np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], float),
        np.array([k1, k2, p1, p2, k3], float),
    )
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = world_from_camera, position
    frame = {"file_path": "a.png", "transform_matrix": matrix.tolist()}
    return {
        "name": name,
        "transforms": {**fields, "frames": [frame]},
        "points": points.tolist(),
        "pixels": pixels.reshape(-1, 2).tolist(),
    }


angle = 0.9
cases = [
    case("pinhole", dict(camera_model="PINHOLE", w=640, h=480, fl_x=614.7, fl_y=600.1, cx=318.2, cy=243.9),
         640, 480, 614.7, 600.1, 318.2, 243.9),
    case("opencv", dict(camera_model="OPENCV", w=1416, h=1064, fl_x=1103.2, fl_y=1104.9, cx=701.3, cy=540.8,
                        k1=-0.21, k2=0.07, p1=0.0011, p2=-0.0007),
         1416, 1064, 1103.2, 1104.9, 701.3, 540.8, -0.21, 0.07, 0.0011, -0.0007),
    case("opencv with k3", dict(w=640, h=480, fl_x=608.5, cx=320, cy=240, k1=0.139, k2=-0.35, k3=0.2),
         640, 480, 608.5, 608.5, 320, 240, 0.139, -0.35, 0, 0, 0.2),
    case("simple radial, corner lens", dict(camera_model="SIMPLE_RADIAL", w=640, h=480, fl_x=614.7142806307731, k1=0.08),
         640, 480, 614.7142806307731, 614.7142806307731, 320, 240, 0.08),
    case("field of view alone", dict(camera_angle_x=angle, w=800, h=600),
         800, 600, 400 / np.tan(angle / 2), 400 / np.tan(angle / 2), 400, 300),
]
print(json.dumps({"made_by": f"OpenCV {cv2.__version__}, tests/golden/projection/make.py", "cases": cases}))
