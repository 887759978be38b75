//! Reading sequences and single images.

use std::path::{Path, PathBuf};
use std::slice;

use glam::UVec2;

use super::camera::CameraFile;
use super::exr_file::{ChannelIndex, ExrFile};
use super::{ChannelNames, Frame, Metadata, SequenceError};

/// A sequence on disk. Frames are read when asked for.
#[derive(Clone, Debug)]
pub struct Sequence {
    dir: PathBuf,
    cameras: CameraFile,
    channels: ChannelNames,
}

impl Sequence {
    /// Opens the folder `dir` by its `camera.json`; `channels` names the channels of its EXR files.
    pub fn open(dir: &Path, channels: &ChannelNames) -> Result<Self, SequenceError> {
        Ok(Self {
            cameras: CameraFile::read(&dir.join("camera.json"))?,
            dir: dir.to_owned(),
            channels: channels.clone(),
        })
    }

    /// The sequence's name: `sequence` in `camera.json`, otherwise the folder's name.
    pub fn name(&self) -> String {
        let folder = || self.dir.file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.cameras.name.clone().unwrap_or_else(folder)
    }

    /// Width and height of every frame, in pixels.
    pub fn size(&self) -> UVec2 {
        self.cameras.size
    }

    /// The factor on radiance the sequence is meant to be viewed and scored with.
    pub fn exposure(&self) -> f32 {
        self.cameras.exposure
    }

    /// The number of frames, at least one.
    #[expect(clippy::len_without_is_empty, reason = "a sequence is never empty")]
    pub fn len(&self) -> usize {
        self.cameras.frames.len()
    }

    /// The file of frame `index`, counted from 0 in the order of `camera.json`.
    pub fn path(&self, index: usize) -> Result<PathBuf, SequenceError> {
        let entry = self.cameras.frames.get(index).ok_or(SequenceError::NoSuchFrame {
            path: self.dir.clone(),
            index,
            len: self.len(),
        })?;
        Ok(self.dir.join(&entry.file))
    }

    /// The header attributes of frame `index`'s file, to be kept by what is written for it.
    pub fn metadata(&self, index: usize) -> Result<Metadata, SequenceError> {
        Metadata::read(&self.path(index)?)
    }

    /// Reads frame `index`.
    pub fn load(&self, index: usize) -> Result<Frame, SequenceError> {
        let path = self.path(index)?;
        let entry = &self.cameras.frames[index];
        let file = ExrFile::open(&path)?;
        let names = &self.channels;
        let mut wanted = Vec::new();
        let mut want = |key, names: &[String]| -> Result<(), SequenceError> {
            for name in names {
                wanted.push(find(&file, &path, key, name)?);
            }
            Ok(())
        };
        want("radiance", &names.radiance)?;
        want("hit_distance", slice::from_ref(&names.hit_distance))?;
        want("roughness", slice::from_ref(&names.roughness))?;
        want("depth", slice::from_ref(&names.depth))?;
        want("motion", &names.motion)?;
        let default = ChannelNames::default();
        let mut want_if_there = |key, names: &[String; 3], default: &[String; 3]| {
            let is_wanted = names != default || names.iter().any(|name| file.find(name).is_some());
            if is_wanted { want(key, names).map(|()| true) } else { Ok(false) }
        };
        let has_normals = want_if_there("normal", &names.normal, &default.normal)?;
        let has_hit_motion = want_if_there("hit_motion", &names.hit_motion, &default.hit_motion)?;
        want_if_there("reference", &names.reference, &default.reference)?;

        let size = self.size();
        let planes = file.read(&wanted, size)?;
        let [r, g, b, a, roughness, depth, u, v, rest @ ..] = &planes[..] else {
            unreachable!("there is one plane for each channel");
        };
        let (normals, rest) = rest.split_at(if has_normals { 3 } else { 0 });
        let (moved, truth) = rest.split_at(if has_hit_motion { 3 } else { 0 });
        let vectors = |planes: &[Vec<f32>]| match planes {
            [x, y, z] => Some(interleave([x, y, z])),
            _ => None,
        };
        Ok(Frame {
            number: entry.number,
            size,
            reset: entry.reset,
            seconds: entry.seconds,
            camera: entry.camera,
            radiance: interleave([r, g, b, a]),
            normal: vectors(normals).unwrap_or_else(|| vec![[0.0; 3]; r.len()]),
            roughness: roughness.clone(),
            depth: depth.clone(),
            motion: interleave([u, v]),
            hit_motion: vectors(moved),
            reference: vectors(truth),
        })
    }
}

/// Reads the colour of an EXR file, as linear radiance: the channels `R`, `G`, `B`, or else
/// `denoised.R`.., `color.R`.., `reflection.R`.. or `reference.R`...
pub fn read_rgb(path: &Path) -> Result<(UVec2, Vec<[f32; 3]>), SequenceError> {
    let file = ExrFile::open(path)?;
    let colour = ["", "denoised.", "color.", "reflection.", "reference."].into_iter().find_map(|prefix| {
        let find = |channel| file.find(&format!("{prefix}{channel}"));
        Some([find("R")?, find("G")?, find("B")?])
    });
    let Some(colour) = colour else {
        return Err(SequenceError::NoColour { path: path.to_owned(), available: file.channel_names() });
    };
    let size = file.size(colour[0]);
    let planes = file.read(&colour, size)?;
    Ok((size, interleave([&planes[0], &planes[1], &planes[2]])))
}

fn find(file: &ExrFile, path: &Path, key: &'static str, name: &str) -> Result<ChannelIndex, SequenceError> {
    file.find(name).ok_or_else(|| SequenceError::MissingChannel {
        path: path.to_owned(),
        channel: name.to_owned(),
        key,
        available: file.channel_names(),
    })
}

/// One value of each plane per pixel.
fn interleave<const N: usize>(planes: [&Vec<f32>; N]) -> Vec<[f32; N]> {
    (0..planes[0].len()).map(|i| planes.map(|plane| plane[i])).collect()
}
