//! The atoms of one processor in the host's arrays: owned atoms first, then ghosts.

use concordem_contact::math::Vec3;

/// Id of an atom. LAMMPS has ids of 32 or 64 bits (`bigbig`), LIGGGHTS of 32.
pub type Tag = i64;

/// The largest id: records hold ids as reals.
pub const LARGEST_TAG: Tag = 1 << 53;

/// Mass of a frozen atom, kg. As in LIGGGHTS, it is as good as infinite for a dashpot.
pub const FROZEN_MASS: f64 = 1e100;

/// Ids of atoms, as wide as those of the host.
#[derive(Debug, Clone, Copy)]
pub enum Tags<'a> {
    /// 32 bits.
    Narrow(&'a [i32]),
    /// 64 bits.
    Wide(&'a [i64]),
}

impl<'a> Tags<'a> {
    /// Number of atoms.
    pub fn len(self) -> usize {
        match self {
            Self::Narrow(tags) => tags.len(),
            Self::Wide(tags) => tags.len(),
        }
    }

    /// Whether there are no atoms.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Id of atom `i`.
    #[inline(always)]
    pub fn get(self, i: usize) -> Tag {
        match self {
            Self::Narrow(tags) => Tag::from(tags[i]),
            Self::Wide(tags) => tags[i],
        }
    }

    /// All ids.
    pub fn iter(self) -> impl Iterator<Item = Tag> + 'a {
        (0..self.len()).map(move |i| self.get(i))
    }
}

/// Atoms as slices; a vector is three consecutive reals.
pub struct Atoms<'a> {
    /// Number of owned atoms.
    pub owned: usize,
    /// Id. Like all slices unless stated otherwise, it covers owned atoms and ghosts.
    pub tag: Tags<'a>,
    /// Type, from 1.
    pub kind: &'a [i32],
    /// Bit mask of the atom's groups.
    pub mask: &'a [i32],
    /// Bit of the fix's group.
    pub group: i32,
    /// Position, m. A ghost has the position of its owner, not shifted by periodic borders.
    pub position: &'a [f64],
    /// Velocity, m/s.
    pub velocity: &'a [f64],
    /// Angular velocity, rad/s.
    pub angular_velocity: &'a [f64],
    /// Radius, m.
    pub radius: &'a [f64],
    /// Mass, kg.
    pub mass: &'a [f64],
    /// Mass that resists a contact, kg: that of the rigid body of the atom; [`FROZEN_MASS`] if the atom is frozen.
    pub effective_mass: &'a [f64],
    /// Force on owned atoms, N; the network adds to it.
    pub force: &'a mut [f64],
    /// Torque on owned atoms, N·m; the network adds to it.
    pub torque: &'a mut [f64],
    /// Data that the network stores per atom: [`Network::atom_width`](crate::network::Network::atom_width) reals each.
    pub memory: &'a mut [f64],
    /// Periodic edge lengths of the box, m; 0 where it is not periodic.
    pub edge: [f64; 3],
    /// Lowest coordinates of the box, m.
    pub low: [f64; 3],
    /// Highest coordinates of the box, m.
    pub high: [f64; 3],
    /// Time step, s.
    pub dt: f64,
    /// Step number.
    pub step: i64,
}

/// An atom that is a point, or has no mass.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "atom {tag} has the {what} {value}, but bonds and contacts are between spheres with a mass: give it a positive one (`set`), or leave it \
     out of the group of this fix (`fix ID GROUP concordem/bond` instead of bond and pair styles, which act on all atoms)"
)]
pub struct NoSphere {
    tag: Tag,
    what: &'static str,
    /// m or kg.
    value: f64,
}

impl Atoms<'_> {
    /// Whether atom `i` is a sphere with a mass.
    ///
    /// # Errors
    /// It is not.
    pub fn check_sphere(&self, i: usize) -> Result<(), NoSphere> {
        let sizes = [("radius", self.radius[i]), ("mass", self.effective_mass[i])];
        let wrong = sizes.into_iter().find(|(_, value)| !(*value > 0.0 && value.is_finite()));
        wrong.map_or(Ok(()), |(what, value)| Err(NoSphere { tag: self.tag.get(i), what, value }))
    }
}

/// Vector `i` of a slice.
#[inline(always)]
pub fn vector(reals: &[f64], i: usize) -> Vec3 {
    Vec3::new(reals[3 * i], reals[3 * i + 1], reals[3 * i + 2])
}

/// Add to vector `i` of a slice.
#[inline(always)]
pub fn add(reals: &mut [f64], i: usize, v: &Vec3) {
    reals[3 * i] += v.x;
    reals[3 * i + 1] += v.y;
    reals[3 * i + 2] += v.z;
}
