/* Classes of YADE for cohesive beams: material, physics, the functor that makes it, and the law, which ConcorDEM computes.

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
		"Spheres joined by cohesive beams. `young` (Pa) and `poisson` are those of the beams, and of contacts without a beam by YADE's own rule. Give `radiusRatio` or `radius`.",
		((Real,radiusRatio,0,,"Radius of a beam divided by the mean radius of all spheres of such materials; 0: `radius` counts."))
		((Real,radius,0,,"Radius of a beam, m; 0: `radiusRatio` counts."))
		((string,model,"euler-bernoulli",,"What a beam resists: euler-bernoulli, timoshenko, dual-spring, spring."))
		((Real,shearCoefficient,0.9,,"Shear coefficient of the section; with timoshenko."))
		((Real,shearRatio,0,,"Tangential stiffness divided by normal stiffness; with dual-spring."))
		((Real,tensileStrength,std::numeric_limits<Real>::infinity(),,"Largest principal stress on the surface of a beam at which it breaks, Pa; infinite: never."))
		((string,bendingTerm,"mid-section",,"Bending moment that enters this stress: mid-section, half-sum, larger-end.")),
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
		((Real,crossSection,NaN,,"Area of the section, m^2."))
		((Real,refLength,0,,"Length without strain, m; set in the first step. Negative: the contact could not be made, and stops the run."))
		((int,model,0,,"0 euler-bernoulli, 1 timoshenko, 2 dual-spring, 3 spring."))
		((int,bendingTerm,0,,"0 mid-section, 1 half-sum, 2 larger-end."))
		((bool,intact,true,,"A beam that is not is deleted in the next step, without a force and without energy."))
		((Vector3r,restDirection,Vector3r::Zero(),(Attr::readonly),"History: direction of the unloaded beam in axes half way between those of the bodies."))
		((Vector3r,restRotation,Vector3r::Zero(),(Attr::readonly),"History: vector part of the rotation from either body to these axes."))
		((Vector3r,moment,Vector3r::Zero(),(Attr::readonly),"Moment of the middle section on the first body, N*m.")),
		createIndex();
	);
	// clang-format on
	REGISTER_CLASS_INDEX(BeamPhys_Rust, RotStiffFrictPhys);
};
REGISTER_SERIALIZABLE(BeamPhys_Rust);

class Ip2_BeamMat_BeamMat_BeamPhys_Rust : public Ip2_FrictMat_FrictMat_FrictPhys {
	Real   countedRadius = NaN; // mean radius of the spheres, counted in this step if it is not NaN
	Real   meanRadius();

public:
	LastLook last;
	void     look() { countedRadius = NaN; }
	string   make(const Interaction&, const BeamMat_Rust&, const BeamMat_Rust&, BeamPhys_Rust&);
	void go(const shared_ptr<Material>&, const shared_ptr<Material>&, const shared_ptr<Interaction>&) override;
	FUNCTOR2D(BeamMat_Rust, BeamMat_Rust);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS(Ip2_BeamMat_BeamMat_BeamPhys_Rust, Ip2_FrictMat_FrictMat_FrictPhys,
		"Joins spheres of BeamMat_Rust by beams until iteration cohesiveThresholdIter (negative: always). Later, and where a facet or another shape takes part, it makes the FrictPhys of its base class, for which InteractionLoop needs a law such as Law2_ScGeom_FrictPhys_CundallStrack. Different materials: means of numbers; words must agree.",
		((long,cohesiveThresholdIter,10,,"Iteration until which new contacts are beams; negative: always."))
		((string,error,,(Attr::noSave|Attr::readonly),"What stopped the run; empty if nothing did."))
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
		"The cohesive beam of ConcorDEM between the centres of two spheres: exact for rotations of any size, forces are derivatives of one energy, brittle by the largest principal stress on the surface. A beam that breaks is deleted. With O.trackEnergy, O.energy gets beamElastic, beamDamage, and beamIntegration (error of the work rule in the step that breaks). What is not a number stops the run and is told in `error`.",
		((long,broken,0,(Attr::readonly),"Beams that broke."))
		((string,error,,(Attr::noSave|Attr::readonly),"What stopped the run; empty if nothing did."))
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Law2_ScGeom6D_BeamPhys_Rust);

} // namespace yade
