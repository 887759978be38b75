//! Classify: decodes the G-buffer once for all later passes, lists the 8x8 tiles that need denoising and,
//! if asked to, the pixels for which the renderer has to trace a ray.
//!
//! in   normal, roughness, depth   as the caller has them     full
//! in   history      rgba16float   full   a: last frame's variance (ray list only)
//! out  guide        rg32uint      full   packed normal, linear depth, roughness, left-out flag
//! out  average      rgba16float   tile   0 in tiles that are left out
//! out  blocks, other_blocks       rgba32uint    block   the same
//! out  light        r32uint       block  the same
//! out  tiles        u32 list      listed tiles from the front, left-out tiles from the back
//! out  rays         u32 list      pixels to trace and where to copy the result (ray list only)
//! out  counters     4 x u32       listed tiles, left-out tiles, rays
//!
//! Grid: one invocation per pixel, 8x8. Reads and writes its own pixel: about 20 bytes in, 8 out.
//! After: tile classification of the AMD FidelityFX denoiser 1.2 (2021). Differs: one ray per quad goes to the
//! first pixel that needs one, where the original traces none if the top left pixel needs none.

import package::shared::frame;
import package::shared::packing;
import package::shared::tiles;
import package::shared::blocks;

// 0: xyz in -1..1, 1: xyz in 0..1, 2: octahedral in -1..1, 3: octahedral in 0..1.
override NORMAL_ENCODING: u32 = 0u;
// Channel of the roughness texture.
override ROUGHNESS_CHANNEL: u32 = 0u;
// The roughness texture holds GGX alpha, not perceptual roughness.
override ROUGHNESS_IS_ALPHA: bool = false;
// All surfaces have the roughness in the constants; there is no texture of it.
override ROUGHNESS_IS_CONSTANT: bool = false;
// Some later pass uses the 8x8 averages.
override AVERAGE_IS_USED: bool = true;
// Later passes work on blocks, and leave those of tiles alone that are left out.
override BLOCKS_ARE_USED: bool = false;
// Later passes notice where the light changed.
override LIGHT_CHANGE: bool = false;
// Rays in a 2x2 quad: 1, 2 or 4; 0: no ray list.
override RAYS_PER_QUAD: u32 = 0u;
// Pixels whose variance was high last frame get their own ray.
override RAYS_FOLLOW_VARIANCE: bool = false;

@group(0) @binding(2) var in_normal: texture_2d<f32>;
@group(0) @binding(3) var in_roughness: texture_2d<f32>;
@group(0) @binding(4) var in_depth: texture_2d<f32>;

@group(1) @binding(0) var in_history: texture_2d<f32>;
@group(1) @binding(1) var out_guide: texture_storage_2d<rg32uint, write>;
@group(1) @binding(2) var out_average: texture_storage_2d<rgba16float, write>;
@group(1) @binding(3) var<storage, read_write> out_tiles: array<u32>;
@group(1) @binding(4) var<storage, read_write> out_rays: array<u32>;
@group(1) @binding(5) var<storage, read_write> out_counters: array<atomic<u32>, 4>;
@group(1) @binding(6) var out_blocks: texture_storage_2d<rgba32uint, write>;
@group(1) @binding(7) var out_other_blocks: texture_storage_2d<rgba32uint, write>;
@group(1) @binding(8) var out_light: texture_storage_2d<r32uint, write>;

const PIXEL_DENOISED: u32 = 1u;
const PIXEL_PREFERS_RAY: u32 = 2u;

var<workgroup> tile_is_listed: atomic<u32>;
var<workgroup> tile_ray_count: atomic<u32>;
var<workgroup> tile_first_ray: u32;
var<workgroup> tile_flags: array<u32, 64>;

fn decode_normal(texel: vec4<f32>) -> vec3<f32> {
    if NORMAL_ENCODING == 0u {
        return texel.xyz;
    }
    if NORMAL_ENCODING == 1u {
        return texel.xyz * 2.0 - 1.0;
    }
    if NORMAL_ENCODING == 2u {
        return oct_decode(texel.xy);
    }
    return oct_decode(texel.xy * 2.0 - 1.0);
}

fn decode_depth(pixel: vec2<u32>) -> f32 {
    let device = textureLoad(in_depth, pixel, 0).x;
    let c = frame.depth_from_device;
    let depth = abs((c.x + c.y * device) / (c.z + c.w * device));
    let is_surface = is_finite(device) && device > frame.sky_depth.x && device < frame.sky_depth.y
        && is_finite(depth) && depth > 0.0 && depth < SKY_DEPTH;
    return select(SKY_DEPTH, depth, is_surface);
}

// Texels that hold no direction or no roughness make their pixel one without a surface.
fn decode_guide(pixel: vec2<u32>) -> Guide {
    let normal = decode_normal(textureLoad(in_normal, pixel, 0));
    var stored_roughness = frame.constant_roughness;
    if !ROUGHNESS_IS_CONSTANT {
        stored_roughness = textureLoad(in_roughness, pixel, 0)[ROUGHNESS_CHANNEL];
    }
    let squared_length = dot(normal, normal);
    let usable = is_finite(squared_length) && squared_length > 1e-12 && is_finite(stored_roughness);
    var guide: Guide;
    guide.normal = select(vec3<f32>(0.0, 0.0, 1.0), normal * inverseSqrt(max(squared_length, 1e-12)), usable);
    guide.roughness = select(1.0, saturate(stored_roughness), is_finite(stored_roughness));
    if ROUGHNESS_IS_ALPHA {
        guide.roughness = sqrt(guide.roughness);
    }
    guide.roughness = quantized_roughness(guide.roughness);
    guide.depth = select(SKY_DEPTH, decode_depth(pixel), usable);
    guide.denoised = guide.depth < SKY_DEPTH && guide.roughness <= frame.roughness_threshold;
    return guide;
}

// Whether the sampling pattern gives the pixel a ray of its own.
fn prefers_ray(pixel: vec2<u32>, guide: Guide) -> bool {
    if RAYS_PER_QUAD >= 4u || guide.roughness <= frame.mirror_roughness {
        return true;
    }
    if RAYS_FOLLOW_VARIANCE {
        // The last output may have had another size; 0 when there is none.
        let prev_pixel = vec2<u32>(pixel_uv(pixel) * vec2<f32>(frame.prev_size));
        if all(prev_pixel < frame.prev_size) && textureLoad(in_history, prev_pixel, 0).a > frame.ray_variance_threshold {
            return true;
        }
    }
    if RAYS_PER_QUAD == 2u {
        return (pixel.x & 1u) == (pixel.y & 1u);
    }
    return ((pixel.x | pixel.y) & 1u) == 0u;
}

// Lane in the same quad, or in the same row of it for two rays a quad, whose ray stands for `lane`: the one
// that the pattern names if it needs a ray, else the first that does.
fn representative(lane: u32) -> u32 {
    let row = lane & ~1u;
    let quad = row & ~8u;
    if RAYS_PER_QUAD == 2u {
        let named = row + ((lane >> 3u) & 1u);
        return select(named ^ 1u, named, (tile_flags[named] & PIXEL_DENOISED) != 0u);
    }
    if (tile_flags[quad] & PIXEL_DENOISED) != 0u {
        return quad;
    }
    if (tile_flags[quad + 1u] & PIXEL_DENOISED) != 0u {
        return quad + 1u;
    }
    return select(quad + 9u, quad + 8u, (tile_flags[quad + 8u] & PIXEL_DENOISED) != 0u);
}

fn is_traced(lane: u32) -> bool {
    let flags = tile_flags[lane];
    return (flags & PIXEL_DENOISED) != 0u && ((flags & PIXEL_PREFERS_RAY) != 0u || representative(lane) == lane);
}

// 1 when the pixel at `lane` is to receive the ray of `source`.
fn copies_from(lane: u32, source: u32) -> u32 {
    let denoised = (tile_flags[lane] & PIXEL_DENOISED) != 0u;
    return select(0u, 1u, denoised && !is_traced(lane) && representative(lane) == source);
}

@compute @workgroup_size(8, 8)
fn classify(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let tile = group.xy;
    let pixel = tile * TILE_SIZE + lane_position(lane);
    let on_screen = all(pixel < frame.size);
    if lane == 0u {
        atomicStore(&tile_is_listed, 0u);
        atomicStore(&tile_ray_count, 0u);
    }
    var flags = 0u;
    workgroupBarrier();
    if on_screen {
        let guide = decode_guide(pixel);
        textureStore(out_guide, pixel, vec4<u32>(pack_guide(guide), 0u, 0u));
        if guide.denoised {
            atomicStore(&tile_is_listed, 1u);
            flags = PIXEL_DENOISED;
            if RAYS_PER_QUAD != 0u {
                flags |= select(0u, PIXEL_PREFERS_RAY, prefers_ray(pixel, guide));
            }
        }
    }
    if RAYS_PER_QUAD != 0u {
        tile_flags[lane] = flags;
    }
    workgroupBarrier();

    if lane == 0u {
        if atomicLoad(&tile_is_listed) != 0u {
            out_tiles[atomicAdd(&out_counters[0], 1u)] = pack_tile(tile);
        } else {
            let counts = tile_counts();
            out_tiles[counts.x * counts.y - 1u - atomicAdd(&out_counters[1], 1u)] = pack_tile(tile);
            if AVERAGE_IS_USED {
                textureStore(out_average, tile, vec4<f32>(0.0));
            }
        }
    }

    if BLOCKS_ARE_USED {
        let block = block_of_tile(tile, lane);
        if lane < 4u && atomicLoad(&tile_is_listed) == 0u && all(vec2<i32>(block) <= last_block()) {
            textureStore(out_blocks, block, vec4<u32>(0u));
            textureStore(out_other_blocks, block, vec4<u32>(0u));
            if LIGHT_CHANGE {
                textureStore(out_light, block, vec4<u32>(0u));
            }
        }
    }

    if RAYS_PER_QUAD != 0u {
        let traced = is_traced(lane);
        var ray_index = 0u;
        if traced {
            ray_index = atomicAdd(&tile_ray_count, 1u);
        }
        workgroupBarrier();
        if lane == 0u {
            tile_first_ray = atomicAdd(&out_counters[2], atomicLoad(&tile_ray_count));
        }
        workgroupBarrier();
        if traced {
            let copies = copies_from(lane ^ 1u, lane) | (copies_from(lane ^ 8u, lane) << 1u) | (copies_from(lane ^ 9u, lane) << 2u);
            out_rays[tile_first_ray + ray_index] = pixel.x | (pixel.y << 14u) | (copies << 28u);
        }
    }
}
