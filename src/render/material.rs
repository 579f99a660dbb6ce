//! The material of ribbons.

use super::{
    HairFollowers, HairView,
    ribbon_mesh::{CORNER, DrawOrder},
    rings::Rings,
    thickness::{PIECES, Thickness},
};
use crate::hair::look::{HairDye, HairLook, HairShading, MAX_LAYERS};
use bevy::{
    material::OpaqueRendererMethod,
    mesh::MeshVertexBufferLayoutRef,
    pbr::{MaterialPipeline, MaterialPipelineKey},
    prelude::*,
    render::{
        render_resource::{
            AsBindGroup, ColorTargetState, ColorWrites, CompareFunction, RenderPipelineDescriptor,
            ShaderType, SpecializedMeshPipelineError, TextureFormat,
        },
        storage::ShaderBuffer,
    },
    shader::{ShaderDefVal, ShaderRef},
};
use core::marker::PhantomData;

/// Of marks, see [`smoothing`](super::smoothing): twice the angle of a strand on the screen as cosine and sine, each halved
/// and from one half up, and 1.
pub(super) const MARKS: TextureFormat = TextureFormat::Rgba8Unorm;

/// Which of a camera's two draws of hair a material is for.
pub(super) trait Draw: TypePath + Clone + core::fmt::Debug + Send + Sync + 'static {
    /// Whether it is the one that finds out which strands are seen.
    const DEPTH: bool;
}

/// Lit hair, in all passes. In a camera's picture it shades no more than what is seen.
#[derive(TypePath, Clone, Debug)]
pub(super) struct Lit;

/// Depth before it, in the picture alone: shading strands that others hide would cost several times as much.
#[derive(TypePath, Clone, Debug)]
pub(super) struct Depth;

impl Draw for Lit {
    const DEPTH: bool = false;
}

impl Draw for Depth {
    const DEPTH: bool = true;
}

/// The material of drawn hair; made and kept up to date from [`HairLook`], [`HairFollowers`] and
/// [`HairView`], which a game edits instead.
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug)]
#[bind_group_data(RibbonKey)]
pub(super) struct RibbonMaterial<D: Draw = Lit> {
    pub(super) draw: PhantomData<D>,
    pub(super) key: RibbonKey,
    #[uniform(0)]
    pub(super) ribbon: Ribbon,
    #[storage(1, read_only, visibility(vertex))]
    pub(super) nodes: Handle<ShaderBuffer>,
    #[storage(2, read_only, visibility(vertex))]
    pub(super) guides: Handle<ShaderBuffer>,
    #[storage(3, read_only, visibility(vertex))]
    pub(super) strands: Handle<ShaderBuffer>,
    /// For each strand a bit mask of the layers of dye whose streaks it is in. Read only where a
    /// layer has streaks.
    #[storage(4, read_only, visibility(vertex))]
    pub(super) streaks: Handle<ShaderBuffer>,
    /// What differs from frame to frame besides nodes.
    #[storage(5, read_only, visibility(vertex, fragment))]
    pub(super) frame: Handle<ShaderBuffer>,
    /// Computed once a frame from these; read only where the key says so.
    #[storage(6, read_only, visibility(vertex))]
    pub(super) rings: Handle<ShaderBuffer>,
    /// How many fibres light meets.
    #[texture(7, dimension = "3d", visibility(fragment))]
    #[sampler(8, visibility(fragment))]
    pub(super) volume: Option<Handle<Image>>,
}

/// Specialisation key of the shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct RibbonKey {
    heat: bool,
    kajiya_kay: bool,
    /// Whether rings are computed once a frame.
    pub(super) expanded: bool,
    /// Whether it is averaged along its strands, see `HairSmoothing`.
    marked: bool,
}

impl RibbonKey {
    pub(super) fn new(look: &HairLook, view: HairView, expanded: bool) -> Self {
        let heat = !matches!(view, HairView::Natural | HairView::Guides);
        let kajiya_kay = !heat && look.shading == HairShading::KajiyaKay;
        Self { heat, kajiya_kay, expanded, marked: !heat }
    }

    /// Depth is the same whatever colour is seen.
    fn of_depth(self) -> Self {
        Self { expanded: self.expanded, marked: self.marked, ..default() }
    }

    pub(super) fn is_lit(self) -> bool {
        !self.heat
    }
}

impl<D: Draw> From<&RibbonMaterial<D>> for RibbonKey {
    fn from(material: &RibbonMaterial<D>) -> Self {
        material.key
    }
}

impl RibbonMaterial {
    /// That of the draw before.
    pub(super) fn depth(&self) -> RibbonMaterial<Depth> {
        let Self { key, ribbon, nodes, guides, strands, streaks, frame, rings, .. } = self.clone();
        let (draw, volume) = (PhantomData, None);
        let key = key.of_depth();
        RibbonMaterial { draw, key, ribbon, nodes, guides, strands, streaks, frame, rings, volume }
    }
}

/// `Ribbon` of `strands.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Ribbon {
    root_absorption: Vec3,
    variation: f32,
    tip_absorption: Vec3,
    root_shade: f32,
    width: f32,
    taper: f32,
    roughness: f32,
    gloss: f32,
    backlight: f32,
    grey: f32,
    layers: f32,
    clump: f32,
    parting: f32,
    wet_clump: f32,
    segments: u32,
    guides: u32,
    strands: u32,
    view: u32,
    frizz: f32,
    locks: Vec3,
    lock_shape: f32,
    root_fade: f32,
    dye_count: u32,
    rank_step: u32,
    order_step: u32,
    ring_ranks: u32,
    ring_every: u32,
    shadow_density: f32,
    densities: [Vec4; PIECES / 4],
    dyes: [Dye; MAX_LAYERS],
}

/// `Dye` of `strands.wgsl`: a layer of dye.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
struct Dye {
    absorption: Vec3,
    bleach: f32,
    begin: f32,
    end: f32,
    fade: f32,
    in_streaks: u32,
}

fn dyes(dye: &HairDye) -> [Dye; MAX_LAYERS] {
    let mut dyes = [Dye::default(); MAX_LAYERS];
    for (to, layer) in dyes.iter_mut().zip(&dye.layers) {
        *to = Dye {
            absorption: layer.absorption(),
            bleach: layer.bleach,
            begin: layer.from,
            end: layer.to,
            fade: layer.fade,
            in_streaks: layer.streaks.is_some().into(),
        };
    }
    dyes
}

impl Ribbon {
    /// With room for these rings.
    pub(super) fn with_rings(self, rings: Rings) -> Self {
        Self { ring_ranks: rings.ranks, ring_every: rings.every, ..self }
    }

    pub(super) fn new(
        (look, dye): (&HairLook, &HairDye),
        followers: &HairFollowers,
        view: HairView,
        thickness: Thickness,
        guides: u32,
        strands: u32,
        rings: Rings,
    ) -> Self {
        let order = DrawOrder::new(strands);
        let (root_absorption, tip_absorption) = look.absorptions();
        let fibre_width = look.width * look.shadow_density;
        Self {
            root_absorption,
            variation: look.variation,
            tip_absorption,
            root_shade: look.root_shade,
            width: look.width,
            taper: look.taper,
            roughness: look.roughness,
            gloss: look.gloss,
            backlight: look.backlight,
            grey: look.grey,
            layers: thickness.layers * fibre_width,
            clump: followers.clump,
            parting: followers.parting,
            wet_clump: followers.wet_clump,
            segments: followers.segments,
            guides,
            strands,
            view: view.number(),
            frizz: followers.frizz,
            locks: followers.locks,
            lock_shape: followers.lock_shape,
            root_fade: look.root_fade,
            dye_count: dye.layers.len().min(MAX_LAYERS) as u32,
            rank_step: order.rank_step(),
            order_step: order.step(),
            ring_ranks: rings.ranks,
            ring_every: rings.every,
            shadow_density: look.shadow_density,
            densities: core::array::from_fn(|i| {
                Vec4::from_slice(&thickness.densities[4 * i..]) * fibre_width
            }),
            dyes: dyes(dye),
        }
    }
}

const FORWARD: &str = "embedded://bevy_keratin/render/ribbon_forward.wgsl";
const PREPASS: &str = "embedded://bevy_keratin/render/ribbon_prepass.wgsl";

impl RibbonMaterial<Depth> {
    /// Whether it is what `lit` makes.
    pub(super) fn draws(&self, lit: &RibbonMaterial) -> bool {
        let Self { key, ribbon, nodes, guides, strands, streaks, frame, rings, .. } = self;
        (*key, ribbon) == (lit.key.of_depth(), &lit.ribbon)
            && [nodes, guides, strands] == [&lit.nodes, &lit.guides, &lit.strands]
            && [streaks, frame, rings] == [&lit.streaks, &lit.frame, &lit.rings]
    }
}

impl<D: Draw> Material for RibbonMaterial<D> {
    fn vertex_shader() -> ShaderRef {
        FORWARD.into()
    }

    fn fragment_shader() -> ShaderRef {
        FORWARD.into()
    }

    fn prepass_vertex_shader() -> ShaderRef {
        PREPASS.into()
    }

    fn prepass_fragment_shader() -> ShaderRef {
        PREPASS.into()
    }

    /// Makes Bevy run the fragment stage in the prepasses and shadow maps too, where strands cover
    /// their share of the samples. No alpha test is done. Opaque things are drawn before those with a mask.
    fn alpha_mode(&self) -> AlphaMode {
        if D::DEPTH { AlphaMode::Opaque } else { AlphaMode::Mask(0.5) }
    }

    fn enable_prepass() -> bool {
        !D::DEPTH
    }

    fn enable_shadows() -> bool {
        !D::DEPTH
    }

    fn opaque_render_method(&self) -> OpaqueRendererMethod {
        OpaqueRendererMethod::Forward
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        layout: &MeshVertexBufferLayoutRef,
        key: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        descriptor.vertex.buffers = vec![layout.0.get_layout(&[CORNER.at_shader_location(0)])?];
        descriptor.primitive.cull_mode = None;
        let samples = ShaderDefVal::UInt("HAIR_SAMPLES".into(), descriptor.multisample.count);
        let RibbonKey { heat, kajiya_kay, expanded, marked } = key.bind_group_data;
        let in_picture = descriptor.label.as_deref() != Some("prepass_pipeline");
        let depth_known = in_picture && !D::DEPTH;
        if let Some(depth) = descriptor.depth_stencil.as_mut().filter(|_| depth_known) {
            depth.depth_compare = Some(CompareFunction::Equal);
            depth.depth_write_enabled = Some(false);
        }
        descriptor.vertex.shader_defs.push(samples.clone());
        descriptor.vertex.shader_defs.extend(expanded.then(|| "HAIR_EXPANDED".into()));
        if let Some(fragment) = &mut descriptor.fragment {
            let defs = &mut fragment.shader_defs;
            defs.push(samples);
            defs.extend(heat.then(|| "HAIR_HEAT".into()));
            defs.extend(kajiya_kay.then(|| "HAIR_KAJIYA_KAY".into()));
            defs.extend(marked.then(|| "HAIR_MARKED".into()));
            defs.extend(D::DEPTH.then(|| "HAIR_DEPTH".into()));
            if in_picture {
                // The pass has both: depth writes marks, light the picture.
                let [picture, marks] = match D::DEPTH {
                    true => [ColorWrites::empty(), ColorWrites::ALL],
                    false => [ColorWrites::ALL, ColorWrites::empty()],
                };
                fragment.targets.iter_mut().flatten().for_each(|to| to.write_mask = picture);
                let to = ColorTargetState { format: MARKS, blend: None, write_mask: marks };
                fragment.targets.push(Some(to));
            }
        }
        Ok(())
    }
}
