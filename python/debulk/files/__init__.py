"""Files in and out: clouds, masks, poses, outlines. No file is trusted, and a bad one gives one clear error."""

from __future__ import annotations

from debulk.files.loading import Unit, load_cloud, load_mask, load_outline, load_pose, save_cloud
from debulk.files.replacing import replacing

__all__ = ["Unit", "load_cloud", "load_mask", "load_outline", "load_pose", "replacing", "save_cloud"]
