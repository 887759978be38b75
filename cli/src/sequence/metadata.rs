//! Header attributes carried from an input file to an output file.

use std::path::Path;

use exr::math::Vec2;
use exr::meta::attribute::IntegerBounds;
use exr::meta::header::{ImageAttributes, LayerAttributes};
use glam::UVec2;

use super::SequenceError;
use super::exr_file::ExrFile;

/// The attributes of an EXR file: standard ones such as the time code, windows and cameras, and
/// custom ones. Of a multi-part file, those of its first part.
#[derive(Clone, Debug)]
pub struct Metadata {
    size: Vec2<usize>,
    image: ImageAttributes,
    layer: LayerAttributes,
}

impl Metadata {
    /// Reads the header of an EXR file.
    pub fn read(path: &Path) -> Result<Self, SequenceError> {
        let file = ExrFile::open(path)?;
        let header = &file.headers()[0];
        Ok(Self {
            size: header.layer_size,
            image: header.shared_attributes.clone(),
            layer: header.own_attributes.clone(),
        })
    }

    /// The attributes of a new file that has none to keep.
    pub fn new(size: UVec2) -> Self {
        let size = Vec2(size.x as usize, size.y as usize);
        Self { size, image: ImageAttributes::with_size(size), layer: LayerAttributes::default() }
    }

    /// The attributes for a single-part file with an image of `size`: without those that described
    /// other pixels (part name, thumbnail and, where the size differs, the windows).
    pub(super) fn for_image(&self, size: Vec2<usize>) -> (ImageAttributes, LayerAttributes) {
        let (mut image, mut layer) = (self.image.clone(), self.layer.clone());
        layer.layer_name = None;
        layer.preview = None;
        if size != self.size {
            image.display_window = IntegerBounds::from_dimensions(size);
            layer.layer_position = Vec2(0, 0);
        }
        (image, layer)
    }
}
