"""Why a request is refused: one sentence, and the status of HTTP that says of what kind it is."""

from __future__ import annotations

from debulk import InputError

__all__ = ["Refusal"]


class Refusal(InputError):
    """A request that is not carried out.

    Parameters
    ----------
    status
        Status of HTTP, such as 404.
    reason
        What was wrong, and what to do.
    retry_after_s
        When it may be tried again, seconds; None if trying again does not help.
    """

    def __init__(self, status: int, reason: str, retry_after_s: float | None = None) -> None:
        super().__init__(reason)
        self.status = status
        self.retry_after_s = retry_after_s
