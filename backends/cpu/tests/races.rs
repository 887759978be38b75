//! Checked execution finds what two workgroups of one dispatch must not do to the same memory.

mod support;

use limpid_cpu::{Binding, Buffer, Fault, FaultKind, Sampler, TexelFormat, Texture};
use proptest::prelude::*;
use support::executor;

/// Faults of four workgroups of eight with a buffer of plain words and one of atomic words, and the lines they are on.
fn faults_with(body: &str, plain: &Buffer, atomic: &Buffer) -> Vec<(Fault, String)> {
    let source = format!(
        "@group(0) @binding(0) var<storage, read_write> plain: array<u32>;
        @group(0) @binding(1) var<storage, read_write> shared_: array<atomic<u32>>;
        @compute @workgroup_size(8) fn main(
            @builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32,
            @builtin(workgroup_id) group: vec3<u32>,
        ) {{
            let i = id.x;
{body}
        }}"
    );
    let bindings = [Binding::buffer(0, 0, plain), Binding::buffer(0, 1, atomic)];
    let found = executor(&source).dispatch_checked([4, 1, 1], &bindings).unwrap();
    let line = |fault: &Fault| source[fault.offset.unwrap()..].lines().next().unwrap_or_default().to_owned();
    found.into_iter().map(|fault| (fault.clone(), line(&fault))).collect()
}

fn faults(body: &str) -> Vec<(Fault, String)> {
    faults_with(body, &Buffer::zeroed(64), &Buffer::zeroed(64))
}

#[test]
fn two_workgroups_that_write_a_word_are_named_with_the_line() {
    let found = faults("plain[i] = 1u;\nif group.x != 1u && lane == 3u {\nplain[lane] = 5u;\n}");
    // Workgroup 0 wrote all of its words before.
    let expected = (FaultKind::RaceBetweenWorkgroups, [2, 0, 0], Some([0, 0, 0]), 3, 2);
    assert_eq!(found.len(), 1, "{found:?}");
    let (fault, line) = &found[0];
    assert_eq!((fault.kind, fault.workgroup, fault.other_workgroup, fault.invocation, fault.count), expected);
    assert!(line.starts_with("plain[lane]"), "{line}");
    assert_eq!(fault.kind.to_string(), "uses memory that another workgroup uses");
}

#[test]
fn reading_what_another_workgroup_writes_is_a_race_in_either_order() {
    // The first workgroup reads what the second writes, and the other way round.
    for neighbour in ["(i + 8u) % 32u", "(i + 24u) % 32u"] {
        let found = faults(&format!("let seen = plain[{neighbour}];\nplain[i] = seen;"));
        assert!(found.iter().all(|(fault, _)| fault.kind == FaultKind::RaceBetweenWorkgroups), "{found:?}");
        assert!(found.iter().any(|(fault, _)| fault.other_workgroup == Some([0, 0, 0])), "{found:?}");
    }
    let own = "let seen = plain[i];\nplain[i] = seen + plain[group.x * 8u + 7u - lane];";
    assert_eq!(faults(own), [], "inside of a workgroup");
    assert_eq!(faults("plain[32u + i] = plain[lane] + plain[31u];"), [], "only reads are shared");
}

#[test]
fn atomic_operations_are_no_race_with_each_other() {
    let body = "atomicAdd(&shared_[lane], 1u);\natomicStore(&shared_[9], i);\nplain[i] = atomicLoad(&shared_[lane])
        + atomicCompareExchangeWeak(&shared_[10], 0u, 1u).old_value;";
    assert_eq!(faults(body), []);
    // Through another binding of the same buffer, plain uses are.
    let both = Buffer::zeroed(64);
    let kinds = |body: &str| faults_with(body, &both, &both).iter().map(|(fault, _)| fault.kind).collect::<Vec<_>>();
    let race = FaultKind::RaceBetweenWorkgroups;
    assert_eq!(kinds("atomicAdd(&shared_[0], 1u);\nif plain[32u + i] == 5u { return; }"), []);
    assert_eq!(kinds("if plain[group.x] + atomicLoad(&shared_[lane]) == 5u { return; }"), []);
    assert_eq!(kinds("if group.x == 0u { atomicAdd(&shared_[0], 1u); }\nif plain[group.x] == 5u { return; }"), []);
    assert_eq!(kinds("if group.x == 0u { atomicAdd(&shared_[0], 1u); }\nif plain[0] == 5u { return; }"), [race]);
    assert_eq!(
        kinds("if group.x == 2u { plain[0] = 1u; }\nif atomicLoad(&shared_[0]) == 5u { return; }"),
        [race, race]
    );
}

#[test]
fn texels_of_storage_textures() {
    let kinds = |body: &str| {
        let source = format!(
            "@group(0) @binding(0) var image: texture_storage_2d<r32float, read_write>;
            @group(0) @binding(1) var other: texture_2d<f32>;
            @group(0) @binding(2) var s: sampler;
            @group(0) @binding(3) var<storage, read_write> out: array<f32>;
            @compute @workgroup_size(4, 4) fn main(
                @builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32,
            ) {{
                {body}
            }}"
        );
        let faults = |other: &Texture, image: &Texture| {
            let out = Buffer::zeroed(256);
            let bindings = [
                Binding::texture(0, 0, image),
                Binding::texture(0, 1, other),
                Binding::sampler(0, 2, Sampler::default()),
                Binding::buffer(0, 3, &out),
            ];
            let found = executor(&source).dispatch_checked([4, 4, 1], &bindings).unwrap();
            found.into_iter().map(|fault| (fault.kind, fault.workgroup, fault.other_workgroup)).collect::<Vec<_>>()
        };
        let image = Texture::new(TexelFormat::R32Float, 16, 16);
        [faults(&Texture::new(TexelFormat::R32Float, 16, 16), &image), faults(&image, &image)]
    };
    let place = "let at = id.xy;\nlet index = id.y * 16u + id.x;\n";
    let own = "textureStore(image, at, textureLoad(image, at) + 1.0);";
    assert_eq!(kinds(&format!("{place}{own}")), [[], []]);
    let [apart, same] = kinds(&format!("{place}{own}\nout[index] = textureLoad(other, 15u - at, 0).x;"));
    assert_eq!(apart, []);
    // Sixteen workgroups, by twos; the second of them sees it when it reads, or when it loads before it stores.
    let reading = (FaultKind::RaceBetweenWorkgroups, [0, 2, 0], Some([3, 1, 0]));
    assert!(same.contains(&reading), "{same:?}");
    let sample = "out[index] = textureSampleLevel(other, s, vec2<f32>(15u - at) / 16.0 + 1.0 / 32.0, 0.0).x;";
    let [apart, same] = kinds(&format!("{place}{own}\n{sample}"));
    assert_eq!(apart, []);
    assert!(same.contains(&reading), "{same:?}");
    let [apart, _] = kinds(&format!("{place}textureStore(image, at / 2u * 2u % 8u, vec4(1.0));\nout[index] = 1.0;"));
    assert_eq!(apart[0], (FaultKind::RaceBetweenWorkgroups, [2, 0, 0], Some([0, 0, 0])));
}

#[test]
fn halves_of_a_word_are_apart() {
    let kinds = |place: &str| {
        let source = format!(
            "enable f16;
            @group(0) @binding(0) var<storage, read_write> halves: array<f16>;
            @compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
                halves[{place}] += 1.0h;
            }}"
        );
        let halves = Buffer::zeroed(16);
        let found = executor(&source).dispatch_checked([32, 1, 1], &[Binding::buffer(0, 0, &halves)]).unwrap();
        found.into_iter().map(|fault| fault.kind).collect::<Vec<_>>()
    };
    assert_eq!(kinds("id.x"), []);
    assert_eq!(kinds("id.x / 2u"), [FaultKind::RaceBetweenWorkgroups; 2]);
}

/// What an invocation does at an address.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Access {
    Read,
    Write,
    AtomicLoad,
    AtomicAdd,
}

impl Access {
    fn conflicts(self, other: Self) -> bool {
        let one_of = |a, b| (self, other) == (a, b) || (self, other) == (b, a);
        self == Self::Write || other == Self::Write || one_of(Self::Read, Self::AtomicAdd)
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn races_are_found_where_any_two_accesses_conflict(accesses in proptest::collection::vec((0u32..4, 0u32..40), 16)) {
        let source = "
            @group(0) @binding(0) var<storage, read_write> plain: array<u32>;
            @group(0) @binding(1) var<storage, read_write> words: array<atomic<u32>>;
            @group(0) @binding(2) var<storage, read> accesses: array<vec2<u32>>;
            @group(0) @binding(3) var<storage, read_write> out: array<u32>;
            @compute @workgroup_size(2, 2) fn main(
                @builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32,
            ) {
                let i = (group.y * 2u + group.x) * 4u + lane;
                let address = accesses[i].y;
                switch accesses[i].x {
                    case 0u: { out[i] = plain[address]; }
                    case 1u: { plain[address] = i; }
                    case 2u: { out[i] = atomicLoad(&words[address]); }
                    default: { atomicAdd(&words[address], 1u); }
                }
            }";
        let (words, out) = (Buffer::zeroed(40), Buffer::zeroed(16));
        let input = Buffer::new(accesses.iter().flat_map(|(kind, address)| [*kind, *address]));
        let bindings = [
            Binding::buffer(0, 0, &words),
            Binding::buffer(0, 1, &words),
            Binding::buffer(0, 2, &input),
            Binding::buffer(0, 3, &out),
        ];
        let found = executor(source).dispatch_checked([2, 2, 1], &bindings).unwrap();
        let kinds = [Access::Read, Access::Write, Access::AtomicLoad, Access::AtomicAdd];
        let named = |(kind, address): &(u32, u32)| (kinds[*kind as usize], *address);
        let of_group = |group: usize| accesses[4 * group..4 * group + 4].iter().map(named);
        let conflict = |a: usize, b: usize| {
            of_group(a).any(|(kind, address)| of_group(b).any(|(other, at)| address == at && kind.conflicts(other)))
        };
        let expected = (0..4).any(|a| (0..a).any(|b| conflict(a, b)));
        prop_assert_eq!(!found.is_empty(), expected);
        for fault in found {
            prop_assert_eq!(fault.kind, FaultKind::RaceBetweenWorkgroups);
            let number = |group: [u32; 3]| (group[1] * 2 + group[0]) as usize;
            let (group, other) = (number(fault.workgroup), number(fault.other_workgroup.unwrap()));
            prop_assert!(group != other && conflict(group, other), "{} and {}", group, other);
        }
    }
}
