"""Fleiss's kappa: how well several judgements of the same things agree, beyond what chance would give."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence


def fleiss(ratings: Sequence[Sequence[Hashable]]) -> float | None:
    """Return kappa of N things that were each judged n times, n from 2; None if all judgements are the same.

    J. L. Fleiss, Measuring nominal scale agreement among many raters, Psychological Bulletin 76 (1971) 378.

    Examples
    --------
    >>> fleiss([("cease", "cease"), ("crease", "crease")])
    1.0
    >>> fleiss([("cease", "crease"), ("crease", "cease")])
    -1.0
    """
    counts = [Counter(one) for one in ratings]
    each, total = len(ratings[0]), sum(len(one) for one in ratings)
    observed = sum(sum(n * (n - 1) for n in one.values()) for one in counts) / (len(ratings) * each * (each - 1))
    shares = sum(counts, Counter())
    by_chance = sum((n / total) ** 2 for n in shares.values())
    return None if by_chance == 1 else float((observed - by_chance) / (1 - by_chance))
