/* Cohesive beams: the law functor, its physics, and the functor that makes it.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "beams.hpp"
#include <core/EnergyTracker.hpp>
#include <cmath>

namespace yade {

YADE_PLUGIN((BeamMat_Rust)(BeamPhys_Rust)(Ip2_BeamMat_BeamMat_BeamPhys_Rust)(Law2_ScGeom6D_BeamPhys_Rust));

namespace {

	const vector<string> models { "euler-bernoulli", "timoshenko", "dual-spring", "spring" };
	const vector<string> bendingTerms { "mid-section", "half-sum", "larger-end" };

	/* Place of a word, or what is wrong with it in `why`. */
	int place(const vector<string>& words, const string& word, const char* attribute, string& why)
	{
		for (size_t k = 0; k < words.size(); k++)
			if (words[k] == word) return int(k);
		why = string("BeamMat_Rust.") + attribute + " is \"" + word + "\"; it may be ";
		for (size_t k = 0; k < words.size(); k++)
			why += (k ? ", \"" : "\"") + words[k] + "\"";
		return 0;
	}

} // namespace

/* Mean radius of the spheres of such materials, counted once in every step that needs it. */
Real Ip2_BeamMat_BeamMat_BeamPhys_Rust::meanRadius()
{
	if (countedIn == scene && countedAt == scene->iter) return countedRadius;
	Real   sum   = 0;
	size_t count = 0;
	for (const auto& body : *scene->bodies) {
		if (!body || !dynamic_cast<const BeamMat_Rust*>(body->material.get())) continue;
		if (const auto* ball = dynamic_cast<const Sphere*>(body->shape.get())) sum += ball->radius, count++;
	}
	countedRadius = sum / count;
	countedIn     = scene;
	countedAt     = scene->iter;
	return countedRadius;
}

/* The beam between two materials; what is wrong with them, or nothing. */
string Ip2_BeamMat_BeamMat_BeamPhys_Rust::make(const BeamMat_Rust& one, const BeamMat_Rust& two, BeamPhys_Rust& phys)
{
	string why;
	if (one.model != two.model) return "the materials have the models \"" + one.model + "\" and \"" + two.model + "\"; give both the same";
	if (one.bendingTerm != two.bendingTerm)
		return "the materials have the bending terms \"" + one.bendingTerm + "\" and \"" + two.bendingTerm + "\"; give both the same";
	phys.model       = place(models, one.model, "model", why);
	phys.bendingTerm = place(bendingTerms, one.bendingTerm, "bendingTerm", why);
	if (!why.empty()) return why;
	for (const BeamMat_Rust* material : { &one, &two })
		if ((material->radius > 0) == (material->radiusRatio > 0))
			return "BeamMat_Rust needs a positive radiusRatio or a positive radius, and not both; it has radiusRatio = "
			        + std::to_string(material->radiusRatio) + ", radius = " + std::to_string(material->radius) + " m";
	if ((one.radius > 0) != (two.radius > 0)) return "one material gives radius, the other radiusRatio; give both the same";
	const Real radius    = one.radius > 0 ? mean(one.radius, two.radius) : mean(one.radiusRatio, two.radiusRatio) * meanRadius();
	phys.crossSection    = M_PI * (radius * radius);
	phys.young           = mean(one.young, two.young);
	phys.poisson         = mean(one.poisson, two.poisson);
	phys.tensileStrength = mean(one.tensileStrength, two.tensileStrength);
	if (phys.model == 1) phys.shear = mean(one.shearCoefficient, two.shearCoefficient);
	if (phys.model == 2) phys.shear = mean(one.shearRatio, two.shearRatio);
	phys.tangensOfFrictionAngle = std::tan(std::min(one.frictionAngle, two.frictionAngle));
	return "";
}

void Ip2_BeamMat_BeamMat_BeamPhys_Rust::go(const shared_ptr<Material>& one, const shared_ptr<Material>& two, const shared_ptr<Interaction>& I)
{
	if (I->phys) return;
	const bool bonds = (cohesiveThresholdIter < 0 || scene->iter < cohesiveThresholdIter) && isBall(scene, I->id1) && isBall(scene, I->id2);
	string     why;
	shared_ptr<BeamPhys_Rust> phys(new BeamPhys_Rust);
#pragma omp critical(concordem_beams)
	{
		if (seenIn != scene || seenAt != scene->iter) {
			laws   = lawsOf<Law2_ScGeom6D_BeamPhys_Rust>(*scene);
			seenIn = scene, seenAt = scene->iter;
		}
		if (!laws.ours) why = "InteractionLoop has no Law2_ScGeom6D_BeamPhys_Rust";
		else if (bonds)
			why = make(*YADE_CAST<BeamMat_Rust*>(one.get()), *YADE_CAST<BeamMat_Rust*>(two.get()), *phys);
		else if (!laws.frictional)
			why = "this contact has no beam, and InteractionLoop has no law of FrictPhys for it; add Law2_ScGeom_FrictPhys_CundallStrack()";
	}
	if (!why.empty()) {
		stopRun(*scene, "Ip2_BeamMat_BeamMat_BeamPhys_Rust", error, *I, why);
		refuseAlways<Law2_ScGeom6D_BeamPhys_Rust>(scene, *I, phys);
	} else if (bonds) {
		I->phys = phys;
	} else {
		Ip2_FrictMat_FrictMat_FrictPhys::go(one, two, I);
	}
}

bool Law2_ScGeom6D_BeamPhys_Rust::stop(const Interaction& I, const string& reason)
{
	stopRun(*scene, "Law2_ScGeom6D_BeamPhys_Rust", error, I, reason);
	return true;
}

void Law2_ScGeom6D_BeamPhys_Rust::addEnergies(const ConcordemBeamContact& c)
{
	EnergyTracker& all = *scene->energy;
	// Names are given once, by one thread.
	if (storedId < 0) {
#pragma omp critical(concordem_energy)
		if (storedId < 0) {
			all.findId("beamDamage", damageId), all.findId("beamIntegration", integrationId);
			int id = -1;
			all.findId("beamElastic", id, /*reset at every step*/ true);
			storedId = id;
		}
	}
	all.add(c.damageEnergy, "beamDamage", damageId);
	all.add(c.integrationEnergy, "beamIntegration", integrationId);
	all.add(c.storedEnergy, "beamElastic", storedId, true);
}

bool Law2_ScGeom6D_BeamPhys_Rust::go(shared_ptr<IGeom>&, shared_ptr<IPhys>& physics, Interaction* I)
{
	BeamPhys_Rust& phys = *static_cast<BeamPhys_Rust*>(physics.get());
	if (phys.refLength < 0) {
		stopAgain(*scene);
		return true;
	}
	if (!phys.intact) return false;
	const auto motion = [&](Body::id_t id) -> ConcordemBodyMotion {
		const State& s = *Body::byId(id, scene)->state;
		return { s.pos.data(), s.vel.data(), s.angVel.data(), s.ori.coeffs().data() };
	};
	ConcordemBeamContact c;
	c.parameters = { phys.young, phys.poisson, phys.shear, phys.tensileStrength, phys.crossSection, phys.refLength, phys.model, phys.bendingTerm };
	c.bodies[0]  = motion(I->id1);
	c.bodies[1]  = motion(I->id2);
	put(c.shift, scene->isPeriodic ? scene->cell->intrShiftPos(I->cellDist) : Vector3r(Vector3r::Zero()));
	put(c.shiftVelocity, scene->isPeriodic ? scene->cell->intrShiftVel(I->cellDist) : Vector3r(Vector3r::Zero()));
	c.dt            = scene->dt;
	c.restDirection = phys.restDirection.data();
	c.restRotation  = phys.restRotation.data();

	const int outcome = concordem_yade_beam(&c);
	if (outcome == -3) return stop(*I, "internal error of concordem, please report it");
	// Parameters are looked at in the first step, and where they may be the reason of what went wrong: attributes can be changed.
	if (outcome < 0 || phys.refLength <= 0) {
		double k[4];
		Reason reason;
		if (concordem_yade_beam_stiffness(&c.parameters, &k, reason) < 0) {
			// It has not begun: the next step looks at it again.
			if (phys.refLength <= 0) phys.restDirection = phys.restRotation = Vector3r::Zero();
			return stop(*I, reason.text);
		}
		if (outcome < 0) return stop(*I, "the force is not a number; is the time step too large, or are two bodies in one place?");
		phys.refLength = c.parameters.length;
		phys.kn = k[0], phys.ks = k[1], phys.kr = k[2], phys.ktw = k[3];
	}
	if (scene->trackEnergy) addEnergies(c);
	if (outcome == 1) {
#pragma omp atomic
		broken++;
		return false;
	}
	const Vector3r f = read(c.force), n = read(c.normal);
	phys.normalForce = -f.dot(n) * n;
	phys.shearForce  = -f - phys.normalForce;
	phys.moment      = read(c.moment);
	scene->forces.addForce(I->id1, f);
	scene->forces.addForce(I->id2, -f);
	scene->forces.addTorque(I->id1, read(c.torque[0]));
	scene->forces.addTorque(I->id2, read(c.torque[1]));
	return true;
}

} // namespace yade
