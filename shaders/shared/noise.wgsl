// Perlin's gradient noise with gradients along the twelve edges, and its derivatives, in + - *, floor, selects and
// integers alone, so that every driver and the CPU give the same bits. CPU twin, with the same operations in the
// same order: src/field/noise.rs.

fn iso_noise_mixed(hash: u32) -> u32 {
    var h = (hash ^ (hash >> 16u)) * 0x7feb352du;
    h = (h ^ (h >> 15u)) * 0x846ca68bu;
    return h ^ (h >> 16u);
}

struct IsoNoisePlace { number: vec3<u32>, t: vec3<f32>, weight: vec3<f32>, slope: vec3<f32> }

fn iso_noise_placed(p: vec3<f32>) -> IsoNoisePlace {
    // A driver may take a denormal number for zero, which lies in another cell if it is negative.
    let tiny = (bitcast<vec3<u32>>(p) & vec3<u32>(0x7fffffffu)) < vec3<u32>(0x00800000u);
    let x = select(p, vec3<f32>(0.0), tiny);
    let cell = floor(x);
    let t = x - cell;
    let number = bitcast<vec3<u32>>(cell + vec3<f32>(12582912.0));
    let weight = (t * t * t) * (t * (t * 6.0 - 15.0) + 10.0);
    return IsoNoisePlace(number, t, weight, (t * t) * (t * (t * 30.0 - 60.0) + 30.0));
}

fn iso_noise_corner(hash: u32, d: vec3<f32>) -> vec4<f32> {
    let h = iso_noise_mixed(hash);
    // The axis that the gradient is perpendicular to: x, y or z, as h is low, middle or high.
    let low = bitcast<i32>(h) < -715827882;
    let high = bitcast<i32>(h) > 715827882;
    let first_sign = h << 31u;
    let second_sign = (h << 30u) & 0x80000000u;
    let first = bitcast<f32>(bitcast<u32>(select(d.x, d.y, low)) ^ first_sign);
    let second = bitcast<f32>(bitcast<u32>(select(d.z, d.y, high)) ^ second_sign);
    let along_first = bitcast<f32>(0x3f800000u | first_sign);
    let along_second = bitcast<f32>(0x3f800000u | second_sign);
    return vec4<f32>(
        first + second,
        select(along_first, 0.0, low),
        select(select(0.0, along_second, high), along_first, low),
        select(along_second, 0.0, high),
    );
}

fn iso_noise_mix(a: vec4<f32>, b: vec4<f32>, weight: f32, slope: f32, axis: vec3<f32>) -> vec4<f32> {
    let r = a + weight * (b - a);
    return vec4<f32>(r.x, r.yzw + axis * (slope * (b.x - a.x)));
}

fn iso_noise(p: vec3<f32>, seed: u32) -> f32 {
    return iso_noise_gradient(p, seed).x;
}

fn iso_noise_gradient(p: vec3<f32>, seed: u32) -> vec4<f32> {
    let primes = vec3<u32>(0x9e3779b1u, 0x85ebca77u, 0xc2b2ae3du);
    let place = iso_noise_placed(p);
    let a = place.t;
    let b = a - vec3<f32>(1.0);
    let n = place.number * primes;
    let m = n + primes;
    let s = iso_noise_mixed(seed ^ 0x5bd1e995u);
    let u = place.weight;
    let du = place.slope;
    let x = vec3<f32>(1.0, 0.0, 0.0);
    let y = vec3<f32>(0.0, 1.0, 0.0);
    let z = vec3<f32>(0.0, 0.0, 1.0);
    let c000 = iso_noise_corner(s ^ n.x ^ n.y ^ n.z, a);
    let c100 = iso_noise_corner(s ^ m.x ^ n.y ^ n.z, vec3<f32>(b.x, a.y, a.z));
    let c010 = iso_noise_corner(s ^ n.x ^ m.y ^ n.z, vec3<f32>(a.x, b.y, a.z));
    let c110 = iso_noise_corner(s ^ m.x ^ m.y ^ n.z, vec3<f32>(b.x, b.y, a.z));
    let c001 = iso_noise_corner(s ^ n.x ^ n.y ^ m.z, vec3<f32>(a.x, a.y, b.z));
    let c101 = iso_noise_corner(s ^ m.x ^ n.y ^ m.z, vec3<f32>(b.x, a.y, b.z));
    let c011 = iso_noise_corner(s ^ n.x ^ m.y ^ m.z, vec3<f32>(a.x, b.y, b.z));
    let c111 = iso_noise_corner(s ^ m.x ^ m.y ^ m.z, b);
    let e00 = iso_noise_mix(c000, c100, u.x, du.x, x);
    let e10 = iso_noise_mix(c010, c110, u.x, du.x, x);
    let e01 = iso_noise_mix(c001, c101, u.x, du.x, x);
    let e11 = iso_noise_mix(c011, c111, u.x, du.x, x);
    let near = iso_noise_mix(e00, e10, u.y, du.y, y);
    let far = iso_noise_mix(e01, e11, u.y, du.y, y);
    let value = iso_noise_mix(near, far, u.z, du.z, z) * 0.96;

    let magnitudes = bitcast<vec3<u32>>(p) & vec3<u32>(0x7fffffffu);
    let most = max(max(magnitudes.x, magnitudes.y), magnitudes.z);
    // 2^-60: what denormal numbers on the way there change.
    let tiny = (bitcast<vec4<u32>>(value) & vec4<u32>(0x7fffffffu)) < vec4<u32>(0x21800000u);
    let bits = select(bitcast<vec4<u32>>(value), vec4<u32>(0u), tiny | vec4<bool>(most >= 0x4a800000u));
    return bitcast<vec4<f32>>(select(bits, vec4<u32>(0x7fc00000u), vec4<bool>(most > 0x7f800000u)));
}
