//! Series of VTU files as tables: files that VTK, meshio and PyEVTK wrote, and files that nobody should have.

use std::path::Path;
use std::process::Command;

use coldplate::Table;
use coldplate_base::vtu::Vtu;

use super::{folder, json, output, root, said};

/// The temperature (K) that `scripts/vtu-samples` puts into its plate.
fn plate(flow: f64, heat: f64, [x, y, z]: [f64; 3]) -> f64 {
    293.15 + heat / (70.0 * flow) * (1.0 + x) + 0.4 * heat * z - y
}

const UNITS: [&str; 4] = ["--unit", "T=K", "--unit", "u=m"];

/// The output columns of an import in `folder`.
fn imported(folder: &Path, arguments: &[&str]) -> Table {
    json(folder, &[&["import"], arguments, &["--out", "out.csv"]].concat());
    Table::read(folder.join("out.csv")).unwrap()
}

#[test]
fn every_form_that_vtk_writes_is_read_alike() {
    let folder = folder("vtu-forms");
    let mut answers = Vec::new();
    for name in ["ascii", "inline", "inline_zlib", "appended_text", "appended_text_zlib", "appended_raw", "appended_raw_zlib"] {
        std::fs::copy(root().join(format!("tests/program/solvers/vtu/{name}.vtu")), folder.join("at_2.vtu")).unwrap();
        let points = ["inside=T @ 110 mm, 0.03 m, 8 cm", "corner=T@point 35", "tool z=u.z @ 0.3 m, 0.2 m, 0.1 m", "part=part @ cell 7"];
        let points: Vec<&str> = points.iter().flat_map(|point| ["--point", *point]).collect();
        let asked =
            [&["at_2.vtu", "--names", "at_{{coolant_flow:L/min}}.vtu", "--unit", "part=1", "--unit", "tool z=um"], &points[..], &UNITS];
        let table = imported(&folder, &asked.concat());
        let value = |name: &str| table.column(name).unwrap().values[0];
        assert!((value("inside") - plate(2.0, 100.0, [0.11, 0.03, 0.08])).abs() < 1e-9, "{name}: {}", value("inside"));
        assert!((value("corner") - plate(2.0, 100.0, [0.3, 0.2, 0.1])).abs() < 1e-9, "{name}");
        let rise = plate(2.0, 100.0, [0.3, 0.2, 0.1]) - 293.15;
        assert!((value("tool z") - 1e6 * 1e-5 * rise * 0.1).abs() < 1e-5, "{name}: {}", value("tool z"));
        assert_eq!((value("part"), value("coolant_flow"), table.inputs), (7.0, 2.0, 1), "{name}");
        answers.push(table.columns);
    }
    // In text VTK writes as many digits as bring every number back.
    assert!(answers.windows(2).all(|pair| pair[0] == pair[1]));
    let refused = output(
        &folder,
        &["import", root().join("tests/program/solvers/vtu/lz4.vtu").to_str().unwrap(), "--out", "x.csv", "--names", "{{a:W}}.vtu"],
    );
    assert!(said(&refused).contains("--point"), "{}", said(&refused));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_study_becomes_a_table_that_is_fitted() {
    let folder = folder("vtu-study");
    let study = root().join("examples/solvers/studies/vtu");
    let places = [[0.25, 0.1, 0.1], [0.0, 0.0, 0.02]];
    let asked = [
        &[study.to_str().unwrap(), "--names", "plate_{{coolant_flow:L/min}}_{{heat:W}}.vtu"][..],
        &["--point", "top=T @ 250 mm, 100 mm, 100 mm", "--point", "low=T @ 0 m, 0 m, 2 cm", "--unit", "T=K", "--unit", "top=degC"],
    ];
    let named = imported(&folder, &asked.concat());
    assert_eq!((named.rows(), named.inputs), (9, 2));
    for row in 0..9 {
        let at = |name: &str| named.column(name).unwrap().values[row];
        let expected = places.map(|place| plate(at("coolant_flow"), at("heat"), place));
        assert!((at("top") + 273.15 - expected[0]).abs() < 1e-9 && (at("low") - expected[1]).abs() < 1e-9, "row {row}");
        assert_eq!(named.text("file").unwrap().values[row], format!("plate_{}_{}.vtu", at("coolant_flow"), at("heat")));
    }
    // The same with the conditions in a table of another order, and coordinates in mm.
    let rows: Vec<usize> = (0..9).rev().collect();
    let line = |row: &usize| {
        let at = |name: &str| named.column(name).unwrap().values[*row];
        format!("plate_{0}_{1}.vtu,{1},{0}\n", at("coolant_flow"), at("heat"))
    };
    std::fs::write(
        folder.join("conditions.csv"),
        format!("file,heat [W],coolant_flow [L/min]\n{}", rows.iter().map(line).collect::<String>()),
    )
    .unwrap();
    let asked = [
        study.to_str().unwrap(),
        "--conditions",
        "conditions.csv",
        "--point",
        "top=T @ 0.25 mm, 0.1 mm, 0.1 mm",
        "--unit",
        "T=K",
        "--length",
        "mm",
    ];
    let listed = imported(&folder, &[&asked[..], &["--unit", "top=degC"]].concat());
    let reversed = |table: &Table, name: &str| table.column(name).unwrap().values.iter().rev().copied().collect::<Vec<f64>>();
    assert_eq!(reversed(&listed, "top"), named.column("top").unwrap().values);
    let fitted = json(&folder, &["fit", "out.csv", "--out", "plate.cps"]);
    assert_eq!(fitted["points"].as_array().unwrap().len(), 1, "{fitted}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A tetrahedron and a wedge with a field that is linear, as each of the tools writes it.
const TOOLS: &str = r#"
import numpy as np, meshio
from pyevtk.hl import unstructuredGridToVTK
from pyevtk.vtk import VtkTetra, VtkWedge
points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [0.5, 0.5, -1.0]])
T = 300 + 10 * points[:, 0] - 4 * points[:, 1] + 7 * points[:, 2]
cells = [("tetra", [[0, 1, 2, 6]]), ("wedge", [[0, 1, 2, 3, 4, 5]])]
mesh = meshio.Mesh(points, cells, point_data={"T": T}, cell_data={"part": [np.array([4]), np.array([5])]})
meshio.write("meshio_1.vtu", mesh)
meshio.write("meshio_2.vtu", mesh, compression=None)
meshio.write("meshio_3.vtu", mesh, binary=False)
x, y, z = (np.ascontiguousarray(points[:, i]) for i in range(3))
unstructuredGridToVTK("evtk_4", x, y, z, connectivity=np.array([0, 1, 2, 6, 0, 1, 2, 3, 4, 5]), offsets=np.array([4, 10]),
    cell_types=np.array([VtkTetra.tid, VtkWedge.tid], dtype=np.uint8), pointData={"T": T}, cellData={"part": np.array([4.0, 5.0])})
"#;

#[test]
fn files_of_other_tools_are_read() {
    let Some(python) = crate::common::python("meshio, pyevtk") else {
        println!("skipped: meshio and PyEVTK are not here (scripts/clients installs them)");
        return;
    };
    let folder = folder("vtu-tools");
    let ran = Command::new(python).args(["-c", TOOLS]).current_dir(&folder).output().unwrap();
    assert!(ran.status.success(), "{}", said(&ran));
    for name in ["meshio_1", "meshio_2", "meshio_3", "evtk_4"] {
        let file = format!("{name}.vtu");
        let pattern = format!("{}_{{{{x:W}}}}.vtu", name.split_once('_').unwrap().0);
        let points =
            ["--point", "a=T @ 0.3 m, 0.2 m, 0.7 m", "--point", "b=part @ 0.4 m, 0.4 m, -0.4 m", "--point", "c=part @ 0.1 m, 0.1 m, 0.9 m"];
        let table = imported(&folder, &[&[&file, "--names", &pattern, "--unit", "T=K", "--unit", "part=1"], &points[..]].concat());
        let value = |name: &str| table.column(name).unwrap().values[0];
        assert!((value("a") - (300.0 + 3.0 - 0.8 + 4.9)).abs() < 1e-9, "{name}: {}", value("a"));
        assert_eq!((value("b"), value("c")), (4.0, 5.0), "{name}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A small file by hand, with one of its words replaced.
fn by_hand(from: &str, to: &str) -> Vec<u8> {
    let text = "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n\
         <Piece NumberOfPoints=\"3\" NumberOfCells=\"1\">\n<PointData><DataArray type=\"Float64\" Name=\"T\" format=\"ascii\">300 301 302</DataArray></PointData>\n\
         <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray></Points>\n\
         <Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray>\n\
         <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3</DataArray>\n<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">5</DataArray></Cells>\n\
         </Piece></UnstructuredGrid></VTKFile>\n";
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1).into_bytes()
}

#[test]
fn damaged_and_hostile_files_are_refused_with_their_name() {
    let folder = folder("vtu-hostile");
    let vtk = |name: &str| std::fs::read(root().join(format!("tests/program/solvers/vtu/{name}.vtu"))).unwrap();
    // Sizes of an array in its header, where the appended bytes begin.
    let sized = |name: &str, at: usize, value: u8| {
        let mut bytes = vtk(name);
        let start = bytes.windows(14).position(|w| w == b"<AppendedData ").unwrap();
        let start = start + bytes[start..].iter().position(|b| *b == b'_').unwrap() + 1;
        bytes[start + at] = value;
        bytes
    };
    let half = |name: &str| vtk(name)[..vtk(name).len() / 2].to_vec();
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("empty", Vec::new(), "no VTK file in XML"),
        ("no XML", b"file,T [K]\nx,1\n".to_vec(), "no VTK file in XML"),
        ("bytes", (0..=255).cycle().take(5000).collect(), "no VTK file in XML"),
        ("HTML", b"<html><body>sorry</body></html>".to_vec(), "no VTK file in XML"),
        ("legacy", b"# vtk DataFile Version 3.0\nplate\nASCII\nDATASET UNSTRUCTURED_GRID\n".to_vec(), "no VTK file in XML"),
        ("image", by_hand("\"UnstructuredGrid\"", "\"ImageData\""), "no unstructured grid"),
        ("list of pieces", by_hand("\"UnstructuredGrid\"", "\"PUnstructuredGrid\""), "name the .vtu files"),
        ("cut text", half("ascii"), "ends in the middle"),
        ("cut tag", half("appended_raw")[..600].to_vec(), "this is no XML"),
        ("cut bytes", vtk("appended_raw")[..2800].to_vec(), "ends before this array does"),
        ("cut base64", vtk("appended_text_zlib")[..2600].to_vec(), "ends in the middle of its appended data"),
        ("crossed tags", by_hand("</PointData>", "</CellData>"), "this is no XML"),
        ("compressed by LZ4", vtk("lz4"), "vtkLZ4DataCompressor"),
        ("long array", sized("appended_raw", 7, 0x7f), "ends before this array does"),
        ("many blocks", sized("appended_raw_zlib", 0, 0x7f), "ends before this array does"),
        ("bad block", sized("appended_raw_zlib", 60, 0x55), "cannot be unpacked"),
        ("too few", by_hand("300 301 302", "300 301"), "has 2 numbers, and its mesh asks for 3"),
        ("too many", by_hand("300 301 302", "300 301 302 303"), "has more numbers, and its mesh asks for 3"),
        ("words", by_hand("300 301 302", "300 warm 302"), "no number can be read here"),
        ("not finite", by_hand("300 301 302", "nan nan nan"), "not finite"),
        ("huge mesh", by_hand("NumberOfPoints=\"3\"", "NumberOfPoints=\"99999999999999\""), "more than 4 GiB"),
        ("huger mesh", by_hand("NumberOfPoints=\"3\"", "NumberOfPoints=\"99999999999999999999999\""), "no whole number"),
        ("large mesh", by_hand("NumberOfPoints=\"3\"", "NumberOfPoints=\"100000000\""), "its mesh asks for"),
        ("negative", by_hand("NumberOfCells=\"1\"", "NumberOfCells=\"-1\""), "no whole number"),
        ("no count", by_hand("NumberOfCells=\"1\"", ""), "NumberOfCells"),
        (
            "many components",
            by_hand("NumberOfComponents=\"3\"", "NumberOfComponents=\"4000000000\""),
            "coordinates of the points are missing",
        ),
        ("corner", by_hand(">0 1 2<", ">0 1 7<"), "a corner that is no point"),
        ("half a corner", by_hand(">0 1 2<", ">0 1 1.5<"), "a corner that is no point"),
        ("endless cell", by_hand(">3<", ">3e9<"), "more than 4 GiB"),
        ("entities", by_hand("<UnstructuredGrid>", "<!DOCTYPE a [<!ENTITY b \"cc\">]><UnstructuredGrid>&b;"), ""),
        ("deep", by_hand("<UnstructuredGrid>", &format!("{}<UnstructuredGrid>", "<a>".repeat(200_000))), "this is no XML"),
        ("inline header", by_hand("format=\"ascii\">300 301 302", "format=\"binary\">/////w=="), "ends before this array does"),
        ("no base64", by_hand("format=\"ascii\">300 301 302", "format=\"binary\">300 301 302"), "no base64"),
        (
            "nothing appended",
            by_hand("format=\"ascii\">300 301 302", "format=\"appended\" offset=\"18446744073709551615\">"),
            "ends before this array does",
        ),
        ("texts", by_hand("type=\"Float64\" Name=\"T\"", "type=\"String\" Name=\"T\""), "no field 'T'"),
    ];
    for (name, bytes, words) in cases {
        std::fs::write(folder.join("at_1.vtu"), bytes).unwrap();
        let place = if name == "no base64" || !matches!(name, "entities") { "T @ 0.3 m, 0.3 m, 0 m" } else { "T @ point 0" };
        let ran = output(
            &folder,
            &["import", "at_1.vtu", "--names", "at_{{x:W}}.vtu", "--point", &format!("a={place}"), "--unit", "T=K", "--out", "x.csv"],
        );
        if words.is_empty() {
            // An entity that nothing asks for is left alone, and expanded nowhere.
            assert!(matches!(ran.status.code(), Some(0 | 2)), "{name}: {}", said(&ran));
            let _ = std::fs::remove_file(folder.join("x.csv"));
            continue;
        }
        assert_eq!(ran.status.code(), Some(2), "{name}: {}", said(&ran));
        assert!(said(&ran).contains(words) && said(&ran).contains("at_1.vtu"), "{name}: {}", said(&ran));
        assert!(said(&ran).len() < 1500 && !folder.join("x.csv").exists(), "{name}: {}", said(&ran));
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Files with bytes changed here and there, or cut: read or refused, and never more than that.
#[test]
fn changed_bytes_end_in_an_answer_or_an_error() {
    // A linear congruential generator: the same files in every run.
    let mut state = 1_u64;
    let mut next = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let (mut whole, mut refused) = (0, 0);
    for entry in std::fs::read_dir(root().join("tests/program/solvers/vtu")).unwrap() {
        let sound = std::fs::read(entry.unwrap().path()).unwrap();
        for _ in 0..400 {
            let mut bytes = sound.clone();
            for _ in 0..=next(4) {
                let at = next(bytes.len());
                bytes[at] = if next(2) == 0 { next(256) as u8 } else { b"0123456789-.eE<>\"=_ /"[next(21)] };
            }
            if next(8) == 0 {
                bytes.truncate(next(sound.len()));
            }
            let Ok(grid) = Vtu::from_bytes(bytes, Path::new("t.vtu")) else {
                refused += 1;
                continue;
            };
            let fields = grid.fields().into_iter().map(|name| grid.field(name, None).is_ok()).collect::<Vec<_>>();
            let place = match (grid.coordinates(), grid.mesh()) {
                (Ok(points), Ok(cells)) => cells.place(&points, [0.11, 0.03, 0.08]),
                _ => None,
            };
            whole += usize::from(place.is_some() && fields.iter().all(|is_read| *is_read));
        }
    }
    assert!(whole > 100 && refused > 100, "{whole} read, {refused} refused");
}

#[test]
fn what_is_asked_wrongly_is_told() {
    let folder = folder("vtu-asked");
    let study = root().join("examples/solvers/studies/vtu");
    let study = study.to_str().unwrap();
    std::fs::write(folder.join("short.csv"), "file,heat [W]\nplate_2_50.vtu,50\n").unwrap();
    std::fs::write(folder.join("other.csv"), "file,heat [W]\nplate_2_51.vtu,50\n").unwrap();
    std::fs::write(folder.join("nameless.csv"), "heat [W]\n50\n").unwrap();
    std::fs::create_dir(folder.join("nothing")).unwrap();
    let names = "plate_{{coolant_flow:L/min}}_{{heat:W}}.vtu";
    let point = "a=T @ 0.1 m, 0.1 m, 0.1 m";
    let cases: [(&[&str], &str); 19] = [
        (&[study, "--names", names], "no measurement point"),
        (&[study, "--point", point], "where the conditions of the files stand is not said"),
        (&[study, "--names", names, "--point", point], "--unit \"T=degC\""),
        (&[study, "--names", "rig_{{heat:W}}.vtu", "--point", point, "--unit", "T=K"], "do not stand in the name"),
        (&[study, "--names", "plate_{{heat}}.vtu", "--point", point, "--unit", "T=K"], "has no unit"),
        (&[study, "--names", "plate.vtu", "--point", point, "--unit", "T=K"], "no condition stands in this name"),
        (&[study, "--names", names, "--point", "a=t @ point 0", "--unit", "t=K"], "fields here: T, u"),
        (&[study, "--names", names, "--point", "a=u @ point 0", "--unit", "u=m"], "3 components"),
        (&[study, "--names", names, "--point", "a=u.7 @ point 0", "--unit", "u=m"], "no such component"),
        (&[study, "--names", names, "--point", "a=T @ point 36", "--unit", "T=K"], "36 values"),
        (&[study, "--names", names, "--point", "a=T @ cell 1", "--unit", "T=K"], "no field 'T' in the cells"),
        (&[study, "--names", names, "--point", "a=T @ 100, 20, 5", "--unit", "T=K"], "a bare number"),
        (&[study, "--names", names, "--point", "a=T @ 100 mm, 20 mm", "--unit", "T=K"], "NAME=FIELD @"),
        (&[study, "--names", names, "--point", "a=T @ 5 m, 0 m, 0 m", "--unit", "T=K"], "in no cell, and 4700.000 mm"),
        (&[study, "--names", names, "--point", point, "--unit", "T=K", "--unit", "p=bar"], "neither a field that is read nor a point"),
        (&[study, "--conditions", "short.csv", "--point", point, "--unit", "T=K"], "a file has no condition"),
        (&[study, "--conditions", "other.csv", "--point", point, "--unit", "T=K"], "did you mean 'plate_2_50.vtu'"),
        (&[study, "--conditions", "nameless.csv", "--point", point, "--unit", "T=K"], "there is no column 'file'"),
        (&["nothing", "--names", names, "--point", point, "--unit", "T=K"], "no .vtu file is in this folder"),
    ];
    for (arguments, words) in cases {
        let ran = output(&folder, &[&["import"], arguments, &["--out", "x.csv"]].concat());
        assert_eq!(ran.status.code(), Some(2), "{arguments:?}: {}", said(&ran));
        assert!(said(&ran).contains(words), "{arguments:?}: {}", said(&ran));
    }
    assert!(!folder.join("x.csv").exists());
    std::fs::remove_dir_all(&folder).unwrap();
}
