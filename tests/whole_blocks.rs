//! Blocks that are worked on as a whole: which ones, and that it is the same light.

use std::collections::{BTreeMap, BTreeSet};

use glam::UVec2;
use limpid_harness::strategy::noise;
use limpid_harness::{Case, Executor, Pixel, Snapshot, fastest};

const SIZE: UVec2 = UVec2::new(75, 50);
const ROUGH: f32 = 0.5;

/// What a pixel shows, by its block: rough and flat for the most part.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Shows {
    RoughWall,
    Mirror,
    /// A rough wall behind a bar that is a pixel wide.
    Bar,
    Sky,
}

fn shown(block: UVec2) -> Shows {
    match noise(3, block) {
        n if n < 0.15 => Shows::Mirror,
        n if n < 0.3 => Shows::Bar,
        n if n < 0.4 => Shows::Sky,
        _ => Shows::RoughWall,
    }
}

fn pixel(frame: u32, p: UVec2, shows: Shows) -> Pixel {
    let value = 0.5 + noise(frame, p);
    let wall = Pixel { radiance: [value, 0.5 * value, 0.25, 30.0], roughness: ROUGH, ..Pixel::WALL };
    match shows {
        Shows::RoughWall => wall,
        Shows::Mirror => Pixel { roughness: 0.02, ..wall },
        Shows::Bar if p.x % 4 == 2 => Pixel { depth: 0.5 * wall.depth, ..wall },
        Shows::Bar => wall,
        Shows::Sky => Pixel { depth: 0.0, ..wall },
    }
}

fn run(executor: &mut dyn Executor, case: &Case, whole_blocks: bool) -> Vec<Snapshot> {
    let mut case = case.clone();
    case.settings.features.whole_blocks = whole_blocks;
    case.run(executor)
}

#[test]
fn each_block_of_a_listed_tile_is_in_one_list() {
    let case = Case::still(SIZE, 3, |frame, p| pixel(frame, p, shown(p / 4)));
    for snapshot in run(&mut *fastest(), &case, true) {
        let [others, whole] = snapshot.block_lists(SIZE);
        let mut times = BTreeMap::<[u32; 2], u32>::new();
        others.iter().chain(&whole).for_each(|block| *times.entry(block.to_array()).or_default() += 1);
        assert!(times.values().all(|&count| count == 1));
        let tiles = &snapshot.0["tiles"][..snapshot.0["args"][3] as usize];
        let tiles: BTreeSet<_> = tiles.iter().map(|word| [word & 0xffff, word >> 16]).collect();
        for y in 0..SIZE.y.div_ceil(4) {
            for x in 0..SIZE.x.div_ceil(4) {
                assert_eq!(times.contains_key(&[x, y]), tiles.contains(&[x / 2, y / 2]), "block {x}, {y}");
            }
        }
        // The margin is cut off: 75 is no multiple of 4.
        let expected =
            |block: &&UVec2| shown(**block) == Shows::RoughWall && (**block + 1) * 4 == (**block * 4 + 4).min(SIZE);
        let all: Vec<UVec2> = others.iter().chain(&whole).copied().collect();
        let expected: BTreeSet<_> = all.iter().filter(expected).map(|block| block.to_array()).collect();
        let found: BTreeSet<_> = whole.iter().map(|block| block.to_array()).collect();
        assert_eq!(found, expected);
        assert!(found.len() > 50 && others.len() > 50, "{} and {}", found.len(), others.len());
    }
}

#[test]
fn a_whole_block_has_one_history() {
    let case = Case::still(SIZE, 4, |frame, p| pixel(frame, p, shown(p / 4)));
    for snapshot in run(&mut *fastest(), &case, true) {
        let history = &snapshot.0["history"];
        let [_, whole] = snapshot.block_lists(SIZE);
        for block in whole {
            let texel = |i: u32| {
                let p = block * 4 + UVec2::new(i % 4, i / 4);
                let first = 2 * (p.y * SIZE.x + p.x) as usize;
                [history[first], history[first + 1]]
            };
            assert!((1..16).all(|i| texel(i) == texel(0)), "{block}");
        }
    }
}

/// Mean over the image, and deviation of pixels.
fn moments(snapshot: &Snapshot) -> [f64; 2] {
    let values: Vec<f64> = snapshot.output().iter().map(|c| f64::from(c[0])).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    [mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()]
}

/// A noisy wall is as bright and as smooth as one whose pixels are accumulated one by one.
#[test]
fn blocks_say_what_their_pixels_say() {
    let executor = &mut *fastest();
    let case = Case::still(UVec2::splat(64), 8, |frame, p| pixel(frame, p, Shows::RoughWall));
    let (whole, single) = (run(executor, &case, true), run(executor, &case, false));
    for (whole, single) in whole.iter().zip(&single) {
        let ([mean, deviation], [expected, expected_deviation]) = (moments(whole), moments(single));
        assert!((mean / expected - 1.0).abs() < 0.01, "{mean} and {expected}");
        assert!(deviation < 1.2 * expected_deviation + 1e-3, "{deviation} and {expected_deviation}");
    }
    assert!(whole.iter().zip(&single).any(|(a, b)| a.output() != b.output()));
}
