/* What the functors share: vectors as plain reals, what is in the scene, and errors in YADE's parallel loop.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include "abi.h"
#include <core/Interaction.hpp>
#include <core/InteractionLoop.hpp>
#include <core/Scene.hpp>
#include <pkg/common/Sphere.hpp>
#include <iostream>

namespace yade {

inline void put(double* to, const Vector3r& from)
{
	for (int k = 0; k < 3; k++)
		to[k] = from[k];
}
inline Vector3r read(const double* from) { return Vector3r(from[0], from[1], from[2]); }

inline Real mean(Real one, Real two) { return 0.5 * (one + two); }

inline bool isBall(Scene* scene, Body::id_t id) { return dynamic_cast<const Sphere*>(Body::byId(id, scene)->shape.get()); }

/* A text that the library writes its reasons into. */
struct Reason {
	char             text[2048] = { 0 };
	ConcordemMessage message    = { text, sizeof(text) };
	operator const ConcordemMessage*() const { return &message; }
};

/* What InteractionLoop answers contacts with. */
struct LawsOfScene {
	bool ours       = false; // the law asked for
	bool frictional = false; // a law that takes FrictPhys
};

template <class Law> LawsOfScene lawsOf(const Scene& scene)
{
	LawsOfScene found;
	for (const auto& engine : scene.engines) {
		const auto* loop = dynamic_cast<const InteractionLoop*>(engine.get());
		if (!loop) continue;
		for (const auto& law : loop->lawDispatcher->functors) {
			if (dynamic_cast<const Law*>(law.get())) found.ours = true;
			const string physics = law->get2DFunctorType2();
			if (physics == "FrictPhys" || physics == "NormShearPhys" || physics == "NormPhys" || physics == "IPhys") found.frictional = true;
		}
	}
	return found;
}

/* An exception must not leave YADE's parallel loop: the run is stopped after this step, with the reason in `error`. Every time: a run
   that is begun again although nothing was put right must not go on. */
inline void stopRun(Scene& scene, const char* functor, string& error, const Interaction& I, const string& reason)
{
#pragma omp critical(concordem_error)
	{
		if (error.empty()) {
			error = "contact of bodies " + std::to_string(I.id1) + " and " + std::to_string(I.id2) + " at iteration " + std::to_string(scene.iter)
			        + ": " + reason;
			std::cerr << functor << " stops the run: " << error << std::endl;
		}
		scene.stopAtIter = scene.iter + 1;
	}
}

/* Stop the run after this step, for a reason that has been told. */
inline void stopAgain(Scene& scene)
{
#pragma omp critical(concordem_error)
	scene.stopAtIter = scene.iter + 1;
}

/* A contact must have physics. That of one that could not be made (`refLength` < 0) is refused by its law in every step, also where
   InteractionLoop has no such law; why is in the `error` of the functor that was to make it. */
template <class Law, class Physics> void refuseAlways(Scene* scene, Interaction& I, const shared_ptr<Physics>& physics)
{
	physics->refLength = -1;
	I.phys             = physics;
	const shared_ptr<Law> law(new Law);
	law->scene               = scene;
	I.functorCache.constLaw = law;
}

} // namespace yade
