"""Why a request is refused: one sentence, and the status of HTTP that says of what kind it is."""

from __future__ import annotations

from debulk import InputError


class Refusal(InputError):
    """A request that is not carried out: why, its status of HTTP, and after how many seconds to try again, if ever."""

    def __init__(self, status: int, reason: str, retry_after_s: float | None = None) -> None:
        super().__init__(reason)
        self.status = status
        self.retry_after_s = retry_after_s
