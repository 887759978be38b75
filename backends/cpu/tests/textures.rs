//! Textures of every format.

mod support;

use half::f16;
use limpid_cpu::{Binding, Buffer, TexelFormat, Texture};
use support::{executor, floats};

#[derive(Clone, Copy, PartialEq)]
enum Channel {
    Float,
    Half,
    Unorm,
    Snorm,
    Uint(u32),
    Sint(u32),
}

struct Format {
    format: TexelFormat,
    name: &'static str,
    components: usize,
    channel: Channel,
}

const fn format(format: TexelFormat, name: &'static str, components: usize, channel: Channel) -> Format {
    Format { format, name, components, channel }
}

const FORMATS: [Format; 20] = [
    format(TexelFormat::R32Float, "r32float", 1, Channel::Float),
    format(TexelFormat::Rg32Float, "rg32float", 2, Channel::Float),
    format(TexelFormat::Rgba32Float, "rgba32float", 4, Channel::Float),
    format(TexelFormat::R16Float, "r16float", 1, Channel::Half),
    format(TexelFormat::Rg16Float, "rg16float", 2, Channel::Half),
    format(TexelFormat::Rgba16Float, "rgba16float", 4, Channel::Half),
    format(TexelFormat::R8Unorm, "r8unorm", 1, Channel::Unorm),
    format(TexelFormat::Rg8Unorm, "rg8unorm", 2, Channel::Unorm),
    format(TexelFormat::Rgba8Unorm, "rgba8unorm", 4, Channel::Unorm),
    format(TexelFormat::Rgba8Snorm, "rgba8snorm", 4, Channel::Snorm),
    format(TexelFormat::R32Uint, "r32uint", 1, Channel::Uint(32)),
    format(TexelFormat::Rg32Uint, "rg32uint", 2, Channel::Uint(32)),
    format(TexelFormat::Rgba32Uint, "rgba32uint", 4, Channel::Uint(32)),
    format(TexelFormat::Rgba16Uint, "rgba16uint", 4, Channel::Uint(16)),
    format(TexelFormat::Rgba8Uint, "rgba8uint", 4, Channel::Uint(8)),
    format(TexelFormat::R32Sint, "r32sint", 1, Channel::Sint(32)),
    format(TexelFormat::Rg32Sint, "rg32sint", 2, Channel::Sint(32)),
    format(TexelFormat::Rgba32Sint, "rgba32sint", 4, Channel::Sint(32)),
    format(TexelFormat::Rgba16Sint, "rgba16sint", 4, Channel::Sint(16)),
    format(TexelFormat::Rgba8Sint, "rgba8sint", 4, Channel::Sint(8)),
];

#[test]
fn every_format_is_tested() {
    for known in TexelFormat::ALL {
        assert!(FORMATS.iter().any(|format| format.format == *known), "{known:?}");
    }
}

impl Format {
    fn scalar(&self) -> &'static str {
        match self.channel {
            Channel::Uint(_) => "u32",
            Channel::Sint(_) => "i32",
            _ => "f32",
        }
    }

    /// What a number becomes in this format: bits in the shader, and in the texel with their count.
    fn encoded(&self, number: u32) -> (u32, u32, u32) {
        match self.channel {
            Channel::Float => ((number as f32).to_bits(), (number as f32).to_bits(), 32),
            Channel::Half => ((number as f32).to_bits(), f16::from_f32(number as f32).to_bits().into(), 16),
            Channel::Unorm => ((number as u8 as f32 / 255.0).to_bits(), number & 0xff, 8),
            Channel::Snorm => {
                let value = (number % 255) as i8;
                ((f32::from(value) / 127.0).max(-1.0).to_bits(), u32::from(value.cast_unsigned()), 8)
            }
            Channel::Uint(bits) => (number & (u32::MAX >> (32 - bits)), number & (u32::MAX >> (32 - bits)), bits),
            Channel::Sint(bits) => {
                let value = (number.wrapping_sub(300) << (32 - bits)).cast_signed() >> (32 - bits);
                (value.cast_unsigned(), value.cast_unsigned() & (u32::MAX >> (32 - bits)), bits)
            }
        }
    }

    /// Words of a texel with these components.
    fn texel(&self, components: [u32; 4]) -> Vec<u32> {
        let mut words = vec![0; self.format.words()];
        for (index, component) in components[..self.components].iter().enumerate() {
            let (_, raw, bits) = self.encoded(*component);
            let bit = index * bits as usize;
            words[bit / 32] |= raw << (bit % 32);
        }
        words
    }

    /// What loading gives: components that there are none of are 0, or 1 for alpha.
    fn loaded(&self, components: [u32; 4]) -> [u32; 4] {
        let one = if self.scalar() == "f32" { 1.0f32.to_bits() } else { 1 };
        let missing = [0, 0, 0, one];
        [0, 1, 2, 3].map(|i| if i < self.components { self.encoded(components[i]).0 } else { missing[i] })
    }
}

/// Four numbers for a texel.
fn numbers(x: u32, y: u32, level: u32) -> [u32; 4] {
    [0, 1, 2, 3].map(|channel: u32| {
        let place = x.wrapping_mul(4).wrapping_add(y.wrapping_mul(40)).wrapping_add(level * 400);
        place.wrapping_add(channel + 1)
    })
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
            @group(0) @binding(1) var<storage, read> values: array<vec4<{scalar}>>;
            @compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
                let at = vec2<i32>(id.xy) - 2;
                if id.x % 3u == 2u {{ return; }}
                textureStore(to, at, values[(at.y + 2) * 16 + at.x + 2]);
                textureStore(to, vec2(at.x + 0x40000000, at.y), vec4<{scalar}>(9));
                textureStore(to, vec2(at.x, at.y - 0x7ffffff0), vec4<{scalar}>(9));
            }}",
            name = format.name,
            scalar = format.scalar()
        );
        // All four components are given, also to formats that keep fewer.
        let value = |x: u32, y: u32| numbers(x.wrapping_add(5), y, 1);
        let values = Buffer::new((0..256).flat_map(|i: u32| {
            let components = value((i % 16).wrapping_sub(2), (i / 16).wrapping_sub(2));
            components.map(|component| format.encoded(component).0)
        }));
        for before in [filled(format, 9, 5, 2), Texture::with_levels(format.format, 9, 5, 2)] {
            let mut expected = before.read();
            for (i, texel) in (0..45).zip(expected.chunks_mut(format.format.words())) {
                if (i % 9 + 2) % 3 != 2 {
                    texel.copy_from_slice(&format.texel(value(i % 9, i / 9)));
                }
            }
            let bindings = [Binding::texture(0, 0, &before), Binding::buffer(0, 1, &values)];
            executor(&source).dispatch([2, 2, 1], &bindings).unwrap();
            assert_eq!(before.read(), expected, "{}", format.name);
        }
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
            if name == "r32float" { (number as f32).to_bits() } else { number }
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
    let (a, b) = (filled(&FORMATS[2], 8, 8, 1), filled(&FORMATS[5], 8, 8, 1));
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
