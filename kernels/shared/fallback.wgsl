// What a pixel that limpid leaves out (no surface, or too rough) holds in the output.

import package::shared::frame;
import package::shared::packing;
import package::shared::radiance;

// 0: black, 1: the input as it is, 2: the environment map (black without a surface).
override FALLBACK: u32 = 1u;

// Equirectangular radiance, y up, -z at the centre, with a mip chain that is blurrier level by level.
@group(0) @binding(6) var in_environment: texture_2d<f32>;

fn environment_level(direction: vec3<f32>, level: u32) -> vec3<f32> {
    // Not the size of `level` itself: lavapipe answers for one pixel's level in the place of all.
    let size = max(textureDimensions(in_environment, 0) >> vec2<u32>(level), vec2<u32>(1u));
    let uv = vec2<f32>(atan2(direction.x, -direction.z) * 0.15915494 + 0.5, acos(clamp(direction.y, -1.0, 1.0)) * 0.31830989);
    let texel = uv * vec2<f32>(size) - 0.5;
    let base = vec2<i32>(floor(texel));
    let f = texel - floor(texel);
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        let corner = vec2<u32>(i & 1u, i >> 1u);
        let tap = base + vec2<i32>(corner);
        // Around the horizon the map repeats, at the poles it ends.
        let x = (tap.x + i32(size.x)) % i32(size.x);
        let y = clamp(tap.y, 0, i32(size.y) - 1);
        let w = select(1.0 - f, f, corner == vec2<u32>(1u));
        sum += w.x * w.y * textureLoad(in_environment, vec2<i32>(x, y), level).rgb;
    }
    return sum;
}

fn environment_radiance(pixel: vec2<u32>, guide: Guide) -> vec3<f32> {
    if guide.depth >= SKY_DEPTH {
        return vec3<f32>(0.0);
    }
    let view = view_direction(world_position(pixel, guide.depth));
    let mirrored = (frame.environment_from_world * vec4<f32>(reflect(view, guide.normal), 0.0)).xyz;
    let last_level = f32(textureNumLevels(in_environment) - 1u);
    let level = min(alpha_of(guide.roughness) * frame.environment_mip_scale, last_level);
    let sharp = environment_level(mirrored, u32(floor(level)));
    let blurry = environment_level(mirrored, u32(ceil(level)));
    return clean_radiance(mix(sharp, blurry, fract(level)));
}

// Radiance as stored in the output, not exposed.
fn fallback_radiance(pixel: vec2<u32>, guide: Guide) -> vec3<f32> {
    if FALLBACK == 0u {
        return vec3<f32>(0.0);
    }
    if FALLBACK == 1u {
        return clean_radiance(textureLoad(in_radiance, pixel, 0).rgb);
    }
    return environment_radiance(pixel, guide);
}
