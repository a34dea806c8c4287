//! The readers under test, and good inputs for them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use concordem::assembly::restart::apply;
use concordem::assembly::{Assembly, assemble};
use concordem::output::sphere_pack;
use concordem::output::{ResultFile, RunFiles, RunHeader, SeriesColumn, checkpoint, csv};
use concordem::packing::import;
use concordem::packing::shape::Mesh;
use concordem::sampling::Record;
use concordem::scenario::{Scenario, TEMPLATES};
use concordem::schedule::Simulation;
use concordem::state::columns::{ColumnData, ColumnStore, StoredColumn};
use concordem::sweep::Sweep;
use concordem::sweep::journal::Journal;
use concordem::sweep::outcome::Outcome;
use concordem_tests::commands::concordem;

use concordem_tests::random::Random;

use crate::forge::forge;
use crate::mutate::restructure;

/// A reader of one kind of input.
pub struct Reader {
    /// Name.
    pub name: &'static str,
    /// Whether inputs are text.
    pub text: bool,
    /// Lines beside those of the good inputs that a text may have.
    keywords: &'static [&'static str],
    /// Whether inputs end with a seal, which must be recomputed.
    sealed: bool,
    /// Reads an input and uses the result.
    pub read: fn(&Samples, &[u8]),
}

const fn reader(name: &'static str, text: bool, sealed: bool, read: fn(&Samples, &[u8])) -> Reader {
    Reader { name, text, keywords: &[], sealed, read }
}

/// A reader of text with lines and keywords.
const fn lines(name: &'static str, keywords: &'static [&'static str], read: fn(&Samples, &[u8])) -> Reader {
    Reader { name, text: true, keywords, sealed: false, read }
}

const TABLE: &[&str] = &[
    "x,y,z,r",
    "x [mm];y [mm];z [mm];d [um]",
    "id x y z radius clump",
    "# cell 1 0 0 0 1 0 0 0 1",
    "\"x\",\"y\",\"z\",\"r\"",
    "\u{feff}",
    "",
];
const YADE: &[&str] = &[
    "##PERIODIC:: 1 1 1",
    "#format x_y_z_r_matId",
    "#format x_y_z_r_clumpId",
    "# cell 1 0 0 0 1 0 0 0 1",
    "0 0 0 1 -1",
    "0 0 0 1 3",
];
const DATA: &[&str] = &[
    "Atoms",
    "Atoms # sphere",
    "Atoms # bpm/sphere",
    "Atoms # hybrid sphere bond",
    "Bonds",
    "Velocities",
    "2 atoms",
    "3 atom types",
    "0 1 xlo xhi",
    "-1 1 ylo yhi",
    "1 0 zlo zhi",
    "0.5 0 0 xy xz yz",
    "LAMMPS data file, units = cgs",
    "1 1 1.0 2500 0 1 2 0 0 0",
];
const DUMP: &[&str] = &[
    "ITEM: TIMESTEP",
    "ITEM: UNITS",
    "si",
    "lj",
    "ITEM: TIME",
    "ITEM: NUMBER OF ATOMS",
    "ITEM: BOX BOUNDS pp pp pp",
    "ITEM: ATOMS x y z radius",
    "ITEM: ATOMS id xu yu zu diameter id_multisphere",
    "ITEM: ATOMS x x y z r",
    "ITEM: ENTRIES c_1",
    "",
];
const STL: &[&str] = &[
    "solid",
    "solid a",
    "endsolid",
    "end solid",
    "facet normal 0 0 1",
    "outer loop",
    "vertex 0 0 1e38",
    "vertex -0 0 0",
    "endloop",
    "endfacet",
    "FACET NORMAL 0 0 1",
];

/// All readers.
pub const READERS: [Reader; 16] = [
    reader("scenario", true, false, scenario),
    reader("sweep", true, false, sweep),
    lines("table", TABLE, spheres),
    lines("text", YADE, spheres),
    lines("data", DATA, spheres),
    lines("dump", DUMP, spheres),
    lines("surface", STL, surface),
    reader("binary-surface", false, false, surface),
    reader("pack", false, true, pack),
    reader("result", false, true, result),
    reader("checkpoint", false, true, read_checkpoint),
    reader("header", false, true, header),
    reader("segment", false, true, segment),
    reader("journal", true, false, journal),
    reader("state", false, false, state),
    reader("motion", false, false, motion),
];

/// Mark with which the seal of a file begins, and length of the seal.
const SEAL: (&[u8], usize) = (b"ConcorDEM-seal-1", 56);

/// A small scenario with samples, of 16 spheres: the time of an input grows with their number, what a reader can do wrong does not.
const SCENARIO: &str = r#"
version = 1
[packing]
kind = "lattice"
lattice = "hcp"
radius = "1 mm"
repeats = [2, 1, 2]
[[material]]
name = "stone"
density = 2500
linear_bond = { normal_stiffness = 1e6, shear_stiffness = 2e5, normal_strength = 1, shear_strength = 1 }
frictional = { normal_stiffness = 1e6, shear_stiffness = 2e5, friction_coefficient = 0.5 }
[bonds]
law = "linear_bond"
interaction_ratio = 1.05
[contacts]
law = "frictional"
[[wall]]
material = "stone"
shape = { kind = "plane", point = [0, 0, "-1 mm"], normal = [0, 0, 1] }
[loading]
kind = "uniaxial"
layer_thickness = "1 mm"
strain_rate = "1 1/s"
[stop]
steps = 20
[output]
sample_interval = 2
snapshot_interval = 10
[[sample]]
operator = "fabric"
region = { kind = "all", volume = 1 }
"#;

const SWEEP: &str = r#"
version = 1
scenario = "cell.toml"
[[axis]]
name = "k_t"
key = "material[0].linear_bond.shear_stiffness"
logarithmic = { from = 1e4, to = 1e9, count = 16 }
[[axis]]
key = "packing.repeats"
values = [[3, 2, 3], [2, 2, 2]]
"#;

/// A sphere that follows a recorded motion.
const FOLLOWING: &str = r#"
version = 1
[packing]
kind = "spheres"
spheres = [[0, 0, 0, 1e-3]]
[[material]]
name = "stone"
density = 2500
[contacts]
law = "none"
[integration]
time_step = 1e-6
[[set]]
name = "moved"
selection = { kind = "ids", ids = [0] }
[[prescribe]]
set = "moved"
velocity = [0, 0, 0]
angular_velocity = [0, 0, 0]
[[slave]]
set = "moved"
path = "motion.npy"
[stop]
steps = 2
"#;

/// An array in NumPy's format: `steps` rows of one particle with six numbers.
fn array(steps: usize) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({steps}, 1, 6), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend_from_slice(&(header.len() as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes.extend((0..6 * steps).flat_map(|k| (1e-3 * k as f64).to_le_bytes()));
    bytes
}

/// Fingerprint of the sweep that the journal belongs to.
const FINGERPRINT: &str = "0123456789abcdef";

/// Numbers of its points.
const NUMBERS: usize = 61;

const SURFACE: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
                       facet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 1 0 1\nvertex 0 1 1\nendloop\nendfacet\nendsolid s\n";

/// Good inputs.
pub struct Samples {
    folder: PathBuf,
    inputs: BTreeMap<&'static str, Vec<Vec<u8>>>,
    /// Lines of the good inputs of each reader of text, and what else its lines may be.
    lines: BTreeMap<&'static str, Vec<String>>,
    columns: ColumnStore,
    scenario: Scenario,
    assembly: Assembly,
    following: Scenario,
}

impl Samples {
    /// Makes the good inputs in `folder`.
    pub fn new(folder: &Path) -> Self {
        let file = |name: &str| folder.join(name);
        let bytes = |path: &Path| std::fs::read(path).expect("a file");
        let scenario_file = file("cell.toml");
        std::fs::write(&scenario_file, SCENARIO).expect("a file");
        let scenario = Scenario::parse("cell.toml", SCENARIO).expect("a scenario");
        concordem(["run", "-q", &scenario_file.display().to_string()]);
        let assembly = assemble(&scenario, folder, &mut |_, _| ()).expect("an assembly");
        let packing = concordem::assembly::pack(&scenario, folder, &mut |_, _| ()).expect("a packing");
        sphere_pack::write(&file("pack.h5"), &packing).expect("a pack");
        let cell = Some(concordem::state::Cell::new_box(concordem::math::Vec3::repeat(0.01)));
        let periodic = concordem::packing::Packing { cell, ..packing.clone() };
        sphere_pack::write(&file("periodic.h5"), &periodic).expect("a pack");
        let mut text = Vec::new();
        concordem::packing::export_text(&packing, &mut text).expect("a text");
        let columns = ColumnStore::of(&assembly.state).expect("columns");
        // An unfinished run: a header, a segment, a checkpoint. Resuming it reads all of them, whichever is changed.
        let mut files = RunFiles::create(&file("run.h5"), run_header(), false).expect("files");
        files.append_sample(&[0.0; SERIES]).expect("a sample");
        files.commit(&assembly.state).expect("a commit");
        drop(files);
        let parts = file("run.h5.parts");
        let (mut journal, _) = Journal::open(&file("journal"), FINGERPRINT, NUMBERS).expect("a journal");
        journal.add(0, &Outcome::new(NUMBERS)).expect("a point");
        let mut binary = vec![0_u8; 80];
        binary.extend_from_slice(&2_u32.to_le_bytes());
        binary.extend((0..100).map(|k| k as u8));
        let scenarios = TEMPLATES.iter().map(|template| template.text.as_bytes().to_vec());
        let inputs = BTreeMap::from([
            ("scenario", scenarios.chain([SCENARIO.into()]).collect()),
            ("sweep", vec![SWEEP.into()]),
            (
                "text",
                vec![
                    text,
                    b"##PERIODIC:: 1 2 3\n0 0 0 1 -1\n".to_vec(),
                    b"#format x_y_z_r_matId\n0 1 2 0.5 1\n".to_vec(),
                ],
            ),
            (
                "table",
                vec![
                    b"x [mm],y [mm],z [mm],radius [um]\n0,1,2,0.5\n3,4,5,1e-1\n".to_vec(),
                    b"id;x;y;z;d\n1;0;1,5;2;0,5\n2;3;4;5;0,1\n".to_vec(),
                    b"x y z r clump\n0 1 2 0.5 -1\n".to_vec(),
                ],
            ),
            (
                "data",
                vec![
                    b"data\n\n1 atoms\n\nAtoms # sphere\n\n1 1 1.0 2500 0 1 2 0 0 0\n".to_vec(),
                    b"data\n\n1 atoms\n1 atom types\n0 9 xlo xhi\n0 9 ylo yhi\n0 9 zlo zhi\n\nAtoms # bpm/sphere\n\n1 1 1 1.0 2500 0 1 2\n\n\
                      Velocities\n\n1 0 0 0 0 0 0\n"
                        .to_vec(),
                ],
            ),
            (
                "dump",
                vec![
                    b"ITEM: UNITS\nsi\nITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: ATOMS id x y z radius\n1 0 1 2 0.5\n".to_vec(),
                ],
            ),
            ("surface", vec![SURFACE.into()]),
            ("binary-surface", vec![binary]),
            ("pack", vec![bytes(&file("pack.h5")), bytes(&file("periodic.h5"))]),
            ("result", vec![bytes(&file("cell.h5"))]),
            ("checkpoint", vec![bytes(&parts.join("checkpoint-0000.h5"))]),
            ("header", vec![bytes(&parts.join("header.h5"))]),
            ("segment", vec![bytes(&parts.join("segment-0000.h5"))]),
            ("journal", vec![bytes(&file("journal"))]),
            ("state", (0..8).map(|seed: u8| vec![seed; 8]).collect()),
            ("motion", vec![array(3), array(12)]),
        ]);
        let lines = READERS.iter().filter(|reader| reader.text).map(|reader| {
            let good = inputs[reader.name].iter().flat_map(|good: &Vec<u8>| good.split(|byte| *byte == b'\n'));
            let good = good.map(|line| String::from_utf8_lossy(line).into_owned());
            (reader.name, good.chain(reader.keywords.iter().map(|word| (*word).to_owned())).collect())
        });
        let lines = lines.collect();
        let following = Scenario::parse("following.toml", FOLLOWING).expect("a scenario");
        Self { folder: folder.to_owned(), inputs, lines, columns, scenario, assembly, following }
    }

    /// The good inputs of a reader.
    pub fn good(&self, reader: &Reader) -> &[Vec<u8>] {
        &self.inputs[reader.name]
    }

    /// Changes an input: its structure, its bytes by `bytewise`, or both. The marks of the lines of a journal fit again afterwards.
    pub fn change(
        &self,
        reader: &Reader,
        bytes: &mut Vec<u8>,
        random: &mut Random,
        bytewise: &mut dyn FnMut(&mut Vec<u8>, &mut Random),
    ) {
        if reader.sealed && self.reseal(reader, bytes, random) {
            return;
        }
        let kind = random.below(3);
        if kind > 0 && reader.text {
            restructure(bytes, random, &self.lines[reader.name]);
        }
        if kind < 2 || !reader.text {
            bytewise(bytes, random);
        }
        if reader.name == "journal" && random.below(2) == 0 {
            mark_lines(bytes);
        }
    }

    /// Mostly changes the tables of a file with a seal that fits, and seals it again; returns whether it did. Bytes change under no seal that
    /// fits: the HDF5 library, which opens such files only, ends the process at many of them, here and in the reader.
    fn reseal(&self, reader: &Reader, bytes: &mut Vec<u8>, random: &mut Random) -> bool {
        let content = bytes.len().saturating_sub(SEAL.1);
        if !bytes.ends_with(&seal(&bytes[..content])) || random.below(8) == 0 {
            return false;
        }
        bytes.truncate(content);
        let path = self.file("forged.h5", bytes);
        forge(&path, random);
        *bytes = std::fs::read(path).expect("a file");
        // Packs without a seal are read, too.
        if reader.name != "pack" || random.below(2) == 0 {
            bytes.extend(seal(bytes));
        }
        true
    }

    fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.folder.join(name);
        std::fs::write(&path, bytes).expect("a file");
        path
    }
}

/// The seal of a file with this content.
fn seal(content: &[u8]) -> Vec<u8> {
    [SEAL.0, &(content.len() as u64).to_le_bytes(), blake3::hash(content).as_bytes()].concat()
}

/// Gives each line of a journal the mark that fits to it.
fn mark_lines(bytes: &mut Vec<u8>) {
    let text = String::from_utf8_lossy(bytes).into_owned();
    let marked = |line: &str| match line.rsplit_once(' ') {
        Some((content, _)) if !content.starts_with("concordem") => {
            format!("{content} {}", &blake3::hash(content.as_bytes()).to_hex()[..16])
        }
        _ => line.to_owned(),
    };
    *bytes = text.split('\n').map(marked).collect::<Vec<_>>().join("\n").into_bytes();
}

/// Series of the unfinished run.
const SERIES: usize = 3;

fn run_header() -> RunHeader {
    RunHeader {
        scenario: SCENARIO.to_owned(),
        provenance: Vec::new(),
        series: Record::COLUMNS.iter().take(SERIES).map(|c| SeriesColumn::new(c.name, c.unit, c.description)).collect(),
        operators: Vec::new(),
        earlier: [("strain".to_owned(), vec![0.0, 1e-3])].into(),
    }
}

fn scenario(_: &Samples, bytes: &[u8]) {
    if let Err(error) = Scenario::parse("input.toml", &String::from_utf8_lossy(bytes)) {
        assert!(!error.problems.is_empty() && !error.to_string().is_empty());
    }
}

fn sweep(samples: &Samples, bytes: &[u8]) {
    if let Ok(sweep) = Sweep::read(&samples.file("sweep.toml", bytes)) {
        let _ = sweep.points();
    }
}

fn journal(samples: &Samples, bytes: &[u8]) {
    let _ = Journal::open(&samples.file("input-journal", bytes), FINGERPRINT, NUMBERS);
}

fn spheres(_: &Samples, bytes: &[u8]) {
    let _ = import(bytes, None);
}

fn surface(_: &Samples, bytes: &[u8]) {
    let _ = Mesh::from_stl(bytes, 1e-3);
}

fn pack(samples: &Samples, bytes: &[u8]) {
    let _ = sphere_pack::read(&samples.file("input-pack.h5", bytes));
}

fn result(samples: &Samples, bytes: &[u8]) {
    let path = samples.file("input-result.h5", bytes);
    let Ok(result) = ResultFile::open(&path) else { return };
    let _ = (csv::text(&result), result.operators(), result.events(), result.state_hash(), result.scenario());
    let _ = (result.provenance(), result.snapshot_times(), result.bounds());
    let laws = result.laws().unwrap_or_default();
    let tables = laws.iter().map(|law| format!("contacts/{law}"));
    for table in
        tables.chain(["particles", "VTKHDF", "VTKHDF/PointData", "samples/fabric", "events"].map(str::to_owned))
    {
        let _ = result.table(&table);
    }
    drop(result);
    let name = path.display().to_string();
    concordem(["info", &name]);
    concordem(["measure", &name]);
    let _ = checkpoint::read(&path);
}

fn read_checkpoint(samples: &Samples, bytes: &[u8]) {
    let _ = checkpoint::read(&samples.file("input-checkpoint.h5", bytes));
}

fn header(samples: &Samples, bytes: &[u8]) {
    samples.file("run.h5.parts/header.h5", bytes);
    let _ = RunFiles::resume(&samples.folder.join("run.h5"));
}

fn segment(samples: &Samples, bytes: &[u8]) {
    samples.file("run.h5.parts/segment-0000.h5", bytes);
    let _ = RunFiles::resume(&samples.folder.join("run.h5"));
}

fn motion(samples: &Samples, bytes: &[u8]) {
    samples.file("motion.npy", bytes);
    let Ok(assembly) = assemble(&samples.following, &samples.folder, &mut |_, _| ()) else { return };
    let Ok(mut simulation) = Simulation::new(assembly.state, assembly.model, assembly.schedule) else { return };
    while simulation.stopped().is_none() && simulation.advance().is_ok() {}
}

/// Restores a state with one changed column, as in a forged checkpoint; if it is accepted, the run takes two steps.
fn state(samples: &Samples, bytes: &[u8]) {
    let mut seed = [0; 8];
    seed.iter_mut().zip(bytes).for_each(|(seed, byte)| *seed = *byte);
    let mut random = Random::new(u64::from_le_bytes(seed), 1);
    let paths: Vec<&str> = samples.columns.iter().map(|(path, _)| path).collect();
    let changed = paths[random.below(paths.len())].to_owned();
    let mut columns = ColumnStore::default();
    for (path, column) in samples.columns.iter() {
        let column = if path == changed { forged(column, &mut random) } else { Some(column.clone()) };
        if let Some(column) = column {
            columns.insert(path, column).expect("paths differ");
        }
    }
    let Assembly { state, model, schedule, summary } = &samples.assembly;
    let (state, model) = (state.clone(), model.clone());
    let mut assembly = Assembly { state, model, schedule: schedule.clone(), summary: summary.clone() };
    if apply(&mut assembly, &mut columns, &samples.scenario, &[], false).is_err() {
        return;
    }
    let Ok(mut simulation) = Simulation::new(assembly.state, assembly.model, assembly.schedule) else { return };
    for _ in 0..2 {
        if simulation.stopped().is_some() || simulation.advance().is_err() {
            return;
        }
    }
}

/// A column with a changed number or a changed length; `None` removes the column.
fn forged(column: &StoredColumn, random: &mut Random) -> Option<StoredColumn> {
    fn change<T: Copy>(data: &mut Vec<T>, random: &mut Random, new: impl Fn(u64) -> T) {
        let border = [0, 1, 0xffff, u64::from(u32::MAX), u64::MAX, 0x7ff8_0000_0000_0000, 0x7fe0_0000_0000_0000];
        let number = new(border[random.below(border.len())]);
        match random.below(4) {
            0 => data.push(number),
            1 => data.truncate(random.below(data.len())),
            _ => {
                let at = random.below(data.len());
                if let Some(value) = data.get_mut(at) {
                    *value = number;
                }
            }
        }
    }
    if random.below(16) == 0 {
        return None;
    }
    let mut column = column.clone();
    match &mut column.data {
        ColumnData::F64(data) => change(data, random, f64::from_bits),
        ColumnData::U64(data) => change(data, random, |n| n),
        ColumnData::U32(data) => change(data, random, |n| n as u32),
        ColumnData::U16(data) => change(data, random, |n| n as u16),
        ColumnData::U8(data) => change(data, random, |n| n as u8),
        ColumnData::I8(data) => change(data, random, |n| n as i8),
    }
    Some(column)
}
