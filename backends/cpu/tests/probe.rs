//! The numerical probe: what it sees of small programs and of limpid's kernels.

use limpid_cpu::{Binding, Buffer, Event, EventKind, Executor, Probe};

/// What the probe sees of one workgroup of 64 that reads `input` and writes `output`; and what was written.
fn probe(body: &str, input: &[f32]) -> (Probe, Vec<f32>, String) {
    let source = format!(
        "@group(0) @binding(0) var<storage, read> input: array<f32>;
        @group(0) @binding(1) var<storage, read_write> output: array<f32>;
        @compute @workgroup_size(64)
        fn main(@builtin(local_invocation_index) lane: u32) {{
            let x = input[lane];
{body}
        }}"
    );
    let module = naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)));
    let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), Default::default());
    let executor = Executor::new(&module, &validator.validate(&module).unwrap(), "main").unwrap();
    let input = Buffer::new((0..64).map(|i| input[i % input.len()].to_bits()));
    let (plain, output) = (Buffer::zeroed(64), Buffer::zeroed(64));
    executor.dispatch([1, 1, 1], &[Binding::buffer(0, 0, &input), Binding::buffer(0, 1, &plain)]).unwrap();
    let bindings = [Binding::buffer(0, 0, &input), Binding::buffer(0, 1, &output)];
    let probe = executor.dispatch_probed([1, 1, 1], &bindings).unwrap();
    assert_eq!(output.read(), plain.read(), "the probe changes results");
    (probe, output.read().into_iter().map(f32::from_bits).collect(), source)
}

fn events(body: &str, input: &[f32]) -> Vec<(EventKind, u64)> {
    probe(body, input).0.events.iter().map(|event| (event.kind, event.count)).collect()
}

#[test]
fn events_are_counted_where_they_arise() {
    assert_eq!(events("output[lane] = x * 3.0 + 1.0;", &[1.5, 2.0]), []);
    assert_eq!(events("output[lane] = x * 1e30;", &[1e30, 1.0]), [(EventKind::Infinite, 32)]);
    assert_eq!(events("output[lane] = 1.0 / x;", &[0.0, 1.0, 1.0, 1.0]), [(EventKind::Infinite, 16)]);
    assert_eq!(events("output[lane] = x * 1e-30;", &[1e-10, 1.0]), [(EventKind::Denormal, 32)]);
    // What is made of NaN is no event of its own.
    assert_eq!(events("output[lane] = sqrt(x) + 1.0;", &[-1.0, 4.0]), [(EventKind::Nan, 32)]);
    let (probe, _, source) = probe("let big = x + 1.0;\noutput[lane] = big * 1e38;", &[9.0]);
    let [Event { offset: Some(offset), operands, value, .. }] = &probe.events[..] else { panic!("{probe:?}") };
    assert!(source[*offset..].starts_with("big * 1e38"), "{}", &source[*offset..]);
    assert_eq!((&operands[..], *value), (&[10.0, 1e38][..], f32::INFINITY));
}

#[test]
fn only_invocations_that_take_part_count() {
    let body = "if x > 0.0 {\noutput[lane] = 1.0 / (x - 1.0);\n}";
    assert_eq!(events(body, &[1.0, -1.0, 2.0, 1.0]), [(EventKind::Infinite, 32)]);
    assert_eq!(events(body, &[-1.0, 2.0]), []);
    let guarded = "if x != 0.0 {\noutput[lane] = 1.0 / x;\n}";
    assert_eq!(events(guarded, &[0.0, 3.0]), []);
}

#[test]
fn rounding_errors_are_those_of_64_bits_and_lead_to_their_origin() {
    // Of a third of 1e8 the last places are lost when 1e8 is taken away again.
    let (probe, output, source) =
        probe("let third = x / 3.0;\nlet large = third + 1e8;\noutput[lane] = large - 1e8;", &[1.0]);
    let [error] = &probe.outputs[..] else { panic!("{probe:?}") };
    let exact = 1.0 / 3.0;
    assert_eq!((error.count, error.value), (64, output[0]));
    assert!((error.exact - exact).abs() < 1e-7, "{error:?}");
    assert!((error.relative - (f64::from(output[0]) - exact).abs() / exact).abs() < 1e-6, "{error:?}");
    assert!(source[error.origin.unwrap()..].starts_with("large - 1e8"), "{}", &source[error.origin.unwrap()..]);
    assert_eq!(probe.events.iter().map(|event| event.kind).collect::<Vec<_>>(), [EventKind::Cancellation]);

    let (probe, ..) = self::probe("output[lane] = sqrt(x) * exp(-x) + log(x);", &[1.7, 2.3, 9.1]);
    assert!(probe.outputs[0].relative < 1e-5 && probe.outputs[0].relative > 0.0, "{probe:?}");
    // Exact arithmetic has no error, and what is chosen, assigned and looped over keeps its own.
    let body = "var sum = 0.0;\nfor (var i = 0u; i < 8u; i++) { sum += select(0.0, x, i < 4u); }\noutput[lane] = sum;";
    assert_eq!(self::probe(body, &[0.5, 3.0]).0.outputs[0].relative, 0.0);
    // A register that held a rounded 0 and is used again for an exact one.
    let reused = "let lost = (x + 1e9) - 1e9;\noutput[lane] = lost;\nvar words = array<f32, 4>();\nwords[lane % 4u] = 0.0;\n\
                  output[lane] = words[(lane + 1u) % 4u] * x;";
    let outputs = self::probe(reused, &[3.0]).0.outputs;
    assert_eq!((outputs.len(), outputs[1].relative), (2, 0.0), "{outputs:?}");
    let thirds = body.replace("select(0.0, x,", "select(0.0, x / 3.0,");
    let relative = self::probe(&thirds, &[1.0, 5.0]).0.outputs[0].relative;
    assert!(relative > 1e-9 && relative < 2e-7, "{relative}");
}
