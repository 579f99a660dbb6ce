//! Packs strands for drawing, once a frame.

use super::{
    HairFollowers, HairView, WetLook,
    buffers::{DrawnNodes, HairBuffers, PackedNode, pack_strands, packed_place},
    curve::Guide,
    drawn_strand::{DrawnStrand, GuideEnd, GuideRoot},
    elsewhere::DrawnElsewhere,
    follower_roots::{FollowerRoots, misplaced},
    material::{Ribbon, RibbonKey, RibbonMaterial},
    packed_frame::{DrawnFrame, PackedFrame},
    ribbon_mesh::{RibbonLevel, RibbonMeshes},
    rings::Rings,
    scatter::{scatter, shorten},
    sets::Interpolate,
    streaks::DrawnStreaks,
    thickness::Thickness,
};
use crate::{
    base::{
        fault::HairFault,
        lanes::{dispatch, simd_level},
        parallel::{Nanos, emptied, for_each},
        setting::Settings,
    },
    hair::{
        look::{HairDye, HairLook},
        strand::{CutStrand, FollowerCuts, Hair, MotionOwner, Strand, StrandHistory, Strands},
    },
    keratin::bond::Bonds,
    simulation::settle::Settling,
    water::Moisture,
};
use bevy::{
    asset::RenderAssetUsages,
    camera::{primitives::Aabb, visibility::NoAutoAabb},
    ecs::system::NonSendMarker,
    prelude::*,
    render::{renderer::RenderDevice, storage::ShaderBuffer},
};
use core::marker::PhantomData;

/// Packed data of a hair, kept to reuse the allocations.
#[derive(Component, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
pub(super) struct Packed {
    pub(super) nodes: Vec<PackedNode>,
    layout: Vec<PackedGuide>,
    /// Roots of guides when the layout was made: `FollowerRoots` refer to these.
    roots: Vec<GuideRoot>,
    followers: Option<HairFollowers>,
    /// Whether roots have moved since followers were laid out.
    roots_moved: bool,
    /// Whether the nodes here are not those that were drawn in the frame before.
    is_stale: bool,
    thickness: Thickness,
    /// How far apart guides grow (m).
    spacing: f32,
    /// How far followers reach beyond the guides (m).
    margin: f32,
    pub(super) ribbon: Ribbon,
    pub(super) key: RibbonKey,
    /// For which rings there is room; none before the first frame.
    pub(super) rings: Rings,
    /// In which fibres on the way of light are counted, and the number of cells along its side.
    pub(super) volume: Option<(Handle<Image>, u32)>,
    /// Roots of drawn strands at rest, which determine their streaks.
    places: Vec<Vec3>,
    /// The streaks last uploaded to the GPU.
    streaks: DrawnStreaks,
}

/// Marks the child that carries mesh and material of a hair.
#[derive(Component, Reflect, Clone, Copy, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub(super) struct DrawnHair;

/// A strand that is a guide.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PackedGuide {
    strand: Entity,
    /// How many nodes it has.
    nodes: u32,
    /// Where it ends.
    end: GuideEnd,
    /// Position of its root when followers were laid out (m).
    root: Vec3,
}

type GuideParts = (
    &'static Strand,
    &'static StrandHistory,
    &'static Bonds,
    Option<&'static Moisture>,
    Option<&'static WetLook>,
    Option<&'static CutStrand>,
);

/// Prepares new hair for drawing, and cleans up removed hair.
pub(super) fn appear(
    mut commands: Commands,
    hairs: Query<Entity, (With<Hair>, Without<Packed>)>,
    bald: Query<(Entity, Option<&HairBuffers>), (With<Packed>, Without<Hair>)>,
    drawn: Query<(Entity, &ChildOf), Added<DrawnHair>>,
    buffers: Query<&HairBuffers>,
) {
    // What draws a hair is copied with it, and saved.
    for (entity, of) in &drawn {
        if !buffers.get(of.parent()).is_ok_and(|buffers| buffers.drawn == entity) {
            commands.entity(entity).try_despawn();
        }
    }
    for hair in &hairs {
        commands.entity(hair).insert((Packed::default(), DrawnFrame::default()));
    }
    for (entity, buffers) in &bald {
        if let Some(buffers) = buffers {
            commands.entity(buffers.drawn).try_despawn();
        }
        commands.entity(entity).remove::<(Packed, DrawnFrame, HairBuffers)>();
    }
}

/// Hair that nothing settles is drawn as it is.
pub(super) fn end_settling(mut commands: Commands, hairs: Query<Entity, With<Settling>>) {
    for hair in &hairs {
        commands.entity(hair).try_remove::<Settling>();
    }
}

/// Packs all nodes at their drawn positions; when the groom has changed, everything that depends on it is
/// rebuilt.
pub(super) fn pack(
    mut commands: Commands,
    mut hairs: Query<(
        (Entity, &MotionOwner),
        &mut Packed,
        Option<&HairBuffers>,
        Option<&Strands>,
        (Option<Ref<FollowerRoots>>, Option<Ref<FollowerCuts>>),
        &GlobalTransform,
        Option<&mut DrawnElsewhere>,
    )>,
    mut roots_removed: RemovedComponents<FollowerRoots>,
    strands: Query<GuideParts>,
    mut drawn: Query<(&mut Aabb, &MeshMaterial3d<RibbonMaterial>)>,
    (looks, dyes, views): (Settings<HairLook>, Settings<HairDye>, Settings<HairView>),
    followers: Settings<HairFollowers>,
    (time, interpolate): (Option<Res<Time<Fixed>>>, Res<Interpolate>),
    device: Option<Res<RenderDevice>>,
    (mut known_meshes, mut meshes): (ResMut<RibbonMeshes>, ResMut<Assets<Mesh>>),
    mut materials: ResMut<Assets<RibbonMaterial>>,
    mut shader_buffers: ResMut<Assets<ShaderBuffer>>,
    mut faults: MessageWriter<HairFault>,
    // The main thread joins in its parts; it waits for a system that a thread of the pool runs.
    (mut free, _main): (Local<Vec<GuideBlock<'static>>>, NonSendMarker),
) {
    let overstep = match time {
        Some(time) if interpolate.0 => time.overstep_fraction().clamp(0.0, 1.0),
        _ => 1.0,
    };
    let new_device = device.is_some_and(|device| device.is_changed());
    let roots_removed: Vec<Entity> = roots_removed.read().collect();
    for ((hair, owner), mut packed, buffers, members, followers_own, place, elsewhere) in &mut hairs
    {
        let (follower_roots, cuts) = followers_own;
        if *owner == MotionOwner::Settling {
            continue;
        }
        let packed = packed.bypass_change_detection();
        let guides = || members.into_iter().flat_map(|m| m.iter());
        let settings = followers.of(hair);
        // The nodes of hair on the GPU are not here, and its guides stay the same: it returns before they
        // change.
        let elsewhere = elsewhere.map(|mut drawn| {
            let drawn = drawn.bypass_change_detection();
            drawn.overstep = if drawn.rests { 1.0 } else { overstep };
            (drawn.low, drawn.high)
        });
        let elsewhere = elsewhere.filter(|_| buffers.is_some() && !packed.layout.is_empty());
        let mut has_new_layout = packed.update_followers(&settings);
        if elsewhere.is_none() {
            has_new_layout |= packed.update_layout(guides(), &strands);
        }
        has_new_layout |=
            follower_roots.as_ref().map_or(roots_removed.contains(&hair), Ref::is_changed);
        has_new_layout |= cuts.as_ref().is_some_and(Ref::is_changed);

        let (low, high) = match elsewhere {
            Some(corners) => {
                packed.is_stale = true;
                corners
            }
            None => {
                let known = !has_new_layout && !core::mem::take(&mut packed.is_stale);
                packed.pack_nodes(&strands, overstep, known, &mut free).unwrap_or_default()
            }
        };
        let around = |margin: f32| Aabb::from_min_max(low - margin, high + margin);
        let (look, dye) = (looks.of(hair), dyes.of(hair));
        let view = views.of(hair);
        let key = |rings: bool| RibbonKey::new(&look, view, rings);

        let known = buffers.and_then(|b| drawn.get_mut(b.drawn).ok().zip(Some(b)));
        if packed.layout.is_empty() {
            if let Some(buffers) = buffers {
                commands.entity(buffers.drawn).try_despawn();
                commands.entity(hair).remove::<HairBuffers>();
            }
            continue;
        }
        if !has_new_layout && let Some(((mut bounds, material), buffers)) = known {
            bounds.set_if_neq(around(packed.margin));
            // A new device after a loss gets all buffers again; these nodes are the present ones.
            if new_device && let Some(mut nodes) = shader_buffers.get_mut(&buffers.nodes) {
                nodes.data = Some(bytemuck::cast_slice(&packed.nodes).to_vec());
            }
            let counts = (buffers.guide_count, buffers.strand_count);
            let key = key(buffers.rings.is_some());
            let ribbon = packed.ribbon((&look, &dye), &settings, view, counts);
            let has_new_streaks = packed.streaks.update(&dye);
            if has_new_streaks || (packed.ribbon, packed.key) != (ribbon, key) {
                (packed.ribbon, packed.key) = (ribbon, key);
                if let Some(mut material) = materials.get_mut(&material.0) {
                    material.key = key;
                    material.ribbon = ribbon;
                    if has_new_streaks {
                        material.streaks =
                            shader_buffers.add(buffer(&packed.streaks.pack(&packed.places)));
                    }
                }
            }
            continue;
        }

        let strands =
            packed.scatter(&strands, follower_roots.as_deref(), cuts.as_deref(), &settings);
        faults.write_batch(misplaced(&strands).map(|fault| fault.of(hair)));
        let counts = (packed.layout.len() as u32, strands.len() as u32);
        (packed.rings, packed.volume) = default();
        packed.ribbon = packed.ribbon((&look, &dye), &settings, view, counts);
        let key = key(false);
        packed.key = key;
        packed.streaks.update(&dye);
        let mut first = 0;
        let ranges = packed.layout.iter().map(|guide| {
            first += guide.nodes;
            let GuideEnd { edges, end } = guide.end;
            [first - guide.nodes, guide.nodes, edges.to_bits(), end.to_bits()]
        });
        let ranges: Vec<[u32; 4]> = ranges.collect();
        let mut add = |bytes: &[u8]| shader_buffers.add(buffer(bytes));
        let nodes = add(bytemuck::cast_slice(&packed.nodes));
        let material = RibbonMaterial {
            draw: PhantomData,
            key,
            ribbon: packed.ribbon,
            // A placeholder: rings are not read before they are expanded.
            rings: nodes.clone(),
            volume: None,
            nodes,
            guides: add(bytemuck::cast_slice(&ranges)),
            strands: add(&pack_strands(&strands)),
            streaks: add(&packed.streaks.pack(&packed.places)),
            frame: add(bytemuck::bytes_of(&PackedFrame::default())),
        };
        let (nodes, guides) = (material.nodes.clone(), material.guides.clone());
        let (strands, frame) = (material.strands.clone(), material.frame.clone());
        let level = RibbonLevel::full(counts.1, settings.segments);
        let mesh = known_meshes.get(level, &mut meshes);
        let material = MeshMaterial3d(materials.add(material));
        let parts = (Mesh3d(mesh), material, around(packed.margin), NoAutoAabb);
        // The child entity is kept, with the components that a game has put on it.
        let drawn = match known {
            Some((_, old)) => {
                commands.entity(old.drawn).try_insert(parts);
                old.drawn
            }
            // Transforms have been propagated already in this frame.
            None => {
                let name = Name::new("drawn hair");
                commands.spawn((DrawnHair, name, parts, *place, ChildOf(hair))).id()
            }
        };
        commands.entity(hair).insert(HairBuffers {
            nodes,
            guides,
            strands,
            frame,
            rings: None,
            guide_count: counts.0,
            strand_count: counts.1,
            drawn,
        });
    }
}

/// The data stay in the main world as well, for a new device after a device loss.
fn buffer(bytes: &[u8]) -> ShaderBuffer {
    ShaderBuffer::new(bytes, RenderAssetUsages::default())
}

/// Some guides and their nodes, packed by one thread.
pub(super) struct GuideBlock<'a> {
    guides: &'a [PackedGuide],
    nodes: &'a mut [PackedNode],
    /// The box around them.
    bounds: Option<(Vec3, Vec3)>,
    /// Whether no root has moved since the frame before.
    still: bool,
    /// Whether a root is far from where it was when followers were laid out.
    displaced: bool,
}

impl GuideBlock<'_> {
    /// Their lists fit into the nearest cache.
    const GUIDES: usize = 16;
    /// Estimated time of a node (ns).
    const NODE: usize = 20;

    #[inline(always)]
    fn pack(&mut self, strands: &Query<GuideParts>, overstep: f32, known: bool, far: f32) {
        let parts: [_; GuideBlock::GUIDES] = core::array::from_fn(|i| {
            let (strand, history, bonds, water, wet, _) =
                strands.get(self.guides.get(i)?.strand).ok()?;
            let wet = wet.map_or_else(|| water.map_or(&[][..], Moisture::sheen), |wet| &wet.0);
            let nodes = DrawnNodes { strand, history, bonds, wet };
            nodes.prefetch();
            Some(nodes)
        });
        let mut rest = &mut *self.nodes;
        for (guide, nodes) in self.guides.iter().zip(&parts) {
            let own = rest.split_off_mut(..guide.nodes as usize).unwrap_or_default();
            let Some(nodes) = nodes else { continue };
            let before = packed_place(&own[0]);
            let around = nodes.pack(own, known, overstep);
            let root = packed_place(&own[0]);
            self.still &= root.distance_squared(before) < 1e-12;
            self.displaced |= root.distance(guide.root) > far;
            self.bounds = self.bounds.into_iter().chain(around).reduce(around_both);
        }
    }
}

/// The box around two boxes.
fn around_both((a, b): (Vec3, Vec3), (c, d): (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.min(c), b.max(d))
}

/// The root of a guide, as long as it was before it was cut.
pub(super) fn guide_root(strand: &Strand, cut: Option<&CutStrand>) -> GuideRoot {
    let [root, .., tip] = strand.positions() else { return GuideRoot::default() };
    let cut = cut.filter(|cut| cut.fits(strand.nodes()));
    GuideRoot {
        place: *root,
        normal: strand.root_frame() * Vec3::Z,
        length: cut.map_or_else(|| strand.length(), CutStrand::whole_length),
        reach: cut.map_or(*tip - *root, |cut| cut.reach),
    }
}

impl Packed {
    /// The roots of guides that the roots of followers refer to.
    pub(super) fn known_roots(&self, followers: Option<&FollowerRoots>) -> Option<&[GuideRoot]> {
        (followers.is_some() && !self.roots.is_empty()).then_some(&self.roots)
    }

    /// The roots of guides by which followers are laid out.
    #[cfg(feature = "groom")]
    pub(super) fn laid_out(&self) -> Option<&[GuideRoot]> {
        (!self.roots.is_empty()).then_some(&self.roots)
    }

    /// Straight segments of each drawn strand.
    pub(super) fn segments(&self) -> u32 {
        self.followers.map_or(1, |followers| followers.segments)
    }

    /// Updates the list of guides; returns whether it has changed.
    fn update_layout(
        &mut self,
        members: impl Iterator<Item = Entity>,
        strands: &Query<GuideParts>,
    ) -> bool {
        let mut count = 0;
        let mut changed = false;
        for guide in members {
            let Ok((strand, .., cut)) = strands.get(guide) else {
                continue;
            };
            let cut = cut.filter(|cut| cut.fits(strand.nodes()));
            if strand.nodes() < 2 {
                continue;
            }
            let nodes = strand.nodes() as u32;
            let end = cut.map_or_else(|| GuideEnd::whole(nodes), GuideEnd::from);
            match self.layout.get_mut(count) {
                // Its root stays when it is cut.
                Some(known) if known.strand == guide => {
                    changed |= (known.nodes, known.end) != (nodes, end);
                    (known.nodes, known.end) = (nodes, end);
                }
                _ => {
                    let entry = PackedGuide { strand: guide, nodes, end, root: Vec3::ZERO };
                    self.layout.truncate(count);
                    self.layout.push(entry);
                    self.roots.clear();
                    changed = true;
                }
            }
            count += 1;
        }
        if count != self.layout.len() {
            self.layout.truncate(count);
            self.roots.clear();
            changed = true;
        }
        changed | core::mem::take(&mut self.roots_moved)
    }

    /// Updates the settings of followers; returns whether the drawn strands depend on the change.
    fn update_followers(&mut self, followers: &HairFollowers) -> bool {
        // Settings that the shader reads from the uniform do not change the strands.
        let grown = |f: &HairFollowers| HairFollowers {
            clump: 0.0,
            parting: 0.0,
            locks: Vec3::ZERO,
            lock_shape: 0.0,
            frizz: 0.0,
            ..*f
        };
        let changed = self.followers.as_ref().map(grown) != Some(grown(followers));
        self.followers = Some(*followers);
        changed
    }

    /// Packs the nodes of all guides; `known` if those of the previous frame are present. Returns the box
    /// around them.
    fn pack_nodes(
        &mut self,
        strands: &Query<GuideParts>,
        overstep: f32,
        known: bool,
        free: &mut Vec<GuideBlock<'static>>,
    ) -> Option<(Vec3, Vec3)> {
        let count = self.layout.iter().map(|guide| guide.nodes as usize).sum();
        self.nodes.resize(count, default());
        let mut rest = &mut self.nodes[..];
        let mut blocks: Vec<GuideBlock> = emptied(core::mem::take(free));
        blocks.extend(self.layout.chunks(GuideBlock::GUIDES).map(|guides| {
            let count = guides.iter().map(|guide| guide.nodes as usize).sum();
            let nodes = rest.split_off_mut(..count).unwrap_or_default();
            GuideBlock { guides, nodes, bounds: None, still: true, displaced: false }
        }));
        let each = Nanos(GuideBlock::NODE * count / blocks.len().max(1));
        let (level, far) = (simd_level(), 0.25 * self.spacing);
        for_each(&mut blocks, each, |block| {
            dispatch!(level, _ => block.pack(strands, overstep, known, far));
        });
        let still = blocks.iter().all(|block| block.still);
        let displaced = blocks.iter().any(|block| block.displaced);
        let bounds = blocks.iter().filter_map(|block| block.bounds).reduce(around_both);
        *free = emptied(blocks);
        // Followers move with their roots; neighbours are chosen again once roots rest.
        self.roots_moved = known && still && displaced;
        bounds
    }

    /// Chooses the drawn strands.
    fn scatter(
        &mut self,
        strands: &Query<GuideParts>,
        follower_roots: Option<&FollowerRoots>,
        cuts: Option<&FollowerCuts>,
        followers: &HairFollowers,
    ) -> Vec<DrawnStrand> {
        if self.known_roots(follower_roots).is_none() {
            self.roots.clear();
            self.roots.extend(self.layout.iter().map(|guide| {
                let guide = strands.get(guide.strand);
                guide.map_or_else(|_| default(), |(strand, .., cut)| guide_root(strand, cut))
            }));
        }
        let roots = core::mem::take(&mut self.roots);
        self.record_roots();
        let mut drawn = scatter(&roots, follower_roots, followers);
        let ends: Vec<GuideEnd> = self.layout.iter().map(|guide| guide.end).collect();
        shorten(&mut drawn, &ends, cuts);
        let reach = |strand: &DrawnStrand| {
            let own = roots[strand.guides[0] as usize].place;
            let apart = |k: usize| roots[strand.guides[k] as usize].place.distance(own);
            let larger = (strand.length - 1.0).max(0.0)
                * strand.guides.iter().map(|g| roots[*g as usize].length).fold(0.0, f32::max);
            let locks = strand.locks.iter().map(|lock| lock.root.length()).fold(0.0, f32::max);
            let reach = apart(1).max(apart(2))
                + strand.root.length()
                + strand.stray.length()
                + larger
                + locks;
            if reach.is_finite() { reach } else { 0.0 }
        };
        self.places.clear();
        self.places.extend(drawn.iter().map(|strand| strand.place(&roots)));
        self.margin = drawn.iter().map(reach).fold(0.005 + followers.frizz, f32::max);
        self.roots = roots;
        self.thickness = self.thickness_of(&drawn, followers);
        drawn
    }

    fn thickness_of(&self, drawn: &[DrawnStrand], followers: &HairFollowers) -> Thickness {
        let nodes: Vec<Vec3> = self.nodes.iter().map(packed_place).collect();
        let mut rest = &nodes[..];
        let guides = self.layout.iter().map(|guide| {
            let (nodes, others) = rest.split_at(guide.nodes as usize);
            rest = others;
            Guide { end: Some(guide.end), ..Guide::new(nodes) }
        });
        let guides: Vec<Guide> = guides.collect();
        Thickness::of(drawn, |k| guides[k as usize], followers)
    }

    /// Records the present roots, now that followers are laid out.
    fn record_roots(&mut self) {
        let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
        let mut first = 0;
        for guide in &mut self.layout {
            guide.root = packed_place(&self.nodes[first]);
            first += guide.nodes as usize;
            (low, high) = (low.min(guide.root), high.max(guide.root));
        }
        // Approximate spacing of guides that cover the box. A single guide, or all in one place, has
        // no neighbours to choose.
        let spacing = (high - low).length() / (self.layout.len() as f32).sqrt();
        self.spacing = if spacing > 1e-6 { spacing } else { f32::MAX };
    }

    fn ribbon(
        &self,
        look: (&HairLook, &HairDye),
        followers: &HairFollowers,
        view: HairView,
        (guides, strands): (u32, u32),
    ) -> Ribbon {
        Ribbon::new(look, followers, view, self.thickness, guides, strands, self.rings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::{
        ecs::system::RunSystemOnce,
        tasks::{ComputeTaskPool, TaskPoolBuilder},
    };

    /// Strands of 16 nodes in a world, every seventh shorter and every eleventh without bonds.
    fn world(strands: usize) -> (World, Packed) {
        ComputeTaskPool::get_or_init(|| TaskPoolBuilder::new().num_threads(1).build());
        let (mut world, mut packed) = (World::new(), Packed::default());
        for i in 0..strands {
            let nodes = if i % 7 == 0 { 9 } else { 16 };
            let root = Vec3::new((i % 100) as f32, 0.0, (i / 100) as f32) * 2e-3;
            let points: Vec<Vec3> =
                (0..nodes).map(|k| root + Vec3::new(0.12, -1.0, 0.0) * (0.02 * k as f32)).collect();
            let strand = Strand::from_polyline(&points).unwrap();
            let history = StrandHistory {
                positions: points.iter().map(|p| *p + Vec3::Z * 1e-3).collect(),
                ..default()
            };
            let bonds = if i % 11 == 0 { Bonds::default() } else { Bonds::of(&strand) };
            let strand = world.spawn((strand, history, bonds)).id();
            packed.layout.push(PackedGuide { strand, nodes, end: GuideEnd::whole(nodes), root });
        }
        (world, packed)
    }

    fn pack_all(world: &mut World, mut packed: Packed) -> (Packed, Option<(Vec3, Vec3)>) {
        let pack = move |strands: Query<GuideParts>| {
            let around = packed.pack_nodes(&strands, 0.5, false, &mut Vec::new());
            (core::mem::take(&mut packed), around)
        };
        world.run_system_once(pack).unwrap()
    }

    #[test]
    fn guides_are_packed_alike_alone_and_by_many_threads() {
        let (mut world, packed) = world(5000);
        let (packed, around) = pack_all(&mut world, packed);
        let (mut first, mut all) = (0, None);
        for guide in &packed.layout {
            let alone = Packed { layout: vec![*guide], ..default() };
            let (alone, own) = pack_all(&mut world, alone);
            assert_eq!(packed.nodes[first..][..guide.nodes as usize], alone.nodes);
            first += alone.nodes.len();
            all = all.into_iter().chain(own).reduce(around_both);
        }
        assert_eq!((first, around), (packed.nodes.len(), all));
    }

    #[test]
    #[ignore = "a timing, to be read"]
    fn what_packing_costs() {
        let (mut world, mut packed) = world(10_000);
        let pack = move |strands: Query<GuideParts>| {
            let mut free = Vec::new();
            let members: Vec<Entity> = packed.layout.iter().map(|guide| guide.strand).collect();
            let mut least = [std::time::Duration::MAX; 2];
            for _ in 0..200 {
                let start = std::time::Instant::now();
                packed.update_layout(members.iter().copied(), &strands);
                least[0] = least[0].min(start.elapsed());
                packed.pack_nodes(&strands, 0.5, true, &mut free);
                least[1] = least[1].min(start.elapsed());
            }
            println!("10,000 guides of 16 nodes: {:?}, of which the list {:?}", least[1], least[0]);
        };
        world.run_system_once(pack).unwrap();
    }
}
