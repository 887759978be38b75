//! A check the decoder lacks: chunks compressed with DWA state how much memory they unpack to,
//! and a damaged statement would abort the process.

use exr::block::chunk::{Chunk, CompressedBlock};
use exr::compression::Compression;
use exr::error::{Error, Result};
use exr::meta::header::Header;

/// Where a chunk states sizes to be unpacked, as indices into its leading 64-bit numbers: bytes of
/// unknown data, of run-length codes and of what they expand to, counts of AC and DC coefficients.
const SIZES: [usize; 5] = [1, 6, 7, 8, 9];

/// An error for a DWA chunk that claims to unpack to far more than its pixels.
pub(super) fn check_chunk(chunk: &Chunk, header: &Header) -> Result<()> {
    let bytes = match &chunk.compressed_block {
        _ if !matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_)) => {
            return Ok(());
        }
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    let tile = header.get_block_data_indices(&chunk.compressed_block)?;
    let size = header.get_absolute_block_pixel_coordinates(tile)?.size;
    let bytes_per_pixel = header.channels.bytes_per_pixel;
    if bytes.len() == size.area() * bytes_per_pixel {
        return Ok(()); // stored as it is
    }
    // Coefficients come in blocks of 8x8 pixels; incompressible runs take up to twice their size.
    let limit = 4 * (size.width() + 8) * (size.height() + 8) * bytes_per_pixel;
    let numbers: Vec<u64> = bytes
        .chunks_exact(8)
        .take(11)
        .map(|number| number.iter().rev().fold(0, |n, &byte| n << 8 | u64::from(byte)))
        .collect();
    let is_absurd = |&i: &usize| numbers.get(i).is_some_and(|&n| n > limit as u64);
    if SIZES.iter().any(is_absurd) {
        return Err(Error::Invalid("DWA chunk sizes".into()));
    }
    Ok(())
}
