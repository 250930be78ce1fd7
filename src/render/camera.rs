//! The camera: fits a box into the frame from any side.

use super::RenderError;
use glam::{DMat3, DVec3, Mat3, Mat4, Vec3, Vec4};

/// The longest side a picture can have.
pub const MAX_SIDE: u32 = 16384;
/// The most pixels a picture can have.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Bytes that drawing a picture takes at most beside the mesh, its lines and, on the CPU, its projection.
pub fn picture_bytes([width, height]: [u32; 2], on_gpu: bool) -> u64 {
    let pixels = u64::from(width) * u64::from(height);
    if on_gpu {
        // 4 samples of colour and depth and the picture; its rows in a buffer, on their way, and here.
        return pixels * (4 * (4 + 4) + 4)
            + 3 * 4 * u64::from(height) * u64::from(width).next_multiple_of(64);
    }
    // The picture and its file; the samples of a band of rows for each thread.
    pixels * (4 + 4) + super::software::band_bytes(width) * rayon::current_num_threads() as u64
}

/// The part of the frame's half width and height that the box may fill.
const FILL: f64 = 0.96;

/// From where to look, and how large the picture is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Degrees around the z axis, which points up in the picture. 0 looks from +x towards the
    /// centre, 90 from +y.
    pub azimuth: f32,
    /// Degrees above the xy plane; 90 looks straight down.
    pub elevation: f32,
    /// Vertical field of view in degrees, 1 to 150.
    pub fov: f32,
    /// Pixels across and down.
    pub size: [u32; 2],
}

impl Default for View {
    fn default() -> Self {
        Self { azimuth: 30.0, elevation: 25.0, fov: 35.0, size: [1024, 768] }
    }
}

/// A perspective camera outside the box that it looks at.
///
/// Drawing happens in camera units, in which the box is about 1 large, relative to the eye: neither
/// tiny and huge boxes nor boxes far from the origin lose precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    pub(super) size: [u32; 2],
    pub(super) eye: Vec3,
    /// Camera units per world unit.
    pub(super) scale: f32,
    /// From camera units relative to the eye (world axes) to clip space, depth 0 to 1.
    pub(super) clip: Mat4,
    /// Right, up and backwards, as world vectors.
    pub(super) axes: Mat3,
}

impl Camera {
    /// The camera that shows all of the box `bounds` (two opposite corners), as large as the frame
    /// allows with a small margin. `None`, an empty mesh, counts as the unit box around the origin.
    ///
    /// # Errors
    /// [`RenderError::Size`], [`RenderError::Angle`], [`RenderError::Bounds`].
    pub fn fit(bounds: impl Into<Option<(Vec3, Vec3)>>, view: &View) -> Result<Self, RenderError> {
        check(view)?;
        let (a, b) = bounds.into().unwrap_or((Vec3::splat(-0.5), Vec3::splat(0.5)));
        if !a.is_finite() || !b.is_finite() {
            return Err(RenderError::Bounds);
        }
        let (a, b) = (a.as_dvec3(), b.as_dvec3());
        let centre = (a + b) * 0.5;
        let mut half = (b - a).abs() * 0.5;
        if half.max_element() == 0.0 && centre == DVec3::ZERO {
            half = DVec3::splat(1.0);
        }
        // Below this, neighbouring f32 positions would be visibly apart, or `scale` overflow.
        let least = (centre.length() * 1e-6).max(1e-30);
        if half.max_element() < least {
            half = DVec3::splat(least);
        }
        let unit = half.length();
        let half = half / unit;

        let axes = axes(view);
        let slope = (f64::from(view.fov).to_radians() * 0.5).tan();
        let aspect = f64::from(view.size[0]) / f64::from(view.size[1]);
        let corners: [DVec3; 8] = std::array::from_fn(|i| {
            let sign = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
            axes.transpose() * (half * DVec3::new(sign(1), sign(2), sign(4)))
        });
        let highest = |f: &dyn Fn(DVec3) -> f64| corners.iter().map(|&c| f(c)).fold(f64::MIN, f64::max);
        // A corner c is in the frame if |c.x| ≤ t (distance − c.z), and so for y. Aiming at the
        // centre, instead of where the corners would be balanced, is what looks right for round
        // meshes, which fill no corner.
        let along = |axis: usize, t: f64| highest(&|c| c[axis].abs() / t + c.z);
        let (wide, tall) = (along(0, FILL * slope * aspect), along(1, FILL * slope));
        // The last keeps the eye outside a box that is thin across the view, such as a line.
        let distance = wide.max(tall).max(highest(&|c| c.z) + 0.05);

        let eye = (centre + axes.z_axis * (distance * unit)).as_vec3();
        let scale = unit.recip() as f32;
        if !eye.is_finite() || !scale.is_normal() || unit > 1e37 {
            return Err(RenderError::Bounds);
        }
        // Room in front and behind, for meshes that stick out of the box.
        let near = 0.5 * (distance - highest(&|c| c.z));
        let far = 2.0 * (distance + highest(&|c| -c.z));
        let projection = glam::dcamera::rh::proj::directx::perspective(
            f64::from(view.fov).to_radians(),
            aspect,
            near,
            far,
        );
        let clip = projection * glam::DMat4::from_mat3(axes.transpose());
        Ok(Self { size: view.size, eye, scale, clip: clip.as_mat4(), axes: axes.as_mat3() })
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Where the camera stands, in world units.
    pub fn eye(&self) -> Vec3 {
        self.eye
    }

    /// Homogeneous clip coordinates of a world position: x right, y up, depth 0 (near) to 1 (far)
    /// after division by w; in the frame from −1 to 1.
    pub fn project(&self, position: Vec3) -> Vec4 {
        self.clip * self.ray(position).extend(1.0)
    }

    /// A world position relative to the eye, in camera units.
    #[inline]
    pub(super) fn ray(&self, position: Vec3) -> Vec3 {
        (position - self.eye) * self.scale
    }

    /// Directions to the key and the fill light, which move with the camera.
    pub(super) fn lights(&self) -> (Vec3, Vec3) {
        let to_world = |v: Vec3| (self.axes * v.normalize()).normalize();
        (to_world(Vec3::new(-0.55, 0.65, 0.75)), to_world(Vec3::new(0.85, -0.05, 0.45)))
    }
}

/// Columns: right, up, backwards. From the angles themselves, so looking straight down is no
/// special case.
fn axes(view: &View) -> DMat3 {
    let (sa, ca) = f64::from(view.azimuth).to_radians().sin_cos();
    let (se, ce) = f64::from(view.elevation).to_radians().sin_cos();
    DMat3::from_cols(
        DVec3::new(-sa, ca, 0.0),
        DVec3::new(-se * ca, -se * sa, ce),
        DVec3::new(ce * ca, ce * sa, se),
    )
}

/// Whether a picture can be made so.
pub(crate) fn check(view: &View) -> Result<(), RenderError> {
    let [width, height] = view.size;
    let sides = 1..=MAX_SIDE;
    if !sides.contains(&width)
        || !sides.contains(&height)
        || u64::from(width) * u64::from(height) > MAX_PIXELS
    {
        return Err(RenderError::Size { width, height });
    }
    let turn = "a number from -36000 to 36000";
    for (what, degrees) in [("azimuth", view.azimuth), ("elevation", view.elevation)] {
        if !(-36000.0..=36000.0).contains(&degrees) {
            return Err(RenderError::Angle { what, degrees, range: turn });
        }
    }
    if !(1.0..=150.0).contains(&view.fov) {
        return Err(RenderError::Angle { what: "field of view", degrees: view.fov, range: "1 to 150" });
    }
    Ok(())
}
