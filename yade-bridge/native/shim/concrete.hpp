/* Classes of YADE for concrete whose law is computed by ConcorDEM.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include "functor.hpp"
#include <pkg/dem/ConcretePM.hpp>

namespace yade {

/* YADE's CpmPhys, with its history saved. YADE keeps omega, kappaD, epsN, epsT, epsNPl, epsTPl as plain members that O.save
   leaves out; here they travel in a declared attribute. */
class CpmPhys_Rust : public CpmPhys {
public:
	virtual ~CpmPhys_Rust() = default;
	void preSave(CpmPhys_Rust&);
	void postSave(CpmPhys_Rust&) { history.clear(); }
	void postLoad(CpmPhys_Rust&);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR(CpmPhys_Rust, CpmPhys,
		"CpmPhys whose history survives O.save and O.load.",
		((vector<Real>,history,,(Attr::readonly|Attr::hidden),"omega, epsN, kappaD, epsNPl, epsT, epsTPl, sigmaN, sigmaT, Fn, Fs, relResidualStrength while the scene is being saved or loaded; empty otherwise.")),
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
		"As Ip2_CpmMat_CpmMat_CpmPhys, but makes CpmPhys_Rust, whose history survives O.save and O.load."
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Ip2_CpmMat_CpmMat_CpmPhys_Rust);

/* Attributes, elasticEnergy and the rest are inherited: a script changes one word. */
class Law2_ScGeom_CpmPhys_Rust : public Law2_ScGeom_CpmPhys_Cpm {
	LawEnergies energies { "cpmDamage", "cpmFriction", "cpmIntegration", "cpmElastic" };
	void check(const shared_ptr<IGeom>&, const shared_ptr<CpmPhys>& before, const CpmPhys& after, Interaction*, bool lives);
	void stop(const Interaction&, const string& reason);

public:
	bool go(shared_ptr<IGeom>&, shared_ptr<IPhys>&, Interaction*) override;
	FUNCTOR2D(GenericSpheresContact, CpmPhys);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS(Law2_ScGeom_CpmPhys_Rust, Law2_ScGeom_CpmPhys_Cpm,
		"YADE's concrete law computed by ConcorDEM, bit for bit; in place of Law2_ScGeom_CpmPhys_Cpm. With O.trackEnergy, O.energy gets cpmElastic, cpmDamage, cpmFriction, and cpmIntegration (error of the trapezoidal rule). A strain that is not a number, or a wrong damLaw, stops the run and is told in `error`.",
		((int,checkEvery,0,,"Every so many steps YADE's own law answers every contact as well, and the run stops if a bit differs; 0: never."))
		((string,error,,(Attr::noSave|Attr::readonly),"What stopped the run; empty if nothing did."))
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Law2_ScGeom_CpmPhys_Rust);

/* What differs between two CpmPhys in any bit, in words; empty if nothing does. */
std::string difference(const CpmPhys& ours, const CpmPhys& theirs);

} // namespace yade
