//! One EXR file, of which only the channels asked for are decoded.
//!
//! Files come from anywhere and may be damaged: sizes are checked before anything is allocated by
//! them, and a panic of the decoder is turned into an error.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use exr::block::UncompressedBlock;
use exr::block::lines::LineRef;
use exr::block::reader::{ChunksReader, Reader};
use exr::error::Error;
use exr::math::Vec2;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use glam::UVec2;
use half::f16;

use super::dwa::check_chunk;
use super::{MAX_SIDE, SequenceError};

/// An opened EXR file: its headers are read, its pixels are not.
pub(super) struct ExrFile {
    path: PathBuf,
    reader: Reader<BufReader<File>>,
}

/// Where a channel is in its file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct ChannelIndex {
    part: usize,
    channel: usize,
}

impl ExrFile {
    pub(super) fn open(path: &Path) -> Result<Self, SequenceError> {
        let mut file = File::open(path).map_err(|reason| SequenceError::read(path, reason))?;
        check_magic(path, &mut file)?;
        let reader = contain(path, || exr::block::read(BufReader::new(file), false))?;
        let path = path.to_owned();
        Ok(Self { path, reader })
    }

    /// The header of each part; there is at least one.
    pub(super) fn headers(&self) -> &[Header] {
        self.reader.headers()
    }

    /// Every channel's name, with its part's name before it where there are several parts.
    pub(super) fn channel_names(&self) -> Vec<String> {
        let several = self.headers().len() > 1;
        let names = |header: &Header| {
            let part = part_name(header).filter(|_| several);
            let full = move |name: String| match &part {
                Some(part) if !name.starts_with(&format!("{part}.")) => format!("{part}.{name}"),
                _ => name,
            };
            let channels = header.channels.list.iter();
            channels.map(move |c| full(c.name.to_string())).collect::<Vec<_>>()
        };
        self.headers().iter().flat_map(names).collect()
    }

    /// The channel called `name`, or `channel` in a part called `part` for a name `part.channel`.
    pub(super) fn find(&self, name: &str) -> Option<ChannelIndex> {
        let find = |matches: &dyn Fn(&Header, &str) -> bool| {
            self.headers().iter().enumerate().find_map(|(part, header)| {
                let mut channels = header.channels.list.iter();
                let channel = channels.position(|c| matches(header, &c.name.to_string()))?;
                Some(ChannelIndex { part, channel })
            })
        };
        find(&|_, channel| channel == name).or_else(|| {
            find(&|header, channel| {
                let rest = part_name(header).and_then(|part| name.strip_prefix(&part)?.strip_prefix('.'));
                rest == Some(channel)
            })
        })
    }

    /// The size of the image a channel belongs to.
    pub(super) fn size(&self, channel: ChannelIndex) -> UVec2 {
        size_of(&self.headers()[channel.part])
    }

    /// The samples of each channel in turn, if all are of one `size`.
    pub(super) fn read(self, channels: &[ChannelIndex], size: UVec2) -> Result<Vec<Vec<f32>>, SequenceError> {
        let Self { path, reader } = self;
        for &index in channels {
            check_header(&path, &reader.headers()[index.part], size)?;
        }
        let pixels = size.x as usize * size.y as usize;
        let mut planes = vec![vec![0.0; pixels]; channels.len()];
        let mut samples_read = vec![0; channels.len()];
        contain(&path, || {
            let mut chunks = reader.filter_chunks(false, |_, tile, block| {
                tile.level_index == Vec2(0, 0) && channels.iter().any(|c| c.part == block.layer)
            })?;
            while let Some(chunk) = chunks.next() {
                let chunk = chunk?;
                let meta = chunks.meta_data();
                let header = meta.headers.get(chunk.layer_index).ok_or(Error::Invalid("a chunk of no part".into()))?;
                check_chunk(&chunk, header)?;
                let block = UncompressedBlock::decompress_chunk(chunk, meta, false)?;
                for line in block.lines(&header.channels) {
                    let index = ChannelIndex { part: line.location.layer, channel: line.location.channel };
                    let sample_type = header.channels.list[index.channel].sample_type;
                    for i in (0..channels.len()).filter(|&i| channels[i] == index) {
                        samples_read[i] += line.location.sample_count;
                        copy_line(line, sample_type, size, &mut planes[i])?;
                    }
                }
            }
            Ok(())
        })?;
        if samples_read.iter().any(|&n| n != pixels) {
            return Err(SequenceError::Truncated { path });
        }
        Ok(planes)
    }
}

/// The name of a header's part, if it has one.
fn part_name(header: &Header) -> Option<String> {
    header.own_attributes.layer_name.as_ref().map(ToString::to_string)
}

fn size_of(header: &Header) -> UVec2 {
    let side = |x: usize| u32::try_from(x).unwrap_or(u32::MAX);
    UVec2::new(side(header.layer_size.x()), side(header.layer_size.y()))
}

fn check_magic(path: &Path, file: &mut File) -> Result<(), SequenceError> {
    const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
    let failed = |reason| SequenceError::read(path, reason);
    let mut start = Vec::new();
    file.take(4).read_to_end(&mut start).map_err(failed)?;
    file.rewind().map_err(failed)?;
    if start == MAGIC {
        return Ok(());
    }
    let found: Vec<String> = start.iter().map(|byte| format!("{byte:02x}")).collect();
    Err(SequenceError::NotExr {
        path: path.to_owned(),
        found: if found.is_empty() { "nothing".to_owned() } else { found.join(" ") },
    })
}

fn check_header(path: &Path, header: &Header, expected: UVec2) -> Result<(), SequenceError> {
    let refuse = |reason: String| Err(SequenceError::corrupt(path, reason));
    let found = size_of(header);
    if found != expected {
        let path = path.to_owned();
        return Err(SequenceError::Size { path, expected, found });
    }
    if found.min_element() == 0 || found.max_element() > MAX_SIDE {
        return refuse(format!("expected 1 to {MAX_SIDE} pixels a side, found {found}"));
    }
    if header.deep {
        return refuse("deep data".to_owned());
    }
    match header.channels.list.iter().find(|c| c.sampling != Vec2(1, 1)) {
        Some(channel) => refuse(format!("the channel `{}` is subsampled", channel.name)),
        None => Ok(()),
    }
}

/// Runs the decoder, whose errors are given the file's name and whose panics become errors.
fn contain<T>(path: &Path, decode: impl FnOnce() -> exr::error::Result<T>) -> Result<T, SequenceError> {
    match catch_unwind(AssertUnwindSafe(decode)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(Error::Io(reason))) => Err(SequenceError::read(path, reason)),
        // How the decoder reports a read beyond the end of the file.
        Ok(Err(Error::Invalid(reason))) if reason == "reference to missing bytes" => {
            Err(SequenceError::Truncated { path: path.to_owned() })
        }
        Ok(Err(error)) => Err(SequenceError::corrupt(path, error.to_string())),
        Err(_) => Err(SequenceError::corrupt(path, "the decoder failed on it")),
    }
}

/// Copies one line of a channel to its place in `plane`.
fn copy_line(line: LineRef<'_>, sample_type: SampleType, size: UVec2, plane: &mut [f32]) -> exr::error::Result<()> {
    let Vec2(x, y) = line.location.position;
    let count = line.location.sample_count;
    let start = y * size.x as usize + x;
    let target = plane.get_mut(start..start + count).ok_or(Error::Invalid("a line outside the image".into()))?;
    match sample_type {
        SampleType::F32 => line.read_samples_into_slice(target)?,
        SampleType::F16 => {
            let mut samples = vec![f16::ZERO; count];
            line.read_samples_into_slice(&mut samples)?;
            target.iter_mut().zip(samples).for_each(|(t, s)| *t = s.to_f32());
        }
        SampleType::U32 => {
            let mut samples = vec![0_u32; count];
            line.read_samples_into_slice(&mut samples)?;
            target.iter_mut().zip(samples).for_each(|(t, s)| *t = s as f32);
        }
    }
    Ok(())
}
