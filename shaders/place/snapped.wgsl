// Vertices where the field itself crosses iso, within `call.epsilon`: the secant's place and the middle of what is left by
// turns, each with a look `near` further on, which closes the bracket once the place is good. CPU twin: src/stage/emit/cpu/snap.rs.

const CENTRES_MOVE = true;
const MOST_STEPS = 32u;
// 2⁻²²: less does not show beside a whole number.
const LEAST_NEAR = 0x1p-22f;
// 2⁻²⁰. A corner that is taken in place of an earlier one is nearer by this much at least, of squares: of near ties the first, whether a
// driver contracts sums or not.
const NEARER = 0x1p-20f;
// How far apart on its line the field is looked at for a vertex within a cell, in grid steps along the axis that the line goes along
// most, and how often on either side.
const LOOK_STEP = 0.125;
const LOOKS = 6u;
// From the cell's faces such a vertex stays this far on the gradient's line, in grid steps.
const MARGIN = 0.015625;

// What is left of a line: fractions of it on either side of iso, and the values there.
struct Bracket {
    low: f32,
    high: f32,
    at_low: f32,
    at_high: f32,
}

// The fraction of the line from `p` on, `way` in grid steps, at which the field crosses iso within a bracket.
fn crossing_on(p: vec3<f32>, way: vec3<f32>, bracket: Bracket) -> f32 {
    var left = bracket;
    let step = (params.step_x * way.x + params.step_y * way.y) + params.step_z * way.z;
    // No longer than the line is long; where a border is closed there is nothing to look for.
    let near = select(
        max(0.5 * call.epsilon / ((abs(step.x) + abs(step.y)) + abs(step.z)), LEAST_NEAR),
        1.0,
        is_beyond(left.at_low, left.at_high),
    );
    let inside_low = is_inside(bitcast<u32>(left.at_low));
    var t = 0.0;
    // Both looks of a step are one call: kernels take the longer to compile the more of them there are.
    for (var i = 0u; i < 2u * MOST_STEPS; i++) {
        if (i & 1u) == 0u {
            if !(left.high - left.low > 2.0 * near) {
                break;
            }
            t = left.low + (left.high - left.low) * select(crossing(left.at_low, left.at_high), 0.5, (i & 2u) == 2u);
        }
        let v = density(domain_position(p + way * t));
        if is_inside(bitcast<u32>(v)) == inside_low {
            left.low = t;
            left.at_low = v;
            t = min(t + near, left.high);
        } else {
            left.high = t;
            left.at_high = v;
            t = max(t - near, left.low);
        }
    }
    return left.low + (left.high - left.low) * crossing(left.at_low, left.at_high);
}

fn fraction(owner: vec3<u32>, across: vec3<u32>, a: u32, b: u32) -> f32 {
    return crossing_on(vec3<f32>(owner) - params.margin, vec3<f32>(across), Bracket(0.0, 1.0, bitcast<f32>(a), bitcast<f32>(b)));
}

// How far a vertex within a cell may go.
fn reach(within: vec3<f32>, way: vec3<f32>) -> f32 {
    let room = (select(within, vec3<f32>(1.0) - within, way > vec3<f32>(0.0)) - MARGIN) / max(abs(way), vec3<f32>(LEAST_NEAR));
    return max(min(room.x, min(room.y, room.z)), 0.0);
}

// Moves a vertex within a cell to where the field crosses iso: to the nearest crossing that is found in the cell on the line
// through it along `outward`, and where none is, on the segment to the nearest corner of the other side, which always has
// one. In grid steps in the domain. A cell beyond a closed border has no such vertex: one of its faces is outside altogether.
fn snap_within(slot: u32, origin: vec3<u32>, cell: vec3<u32>, within: vec3<f32>, outward: vec3<f32>) -> vec3<f32> {
    let p = (vec3<f32>(origin + cell) - params.margin) + within;
    let forth = line_of(outward);
    let reaches = vec2<f32>(reach(within, -forth), reach(within, forth));
    // First where it is, then by turns on either side.
    var way = forth;
    var t = 0.0;
    var v_here = 0.0;
    var before = vec2<f32>(0.0);
    var v_there = 0.0;
    var look = 0u;
    for (; look <= 2u * LOOKS; look++) {
        let side = look & 1u;
        way = select(-forth, forth, side == 1u);
        t = min(f32((look + 1u) / 2u) * LOOK_STEP, reaches[side]);
        v_here = density(domain_position(p + way * t));
        if look == 0u {
            before = vec2<f32>(v_here);
            v_there = v_here;
        }
        if is_inside(bitcast<u32>(v_here)) != is_inside(bitcast<u32>(v_there)) {
            break;
        }
        before[side] = v_here;
    }
    let last = f32((max(look, 1u) - 1u) / 2u) * LOOK_STEP;
    var bracket = Bracket(last, t, before[look & 1u], v_here);
    if look > 2u * LOOKS {
        let corner = nearest_corner(slot, origin, cell, within, !is_inside(bitcast<u32>(v_there)));
        way = vec3<f32>(corner) - within;
        bracket = Bracket(0.0, 1.0, v_there, bitcast<f32>(sample_bits(slot, origin, cell + corner)));
    }
    return p + way * crossing_on(p, way, bracket);
}

// The line along a vector of the world, in grid steps, of which the longest is one; zero where there is no direction.
fn line_of(outward: vec3<f32>) -> vec3<f32> {
    let v = unit(select(vec3<f32>(1.0), outward, has_direction(outward)));
    // What takes gradients to the world, the other way round, is the inverse of the grid's steps.
    let along = vec3<f32>(
        (params.outward_x.x * v.x + params.outward_x.y * v.y) + params.outward_x.z * v.z,
        (params.outward_y.x * v.x + params.outward_y.y * v.y) + params.outward_y.z * v.z,
        (params.outward_z.x * v.x + params.outward_z.y * v.y) + params.outward_z.z * v.z,
    ) * call.outward_sign;
    if !(has_direction(outward) && has_direction(along)) {
        return vec3<f32>(0.0);
    }
    return along / largest(along);
}

// The corner on a side that is nearest to a place, of several the first.
fn nearest_corner(slot: u32, origin: vec3<u32>, cell: vec3<u32>, within: vec3<f32>, side: bool) -> vec3<u32> {
    var nearest = vec3<u32>(0u);
    // Farther than any.
    var least = 4.0;
    for (var k = 0u; k < 8u; k++) {
        let corner = vec3<u32>(k, k >> 1u, k >> 2u) & vec3<u32>(1u);
        let way = vec3<f32>(corner) - within;
        let length = (way.x * way.x + way.y * way.y) + way.z * way.z;
        if is_inside(sample_bits(slot, origin, cell + corner)) == side && length < least - NEARER {
            nearest = corner;
            least = length;
        }
    }
    return nearest;
}
