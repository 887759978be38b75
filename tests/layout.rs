//! The constant buffer looks the same from Rust and from WGSL.

use limpid::FrameConstants;
use limpid::kernel::{Kernel, Overrides};

#[test]
fn constants_have_the_layout_of_the_kernels() {
    let kernel = Kernel::new("reproject", &Overrides::new()).unwrap();
    let (_, frame) = kernel.module.global_variables.iter().find(|(_, v)| v.name.as_deref() == Some("frame")).unwrap();
    let naga::TypeInner::Struct { members, span } = &kernel.module.types[frame.ty].inner else {
        panic!("`frame` is no struct");
    };
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(kernel.module.to_ctx()).unwrap();
    let wgsl: Vec<_> =
        members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize, layouter[m.ty].size as usize)).collect();
    assert_eq!(wgsl, FrameConstants::FIELDS);
    assert_eq!(*span as usize, size_of::<FrameConstants>());
}
