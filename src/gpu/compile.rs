//! The kernels of the app's device: asked for by the main world, compiled in the render world.

use super::{
    constants::source,
    pipelines::{COUNT, HairKernels, KERNELS, layouts},
    residence::{HairGpu, WhyCpu},
};
use crate::render::why_broken;
use bevy::{
    ecs::system::SystemParam,
    material::descriptor::{BindGroupLayoutDescriptor, ComputePipelineDescriptor},
    prelude::*,
    render::{
        GpuResourceAppExt, Render, RenderApp, RenderSystems,
        render_resource::{CachedComputePipelineId, DownlevelFlags, PipelineCache},
        renderer::{RenderAdapter, RenderAdapterInfo, RenderDevice, RenderQueue},
    },
    shader::{Shader, ValidateShader},
};
use core::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// What both worlds know of the kernels and of the device.
#[derive(Resource, Clone, Default)]
pub(super) struct Compiled {
    state: Arc<Mutex<State>>,
    /// How many devices there have been: two of them may look alike.
    devices: Arc<AtomicU64>,
}

#[derive(Default)]
enum State {
    #[default]
    Idle,
    Asked,
    /// On this device.
    Ready(u64, Arc<HairKernels>),
    Broken,
}

impl Compiled {
    fn with<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The number of the present device.
    pub(super) fn device(&self) -> u64 {
        self.devices.load(Ordering::Acquire)
    }

    /// There is another device.
    pub(super) fn renew(&self) {
        self.devices.fetch_add(1, Ordering::AcqRel);
        self.with(|state| *state = State::Idle);
    }
}

/// The kernels' sources as assets, which live as long as the app.
#[derive(Resource, Clone)]
pub(super) struct Sources([Handle<Shader>; COUNT]);

impl Sources {
    /// `None` in an app without shaders.
    pub(super) fn add(world: &mut World) -> Option<Self> {
        let mut shaders = world.get_resource_mut::<Assets<Shader>>()?;
        Some(Self(KERNELS.map(|(name, files, _)| {
            let mut shader =
                Shader::from_wgsl(source(files), format!("bevy_keratin/gpu/{name}.wgsl"));
            // An index out of range must stay without effect, whatever it would cost to find it.
            shader.validate_shader = ValidateShader::Enabled;
            shaders.add(shader)
        })))
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Compiled>();
    let compiled = app.world().resource::<Compiled>().clone();
    let Some(sources) = Sources::add(app.world_mut()) else { return };
    app.insert_resource(sources.clone());
    if let Some(render) = app.get_sub_app_mut(RenderApp) {
        render
            .insert_resource(compiled)
            .insert_resource(sources)
            .init_gpu_resource::<Queued>()
            .add_systems(Render, compile.in_set(RenderSystems::PrepareResources));
    }
}

/// The pipelines in the cache of this device.
#[derive(Resource, Default)]
struct Queued(Option<[CachedComputePipelineId; COUNT]>);

fn compile(
    compiled: Res<Compiled>,
    sources: Res<Sources>,
    cache: Res<PipelineCache>,
    mut queued: ResMut<Queued>,
) {
    if !compiled.with(|state| matches!(state, State::Asked)) {
        return;
    }
    let layouts = layouts().map(|(label, entries)| BindGroupLayoutDescriptor::new(label, &entries));
    let ids = *queued.0.get_or_insert_with(|| {
        core::array::from_fn(|i| {
            let (name, _, groups) = KERNELS[i];
            cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some(name.into()),
                layout: groups.iter().map(|group| layouts[*group].clone()).collect(),
                shader: sources.0[i].clone(),
                entry_point: Some(name.into()),
                ..default()
            })
        })
    });
    for id in ids {
        if let Some(error) = why_broken(&cache, id) {
            tracing::error!("hair's kernels cannot be compiled: {error}");
            compiled.with(|state| *state = State::Broken);
            return;
        }
    }
    let pipelines: Option<Vec<_>> =
        ids.iter().map(|id| cache.get_compute_pipeline(*id).cloned()).collect();
    let Some(Ok(pipelines)) = pipelines.map(TryInto::try_into) else { return };
    let layouts = layouts.map(|layout| cache.get_bind_group_layout(&layout));
    let kernels = Arc::new(HairKernels::of(layouts, pipelines));
    compiled.with(|state| *state = State::Ready(compiled.device(), kernels));
}

/// The app's device as far as the main world needs it.
#[derive(SystemParam)]
pub(super) struct AppDevice<'w> {
    device: Option<Res<'w, RenderDevice>>,
    queue: Option<Res<'w, RenderQueue>>,
    adapter: Option<Res<'w, RenderAdapter>>,
    info: Option<Res<'w, RenderAdapterInfo>>,
    compiled: Res<'w, Compiled>,
    sources: Option<Res<'w, Sources>>,
    settings: Res<'w, HairGpu>,
}

/// What hair is handed over with.
#[derive(Clone)]
pub(super) struct Ready {
    /// The device's number.
    pub(super) number: u64,
    pub(super) device: RenderDevice,
    pub(super) queue: RenderQueue,
    pub(super) kernels: Arc<HairKernels>,
}

impl AppDevice<'_> {
    /// The device with its kernels, which are compiled when first needed.
    pub(super) fn ready(&self) -> Result<Ready, WhyCpu> {
        let (Some(device), Some(queue), Some(adapter), Some(_)) =
            (&self.device, &self.queue, &self.adapter, &self.sources)
        else {
            return Err(WhyCpu::NoRenderer);
        };
        let computes =
            adapter.get_downlevel_capabilities().flags.contains(DownlevelFlags::COMPUTE_SHADERS);
        if !computes || device.limits().max_storage_buffers_per_shader_stage < 8 {
            return Err(WhyCpu::NoCompute);
        }
        // The type's name is not public.
        let is_software =
            self.info.as_ref().is_some_and(|info| format!("{:?}", info.device_type) == "Cpu");
        if is_software && !self.settings.software {
            return Err(WhyCpu::Software);
        }
        self.compiled.with(|state| match state {
            State::Ready(number, kernels) if *number == self.compiled.device() => Ok(Ready {
                number: *number,
                device: RenderDevice::clone(device),
                queue: RenderQueue::clone(queue),
                kernels: kernels.clone(),
            }),
            State::Broken => Err(WhyCpu::Broken),
            State::Asked => Err(WhyCpu::Compiling),
            State::Idle | State::Ready(..) => {
                *state = State::Asked;
                Err(WhyCpu::Compiling)
            }
        })
    }
}
