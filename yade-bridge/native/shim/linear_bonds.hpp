/* Classes of YADE for brittle linear bonds between particles that may deform: material, state of the particles, physics, the
   functor that makes it, the law, and the pass that strains the particles. ConcorDEM computes the latter two.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include "abi.h"
#include "functor.hpp"
#include <core/GlobalEngine.hpp>
#include <pkg/dem/FrictPhys.hpp>
#include <pkg/dem/ScGeom.hpp>

namespace yade {

class DeformableState_Rust : public State {
public:
	virtual ~DeformableState_Rust() = default;
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR(DeformableState_Rust, State,
		"Place and motion of a particle that may deform, and its uniform strain. Tensors as Voigt vectors xx, yy, zz, yz, xz, xy without factors; tension positive.",
		((Vector6r,stress,Vector6r::Zero(),(Attr::readonly),"Stress by the bonds of the last step and the reactions of blockedDOFs, Pa."))
		((Vector6r,widening,Vector6r::Zero(),(Attr::readonly),"Radius times strain that bonds will see in the next step, m: how far the surface moved out."))
		((Vector6r,wideningBefore,Vector6r::Zero(),(Attr::readonly),"What they saw in the last one, m."))
		((Vector6r,dyad,Vector6r::Zero(),(Attr::readonly|Attr::hidden),"History, N: dyad of all forces of the last step that strain the particle."))
		((Vector6r,usedDyad,Vector6r::Zero(),(Attr::readonly|Attr::hidden),"History, N: dyad that the strain of the last step was computed from."))
		((Vector6r,otherDyad,Vector6r::Zero(),(Attr::readonly|Attr::hidden),"History, N: that of forces that do not feel the strain."))
		((Vector6r,reactionDyad,Vector6r::Zero(),(Attr::readonly|Attr::hidden),"History, N: that of the reaction of blockedDOFs.")),
		createIndex();
	);
	// clang-format on
	REGISTER_CLASS_INDEX(DeformableState_Rust, State);
};
REGISTER_SERIALIZABLE(DeformableState_Rust);

class LinearBondMat_Rust : public FrictMat {
public:
	virtual ~LinearBondMat_Rust() = default;
	shared_ptr<State> newAssocState() const override { return shared_ptr<State>(new DeformableState_Rust); }
	bool              stateTypeOk(State* s) const override { return (bool)dynamic_cast<DeformableState_Rust*>(s); }
	bool              deforms() const { return particleYoung != std::numeric_limits<Real>::infinity(); }
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR(LinearBondMat_Rust, FrictMat,
		"Spheres joined by brittle linear bonds, which may deform (`particleYoung`). `young`, `poisson`, and `frictionAngle` are those of contacts without a bond, by YADE's own rule.",
		((Real,normalStiffness,NaN,,"Normal stiffness of a bond, N/m."))
		((Real,shearStiffness,0,,"Shear stiffness of a bond, N/m."))
		((Real,dampingRatio,0,,"Dashpots of a bond as a fraction of critical damping of the pair."))
		((Real,normalStrength,std::numeric_limits<Real>::infinity(),,"Tensile force at which a bond breaks, N; infinite: never."))
		((Real,shearStrength,std::numeric_limits<Real>::infinity(),,"Shear force at which a bond breaks, N; infinite: never."))
		((bool,subtractInitialGap,true,,"Whether a bond is free of force at the distance at which it is made; else where the spheres touch."))
		((Real,particleYoung,std::numeric_limits<Real>::infinity(),,"Young's modulus of the particles themselves, Pa; infinite: rigid. Needs DeformableParticles_Rust in O.engines."))
		((Real,particlePoisson,0,,"Poisson's ratio of the particles themselves.")),
		createIndex();
	);
	// clang-format on
	REGISTER_CLASS_INDEX(LinearBondMat_Rust, FrictMat);
};
REGISTER_SERIALIZABLE(LinearBondMat_Rust);

class LinearBondPhys_Rust : public FrictPhys {
public:
	virtual ~LinearBondPhys_Rust() = default;
	ConcordemLinearBondParameters parameters() const;
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR(LinearBondPhys_Rust, FrictPhys,
		"A brittle linear bond with its history; `kn` and `ks` (N/m) are its stiffnesses.",
		((Real,dampingRatio,0,,"Dashpots as a fraction of critical damping of the pair."))
		((Real,normalStrength,std::numeric_limits<Real>::infinity(),,"Tensile strength, N."))
		((Real,shearStrength,std::numeric_limits<Real>::infinity(),,"Shear strength, N."))
		((bool,subtractInitialGap,true,,"Whether it is free of force at refLength; else where the spheres touch."))
		((bool,deforms,false,,"Whether one of its particles deforms."))
		((Real,refLength,0,,"Distance of the centres at bonding, m; set in the first step. Negative: the contact could not be made, and stops the run."))
		((bool,intact,true,,"A bond that is not is deleted in the next step, without a force and without energy."))
		((Vector3r,force,Vector3r::Zero(),(Attr::readonly),"Force on the first body in the last step, N."))
		((Vector3r,direction,Vector3r::Zero(),(Attr::readonly),"History: unit vector from the first to the second body."))
		((Real,length,0,(Attr::readonly),"History: distance of the centres, m."))
		((Vector3r,shearDisplacement,Vector3r::Zero(),(Attr::readonly),"History: shear displacement of the second body since bonding, m."))
		((Real,normalDashpot,0,(Attr::readonly),"History: normal force of the dashpot, N."))
		((Vector3r,shearDashpot,Vector3r::Zero(),(Attr::readonly),"History: shear force of the dashpot, N."))
		((bool,strained,false,(Attr::readonly|Attr::hidden),"Whether DeformableParticles_Rust has seen the force of the last step.")),
		createIndex();
	);
	// clang-format on
	REGISTER_CLASS_INDEX(LinearBondPhys_Rust, FrictPhys);
};
REGISTER_SERIALIZABLE(LinearBondPhys_Rust);

class Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust : public Ip2_FrictMat_FrictMat_FrictPhys {
	string wrongPass; // what is wrong with DeformableParticles_Rust in this step

public:
	LastLook last;
	void     look();
	string   make(const Interaction&, const LinearBondMat_Rust&, const LinearBondMat_Rust&, LinearBondPhys_Rust&);
	void go(const shared_ptr<Material>&, const shared_ptr<Material>&, const shared_ptr<Interaction>&) override;
	FUNCTOR2D(LinearBondMat_Rust, LinearBondMat_Rust);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS(Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust, Ip2_FrictMat_FrictMat_FrictPhys,
		"Joins spheres of LinearBondMat_Rust by brittle linear bonds until iteration cohesiveThresholdIter (negative: always). Later, and where a facet or another shape takes part, it makes the FrictPhys of its base class, for which InteractionLoop needs a law such as Law2_ScGeom_FrictPhys_CundallStrack. Different materials: means of numbers.",
		((long,cohesiveThresholdIter,10,,"Iteration until which new contacts are bonds; negative: always."))
		((string,error,,(Attr::noSave|Attr::readonly),"What stopped the run; empty if nothing did."))
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust);

class Law2_ScGeom_LinearBondPhys_Rust : public LawFunctor {
	LawEnergies energies { "linearBondDamage", "linearBondViscous", "linearBondIntegration", "linearBondElastic" };

public:
	string               fill(ConcordemLinearBondContact&, const LinearBondPhys_Rust&, const Interaction&) const;
	ConcordemBondOutcome compute(ConcordemLinearBondContact& c) const { return concordem_yade_linear_bond(&c); }
	string               store(const ConcordemLinearBondContact&, ConcordemBondOutcome, LinearBondPhys_Rust&) const;
	void                 show(const ConcordemLinearBondContact& c, LinearBondPhys_Rust& phys) const { phys.force = read(c.force); }
	void                 addEnergies(const ConcordemLinearBondContact& c)
	{
		energies.add(*scene->energy, { c.damageEnergy, c.viscousEnergy, c.integrationEnergy, c.storedEnergy });
	}
	bool go(shared_ptr<IGeom>&, shared_ptr<IPhys>&, Interaction*) override;
	FUNCTOR2D(ScGeom, LinearBondPhys_Rust);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS(Law2_ScGeom_LinearBondPhys_Rust, LawFunctor,
		"The brittle linear bond of ConcorDEM between the centres of two spheres, with increments of finite rotations. Where particles deform, it takes their widening off the elongation; DeformableParticles_Rust finds it. A bond that breaks is deleted. With O.trackEnergy, O.energy gets linearBondElastic, linearBondDamage, linearBondViscous, and linearBondIntegration (error of the work rule in the step that breaks). What is not a number stops the run and is told in `error`.",
		((long,broken,0,(Attr::readonly),"Bonds that broke."))
		((string,error,,(Attr::noSave|Attr::readonly),"What stopped the run; empty if nothing did."))
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Law2_ScGeom_LinearBondPhys_Rust);

class DeformableParticles_Rust : public GlobalEngine {
	shared_ptr<ConcordemDeformationScratch> scratch;
	int                              storedId = -1, lagId = -1, otherId = -1, reactionsId = -1;
	void                             addEnergies(const struct ::ConcordemDeformationEnergies&);

public:
	void action() override;
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS(DeformableParticles_Rust, GlobalEngine,
		"Strains the particles of LinearBondMat_Rust (Madan 2019): from the forces of their bonds in this step, and the reactions of blockedDOFs, follow one uniform stress and strain of each, which the law sees in the next step. Put it behind InteractionLoop. YADE's contacts and forces do not strain. Results are in O.bodies[...].state (DeformableState_Rust). With O.trackEnergy, O.energy gets deformationElastic, deformationLag, deformationOther (of forces that strain without feeling it), and deformationReactions (less the work of reactions on the outer half of their particles).",
		((string,condition,"solid",,"Which strains go with which stresses: solid (spheres); plane-strain, plane-stress (discs of unit depth in the plane z = const)."))
		((bool,dashpots,false,,"Whether forces of dashpots strain the particles, too."))
		((int,threads,0,,"Threads for the particles; 0: as many as YADE has. The result does not depend on it."))
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(DeformableParticles_Rust);

} // namespace yade
