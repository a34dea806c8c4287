/* Concrete: the law functor, its physics, and the Ip2 functor.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "concrete.hpp"
#include "opened.hpp"
#include <pkg/common/Box.hpp>
#include <pkg/common/Facet.hpp>
#include <pkg/common/Wall.hpp>
#include <cmath>
#include <cstring>
#include <iomanip>
#include <sstream>

namespace yade {

// Axes with which ScGeom::rotate rotates a history vector.
struct SwingAxis {
	typedef Vector3r ScGeom::*type;
	friend type               opened(SwingAxis);
};
struct TwistAxis {
	typedef Vector3r ScGeom::*type;
	friend type               opened(TwistAxis);
};

template struct Open<SwingAxis, &ScGeom::orthonormal_axis>;
template struct Open<TwistAxis, &ScGeom::twist_axis>;

YADE_PLUGIN((CpmPhys_Rust)(Ip2_CpmMat_CpmMat_CpmPhys_Rust)(Law2_ScGeom_CpmPhys_Rust));

namespace {

	bool isPlane(int index)
	{
		return index == Facet::getClassIndexStatic() || index == Wall::getClassIndexStatic() || index == Box::getClassIndexStatic();
	}

	/* Set reference length, area, and stiffnesses in the first step of a contact. */
	void begin(Scene* scene, const ScGeom& geom, CpmPhys& phys, const Interaction& I)
	{
		const Body &one = *Body::byId(I.id1, scene), &two = *Body::byId(I.id2, scene);
		const int   first = one.shape->getClassIndex(), second = two.shape->getClassIndex(), ball = Sphere::getClassIndexStatic();
		if (first == ball && second == ball) {
			Real r = math::min(geom.refR1, geom.refR2);
			if (geom.refR2 <= 0) r = geom.refR1;
			if (geom.refR1 <= 0) r = geom.refR2;
			const Vector3r shift = scene->isPeriodic ? Vector3r(scene->cell->hSize * I.cellDist.cast<Real>()) : Vector3r::Zero();
			phys.refLength       = (two.state->pos - one.state->pos + shift).norm();
			phys.crossSection    = M_PI * (r * r);
			phys.refPD           = geom.refR1 + geom.refR2 - phys.refLength;
		} else if (isPlane(first) || isPlane(second)) {
			const Real r      = static_cast<const Sphere&>(*(isPlane(first) ? two : one).shape).radius;
			phys.refLength    = r;
			phys.crossSection = M_PI * (r * r);
			phys.refPD        = 0;
		}
		phys.kn          = phys.crossSection * phys.E / phys.refLength;
		phys.ks          = phys.crossSection * phys.G / phys.refLength;
		phys.epsFracture = phys.epsCrackOnset * phys.relDuctility;
	}

	void countBroken(const shared_ptr<Body>& body)
	{
		CpmState* state = dynamic_cast<CpmState*>(body->state.get());
		if (!state) return;
		const std::lock_guard<std::mutex> lock(state->updateMutex);
		state->numBrokenCohesive += 1;
	}

	const char* reasonOf(ConcordemCpmOutcome outcome)
	{
		switch (outcome) {
			case ConcordemCpmOutcome::NotANumber: return "the strain is NaN; reduce the time step, and check that the contact was created by its functors";
			case ConcordemCpmOutcome::DamageLaw: return "damLaw must be 0 or 1";
			default: return INTERNAL_ERROR;
		}
	}

} // namespace

void CpmPhys_Rust::preSave(CpmPhys_Rust&)
{
	history = { omega, epsN, kappaD, epsNPl, sigmaN, Fn, relResidualStrength };
	for (const Vector3r* v : { &epsT, &epsTPl, &sigmaT, &Fs })
		for (int k = 0; k < 3; k++)
			history.push_back((*v)[k]);
}

void CpmPhys_Rust::postLoad(CpmPhys_Rust&)
{
	// YADE also calls this when Python sets attributes; then there is no history.
	if (history.empty()) return;
	if (history.size() != 19) throw std::runtime_error("CpmPhys_Rust: the saved history has " + std::to_string(history.size()) + " reals, not 19");
	omega = history[0], epsN = history[1], kappaD = history[2], epsNPl = history[3];
	sigmaN = history[4], Fn = history[5], relResidualStrength = history[6];
	int at = 7;
	for (Vector3r* v : { &epsT, &epsTPl, &sigmaT, &Fs })
		for (int k = 0; k < 3; k++)
			(*v)[k] = history[at++];
	history.clear();
}

void Ip2_CpmMat_CpmMat_CpmPhys_Rust::go(const shared_ptr<Material>& one, const shared_ptr<Material>& two, const shared_ptr<Interaction>& I)
{
	if (I->phys) return;
	Ip2_CpmMat_CpmMat_CpmPhys::go(one, two, I);
	shared_ptr<CpmPhys_Rust> phys(new CpmPhys_Rust);
	const CpmPhys&           made = *YADE_CAST<CpmPhys*>(I->phys.get());
	phys->E                       = made.E;
	phys->G                       = made.G;
	phys->tanFrictionAngle        = made.tanFrictionAngle;
	phys->undamagedCohesion       = made.undamagedCohesion;
	phys->epsCrackOnset           = made.epsCrackOnset;
	phys->relDuctility            = made.relDuctility;
	phys->equivStrainShearContrib = made.equivStrainShearContrib;
	phys->dmgTau                  = made.dmgTau;
	phys->dmgRateExp              = made.dmgRateExp;
	phys->plTau                   = made.plTau;
	phys->plRateExp               = made.plRateExp;
	phys->isoPrestress            = made.isoPrestress;
	phys->neverDamage             = made.neverDamage;
	phys->damLaw                  = made.damLaw;
	phys->isCohesive              = made.isCohesive;
	I->phys                       = phys;
}

std::string difference(const CpmPhys& ours, const CpmPhys& theirs)
{
	std::ostringstream text;
	text << std::setprecision(17);
	const auto reals = [&](const char* name, const Real* one, const Real* two, int count) {
		if (std::memcmp(one, two, sizeof(Real) * count) == 0) return;
		text << "\n  " << name << ": ours";
		for (int k = 0; k < count; k++)
			text << ' ' << one[k];
		text << ", YADE's";
		for (int k = 0; k < count; k++)
			text << ' ' << two[k];
	};
#define CONCORDEM_SCALAR(name) reals(#name, &ours.name, &theirs.name, 1)
#define CONCORDEM_VECTOR(name) reals(#name, ours.name.data(), theirs.name.data(), 3)
	CONCORDEM_SCALAR(refLength), CONCORDEM_SCALAR(refPD), CONCORDEM_SCALAR(crossSection), CONCORDEM_SCALAR(epsFracture);
	CONCORDEM_SCALAR(kn), CONCORDEM_SCALAR(ks), CONCORDEM_SCALAR(epsN), CONCORDEM_SCALAR(epsNPl), CONCORDEM_SCALAR(kappaD);
	CONCORDEM_SCALAR(omega), CONCORDEM_SCALAR(sigmaN), CONCORDEM_SCALAR(relResidualStrength), CONCORDEM_SCALAR(Fn);
	CONCORDEM_VECTOR(epsT), CONCORDEM_VECTOR(epsTPl), CONCORDEM_VECTOR(sigmaT), CONCORDEM_VECTOR(Fs);
	CONCORDEM_VECTOR(normalForce), CONCORDEM_VECTOR(shearForce);
#undef CONCORDEM_SCALAR
#undef CONCORDEM_VECTOR
	return text.str();
}

void Law2_ScGeom_CpmPhys_Rust::stop(const Interaction& I, const string& reason)
{
	stopRun(*scene, "Law2_ScGeom_CpmPhys_Rust", error, I, reason);
}

/* Compute the same contact with YADE's law, in a separate scene that shares the bodies and receives the forces. */
void Law2_ScGeom_CpmPhys_Rust::check(
        const shared_ptr<IGeom>& geometry, const shared_ptr<CpmPhys>& before, const CpmPhys& after, Interaction* I, bool lives)
{
	static thread_local Scene* aside = nullptr; // one per thread, never deleted
	if (!aside) {
#pragma omp critical(concordem_error)
		aside = new Scene;
	}
	aside->bodies     = scene->bodies;
	aside->cell       = scene->cell;
	aside->isPeriodic = scene->isPeriodic;
	aside->iter       = scene->iter;
	aside->dt         = scene->dt;
	Law2_ScGeom_CpmPhys_Cpm yades;
	yades.scene          = aside;
	yades.omegaThreshold = omegaThreshold;
	yades.epsSoft        = epsSoft;
	yades.relKnSoft      = relKnSoft;
	shared_ptr<IGeom> geom(geometry);
	shared_ptr<IPhys> phys(before);
	const bool        livesThere = yades.go(geom, phys, I);
	if (!livesThere) {
		// YADE's law has also counted the broken bond.
		for (Body::id_t id : { I->id1, I->id2 }) {
			CpmState*                         state = YADE_CAST<CpmState*>(Body::byId(id, scene)->state.get());
			const std::lock_guard<std::mutex> lock(state->updateMutex);
			state->numBrokenCohesive -= 1;
		}
	}
	if (livesThere != lives) stop(*I, lives ? "YADE's law deletes the contact, but ours does not" : "our law deletes the contact, but YADE's does not");
	if (!lives || !livesThere) return;
	const string text = difference(after, *before);
	if (!text.empty()) stop(*I, "our law and YADE's differ in" + text);
}

bool Law2_ScGeom_CpmPhys_Rust::go(shared_ptr<IGeom>& geometry, shared_ptr<IPhys>& physics, Interaction* I)
{
	const ScGeom& geom  = *static_cast<const ScGeom*>(geometry.get());
	CpmPhys&      phys  = *static_cast<CpmPhys*>(physics.get());
	const bool    fresh = I->isFresh(scene);
	const bool    checks = checkEvery > 0 && scene->iter % checkEvery == 0;

	shared_ptr<CpmPhys> before;
	if (checks) before = shared_ptr<CpmPhys>(new CpmPhys(phys));
	if (fresh) begin(scene, geom, phys, *I);

	ConcordemCpmContact c;
	c.young                 = phys.E;
	c.shearModulus          = phys.G;
	c.frictionCoefficient   = phys.tanFrictionAngle;
	c.cohesion              = phys.undamagedCohesion;
	c.crackOnsetStrain      = phys.epsCrackOnset;
	c.fracture              = phys.epsFracture;
	c.shearContribution     = phys.equivStrainShearContrib;
	c.prestress             = phys.isoPrestress;
	c.referenceLength       = phys.refLength;
	c.referencePenetration  = phys.refPD;
	c.area                  = phys.crossSection;
	c.omegaThreshold        = omegaThreshold;
	c.softStrain            = epsSoft;
	c.relativeSoftStiffness = relKnSoft;
	c.penetration           = geom.penetrationDepth;
	put(c.normal, geom.normal);
	put(c.shearIncrement, geom.shearInc);
	put(c.swing, geom.*opened(SwingAxis()));
	put(c.twist, geom.*opened(TwistAxis()));
	c.strain        = phys.epsN;
	c.kappa         = phys.kappaD;
	c.omega         = phys.omega;
	c.plasticStrain = phys.epsNPl;
	put(c.shearStrain, phys.epsT);
	put(c.plasticShearStrain, phys.epsTPl);
	c.damageLaw   = phys.damLaw;
	c.neverDamage = phys.neverDamage;
	c.cohesive    = phys.isCohesive;
	c.fresh       = fresh;

	const bool energy  = scene->trackEnergy;
	const auto outcome = energy ? concordem_yade_cpm_with_energy(&c) : concordem_yade_cpm(&c);
	if (int(outcome) < 0) {
		stop(*I, reasonOf(outcome));
		return true;
	}

	phys.epsN                = c.strain;
	phys.kappaD              = c.kappa;
	phys.omega               = c.omega;
	phys.epsNPl              = c.plasticStrain;
	phys.epsT                = read(c.shearStrain);
	phys.epsTPl              = read(c.plasticShearStrain);
	phys.sigmaN              = c.normalStress;
	phys.sigmaT              = read(c.shearStress);
	phys.relResidualStrength = c.residualStrength;
	if (energy) energies.add(*scene->energy, { c.damageEnergy, c.frictionEnergy, c.integrationEnergy, c.storedEnergy });
	const shared_ptr<Body>&one = Body::byId(I->id1, scene), &two = Body::byId(I->id2, scene);
	if (outcome == ConcordemCpmOutcome::Lost) {
		countBroken(one);
		countBroken(two);
		if (checks) check(geometry, before, phys, I, false);
		return false;
	}
	phys.Fn          = phys.sigmaN * phys.crossSection;
	phys.normalForce = -phys.Fn * geom.normal;
	phys.Fs          = phys.sigmaT * phys.crossSection;
	phys.shearForce  = -phys.Fs;
	if (checks) check(geometry, before, phys, I, true);
	const Vector3r f = -phys.normalForce - phys.shearForce;
	if (!scene->isPeriodic) {
		applyForceAtContactPoint(f, geom.contactPoint, I->id1, one->state->pos, I->id2, two->state->pos);
	} else {
		// As in YADE: arms from the elongation, not to the contact point.
		const Real     half  = .5 * (phys.refPD - geom.penetrationDepth);
		const Vector3r twist = geom.normal.cross(f);
		scene->forces.addForce(I->id1, f);
		scene->forces.addForce(I->id2, -f);
		scene->forces.addTorque(I->id1, (geom.radius1 + half) * twist);
		scene->forces.addTorque(I->id2, (geom.radius2 + half) * twist);
	}
	return true;
}

} // namespace yade
