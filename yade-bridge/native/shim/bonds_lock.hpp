/* The lock of the bonds of an engine.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include <Python.h>
#include <mutex>

namespace yade {

/* Holds the mutex of the bonds: YADE's background thread changes them in its steps, and Python's threads read them. A thread that waits
   releases Python's lock meanwhile, because the step it waits for may need that lock for its checks. */
class BondsLock {
	std::unique_lock<std::recursive_mutex> held;

public:
	explicit BondsLock(std::recursive_mutex& mutex)
	        : held(mutex, std::try_to_lock)
	{
		if (held.owns_lock()) return;
		PyThreadState* python = PyGILState_Check() ? PyEval_SaveThread() : nullptr;
		held.lock();
		if (python) PyEval_RestoreThread(python);
	}
};

} // namespace yade
