"""Files in and out: clouds, masks, poses, outlines, angles. No file is trusted; a bad one gives one clear error."""

from __future__ import annotations

from debulk.files.angles import load_angles
from debulk.files.clouds import CloudWarning, load_cloud, save_cloud
from debulk.files.heights import load_heights
from debulk.files.mask import load_mask
from debulk.files.outline import load_outline
from debulk.files.pose import load_pose
from debulk.files.replacing import replacing
from debulk.files.units import Unit

__all__ = [
    "CloudWarning",
    "Unit",
    "load_angles",
    "load_cloud",
    "load_heights",
    "load_mask",
    "load_outline",
    "load_pose",
    "replacing",
    "save_cloud",
]
