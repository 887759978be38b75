//! What graphics APIs call formats.

use schemars::JsonSchema;
use serde::Serialize;

use crate::resource::Format;

/// A texel format in the terms of each API.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FormatNames {
    /// `DXGI_FORMAT`.
    pub dxgi: &'static str,
    /// `VkFormat`.
    pub vulkan: &'static str,
    /// `MTLPixelFormat`.
    pub metal: &'static str,
    /// `GPUTextureFormat`.
    pub webgpu: &'static str,
    /// OpenGL's sized internal format.
    pub gl: &'static str,
}

pub(super) fn names(format: Format) -> FormatNames {
    match format {
        Format::Rgba16Float => FormatNames {
            dxgi: "DXGI_FORMAT_R16G16B16A16_FLOAT",
            vulkan: "VK_FORMAT_R16G16B16A16_SFLOAT",
            metal: "MTLPixelFormatRGBA16Float",
            webgpu: "rgba16float",
            gl: "GL_RGBA16F",
        },
        Format::Rgba32Uint => FormatNames {
            dxgi: "DXGI_FORMAT_R32G32B32A32_UINT",
            vulkan: "VK_FORMAT_R32G32B32A32_UINT",
            metal: "MTLPixelFormatRGBA32Uint",
            webgpu: "rgba32uint",
            gl: "GL_RGBA32UI",
        },
        Format::R32Uint => FormatNames {
            dxgi: "DXGI_FORMAT_R32_UINT",
            vulkan: "VK_FORMAT_R32_UINT",
            metal: "MTLPixelFormatR32Uint",
            webgpu: "r32uint",
            gl: "GL_R32UI",
        },
        Format::Rg32Uint => FormatNames {
            dxgi: "DXGI_FORMAT_R32G32_UINT",
            vulkan: "VK_FORMAT_R32G32_UINT",
            metal: "MTLPixelFormatRG32Uint",
            webgpu: "rg32uint",
            gl: "GL_RG32UI",
        },
    }
}
