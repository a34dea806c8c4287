/* What the functors share: vectors as plain reals, and errors in YADE's parallel loop.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include <core/Interaction.hpp>
#include <core/Scene.hpp>
#include <iostream>

namespace yade {

inline void put(double* to, const Vector3r& from)
{
	for (int k = 0; k < 3; k++)
		to[k] = from[k];
}
inline Vector3r read(const double* from) { return Vector3r(from[0], from[1], from[2]); }

/* An exception must not leave YADE's parallel loop: the run is stopped after this step, with the reason in `error`. */
inline void stopRun(Scene& scene, const char* functor, string& error, const Interaction& I, const string& reason)
{
#pragma omp critical(concordem_error)
	if (error.empty()) {
		error = "contact of bodies " + std::to_string(I.id1) + " and " + std::to_string(I.id2) + " at iteration " + std::to_string(scene.iter) + ": "
		        + reason;
		std::cerr << functor << " stops the run: " << error << std::endl;
		scene.stopAtIter = scene.iter + 1;
	}
}

} // namespace yade
