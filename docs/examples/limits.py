"""Limits and material of your own, and what they change: one layup, three recipes."""

import debulk

layup = debulk.scenes.layup(seed=2, pixels=(640, 480))

strict = debulk.Recipe(verdict={"max_ridge_mm": 0.4})
as_the_paper = debulk.Recipe(verdict={"criterion": "paper"})
found = {}
for name, recipe in [("default", debulk.Recipe()), ("strict", strict), ("paper", as_the_paper)]:
    report = debulk.inspect(
        layup.scan, layup.reference, recipe, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner
    )
    found[name] = verdicts = [p.verdict.name for p in report.pockets]
    print(f"{name:>8}: {report.verdict.name},", *(f"{verdicts.count(v)} {v}" for v in sorted(set(verdicts))))
