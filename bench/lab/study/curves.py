"""Notes beside the points of a curve, placed so that none covers another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

# Offset in points from the mark, and alignment of the text there; the first free place is taken.
_PLACES = (
    (0, 6, "center", "bottom"),
    (0, -6, "center", "top"),
    (7, 0, "left", "center"),
    (-7, 0, "right", "center"),
    (6, 7, "left", "bottom"),
    (6, -7, "left", "top"),
    (-6, 7, "right", "bottom"),
    (-6, -7, "right", "top"),
    (0, 17, "center", "bottom"),
    (0, -17, "center", "top"),
    (0, 28, "center", "bottom"),
    (0, -28, "center", "top"),
)


@dataclass(frozen=True)
class Mark:
    """A point with its note."""

    x: float
    y: float
    note: str
    colour: str


def note_marks(figure: Any, panels: Sequence[tuple[Any, Sequence[Mark]]]) -> None:
    """Write the notes of all axes after everything is drawn. Marks that lie on one another share one note."""
    figure.draw_without_rendering()  # sets the final positions of the axes, which the layout engine moves
    for ax, marks in panels:
        _note(ax, marks, figure.canvas.get_renderer(), figure.dpi / 72)


def _note(ax: Any, marks: Sequence[Mark], renderer: Any, scale: float) -> None:
    groups: list[list[Mark]] = []
    points = [ax.transData.transform((m.x, m.y)) for m in marks]
    for mark, point in zip(marks, points, strict=True):
        for group in groups:
            first = ax.transData.transform((group[0].x, group[0].y))
            if mark.colour == group[0].colour and max(abs(point - first)) < 5 * scale:
                group.append(mark)
                break
        else:
            groups.append([mark])
    from matplotlib.transforms import Bbox

    taken = [Bbox.from_extents(*(p - 3 * scale), *(p + 3 * scale)) for p in points]
    inside = ax.get_window_extent(renderer)
    for group in groups:
        notes = list(dict.fromkeys(m.note for m in group))
        note = notes[0] if len(notes) == 1 else f"{notes[0]} … {notes[-1]}" if len(notes) > 2 else ", ".join(notes)
        best = None
        for dx, dy, across, up in _PLACES:
            text = ax.annotate(
                note,
                (group[0].x, group[0].y),
                xytext=(dx, dy),
                textcoords="offset points",
                ha=across,
                va=up,
                fontsize=7.5,
                color=group[0].colour,
                annotation_clip=False,
            )
            text.set_in_layout(False)
            box = text.get_window_extent(renderer)
            hits = sum(box.overlaps(other) for other in taken)
            out = not (
                inside.x0 - 20 <= box.x0
                and box.x1 <= inside.x1 + 40
                and inside.y0 <= box.y0
                and box.y1 <= inside.y1 + 8
            )
            cost = hits + 3 * out
            if best is None or cost < best[0]:
                if best is not None:
                    best[1].remove()
                best = (cost, text, box)
            else:
                text.remove()
            if cost == 0:
                break
        assert best is not None
        taken.append(best[2])
