/* The bonded engine.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "bonds.hpp"
#include "bonds_lock.hpp"
#include "functor.hpp"
#include "rules.hpp"
#include <core/InteractionLoop.hpp>
#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <lib/pyutil/gil.hpp>
#include <pkg/common/InsertionSortCollider.hpp>
#include <pkg/common/Sphere.hpp>
#include <pkg/dem/ConcretePM.hpp>
#include <pkg/dem/Ig2_Sphere_Sphere_ScGeom.hpp>
#include <algorithm>
#include <iomanip>
#include <map>
#include <set>
#include <sstream>
#include <typeinfo>

namespace yade {

YADE_PLUGIN((BondedEngine_Rust));

namespace {

	[[noreturn]] void refuse(const string& why) { throw std::runtime_error("BondedEngine_Rust: " + why); }

	/* The cell; null if the scene is not periodic. */
	const ConcordemCellArrays* cellOf(const Scene& scene, ConcordemCellArrays& cell)
	{
		if (!scene.isPeriodic) return nullptr;
		put(cell.edges, scene.cell->hSize);
		put(cell.gradient, scene.cell->trsf);
		put(cell.rate, scene.cell->velGrad);
		return &cell;
	}

	/* Columns of bodies for the library. */
	struct BodyColumns {
		vector<uint32_t> id, material, constraint, lost;
		vector<Real>     position, velocity, orientation, angularVelocity, radius, mass, inertia;

		void add(const Body& body, const Sphere& sphere, uint32_t number)
		{
			const State& s = *body.state;
			if (s.inertia[0] != s.inertia[1] || s.inertia[0] != s.inertia[2])
				refuse("body " + std::to_string(body.id) + " has different moments of inertia about its axes; bonded bodies must be spheres");
			if (!body.isStandalone()) refuse("body " + std::to_string(body.id) + " is a clump member, which cannot be bonded");
			id.push_back(body.id), material.push_back(number), constraint.push_back(s.blockedDOFs);
			put(position, s.pos), put(velocity, s.vel), put(angularVelocity, s.angVel);
			for (Real q : { s.ori.x(), s.ori.y(), s.ori.z(), s.ori.w() })
				orientation.push_back(q);
			radius.push_back(sphere.radius), mass.push_back(s.mass), inertia.push_back(s.inertia[0]);
			const auto* concrete = dynamic_cast<const CpmState*>(&s);
			lost.push_back(concrete ? std::max(0, concrete->numBrokenCohesive) : 0);
		}
		ConcordemBodyArrays view() const
		{
			return { id.size(), id.data(), position.data(), velocity.data(), orientation.data(), angularVelocity.data(), radius.data(), mass.data(),
				 inertia.data(), material.data(), constraint.data(), lost.data() };
		}
	};

	/* The engine that updateStates replaces. */
	const char* const stateUpdater = "CpmStateUpdater";
	const char* const title        = "BondedEngine_Rust";

	/* Engines with bonds. An engine gets its bodies before it joins, and loses them after it has left. (Never deleted, because engines may be
	   deleted later than static objects.) */
	std::set<const BondedEngine_Rust*>& bondedEngines = *new std::set<const BondedEngine_Rust*>;
	/* Scenes whose bonded engine was deleted while it had bonds, with its bit of groupMask. */
	std::map<const Scene*, int>& abandoned = *new std::map<const Scene*, int>;
	/* Of both: scripts read them while YADE's thread takes bonds over. */
	std::mutex& registry = *new std::mutex;

	void join(const BondedEngine_Rust* engine)
	{
		const std::lock_guard<std::mutex> lock(registry);
		bondedEngines.insert(engine);
	}

	void leave(const BondedEngine_Rust* engine)
	{
		const std::lock_guard<std::mutex> lock(registry);
		bondedEngines.erase(engine);
	}

	InsertionSortCollider& colliderOf(const Scene& scene)
	{
		for (const auto& engine : scene.engines)
			if (auto* found = dynamic_cast<InsertionSortCollider*>(engine.get())) return *found;
		refuse("O.engines has no InsertionSortCollider; add one");
	}

	/* The OpenMP function, with plain integers for its types. */
	int (*const pauseThreads)(int) =
#ifdef YADE_OPENMP
	        [](int kind) { return omp_pause_resource_all(static_cast<omp_pause_resource_t>(kind)); };
#else
	        nullptr;
#endif

	/* Whether no other thread moves bodies now. */
	bool bodiesStand() { return boost::python::extract<bool>(boost::python::import("concordem.yade._scene").attr("bodies_stand")()); }

	/* Not of a derived class, as in the engine without headers. */
	bool isBall(const shared_ptr<Body>& body)
	{
		const Shape* shape = body ? body->shape.get() : nullptr;
		return shape && typeid(*shape) == typeid(Sphere);
	}

} // namespace

int BondedEngine_Rust::wantedThreads() const
{
#ifdef YADE_OPENMP
	return threads > 0 ? threads : omp_get_max_threads();
#else
	return std::max(1, threads);
#endif
}

/* Refuse engines that would not find the bonds, and an order in which the bonds do not act. At take-over, CpmStateUpdater is allowed if
   updateStates replaces it. */
void BondedEngine_Rust::checkEngines(bool atTakeOver)
{
	inPython([&](const boost::python::object& rules) {
		boost::python::list mine;
		for (size_t k = 0; k < enginesOf(*scene).size(); k++)
			if (enginesOf(*scene)[k].get() == this) mine.append(k);
		rules.attr("check_native")(listOf(enginesOf(*scene)), mine, title, atTakeOver && updateStates > 0 ? stateUpdater : "");
	});
	checkedEngines.clear();
	for (const auto& engine : enginesOf(*scene))
		checkedEngines.emplace_back(engine.get(), engine->dead);
}

bool BondedEngine_Rust::enginesChanged() const
{
	if (checkedEngines.size() != enginesOf(*scene).size()) return true;
	for (size_t k = 0; k < checkedEngines.size(); k++)
		if (checkedEngines[k].first != enginesOf(*scene)[k].get() || checkedEngines[k].second != enginesOf(*scene)[k]->dead) return true;
	return false;
}

/* Materials of concrete for the rules. */
boost::python::list BondedEngine_Rust::watchedMaterials() const
{
	boost::python::list found;
	if (!scenario.empty()) return found;
	std::set<const Material*> known;
	for (const auto& body : seen)
		if (known.insert(body->material.get()).second) found.append(body->material);
	return found;
}

/* Remember what must not change. */
void BondedEngine_Rust::watch()
{
	materials.clear(), radii.clear(), checkedEngines.clear();
	for (const auto& body : seen) {
		materials.push_back(body->material.get());
		radii.push_back(static_cast<const Sphere&>(*body->shape).radius);
	}
	settings.clear();
	if (scenario.empty())
		inPython([&](const boost::python::object& rules) {
			settings = boost::python::extract<string>(rules.attr("settings_text")(listOf(enginesOf(*scene)), watchedMaterials()))();
		});
}

/* Throw unless the engine is in its place in O.engines, has acted in every step, and (deep) settings and bodies are those of the take-over. */
void BondedEngine_Rust::verify(bool deep)
{
	if (deep || enginesChanged()) checkEngines(false);
	if (nextIter >= 0 && scene->iter > nextIter)
		inPython([&](const boost::python::object& rules) { rules.attr("refuse_skipped")(nextIter, scene->iter, title); });
	if (!deep) return;
	for (size_t k = 0; k < seen.size(); k++) {
		if (!isPresent(this, k, seen[k]->id)) return; // the next step reports it
		if (scenario.empty() && seen[k]->material.get() != materials[k])
			inPython([&](const boost::python::object& rules) { rules.attr("refuse_material")(seen[k]->id, title); });
		const Real radius = isBall(seen[k]) ? static_cast<const Sphere&>(*seen[k]->shape).radius : 0;
		if (radius != radii[k])
			inPython([&](const boost::python::object& rules) { rules.attr("refuse_radius")(seen[k]->id, radii[k], radius, title); });
	}
	if (!settings.empty())
		inPython([&](const boost::python::object& rules) { rules.attr("check_settings")(settings, listOf(enginesOf(*scene)), watchedMaterials(), title); });
}

void BondedEngine_Rust::check()
{
	const BondsLock lock(bondsMutex);
	scene = Omega::instance().getScene().get();
	facts();
	if (bonds) verify(true);
}

BondedEngine_Rust::~BondedEngine_Rust()
{
	leave(this);
	if (!bonds || !selfMask) return;
	const std::lock_guard<std::mutex> lock(registry);
	abandoned[scene] = selfMask;
}

bool BondedEngine_Rust::isMissingIn(const Scene& now) const
{
	if (!bonds) return false;
	for (const auto& engine : enginesOf(now))
		if (engine.get() == this) return false;
	// A new scene may have the address of a deleted one, but not its bodies.
	for (const auto& body : seen)
		if (now.bodies->exists(body->id) && (*now.bodies)[body->id] == body) return true;
	return false;
}

string abandonedBonds()
{
	const std::lock_guard<std::mutex> lock(registry);
	const Scene* scene = Omega::instance().getScene().get();
	for (const BondedEngine_Rust* engine : bondedEngines)
		if (engine->isMissingIn(*scene))
			return "O.engines lacks BondedEngine_Rust, so its bonds would not act; keep it when you assign O.engines, or call its release() before";
	const auto found = abandoned.find(scene);
	if (found == abandoned.end()) return "";
	bool excluded = false;
	for (const auto& engine : enginesOf(*scene)) {
		if (const auto* collider = dynamic_cast<const InsertionSortCollider*>(engine.get())) excluded |= (collider->avoidSelfInteractionMask & found->second) != 0;
		const auto* other = dynamic_cast<const BondedEngine_Rust*>(engine.get());
		if (other && other->selfMask == found->second) return "";
	}
	bool bonded = false;
	for (const auto& body : *scene->bodies)
		if (body) bonded |= (body->groupMask & found->second) != 0;
	// Another scene may have got the address of a deleted one.
	if (!excluded || !bonded) {
		abandoned.erase(found);
		return "";
	}
	return "BondedEngine_Rust is no longer in O.engines, and its bonds are deleted, but its bodies are still excluded from YADE's contacts; load the "
	       "scene again, and keep the engine when you assign O.engines, or call its release() before";
}

/* Exclude contacts between the bonded bodies from YADE's collider, and remove their interactions. */
void BondedEngine_Rust::mask()
{
	InsertionSortCollider& collider = colliderOf(*scene);
	int                    used     = collider.avoidSelfInteractionMask;
	for (const auto& body : *scene->bodies)
		if (body) used |= body->groupMask;
	int bit = 0;
	for (int k = 29; k >= 0 && !bit; k--)
		if (!(used >> k & 1)) bit = 1 << k;
	if (!bit) refuse("all bits of the bodies' groupMask are in use; free one");
	const int common = seen.empty() ? 0 : seen[0]->groupMask;
	for (const auto& body : seen)
		if (body->groupMask & collider.avoidSelfInteractionMask)
			refuse("body " + std::to_string(body->id)
			       + " is excluded from contacts by the collider's avoidSelfInteractionMask, as bodies of a bonded engine are; call release() of that engine first, or unset the mask");
	for (const auto& body : seen)
		if (body->groupMask != common) refuse("the bodies have different groupMasks; give all bonded bodies the same");
	vector<bool> mine(scene->bodies->size(), false);
	for (const auto& body : seen)
		mine[body->id] = true;
	vector<shared_ptr<Interaction>> inner;
	for (const auto& I : *scene->interactions)
		if (mine[I->id1] && mine[I->id2]) inner.push_back(I);
	// Nothing can fail from here on.
	for (const auto& body : seen)
		body->groupMask |= bit;
	collider.avoidSelfInteractionMask |= bit;
	selfMask = bit;
	for (const auto& I : inner)
		scene->interactions->erase(I->id1, I->id2, I->linIx);
}

/* Find the bodies of the particles of the assembly. */
void BondedEngine_Rust::attach()
{
	ConcordemFacts now;
	concordem_yade_bonds_facts(bonds.get(), &now);
	const uint32_t* id = concordem_yade_bonds_ids(bonds.get());
	seen.clear(), states.clear(), motion.clear(), blocked.clear(), byId.clear();
	for (size_t k = 0; k < now.particles; k++) {
		const Body::id_t number = id[k];
		if (!scene->bodies->exists(number)) refuse("body " + std::to_string(number) + ", which has bonds, does not exist in the scene");
		const shared_ptr<Body> body  = (*scene->bodies)[number];
		State*                 state = body->state.get();
		if (!isBall(body)) refuse("body " + std::to_string(number) + ", which has bonds, is not a sphere");
		seen.push_back(body);
		states.push_back(state);
		motion.push_back({ state->pos.data(), state->vel.data(), state->angVel.data(), state->ori.coeffs().data() });
		blocked.push_back(&state->blockedDOFs);
		byId.push_back(k);
	}
	std::sort(byId.begin(), byId.end(), [&](size_t i, size_t j) { return id[i] < id[j]; });
	nextIter = -1;
	watch();
}

void BondedEngine_Rust::begin(ConcordemBonds* made, const char* message)
{
	if (!made) refuse(message);
	bonds = shared_ptr<ConcordemBonds>(made, concordem_yade_bonds_delete);
	try {
		attach();
		mask();
	} catch (...) {
		bonds.reset(), seen.clear(), states.clear(), motion.clear(), blocked.clear(), byId.clear();
		throw;
	}
	nextIter = scene->iter + 1;
	join(this);
	if (updateStates > 0)
		for (const auto& engine : scene->engines)
			if (engine->getClassName() == stateUpdater) engine->dead = true;
}

/* Take over the concrete of the scene; false if YADE is still creating bonds. */
bool BondedEngine_Rust::takeConcrete(bool now)
{
	const Law2_ScGeom_CpmPhys_Cpm*    law = nullptr;
	const Ig2_Sphere_Sphere_ScGeom*   ig2 = nullptr;
	const Ip2_CpmMat_CpmMat_CpmPhys*  ip2 = nullptr;
	int                               loops = 0;
	for (const auto& engine : scene->engines) {
		const auto* loop = dynamic_cast<const InteractionLoop*>(engine.get());
		if (!loop || loop->dead) continue;
		loops++;
		for (const auto& f : loop->lawDispatcher->functors)
			if (const auto* found = dynamic_cast<const Law2_ScGeom_CpmPhys_Cpm*>(f.get())) law = found;
		for (const auto& f : loop->geomDispatcher->functors)
			if (const auto* found = dynamic_cast<const Ig2_Sphere_Sphere_ScGeom*>(f.get())) ig2 = found;
		for (const auto& f : loop->physDispatcher->functors)
			if (const auto* found = dynamic_cast<const Ip2_CpmMat_CpmMat_CpmPhys*>(f.get())) ip2 = found;
	}
	if (loops != 1 || !law || !ig2 || !ip2) {
		inPython([&](const boost::python::object& rules) { rules.attr("functors_of_concrete")(listOf(scene->engines)); });
		refuse("internal error of concordem, please report it: a functor of concrete was not found");
	}
	if (!now && scene->iter < ip2->cohesiveThresholdIter) return false;
	inPython([&](const boost::python::object& rules) {
		rules.attr("check_creation")(ip2->cohesiveThresholdIter, scene->iter);
		rules.attr("check_distance")(ig2->interactionDetectionFactor);
	});
	checkEngines(true);

	vector<const CpmMat*>          materials;
	std::map<const CpmMat*, int>   numbers;
	vector<int>                    row(scene->bodies->size(), -1);
	BodyColumns                    columns;
	for (const auto& body : *scene->bodies) {
		if (!isBall(body)) continue;
		const auto* material = dynamic_cast<const CpmMat*>(body->material.get());
		if (!material != !dynamic_cast<const CpmState*>(body->state.get()))
			inPython([&](const boost::python::object& rules) {
				rules.attr("refuse_sphere")(body->id, body->material ? body->material->getClassName() : "NoneType", body->state->getClassName());
			});
		if (!material) continue;
		const auto found = numbers.emplace(material, int(materials.size()));
		if (found.second) {
			inPython([&](const boost::python::object& rules) { rules.attr("check_damage_law")(body->id, material->damLaw); });
			materials.push_back(material);
		}
		row[body->id] = int(columns.id.size());
		columns.add(*body, static_cast<const Sphere&>(*body->shape), found.first->second);
	}
	if (columns.id.empty()) refuse("the scene has no spheres of CpmMat; add them, or set `scenario`");

	vector<ConcordemPairCoefficients> rows;
	for (size_t i = 0; i < materials.size(); i++)
		for (size_t j = i; j < materials.size(); j++) {
			const CpmMat &one = *materials[i], &two = *materials[j];
			ConcordemPairCoefficients  r;
			r.a = i, r.b = j;
			r.young = mean(one.young, two.young), r.shearRatio = mean(one.poisson, two.poisson), r.cohesion = mean(one.sigmaT, two.sigmaT);
			r.frictionAngle = mean(one.frictionAngle, two.frictionAngle), r.crackOnsetStrain = mean(one.epsCrackOnset, two.epsCrackOnset);
			r.ductility = mean(one.relDuctility, two.relDuctility);
			r.shearContribution = mean(one.equivStrainShearContrib, two.equivStrainShearContrib);
			r.prestress = mean(one.isoPrestress, two.isoPrestress), r.omegaThreshold = law->omegaThreshold;
			r.softStrain = law->epsSoft, r.relativeSoftStiffness = law->relKnSoft;
			r.damageLaw = one.damLaw, r.neverDamage = one.neverDamage || two.neverDamage;
			rows.push_back(r);
		}
	const auto between = [&](int one, int two) -> const ConcordemPairCoefficients& {
		const size_t i = std::min(columns.material[one], columns.material[two]), j = std::max(columns.material[one], columns.material[two]);
		for (const ConcordemPairCoefficients& r : rows)
			if (r.a == i && r.b == j) return r;
		refuse("internal error of concordem, please report it: no parameters for a pair of materials");
	};

	vector<uint32_t> pair;
	vector<int8_t>   image;
	vector<uint8_t>  bonded;
	vector<Real>     length, area, normal, distance, history, radiusSum, overlap, stored;
	for (const auto& I : *scene->interactions) {
		if (!I->isReal()) continue;
		const int one = row[I->id1], two = row[I->id2];
		if (one < 0 || two < 0) continue;
		const auto * phys = dynamic_cast<const CpmPhys*>(I->phys.get());
		const auto * geom = dynamic_cast<const ScGeom*>(I->geom.get());
		if (!phys || !geom)
			inPython([&](const boost::python::object& rules) {
				rules.attr("refuse_contact")(I->id1, I->id2, I->phys->getClassName(), I->geom->getClassName());
			});
		const ConcordemPairCoefficients& r = between(one, two);
		for (int k = 0; k < 3; k++) {
			if (std::abs(I->cellDist[k]) > 127)
				inPython([&](const boost::python::object& rules) { rules.attr("refuse_image")(I->id1, I->id2); });
			image.push_back(I->cellDist[k]);
		}
		pair.push_back(one), pair.push_back(two), bonded.push_back(phys->isCohesive);
		length.push_back(phys->refLength), area.push_back(phys->crossSection), put(normal, geom->normal);
		distance.push_back(geom->refR1 + geom->refR2 - geom->penetrationDepth);
		for (Real x : { phys->epsN - r.prestress / r.young, phys->kappaD, phys->omega, phys->epsNPl, 0.0 })
			history.push_back(x);
		put(history, phys->epsT), put(history, phys->epsTPl);
		radiusSum.push_back(geom->refR1 + geom->refR2), overlap.push_back(phys->refPD);
		// The library compares them with the materials; their order is that of STORED.
		for (Real x : { phys->E, phys->G, phys->tanFrictionAngle, phys->undamagedCohesion, phys->epsCrackOnset, phys->epsFracture,
		                phys->equivStrainShearContrib, phys->isoPrestress, Real(phys->damLaw), Real(phys->neverDamage) })
			stored.push_back(x);
	}
	const ConcordemBodyArrays   bodies   = columns.view();
	const ConcordemContactArrays contacts = { length.size(), pair.data(), image.data(), bonded.data(), length.data(), area.data(), normal.data(), distance.data(), history.data(),
		                                radiusSum.data(), overlap.data(), stored.data() };
	ConcordemCellArrays           cell;
	const string            measure = !kinematics.empty() ? kinematics : ig2->avoidGranularRatcheting ? "yade-ratcheting" : "yade";
	Reason                  reason;
	const ConcordemConcreteScene given
	        = { &bodies, &contacts, rows.data(), rows.size(), materials.size(), measure.c_str(), mode.c_str(), cellOf(*scene, cell), scene->dt };
	if (std::find(bonded.begin(), bonded.end(), 1) == bonded.end())
		refuse("there are no bonds to take over; let YADE create them first (an interactionDetectionFactor above 1 in a step before cohesiveThresholdIter)");
	begin(concordem_yade_bonds_concrete(&given, wantedThreads(), reason), reason.text);
	return true;
}

/* Create the bonds of a scenario whose spheres are bodies of the scene. */
void BondedEngine_Rust::bondScenario()
{
	if (scene->isPeriodic) refuse("`scenario` does not support periodic scenes; take over concrete instead");
	checkEngines(true);
	BodyColumns        columns;
	std::ostringstream text;
	text << std::setprecision(17) << "version = 1\nkinematics = \"" << (kinematics.empty() ? "finite" : kinematics) << "\"\n"
	     << scenario << "\n[packing]\nkind = \"spheres\"\nspheres = [\n";
	const auto add = [&](const shared_ptr<Body>& body) {
		const Sphere& sphere = static_cast<const Sphere&>(*body->shape);
		columns.add(*body, sphere, 0);
		const Vector3r& x = body->state->pos;
		text << "[" << std::scientific << x[0] << ", " << x[1] << ", " << x[2] << ", " << sphere.radius << "],\n";
	};
	if (ids.empty()) {
		for (const auto& body : *scene->bodies)
			if (isBall(body)) add(body);
	}
	for (Body::id_t number : ids) {
		if (!scene->bodies->exists(number)) refuse("`ids` contains " + std::to_string(number) + ", but there is no such body");
		if (!isBall((*scene->bodies)[number])) refuse("`ids` contains " + std::to_string(number) + ", which is not a sphere");
		add((*scene->bodies)[number]);
	}
	if (columns.id.empty()) refuse("the scene has no spheres to bond");
	text << "]\n[stop]\nsteps = 1\n";
	const ConcordemBodyArrays bodies = columns.view();
	Reason                reason;
	begin(concordem_yade_bonds_scenario(text.str().c_str(), &bodies, scene->dt, wantedThreads(), reason), reason.text);
}

void BondedEngine_Rust::load()
{
	Reason          reason;
	ConcordemBonds* made = concordem_yade_bonds_load(memory.data(), memory.size(), wantedThreads(), reason);
	if (!made) refuse(reason.text);
	bonds = shared_ptr<ConcordemBonds>(made, concordem_yade_bonds_delete);
	attach();
	join(this);
	memory.clear();
	memory.shrink_to_fit();
}

void BondedEngine_Rust::takeOver()
{
	const BondsLock lock(bondsMutex);
	scene = Omega::instance().getScene().get();
	if (!bonds && !memory.empty()) load();
	if (bonds) refuse("the bonds have already been taken over; call release() first");
	if (scenario.empty()) takeConcrete(true);
	else
		bondScenario();
}

/* Whether body `number` of particle k is the same object as at the start. Called by several threads at once. Does not use the id of the
   body, because an erased body has none. */
int32_t BondedEngine_Rust::isPresent(const void* engine, size_t k, uint32_t number)
{
	const BondedEngine_Rust& self = *static_cast<const BondedEngine_Rust*>(engine);
	// Bodies are scattered in memory.
	if (k + 24 < self.seen.size()) __builtin_prefetch(&self.seen[k + 24]->state);
	const auto& bodies = *self.scene->bodies;
	return bodies.exists(number) && bodies[number] == self.seen[k] && self.seen[k]->state.get() == self.states[k];
}

void BondedEngine_Rust::action()
{
	const BondsLock lock(bondsMutex);
	if (!bonds) {
		if (!memory.empty()) load();
		else {
			// YADE's contacts have already acted in this step; ours start with the next one.
			if (scenario.empty()) takeConcrete(false);
			else
				bondScenario();
			return;
		}
	}
	verify(scene->iter % 64 == 0);
	nextIter = scene->iter + 1;
	ConcordemCellArrays cell;
	Reason        reason;
	const auto*   addresses = reinterpret_cast<const double* const(*)[4]>(motion.data());
	const ConcordemBondedStep step
	        = { isPresent, this, addresses, blocked.data(), cellOf(*scene, cell), pauseThreads, scene->dt, int32_t(scene->trackEnergy) };
	if (concordem_yade_bonds_step(bonds.get(), &step, reason) < 0)
		refuse("at iteration " + std::to_string(scene->iter) + ": " + reason.text);
	const uint32_t* id = concordem_yade_bonds_ids(bonds.get());
	const double *  force, *torque;
	concordem_yade_bonds_forces(bonds.get(), &force, &torque);
	// By body id, the order of YADE's forces in memory.
	for (size_t k : byId) {
		const Body::id_t number = id[k];
		scene->forces.addForce(number, Vector3r(force[3 * k], force[3 * k + 1], force[3 * k + 2]));
		scene->forces.addTorque(number, Vector3r(torque[3 * k], torque[3 * k + 1], torque[3 * k + 2]));
	}
	if (scene->trackEnergy) addEnergies();
	if (updateStates > 0 && scene->iter % updateStates == 0) writeStates();
}

ConcordemFacts BondedEngine_Rust::facts()
{
	const BondsLock lock(bondsMutex);
	if (!bonds && !memory.empty()) {
		scene = Omega::instance().getScene().get();
		load();
	}
	ConcordemFacts found = ConcordemFacts();
	if (bonds) concordem_yade_bonds_facts(bonds.get(), &found);
	return found;
}

void BondedEngine_Rust::addEnergies()
{
	const ConcordemFacts now = facts();
	EnergyTracker&       all = *scene->energy;
	all.set(now.stored, "bondElastic", storedId), all.set(now.dissipated[0], "bondDamage", damageId);
	all.set(now.dissipated[1], "bondFriction", frictionId), all.set(now.dissipated[2], "bondViscous", viscousId);
	all.set(now.dissipated[3], "bondIntegration", integrationId);
}

void BondedEngine_Rust::writeStates()
{
	const size_t                  count = seen.size();
	vector<double>                damage(count);
	vector<uint32_t>              lost(count);
	vector<std::array<double, 9>> stresses(count);
	Reason                        reason;
	auto*                         rows = reinterpret_cast<double(*)[9]>(stresses.data());
	if (concordem_yade_bonds_particles(bonds.get(), damage.data(), lost.data(), rows, reason) < 0) refuse(reason.text);
	for (size_t k = 0; k < count; k++) {
		auto* state = dynamic_cast<CpmState*>(states[k]);
		if (!state) refuse("updateStates needs CpmState, which body " + std::to_string(seen[k]->id) + " does not have; set updateStates=0");
		state->normDmg           = damage[k];
		state->numBrokenCohesive = lost[k];
		for (int i = 0; i < 3; i++)
			for (int j = 0; j < 3; j++)
				state->stress(i, j) = stresses[k][3 * i + j];
	}
}

Matrix3r BondedEngine_Rust::stress(Real volume)
{
	const BondsLock lock(bondsMutex);
	scene = Omega::instance().getScene().get();
	facts();
	if (!bonds) refuse("there are no bonds yet; take a step or call takeOver() first");
	// While another thread moves bodies, cell and positions of the last step.
	const bool stand = bodiesStand();
	if (volume <= 0) {
		if (!scene->isPeriodic) refuse("the volume is missing; give stress(volume), which only a periodic scene can omit");
		volume = stand ? std::abs(scene->cell->hSize.determinant()) : facts().cellVolume;
	}
	double sum[9];
	Reason reason;
	vector<const double(*)[3]> positions;
	for (size_t k = 0; stand && k < seen.size(); k++) {
		if (!isPresent(this, k, concordem_yade_bonds_ids(bonds.get())[k])) refuse("a body with bonds was deleted or replaced");
		positions.push_back(reinterpret_cast<const double(*)[3]>(states[k]->pos.data()));
	}
	if (concordem_yade_bonds_virial(bonds.get(), stand ? positions.data() : nullptr, &sum, reason) < 0) refuse(reason.text);
	Matrix3r found;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			found(i, j) = sum[3 * i + j] / volume;
	return found;
}

void BondedEngine_Rust::release()
{
	const BondsLock lock(bondsMutex);
	scene = Omega::instance().getScene().get();
	facts();
	if (!bonds) return;
	InsertionSortCollider& collider = colliderOf(*scene);
	for (const auto& body : seen)
		body->groupMask &= ~selfMask;
	collider.avoidSelfInteractionMask &= ~selfMask;
	selfMask = 0;
	// In the next step, the collider must check the pairs that were excluded.
	collider.doSort = true;
	scene->doSort   = true;
	dead          = true;
	leave(this);
	nextIter = -1;
	bonds.reset(), seen.clear(), states.clear(), motion.clear(), blocked.clear(), byId.clear();
}

namespace {
	/* The bonds as the library saves them. */
	vector<int> saved(const ConcordemBonds* bonds)
	{
		vector<int> words;
		Reason      reason;
		const auto  take = [](void* to, const int32_t* from, size_t count) { static_cast<vector<int>*>(to)->assign(from, from + count); };
		if (concordem_yade_bonds_words(bonds, take, &words, reason) < 0) refuse(reason.text);
		return words;
	}
} // namespace

boost::python::object BondedEngine_Rust::words()
{
	const BondsLock lock(bondsMutex);
	scene = Omega::instance().getScene().get();
	facts();
	if (!bonds) refuse("there are no bonds yet; take a step or call takeOver() first");
	const vector<int> found = saved(bonds.get());
	return boost::python::object(boost::python::handle<>(PyBytes_FromStringAndSize(reinterpret_cast<const char*>(found.data()), found.size() * sizeof(int))));
}

void BondedEngine_Rust::preSave(BondedEngine_Rust&)
{
	const BondsLock lock(bondsMutex);
	if (bonds) memory = saved(bonds.get());
}

} // namespace yade
