"""How a verdict is shown: a sign, and a colour that colour-blind people can distinguish."""

from __future__ import annotations

from debulk.verdict import Verdict

# Colours of Okabe and Ito.
VERDICT_COLOURS = {
    Verdict.CEASE: "#009e73",
    Verdict.UNDECIDED: "#e69f00",
    Verdict.CREASE: "#d55e00",
    Verdict.INVALID: "#808080",
}
VERDICT_SIGNS = {Verdict.CEASE: "✓", Verdict.UNDECIDED: "?", Verdict.CREASE: "✕", Verdict.INVALID: "∅"}
