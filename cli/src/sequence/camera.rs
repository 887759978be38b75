//! `camera.json`: size, exposure and the cameras of a sequence.

use std::fs;
use std::path::Path;

use glam::{DMat4, DVec4, Mat4, UVec2, Vec2};
use limpid::Camera;
use serde_json::Value;

use super::{MAX_SIDE, SequenceError};

/// The content of `camera.json` that matters to a denoiser.
#[derive(Clone, Debug)]
pub(super) struct CameraFile {
    pub(super) name: Option<String>,
    pub(super) size: UVec2,
    pub(super) exposure: f32,
    pub(super) frames: Vec<FrameEntry>,
}

/// One frame as `camera.json` lists it.
#[derive(Clone, Debug)]
pub(super) struct FrameEntry {
    pub(super) number: u32,
    pub(super) file: String,
    pub(super) reset: bool,
    pub(super) seconds: f32,
    pub(super) camera: Camera,
}

impl CameraFile {
    /// Reads and checks the file. `sequence`, `exposure` (1), and a frame's `reset` (false), `seconds` (1/60)
    /// and `jitter` (0, 0) may be left out; keys unknown here are ignored.
    pub(super) fn read(path: &Path) -> Result<Self, SequenceError> {
        let text = fs::read_to_string(path).map_err(|reason| SequenceError::read(path, reason))?;
        let root: Value =
            serde_json::from_str(&text).map_err(|reason| SequenceError::Json { path: path.to_owned(), reason })?;
        let root = Field { path, name: String::new(), value: Some(&root) };
        let frames = root.key("frames").items("a list of at least one frame", |n| n > 0)?;
        Ok(Self {
            name: root.key("sequence").optional(|f| f.text())?,
            size: UVec2::new(root.key("width").side()?, root.key("height").side()?),
            exposure: root.key("exposure").optional(|f| f.positive())?.unwrap_or(1.0),
            frames: frames.iter().map(FrameEntry::from_field).collect::<Result<_, _>>()?,
        })
    }
}

impl FrameEntry {
    fn from_field(frame: &Field<'_>) -> Result<Self, SequenceError> {
        Ok(Self {
            number: frame.key("frame").number()?,
            file: frame.key("file").text()?,
            reset: frame.key("reset").optional(|f| f.flag())?.unwrap_or(false),
            seconds: frame.key("seconds").optional(|f| f.positive())?.unwrap_or(1.0 / 60.0),
            camera: Camera {
                world_to_view: frame.key("view").matrix()?,
                view_to_clip: frame.key("proj").matrix()?,
                jitter: frame.key("jitter").optional(|f| f.vector())?.unwrap_or(Vec2::ZERO),
            },
        })
    }
}

/// A value of the file, or its absence, and the way to it, for messages.
struct Field<'a> {
    path: &'a Path,
    name: String,
    value: Option<&'a Value>,
}

impl<'a> Field<'a> {
    fn key(&self, key: &str) -> Field<'a> {
        let dot = if self.name.is_empty() { "" } else { "." };
        Field {
            path: self.path,
            name: format!("{}{dot}{key}", self.name),
            value: self.value.and_then(|value| value.get(key)),
        }
    }

    fn optional<T>(self, read: impl FnOnce(&Self) -> Result<T, SequenceError>) -> Result<Option<T>, SequenceError> {
        self.value.is_some().then(|| read(&self)).transpose()
    }

    fn expected(&self, expected: &str) -> SequenceError {
        let found = match self.value {
            None => "nothing".to_owned(),
            Some(value) => {
                let text = value.to_string();
                match text.char_indices().nth(60) {
                    None => text,
                    Some((end, _)) => format!("{}...", &text[..end]),
                }
            }
        };
        SequenceError::Field {
            path: self.path.to_owned(),
            field: self.name.clone(),
            expected: expected.to_owned(),
            found,
        }
    }

    fn items(&self, expected: &str, accept: impl Fn(usize) -> bool) -> Result<Vec<Field<'a>>, SequenceError> {
        let items = self.value.and_then(Value::as_array).filter(|items| accept(items.len()));
        let items = items.ok_or_else(|| self.expected(expected))?;
        Ok(items
            .iter()
            .enumerate()
            .map(|(i, item)| Field { path: self.path, name: format!("{}[{i}]", self.name), value: Some(item) })
            .collect())
    }

    fn number(&self) -> Result<u32, SequenceError> {
        let number = self.value.and_then(Value::as_u64).and_then(|n| u32::try_from(n).ok());
        number.ok_or_else(|| self.expected("a whole number"))
    }

    fn side(&self) -> Result<u32, SequenceError> {
        let side = self.number().ok().filter(|n| (1..=MAX_SIDE).contains(n));
        side.ok_or_else(|| self.expected(&format!("a whole number of pixels, 1 to {MAX_SIDE}")))
    }

    fn text(&self) -> Result<String, SequenceError> {
        let text = self.value.and_then(Value::as_str);
        text.map(str::to_owned).ok_or_else(|| self.expected("a string"))
    }

    fn flag(&self) -> Result<bool, SequenceError> {
        let flag = self.value.and_then(Value::as_bool);
        flag.ok_or_else(|| self.expected("true or false"))
    }

    fn real(&self) -> Result<f64, SequenceError> {
        let real = self.value.and_then(Value::as_f64).filter(|x| (*x as f32).is_finite());
        real.ok_or_else(|| self.expected("a finite number"))
    }

    fn positive(&self) -> Result<f32, SequenceError> {
        let number = self.real().ok().map(|x| x as f32).filter(|x| *x > 0.0);
        number.ok_or_else(|| self.expected("a number above 0"))
    }

    fn vector(&self) -> Result<Vec2, SequenceError> {
        let items = self.items("a list of 2 numbers", |n| n == 2)?;
        Ok(Vec2::new(items[0].real()? as f32, items[1].real()? as f32))
    }

    /// A row-major 4x4 matrix for column vectors.
    fn matrix(&self) -> Result<Mat4, SequenceError> {
        let mut rows = [DVec4::ZERO; 4];
        let fields = self.items("a list of 4 rows", |n| n == 4)?;
        for (row, field) in rows.iter_mut().zip(&fields) {
            for (i, x) in field.items("a row of 4 numbers", |n| n == 4)?.iter().enumerate() {
                row[i] = x.real()?;
            }
        }
        let matrix = DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose();
        let is_invertible = (matrix * matrix.inverse()).abs_diff_eq(DMat4::IDENTITY, 1e-3);
        if is_invertible { Ok(matrix.as_mat4()) } else { Err(self.expected("a matrix that can be inverted")) }
    }
}
