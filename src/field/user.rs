//! Fields that a user writes as a WGSL function `fn density(p: vec3<f32>) -> f32`.
//!
//! The source is parsed and validated alone, so that errors carry the user's own line and column.
//! It is then rewritten through naga's representation: every function, type and constant gets a
//! prefix of its own, so that no helper's name clashes with the library's, and every loop counts
//! its iterations and leaves when one invocation has made [`MAX_ITERATIONS`]: an endless loop would
//! hang a GPU, and lavapipe ends it in silence after 65,535 iterations with a wrong value.
//!
//! Where the function can be written as an expression of the field graph ([`from_wgsl`]), that is what is
//! evaluated, on both backends, with exact gradients and bounds; of a long one, on the CPU alone. Else the rewritten text runs on the GPU
//! alone, and [`UserField::obstacle`] says why.

mod rewrite;

use super::{Field, NoForm, Points, Sense, Wgsl, Within};
use crate::excerpt::{Excerpt, excerpt};
use crate::graph::from_wgsl::{self, Obstacle};
use crate::graph::interval::{ALL, Interval};
use crate::graph::{Expr, GraphField};
use naga::{Handle, Module, Span};
use rewrite::{check_pointers, count_loops, rename};
use std::sync::Arc;

/// Iterations that all loops of the function may make in one invocation of a kernel (which
/// evaluates the function from three to a few dozen times).
pub const MAX_ITERATIONS: u32 = 50_000;

/// Operations up to which a GPU runs the expression. Drivers compile long straight code in a time that grows
/// faster than its length: lavapipe minutes for 2,000 operations.
const MOST_ON_GPU: usize = 1000;

/// Bytes that a source may have, and the stack it is checked on.
const MAX_SOURCE: usize = 1 << 20;
const STACK: usize = 1 << 30;

/// What is wrong with the user's source, and where.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}:{line}:{column}: {message}\n{excerpt}")]
pub struct UserError {
    /// The file, as the user named it.
    pub file: String,
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// What is wrong and what to do.
    pub message: String,
    /// The line with a caret under the place.
    pub excerpt: String,
}

/// A checked user function.
#[derive(Debug, Clone)]
pub struct UserField {
    sense: Sense,
    rewritten: Arc<str>,
    graph: Option<(Expr, GraphField)>,
    obstacle: Option<Obstacle>,
    /// Whether drivers take the function as it is written.
    runs_on_gpu: bool,
}

impl UserField {
    /// Checks `source`; `file` is the name that errors show.
    ///
    /// # Errors
    /// [`UserError`] with line and column: what naga's parser and validator refuse, a missing or
    /// differently typed `density`, entry points, global variables, overrides.
    pub fn new(source: &str, file: &str, sense: Sense) -> Result<Self, UserError> {
        let source = source.trim_start_matches('\u{feff}');
        if source.len() > MAX_SOURCE {
            let message = format!("the source has {} bytes; it may have {MAX_SOURCE}", source.len());
            return Err(locate(source, file, None, message));
        }
        // naga walks expressions by recursion: deep ones need more stack than a thread has by default.
        std::thread::scope(|scope| {
            let check = || Self::check(source, file, sense);
            let fail = |message: String| Err(locate(source, file, None, message));
            let thread = match std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, check) {
                Ok(thread) => thread,
                Err(error) => {
                    let room = STACK >> 20;
                    return fail(format!(
                        "there is no room for a stack of {room} MiB to check it with: {error}"
                    ));
                }
            };
            let too_deep =
                "the source is too deeply nested to be checked here: write it in shorter expressions";
            thread.join().unwrap_or_else(|_| fail(too_deep.into()))
        })
    }

    /// The function as an expression, if it is one.
    pub fn graph(&self) -> Option<&GraphField> {
        self.graph.as_ref().map(|(_, field)| field)
    }

    /// The expression itself, as a part for others.
    pub fn expr(&self) -> Option<&Expr> {
        self.graph.as_ref().map(|(expr, _)| expr)
    }

    /// Why only a GPU evaluates the function, if that is so.
    pub fn obstacle(&self) -> Option<&Obstacle> {
        self.obstacle.as_ref()
    }

    /// How many operations the expression has, if they are too many for a GPU, which then runs the function as it is
    /// written: its bytes may differ from the CPU's.
    pub fn too_long_for_gpu(&self) -> Option<usize> {
        self.graph().map(GraphField::operations).filter(|&operations| operations > MOST_ON_GPU)
    }

    /// The function as it was written, for the GPU alone.
    #[must_use]
    pub fn as_written(self) -> Self {
        Self { graph: None, ..self }
    }

    fn check(source: &str, file: &str, sense: Sense) -> Result<Self, UserError> {
        let error = |span: Option<Span>, message: String| {
            let place = span.and_then(|span| source.get(span.to_range()?)).unwrap_or_default();
            locate(source, file, span, with_float(message, place))
        };
        let mut module = naga::front::wgsl::parse_str(source).map_err(|e| {
            let span = e.labels().next().map(|(span, _)| span);
            error(span, e.message().to_string())
        })?;
        let info = validate(&module).map_err(|(span, message)| error(span, message))?;
        check_form(&module, &info).map_err(|(span, message)| error(span, message))?;
        let (graph, obstacle) = match from_wgsl::lower(&module, source, sense) {
            Ok(graph) => (Some(graph), None),
            Err(obstacle) => (None, Some(obstacle)),
        };
        let pointers = check_pointers(&module);
        let runs_on_gpu = pointers.is_ok();
        if graph.as_ref().is_none_or(|(_, graph)| graph.operations() > MOST_ON_GPU) {
            pointers.map_err(|(span, message)| error(span, message))?;
        }
        count_loops(&mut module);
        rename(&mut module);
        let info = validate(&module).map_err(|(span, message)| error(span, message))?;
        let flags = naga::back::wgsl::WriterFlags::empty();
        let rewritten = naga::back::wgsl::write_string(&module, &info, flags)
            .map_err(|e| error(None, format!("the function cannot be rewritten: {e}")))?;
        // The writer adds parentheses and braces, and the parser has limits on both.
        naga::front::wgsl::parse_str(&rewritten).map_err(|e| {
            let message = format!(
                "the function is too deeply nested ({}): write it in shorter expressions",
                e.message()
            );
            error(None, message)
        })?;
        Ok(Self { sense, rewritten: rewritten.into(), graph, obstacle, runs_on_gpu })
    }
}

impl Field for UserField {
    fn sense(&self) -> Sense {
        self.sense
    }

    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
        self.graph().ok_or(NoForm::Cpu)?.values(points, out)
    }

    fn gradients(&self, points: Points<'_>, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        self.graph().ok_or(NoForm::Cpu)?.gradients(points, out)
    }

    fn within(&self, region: [Interval; 3]) -> Within {
        self.graph().map_or(Within { range: ALL, field: None }, |graph| graph.within(region))
    }

    fn as_graph(&self) -> Option<&GraphField> {
        self.graph()
    }

    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        if let Some(graph) = self.graph().filter(|graph| graph.operations() <= MOST_ON_GPU) {
            return graph.wgsl();
        }
        if !self.runs_on_gpu {
            return Err(NoForm::Gpu);
        }
        Ok(Wgsl {
            value: self.rewritten.clone(),
            gradient: None,
            interval: None,
            planes: None,
            data: Arc::default(),
            parameters: Vec::new(),
            counts_loops: true,
        })
    }
}

type Fault = (Option<Span>, String);

fn locate(source: &str, file: &str, span: Option<Span>, message: String) -> UserError {
    let place = span.filter(|s| s.is_defined()).map_or(0, |s| s.location(source).offset as usize);
    let Excerpt { line, column, text } = excerpt(source, place);
    UserError { file: file.into(), line, column, message, excerpt: text }
}

fn validate(module: &Module) -> Result<naga::valid::ModuleInfo, Fault> {
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    validator.validate(module).map_err(|e| {
        // Of the places named, the narrowest: the others are the functions around it.
        let places = e.spans().map(|(span, _)| *span).filter(Span::is_defined);
        let span = places.min_by_key(|s| s.to_range().map_or(0, |r| r.len()));
        // The outer errors name arena handles, the innermost one says what is wrong.
        let mut inner: &dyn std::error::Error = e.as_inner();
        while let Some(source) = inner.source() {
            inner = source;
        }
        (span, reworded(&inner.to_string()))
    })
}

/// naga knows the other floats, and says only that they are not switched on, or no type to cast to.
fn with_float(message: String, place: &str) -> String {
    let names = ["f16", "f64", "FLOAT16", "FLOAT64"];
    if names.iter().any(|name| message.contains(name) || place.contains(name)) {
        message + ": the only floats are `f32`"
    } else {
        message
    }
}

/// The validator's messages speak of arena handles like `Some([3])`; users cannot look those up.
fn reworded(message: &str) -> String {
    if message.contains("`return` expression") {
        return "the value returned is not of the declared type, or the function can end without `return` \
                (put one behind a loop, too)"
            .into();
    }
    let mut out = String::new();
    let mut rest = message;
    while let Some(open) = rest.find('[') {
        let digits = rest[open + 1..].find(|c: char| !c.is_ascii_digit()).unwrap_or(0);
        let is_handle = digits > 0 && rest[open + 1 + digits..].starts_with(']');
        let end = open + if is_handle { digits + 2 } else { 1 };
        out.push_str(if is_handle { rest[..open].trim_end() } else { &rest[..end] });
        rest = &rest[end..];
    }
    out + rest
}

fn check_form(module: &Module, info: &naga::valid::ModuleInfo) -> Result<(), Fault> {
    if let Some(entry) = module.entry_points.first() {
        let message = format!("`{}` is an entry point: write plain functions only", entry.name);
        return Err((None, message));
    }
    if let Some((handle, variable)) = module.global_variables.iter().next() {
        let name = variable.name.as_deref().unwrap_or("a variable");
        let span = module.global_variables.get_span(handle);
        return Err((Some(span), format!("`{name}` is a global variable: use `const` or a local `var`")));
    }
    if let Some((handle, _)) = module.overrides.iter().next() {
        return Err((
            Some(module.overrides.get_span(handle)),
            "`override` is not available: use `const`".into(),
        ));
    }
    for (handle, function) in module.functions.iter() {
        if !info[handle].available_stages.is_all() {
            let name = function.name.as_deref().unwrap_or("a function");
            let message = format!(
                "`{name}` uses what belongs to one kind of shader (discard, derivatives, barriers): leave it out"
            );
            return Err((Some(module.functions.get_span(handle)), message));
        }
    }
    let density = module.functions.iter().find(|(_, f)| f.name.as_deref() == Some("density"));
    let Some((handle, function)) = density else {
        return Err((None, "there is no `fn density(p: vec3<f32>) -> f32`: add it".into()));
    };
    let float = naga::Scalar { kind: naga::ScalarKind::Float, width: 4 };
    let is = |ty: Handle<naga::Type>, wanted: naga::TypeInner| module.types[ty].inner == wanted;
    let point = naga::TypeInner::Vector { size: naga::VectorSize::Tri, scalar: float };
    let takes_point = function.arguments.len() == 1
        && function.arguments[0].binding.is_none()
        && is(function.arguments[0].ty, point);
    let gives_float = function.result.as_ref().is_some_and(|r| is(r.ty, naga::TypeInner::Scalar(float)));
    if !(takes_point && gives_float) {
        let message = "`density` has the wrong signature: write `fn density(p: vec3<f32>) -> f32`".into();
        return Err((Some(module.functions.get_span(handle)), message));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(source: &str) -> UserError {
        UserField::new(source, "blob.wgsl", Sense::Below).expect_err("must be refused")
    }

    #[test]
    fn errors_carry_line_and_column() {
        let e = fault("fn density(p: vec3<f32>) -> f32 {\n    return lenght(p);\n}\n");
        assert_eq!((e.line, e.column), (2, 12), "{e}");
        let e = fault("fn density(p: vec3<f32>) -> f32 {\n  return p * 2.0;\n}\n");
        assert_eq!(e.line, 2, "{e}");
        assert_eq!(e.column, 10, "{e}");
        assert!(!e.message.contains('['), "no arena handles: {e}");
    }

    #[test]
    fn form_is_checked() {
        assert!(fault("fn f() {}").message.contains("no `fn density"));
        assert!(fault("fn density(p: vec2<f32>) -> f32 { return 1.0; }").message.contains("signature"));
        assert!(fault("fn density(p: vec3<f32>) -> vec3<f32> { return p; }").message.contains("signature"));
        let e = fault("var<private> a: f32;\nfn density(p: vec3<f32>) -> f32 { return a; }");
        assert!(e.message.contains("global"));
        let e = fault(
            "@compute @workgroup_size(1) fn main() {}\nfn density(p: vec3<f32>) -> f32 { return 1.0; }",
        );
        assert!(e.message.contains("entry point"));
    }

    #[test]
    fn every_loop_is_counted_and_names_are_prefixed() {
        let source = "
            struct Ball { r: f32 }
            const LIMIT = 3;
            fn is_inside(b: Ball) -> f32 { var t = b.r; loop { t += 1.0; if t > 9.0 { return t; } } return t; }
            fn density(p: vec3<f32>) -> f32 {
                var s = 0.0;
                for (var i = 0; i < LIMIT; i++) { while s < 1.0 { s += is_inside(Ball(p.x)); } }
                return s;
            }";
        let field = UserField::new(source, "a", Sense::Below).unwrap();
        assert_eq!(field.rewritten.matches("break;").count(), 3 + 2, "{}", field.rewritten);
        assert!(field.rewritten.contains("user_is_inside") && field.rewritten.contains("fn density("));
        assert!(!field.rewritten.contains("fn is_inside"));
    }

    #[test]
    fn any_name_may_be_used() {
        let source = "
            fn scale(density: f32, isoforge_iterations: f32) -> f32 { let params = density; var work = params; return work; }
            fn density(p: vec3<f32>) -> f32 { let density = p.x; return scale(density, p.y); }";
        let field = UserField::new(source, "a", Sense::Below).unwrap();
        assert!(
            field.rewritten.contains("fn density(")
                && field.rewritten.contains("var<private> isoforge_iterations")
        );
    }

    #[test]
    fn hostile_sources_are_errors() {
        let body = |text: &str| format!("fn density(p: vec3<f32>) -> f32 {{ return {text}; }}");
        assert!(UserField::new(&body(&vec!["p.x"; 50_000].join("+")), "a", Sense::Below).is_err());
        assert!(UserField::new(&body(&("- ".repeat(20_000) + "p.x")), "a", Sense::Below).is_err());
        assert!(fault(&body("dpdx(p.x)")).message.contains("derivatives"));
        let e = fault("fn density(p: vec3<f32>) -> f32 { if p.x > 0.0 { workgroupBarrier(); } return 1.0; }");
        assert!(e.message.contains("barriers"), "{e}");
        let e = fault(&format!("\t{} x", body(&"p.x + ".repeat(500))));
        assert!(e.excerpt.len() < 300, "{e}");
        assert!(UserField::new(&format!("\u{feff}{}", body("p.x")), "a", Sense::Below).is_ok());
    }
}
