// In place of nearest.wgsl where a driver's own quotients and roots are the nearest floats.

fn iso_nearest_quotient(a: f32, b: f32, from_driver: f32) -> f32 {
    return from_driver;
}

fn iso_nearest_root(x: f32, from_driver: f32) -> f32 {
    return from_driver;
}
