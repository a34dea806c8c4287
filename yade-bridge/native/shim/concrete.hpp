/* YADE classes for concrete. ConcorDEM computes the law.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include "functor.hpp"
#include <pkg/dem/ConcretePM.hpp>

namespace yade {

/* YADE's CpmPhys with a saved history. O.save does not write the plain members omega, kappaD, epsN, epsT, epsNPl, epsTPl of CpmPhys;
   here a declared attribute stores them. */
class CpmPhys_Rust : public CpmPhys {
public:
	virtual ~CpmPhys_Rust() = default;
	void preSave(CpmPhys_Rust&);
	void postSave(CpmPhys_Rust&) { history.clear(); }
	void postLoad(CpmPhys_Rust&);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR(CpmPhys_Rust, CpmPhys,
		"CpmPhys whose history is saved by O.save.",
		((vector<Real>,history,,(Attr::readonly|Attr::hidden),"omega, epsN, kappaD, epsNPl, epsT, epsTPl, sigmaN, sigmaT, Fn, Fs, relResidualStrength, only while the scene is saved or loaded; empty otherwise.")),
		createIndex(); sigmaN=0; relResidualStrength=1; sigmaT=Vector3r::Zero();
	);
	// clang-format on
	REGISTER_CLASS_INDEX(CpmPhys_Rust, CpmPhys);
};
REGISTER_SERIALIZABLE(CpmPhys_Rust);

class Ip2_CpmMat_CpmMat_CpmPhys_Rust : public Ip2_CpmMat_CpmMat_CpmPhys {
public:
	void go(const shared_ptr<Material>&, const shared_ptr<Material>&, const shared_ptr<Interaction>&) override;
	FUNCTOR2D(CpmMat, CpmMat);
	// clang-format off
	YADE_CLASS_BASE_DOC(Ip2_CpmMat_CpmMat_CpmPhys_Rust, Ip2_CpmMat_CpmMat_CpmPhys,
		"Ip2_CpmMat_CpmMat_CpmPhys that creates CpmPhys_Rust, whose history is saved by O.save."
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Ip2_CpmMat_CpmMat_CpmPhys_Rust);

/* Attributes and elasticEnergy are inherited, so a script only changes the class name. */
class Law2_ScGeom_CpmPhys_Rust : public Law2_ScGeom_CpmPhys_Cpm {
	LawEnergies energies { "cpmDamage", "cpmFriction", "cpmIntegration", "cpmElastic" };
	void check(const shared_ptr<IGeom>&, const shared_ptr<CpmPhys>& before, const CpmPhys& after, Interaction*, bool lives);
	void stop(const Interaction&, const string& reason);

public:
	bool go(shared_ptr<IGeom>&, shared_ptr<IPhys>&, Interaction*) override;
	FUNCTOR2D(GenericSpheresContact, CpmPhys);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS(Law2_ScGeom_CpmPhys_Rust, Law2_ScGeom_CpmPhys_Cpm,
		"Replaces Law2_ScGeom_CpmPhys_Cpm with bitwise equal results; ConcorDEM computes the law. With O.trackEnergy, O.energy gets cpmElastic, cpmDamage, cpmFriction, and cpmIntegration (error of the trapezoidal rule). A NaN strain or an invalid damLaw stops the run and sets `error`.",
		((int,checkEvery,0,,"Every checkEvery steps, also compute every contact with YADE's law and stop the run if a bit differs; 0: never."))
		((string,error,,(Attr::noSave|Attr::readonly),"Error that stopped the run; empty if there was none."))
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Law2_ScGeom_CpmPhys_Rust);

/* The bitwise differences between two CpmPhys as text; empty if there are none. */
std::string difference(const CpmPhys& ours, const CpmPhys& theirs);

} // namespace yade
