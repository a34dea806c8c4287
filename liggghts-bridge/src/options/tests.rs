//! Tests of the arguments.

use super::*;

fn parse(text: &str) -> Result<Options, String> {
    let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
    Options::parse(&words, 2).map_err(|error| error.to_string())
}

#[test]
fn inline_parameters_use_the_keys_of_a_scenario() {
    let options = parse(
        "linear_bond normal_stiffness 1e6 shear_stiffness .5e6 bond distance 1.2 contact frictional \
         contact.normal_stiffness 2e6 contact.shear_stiffness 1e6 contact.friction_coefficient 0.3 kinematics first-order at 10",
    )
    .unwrap();
    assert_eq!(options.law, Some(LawName::LinearBond));
    assert_eq!(options.materials.len(), 2);
    let bond = options.materials[1].linear_bond.as_ref().unwrap();
    assert_eq!(bond.shear_stiffness.si(), 0.5e6);
    assert_eq!(options.materials[0].frictional.as_ref().unwrap().friction_coefficient.si(), 0.3);
    assert_eq!(options.creation, Creation::Distance(1.2));
    assert_eq!((options.mode, options.at), (MotionMeasure::FirstOrder, Some(10)));
}

#[test]
fn without_a_bond_law_the_parameters_belong_to_contacts() {
    let options =
        parse("none contact frictional normal_stiffness 2e6 shear_stiffness 1e6 friction_coefficient 0.3").unwrap();
    assert_eq!((options.law, options.creation), (None, Creation::None));
    assert_eq!(options.materials[1].frictional.as_ref().unwrap().friction_coefficient.si(), 0.3);
}

#[test]
fn a_state_needs_no_bonds() {
    let options = parse("linear_bond normal_stiffness 1 shear_stiffness 1 state half.data").unwrap();
    assert_eq!((options.state.as_deref(), options.creation), (Some("half.data"), Creation::None));
}

#[test]
fn errors_name_the_argument_and_the_remedy() {
    for (text, wanted) in [
        ("", "unknown bond law ``"),
        ("hertz_mindlin", "unknown bond law `hertz_mindlin`; choose one of"),
        ("none", "computes no forces"),
        ("none contact frictional bond distance 1.2", "`bond` needs a bond law"),
        ("none contact frictional contact.normal_stiffness 1", "write `normal_stiffness`"),
        ("none contact hertz_mindlin young 1e7", "missing field `poisson`"),
        ("linear_bond bond distance", "needs a value: a factor"),
        ("linear_bond bond distance 20", "`bond 20` is invalid; give a factor"),
        ("linear_bond normal_stiffness 1 shear_stiffness 1", "add `bond distance FACTOR`"),
        ("linear_bond normal_stiffness 1 bond none", "missing field `shear_stiffness`"),
        ("linear_bond normal_stiffness 1 shear_stiffness 1 colour red bond none", "unknown field `colour`"),
        ("linear_bond normal_stiffness 1 normal_stiffness 1 bond none", "given twice"),
        (
            "cohesive_beam young 1e9 tensile_strength 1e6 bond none",
            "the radius of the beam is missing; give `radius_ratio`",
        ),
        (
            "cohesive_beam young 1e9 radius 1 radius_ratio 1 tensile_strength 1e6 bond none",
            "`radius`: the radius of the beam is given twice",
        ),
        (
            "cohesive_beam young 1e9 radius_ratio 1 tensile_strength 1e6 hydrostatic_strength 1e6 bond none",
            "failure of whole particles is not available",
        ),
        ("linear_bond bond none state", "`state` needs a value: a file that write_data wrote"),
        ("linear_bond state a.data bond distance 1.2", "`bond` creates bonds, but `state FILE` has the bonds"),
        ("linear_bond state a.data at 10", "`at` creates bonds, but `state FILE` has the bonds"),
        ("linear_bond contact glue bond none", "unknown contact law `glue`"),
        ("linear_bond bond list /no/such/file", "cannot read /no/such/file"),
        ("linear_bond deformable much bond none", "solid, plane-strain, or plane-stress"),
        ("linear_bond normal_stiffness 1 shear_stiffness 1 deformable solid bond none", "add `deformable.young`"),
        ("linear_bond kinematics fast bond none", "finite, first-order, yade, or yade-ratcheting"),
        ("linear_bond normal_stiffness 1 materials /no/such bond none", "conflicts with `materials FILE`"),
        ("linear_bond normal_stiffness 1 shear_stiffness 1 contact.x 1 bond none", "no parameters of its own"),
    ] {
        let message = parse(text).unwrap_err();
        assert!(message.contains(wanted), "{text}: {message}");
    }
}
