//! Kinds of loops over the contacts of a tile: what a loop supports. The compiler leaves out the rest.

use concordem_contact::kinematics::{Kinematics as _, MotionMeasure};
use concordem_contact::law::ContactLaw;

use super::StepContext;

/// What a loop over contacts supports.
pub(super) trait LoopKind {
    /// A periodic cell.
    const PERIODIC: bool = false;
    /// Samples: stored energies, heat of single contacts, temperatures, thermal expansion.
    const SAMPLE: bool = false;
    /// Particles that deform.
    const DEFORM: bool = false;
    /// Strengths that scatter, in columns.
    const SCATTERED: bool = false;
    /// YADE's measures in columns, in place of the finite one.
    const YADE: bool = false;
    /// Compiled for each kind of vector registers, not for the smallest alone.
    const WIDE: bool = true;
}

/// Rigid particles, the finite measure, no cell.
pub(super) struct Plain;
impl LoopKind for Plain {}

/// As [`Plain`], in a periodic cell.
pub(super) struct InCell;
impl LoopKind for InCell {
    const PERIODIC: bool = true;
}

/// As [`Plain`], with YADE's measures.
pub(super) struct AsYade;
impl LoopKind for AsYade {
    const YADE: bool = true;
}

/// As [`Plain`], with particles that deform.
pub(super) struct Deforming;
impl LoopKind for Deforming {
    const DEFORM: bool = true;
}

/// As [`InCell`], with or without a cell, with strengths that scatter.
pub(super) struct Scattered;
impl LoopKind for Scattered {
    const PERIODIC: bool = true;
    const SCATTERED: bool = true;
}

/// All measures, cells, and samples; rigid particles.
pub(super) struct General;
impl LoopKind for General {
    const PERIODIC: bool = true;
    const SAMPLE: bool = true;
    const WIDE: bool = false;
}

/// As [`General`], with rigid particles and with particles that deform.
pub(super) struct GeneralDeforming;
impl LoopKind for GeneralDeforming {
    const PERIODIC: bool = true;
    const SAMPLE: bool = true;
    const WIDE: bool = false;
    const DEFORM: bool = true;
}

/// A function for the kind of loop that [`choose`] has chosen.
pub(super) trait WithKind<L> {
    /// Type of the result.
    type Output;
    /// Run the loop of kind `K` with this measure.
    fn run<K: LoopKind>(self, measure: MotionMeasure) -> Self::Output;
}

/// Choose the loop for a law and a step.
///
/// Steps without a sample have their own loops for the default measure and, without a cell, for YADE's measures. All other steps share
/// one loop, to keep the program small.
#[inline(always)]
pub(super) fn choose<L: ContactLaw, F: WithKind<L>>(context: &StepContext<'_>, function: F) -> F::Output {
    let (mode, periodic) = (context.mode, context.cell.is_some());
    let deforms = L::DEFORMS && !context.surface_displacement.is_empty();
    // The loops without a sample compute neither the work of thermal expansion nor the heat of single contacts, and know no
    // factors of single contacts.
    let lean = !context.sample && context.expansion.is_none() && !context.heats;
    let plain = lean && context.factors.is_none();
    let scattered = lean && context.factors.is_some_and(|factors| factors.softened.is_none());
    let finite = plain && (mode == MotionMeasure::Finite || L::Kinematics::ONE_MODE);
    let yade = plain && !periodic && matches!(mode, MotionMeasure::Yade | MotionMeasure::YadeRatcheting);
    // Conditions on constants of the law come first, so that the compiler omits the loops they exclude.
    if L::DEFORMS && deforms {
        if finite && !periodic {
            function.run::<Deforming>(MotionMeasure::Finite)
        } else {
            function.run::<GeneralDeforming>(mode)
        }
    } else if L::VARIES && scattered && (mode == MotionMeasure::Finite || L::Kinematics::ONE_MODE) {
        function.run::<Scattered>(MotionMeasure::Finite)
    } else if finite && periodic {
        function.run::<InCell>(MotionMeasure::Finite)
    } else if finite {
        function.run::<Plain>(MotionMeasure::Finite)
    } else if !L::Kinematics::ONE_MODE && yade {
        function.run::<AsYade>(mode)
    } else if L::DEFORMS {
        function.run::<GeneralDeforming>(mode)
    } else {
        function.run::<General>(mode)
    }
}
