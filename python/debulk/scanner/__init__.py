"""The scanner: from the fringe images of two cameras to the organised cloud.

A projector shows fringes with two or more numbers of periods that are close together, and two cameras record them.
`fringe_patterns` makes the images for the projector, `decode` turns a camera's images into absolute phases, and
`triangulate` turns two phases into points. `Scanner` does all that cycle after cycle with everything prepared, also
while the images arrive.
`calibrate` determines the cameras from images of a board, `calibrate_projector` the projector from scans, and
`register` the position of the mold.
"""

from __future__ import annotations

from debulk.scanner.arriving import Arriving
from debulk.scanner.board import Board
from debulk.scanner.board_places import BoardPlace
from debulk.scanner.calibrate import UncertainCalibration, calibrate
from debulk.scanner.calibrate_projector import calibrate_projector
from debulk.scanner.calibration import Calibration
from debulk.scanner.calibration_picture import calibration_picture
from debulk.scanner.certainty import Certainty
from debulk.scanner.decode import Phase, decode
from debulk.scanner.decode_gray import decode_gray
from debulk.scanner.gray_patterns import gray_patterns
from debulk.scanner.patterns import fringe_patterns
from debulk.scanner.picture import picture
from debulk.scanner.projector import Projector
from debulk.scanner.register import Registration, register
from debulk.scanner.scanner import ScanCancelled, Scanner, ScanTooLate
from debulk.scanner.triangulate import Scan, match, triangulate

__all__ = [
    "Arriving",
    "Board",
    "BoardPlace",
    "Calibration",
    "Certainty",
    "Phase",
    "Projector",
    "Registration",
    "Scan",
    "ScanCancelled",
    "ScanTooLate",
    "Scanner",
    "UncertainCalibration",
    "calibrate",
    "calibrate_projector",
    "calibration_picture",
    "decode",
    "decode_gray",
    "fringe_patterns",
    "gray_patterns",
    "match",
    "picture",
    "register",
    "triangulate",
]
