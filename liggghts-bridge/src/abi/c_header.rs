//! Test: the committed C header matches the Rust sources.

use std::path::{Path, PathBuf};

use concordem_c_abi::Message;
use concordem_c_abi::header::{FieldNames, Header, TypeLayout};

use super::atoms::AtomArrays;
use super::network::{BondLists, Facts, PairLists};
use super::pair::{PairArrays, PairModel, PairProperties};
use crate::bond_list::BondOfList;
use crate::heat_network::HeatEntry;
use crate::network::Rules;
use crate::pair::{PairForce, SingleContact, SingleResponse, WallContact};

#[test]
fn c_header_is_current() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sources: Vec<PathBuf> = [
        "c-abi/src/guard.rs",
        "src/abi/atoms.rs",
        "src/abi/network.rs",
        "src/abi/heat.rs",
        "src/abi/results.rs",
        "src/abi/pair.rs",
        "src/network/mod.rs",
        "src/network/exclude.rs",
        "src/bond_list.rs",
        "src/heat_network.rs",
        "src/law_names.rs",
        "src/pair.rs",
    ]
    .map(|name| root.join(name))
    .into();
    Header {
        path: &root.join("shim/abi.h"),
        sources: &sources,
        comment: "/* Functions and structures of the Rust library (../src). Generated from the Rust sources by the test c_header: do not edit.\n\n   \
                  SPDX-License-Identifier: MIT OR Apache-2.0 */",
        fields: FieldNames::Snake,
        names: &[
            ("AtomArrays", "ConcordemAtoms"),
            ("PairLawHandle", "ConcordemPairLaw"),
            ("SUMS", "CONCORDEM_SUMS"),
            ("ELASTIC", "CONCORDEM_ELASTIC"),
            ("RESTITUTION", "CONCORDEM_RESTITUTION"),
            ("STIFFNESS", "CONCORDEM_STIFFNESS"),
            ("DAMPING", "CONCORDEM_DAMPING"),
            ("VELOCITY", "CONCORDEM_VELOCITY"),
            ("LONGEST", "CONCORDEM_LONGEST"),
            ("TOTALS", "CONCORDEM_TOTALS"),
            ("FROZEN_MASS", "CONCORDEM_FROZEN_MASS"),
            ("ROW", "CONCORDEM_ROW"),
            ("LINE", "CONCORDEM_LINE"),
            ("BREAK", "CONCORDEM_BREAK"),
        ],
        layouts: &[
            Message::type_layout(),
            AtomArrays::type_layout(),
            Facts::type_layout(),
            PairLists::type_layout(),
            Rules::type_layout(),
            BondLists::type_layout(),
            BondOfList::type_layout(),
            HeatEntry::type_layout(),
            PairForce::type_layout(),
            WallContact::type_layout(),
            SingleContact::type_layout(),
            SingleResponse::type_layout(),
            PairModel::type_layout(),
            PairProperties::type_layout(),
            PairArrays::type_layout(),
        ],
    }
    .check();
}
