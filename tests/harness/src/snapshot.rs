use std::collections::BTreeMap;

use glam::UVec2;
use half::f16;
use limpid::Plan;
use limpid::resource::{Copy, Count, Extent, Kind, Resource, TILE_SIZE};

/// All resources of limpid after a frame, as words, by name and copy.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Snapshot(pub BTreeMap<String, Vec<u32>>);

impl Snapshot {
    /// Blocks of 4x4 pixels that a frame of a size listed: others, and whole ones.
    pub fn block_lists(&self, frame: UVec2) -> [Vec<UVec2>; 2] {
        let unpacked = |words: &[u32]| words.iter().map(|word| UVec2::new(word & 0xffff, word >> 16)).collect();
        let (list, args) = (&self.0["block_list"], &self.0["block_args"]);
        let blocks = frame.map(|side| side.div_ceil(4)).element_product() as usize;
        [unpacked(&list[..args[3] as usize]), unpacked(&list[blocks - args[7] as usize..blocks])]
    }

    /// Reads what a plan names and can be read after a frame of a size, by functions that read a texture and a buffer.
    pub fn take(
        plan: &Plan,
        frame: UVec2,
        is_readable: impl Fn(&Resource) -> bool,
        mut texture: impl FnMut(&str, Copy) -> Vec<u32>,
        mut buffer: impl FnMut(&str) -> Vec<u32>,
    ) -> Self {
        let mut words = BTreeMap::new();
        for resource in plan.resources.iter().filter(|resource| is_readable(resource)) {
            let name = resource.name.as_str();
            match resource.kind {
                Kind::Texture { .. } => {
                    let copies =
                        if resource.ping_pong { &[Copy::Current, Copy::Previous][..] } else { &[Copy::Current] };
                    for &copy in copies {
                        let key = match copy {
                            _ if plan.output() == Some((name, copy)) => "output".to_owned(),
                            Copy::Current => name.to_owned(),
                            Copy::Previous => format!("previous {name}"),
                        };
                        words.insert(key, texture(name, copy));
                    }
                }
                Kind::Buffer { .. } => {
                    words.insert(name.to_owned(), buffer(name));
                }
                Kind::Constants | Kind::Input => {}
            }
        }
        let mut this = Self(words);
        this.sort_lists(frame);
        this
    }

    /// Lists are in the order in which workgroups happened to run.
    fn sort_lists(&mut self, frame: UVec2) {
        let Some(args) = self.0.get("args") else { return };
        let [listed, left_out, rays] = [3, 7, 11].map(|word| args.get(word).map_or(0, |&count| count as usize));
        if let Some(tiles) = self.0.get_mut("tiles") {
            // Left-out tiles grow from the end of what this frame uses.
            let end = (Count::Per(Extent::Tile).of(frame) as usize).min(tiles.len());
            let listed = listed.min(end);
            let left_out = end - left_out.min(end - listed);
            tiles[..listed].sort_unstable();
            tiles[left_out..end].sort_unstable();
            // The rest is of earlier frames.
            tiles[listed..left_out].fill(0);
            tiles[end..].fill(0);
        }
        let [others, whole] = [3, 7].map(|word| self.0.get("block_args").map_or(0, |args| args[word] as usize));
        if let Some(blocks) = self.0.get_mut("block_list") {
            // As are whole blocks.
            let end = (Count::Per(Extent::Block).of(frame) as usize).min(blocks.len());
            blocks[..others].sort_unstable();
            blocks[end - whole..end].sort_unstable();
            blocks[others..end - whole].fill(0);
            blocks[end..].fill(0);
        }
        if let Some(list) = self.0.get_mut("rays") {
            let count = list.len();
            list[..rays.min(count)].sort_unstable();
            list[rays.min(count)..].fill(0);
        }
    }

    /// Where there is no guide to tell which pixels were denoised, notes those of listed tiles as `listed`. `size` is that of
    /// the textures, `frame` that of the frame.
    pub(crate) fn note_listed(&mut self, size: UVec2, frame: UVec2) {
        let Some(idle) = self.0.get("idle_frames").filter(|_| !self.0.contains_key("guide")) else { return };
        let row = Extent::Tile.of(frame).x;
        let positions = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
        let is_listed = |p: UVec2| idle[(p.y / TILE_SIZE * row + p.x / TILE_SIZE) as usize] == 0;
        let listed = positions.map(|p| u32::from(p.cmplt(frame).all() && is_listed(p))).collect();
        self.0.insert("listed".to_owned(), listed);
    }

    /// Whether every half float of the output is a finite number.
    pub fn is_finite(&self) -> bool {
        self.0["output"].iter().all(|word| word & 0x7c00 != 0x7c00 && word & 0x7c00_0000 != 0x7c00_0000)
    }

    /// The denoised image: radiance and variance of each texel.
    pub fn output(&self) -> Vec<[f32; 4]> {
        self.half_texels("output")
    }

    /// Texels of a resource of four half floats.
    pub fn half_texels(&self, name: &str) -> Vec<[f32; 4]> {
        let half = |bits: u32| f16::from_bits(bits as u16).to_f32();
        let texel = |w: &[u32]| [half(w[0]), half(w[0] >> 16), half(w[1]), half(w[1] >> 16)];
        self.0[name].chunks_exact(2).map(texel).collect()
    }
}
