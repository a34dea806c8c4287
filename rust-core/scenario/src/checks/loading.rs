//! Checks of the loading, of initial velocities that conflict with it, and of the end of the run.

use super::{Checker, SYMMETRY, components, length};
use crate::schema::quantity::dimension::OfStrainRate;
use crate::schema::quantity::{AngularVelocity, Component, CrossSection, Length, StrainRate, Stress};
use crate::schema::{Axis, Control, Loading, Shape};

impl Checker<'_> {
    pub(super) fn loading(&mut self) {
        let scenario = self.scenario;
        let periodic = scenario.packing.is_periodic();
        let kind = scenario.loading.kind();
        if scenario.loading.drives_cell() && !periodic {
            let help =
                "give [packing.shape] kind = \"periodic\" (or a `cell` for spheres), or use \"uniaxial\" loading";
            self.conflict("loading.kind", "the packing has no periodic cell to drive", help);
        }
        let by_ends = matches!(
            scenario.loading,
            Loading::Uniaxial { .. }
                | Loading::Platens { .. }
                | Loading::Flexure { .. }
                | Loading::Bending { .. }
                | Loading::Torsion { .. }
        );
        if by_ends && periodic {
            let help = "use \"cell-strain\" loading, or cut out a specimen with another [packing.shape]";
            self.conflict("loading.kind", format!("a periodic cell has no ends for \"{kind}\" loading"), help);
        }
        if let Loading::Uniaxial { area: Some(CrossSection::Hull), .. }
        | Loading::Platens { area: Some(CrossSection::Hull), .. } = &scenario.loading
            && scenario.dimension == 2
        {
            let help = "remove `area`, or give width times depth: area = \"50 mm^2\"";
            self.conflict("loading.area", "\"hull\" is for spheres, not for discs", help);
        }
        match &scenario.loading {
            Loading::None => {}
            Loading::Uniaxial { axis, strain_rate, layer_thickness, area, .. } => {
                self.uniaxial(*axis, *strain_rate, *layer_thickness);
                if *area == Some(CrossSection::Splitting) {
                    let help = "use \"platens\" loading, or remove `area`";
                    self.conflict("loading.area", "\"splitting\" is for plates that press on a cylinder", help);
                }
            }
            Loading::Bending { axis, about, rate, .. } => self.bending(*axis, *about, *rate),
            Loading::Torsion { axis, rate, .. } => self.torsion(*axis, *rate),
            Loading::CellStrain { velocity_gradient } => {
                if velocity_gradient.iter().flatten().all(|rate| rate.si() == 0.0) {
                    let help =
                        "rows are velocity components, columns directions; at least one component must not be zero";
                    self.range("loading.velocity_gradient", "all components are zero", help);
                }
            }
            Loading::CellStress { stress, strain_rate, .. } => {
                self.cell_stress(stress);
                self.cell_rates(stress, strain_rate);
            }
            Loading::Platens { axis, material, strip_width, area, .. } => {
                self.plates_or_strips(material.as_deref(), *strip_width, *area);
                if *area == Some(CrossSection::Splitting)
                    && !matches!(scenario.packing.shape(), Some(Shape::Cylinder { axis: along, .. }) if along != axis)
                {
                    let help = "give [packing.shape] kind = \"cylinder\" with another axis, or the area";
                    self.conflict("loading.area", "\"splitting\" needs a cylinder that lies across the axis", help);
                }
            }
            Loading::Flexure { .. } => self.flexure(),
        }
        self.opening();
        self.initial_field();
    }

    fn uniaxial(&mut self, axis: Axis, strain_rate: StrainRate, layer_thickness: Option<Length>) {
        let scenario = self.scenario;
        if strain_rate.si() == 0.0 {
            let help = "positive is tension, negative compression: strain_rate = \"0.4 1/s\"";
            self.range("loading.strain_rate", "must not be zero", help);
        }
        if strain_rate.si() > 0.0 && scenario.bonds.is_none() {
            let help = "add [bonds], or use a negative strain rate for compression";
            self.conflict("loading.strain_rate", "without bonds nothing holds the particles together in tension", help);
        }
        let along = scenario.packing.shape().and_then(|shape| length_along(shape, axis));
        if let (Some(thickness), Some(along)) = (layer_thickness, along)
            && 2.0 * thickness.si() >= along
        {
            let message = format!("the two end layers cover the whole length of the specimen, {}", length(along));
            let help = "one to three particle diameters are usual; check the units";
            self.range("loading.layer_thickness", message, help);
        }
    }

    /// Plates need a material; strips have that of the specimen, and belong to a cylinder that splits.
    fn plates_or_strips(&mut self, material: Option<&str>, strip_width: Option<Length>, area: Option<CrossSection>) {
        match (material, strip_width) {
            (None, None) => {
                let help = "give `material`, the name of a [[material]]";
                self.missing("loading", "plates need a material", help);
            }
            (Some(_), Some(_)) => {
                let help = "remove `material`; strips are particles of the specimen";
                self.conflict("loading.material", "strips of particles have no material of their own", help);
            }
            _ => {}
        }
        if let Some(material) = material {
            self.known_material("loading.material", material);
        }
        let Some(width) = strip_width else { return };
        if area != Some(CrossSection::Splitting) {
            let help = "remove the key, or give `area = \"splitting\"` and a cylinder across the axis";
            self.conflict("loading.strip_width", "strips press on a cylinder that splits", help);
        } else if let Some(Shape::Cylinder { radius, .. }) = self.scenario.packing.shape()
            && width.si() > radius.si()
        {
            let message = format!("is more than half of the diameter, {}", length(2.0 * radius.si()));
            self.range("loading.strip_width", message, "a tenth of the diameter is usual");
        }
    }

    fn bending(&mut self, axis: Axis, about: Axis, rate: AngularVelocity) {
        self.rotation_rate(rate);
        if axis == about {
            let help = "bend about an axis across the specimen";
            self.conflict("loading.about", "is the axis of the specimen", help);
        }
        // The stress is computed from the moment of inertia of the section.
        let known = match self.scenario.packing.shape() {
            Some(Shape::Box { .. }) => true,
            Some(Shape::Cylinder { axis: along, .. }) => *along == axis,
            _ => false,
        };
        if !known {
            let help = "give [packing.shape] kind = \"box\", or \"cylinder\" with the same axis";
            self.conflict(
                "loading.kind",
                "bending needs a box, or a cylinder along the same axis, to compute the stress",
                help,
            );
        }
    }

    fn flexure(&mut self) {
        let Loading::Flexure { axis, across, span, inner_span, strip_width, roller_radius, material, .. } =
            &self.scenario.loading
        else {
            return;
        };
        match (strip_width, roller_radius, material) {
            (None, None, _) => {
                let help = "give the width of the strips of particles that are held and moved, or `roller_radius`";
                self.missing("loading", "gives neither `strip_width` nor `roller_radius`", help);
            }
            (Some(_), Some(_), _) => {
                let help = "keep one of them";
                self.conflict("loading.strip_width", "gives both `strip_width` and `roller_radius`", help);
            }
            (None, Some(_), None) => {
                self.missing("loading", "rollers need a material", "give `material`, the name of a [[material]]");
            }
            (Some(_), None, Some(_)) => {
                let help = "remove `material`; strips are particles of the beam";
                self.conflict("loading.material", "strips of particles have no material of their own", help);
            }
            _ => {}
        }
        if let Some(material) = material {
            self.known_material("loading.material", material);
        }
        if *across == Some(*axis) {
            let help = "the rollers press across the beam; choose another axis";
            self.conflict("loading.across", "is the axis of the beam", help);
        }
        if inner_span.si() >= span.si() {
            let help = "two rollers lie between the supports; three-point bending has inner_span = 0";
            self.conflict("loading.inner_span", "is not shorter than `span`", help);
        }
        let Some(Shape::Box { size, .. }) = self.scenario.packing.shape() else {
            let help = "give [packing.shape] kind = \"box\"";
            self.conflict("loading.kind", "bending needs a beam with a known section", help);
            return;
        };
        let along = size[axis.index()].si();
        if span.si() > along {
            let message = format!("is longer than the beam, {}", length(along));
            self.range("loading.span", message, "let the beam stick out over its supports");
        }
    }

    fn torsion(&mut self, axis: Axis, rate: AngularVelocity) {
        self.rotation_rate(rate);
        if !matches!(self.scenario.packing.shape(), Some(Shape::Cylinder { axis: along, .. }) if *along == axis) {
            let help = "give [packing.shape] kind = \"cylinder\" with the same axis";
            self.conflict("loading.kind", "torsion needs a cylinder along the same axis to compute the stress", help);
        }
    }

    fn rotation_rate(&mut self, rate: AngularVelocity) {
        if rate.si() == 0.0 {
            let help = "the ends rotate in opposite directions: rate = \"1 rad/s\"";
            self.range("loading.rate", "must not be zero", help);
        }
    }

    fn cell_stress(&mut self, stress: &[[Stress; 3]; 3]) {
        for (row, column) in [(0, 1), (0, 2), (1, 2)] {
            let (upper, lower) = (stress[row][column].si(), stress[column][row].si());
            if (upper - lower).abs() > SYMMETRY * upper.abs().max(lower.abs()) {
                let message = format!("must equal the component in row {row}, column {column}");
                let help = "the stress of a cell in equilibrium is symmetric";
                self.conflict(&format!("loading.stress[{column}][{row}]"), message, help);
            }
        }
    }

    /// Checks the strain rates of axes of a cell whose other axes follow their stress.
    fn cell_rates(&mut self, stress: &[[Stress; 3]; 3], strain_rate: &[Component<OfStrainRate>; 3]) {
        let by_stress = self.scenario.stages.iter().any(|stage| stage.control == Control::Stress);
        let driven: Vec<usize> = (0..3).filter(|&axis| strain_rate[axis] != Component::Free).collect();
        if by_stress && driven.is_empty() {
            let at = self.scenario.stages.iter().position(|stage| stage.control == Control::Stress).unwrap_or(0);
            let help = "give `loading.strain_rate`, or remove `control`";
            self.conflict(&format!("stage[{at}].control"), "all axes follow their stress in every stage", help);
        }
        if driven.len() == 3 {
            let help = "leave at least one axis \"free\", or use \"cell-strain\" loading";
            self.conflict("loading.strain_rate", "no axis is left that follows its stress", help);
        }
        for axis in driven {
            if stress[axis][axis].si() != 0.0 && !by_stress {
                let help = "write 0, or add a [[stage]] with control = \"stress\"";
                let message = "has no effect, because this axis follows its strain rate";
                self.conflict(&format!("loading.stress[{axis}][{axis}]"), message, help);
            }
        }
    }

    /// Refuses initial velocities that the loading would overwrite.
    fn initial_field(&mut self) {
        let scenario = self.scenario;
        let loading = &scenario.loading;
        let (translations, rotations) = match loading {
            Loading::Uniaxial { axis, initial_velocity_field: true, .. } => {
                (std::array::from_fn(|i| i == axis.index()), [false; 3])
            }
            Loading::Bending { initial_velocity_field: true, .. }
            | Loading::Torsion { initial_velocity_field: true, .. } => ([true; 3], [true; 3]),
            Loading::CellStrain { .. } => ([true; 3], [false; 3]),
            _ => return,
        };
        let help = if loading.drives_cell() {
            "particles of a driven cell start with the affine velocity of the cell; remove this velocity, or use [[prescribe]]"
        } else {
            "remove this velocity, or write initial_velocity_field = false in [loading]"
        };
        let mut given: Vec<(String, [f64; 3], [bool; 3])> = Vec::new();
        for (at, initial) in scenario.initials.iter().enumerate() {
            given.push((format!("initial[{at}].velocity"), components(&initial.velocity), translations));
            given.push((format!("initial[{at}].angular_velocity"), components(&initial.angular_velocity), rotations));
        }
        for (at, clump) in scenario.clumps.iter().enumerate() {
            let velocity = clump.velocity.as_ref().map_or([0.0; 3], components);
            let angular_velocity = clump.angular_velocity.as_ref().map_or([0.0; 3], components);
            given.push((format!("clump[{at}].velocity"), velocity, translations));
            given.push((format!("clump[{at}].angular_velocity"), angular_velocity, rotations));
        }
        let message = format!("\"{}\" loading sets this initial velocity", loading.kind());
        for (key, value, set) in given {
            for i in (0..3).filter(|&i| set[i] && value[i] != 0.0) {
                self.conflict(&format!("{key}[{i}]"), &message, help);
            }
        }
    }

    pub(super) fn stop(&mut self) {
        let scenario = self.scenario;
        let stop = &scenario.stop;
        let never = stop.drop_to.is_none()
            && stop.strain.is_none()
            && stop.time.is_none()
            && stop.steps.is_none()
            && stop.unbalanced.is_none();
        if never && scenario.stages.is_empty() {
            let help = "add [stop] with at least one of `steps`, `time`, `strain`, `drop_to`, and `unbalanced`";
            self.missing("stop", "the run has no end", help);
        }
        if stop.drop_to.is_some() && !scenario.loading.has_peak() {
            let help = "use it with \"uniaxial\", \"platens\", or \"cell-strain\" loading";
            self.conflict("stop.drop_to", "this loading measures no stress with a peak", help);
        }
        if stop.strain.is_some() && matches!(scenario.loading, Loading::None) {
            let help = "stop by `time` or `steps`, or add [loading]";
            self.conflict("stop.strain", "a run without loading has no strain", help);
        }
    }
}

/// Length of a shape along an axis, m.
fn length_along(shape: &Shape, along: Axis) -> Option<f64> {
    match shape {
        Shape::Box { size, .. } => Some(size[along.index()].si()),
        Shape::Cylinder { radius, height, axis, .. } | Shape::Hyperboloid { radius, height, axis, .. } => {
            Some(if *axis == along { height.si() } else { 2.0 * radius.si() })
        }
        Shape::Mesh { .. } | Shape::Periodic { .. } => None,
    }
}
