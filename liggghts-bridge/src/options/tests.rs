//! Tests of the arguments.

use concordem_contact::law::{ContactLaw, Cpm, Frictional, HertzMindlin};
use concordem_solver::evaluation::EvaluatedContacts;
use concordem_solver::laws::{block, contact_block};
use concordem_solver::state::contacts::ContactBlock;

use super::*;

fn parse(text: &str) -> Result<Options, String> {
    let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
    Options::parse(&words, 2, Units::Si).map_err(|error| error.to_string())
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
fn bonds_between_chosen_types() {
    let of = |end: &str| parse(&format!("linear_bond normal_stiffness 1e6 shear_stiffness 1e6 {end}"));
    assert_eq!(of("bond distance 1.2 between 1-1,2-1").unwrap().between, Some(vec![[0, 0], [0, 1]]));
    assert_eq!(of("bond distance 1.2").unwrap().between, None);
    for (end, wanted) in [
        ("bond none between 1-1", "`between` chooses pairs of `bond distance FACTOR`"),
        ("bond distance 1.2 between 1-3", "`between 1-3`: atom types are 1 to 2"),
        ("bond distance 1.2 between 0-1", "`between 0-1` is invalid; give pairs of atom types"),
        ("bond distance 1.2 between 1", "`between 1` is invalid"),
        ("bond distance 1.2 between 1-1 between 2-2", "given twice"),
    ] {
        let message = of(end).unwrap_err();
        assert!(message.contains(wanted), "{message}");
    }
}

#[test]
fn limits_of_bonds_per_atom() {
    let of = |end: &str| parse(&format!("linear_bond normal_stiffness 1e6 shear_stiffness 1e6 {end}"));
    assert_eq!(of("bond distance 1.2 limit 3").unwrap().limit, Some(vec![3, 3]));
    assert_eq!(of("limit 4,1 bond distance 1.2").unwrap().limit, Some(vec![4, 1]));
    for (end, wanted) in [
        ("bond list file limit 2", "`limit` counts the bonds of `bond distance FACTOR`"),
        ("bond distance 1.2 limit 1,2,3", "`limit` has 3 numbers, but there are 2 atom types"),
        ("bond distance 1.2 limit 0", "`limit 0` is invalid; give a number of bonds per atom"),
        ("bond distance 1.2 limit 2,x", "`limit 2,x` is invalid"),
        ("bond distance 1.2 limit 2 limit 2", "given twice"),
    ] {
        let message = of(end).unwrap_err();
        assert!(message.contains(wanted), "{message}");
    }
}

#[test]
fn without_a_bond_law_the_parameters_belong_to_contacts() {
    let options =
        parse("none contact frictional normal_stiffness 2e6 shear_stiffness 1e6 friction_coefficient 0.3").unwrap();
    assert_eq!((options.law, options.creation), (None, Creation::None));
    assert_eq!(options.materials[1].frictional.as_ref().unwrap().friction_coefficient.si(), 0.3);
}

/// A friction coefficient arrives in every law as it is written, in the script and in a materials file.
#[test]
fn friction_arrives_in_the_laws_as_it_is_written() {
    fn rows<L: ContactLaw>(block: &dyn EvaluatedContacts) -> Vec<L> {
        block.contacts().as_any().downcast_ref::<ContactBlock<L>>().unwrap().rows.clone()
    }
    let bond = "cpm young 30e9 shear_ratio 0.2 cohesion 3e6 friction_coefficient 0.8 crack_onset_strain 1e-3 relative_ductility 5";
    let given = [
        format!("{bond} bond distance 1.5 contact cpm"),
        "linear_bond normal_stiffness 1e6 shear_stiffness 4e5 friction_coefficient 0.8 bond none contact linear_bond"
            .into(),
        "none contact frictional normal_stiffness 1e6 shear_stiffness 4e5 friction_coefficient 0.8".into(),
        "none contact hertz_mindlin young 1e8 poisson 0.2 friction_coefficient 0.8 restitution 0.8".into(),
    ];
    let file = tempfile::NamedTempFile::new().unwrap();
    let table = |name: &str| {
        format!(
            "[[material]]\nname = \"{name}\"\ndensity = 1\ncpm = {{ young = 30e9, shear_ratio = 0.2, cohesion = 3e6, \
             friction_coefficient = 0.8, crack_onset_strain = 1e-3, relative_ductility = 5 }}\n"
        )
    };
    std::fs::write(file.path(), table("a") + &table("b")).unwrap();
    let of_file = format!("cpm materials {} bond distance 1.5 contact cpm", file.path().display());
    for text in given.iter().chain([&of_file]) {
        let options = parse(text).unwrap();
        let (contacts, _) = contact_block(options.contact, &options.materials, &[]).unwrap().unwrap();
        let found: Vec<f64> = match options.contact.law().unwrap() {
            LawName::Cpm => {
                let (bonds, _) = block(LawName::Cpm, &options.materials, &[]).unwrap();
                let laws = [rows::<Cpm>(&*bonds), rows::<Cpm>(&*contacts)].concat();
                laws.iter().map(|law| law.parameters().friction_coefficient).collect()
            }
            LawName::HertzMindlin => rows::<HertzMindlin>(&*contacts).iter().map(|law| law.friction).collect(),
            _ => rows::<Frictional>(&*contacts).iter().map(|law| law.friction).collect(),
        };
        assert!(found.len() >= 3 && found.iter().all(|x| x.to_bits() == 0.8_f64.to_bits()), "{text}: {found:?}");
    }
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
        ("linear_bond bond list", "`bond` needs a value: a file with two atom ids per line"),
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

/// The error that a file with `table` in `[heat]`, and `more` arguments, gives.
fn heat_error(table: &str, more: &str) -> String {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), format!("[heat]\ntemperature = 300\n{table}\n")).unwrap();
    let name = file.path().display();
    let thermal = "thermal.specific_heat 800 thermal.conductivity 1";
    parse(&format!("linear_bond normal_stiffness 1 shear_stiffness 1 bond distance 1.1 {thermal} heat {name} {more}"))
        .unwrap_err()
}

#[test]
fn heat_that_does_not_work_is_rejected_with_line_and_remedy() {
    const ORDERED: &str = "model = \"ordered\"\npairs = \"bonds\"\n";
    for (table, wanted) in [
        ("steady = true", ", line 5: `heat.steady = true`: the steady state needs all processors at once; give"),
        ("scheme = \"implicit\"", "remove the key: steps are then explicit"),
        ("motion = false", "the host moves the atoms"),
        ("dissipation = true", "heat of dissipation is not available here"),
        ("crack_resistance = 1e-3", "here, cracks insulate"),
        ("contact_ratio = 1.1", "here, heat flows along bonds"),
        ("contact = { resistance = 1 }", "without a contact law no atoms touch"),
        ("time_factor = -1", "line 5: `heat.time_factor = -1`: must be greater than 0; change it"),
        ("reference_temperature = -1", "`heat.reference_temperature = -1`: must be at least 0"),
        ("contact = { resistance = -1 }", "`heat.contact.resistance = -1`: must be at least 0"),
        ("contact = { resistance = 1, constriction = true }", "needs exactly one of `resistance` and `constriction"),
        ("glow = 1", "unknown field `glow`"),
        ("[[heat.initial]]\nset = \"a\"\ntemperature = -1", "`heat.initial[0].temperature = -1`: must be at least 0"),
        ("[[heat.source]]\nspot = { center = [0, 0, 0], radius = 1 }\npower = 1", "line 6: `heat.source[0].spot"),
        (
            "[[heat.source]]\nset = \"hot\"\npower = 1\nhistory = \"h\"",
            "`heat.source[0].history = \"h\"`: there are no",
        ),
        ("[[heat.source]]\nset = \"hot\"", "`heat.source[0].power`: the power is missing; give"),
        ("[[heat.source]]\npower = 1", "nothing is heated"),
        ("[[heat.boundary]]\nface = \"side\"\nflux = 1", "the body has no faces here"),
        ("[[heat.boundary]]\nwall = \"floor\"\ntemperature = 300", "walls exchange no heat here"),
        ("[[heat.boundary]]\nset = \"hot\"\nflux = 1\nhistory = \"h\"", "there are no histories here"),
        ("[[heat.boundary]]\nset = \"hot\"\ntemperature = 300\nflux = 1", "needs exactly one of `temperature`"),
        (
            "[[heat.boundary]]\nset = \"hot\"\nconvection = { coefficient = 0, ambient = 300 }",
            "line 7: `heat.boundary[0].convection.coefficient = 0`: must be greater than 0",
        ),
        (
            "[[heat.boundary]]\nset = \"hot\"\nradiation = { emissivity = 1.1, ambient = 300 }",
            "must be greater than 0 and at most 1",
        ),
    ] {
        let error = heat_error(&format!("{ORDERED}{table}"), "");
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
    assert!(
        heat_error(ORDERED, "deformable solid deformable.young 1 deformable.poisson 0")
            .contains("not with `deformable`")
    );
    assert!(heat_error("", "").contains("(default: \"power\"); give heat capacities"));
    assert!(heat_error("model = \"ordered\"", "").contains("give pairs = \"bonds\""));
    assert!(heat_error("model = \"contacts\"", "").contains("needs to know how contacts conduct"));
    let grains = "model = \"contacts\"\ncontact = { resistance = 0 }\n";
    assert!(heat_error(&format!("{grains}pairs = \"bonds\""), "").contains("`heat.pairs = \"bonds\"`: has no effect"));
    for (more, wanted) in [
        ("thermal.bulk_density -1", "`thermal.bulk_density`: must be greater than 0"),
        ("thermal.expansion 1e-5 subtract_initial_gap no", "where spheres touch cannot expand; remove the key"),
    ] {
        let error = heat_error(ORDERED, more);
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
    let contact =
        "contact frictional contact.normal_stiffness 1 contact.shear_stiffness 1 contact.friction_coefficient 0";
    let surface = format!("{grains}[[heat.boundary]]\nset = \"a\"\nflux = 1");
    assert!(heat_error(&surface, contact).contains("atoms have no surface"));
    assert!(
        parse("linear_bond normal_stiffness 1 shear_stiffness 1 bond none heat_network x")
            .unwrap_err()
            .contains("`heat FILE`")
    );
}
