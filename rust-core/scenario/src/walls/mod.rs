//! The kinds of walls: one file per kind, and their list. The file of a kind has its keys, their checks, what the program asks of it
//! ([`WallKind`]), and its surface, unless packings or loadings use that surface, too: planes, infinite cylinders, and triangles are in
//! the solver ([`concordem_solver::state::surface`]).

mod kind;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub(crate) use kind::IN_TWO_DIMENSIONS;
pub use kind::{NamedFile, Unfit, WallKind};

// `cargo fmt` does not see the files; `make check` formats them by name.
macro_rules! walls {
    ($($file:ident: $Kind:ident,)*) => {
        $(pub mod $file;)*

        /// Surface of a wall.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "kind", rename_all = "kebab-case")]
        #[expect(missing_docs, reason = "a comment here would replace that of the type in the JSON Schema")]
        pub enum WallShape {
            $($Kind($file::$Kind),)*
        }

        impl WallShape {
            /// What the program asks of a kind.
            pub fn kind(&self) -> &dyn WallKind {
                match self { $(Self::$Kind(kind) => kind,)* }
            }
        }
    };
}

// One line per kind, as `file: Kind`; in scenarios, `kind` is the type's name in lower case, with hyphens between its words. To add a
// kind, add a line.
walls! {
    plane: Plane,
    box_of_planes: Box,
    cylinder: Cylinder,
    plate: Plate,
    facets: Facets,
    mesh: Mesh,
}
