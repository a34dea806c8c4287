//! Surfaces in STL format: every way in which they are written gives the same triangles, or is refused by its name.

use concordem_contact::math::Vec3;
use concordem_packing::read_stl;

/// A triangle in text; `shift` moves it along x.
fn facet(shift: f64) -> String {
    format!(
        "facet normal 0 0 1\n outer loop\n  vertex {shift} 0 0\n  vertex {} 0 0\n  vertex {shift} 1 0\n endloop\nendfacet\n",
        shift + 1.0
    )
}

/// The same triangles in binary form.
fn binary(header: &[u8], shifts: &[f32]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((shifts.len() as u32).to_le_bytes());
    for x in shifts {
        for value in [0.0, 0.0, 1.0, *x, 0.0, 0.0, x + 1.0, 0.0, 0.0, *x, 1.0, 0.0] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0xff, 0x7f]);
    }
    bytes
}

/// Corners of a triangle of [`facet`].
fn corners(shift: f64) -> [Vec3; 3] {
    [Vec3::new(shift, 0.0, 0.0), Vec3::new(shift + 1.0, 0.0, 0.0), Vec3::new(shift, 1.0, 0.0)]
}

fn read(bytes: &[u8]) -> Result<Vec<[Vec3; 3]>, String> {
    let surface = read_stl(bytes, 1.0).map_err(|error| error.to_string())?;
    let corner = |index: u32| surface.vertices[index as usize];
    Ok(surface.triangles.iter().map(|triangle| triangle.map(corner)).collect())
}

/// Every way in which programs write the same two triangles: in one solid or two, named or not, with other white space, case, and ends of
/// lines; binary with any header.
#[test]
fn all_spellings_give_the_same_triangles() {
    let (a, b) = (facet(0.0), facet(2.0));
    let one = format!("solid\n{a}{b}endsolid\n");
    let texts = [
        one.clone(),
        format!("solid part\n{a}{b}endsolid part\n"),
        format!("solid left\n{a}endsolid left\nsolid right\n{b}endsolid right\n"),
        format!("solid\n{a}endsolid\n\n\nsolid\n{b}endsolid"),
        format!("solid a\nendsolid a\nsolid b\n{a}{b}endsolid b\n"),
        format!("solid facet normal\n{a}{b}endsolid facet normal\n"),
        format!("solid Bauteil größe 5 µm\n{a}{b}endsolid Bauteil größe 5 µm\n"),
        format!("SOLID PART\n{}ENDSOLID PART\n", format!("{a}{b}").to_uppercase()),
        format!("\u{feff}solid part\n{a}{b}endsolid part\n"),
        format!("\n\n  solid part\n{a}{b}end solid part\n"),
        one.replace('\n', "\r\n"),
        one.replace('\n', "\r"),
        one.replace(' ', "\t"),
        one.replace(' ', "   "),
        one.replace("\n ", " ").replace("vertex", "\n\n   vertex"),
        one.replace("normal 0 0 1", "normal 0 0 0"),
        one.replace("normal 0 0 1", "normal nan nan nan"),
        one.replace(" 1 ", " 1.0000e+00 ").replace(" 2 ", " +2. "),
        one.replace(" 0 ", " -0.0 "),
    ];
    for text in &texts {
        assert_eq!(read(text.as_bytes()).unwrap(), [corners(0.0), corners(2.0)], "{text}");
    }
    let mut padded = binary(b"", &[0.0, 2.0]);
    padded.extend([0; 412]);
    for bytes in [
        binary(b"", &[0.0, 2.0]),
        binary(b"solid part", &[0.0, 2.0]),
        binary(b"Exported by a program, COLOR=\xff\x00\x00\xff", &[0.0, 2.0]),
        padded,
    ] {
        assert_eq!(read(&bytes).unwrap(), [corners(0.0), corners(2.0)]);
    }
}

/// Corners with equal coordinates are one, also −0 and 0; the unit scales them.
#[test]
fn equal_corners_are_welded() {
    let text = format!("solid\n{}{}endsolid\n", facet(0.0), facet(1.0).replace(" 0 0\n", " -0 0\n"));
    let surface = read_stl(text.as_bytes(), 1e-3).unwrap();
    assert_eq!(surface.triangles, [[0, 1, 2], [1, 3, 4]]);
    assert_eq!(surface.vertices[3], Vec3::new(2e-3, 0.0, 0.0));
}

/// What is not STL is named, and what is broken is placed.
#[test]
fn other_files_are_refused_by_their_name() {
    let a = facet(0.0);
    let whole = format!("solid\n{a}endsolid\n");
    let texts: &[(&str, &str)] = &[
        ("", "a text begins with `solid`"),
        ("nonsense", "a text begins with `solid`"),
        (
            "# made by hand\no part\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "it is an OBJ file, not STL; save the surface as STL",
        ),
        ("mtllib part.mtl\nv\t0 0 0\n", "an OBJ file"),
        ("ply\nformat ascii 1.0\n", "a PLY file"),
        ("OFF\n3 1 0\n", "an OFF file"),
        ("ISO-10303-21;\n", "a STEP file"),
        ("# vtk DataFile Version 3.0\n", "a VTK file"),
        ("<?xml version=\"1.0\"?>", "an XML or HTML file"),
        ("solid\nendsolid\n", "it has no triangles"),
        ("solid part\n", "line 2: the file ends before `endsolid`"),
        (&whole.replace("endsolid", ""), "the file ends before `endsolid`; it is cut off"),
        (&whole[..60], "it is cut off"),
        (&whole.replace("vertex 1 0 0", "vertex 1,5 0 0"), "line 5: \"1,5\" is not a number, such as 0.5 or 1e-3"),
        (&whole.replace("vertex 1 0 0", "vertex 1 0 nan"), "line 5: NaN is not finite"),
        (&whole.replace("vertex 1 0 0", "vertex 1e39 0 0"), "line 5: inf is not finite"),
        (&whole.replace(" endloop", "  vertex 9 9 9\n endloop"), "line 7: expected `endloop`, found \"vertex\""),
        (
            &whole.replace("facet normal", "color 1 0 0\nfacet normal"),
            "line 2: expected `facet` or `endsolid`, found \"color\"",
        ),
        (&format!("{whole}{a}"), "line 10: expected `solid`, found \"facet\""),
    ];
    for &(text, expected) in texts {
        let error = read(text.as_bytes()).expect_err(text);
        assert!(error.contains(expected), "{text}: {error}");
    }
    let two = binary(b"", &[0.0, 2.0]);
    let mut joined = two.clone();
    joined.extend(binary(b"", &[4.0]));
    let mut not_finite = two.clone();
    not_finite[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let binaries: [(&[u8], &str); 9] = [
        (&two[..two.len() - 1], "counts 2 triangles (184 bytes), but it has 183 bytes; it is cut off, or not STL"),
        (&two[..83], "at least 84 bytes"),
        (&joined[..], "a binary file holds one list of triangles: save all solids as one surface"),
        (&not_finite[..], "triangle 1 has the corners"),
        (b"\xff\xfes\0o\0l\0i\0d\0\n\0", "text in UTF-16"),
        (b"PK\x03\x04....", "a ZIP archive"),
        (b"\x1f\x8b....", "compressed by gzip"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
        (b"glTF\x02\0\0\0", "a glTF file"),
    ];
    for (bytes, expected) in binaries {
        let error = read(bytes).expect_err(expected);
        assert!(error.contains(expected), "{expected}: {error}");
    }
}
