"""Qualification of the chain that measures: scanner, filters and export; see docs/qualification.md.

`debulk.qualify` makes a `Chain` of at least ten scans of one unmoved layup; an `Inspector` that is given it compares
the signature of every scan with it.
"""

from __future__ import annotations

from debulk.chain.gauge import Gauge
from debulk.chain.recognise import recognised
from debulk.chain.record import Chain, Figure
from debulk.chain.signature import Signature

__all__ = ["Chain", "Figure", "Gauge", "Signature", "recognised"]
