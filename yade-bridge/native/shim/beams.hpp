/* YADE classes for cohesive beams: material, physics, Ip2 functor, and Law2 functor. ConcorDEM computes the law.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include "abi.h"
#include "functor.hpp"
#include <pkg/dem/FrictPhys.hpp>
#include <pkg/dem/ScGeom.hpp>

namespace yade {

class BeamMat_Rust : public FrictMat {
public:
	virtual ~BeamMat_Rust() = default;
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR(BeamMat_Rust, FrictMat,
		"Material of spheres joined by cohesive beams. `young` (Pa) and `poisson` are those of the beams; contacts without a beam use them by YADE's rule. Give either `radiusRatio` or `radius`.",
		((Real,radiusRatio,0,,"Beam radius divided by the mean radius of all spheres of this class of material; 0 if `radius` is given."))
		((Real,radius,0,,"Beam radius, m; 0 if `radiusRatio` is given."))
		((string,model,"euler-bernoulli",,"Beam model: euler-bernoulli, timoshenko, dual-spring, or spring."))
		((Real,shearCoefficient,0.9,,"Shear coefficient of the section; only for timoshenko."))
		((Real,shearRatio,0,,"Shear stiffness divided by normal stiffness; only for dual-spring."))
		((Real,tensileStrength,std::numeric_limits<Real>::infinity(),,"A beam breaks when the largest principal stress on its surface exceeds this, Pa; infinite: never."))
		((string,bendingTerm,"mid-section",,"Bending moment used for this stress: mid-section, half-sum, or larger-end.")),
		createIndex();
	);
	// clang-format on
	REGISTER_CLASS_INDEX(BeamMat_Rust, FrictMat);
};
REGISTER_SERIALIZABLE(BeamMat_Rust);

class BeamPhys_Rust : public RotStiffFrictPhys {
public:
	virtual ~BeamPhys_Rust() = default;
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR(BeamPhys_Rust, RotStiffFrictPhys,
		"A cohesive beam with its history. Parameters may be changed before the first step of the beam.",
		((Real,young,NaN,,"Young's modulus, Pa."))
		((Real,poisson,NaN,,"Poisson's ratio."))
		((Real,shear,0,,"Shear coefficient (timoshenko) or stiffness ratio (dual-spring)."))
		((Real,tensileStrength,std::numeric_limits<Real>::infinity(),,"Strength, Pa."))
		((Real,crossSection,NaN,,"Cross-section, m^2."))
		((Real,refLength,0,,"Reference length, m; set in the first step. A negative value marks a contact that could not be created; it stops the run."))
		((int,model,0,,"0 euler-bernoulli, 1 timoshenko, 2 dual-spring, 3 spring."))
		((int,bendingTerm,0,,"0 mid-section, 1 half-sum, 2 larger-end."))
		((bool,intact,true,,"If False, the beam is deleted in the next step without force and energy."))
		((Vector3r,restDirection,Vector3r::Zero(),(Attr::readonly),"History: direction of the unloaded beam, in axes halfway between those of the bodies."))
		((Vector3r,restRotation,Vector3r::Zero(),(Attr::readonly),"History: vector part of the rotation from either body to these axes."))
		((Vector3r,moment,Vector3r::Zero(),(Attr::readonly),"Moment at the middle section, on the first body, N*m.")),
		createIndex();
	);
	// clang-format on
	REGISTER_CLASS_INDEX(BeamPhys_Rust, RotStiffFrictPhys);
};
REGISTER_SERIALIZABLE(BeamPhys_Rust);

class Ip2_BeamMat_BeamMat_BeamPhys_Rust : public Ip2_FrictMat_FrictMat_FrictPhys {
	Real   countedRadius = NaN; // mean radius of the spheres, m; NaN if not computed in this step yet
	Real   meanRadius();

public:
	LastLook last;
	void     look() { countedRadius = NaN; }
	string   make(const Interaction&, const BeamMat_Rust&, const BeamMat_Rust&, BeamPhys_Rust&);
	void go(const shared_ptr<Material>&, const shared_ptr<Material>&, const shared_ptr<Interaction>&) override;
	FUNCTOR2D(BeamMat_Rust, BeamMat_Rust);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS(Ip2_BeamMat_BeamMat_BeamPhys_Rust, Ip2_FrictMat_FrictMat_FrictPhys,
		"Creates beams between spheres of BeamMat_Rust until iteration cohesiveThresholdIter (negative: always). Later contacts, and contacts with facets and other shapes, get the FrictPhys of the base class, so InteractionLoop needs a law such as Law2_ScGeom_FrictPhys_CundallStrack. Between two materials, numbers are averaged and words must be equal.",
		((long,cohesiveThresholdIter,10,,"New contacts are beams until this iteration; negative: always."))
		((string,error,,(Attr::noSave|Attr::readonly),"Error that stopped the run; empty if there was none."))
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Ip2_BeamMat_BeamMat_BeamPhys_Rust);

class Law2_ScGeom6D_BeamPhys_Rust : public LawFunctor {
	LawEnergies energies { "beamDamage", "beamIntegration", "beamElastic" };

public:
	string               fill(ConcordemBeamContact&, BeamPhys_Rust&, const Interaction&) const;
	ConcordemBondOutcome compute(ConcordemBeamContact& c) const { return concordem_yade_beam(&c); }
	string               store(ConcordemBeamContact&, ConcordemBondOutcome, BeamPhys_Rust&) const;
	void                 show(const ConcordemBeamContact& c, BeamPhys_Rust& phys) const { phys.moment = read(c.moment); }
	void                 addEnergies(const ConcordemBeamContact& c)
	{
		energies.add(*scene->energy, { c.damageEnergy, c.integrationEnergy, c.storedEnergy });
	}
	bool go(shared_ptr<IGeom>&, shared_ptr<IPhys>&, Interaction*) override;
	FUNCTOR2D(ScGeom6D, BeamPhys_Rust);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS(Law2_ScGeom6D_BeamPhys_Rust, LawFunctor,
		"ConcorDEM's cohesive beam between the centers of two spheres. It is exact for rotations of any size, and its forces derive from an energy. It breaks by the largest principal stress on its surface; a broken beam is deleted. With O.trackEnergy, O.energy gets beamElastic, beamDamage, and beamIntegration (error of the work rule in the step in which a beam breaks). A force that is not finite stops the run and sets `error`.",
		((long,broken,0,(Attr::readonly),"Number of broken beams."))
		((string,error,,(Attr::noSave|Attr::readonly),"Error that stopped the run; empty if there was none."))
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Law2_ScGeom6D_BeamPhys_Rust);

} // namespace yade
