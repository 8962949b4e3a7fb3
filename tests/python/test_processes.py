"""Processes that fork, end, or hold several interpreters while debulk works: nothing hangs, and nothing crashes."""

import linecache
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from debulk import _core
from debulk.forking import Guard, kept
from debulk.workers import Workers

pytestmark = pytest.mark.program

LONG_S = 120  # what would hang is stopped here

START = """
import atexit, os, sys, threading, time
import debulk
layup = debulk.scenes.layup(seed=4, pixels=(200, 150))
recipe = debulk.Recipe(segmentation={"area_tol_mm2": 8000.0}, solve={"starts": 1})
inspector = debulk.Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
def same(report, other):
    return report.reason == other.reason and all(
        a.debulked_mm is None or a.debulked_mm.tobytes() == b.debulked_mm.tobytes()
        for a, b in zip(report.pockets, other.pockets, strict=True))
def ended(child):
    late = time.monotonic() + 60
    while time.monotonic() < late:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(child, 9)
    os.waitpid(child, 0)
    return "hangs"
"""

FORKED = """
alone = inspector.inspect(layup.scan)
assert any(pocket.debulked_mm is not None for pocket in alone.pockets)
reached, wanted, over = threading.Event(), [""], []
def run():
    while not over:
        inspector.inspect(layup.scan, progress=lambda stage, done: reached.set() if stage == wanted[0] else None)
thread = threading.Thread(target=run)
thread.start()
for stage, way in (("level", 0), ("height map", 0), ("height map", 1), ("debulk", 1), ("report", 0)):
    wanted[0] = stage
    reached.clear()
    reached.wait()
    child = os.fork()
    if child == 0:
        over.append(True)
        code = 0 if same(inspector.inspect(layup.scan), alone) else 3
        os._exit(code) if way else sys.exit(code)
    print(stage, ended(child))
over.append(True)
thread.join()
"""

IPOPT = """
from debulk.doctor import _pocket_sheet
sheet = _pocket_sheet()
alone = debulk.solve.minimise(sheet, method="ipopt")
began, stop = threading.Event(), debulk._core.Stop()
def run():
    began.set()
    debulk.solve.minimise(sheet, method="ipopt", starts=1000, stop=stop)
thread = threading.Thread(target=run)
thread.start()
began.wait()
for k in range(2):
    time.sleep(0.05)
    child = os.fork()
    if child == 0:
        os._exit(0 if debulk.solve.minimise(sheet, method="ipopt").energy_mj == alone.energy_mj else 3)
    print("ipopt", ended(child))
stop.cancel()
thread.join()
"""

EXIT = """
kind = sys.argv[1]
began = threading.Event()
def inspect():
    try:
        report = inspector.inspect(layup.scan, progress=lambda *_: began.set())
        print("whole" if report.pockets else "nothing", flush=True)
    except (debulk.Cancelled, RuntimeError) as error:
        print(type(error).__name__, flush=True)
        raise SystemExit from None
def for_ever():
    while True:
        inspect()
if kind == "atexit":
    atexit.register(inspect)
else:
    threading.Thread(target=for_ever if kind == "loop" else inspect, daemon=kind != "thread").start()
    began.wait()
"""

AHEAD = """
stack = debulk.Stack(recipe, layup.reference, mold_from_scanner=layup.mold_from_scanner)
stack.lay_ahead(layup.ply_outline)
child = os.fork()
if child == 0:
    os._exit(0 if same(stack.inspect(layup.scan), inspector.inspect(layup.scan)) else 3)
print("forked", ended(child), len(stack.plies))
stack.cancel()
stack.lay_ahead(layup.ply_outline)
time.sleep(float(sys.argv[1]))
print(stack._ahead._thread.is_alive())
"""

OTHER = """
import sys
try:
    import _interpreters
    makers = [lambda: _interpreters.create("legacy"), lambda: _interpreters.create("isolated")]
except ImportError:
    import _xxsubinterpreters as _interpreters
    makers = [lambda: _interpreters.create(isolated=False), lambda: _interpreters.create()]
script = '''
import sys
sys.path[:0] = %r
try:
    import debulk
except ImportError as error:
    print(error, flush=True)
''' % [entry for entry in sys.path if entry]
def refused():
    for make in makers:
        _interpreters.run_string(make(), script)
if "first" in sys.argv:
    refused()
import debulk
refused()
print(debulk.ridge.ridge_height(18.6, 18.0, 0.3) > 0)
"""


def run(script, *arguments):
    """What a Python program of its own prints, line by line."""
    command = [sys.executable, "-W", "ignore::DeprecationWarning", "-c", script, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LONG_S)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_a_child_forked_while_a_thread_inspects_inspects_too():
    stages = ["level", "height map", "height map", "debulk", "report"]
    assert run(START + FORKED) == [f"{stage} 0" for stage in stages]


def test_a_child_forked_while_ipopt_solves_solves_too():
    assert run(START + IPOPT) == ["ipopt 0"] * 2


@pytest.mark.parametrize("after_s", ["0", "0.05"])
def test_a_ply_laid_ahead_is_prepared_in_the_child_and_holds_up_no_end(after_s):
    assert run(START + AHEAD, after_s) == ["forked 0 0", "True"]


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_lock_that_another_thread_held_is_open_in_the_child_and_torn():
    free, locked = Guard(), Guard()
    holding, done = threading.Event(), threading.Event()

    def hold():
        with locked.held():
            holding.set()
            done.wait()

    thread = threading.Thread(target=hold)
    thread.start()
    holding.wait()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            with free.held(), locked.held():
                code = 0 if (free.torn, locked.torn) == (False, True) else 2
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    done.set()
    thread.join()
    assert not locked.torn  # in the parent


@pytest.mark.parametrize(
    ("kind", "says"), [("thread", "whole"), ("atexit", "whole"), ("daemon", "Cancelled"), ("loop", "Cancelled")]
)
def test_at_the_exit_threads_are_waited_for_and_daemons_are_cancelled(kind, says):
    assert run(START + EXIT, kind) in ([says], ["whole", says])  # one may have been finished before


@pytest.mark.parametrize("order", ["first", "later"])
def test_other_interpreters_are_refused_by_name(order):
    if sys.version_info < (3, 13):
        pytest.importorskip("_xxsubinterpreters")
    else:
        pytest.importorskip("_interpreters")
    *refusals, works = run(OTHER, order)
    assert works == "True"
    assert len(refusals) == (4 if order == "first" else 2)
    for refusal in refusals:
        assert "debulk" in refusal and "subinterpreter" in refusal


def test_workers_do_what_an_executor_does():
    with Workers(2, name="mine") as workers:
        assert list(workers.map(divmod, range(9), [4] * 9)) == [divmod(k, 4) for k in range(9)]
        names = {workers.submit(lambda: threading.current_thread().name).result() for _ in range(9)}
        assert names <= {"mine_0", "mine_1"}
        with pytest.raises(ZeroDivisionError):
            workers.submit(divmod, 1, 0).result()
    with pytest.raises(RuntimeError, match="told to end"):
        workers.submit(divmod, 1, 1)


class CtrlC:
    """A trace function that sends Ctrl-C to the main thread at the n-th line that it runs in a few modules."""

    def __init__(self, at):
        self.at, self.lines = at, 0

    def __call__(self, frame, _event, _argument):
        return self.line if frame.f_code.co_filename.endswith(("workers.py", "threading.py")) else None

    def line(self, frame, event, _argument):
        text = linecache.getline(frame.f_code.co_filename, frame.f_lineno).lstrip()
        if event == "line" and not text.startswith("with "):  # where a real signal is not looked at
            self.lines += 1
            if self.lines == self.at:
                signal.raise_signal(signal.SIGINT)
        return self.line


def help_out(trace, stop):
    """Let two threads work until they are told to end, and return how the call ended."""
    done = []

    def work():
        while not done and not stop.cancelled:
            time.sleep(0.001)

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        with Workers(2, stop) as pool:
            runs = [pool.submit(work) for _ in range(2)]
            done.append(True)
            runs[0].result()
    except (KeyboardInterrupt, RuntimeError) as error:  # the latter from within threading, about its own locks
        return type(error).__name__
    finally:
        sys.settrace(before)
    return "ended"


@pytest.mark.usefixtures("ctrl_c")
def test_no_ctrl_c_leaves_a_thread_behind(monkeypatch):
    ignored = []
    monkeypatch.setattr(sys, "unraisablehook", ignored.append)  # Ctrl-C in a finalizer
    whole = CtrlC(at=0)
    assert help_out(whole, _core.Stop()) == "ended"
    assert whole.lines > 100
    ends = set()
    for at in range(1, whole.lines + 1):
        before = set(threading.enumerate())
        ends.add(help_out(CtrlC(at), _core.Stop()))
        for thread in set(threading.enumerate()) - before:
            thread.join(5.0)  # one that its owner could not wait for ends by itself
            assert not thread.is_alive(), f"Ctrl-C at line {at}"
    assert "KeyboardInterrupt" in ends


def test_a_kept_value_is_computed_once_and_belongs_to_its_object():
    class Counted:
        made = 0

        @kept
        def number(self):
            Counted.made += 1
            return Counted.made

    one, two = Counted(), Counted()
    assert (one.number, two.number, one.number, two.number) == (1, 2, 1, 2)
