"""A minimal test runner, because YADE's Python has no pytest. Every test starts with a new scene."""

import sys
import time
import traceback


def main(namespace):
    """Run every function test_* and tell how long each took; if all pass, print a line that run.sh looks for."""
    failed = 0
    for name, function in list(namespace.items()):
        if not name.startswith("test_") or not callable(function):
            continue
        started = time.perf_counter()
        try:
            function()
            print("ok", name, f"{time.perf_counter() - started:.1f} s")
        except Exception:
            failed += 1
            print("FAILED", name)
            traceback.print_exc()
    sys.stdout.flush()
    if failed:
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
