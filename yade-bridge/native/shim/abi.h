/* Functions and structures of the Rust library (../src). Generated from the Rust sources by the test c_header: do not edit.

   SPDX-License-Identifier: MIT OR Apache-2.0 */

#pragma once

#include <stddef.h>
#include <stdint.h>

/// Outcome of a step of one contact.
enum class ConcordemCpmOutcome : int32_t {
  /// The contact continues.
  Lives = 0,
  /// The contact must be deleted.
  Lost = 1,
  /// The strain is NaN.
  NotANumber = -1,
  /// `damLaw` is neither 0 nor 1.
  DamageLaw = -2,
  /// The library panicked.
  Internal = -3,
};

/// Outcome of a step of one bond.
enum class ConcordemBondOutcome : int32_t {
  /// The bond is intact.
  Lives = 0,
  /// The bond broke.
  Broke = 1,
  /// The contact without a bond opened, or was never closed.
  Opened = 2,
  /// The force is not finite.
  NotANumber = -1,
  /// The library panicked.
  Internal = -3,
};

/// Bonds of a scene, and the threads that compute their forces.
struct ConcordemBonds;

/// Scratch memory and threads of the pass.
struct ConcordemDeformationScratch;

/// A row of coefficients of a law.
struct ConcordemLawRow;

/// Parameters, motion, history, and results of one contact, named as in YADE's classes; SI units.
struct ConcordemCpmContact {
  double young;
  double shearModulus;
  double frictionCoefficient;
  double cohesion;
  double crackOnsetStrain;
  double fracture;
  double shearContribution;
  double prestress;
  double referenceLength;
  double referencePenetration;
  double area;
  double omegaThreshold;
  double softStrain;
  double relativeSoftStiffness;
  double penetration;
  double normal[3];
  double shearIncrement[3];
  /// `ScGeom::orthonormal_axis`.
  double swing[3];
  /// `ScGeom::twist_axis`.
  double twist[3];
  double strain;
  double kappa;
  double omega;
  double plasticStrain;
  double shearStrain[3];
  double plasticShearStrain[3];
  double normalStress;
  double shearStress[3];
  double residualStrength;
  double damageEnergy;
  double frictionEnergy;
  double storedEnergy;
  double integrationEnergy;
  int32_t damageLaw;
  int32_t neverDamage;
  int32_t cohesive;
  /// Whether the contact was created in this step.
  int32_t fresh;
};

/// Parameters of `LinearBond`, SI units.
struct ConcordemLinearBondParameters {
  double normalStiffness;
  double shearStiffness;
  double dampingRatio;
  double normalStrength;
  double shearStrength;
  int32_t subtractInitialGap;
};

/// Addresses of the position (m), velocity (m/s), angular velocity (rad/s), three reals each, and orientation (x, y, z, w) of a
/// body.
struct ConcordemBodyMotion {
  const double *position;
  const double *velocity;
  const double *angularVelocity;
  const double *orientation;
};

/// A body of a bond.
struct ConcordemBondedBody {
  ConcordemBodyMotion motion;
  /// Radius, m.
  double radius;
  /// Mass, kg.
  double mass;
  /// Surface displacement in this step and in the previous one, m: addresses of six reals each (xx, yy, zz, yz, xz, xy), or null for
  /// a rigid body.
  const double *surfaceDisplacement[2];
};

/// Parameters, motion, history, and results of one bond; SI units.
struct ConcordemLinearBondContact {
  ConcordemLinearBondParameters parameters;
  ConcordemBondedBody bodies[2];
  /// Displacement of the second body's periodic image, m.
  double shift[3];
  /// Time step, s.
  double dt;
  /// Reference length, m; 0 before the first step, which sets it.
  double referenceLength;
  /// History: distance of the centers at the last step, m, then the unit vector from the first body to the second and the fields of
  /// `LinearBondState`.
  double length;
  double normal[3];
  double shearDisplacement[3];
  double normalDashpot;
  double shearDashpot[3];
  /// Force on the first body, N; the second gets the opposite.
  double force[3];
  /// Torques on both bodies about their centers, N·m.
  double torque[2][3];
  /// Stored energy, J.
  double storedEnergy;
  /// Energies of this step, J: dissipated by breaking, dissipated by dashpots, error of the work rule.
  double damageEnergy;
  double viscousEnergy;
  double integrationEnergy;
};

/// Elastic constants of a particle: Young's modulus (Pa; infinite for a rigid particle) and Poisson's ratio.
struct ConcordemElasticity {
  double young;
  double poisson;
};

/// Caller's buffer for an error message, zero-terminated.
struct ConcordemMessage {
  /// First byte of the buffer; if null, the message is dropped.
  char *text;
  /// Size of the buffer, bytes.
  size_t capacity;
};

/// A body of a contact.
struct ConcordemLawBody {
  ConcordemBodyMotion motion;
  /// Radius, m.
  double radius;
  /// Mass, kg.
  double mass;
};

/// Motion, history, and results of one contact; SI units.
struct ConcordemLawContact {
  ConcordemLawBody bodies[2];
  /// Displacement of the second body's periodic image, m.
  double shift[3];
  /// Velocity of this displacement, m/s.
  double shiftVelocity[3];
  /// Time step, s.
  double dt;
  /// Mean radius of the bonded spheres, m.
  double meanRadius;
  /// Length without strain, m, and area, m²; a length of 0 before the first step, which sets both.
  double referenceLength;
  double area;
  /// Distance of the centers at the last step, m, and the direction from the first body to the second.
  double length;
  double normal[3];
  /// History: address of the reals of the law.
  double *history;
  /// Force on the first body, N; the second gets the opposite.
  double force[3];
  /// Torques on both bodies about their centers, N·m.
  double torque[2][3];
  /// Moment on the first body about the contact point, N·m.
  double moment[3];
  /// Stiffnesses in tension and shear, N/m, bending and twist, N·m/rad.
  double stiffness[4];
  /// Stored energy, J.
  double storedEnergy;
  /// Energies of this step, J: dissipated by damage, friction, dashpots; error of the work rule.
  double damageEnergy;
  double frictionEnergy;
  double viscousEnergy;
  double integrationEnergy;
};

/// A deformable body with the addresses of its history and results, six reals each (xx, yy, zz, yz, xz, xy).
struct ConcordemDeformableBody {
  /// Index of its elasticity.
  uint32_t material;
  /// Bit mask of its prescribed degrees of freedom (`Constraint`).
  uint32_t blocked;
  /// Radius, m.
  double radius;
  /// History, N: particle virials, see `Deformation`.
  double *dyad;
  double *used;
  double *other;
  double *reaction;
  /// Surface displacement in the next step, m.
  double *surfaceDisplacement;
  /// Surface displacement in this step, m.
  double *surfaceDisplacementBefore;
  /// Stress, Pa.
  double *stress;
};

/// Force of a bond in this step.
struct ConcordemBondForce {
  /// Indices of the two bodies.
  uint32_t bodies[2];
  /// Unit vector from the first body to the second: address of three reals.
  const double *normal;
  /// Force on the first body, N: address of three reals.
  const double *force;
  /// Normal force of the dashpot, N.
  double normalDashpot;
  /// Shear force of the dashpot, N: address of three reals.
  const double *shearDashpot;
};

/// Input of [`concordem_yade_deformation`].
struct ConcordemDeformableScene {
  const ConcordemDeformableBody *bodies;
  size_t bodyCount;
  /// Bonds; sums follow this order.
  const ConcordemBondForce *bonds;
  size_t bondCount;
  const ConcordemElasticity *materials;
  size_t materialCount;
  /// solid, plane-strain, or plane-stress.
  const char *condition;
  /// Whether dashpot forces strain the particles.
  int32_t dashpots;
};

/// Energies of the deformation of all particles, J: see `DeformationSums`.
struct ConcordemDeformationEnergies {
  double stored;
  double lag;
  double other;
  double reactions;
};

/// Columns of `count` bodies, see `Bodies` in `src/assembly/concrete.rs`. Vectors have three reals, orientations four.
struct ConcordemBodyArrays {
  size_t count;
  const uint32_t *id;
  const double *position;
  const double *velocity;
  const double *orientation;
  const double *angularVelocity;
  const double *radius;
  const double *mass;
  const double *inertia;
  const uint32_t *material;
  const uint32_t *constraint;
  const uint32_t *lost;
};

/// Columns of `count` contacts, see `Contacts` in `src/assembly/concrete.rs`.
struct ConcordemContactArrays {
  size_t count;
  const uint32_t *pair;
  const int8_t *image;
  const uint8_t *bonded;
  const double *length;
  const double *area;
  const double *normal;
  const double *distance;
  const double *history;
  const double *radii;
  const double *referenceOverlap;
  const double *stored;
};

/// Parameters of concrete between materials `a` and `b`, as in YADE's material and law.
struct ConcordemPairCoefficients {
  uint32_t a;
  uint32_t b;
  double young;
  double shearRatio;
  double cohesion;
  double frictionAngle;
  double crackOnsetStrain;
  double ductility;
  double shearContribution;
  double prestress;
  double omegaThreshold;
  double softStrain;
  double relativeSoftStiffness;
  int32_t damageLaw;
  int32_t neverDamage;
};

/// Edges (m, as columns), deformation gradient, and velocity gradient (1/s) of the cell, in row-major order.
struct ConcordemCellArrays {
  double edges[9];
  double gradient[9];
  double rate[9];
};

/// Concrete to take over.
struct ConcordemConcreteScene {
  const ConcordemBodyArrays *bodies;
  const ConcordemContactArrays *contacts;
  /// Parameters of all pairs of materials.
  const ConcordemPairCoefficients *pairs;
  size_t pairCount;
  size_t materialCount;
  /// Name of the kinematics.
  const char *kinematics;
  /// Formulation of the law: yade-public, thesis, or woo.
  const char *formulation;
  /// Null: not periodic.
  const ConcordemCellArrays *cell;
  /// Time step, s.
  double dt;
};

/// Counts and energies of an assembly. Energies in J: dissipated by damage, friction, and dashpots, error of the work rule, and
/// stored.
struct ConcordemFacts {
  size_t particles;
  size_t bonds;
  uint64_t broken;
  uint64_t steps;
  uint64_t neighborListRebuilds;
  double dissipated[4];
  double stored;
  /// Volume of the cell in the last step, m³; 0 without a cell.
  double cellVolume;
  int32_t needsRotation;
  int32_t threads;
};

/// The scene in one step.
struct ConcordemBondedStep {
  /// Returns 1 if particle `k` is still body `id` of the scene, else 0; called from several threads with `context`. States of deleted
  /// bodies are not read.
  int32_t (*present)(const void *context, size_t k, uint32_t id);
  const void *context;
  /// For each particle the addresses of its position, velocity, angular velocity (three reals each), and orientation (x, y, z, w).
  const double *const (*states)[4];
  /// For each particle the address of the bit mask of its prescribed degrees of freedom.
  const uint32_t *const *blocked;
  /// Null: not periodic.
  const ConcordemCellArrays *cell;
  /// Stops OpenMP's waiting threads (`omp_pause_resource_all`); null if YADE does not use OpenMP.
  int32_t (*pause)(int32_t kind);
  /// Time step, s.
  double dt;
  /// Whether to sum stored energies.
  int32_t sample;
};

extern "C" {

/// Compute one step of the concrete law, without energies.
///
/// # Safety
/// `contact` must point to a contact.
ConcordemCpmOutcome concordem_yade_cpm(ConcordemCpmContact *contact);

/// Compute one step of the concrete law, with energies.
///
/// # Safety
/// `contact` must point to a contact.
ConcordemCpmOutcome concordem_yade_cpm_with_energy(ConcordemCpmContact *contact);

/// Compute one step of a bond.
///
/// # Safety
/// `contact` must point to a bond; its addresses must be those of existing bodies.
ConcordemBondOutcome concordem_yade_linear_bond(ConcordemLinearBondContact *contact);

/// Check the parameters of a bond and the elastic constants of its two particles. Returns 0, or −1 and a message.
///
/// # Safety
/// The pointers must be valid.
int64_t concordem_yade_linear_bond_check(const ConcordemLinearBondParameters *parameters,
                                         const ConcordemElasticity (*elasticity)[2],
                                         const ConcordemMessage *message);

/// The row of `law` between two materials, whose tables are TOML; it lives as long as the program. Null and a message if it cannot
/// be made.
///
/// # Safety
/// `law`, `one`, and `two` must be strings that end in zero.
const ConcordemLawRow *concordem_yade_law_row(const char *law,
                                              int32_t bonded,
                                              const char *one,
                                              const char *two,
                                              const ConcordemMessage *message);

/// One step of a contact.
///
/// # Safety
/// `row` must come from [`concordem_yade_law_row`]; the addresses in `contact` must be those of living bodies and of a history of
/// this law.
ConcordemBondOutcome concordem_yade_law_step(const ConcordemLawRow *row, ConcordemLawContact *contact);

/// Create scratch memory of the pass with `threads` threads. Returns null and a message if they cannot be started.
///
/// # Safety
/// `message` must be valid.
ConcordemDeformationScratch *concordem_yade_deformation_scratch(int32_t threads, const ConcordemMessage *message);

/// Delete scratch memory of the pass.
///
/// # Safety
/// `scratch` must be from [`concordem_yade_deformation_scratch`] and not deleted yet.
void concordem_yade_deformation_delete(ConcordemDeformationScratch *scratch);

/// Run the pass after the forces of a step: compute history, surface displacement, and stress of the bodies from the bond forces.
/// Returns 0, or −1 and a message.
///
/// # Safety
/// Arrays must have the stated lengths and contain addresses in existing objects. Body indices must be below `body_count`, material
/// indices below `material_count`.
int64_t concordem_yade_deformation(ConcordemDeformationScratch *scratch,
                                   const ConcordemDeformableScene *scene,
                                   ConcordemDeformationEnergies *energies,
                                   const ConcordemMessage *message);

/// Take over concrete from the scene. Returns null and a message if this is not possible.
ConcordemBonds *concordem_yade_bonds_concrete(const ConcordemConcreteScene *scene,
                                              int32_t threads,
                                              const ConcordemMessage *message);

/// Create the bonds of a scenario between bodies of the scene; of `bodies`, only id, mass, and inertia are read. Returns null and a
/// message if this is not possible.
ConcordemBonds *concordem_yade_bonds_scenario(const char *scenario,
                                              const ConcordemBodyArrays *bodies,
                                              double dt,
                                              int32_t threads,
                                              const ConcordemMessage *message);

/// Load the assembly that [`concordem_yade_bonds_words`] saved. Returns null and a message if the words are invalid.
ConcordemBonds *concordem_yade_bonds_load(const int32_t *words, size_t count, int32_t threads, const ConcordemMessage *message);

/// Delete an assembly.
void concordem_yade_bonds_delete(ConcordemBonds *bonds);

/// Save the assembly: call `take` once with `context`, the words, and their number. Returns 0, or −1 and a message.
int64_t concordem_yade_bonds_words(const ConcordemBonds *bonds,
                                   void (*take)(void *context, const int32_t *words, size_t count),
                                   void *context,
                                   const ConcordemMessage *message);

/// Write counts and energies.
void concordem_yade_bonds_facts(const ConcordemBonds *bonds, ConcordemFacts *facts);

/// Ids of the bodies in the order of the particles; as many as `Facts::particles`.
const uint32_t *concordem_yade_bonds_ids(const ConcordemBonds *bonds);

/// Addresses of the forces (N) and torques (N·m) of the last step, three reals per particle.
void concordem_yade_bonds_forces(const ConcordemBonds *bonds, const double **force, const double **torque);

/// Compute one step at the positions and velocities of the bodies. Returns the number of bonds that broke, or −1 and a message.
int64_t concordem_yade_bonds_step(ConcordemBonds *bonds, const ConcordemBondedStep *step, const ConcordemMessage *message);

/// Write the virial `Σ l⊗f` over all contacts, J: forces of the last step, branch vectors between the present positions, at the
/// addresses `positions` of all particles; if `positions` is null, between the positions of the last step. Nine reals in row-major order,
/// branch vector first. Returns 0, or −1 and a message.
int64_t concordem_yade_bonds_virial(const ConcordemBonds *bonds,
                                    const double (*const *positions)[3],
                                    double (*virial)[9],
                                    const ConcordemMessage *message);

/// Hash of the C header that this library was built with. The shim compares it to the hash of its own header.
uint64_t concordem_yade_header_hash();

/// Compute the attributes of `CpmState` for each particle: mean lost strength of its bonds (1 for one that ended), number of bonds
/// that broke and unbonded contacts that opened, and mean stress (Pa, nine reals, symmetric). Returns 0, or −1 and a message.
int64_t concordem_yade_bonds_particles(const ConcordemBonds *bonds,
                                       double *damage,
                                       uint32_t *lost,
                                       double (*stress_of)[9],
                                       const ConcordemMessage *message);

/// Compute the attributes of `CpmState` for each particle: mean lost strength of its bonds (1 for one that ended), number of bonds
/// that broke and unbonded contacts that opened, and mean stress (Pa, nine reals, symmetric). Returns 0, or −1 and a message.
int64_t concordem_yade_bonds_particles(const ConcordemBonds *bonds,
                                       double *damage,
                                       uint32_t *lost,
                                       double (*stress_of)[9],
                                       const ConcordemMessage *message);

}  // extern "C"

// Layout of the structures in Rust.
static_assert(offsetof(ConcordemMessage, text) == 0 && sizeof(ConcordemMessage::text) == 8, "ConcordemMessage::text");
static_assert(offsetof(ConcordemMessage, capacity) == 8 && sizeof(ConcordemMessage::capacity) == 8, "ConcordemMessage::capacity");
static_assert(sizeof(ConcordemMessage) == 16 && alignof(ConcordemMessage) == 8, "ConcordemMessage");
static_assert(offsetof(ConcordemBodyMotion, position) == 0 && sizeof(ConcordemBodyMotion::position) == 8, "ConcordemBodyMotion::position");
static_assert(offsetof(ConcordemBodyMotion, velocity) == 8 && sizeof(ConcordemBodyMotion::velocity) == 8, "ConcordemBodyMotion::velocity");
static_assert(offsetof(ConcordemBodyMotion, angularVelocity) == 16 && sizeof(ConcordemBodyMotion::angularVelocity) == 8, "ConcordemBodyMotion::angularVelocity");
static_assert(offsetof(ConcordemBodyMotion, orientation) == 24 && sizeof(ConcordemBodyMotion::orientation) == 8, "ConcordemBodyMotion::orientation");
static_assert(sizeof(ConcordemBodyMotion) == 32 && alignof(ConcordemBodyMotion) == 8, "ConcordemBodyMotion");
static_assert(offsetof(ConcordemCpmContact, young) == 0 && sizeof(ConcordemCpmContact::young) == 8, "ConcordemCpmContact::young");
static_assert(offsetof(ConcordemCpmContact, shearModulus) == 8 && sizeof(ConcordemCpmContact::shearModulus) == 8, "ConcordemCpmContact::shearModulus");
static_assert(offsetof(ConcordemCpmContact, frictionCoefficient) == 16 && sizeof(ConcordemCpmContact::frictionCoefficient) == 8, "ConcordemCpmContact::frictionCoefficient");
static_assert(offsetof(ConcordemCpmContact, cohesion) == 24 && sizeof(ConcordemCpmContact::cohesion) == 8, "ConcordemCpmContact::cohesion");
static_assert(offsetof(ConcordemCpmContact, crackOnsetStrain) == 32 && sizeof(ConcordemCpmContact::crackOnsetStrain) == 8, "ConcordemCpmContact::crackOnsetStrain");
static_assert(offsetof(ConcordemCpmContact, fracture) == 40 && sizeof(ConcordemCpmContact::fracture) == 8, "ConcordemCpmContact::fracture");
static_assert(offsetof(ConcordemCpmContact, shearContribution) == 48 && sizeof(ConcordemCpmContact::shearContribution) == 8, "ConcordemCpmContact::shearContribution");
static_assert(offsetof(ConcordemCpmContact, prestress) == 56 && sizeof(ConcordemCpmContact::prestress) == 8, "ConcordemCpmContact::prestress");
static_assert(offsetof(ConcordemCpmContact, referenceLength) == 64 && sizeof(ConcordemCpmContact::referenceLength) == 8, "ConcordemCpmContact::referenceLength");
static_assert(offsetof(ConcordemCpmContact, referencePenetration) == 72 && sizeof(ConcordemCpmContact::referencePenetration) == 8, "ConcordemCpmContact::referencePenetration");
static_assert(offsetof(ConcordemCpmContact, area) == 80 && sizeof(ConcordemCpmContact::area) == 8, "ConcordemCpmContact::area");
static_assert(offsetof(ConcordemCpmContact, omegaThreshold) == 88 && sizeof(ConcordemCpmContact::omegaThreshold) == 8, "ConcordemCpmContact::omegaThreshold");
static_assert(offsetof(ConcordemCpmContact, softStrain) == 96 && sizeof(ConcordemCpmContact::softStrain) == 8, "ConcordemCpmContact::softStrain");
static_assert(offsetof(ConcordemCpmContact, relativeSoftStiffness) == 104 && sizeof(ConcordemCpmContact::relativeSoftStiffness) == 8, "ConcordemCpmContact::relativeSoftStiffness");
static_assert(offsetof(ConcordemCpmContact, penetration) == 112 && sizeof(ConcordemCpmContact::penetration) == 8, "ConcordemCpmContact::penetration");
static_assert(offsetof(ConcordemCpmContact, normal) == 120 && sizeof(ConcordemCpmContact::normal) == 24, "ConcordemCpmContact::normal");
static_assert(offsetof(ConcordemCpmContact, shearIncrement) == 144 && sizeof(ConcordemCpmContact::shearIncrement) == 24, "ConcordemCpmContact::shearIncrement");
static_assert(offsetof(ConcordemCpmContact, swing) == 168 && sizeof(ConcordemCpmContact::swing) == 24, "ConcordemCpmContact::swing");
static_assert(offsetof(ConcordemCpmContact, twist) == 192 && sizeof(ConcordemCpmContact::twist) == 24, "ConcordemCpmContact::twist");
static_assert(offsetof(ConcordemCpmContact, strain) == 216 && sizeof(ConcordemCpmContact::strain) == 8, "ConcordemCpmContact::strain");
static_assert(offsetof(ConcordemCpmContact, kappa) == 224 && sizeof(ConcordemCpmContact::kappa) == 8, "ConcordemCpmContact::kappa");
static_assert(offsetof(ConcordemCpmContact, omega) == 232 && sizeof(ConcordemCpmContact::omega) == 8, "ConcordemCpmContact::omega");
static_assert(offsetof(ConcordemCpmContact, plasticStrain) == 240 && sizeof(ConcordemCpmContact::plasticStrain) == 8, "ConcordemCpmContact::plasticStrain");
static_assert(offsetof(ConcordemCpmContact, shearStrain) == 248 && sizeof(ConcordemCpmContact::shearStrain) == 24, "ConcordemCpmContact::shearStrain");
static_assert(offsetof(ConcordemCpmContact, plasticShearStrain) == 272 && sizeof(ConcordemCpmContact::plasticShearStrain) == 24, "ConcordemCpmContact::plasticShearStrain");
static_assert(offsetof(ConcordemCpmContact, normalStress) == 296 && sizeof(ConcordemCpmContact::normalStress) == 8, "ConcordemCpmContact::normalStress");
static_assert(offsetof(ConcordemCpmContact, shearStress) == 304 && sizeof(ConcordemCpmContact::shearStress) == 24, "ConcordemCpmContact::shearStress");
static_assert(offsetof(ConcordemCpmContact, residualStrength) == 328 && sizeof(ConcordemCpmContact::residualStrength) == 8, "ConcordemCpmContact::residualStrength");
static_assert(offsetof(ConcordemCpmContact, damageEnergy) == 336 && sizeof(ConcordemCpmContact::damageEnergy) == 8, "ConcordemCpmContact::damageEnergy");
static_assert(offsetof(ConcordemCpmContact, frictionEnergy) == 344 && sizeof(ConcordemCpmContact::frictionEnergy) == 8, "ConcordemCpmContact::frictionEnergy");
static_assert(offsetof(ConcordemCpmContact, storedEnergy) == 352 && sizeof(ConcordemCpmContact::storedEnergy) == 8, "ConcordemCpmContact::storedEnergy");
static_assert(offsetof(ConcordemCpmContact, integrationEnergy) == 360 && sizeof(ConcordemCpmContact::integrationEnergy) == 8, "ConcordemCpmContact::integrationEnergy");
static_assert(offsetof(ConcordemCpmContact, damageLaw) == 368 && sizeof(ConcordemCpmContact::damageLaw) == 4, "ConcordemCpmContact::damageLaw");
static_assert(offsetof(ConcordemCpmContact, neverDamage) == 372 && sizeof(ConcordemCpmContact::neverDamage) == 4, "ConcordemCpmContact::neverDamage");
static_assert(offsetof(ConcordemCpmContact, cohesive) == 376 && sizeof(ConcordemCpmContact::cohesive) == 4, "ConcordemCpmContact::cohesive");
static_assert(offsetof(ConcordemCpmContact, fresh) == 380 && sizeof(ConcordemCpmContact::fresh) == 4, "ConcordemCpmContact::fresh");
static_assert(sizeof(ConcordemCpmContact) == 384 && alignof(ConcordemCpmContact) == 8, "ConcordemCpmContact");
static_assert(offsetof(ConcordemLinearBondParameters, normalStiffness) == 0 && sizeof(ConcordemLinearBondParameters::normalStiffness) == 8, "ConcordemLinearBondParameters::normalStiffness");
static_assert(offsetof(ConcordemLinearBondParameters, shearStiffness) == 8 && sizeof(ConcordemLinearBondParameters::shearStiffness) == 8, "ConcordemLinearBondParameters::shearStiffness");
static_assert(offsetof(ConcordemLinearBondParameters, dampingRatio) == 16 && sizeof(ConcordemLinearBondParameters::dampingRatio) == 8, "ConcordemLinearBondParameters::dampingRatio");
static_assert(offsetof(ConcordemLinearBondParameters, normalStrength) == 24 && sizeof(ConcordemLinearBondParameters::normalStrength) == 8, "ConcordemLinearBondParameters::normalStrength");
static_assert(offsetof(ConcordemLinearBondParameters, shearStrength) == 32 && sizeof(ConcordemLinearBondParameters::shearStrength) == 8, "ConcordemLinearBondParameters::shearStrength");
static_assert(offsetof(ConcordemLinearBondParameters, subtractInitialGap) == 40 && sizeof(ConcordemLinearBondParameters::subtractInitialGap) == 4, "ConcordemLinearBondParameters::subtractInitialGap");
static_assert(sizeof(ConcordemLinearBondParameters) == 48 && alignof(ConcordemLinearBondParameters) == 8, "ConcordemLinearBondParameters");
static_assert(offsetof(ConcordemBondedBody, motion) == 0 && sizeof(ConcordemBondedBody::motion) == 32, "ConcordemBondedBody::motion");
static_assert(offsetof(ConcordemBondedBody, radius) == 32 && sizeof(ConcordemBondedBody::radius) == 8, "ConcordemBondedBody::radius");
static_assert(offsetof(ConcordemBondedBody, mass) == 40 && sizeof(ConcordemBondedBody::mass) == 8, "ConcordemBondedBody::mass");
static_assert(offsetof(ConcordemBondedBody, surfaceDisplacement) == 48 && sizeof(ConcordemBondedBody::surfaceDisplacement) == 16, "ConcordemBondedBody::surfaceDisplacement");
static_assert(sizeof(ConcordemBondedBody) == 64 && alignof(ConcordemBondedBody) == 8, "ConcordemBondedBody");
static_assert(offsetof(ConcordemLinearBondContact, parameters) == 0 && sizeof(ConcordemLinearBondContact::parameters) == 48, "ConcordemLinearBondContact::parameters");
static_assert(offsetof(ConcordemLinearBondContact, bodies) == 48 && sizeof(ConcordemLinearBondContact::bodies) == 128, "ConcordemLinearBondContact::bodies");
static_assert(offsetof(ConcordemLinearBondContact, shift) == 176 && sizeof(ConcordemLinearBondContact::shift) == 24, "ConcordemLinearBondContact::shift");
static_assert(offsetof(ConcordemLinearBondContact, dt) == 200 && sizeof(ConcordemLinearBondContact::dt) == 8, "ConcordemLinearBondContact::dt");
static_assert(offsetof(ConcordemLinearBondContact, referenceLength) == 208 && sizeof(ConcordemLinearBondContact::referenceLength) == 8, "ConcordemLinearBondContact::referenceLength");
static_assert(offsetof(ConcordemLinearBondContact, length) == 216 && sizeof(ConcordemLinearBondContact::length) == 8, "ConcordemLinearBondContact::length");
static_assert(offsetof(ConcordemLinearBondContact, normal) == 224 && sizeof(ConcordemLinearBondContact::normal) == 24, "ConcordemLinearBondContact::normal");
static_assert(offsetof(ConcordemLinearBondContact, shearDisplacement) == 248 && sizeof(ConcordemLinearBondContact::shearDisplacement) == 24, "ConcordemLinearBondContact::shearDisplacement");
static_assert(offsetof(ConcordemLinearBondContact, normalDashpot) == 272 && sizeof(ConcordemLinearBondContact::normalDashpot) == 8, "ConcordemLinearBondContact::normalDashpot");
static_assert(offsetof(ConcordemLinearBondContact, shearDashpot) == 280 && sizeof(ConcordemLinearBondContact::shearDashpot) == 24, "ConcordemLinearBondContact::shearDashpot");
static_assert(offsetof(ConcordemLinearBondContact, force) == 304 && sizeof(ConcordemLinearBondContact::force) == 24, "ConcordemLinearBondContact::force");
static_assert(offsetof(ConcordemLinearBondContact, torque) == 328 && sizeof(ConcordemLinearBondContact::torque) == 48, "ConcordemLinearBondContact::torque");
static_assert(offsetof(ConcordemLinearBondContact, storedEnergy) == 376 && sizeof(ConcordemLinearBondContact::storedEnergy) == 8, "ConcordemLinearBondContact::storedEnergy");
static_assert(offsetof(ConcordemLinearBondContact, damageEnergy) == 384 && sizeof(ConcordemLinearBondContact::damageEnergy) == 8, "ConcordemLinearBondContact::damageEnergy");
static_assert(offsetof(ConcordemLinearBondContact, viscousEnergy) == 392 && sizeof(ConcordemLinearBondContact::viscousEnergy) == 8, "ConcordemLinearBondContact::viscousEnergy");
static_assert(offsetof(ConcordemLinearBondContact, integrationEnergy) == 400 && sizeof(ConcordemLinearBondContact::integrationEnergy) == 8, "ConcordemLinearBondContact::integrationEnergy");
static_assert(sizeof(ConcordemLinearBondContact) == 408 && alignof(ConcordemLinearBondContact) == 8, "ConcordemLinearBondContact");
static_assert(offsetof(ConcordemLawBody, motion) == 0 && sizeof(ConcordemLawBody::motion) == 32, "ConcordemLawBody::motion");
static_assert(offsetof(ConcordemLawBody, radius) == 32 && sizeof(ConcordemLawBody::radius) == 8, "ConcordemLawBody::radius");
static_assert(offsetof(ConcordemLawBody, mass) == 40 && sizeof(ConcordemLawBody::mass) == 8, "ConcordemLawBody::mass");
static_assert(sizeof(ConcordemLawBody) == 48 && alignof(ConcordemLawBody) == 8, "ConcordemLawBody");
static_assert(offsetof(ConcordemLawContact, bodies) == 0 && sizeof(ConcordemLawContact::bodies) == 96, "ConcordemLawContact::bodies");
static_assert(offsetof(ConcordemLawContact, shift) == 96 && sizeof(ConcordemLawContact::shift) == 24, "ConcordemLawContact::shift");
static_assert(offsetof(ConcordemLawContact, shiftVelocity) == 120 && sizeof(ConcordemLawContact::shiftVelocity) == 24, "ConcordemLawContact::shiftVelocity");
static_assert(offsetof(ConcordemLawContact, dt) == 144 && sizeof(ConcordemLawContact::dt) == 8, "ConcordemLawContact::dt");
static_assert(offsetof(ConcordemLawContact, meanRadius) == 152 && sizeof(ConcordemLawContact::meanRadius) == 8, "ConcordemLawContact::meanRadius");
static_assert(offsetof(ConcordemLawContact, referenceLength) == 160 && sizeof(ConcordemLawContact::referenceLength) == 8, "ConcordemLawContact::referenceLength");
static_assert(offsetof(ConcordemLawContact, area) == 168 && sizeof(ConcordemLawContact::area) == 8, "ConcordemLawContact::area");
static_assert(offsetof(ConcordemLawContact, length) == 176 && sizeof(ConcordemLawContact::length) == 8, "ConcordemLawContact::length");
static_assert(offsetof(ConcordemLawContact, normal) == 184 && sizeof(ConcordemLawContact::normal) == 24, "ConcordemLawContact::normal");
static_assert(offsetof(ConcordemLawContact, history) == 208 && sizeof(ConcordemLawContact::history) == 8, "ConcordemLawContact::history");
static_assert(offsetof(ConcordemLawContact, force) == 216 && sizeof(ConcordemLawContact::force) == 24, "ConcordemLawContact::force");
static_assert(offsetof(ConcordemLawContact, torque) == 240 && sizeof(ConcordemLawContact::torque) == 48, "ConcordemLawContact::torque");
static_assert(offsetof(ConcordemLawContact, moment) == 288 && sizeof(ConcordemLawContact::moment) == 24, "ConcordemLawContact::moment");
static_assert(offsetof(ConcordemLawContact, stiffness) == 312 && sizeof(ConcordemLawContact::stiffness) == 32, "ConcordemLawContact::stiffness");
static_assert(offsetof(ConcordemLawContact, storedEnergy) == 344 && sizeof(ConcordemLawContact::storedEnergy) == 8, "ConcordemLawContact::storedEnergy");
static_assert(offsetof(ConcordemLawContact, damageEnergy) == 352 && sizeof(ConcordemLawContact::damageEnergy) == 8, "ConcordemLawContact::damageEnergy");
static_assert(offsetof(ConcordemLawContact, frictionEnergy) == 360 && sizeof(ConcordemLawContact::frictionEnergy) == 8, "ConcordemLawContact::frictionEnergy");
static_assert(offsetof(ConcordemLawContact, viscousEnergy) == 368 && sizeof(ConcordemLawContact::viscousEnergy) == 8, "ConcordemLawContact::viscousEnergy");
static_assert(offsetof(ConcordemLawContact, integrationEnergy) == 376 && sizeof(ConcordemLawContact::integrationEnergy) == 8, "ConcordemLawContact::integrationEnergy");
static_assert(sizeof(ConcordemLawContact) == 384 && alignof(ConcordemLawContact) == 8, "ConcordemLawContact");
static_assert(offsetof(ConcordemElasticity, young) == 0 && sizeof(ConcordemElasticity::young) == 8, "ConcordemElasticity::young");
static_assert(offsetof(ConcordemElasticity, poisson) == 8 && sizeof(ConcordemElasticity::poisson) == 8, "ConcordemElasticity::poisson");
static_assert(sizeof(ConcordemElasticity) == 16 && alignof(ConcordemElasticity) == 8, "ConcordemElasticity");
static_assert(offsetof(ConcordemDeformableBody, material) == 0 && sizeof(ConcordemDeformableBody::material) == 4, "ConcordemDeformableBody::material");
static_assert(offsetof(ConcordemDeformableBody, blocked) == 4 && sizeof(ConcordemDeformableBody::blocked) == 4, "ConcordemDeformableBody::blocked");
static_assert(offsetof(ConcordemDeformableBody, radius) == 8 && sizeof(ConcordemDeformableBody::radius) == 8, "ConcordemDeformableBody::radius");
static_assert(offsetof(ConcordemDeformableBody, dyad) == 16 && sizeof(ConcordemDeformableBody::dyad) == 8, "ConcordemDeformableBody::dyad");
static_assert(offsetof(ConcordemDeformableBody, used) == 24 && sizeof(ConcordemDeformableBody::used) == 8, "ConcordemDeformableBody::used");
static_assert(offsetof(ConcordemDeformableBody, other) == 32 && sizeof(ConcordemDeformableBody::other) == 8, "ConcordemDeformableBody::other");
static_assert(offsetof(ConcordemDeformableBody, reaction) == 40 && sizeof(ConcordemDeformableBody::reaction) == 8, "ConcordemDeformableBody::reaction");
static_assert(offsetof(ConcordemDeformableBody, surfaceDisplacement) == 48 && sizeof(ConcordemDeformableBody::surfaceDisplacement) == 8, "ConcordemDeformableBody::surfaceDisplacement");
static_assert(offsetof(ConcordemDeformableBody, surfaceDisplacementBefore) == 56 && sizeof(ConcordemDeformableBody::surfaceDisplacementBefore) == 8, "ConcordemDeformableBody::surfaceDisplacementBefore");
static_assert(offsetof(ConcordemDeformableBody, stress) == 64 && sizeof(ConcordemDeformableBody::stress) == 8, "ConcordemDeformableBody::stress");
static_assert(sizeof(ConcordemDeformableBody) == 72 && alignof(ConcordemDeformableBody) == 8, "ConcordemDeformableBody");
static_assert(offsetof(ConcordemBondForce, bodies) == 0 && sizeof(ConcordemBondForce::bodies) == 8, "ConcordemBondForce::bodies");
static_assert(offsetof(ConcordemBondForce, normal) == 8 && sizeof(ConcordemBondForce::normal) == 8, "ConcordemBondForce::normal");
static_assert(offsetof(ConcordemBondForce, force) == 16 && sizeof(ConcordemBondForce::force) == 8, "ConcordemBondForce::force");
static_assert(offsetof(ConcordemBondForce, normalDashpot) == 24 && sizeof(ConcordemBondForce::normalDashpot) == 8, "ConcordemBondForce::normalDashpot");
static_assert(offsetof(ConcordemBondForce, shearDashpot) == 32 && sizeof(ConcordemBondForce::shearDashpot) == 8, "ConcordemBondForce::shearDashpot");
static_assert(sizeof(ConcordemBondForce) == 40 && alignof(ConcordemBondForce) == 8, "ConcordemBondForce");
static_assert(offsetof(ConcordemDeformableScene, bodies) == 0 && sizeof(ConcordemDeformableScene::bodies) == 8, "ConcordemDeformableScene::bodies");
static_assert(offsetof(ConcordemDeformableScene, bodyCount) == 8 && sizeof(ConcordemDeformableScene::bodyCount) == 8, "ConcordemDeformableScene::bodyCount");
static_assert(offsetof(ConcordemDeformableScene, bonds) == 16 && sizeof(ConcordemDeformableScene::bonds) == 8, "ConcordemDeformableScene::bonds");
static_assert(offsetof(ConcordemDeformableScene, bondCount) == 24 && sizeof(ConcordemDeformableScene::bondCount) == 8, "ConcordemDeformableScene::bondCount");
static_assert(offsetof(ConcordemDeformableScene, materials) == 32 && sizeof(ConcordemDeformableScene::materials) == 8, "ConcordemDeformableScene::materials");
static_assert(offsetof(ConcordemDeformableScene, materialCount) == 40 && sizeof(ConcordemDeformableScene::materialCount) == 8, "ConcordemDeformableScene::materialCount");
static_assert(offsetof(ConcordemDeformableScene, condition) == 48 && sizeof(ConcordemDeformableScene::condition) == 8, "ConcordemDeformableScene::condition");
static_assert(offsetof(ConcordemDeformableScene, dashpots) == 56 && sizeof(ConcordemDeformableScene::dashpots) == 4, "ConcordemDeformableScene::dashpots");
static_assert(sizeof(ConcordemDeformableScene) == 64 && alignof(ConcordemDeformableScene) == 8, "ConcordemDeformableScene");
static_assert(offsetof(ConcordemDeformationEnergies, stored) == 0 && sizeof(ConcordemDeformationEnergies::stored) == 8, "ConcordemDeformationEnergies::stored");
static_assert(offsetof(ConcordemDeformationEnergies, lag) == 8 && sizeof(ConcordemDeformationEnergies::lag) == 8, "ConcordemDeformationEnergies::lag");
static_assert(offsetof(ConcordemDeformationEnergies, other) == 16 && sizeof(ConcordemDeformationEnergies::other) == 8, "ConcordemDeformationEnergies::other");
static_assert(offsetof(ConcordemDeformationEnergies, reactions) == 24 && sizeof(ConcordemDeformationEnergies::reactions) == 8, "ConcordemDeformationEnergies::reactions");
static_assert(sizeof(ConcordemDeformationEnergies) == 32 && alignof(ConcordemDeformationEnergies) == 8, "ConcordemDeformationEnergies");
static_assert(offsetof(ConcordemBodyArrays, count) == 0 && sizeof(ConcordemBodyArrays::count) == 8, "ConcordemBodyArrays::count");
static_assert(offsetof(ConcordemBodyArrays, id) == 8 && sizeof(ConcordemBodyArrays::id) == 8, "ConcordemBodyArrays::id");
static_assert(offsetof(ConcordemBodyArrays, position) == 16 && sizeof(ConcordemBodyArrays::position) == 8, "ConcordemBodyArrays::position");
static_assert(offsetof(ConcordemBodyArrays, velocity) == 24 && sizeof(ConcordemBodyArrays::velocity) == 8, "ConcordemBodyArrays::velocity");
static_assert(offsetof(ConcordemBodyArrays, orientation) == 32 && sizeof(ConcordemBodyArrays::orientation) == 8, "ConcordemBodyArrays::orientation");
static_assert(offsetof(ConcordemBodyArrays, angularVelocity) == 40 && sizeof(ConcordemBodyArrays::angularVelocity) == 8, "ConcordemBodyArrays::angularVelocity");
static_assert(offsetof(ConcordemBodyArrays, radius) == 48 && sizeof(ConcordemBodyArrays::radius) == 8, "ConcordemBodyArrays::radius");
static_assert(offsetof(ConcordemBodyArrays, mass) == 56 && sizeof(ConcordemBodyArrays::mass) == 8, "ConcordemBodyArrays::mass");
static_assert(offsetof(ConcordemBodyArrays, inertia) == 64 && sizeof(ConcordemBodyArrays::inertia) == 8, "ConcordemBodyArrays::inertia");
static_assert(offsetof(ConcordemBodyArrays, material) == 72 && sizeof(ConcordemBodyArrays::material) == 8, "ConcordemBodyArrays::material");
static_assert(offsetof(ConcordemBodyArrays, constraint) == 80 && sizeof(ConcordemBodyArrays::constraint) == 8, "ConcordemBodyArrays::constraint");
static_assert(offsetof(ConcordemBodyArrays, lost) == 88 && sizeof(ConcordemBodyArrays::lost) == 8, "ConcordemBodyArrays::lost");
static_assert(sizeof(ConcordemBodyArrays) == 96 && alignof(ConcordemBodyArrays) == 8, "ConcordemBodyArrays");
static_assert(offsetof(ConcordemContactArrays, count) == 0 && sizeof(ConcordemContactArrays::count) == 8, "ConcordemContactArrays::count");
static_assert(offsetof(ConcordemContactArrays, pair) == 8 && sizeof(ConcordemContactArrays::pair) == 8, "ConcordemContactArrays::pair");
static_assert(offsetof(ConcordemContactArrays, image) == 16 && sizeof(ConcordemContactArrays::image) == 8, "ConcordemContactArrays::image");
static_assert(offsetof(ConcordemContactArrays, bonded) == 24 && sizeof(ConcordemContactArrays::bonded) == 8, "ConcordemContactArrays::bonded");
static_assert(offsetof(ConcordemContactArrays, length) == 32 && sizeof(ConcordemContactArrays::length) == 8, "ConcordemContactArrays::length");
static_assert(offsetof(ConcordemContactArrays, area) == 40 && sizeof(ConcordemContactArrays::area) == 8, "ConcordemContactArrays::area");
static_assert(offsetof(ConcordemContactArrays, normal) == 48 && sizeof(ConcordemContactArrays::normal) == 8, "ConcordemContactArrays::normal");
static_assert(offsetof(ConcordemContactArrays, distance) == 56 && sizeof(ConcordemContactArrays::distance) == 8, "ConcordemContactArrays::distance");
static_assert(offsetof(ConcordemContactArrays, history) == 64 && sizeof(ConcordemContactArrays::history) == 8, "ConcordemContactArrays::history");
static_assert(offsetof(ConcordemContactArrays, radii) == 72 && sizeof(ConcordemContactArrays::radii) == 8, "ConcordemContactArrays::radii");
static_assert(offsetof(ConcordemContactArrays, referenceOverlap) == 80 && sizeof(ConcordemContactArrays::referenceOverlap) == 8, "ConcordemContactArrays::referenceOverlap");
static_assert(offsetof(ConcordemContactArrays, stored) == 88 && sizeof(ConcordemContactArrays::stored) == 8, "ConcordemContactArrays::stored");
static_assert(sizeof(ConcordemContactArrays) == 96 && alignof(ConcordemContactArrays) == 8, "ConcordemContactArrays");
static_assert(offsetof(ConcordemPairCoefficients, a) == 0 && sizeof(ConcordemPairCoefficients::a) == 4, "ConcordemPairCoefficients::a");
static_assert(offsetof(ConcordemPairCoefficients, b) == 4 && sizeof(ConcordemPairCoefficients::b) == 4, "ConcordemPairCoefficients::b");
static_assert(offsetof(ConcordemPairCoefficients, young) == 8 && sizeof(ConcordemPairCoefficients::young) == 8, "ConcordemPairCoefficients::young");
static_assert(offsetof(ConcordemPairCoefficients, shearRatio) == 16 && sizeof(ConcordemPairCoefficients::shearRatio) == 8, "ConcordemPairCoefficients::shearRatio");
static_assert(offsetof(ConcordemPairCoefficients, cohesion) == 24 && sizeof(ConcordemPairCoefficients::cohesion) == 8, "ConcordemPairCoefficients::cohesion");
static_assert(offsetof(ConcordemPairCoefficients, frictionAngle) == 32 && sizeof(ConcordemPairCoefficients::frictionAngle) == 8, "ConcordemPairCoefficients::frictionAngle");
static_assert(offsetof(ConcordemPairCoefficients, crackOnsetStrain) == 40 && sizeof(ConcordemPairCoefficients::crackOnsetStrain) == 8, "ConcordemPairCoefficients::crackOnsetStrain");
static_assert(offsetof(ConcordemPairCoefficients, ductility) == 48 && sizeof(ConcordemPairCoefficients::ductility) == 8, "ConcordemPairCoefficients::ductility");
static_assert(offsetof(ConcordemPairCoefficients, shearContribution) == 56 && sizeof(ConcordemPairCoefficients::shearContribution) == 8, "ConcordemPairCoefficients::shearContribution");
static_assert(offsetof(ConcordemPairCoefficients, prestress) == 64 && sizeof(ConcordemPairCoefficients::prestress) == 8, "ConcordemPairCoefficients::prestress");
static_assert(offsetof(ConcordemPairCoefficients, omegaThreshold) == 72 && sizeof(ConcordemPairCoefficients::omegaThreshold) == 8, "ConcordemPairCoefficients::omegaThreshold");
static_assert(offsetof(ConcordemPairCoefficients, softStrain) == 80 && sizeof(ConcordemPairCoefficients::softStrain) == 8, "ConcordemPairCoefficients::softStrain");
static_assert(offsetof(ConcordemPairCoefficients, relativeSoftStiffness) == 88 && sizeof(ConcordemPairCoefficients::relativeSoftStiffness) == 8, "ConcordemPairCoefficients::relativeSoftStiffness");
static_assert(offsetof(ConcordemPairCoefficients, damageLaw) == 96 && sizeof(ConcordemPairCoefficients::damageLaw) == 4, "ConcordemPairCoefficients::damageLaw");
static_assert(offsetof(ConcordemPairCoefficients, neverDamage) == 100 && sizeof(ConcordemPairCoefficients::neverDamage) == 4, "ConcordemPairCoefficients::neverDamage");
static_assert(sizeof(ConcordemPairCoefficients) == 104 && alignof(ConcordemPairCoefficients) == 8, "ConcordemPairCoefficients");
static_assert(offsetof(ConcordemCellArrays, edges) == 0 && sizeof(ConcordemCellArrays::edges) == 72, "ConcordemCellArrays::edges");
static_assert(offsetof(ConcordemCellArrays, gradient) == 72 && sizeof(ConcordemCellArrays::gradient) == 72, "ConcordemCellArrays::gradient");
static_assert(offsetof(ConcordemCellArrays, rate) == 144 && sizeof(ConcordemCellArrays::rate) == 72, "ConcordemCellArrays::rate");
static_assert(sizeof(ConcordemCellArrays) == 216 && alignof(ConcordemCellArrays) == 8, "ConcordemCellArrays");
static_assert(offsetof(ConcordemFacts, particles) == 0 && sizeof(ConcordemFacts::particles) == 8, "ConcordemFacts::particles");
static_assert(offsetof(ConcordemFacts, bonds) == 8 && sizeof(ConcordemFacts::bonds) == 8, "ConcordemFacts::bonds");
static_assert(offsetof(ConcordemFacts, broken) == 16 && sizeof(ConcordemFacts::broken) == 8, "ConcordemFacts::broken");
static_assert(offsetof(ConcordemFacts, steps) == 24 && sizeof(ConcordemFacts::steps) == 8, "ConcordemFacts::steps");
static_assert(offsetof(ConcordemFacts, neighborListRebuilds) == 32 && sizeof(ConcordemFacts::neighborListRebuilds) == 8, "ConcordemFacts::neighborListRebuilds");
static_assert(offsetof(ConcordemFacts, dissipated) == 40 && sizeof(ConcordemFacts::dissipated) == 32, "ConcordemFacts::dissipated");
static_assert(offsetof(ConcordemFacts, stored) == 72 && sizeof(ConcordemFacts::stored) == 8, "ConcordemFacts::stored");
static_assert(offsetof(ConcordemFacts, cellVolume) == 80 && sizeof(ConcordemFacts::cellVolume) == 8, "ConcordemFacts::cellVolume");
static_assert(offsetof(ConcordemFacts, needsRotation) == 88 && sizeof(ConcordemFacts::needsRotation) == 4, "ConcordemFacts::needsRotation");
static_assert(offsetof(ConcordemFacts, threads) == 92 && sizeof(ConcordemFacts::threads) == 4, "ConcordemFacts::threads");
static_assert(sizeof(ConcordemFacts) == 96 && alignof(ConcordemFacts) == 8, "ConcordemFacts");
static_assert(offsetof(ConcordemConcreteScene, bodies) == 0 && sizeof(ConcordemConcreteScene::bodies) == 8, "ConcordemConcreteScene::bodies");
static_assert(offsetof(ConcordemConcreteScene, contacts) == 8 && sizeof(ConcordemConcreteScene::contacts) == 8, "ConcordemConcreteScene::contacts");
static_assert(offsetof(ConcordemConcreteScene, pairs) == 16 && sizeof(ConcordemConcreteScene::pairs) == 8, "ConcordemConcreteScene::pairs");
static_assert(offsetof(ConcordemConcreteScene, pairCount) == 24 && sizeof(ConcordemConcreteScene::pairCount) == 8, "ConcordemConcreteScene::pairCount");
static_assert(offsetof(ConcordemConcreteScene, materialCount) == 32 && sizeof(ConcordemConcreteScene::materialCount) == 8, "ConcordemConcreteScene::materialCount");
static_assert(offsetof(ConcordemConcreteScene, kinematics) == 40 && sizeof(ConcordemConcreteScene::kinematics) == 8, "ConcordemConcreteScene::kinematics");
static_assert(offsetof(ConcordemConcreteScene, formulation) == 48 && sizeof(ConcordemConcreteScene::formulation) == 8, "ConcordemConcreteScene::formulation");
static_assert(offsetof(ConcordemConcreteScene, cell) == 56 && sizeof(ConcordemConcreteScene::cell) == 8, "ConcordemConcreteScene::cell");
static_assert(offsetof(ConcordemConcreteScene, dt) == 64 && sizeof(ConcordemConcreteScene::dt) == 8, "ConcordemConcreteScene::dt");
static_assert(sizeof(ConcordemConcreteScene) == 72 && alignof(ConcordemConcreteScene) == 8, "ConcordemConcreteScene");
static_assert(offsetof(ConcordemBondedStep, present) == 0 && sizeof(ConcordemBondedStep::present) == 8, "ConcordemBondedStep::present");
static_assert(offsetof(ConcordemBondedStep, context) == 8 && sizeof(ConcordemBondedStep::context) == 8, "ConcordemBondedStep::context");
static_assert(offsetof(ConcordemBondedStep, states) == 16 && sizeof(ConcordemBondedStep::states) == 8, "ConcordemBondedStep::states");
static_assert(offsetof(ConcordemBondedStep, blocked) == 24 && sizeof(ConcordemBondedStep::blocked) == 8, "ConcordemBondedStep::blocked");
static_assert(offsetof(ConcordemBondedStep, cell) == 32 && sizeof(ConcordemBondedStep::cell) == 8, "ConcordemBondedStep::cell");
static_assert(offsetof(ConcordemBondedStep, pause) == 40 && sizeof(ConcordemBondedStep::pause) == 8, "ConcordemBondedStep::pause");
static_assert(offsetof(ConcordemBondedStep, dt) == 48 && sizeof(ConcordemBondedStep::dt) == 8, "ConcordemBondedStep::dt");
static_assert(offsetof(ConcordemBondedStep, sample) == 56 && sizeof(ConcordemBondedStep::sample) == 4, "ConcordemBondedStep::sample");
static_assert(sizeof(ConcordemBondedStep) == 64 && alignof(ConcordemBondedStep) == 8, "ConcordemBondedStep");

#define CONCORDEM_HEADER_HASH UINT64_C(0x87081a8c5d9f6502)
