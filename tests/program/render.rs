//! Pictures of results.

use std::path::{Path, PathBuf};

use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::{CELL, prism};

/// Two spheres in space, the right one of which flies away to the right over a floor.
const FLIGHT: &str = r#"
version = 1
[packing]
kind = "spheres"
spheres = [[0, 0, "1 mm", "1 mm"], ["4 mm", 0, "1.5 mm", "1.5 mm"]]
[[material]]
name = "glass"
density = 2500
hertz_mindlin = { young = "70 GPa", poisson = 0.22, restitution = 0.9 }
[contacts]
law = "hertz_mindlin"
[[wall]]
name = "floor"
shape = { kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }
material = "glass"
[[set]]
name = "right"
selection = { kind = "ids", ids = [1] }
[[initial]]
set = "right"
velocity = ["1 m/s", 0, 0]
[integration]
time_step = "1e-7 s"
[stop]
steps = 20_000
[output]
snapshot_interval = 5000
"#;

/// Colors of the ends of the scale of speeds.
const SLOW: [u8; 3] = [68, 1, 84];
const FAST: [u8; 3] = [253, 231, 37];

struct Picture {
    width: usize,
    images: Vec<Vec<[u8; 3]>>,
}

impl Picture {
    fn read(path: &Path) -> Self {
        let file = std::io::BufReader::new(std::fs::File::open(path).expect("a picture"));
        let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
        let (width, height) = (reader.info().width as usize, reader.info().height as usize);
        let count = reader.info().animation_control.map_or(1, |animation| animation.num_frames);
        let mut image = || {
            let mut bytes = vec![0; 3 * width * height];
            reader.next_frame(&mut bytes).expect("an image");
            bytes.as_chunks::<3>().0.to_vec()
        };
        Self { width, images: (0..count).map(|_| image()).collect() }
    }

    /// Mean column and number of the pixels whose color has about the hue of `color`, left of the key.
    fn of_color(&self, image: usize, color: [u8; 3]) -> (f64, usize) {
        let size = |c: [u8; 3]| c.iter().map(|part| f64::from(*part).powi(2)).sum::<f64>().sqrt();
        let is_alike = |pixel: &[u8; 3]| {
            let along: f64 = pixel.iter().zip(color).map(|(a, b)| f64::from(*a) * f64::from(b)).sum();
            along > 0.995 * size(*pixel) * size(color)
        };
        let columns =
            self.images[image].iter().enumerate().filter(|(_, pixel)| is_alike(pixel)).map(|(k, _)| k % self.width);
        let columns: Vec<usize> = columns.filter(|column| *column < self.width - 130).collect();
        (columns.iter().sum::<usize>() as f64 / columns.len() as f64, columns.len())
    }
}

fn run(folder: &Path, scenario: &str) -> PathBuf {
    let path = write(folder, "one.toml", scenario);
    let given = concordem(["run", "-q", text(&path)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    path.with_extension("h5")
}

/// Draws with these options; returns the picture, and what the command says.
fn drawn(result: &Path, options: &[&str]) -> (Picture, String) {
    let path = result.with_extension("png");
    let given = concordem([&["render", text(result), "--force"][..], options].concat());
    assert_eq!(given.code, exit::DONE, "{options:?}: {}", given.err);
    (Picture::read(&path), given.err)
}

fn refused(result: &Path, options: &[&str], reason: &str) {
    let given = concordem([&["render", text(result), "--force"][..], options].concat());
    assert_eq!(given.code, exit::USAGE, "{options:?}: {}", given.err);
    assert!(given.err.contains(reason), "{options:?}: {}", given.err);
}

/// Spheres are where the result says, as large as it says, in the colors of their speeds, at each of the times; a slice and a cut remove what they say.
#[test]
fn spheres_are_where_they_are() {
    let folder = TempDir::new().expect("a temporary folder");
    let result = run(folder.path(), FLIGHT);
    let (front, said) = drawn(&result, &["--view=-y", "--animate=3", "--show", "particles"]);
    assert_eq!((front.images.len(), said.as_str()), (3, ""));
    // From the left side of the left sphere at 0 to the right side of the right one at the end.
    let span = 1e-3 + 4e-3 + 2e-3 + 1.5e-3;
    let drawing = (front.width - 2 * 18) as f64;
    let [first, middle, last] = [0, 1, 2].map(|k| front.of_color(k, FAST).0);
    let scale = (last - first) / 2e-3;
    // The key takes the rest of the width. Columns are whole pixels, the middle of some thousand.
    assert!(scale * span < drawing && scale * span > drawing - 200.0, "{scale} {drawing}");
    assert!((middle - 0.5 * (first + last)).abs() < 0.5, "{first} {middle} {last}");
    let (still, slow) = front.of_color(0, SLOW);
    assert!(((first - still) / scale - 4e-3).abs() < 0.02e-3, "{still} {first} {scale}");
    let (_, fast) = front.of_color(0, FAST);
    // Radii 1 and 1.5; the rims mix with the paper.
    assert!((fast as f64 / slow as f64 - 2.25).abs() < 0.05, "{fast} {slow}");
    let area = std::f64::consts::PI * (1.5e-3 * scale).powi(2);
    assert!((fast as f64 / area - 1.0).abs() < 0.03, "{fast} {area}");
    // At z = 2.5 mm a slice meets the right sphere only, in a circle of half √5 mm.
    let (slice, _) = drawn(&result, &["--slice", "z=2.5 mm", "--range=0,1", "--show", "particles"]);
    let (_, fast) = slice.of_color(0, FAST);
    assert_eq!(slice.of_color(0, SLOW).1, 0);
    assert!(fast > 10_000, "{fast}");
    // A cut at x = 2 mm, seen from the right, removes the right sphere, which is there at the start.
    let (cut, _) =
        drawn(&result, &["--view", "x", "--cut", "x=2 mm", "--time", "0 s", "--range=0,1", "--show", "particles"]);
    assert_eq!(cut.of_color(0, FAST).1, 0);
    assert!(cut.of_color(0, SLOW).1 > 1000);
    // From above the floor is gray where no sphere is, from below it does not hide them.
    let gray = |picture: &Picture| picture.images[0].iter().filter(|pixel| **pixel == [225, 228, 230]).count();
    let (above, _) = drawn(&result, &["--view", "z"]);
    let (below, _) = drawn(&result, &["--view=-z"]);
    assert!(gray(&above) > 10_000 && gray(&below) == 0, "{} {}", gray(&above), gray(&below));
}

/// The colors of strains are those of the cell, which is stretched by `ε = L_zz t` along z and by half of it along x: all above half of the strain,
/// none above one and a half times of it. Two spheres in space have no strain.
#[test]
fn strains_are_those_of_the_cell() {
    let folder = TempDir::new().expect("a temporary folder");
    let loading = "[loading]\nkind = \"cell-strain\"\nvelocity_gradient = [[50, 0, 0], [0, 0, 0], [0, 0, 100]]\n\
                   [integration]\ntime_step = \"0.5 us\"\n[stop]\nsteps = 40\n";
    let result = run(folder.path(), &CELL.replace("[stop]\nsteps = 1\n", loading));
    for (name, strain) in
        [("strain-zz", 2e-3), ("strain-xx", 1e-3), ("principal-strain", 2e-3), ("volumetric-strain", 3e-3)]
    {
        for (low, high, all, none) in [(0.2, 0.5, FAST, SLOW), (1.5, 2.0, SLOW, FAST)] {
            let range = format!("--range={},{}", low * strain, high * strain);
            let (picture, _) = drawn(&result, &["--color", name, &range, "--show", "particles"]);
            // The key of a long name is wider than what is left out.
            let [all, none] = [all, none].map(|color| picture.of_color(0, color).1);
            assert!(all > 10_000 && none < all / 20, "{name}, {range}: {all} {none}");
        }
    }
    let other = TempDir::new().expect("a temporary folder");
    let flight = run(other.path(), FLIGHT);
    refused(&flight, &["--color", "principal-strain"], "no particle has neighbors on all sides");
    refused(&flight, &["--color", "strain"], "strain-xx");
}

/// Equal bytes for any number of threads and any second time.
#[test]
fn pictures_do_not_depend_on_threads() {
    let folder = TempDir::new().expect("a temporary folder");
    let result = prism(folder.path(), 200);
    assert_eq!(concordem(["run", "-q", text(&result)]).code, exit::DONE);
    let result = result.with_extension("h5");
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| drawn(&result, &["--show", "particles,cracks"]));
        std::fs::read(result.with_extension("png")).expect("a picture")
    };
    assert_eq!(bytes(1), bytes(3));
}

/// Bonds and cracks have the colors of the key and show through a pale body; stresses give colors at the end only.
#[test]
fn bonds_cracks_and_stresses_are_drawn() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 700);
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let result = scenario.with_extension("h5");
    let blue = [0, 114, 178];
    let (cracks, _) = drawn(&result, &["--show", "particles,cracks"]);
    assert!(cracks.of_color(0, blue).1 > 1000, "{}", cracks.of_color(0, blue).1);
    let (before, _) = drawn(&result, &["--show", "particles,cracks", "--time", "0 s"]);
    assert_eq!(before.of_color(0, blue).1, 0, "nothing has broken at the start");
    for options in [
        &["--show", "bonds"][..],
        &["--show", "bonds", "--color", "normal-force", "--slice", "y"],
        &["--color", "stress-zz"],
        &["--magnify", "100", "--color", "displacement-z"],
        &["--color", "fragment"],
        &["--color", "material"],
    ] {
        drawn(&result, options);
    }
    refused(&result, &["--color", "stress-zz", "--time", "0 s"], "forces of the end only");
    refused(&result, &["--color", "nothing"], "there are: speed, diameter");
    refused(&result, &["--show", "bonds", "--color", "speed"], "normal-force");
    refused(&result, &["--show", "walls"], "show one of them");
    refused(&result, &["--show", "cracks", "--magnify", "3"], "before it deforms");
    refused(&result, &["--slice", "y", "--view", "x"], "slice");
    refused(&result, &["--view", "x", "--cut", "y"], "from its edge");
    refused(&result, &["--time", "1 s"], "outside of the snapshots");
    refused(&result, &["--range=2,1"], "smaller one first");
    refused(&result, &["--size", "120"], "no room");
    refused(&result, &["-o", text(&folder.path().join("one.jpg"))], ".png");
    let given = concordem(["render", text(&result)]);
    assert_eq!((given.code, given.err.contains("--force")), (exit::FILE, true), "{}", given.err);
}

/// A cell has its edges, and bonds through its faces; a run without bonds has none to draw.
#[test]
fn cells_have_their_edges() {
    let folder = TempDir::new().expect("a temporary folder");
    let result = run(folder.path(), CELL);
    let ink = |picture: &Picture| picture.images[0].iter().filter(|pixel| **pixel == [40, 48, 56]).count();
    let (with, _) = drawn(&result, &["--color", "diameter"]);
    let (without, _) = drawn(&result, &["--color", "diameter", "--show", "particles"]);
    assert!(ink(&with) > ink(&without) + 500, "{} {}", ink(&with), ink(&without));
    drawn(&result, &["--show", "bonds,cell"]);
    let other = TempDir::new().expect("a temporary folder");
    let loose = run(other.path(), FLIGHT);
    refused(&loose, &["--show", "bonds"], "no [bonds]");
}
