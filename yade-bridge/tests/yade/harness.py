"""A minimal test runner, because YADE's Python has no pytest. Every test starts with a new scene."""

import os
import sys
import time
import traceback


def on_two_threads(function):
    """Mark a test whose claim depends on the threads of YADE: it runs at -j1 and at -j2, the others at -j1 alone."""
    function.threads = (1, 2)
    return function


def on_two_threads_only(function):
    """Mark a test that claims nothing at -j1."""
    function.threads = (2,)
    return function


def main(namespace):
    """Run the functions test_* for this number of threads (with CONCORDEM_TEST_FULL, all) and tell how long each took, and for how long it
    held a processor; if all pass, print a line that run.sh looks for."""
    from yade import O

    failed = ran = 0
    for name, function in list(namespace.items()):
        if not name.startswith("test_") or not callable(function):
            continue
        if O.numThreads not in getattr(function, "threads", (1,)) and not os.environ.get("CONCORDEM_TEST_FULL"):
            continue
        ran += 1
        started, used = time.perf_counter(), os.times()
        try:
            function()
            used = sum(os.times()[:4]) - sum(used[:4])
            print("ok", name, f"{time.perf_counter() - started:.1f} s, of a processor {used:.1f} s")
        except Exception:
            failed += 1
            print("FAILED", name)
            traceback.print_exc()
    sys.stdout.flush()
    if failed or not ran:
        print(f"{failed} of {ran} tests failed")
        sys.exit(1)
    print("ALL TESTS PASSED")
    sys.stdout.flush()


class raises:
    """Check that a block raises an error whose message contains `text`."""

    def __init__(self, kind, text=""):
        self.kind, self.text, self.value = kind, text, None

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        assert kind is not None, "nothing was raised"
        self.value = value
        if not issubclass(kind, self.kind):
            return False
        assert self.text in str(value), f"{self.text!r} is not in {value}"
        return True
