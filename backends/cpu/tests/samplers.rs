//! Samplers, against the Vulkan specification's formulas in double precision.

mod sampling;
mod support;

use limpid_cpu::{AddressMode, Binding, BorderColor, Buffer, Compare, Filter, Sampler, TexelFormat, Texture};
use proptest::prelude::*;
use sampling::{Image, Oracle};
use support::{bits, dispatch, executor, floats};

fn filter() -> impl Strategy<Value = Filter> {
    prop_oneof![Just(Filter::Nearest), Just(Filter::Linear)]
}

fn address() -> impl Strategy<Value = AddressMode> {
    proptest::sample::select(vec![
        AddressMode::ClampToEdge,
        AddressMode::Repeat,
        AddressMode::MirrorRepeat,
        AddressMode::ClampToBorder,
    ])
}

fn sampler() -> impl Strategy<Value = Sampler> {
    let border = vec![BorderColor::TransparentBlack, BorderColor::OpaqueBlack, BorderColor::OpaqueWhite];
    let lods = (-1.0f32..2.0, 0.0f32..4.0);
    ([address(), address()], [filter(), filter(), filter()], lods, proptest::sample::select(border)).prop_map(
        |(address, [magnify, minify, mip], (low, range), border)| Sampler {
            address,
            magnify,
            minify,
            mip,
            lod: [low, low + range],
            border,
            compare: None,
        },
    )
}

fn image() -> impl Strategy<Value = Image> {
    let formats =
        vec![TexelFormat::R32Float, TexelFormat::Rgba32Float, TexelFormat::Rgba16Float, TexelFormat::Rgba8Unorm];
    let numbers = proptest::collection::vec(-4.0f32..4.0, 60);
    (proptest::sample::select(formats), [1u32..9, 1u32..9], 1u32..5, numbers)
        .prop_map(|(format, size, levels, numbers)| Image::new(format, size, levels, &numbers))
}

/// Two coordinates, a level of detail and one number more.
fn places() -> impl Strategy<Value = Vec<[f32; 4]>> {
    let coordinate = || prop_oneof![-3.0f32..3.0, (-24i32..24).prop_map(|i| i as f32 / 8.0)];
    let lod = prop_oneof![9 => -1.0f32..5.0, 1 => Just(0.0)];
    let place = (coordinate(), coordinate(), lod, -4.0f32..4.0);
    proptest::collection::vec(place.prop_map(|(s, t, lod, extra)| [s, t, lod, extra]), 70)
}

/// What an expression of `p`, an element of `places`, gives for each.
fn evaluate(
    texture_type: &str,
    expression: &str,
    texture: &Texture,
    sampler: Sampler,
    places: &[[f32; 4]],
) -> Vec<[f32; 4]> {
    let kind = if sampler.compare.is_some() { "sampler_comparison" } else { "sampler" };
    let count = places.len();
    let source = format!(
        "@group(0) @binding(0) var<storage, read_write> out: array<vec4<f32>>;
        @group(0) @binding(1) var<storage, read> places: array<vec4<f32>>;
        @group(0) @binding(2) var image: {texture_type};
        @group(0) @binding(3) var s: {kind};
        fn look_up(image: {texture_type}, s: {kind}, p: vec4<f32>) -> vec4<f32> {{ return vec4({expression}); }}
        @compute @workgroup_size({count}) fn main(@builtin(local_invocation_index) i: u32) {{
            if i % 2u == 0u {{ out[i] = look_up(image, s, places[i]); }} else {{
                let p = places[i];
                out[i] = vec4({expression});
            }}
        }}"
    );
    let (out, input) = (Buffer::zeroed(4 * count), Buffer::new(places.iter().flat_map(|place| bits(place))));
    let bindings = [
        Binding::buffer(0, 0, &out),
        Binding::buffer(0, 1, &input),
        Binding::texture(0, 2, texture),
        Binding::sampler(0, 3, sampler),
    ];
    dispatch(&executor(&source), [1, 1, 1], &bindings, &source);
    floats(&out.read()).chunks(4).map(|texel| [texel[0], texel[1], texel[2], texel[3]]).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn samples_at_a_level(image in image(), sampler in sampler(), places in places()) {
        let texture = image.texture();
        let oracle = Oracle { image: &image, sampler, offset: [0, 0], reference: None };
        let all = evaluate("texture_2d<f32>", "textureSampleLevel(image, s, p.xy, p.z)", &texture, sampler, &places);
        for (place, actual) in places.iter().zip(all) {
            let [s, t, lod, _] = *place;
            let expected = oracle.sample([s.into(), t.into()], lod.into());
            let accepted = oracle.accepts(actual, [s, t], lod.into());
            prop_assert!(accepted, "{:?}: {:?}, expected {:?}", place, actual, expected);
        }
    }

    #[test]
    fn samples_with_gradients_and_offsets(image in image(), sampler in sampler(), places in places()) {
        let texture = image.texture();
        let oracle = Oracle { image: &image, sampler, offset: [-3, 2], reference: None };
        let expression = "textureSampleGrad(image, s, p.xy, vec2(p.z, p.w), vec2(0.5 * p.w, 0.1), vec2(-3, 2))";
        let all = evaluate("texture_2d<f32>", expression, &texture, sampler, &places);
        let [width, height] = image.sizes[0].map(f64::from);
        for (place, actual) in places.iter().zip(all) {
            let [s, t, z, w] = place.map(f64::from);
            let x = (z * width).hypot(w * height);
            let y = (0.5 * w * width).hypot(0.1 * height);
            let lod = x.max(y).log2();
            let expected = oracle.sample([s, t], lod);
            let accepted = oracle.accepts(actual, [place[0], place[1]], lod);
            prop_assert!(accepted, "{:?}: {:?}, expected {:?}", place, actual, expected);
        }
    }

    #[test]
    fn samples_that_stay_half_a_texel_inside(image in image(), sampler in sampler(), places in places()) {
        let texture = image.texture();
        let oracle = Oracle { image: &image, sampler, offset: [0, 0], reference: None };
        let half = image.sizes[0].map(|size| 0.5 / size as f32);
        let expression = "textureSampleBaseClampToEdge(image, s, p.xy)";
        for (place, actual) in places.iter().zip(evaluate("texture_2d<f32>", expression, &texture, sampler, &places)) {
            let at = [0, 1].map(|axis| place[axis].clamp(half[axis], 1.0 - half[axis]));
            prop_assert!(oracle.accepts(actual, at, 0.0), "{:?}: {:?}", place, actual);
        }
    }

    #[test]
    fn gathers_four_texels(image in image(), sampler in sampler(), places in places(), component in 0usize..4) {
        let texture = image.texture();
        let oracle = Oracle { image: &image, sampler, offset: [1, -2], reference: None };
        let expression = format!("textureGather({component}, image, s, p.xy, vec2(1, -2))");
        let [width, height] = image.sizes[0].map(|size| size as f32);
        for (place, actual) in places.iter().zip(evaluate("texture_2d<f32>", &expression, &texture, sampler, &places)) {
            let [u, v] = [place[0] * width - 0.5, place[1] * height - 0.5];
            // Rounding may move what lies on a boundary.
            let distance = |u: f32| (u - u.round()).abs();
            if distance(u) < 1e-5 || distance(v) < 1e-5 {
                continue;
            }
            let (i, j) = (u.floor() as i64, v.floor() as i64);
            let corners = [(0, 1), (1, 1), (1, 0), (0, 0)];
            let expected = corners.map(|(x, y)| oracle.texel(0, i + x, j + y)[component] as f32);
            prop_assert_eq!(actual, expected, "{:?}", place);
        }
    }

    #[test]
    fn comparisons_with_depth(mut image in image(), sampler in sampler(), places in places(), compare in 0usize..8) {
        let all = [
            Compare::Never, Compare::Less, Compare::Equal, Compare::LessEqual,
            Compare::Greater, Compare::NotEqual, Compare::GreaterEqual, Compare::Always,
        ];
        // Few values, so that some are equal.
        let sampler = Sampler { compare: Some(all[compare]), ..sampler };
        image.format = TexelFormat::R32Float;
        image.values.iter_mut().for_each(|texel| *texel = [texel[0].round(), 0.0, 0.0, 1.0]);
        let places: Vec<_> = places.iter().map(|[s, t, lod, reference]| [*s, *t, *lod, reference.round()]).collect();
        let texture = image.texture();
        let oracle =
            |reference: f32| Oracle { image: &image, sampler, offset: [0, 0], reference: Some(reference.into()) };
        let depth = |expression: &str, sampler| evaluate("texture_depth_2d", expression, &texture, sampler, &places);
        let compared = depth("textureSampleCompareLevel(image, s, p.xy, p.w)", sampler);
        for (place, actual) in places.iter().zip(compared) {
            prop_assert!(oracle(place[3]).accepts(actual, [place[0], place[1]], 0.0), "{:?}: {:?}", place, actual);
        }
        let gathered = depth("textureGatherCompare(image, s, p.xy, p.w)", sampler);
        let [width, height] = image.sizes[0].map(|size| size as f32);
        for (place, actual) in places.iter().zip(gathered) {
            let [u, v] = [place[0] * width - 0.5, place[1] * height - 0.5];
            let distance = |u: f32| (u - u.round()).abs();
            if distance(u) > 1e-5 && distance(v) > 1e-5 {
                let (i, j) = (u.floor() as i64, v.floor() as i64);
                let expected =
                    [(0, 1), (1, 1), (1, 0), (0, 0)].map(|(x, y)| oracle(place[3]).texel(0, i + x, j + y)[0] as f32);
                prop_assert_eq!(actual, expected, "{:?}", place);
            }
        }
        let plain = Sampler { compare: None, ..sampler };
        let loaded = Oracle { image: &image, sampler: plain, offset: [0, 0], reference: None };
        let all = depth("textureSampleLevel(image, s, p.xy, i32(p.z))", plain);
        for (place, actual) in places.iter().zip(all) {
            let texel = [actual[0], 0.0, 0.0, 1.0];
            let lod = f64::from(place[2].trunc());
            let at = [place[0], place[1]];
            prop_assert!(loaded.accepts(texel, at, lod), "{:?}: {:?}", place, actual);
        }
    }

    #[test]
    fn any_bits_as_coordinates_give_a_value_between_the_texels(
        image in image(), sampler in sampler(), words in proptest::collection::vec(any::<[u32; 4]>(), 60),
    ) {
        let mut places: Vec<_> = words.iter().map(|words| words.map(f32::from_bits)).collect();
        let special = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e10, -1e-40, -0.0];
        places.extend(special.iter().zip(special.iter().rev()).map(|(a, b)| [*a, *b, *b, *a]));
        let texture = image.texture();
        let outside = [0.0, 1.0];
        let all = || image.values.iter().flatten().copied().chain(outside);
        let (low, high) = (all().fold(f32::MAX, f32::min), all().fold(f32::MIN, f32::max));
        for expression in [
            "textureSampleLevel(image, s, p.xy, p.z)",
            "textureSampleGrad(image, s, p.xy, p.zw, p.wx)",
            "textureSampleBaseClampToEdge(image, s, p.xy)",
            "textureGather(0, image, s, p.xy)",
        ] {
            let all = evaluate("texture_2d<f32>", expression, &texture, sampler, &places);
            for (place, actual) in places.iter().zip(all) {
                let between = actual.iter().all(|value| *value >= low - 1e-4 && *value <= high + 1e-4);
                prop_assert!(between, "{} at {:?}: {:?}", expression, place, actual);
            }
        }
    }
}

#[test]
fn what_is_no_number_counts_as_zero_and_infinity_is_the_edge() {
    let image = Image::new(TexelFormat::R32Float, [4, 4], 1, &(0..64).map(|i| i as f32 / 16.0).collect::<Vec<_>>());
    let texture = image.texture();
    let sample = |mode, s: f32| {
        let sampler = Sampler { address: [mode; 2], magnify: Filter::Linear, ..Default::default() };
        let places = [[s, 0.4, 0.0, 0.0], [s, 0.4, f32::NAN, 0.0]];
        let all = evaluate("texture_2d<f32>", "textureSampleLevel(image, s, p.xy, p.z)", &texture, sampler, &places);
        assert_eq!(all[0], all[1]);
        all[0]
    };
    use AddressMode as M;
    for mode in [M::ClampToEdge, M::Repeat, M::MirrorRepeat, M::ClampToBorder] {
        assert_eq!(sample(mode, f32::NAN), sample(mode, 0.0), "{mode:?}");
    }
    for infinity in [f32::INFINITY, f32::MAX] {
        assert_eq!(sample(M::ClampToEdge, infinity), sample(M::ClampToEdge, 1.0));
        assert_eq!(sample(M::ClampToEdge, -infinity), sample(M::ClampToEdge, 0.0));
        assert_eq!(sample(M::ClampToBorder, infinity), [0.0, 0.0, 0.0, 1.0]);
        for mode in [M::Repeat, M::MirrorRepeat] {
            assert_eq!(sample(mode, infinity), sample(mode, 0.0));
            assert_eq!(sample(mode, -infinity), sample(mode, 0.0));
        }
    }
}

#[test]
fn integers_are_gathered_as_they_are() {
    let mut texture = Texture::new(TexelFormat::Rgba8Sint, 4, 4);
    texture.write((0..16).map(|i| 0x8040_2000u32.wrapping_add(i * 0x0101_0101)));
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: vec4<i32>;
        @group(0) @binding(1) var image: texture_2d<i32>;
        @group(0) @binding(2) var s: sampler;
        @compute @workgroup_size(1) fn main() { out = textureGather(3, image, s, vec2(0.5, 0.5)); }";
    let out = Buffer::zeroed(4);
    let bindings =
        [Binding::buffer(0, 0, &out), Binding::texture(0, 1, &texture), Binding::sampler(0, 2, Sampler::default())];
    executor(source).dispatch([1, 1, 1], &bindings).unwrap();
    let expected = [9, 10, 6, 5].map(|i: i32| (-128 + i).cast_unsigned());
    assert_eq!(out.read(), expected);
}

#[test]
fn samplers_must_compare_where_the_kernel_does() {
    for (kind, texture, call, wrong) in [
        ("sampler", "texture_2d<f32>", "textureSampleLevel(image, s, vec2(0.5), 0.0).x", Some(Compare::Less)),
        ("sampler_comparison", "texture_depth_2d", "textureSampleCompareLevel(image, s, vec2(0.5), 0.5)", None),
    ] {
        let source = format!(
            "@group(0) @binding(0) var<storage, read_write> out: f32;
            @group(0) @binding(1) var image: {texture};
            @group(0) @binding(2) var s: {kind};
            @compute @workgroup_size(1) fn main() {{ out = {call}; }}"
        );
        let (out, texture) = (Buffer::zeroed(1), Texture::new(TexelFormat::R32Float, 2, 2));
        let run = |sampler: Binding<'_>| {
            let bindings = [Binding::buffer(0, 0, &out), Binding::texture(0, 1, &texture), sampler];
            executor(&source).dispatch([1, 1, 1], &bindings)
        };
        let error = run(Binding::sampler(0, 2, Sampler { compare: wrong, ..Default::default() })).unwrap_err();
        assert!(error.to_string().contains("`s` at group 0, binding 2 needs a sampler that"), "{error}");
        assert!(run(Binding::texture(0, 2, &texture)).is_err());
        let right = if wrong.is_some() { None } else { Some(Compare::Less) };
        run(Binding::sampler(0, 2, Sampler { compare: right, ..Default::default() })).unwrap();
    }
}
