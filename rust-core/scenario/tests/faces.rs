//! Bonds near the faces of a body that is cut from a periodic packing.

use std::path::Path;

use concordem_scenario::assembly::{Assembly, AssemblyError, assemble};
use concordem_scenario::schema::Scenario;

const RATIO: f64 = 1.5;
const RADIUS: f64 = 1e-3;

/// Concrete in a packing with these keys and these bonds.
fn body(packing: &str, bonds: &str) -> Result<Assembly, AssemblyError> {
    let text = format!(
        "version = 1
        [packing]
        {packing}
        [[material]]
        name = \"concrete\"
        density = 4800
        cpm = {{ young = 25e9, shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 30, cohesion = 3e6, friction_coefficient = 0.8 }}
        [bonds]
        law = \"cpm\"
        {bonds}
        [contacts]
        law = \"cpm\"
        [stop]
        steps = 1"
    );
    let scenario = Scenario::parse("test.toml", &text).unwrap_or_else(|error| panic!("{error}"));
    assemble(&scenario, Path::new(env!("CARGO_TARGET_TMPDIR")), &mut |_, _| ())
}

/// The packing of a cell of 300 spheres, 12.6 mm wide, cut to this shape.
fn cut(shape: &str) -> String {
    format!("kind = \"random-dense\"\ncount = 300\nradius = {RADIUS}\nshape = {{ {shape} }}")
}

/// A correction changes areas near the faces only: by the same factor at both ends of the periodic packing, never below 1. Bonds whose particles
/// have all of their neighbors keep their bits.
#[test]
fn only_areas_near_the_faces_grow() {
    let half = [5e-3, 6e-3, 7e-3];
    let shape = cut("kind = \"box\", size = [0.010, 0.012, 0.014]");
    let plain = body(&shape, &format!("interaction_ratio = {RATIO}")).unwrap();
    let corrected = body(&shape, &format!("interaction_ratio = {RATIO}\nface_correction = true")).unwrap();
    let particles = &corrected.state.particles;
    assert_eq!(plain.state.particles.position, particles.position);
    let [plain, corrected] = [&plain, &corrected].map(|assembly| assembly.state.bonds[0].contacts());
    assert_eq!(plain.len(), corrected.len());
    // A particle has all of its neighbors if the longest bond does not reach a face.
    let depth = |p: u32| (0..3).map(|k| half[k] - particles.position[p as usize][k].abs()).fold(f64::MAX, f64::min);
    let (mut inside, mut near, mut sum) = (0, 0, 0.0);
    for k in 0..plain.len() {
        let [before, after] = [plain.view(k), corrected.view(k)];
        assert_eq!((before.pair, before.reference.length), (after.pair, after.reference.length));
        let factor = after.reference.area / before.reference.area;
        if [before.pair.a, before.pair.b].iter().all(|&p| depth(p) > 2.0 * RATIO * RADIUS) {
            assert_eq!(before.reference.area.to_bits(), after.reference.area.to_bits());
            inside += 1;
        } else {
            assert!((1.0..8.0).contains(&factor), "{factor}");
            near += 1;
            sum += factor;
        }
    }
    // The layer of a quarter of a diameter on six faces, `1 - (9/10)(11/12)(13/14)` of the volume, is what bonds near the faces take over: 24 % of all,
    // hence a mean factor of some 1.3 on nine tenths of the bonds. Bonds along the faces count, which lifts it.
    assert!(inside > 20 && near > 500, "{inside} {near}");
    let mean = sum / f64::from(near);
    assert!((1.2..1.5).contains(&mean), "{mean}");
}

/// The correction follows the packing's own neighbors: a file with a cell gives the same as the packing itself, one without a cell is refused. At a
/// small interaction ratio it warns.
#[test]
fn files_need_a_cell_and_few_bonds_warn() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let shape = "kind = \"box\", size = [0.010, 0.010, 0.010]";
    let whole = body(&cut("kind = \"periodic\""), &format!("interaction_ratio = {RATIO}")).unwrap();
    let edge = whole.state.cell.unwrap().matrix[(0, 0)];
    let particles = &whole.state.particles;
    let rows = particles.position.iter().zip(&particles.radius);
    let lines: Vec<String> = rows.map(|(p, r)| format!("{:?} {:?} {:?} {r:?}", p.x, p.y, p.z)).collect();
    std::fs::write(folder.join("faces.txt"), lines.join("\n")).unwrap();
    let bonds = format!("interaction_ratio = {RATIO}\nface_correction = true");
    let file = |cell: &str| {
        format!("kind = \"file\"\npath = \"faces.txt\"\n{cell}shape = {{ {shape}, center = [0.006, 0.006, 0.006] }}")
    };
    let message = body(&file(""), &bonds).err().expect("refused").to_string();
    assert!(message.contains("bonds.face_correction") && message.contains("cut from a periodic packing"), "{message}");
    let centered = format!("{shape}, center = [0.006, 0.006, 0.006]");
    let own = body(&cut(&centered), &bonds).unwrap();
    let read = body(&file(&format!("cell = [{edge:?}, {edge:?}, {edge:?}]\n")), &bonds).unwrap();
    assert_eq!(own.summary.bonds, read.summary.bonds);
    let areas = |assembly: &Assembly| {
        let block = assembly.state.bonds[0].contacts();
        let mut areas: Vec<f64> = (0..block.len()).map(|k| block.view(k).reference.area).collect();
        areas.sort_by(f64::total_cmp);
        areas
    };
    for (one, other) in areas(&own).iter().zip(areas(&read)) {
        // Images are shifted by other multiples of the edge: a few roundings; a part of a bond is found to 1e-6.
        assert!((one / other - 1.0).abs() < 1e-5, "{one} {other}");
    }
    let warns =
        |assembly: &Assembly| assembly.summary.warnings.iter().any(|w| w.to_string().contains("half of its effect"));
    assert!(!warns(&own));
    assert!(warns(&body(&cut(shape), "interaction_ratio = 1.2\nface_correction = true").unwrap()));
}
