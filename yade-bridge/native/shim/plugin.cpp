/* Functions for Python: registration of the plugin's classes, and sample objects for the layout check.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "abi.h"
#include "bonds.hpp"
#include "concrete.hpp"
#include "linear_bonds.hpp"
#include "opened.hpp"
#include <core/Body.hpp>
#include <core/Cell.hpp>
#include <core/Omega.hpp>
#include <core/Scene.hpp>

namespace yade {

struct BuildDatabase {
	typedef void (Omega::*type)(const vector<string>&);
	friend type opened(BuildDatabase);
};

template struct Open<BuildDatabase, &Omega::buildDynlibDatabase>;

} // namespace yade

namespace {

namespace py = ::boost::python;
using namespace yade;

/* Run `body`; convert C++ exceptions to Python exceptions. */
template <class Body> PyObject* guarded(Body body)
{
	try {
		return py::incref(body().ptr());
	} catch (const py::error_already_set&) {
		return nullptr;
	} catch (const std::exception& error) {
		PyErr_SetString(PyExc_RuntimeError, error.what());
		return nullptr;
	}
}

/* Sample objects with the values written to their fields. */
struct Sample {
	py::list all;
	int      next = 1;
	py::dict fields;

	Real real(const char* name)
	{
		const Real value = 0.5 + next++;
		fields[name]     = py::object(value);
		return value;
	}
	Vector3r vector(const char* name)
	{
		const Vector3r value(next + 0.25, next + 0.5, next + 0.75);
		next++;
		fields[name] = py::object(value);
		return value;
	}
	int integer(const char* name)
	{
		const int value = 1000 + next++;
		fields[name]    = py::object(value);
		return value;
	}
	template <class T> void done(const shared_ptr<T>& object)
	{
		all.append(py::make_tuple(py::object(object), fields));
		fields = py::dict();
	}
};

} // namespace

extern "C" {

/* Register classes in YADE by name, as boot.initialize does, but without resetting the scene. */
__attribute__((visibility("default"))) PyObject* concordem_yade_register(PyObject* names)
{
	return guarded([&] {
		vector<string> classes;
		py::object     list(py::handle<>(py::borrowed(names)));
		for (py::ssize_t k = 0; k < py::len(list); k++)
			classes.push_back(py::extract<string>(list[k]));
		if (concordem_yade_header_hash() != CONCORDEM_HEADER_HASH)
			throw std::runtime_error("the shim and the library have different versions; rebuild the plugin");
		(Omega::instance().*opened(BuildDatabase()))(classes);
		return py::object();
	});
}

/* Sample objects, written with the layout of the headers, and the values that YADE must read from them. */
__attribute__((visibility("default"))) PyObject* concordem_yade_samples()
{
	return guarded([] {
		Sample s;

		shared_ptr<CpmPhys> phys(new CpmPhys);
		phys->kn = s.real("kn"), phys->ks = s.real("ks"), phys->normalForce = s.vector("normalForce"), phys->shearForce = s.vector("shearForce");
		phys->E = s.real("E"), phys->G = s.real("G"), phys->tanFrictionAngle = s.real("tanFrictionAngle");
		phys->undamagedCohesion = s.real("undamagedCohesion"), phys->crossSection = s.real("crossSection"), phys->refLength = s.real("refLength");
		phys->refPD = s.real("refPD"), phys->epsCrackOnset = s.real("epsCrackOnset"), phys->relDuctility = s.real("relDuctility");
		phys->epsFracture = s.real("epsFracture"), phys->equivStrainShearContrib = s.real("equivStrainShearContrib");
		phys->isoPrestress = s.real("isoPrestress"), phys->damLaw = s.integer("damLaw");
		phys->omega = s.real("omega"), phys->Fn = s.real("Fn"), phys->sigmaN = s.real("sigmaN"), phys->epsN = s.real("epsN");
		phys->kappaD = s.real("kappaD"), phys->epsNPl = s.real("epsNPl"), phys->relResidualStrength = s.real("relResidualStrength");
		phys->sigmaT = s.vector("sigmaT"), phys->Fs = s.vector("Fs"), phys->epsT = s.vector("epsT"), phys->epsTPl = s.vector("epsTPl");
		s.done(phys);

		shared_ptr<ScGeom> geom(new ScGeom);
		geom->normal = s.vector("normal"), geom->contactPoint = s.vector("contactPoint"), geom->refR1 = s.real("refR1"), geom->refR2 = s.real("refR2");
		geom->penetrationDepth = s.real("penetrationDepth"), geom->shearInc = s.vector("shearInc");
		s.done(geom);

		shared_ptr<CpmState> state(new CpmState);
		state->pos = s.vector("pos"), state->vel = s.vector("vel"), state->angVel = s.vector("angVel"), state->mass = s.real("mass");
		state->inertia = s.vector("inertia"), state->angMom = s.vector("angMom"), state->normDmg = s.real("normDmg");
		state->numBrokenCohesive = s.integer("numBrokenCohesive");
		s.done(state);

		shared_ptr<CpmMat> material(new CpmMat);
		material->density = s.real("density"), material->young = s.real("young"), material->poisson = s.real("poisson");
		material->frictionAngle = s.real("frictionAngle"), material->sigmaT = s.real("sigmaT"), material->epsCrackOnset = s.real("epsCrackOnset");
		material->damLaw = s.integer("damLaw"), material->isoPrestress = s.real("isoPrestress");
		s.done(material);

		shared_ptr<RotStiffFrictPhys> stiff(new RotStiffFrictPhys);
		stiff->kn = s.real("kn"), stiff->ks = s.real("ks"), stiff->normalForce = s.vector("normalForce"), stiff->shearForce = s.vector("shearForce");
		stiff->tangensOfFrictionAngle = s.real("tangensOfFrictionAngle"), stiff->kr = s.real("kr"), stiff->ktw = s.real("ktw");
		s.done(stiff);

		shared_ptr<Body> body(new Body);
		body->id = s.integer("id"), body->groupMask = s.integer("groupMask"), body->iterBorn = s.integer("iterBorn");
		s.done(body);

		shared_ptr<Interaction> interaction(new Interaction(11, 12));
		interaction->iterMadeReal = s.integer("iterMadeReal"), interaction->iterBorn = s.integer("iterBorn");
		s.fields["id1"] = 11, s.fields["id2"] = 12;
		s.done(interaction);

		shared_ptr<Cell> cell(new Cell);
		cell->homoDeform = s.integer("homoDeform");
		s.done(cell);

		const Scene& scene = *Omega::instance().getScene();
		py::dict     now;
		now["dt"] = py::object(scene.dt), now["iter"] = py::object(scene.iter), now["time"] = py::object(scene.time);
		now["periodic"] = py::object(bool(scene.isPeriodic)), now["bodies"] = py::object(scene.bodies->size());
		now["interactions"] = py::object(scene.interactions->size()), now["engines"] = py::object(scene.engines.size());
		return py::object(py::make_tuple(s.all, now));
	});
}

/* Clear the law cached in every contact. */
__attribute__((visibility("default"))) PyObject* concordem_yade_forget_laws()
{
	return guarded([] {
		for (const shared_ptr<Interaction>& I : *Omega::instance().getScene()->interactions)
			I->functorCache.constLaw.reset();
		return py::object();
	});
}

/* What is wrong if the scene has lost its bonded engine; empty if it has not. */
__attribute__((visibility("default"))) PyObject* concordem_yade_abandoned()
{
	return guarded([] { return py::object(abandonedBonds()); });
}

/* The differences between two CpmPhys, as text. */
__attribute__((visibility("default"))) PyObject* concordem_yade_difference(PyObject* one, PyObject* two)
{
	return guarded([&] {
		const auto phys = [](PyObject* object) { return shared_ptr<CpmPhys>(py::extract<shared_ptr<CpmPhys>>(object)); };
		return py::object(difference(*phys(one), *phys(two)));
	});
}
}
