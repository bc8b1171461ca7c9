use super::*;

/// A tetrahedron of edges 1 along the axes.
const FACETS: [[[f64; 3]; 3]; 4] = {
    let (o, x, y, z) = (
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    );
    [[o, y, x], [o, x, z], [o, z, y], [x, y, z]]
};

fn facets_text(normal: &str) -> String {
    let vertex = |[x, y, z]: [f64; 3]| format!("   vertex {x} {y} {z}\n");
    let facet = |corners: [[f64; 3]; 3]| {
        let vertices: String = corners.map(vertex).concat();
        format!(" facet normal {normal}\n  outer loop\n{vertices}  endloop\n endfacet\n")
    };
    FACETS.map(facet).concat()
}

fn plain() -> String {
    format!("solid name\n{}endsolid name\n", facets_text("0 0 1"))
}

fn binary(header: &[u8], n_facets: u32) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(n_facets.to_le_bytes());
    for facet in FACETS {
        bytes.extend([0x7f_u8, 0xc0, 0, 0].repeat(3));
        for x in facet.as_flattened() {
            bytes.extend((*x as f32).to_le_bytes());
        }
        bytes.extend([1, 2]);
    }
    bytes
}

fn is_tetrahedron((vertices, triangles): &Soup) -> bool {
    let of_file = triangles.iter().flatten().map(|v| vertices[*v as usize]);
    let expected = FACETS.as_flattened().iter().map(|v| DVec3::from_array(*v));
    of_file.eq(expected)
}

#[test]
fn stl_text_is_read_however_it_is_spelled() {
    let plain = plain();
    let facets = facets_text("0 0 1");
    let with_begin = |begin: &str| plain.replacen("solid name", begin, 1);
    let with_end = |end: &str| plain.replace("endsolid name", end);
    let spelled = [
        plain.clone(),
        with_begin("solid"),
        with_begin("SOLID name"),
        plain.to_uppercase(),
        with_begin("\u{feff}solid name"),
        with_begin("  \n\t solid name"),
        with_begin("solid a facet of a vertex outer loop"),
        with_begin("solid facet"),
        with_begin("# exported\nsolid name"),
        with_begin("solid name\ncolor 0.5 0.5 0.5"),
        with_end("end solid name"),
        with_end("endsolidname"),
        with_end("endsolid"),
        with_end("EndSolid other"),
        with_end(""),
        plain
            .replace("endfacet", "end facet")
            .replace("endloop", "end loop"),
        plain.replace('\n', "\r\n"),
        plain.replace('\n', "\r"),
        plain.replace('\n', " "),
        plain.replace("   vertex ", "\tvertex\t\t"),
        facets,
        plain.replace("vertex 0 0 1", "vertex 0e0 -0.0 +1.0E+00"),
        format!("solid a\n{}endsolid a\n", facets_text("nan NaN -nan(ind)")),
        format!("solid a\n{}endsolid a\n", facets_text("1.#QNAN inf")),
        format!("solid a\n{}endsolid a\n", facets_text("")),
    ];
    for text in spelled {
        let soup = stl::parse(text.as_bytes()).unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert!(is_tetrahedron(&soup), "{text}");
    }
    // Latin-1, and what some systems call Unicode.
    let (begin, rest) = plain.split_at(6);
    let latin = [begin.as_bytes(), b"Schl\xfcssel ", rest.as_bytes()].concat();
    assert!(is_tetrahedron(&stl::parse(&latin).unwrap()));
    let wide = |to_bytes: fn(u16) -> [u8; 2]| {
        let marked = format!("\u{feff}{plain}");
        marked
            .encode_utf16()
            .flat_map(to_bytes)
            .collect::<Vec<u8>>()
    };
    for bytes in [wide(u16::to_le_bytes), wide(u16::to_be_bytes)] {
        assert!(is_tetrahedron(&stl::parse(&bytes).unwrap()));
    }
}

#[test]
fn all_solids_of_an_stl_file_are_read() {
    let text = format!("{}\n{}{}", plain(), plain().to_uppercase(), plain());
    assert_eq!(stl::parse(text.as_bytes()).unwrap().1.len(), 12);
    let one_line = text.replace('\n', " ");
    assert_eq!(stl::parse(one_line.as_bytes()).unwrap().1.len(), 12);
}

#[test]
fn binary_stl_is_known_by_its_length() {
    for header in [
        &b"binary"[..],
        b"solid",
        b"solid name\nfacet normal 0 0 1\n",
        b"\xff\xfesolid",
    ] {
        assert!(is_tetrahedron(&stl::parse(&binary(header, 4)).unwrap()));
    }
    // Bytes behind the last facet are some program's own.
    let mut longer = binary(b"binary", 4);
    longer.extend(b"more");
    assert!(is_tetrahedron(&stl::parse(&longer).unwrap()));
    assert_eq!(stl::parse(&binary(b"", 0)[..84]).unwrap().1.len(), 0);
    for header in [&b"binary"[..], b"solid name\n"] {
        let refusal = stl::parse(&binary(header, 5)).unwrap_err();
        assert!(refusal.contains("announces 5 triangles, which take 334 bytes, and has 284"));
    }
    let mut nan = binary(b"", 4);
    nan[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let refusal = stl::parse(&nan).unwrap_err();
    assert!(refusal.starts_with("triangle 2 has a corner"), "{refusal}");
}

#[test]
fn what_is_wrong_in_stl_text_is_told_with_its_line() {
    let plain = plain();
    let refused = |from: &str, to: &str| {
        let text = plain.replacen(from, to, 1);
        assert_ne!(text, plain);
        stl::parse(text.as_bytes()).unwrap_err()
    };
    for (from, to, told) in [
        (
            "vertex 0 0 0",
            "vertex 0 0",
            "line 4: a vertex needs three numbers",
        ),
        ("vertex 0 0 0", "vertex 0 0 q", "line 4: \"q\" is no number"),
        (
            "vertex 0 0 0",
            "vertex 0,5 0 0",
            "line 4: \"0,5\" is no number; write a decimal point",
        ),
        (
            "vertex 0 0 0",
            "vertex 0 0 inf",
            "line 4: a vertex is not finite",
        ),
        ("   vertex 0 0 0", "", "line 7: a facet with 2 corners"),
        (
            "  endloop",
            "vertex 5 5 5\n  endloop",
            "line 8: a facet with 4 corners",
        ),
        ("  outer loop", "", "line 4: a facet needs \"outer loop\""),
        (
            " facet normal 0 0 1\n  outer loop",
            "",
            "line 3: a vertex outside of a facet",
        ),
        (
            "  endloop",
            "  endlop",
            "line 7: \"endlop\" where \"vertex\" was expected",
        ),
    ] {
        let refusal = refused(from, to);
        assert!(refusal.starts_with(told), "{refusal}, not {told}");
    }
    let cut = plain.find("endloop").unwrap();
    let refusal = stl::parse(&plain.as_bytes()[..cut]).unwrap_err();
    assert!(refusal.contains("ends within a facet"), "{refusal}");
    let refusal = stl::parse(b"PK\x03\x04").unwrap_err();
    assert!(refusal.contains("is no STL file"), "{refusal}");
}

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

#[test]
fn obj_text_is_read_however_it_is_spelled() {
    let relative = OBJ
        .replace("f 1 3 2", "f -4 -2 -3")
        .replace("f 2 3 4", "f -3/1 -2//1 -1/2/3");
    let spelled = [
        OBJ.to_owned(),
        relative,
        OBJ.replace("f 1 2 4", "usemtl\nf 1 2 4"),
        OBJ.replace("f 1 2 4", "usemtl \nusemtl a b\no\ng\ns off\nf 1 2 4"),
        OBJ.replace("f 1 2 4", "l 1 2 3 4\np 1 2\nf 1 2 4"),
        OBJ.replace("f 1 2 4", "f 1 2 \\\n 4"),
        OBJ.replace("f 1 2 4", "f \\  \r\n1\\\n2\\\n4 # end"),
        OBJ.replace("v 1 0 0", "v 1 0 0 0.5 0.5 0.5"),
        OBJ.replace("v 1 0 0", "v 1.0e0 0 \\\n 0"),
        OBJ.replace("f 1 2 4", "# f 1 2 3 \\\nf 1 2 4"),
        OBJ.replace("f 1 2 4", "f 1 2\nf\nfo 1 2 4"),
        OBJ.replace('\n', "\r\n"),
        OBJ.replace('\n', "\r"),
        format!("\u{feff}mtllib my file.mtl\n{}", OBJ.trim_end()),
    ];
    for text in spelled {
        let soup = obj::parse(text.as_bytes()).unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert!(is_tetrahedron(&soup), "{text}\n{soup:?}");
    }
    let latin = [&b"o Schl\xfcssel\n"[..], OBJ.as_bytes()].concat();
    assert!(is_tetrahedron(&obj::parse(&latin).unwrap()));
}

#[test]
fn what_is_wrong_in_obj_text_is_told_with_its_line() {
    for (from, to, told) in [
        ("v 1 0 0", "v 1 0", "line 2: a vertex needs three numbers"),
        ("v 1 0 0", "v 1 0 x", "line 2: \"x\" is no number"),
        (
            "f 1 2 4",
            "f 1 2 5",
            "line 6: a face names vertex 5, the file has 4",
        ),
        ("f 1 2 4", "f 1 2 0", "line 6: a face names vertex 0"),
        ("f 1 2 4", "f 1 2 -5", "line 6: a face names vertex -5"),
        (
            "f 1 2 4",
            "f 1 2 99999999999",
            "line 6: a face names vertex 99999999999",
        ),
        ("f 1 2 4", "f 1 2 a", "line 6: \"a\" is no corner of a face"),
        (
            "v 1 0 0",
            "v 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3 4",
            "line 5: a polygon without area",
        ),
        (
            "v 1 0 0",
            "v 1 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 3 4 5",
            "line 6: a polygon that crosses or touches itself",
        ),
    ] {
        let refusal = obj::parse(OBJ.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert!(refusal.starts_with(told), "{refusal}, not {told}");
    }
    let refusal = obj::parse(b"v 0 0 0\nsurf 0 1 0 1 1\n").unwrap_err();
    assert!(refusal.contains("free-form surfaces"), "{refusal}");
}

/// Cut anywhere, or one byte another: an answer, never a panic and no hang.
#[test]
fn damaged_files_are_answered() {
    type Parse = fn(&[u8]) -> Result<Soup, String>;
    let concave =
        "v 0 0 0\nv 6 0 0\nv 6 1 0\nv 1 1 0\nv 1 6 0\nv 0 6 0\nf 6 5 4 3 2 1\nf -1 -2 \\\n -3\n";
    let files: [(Parse, Vec<u8>); 5] = [
        (stl::parse, plain().into_bytes()),
        (stl::parse, binary(b"solid x", 4)),
        (
            stl::parse,
            plain().encode_utf16().flat_map(u16::to_le_bytes).collect(),
        ),
        (obj::parse, OBJ.as_bytes().to_vec()),
        (obj::parse, concave.as_bytes().to_vec()),
    ];
    for (parse, bytes) in files {
        for length in 0..bytes.len() {
            let _ = parse(&bytes[..length]);
        }
        for at in 0..bytes.len() {
            for other in [
                0, b' ', b'\n', b'-', b'9', b'.', b'e', b'/', b'#', 0x7f, 0xff,
            ] {
                let mut damaged = bytes.clone();
                damaged[at] = other;
                if let Ok((vertices, triangles)) = parse(&damaged) {
                    let n = vertices.len() as u32;
                    assert!(triangles.as_flattened().iter().all(|v| *v < n));
                    assert!(vertices.iter().all(|v| v.is_finite()));
                }
            }
        }
    }
}
