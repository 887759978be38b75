//! What cannot be compiled or run is said, and the number of threads changes nothing.

mod support;

use limpid_cpu::{Binding, Buffer, CompileError, DispatchError, TexelFormat, Texture};
use support::{compile, executor};

#[test]
fn unknown_entry_points_are_named() {
    let source = "@compute @workgroup_size(1) fn main() {} @fragment fn shade() {}";
    for name in ["", "Main", "shade", "nothing"] {
        let error = compile(source, name).unwrap_err();
        assert_eq!(error, CompileError::EntryPoint { name: name.to_owned() });
        assert!(error.to_string().contains(&format!("`{name}`")), "{error}");
    }
    assert!(compile(source, "main").is_ok());
}

/// Compiles a source with something unsupported on the line that ends with `// here`; the message.
fn unsupported(source: &str) -> String {
    match compile(source, "main") {
        Err(error @ CompileError::Unsupported { offset: Some(offset), .. }) => {
            let place = naga::Span::new(offset as u32, offset as u32).location(source);
            let line = source.lines().nth(place.line_number as usize - 1).unwrap();
            assert!(line.ends_with("// here"), "{error} at {line}");
            error.to_string()
        }
        other => panic!("{other:?}\n{source}"),
    }
}

#[test]
fn declarations_that_are_not_supported_are_named_with_their_line() {
    for (declaration, name) in [
        ("@group(0) @binding(0) var sky: texture_cube<f32>;", "sky"),
        ("@group(0) @binding(0) var layers: texture_2d_array<f32>;", "layers"),
        ("@group(0) @binding(0) var volume: texture_3d<f32>;", "volume"),
        ("override factor: u32;", "override"),
    ] {
        let source = format!("// A comment.\n\n{declaration} // here\n\n@compute @workgroup_size(1) fn main() {{}}");
        assert!(unsupported(&source).contains(name), "{declaration}");
    }
}

#[test]
fn code_that_is_not_supported_is_named_with_its_line() {
    for (line, name) in [
        ("var wide: u64;", "64"),
        ("let wide = u64(i);", "64"),
        ("out[1] = u32(5lu + u64(i));", "64"),
        ("if f64(i) < 2.0 {}", "64"),
        ("for (var k = 0lu; k < 2lu; k++) {}", "64"),
        ("out[1] = u32(wide_numbers[i].x);", "64"),
    ] {
        for (body, function) in [(line, "let x = i;"), ("helper(i);", line)] {
            let mark = |code: &str| if code == line { format!("{code} // here") } else { code.to_owned() };
            let source = format!(
                "@group(0) @binding(0) var<storage, read_write> out: array<u32>;
                @group(0) @binding(1) var<storage> wide_numbers: array<vec2<i64>>;
                fn helper(i: u32) {{
                    out[2] = i;
                    {}
                }}
                @compute @workgroup_size(64) fn main(@builtin(local_invocation_index) i: u32) {{
                    out[0] = i;
                    if i < 3u {{
                        {}
                    }}
                }}",
                mark(function),
                mark(body),
            );
            let message = unsupported(&source);
            assert!(message.contains(name), "{line}: {message}");
        }
    }
}

const COPY: &str = "
    @group(0) @binding(0) var<storage, read_write> out: array<f32>;
    @group(2) @binding(5) var image: texture_2d<f32>;
    @group(0) @binding(1) var<uniform> scale: f32;
    @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
        out[id.x] = textureLoad(image, vec2(id.x % 16u, id.x / 16u), 0).x * scale;
    }";

#[test]
fn missing_and_wrong_bindings_are_named() {
    let executor = executor(COPY);
    let (buffer, texture) = (Buffer::zeroed(64), Texture::new(TexelFormat::R32Float, 16, 16));
    let good = [Binding::buffer(0, 0, &buffer), Binding::buffer(0, 1, &buffer), Binding::texture(2, 5, &texture)];
    let named = |bindings: &[Binding<'_>], expected: (&str, u32, u32)| {
        let error = executor.dispatch([1, 1, 1], bindings).unwrap_err();
        let DispatchError::Binding { name, group, binding, .. } = &error else { panic!("{error:?}") };
        assert_eq!((name.as_str(), *group, *binding), expected, "{error}");
        assert!(error.to_string().contains(expected.0), "{error}");
    };
    executor.dispatch([1, 1, 1], &good).unwrap();
    named(&good[1..], ("out", 0, 0));
    named(&[good[0], good[2]], ("scale", 0, 1));
    named(&good[..2], ("image", 2, 5));
    named(&[good[0], good[1], Binding::buffer(2, 5, &buffer)], ("image", 2, 5));
    named(&[good[0], Binding::texture(0, 1, &texture), good[2]], ("scale", 0, 1));
    // The same number in another group is another binding.
    named(&[good[0], good[1], Binding::texture(0, 5, &texture)], ("image", 2, 5));
}

#[test]
fn bindings_may_come_in_any_order_and_be_more_than_needed() {
    let mut image = Texture::new(TexelFormat::R32Float, 16, 16);
    image.write((0..256).map(|texel| (texel as f32).to_bits()));
    let (out, scale, other) = (Buffer::zeroed(256), Buffer::new([3.0f32.to_bits()]), Buffer::zeroed(1));
    let bindings = [
        Binding::buffer(7, 7, &other),
        Binding::texture(2, 5, &image),
        Binding::buffer(0, 1, &scale),
        Binding::texture(0, 9, &image),
        Binding::buffer(0, 0, &out),
    ];
    executor(COPY).dispatch([4, 1, 1], &bindings).unwrap();
    assert_eq!(support::floats(&out.read()), (0..256).map(|texel| 3.0 * texel as f32).collect::<Vec<_>>());
}

#[test]
fn no_workgroups_do_nothing() {
    let source = "
        @group(0) @binding(0) var<storage, read_write> out: array<u32>;
        @compute @workgroup_size(1) fn main() { out[0] = 1u; }";
    for groups in [[0, 1, 1], [1, 0, 1], [1, 1, 0], [0, 0, 0]] {
        let out = Buffer::zeroed(1);
        executor(source).dispatch(groups, &[Binding::buffer(0, 0, &out)]).unwrap();
        assert_eq!(out.read(), [0], "{groups:?}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads_nor_on_earlier_runs() {
    let source = "
        struct Totals { count: atomic<u32>, highest: atomic<i32> }
        @group(0) @binding(0) var<storage, read_write> out: array<f32>;
        @group(0) @binding(1) var<storage, read_write> totals: Totals;
        var<workgroup> tile: array<f32, 100>;
        @compute @workgroup_size(10, 10) fn main(
            @builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) i: u32,
        ) {
            let at = id.y * 300u + id.x;
            tile[i] = f32(at) * 0.37;
            workgroupBarrier();
            var sum = 0.0;
            for (var k = 0u; k <= at % 17u; k++) { sum += sin(tile[(i + k * 7u) % 100u]) / f32(k + 1u); }
            out[at] = sum;
            if sum > 0.0 { atomicAdd(&totals.count, 1u); }
            atomicMax(&totals.highest, i32(sum * 1000.0));
        }";
    let executor = executor(source);
    let run = || {
        let (out, totals) = (Buffer::zeroed(300 * 300), Buffer::zeroed(2));
        executor.dispatch([30, 30, 1], &[Binding::buffer(0, 0, &out), Binding::buffer(0, 1, &totals)]).unwrap();
        (out.read(), totals.read())
    };
    let first = run();
    assert!(first.1[0] > 20_000, "{:?}", first.1);
    for threads in [1, 2, 7, 1] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(run) == first, "{threads} threads");
    }
}
