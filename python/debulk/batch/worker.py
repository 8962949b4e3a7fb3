"""What a worker does with one layup: read its files, inspect it, and give the report back as text."""

from __future__ import annotations

from typing import Any

import numpy as np

from debulk._core import InputError
from debulk.batch.archive import Layup


def inspected(layup: Layup, recipe: dict[str, Any], build: str) -> tuple[bytes, str]:
    """Return the report as JSON, and an empty text; or nothing, and what was wrong."""
    from debulk import files
    from debulk.build import build_id
    from debulk.inspection.inspector import Inspector
    from debulk.recipe import Recipe
    from debulk.results import codec
    from debulk.results.report import FORMAT

    if build_id() != build:
        return b"", f"the worker runs build {build_id()}, the client {build}: install the same debulk on both"

    def of(name: str) -> Any:
        path = getattr(layup, name)
        return None if path is None else layup.folder / path

    try:
        outline, mask, pose = of("outline"), of("mask"), of("pose")
        inspector = Inspector(
            Recipe(**recipe),
            files.load_cloud(of("reference"), layup.unit),
            outline and files.load_outline(outline, layup.in_frame, layup.outline_layer),
            layup.angles_deg,
            np.eye(4) if str(layup.pose) == "identity" else pose and files.load_pose(pose, layup.in_frame),
            layup.camera,
            None if mask is None else files.load_mask(mask),
        )
        measured = of("measured_angles")
        angles = None if measured is None else files.load_angles(measured, layup.in_frame)
        scan = files.load_cloud(of("scan"), layup.unit)
        report = inspector.inspect(scan, context=layup.context, fibre_angles_deg=angles)
    except (InputError, OSError) as error:
        return b"", str(error)
    return codec.dumps(report, FORMAT).encode("utf-8", "backslashreplace"), ""
