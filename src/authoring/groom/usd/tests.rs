//! Small stages as text: bases, attributes, transforms, and everything that can be wrong.

use super::*;
use crate::authoring::groom::{GroomCache, GroomError, GroomFormat, GroomSettings, UpAxis};
use bevy::prelude::*;
use openusd::{usda, usdc, usdz};
use std::io::Cursor;

/// Two strands of four points along Y, from x = 0 and x = 1, with more properties.
fn hair(more: &str) -> String {
    format!(
        "def BasisCurves \"Hair\"\n{{\n    int[] curveVertexCounts = [4, 4]\n    \
         point3f[] points = [(0, 0, 0), (0, 1, 0), (0, 2, 0), (0, 3, 0), \
         (1, 0, 0), (1, 1, 0), (1, 2, 0), (1, 3, 0)]\n{more}\n}}\n"
    )
}

const LINEAR: &str = "uniform token type = \"linear\"\n";

fn file(body: &str) -> Vec<u8> {
    format!("#usda 1.0\n{body}").into_bytes()
}

fn read_text(body: &str) -> (Groom, GroomLosses) {
    read(&file(body)).unwrap_or_else(|error| panic!("{error}\n{body}"))
}

fn wrong_text(body: &str) -> String {
    read(&file(body)).expect_err(body).to_string()
}

/// The same stage as a binary file.
fn binary(text: &[u8]) -> Vec<u8> {
    let data = usda::parse(str::from_utf8(text).unwrap()).unwrap();
    let mut file = Cursor::new(Vec::new());
    usdc::CrateWriter::write(&data, &mut file).unwrap();
    file.into_inner()
}

fn package(layers: &[(&str, &[u8])]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut archive = usdz::ArchiveWriter::new(&mut file);
    for (name, bytes) in layers {
        archive.add_layer(name, bytes).unwrap();
    }
    archive.finish().unwrap();
    file.into_inner()
}

fn places(loss: &crate::authoring::groom::GroomLoss) -> Vec<String> {
    loss.places.iter().map(ToString::to_string).collect()
}

#[test]
fn each_basis_becomes_nodes() {
    let ys = |properties: &str| -> Vec<f32> {
        let (groom, losses) = read_text(&hair(properties));
        assert_eq!(groom.len(), 2, "{losses}");
        groom.strands().next().unwrap().points.iter().map(|p| p.y).collect()
    };
    let basis = |basis: &str, wrap: &str| {
        format!("uniform token basis = \"{basis}\"\nuniform token wrap = \"{wrap}\"\n")
    };
    let whole = [0.0, 1.0, 2.0, 3.0];
    assert_eq!(ys(LINEAR), whole);
    for wrap in ["nonperiodic", "pinned", "periodic"] {
        assert_eq!(ys(&basis("catmullRom", wrap)), whole);
        // Handles at thirds of a line: on it evenly.
        for (y, expected) in ys(&basis("bezier", wrap)).into_iter().zip(whole) {
            assert!((y - expected).abs() < 1e-6);
        }
    }
    // What is not written is a Bezier curve.
    assert_eq!(ys("").len(), 4);
    // A B-spline ends before its points, unless it is pinned.
    let open = ys(&basis("bspline", "nonperiodic"));
    assert!((open[0] - 1.0).abs() < 1e-6 && (open[3] - 2.0).abs() < 1e-6, "{open:?}");
    let pinned = ys(&basis("bspline", "pinned"));
    assert!((pinned[0], pinned[3]) == (0.0, 3.0) && pinned[1] > 0.9, "{pinned:?}");
    let (_, losses) = read_text(&hair(&basis("catmullRom", "periodic")));
    assert_eq!(losses.opened_loops.count, 2);
    let error = wrong_text(&hair(&basis("hermite", "pinned")));
    assert!(
        error.starts_with("the type of /Hair: found cubic hermite, expected linear"),
        "{error}"
    );
}

#[test]
fn particle_hair_of_blender_is_joined() {
    let body = hair("uniform token basis = \"bspline\"\n");
    let blender = format!("(\n    doc = \"Blender v4.2.23 LTS\"\n)\n{body}");
    assert_eq!(read_text(&blender).0.points()[0], Vec3::ZERO);
    assert!(read_text(&body).0.points()[0].distance(Vec3::Y) < 1e-6);
}

#[test]
fn nurbs_have_orders_knots_and_weights() {
    // A quarter of a circle.
    let body = |more: &str| {
        format!(
            "def NurbsCurves \"Hair\"\n{{\n int[] curveVertexCounts = [3]\n int[] order = [3]\n \
             point3f[] points = [(1, 0, 0), (1, 1, 0), (0, 1, 0)]\n{more}}}\n"
        )
    };
    let weights = "double[] pointWeights = [1, 0.70710678118, 1]\n";
    let knots = "double[] knots = [0, 0, 0, 1, 1, 1]\n";
    for more in [weights.to_owned(), format!("{weights}{knots}")] {
        let (groom, losses) = read_text(&body(&more));
        assert!(groom.points().iter().all(|p| (p.length() - 1.0).abs() < 1e-6));
        assert!(losses.is_empty(), "{losses}");
    }
    let (groom, losses) = read_text(&body("double[] knots = [0, 1]\n"));
    assert_eq!((groom.points()[0], losses.broken_arrays.count), (Vec3::X, 1));
}

#[test]
fn hermite_curves_pass_through_their_points() {
    let body = hair("vector3f[] tangents = []\n").replace("BasisCurves", "HermiteCurves");
    assert_eq!(read_text(&body).0.points()[1], Vec3::Y);
}

#[test]
fn widths_have_four_scopes() {
    let widths = |basis: &str, widths: &str| -> Vec<f32> {
        let (groom, losses) = read_text(&hair(&format!("{basis}float[] {widths}\n")));
        assert!(losses.is_empty(), "{losses}");
        groom.strands().flat_map(|strand| strand.widths.unwrap().to_vec()).collect()
    };
    let cubic = |basis: &str| format!("uniform token basis = \"{basis}\"\n");
    assert_eq!(widths(LINEAR, "widths = [2] (interpolation = \"constant\")"), [2.0; 8]);
    let each = widths(LINEAR, "widths = [2, 3] (interpolation = \"uniform\")");
    assert_eq!(each, [2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0]);
    let all = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
    assert_eq!(widths(LINEAR, "widths = [1, 2, 3, 4, 5, 6, 7, 8]"), all);
    let anchors = widths(&cubic("bezier"), "widths = [3, 0, 0, 6] (interpolation = \"varying\")");
    assert_eq!(anchors, [3.0, 2.0, 1.0, 0.0, 0.0, 2.0, 4.0, 6.0]);
    let indexed = "primvars:widths = [5, 7]\nint[] primvars:widths:indices = [1, 0]";
    assert_eq!(widths(LINEAR, indexed), [7.0, 7.0, 7.0, 7.0, 5.0, 5.0, 5.0, 5.0]);
    // One a segment's end, of which a cubic curve of four points has two.
    let varying = widths(&cubic("bspline"), "widths = [1, 2, 3, 4] (interpolation = \"varying\")");
    assert_eq!(varying, [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0]);
    // What Unreal Engine names goes first.
    assert_eq!(widths(LINEAR, "primvars:groom_width = [9]\nfloat[] widths = [2]"), [9.0; 8]);
    for broken in
        ["widths = [1, 2, 3]", "primvars:widths = [1]\nint[] primvars:widths:indices = [4]"]
    {
        let (groom, losses) = read_text(&hair(&format!("{LINEAR}float[] {broken}\n")));
        assert!(losses.broken_arrays.count == 1 && losses.is_broken(), "{losses}");
        assert!(groom.strands().all(|strand| strand.widths.is_none()));
    }
}

#[test]
fn other_numbers_of_strands() {
    let body = hair(&format!(
        "{LINEAR}texCoord2f[] primvars:surface_uv_coordinate = [(0.25, 0.25), (0.5, 0)]\n\
         color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = \"uniform\")\n\
         int[] primvars:groom_guide = [1, 0]\nint[] primvars:groom_group_id = [3, 4]\n\
         string[] primvars:groom_group_name = [\"top\", \"side\"]\n\
         float[] primvars:groom_stiffness = [0.5, 2]\nint[] primvars:groom_id = [1, 2]\n\
         normal3f[] normals = [(0, 0, 1)]\n"
    ));
    let (groom, losses) = read_text(&body);
    let strands: Vec<_> = groom.strands().collect();
    assert_eq!(strands[0].uv, Some(Vec2::new(0.25, 0.75)));
    assert_eq!(strands[1].colors.unwrap()[3], LinearRgba::rgb(0.0, 1.0, 0.0));
    assert!(strands[0].is_guide && !strands[1].is_guide);
    let group = strands[1].group.unwrap();
    assert_eq!((group.id, group.name.as_str(), group.path.as_str()), (4, "side", "/Hair"));
    assert_eq!(strands[1].stiffness, Some(2.0));
    let unread = places(&losses.unread_arrays);
    assert!(unread.len() == 2 && unread.iter().any(|u| u == "/Hair.normals"), "{unread:?}");
    // One colour for all is the viewport's.
    let constant = "color3f[] primvars:displayColor = [(1, 0, 0)]\n";
    let (groom, losses) = read_text(&hair(&format!("{LINEAR}{constant}")));
    assert!(groom.strands().all(|s| s.colors.is_none()) && losses.is_empty(), "{losses}");
}

#[test]
fn transforms_are_composed() {
    let inside = |properties: &str, hair: &str| {
        let body = format!("def Xform \"Head\"\n{{\n{properties}\n{hair}}}\n");
        let points = read_text(&body).0.points().to_vec();
        (points[0], points[1])
    };
    let near = |(a, b): (Vec3, Vec3), (x, y): (Vec3, Vec3)| {
        assert!(a.distance(x) < 1e-5 && b.distance(y) < 1e-5, "{a} {b}, expected {x} {y}");
    };
    let linear = hair(LINEAR);
    let all = "double3 xformOp:translate = (1, 2, 3)\nfloat xformOp:rotateZ = 90\n\
               float3 xformOp:scale = (2, 2, 2)\nuniform token[] xformOpOrder = \
               [\"xformOp:translate\", \"xformOp:rotateZ\", \"xformOp:scale\"]\n";
    near(inside(all, &linear), (Vec3::new(1.0, 2.0, 3.0), Vec3::new(-1.0, 2.0, 3.0)));
    let moved = "double3 xformOp:translate = (0, 0, 5)\n\
                 uniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
    let below = hair(&format!("{LINEAR}{moved}"));
    near(inside(all, &below), (Vec3::new(1.0, 2.0, 13.0), Vec3::new(-1.0, 2.0, 13.0)));
    let reset = moved.replace("[\"xform", "[\"!resetXformStack!\", \"xform");
    let below = hair(&format!("{LINEAR}{reset}"));
    near(inside(all, &below), (Vec3::Z * 5.0, Vec3::new(0.0, 1.0, 5.0)));
    // About X first, as the name says: Y goes to Z, and about Z it stays there.
    let euler = "float3 xformOp:rotateXYZ = (90, 0, 90)\n\
                 uniform token[] xformOpOrder = [\"xformOp:rotateXYZ\"]\n";
    near(inside(euler, &linear), (Vec3::ZERO, Vec3::Z));
    let pivot = "float3 xformOp:translate:pivot = (0, 1, 0)\nfloat xformOp:rotateX = 180\n\
                 uniform token[] xformOpOrder = [\"xformOp:translate:pivot\", \"xformOp:rotateX\", \
                 \"!invert!xformOp:translate:pivot\"]\n";
    near(inside(pivot, &linear), (Vec3::Y * 2.0, Vec3::Y));
    let matrix = "matrix4d xformOp:transform = ( (0, 0, 1, 0), (0, 1, 0, 0), (-1, 0, 0, 0), \
                  (7, 8, 9, 1) )\nuniform token[] xformOpOrder = [\"xformOp:transform\"]\n";
    near(inside(matrix, &linear), (Vec3::new(7.0, 8.0, 9.0), Vec3::new(7.0, 9.0, 9.0)));
    let quat = "quatf xformOp:orient = (0.70710678, 0.70710678, 0, 0)\n\
                uniform token[] xformOpOrder = [\"xformOp:orient\"]\n";
    near(inside(quat, &linear), (Vec3::ZERO, Vec3::Z));
    // Widths are in the space of their set.
    let wide = hair(&format!("{LINEAR}float[] widths = [0.5]\n"));
    let body = format!("def Xform \"Head\"\n{{\n{all}\n{wide}}}\n");
    assert_eq!(read_text(&body).0.mean_width(), Some(1.0));
    let skewed = "float xformOp:skew = 90\nuniform token[] xformOpOrder = [\"xformOp:skew\"]\n";
    let error = wrong_text(&format!("def Xform \"Head\"\n{{\n{skewed}}}\n"));
    assert!(error.starts_with("/Head.xformOp:skew: found skew, expected a scale"), "{error}");
}

#[test]
fn prims_that_are_not_drawn_are_left_out() {
    let hidden = |head: &str, more: &str, what: &str| {
        let shown = hair(LINEAR).replace("\"Hair\"", "\"Shown\"");
        let in_head = hair(&format!("{LINEAR}{more}"));
        let body = format!("def Scope \"Head\"\n{{\n{head}\n{in_head}}}\n{shown}");
        let (groom, losses) = read_text(&body);
        assert_eq!(groom.len(), 2, "{body}");
        assert_eq!(places(&losses.hidden_curves), [format!("/Head/Hair, {what}")]);
    };
    hidden("token visibility = \"invisible\"", "", "invisible");
    // A child cannot show itself.
    hidden("token visibility = \"invisible\"", "token visibility = \"inherited\"\n", "invisible");
    hidden("uniform token purpose = \"proxy\"", "", "of purpose proxy");
    hidden("", "uniform token purpose = \"guide\"\n", "of purpose guide");
    let guides = "uniform token purpose = \"guide\"\nint primvars:groom_guide = 1\n";
    let (groom, losses) = read_text(&hair(&format!("{LINEAR}{guides}")));
    assert!(groom.strands().all(|strand| strand.is_guide) && losses.is_empty());
    // Neither are classes, overs and inactive prims, which nobody counts.
    for specifier in ["class", "over"] {
        let other = hair(LINEAR).replace("def", specifier).replace("\"Hair\"", "\"Other\"");
        let (groom, losses) = read_text(&format!("{other}{}", hair(LINEAR)));
        assert_eq!((groom.len(), losses), (2, GroomLosses::default()));
    }
    let error = wrong_text(&hair("token visibility = \"invisible\"\n"));
    assert!(error.contains("without curves (1 hidden curve sets left out (/Hair, invisible))"));
}

#[test]
fn sets_are_groups_by_path() {
    let top = hair(LINEAR).replace("\"Hair\"", "\"Top\"");
    let wide = hair(&format!("{LINEAR}float[] widths = [2]\n"));
    let empty = "def BasisCurves \"Empty\"\n{\n}\ndef Mesh \"Scalp\"\n{\n}\n";
    let (groom, losses) = read_text(&format!("{top}def Xform \"Head\"\n{{\n{wide}}}\n{empty}"));
    let paths: Vec<_> = groom.groups().iter().map(|group| group.path.as_str()).collect();
    assert_eq!((groom.len(), paths), (4, vec!["/Top", "/Head/Hair"]));
    assert_eq!(groom.strands().last().unwrap().group.unwrap().name, "Hair");
    // Sets without widths take the mean of the others.
    assert_eq!(groom.strands().next().unwrap().widths, Some(&[2.0; 4][..]));
    assert_eq!((losses.empty_curves.count, losses.skipped_primitives.count), (1, 1));
}

#[test]
fn unit_and_axis_are_the_files() {
    let first_tip = |metadata: &str, settings: &GroomSettings| {
        let text = file(&format!("{metadata}{}", hair(LINEAR)));
        assert_eq!(GroomFormat::of(&text), Ok(GroomFormat::Usd));
        let settings = GroomSettings { shortest_segment: 1e-9, ..settings.clone() };
        let (scale, up) = settings.scale_and_up_in(&text).unwrap();
        let (raw, _) = read(&text).unwrap();
        let (groom, _) = Groom::from_file(&text, &settings).unwrap();
        assert_eq!(raw.with_up(up).scaled(scale).unwrap(), groom);
        groom.points()[3]
    };
    let near = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-6, "{a}, expected {b}");
    let plain = GroomSettings::default();
    // What is not written is centimetres and Y.
    near(first_tip("", &plain), Vec3::Y * 0.03);
    near(first_tip("(metersPerUnit = 1)\n", &plain), Vec3::Y * 3.0);
    near(first_tip("(metersPerUnit = 0.01\nupAxis = \"Z\")\n", &plain), Vec3::NEG_Z * 0.03);
    near(first_tip("(metersPerUnit = 0.001\nupAxis = \"Y\")\n", &plain), Vec3::Y * 0.003);
    let own = GroomSettings { scale: Some(1.0), up: Some(UpAxis::Y), ..default() };
    near(first_tip("(metersPerUnit = 0.01\nupAxis = \"Z\")\n", &own), Vec3::Y * 3.0);
    for (metadata, says) in [
        ("(metersPerUnit = 0)\n", "metersPerUnit: found 0, expected a length of 1e-9 to 1e9"),
        ("(upAxis = \"W\")\n", "upAxis: found W, expected Y or Z"),
    ] {
        let error = wrong_text(&format!("{metadata}{}", hair(LINEAR)));
        assert!(error.starts_with(says), "{error}");
    }
}

#[test]
fn assets_of_usd_are_loaded_by_their_extensions() {
    let extensions = bevy::asset::AssetLoader::extensions(&crate::authoring::groom::GroomLoader);
    assert!(["usd", "usda", "usdc", "usdz"].iter().all(|usd| extensions.contains(usd)));
}

#[test]
fn of_samples_the_earliest_counts() {
    let points = "point3f[] points.timeSamples = { 3: [(0, 0, 0), (0, 1, 0)], \
                  5: [(0, 9, 0), (0, 8, 0)], }\n";
    let body = format!(
        "def BasisCurves \"Hair\"\n{{\n{LINEAR}int[] curveVertexCounts = [2]\n{points}\
         double3 xformOp:translate.timeSamples = {{ 1: (1, 0, 0), 2: (5, 0, 0) }}\n\
         uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}}\n"
    );
    let (groom, losses) = read_text(&body);
    assert_eq!(groom.points(), [Vec3::X, Vec3::new(1.0, 1.0, 0.0)]);
    assert_eq!(losses.unread_samples.count, 1);
}

/// A strand whose points have samples at 0 and 2 and which moves at 1 and 3, below a prim that moves at 1 and 2.
fn moving(rate: &str, points: &str) -> Vec<u8> {
    file(&format!(
        "(\nmetersPerUnit = 1\nupAxis = \"Y\"\n{rate}\n)\n\
         def Xform \"Head\"\n{{\ndouble3 xformOp:translate.timeSamples = {{ 1: (0, 0, 0), 2: (0, 0, 4) }}\n\
         uniform token[] xformOpOrder = [\"xformOp:translate\"]\n\
         def BasisCurves \"Hair\"\n{{\n{LINEAR}int[] curveVertexCounts = [2]\n{points}\
         double3 xformOp:translate:a.timeSamples = {{ 1: (0, 0, 0), 3: (8, 0, 0) }}\n\
         uniform token[] xformOpOrder = [\"xformOp:translate:a\"]\n}}\n\
         def Camera \"Eye\"\n{{\ndouble3 xformOp:translate.timeSamples = {{ 7: (0, 0, 0), 9: (0, 0, 1) }}\n\
         uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}}\n}}\n"
    ))
}

const BENDING: &str = "point3f[] points.timeSamples = { 0: [(0, 0, 0), (0, 1, 0)], \
                       2: [(0, 0, 0), (0, 1, 2)], }\n";

#[test]
fn caches_have_a_frame_at_each_time_at_which_nodes_have_samples() {
    let text = moving("timeCodesPerSecond = 10", BENDING);
    for whole in [text.clone(), binary(&text), package(&[("a.usdc", &binary(&text))])] {
        let (cache, losses) = GroomCache::from_file(&whole, &GroomSettings::default()).unwrap();
        // The camera's are not among them.
        for (found, expected) in cache.times().iter().zip([0.0, 0.1, 0.2, 0.3]) {
            assert!((found - expected).abs() < 1e-6, "{:?}", cache.times());
        }
        assert_eq!(cache.len(), 4);
        let nodes = |frame| cache.frame(frame).to_vec();
        assert_eq!(nodes(0), [Vec3::ZERO, Vec3::Y]);
        assert_eq!(nodes(1), [Vec3::ZERO, Vec3::new(0.0, 1.0, 1.0)], "blended");
        assert_eq!(nodes(2), [Vec3::new(4.0, 0.0, 4.0), Vec3::new(4.0, 1.0, 6.0)]);
        assert_eq!(nodes(3), [Vec3::new(8.0, 0.0, 4.0), Vec3::new(8.0, 1.0, 6.0)]);
        assert_eq!(losses.unread_samples.count, 0);
        assert_eq!(cache.groom().points(), nodes(0));
    }
    // Without a rate it is 24 a second.
    let (cache, _) = GroomCache::from_file(&moving("", BENDING), &default()).unwrap();
    assert!((cache.duration() - 0.125).abs() < 1e-6);
    // Whole numbers of what is a float.
    let turning = file(&format!(
        "(\nmetersPerUnit = 1\nupAxis = \"Y\"\n)\ndef BasisCurves \"Hair\"\n{{\n{LINEAR}int[] curveVertexCounts = [2]\n\
         point3f[] points = [(0, 0, 0), (0, 1, 0)]\nfloat xformOp:rotateZ.timeSamples = {{ 0: 0, 24: 90 }}\n\
         uniform token[] xformOpOrder = [\"xformOp:rotateZ\"]\n}}\n"
    ));
    let (cache, _) = GroomCache::from_file(&turning, &default()).unwrap();
    assert!(cache.frame(1)[1].distance(Vec3::NEG_X) < 1e-6, "{:?}", cache.frame(1));
    // What does not move is one frame.
    let (still, _) = GroomCache::from_file(&file(&hair(LINEAR)), &default()).unwrap();
    assert_eq!(still.times(), [0.0]);
}

#[test]
fn motion_that_cannot_be_is_refused() {
    let error = |file: &[u8]| GroomCache::from_file(file, &default()).unwrap_err().to_string();
    let more = "point3f[] points.timeSamples = { 0: [(0, 0, 0), (0, 1, 0)], \
                2: [(0, 0, 0), (0, 1, 2), (0, 2, 2)], }\n";
    let found = error(&moving("", more));
    assert!(found.contains("curveVertexCounts") || found.contains("nodes"), "{found}");
    // As many in the first frame, more in a later one.
    let counts = "int[] curveVertexCounts.timeSamples = { 0: [2], 2: [3] }\n";
    let text = String::from_utf8(moving("", more)).unwrap();
    let found = error(text.replace("int[] curveVertexCounts = [2]\n", counts).as_bytes());
    assert!(found.contains("frame 2 has 3 nodes, expected 2"), "{found}");
    let unsorted = "point3f[] points.timeSamples = { 24: [(0, 0, 0), (0, 1, 0)], \
                    0: [(0, 0, 0), (0, 1, 2)], }\n";
    let found = error(&moving("", unsorted));
    assert!(found.contains("points.timeSamples: found 0 after 24, expected times that"), "{found}");
    let found = error(&moving("timeCodesPerSecond = 0", BENDING));
    assert!(found.contains("timeCodesPerSecond: found 0, expected a number of"), "{found}");
    // A strand of many nodes that its prim moves often.
    let points: Vec<String> = (0..2000).map(|i| format!("(0, {i}, 0)")).collect();
    let times: Vec<String> = (0..3000).map(|i| format!("{i}: (0, {i}, 0)")).collect();
    let found = error(&file(&format!(
        "def BasisCurves \"Hair\"\n{{\n{LINEAR}int[] curveVertexCounts = [2000]\n\
         point3f[] points = [{}]\ndouble3 xformOp:translate.timeSamples = {{ {} }}\n\
         uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}}\n",
        points.join(", "),
        times.join(", ")
    )));
    assert!(found.contains("has 3000 frames of 2000 nodes, expected at most"), "{found}");
}

#[test]
fn what_is_in_the_file_is_composed() {
    let class = hair(LINEAR).replace("def", "class").replace("\"Hair\"", "\"_lock\"");
    let two = "def Xform \"A\" (instanceable = true\nreferences = </Proto>)\n{\n}\n\
               def Xform \"B\" (references = </Proto>)\n{\n\
               double3 xformOp:translate = (0, 0, 4)\n\
               uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n";
    let proto = format!("class Xform \"Proto\"\n{{\n{}}}\n", hair(LINEAR));
    let (groom, losses) = read_text(&format!("{class}{proto}{two}"));
    assert_eq!((groom.len(), losses), (4, GroomLosses::default()));
    assert_eq!(groom.points()[8], Vec3::Z * 4.0);
    let variants = format!(
        "def Xform \"Head\" (variants = {{ string cut = \"long\" }}\nprepend variantSets = \"cut\")\n\
         {{\nvariantSet \"cut\" = {{\n\"short\" {{\n}}\n\"long\" {{\n{}}}\n}}\n}}\n",
        hair(LINEAR)
    );
    assert_eq!(read_text(&variants).0.len(), 2);
    // Another file is not there.
    let outside = "def Xform \"Beard\" (references = @./beard.usda@</Beard>)\n{\n}\n";
    let (groom, losses) = read_text(&format!("{}{outside}", hair(LINEAR)));
    assert_eq!((groom.len(), losses.unread_files.count, losses.is_broken()), (2, 1, false));
    assert!(losses.to_string().contains("(beard.usda at /Beard)"), "{losses}");
    let error = wrong_text(outside);
    assert!(error.contains("flatten the file by usdcat --flatten"), "{error}");
}

#[test]
fn packages_hold_layers() {
    let root = file(
        "(\n    metersPerUnit = 1\n)\ndef \"Beard\" (references = @./parts/beard.usdc@</Hair>)\n{\n}\n",
    );
    let beard = binary(&file(&hair(LINEAR)));
    let whole = package(&[("root.usda", &root), ("parts/beard.usdc", &beard)]);
    assert_eq!(GroomFormat::of(&whole), Ok(GroomFormat::Usd));
    let (groom, losses) = read(&whole).unwrap();
    assert_eq!((groom.len(), losses), (2, GroomLosses::default()));
    let alone = package(&[("hair.usdc", &beard)]);
    assert_eq!(read(&alone).unwrap().0.len(), 2);
    for end in (4..whole.len()).step_by(7) {
        read(&whole[..end]).unwrap_err();
    }
    let mut packed = whole.clone();
    let directory = packed.windows(4).position(|part| part == b"PK\x01\x02").unwrap();
    packed[directory + 10] = 8;
    let error = read(&packed).unwrap_err().to_string();
    assert!(
        error.contains("the method of compression is 8 of \"root.usda\", expected 0"),
        "{error}"
    );
    // A package of something else is none.
    let mut other = whole;
    other[30..39].copy_from_slice(b"root.jpeg");
    let error = GroomFormat::of(&other).unwrap_err().to_string();
    assert!(error.contains("found a ZIP archive"), "{error}");
}

#[test]
fn what_is_wrong_is_said() {
    let counts = |counts: &str| hair(LINEAR).replace("[4, 4]", counts);
    for (body, says) in [
        (String::new(), "the USD file: found without curves (nothing left out)"),
        (counts("[4, 5]"), "the count of /Hair.points: found 8, expected 9, the sum of"),
        (counts("[9, -1]"), "the count of /Hair.points: found 8, expected 8, the sum of"),
        (hair(LINEAR).replace("point3f[]", "float[]"), "the USD library failed: "),
        (
            hair(LINEAR).replace("(0, 1, 0)", "(0, 1)"),
            "byte 107: a vector's count of numbers is 2, expected 3",
        ),
        ("def Xform \"A\"\n{\n".repeat(70), "byte 1048: the depth of brackets is more"),
        ("def Xform \"A\"\n{\n".to_owned(), "the USD library failed: "),
    ] {
        let error = wrong_text(&body);
        assert!(error.starts_with(says), "{error}");
    }
    assert!(GroomFormat::of(b"").is_err() && read(b"").is_err() && read(b"#usda").is_err());
    // A strand with a number that cannot be is left out.
    let (groom, losses) = read_text(&hair(LINEAR).replace("(0, 2, 0)", "(nan, inf, 0)"));
    assert_eq!((groom.len(), losses.broken_strands.count), (1, 1));
    assert_eq!(places(&losses.broken_strands), ["strand 0 node 2"]);
    let all = hair(LINEAR).replace("2, 0)", "inf, 0)");
    let error = read(&file(&all)).unwrap_err();
    assert!(matches!(error, GroomFileError::Groom(GroomError::AllLeftOut { .. })), "{error}");
    // Points that are no points.
    let flat = hair(LINEAR).replace("point3f[] points", "point3f[] other");
    let flat = flat.replace("int[]", "float[] points = [1, 2, 3]\nint[]");
    assert!(wrong_text(&flat).contains("/Hair.points: found numbers of 1, expected point3f[]"));
}

#[test]
fn nodes_need_bytes_of_the_file() {
    // Each doubles the one below.
    let mut body = format!("class \"L0\"\n{{\n{}}}\n", hair(LINEAR));
    for level in 1..20 {
        let below = level - 1;
        body += &format!(
            "class \"L{level}\"\n{{\ndef \"A\" (references = </L{below}>)\n{{\n}}\n\
             def \"B\" (references = </L{below}>)\n{{\n}}\n}}\n"
        );
    }
    body += "def \"All\" (references = </L19>)\n{\n}\n";
    let error = wrong_text(&body);
    assert!(error.contains("as the file's size justifies"), "{error}");
}

#[test]
fn binary_files_are_the_same() {
    let more = "float[] widths = [1, 2, 3, 4, 5, 6, 7, 8]\nint[] primvars:groom_guide = [1, 0]\n\
                string[] primvars:groom_group_name = [\"top\", \"side\"]\n";
    let text = file(&format!("(\nupAxis = \"Z\"\n)\n{}", hair(&format!("{LINEAR}{more}"))));
    assert_eq!(read(&binary(&text)).unwrap(), read(&text).unwrap());
}

#[test]
fn broken_files_are_refused_or_read() {
    let more = "float[] widths = [1, 2, 3, 4, 5, 6, 7, 8]\nint[] primvars:groom_guide = [1, 0]\n\
                string[] primvars:groom_group_name = [\"top\", \"side\"]\n\
                point3f[] velocities.timeSamples = { 1: [(0, 0, 0)], 2: [(0, 0, 0)] }\n";
    let xform = "def Xform \"Head\" (customData = { dictionary a = { int b = 1 } }\n\
                 prepend references = </Class>)\n{\n}\nclass \"Class\"\n{\n}\n";
    let text = file(&format!("{}{xform}", hair(&format!("{LINEAR}{more}"))));
    let moves = moving("", BENDING);
    let mut state = 1u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 33) as usize % below
    };
    for whole in [text.clone(), binary(&text), package(&[("a.usdc", &binary(&text))])] {
        assert_eq!(read(&whole).unwrap().0.len(), 2);
        for end in (0..whole.len()).step_by(11) {
            let _ = read(&whole[..end]);
        }
        for _ in 0..300 {
            let mut file = whole.clone();
            for _ in 0..=random(4) {
                let at = random(file.len());
                file[at] = random(256) as u8;
            }
            if let Ok((groom, _)) = read(&file) {
                assert!(groom.points().iter().all(|p| p.is_finite()));
            }
        }
    }
    for whole in [moves.clone(), binary(&moves)] {
        for _ in 0..300 {
            let mut file = whole.clone();
            for _ in 0..=random(4) {
                let at = random(file.len());
                file[at] = random(256) as u8;
            }
            if let Ok((cache, _)) = GroomCache::from_file(&file, &default()) {
                let frames = (0..cache.len()).flat_map(|frame| cache.frame(frame));
                assert!(frames.clone().count() > 0 && frames.clone().all(|p| p.is_finite()));
            }
        }
    }
}
