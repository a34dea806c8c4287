/* The bonded engine: bonds that are ConcorDEM's, in a scene that stays YADE's.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include "abi.h"
#include <core/Body.hpp>
#include <core/GlobalEngine.hpp>

namespace yade {

class BondedEngine_Rust : public GlobalEngine {
	shared_ptr<ConcordemBonds>         bonds;
	vector<shared_ptr<Body>>           seen;   // bodies behind the particles, when the engine began
	vector<State*>                     states; // and their states
	vector<std::array<const Real*, 4>> motion; // where position, velocity, angular velocity, orientation are
	vector<const unsigned*>            blocked; // and blockedDOFs
	vector<size_t>                     byId;    // particles in the order of their ids
	int                                storedId = -1, damageId = -1, frictionId = -1, viscousId = -1, integrationId = -1;

	int            wantedThreads() const;
	void           begin(ConcordemBonds*, const char* message);
	void           attach();
	bool           takeConcrete(bool now);
	void           bondScenario();
	void           mask();
	static int32_t isPresent(const void* engine, size_t k, uint32_t number);
	void           refuseBlindEngines(bool atTakeOver) const;
	void           addEnergies();
	void           writeStates();
	void           load();
	ConcordemFacts facts();

public:
	void action() override;
	void takeOver();
	void release();
	void preSave(BondedEngine_Rust&);
	void postSave(BondedEngine_Rust&) { memory.clear(); }

	long     bondCount_get() { return facts().bonds; }
	long     broken_get() { return facts().broken; }
	long     steps_get() { return facts().steps; }
	long     searches_get() { return facts().neighborListRebuilds; }
	Matrix3r stress(Real volume);

	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(BondedEngine_Rust, GlobalEngine,
		"Owns bonds as contiguous arrays and adds their forces: put it behind InteractionLoop. In its first step with all bonds made (cohesiveThresholdIter), it takes the contacts of concrete (CpmPhys between spheres) over from O.interactions, with their histories, and goes on with them, new contacts after breakage included; or, with `scenario`, it bonds spheres by any law of ConcorDEM. Saved and loaded with the scene. The same bits for any number of threads.",
		((string,kinematics,"",,"Measure of motion: finite, first-order, yade, yade-ratcheting; empty: that of Ig2_Sphere_Sphere_ScGeom."))
		((string,mode,"yade-public",,"Form of the concrete law: yade-public, thesis, woo."))
		((string,scenario,"",,"Tables of a scenario (TOML: material, bonds, contacts, ...) to bond spheres by, instead of taking concrete over."))
		((vector<Body::id_t>,ids,,,"Spheres that `scenario` bonds; empty: all."))
		((int,threads,0,,"Threads for the bonds; 0: as many as YADE has."))
		((int,updateStates,0,,"Write damage and stress into CpmState every so many steps, in place of CpmStateUpdater, which is made dead and stays so after release() or when the engine is taken out; 0: never."))
		((int,selfMask,0,(Attr::readonly),"Bit of groupMask that keeps the bonded bodies apart in YADE's collider."))
		((Real,crackOnset,0,(Attr::readonly),"epsCrackOnset of the material, for CpmState.normDmg."))
		((vector<int>,memory,,(Attr::readonly|Attr::hidden),"The bonds while the scene is being saved or loaded; empty otherwise."))
		,
		/*ctor*/,
		/*py*/
		.def("takeOver",&BondedEngine_Rust::takeOver,"Take the bonds over now, between two steps.")
		.def("release",&BondedEngine_Rust::release,"Let the bonds go: the bodies may touch as YADE's again. A CpmStateUpdater that was made dead stays so.")
		.def("stress",&BondedEngine_Rust::stress,(boost::python::arg("volume")=-1),"Stress by bonds and contacts of the cell, or of a body of this volume (m³), Pa, tension positive; first index: branch.")
		.add_property("bondCount",&BondedEngine_Rust::bondCount_get,"Bonds that have not broken.")
		.add_property("broken",&BondedEngine_Rust::broken_get,"Bonds that broke since the take-over.")
		.add_property("steps",&BondedEngine_Rust::steps_get,"Steps of the bonds.")
		.add_property("searches",&BondedEngine_Rust::searches_get,"Neighbour searches.")
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(BondedEngine_Rust);

} // namespace yade
