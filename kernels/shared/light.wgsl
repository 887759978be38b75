// How bright the samples around a block are, kept from frame to frame to notice where the light changes.

import package::shared::frame;
import package::shared::packing;

struct Light {
    // Mean brightness of samples, exposed; 0 where it is not known.
    brightness: f32,
    // Deviation of single samples, 0 to 1.
    deviation: f32,
    // Whether the light changed this frame, 0 to 1.
    changed: f32,
}

// Brightness is kept as luminance that is not exposed, since exposure may change.
fn pack_light(light: Light) -> u32 {
    let l = min(light.brightness / max(1.0 - light.brightness, 1e-5) * frame.inverse_exposure, HALF_MAX);
    let other = vec2<u32>(round(vec2<f32>(saturate(light.deviation), saturate(light.changed)) * 255.0));
    return pack2x16float(vec2<f32>(l, 0.0)) | (other.x << 16u) | (other.y << 24u);
}

fn unpack_light(word: u32) -> Light {
    let l = min(unpack2x16float(word & 0xffffu).x * frame.exposure, HALF_MAX);
    let other = vec2<f32>(vec2<u32>((word >> 16u) & 255u, word >> 24u)) * (1.0 / 255.0);
    return Light(l / (1.0 + l), other.x, other.y);
}
