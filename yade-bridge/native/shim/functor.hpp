/* Common parts of the functors: vectors as plain reals, motion and forces of bodies, energies, errors in YADE's parallel loop, and the
   adapters that create and step a bond. For the adapters, a bond law defines
     its Ip2 functor:  look()                        once per step: read what it needs from the scene
                       make(I, one, two, phys)       set the parameters of a bond; returns an error message, or an empty string
     its Law2 functor: fill(contact, phys, I)        what the library reads; the reason if this is not possible
                       compute(contact)              the library's function
                       store(contact, outcome, phys) the history; the reason if the step failed
                       show(contact, phys)           attributes that only scripts read

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include "abi.h"
#include <core/EnergyTracker.hpp>
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
inline void put(vector<Real>& to, const Vector3r& v)
{
	for (int k = 0; k < 3; k++)
		to.push_back(v[k]);
}
inline void put(double* to, const Matrix3r& m)
{
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			to[3 * i + j] = m(i, j);
}
inline Vector3r read(const double* from) { return Vector3r(from[0], from[1], from[2]); }

inline Real mean(Real one, Real two) { return 0.5 * (one + two); }

inline bool isBall(Scene* scene, Body::id_t id) { return dynamic_cast<const Sphere*>(Body::byId(id, scene)->shape.get()); }

inline ConcordemBodyMotion motionOf(const State& s) { return { s.pos.data(), s.vel.data(), s.angVel.data(), s.ori.coeffs().data() }; }

/* Displacement of the second body's periodic image, and its velocity. */
inline Vector3r imageShift(const Scene& scene, const Interaction& I)
{
	return scene.isPeriodic ? scene.cell->intrShiftPos(I.cellDist) : Vector3r(Vector3r::Zero());
}
inline Vector3r imageVelocity(const Scene& scene, const Interaction& I)
{
	return scene.isPeriodic ? scene.cell->intrShiftVel(I.cellDist) : Vector3r(Vector3r::Zero());
}

/* Buffer for a message of the library. */
struct Reason {
	char             text[2048] = { 0 };
	ConcordemMessage message    = { text, sizeof(text) };
	operator const ConcordemMessage*() const { return &message; }
};

const char* const INTERNAL_ERROR = "internal error of concordem, please report it";

/* Energies of a law in O.energy. The last one is the stored energy, which is reset at every step; the others accumulate. */
class LawEnergies {
	vector<string> names;
	vector<int>    ids;

public:
	LawEnergies(std::initializer_list<const char*> all)
	        : names(all.begin(), all.end())
	        , ids(all.size(), -1)
	{
	}
	/* One value per name. */
	void add(EnergyTracker& tracker, std::initializer_list<Real> values)
	{
		const size_t last = names.size() - 1;
		// One thread registers the names.
		if (ids[last] < 0) {
#pragma omp critical(concordem_energy)
			if (ids[last] < 0) {
				for (size_t k = 0; k < last; k++)
					tracker.findId(names[k], ids[k]);
				int id = -1;
				tracker.findId(names[last], id, /*reset at every step*/ true);
				ids[last] = id;
			}
		}
		size_t k = 0;
		for (Real value : values) {
			tracker.add(value, names[k], ids[k], k == last);
			k++;
		}
	}
};

/* The laws of InteractionLoop. */
struct LawsOfScene {
	bool ours       = false; // it has our law
	bool frictional = false; // it has a law for FrictPhys
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

/* Stop the run after this step and set `error`, because an exception must not leave YADE's parallel loop. If the cause is not removed, the
   next run stops again. */
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

/* Stop the run after this step; `error` is already set. */
inline void stopAgain(Scene& scene)
{
#pragma omp critical(concordem_error)
	scene.stopAtIter = scene.iter + 1;
}

/* Mark a contact that could not be created by refLength < 0, because YADE requires physics. Its law stops the run in every step, even if
   InteractionLoop has no such law. The `error` of the Ip2 functor gives the reason. */
template <class Law, class Physics> void refuseAlways(Scene* scene, Interaction& I, const shared_ptr<Physics>& physics)
{
	physics->refLength = -1;
	I.phys             = physics;
	const shared_ptr<Law> law(new Law);
	law->scene               = scene;
	I.functorCache.constLaw = law;
}

/* The last scene and step for which a functor read the scene. */
struct LastLook {
	const Scene* scene = nullptr;
	long         iter  = -1;
	LawsOfScene  laws;
	/* Whether the scene or the step is new; stores both. */
	bool isDue(const Scene* now)
	{
		if (scene == now && iter == now->iter) return false;
		scene = now, iter = now->iter;
		return true;
	}
};

/* go() of an Ip2 functor that creates bonds between spheres until iteration cohesiveThresholdIter. Later contacts, and contacts with other
   shapes, come from its base class. `word`: name of a bond in messages. */
template <class Law, class Physics, class Mat, class Functor>
void makeBondOrContact(
        Functor& functor, const char* word, const shared_ptr<Material>& one, const shared_ptr<Material>& two, const shared_ptr<Interaction>& I)
{
	if (I->phys) return;
	Scene*      scene = functor.scene;
	const bool  bonds = (functor.cohesiveThresholdIter < 0 || scene->iter < functor.cohesiveThresholdIter) && isBall(scene, I->id1) && isBall(scene, I->id2);
	string      why;
	shared_ptr<Physics> phys(new Physics);
#pragma omp critical(concordem_make_bond)
	{
		if (functor.last.isDue(scene)) {
			functor.last.laws = lawsOf<Law>(*scene);
			functor.look();
		}
		if (!functor.last.laws.ours) why = "InteractionLoop has no " + Law().getClassName() + "; add it";
		else if (bonds)
			why = functor.make(*I, *YADE_CAST<Mat*>(one.get()), *YADE_CAST<Mat*>(two.get()), *phys);
		else if (!functor.last.laws.frictional)
			why = string("this contact has no ") + word
			        + ", and InteractionLoop has no law for FrictPhys; add Law2_ScGeom_FrictPhys_CundallStrack()";
	}
	if (!why.empty()) {
		stopRun(*scene, functor.getClassName().c_str(), functor.error, *I, why);
		refuseAlways<Law>(scene, *I, phys);
	} else if (bonds) {
		I->phys = phys;
	} else {
		functor.Ip2_FrictMat_FrictMat_FrictPhys::go(one, two, I);
	}
}

/* go() of a bond law: compute the bond, store its history, add its energies and forces. Returns false if the bond must be deleted. */
template <class Contact, class Physics, class Functor> bool stepBond(Functor& law, Physics& phys, Interaction& I)
{
	Scene& scene = *law.scene;
	if (phys.refLength < 0) {
		stopAgain(scene);
		return true;
	}
	if (!phys.intact) return false;
	Contact              c;
	ConcordemBondOutcome outcome = ConcordemBondOutcome::Internal;
	string               why     = law.fill(c, phys, I);
	if (why.empty()) {
		outcome = law.compute(c);
		why     = outcome == ConcordemBondOutcome::Internal ? INTERNAL_ERROR : law.store(c, outcome, phys);
	}
	if (!why.empty()) {
		stopRun(scene, law.getClassName().c_str(), law.error, I, why);
		return true;
	}
	if (scene.trackEnergy) law.addEnergies(c);
	if (outcome == ConcordemBondOutcome::Broke) {
#pragma omp atomic
		law.broken++;
		return false;
	}
	if (outcome == ConcordemBondOutcome::Opened) return false;
	law.show(c, phys);
	const Vector3r f = read(c.force), n = read(c.normal);
	phys.normalForce = -f.dot(n) * n;
	phys.shearForce  = -f - phys.normalForce;
	scene.forces.addForce(I.id1, f);
	scene.forces.addForce(I.id2, -f);
	scene.forces.addTorque(I.id1, read(c.torque[0]));
	scene.forces.addTorque(I.id2, read(c.torque[1]));
	return true;
}

} // namespace yade
