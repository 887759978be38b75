//! Frames as limpid means them, from frames in the caller's conventions.

use glam::{Mat4, Vec2, Vec3, Vec4};
use limpid::settings::{Conventions, NdcY, NormalEncoding, RoughnessEncoding};

use crate::sequence::Frame;

/// Turns `y` of clip space around.
pub(super) const FLIPPED: Mat4 = Mat4::from_cols(Vec4::X, Vec4::NEG_Y, Vec4::Z, Vec4::W);

/// Which of a frame's matrices hold columns where rows are expected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Transposed {
    pub(super) view: bool,
    pub(super) projection: bool,
}

/// Matrices that make sense only when read by columns.
pub(super) fn transposed(frame: &Frame) -> Transposed {
    let (view, projection) = (frame.camera.world_to_view, frame.camera.view_to_clip);
    let is_affine = |matrix: Mat4| (matrix.row(3) - Vec4::W).abs().max_element() < 1e-5;
    let divides_by_depth = |matrix: Mat4| {
        let row = matrix.row(3);
        row.truncate().truncate() == Vec2::ZERO && (row.z.abs() - 1.0).abs() < 1e-5 && row.w == 0.0
    };
    let makes_sense = |matrix: Mat4| divides_by_depth(matrix) || is_affine(matrix);
    Transposed {
        view: !is_affine(view) && is_affine(view.transpose()),
        projection: !makes_sense(projection) && makes_sense(projection.transpose()),
    }
}

/// An octahedral map, -1 to 1 (Meyer et al. 2010).
fn octahedral(e: Vec2) -> Vec3 {
    let z = 1.0 - e.x.abs() - e.y.abs();
    let folded = (1.0 - Vec2::new(e.y, e.x).abs()) * Vec2::new(1f32.copysign(e.x), 1f32.copysign(e.y));
    (if z < 0.0 { folded } else { e }).extend(z).normalize_or_zero()
}

fn normal(stored: Vec3, encoding: NormalEncoding) -> Vec3 {
    match encoding {
        NormalEncoding::Unsigned => stored * 2.0 - 1.0,
        NormalEncoding::Octahedral => octahedral(stored.truncate()),
        NormalEncoding::OctahedralUnsigned => octahedral(stored.truncate() * 2.0 - 1.0),
        _ => stored,
    }
}

/// Decodes what is encoded, scales motion vectors, and turns clip space and matrices the right way.
pub(super) fn conform(mut frame: Frame, previous: Option<&Frame>, conventions: &Conventions) -> Frame {
    let turned = transposed(&frame);
    let camera = &mut frame.camera;
    if turned.view {
        camera.world_to_view = camera.world_to_view.transpose();
    }
    if turned.projection {
        camera.view_to_clip = camera.view_to_clip.transpose();
    }
    if conventions.ndc_y == NdcY::Down {
        camera.view_to_clip = FLIPPED * camera.view_to_clip;
    }
    for depth in frame.depth.iter_mut().filter(|depth| **depth >= conventions.sky_distance) {
        *depth = 0.0;
    }
    if conventions.normal != NormalEncoding::Signed {
        for stored in &mut frame.normal {
            *stored = normal(Vec3::from(*stored), conventions.normal).to_array();
        }
    }
    if conventions.roughness == RoughnessEncoding::Alpha {
        frame.roughness.iter_mut().for_each(|roughness| *roughness = roughness.sqrt());
    }
    let jitter = previous.map_or(Vec2::ZERO, |previous| frame.camera.jitter - previous.camera.jitter);
    // A jittered image moves against the jitter.
    let offset = if conventions.motion_includes_jitter { jitter / frame.size.as_vec2() } else { Vec2::ZERO };
    for motion in &mut frame.motion {
        *motion = (Vec2::from(*motion) * conventions.motion_scale + offset).to_array();
    }
    frame
}
