"""A report in 3-D, drawn by Open3D (the extra "view"), in a window that the mouse turns or as a picture."""

from __future__ import annotations

from debulk.view.drawing import view
from debulk.view.shapes import Lines, Shapes, shapes

__all__ = ["Lines", "Shapes", "shapes", "view"]
