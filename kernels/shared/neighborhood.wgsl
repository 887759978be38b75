// Gaussian statistics of the 9x9 pixels around each pixel of a tile: the tile and its border of 4 pixels are
// loaded into workgroup memory once, then summed along rows and along columns (the Gaussian is separable and
// a mask does not change that). Pixels off screen or left out have no weight.

import package::shared::frame;
import package::shared::packing;

const WINDOW_SIZE: u32 = 16u;
const WINDOW_BORDER: u32 = 4u;

// Per pixel of the window: radiance, and 1 where it counts.
var<workgroup> window_radiance: array<vec2<u32>, 256>;
// Sums along rows, 8 in each of the 16 rows: weighted radiance and weight; weighted squared radiance.
var<workgroup> row_sum: array<vec4<f32>, 128>;
var<workgroup> row_square_sum: array<vec4<f32>, 128>;

struct Statistics {
    mean: vec3<f32>,
    variance: vec3<f32>,
}

fn store_window(index: u32, radiance: vec3<f32>, counts: bool) {
    let c = select(vec3<f32>(0.0), radiance, counts);
    window_radiance[index] = pack_radiance(c, select(0.0, 1.0, counts));
}

// Pixel on screen that an entry of the window stands for; may lie off screen.
fn window_pixel(tile: vec2<u32>, index: u32) -> vec2<i32> {
    let offset = vec2<u32>(index % WINDOW_SIZE, index / WINDOW_SIZE);
    return vec2<i32>(tile * 8u + offset) - vec2<i32>(i32(WINDOW_BORDER));
}

fn neighborhood_weight(offset: i32) -> f32 {
    let distance = abs(offset);
    if distance == 0 {
        return 1.0;
    }
    return frame.neighborhood_weights[distance - 1];
}

// Called by the whole workgroup after a barrier that follows `store_window`, and followed by a barrier.
fn sum_rows(lane: u32) {
    for (var pass_index = 0u; pass_index < 2u; pass_index++) {
        let entry = lane + 64u * pass_index;
        let start = (entry / 8u) * WINDOW_SIZE + entry % 8u;
        var sum = vec4<f32>(0.0);
        var square_sum = vec3<f32>(0.0);
        for (var i = 0; i < 9; i++) {
            let weight = neighborhood_weight(i - 4);
            let c = unpack_radiance(window_radiance[start + u32(i)]);
            sum += weight * c;
            square_sum += weight * c.rgb * c.rgb;
        }
        row_sum[entry] = sum;
        row_square_sum[entry] = vec4<f32>(square_sum, 0.0);
    }
}

fn neighborhood_statistics(lane: u32) -> Statistics {
    var sum = vec4<f32>(0.0);
    var square_sum = vec3<f32>(0.0);
    for (var i = 0; i < 9; i++) {
        let weight = neighborhood_weight(i - 4);
        let entry = lane + u32(i) * 8u;
        sum += weight * row_sum[entry];
        square_sum += weight * row_square_sum[entry].xyz;
    }
    let normalization = 1.0 / max(sum.w, 1e-6);
    var statistics: Statistics;
    statistics.mean = sum.rgb * normalization;
    statistics.variance = abs(square_sum * normalization - statistics.mean * statistics.mean);
    return statistics;
}
