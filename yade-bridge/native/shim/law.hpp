/* What the generated classes of a law (laws.cpp) do: the table of a material as the library reads it, the physics they share, and the
   parts of makeBondOrContact and stepBond (functor.hpp) that depend on no law.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include "abi.h"
#include "functor.hpp"
#include <core/Body.hpp>
#include <pkg/dem/FrictPhys.hpp>
#include <pkg/dem/ScGeom.hpp>
#include <cmath>
#include <cstdio>

namespace yade {

/* Keys and values of a material, as in a scenario; what was not given is left out. */
struct TomlTable {
	string text;

	void add(const char* key, Real value)
	{
		if (std::isnan(value)) return;
		char digits[40];
		snprintf(digits, sizeof(digits), "%.17e", value);
		text += string(key) + " = " + (std::isinf(value) ? (value > 0 ? "inf" : "-inf") : digits) + "\n";
	}
	void add(const char* key, bool value) { text += string(key) + (value ? " = true\n" : " = false\n"); }
	/* A word; what begins like a table or a list is taken as TOML. */
	void add(const char* key, const string& value)
	{
		if (value.empty()) return;
		const bool plain = value[0] == '{' || value[0] == '[';
		text += string(key) + " = " + (plain ? value : "\"" + value + "\"") + "\n";
	}
};

/* What contacts of all generated laws have. */
class LawPhys_Rust : public RotStiffFrictPhys {
public:
	virtual ~LawPhys_Rust() = default;
	const ConcordemLawRow* row = nullptr; // made of both texts when it is needed
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR(LawPhys_Rust, RotStiffFrictPhys,
		"A contact by a law of ConcorDEM.",
		((string,tableOne,,(Attr::readonly|Attr::hidden),"Parameters of the first material, as in a scenario."))
		((string,tableTwo,,(Attr::readonly|Attr::hidden),"Parameters of the second material."))
		((Real,meanRadius,0,(Attr::readonly|Attr::hidden),"Mean radius of the spheres of such materials, m."))
		((Real,refLength,0,(Attr::readonly),"Length without strain, m; set in the first step. Negative: the contact could not be made, and stops the run."))
		((Real,crossSection,0,(Attr::readonly),"Area, m^2."))
		((Real,lastLength,0,(Attr::readonly),"Distance of the centres at the last step, m."))
		((Vector3r,lastNormal,Vector3r::Zero(),(Attr::readonly),"Direction from the first body to the second at the last step."))
		((bool,intact,true,,"A contact that is not is deleted in the next step, without a force and without energy."))
		((Vector3r,moment,Vector3r::Zero(),(Attr::readonly),"Moment on the first body about the contact point, N*m.")),
		createIndex();
	);
	// clang-format on
	REGISTER_CLASS_INDEX(LawPhys_Rust, RotStiffFrictPhys);
};
REGISTER_SERIALIZABLE(LawPhys_Rust);

/* A contact, its row, and room for its history. */
template <class Physics> struct LawContactOf : ConcordemLawContact {
	const ConcordemLawRow* row = nullptr;
	double                 reals[Physics::width + 1];
};

/* Mean radius of the spheres of such materials, counted at most once per step. */
template <class Mat> Real meanRadiusOf(const Scene& scene, Real& counted)
{
	if (!std::isnan(counted)) return counted;
	Real   sum   = 0;
	size_t count = 0;
	for (const auto& body : *scene.bodies) {
		if (!body || !dynamic_cast<const Mat*>(body->material.get())) continue;
		if (const auto* ball = dynamic_cast<const Sphere*>(body->shape.get())) sum += ball->radius, count++;
	}
	counted = sum / count;
	return counted;
}

/* Parameters of the contact between two materials; the reason if they are not valid. */
template <class Mat, class Physics>
string makeLaw(const Scene& scene, const char* law, bool bonded, Real& countedRadius, const Mat& one, const Mat& two, Physics& phys)
{
	Reason reason;
	phys.tableOne = one.table(), phys.tableTwo = two.table();
	phys.row = concordem_yade_law_row(law, bonded, phys.tableOne.c_str(), phys.tableTwo.c_str(), reason);
	if (!phys.row) return reason.text;
	phys.meanRadius             = bonded ? meanRadiusOf<Mat>(scene, countedRadius) : 0;
	phys.tangensOfFrictionAngle = std::tan(std::min(one.frictionAngle, two.frictionAngle));
	return "";
}

template <class Physics>
string fillLaw(const Scene& scene, const char* law, bool bonded, LawContactOf<Physics>& c, Physics& phys, const Interaction& I)
{
	if (!phys.row) {
		// After O.load.
		Reason reason;
		phys.row = concordem_yade_law_row(law, bonded, phys.tableOne.c_str(), phys.tableTwo.c_str(), reason);
		if (!phys.row) return reason.text;
	}
	c.row = phys.row;
	for (int k = 0; k < 2; k++) {
		const Body& body = *(*scene.bodies)[k ? I.id2 : I.id1];
		c.bodies[k]      = { motionOf(*body.state), static_cast<const Sphere&>(*body.shape).radius, body.state->mass };
	}
	put(c.shift, imageShift(scene, I));
	put(c.shiftVelocity, imageVelocity(scene, I));
	c.dt              = scene.dt;
	c.meanRadius      = phys.meanRadius;
	c.referenceLength = phys.refLength;
	c.area            = phys.crossSection;
	c.length          = phys.lastLength;
	put(c.normal, phys.lastNormal);
	phys.write(c.reals);
	c.history = c.reals;
	return string();
}

template <class Physics> string storeLaw(const LawContactOf<Physics>& c, ConcordemBondOutcome outcome, Physics& phys)
{
	if (int(outcome) < 0) return "the force is not a number; is the time step too large, or are two bodies in one place?";
	phys.refLength    = c.referenceLength;
	phys.crossSection = c.area;
	phys.lastLength   = c.length;
	phys.lastNormal   = read(c.normal);
	phys.kn = c.stiffness[0], phys.ks = c.stiffness[1], phys.kr = c.stiffness[2], phys.ktw = c.stiffness[3];
	phys.take(c.reals);
	return string();
}

} // namespace yade
