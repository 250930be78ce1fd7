//! A tape as WGSL: values, value with gradient by forward differentiation, intervals.
//!
//! One `let` an operation: nothing nests, however deep the expression was. All of it is kept from
//! drivers' algebra when a kernel is made (`src/gpu/exact.rs`).

use super::lattice::{Part, part_of, parts};
use super::leaf::LeafWgsl;
use super::lower::Program;
use super::tape::{Code, Instruction, Op, Operand};
use crate::field::Planes;
use std::collections::HashSet;
use std::fmt::Write;

/// Operations up to which bounds are written one after the other. Of longer fields they are a loop over the
/// operations: compilers take minutes for what the functions of a thousand become.
const LONGEST_INTERVAL: usize = 100;
/// Operations and registers up to which there are bounds at all: lavapipe ends loops in silence after 65,535.
const LONGEST_LOOP: usize = 50_000;
const MOST_REGISTERS: usize = 512;

/// Which of the uniforms are read from the parameter buffer, in its order; the others are literals.
pub fn buffer_places(program: &Program) -> Vec<u32> {
    (0..program.uniform_count()).filter(|&i| program.constant(i).is_none()).collect()
}

struct Writer<'a> {
    program: &'a Program,
    places: Vec<u32>,
    /// Where the numbers are read that are there, where some are: of `plane` or of `level`.
    known: [HashSet<Operand>; 2],
}

impl Writer<'_> {
    fn uniform(&self, i: u32) -> String {
        match self.program.constant(i) {
            Some(value) if value.is_sign_negative() => format!("({value:?}f)"),
            Some(value) => format!("{value:?}f"),
            None => {
                let place = self.places.partition_point(|&p| p < i);
                format!("field_parameters[{}].{}", place / 4, ["x", "y", "z", "w"][place % 4])
            }
        }
    }

    fn value(&self, operand: Operand) -> String {
        let from = |part: &str| format!("{part}.{}", name(operand));
        let [of_plane, of_level] = self.known.each_ref().map(|known| known.contains(&operand));
        match operand {
            _ if of_plane => from("plane"),
            _ if of_level => from("level"),
            Operand::Axis(_) => from("p"),
            Operand::Uniform(i) => self.uniform(i),
            Operand::Value(_) => name(operand),
        }
    }

    fn gradient(&self, operand: Operand) -> String {
        match operand {
            Operand::Axis(axis) => format!("AXIS_{}", ["X", "Y", "Z"][usize::from(axis)]),
            Operand::Uniform(_) => "vec3<f32>(0.0)".into(),
            Operand::Value(i) => format!("d{i}"),
        }
    }

    fn interval(&self, operand: Operand) -> String {
        match operand {
            Operand::Axis(axis) => ["x", "y", "z"][usize::from(axis)].into(),
            Operand::Uniform(i) => format!("iv_point({})", self.uniform(i)),
            Operand::Value(i) => format!("i{i}"),
        }
    }

    fn value_text(&self, i: &Instruction) -> String {
        let [a, b, c] = i.operands.map(|o| self.value(o));
        match i.op {
            Op::Unary(op) => fill(op.wgsl().value, &a, "", ""),
            Op::Binary(op) => fill(op.wgsl().value, &a, &b, ""),
            Op::Select => format!("select({b}, {c}, {a} == 0.0)"),
            Op::Leaf(leaf) => format!("leaf{leaf}(vec3<f32>({a}, {b}, {c}))"),
        }
    }

    fn gradient_text(&self, n: usize, i: &Instruction) -> String {
        let [a, b, _] = i.operands.map(|o| self.value(o));
        let slopes = match i.op {
            Op::Unary(op) => op.wgsl().slopes,
            Op::Binary(op) => op.wgsl().slopes,
            Op::Select => {
                let [_, db, dc] = i.operands.map(|o| self.gradient(o));
                return format!("select({db}, {dc}, {a} == 0.0)");
            }
            Op::Leaf(_) => {
                let by = |axis: usize| match i.operands[axis] {
                    Operand::Uniform(_) => "vec3<f32>(0.0)".into(),
                    operand => {
                        format!("iso_term(l{n}.{}, {})", ["y", "z", "w"][axis], self.gradient(operand))
                    }
                };
                return format!("({} + {}) + {}", by(0), by(1), by(2));
            }
        };
        let mut terms = Vec::new();
        for (slope, &operand) in slopes.iter().zip(i.operands()) {
            // A uniform has no derivative: its slope, which may be NaN, does not count.
            if matches!(operand, Operand::Uniform(_)) {
                continue;
            }
            let derivative = self.gradient(operand);
            match *slope {
                "0.0" => {}
                "1.0" => terms.push(derivative),
                slope => {
                    let slope = fill(slope, &a, &b, &format!("v{n}"));
                    terms.push(format!("iso_term({slope}, {derivative})"));
                }
            }
        }
        if terms.is_empty() { "vec3<f32>(0.0)".into() } else { terms.join(" + ") }
    }

    fn interval_text(&self, i: &Instruction) -> String {
        let [a, b, c] = i.operands.map(|o| self.interval(o));
        match i.op {
            Op::Unary(op) => fill(op.wgsl().interval, &a, "", ""),
            Op::Binary(op) => fill(op.wgsl().interval, &a, &b, ""),
            Op::Select => format!("iv_select({a}, {b}, {c})"),
            Op::Leaf(leaf) => format!("leaf{leaf}_interval({a}, {b}, {c})"),
        }
    }
}

impl Writer<'_> {
    /// The bounds as a loop over the operations, which it reads from `field_data` at `first`: a helper, the body of
    /// the function, and the words. Five words an operation: which case, the register that it fills, three operands;
    /// behind them the constants. An operand's top bits say where it is: 0 in a register, 1 a constant, 2 a parameter.
    fn interval_loop(&self, first: usize) -> (String, String, Vec<u32>) {
        const CONSTANT: u32 = 1 << 30;
        const PARAMETER: u32 = 2 << 30;
        let code = Code::new(&self.program.tape);
        if code.instructions.len() > LONGEST_LOOP || code.registers > MOST_REGISTERS {
            return (String::new(), "    return ALL;\n".into(), Vec::new());
        }
        let (mut cases, mut words, mut constants) = (Vec::new(), Vec::new(), Vec::new());
        let mut operand = |operand| match operand {
            Operand::Value(register) => register,
            // The first registers hold the coordinates.
            Operand::Axis(axis) => axis.into(),
            Operand::Uniform(i) => match self.program.constant(i) {
                Some(value) => {
                    constants.push(value.to_bits());
                    CONSTANT | (constants.len() as u32 - 1)
                }
                None => PARAMETER | self.places.partition_point(|&p| p < i) as u32,
            },
        };
        for (instruction, to) in &code.instructions {
            let case = cases.iter().position(|op| *op == instruction.op).unwrap_or_else(|| {
                cases.push(instruction.op);
                cases.len() - 1
            });
            let mut operands = [0; 3];
            for (word, from) in operands.iter_mut().zip(instruction.operands()) {
                *word = operand(*from);
            }
            words.extend([case as u32, *to]);
            words.extend(operands);
        }
        let root = operand(code.root);
        let (count, constants_at) = (code.instructions.len(), first + words.len());
        words.extend(constants);

        let registers = format!("ptr<function, array<vec2<f32>, {}>>", code.registers);
        let helper = format!(
            "fn iv_operand(word: u32, registers: {registers}) -> vec2<f32> {{\n    let i = word & 0x3fffffffu;\n    \
             switch word >> 30u {{\n        case 1u: {{ return iv_point(bitcast<f32>(field_data[{constants_at}u + i])); }}\n        \
             case 2u: {{ return iv_point(field_parameters[i / 4u][i % 4u]); }}\n        \
             default: {{ return (*registers)[i]; }}\n    }}\n}}\n"
        );
        let mut body = format!(
            "    var r: array<vec2<f32>, {}>;\n    r[0] = x;\n    r[1] = y;\n    r[2] = z;\n    \
             for (var i = 0u; i < {count}u; i++) {{\n        let at = {first}u + 5u * i;\n        \
             let a = iv_operand(field_data[at + 2u], &r);\n        let b = iv_operand(field_data[at + 3u], &r);\n        \
             let c = iv_operand(field_data[at + 4u], &r);\n        var v = ALL;\n        switch field_data[at] {{\n",
            code.registers
        );
        for (n, op) in cases.iter().enumerate() {
            let text = match op {
                Op::Unary(op) => fill(op.wgsl().interval, "a", "", ""),
                Op::Binary(op) => fill(op.wgsl().interval, "a", "b", ""),
                Op::Select => "iv_select(a, b, c)".into(),
                Op::Leaf(leaf) => format!("leaf{leaf}_interval(a, b, c)"),
            };
            // Writing to a string does not fail.
            let _ = writeln!(body, "            case {n}u: {{ v = {text}; }}");
        }
        let _ = writeln!(
            body,
            "            default: {{}}\n        }}\n        r[field_data[at + 1u]] = v;\n    }}\n    return iv_operand({root}u, &r);"
        );
        (helper, body, words)
    }
}

/// `density` in parts, if that saves anything.
fn write_planes(program: &Program) -> Option<Planes> {
    let tape = &program.tape;
    let parts = parts(tape);
    // Leaves may loop long, and an invocation that takes nine of their values longer than lavapipe lets it.
    if !tape.leaves.is_empty() || !parts.contains(&Part::OnePlane) {
        return None;
    }
    // What is asked of the first two parts: by what is done at each point, and as the whole.
    let at_points = tape.instructions.iter().zip(&parts).filter(|(_, part)| **part == Part::Points);
    let asked = at_points.flat_map(|(instruction, _)| instruction.operands()).chain([&tape.root]);
    let (mut known, mut seen) = ([const { Vec::new() }; 2], HashSet::new());
    for &operand in asked {
        let of = match part_of(&parts, operand) {
            Some(Part::OnePlane) => &mut known[0],
            Some(Part::Planes) => &mut known[1],
            Some(Part::Points) | None => continue,
        };
        if seen.insert(operand) {
            of.push(operand);
        }
    }
    // A struct has a member.
    let axes = [Operand::Axis(0), Operand::Axis(2)];
    known
        .iter_mut()
        .zip(axes)
        .filter(|(known, _)| known.is_empty())
        .for_each(|(known, axis)| known.push(axis));

    let mut writer = Writer { program, places: buffer_places(program), known: Default::default() };
    let text_of = |writer: &Writer<'_>, wanted: Part| {
        let some = tape.instructions.iter().enumerate().filter(|(n, _)| parts[*n] == wanted);
        some.map(|(n, i)| format!("    let v{n} = {};\n", writer.value_text(i))).collect::<String>()
    };
    let firsts = [("Plane", "plane", Part::OnePlane), ("Level", "level", Part::Planes)];
    let mut text: String = firsts
        .iter()
        .zip(&known)
        .map(|((ty, function, part), known)| {
            let list =
                |write: &dyn Fn(&Operand) -> String| known.iter().map(write).collect::<Vec<_>>().join(", ");
            format!(
                "struct Density{ty} {{ {} }}\n\nfn density_{function}(p: vec3<f32>) -> Density{ty} {{\n\
                 {}    return Density{ty}({});\n}}\n\n",
                list(&|operand| format!("{}: f32", name(*operand))),
                text_of(&writer, *part),
                list(&|operand| writer.value(*operand)),
            )
        })
        .collect();
    let bytes = known.each_ref().map(|known| 4 * known.len() as u32);
    writer.known = known.map(|known| known.into_iter().collect());
    // Writing to a string does not fail.
    let _ = writeln!(
        text,
        "fn density_in_plane(plane: DensityPlane, level: DensityLevel) -> f32 {{\n{}    return {};\n}}",
        text_of(&writer, Part::Points),
        writer.value(tape.root),
    );
    Some(Planes { text: text.into(), bytes })
}

/// What a coordinate or a value is called.
fn name(operand: Operand) -> String {
    match operand {
        Operand::Axis(axis) => ["x", "y", "z"][usize::from(axis)].into(),
        Operand::Uniform(i) | Operand::Value(i) => format!("v{i}"),
    }
}

/// An operation's text with its operands in place of `A`, `B` and `V`.
fn fill(text: &str, a: &str, b: &str, v: &str) -> String {
    text.chars().fold(String::new(), |mut out, letter| {
        match letter {
            'A' => out.push_str(a),
            'B' => out.push_str(b),
            'V' => out.push_str(v),
            other => out.push(other),
        }
        out
    })
}

/// Source text of `density`, `density_gradient` and `density_interval`.
pub struct Texts {
    /// `fn density(p: vec3<f32>) -> f32`.
    pub value: String,
    /// `fn density_gradient(p: vec3<f32>) -> vec3<f32>`.
    pub gradient: String,
    /// `fn density_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32>`.
    pub interval: String,
    /// `density` by planes.
    pub planes: Option<Planes>,
    /// What `density_interval` reads of `field_data` behind the leaves' data.
    pub code: Vec<u32>,
}

/// Writes the program.
pub fn write(program: &Program) -> Texts {
    let writer = Writer { program, places: buffer_places(program), known: Default::default() };
    let tape = &program.tape;
    let [mut value, mut gradient, mut interval] = [const { String::new() }; 3];
    let is_long = tape.instructions.len() > LONGEST_INTERVAL;
    // Writing to a string does not fail.
    for (n, i) in tape.instructions.iter().enumerate() {
        let v = writer.value_text(i);
        let _ = writeln!(value, "    let v{n} = {v};");
        let d = writer.gradient_text(n, i);
        let _ = match i.op {
            Op::Leaf(leaf) => {
                let [a, b, c] = i.operands.map(|o| writer.value(o));
                let call = format!("dual{leaf}_gradient(vec3<f32>({a}, {b}, {c}))");
                writeln!(gradient, "    let l{n} = {call};\n    let v{n} = l{n}.x;\n    let d{n} = {d};")
            }
            _ => writeln!(gradient, "    let v{n} = {v};\n    let d{n} = {d};"),
        };
        if !is_long {
            let _ = writeln!(interval, "    let i{n} = {};", writer.interval_text(i));
        }
    }
    let root = tape.root;
    let mut leaves = LeafWgsl { value: String::new(), gradient: String::new(), interval: String::new() };
    let mut first = 0;
    for (n, leaf) in tape.leaves.iter().enumerate() {
        let texts = leaf.wgsl(&format!("leaf{n}"), first);
        leaves.value += &texts.value;
        // Under a name of its own, so that it may stand beside the value.
        leaves.gradient += &leaf.wgsl(&format!("dual{n}"), first).gradient;
        leaves.interval += &texts.interval;
        first += (leaf.data_bytes() / 4) as usize;
    }
    let mut code = Vec::new();
    let head = "fn density_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32> {";
    interval = match is_long {
        true => {
            let (helper, body, words) = writer.interval_loop(first);
            code = words;
            format!("{helper}{head}\n{body}}}\n")
        }
        false => format!("{head}\n{interval}    return {};\n}}\n", writer.interval(root)),
    };
    let LeafWgsl { value: leaf_values, gradient: leaf_gradients, interval: leaf_intervals } = leaves;
    Texts {
        value: format!(
            "{leaf_values}fn density(p: vec3<f32>) -> f32 {{\n{value}    return {};\n}}\n",
            writer.value(root)
        ),
        gradient: format!(
            "{leaf_gradients}fn density_gradient(p: vec3<f32>) -> vec3<f32> {{\n{gradient}    return {};\n}}\n",
            writer.gradient(root)
        ),
        interval: leaf_intervals + &interval,
        planes: write_planes(program),
        code,
    }
}
