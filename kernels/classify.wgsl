//! Classify: decodes the G-buffer once for all later passes, finds the 8x8 tiles that need denoising and, if asked to,
//! lists the pixels for which the renderer has to trace a ray.
//!
//! in   normal, roughness, depth   as the caller has them     full
//! in   history      rgba16float   full   a: last frame's variance (ray list only)
//! out  guide        rg32uint      full   packed normal, linear depth, roughness, left-out flag (packed guide); where no
//!                                        later pass looks at surfaces that are left out, in tiles that are denoised
//!                                        only, 0 if left out
//! in/out  idle_frames   u32       tile   frames in a row in which no pixel of the tile was denoised, up to 3
//! out  rays         u32 list      pixels to trace and where to copy the result (ray list only)
//! out  counters     4 x u32       rays (ray list only)
//!
//! Grid: 8x8 invocations for each 4x4 tiles, each of which handles a pixel of every tile: about 20 bytes in, 8 out a pixel.
//! Where depth shows no surface, depth alone, unless the guide is needed there too.
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
// Later passes look at surfaces that are left out, too.
override GUIDE_IS_COMPLETE: bool = true;

@group(1) @binding(0) var in_history: texture_2d<f32>;
@group(1) @binding(1) var out_guide: texture_storage_2d<rg32uint, write>;
@group(1) @binding(2) var<storage, read_write> inout_idle_frames: array<u32>;
@group(1) @binding(3) var<storage, read_write> out_rays: array<u32>;
@group(1) @binding(4) var<storage, read_write> out_counters: array<atomic<u32>, 4>;

// Tiles of a workgroup. `limpid::passes` has the same side.
const GROUP_SIDE: u32 = 4u;
const GROUP_TILES: u32 = 16u;

const PIXEL_DENOISED: u32 = 1u;
const PIXEL_PREFERS_RAY: u32 = 2u;

// A bit for each tile in which a pixel is denoised.
var<workgroup> listed_tiles: atomic<u32>;
var<workgroup> ray_count: atomic<u32>;
var<workgroup> first_ray: u32;
// Of the pixels of one tile after the other.
var<workgroup> pixel_flags: array<u32, 1024>;

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

// Entry of the same quad, or of the same row of it for two rays a quad, whose ray stands for `entry`: the one
// that the pattern names if it needs a ray, else the first that does.
fn representative(entry: u32) -> u32 {
    let row = entry & ~1u;
    let quad = row & ~8u;
    if RAYS_PER_QUAD == 2u {
        let named = row + ((entry >> 3u) & 1u);
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

fn is_traced(entry: u32) -> bool {
    let flags = pixel_flags[entry];
    return (flags & PIXEL_DENOISED) != 0u && ((flags & PIXEL_PREFERS_RAY) != 0u || representative(entry) == entry);
}

// 1 when the pixel of `entry` is to receive the ray of `source`.
fn copies_from(entry: u32, source: u32) -> u32 {
    let denoised = (pixel_flags[entry] & PIXEL_DENOISED) != 0u;
    return select(0u, 1u, denoised && !is_traced(entry) && representative(entry) == source);
}

fn tile_of(group: vec2<u32>, index: u32) -> vec2<u32> {
    return group * GROUP_SIDE + vec2<u32>(index % GROUP_SIDE, index / GROUP_SIDE);
}

// The pixel that a lane handles in a tile of its workgroup.
fn pixel_of(group: vec2<u32>, index: u32, lane: u32) -> vec2<u32> {
    return tile_of(group, index) * TILE_SIZE + lane_position(lane);
}

// A bit for each tile in which the pixel that a lane handles is on screen.
fn tiles_on_screen(group: vec2<u32>, lane: u32) -> u32 {
    let size = frame.size;
    var found = 0u;
    for (var i = 0u; i < GROUP_TILES; i++) {
        found |= select(0u, 1u << i, all(pixel_of(group, i, lane) < size));
    }
    return found;
}

// Those of them in which it shows a surface, by depth alone.
fn tiles_with_surface(group: vec2<u32>, lane: u32, on_screen: u32, encoding: DepthEncoding) -> u32 {
    let last = frame.size - 1u;
    var found = 0u;
    for (var i = 0u; i < GROUP_TILES; i++) {
        let depth = decode_depth(min(pixel_of(group, i, lane), last), encoding);
        found |= select(0u, 1u << i, depth < SKY_DEPTH);
    }
    return found & on_screen;
}

// Counts the frames in a row in which nothing was denoised in a tile. Without history of the frame's size it is the first.
fn count_idle_frames(tile: vec2<u32>, is_listed: bool) {
    let index = tile_index(tile);
    let last = select(0u, inout_idle_frames[index], all(frame.prev_size == frame.size));
    inout_idle_frames[index] = select(min(last, FRAMES_TO_FILL) + 1u, 0u, is_listed);
}

fn store_guide(pixel: vec2<u32>, packed: vec2<u32>) {
    if GUIDE_IS_PACKED {
        textureStore(out_guide, pixel, vec4<u32>(packed, 0u, 0u));
    }
}

// Lists the rays of the pixels that a lane handles. Called by the whole workgroup.
fn list_rays(group: vec2<u32>, lane: u32) {
    var index = 0u;
    for (var i = 0u; i < GROUP_TILES; i++) {
        index += select(0u, 1u, is_traced(i * 64u + lane));
    }
    index = atomicAdd(&ray_count, index);
    workgroupBarrier();
    if lane == 0u {
        first_ray = atomicAdd(&out_counters[2], atomicLoad(&ray_count));
    }
    workgroupBarrier();
    for (var i = 0u; i < GROUP_TILES; i++) {
        let entry = i * 64u + lane;
        if is_traced(entry) {
            let copies = copies_from(entry ^ 1u, entry) | (copies_from(entry ^ 8u, entry) << 1u) | (copies_from(entry ^ 9u, entry) << 2u);
            let pixel = pixel_of(group, i, lane);
            out_rays[first_ray + index] = pixel.x | (pixel.y << 14u) | (copies << 28u);
            index += 1u;
        }
    }
}

@compute @workgroup_size(8, 8)
fn classify(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    if lane == 0u {
        atomicStore(&listed_tiles, 0u);
        atomicStore(&ray_count, 0u);
    }
    if RAYS_PER_QUAD != 0u {
        for (var i = 0u; i < GROUP_TILES; i++) {
            pixel_flags[i * 64u + lane] = 0u;
        }
    }
    workgroupBarrier();
    let encoding = depth_encoding();
    let on_screen = tiles_on_screen(group.xy, lane);
    var decoded = on_screen;
    if !GUIDE_IS_COMPLETE {
        decoded = tiles_with_surface(group.xy, lane, on_screen, encoding);
    }
    var denoised = 0u;
    // A loop, not a condition: software drivers run both sides of an `if`.
    for (var left = decoded; left != 0u; left &= left - 1u) {
        let i = lowest_bit(left);
        let pixel = pixel_of(group.xy, i, lane);
        let guide = decode_guide(pixel, encoding);
        if guide.denoised {
            denoised |= 1u << i;
            if RAYS_PER_QUAD != 0u {
                let preference = select(0u, PIXEL_PREFERS_RAY, prefers_ray(pixel, guide));
                pixel_flags[i * 64u + lane] = PIXEL_DENOISED | preference;
            }
        }
        if GUIDE_IS_COMPLETE || guide.denoised {
            store_guide(pixel, pack_guide(guide));
        }
    }
    atomicOr(&listed_tiles, denoised);
    workgroupBarrier();

    let listed = atomicLoad(&listed_tiles);
    if lane < GROUP_TILES {
        let tile = tile_of(group.xy, lane);
        if all(tile < tile_counts()) {
            count_idle_frames(tile, ((listed >> lane) & 1u) != 0u);
        }
    }
    if !GUIDE_IS_COMPLETE {
        for (var left = listed & on_screen & ~denoised; left != 0u; left &= left - 1u) {
            store_guide(pixel_of(group.xy, lowest_bit(left), lane), vec2<u32>(0u));
        }
    }
    if RAYS_PER_QUAD != 0u {
        list_rays(group.xy, lane);
    }
}
