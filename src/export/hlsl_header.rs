//! `limpid.hlsli`: what an engine's own shaders need of limpid.

use super::Export;
use crate::Error;

const RAYS: &str = "
// Rays: which pixels to trace. The buffer `rays` has as many entries as the fourth uint of its grid in `args` says.

// Pixel of an entry of `rays`.
uint2 LimpidRayPixel(uint entry) {
    return uint2(entry & 0x3fffu, (entry >> 14u) & 0x3fffu);
}

// Whether the result of the ray is also that of the neighbour: 0 the pixel beside it (x ^ 1), 1 the one above or below
// (y ^ 1), 2 the one across (both).
bool LimpidRayIsCopied(uint entry, uint neighbor) {
    return ((entry >> (28u + neighbor)) & 1u) != 0u;
}
";

impl Export<'_> {
    /// The constant buffer, conventions, and the ray list if there is one.
    pub(super) fn hlsl_header(&self) -> Result<String, Error> {
        let frame = self.kernels.iter().find(|kernel| kernel.bindings.iter().any(|binding| binding.name == "frame"));
        let text = frame.map(|kernel| kernel.hlsl(&self.options.hlsl)).transpose()?.unwrap_or_default();
        let structure =
            text.split("struct Frame {").nth(1).and_then(|rest| rest.split("};").next()).unwrap_or_default();
        let rays = if self.plan.resource("rays").is_some() { RAYS } else { "" };
        Ok(format!(
            "// limpid {} for your own shaders: the constant buffer and, if rays are listed, how to read the list.\n\
             // Settings {}. The passes do not include this file.\n//\n\
             // uv has its origin at the top left, y down. Matrices are for column vectors: mul(matrix, vector).\n\
             // Radiance is linear, along the reflected ray, before it is multiplied by the BRDF.\n//\n\
             // SPDX-License-Identifier: MIT OR Apache-2.0\n\n#ifndef LIMPID_HLSLI\n#define LIMPID_HLSLI\n\n\
             struct LimpidFrame {{{structure}}};\n{rays}\n#endif // LIMPID_HLSLI\n",
            env!("CARGO_PKG_VERSION"),
            self.settings_hash,
        ))
    }
}
