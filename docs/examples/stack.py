"""A layup of several plies: the reference of each is the scan of the ply before it, after its vacuum."""

import debulk

layup = debulk.scenes.layup(seed=1, pixels=(640, 480))  # in place of the scanner
frame = dict(ply_outline=layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)

below = layup.reference  # the bare mold
reports = []
for ply, (scan, after_vacuum) in enumerate([(layup.scan, layup.debulked().scan)], start=1):
    inspector = debulk.Inspector(None, below, fibre_angles_deg=(0, 90) if ply % 2 else (45, 135), **frame)
    reports.append(inspector.inspect(scan, context={"ply": ply}))
    print(ply, reports[-1].verdict.name, reports[-1].reason)

    # What became of it, measured; then it is the next ply's reference.
    print(inspector.compare(reports[-1], after_vacuum).table())
    below = after_vacuum
