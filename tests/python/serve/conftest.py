"""Services for the tests."""

import pytest

from cells import Running


@pytest.fixture
def running(tmp_path):
    """Return a function that starts a service; all are stopped at the end."""
    started = []

    def start(**settings):
        started.append(Running(tmp_path, **settings))
        return started[-1]

    yield start
    for one in started:
        if one.thread.is_alive():
            one.stop()
