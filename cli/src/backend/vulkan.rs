//! The ash backend on a device without a window.

use std::rc::Rc;
use std::time::Duration;

use anyhow::{Context as _, Result};
use glam::UVec2;
use half::f16;
use limpid::{FrameInputs, Plan};
use limpid_ash::ash::vk::Format;
use limpid_ash::offscreen::{Context, ContextOptions, Session, UploadedImage, UploadedInputs};
use limpid_ash::{Denoiser, Options, OwnImage};

use super::{Backend, Denoised, ListedRay, Tracer, split, timed, to_half, trace_listed};
use crate::sequence::Frame;

pub(super) struct Vulkan {
    description: String,
    /// Normal, roughness and depth of the last frame. Before the context, as the session is.
    last: Option<[UploadedImage; 3]>,
    session: Session,
    context: Rc<Context>,
}

impl Vulkan {
    pub(super) fn open(core: limpid::Denoiser) -> Result<Self> {
        let context = Rc::new(Context::open(&ContextOptions::default())?);
        let options = Options {
            synchronization: context.synchronization(),
            timestamps: context.has_timestamps(),
            ..Options::default()
        };
        let description = format!("{} through ash", context.name());
        let session = Session::new(&context, core, options)?;
        Ok(Self { description, last: None, session, context })
    }
}

fn upload<T: bytemuck::NoUninit>(
    context: &Rc<Context>,
    format: Format,
    size: UVec2,
    texels: &[T],
) -> Result<UploadedImage> {
    Ok(UploadedImage::new(context, format, size, bytemuck::cast_slice(texels))?)
}

fn half_texels(radiance: &[[f32; 4]]) -> Vec<[f16; 4]> {
    radiance.iter().map(|texel| texel.map(to_half)).collect()
}

fn listed_rays(context: &Context, denoiser: &Denoiser) -> Result<Vec<ListedRay>> {
    let list = denoiser.ray_list().context("the settings ask for no ray list")?;
    let args: Vec<u32> = bytemuck::pod_collect_to_vec(&context.read_buffer(list.args, list.args_offset + 16)?);
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&context.read_buffer(list.rays, list.rays_size)?);
    let count = args.last().map_or(0, |&count| count as usize);
    Ok(words.into_iter().take(count).map(ListedRay::unpack).collect())
}

/// The first three channels and the fourth.
fn read_halves(context: &Context, image: &OwnImage, size: UVec2) -> Result<(Vec<[f32; 3]>, Vec<f32>)> {
    let halves: Vec<[f16; 4]> = bytemuck::pod_collect_to_vec(&context.read_image(image)?);
    let rows = halves.chunks_exact(image.size.x as usize).take(size.y as usize);
    Ok(split(rows.flat_map(|row| &row[..size.x as usize]).copied()))
}

impl Backend for Vulkan {
    fn device(&self) -> &str {
        &self.description
    }

    fn plan(&self) -> &Plan {
        self.session.denoiser().plan()
    }

    fn denoise(&mut self, frame: &Frame, exposure: f32, tracer: Option<Tracer<'_>>) -> Result<Denoised> {
        let size = frame.size;
        let mut frame_inputs = FrameInputs::new(frame.camera, size);
        frame_inputs.reset = frame.reset;
        frame_inputs.frame_seconds = frame.seconds;
        frame_inputs.exposure = exposure;
        let (session, context) = (&mut self.session, &self.context);
        let normals = super::normals(session.denoiser().plan(), frame)?;
        let normal = upload(context, Format::R32G32B32A32_SFLOAT, size, &normals)?;
        let roughness = upload(context, Format::R32_SFLOAT, size, &frame.roughness)?;
        let depth = upload(context, Format::R32_SFLOAT, size, &frame.depth)?;
        let motion = upload(context, Format::R32G32_SFLOAT, size, &frame.motion)?;
        let radiance = upload(context, Format::R16G16B16A16_SFLOAT, size, &half_texels(&frame.radiance))?;
        let hit_motion = super::hit_motion(session.denoiser().plan(), frame)?;
        let hit_motion = hit_motion.map(|m| upload(context, Format::R32G32B32A32_SFLOAT, size, &m)).transpose()?;
        let gbuffer = [normal, roughness, depth];
        let previous = Some(self.last.as_ref().unwrap_or(&gbuffer).each_ref());
        let [normal, roughness, depth] = &gbuffer;
        let (radiance, motion) = (&radiance, &motion);
        let hit_motion = hit_motion.as_ref();
        let inputs =
            UploadedInputs { radiance, normal, roughness, depth, motion, hit_motion, environment: None, previous };
        let mut rays = frame.depth.iter().filter(|depth| **depth > 0.0).count() as u64;
        let (mut time, mut cpu_time) = (Duration::ZERO, Duration::ZERO);
        let mut traced = None;
        if let Some(tracer) = tracer {
            timed(&mut time, &mut cpu_time, || session.run_classify(&inputs, &frame_inputs))?;
            let listed = listed_rays(context, session.denoiser())?;
            rays = listed.len() as u64;
            let values = trace_listed(&listed, size, tracer);
            radiance.write(bytemuck::cast_slice(&half_texels(&values)))?;
            traced = Some(values);
            timed(&mut time, &mut cpu_time, || session.run_denoise(&inputs))?;
        } else {
            timed(&mut time, &mut cpu_time, || session.run(&inputs, &frame_inputs))?;
        }
        self.last = Some(gbuffer);
        let pass_times = session.denoiser().read_times()?.unwrap_or_default();
        let pass_times = pass_times.into_iter().map(|time| (time.pass, time.duration)).collect();
        let (radiance, variance) = read_halves(context, &session.denoiser().output(), size)?;
        let view = session.denoiser().debug_view();
        let debug_view = view.map(|image| anyhow::Ok(read_halves(context, &image, size)?.0)).transpose()?;
        Ok(Denoised { radiance, variance, debug_view, time, cpu_time, pass_times, rays, traced })
    }
}
