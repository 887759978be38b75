//! Classify: decodes the G-buffer once for all later passes, finds the 8x8 tiles that need denoising and, if asked to,
//! lists the pixels for which the renderer has to trace a ray.
//!
//! in   normal, roughness, depth   as the caller has them     full
//! in   history      rgba16float   full   a: last frame's variance (ray list only)
//! out  guide        rg32uint      full   packed normal, linear depth, roughness, left-out flag (packed guide)
//! out  tile_flags   r32uint       tile   whether a pixel of the tile is denoised
//! out  rays         u32 list      pixels to trace and where to copy the result (ray list only)
//! out  counters     4 x u32       rays (ray list only)
//!
//! Grid: one invocation per pixel, 8x8. Reads and writes its own pixel: about 20 bytes in, 8 out.
//! After: tile classification of the AMD FidelityFX denoiser 1.2 (2021). Differs: one ray per quad goes to the
//! first pixel that needs one, where the original traces none if the top left pixel needs none.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::tiles;

// Rays in a 2x2 quad: 1, 2 or 4; 0: no ray list.
override RAYS_PER_QUAD: u32 = 0u;
// Pixels whose variance was high last frame get their own ray.
override RAYS_FOLLOW_VARIANCE: bool = false;

@group(1) @binding(0) var in_history: texture_2d<f32>;
@group(1) @binding(1) var out_guide: texture_storage_2d<rg32uint, write>;
@group(1) @binding(2) var out_tile_flags: texture_storage_2d<r32uint, write>;
@group(1) @binding(3) var<storage, read_write> out_rays: array<u32>;
@group(1) @binding(4) var<storage, read_write> out_counters: array<atomic<u32>, 4>;

const PIXEL_DENOISED: u32 = 1u;
const PIXEL_PREFERS_RAY: u32 = 2u;

var<workgroup> tile_is_listed: atomic<u32>;
var<workgroup> tile_ray_count: atomic<u32>;
var<workgroup> tile_first_ray: u32;
var<workgroup> pixel_flags: array<u32, 64>;

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
        return select(named ^ 1u, named, (pixel_flags[named] & PIXEL_DENOISED) != 0u);
    }
    if (pixel_flags[quad] & PIXEL_DENOISED) != 0u {
        return quad;
    }
    if (pixel_flags[quad + 1u] & PIXEL_DENOISED) != 0u {
        return quad + 1u;
    }
    return select(quad + 9u, quad + 8u, (pixel_flags[quad + 8u] & PIXEL_DENOISED) != 0u);
}

fn is_traced(lane: u32) -> bool {
    let flags = pixel_flags[lane];
    return (flags & PIXEL_DENOISED) != 0u && ((flags & PIXEL_PREFERS_RAY) != 0u || representative(lane) == lane);
}

// 1 when the pixel at `lane` is to receive the ray of `source`.
fn copies_from(lane: u32, source: u32) -> u32 {
    let denoised = (pixel_flags[lane] & PIXEL_DENOISED) != 0u;
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
        let guide = decode_guide(pixel, depth_encoding());
        if GUIDE_IS_PACKED {
            textureStore(out_guide, pixel, vec4<u32>(pack_guide(guide), 0u, 0u));
        }
        if guide.denoised {
            atomicStore(&tile_is_listed, 1u);
            flags = PIXEL_DENOISED;
            if RAYS_PER_QUAD != 0u {
                flags |= select(0u, PIXEL_PREFERS_RAY, prefers_ray(pixel, guide));
            }
        }
    }
    if RAYS_PER_QUAD != 0u {
        pixel_flags[lane] = flags;
    }
    workgroupBarrier();

    if lane == 0u {
        textureStore(out_tile_flags, tile, vec4<u32>(atomicLoad(&tile_is_listed), 0u, 0u, 0u));
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
