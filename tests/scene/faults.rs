//! What is wrong with a scene is said with file, line, column and key, and with what to do.

use super::parse;
use isoforge::scene::{Fault, SceneError};

/// That the text is refused at a place (line, column, key) with words of the message.
fn refused(text: &str, place: (u32, u32, &str), words: &str) -> Fault {
    let error = parse(text).err().unwrap_or_else(|| panic!("taken: {text}"));
    let message = error.to_string();
    let SceneError::At(at) = error else { panic!("{message}") };
    assert!(message.contains(words), "{message}");
    assert_eq!((at.line, at.column, &*at.key), place, "{message}");
    assert!(
        message.starts_with(&format!("examples/scenes/test.toml:{}:{}: ", at.line, at.column)),
        "{message}"
    );
    at.fault
}

/// In a node's keys, from line 2 on.
fn node(keys: &str, place: (u32, u32, &str), words: &str) {
    refused(&format!("[nodes.n]\n{keys}"), place, words);
}

#[test]
fn text_that_is_no_scene() {
    refused("[nodes.n\nkind = 1", (1, 9, ""), "this is not TOML");
    refused("", (1, 1, ""), "the scene has no node");
    refused("[nodes]", (1, 1, "nodes"), "the scene has no node");
    refused("nodes = 3", (1, 9, "nodes"), "a number stands here: give a table");
    refused("[nodes.n]\nkind = 'sphere'\nradius = 1\nradius = 2", (4, 1, ""), "duplicate key");
    refused("node = 1\n[nodes.n]\nkind = 'sphere'\nradius = 1", (1, 1, ""), "did you mean `nodes`?");
    let deep = format!("a = {}1{}", "[".repeat(20_000), "]".repeat(20_000));
    assert!(parse(&deep).unwrap_err().to_string().contains("this is not TOML"));
}

#[test]
fn nodes() {
    node("kind = 'spere'\nradius = 1", (2, 8, "nodes.n.kind"), "no kind `spere` (did you mean `sphere`?)");
    node("radius = 1", (1, 1, "nodes.n"), "the key `kind` is missing");
    node("kind = 'sphere'", (1, 1, "nodes.n"), "the key `radius` is missing");
    node(
        "kind = 'sphere'\nradius = 1\nraduis = 2",
        (4, 1, "nodes.n"),
        "no key `raduis` here (did you mean `radius`?)",
    );
    node("kind = 'sphere'\nraduis = 2", (1, 1, "nodes.n"), "`radius` is missing (is it `raduis`?)");
    node(
        "kind = 'sphere'\nradius = true",
        (3, 10, "nodes.n.radius"),
        "true or false stands here: give a number",
    );
    node("kind = 'sphere'\nradius = [1]", (3, 10, "nodes.n.radius"), "a list stands here");
    node(
        "kind = 'sphere'\nradius = nan",
        (3, 10, "nodes.n.radius"),
        "nan is out of range: give a finite number",
    );
    node("kind = 'sphere'\nradius = 1e300", (3, 10, "nodes.n.radius"), "finite");
    node("kind = 'sphere'\nradius = inf", (3, 10, "nodes.n.radius"), "finite");
    node("kind = 3", (2, 8, "nodes.n.kind"), "a number stands here: give a text in quotes");
    node("kind = 'box'\nlow = [0, 0]\nhigh = [1, 1, 1]", (3, 7, "nodes.n.low"), "a list of another length");
    node("kind = 'union'\nof = []", (3, 6, "nodes.n.of"), "an empty list stands here");
    node("kind = 'union'\nof = ['m']", (3, 7, "nodes.n.of[0]"), "no node `m`");
    node("kind = 'union'\nof = [{kind = 'sphere'}]", (3, 7, "nodes.n.of[0]"), "`radius` is missing");
    node(
        "kind = 'noise'\nseed = -1",
        (3, 8, "nodes.n.seed"),
        "-1 is out of range: give a whole number from 0",
    );
    node("kind = 'noise'\nseed = 1.5", (3, 8, "nodes.n.seed"), "give a whole number");
    node("kind = 'blob'\nradius = 1\nkernel = 'sof'", (4, 10, "nodes.n.kernel"), "did you mean `soft`?");
    node("kind = 'field'\nname = 'gyrod'", (3, 8, "nodes.n.name"), "did you mean `gyroid`?");
    let two = "[nodes.a]\nkind = 'sphere'\nradius = 1\n[nodes.b]\nkind = 'sphere'\nradius = 1";
    refused(
        two,
        (1, 1, ""),
        "2 nodes are part of no other (a, b): say which is meshed, as in `surface = \"a\"`",
    );
    refused(&format!("surface = 'c'\n{two}"), (1, 11, "surface"), "no node `c`");
}

#[test]
fn sizes() {
    let ball = "{kind = 'sphere', radius = 1}";
    for (kind, others, keys) in [
        ("sphere", "", &["radius"][..]),
        ("box", "low = [0, 0, 0]\nhigh = [1, 1, 1]", &["radius"]),
        ("cylinder", "", &["radius", "height"]),
        ("capsule", "a = [0, 0, 0]\nb = [1, 0, 0]", &["radius"]),
        ("torus", "", &["major", "minor"]),
        ("cone", "height = 1", &["radius", "top"]),
        ("supertorus", "radii = [1, 1, 1]\ne1 = 1\ne2 = 1", &["hole"]),
        ("shell", &format!("of = {ball}"), &["thickness"]),
        ("extrude", &format!("of = {ball}"), &["height"]),
        ("union", &format!("of = [{ball}, {ball}]"), &["radius"]),
        ("difference", &format!("of = [{ball}, {ball}]\nblend = 'exponential'"), &["radius"]),
        ("blob", "skeleton = 'circle'\nradius = 1", &["major"]),
    ] {
        for wrong in keys {
            let text = |bad: &str| {
                let keys =
                    keys.iter().map(|key| format!("{key} = {}\n", if key == wrong { bad } else { "1" }));
                format!("[nodes.n]\n{}kind = '{kind}'\n{others}", keys.collect::<String>())
            };
            let line = keys.iter().position(|key| key == wrong).unwrap_or(0) as u32 + 2;
            let place = (line, wrong.len() as u32 + 4, &*format!("nodes.n.{wrong}"));
            refused(&text("-1"), place, "-1 is out of range: give a number of 0 or more");
            refused(&text("'1-2'"), place, "'1-2' = -1 is out of range");
            for good in ["0", "'r - 2'"] {
                let text = format!("{}\n[parameters]\nr = 1", text(good));
                parse(&text).unwrap_or_else(|error| panic!("{error}"));
            }
        }
    }
    node(
        "kind = 'box'\nlow = [0, 1, 0]\nhigh = [1, 0, 1]",
        (1, 1, "nodes.n"),
        "the box along y reaches from 1 to 0",
    );
    parse("[nodes.n]\nkind = 'box'\nlow = [0, 1, 0]\nhigh = [1, 1, 1]").expect("a sheet");
    parse("[nodes.n]\nkind = 'offset'\ndistance = -1\nof = {kind = 'sphere', radius = 2}").expect("smaller");
}

#[test]
fn nodes_within_themselves() {
    let text = "[nodes.a]\nkind = 'negation'\nof = 'b'\n[nodes.b]\nkind = 'union'\nof = ['a', 'c']\n\
                [nodes.c]\nkind = 'sphere'\nradius = 1";
    let fault = refused(text, (6, 7, "nodes.b.of[0]"), "a → b → a");
    assert!(matches!(fault, Fault::Cycle { nodes } if nodes == ["a", "b", "a"]));
    node("kind = 'negation'\nof = 'n'", (3, 6, "nodes.n.of"), "n → n");
    // Through a node in place, and through a formula's names.
    node("kind = 'union'\nof = {kind = 'negation', of = 'n'}", (3, 31, "nodes.n.of.of"), "n → n");
    node("kind = 'formula'\ntext = 'a'\nwith = {a = 'n'}", (4, 13, "nodes.n.with.a"), "n → n");
}

#[test]
fn formulas() {
    node("kind = 'sphere'\nradius = '2*q'", (3, 13, "nodes.n.radius"), "no value is given for `q`");
    node("kind = 'sphere'\nradius = '2*'", (3, 13, "nodes.n.radius"), "a value is missing before the end");
    node("kind = 'sphere'\nradius = '1/0'", (3, 12, "nodes.n.radius"), "gives inf everywhere");
    node(
        "kind = 'formula'\ntext = '''\nx +\n* y'''",
        (5, 1, "nodes.n.text"),
        "a value is missing before `*`",
    );
    // Where the text is escaped, the place is that of the value.
    node("kind = 'formula'\ntext = \"x \\u002b * y\"", (3, 8, "nodes.n.text"), "a value is missing");
    for name in ["''", "'a.b'", "'a b'", "1a"] {
        let text = format!("[parameters]\n{name} = 1\n[nodes.n]\nkind = 'sphere'\nradius = 1");
        let key = format!("parameters.{}", name.replace('\'', "\""));
        refused(&text, (2, name.len() as u32 + 4, &key), "formulas cannot say");
    }
    let with = "kind = 'formula'\ntext = 'x'\nwith = {x = {kind = 'sphere', radius = 1}}";
    node(with, (4, 13, "nodes.n.with.x"), "`x` has a meaning of its own");
    let reserved = "[parameters]\nx = 1\n[nodes.n]\nkind = 'sphere'\nradius = 1";
    refused(reserved, (2, 5, "parameters.x"), "`x` has a meaning of its own");
    let text = "[parameters]\nr = 'a'\n[nodes.n]\nkind = 'sphere'\nradius = 1";
    refused(text, (2, 5, "parameters.r"), "a text stands here: give a number");
    let text = "[parameters]\nr = nan\n[nodes.n]\nkind = 'sphere'\nradius = 'r'";
    refused(text, (2, 5, "parameters.r"), "give a finite number");
}

#[test]
fn shapes_that_cannot_be() {
    node("kind = 'ellipsoid'\nradii = [1, 0, 1]", (1, 1, "nodes.n"), "the half axis is 0");
    node(
        "kind = 'superellipsoid'\nradii = [1, 1, 1]\ne1 = -1\ne2 = 1",
        (1, 1, "nodes.n"),
        "the exponent is -1",
    );
    node("kind = 'half_space'\nnormal = [0, 0, 0]", (1, 1, "nodes.n"), "the normal has no direction");
    node("kind = 'noise'\nsize = 0", (1, 1, "nodes.n"), "the size is 0");
    node("kind = 'blob'\nradius = 0", (1, 1, "nodes.n"), "the radius is 0");
    node("kind = 'field'\nname = 'torus'\nparameters = {r = -1}", (1, 1, "nodes.n"), "`r` is -1");
    let ball = "kind = 'sphere'\nradius = 1\n";
    let of = |transform: &str, place, words| node(&format!("{ball}{transform}"), place, words);
    of("scale = 0", (4, 9, "nodes.n.scale"), "the scale factor is 0");
    of("rotate = {axis = [0, 0, 0], turns = 1}", (4, 10, "nodes.n.rotate"), "no direction");
    of("rotate = {axis = [0, 0, 1]}", (4, 10, "nodes.n.rotate"), "give one of `degrees` and `turns`");
    of("rotate = {axis = [0, 0, 1], turns = 1, around = 2}", (4, 40, "nodes.n.rotate"), "no key `around`");
    of("mirror = [1, 0, 0]", (4, 10, "nodes.n.mirror"), "`isoforge nodes` lists");
    let lattice = "free_form = {low = [0, 0, 0], high = [0, 1, 1], counts = [2, 2, 2], displacements = []}";
    of(lattice, (4, 13, "nodes.n.free_form"), "which is empty");
    of("twist = {turns_per_length = 1, from = 1, to = 1}", (4, 9, "nodes.n.twist"), "which is empty");
    of("affine = [[1, 0, 0, 0], [2, 0, 0, 0], [0, 0, 1, 0]]", (4, 10, "nodes.n.affine"), "has no inverse");
    of("affine = [[1, 0, 0, 0], [2, 0, 0, 0]]", (4, 10, "nodes.n.affine"), "three rows");
    of("repeat = {axis = 'w', period = 1}", (4, 18, "nodes.n.repeat.axis"), "no axis `w`");
    of("transform = [{scale = 2, turn = 1}]", (4, 26, "nodes.n.transform[0]"), "no key `turn`");
    let r = "kind = 'union'\nblend = 'r'\nalpha = -1\nof = [{kind = 'sphere', radius = 1}, {kind = 'sphere', radius = 2}]";
    node(r, (1, 1, "nodes.n"), "alpha is -1");
    node(
        "kind = 'blobs'\ncomponents = [{at = [0, 0, 0], radius = 0}]",
        (1, 1, "nodes.n"),
        "component 0 (from 0) has the radius 0",
    );
    let part = |keys: &str, place, words| {
        node(&format!("kind = 'blobs'\ncomponents = [{{at = [0, 0, 0], {keys}}}]"), place, words)
    };
    part("scale = [1, 0, 1]", (1, 1, "nodes.n"), "component 0 (from 0) is scaled by [1.0, 0.0, 1.0]");
    part("rotate = {axis = [0, 0, 0], turns = 1}", (3, 41, "nodes.n.components[0].rotate"), "no direction");
    node("kind = 'blobs'\ncomponents = []", (1, 1, "nodes.n"), "there is no component");
}

#[test]
fn densities_where_solids_are_wanted() {
    node("kind = 'union'\nof = {kind = 'blob', radius = 1}", (3, 6, "nodes.n.of"), "give it an `iso`");
    node("kind = 'points'\nfile = '../data/1A8O.pdb.gz'\niso = 7", (1, 1, "nodes.n"), "7 is out of range");
}

#[test]
fn the_top() {
    let ball = "[nodes.n]\nkind = 'sphere'\nradius = 1";
    refused(&format!("\u{feff}cells = 0\n{ball}"), (1, 9, "cells"), "0 is out of range");
    refused(&format!("iso = 1e39\n{ball}"), (1, 7, "iso"), "1e39 is out of range: give a finite number");
    refused(&format!("cells = 0\n{ball}"), (1, 9, "cells"), "0 is out of range");
    refused(&format!("cells = [1, 2]\n{ball}"), (1, 9, "cells"), "a list");
    refused(&format!("bounds = [[0, 0, 0], [1, 0, 1]]\n{ball}"), (1, 10, "bounds"), "higher along each axis");
    refused(&format!("bounds = [[0, 0, 0]]\n{ball}"), (1, 10, "bounds"), "two corners");
    refused(&format!("inside = 'left'\n{ball}"), (1, 10, "inside"), "there are below, above");
    refused(
        &format!("iso = 'r'\n{ball}"),
        (1, 8, "iso"),
        "give it a value as a parameter (in a scene below `[parameters]`)\n",
    );
    refused(&format!("iso = 'x + 1'\n{ball}"), (1, 7, "iso"), "give a formula of parameters alone");
    refused(&format!("cells = '0.2'\n{ball}"), (1, 9, "cells"), "'0.2' = 0 is out of range");
    refused(&format!("refine = {{flat = 1}}\n{ball}"), (1, 11, "refine"), "no key `flat` here");
    refused(&format!("camera = {{fov = 500}}\n{ball}"), (1, 17, "camera.fov"), "degrees from 1 to 150");
}

#[test]
fn files_that_cannot_be_read() {
    node("kind = 'volume'\nfile = 'none.nii'\niso = 1", (3, 8, "nodes.n.file"), "none.nii");
    node("kind = 'points'\nfile = 'none.csv'\niso = 0.5", (3, 8, "nodes.n.file"), "none.csv");
    node("kind = 'volume'\nfile = 'x.raw'\ntype = 'u8'", (1, 1, "nodes.n"), "the key `dims` is missing");
    // What only raw files need is not ignored beside others.
    let other =
        "kind = 'volume'\nfile = '../../tests/data/brain_24.nii.gz'\niso = 1\ndims = [2, 2, 2]\ntype = 'u8'";
    node(other, (5, 1, "nodes.n"), "no key `dims` here");
    node(
        "kind = 'volume'\nfile = 'x.raw'\niso = 1\ndims = [2, 2, 2]\ntype = 'u9'",
        (6, 8, "nodes.n.type"),
        "u8 i8",
    );
    node("kind = 'wgsl'\ntext = 'fn density('", (1, 1, "nodes.n"), "nodes.n.text:1:");
    node("kind = 'wgsl'", (1, 1, "nodes.n"), "give one of `file` and `text`");
    let path = std::path::Path::new("no/such.toml");
    let error = isoforge::scene::Scene::open(path, &Default::default()).unwrap_err().to_string();
    assert!(error.contains("no/such.toml cannot be read") && error.contains("check the name"), "{error}");
}

/// Goes red when 2⁴⁰ operations are begun.
#[test]
fn too_many_operations() {
    let mut text = String::from("surface = 'n40'\n[nodes.n0]\nkind = 'sphere'\nradius = 1\n");
    for i in 1..=40 {
        let twice =
            format!("'n{0}', {{kind = 'copy', of = 'n{0}', translate = [{1}, 0, 0]}}", i - 1, 1u64 << i);
        text += &format!("[nodes.n{i}]\nkind = 'union'\nof = [{twice}]\n");
    }
    refused(&text, (1, 1, ""), "more than 4194304 operations");
}

/// Messages stay short where there is much to list.
#[test]
fn long_lists_of_names() {
    let names = |kind: &str| {
        let node = |i| format!("[nodes.n{i}]\n{kind}\nradius = 1\n");
        (0..100).map(node).collect::<String>()
    };
    refused(&names("kind = 'sphere'"), (1, 1, ""), "n39, … (60 more)");
    refused(&format!("surface = 'm'\n{}", names("kind = 'sphere'")), (1, 11, "surface"), "n39, … (60 more)");
    let parameters: String = (0..100).map(|i| format!("p{i} = 1\n")).collect();
    let text = format!("[nodes.n]\nkind = 'sphere'\nradius = 'q'\n[parameters]\n{parameters}");
    refused(&text, (3, 11, "nodes.n.radius"), "p39, … (60 more)");
}

/// Any text is taken or refused, never a panic: half of an example, a piece left out, a letter changed.
#[test]
fn damaged_scenes() {
    let text = include_str!("../../examples/scenes/part.toml");
    let mut taken = 0;
    for i in (0..text.len()).filter(|&i| text.is_char_boundary(i)) {
        let _ = parse(&text[..i]);
        let end = (i + 7).min(text.len());
        let _ = parse(&format!("{}{}", &text[..i], &text[end..]));
        for letter in ["'", "[", "=", "x", "9", "\n", "\u{0}"] {
            taken += u32::from(parse(&format!("{}{letter}{}", &text[..i], &text[i + 1..])).is_ok());
        }
    }
    assert!(taken > 0);
}
