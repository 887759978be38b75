//! Textures of half floats: rounding and special values.

mod support;

use half::f16;
use limpid_cpu::{Binding, Buffer, TexelFormat, Texture};
use support::{bits, executor, floats};

#[test]
fn half_floats_round_to_nearest_even_and_keep_what_is_special() {
    let source = "
        @group(0) @binding(0) var<storage, read> numbers: array<vec4<f32>>;
        @group(0) @binding(1) var to: texture_storage_2d<rgba16float, write>;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            if i < arrayLength(&numbers) { textureStore(to, vec2(i, 0u), numbers[i]); }
        }";
    let mut numbers = vec![0.0, -0.0, f32::INFINITY, -f32::INFINITY, 65504.0, 65519.0, 65520.0, 1e30, -7e4, f32::MIN];
    for exponent in -28..18 {
        // Halfway between halves, and one step to both sides.
        for significand in [1.0, 1.0 + 1.0 / 2048.0, 1.0 + 3.0 / 2048.0, 1.5, 2.0 - 1.0 / 2048.0] {
            let number = significand * 2f32.powi(exponent);
            numbers.extend([number, -number, number.next_up(), number.next_down()]);
        }
    }
    numbers.resize(numbers.len().next_multiple_of(256), f32::MIN_POSITIVE / 4.0);
    for numbers in numbers.chunks(256) {
        let texture = Texture::new(TexelFormat::Rgba16Float, 64, 1);
        let buffer = Buffer::new(bits(numbers));
        let bindings = [Binding::buffer(0, 0, &buffer), Binding::texture(0, 1, &texture)];
        executor(source).dispatch([1, 1, 1], &bindings).unwrap();
        let stored = texture.read().into_iter().flat_map(|word| [word as u16, (word >> 16) as u16]);
        for (number, stored) in numbers.iter().zip(stored) {
            assert_eq!(stored, f16::from_f32(*number).to_bits(), "{number:e}");
        }
    }
}

#[test]
fn every_half_float_loads_exactly() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<vec4<f32>>;
        @group(0) @binding(1) var from_: texture_2d<f32>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            out[id.x] = textureLoad(from_, vec2(id.x % 128u, id.x / 128u), 0);
        }";
    let mut texture = Texture::new(TexelFormat::Rgba16Float, 128, 128);
    texture.write((0..0x8000).map(|word: u32| (2 * word) | ((2 * word + 1) << 16)));
    let out = Buffer::zeroed(0x10000);
    executor(source).dispatch([256, 1, 1], &[Binding::buffer(0, 0, &out), Binding::texture(0, 1, &texture)]).unwrap();
    for (half, actual) in (0..=u16::MAX).zip(floats(&out.read())) {
        let expected = f16::from_bits(half).to_f32();
        assert!(
            actual.to_bits() == expected.to_bits() || (actual.is_nan() && expected.is_nan()),
            "{half:#x}: {actual}"
        );
    }
}
