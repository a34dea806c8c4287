//! Test: the committed C header matches the Rust sources.

use std::path::{Path, PathBuf};

use concordem_c_abi::Message;
use concordem_c_abi::header::{FieldNames, Header, TypeLayout};

use crate::body_motion::BodyMotion;
use crate::bonded_engine::{BodyArrays, BondedStep, CellArrays, ConcreteScene, ContactArrays, Facts, PairCoefficients};
use crate::concrete::CpmContact;
use crate::deformation::{BondForce, DeformableBody, DeformableScene, DeformationEnergies, Elasticity};
use crate::law_contact::{LawBody, LawContact};
use crate::linear_bond::{BondedBody, LinearBondContact, LinearBondParameters};

#[test]
fn c_header_is_current() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut sources: Vec<PathBuf> = [
        "body_motion",
        "concrete",
        "linear_bond",
        "law_contact",
        "deformation",
        "bonded_engine/arrays",
        "bonded_engine/mod",
        "bonded_engine/particle_results",
    ]
    .map(|name| root.join("src").join(name).with_extension("rs"))
    .into();
    sources.push(root.join("../../liggghts-bridge/c-abi/src/guard.rs"));
    Header {
        path: &root.join("shim/abi.h"),
        sources: &sources,
        comment: "/* Functions and structures of the Rust library (../src). Generated from the Rust sources by the test c_header: do not edit.\n\n   \
                  SPDX-License-Identifier: MIT OR Apache-2.0 */",
        fields: FieldNames::Camel,
        names: &[],
        layouts: &[
            Message::type_layout(),
            BodyMotion::type_layout(),
            CpmContact::type_layout(),
            LinearBondParameters::type_layout(),
            BondedBody::type_layout(),
            LinearBondContact::type_layout(),
            LawBody::type_layout(),
            LawContact::type_layout(),
            Elasticity::type_layout(),
            DeformableBody::type_layout(),
            BondForce::type_layout(),
            DeformableScene::type_layout(),
            DeformationEnergies::type_layout(),
            BodyArrays::type_layout(),
            ContactArrays::type_layout(),
            PairCoefficients::type_layout(),
            CellArrays::type_layout(),
            Facts::type_layout(),
            ConcreteScene::type_layout(),
            BondedStep::type_layout(),
        ],
    }
    .check();
}
