"""A cell's cycle: prepared once, a deadline, a record, and one action for every verdict."""

import json
import tempfile
from pathlib import Path

import debulk
from debulk import Verdict

ACTIONS = {
    Verdict.CEASE: "draw the vacuum",
    Verdict.CREASE: "smooth the named pockets and scan again",
    Verdict.UNDECIDED: "smooth, or ask a person",
    Verdict.INVALID: "scan again",
}

layup = debulk.scenes.layup(seed=3, pixels=(640, 480))  # in place of your scanner
folder = Path(tempfile.mkdtemp())

# When the part is set up, once:
inspector = debulk.Inspector(
    None, layup.reference, layup.ply_outline, fibre_angles_deg=(0, 90), mold_from_scanner=layup.mold_from_scanner
)
inspector.save(folder / "part_17.npz")

# When the program starts:
inspector = debulk.Inspector.load(folder / "part_17.npz")

# For every scan:
report = inspector.inspect(layup.scan, deadline_s=5.0, context={"part": "A-17", "ply": 3})
print(report.verdict.name, "-", ACTIONS[report.verdict])
for pocket in report.pockets:
    if pocket.verdict is not Verdict.CEASE:
        x, y = pocket.centroid_mm
        print(f"  pocket {pocket.id} at ({x:.0f}, {y:.0f}) mm: {pocket.reason}")
report.save(folder / "ply_3.json")

kept = json.loads((folder / "ply_3.json").read_text())
assert kept["verdict"] == report.verdict.value and kept["trace"]["context"] == {"part": "A-17", "ply": 3}
