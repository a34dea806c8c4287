/* YADE classes for linear bonds between particles that may deform: material, state of the particles, physics, Ip2 functor, Law2 functor,
   and the deformation pass. ConcorDEM computes the law and the pass.

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
		"State of a particle that may deform, with one uniform strain. Tensors are Voigt vectors xx, yy, zz, yz, xz, xy without factors; tension positive.",
		((Vector6r,stress,Vector6r::Zero(),(Attr::readonly),"Stress from the bond forces of the last step and the reactions of blockedDOFs, Pa."))
		((Vector6r,widening,Vector6r::Zero(),(Attr::readonly),"Surface displacement in the next step, m: radius times strain, positive outward."))
		((Vector6r,wideningBefore,Vector6r::Zero(),(Attr::readonly),"Surface displacement in the last step, m."))
		((Vector6r,dyad,Vector6r::Zero(),(Attr::readonly|Attr::hidden),"History, N: particle virial of all forces of the last step that strain the particle."))
		((Vector6r,usedDyad,Vector6r::Zero(),(Attr::readonly|Attr::hidden),"History, N: particle virial that gave the strain of the last step."))
		((Vector6r,otherDyad,Vector6r::Zero(),(Attr::readonly|Attr::hidden),"History, N: particle virial of forces that do not depend on the strain."))
		((Vector6r,reactionDyad,Vector6r::Zero(),(Attr::readonly|Attr::hidden),"History, N: particle virial of the reactions of blockedDOFs.")),
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
		"Material of spheres joined by linear bonds; the spheres may deform (`particleYoung`). `young`, `poisson`, and `frictionAngle` apply to unbonded contacts, by YADE's rule.",
		((Real,normalStiffness,NaN,,"Normal stiffness of a bond, N/m."))
		((Real,shearStiffness,0,,"Shear stiffness of a bond, N/m."))
		((Real,dampingRatio,0,,"Dashpots of a bond, as a fraction of the critical damping of the pair."))
		((Real,normalStrength,std::numeric_limits<Real>::infinity(),,"Tensile force at which a bond breaks, N; infinite: never."))
		((Real,shearStrength,std::numeric_limits<Real>::infinity(),,"Shear force at which a bond breaks, N; infinite: never."))
		((bool,subtractInitialGap,true,,"If True, a bond is unstrained at the distance at which it is created; if False, at the distance at which the spheres touch."))
		((Real,particleYoung,std::numeric_limits<Real>::infinity(),,"Young's modulus of the particles, Pa; infinite: rigid. A finite value needs DeformableParticles_Rust in O.engines."))
		((Real,particlePoisson,0,,"Poisson's ratio of the particles.")),
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
		"A linear bond with its history; `kn` and `ks` (N/m) are its stiffnesses.",
		((Real,dampingRatio,0,,"Dashpots, as a fraction of the critical damping of the pair."))
		((Real,normalStrength,std::numeric_limits<Real>::infinity(),,"Tensile strength, N."))
		((Real,shearStrength,std::numeric_limits<Real>::infinity(),,"Shear strength, N."))
		((bool,subtractInitialGap,true,,"If True, it is unstrained at refLength; if False, at the distance at which the spheres touch."))
		((bool,deforms,false,,"Whether at least one of its particles deforms."))
		((Real,refLength,0,,"Distance of the centers at bonding, m; set in the first step. A negative value marks a contact that could not be created; it stops the run."))
		((bool,intact,true,,"If False, the bond is deleted in the next step without force and energy."))
		((Vector3r,force,Vector3r::Zero(),(Attr::readonly),"Force on the first body in the last step, N."))
		((Vector3r,direction,Vector3r::Zero(),(Attr::readonly),"History: unit vector from the first body to the second."))
		((Real,length,0,(Attr::readonly),"History: distance of the centers, m."))
		((Vector3r,shearDisplacement,Vector3r::Zero(),(Attr::readonly),"History: shear displacement of the second body since bonding, m."))
		((Real,normalDashpot,0,(Attr::readonly),"History: normal force of the dashpot, N."))
		((Vector3r,shearDashpot,Vector3r::Zero(),(Attr::readonly),"History: shear force of the dashpot, N."))
		((bool,strained,false,(Attr::readonly|Attr::hidden),"Whether DeformableParticles_Rust has used the force of the last step.")),
		createIndex();
	);
	// clang-format on
	REGISTER_CLASS_INDEX(LinearBondPhys_Rust, FrictPhys);
};
REGISTER_SERIALIZABLE(LinearBondPhys_Rust);

class Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust : public Ip2_FrictMat_FrictMat_FrictPhys {
	string wrongPass; // error message about DeformableParticles_Rust in this step

public:
	LastLook last;
	void     look();
	string   make(const Interaction&, const LinearBondMat_Rust&, const LinearBondMat_Rust&, LinearBondPhys_Rust&);
	void go(const shared_ptr<Material>&, const shared_ptr<Material>&, const shared_ptr<Interaction>&) override;
	FUNCTOR2D(LinearBondMat_Rust, LinearBondMat_Rust);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS(Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust, Ip2_FrictMat_FrictMat_FrictPhys,
		"Creates linear bonds between spheres of LinearBondMat_Rust until iteration cohesiveThresholdIter (negative: always). Later contacts, and contacts with facets and other shapes, get the FrictPhys of the base class, so InteractionLoop needs a law such as Law2_ScGeom_FrictPhys_CundallStrack. Between two materials, parameters are averaged.",
		((long,cohesiveThresholdIter,10,,"New contacts are bonds until this iteration; negative: always."))
		((string,error,,(Attr::noSave|Attr::readonly),"Error that stopped the run; empty if there was none."))
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
		"ConcorDEM's linear bond between the centers of two spheres, with finite rotation increments. If particles deform, their surface displacement (computed by DeformableParticles_Rust) is subtracted from the elongation. A broken bond is deleted. With O.trackEnergy, O.energy gets linearBondElastic, linearBondDamage, linearBondViscous, and linearBondIntegration (error of the work rule in the step in which a bond breaks). A force that is not finite stops the run and sets `error`.",
		((long,broken,0,(Attr::readonly),"Number of broken bonds."))
		((string,error,,(Attr::noSave|Attr::readonly),"Error that stopped the run; empty if there was none."))
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
		"Deforms the particles of LinearBondMat_Rust (Madan 2019). It computes one uniform stress and strain per particle from the bond forces of this step and the reactions of blockedDOFs; the law uses the strain in the next step. Put it after InteractionLoop. YADE's contacts and forces do not strain particles. Results are in O.bodies[...].state (DeformableState_Rust). With O.trackEnergy, O.energy gets deformationElastic, deformationLag, deformationOther (forces that strain a particle but do not depend on its strain), and deformationReactions (minus the work of reactions on the outer half of their particles).",
		((string,condition,"solid",,"Elastic condition: solid (spheres); plane-strain or plane-stress (discs of unit depth in the plane z = const)."))
		((bool,dashpots,false,,"Whether dashpot forces also strain the particles."))
		((int,threads,0,,"Number of threads for the particles; 0: as many as YADE uses. The result does not depend on it."))
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(DeformableParticles_Rust);

} // namespace yade
