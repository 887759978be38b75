// The footprint of the specular lobe on screen: around a pixel, those that reflect nearly the same light.

import package::shared::frame;
import package::shared::packing;

// How far a tap may lie from the plane of the surface, as a share of depth.
const PLANE_TOLERANCE: f32 = 0.008;
// Smallest angle, in radians, that normals may differ by; rough surfaces tolerate GGX alpha.
const NORMAL_TOLERANCE: f32 = 0.04;
// How much roughness may differ: a share of it, and a constant.
const ROUGHNESS_SHARE: f32 = 0.35;
const ROUGHNESS_FLOOR: f32 = 0.02;

// Hit shares further apart belong to different things; between blocks, whose shares are means: contact shadows of a light
// that is far away end sharply.
const SHARE_TOLERANCE: f32 = 0.3;
const BLOCK_SHARE_TOLERANCE: f32 = 0.15;

// Half axes in pixels, and the direction of the longer one.
struct Footprint {
    axis: vec2<f32>,
    along: f32,
    across: f32,
}

// Hit distance as the caller has it, in bounds; 0, for not known, where it is no number or not positive.
fn usable_hit_distance(distance: f32) -> f32 {
    let is_known = is_finite(distance) || bitcast<u32>(distance) == 0x7f800000u;
    return select(0.0, clamp(distance, 0.0, 1e30), is_known);
}

// How far the reflected point is, as a share of the whole way: hit distance over hit distance plus distance to
// the camera. The share of a ray that hits nothing is 1.
fn hit_share(hit_distance: f32, camera_distance: f32) -> f32 {
    return clamp(hit_distance / (hit_distance + camera_distance), 0.0, 1.0);
}

// Hit distance of a share, bounded by a few hundred times the camera's.
fn hit_distance_of(share: f32, camera_distance: f32) -> f32 {
    let bounded = min(share, 0.9985);
    return bounded / (1.0 - bounded) * camera_distance;
}

// Distance to the camera; finite however far.
fn camera_distance_of(position: vec3<f32>) -> f32 {
    let magnitude = max(max(abs(position.x), abs(position.y)), max(abs(position.z), 1e-30));
    return length(position / magnitude) * magnitude;
}

// Lobes are GGX alpha wide. A half vector that leans by an angle turns the reflected ray by twice that in the
// plane of incidence, by twice its cosine across: at grazing angles reflections are streaks.
fn lobe_footprint(position: vec3<f32>, guide: Guide, share: f32) -> Footprint {
    let cosine = saturate(dot(-view_direction(position), guide.normal));
    let right = (frame.world_from_pixel * vec4<f32>(1.0, 0.0, 0.0, 0.0)).xyz;
    let down = (frame.world_from_pixel * vec4<f32>(0.0, 1.0, 0.0, 0.0)).xyz;
    let leaning = vec2<f32>(dot(guide.normal, normalize(right)), dot(guide.normal, normalize(down)));
    let size = length(leaning);
    let reach = select(share, hit_distance_of(share, camera_distance_of(position)), frame.clip_w.y == 0.0);
    var footprint: Footprint;
    footprint.axis = select(vec2<f32>(1.0, 0.0), leaning / max(size, 1e-6), size > 1e-4);
    footprint.along = frame.pixels_per_unit * alpha_of(guide.roughness) * reach;
    footprint.across = footprint.along * max(cosine, frame.grazing_width);
    return footprint;
}

fn side_of(axis: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(-axis.y, axis.x);
}

// What taps are compared with: a surface, and how much each difference counts.
struct Plane {
    normal: vec3<f32>,
    // Distance from the plane of a position given as (x w, y w, depth, 1), in multiples of what is tolerated.
    distance: vec4<f32>,
    normal_scale: f32,
    roughness: f32,
    roughness_scale: f32,
}

fn plane_of(guide: Guide, position: vec3<f32>) -> Plane {
    return plane_within(guide, position, NORMAL_TOLERANCE);
}

// `normal_tolerance`: smallest angle, in radians, that normals may differ by.
fn plane_within(guide: Guide, position: vec3<f32>, normal_tolerance: f32) -> Plane {
    // Of surfaces that are next to nothing away it would be infinite. A quotient of constants, as DXC makes one of
    // 1 / (PLANE_TOLERANCE * depth), which rounds otherwise.
    let tolerance = (1.0 / PLANE_TOLERANCE) / max(guide.depth, 1e-30);
    let offset = vec4<f32>(0.0, 0.0, 0.0, dot(guide.normal, position));
    let lobe = 1.0 / max(alpha_of(guide.roughness), normal_tolerance);
    var plane: Plane;
    plane.normal = guide.normal;
    plane.distance = (vec4<f32>(guide.normal, 0.0) * frame.world_from_pixel - offset) * tolerance;
    plane.normal_scale = lobe * lobe;
    plane.roughness = guide.roughness;
    plane.roughness_scale = 1.0 / (ROUGHNESS_SHARE * guide.roughness + ROUGHNESS_FLOOR);
    return plane;
}

// How badly a tap at a place on screen, in pixels, fits: the negative logarithm of its weight.
fn plane_penalty(plane: Plane, tap: Guide, place: vec2<f32>) -> f32 {
    let w = frame.clip_w.x + frame.clip_w.y * tap.depth;
    let distance = dot(plane.distance, vec4<f32>(place * w, tap.depth, 1.0));
    let turned = plane.normal - tap.normal;
    let rougher = (tap.roughness - plane.roughness) * plane.roughness_scale;
    return distance * distance + dot(turned, turned) * plane.normal_scale + rougher * rougher;
}
