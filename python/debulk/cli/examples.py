"""What stands below every --help: examples, and the exit codes."""

from __future__ import annotations

EXAMPLES = {
    "": (
        "debulk demo -o out",
        "debulk inspect scan.pcd --reference ref.pcd --pose pose.txt -o layup.html",
        "debulk inspect --help",
    ),
    "inspect": (
        "debulk inspect scan.pcd --reference ref.pcd --pose pose.txt -o layup.html",
        "debulk inspect scan.ply --reference ref.ply --pose identity --angles=-45,45",
        "debulk inspect s.npy --reference r.npy --pose p.txt --json > layup.json",
    ),
    "demo": ("debulk demo", "debulk demo -o out --seed 3 --keep-files"),
    "page": (
        "debulk page layup.json -o layup.html",
        "debulk page ply1.json ply2.json -o stack.html",
        "debulk page before.json after.json --compare -o both.html",
    ),
    "qualify": (
        "debulk qualify scans/*.pcd --reference ref.pcd --pose pose.txt -o chain.json -o chain.html",
        "debulk inspect scan.pcd --reference ref.pcd --pose pose.txt --chain chain.json",
    ),
    "serve": (
        "debulk serve --reference ref.pcd --pose pose.txt --folder scans --history cell.sqlite",
        "debulk serve --pose pose.txt --folder scans --deadline 2 --port 9000",
        "debulk serve --folder scans --opcua opc.tcp://127.0.0.1:4840/ --nodeset Opc.Ua.MachineVision.NodeSet2.xml",
    ),
    "rework": ("debulk rework layup.json", "debulk rework layup.json --hold 168 -o plan.json"),
    "diff": ("debulk diff before.json after.json", "debulk diff cell.toml new.toml"),
    "checks": ("debulk checks", "debulk checks level"),
    "recipe": ("debulk recipe > cell.toml",),
    "compare": (
        "debulk compare layup.json debulked.pcd --reference ref.pcd --pose pose.txt",
        "debulk compare layup.json after.pcd --reference ref.pcd --pose p.txt -o after.html",
    ),
    "repeat": ("debulk repeat layup.json --scan scan.pcd --reference ref.pcd",),
    "view": ("debulk view layup.json", "debulk view layup.json --pocket 2 --png pocket.png"),
    "doctor": ("debulk doctor", "debulk doctor --json"),
    "completion": ('eval "$(debulk completion bash)"', "debulk completion zsh > ~/.zfunc/_debulk"),
    "calibrate": ("debulk calibrate cell.sqlite --recipe cell.toml --missed 50 -o proposed.toml",),
    "batch": (
        "debulk batch archive/ --recipe new.toml --history new.sqlite",
        "debulk batch archive/ --recipe new.toml --history new.sqlite --scheduler tcp://10.0.0.5:8786",
    ),
    "approve": ('debulk approve cell.toml --in approved.toml --by "A. Owner"',),
    "history": (
        "debulk history list cell.sqlite --part A-17 --verdict crease",
        "debulk history page cell.sqlite -o history.html",
    ),
    "history list": ("debulk history list cell.sqlite --near 350,-120 --within 80 --since 2026-03-01",),
    "history get": ("debulk history get cell.sqlite 17 -o layup.html",),
    "history add": ("debulk history add cell.sqlite archive/*.json",),
    "history outcome": ('debulk history outcome cell.sqlite 17 3 crease --by "A. Smith"',),
    "history export": (
        "debulk history export cell.sqlite -o layups.csv",
        "debulk history export cell.sqlite --table pocket --part A-17 -o pockets.parquet",
        "debulk history export cell.sqlite --part A-17 -o layups.dfq",
    ),
    "history page": ("debulk history page cell.sqlite --since 2026-03-01 -o history.html",),
    "history check": ("debulk history check cell.sqlite",),
    "scan": ("debulk scan left/ right/ --calibration cell.json -o scan.pcd", "debulk scan patterns patterns/"),
    "scan images": (
        "debulk scan left/ right/ --calibration cell.json -o scan.pcd",
        "debulk scan left/ right/ --calibration cell.json -o s.npy --picture s.png",
    ),
    "scan patterns": ("debulk scan patterns patterns/ --pixels 1920x1080 --periods 50,51",),
    "scan calibrate": (
        "debulk scan calibrate left/ right/ --squares 10x7 --square-mm 25 -o cell.json --picture boards.png",
        "debulk scan calibrate l/ r/ --squares 9x6 --square-mm 30 --charuco --marker-mm 22 -o c.json",
    ),
    "scan projector": ("debulk scan projector left/ right/ --calibration cell.json -o cell_projector.json",),
}
"""By command; each is tried by a test."""

_VERDICTS = "0 CEASE, 1 CREASE, 2 bad input, 3 INVALID, 4 UNDECIDED"
_CODES = {
    "": f"of inspect: {_VERDICTS}; of the others 0 or 2 unless their --help says more",
    "inspect": _VERDICTS,
    "demo": "0 done, whatever the verdict, 2 bad input, 3 INVALID",
    "compare": "0 no outcome was wrong, 1 one was, 2 bad input",
    "history check": "0 nothing was changed or is missing, 1 something, 2 bad input",
    "diff": "0 nothing differs, 1 something does, 2 bad input",
    "repeat": "0 all figures the same, 1 one differs, 2 bad input",
}


def epilog(command: str) -> str:
    """Return the examples and exit codes of a command, each in a paragraph."""
    codes = _CODES.get(command, "0 done, 2 bad input")
    return "\n\n".join(
        ["Examples:", *EXAMPLES[command], f"Exit codes: {codes}; 70 a fault of debulk's, 130 interrupted."]
    )
