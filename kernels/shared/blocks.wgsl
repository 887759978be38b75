// Averages over 4x4 blocks of pixels, from which wide filters read: one texel holds all of a block, so that a tap
// is a single load.

import package::shared::frame;
import package::shared::packing;
import package::shared::color;

const BLOCK_SIZE: u32 = 4u;

struct Block {
    // The G-buffer of the pixel that stands for the block; not `denoised` where none is.
    guide: Guide,
    // Mean radiance, exposed.
    radiance: vec3<f32>,
    // Mean of what was cut off from outliers, exposed.
    excess: vec3<f32>,
    // How far one frame's is to be believed, 0 to 1: less the fewer blocks it is from.
    certainty: f32,
    // Hit share.
    share: f32,
    // Deviation of brightness, 0 to 1.
    deviation: f32,
    // All of its pixels show its surface (whole blocks).
    is_whole: bool,
}

// Bits of each channel of a block's radiance, as of rgb9e5, and of its excess, which leaves 6 for its certainty.
const RADIANCE_BITS: u32 = 9u;
const EXCESS_BITS: u32 = 7u;

// A little above a half: means of equal half floats, which have two bits more, are often just between two codes, where
// else the last bit of a sum, which differs between devices, would decide.
const ROUNDING: f32 = 0.50390625;

// Three numbers of 9 bits or fewer with an exponent of 5 in common, rounded to nearest; of 9 that is rgb9e5.
fn pack_shared_exponent(radiance: vec3<f32>, bits: u32) -> u32 {
    let c = clamp(radiance, vec3<f32>(0.0), vec3<f32>(65408.0));
    let largest = max(c.x, max(c.y, c.z));
    let exponent = clamp(i32(bitcast<u32>(largest * 1.001) >> 23u) - 126, -15, 16);
    let scale = exp2(f32(i32(bits) - exponent));
    let words = min(vec3<u32>(floor(c * scale + ROUNDING)), vec3<u32>((1u << bits) - 1u));
    return words.x | (words.y << bits) | (words.z << (2u * bits)) | (u32(exponent + 15) << (3u * bits));
}

fn unpack_shared_exponent(word: u32, bits: u32) -> vec3<f32> {
    let scale = exp2(f32((word >> (3u * bits)) & 31u) - f32(15u + bits));
    return vec3<f32>(vec3<u32>(word, word >> bits, word >> (2u * bits)) & vec3<u32>((1u << bits) - 1u)) * scale;
}

fn pack_block(block: Block) -> vec4<u32> {
    let oct = vec2<u32>(round((oct_encode(block.guide.normal) * 0.5 + 0.5) * 511.0));
    let roughness = u32(round(saturate(block.guide.roughness) * 63.0));
    let share = u32(round(saturate(block.share) * 255.0));
    // The last 8 bits of depth and its sign make room.
    let depth = ((bitcast<u32>(block.guide.depth) + 128u) & 0x7fffff00u) | select(0u, 0x80000000u, block.is_whole);
    let deviation = u32(round(saturate(block.deviation) * 255.0));
    let certainty = u32(round(saturate(block.certainty) * 63.0));
    return vec4<u32>(
        select(0u, depth | deviation, block.guide.denoised),
        oct.x | (oct.y << 9u) | (roughness << 18u) | (share << 24u),
        pack_shared_exponent(block.radiance, RADIANCE_BITS),
        pack_shared_exponent(block.excess, EXCESS_BITS) | (certainty << 26u),
    );
}

fn unpack_block(texel: vec4<u32>) -> Block {
    let oct = vec2<f32>(vec2<u32>(texel.y, texel.y >> 9u) & vec2<u32>(511u)) * (2.0 / 511.0) - 1.0;
    var block: Block;
    block.guide.normal = oct_decode(oct);
    block.guide.depth = bitcast<f32>(texel.x & 0x7fffff00u);
    block.guide.roughness = f32((texel.y >> 18u) & 63u) * (1.0 / 63.0);
    block.guide.denoised = texel.x != 0u;
    block.share = f32(texel.y >> 24u) * (1.0 / 255.0);
    block.deviation = f32(texel.x & 255u) * (1.0 / 255.0);
    block.radiance = unpack_shared_exponent(texel.z, RADIANCE_BITS);
    block.excess = unpack_shared_exponent(texel.w, EXCESS_BITS);
    block.certainty = f32(texel.w >> 26u) * (1.0 / 63.0);
    block.is_whole = texel.x >= 0x80000000u;
    return block;
}

// What is known of the samples of a block beside their mean.
struct Samples {
    // The second and third largest luminance.
    peaks: vec2<f32>,
    // Mean brightness.
    brightness: f32,
    // A bit for each pixel that shows the surface of the block, row by row.
    shown: u32,
}

// All of them do.
const ALL_PIXELS: u32 = 0xffffu;

fn pack_samples(samples: Samples) -> vec2<u32> {
    let peaks = min(samples.peaks, vec2<f32>(HALF_MAX));
    return vec2<u32>(pack2x16float(peaks), pack2x16float(vec2<f32>(samples.brightness, 0.0)) | (samples.shown << 16u));
}

fn unpack_samples(packed: vec2<u32>) -> Samples {
    return Samples(unpack2x16float(packed.x), unpack2x16float(packed.y & 0xffffu).x, packed.y >> 16u);
}

// The largest indices of blocks on screen.
fn last_block() -> vec2<i32> {
    return vec2<i32>((frame.size - 1u) / BLOCK_SIZE);
}

// How many there are on screen.
fn block_count() -> u32 {
    let counts = vec2<u32>(last_block()) + 1u;
    return counts.x * counts.y;
}

// Place on screen, in pixels, that stands for a block.
fn block_place(block: vec2<i32>) -> vec2<f32> {
    return min(vec2<f32>(block * i32(BLOCK_SIZE)) + 1.5, vec2<f32>(frame.size) - 0.5);
}

// Where a pixel lies between four blocks: the first of them, which may be off screen, and how far from it to the last.
struct BetweenBlocks {
    first: vec2<i32>,
    fraction: vec2<f32>,
}

fn between_blocks(pixel: vec2<u32>) -> BetweenBlocks {
    let place = (vec2<f32>(pixel) + 0.5) / f32(BLOCK_SIZE) - 0.5;
    let first = floor(place);
    return BetweenBlocks(vec2<i32>(first), place - first);
}

// One of the four blocks around a pixel.
struct Corner {
    block: vec2<i32>,
    // Bilinear weight.
    weight: f32,
}

fn corner_of(pixel: vec2<u32>, corner: u32) -> Corner {
    let between = between_blocks(pixel);
    let offset = vec2<u32>(corner & 1u, corner >> 1u);
    let weight = select(1.0 - between.fraction, between.fraction, offset == vec2<u32>(1u));
    return Corner(clamp(between.first + vec2<i32>(offset), vec2<i32>(0), last_block()), weight.x * weight.y);
}

// Luminance squeezed into 0 to 1, in which differences and deviations are measured.
fn brightness(radiance: vec3<f32>) -> f32 {
    let l = luminance(radiance);
    return l / (1.0 + l);
}
