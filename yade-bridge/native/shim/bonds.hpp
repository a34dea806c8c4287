/* The bonded engine: ConcorDEM stores and computes bonds in a scene that YADE integrates.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include "abi.h"
#include <core/Body.hpp>
#include <core/GlobalEngine.hpp>
#include <mutex>

namespace yade {

class BondedEngine_Rust : public GlobalEngine {
	shared_ptr<ConcordemBonds>         bonds;
	vector<shared_ptr<Body>>           seen;    // bodies of the particles at the start
	vector<State*>                     states;  // their states
	vector<std::array<const Real*, 4>> motion;  // addresses of position, velocity, angular velocity, orientation
	vector<const unsigned*>            blocked; // addresses of blockedDOFs
	vector<size_t>                     byId;    // indices of the particles, ordered by body id
	vector<const Material*>            materials; // of the bodies at the take-over
	vector<Real>                       radii;     // of the bodies at the take-over
	string                             settings;  // of the functors and materials at the take-over
	vector<std::pair<const Engine*, bool>> checkedEngines; // O.engines when they were last checked, with `dead`
	std::recursive_mutex               bondsMutex;    // held while a thread reads or changes the bonds; see BondsLock
	long                               nextIter = -1; // the iteration in which the engine must act next; -1: any
	int                                storedId = -1, damageId = -1, frictionId = -1, viscousId = -1, integrationId = -1;

	int            wantedThreads() const;
	void           begin(ConcordemBonds*, const char* message);
	void           attach();
	bool           takeConcrete(bool now);
	void           bondScenario();
	void           mask();
	static int32_t isPresent(const void* engine, size_t k, uint32_t number);
	void           checkEngines(bool atTakeOver);
	bool           enginesChanged() const;
	void           watch();
	void           verify(bool deep);
	boost::python::list watchedMaterials() const;
	void           addEnergies();
	void           writeStates();
	void           load();
	ConcordemFacts facts();

public:
	~BondedEngine_Rust() override;
	void action() override;
	void check();
	/* Whether the engine has bonds in this scene, but is not in its list of engines. */
	bool isMissingIn(const Scene&) const;
	void takeOver();
	void release();
	/* A copy of the bonds as Python's bytes, which the package reads. */
	boost::python::object words();
	void preSave(BondedEngine_Rust&);
	void postSave(BondedEngine_Rust&) { memory.clear(); }

	long     bondCount_get() { return facts().bonds; }
	long     broken_get() { return facts().broken; }
	long     steps_get() { return facts().steps; }
	long     searches_get() { return facts().neighborListRebuilds; }
	Matrix3r stress(Real volume);

	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(BondedEngine_Rust, GlobalEngine,
		"Stores bonds in contiguous arrays and adds their forces; put it after InteractionLoop in O.engines. In the first step after cohesiveThresholdIter, it takes over the contacts of concrete (CpmPhys between spheres) from O.interactions with their histories, and from then on also computes new contacts. With `scenario`, it bonds spheres with any ConcorDEM law instead. The bonds are saved and loaded with the scene. Results are bitwise equal for any number of threads.",
		((string,kinematics,"",,"Kinematics: finite, first-order, yade, or yade-ratcheting; empty: that of Ig2_Sphere_Sphere_ScGeom."))
		((string,mode,"yade-public",,"Formulation of the concrete law: yade-public, thesis, or woo."))
		((string,scenario,"",,"Tables of a scenario (TOML: material, bonds, contacts, ...) that define the bonds; empty: take over concrete."))
		((vector<Body::id_t>,ids,,,"Ids of the spheres that `scenario` bonds; empty: all spheres."))
		((int,threads,0,,"Number of threads for the bonds; 0: as many as YADE uses."))
		((int,updateStates,0,,"Write damage and stress to CpmState every updateStates steps; 0: never. CpmStateUpdater is set to dead=True, also after release() or removal of the engine."))
		((int,selfMask,0,(Attr::readonly),"Bit of groupMask that excludes contacts between the bonded bodies from YADE's collider."))
		((vector<int>,memory,,(Attr::readonly|Attr::hidden),"The bonds, only while the scene is saved or loaded; empty otherwise."))
		,
		/*ctor*/,
		/*py*/
		.def("takeOver",&BondedEngine_Rust::takeOver,"Take over the bonds now. Call it between two steps.")
		.def("release",&BondedEngine_Rust::release,"Delete the bonds; YADE handles contacts between the bodies again. CpmStateUpdater stays dead.")
		.def("stress",&BondedEngine_Rust::stress,(boost::python::arg("volume")=-1),"Stress of the periodic cell, or of a body of this volume (m³), from bonds and contacts: σ = (1/V) Σ l⊗f, Pa, tension positive; first index: branch vector. Forces of the last step, branch vectors between the present positions, as in getStress; while another thread runs YADE, positions and cell of the last step.")
		.def("words",&BondedEngine_Rust::words,"A copy of the bonds as bytes, for concordem.yade, which adds the methods contacts(), forces(), temperatures(), interactions(), give_back(), and write_vtk().")
		.def("check",&BondedEngine_Rust::check,"Raise an error unless the engine is in its place in O.engines, has acted in every step, and settings and bodies are those of the take-over. O.run and O.step call it.")
		.add_property("bondCount",&BondedEngine_Rust::bondCount_get,"Number of intact bonds.")
		.add_property("broken",&BondedEngine_Rust::broken_get,"Number of bonds broken since the take-over.")
		.add_property("steps",&BondedEngine_Rust::steps_get,"Number of steps since the take-over.")
		.add_property("searches",&BondedEngine_Rust::searches_get,"Number of neighbor-list rebuilds.")
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(BondedEngine_Rust);

/* What is wrong if the scene has lost its bonded engine; empty if it has not. */
string abandonedBonds();

} // namespace yade
