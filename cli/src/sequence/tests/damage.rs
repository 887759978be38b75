//! Damaged files: errors that name them, never a panic.

use std::fs;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LineOrder, WritableImage,
};
use half::f16;
use proptest::prelude::*;
use proptest::sample::Index;

use super::{Folder, SIZE, frame, open};
use crate::sequence::*;

#[test]
fn a_dwa_chunk_that_claims_to_be_huge_is_refused() {
    let folder = Folder::new("dwa");
    let path = folder.0.join("dwa.exr");
    let encoding =
        Encoding { compression: Compression::DWAA(None), blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let channel = |name| AnyChannel::new(name, FlatSamples::F16(vec![f16::ONE; 64 * 32]));
    let channels = AnyChannels::sort(["R", "G", "B"].map(channel).to_vec().into());
    let image = Image::from_encoded_channels((64, 32), encoding, channels);
    image.write().to_file(&path).unwrap();
    assert!(read_rgb(&path).unwrap().1[0][0] > 0.9);

    // The only entry of the offset table points to the chunk that follows the table.
    let mut bytes = fs::read(&path).unwrap();
    let points_to_next = |p: &usize| bytes[*p..*p + 8] == (*p as u64 + 8).to_le_bytes();
    let chunk = (0..bytes.len() - 8).find(points_to_next).unwrap() + 8;
    let dc_count = chunk + 8 + 9 * 8;
    bytes[dc_count + 7] = 0x20;
    fs::write(&path, &bytes).unwrap();
    assert_eq!(
        read_rgb(&path).unwrap_err().to_string(),
        format!("{}: damaged or unsupported EXR file: invalid: DWA chunk sizes", path.display())
    );
}

/// A change to a file's bytes.
#[derive(Clone, Debug)]
enum Damage {
    Set(Index, u8),
    Cut(Index),
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn damaged_files_give_errors_that_name_them(
        damages in prop::collection::vec(
            prop_oneof![
                8 => (any::<Index>(), any::<u8>()).prop_map(|(at, to)| Damage::Set(at, to)),
                1 => any::<Index>().prop_map(Damage::Cut),
            ],
            1..6,
        ),
        in_header in any::<bool>(),
    ) {
        let folder = Folder::new("damage");
        write_sequence(&folder.0, "damage", 1.0, [frame(1)]).unwrap();
        let sequence = open(&folder.0).unwrap();
        let path = sequence.path(0).unwrap();
        let mut bytes = fs::read(&path).unwrap();
        let mut is_cut = false;
        for damage in damages {
            let len = bytes.len().max(1);
            match damage {
                Damage::Set(at, to) => {
                    let at = at.index(if in_header { len.min(900) } else { len });
                    bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = to);
                }
                Damage::Cut(at) => {
                    bytes.truncate(at.index(len));
                    is_cut = true;
                }
            }
        }
        fs::write(&path, &bytes).unwrap();
        let name = path.display().to_string();
        match sequence.load(0) {
            // Damage that no checksum covers changes values only.
            Ok(frame) => prop_assert!(!is_cut && frame.size == SIZE),
            Err(error) => prop_assert!(error.to_string().starts_with(&name), "{}", error),
        }
        for error in [read_rgb(&path).err(), Metadata::read(&path).err()].into_iter().flatten() {
            prop_assert!(error.to_string().starts_with(&name), "{}", error);
        }
    }
}
