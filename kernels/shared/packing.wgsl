// How values are kept in 32-bit words, and what counts as a usable number.

import package::shared::frame;

// Largest finite half float: nothing above it is stored.
const HALF_MAX: f32 = 65504.0;
// Linear depth of a pixel without a surface. Finite, so that arithmetic on it is too.
const SKY_DEPTH: f32 = 1e30;

// Bit test: compilers fold `x == x` to true.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn all_finite(v: vec3<f32>) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

// What a pixel of the G-buffer says, decoded.
struct Guide {
    // World-space unit normal.
    normal: vec3<f32>,
    // Linear depth in world units, SKY_DEPTH without a surface.
    depth: f32,
    // Perceptual roughness.
    roughness: f32,
    // Whether limpid denoises this pixel; others keep the fallback value.
    denoised: bool,
}

// GGX alpha, the width that the published pipeline calls roughness.
fn alpha_of(roughness: f32) -> f32 {
    return roughness * roughness;
}

// Roughness as a guide keeps it, so that thresholds mean the same in every pass.
fn quantized_roughness(roughness: f32) -> f32 {
    return round(saturate(roughness) * 1023.0) * (1.0 / 1023.0);
}

// Octahedral map of the unit sphere, Meyer et al. 2010, to -1..1 in x and y.
fn oct_encode(n: vec3<f32>) -> vec2<f32> {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let side = select(vec2<f32>(-1.0), vec2<f32>(1.0), p >= vec2<f32>(0.0));
    return select((1.0 - abs(p.yx)) * side, p, n.z >= 0.0);
}

fn oct_decode(p: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(p.x) - abs(p.y);
    let fold = max(-z, 0.0);
    let side = select(vec2<f32>(-1.0), vec2<f32>(1.0), p >= vec2<f32>(0.0));
    return normalize(vec3<f32>(p - fold * side, z));
}

// x: linear depth, negative where the pixel is left out. y: octahedral normal in 2 x 11 bits, roughness in 10.
fn pack_guide(guide: Guide) -> vec2<u32> {
    let oct = vec2<u32>(round((oct_encode(guide.normal) * 0.5 + 0.5) * 2047.0));
    let roughness = u32(round(saturate(guide.roughness) * 1023.0));
    let depth = select(-guide.depth, guide.depth, guide.denoised);
    return vec2<u32>(bitcast<u32>(depth), oct.x | (oct.y << 11u) | (roughness << 22u));
}

fn unpack_guide(packed: vec2<u32>) -> Guide {
    let depth = bitcast<f32>(packed.x);
    let oct = vec2<f32>(vec2<u32>(packed.y & 2047u, (packed.y >> 11u) & 2047u)) * (2.0 / 2047.0) - 1.0;
    var guide: Guide;
    guide.normal = oct_decode(oct);
    guide.depth = abs(depth);
    guide.roughness = f32(packed.y >> 22u) * (1.0 / 1023.0);
    guide.denoised = depth > 0.0;
    return guide;
}

// The part of `unpack_guide` that tells whether the pixel is denoised.
fn packed_guide_is_denoised(packed: vec2<u32>) -> bool {
    return bitcast<f32>(packed.x) > 0.0;
}

// Radiance and one more half float.
fn pack_radiance(radiance: vec3<f32>, other: f32) -> vec2<u32> {
    let c = min(radiance, vec3<f32>(HALF_MAX));
    return vec2<u32>(pack2x16float(c.rg), pack2x16float(vec2<f32>(c.b, other)));
}

fn unpack_radiance(packed: vec2<u32>) -> vec4<f32> {
    return vec4<f32>(unpack2x16float(packed.x), unpack2x16float(packed.y));
}

// The nearest half floats. Storing to a half float texture may round towards zero instead, and does on some
// drivers: kept as history, that darkens frame by frame.
fn rounded_to_half(v: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(unpack2x16float(pack2x16float(v.xy)), unpack2x16float(pack2x16float(v.zw)));
}

// Reprojected history: radiance in three half floats, history length and variance in 8 bits each.
struct Reprojected {
    radiance: vec3<f32>,
    // Frames that the history holds, this one included; 0 where there is no reflection.
    length: f32,
    // Temporal variance, 0..1.
    variance: f32,
}

fn pack_reprojected(r: Reprojected) -> vec2<u32> {
    let half_words = pack_radiance(r.radiance, 0.0);
    let length = u32(round(clamp(r.length * frame.history_length_steps, 0.0, 255.0)));
    // However small, variance is not none: the prefilter leaves pixels alone that have none.
    let variance = max(u32(round(sqrt(saturate(r.variance)) * 255.0)), select(0u, 1u, r.variance > 0.0));
    return vec2<u32>(half_words.x, (half_words.y & 0xffffu) | (length << 16u) | (variance << 24u));
}

fn unpack_reprojected(packed: vec2<u32>) -> Reprojected {
    var r: Reprojected;
    r.radiance = vec3<f32>(unpack2x16float(packed.x), unpack2x16float(packed.y & 0xffffu).x);
    r.length = f32((packed.y >> 16u) & 255u) / frame.history_length_steps;
    let deviation = f32(packed.y >> 24u) * (1.0 / 255.0);
    r.variance = deviation * deviation;
    return r;
}
