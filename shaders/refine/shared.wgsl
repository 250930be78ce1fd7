// What the refiner's shaders share: its settings, what it counts, and lengths of vectors.

// `Refining` in src/refine/gpu/params.rs, field by field.
struct Refining {
    // The box at whose faces the mesh was cut off, if there is one, and how near a face counts as on it.
    low: vec3<f32>,
    // The step of central differences.
    delta: f32,
    high: vec3<f32>,
    iso: f32,
    near: vec3<f32>,
    // 1 where the inside is below iso, -1 where it is above.
    sign: f32,
    // What makes `density_gradient` the gradient of the signed values.
    slope: f32,
    epsilon: f32,
    // The longest step.
    longest: f32,
    flatness: f32,
    // The sine of half the angle that counts as flat, halved.
    least: f32,
    has_border: u32,
    // 0, which no compiler knows.
    nothing: u32,
    // 2, which no compiler knows.
    twice: u32,
    // Of the mesh before the level.
    vertices: u32,
    triangles: u32,
    // The first vertex that is placed, and how many are.
    first: u32,
    tasks: u32,
}

// `Counted` in src/refine/gpu/params.rs, field by field.
struct Counted {
    // Not 0 once a round of those that run until nothing changes has changed something.
    changed: atomic<u32>,
    // Edges that are not flat.
    bent: atomic<u32>,
    // Not 0 if a vertex has more edges than are sorted.
    crowded: atomic<u32>,
    // Not 0 if an invocation's loops were ended from outside.
    cut_short: atomic<u32>,
    // Not 0 once a loop of the user's WGSL was stopped.
    runaway: atomic<u32>,
    not_converged: atomic<u32>,
    singular: atomic<u32>,
    // Vertices that reached another sheet, and those that turned a triangle over.
    astray: atomic<u32>,
    taken_back: atomic<u32>,
    // Triangles that name a vertex twice.
    improper: atomic<u32>,
    // The lowest vertex that is not finite, the lowest without a normal, the lowest triangle that names a vertex which
    // does not exist; all ones if there is none.
    not_finite: atomic<u32>,
    without_normal: atomic<u32>,
    bad_triangle: atomic<u32>,
}

@group(0) @binding(0) var<uniform> params: Refining;
@group(0) @binding(1) var<storage, read_write> work: Counted;

// What stands for the midpoint of an edge that is not split.
const NONE = 0xffffffffu;

// What is known of a vertex: it lies on the surface; it was moved in the round before; it turns a triangle over.
const PLACED = 1u;
const MOVED = 2u;
const BAD = 4u;

fn item_of(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.y * groups.x * 64u + id.x;
}

fn inner(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return (a.x * b.x + a.y * b.y) + a.z * b.z;
}

// The length of a vector; 0 below LEAST_GRADIENT. CPU twin: `length` in src/field/unit.rs.
fn long(v: vec3<f32>) -> f32 {
    let most = largest(v);
    if most < LEAST_GRADIENT {
        return 0.0;
    }
    let scaled = v / most;
    return most * sqrt(inner(scaled, scaled));
}

// A vector that has a direction, at unit length.
fn direction_of(v: vec3<f32>) -> vec3<f32> {
    let scaled = v / largest(v);
    let direction = scaled / sqrt(inner(scaled, scaled));
    return select(direction, vec3<f32>(0.0), direction == vec3<f32>(0.0));
}
