//! A machined part, in millimetres: a block with rounded edges, bosses and ribs, pockets, slots, drilled and
//! countersunk holes. 59 solids.

use isoforge::graph::Expr;
use isoforge::graph::shapes::*;

/// Half the part's size along each axis.
pub const HALF: [f32; 3] = [50.0, 35.0, 20.0];

/// The part; below 0 is inside.
pub fn part() -> Result<Expr, ShapeError> {
    let corners = || [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
    let at = |solid: &Expr, x: f64, y: f64, z: f64| solid.translate([x, y, z]);

    let body = rounded_box([-48.0, -32.0, -12.0], [48.0, 32.0, 8.0], 3.0);
    let boss = cylinder(9.0, 30.0);
    let bosses = [at(&boss, -22.0, 0.0, 0.0), at(&boss, 22.0, 0.0, 0.0)];
    let rib = rounded_box([-20.0, -1.5, 6.0], [20.0, 1.5, 12.0], 1.0);
    let ribs = [rib.clone(), at(&rib, 0.0, 12.0, 0.0), at(&rib, 0.0, -12.0, 0.0)];
    let raised = bosses.into_iter().fold(body, |body, boss| body.smooth_union(boss, 2.0));
    let solid = raised.union(union(ribs));

    let mut cuts = Vec::new();
    // Bores through the bosses, with a groove for a ring.
    for x in [-22.0, 22.0] {
        cuts.push(at(&cylinder(5.0, 60.0), x, 0.0, 0.0));
        cuts.push(at(&torus_distance(5.0, 1.0), x, 0.0, 10.0));
        cuts.push(at(&cone(8.0, 8.0)?.rotate([1.0, 0.0, 0.0], 0.5)?, x, 0.0, 12.0));
    }
    // Countersunk holes in the corners.
    for (x, y) in corners() {
        cuts.push(at(&cylinder(2.5, 60.0), 42.0 * x, 26.0 * y, 0.0));
        cuts.push(at(&frustum(2.5, 5.0, 4.0)?, 42.0 * x, 26.0 * y, 6.5));
    }
    // Pockets from below.
    for (x, y) in corners() {
        cuts.push(at(&rounded_box([-14.0, -6.0, -6.0], [14.0, 6.0, 6.0], 2.0), 20.0 * x, 16.0 * y, -11.0));
    }
    // Slots along the long sides.
    for (x, y) in corners() {
        let slot = capsule([-8.0, 0.0, 0.0], [8.0, 0.0, 0.0], 1.8);
        cuts.push(at(&slot, 22.0 * x, 32.0 * y, 2.0));
    }
    // A row of holes across, and two along, that lead coolant.
    for i in 0..9 {
        let across = infinite_cylinder(1.0).rotate([1.0, 0.0, 0.0], 0.25)?;
        cuts.push(at(&across, -36.0 + 9.0 * f64::from(i), 0.0, -1.5));
    }
    for y in [-1.0, 1.0] {
        let along = infinite_cylinder(1.4).rotate([0.0, 1.0, 0.0], 0.25)?;
        cuts.push(at(&along, 0.0, 21.0 * y, -1.5));
    }
    // Blind holes on a circle about each bore.
    for x in [-22.0, 22.0] {
        for i in 0..6 {
            let (s, c) = (std::f64::consts::TAU * f64::from(i) / 6.0).sin_cos();
            cuts.push(at(&cylinder(0.7, 10.0), x + 7.0 * c, 7.0 * s, 14.0));
        }
    }
    // Dimples that mark the top, and a hollow for a thumb.
    for i in 0..7 {
        cuts.push(at(&sphere(1.5), -12.0 + 4.0 * f64::from(i), 25.0, 8.5));
    }
    cuts.push(at(&ellipsoid([10.0, 4.0, 3.0])?, 0.0, -26.0, 8.0));
    Ok(solid.difference_of(cuts))
}
