/* Brittle linear bonds between particles that may deform: the law functor, its physics, the functor that makes it, and the pass.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "linear_bonds.hpp"
#include <core/Body.hpp>
#include <core/EnergyTracker.hpp>
#include <cmath>

namespace yade {

YADE_PLUGIN((DeformableState_Rust)(LinearBondMat_Rust)(LinearBondPhys_Rust)(Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust)(
        Law2_ScGeom_LinearBondPhys_Rust)(DeformableParticles_Rust));

namespace {

	/* What is wrong with the pass of the scene; empty if nothing is. */
	string wrongPass(const Scene& scene)
	{
		int loop = -1, pass = -1, at = 0;
		for (const auto& engine : scene.engines) {
			if (dynamic_cast<const InteractionLoop*>(engine.get())) loop = at;
			if (dynamic_cast<const DeformableParticles_Rust*>(engine.get()) && !engine->dead) {
				if (pass >= 0) return "O.engines has more than one DeformableParticles_Rust; leave one";
				pass = at;
			}
			at++;
		}
		if (pass < 0)
			return "the particles deform (particleYoung), but O.engines has no DeformableParticles_Rust, or a dead one; put one behind "
			       "InteractionLoop";
		if (loop < 0) return "O.engines has no InteractionLoop, whose forces DeformableParticles_Rust needs";
		if (pass < loop) return "DeformableParticles_Rust must stand behind InteractionLoop in O.engines: it needs the forces of the step";
		return "";
	}

	const LinearBondMat_Rust* bondedMaterial(const Body& body) { return dynamic_cast<const LinearBondMat_Rust*>(body.material.get()); }

	ConcordemElasticity elasticity(const LinearBondMat_Rust& material) { return { material.particleYoung, material.particlePoisson }; }

} // namespace

ConcordemLinearBondParameters LinearBondPhys_Rust::parameters() const
{
	return { kn, ks, dampingRatio, normalStrength, shearStrength, subtractInitialGap };
}

/* The bond between two materials; what is wrong with them, or nothing. */
string Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust::make(
        const Interaction& I, const LinearBondMat_Rust& one, const LinearBondMat_Rust& two, LinearBondPhys_Rust& phys)
{
	phys.kn                     = mean(one.normalStiffness, two.normalStiffness);
	phys.ks                     = mean(one.shearStiffness, two.shearStiffness);
	phys.dampingRatio           = mean(one.dampingRatio, two.dampingRatio);
	phys.normalStrength         = mean(one.normalStrength, two.normalStrength);
	phys.shearStrength          = mean(one.shearStrength, two.shearStrength);
	phys.subtractInitialGap     = one.subtractInitialGap && two.subtractInitialGap;
	phys.tangensOfFrictionAngle = std::tan(std::min(one.frictionAngle, two.frictionAngle));
	phys.deforms                = one.deforms() || two.deforms();
	const ConcordemLinearBondParameters parameters    = phys.parameters();
	const ConcordemElasticity           particles[2] = { elasticity(one), elasticity(two) };
	Reason                              reason;
	if (concordem_yade_linear_bond_check(&parameters, &particles, reason) < 0) return reason.text;
	if (!phys.deforms) return "";
	if (!missingPass.empty()) return missingPass;
	for (Body::id_t id : { I.id1, I.id2 })
		if (!Body::byId(id, scene)->isStandalone()) return "body " + std::to_string(id) + " belongs to a clump; members of clumps cannot deform";
	return "";
}

void Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust::go(
        const shared_ptr<Material>& one, const shared_ptr<Material>& two, const shared_ptr<Interaction>& I)
{
	if (I->phys) return;
	const bool bonds = (cohesiveThresholdIter < 0 || scene->iter < cohesiveThresholdIter) && isBall(scene, I->id1) && isBall(scene, I->id2);
	string     why;
	shared_ptr<LinearBondPhys_Rust> phys(new LinearBondPhys_Rust);
#pragma omp critical(concordem_linear_bonds)
	{
		if (seenIn != scene || seenAt != scene->iter) {
			laws        = lawsOf<Law2_ScGeom_LinearBondPhys_Rust>(*scene);
			missingPass = wrongPass(*scene);
			seenIn = scene, seenAt = scene->iter;
		}
		if (!laws.ours) why = "InteractionLoop has no Law2_ScGeom_LinearBondPhys_Rust";
		else if (bonds)
			why = make(*I, *YADE_CAST<LinearBondMat_Rust*>(one.get()), *YADE_CAST<LinearBondMat_Rust*>(two.get()), *phys);
		else if (!laws.frictional)
			why = "this contact has no bond, and InteractionLoop has no law of FrictPhys for it; add Law2_ScGeom_FrictPhys_CundallStrack()";
	}
	if (!why.empty()) {
		stopRun(*scene, "Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust", error, *I, why);
		refuseAlways<Law2_ScGeom_LinearBondPhys_Rust>(scene, *I, phys);
	} else if (bonds) {
		I->phys = phys;
	} else {
		Ip2_FrictMat_FrictMat_FrictPhys::go(one, two, I);
	}
}

bool Law2_ScGeom_LinearBondPhys_Rust::stop(const Interaction& I, const string& reason)
{
	stopRun(*scene, "Law2_ScGeom_LinearBondPhys_Rust", error, I, reason);
	return true;
}

void Law2_ScGeom_LinearBondPhys_Rust::addEnergies(const ConcordemLinearBond& c)
{
	EnergyTracker& all = *scene->energy;
	// Names are given once, by one thread.
	if (storedId < 0) {
#pragma omp critical(concordem_energy)
		if (storedId < 0) {
			all.findId("linearBondDamage", damageId), all.findId("linearBondViscous", viscousId), all.findId("linearBondIntegration", integrationId);
			int id = -1;
			all.findId("linearBondElastic", id, /*reset at every step*/ true);
			storedId = id;
		}
	}
	all.add(c.damageEnergy, "linearBondDamage", damageId);
	all.add(c.viscousEnergy, "linearBondViscous", viscousId);
	all.add(c.integrationEnergy, "linearBondIntegration", integrationId);
	all.add(c.storedEnergy, "linearBondElastic", storedId, true);
}

bool Law2_ScGeom_LinearBondPhys_Rust::go(shared_ptr<IGeom>&, shared_ptr<IPhys>& physics, Interaction* I)
{
	LinearBondPhys_Rust& phys = *static_cast<LinearBondPhys_Rust*>(physics.get());
	if (phys.refLength < 0) {
		stopAgain(*scene);
		return true;
	}
	if (!phys.intact) return false;
	if (phys.deforms && phys.refLength > 0 && !phys.strained)
		return stop(
		        *I, "its particles deform, but DeformableParticles_Rust has not run since the last step; put one, not dead, behind InteractionLoop");
	ConcordemLinearBond c;
	for (int k = 0; k < 2; k++) {
		const Body&  body  = *Body::byId(k ? I->id2 : I->id1, scene);
		const State& s     = *body.state;
		const auto*  shape = dynamic_cast<const DeformableState_Rust*>(&s);
		if (phys.deforms && !shape) return stop(*I, "the state of body " + std::to_string(body.id) + " is no DeformableState_Rust any more");
		c.bodies[k] = { { s.pos.data(), s.vel.data(), s.angVel.data(), s.ori.coeffs().data() },
			         static_cast<const Sphere&>(*body.shape).radius,
			         s.mass,
			         { phys.deforms ? shape->widening.data() : nullptr, phys.deforms ? shape->wideningBefore.data() : nullptr } };
	}
	c.parameters = phys.parameters();
	put(c.shift, scene->isPeriodic ? scene->cell->intrShiftPos(I->cellDist) : Vector3r(Vector3r::Zero()));
	c.dt              = scene->dt;
	c.referenceLength = phys.refLength;
	c.length          = phys.length;
	put(c.normal, phys.direction);
	put(c.shearDisplacement, phys.shearDisplacement);
	c.normalDashpot = phys.normalDashpot;
	put(c.shearDashpot, phys.shearDashpot);

	const int outcome = concordem_yade_linear_bond(&c);
	if (outcome == -3) return stop(*I, "internal error of concordem, please report it");
	if (outcome < 0) {
		// Attributes may have been changed.
		const ConcordemElasticity rigid[2] = { { std::numeric_limits<Real>::infinity(), 0 }, { std::numeric_limits<Real>::infinity(), 0 } };
		Reason                    reason;
		if (concordem_yade_linear_bond_check(&c.parameters, &rigid, reason) < 0) return stop(*I, reason.text);
		return stop(*I, "the force is not a number; is the time step too large, or are two bodies in one place?");
	}
	phys.refLength         = c.referenceLength;
	phys.length            = c.length;
	phys.direction         = read(c.normal);
	phys.shearDisplacement = read(c.shearDisplacement);
	phys.normalDashpot     = c.normalDashpot;
	phys.shearDashpot      = read(c.shearDashpot);
	phys.strained          = false;
	if (scene->trackEnergy) addEnergies(c);
	if (outcome == 1) {
#pragma omp atomic
		broken++;
		return false;
	}
	phys.force       = read(c.force);
	phys.normalForce = -phys.force.dot(phys.direction) * phys.direction;
	phys.shearForce  = -phys.force - phys.normalForce;
	scene->forces.addForce(I->id1, phys.force);
	scene->forces.addForce(I->id2, -phys.force);
	scene->forces.addTorque(I->id1, read(c.torque[0]));
	scene->forces.addTorque(I->id2, read(c.torque[1]));
	return true;
}

namespace {

	[[noreturn]] void refuse(const Scene& scene, const string& why)
	{
		throw std::runtime_error("DeformableParticles_Rust: at iteration " + std::to_string(scene.iter) + ": " + why);
	}

} // namespace

void DeformableParticles_Rust::addEnergies(const ConcordemDeformationEnergies& now)
{
	EnergyTracker& all = *scene->energy;
	all.set(now.stored, "deformationElastic", storedId);
	all.add(now.lag, "deformationLag", lagId);
	all.add(now.other, "deformationOther", otherId);
	all.add(-now.reactions, "deformationReactions", reactionsId);
}

void DeformableParticles_Rust::action()
{
	const string wrong = wrongPass(*scene);
	if (!wrong.empty()) refuse(*scene, wrong);
	if (!scratch) {
#ifdef YADE_OPENMP
		const int wanted = threads > 0 ? threads : omp_get_max_threads();
#else
		const int wanted = std::max(1, threads);
#endif
		Reason reason;
		auto*  made = concordem_yade_deformation_scratch(wanted, reason);
		if (!made) refuse(*scene, reason.text);
		scratch = shared_ptr<ConcordemDeformation>(made, concordem_yade_deformation_delete);
	}

	vector<ConcordemDeformableBody>          bodies;
	vector<ConcordemElasticity>              materials;
	std::map<const LinearBondMat_Rust*, int> numbers;
	vector<int>                              row(scene->bodies->size(), -1);
	for (const auto& body : *scene->bodies) {
		if (!body) continue;
		const LinearBondMat_Rust* material = bondedMaterial(*body);
		const auto*               sphere   = dynamic_cast<const Sphere*>(body->shape.get());
		if (!material || !sphere) continue;
		auto* s = dynamic_cast<DeformableState_Rust*>(body->state.get());
		if (!s)
			refuse(*scene,
			       "body " + std::to_string(body->id)
			               + " has LinearBondMat_Rust, but its state is no DeformableState_Rust: give the material when the sphere is made, or set "
			                 "body.state = body.material.newAssocState()");
		const auto found = numbers.emplace(material, int(materials.size()));
		if (found.second) materials.push_back(elasticity(*material));
		row[body->id] = int(bodies.size());
		bodies.push_back({ uint32_t(found.first->second), s->blockedDOFs, sphere->radius, s->dyad.data(), s->usedDyad.data(), s->otherDyad.data(),
		                   s->reactionDyad.data(), s->widening.data(), s->wideningBefore.data(), s->stress.data() });
	}

	// By the ids of both bodies, so that sums have one order, whatever the threads made of O.interactions.
	vector<ConcordemBondAnswer>  bonds;
	vector<LinearBondPhys_Rust*> seen;
	for (const auto& body : *scene->bodies) {
		if (!body || row[body->id] < 0) continue;
		for (auto other = body->intrs.upper_bound(body->id); other != body->intrs.end(); ++other) {
			const Interaction& I = *other->second;
			if (!I.isReal()) continue;
			auto* phys = dynamic_cast<LinearBondPhys_Rust*>(I.phys.get());
			if (!phys || phys->refLength <= 0) continue;
			if (row[I.id1] < 0 || row[I.id2] < 0)
				refuse(*scene,
				       "the material of body " + std::to_string(row[I.id1] < 0 ? I.id1 : I.id2)
				               + " is no LinearBondMat_Rust any more, but it has a bond");
			bonds.push_back({ { uint32_t(row[I.id1]), uint32_t(row[I.id2]) }, phys->direction.data(), phys->force.data(), phys->normalDashpot,
			                  phys->shearDashpot.data() });
			seen.push_back(phys);
		}
	}
	ConcordemDeformationEnergies energies;
	Reason                       reason;
	if (concordem_yade_deformation(
	            scratch.get(), bodies.data(), bodies.size(), bonds.data(), bonds.size(), materials.data(), materials.size(), condition.c_str(),
	            dashpots, &energies, reason)
	    < 0)
		refuse(*scene, reason.text);
	for (LinearBondPhys_Rust* phys : seen)
		phys->strained = true;
	if (scene->trackEnergy) addEnergies(energies);
}

} // namespace yade
