//! What a user should know and do.

use limpid::Settings;
use limpid::settings::{Conventions, NdcY};
use serde_json::json;

use super::conform::Transposed;
use super::content::PUBLISHED_THRESHOLD;
use super::geometry::{DepthMeaning, EXPECTED, MatrixTiming, NormalMeaning};
use super::recommend::{Change, number};
use super::{CameraMeaning, Content, Finding, Geometry, Motion, Severity, percent};

fn finding(severity: Severity, found: impl Into<String>, advice: impl Into<String>) -> Finding {
    Finding { severity, found: found.into(), advice: advice.into() }
}

pub(super) fn findings(
    content: &Content,
    geometry: &Geometry,
    motion: &Motion,
    given: &Settings,
    exposure: f32,
) -> Vec<Finding> {
    let mut all = Vec::new();
    all.extend(geometry_findings(geometry));
    all.extend(motion_findings(motion, &given.conventions));
    all.extend(value_findings(content, exposure));
    if lacks_normals(content, given) {
        let advice =
            "write normal.X, .Y and .Z, or leave the feature normal_input out, with which they are derived from depth";
        all.push(finding(Severity::Error, "there are no normals", advice));
    }
    all.extend(cost_findings(content));
    all
}

/// Whether normals are to be read and there are none.
fn lacks_normals(content: &Content, given: &Settings) -> bool {
    given.features.normal_input && content.normals_zero >= 1.0
}

fn geometry_findings(geometry: &Geometry) -> Vec<Finding> {
    let mut all = Vec::new();
    if geometry.samples < 100 {
        return all;
    }
    if geometry.y_down {
        let found = "the projection matrices look as if clip space had y the other way";
        let advice = "negate their second row, or set conventions.ndc_y";
        all.push(finding(Severity::Error, found, advice));
    }
    let (share, best) = (percent(geometry.agreement), percent(geometry.best_agreement));
    if geometry.best.depth != EXPECTED.depth {
        let what = match geometry.best.depth {
            DepthMeaning::Linear => "distance along the view axis",
            DepthMeaning::RayDistance => "distance along the ray, not along the view axis",
            DepthMeaning::Device => "a depth buffer, not a distance",
            DepthMeaning::ReversedDevice => "a reversed depth buffer, not a distance",
        };
        let found = format!("depth looks like {what}: then {best} of normals fit the surface, as it is {share}");
        let advice = match geometry.best.depth {
            DepthMeaning::RayDistance => "multiply it by the cosine between ray and view axis before writing it",
            _ => "write linear depth; in your own renderer set conventions.depth to what it is",
        };
        all.push(finding(Severity::Error, found, advice));
    }
    if geometry.best.normal != EXPECTED.normal {
        let (what, advice) = match geometry.best.normal {
            NormalMeaning::World => ("world-space normals", ""),
            NormalMeaning::View => ("view-space normals", "rotate them by the inverse of the view matrix"),
            NormalMeaning::WorldUnsigned => {
                ("world-space normals times 0.5 plus 0.5", "set conventions.normal to \"unsigned\"")
            }
            NormalMeaning::ViewUnsigned => (
                "view-space normals times 0.5 plus 0.5",
                "rotate them by the inverse of the view matrix after n * 2 - 1",
            ),
            NormalMeaning::Inward => ("normals that point into the surface", "negate them"),
        };
        // Shares are of normals that fit roughly.
        let fit = match geometry.best_agreement > geometry.agreement + 0.02 {
            true => format!("then {best} fit the surface, as they are {share}"),
            false => {
                let [other, own] = [geometry.apart.view, geometry.apart.own].map(f64::to_degrees);
                format!("then they are off by {other:.2} degrees at the median, as they are by {own:.2}")
            }
        };
        let found = format!("normals look like {what}: {fit}");
        all.push(finding(Severity::Error, found, advice));
    }
    let [own, before, after] = geometry.apart.turned.unwrap_or_default().map(f64::to_degrees);
    let timing = match geometry.matrices {
        MatrixTiming::Own => None,
        MatrixTiming::FrameBefore => Some(("before", before)),
        MatrixTiming::FrameAfter => Some(("after", after)),
    };
    if let Some((whose, angle)) = timing {
        let found = format!(
            "the view matrices look like those of the frame {whose}: then normals are off by {angle:.2} degrees at the \
             median, as they are by {own:.2}"
        );
        all.push(finding(Severity::Error, found, "write the matrices that the frame's own images were rendered with"));
    }
    if geometry.best == EXPECTED && geometry.agreement < 0.5 {
        let found = format!("only {share} of normals are those of the surface that the depth describes");
        let advice = "check depth, normals and the projection matrix; very bumpy normals can be the reason too";
        all.push(finding(Severity::Warning, found, advice));
    }
    all
}

fn motion_findings(motion: &Motion, conventions: &Conventions) -> Vec<Finding> {
    let mut all = Vec::new();
    let as_is = percent(1.0 - motion.mismatch);
    if motion.best_factor != glam::Vec2::ONE {
        let scale = motion.best_factor * conventions.motion_scale;
        let why = if motion.best_factor.abs().max_element() < 0.2 {
            "they look like pixels"
        } else if motion.best_factor == glam::Vec2::NEG_ONE {
            "they point the other way"
        } else if motion.best_factor.abs() == glam::Vec2::ONE {
            "one axis points the other way"
        } else {
            "they look like normalised device coordinates"
        };
        let found = format!(
            "motion vectors lead to the same surface for {} of what moves; times ({}, {}) for {}: {why}",
            percent(1.0 - motion.moving_mismatch),
            motion.best_factor.x,
            motion.best_factor.y,
            percent(1.0 - motion.best_mismatch)
        );
        let advice = format!("set conventions.motion_scale to [{}, {}]", scale.x, scale.y);
        all.push(finding(Severity::Error, found, advice));
    } else if motion.samples > 100 && motion.mismatch > 0.4 {
        let found = format!("motion vectors lead to the same surface for only {as_is} of pixels");
        let advice = "no other sign or scale fits better: check that they are uv now minus uv before, of this frame";
        all.push(finding(Severity::Warning, found, advice));
    }
    let residual = motion.camera_residual.unwrap_or(0.0);
    match motion.camera {
        CameraMeaning::ViewInverted => all.push(finding(
            Severity::Error,
            "the view matrices look like view to world",
            "write their inverse: clip = proj * view * world",
        )),
        CameraMeaning::AsExpected if residual > 1.0 && motion.best_factor == glam::Vec2::ONE => {
            let found = format!("cameras and motion vectors disagree by {residual:.1} pixels at the median");
            let advice = "mirror reflections follow the cameras: check that each frame has its own matrices, in full \
                          precision";
            all.push(finding(Severity::Warning, found, advice));
        }
        CameraMeaning::AsExpected => {}
    }
    if motion.includes_jitter && !conventions.motion_includes_jitter {
        let advice = "set conventions.motion_includes_jitter to true";
        all.push(finding(Severity::Error, "motion vectors contain the camera's jitter", advice));
    }
    for number in &motion.unmarked_cuts {
        let found = format!("frame {number} continues nothing that the one before shows");
        all.push(finding(
            Severity::Error,
            found,
            "mark it with \"reset\": true, or history of another place is looked for",
        ));
    }
    for number in &motion.needless_resets {
        let found = format!("frame {number} is marked as reset and continues the one before");
        all.push(finding(Severity::Note, found, "without the mark it would keep its history"));
    }
    all
}

fn value_findings(content: &Content, exposure: f32) -> Vec<Finding> {
    use Severity::{Note, Warning};
    let mut all = Vec::new();
    if content.not_finite > 0 {
        let found = format!("{} values are NaN or infinite", content.not_finite);
        all.push(finding(
            Warning,
            found,
            "they are contained at their pixel, which counts as black or as sky; find their cause",
        ));
    }
    if content.normals_zero > 0.0 && content.normals_zero < 1.0 {
        let found = format!("{} of surfaces have a normal of length 0", percent(content.normals_zero));
        all.push(finding(Warning, found, "such pixels count as sky"));
    }
    if content.normals_not_unit > 0.02 && content.normals_zero < 1.0 {
        let found = format!("{} of normals are not of unit length", percent(content.normals_not_unit));
        all.push(finding(Note, found, "they are normalised; check that they are not filtered or of another encoding"));
    }
    if content.roughness_out_of_range > 0.0 {
        let found =
            format!("roughness of {} of surfaces is not within 0 and 1", percent(content.roughness_out_of_range));
        all.push(finding(Warning, found, "it is clamped; check channel and encoding"));
    }
    if content.negative_radiance > 0.0 {
        let found = format!("radiance of {} of surfaces is negative", percent(content.negative_radiance));
        all.push(finding(Warning, found, "it counts as 0, which brightens; radiance cannot be negative"));
    }
    if content.hit_distance_missing > 0.5 {
        let found = format!("{} of surfaces have no hit distance", percent(content.hit_distance_missing));
        all.push(finding(Warning, found, "mirror reflections smear without: write it into the alpha of the radiance"));
    }
    let ([near_hit, ..], [_, median_depth, _]) = (content.hit_distance, content.depth);
    if near_hit > 0.0 && near_hit < 0.01 * median_depth {
        let found = format!(
            "a quarter of all hit distances are below {near_hit:.3}, and half of all surfaces {median_depth:.1} away"
        );
        all.push(finding(Warning, found, "hit distances look scaled: write them in world units, as depth"));
    }
    let exposed = content.mean_radiance * f64::from(exposure);
    if exposed > 0.0 && !(0.03..=30.0).contains(&exposed) {
        let found = format!("exposed radiance is {exposed:.4} on average; constants were tuned near 1");
        all.push(finding(Warning, found, format!("set the exposure to about {:.3}", 0.5 / content.mean_radiance)));
    }
    let [_, median, _] = content.depth;
    if median > 200.0 || (median > 0.0 && median < 0.05) {
        let found = format!(
            "half of all surfaces are nearer than {median:.3} units; the published pipeline was tuned in metres"
        );
        let advice = "with preset reference, if a unit is u metres, set prefilter.depth_falloff to 4 * u * u";
        all.push(finding(Note, found, advice));
    }
    all
}

fn cost_findings(content: &Content) -> Vec<Finding> {
    let mut all = Vec::new();
    if content.rough > 0.3 {
        let found = format!(
            "{} of pixels are rougher than {PUBLISHED_THRESHOLD:.3}, where reflections look like diffuse light",
            percent(content.rough)
        );
        let advice = format!(
            "with coverage.roughness_threshold = {PUBLISHED_THRESHOLD:.3} and another source of light there, {} of tiles \
             cost nothing but a look at them",
            percent(content.tiles_above_published_threshold)
        );
        all.push(finding(Severity::Note, found, advice));
    }
    all
}

/// Matrices that hold columns where rows are expected.
pub(super) fn transposed(which: Transposed) -> Vec<Finding> {
    let advice = "write them row by row for column vectors (clip = proj * view * world); the rest was looked at with \
                  them turned";
    let all = [(which.view, "view"), (which.projection, "projection")];
    let all = all.into_iter().filter(|(is_it, _)| *is_it);
    all.map(|(_, name)| finding(Severity::Error, format!("the {name} matrices are transposed"), advice)).collect()
}

/// Settings that mend what was found.
pub(super) fn mends(content: &Content, geometry: &Geometry, motion: &Motion, given: &Settings) -> Vec<Change> {
    let mut changes = Vec::new();
    let mut mend = |setting: &str, value, because: &str| {
        changes.push(Change::new(&format!("conventions.{setting}"), value, because, "the data is encoded so"));
    };
    let conventions = &given.conventions;
    if motion.best_factor != glam::Vec2::ONE {
        let scale = motion.best_factor * conventions.motion_scale;
        mend("motion_scale", json!([number(scale.x), number(scale.y)]), "then they lead to the same surface");
    }
    if motion.includes_jitter && !conventions.motion_includes_jitter {
        mend("motion_includes_jitter", json!(true), "motion vectors contain the camera's jitter");
    }
    if geometry.best.normal == NormalMeaning::WorldUnsigned {
        mend("normal", json!("unsigned"), "then normals are those of the surface");
    }
    if geometry.y_down {
        let other = if conventions.ndc_y == NdcY::Up { "down" } else { "up" };
        mend("ndc_y", json!(other), "then normals are those of the surface");
    }
    if lacks_normals(content, given) {
        changes.push(Change::off("normal_input", "there are no normals", "depth is as precise as 32 bits are"));
    }
    changes
}
