//! Stress, couple stress, fabric, damage, power, coarse-graining on NumPy arrays. No input is copied that is a
//! contiguous array of its type; the interpreter's lock is released while sums are made.

use concordem::math::{Mat3, Vec3};
use concordem::operator::affine_stiffness::{self, AffineLink};
use concordem::operator::coarse_grain::{self, Kernel};
use concordem::operator::couple_stress::{self, Resultant};
use concordem::operator::stress::{self, ParticleVolume};
use concordem::operator::{ContactSet, LoadSet, damage, fabric, moment_about_contact_point, power};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{
    Indices, Pairs, Scalars, Tensor, Vector, Vectors, matrix6, result, scalars, tensor, tensors, vector, vectors,
};
use crate::errors::OrRaise;
use crate::regions::{PyPeriod, PyRegion, dimension, or_zero, partition, period, truncation};
use crate::strain::PyAffineFit;

type Any<'py> = PyResult<Bound<'py, PyAny>>;

/// Contacts between particles, as operators read them.
pub struct Contacts<'py> {
    pair: Pairs<'py>,
    branch: Vectors<'py>,
    point: Vectors<'py>,
    force: Vectors<'py>,
    moment: Option<Vectors<'py>>,
}

impl<'a, 'py> FromPyObject<'a, 'py> for Contacts<'py> {
    type Error = PyErr;
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self {
            pair: column(&object, "pair")?,
            branch: column(&object, "branch")?,
            point: column(&object, "point")?,
            force: column(&object, "force")?,
            moment: column(&object, "moment")?,
        })
    }
}

/// A column of a table; errors say which.
fn column<'py, T: FromPyObjectOwned<'py, Error = PyErr>>(table: &Bound<'py, PyAny>, name: &str) -> PyResult<T> {
    table.getattr(name)?.extract().map_err(|error: PyErr| {
        let py = table.py();
        let message = format!("{name}: {}", error.value(py));
        // Of the same class as it was.
        error.get_type(py).call1((message,)).map_or(error, PyErr::from_value)
    })
}

impl Contacts<'_> {
    /// The contacts of the particles at `position`.
    pub fn set<'a>(&'a self, position: &'a Vectors<'_>) -> PyResult<ContactSet<'a>> {
        let moment = self.moment.as_ref().map(Vectors::get).transpose()?;
        ContactSet::new(
            position.get()?,
            self.pair.get()?,
            self.branch.get()?,
            self.point.get()?,
            self.force.get()?,
            moment,
        )
        .or_raise()
    }
}

/// Loads on particles from outside.
pub struct Loads<'py> {
    particle: Indices<'py>,
    point: Vectors<'py>,
    force: Vectors<'py>,
    moment: Option<Vectors<'py>>,
}

impl<'a, 'py> FromPyObject<'a, 'py> for Loads<'py> {
    type Error = PyErr;
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self {
            particle: column(&object, "particle")?,
            point: column(&object, "point")?,
            force: column(&object, "force")?,
            moment: column(&object, "moment")?,
        })
    }
}

impl Loads<'_> {
    /// The loads on `count` particles.
    pub fn set(&self, count: usize) -> PyResult<LoadSet<'_>> {
        let moment = self.moment.as_ref().map(Vectors::get).transpose()?;
        LoadSet::new(count, self.particle.get()?, self.point.get()?, self.force.get()?, moment).or_raise()
    }
}

fn loads_or_none<'a>(loads: Option<&'a Loads<'_>>, count: usize) -> PyResult<LoadSet<'a>> {
    loads.map_or_else(|| Ok(LoadSet::none()), |loads| loads.set(count))
}

/// Volumes of particles.
#[pyfunction]
#[pyo3(signature = (radius, kind="sphere", packing_fraction=None))]
fn particle_volumes<'py>(py: Python<'py>, radius: Scalars<'py>, kind: &str, packing_fraction: Option<f64>) -> Any<'py> {
    let volume = match (kind, packing_fraction) {
        ("sphere", None) => ParticleVolume::Sphere,
        ("disc", None) => ParticleVolume::Disc,
        ("sphere", Some(fraction)) => ParticleVolume::Packing(fraction),
        ("disc", Some(_)) => return Err(PyValueError::new_err("packing_fraction is for spheres")),
        (other, _) => {
            return Err(PyValueError::new_err(format!("kind is \"{other}\"; it may be \"sphere\" or \"disc\"")));
        }
    };
    Ok(scalars(py, &volume.of(radius.get()?).or_raise()?).into_any())
}

/// Moments of the forces on every particle.
#[pyfunction]
#[pyo3(signature = (position, contacts, loads=None, partition="contact-point"))]
fn particle_moments<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    loads: Option<Loads<'py>>,
    partition: &str,
) -> Any<'py> {
    let how = self::partition(partition)?;
    let set = contacts.set(&position)?;
    let loads = loads_or_none(loads.as_ref(), set.position().len())?;
    Ok(tensors(py, py.detach(|| stress::particle_moments(&set, &loads, how)))?.into_any())
}

/// Stress of every particle.
#[pyfunction]
#[pyo3(signature = (position, contacts, volumes, loads=None, partition="contact-point"))]
fn particle_stress<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    volumes: Scalars<'py>,
    loads: Option<Loads<'py>>,
    partition: &str,
) -> Any<'py> {
    let how = self::partition(partition)?;
    let set = contacts.set(&position)?;
    let loads = loads_or_none(loads.as_ref(), set.position().len())?;
    let volumes = volumes.get()?;
    let stress = py.detach(|| stress::particle_stress(&set, &loads, how, volumes)).or_raise()?;
    Ok(tensors(py, stress)?.into_any())
}

/// Stress of a region by the branch sum.
#[pyfunction]
#[pyo3(signature = (position, contacts, region, truncation="branch-clipped", period=None))]
fn region_stress<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    region: &Bound<'py, PyRegion>,
    truncation: &str,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let (how, period) = (self::truncation(truncation)?, self::period(period.as_ref()));
    let set = contacts.set(&position)?;
    let region = &region.get().0;
    let found = py.detach(|| stress::region_stress(&set, region, how, period.as_ref())).or_raise()?;
    result(py, "RegionStress", (tensor(py, &found.stress)?, found.volume, found.full, found.partial))
}

fn matrices(moments: &Bound<'_, PyAny>) -> PyResult<Vec<Mat3>> {
    let shape: Vec<usize> = moments.getattr("shape")?.extract()?;
    let [n, 3, 3] = shape[..] else {
        return Err(PyValueError::new_err(format!("moments have the shape (n, 3, 3), not {shape:?}")));
    };
    let flat: Scalars<'_> = moments.call_method1("reshape", (9 * n,))?.extract()?;
    Ok(flat.get()?.chunks_exact(9).map(Mat3::from_row_slice).collect())
}

/// Stress of a region as volume average over its particles.
#[pyfunction]
#[pyo3(signature = (position, moments, region, period=None))]
fn region_stress_from_particles<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    moments: &Bound<'py, PyAny>,
    region: &Bound<'py, PyRegion>,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let (moments, period) = (matrices(moments)?, self::period(period.as_ref()));
    let (x, region) = (position.get()?, &region.get().0);
    let found = stress::region_stress_from_particles(x, &moments, region, period.as_ref()).or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Stress from the forces on a body's boundary.
#[pyfunction]
fn boundary_stress<'py>(py: Python<'py>, count: usize, loads: Loads<'py>, volume: f64) -> Any<'py> {
    let found = stress::boundary_stress(&loads.set(count)?, volume).or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Traction on a wall.
#[pyfunction]
fn wall_traction<'py>(py: Python<'py>, force: Vector, area: f64) -> Any<'py> {
    Ok(vector(py, &stress::wall_traction(&force.0, area).or_raise()?).into_any())
}

/// Kinetic part of the stress.
#[pyfunction]
#[pyo3(signature = (position, mass, velocity, region, period=None))]
fn kinetic_stress<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    mass: Scalars<'py>,
    velocity: Vectors<'py>,
    region: &Bound<'py, PyRegion>,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let (x, mass, velocity, period) = (position.get()?, mass.get()?, velocity.get()?, self::period(period.as_ref()));
    let found = stress::kinetic_stress(x, mass, velocity, &region.get().0, period.as_ref()).or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Share of solid in a region.
#[pyfunction]
#[pyo3(signature = (position, volumes, region, period=None))]
fn solid_fraction(
    position: Vectors<'_>,
    volumes: Scalars<'_>,
    region: &Bound<'_, PyRegion>,
    period: Option<Bound<'_, PyPeriod>>,
) -> PyResult<f64> {
    let period = self::period(period.as_ref());
    stress::solid_fraction(position.get()?, volumes.get()?, &region.get().0, period.as_ref()).or_raise()
}

/// Axial part of a tensor.
#[pyfunction]
fn axial<'py>(py: Python<'py>, tensor: Tensor) -> Any<'py> {
    Ok(vector(py, &stress::axial(&tensor.0)).into_any())
}

/// Couple stress from external loads.
#[pyfunction]
#[pyo3(signature = (position, loads, volume, centroid=None))]
fn couple_stress_external<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    loads: Loads<'py>,
    volume: f64,
    centroid: Option<Vector>,
) -> Any<'py> {
    let x = position.get()?;
    let found = couple_stress::external(x, &loads.set(x.len())?, volume, &or_zero(centroid)).or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Couple stress from contacts.
#[pyfunction]
#[pyo3(signature = (position, contacts, volume, centroid=None))]
fn couple_stress_internal<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    volume: f64,
    centroid: Option<Vector>,
) -> Any<'py> {
    let set = contacts.set(&position)?;
    let centroid = or_zero(centroid);
    let found = py.detach(|| couple_stress::internal(&set, volume, &centroid)).or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Net forces and moments of the contacts on every particle.
#[pyfunction]
fn resultants<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let set = contacts.set(&position)?;
    let net: Vec<Resultant> = py.detach(|| couple_stress::resultants(&set));
    let (force, moment): (Vec<Vec3>, Vec<Vec3>) = net.into_iter().map(|net| (net.force, net.moment)).unzip();
    Ok((vectors(py, &force)?.into_any(), vectors(py, &moment)?.into_any()))
}

/// Couple stress from net wrenches.
#[pyfunction]
#[pyo3(signature = (position, force, moment, volume, reference=None))]
fn couple_stress_from_resultants<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    force: Vectors<'py>,
    moment: Vectors<'py>,
    volume: f64,
    reference: Option<Vector>,
) -> Any<'py> {
    let (force, moment) = (force.get()?, moment.get()?);
    if force.len() != moment.len() {
        return Err(PyValueError::new_err(format!("{} forces and {} moments", force.len(), moment.len())));
    }
    let net: Vec<_> = force.iter().zip(moment).map(|(&force, &moment)| Resultant { force, moment }).collect();
    let found = couple_stress::from_resultants(position.get()?, &net, volume, &or_zero(reference)).or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Stress and couple stress conjugate to the affine modes of motion of a region.
#[pyfunction]
#[pyo3(signature = (position, contacts, region, reference=None, period=None))]
fn conjugate_stress<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    region: &Bound<'py, PyRegion>,
    reference: Option<Vector>,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let set = contacts.set(&position)?;
    let (region, reference, period) = (&region.get().0, or_zero(reference), self::period(period.as_ref()));
    let c = py.detach(|| couple_stress::conjugate(&set, region, &reference, period.as_ref())).or_raise()?;
    let fields = (
        tensor(py, &c.stress)?,
        tensor(py, &c.couple_stress)?,
        vector(py, &c.rigid_force),
        vector(py, &c.rigid_moment),
        vector(py, &c.rotation),
        c.volume,
        c.contacts,
    );
    result(py, "ConjugateStress", fields)
}

/// Fabric tensor and coordination of a region.
#[pyfunction]
#[pyo3(name = "fabric", signature = (position, contacts, region, truncation="branch-clipped", period=None))]
fn fabric_of<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    region: &Bound<'py, PyRegion>,
    truncation: &str,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let (how, period) = (self::truncation(truncation)?, self::period(period.as_ref()));
    let set = contacts.set(&position)?;
    let region = &region.get().0;
    let f = py.detach(|| fabric::fabric(&set, region, how, period.as_ref())).or_raise()?;
    result(py, "Fabric", (tensor(py, &f.tensor)?, f.contacts, f.particles, f.coordination, f.branch_length))
}

/// Number of contacts of every particle.
#[pyfunction]
fn coordination<'py>(py: Python<'py>, position: Vectors<'py>, contacts: Contacts<'py>) -> Any<'py> {
    let set = contacts.set(&position)?;
    Ok(scalars(py, &py.detach(|| fabric::coordination(&set))).into_any())
}

/// Damage tensor of links.
#[pyfunction]
#[pyo3(signature = (normal, damage, exact=false))]
fn damage_tensor<'py>(py: Python<'py>, normal: Vectors<'py>, damage: Scalars<'py>, exact: bool) -> Any<'py> {
    let (normal, values) = (normal.get()?, damage.get()?);
    let fit = if exact { damage::damage_tensor_exact } else { damage::damage_tensor };
    Ok(tensor(py, &fit(normal, values).or_raise()?)?.into_any())
}

/// Damage of strength from that of stiffness.
#[pyfunction]
fn strength_damage(stiffness_damage: f64, largest_strain: f64, onset_strain: f64) -> PyResult<f64> {
    damage::strength_damage(stiffness_damage, largest_strain, onset_strain).or_raise()
}

/// The same for exponential softening.
#[pyfunction]
fn strength_damage_exponential(largest_strain: f64, onset_strain: f64, softening_strain: f64) -> PyResult<f64> {
    damage::strength_damage_exponential(largest_strain, onset_strain, softening_strain).or_raise()
}

/// Power of the contacts, and what of it the affine motion explains.
#[pyfunction]
#[pyo3(name = "power", signature = (position, contacts, velocity, spin, fit, volume, image_velocity=None))]
fn power_of<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    velocity: Vectors<'py>,
    spin: Vectors<'py>,
    fit: &Bound<'py, PyAffineFit>,
    volume: f64,
    image_velocity: Option<Vectors<'py>>,
) -> Any<'py> {
    let set = contacts.set(&position)?;
    let (velocity, spin, fit) = (velocity.get()?, spin.get()?, &fit.get().0);
    let images = image_velocity.as_ref().map_or(Ok(&[][..]), Vectors::get)?;
    let p = py.detach(|| power::power(&set, velocity, spin, images, fit, volume)).or_raise()?;
    let (stress, couple) = (tensor(py, &p.stress_tensor)?, tensor(py, &p.couple_stress)?);
    result(py, "PowerReport", (p.contacts, p.particles, p.stress, p.couple, p.gap, stress, couple))
}

/// Fields at points by coarse-graining.
#[pyfunction]
#[pyo3(name = "coarse_grain", signature = (position, contacts, mass, velocity, support, points, dimension=3, period=None))]
fn coarse_fields<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    mass: Scalars<'py>,
    velocity: Vectors<'py>,
    support: f64,
    points: Vectors<'py>,
    dimension: u8,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let kernel = Kernel::new(support, self::dimension(dimension)?).or_raise()?;
    let period = self::period(period.as_ref());
    let set = contacts.set(&position)?;
    let (mass, velocity, points) = (mass.get()?, velocity.get()?, points.get()?);
    let fields =
        py.detach(|| coarse_grain::coarse_grain(&set, mass, velocity, &kernel, points, period.as_ref())).or_raise()?;
    let density: Vec<f64> = fields.iter().map(|field| field.density).collect();
    let momentum: Vec<Vec3> = fields.iter().map(|field| field.momentum).collect();
    let contact = fields.iter().map(|field| field.stress).collect();
    let kinetic = fields.iter().map(|field| field.kinetic_stress).collect();
    let fields = (scalars(py, &density), vectors(py, &momentum)?, tensors(py, contact)?, tensors(py, kinetic)?);
    result(py, "CoarseFields", fields)
}

/// Stiffness of links under affine motion.
#[pyfunction]
#[pyo3(name = "affine_stiffness")]
fn affine_stiffness_of<'py>(
    py: Python<'py>,
    normal: Vectors<'py>,
    link_volume: Scalars<'py>,
    normal_modulus: Scalars<'py>,
    shear_modulus: Scalars<'py>,
    volume: f64,
) -> Any<'py> {
    let n = normal.get()?;
    let columns = [link_volume.get()?, normal_modulus.get()?, shear_modulus.get()?];
    if let Some(column) = columns.iter().find(|column| column.len() != n.len()) {
        return Err(PyValueError::new_err(format!("{} numbers for {} links", column.len(), n.len())));
    }
    let links: Vec<AffineLink> = (0..n.len())
        .map(|k| AffineLink {
            normal: n[k],
            volume: columns[0][k],
            normal_modulus: columns[1][k],
            shear_modulus: columns[2][k],
        })
        .collect();
    Ok(matrix6(py, &affine_stiffness::affine_stiffness(&links, volume).or_raise()?)?.into_any())
}

/// Young's modulus and Poisson's ratio of links with all directions alike.
#[pyfunction]
fn isotropic_moduli(link_volume: f64, volume: f64, normal_modulus: f64, shear_modulus: f64) -> PyResult<(f64, f64)> {
    affine_stiffness::isotropic_moduli(link_volume, volume, normal_modulus, shear_modulus).or_raise()
}

/// Bulk and shear modulus of a plane assembly of equal discs.
#[pyfunction]
fn voigt_plane(contacts: f64, radius: f64, area: f64, normal: f64, tangential: f64) -> PyResult<(f64, f64)> {
    affine_stiffness::voigt_plane(contacts, radius, area, normal, tangential).or_raise()
}

/// Forces of springs under an affine displacement.
#[pyfunction]
fn affine_forces<'py>(
    py: Python<'py>,
    branch: Vectors<'py>,
    normal_stiffness: Scalars<'py>,
    shear_stiffness: Scalars<'py>,
    gradient: Tensor,
) -> Any<'py> {
    let stiffness: Vec<(f64, f64)> =
        normal_stiffness.get()?.iter().copied().zip(shear_stiffness.get()?.iter().copied()).collect();
    Ok(vectors(py, &affine_stiffness::affine_forces(branch.get()?, &stiffness, &gradient.0).or_raise()?)?.into_any())
}

/// Moments about contact points from moments about the centres of A.
#[pyfunction]
fn moments_about_contact_points<'py>(
    py: Python<'py>,
    arm: Vectors<'py>,
    force: Vectors<'py>,
    moment: Vectors<'py>,
) -> Any<'py> {
    let (arm, force, moment) = (arm.get()?, force.get()?, moment.get()?);
    if arm.len() != force.len() || arm.len() != moment.len() {
        let message = format!("{} arms, {} forces, {} moments", arm.len(), force.len(), moment.len());
        return Err(PyValueError::new_err(message));
    }
    let moved: Vec<Vec3> = (0..arm.len()).map(|k| moment_about_contact_point(&arm[k], &force[k], &moment[k])).collect();
    Ok(vectors(py, &moved)?.into_any())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    macro_rules! add {
        ($($function:ident),* $(,)?) => { $(module.add_function(wrap_pyfunction!($function, module)?)?;)* };
    }
    add!(
        particle_volumes,
        particle_moments,
        particle_stress,
        region_stress,
        region_stress_from_particles,
        boundary_stress,
        wall_traction,
        kinetic_stress,
        solid_fraction,
        axial,
        couple_stress_external,
        couple_stress_internal,
        resultants,
        couple_stress_from_resultants,
        conjugate_stress,
        fabric_of,
        coordination,
        damage_tensor,
        strength_damage,
        strength_damage_exponential,
        power_of,
        coarse_fields,
        affine_stiffness_of,
        isotropic_moduli,
        voigt_plane,
        affine_forces,
        moments_about_contact_points,
    );
    Ok(())
}
