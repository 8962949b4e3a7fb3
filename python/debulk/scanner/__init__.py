"""The scanner: from the fringe images of two cameras to the organised cloud.

A projector shows fringes at two or more close numbers of periods; two cameras look on. `fringe_patterns` makes what the
projector shows, `decode` turns a camera's images into absolute phases, `triangulate` two phases into points. `Scanner`
does all that cycle after cycle with everything prepared. `calibrate` finds the cameras from images of a board,
`calibrate_projector` the projector from scans, `register` where the mold lies.
"""

from __future__ import annotations

from debulk.scanner.board import Board
from debulk.scanner.calibrate import calibrate
from debulk.scanner.calibrate_projector import calibrate_projector
from debulk.scanner.calibration import Calibration
from debulk.scanner.decode import Phase, decode
from debulk.scanner.patterns import fringe_patterns
from debulk.scanner.picture import picture
from debulk.scanner.projector import Projector
from debulk.scanner.register import Registration, register
from debulk.scanner.scanner import ScanCancelled, Scanner, ScanTooLate
from debulk.scanner.triangulate import Scan, match, triangulate

__all__ = [
    "Board",
    "Calibration",
    "Phase",
    "Projector",
    "Registration",
    "Scan",
    "ScanCancelled",
    "ScanTooLate",
    "Scanner",
    "calibrate",
    "calibrate_projector",
    "decode",
    "fringe_patterns",
    "match",
    "picture",
    "register",
    "triangulate",
]
