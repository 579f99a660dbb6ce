//! Water as beads: small clear drops, all that the same cameras see one draw call.
//!
//! Every frame [`HairBeads`] is filled with the [`Droplet`]s; others may be added to it. Beads are drawn
//! stretched along their velocity. Each bead is a camera-facing square on which a sphere is shaded; the
//! squares are pulled from one buffer by vertex index, as ribbons are.

use super::sets::{HairRenderSystems, Interpolate, supported};
use crate::{
    base::setting::Ranged,
    forces::environment::HairGravity,
    water::{Droplet, DropletRules, model::ball_radius},
};
use bevy::platform::collections::HashSet;
use bevy::{
    asset::{RenderAssetUsages, embedded_asset},
    camera::{
        primitives::Aabb,
        visibility::{NoAutoAabb, RenderLayers},
    },
    ecs::system::SystemParam,
    light::NotShadowCaster,
    mesh::{
        Indices, MeshVertexAttribute, MeshVertexBufferLayoutRef, PrimitiveTopology,
        VertexAttributeValues, VertexFormat,
    },
    pbr::{MaterialPipeline, MaterialPipelineKey},
    prelude::*,
    render::{
        Extract, ExtractSchedule, RenderApp,
        erased_render_asset::ErasedRenderAssetPlugin,
        render_asset::RenderAssets,
        render_resource::{AsBindGroup, RenderPipelineDescriptor, SpecializedMeshPipelineError},
        renderer::RenderQueue,
        storage::{GpuShaderBuffer, ShaderBuffer},
    },
    shader::ShaderRef,
};

/// A drop of water as it is drawn.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Bead {
    /// Its centre, in the world (m).
    pub position: Vec3,
    /// Radius at rest (m). A drop of 1 mm³ has 0.62 mm; nothing is drawn at 0.
    pub radius: f32,
    /// Velocity (m/s): fast beads are drawn long and slim.
    pub velocity: Vec3,
    /// The entity whose `RenderLayers` it has. Default none: layer 0, as where that entity has none.
    pub layers_of: Option<Entity>,
}

impl Bead {
    /// A bead of `volume` (m³).
    ///
    /// ```
    /// # use bevy_keratin::render::Bead; use bevy::prelude::*;
    /// let drop = Bead::of_volume(Vec3::ZERO, 1e-9, Vec3::ZERO);
    /// assert!((drop.radius - 0.62e-3).abs() < 1e-5);
    /// ```
    pub fn of_volume(position: Vec3, volume: f64, velocity: Vec3) -> Self {
        Self { position, radius: ball_radius(volume), velocity, layers_of: None }
    }

    /// As the shader reads it: 32 bytes. Non-finite beads have radius 0.
    fn packed(&self) -> PackedBead {
        let [x, y, z] = self.position.to_array();
        let [u, v, w] = self.velocity.to_array();
        let packed = [x, y, z, self.radius, u, v, w, 0.0];
        match packed.iter().all(|x| x.is_finite()) {
            true => packed,
            false => [0.0; 8],
        }
    }
}

/// The beads to draw in this frame, in any order. [`HairBeadSystems`] fill it in `PostUpdate`, before
/// [`HairRenderSystems`]; add your own between the two.
///
/// A [`Droplet`] that a hair carries, and one that fell from it, is seen where that hair is: it has the hair's
/// `RenderLayers`, and is hidden with it. `RenderLayers` and `Visibility` on the droplet itself or above it come first:
/// `Hidden` hides it, `Visible` shows it round hidden hair.
#[derive(Resource, Reflect, Clone, Debug, Default, Deref, DerefMut)]
#[reflect(Resource, Default)]
pub struct HairBeads(pub Vec<Bead>);

/// The system that fills [`HairBeads`] with the droplets.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HairBeadSystems;

/// How long a drop takes to flatten where it lies (s), and by how much, as a share of its radius.
const FLATTENING_SECONDS: f32 = 0.06;
const FLATTENED_SHARE: f32 = 0.6;

/// Run condition: there is any droplet, or one is still shown.
pub(super) fn are_any(beads: Res<HairBeads>, droplets: Query<(), With<Droplet>>) -> bool {
    !droplets.is_empty() || !beads.is_empty()
}

/// What says whether a drop is seen.
#[derive(SystemParam)]
pub(super) struct Sight<'w, 's> {
    visibility: Query<'w, 's, &'static Visibility>,
    parents: Query<'w, 's, &'static ChildOf>,
}

impl Sight<'_, '_> {
    /// As Bevy will find for this frame; unknown where nothing says so.
    fn of(&self, entity: Entity) -> Option<bool> {
        let line = core::iter::once(entity).chain(self.parents.iter_ancestors(entity));
        line.filter_map(|at| self.visibility.get(at).ok()).find_map(|visibility| match visibility {
            Visibility::Hidden => Some(false),
            Visibility::Visible => Some(true),
            Visibility::Inherited => None,
        })
    }
}

/// Droplets interpolated between two ticks. Those that lie on something flatten to caps, and shrink
/// as they run off.
pub(super) fn show_droplets(
    mut beads: ResMut<HairBeads>,
    droplets: Query<(Entity, &Droplet, Has<RenderLayers>)>,
    (sight, mut last): (Sight, Local<(Option<Entity>, bool)>),
    (rules, gravity): (Option<Res<DropletRules>>, Option<Res<HairGravity>>),
    (time, interpolate): (Option<Res<Time<Fixed>>>, Res<Interpolate>),
) {
    let late = match time {
        Some(time) if interpolate.0 => {
            (1.0 - time.overstep_fraction().clamp(0.0, 1.0)) * time.timestep().as_secs_f32()
        }
        _ => 0.0,
    };
    let longest =
        rules.map(|rules| rules.clamped()).unwrap_or_default().resting_time.max(FLATTENING_SECONDS);
    let down = gravity.map_or(Vec3::NEG_Y, |gravity| gravity.normalize_or_zero());
    beads.clear();
    *last = (None, true);
    beads.extend(droplets.iter().filter_map(|(entity, drop, has_layers)| {
        if last.0 != drop.hair() {
            *last = (drop.hair(), drop.hair().and_then(|hair| sight.of(hair)).unwrap_or(true));
        }
        if !sight.of(entity).unwrap_or(last.1) {
            return None;
        }
        let layers_of = if has_layers { Some(entity) } else { drop.hair() };
        let position = drop.position - drop.velocity * late;
        let radius = drop.radius();
        if drop.lying <= 0.0 {
            return Some(Bead { position, radius, velocity: drop.velocity, layers_of });
        }
        let flattened = FLATTENED_SHARE * (drop.lying / FLATTENING_SECONDS).min(1.0);
        let left = (1.0 - drop.lying / longest).clamp(0.0, 1.0).sqrt();
        // The cap stays on the surface as it shrinks.
        let position = position + down * (radius * (1.0 - left * (1.0 - flattened)));
        let radius = radius * left * (1.0 + 0.3 * flattened);
        Some(Bead { position, radius, velocity: Vec3::ZERO, layers_of })
    }));
}

type PackedBead = [f32; 8];

/// What is drawn of beads: those of the same layers together.
#[derive(Resource, Default)]
struct DrawnBeads(Vec<BeadGroup>);

/// The buffer of some drawn beads, with spare capacity so that few frames reallocate.
#[derive(Default)]
struct BeadGroup {
    layers: RenderLayers,
    packed: Vec<PackedBead>,
    /// How many of these there are, for how many there was room, and the corners of the box around them.
    count: usize,
    room: usize,
    low: Vec3,
    high: Vec3,
    buffer: Handle<ShaderBuffer>,
    entity: Option<Entity>,
}

const CORNER: MeshVertexAttribute =
    MeshVertexAttribute::new("Bead_Corner", 0x6b65_7261_7469_6e02, VertexFormat::Uint32);
const SHADER: &str = "embedded://bevy_keratin/render/beads.wgsl";
const MIN_CAPACITY: usize = 64;
const MOST: usize = 1 << 20;

#[derive(Asset, AsBindGroup, TypePath, Clone, Debug)]
struct BeadMaterial {
    #[storage(0, read_only)]
    beads: Handle<ShaderBuffer>,
}

impl Material for BeadMaterial {
    fn vertex_shader() -> ShaderRef {
        SHADER.into()
    }

    fn fragment_shader() -> ShaderRef {
        SHADER.into()
    }

    /// Drawn after everything solid, of which it gets a copy to look through.
    fn reads_view_transmission_texture(&self) -> bool {
        true
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        layout: &MeshVertexBufferLayoutRef,
        _: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        descriptor.vertex.buffers = vec![layout.0.get_layout(&[CORNER.at_shader_location(0)])?];
        descriptor.primitive.cull_mode = None;
        if let Some(fragment) = &mut descriptor.fragment {
            // Light refracted through the drop lights its far side.
            fragment.shader_defs.push("STANDARD_MATERIAL_DIFFUSE_TRANSMISSION".into());
        }
        Ok(())
    }
}

/// Called in `Plugin::finish`, when all render plugins have been added.
pub(super) fn finish(app: &mut App) {
    embedded_asset!(app, "beads.wgsl");
    app.add_plugins(MaterialPlugin::<BeadMaterial>::default());
    ErasedRenderAssetPlugin::<MeshMaterial3d<BeadMaterial>>::default().finish(app);
    app.init_resource::<DrawnBeads>()
        .add_systems(PostUpdate, pack.in_set(HairRenderSystems).run_if(supported));
    if let Some(render) = app.get_sub_app_mut(RenderApp) {
        render.add_systems(ExtractSchedule, upload.in_set(HairRenderSystems));
    }
}

fn pack(
    mut commands: Commands,
    beads: Res<HairBeads>,
    mut drawn: ResMut<DrawnBeads>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<BeadMaterial>>,
    mut buffers: ResMut<Assets<ShaderBuffer>>,
    mut bounds: Query<&mut Aabb>,
    layers: Query<&RenderLayers>,
) {
    if !beads.is_changed() || (beads.is_empty() && drawn.0.is_empty()) {
        return;
    }
    let DrawnBeads(groups) = &mut *drawn;
    groups.iter_mut().for_each(BeadGroup::clear);
    let (mut last, mut at) = (None, 0);
    for bead in beads.iter().take(MOST) {
        if last != Some(bead.layers_of) {
            last = Some(bead.layers_of);
            let of = bead.layers_of.and_then(|of| layers.get(of).ok()).unwrap_or_default();
            at = groups.iter().position(|group| group.layers == *of).unwrap_or(groups.len());
            if at == groups.len() {
                groups.push(BeadGroup { layers: of.clone(), ..default() });
                groups[at].clear();
            }
        }
        groups[at].push(bead);
    }
    for group in groups.iter_mut() {
        let room = capacity(group.count, group.room);
        group.packed.resize(room, [0.0; 8]);
        let (low, high) = (group.low, group.high);
        let around = if low.x <= high.x { Aabb::from_min_max(low, high) } else { Aabb::default() };
        let entity = group.entity.and_then(|entity| bounds.get_mut(entity).ok());
        if room == group.room
            && let Some(mut bounds) = entity
        {
            bounds.set_if_neq(around);
            continue;
        }
        let bytes: &[u8] = bytemuck::cast_slice(&group.packed);
        group.buffer = buffers.add(ShaderBuffer::new(bytes, RenderAssetUsages::default()));
        let parts = (
            Name::new("drawn beads"),
            Mesh3d(meshes.add(quads(room as u32))),
            MeshMaterial3d(materials.add(BeadMaterial { beads: group.buffer.clone() })),
            (group.layers.clone(), around, NoAutoAabb, NotShadowCaster),
        );
        if let Some(old) = group.entity.take() {
            commands.entity(old).try_despawn();
        }
        group.entity = Some(commands.spawn(parts).id());
    }
    // Layers that no bead has any more; of the last ones the room is kept.
    let mut kept = 0;
    groups.retain(|group| {
        let keep = group.count > 0 || kept == 0 && beads.is_empty();
        kept += usize::from(keep);
        if let (false, Some(entity)) = (keep, group.entity) {
            commands.entity(entity).try_despawn();
        }
        keep
    });
}

impl BeadGroup {
    fn clear(&mut self) {
        self.room = self.packed.len();
        self.packed.clear();
        (self.count, self.low, self.high) = (0, Vec3::MAX, Vec3::MIN);
    }

    fn push(&mut self, bead: &Bead) {
        let packed = bead.packed();
        let reach = 4.0 * packed[3];
        if reach > 0.0 {
            self.low = self.low.min(bead.position - reach);
            self.high = self.high.max(bead.position + reach);
        }
        self.packed.push(packed);
        self.count += 1;
    }
}

/// Room for `count` beads where there is room for `present`: made smaller where it is much too large, because all
/// of it is written whenever beads change.
fn capacity(count: usize, present: usize) -> usize {
    let fits = count.max(MIN_CAPACITY).next_power_of_two();
    if (fits..4 * fits).contains(&present) { present } else { fits }
}

/// Writes beads that have changed to the GPU. A buffer created in this frame is uploaded with its contents instead.
fn upload(
    mut written: Local<HashSet<AssetId<ShaderBuffer>>>,
    drawn: Extract<Option<Res<DrawnBeads>>>,
    buffers: Option<Res<RenderAssets<GpuShaderBuffer>>>,
    queue: Option<Res<RenderQueue>>,
) {
    let (Some(drawn), Some(buffers), Some(queue)) = (drawn.as_ref(), buffers, queue) else {
        return;
    };
    if drawn.is_changed() || queue.is_changed() {
        written.clear();
    }
    for group in &drawn.0 {
        let bytes: &[u8] = bytemuck::cast_slice(&group.packed);
        // Skipped in the frame in which a new device's queue is combined with buffers of a lost one.
        if !written.contains(&group.buffer.id())
            && let Some(gpu) = buffers.get(&group.buffer)
            && !queue.is_changed()
            && gpu.buffer.size() == bytes.len() as u64
        {
            queue.write_buffer(&gpu.buffer, 0, bytes);
            written.insert(group.buffer.id());
        }
    }
}

/// A mesh of only corner indices: four for each bead.
fn quads(count: u32) -> Mesh {
    let indices = (0..count).flat_map(|i| [0, 1, 2, 2, 1, 3].map(|corner| 4 * i + corner));
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(CORNER, VertexAttributeValues::Uint32((0..4 * count).collect()))
        .with_inserted_indices(Indices::U32(indices.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_for_beads_follows_their_number_and_changes_rarely() {
        let counts = [0, 40, 3000, 2100, 1500, 4000, 900, 100, 0, 0];
        let mut room = 0;
        let rooms = counts.map(|count| {
            room = capacity(count, room);
            room
        });
        assert_eq!(rooms, [64, 64, 4096, 4096, 4096, 4096, 1024, 128, 128, 128]);
    }

    #[test]
    fn a_bead_has_its_volume_and_a_non_finite_one_is_not_drawn() {
        let bead = Bead::of_volume(Vec3::X, 4.0 / 3.0 * core::f64::consts::PI * 8e-9, Vec3::Y);
        assert!((bead.radius - 2e-3).abs() < 1e-8);
        assert_eq!(Bead::of_volume(Vec3::X, -1.0, Vec3::Y).radius, 0.0);
        assert_eq!(Bead { velocity: Vec3::NAN, ..bead }.packed(), [0.0; 8]);
        assert_eq!(bead.packed()[..3], [1.0, 0.0, 0.0]);
    }
}
