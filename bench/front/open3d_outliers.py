"""Run Open3D's outlier removal on a scan written by make_scene.py and print JSON; 20 million points take 30 s.

Needs the extra `view`.

open3d_outliers.py STEM WIDTH HEIGHT
"""

import json
import sys
import time

import numpy as np
import open3d

import debulk.cloud

stem, width, height = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
points = np.fromfile(f"{stem}.scan", dtype=np.float32).reshape(-1, 3)
seen = np.isfinite(points).all(axis=1)
cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points[seen].astype(np.float64)))
began = time.perf_counter()
_, kept = cloud.remove_statistical_outlier(nb_neighbors=5, std_ratio=1.0)
passed = time.perf_counter() - began
theirs = np.zeros(len(points), dtype=bool)
theirs[np.flatnonzero(seen)[np.asarray(kept)]] = True
ours = debulk.cloud.remove_outliers(points.reshape(height, width, 3)).reshape(-1)
print(
    json.dumps(
        {
            "version": open3d.__version__,
            "seconds": passed,
            "points": int(seen.sum()),
            "removed": int(seen.sum() - theirs.sum()),
            "different": int(np.count_nonzero(theirs != ours)),
        }
    )
)
