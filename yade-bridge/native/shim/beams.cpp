/* Cohesive beams: the law functor, its physics, and the Ip2 functor.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "beams.hpp"
#include <core/Body.hpp>
#include <cmath>

namespace yade {

YADE_PLUGIN((BeamMat_Rust)(BeamPhys_Rust)(Ip2_BeamMat_BeamMat_BeamPhys_Rust)(Law2_ScGeom6D_BeamPhys_Rust));

namespace {

	const vector<string> models { "euler-bernoulli", "timoshenko", "dual-spring", "spring" };
	const vector<string> bendingTerms { "mid-section", "half-sum", "larger-end" };

	/* Index of a word; sets `why` if the word is unknown. */
	int indexOf(const vector<string>& words, const string& word, const char* attribute, string& why)
	{
		for (size_t k = 0; k < words.size(); k++)
			if (words[k] == word) return int(k);
		why = string("BeamMat_Rust.") + attribute + " is \"" + word + "\"; give one of ";
		for (size_t k = 0; k < words.size(); k++)
			why += (k ? ", \"" : "\"") + words[k] + "\"";
		return 0;
	}

} // namespace

/* Mean radius of the spheres of BeamMat_Rust, computed at most once per step. */
Real Ip2_BeamMat_BeamMat_BeamPhys_Rust::meanRadius()
{
	if (!std::isnan(countedRadius)) return countedRadius;
	Real   sum   = 0;
	size_t count = 0;
	for (const auto& body : *scene->bodies) {
		if (!body || !dynamic_cast<const BeamMat_Rust*>(body->material.get())) continue;
		if (const auto* ball = dynamic_cast<const Sphere*>(body->shape.get())) sum += ball->radius, count++;
	}
	countedRadius = sum / count;
	return countedRadius;
}

/* Set the parameters of the beam between two materials; returns an error message, or an empty string. */
string Ip2_BeamMat_BeamMat_BeamPhys_Rust::make(const Interaction&, const BeamMat_Rust& one, const BeamMat_Rust& two, BeamPhys_Rust& phys)
{
	string why;
	if (one.model != two.model) return "the materials have the models \"" + one.model + "\" and \"" + two.model + "\"; give both the same";
	if (one.bendingTerm != two.bendingTerm)
		return "the materials have the bending terms \"" + one.bendingTerm + "\" and \"" + two.bendingTerm + "\"; give both the same";
	phys.model       = indexOf(models, one.model, "model", why);
	phys.bendingTerm = indexOf(bendingTerms, one.bendingTerm, "bendingTerm", why);
	if (!why.empty()) return why;
	for (const BeamMat_Rust* material : { &one, &two })
		if ((material->radius > 0) == (material->radiusRatio > 0))
			return "BeamMat_Rust needs either a positive radiusRatio or a positive radius; it has radiusRatio = "
			        + std::to_string(material->radiusRatio) + ", radius = " + std::to_string(material->radius) + " m";
	if ((one.radius > 0) != (two.radius > 0)) return "one material has radius, the other radiusRatio; give both materials the same attribute";
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
	makeBondOrContact<Law2_ScGeom6D_BeamPhys_Rust, BeamPhys_Rust, BeamMat_Rust>(*this, "beam", one, two, I);
}

string Law2_ScGeom6D_BeamPhys_Rust::fill(ConcordemBeamContact& c, BeamPhys_Rust& phys, const Interaction& I) const
{
	c.parameters = { phys.young, phys.poisson, phys.shear, phys.tensileStrength, phys.crossSection, phys.refLength, phys.model, phys.bendingTerm };
	c.bodies[0]  = motionOf(*Body::byId(I.id1, scene)->state);
	c.bodies[1]  = motionOf(*Body::byId(I.id2, scene)->state);
	put(c.shift, imageShift(*scene, I));
	put(c.shiftVelocity, imageVelocity(*scene, I));
	c.dt            = scene->dt;
	c.restDirection = phys.restDirection.data();
	c.restRotation  = phys.restRotation.data();
	return string();
}

/* The library has already written the history. Parameters are checked in the first step and after a failure, because scripts can change
   attributes. */
string Law2_ScGeom6D_BeamPhys_Rust::store(ConcordemBeamContact& c, ConcordemBondOutcome outcome, BeamPhys_Rust& phys) const
{
	const bool failed = int(outcome) < 0, first = phys.refLength <= 0;
	if (!failed && !first) return string();
	double k[4];
	Reason reason;
	if (concordem_yade_beam_stiffness(&c.parameters, &k, reason) < 0) {
		// Without a reference length, the next step checks the beam again.
		if (first) phys.restDirection = phys.restRotation = Vector3r::Zero();
		return reason.text;
	}
	if (failed) return "the force is not finite; reduce the time step, and check that no two bodies coincide";
	phys.refLength = c.parameters.length;
	phys.kn = k[0], phys.ks = k[1], phys.kr = k[2], phys.ktw = k[3];
	return string();
}

bool Law2_ScGeom6D_BeamPhys_Rust::go(shared_ptr<IGeom>&, shared_ptr<IPhys>& physics, Interaction* I)
{
	return stepBond<ConcordemBeamContact>(*this, *static_cast<BeamPhys_Rust*>(physics.get()), *I);
}

} // namespace yade
