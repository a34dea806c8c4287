/* Linear bonds between particles that may deform: the law functor, its physics, the Ip2 functor, and the deformation pass.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "linear_bonds.hpp"
#include <core/Body.hpp>
#include <cmath>

namespace yade {

YADE_PLUGIN((DeformableState_Rust)(LinearBondMat_Rust)(LinearBondPhys_Rust)(Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust)(
        Law2_ScGeom_LinearBondPhys_Rust)(DeformableParticles_Rust));

namespace {

	/* Error message about DeformableParticles_Rust in the scene, or an empty string. */
	string checkPass(const Scene& scene)
	{
		int loop = -1, pass = -1, at = 0;
		for (const auto& engine : scene.engines) {
			if (dynamic_cast<const InteractionLoop*>(engine.get())) loop = at;
			if (dynamic_cast<const DeformableParticles_Rust*>(engine.get()) && !engine->dead) {
				if (pass >= 0) return "O.engines has more than one DeformableParticles_Rust; keep one";
				pass = at;
			}
			at++;
		}
		if (pass < 0)
			return "the particles deform (particleYoung), but O.engines has no active DeformableParticles_Rust; put one after "
			       "InteractionLoop";
		if (loop < 0) return "DeformableParticles_Rust needs the forces of an InteractionLoop, but O.engines has none; add one";
		if (pass < loop) return "DeformableParticles_Rust needs the forces of the step; put it after InteractionLoop in O.engines";
		return "";
	}

	const LinearBondMat_Rust* bondedMaterial(const Body& body) { return dynamic_cast<const LinearBondMat_Rust*>(body.material.get()); }

	ConcordemElasticity elasticity(const LinearBondMat_Rust& material) { return { material.particleYoung, material.particlePoisson }; }

} // namespace

ConcordemLinearBondParameters LinearBondPhys_Rust::parameters() const
{
	return { kn, ks, dampingRatio, normalStrength, shearStrength, subtractInitialGap };
}

/* Set the parameters of the bond between two materials; returns an error message, or an empty string. */
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
	if (!wrongPass.empty()) return wrongPass;
	for (Body::id_t id : { I.id1, I.id2 })
		if (!Body::byId(id, scene)->isStandalone()) return "body " + std::to_string(id) + " is a clump member, which cannot deform";
	return "";
}

void Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust::look() { wrongPass = checkPass(*scene); }

void Ip2_LinearBondMat_LinearBondMat_LinearBondPhys_Rust::go(
        const shared_ptr<Material>& one, const shared_ptr<Material>& two, const shared_ptr<Interaction>& I)
{
	makeBondOrContact<Law2_ScGeom_LinearBondPhys_Rust, LinearBondPhys_Rust, LinearBondMat_Rust>(*this, "bond", one, two, I);
}

string Law2_ScGeom_LinearBondPhys_Rust::fill(ConcordemLinearBondContact& c, const LinearBondPhys_Rust& phys, const Interaction& I) const
{
	if (phys.deforms && phys.refLength > 0 && !phys.strained)
		return "its particles deform, but DeformableParticles_Rust has not run since the last step; put an active one after InteractionLoop";
	for (int k = 0; k < 2; k++) {
		const Body& body  = *Body::byId(k ? I.id2 : I.id1, scene);
		const auto* shape = dynamic_cast<const DeformableState_Rust*>(body.state.get());
		if (phys.deforms && !shape) return "the state of body " + std::to_string(body.id) + " is no longer a DeformableState_Rust; do not replace it";
		c.bodies[k] = { motionOf(*body.state),
			        static_cast<const Sphere&>(*body.shape).radius,
			        body.state->mass,
			        { phys.deforms ? shape->widening.data() : nullptr, phys.deforms ? shape->wideningBefore.data() : nullptr } };
	}
	c.parameters = phys.parameters();
	put(c.shift, imageShift(*scene, I));
	c.dt              = scene->dt;
	c.referenceLength = phys.refLength;
	c.length          = phys.length;
	put(c.normal, phys.direction);
	put(c.shearDisplacement, phys.shearDisplacement);
	c.normalDashpot = phys.normalDashpot;
	put(c.shearDashpot, phys.shearDashpot);
	return string();
}

string Law2_ScGeom_LinearBondPhys_Rust::store(const ConcordemLinearBondContact& c, ConcordemBondOutcome outcome, LinearBondPhys_Rust& phys) const
{
	if (int(outcome) < 0) {
		// Scripts can change attributes.
		const ConcordemElasticity rigid[2] = { { std::numeric_limits<Real>::infinity(), 0 }, { std::numeric_limits<Real>::infinity(), 0 } };
		Reason                    reason;
		if (concordem_yade_linear_bond_check(&c.parameters, &rigid, reason) < 0) return reason.text;
		return "the force is not finite; reduce the time step, and check that no two bodies coincide";
	}
	phys.refLength         = c.referenceLength;
	phys.length            = c.length;
	phys.direction         = read(c.normal);
	phys.shearDisplacement = read(c.shearDisplacement);
	phys.normalDashpot     = c.normalDashpot;
	phys.shearDashpot      = read(c.shearDashpot);
	phys.strained          = false;
	return string();
}

bool Law2_ScGeom_LinearBondPhys_Rust::go(shared_ptr<IGeom>&, shared_ptr<IPhys>& physics, Interaction* I)
{
	return stepBond<ConcordemLinearBondContact>(*this, *static_cast<LinearBondPhys_Rust*>(physics.get()), *I);
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
	const string wrong = checkPass(*scene);
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
		scratch = shared_ptr<ConcordemDeformationScratch>(made, concordem_yade_deformation_delete);
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
			               + " has LinearBondMat_Rust, but its state is not a DeformableState_Rust; set the material when you create the sphere, or set "
			                 "body.state = body.material.newAssocState()");
		const auto found = numbers.emplace(material, int(materials.size()));
		if (found.second) materials.push_back(elasticity(*material));
		row[body->id] = int(bodies.size());
		bodies.push_back({ uint32_t(found.first->second), s->blockedDOFs, sphere->radius, s->dyad.data(), s->usedDyad.data(), s->otherDyad.data(),
		                   s->reactionDyad.data(), s->widening.data(), s->wideningBefore.data(), s->stress.data() });
	}

	// Sort by the ids of both bodies, because the order of O.interactions depends on the threads, and the sums must not.
	vector<ConcordemBondForce>  bonds;
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
				               + ", which has a bond, is no longer a LinearBondMat_Rust; do not replace it");
			bonds.push_back({ { uint32_t(row[I.id1]), uint32_t(row[I.id2]) }, phys->direction.data(), phys->force.data(), phys->normalDashpot,
			                  phys->shearDashpot.data() });
			seen.push_back(phys);
		}
	}
	const ConcordemDeformableScene given
	        = { bodies.data(), bodies.size(), bonds.data(), bonds.size(), materials.data(), materials.size(), condition.c_str(), dashpots };
	ConcordemDeformationEnergies energies;
	Reason                       reason;
	if (concordem_yade_deformation(scratch.get(), &given, &energies, reason) < 0) refuse(*scene, reason.text);
	for (LinearBondPhys_Rust* phys : seen)
		phys->strained = true;
	if (scene->trackEnergy) addEnergies(energies);
}

} // namespace yade
