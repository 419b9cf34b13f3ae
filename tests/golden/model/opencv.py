"""Makes projections.json: where OpenCV puts points in images, with its derivatives.

    python opencv.py > projections.json

Made with opencv-python-headless and numpy by cv2.projectPoints. OpenCV's
camera looks along +z with y down; the program's along -z with y up. The Jacobian's columns that are
stored: focal length (both of OpenCV's together), cx, cy, k1, k2.
"""
import json

import cv2
import numpy as np

random = np.random.default_rng(11)
turn = np.diag([1.0, -1.0, -1.0])
cases = []
for f, cx, cy, k1, k2 in [(820.0, 640.0, 480.0, 0.0, 0.0), (1103.2, 701.3, 540.8, -0.21, 0.07),
                          (614.7, 318.2, 243.9, 0.08, -0.02)]:
    rotation = cv2.Rodrigues(random.normal(size=3))[0]
    position = random.normal(size=3) * 3
    u = random.uniform(-0.5, 0.5, (30, 2))
    depth = random.uniform(0.5, 9, 30)
    local = np.concatenate([u, np.ones((30, 1))], 1) * depth[:, None]
    points = local @ turn @ rotation.T + position
    cv = turn @ rotation.T
    matrix, lens = np.array([[f, 0, cx], [0, f, cy], [0, 0, 1.0]]), np.array([k1, k2, 0, 0], float)
    pixels, jacobian = cv2.projectPoints(points, cv2.Rodrigues(cv)[0], -cv @ position, matrix, lens)
    columns = np.stack([jacobian[:, 6] + jacobian[:, 7], jacobian[:, 8], jacobian[:, 9],
                        jacobian[:, 10], jacobian[:, 11]], 1)
    cases.append({"lens": [f, cx, cy, k1, k2], "rotation": rotation.ravel().tolist(), "position": position.tolist(),
                  "points": points.tolist(), "pixels": pixels.reshape(-1, 2).tolist(),
                  "undistorted": u.tolist(), "by_lens": columns.reshape(30, 2, 5).tolist()})
print(json.dumps({"made_by": f"OpenCV {cv2.__version__}, tests/golden/model/opencv.py", "cases": cases},
                 separators=(",", ":")))
