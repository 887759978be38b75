// Debug views: which one, their colours, and those views that are the same in both pipelines. Colours are linear and
// have to be those of `limpid::DebugView::legend`.

import package::shared::frame;
import package::shared::packing;
import package::shared::history;
import package::shared::tiles;

// Which view: numbers of `limpid::DebugView`.
override VIEW: u32 = 0u;

@group(1) @binding(11) var out_debug_view: texture_storage_2d<rgba16float, write>;

const HISTORY_LENGTH: u32 = 0u;
const VARIANCE: u32 = 1u;
const HIT_DISTANCE: u32 = 2u;
const AVERAGE: u32 = 3u;
const MOTION_ERROR: u32 = 4u;
const TILE_CLASSES: u32 = 5u;
// Views from here on look for history again.
const DISOCCLUSION: u32 = 6u;
const CANDIDATE: u32 = 7u;

const LEFT_OUT: vec3<f32> = vec3<f32>(0.05, 0.05, 0.05);
const FINE: vec3<f32> = vec3<f32>(0.0, 0.0, 0.0);
const RED: vec3<f32> = vec3<f32>(0.85, 0.03, 0.03);
const GREEN: vec3<f32> = vec3<f32>(0.05, 0.6, 0.1);
const BLUE: vec3<f32> = vec3<f32>(0.05, 0.2, 0.9);
const YELLOW: vec3<f32> = vec3<f32>(0.9, 0.6, 0.02);
const PALE: vec3<f32> = vec3<f32>(0.9, 0.8, 0.5);
const MAGENTA: vec3<f32> = vec3<f32>(1.0, 0.0, 1.0);

// From 0 to 1 over five colours that are neither red nor magenta.
fn ramp(t: f32) -> vec3<f32> {
    let place = saturate(t) * 4.0;
    var color = mix(vec3<f32>(0.01, 0.01, 0.1), vec3<f32>(0.03, 0.09, 0.5), saturate(place));
    color = mix(color, vec3<f32>(0.0, 0.35, 0.4), saturate(place - 1.0));
    color = mix(color, vec3<f32>(0.3, 0.7, 0.1), saturate(place - 2.0));
    return mix(color, vec3<f32>(1.0, 0.9, 0.4), saturate(place - 3.0));
}

fn history_length_color(length: f32) -> vec3<f32> {
    return select(ramp((log2(max(length, 1.0)) - 1.0) * 0.25), RED, length < 1.5);
}

// Deviations of 1/256 to 1. Negative where it is not known.
fn variance_color(variance: f32) -> vec3<f32> {
    return select(ramp(log2(max(variance, 1e-9)) * 0.0625 + 1.0), RED, variance < 0.0);
}

// As a share of the way from the camera.
fn hit_distance_color(distance: f32, depth: f32) -> vec3<f32> {
    let is_number = is_finite(distance) || bitcast<u32>(distance) == 0x7f800000u;
    let bounded = select(0.0, clamp(distance, 0.0, 1e30), is_number);
    return select(MAGENTA, ramp(bounded / (bounded + depth)), bounded > 0.0);
}

fn radiance_color(radiance: vec3<f32>) -> vec3<f32> {
    return radiance / (1.0 + radiance);
}

// How far motion vectors are, in pixels, from where the camera's motion alone puts the surface.
fn motion_error_color(pixel: vec2<u32>, position: vec3<f32>, texel: vec2<f32>) -> vec3<f32> {
    let uv = pixel_uv(pixel) - (texel * frame.motion_scale + frame.motion_offset);
    let apart = (uv - prev_uv_of(position)) * vec2<f32>(frame.size);
    let octaves = log2(max(length(clamp(apart, vec2<f32>(-1e9), vec2<f32>(1e9))), 1e-9));
    let color = select(FINE, ramp((octaves + 3.0) * 0.125), octaves >= -3.0);
    let is_number = is_finite(uv.x) && is_finite(uv.y);
    return select(LEFT_OUT, select(MAGENTA, color, is_number), all(frame.prev_size > vec2<u32>(0u)));
}

// Bits of what a tile holds: mirrors, rougher surfaces.
var<workgroup> tile_content: atomic<u32>;

// Called by the whole workgroup.
fn gather_tile(lane: u32, guide: Guide) {
    if lane == 0u {
        atomicStore(&tile_content, 0u);
    }
    workgroupBarrier();
    if guide.denoised {
        atomicOr(&tile_content, select(2u, 1u, guide.roughness <= frame.mirror_roughness));
    }
    workgroupBarrier();
}

fn tile_class_color() -> vec3<f32> {
    let content = atomicLoad(&tile_content);
    return select(select(select(LEFT_OUT, BLUE, content == 1u), YELLOW, content == 2u), GREEN, content == 3u);
}

fn store_view(pixel: vec2<u32>, color: vec3<f32>) {
    let shown = select(MAGENTA, saturate(color), all_finite(color));
    textureStore(out_debug_view, pixel, rounded_to_half(vec4<f32>(shown, 1.0)));
}
