use fidget_core::context::Tree;
use fidget_jit::JitShape;
use fidget_mesh::{Octree, Settings};
use std::time::Instant;
fn main() {
    let (x, y, z) = Tree::axes();
    let r = (x.clone().square() + y.clone().square() + z.clone().square()).sqrt();
    let sphere = r.clone() - 0.77f32;
    let bx = x.clone().abs().max(y.clone().abs()).max(z.clone().abs()) - 0.61f32;
    let cube = bx.max(0.75f32 - r.clone());
    let k = 7.0f32;
    let gy = (x.clone()*k).sin()*(y.clone()*k).cos() + (y.clone()*k).sin()*(z.clone()*k).cos() + (z.clone()*k).sin()*(x.clone()*k).cos();
    let gyroid = gy.max(r - 0.83f32);
    for (name, tree) in [("sphere", sphere), ("cube-sphere", cube), ("gyroid", gyroid)] {
        let shape = JitShape::from(tree).try_into().unwrap();
        for depth in 4..=8 {
            let s = Settings { depth, ..Default::default() };
            let mut best = f64::MAX; let mut n = 0; let mut o=0.0;
            for _ in 0..3 {
                let t = Instant::now();
                let oc = Octree::build(&shape, &s).unwrap();
                o = t.elapsed().as_secs_f64();
                let m = oc.walk_dual();
                n = m.triangles.len();
                best = best.min(t.elapsed().as_secs_f64());
            }
            println!("{name} depth {depth}: {n} triangles {:.2} ms (build {:.2})", best*1e3, o*1e3);
        }
    }
}
