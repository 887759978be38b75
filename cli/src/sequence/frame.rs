//! The images of one frame.

use glam::UVec2;
use limpid::Camera;

use super::InputWarnings;

/// One frame: the noisy signal, the guides a denoiser needs and, where known, the converged image.
///
/// Every image has [`Frame::pixels`] values, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The frame's number in its sequence.
    pub number: u32,
    /// Width and height in pixels.
    pub size: UVec2,
    /// Whether history is invalid at this frame: the first one, or a camera cut.
    pub reset: bool,
    /// Time since the frame before, in seconds.
    pub seconds: f32,
    /// The camera the frame was rendered with.
    pub camera: Camera,
    /// Linear radiance along one reflection ray (rgb) and that ray's world-space length to its hit
    /// (a): 10000 where it left the scene, 0 where it fell below the surface or the pixel is sky.
    pub radiance: Vec<[f32; 4]>,
    /// World-space unit shading normal, 0 at sky, and everywhere where there are none.
    pub normal: Vec<[f32; 3]>,
    /// Perceptual roughness, 0 to 1; GGX alpha is its square.
    pub roughness: Vec<f32>,
    /// View-space linear depth: distance along the camera's forward axis in metres, 0 at sky.
    pub depth: Vec<f32>,
    /// Where the surface point was in the previous frame: uv now minus uv then, uv 0 to 1 from the
    /// top left.
    pub motion: Vec<[f32; 2]>,
    /// World-space position, in metres, of what the reflection ray hit, minus the position of the same point in the
    /// previous frame. `None` where it is not known.
    pub hit_motion: Option<Vec<[f32; 3]>>,
    /// The expectation of `radiance`, from many samples.
    pub reference: Option<Vec<[f32; 3]>>,
}

impl Frame {
    /// The number of pixels.
    pub fn pixels(&self) -> usize {
        self.size.x as usize * self.size.y as usize
    }

    /// Whether any pixel has a normal.
    pub fn has_normals(&self) -> bool {
        self.normal.iter().any(|normal| *normal != [0.0; 3])
    }

    /// Whether any pixel shows a surface.
    pub fn has_surfaces(&self) -> bool {
        self.depth.iter().any(|depth| *depth > 0.0)
    }

    /// What is wrong with the frame's values.
    pub fn warnings(&self) -> InputWarnings {
        InputWarnings::of(self)
    }
}
