// The 8x8 averages of noisy and reprojected radiance, one texel a tile.

import package::shared::tiles;

// a: 1 where the tile has an average.
@group(1) @binding(0) var in_average: texture_2d<f32>;

// Average around a pixel, bilinear between the tiles that have one.
fn sample_average(pixel: vec2<u32>) -> vec3<f32> {
    let texel = (vec2<f32>(pixel) + 0.5) / 8.0 - 0.5;
    let base = vec2<i32>(floor(texel));
    let f = texel - floor(texel);
    let last = vec2<i32>(tile_counts()) - 1;
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        let corner = vec2<u32>(i & 1u, i >> 1u);
        let tap = textureLoad(in_average, clamp(base + vec2<i32>(corner), vec2<i32>(0), last), 0);
        let w = select(1.0 - f, f, corner == vec2<u32>(1u));
        sum += w.x * w.y * tap.a * vec4<f32>(tap.rgb, 1.0);
    }
    // The pixel's own tile has an average and a weight of at least a quarter.
    return sum.rgb / max(sum.a, 1e-6);
}
