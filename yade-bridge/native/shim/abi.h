/* The functions of the Rust library (../src) that the plugin calls.

   SPDX-License-Identifier: GPL-2.0-or-later */
#pragma once
#include <cstddef>
#include <cstdint>

extern "C" {

/* One contact of concrete and what it answers; field by field as `CpmContact` of src/concrete.rs. */
struct ConcordemCpmContact {
	double  young, shearModulus, tanFriction, cohesion, crackOnset, fracture, shearContribution, prestress;
	double  referenceLength, referencePenetration, area;
	double  omegaThreshold, softStrain, relativeSoftStiffness;
	double  penetration, normal[3], shearIncrement[3], swing[3], twist[3];
	double  strain, kappa, omega, plasticStrain, shearStrain[3], plasticShearStrain[3];
	double  normalStress, shearStress[3], residualStrength;
	double  damageEnergy, frictionEnergy, storedEnergy, integrationEnergy;
	int32_t damageLaw, neverDamage, cohesive, fresh;
};

/* 0: lives; 1: YADE's law deletes it; -1: not a number; -2: damLaw; -3: internal error. */
int32_t concordem_yade_cpm(ConcordemCpmContact*);
int32_t concordem_yade_cpm_with_energy(ConcordemCpmContact*);
size_t  concordem_yade_cpm_size();

/* A text that the library writes its reasons into. */
struct ConcordemMessage {
	char*  text;
	size_t capacity;
};

/* A beam: structures as in src/beam.rs. */
struct ConcordemBodyMotion {
	const double *position, *velocity, *spin, *orientation;
};

struct ConcordemBeamParameters {
	double  young, poisson, shear, strength, area, length;
	int32_t model, bendingTerm;
};

struct ConcordemBeamContact {
	ConcordemBeamParameters parameters;
	ConcordemBodyMotion     bodies[2];
	double                  shift[3], shiftVelocity[3], dt;
	double *                restDirection, *restRotation;
	double                  force[3], torque[2][3], moment[3], normal[3];
	double                  storedEnergy, damageEnergy, integrationEnergy;
};

/* 0: holds; 1: broke; -1: not a number; -2: parameters without meaning; -3: internal error. */
int32_t concordem_yade_beam(ConcordemBeamContact*);
int64_t concordem_yade_beam_stiffness(const ConcordemBeamParameters*, double (*stiffness)[4], const ConcordemMessage*);
size_t  concordem_yade_beam_size();

/* A brittle linear bond between bodies that may deform: structures as in src/linear_bond.rs. */
struct ConcordemLinearBondParameters {
	double  normalStiffness, shearStiffness, dampingRatio, normalStrength, shearStrength;
	int32_t subtractInitialGap;
};

struct ConcordemBondedBody {
	ConcordemBodyMotion motion;
	double              radius, mass;
	const double*       widening[2];
};

struct ConcordemLinearBond {
	ConcordemLinearBondParameters parameters;
	ConcordemBondedBody           bodies[2];
	double                        shift[3], dt, referenceLength;
	double                        length, normal[3], shearDisplacement[3], normalDashpot, shearDashpot[3];
	double                        force[3], torque[2][3];
	double                        storedEnergy, damageEnergy, viscousEnergy, integrationEnergy;
};

struct ConcordemElasticity {
	double young, poisson;
};

/* 0: holds; 1: broke; -1: not a number; -3: internal error. */
int32_t concordem_yade_linear_bond(ConcordemLinearBond*);
int64_t concordem_yade_linear_bond_check(const ConcordemLinearBondParameters*, const ConcordemElasticity (*)[2], const ConcordemMessage*);
size_t  concordem_yade_linear_bond_size();

/* The pass over deformable particles: structures as in src/deformation.rs. */
struct ConcordemDeformation;

struct ConcordemDeformableBody {
	uint32_t material, blocked;
	double   radius;
	double * dyad, *used, *other, *reaction;
	double * widening, *wideningBefore, *stress;
};

struct ConcordemBondAnswer {
	uint32_t      bodies[2];
	const double *normal, *force;
	double        normalDashpot;
	const double* shearDashpot;
};

struct ConcordemDeformationEnergies {
	double stored, lag, other, reactions;
};

ConcordemDeformation* concordem_yade_deformation_scratch(int32_t threads, const ConcordemMessage*);
void                  concordem_yade_deformation_delete(ConcordemDeformation*);
int64_t               concordem_yade_deformation(
                      ConcordemDeformation*,
                      const ConcordemDeformableBody*,
                      size_t bodies,
                      const ConcordemBondAnswer*,
                      size_t bonds,
                      const ConcordemElasticity*,
                      size_t      materials,
                      const char* condition,
                      int32_t     dashpots,
                      ConcordemDeformationEnergies*,
                      const ConcordemMessage*);

/* The bonded engine: structures as in src/bonds.rs. */
struct ConcordemBonds;

struct ConcordemBodies {
	size_t          count;
	const uint32_t* id;
	const double *  position, *velocity, *orientation, *angularVelocity, *radius, *mass, *inertia;
	const uint32_t *material, *constraint;
};

struct ConcordemContacts {
	size_t          count;
	const uint32_t* pair;
	const int8_t*   image;
	const uint8_t*  bonded;
	const double *  length, *area, *normal, *distance, *history;
};

struct ConcordemRow {
	uint32_t a, b;
	double   young, shearRatio, cohesion, frictionAngle, crackOnset, ductility, shearContribution, prestress;
	double   omegaThreshold, softStrain, relativeSoftStiffness;
	int32_t  damageLaw, neverDamage;
};

struct ConcordemCell {
	double edges[9], gradient[9], rate[9];
};

struct ConcordemFacts {
	size_t   particles, bonds;
	uint64_t broken, steps, searches;
	double   dissipated[4], stored;
	int32_t  needsRotation, threads;
};

ConcordemBonds* concordem_yade_bonds_concrete(
        const ConcordemBodies*,
        const ConcordemContacts*,
        const ConcordemRow*,
        size_t      rows,
        size_t      materials,
        const char* kinematics,
        const char* mode,
        const ConcordemCell*,
        double  dt,
        int32_t threads,
        const ConcordemMessage*);
ConcordemBonds* concordem_yade_bonds_scenario(const char* text, const ConcordemBodies*, double dt, int32_t threads, const ConcordemMessage*);
ConcordemBonds* concordem_yade_bonds_load(const int32_t* words, size_t count, int32_t threads, const ConcordemMessage*);
void            concordem_yade_bonds_delete(ConcordemBonds*);
int64_t         concordem_yade_bonds_words(const ConcordemBonds*, void (*take)(void*, const int32_t*, size_t), void* context, const ConcordemMessage*);
void            concordem_yade_bonds_facts(const ConcordemBonds*, ConcordemFacts*);
const uint32_t* concordem_yade_bonds_ids(const ConcordemBonds*);
void            concordem_yade_bonds_forces(const ConcordemBonds*, const double** force, const double** torque);
int64_t         concordem_yade_bonds_step(
                ConcordemBonds*,
                int32_t (*present)(const void* context, size_t particle, uint32_t body),
                const void* context,
                const double* const (*states)[4],
                const uint32_t* const* blocked,
                double                 dt,
                const ConcordemCell*,
                int32_t sample,
                int (*pause)(int),
                const ConcordemMessage*);
int64_t concordem_yade_bonds_virial(ConcordemBonds*, double* virial, const ConcordemMessage*);
int64_t concordem_yade_bonds_particles(
        ConcordemBonds*, double crackOnset, double* damage, uint32_t* lost, double (*stress)[9], const ConcordemMessage*);
}
