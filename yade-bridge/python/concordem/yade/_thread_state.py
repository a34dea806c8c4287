"""Keeps Python's state of the thread that runs YADE's loop.

YADE enters Python for each call of a PyRunner and leaves it afterwards. `O.run` starts a thread that Python does not know, so each time
Python makes a state for it (an mmap of 16 KB, cleared by the kernel) and deletes it: 13 µs per step (measured). One unmatched
`PyGILState_Ensure` keeps that state.

The state outlives the thread, 20 KB. The next thread that is kept deletes it; from Python 3.12 on, it stays: there, the deletion would
take away the state of the thread that deletes. Therefore it keeps only threads of long runs.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading

#: From this version of Python on, states of ended threads stay.
_STAYS = (3, 12)
#: Steps of a thread before its state is kept.
WORTH = 16 if sys.version_info < _STAYS else 1000
#: Native id and steps of the thread that was here last; its state may be kept.
_last, _steps = 0, 0
#: Native ids and states of the threads that are kept.
_kept: list[tuple[int, int]] = []
# In a process that a fork has made, Python has deleted the states of other threads.
os.register_at_fork(after_in_child=_kept.clear)


def keep() -> None:
    """Keep the state of this thread; called in every step, with the interpreter's lock."""
    global _last, _steps
    this = threading.get_native_id()
    if this != _last:
        _last, _steps = this, 0
    _steps += 1
    if _steps != WORTH:
        return
    _delete_of_ended_threads()
    api = ctypes.pythonapi
    api.PyThreadState_Get.restype = ctypes.c_void_p
    api.PyGILState_Ensure()
    _kept.append((this, api.PyThreadState_Get()))


def _delete_of_ended_threads() -> None:
    """Delete the kept states of threads that have ended. A thread with the id of an ended one only delays that."""
    if sys.version_info >= _STAYS:
        return
    api = ctypes.pythonapi
    for entry in list(_kept):
        thread, state = entry
        if not os.path.exists(f"/proc/self/task/{thread}"):
            api.PyThreadState_Clear(ctypes.c_void_p(state))
            api.PyThreadState_Delete(ctypes.c_void_p(state))
            _kept.remove(entry)
