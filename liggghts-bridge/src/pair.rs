//! Contacts of LIGGGHTS' neighbor lists, stored in LIGGGHTS' contact history.

use concordem_contact::kinematics::{ImageShift, Motion, MotionMeasure, PointKinematics, PreviousGeometry};
use concordem_contact::law::{Kinematics, LawState, Parity, Response, Status};
use concordem_contact::math::{Quat, Vec3, quaternion_of_rotation_vector};
use concordem_contact::step::{AtWall, Contact, Ends, WallMotion, wrenches};
use concordem_solver::PairCoefficients;
use concordem_solver::state::walls::ClosestPoint;

use crate::atoms::FROZEN_MASS;
use crate::host_laws::HostLaw;

mod models;
pub use models::{MODELS, Model, Properties, law, property};

/// Atom arrays for a pass over the neighbor lists; all cover owned atoms and ghosts.
pub struct Pass<'a> {
    /// Position, m.
    pub position: &'a [[f64; 3]],
    /// Velocity, m/s.
    pub velocity: &'a [[f64; 3]],
    /// Angular velocity, rad/s.
    pub angular_velocity: &'a [[f64; 3]],
    /// Radius, m.
    pub radius: &'a [f64],
    /// Mass, kg.
    pub mass: &'a [f64],
    /// Type, from 1.
    pub kind: &'a [i32],
    /// Bit mask of the atom's groups.
    pub mask: &'a [i32],
    /// Bit of the frozen group; its atoms have infinite mass.
    pub frozen: i32,
    /// Number of owned atoms.
    pub owned: usize,
    /// Time step, s.
    pub dt: f64,
    /// Whether histories advance; false during setup.
    pub advance: bool,
}

/// Force of a contact, for the host's virial and for `compute pair/gran/local`.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
#[repr(C)]
pub struct PairForce {
    /// Index of the first atom.
    pub i: i32,
    /// Index of the second atom.
    pub j: i32,
    /// Place of `j` in the list of `i`.
    pub place: i64,
    /// Force on `i`, N.
    pub force: [f64; 3],
    /// Torque on `i`, N·m.
    pub torque: [f64; 3],
    /// Position of `i` minus that of `j`, m.
    pub between: [f64; 3],
}

/// Neighbors of an atom, with flags and histories of their contacts.
pub struct Neighbors<'a> {
    /// The atom.
    pub i: usize,
    /// Indices of its neighbors; LIGGGHTS uses the two upper bits for its own flags.
    pub list: &'a [i32],
    /// Whether the pair is in contact; 0 marks the history as invalid.
    pub flags: &'a mut [i32],
    /// Contact histories, `stride` reals each.
    pub history: &'a mut [f64],
    /// Reals per history.
    pub stride: usize,
    /// Whether to leave a pair out, because a fix concordem/bond computes its forces; empty: none.
    pub skip: &'a [u8],
}

/// A particle in contact with a wall.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
#[repr(C)]
pub struct WallContact {
    /// Type of the particle, from 1.
    pub kind: i32,
    /// Type of the wall.
    pub wall_kind: i32,
    /// Radius, m.
    pub radius: f64,
    /// Mass, kg.
    pub mass: f64,
    /// Distance of the center from the wall, m.
    pub distance: f64,
    /// Unit vector from the center to the wall.
    pub normal: [f64; 3],
    /// Position, m.
    pub position: [f64; 3],
    /// Velocity, m/s.
    pub velocity: [f64; 3],
    /// Angular velocity, rad/s.
    pub angular_velocity: [f64; 3],
    /// Velocity of the wall at the contact, m/s.
    pub wall_velocity: [f64; 3],
    /// Time step, s; 0 during setup.
    pub dt: f64,
}

/// Two overlapping particles.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
#[repr(C)]
pub struct SingleContact {
    /// Types, from 1.
    pub kind: [i32; 2],
    /// Whether the history is valid; 0 at the start of the contact.
    pub known: i32,
    /// Whether the history advances; 0 during setup.
    pub advance: i32,
    /// Radii, m.
    pub radius: [f64; 2],
    /// Masses, kg.
    pub mass: [f64; 2],
    /// Positions, m.
    pub position: [[f64; 3]; 2],
    /// Velocities, m/s.
    pub velocity: [[f64; 3]; 2],
    /// Angular velocities, rad/s.
    pub angular_velocity: [[f64; 3]; 2],
    /// Time step, s.
    pub dt: f64,
}

/// Response of a single contact. All are 0 if the law opens it.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
#[repr(C)]
pub struct SingleResponse {
    /// Force on the first particle, N.
    pub force: [f64; 3],
    /// Torque on the first particle, N·m.
    pub torque: [f64; 3],
    /// Torque on the second particle, N·m; 0 at a wall.
    pub torque_of_second: [f64; 3],
    /// Normal force, N, compression positive.
    pub normal_force: f64,
    /// Secant stiffnesses of the normal and shear springs, N/m.
    pub stiffness: [f64; 2],
}

/// Mask for the index in an entry of a neighbor list.
const NEIGHBOR: i32 = 0x3FFF_FFFF;

/// A contact law for all pairs of types.
pub trait PairLaw {
    /// Names of the reals of a history, and whether each changes sign when the two atoms are swapped.
    fn fields(&self) -> Vec<(String, bool)>;
    /// Add the forces (N) and torques (N·m) between an atom and its neighbors to `force` and `torque` of owned atoms. With `record`,
    /// append the force of each contact to it.
    fn compute(
        &self,
        pass: &Pass<'_>,
        neighbors: Neighbors<'_>,
        force: &mut [[f64; 3]],
        torque: &mut [[f64; 3]],
        record: Option<&mut Vec<PairForce>>,
    );
    /// A single contact of overlapping particles, to which models of LIGGGHTS add forces. `added` (N): see
    /// [`HostLaw::respond_beside`].
    fn single(&self, contact: &SingleContact, added: f64, history: &mut [f64]) -> SingleResponse;
    /// A wall on a particle that overlaps it; `history` is all zeros at the start of the overlap. `added` (N): see
    /// [`HostLaw::respond_beside`].
    fn wall(&self, contact: &WallContact, added: f64, history: &mut [f64]) -> SingleResponse;
}

/// A law for all pairs of types. `FRAMED`: its kinematics needs the previous geometry.
pub struct PairLaws<L, const FRAMED: bool> {
    laws: Vec<L>,
    map: PairCoefficients,
    mode: MotionMeasure,
}

impl<L: HostLaw, const FRAMED: bool> PairLaws<L, FRAMED> {
    /// Reals for the previous geometry, before the law's own history.
    const HEAD: usize = if FRAMED { 4 } else { 0 };
    /// Reals per history.
    const WIDTH: usize = Self::HEAD + size_of::<L::State>() / 8;

    /// `map` gives the index in `laws` for each pair of types.
    pub fn new(laws: Vec<L>, map: PairCoefficients, mode: MotionMeasure) -> Self {
        Self { laws, map, mode }
    }
}

fn vec3(v: &[f64; 3]) -> Vec3 {
    Vec3::new(v[0], v[1], v[2])
}

impl<L: HostLaw, const FRAMED: bool> PairLaws<L, FRAMED> {
    #[inline(always)]
    fn motion(pass: &Pass<'_>, p: usize) -> Motion {
        let angular_velocity = vec3(&pass.angular_velocity[p]);
        // Only laws that need the previous geometry read the rotation increment.
        let rotation_increment = if FRAMED && pass.advance {
            quaternion_of_rotation_vector(&(angular_velocity * pass.dt))
        } else {
            Quat::identity()
        };
        Motion {
            position: vec3(&pass.position[p]),
            velocity: vec3(&pass.velocity[p]),
            angular_velocity,
            rotation_increment,
            orientation: Quat::identity(),
        }
    }

    /// Previous geometry: from the history, or from the velocities if there is none.
    #[inline(always)]
    fn previous_geometry(pass: &Pass<'_>, known: bool, reals: &[f64], a: &Motion, b: &Motion) -> PreviousGeometry {
        if !FRAMED {
            return PreviousGeometry::default();
        }
        if known && pass.advance {
            return PreviousGeometry { normal: Vec3::new(reals[0], reals[1], reals[2]), length: reals[3] };
        }
        let between = b.position - a.position;
        let before = if pass.advance { between - (b.velocity - a.velocity) * pass.dt } else { between };
        let length = before.norm();
        PreviousGeometry { normal: before / length, length }
    }

    /// Response of law `row` for particles `i` and `j`, and its kinematics. `reals` is the history. `added`: see
    /// [`HostLaw::respond_beside`].
    #[inline(always)]
    fn respond(
        &self,
        pass: &Pass<'_>,
        row: u16,
        [(i, a), (j, b)]: [(usize, &Motion); 2],
        known: bool,
        reals: &mut [f64],
        added: f64,
    ) -> (Response<L::State>, PointKinematics) {
        let previous = Self::previous_geometry(pass, known, reals, a, b);
        let mut old = L::State::default();
        // The state is a plain array of reals.
        let state: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut old));
        state.copy_from_slice(&reals[Self::HEAD..Self::WIDTH]);
        let (radius_a, radius_b) = (pass.radius[i], pass.radius[j]);
        let reference = L::unbonded_reference(0.0, radius_a, radius_b);
        let mass = |p: usize| if pass.mask[p] & pass.frozen != 0 { FROZEN_MASS } else { pass.mass[p] };
        // During setup nothing has moved.
        let dt = if pass.advance { pass.dt } else { 0.0 };
        let ends = Ends {
            motion: [a, b],
            radius: [radius_a, radius_b],
            mass: [mass(i), mass(j)],
            image: &ImageShift::default(),
            surface_displacement: None,
        };
        let before = Contact { bonded: false, reference, previous, history: old };
        let k: L::Kinematics = ends.measure(&before, self.mode, dt);
        let response = self.laws[row as usize].respond_beside(&k, &old, dt, added);
        if pass.advance {
            if FRAMED {
                reals[..3].copy_from_slice(k.point().normal.as_slice());
                reals[3] = k.point().length;
            }
            reals[Self::HEAD..Self::WIDTH].copy_from_slice(response.state.as_reals());
        }
        (response, *k.point())
    }

    /// Torques on both particles, N·m.
    #[inline(always)]
    fn torques(response: &Response<L::State>, point: &PointKinematics) -> [Vec3; 2] {
        let wrenches = wrenches::<L>(&point.normal, [point.arm_a, point.arm_b], response);
        [wrenches.a.torque, wrenches.b.torque]
    }

    /// The response of law `row` as LIGGGHTS' models read it.
    #[inline(always)]
    fn for_models(&self, row: u16, response: &Response<L::State>, point: &PointKinematics) -> SingleResponse {
        if response.status != Status::Lives {
            return SingleResponse::default();
        }
        let [torque, torque_of_second] = Self::torques(response, point);
        SingleResponse {
            force: response.force.into(),
            torque: torque.into(),
            torque_of_second: torque_of_second.into(),
            normal_force: -response.force.dot(&point.normal),
            stiffness: self.laws[row as usize].stiffnesses(&point.geometry, -point.gap),
        }
    }

    #[inline(always)]
    fn evaluate<const RECORD: bool>(
        &self,
        pass: &Pass<'_>,
        neighbors: Neighbors<'_>,
        force: &mut [[f64; 3]],
        torque: &mut [[f64; 3]],
        record: &mut Vec<PairForce>,
    ) {
        let Neighbors { i, list, flags, history, stride, skip } = neighbors;
        let (xi, radius_i) = (vec3(&pass.position[i]), pass.radius[i]);
        let (mut sum, mut moment) = (Vec3::zeros(), Vec3::zeros());
        let mut mine: Option<Motion> = None;
        for (jj, &entry) in list.iter().enumerate() {
            let j = (entry & NEIGHBOR) as usize;
            let between = vec3(&pass.position[j]) - xi;
            let (squared, touching) = (between.norm_squared(), radius_i + pass.radius[j]);
            let reals = &mut history[jj * stride..][..Self::WIDTH];
            if squared >= touching * touching || skip.get(jj).is_some_and(|&skipped| skipped != 0) {
                if flags[jj] != 0 {
                    flags[jj] = 0;
                    reals.fill(0.0);
                }
                continue;
            }
            let Some(row) = self.map.get((pass.kind[i] - 1) as u16, (pass.kind[j] - 1) as u16) else { continue };
            let a = *mine.get_or_insert_with(|| Self::motion(pass, i));
            let b = Self::motion(pass, j);
            let (response, point) = self.respond(pass, row, [(i, &a), (j, &b)], flags[jj] != 0, reals, 0.0);
            if pass.advance {
                flags[jj] = 1;
            }
            if response.status != Status::Lives {
                continue;
            }
            let [torque_i, torque_j] = Self::torques(&response, &point);
            sum += response.force;
            moment += torque_i;
            if j < pass.owned {
                for axis in 0..3 {
                    force[j][axis] -= response.force[axis];
                    torque[j][axis] += torque_j[axis];
                }
            }
            if RECORD {
                record.push(PairForce {
                    i: i as i32,
                    j: j as i32,
                    place: jj as i64,
                    force: response.force.into(),
                    torque: torque_i.into(),
                    between: (-between).into(),
                });
            }
        }
        for axis in 0..3 {
            force[i][axis] += sum[axis];
            torque[i][axis] += moment[axis];
        }
    }
}

impl<L: HostLaw, const FRAMED: bool> PairLaw for PairLaws<L, FRAMED> {
    fn fields(&self) -> Vec<(String, bool)> {
        let mut fields = Vec::new();
        if FRAMED {
            fields.extend(["normalx", "normaly", "normalz"].map(|name| (name.to_owned(), true)));
            fields.push(("length".to_owned(), false));
        }
        for field in L::State::FIELDS {
            for k in 0..field.components {
                fields.push((format!("{}{k}", field.name), field.parity == Parity::Odd));
            }
        }
        fields
    }

    fn compute(
        &self,
        pass: &Pass<'_>,
        neighbors: Neighbors<'_>,
        force: &mut [[f64; 3]],
        torque: &mut [[f64; 3]],
        record: Option<&mut Vec<PairForce>>,
    ) {
        // Compiled twice: the recording code would cost registers in the other loop.
        match record {
            Some(record) => self.evaluate::<true>(pass, neighbors, force, torque, record),
            None => self.evaluate::<false>(pass, neighbors, force, torque, &mut Vec::new()),
        }
    }

    fn single(&self, contact: &SingleContact, added: f64, history: &mut [f64]) -> SingleResponse {
        let SingleContact { kind, .. } = contact;
        let Some(row) = self.map.get((kind[0] - 1) as u16, (kind[1] - 1) as u16) else {
            return SingleResponse::default();
        };
        let pass = Pass {
            position: &contact.position,
            velocity: &contact.velocity,
            angular_velocity: &contact.angular_velocity,
            radius: &contact.radius,
            mass: &contact.mass,
            kind,
            mask: &[0; 2],
            frozen: 0,
            owned: 2,
            dt: contact.dt,
            advance: contact.advance != 0,
        };
        let (a, b) = (Self::motion(&pass, 0), Self::motion(&pass, 1));
        let reals = &mut history[..Self::WIDTH];
        let (response, point) = self.respond(&pass, row, [(0, &a), (1, &b)], contact.known != 0, reals, added);
        self.for_models(row, &response, &point)
    }

    fn wall(&self, contact: &WallContact, added: f64, history: &mut [f64]) -> SingleResponse {
        let none = SingleResponse::default();
        let Some(row) = self.map.get((contact.kind - 1) as u16, (contact.wall_kind - 1) as u16) else { return none };
        let (angular_velocity, dt) = (vec3(&contact.angular_velocity), contact.dt);
        let motion = Motion {
            position: vec3(&contact.position),
            velocity: vec3(&contact.velocity),
            angular_velocity,
            rotation_increment: if FRAMED {
                quaternion_of_rotation_vector(&(angular_velocity * dt))
            } else {
                Quat::identity()
            },
            orientation: Quat::identity(),
        };
        let closest_point = ClosestPoint { normal: vec3(&contact.normal), distance: contact.distance, interior: true };
        let velocity = vec3(&contact.wall_velocity);
        let reals = &mut history[..Self::WIDTH];
        let mut previous = PreviousGeometry { normal: closest_point.normal, length: closest_point.distance };
        if FRAMED && dt > 0.0 {
            if reals[3] == 0.0 {
                previous.length += (motion.velocity - velocity).dot(&closest_point.normal) * dt;
            } else {
                previous = PreviousGeometry { normal: Vec3::new(reals[0], reals[1], reals[2]), length: reals[3] };
            }
        }
        let reference = L::unbonded_reference(contact.radius, contact.radius, 0.0);
        let mut old = L::State::default();
        let state: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut old));
        state.copy_from_slice(&reals[Self::HEAD..]);
        let sides = AtWall {
            motion: WallMotion {
                particle: &motion,
                closest_point: &closest_point,
                velocity,
                // The host has no rotation of its triangles.
                rotation: Quat::identity(),
            },
            radius: contact.radius,
            mass: contact.mass,
            surface_displacement: None,
        };
        let before = Contact { bonded: false, reference, previous, history: old };
        let Some(k) = sides.measure::<L::Kinematics, _>(&before, self.mode, dt) else { return none };
        let response = self.laws[row as usize].respond_beside(&k, &old, dt, added);
        if dt > 0.0 {
            reals.fill(0.0);
            if response.status == Status::Lives {
                if FRAMED {
                    reals[..3].copy_from_slice(closest_point.normal.as_slice());
                    reals[3] = closest_point.distance;
                }
                reals[Self::HEAD..].copy_from_slice(response.state.as_reals());
            }
        }
        // At a wall, the torque on the particle is about its center, as between particles.
        SingleResponse { torque_of_second: [0.0; 3], ..self.for_models(row, &response, k.point()) }
    }
}
