//! Is what a scenario asks for in the state that is built from it, or is it refused?

use std::path::Path;

use concordem::assembly::{Assembly, AssemblyError, assemble};
use concordem::scenario::Scenario;

fn built(text: &str) -> Result<Assembly, AssemblyError> {
    let scenario = Scenario::parse("assembled.toml", text).unwrap_or_else(|error| panic!("{error}"));
    assemble(&scenario, Path::new("scenarios/good"), &mut |_, _| {})
}

fn made(text: &str) -> Assembly {
    built(text).unwrap_or_else(|error| panic!("{error}"))
}

/// Sets have the spheres of clumps: by place, by number, and all; their material is the clump's, if it names one.
#[test]
fn sets_have_the_spheres_of_clumps() {
    let text = |material: &str| {
        format!(
            "version = 1
            [packing]
            kind = \"spheres\"
            spheres = [[0, 0, 0, 1]]
            [[material]]
            name = \"light\"
            density = 1000
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 1e5 }}
            [[material]]
            name = \"heavy\"
            density = 2000
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 1e5 }}
            [contacts]
            law = \"linear_bond\"
            [[clump]]
            spheres = [[10, 0, 0, 1], [11, 0, 0, 1]]
            {material}
            [[set]]
            name = \"all\"
            selection = {{ kind = \"all\" }}
            material = \"heavy\"
            [[set]]
            name = \"last\"
            selection = {{ kind = \"ids\", ids = [2] }}
            [[set]]
            name = \"far\"
            selection = {{ kind = \"sphere\", center = [10, 0, 0], radius = 0.5 }}
            [integration]
            time_step = 1e-5
            [stop]
            steps = 1"
        )
    };
    let tags_and_materials = |text: &str| {
        let Assembly { state, .. } = made(text);
        let place = |id: u32| state.particles.id.iter().position(|&other| other == id).expect("the particle");
        [0, 1, 2].map(|id| (state.particles.tags[place(id)], state.particles.material[place(id)]))
    };
    assert_eq!(tags_and_materials(&text("")), [(0b001, 1), (0b101, 1), (0b011, 1)]);
    assert_eq!(tags_and_materials(&text("material = \"light\"")), [(0b001, 1), (0b101, 0), (0b011, 0)]);
}
