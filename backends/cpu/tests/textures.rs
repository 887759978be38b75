//! Textures of every format.

mod support;

use half::f16;
use limpid_cpu::{Binding, Buffer, TexelFormat, Texture};
use support::{bits, executor, floats};

struct Format {
    format: TexelFormat,
    name: &'static str,
    components: usize,
    is_float: bool,
}

const FORMATS: [Format; 7] = [
    Format { format: TexelFormat::R32Float, name: "r32float", components: 1, is_float: true },
    Format { format: TexelFormat::Rg32Float, name: "rg32float", components: 2, is_float: true },
    Format { format: TexelFormat::Rgba32Float, name: "rgba32float", components: 4, is_float: true },
    Format { format: TexelFormat::Rgba16Float, name: "rgba16float", components: 4, is_float: true },
    Format { format: TexelFormat::R32Uint, name: "r32uint", components: 1, is_float: false },
    Format { format: TexelFormat::Rg32Uint, name: "rg32uint", components: 2, is_float: false },
    Format { format: TexelFormat::Rgba32Uint, name: "rgba32uint", components: 4, is_float: false },
];

impl Format {
    fn scalar(&self) -> &'static str {
        if self.is_float { "f32" } else { "u32" }
    }

    /// Bits of a number in the shader.
    fn number(&self, number: u32) -> u32 {
        if self.is_float { (number as f32).to_bits() } else { number }
    }

    /// Words of a texel with these components, which halves can hold.
    fn texel(&self, components: [u32; 4]) -> Vec<u32> {
        if self.format == TexelFormat::Rgba16Float {
            let half = |i: usize| u32::from(f16::from_f32(components[i] as f32).to_bits());
            return vec![half(0) | half(1) << 16, half(2) | half(3) << 16];
        }
        components[..self.components].iter().map(|&component| self.number(component)).collect()
    }

    /// What loading gives: components that there are none of are 0, or 1 for alpha.
    fn loaded(&self, components: [u32; 4]) -> [u32; 4] {
        let missing = [0, 0, 0, 1];
        [0, 1, 2, 3].map(|i| self.number(if i < self.components { components[i] } else { missing[i] }))
    }
}

/// Four numbers for a texel.
fn numbers(x: u32, y: u32, level: u32) -> [u32; 4] {
    [0, 1, 2, 3].map(|channel| 1 + channel + 4 * x + 40 * y + 400 * level)
}

/// A mip chain with `numbers` in every texel.
fn filled(format: &Format, width: u32, height: u32, levels: u32) -> Texture {
    let mut texture = Texture::with_levels(format.format, width, height, levels);
    let mut words = Vec::new();
    for level in 0..levels {
        for y in 0..(height >> level).max(1) {
            for x in 0..(width >> level).max(1) {
                words.extend(format.texel(numbers(x, y, level)));
            }
        }
    }
    texture.write(words);
    texture
}

#[test]
fn loads_of_all_levels() {
    for format in &FORMATS {
        let texture = filled(format, 9, 5, 4);
        let source = format!(
            "@group(0) @binding(0) var<storage, read_write> out: array<vec4<{scalar}>>;
            @group(0) @binding(1) var from_: texture_2d<{scalar}>;
            @compute @workgroup_size(9, 5) fn main(
                @builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) i: u32,
            ) {{
                out[id.z * 45u + i] = textureLoad(from_, id.xy, id.z);
            }}",
            scalar = format.scalar()
        );
        let out = Buffer::zeroed(4 * 45 * 6);
        let bindings = [Binding::buffer(0, 0, &out), Binding::texture(0, 1, &texture)];
        executor(&source).dispatch([1, 1, 6], &bindings).unwrap();
        for (i, texel) in (0..).zip(out.read().chunks(4)) {
            let (x, y, level) = (i % 9, i / 9 % 5, i / 45);
            if level < 4 && x < (9 >> level).max(1) && y < (5 >> level).max(1) {
                assert_eq!(texel, format.loaded(numbers(x, y, level)), "{} at {x}, {y}, level {level}", format.name);
            } else {
                let outside = &texel[..format.components];
                assert!(outside.iter().all(|value| *value == 0), "{} at {x}, {y}, level {level}", format.name);
            }
        }
    }
}

#[test]
fn loads_at_signed_coordinates_in_and_outside() {
    for format in &FORMATS {
        let texture = filled(format, 4, 3, 1);
        let source = format!(
            "@group(0) @binding(0) var<storage, read_write> out: array<vec4<{scalar}>>;
            @group(0) @binding(1) var from_: texture_2d<{scalar}>;
            @group(0) @binding(2) var<storage, read> places: array<vec2<i32>>;
            @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {{
                if i < arrayLength(&places) {{ out[i] = textureLoad(from_, places[i], 0); }}
            }}",
            scalar = format.scalar()
        );
        let extremes = [i32::MIN, i32::MIN + 1, -65_536, -4, -1, 0, 2, 3, 4, 5, 65_536, 0x4000_0000, i32::MAX];
        let all: Vec<[i32; 2]> = extremes.iter().flat_map(|&x| extremes.map(|y| [x, y])).collect();
        for places in all.chunks(64) {
            let out = Buffer::zeroed(4 * places.len());
            let words = Buffer::new(places.iter().flatten().map(|coordinate| coordinate.cast_unsigned()));
            let bindings =
                [Binding::buffer(0, 0, &out), Binding::texture(0, 1, &texture), Binding::buffer(0, 2, &words)];
            executor(&source).dispatch([1, 1, 1], &bindings).unwrap();
            for (&[x, y], texel) in places.iter().zip(out.read().chunks(4)) {
                if (0..4).contains(&x) && (0..3).contains(&y) {
                    let expected = format.loaded(numbers(x as u32, y as u32, 0));
                    assert_eq!(texel, expected, "{} at {x}, {y}", format.name);
                } else {
                    let outside = &texel[..format.components];
                    assert!(outside.iter().all(|value| *value == 0), "{} at {x}, {y}: {texel:?}", format.name);
                }
            }
        }
    }
}

#[test]
fn stores_inside_are_kept_and_others_dropped() {
    for format in &FORMATS {
        let source = format!(
            "@group(0) @binding(0) var to: texture_storage_2d<{name}, write>;
            @compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
                let at = vec2<i32>(id.xy) - 2;
                if id.x % 3u == 2u {{ return; }}
                let first = 1 + 4 * at.x + 40 * at.y;
                textureStore(to, at, vec4<{scalar}>(vec4(first, first + 1, first + 2, first + 3)));
                textureStore(to, vec2(at.x + 0x40000000, at.y), vec4<{scalar}>(9));
                textureStore(to, vec2(at.x, at.y - 0x7ffffff0), vec4<{scalar}>(9));
            }}",
            name = format.name,
            scalar = format.scalar()
        );
        let texture = filled(format, 9, 5, 2);
        let before = texture.read();
        executor(&source).dispatch([2, 2, 1], &[Binding::texture(0, 0, &texture)]).unwrap();
        let mut expected = Vec::new();
        for y in 0..5 {
            for x in 0..9 {
                expected.extend(format.texel(numbers(x, y, 0)));
            }
        }
        expected.extend_from_slice(&before[expected.len()..]);
        assert_eq!(texture.read(), expected, "{}", format.name);

        // And into one that was empty, to see that the masked ones are not written.
        let texture = Texture::new(format.format, 9, 5);
        executor(&source).dispatch([2, 2, 1], &[Binding::texture(0, 0, &texture)]).unwrap();
        let expected = (0..45).flat_map(|i| {
            let (x, y) = (i % 9, i / 9);
            format.texel(if (x + 2) % 3 == 2 { [0; 4] } else { numbers(x, y, 0) })
        });
        assert_eq!(texture.read(), expected.collect::<Vec<_>>(), "{}", format.name);
    }
}

#[test]
fn sizes_and_level_counts() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        @group(0) @binding(1) var a: texture_2d<f32>;
        @group(0) @binding(2) var b: texture_storage_2d<r32float, write>;
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            if i < textureNumLevels(a) {
                let size = textureDimensions(a, i);
                out[2u * i] = size.x;
                out[2u * i + 1u] = size.y;
            }
            if i == 0u {
                out[8] = textureDimensions(a).x;
                out[9] = textureDimensions(a, 2).y;
                out[10] = textureDimensions(b).x;
                out[11] = textureDimensions(b).y;
                out[12] = textureNumLevels(a);
            }
        }";
    let a = Texture::with_levels(TexelFormat::R32Float, 100, 7, 4);
    let b = Texture::new(TexelFormat::R32Float, 3, 11);
    let out = Buffer::zeroed(13);
    let bindings = [Binding::buffer(0, 0, &out), Binding::texture(0, 1, &a), Binding::texture(0, 2, &b)];
    executor(source).dispatch([1, 1, 1], &bindings).unwrap();
    assert_eq!(out.read(), [100, 7, 50, 3, 25, 1, 12, 1, 100, 1, 3, 11, 4]);
    assert_eq!((a.size(), b.size(), a.format()), ([100, 7], [3, 11], TexelFormat::R32Float));
}

#[test]
fn read_write_textures_show_their_own_stores() {
    for name in ["r32float", "r32uint"] {
        let format = FORMATS.iter().find(|format| format.name == name).unwrap();
        let source = format!(
            "@group(0) @binding(0) var image: texture_storage_2d<{name}, read_write>;
            @compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
                for (var k = 0u; k <= id.x; k++) {{
                    let old = textureLoad(image, id.xy).x;
                    textureStore(image, id.xy, vec4(old * 2 + 1));
                }}
            }}"
        );
        let texture = filled(format, 6, 6, 1);
        executor(&source).dispatch([1, 1, 1], &[Binding::texture(0, 0, &texture)]).unwrap();
        let expected = (0..36).map(|i| {
            let number = (0..=i % 6).fold(numbers(i % 6, i / 6, 0)[0], |number, _| number * 2 + 1);
            format.number(number)
        });
        assert_eq!(texture.read(), expected.collect::<Vec<_>>(), "{name}");
    }
}

#[test]
fn textures_as_arguments_of_functions_and_in_divergent_flow() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<f32>;
        @group(0) @binding(1) var a: texture_2d<f32>;
        @group(0) @binding(2) var b: texture_2d<f32>;
        fn pick(image: texture_2d<f32>, at: vec2<i32>) -> f32 {
            if at.x % 2 == 0 { return textureLoad(image, at, 0).y; }
            let texel = textureLoad(image, at, 0);
            return texel.x + texel.w;
        }
        @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {
            let at = vec2(i32(i % 8u), i32(i / 8u));
            if i % 3u == 0u { out[i] = pick(a, at); } else { out[i] = pick(b, at.yx) + textureLoad(a, vec2(0), 0)[i % 4u]; }
        }";
    let (a, b) = (filled(&FORMATS[2], 8, 8, 1), filled(&FORMATS[3], 8, 8, 1));
    let out = Buffer::zeroed(64);
    let bindings = [Binding::buffer(0, 0, &out), Binding::texture(0, 1, &a), Binding::texture(0, 2, &b)];
    executor(source).dispatch([1, 1, 1], &bindings).unwrap();
    let pick = |x, y| {
        let texel = numbers(x, y, 0);
        if x % 2 == 0 { texel[1] } else { texel[0] + texel[3] }
    };
    let expected = (0..64).map(|i| match (i % 8, i / 8) {
        (x, y) if i % 3 == 0 => pick(x, y) as f32,
        (x, y) => (pick(y, x) + numbers(0, 0, 0)[(i % 4) as usize]) as f32,
    });
    assert_eq!(floats(&out.read()), expected.collect::<Vec<_>>());
}

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
    texture.write((0..0x8000).map(|word: u32| 2 * word | ((2 * word + 1) << 16)));
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
