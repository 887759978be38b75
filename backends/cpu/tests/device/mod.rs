//! A device that runs compute kernels.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::io::Write;
use wgpu::util::DeviceExt;

pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
}

impl Gpu {
    /// `None`, with the reason on stderr, where there is no device with default limits and these features.
    pub(crate) fn open(required_features: wgpu::Features) -> Option<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let opened = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .map_err(|error| error.to_string())
            .and_then(|adapter| {
                let required_limits = wgpu::Limits::default();
                let descriptor = wgpu::DeviceDescriptor { required_features, required_limits, ..Default::default() };
                pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| error.to_string())
            });
        match opened {
            Ok((device, queue)) => Some(Self { device, queue }),
            Err(reason) => {
                assert!(std::env::var_os("LIMPID_REQUIRE_DEVICE").is_none(), "{reason}");
                // Past the harness, which keeps to itself what a passing test prints.
                let _ = writeln!(std::io::stderr(), "SKIPPED: {reason}");
                None
            }
        }
    }

    /// Runs `main` with an output buffer of `count` words at binding 0 and a constant or read-only buffer at 1.
    pub(crate) fn run(&self, source: &str, groups: u32, count: usize, input: &[u32]) -> Vec<u32> {
        self.run_with(source, groups, count, input, &[])
    }

    /// The same with more bindings.
    pub(crate) fn run_with(
        &self,
        source: &str,
        groups: u32,
        count: usize,
        input: &[u32],
        more: &[wgpu::BindGroupEntry<'_>],
    ) -> Vec<u32> {
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let buffer = |words: &[u32], usage| {
            let contents: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: None,
                contents: &contents,
                usage,
            })
        };
        use wgpu::BufferUsages as Usage;
        let output = buffer(&vec![0; count], Usage::STORAGE | Usage::COPY_SRC);
        let input = buffer(input, Usage::STORAGE | Usage::UNIFORM);
        let staging = buffer(&vec![0; count], Usage::MAP_READ | Usage::COPY_DST);
        let layout = pipeline.get_bind_group_layout(0);
        let mut entries = vec![wgpu::BindGroupEntry { binding: 0, resource: output.as_entire_binding() }];
        // A binding that is not used is not part of the layout.
        if source.contains("numbers.") || source.contains("numbers[") {
            entries.push(wgpu::BindGroupEntry { binding: 1, resource: input.as_entire_binding() });
        }
        entries.extend_from_slice(more);
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &entries,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&output, 0, &staging, 0, staging.size());
        self.queue.submit([encoder.finish()]);
        staging.slice(..).map_async(wgpu::MapMode::Read, |mapped| mapped.unwrap());
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let bytes = staging.slice(..).get_mapped_range().unwrap().to_vec();
        bytes.chunks(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
    }
}
