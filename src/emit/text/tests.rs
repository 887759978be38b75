//! The shape of what is written.

use crate::emit::{GlslOptions, HlslOptions, MslOptions, WgslOptions};
use crate::kernel::Kernel;

/// The body of the entry point of a module that has one buffer, `data`.
fn written(body: &str) -> String {
    let text = format!(
        "@group(0) @binding(0) var<storage, read_write> data: array<u32, 8>;\n\
         fn change() -> u32 {{ data[0] = 5u; return data[1]; }}\n\
         fn look() -> u32 {{ return data[0]; }}\n\
         @compute @workgroup_size(1)\nfn fill() {{\n{body}\n}}\n"
    );
    let kernel = Kernel::from_text("fill", &text).unwrap();
    let written = kernel.wgsl(&WgslOptions::default()).unwrap();
    let body = written.split("fn fill() {\n").nth(1).unwrap().strip_suffix("}\n").unwrap();
    body.lines().map(|line| line.trim_start().to_owned() + "\n").collect()
}

#[test]
fn values_stay_ahead_of_what_changes_them() {
    assert_eq!(written("data[2] = data[0] + data[1];"), "data[2] = data[0] + data[1];\n");
    // `let` reads before the store, whatever the names.
    let swap = "let a = data[0]; data[0] = data[1]; data[1] = a;";
    assert_eq!(written(swap), "let a = data[0];\ndata[0] = data[1];\ndata[1] = a;\n");
    // The left side is read before the call changes it.
    let text = written("data[2] = data[0] + change();");
    assert_eq!(text, "let data_value = data[0];\nlet value = change();\ndata[2] = data_value + value;\n");
    // Two calls that only read move; one that writes does not.
    assert_eq!(written("data[2] = look() * look();"), "data[2] = look() * look();\n");
    let text = written("data[2] = look() * change();");
    assert_eq!(text, "let value = look();\nlet value_2 = change();\ndata[2] = value * value_2;\n");
}

#[test]
fn loops_and_conditions_look_like_the_sources() {
    for text in [
        "for (var i = 0u; i < 4u; i++) {\ndata[i] += 2u;\n}\n",
        "var i = data[0];\nwhile i < 4u {\ni += data[i];\n}\ndata[1] = i;\n",
        "if data[0] < 2u && look() == 3u || data[1] > 4u {\ndata[2] = 1u;\n}\n",
        "if data[0] == 1u {\ndata[1] = 2u;\n} else if data[0] == 2u {\ndata[1] = 3u;\n} else {\ndata[1] = 4u;\n}\n",
        "data[0] = (data[1] + 2u) * 3u - (data[2] - data[3]);\n",
        "data[0] = (data[1] & 255u) | (data[2] << 8u);\n",
    ] {
        let expected = text
            .replace("2u && look() == 3u || data", "2u && look() == 3u) || data")
            .replace("if data[0] < 2u &&", "if (data[0] < 2u &&");
        assert_eq!(written(text), expected);
    }
    // A variable of a loop's body begins anew each time; one that outlives it does not.
    let text = written("for (var i = 0u; i < 2u; i++) { var s = 0u; s += i; data[i] = s; }");
    assert_eq!(text, "for (var i = 0u; i < 2u; i++) {\nvar s = 0u;\ns += i;\ndata[i] = s;\n}\n");
    let text = written("var s = 0u; for (var i = 0u; i < 2u; i++) { s += i; data[i] = s; }");
    assert_eq!(text, "var s = 0u;\nfor (var i = 0u; i < 2u; i++) {\ns += i;\ndata[i] = s;\n}\n");
}

#[test]
fn variables_that_nobody_reads_are_left_out() {
    assert_eq!(written("var a = 1u; a = data[0]; data[1] = 2u;"), "data[1] = 2u;\n");
}

#[test]
fn what_has_no_text_form_is_refused_by_name() {
    let text = "@group(0) @binding(0) var<storage, read_write> data: array<u32, 8>;\n\
         @compute @workgroup_size(1)\nfn fill() {\n switch data[0] { case 1u: { data[1] = 1u; } default: {} }\n}\n";
    let error = Kernel::from_text("fill", text).unwrap().wgsl(&WgslOptions::default()).unwrap_err().to_string();
    assert!(error.contains("kernel `fill` failed to write WGSL") && error.contains("Switch"), "{error}");
}

#[test]
fn functions_of_integers_that_a_language_lacks_are_refused_by_name() {
    let kernel = |expression: &str| {
        let text = format!(
            "@group(0) @binding(0) var<storage, read_write> data: array<i32, 4>;\n\
             @compute @workgroup_size(1)\nfn fill() {{\n let a = vec2<i32>(data[0], data[1]);\n data[2] = {expression};\n}}\n"
        );
        Kernel::from_text("fill", &text).unwrap()
    };
    let (dot, sign) = (kernel("dot(a, a.yx)"), kernel("sign(a.x)"));
    let (msl, glsl, hlsl) = (MslOptions::default(), GlslOptions::default(), HlslOptions::default());
    for (result, function, stage) in [
        (dot.msl(&msl), "Dot", "write MSL"),
        (sign.msl(&msl), "Sign", "write MSL"),
        (dot.glsl(&glsl), "Dot", "write GLSL"),
    ] {
        let error = result.unwrap_err().to_string();
        assert!(error.contains(stage) && error.contains(&format!("{function} of integers")), "{error}");
    }
    assert!(dot.hlsl(&hlsl).unwrap().contains("dot(a, a.yx)"));
    assert!(sign.glsl(&glsl).unwrap().contains("sign(a.x)"));
    // Those of floats are written.
    assert!(kernel("i32(dot(vec2<f32>(a), vec2<f32>(0.5, f32(a.y))))").msl(&msl).unwrap().contains("dot(float2(a), "));
}
