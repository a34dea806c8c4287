//! The suite must find the defect in each of these laws.

mod cpm;

use super::*;
use crate::kinematics::Transport;
use crate::law::{LinearBond, LinearBondState};

/// The contact of most subjects: its sides differ, so that an exchange of them shows.
pub(crate) const GEOMETRY: ContactGeometry =
    ContactGeometry { reference_length: 2.0, area: 1.0, radius_a: 0.8, radius_b: 1.2, mass_a: 1.0, mass_b: 2.0 };

/// A law that loses energy only by damage and friction.
const CONSERVATIVE: Properties = Properties {
    conservative_normal: true,
    conservative_shear: true,
    dissipation_nonnegative: true,
    continuous_failure: true,
    brittle: false,
};

/// A linear bond with a defect.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Defect {
    None,
    /// The shear history stays in the axes of the previous step.
    NoTransport,
    /// Drops the stored shear energy.
    ForgetsShear,
    /// Stiffness depends on which side A is.
    OneSided,
    /// The history keeps its sign under exchange although its parity is odd.
    WrongSign,
    /// Friction is booked with the wrong sign.
    NegativeFriction,
    /// Divides by the elongation.
    DividesByElongation,
    /// The normal force depends on the orientation in space.
    SpaceFixed,
}

#[derive(Debug, Clone, Copy)]
struct Defective(LinearBond, Defect);

impl Host for Defective {
    type State = LinearBondState;

    fn respond(&self, k: &PointKinematics, old: &LinearBondState, dt: f64) -> Response<LinearBondState> {
        let mut k = *k;
        let mut bond = self.0;
        match self.1 {
            Defect::NoTransport => k.transport = Transport::identity(k.normal),
            Defect::OneSided => bond.normal_stiffness *= k.geometry.radius_a,
            Defect::WrongSign => k.shear_increment += Vec3::new(1e-6, 0.0, 0.0),
            Defect::SpaceFixed => bond.normal_stiffness *= 1.0 + 1e-3 * k.normal.x,
            _ => {}
        }
        let mut response = bond.respond(&k, old, dt);
        match self.1 {
            Defect::ForgetsShear => response.energy.stored_shear = 0.0,
            Defect::NegativeFriction => {
                response.energy.friction -= 1e-3;
                response.energy.integration += 1e-3;
            }
            Defect::DividesByElongation => response.force *= (2.0 * k.elongation) / k.elongation,
            _ => {}
        }
        response
    }
}

fn subject(defect: Defect) -> Subject<Defective> {
    let window = Window { elongation: [-0.4, 0.6], shear: 0.5 };
    Subject {
        name: "defective bond",
        host: Defective(LinearBond::new(1e6, 4e5, 0.0, f64::INFINITY, f64::INFINITY).unwrap(), defect),
        geometry: GEOMETRY,
        bonded: true,
        properties: CONSERVATIVE,
        elastic: window,
        inelastic: window,
        held: Station { elongation: 0.3, shear: [0.2, -0.3], twist: 0.0 },
        failure: 1.0,
        dt: 1e-3,
    }
}

#[test]
fn every_defect_is_found() {
    assert!(check(&subject(Defect::None)).passed());
    for (defect, expected) in [
        (Defect::NoTransport, "held and turned"),
        (Defect::ForgetsShear, "energy balance"),
        (Defect::OneSided, "exchange of A and B"),
        (Defect::WrongSign, "exchange of A and B"),
        (Defect::NegativeFriction, "most negative dissipation"),
        (Defect::DividesByElongation, "extremes"),
        (Defect::SpaceFixed, "held and turned"),
    ] {
        let report = check(&subject(defect));
        assert!(report.failures().any(|finding| finding.check.contains(expected)), "{defect:?}: {report}");
    }
}

/// The suite reports every property that a law has but does not declare.
#[test]
fn undeclared_properties_are_found() {
    type Change = fn(&mut Properties);
    let changes: [(Change, &str); 5] = [
        (|p| p.conservative_normal = false, "not conservative in length"),
        (|p| p.conservative_shear = false, "not conservative in shear"),
        (|p| p.dissipation_nonnegative = false, "most negative dissipation"),
        (|p| p.continuous_failure = false, "pulled to failure"),
        (|p| p.brittle = true, "brittle"),
    ];
    for (change, expected) in changes {
        let mut subject = subject(Defect::None);
        change(&mut subject.properties);
        let report = check(&subject);
        let failures: Vec<_> = report.failures().collect();
        assert!(!failures.is_empty(), "{expected}");
        assert!(failures.iter().all(|finding| finding.check.contains(expected)), "{report}");
    }
}

/// The path builder produces the prescribed deformation, and the measure reads it back. 2e-14: a random walk of 200
/// steps, each with a rounding of the orientations (1e-16) times the length 2, and a margin.
#[test]
fn prescribed_deformation_is_measured() {
    let subject = subject(Defect::None);
    let stations = subject.closed_path(&subject.elastic, true, 11, 25);
    let mut shear = Vec3::zeros();
    for (record, station) in drive(&subject, MotionMeasure::Finite, &subject.path(&stations)).iter().zip(&stations) {
        shear += record.kinematics.shear_increment;
        assert!((record.kinematics.elongation - station.elongation).abs() < 4e-16 * 4.0);
        assert!((shear - Vec3::new(0.0, station.shear[0], station.shear[1])).norm() < 2e-14);
    }
}

/// The atlas detects a wrong closed form and a break at the wrong step.
#[test]
fn atlas_compares() {
    let subject = subject(Defect::None);
    let paths = atlas_paths(&subject.elastic, 20);
    let law = |stiffness: f64| {
        move |now: &Observed| {
            let s = now.station;
            Some([stiffness * s.elongation, 4e5 * s.shear[0], 4e5 * s.shear[1]])
        }
    };
    assert!(atlas(&subject, &paths, || law(1e6), 1e-13, "").iter().all(Finding::passed));
    assert!(atlas(&subject, &paths, || law(1.001e6), 1e-13, "").iter().all(|finding| !finding.passed()));
    assert!(atlas(&subject, &paths, || |_: &Observed| None, 1e-13, "").iter().all(|finding| !finding.passed()));
}
